"""Projective dynamics and its adjoint, with one constant factorization for all steps, iterations and the way back.

Du et al. 2021 (DiffPD), Bouaziz et al. 2014. The local step is the rotation of every point, in R; the global step

    S dv = -R_v,    du = h/2 dv

has the constant S of `GlobalStep` in place of M + h^2/4 K(u), accelerated after Anderson. The adjoint of a step,
(M + h^2/4 K) y = b, is solved by the same factors: y <- S^{-1} (b + (S - M - h^2/4 K) y), or by conjugate gradients.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from gradient_routes.problems.errors import InputError, NotConverged
from gradient_routes.problems.matrices.step_matrix import StepMatrix
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.anderson import Anderson
from gradient_routes.routes.linearized_solve import SAFETY
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import ROUNDING, norm
from gradient_routes.routes.route import ForwardWork, Offers, Result, Work, route
from gradient_routes.routes.solvers.global_step import GlobalFactors
from gradient_routes.routes.solvers.krylov import conjugate_gradients

Inner = Annotated[Literal["cg", "plain"], "how the adjoint of a step is solved for with the constant factors"]
Tolerance = Annotated[float | None, "of every step and its adjoint, relative [those of the solver]"]
MEMORY = 5  # of Anderson acceleration
AT_MOST = 500  # global steps in a step of time, sweeps in its adjoint
TYPICAL = 9  # of both


def cost(n_p: int, forward: ForwardWork, *, inner: str, tolerance: float | None) -> Work:
    steps, known = forward.cold.steps, forward.counted
    k = TYPICAL * steps if known is None else known.newton_iterations
    m = TYPICAL * steps if known is None else known.matvecs
    return Work(
        1, k, 1 + steps + k, m, assemblies=1, factorizations=1, solves=k, transposed_solves=steps + m, steps=steps
    )


def check(*, inner: str, tolerance: float | None) -> None:
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise InputError(f"projective: tolerance={tolerance:g} - choose one between 0 and 1")


def missing(problem: Problem, *, inner: str, tolerance: float | None) -> str | None:
    if isinstance(problem, Transient) and problem.projective:
        return None
    return f"projective needs a march with the law arap, as impact-block[law=arap], {problem.name} is none"


@route("projective", needs=Offers.LINEARIZE, cost=cost, check=check, missing=missing, sound=False)
def projective(model: Model, p: Array, *, inner: Inner = "cg", tolerance: Tolerance = None) -> Result:
    """S dv = -R_v in every step and S y = b - (M + h^2/4 K - S) y on the way back, S constant."""
    return Projective(model, p, inner, tolerance).result()


class Projective:
    """A march at p and the march back."""

    def __init__(self, model: Model, p: Array, inner: str = "cg", tolerance: float | None = None) -> None:
        assert isinstance(model.problem, Transient)
        self.model, self.p, self.inner, self.problem = model, p, inner, model.problem
        self.rtol = tolerance or model.solver.rtol
        self.adjoint_rtol = tolerance or model.solver.adjoint_rtol
        model.tally.count("forward_solves")
        model.tally.count("steps", self.problem.steps)
        self.scale = model.march_scale(p)
        step = self.problem.global_step(p)
        self.factors = GlobalFactors(step, model.factorize(step.A))
        self.stiffness, self.n = step.stiffness, self.problem.n_step // 2

    def solve(self, r: Array, z: Array, kind: str) -> Array:
        """S^{-1} r at the state z."""
        self.model.tally.count(kind)
        return self.factors.solve(r, self.stiffness(z[: self.n]))

    def states(self) -> tuple[Array, float]:
        """(T, 2 n), and |R|_inf that is left. Raises NotConverged."""
        z, states, left = self.problem.initial_state(self.p), [], 0.0
        for t in range(1, self.problem.steps + 1):
            z, missed = self.step(t, z)
            states.append(z)
            left = max(left, missed)
        return np.stack(states), left

    def step(self, t: int, before: Array) -> tuple[Array, float]:
        """z_t by global steps that keep u_t - u_{t-1} = h/2 (v_t + v_{t-1}), and |R_t|_inf."""
        problem, n, history, accelerated = self.problem, self.n, list[float](), Anderson(MEMORY)
        z = start = problem.step_initial(t, before, self.p)
        for _ in range(AT_MOST):
            self.model.tally.count("residuals")
            R = problem.step_residual(t, z, before, self.p)
            history.append(norm(R))
            if history[-1] <= self.rtol * self.scale:
                return z, history[-1]
            if not np.isfinite(history[-1]):
                break
            self.model.tally.count("newton_iterations")
            v = accelerated(z[n:], -self.solve(R[n:], z, "solves"))
            z = np.concatenate([start[:n] + problem.of_velocity * (v - start[n:]), v])
        last = " ".join(f"{r:.2g}" for r in history[-8:])
        raise NotConverged(
            f"{problem.name}, step {t}: no {self.rtol:g} of |R_0| = {self.scale:.2g} in {len(history)} global steps:"
            f" |R| = {last} - take smaller steps dt, or adjoint, whose steps are Newton's",
            tuple(history),
        )

    def adjoint(self, A: StepMatrix, z: Array, b: Array, wanted: float) -> Array:
        """lam (2 n,) of A^T lam = b, u eliminated as in A, to |b - A^T lam|_inf <= wanted."""
        r, s = np.split(b, 2)
        y = self.eliminated(A.schur, z, s - (A.b / A.a) * r, wanted)
        return np.concatenate([(r - A.K.T @ y) / A.a, y])

    def eliminated(self, S: object, z: Array, b: Array, wanted: float) -> Array:
        """y (n,) of (M + h^2/4 K) y = b. Raises NotConverged."""
        wanted = max(wanted / SAFETY, ROUNDING * norm(b))

        def product(y: Array) -> Array:
            return self.model.matvec(S, y)

        def substitute(r: Array) -> Array:
            return self.solve(r, z, "transposed_solves")

        if self.inner == "cg":
            done = conjugate_gradients(product, substitute, b, wanted, at_most=AT_MOST, tried=AT_MOST)
            if done.converged:
                return done.x
            what = done.breakdown or f"a product contracts |b - A y| by {done.rate:.2g} only"
            raise NotConverged(f"{self.problem.name}: adjoint of a step by {done.products} products: {what}", ())
        y, r, k = substitute(b), b, 0
        while k < AT_MOST and np.isfinite(y).all():
            r, k = b - product(y), k + 1
            y = y + substitute(r)
            if norm(r) <= wanted:
                return y
        raise NotConverged(
            f"{self.problem.name}: adjoint of a step: |b - A y| / |b| = {norm(r) / norm(b):.2g} after {k} sweeps"
            " - take inner=cg, or smaller steps dt",
            (),
        )

    def result(self) -> Result:
        problem, p = self.problem, self.p
        states, left = self.states()
        lin, R_u = problem.linearize(states.ravel(), p), self.model.tangent(states.ravel(), p)
        lam, mu, J_u = np.empty_like(states), np.zeros_like(states[0]), lin.J_u.reshape(states.shape)
        for t in range(problem.steps)[::-1]:
            lam[t] = self.adjoint(R_u.diagonal(t), states[t], -J_u[t] - mu, self.adjoint_rtol * norm(lin.J_u))
            mu = R_u.below(t).T @ lam[t]
        J = float(self.model.objective(states.ravel(), p))
        gradient = lin.J_p + lin.R_p.T @ lam.ravel()
        return Result(J, gradient, states.ravel(), left / (self.scale or 1.0), lam.ravel())
