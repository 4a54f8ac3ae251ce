"""Model = problem + solver + tally: what a route works with. Its methods do the expensive operations and count them."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.errors import NotConverged, SingularMatrix
from gradient_routes.problems.problem import Array, Linearization, Offers, Parameters, Problem, Traced
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.load_stepping import by_load_steps
from gradient_routes.routes.newton import Newton, Solver, State, System, newton, norm, rounding, unwatched
from gradient_routes.routes.newton_steps import (
    Auto,
    Chord,
    Direction,
    Full,
    Inexact,
    Operations,
    Recorded,
    Step,
    Truncated,
)
from gradient_routes.routes.precision import double, double_operator
from gradient_routes.routes.solvers.factorization import Deferred, Factorizer
from gradient_routes.routes.solvers.solver import Factorization
from gradient_routes.routes.tally import Tally, Work

if TYPE_CHECKING:
    from gradient_routes.routes.compiled import Compiled


class Model:
    """A problem that can be solved, with its work counted in `tally`, its own or the one given.

    Its arrays are float64 or complex128: what a problem gives as integers is converted. Raises LowPrecision for others.
    """

    def __init__(self, problem: Problem, solver: Solver | None = None, tally: Tally | None = None) -> None:
        self.problem = problem
        self.solver = solver or Solver()
        self.tally = tally or Tally()
        self._factorize = Factorizer(self.solver.linear_solver, self.solver.rtol)

    @property
    def parameters(self) -> Parameters:
        return self.problem.parameters

    @cached_property
    def compiled(self) -> Compiled:
        """R and J in jax.numpy."""
        from gradient_routes.routes.compiled import compiled

        p = self.parameters.start
        found, dtypes = compiled(self.problem.traced(), self.initial(p), p)
        for name, dtype in zip(("traced R", "traced J"), dtypes, strict=True):
            double(np.empty(0, dtype), name, self._who)
        return found

    @property
    def traced(self) -> Traced:
        """R and J in jax.numpy."""
        return self.compiled.traced

    def initial(self, p: Array) -> Array:
        return double(self.problem.initial(p), "u_0", self._who)

    def objective(self, u: Array, p: Array) -> Any:
        return double(self.problem.objective(u, p), "J", self._who)[()]

    def residual(self, u: Array, p: Array) -> Array:
        self.tally.count("residuals")
        return double(self.problem.residual(u, p), "R", self._who)

    def tangent(self, u: Array, p: Array) -> Any:
        self.tally.count("assemblies")
        return double_operator(self.problem.tangent(u, p), "R_u", self._who)

    def factorize(self, A: Any) -> Factorization:
        self.tally.count("factorizations")
        return self._factorize(A, self._who)

    def matvec(self, A: Any, v: Array) -> Array:
        self.tally.count("matvecs")
        return double(A @ v, "R_u v", self._who)

    def solve_linear(self, factors: Factorization, b: Array) -> Array:
        """R_u^{-1} b."""
        self.tally.count("solves")
        return factors.solve(b)

    def solve_transposed(self, factors: Factorization, b: Array) -> Array:
        """R_u^{-T} b."""
        self.tally.count("transposed_solves")
        return factors.solve_transposed(b)

    def factors_at(self, state: State) -> Factorization:
        """Factors of R_u at the solved state itself.

        The last Newton factors are those of R_u at the iterate before: a linearized solve with them has an error of
        the size of the last step (1e-8 and more). R_u of a linear problem does not depend on u.
        """
        return state.factors if self.problem.linear else self.factorize(self.tangent(state.u, state.p))

    def negative_eigenvalues(self, state: State) -> int | None:
        """How many eigenvalues of a symmetric R_u are negative at a solved state, 0 where it is stable; None: unknown.

        From the factors of the last Newton step, which is small; after inexact steps, which keep factors of an earlier
        iterate, from new ones.
        """
        factors = state.factors if state.rate is None else self.factors_at(state)
        return factors.negative_eigenvalues

    def state_at(self, u: Array, p: Array) -> State:
        """A state (n_u,) that was solved for before, with new factors of R_u; its history is its own residual."""
        factors, R = self.factorize(self.tangent(u, p)), norm(self.residual(u, p))
        return State(p, u, self.problem.objective(u, p), (R,), 0.0, factors, Work())

    def noise(self, state: State) -> float:
        """|dJ| by one more full Newton step from a solved state: about the error that the tolerance leaves in J."""
        du = self.solve_linear(self.factors_at(state), self.residual(state.u, state.p))
        return float(abs(self.objective(state.u - du, state.p) - state.J))

    def tangent_operator(self, state: State) -> Any:
        """R_u at a solved state for products only: matrix-free where the problem can, else assembled."""
        if self.problem.matrix_free:
            return double_operator(self.problem.tangent_operator(state.u, state.p), "R_u", self._who)
        return self.tangent(state.u, state.p)

    def linearize(self, state: State) -> Linearization:
        """R_p, J_u, J_p at a solved state. Not counted: they cost about as much as a residual."""
        lin, who = self.problem.linearize(state.u, state.p), self._who
        R_p = double_operator(lin.R_p, "R_p", who)
        return Linearization(R_p, double(lin.J_u, "J_u", who), double(lin.J_p, "J_p", who))

    def solve(
        self, p: Array, start: State | None = None, factors: Factorization | None = None, polish: int = 0
    ) -> State:
        """Solve R(u, p) = 0: cold, warm from the state `start`, by chord steps if `factors` are given.

        A cold solve that fails is repeated by load steps where the problem has `load_steps`. `polish` Newton steps
        are taken after convergence, on nonlinear problems. p may be complex where the problem offers COMPLEX.
        Raises NotConverged, SingularMatrix.
        """
        polish = 0 if self.problem.linear else max(polish, self.solver.polish)
        before = self.tally.work
        self.tally.count("forward_solves")
        self.tally.count("steps", self.problem.steps)
        if isinstance(self.problem, Transient) and not self.problem.linear:
            return self._marched(self.problem, p, polish, before)
        u = self.initial(p) if start is None else start.u.astype(p.dtype)
        scale = None if start is None else start.scale
        try:
            steps = self._direction(p, start, factors)
            u, history, scale = self._newton(u, p, scale, steps, polish=polish)
        except (NotConverged, SingularMatrix):
            if start is not None or not self.problem.load_steps:
                raise
            load = -self.residual(u, p)
            steps = self._direction(p)
            u = by_load_steps(lambda t, u: self._newton(u, p, norm(load), steps, (1.0 - t) * load)[0], u, self._who)
            u, history, scale = self._newton(u, p, norm(load), steps, polish=polish)
        assert steps.factors is not None  # at least one step was taken
        J = self.objective(u, p)
        return State(p, u, J, history, scale, steps.factors, self.tally.work - before, steps.rate)

    def _marched(self, problem: Transient, p: Array, polish: int, before: Work) -> State:
        """The state after every step, each solved for by full Newton steps to the tolerance of the whole."""
        u, states, left, scale = problem.initial_state(p), [], 0.0, self.march_scale(p)
        for t in range(1, problem.steps + 1):
            u, missed = self.march_step(t, u, p, scale, polish)
            states.append(u)
            left = max(left, missed)
        U = np.concatenate(states)
        factors = Deferred(problem.tangent(U, p).norm, lambda: self.factorize(self.tangent(U, p)))
        return State(p, U, self.objective(U, p), (left,), scale, factors, self.tally.work - before)

    def march_scale(self, p: Array, together: int | None = None) -> float:
        """|R|_inf of a march that stays at u_0, to which tolerances of its steps are relative: one residual, of
        `together` steps at once [those of the problem].
        """
        assert isinstance(self.problem, Transient)
        self.tally.count("residuals")
        rest, steps, k = self.problem.initial_state(p), self.problem.steps, together or self.problem.together
        states = np.tile(rest, (min(k, steps) + 1, 1))
        return max(norm(self.problem.rows(t, states[: steps - t + 1], p)) for t in range(0, steps, k))

    def march_step(self, t: int, v: Array, p: Array, scale: float, polish: int = 0) -> tuple[Array, float]:
        """u_t from v = u_{t-1} by full Newton steps, and |R_t|_inf. Raises NotConverged that names the step."""
        step, q = self._step(t), np.concatenate([v, p])
        u, history, _ = step._newton(step.initial(q), q, scale, step._direction(q), polish=polish)
        return u, history[-1]

    def _step(self, t: int) -> Model:
        """Step t in time, with this model's tally and its factorizer, which keeps analyses of patterns."""
        assert isinstance(self.problem, Transient)
        step = copy(self)
        step.problem, step.solver = self.problem.at(t), replace(self.solver, newton="full")
        return step

    def march_iterates(self, t: int, v: Array, p: Array, scale: float, k: int) -> tuple[list[Step], float]:
        """The first k full Newton steps to u_t from v = u_{t-1}, see `newton_iterates`, and |R_t|_inf after them."""
        step, q = self._step(t), np.concatenate([v, p])
        steps, history = step._iterates(q, step.initial(q), scale, k)
        return steps, history[-1]

    def newton_iterates(self, p: Array, k: int) -> tuple[list[Step], float]:
        """The first k full Newton steps of a cold solve, with its line search, and |R|_inf / |R_0|_inf after them.

        They go on where the solve would end. Raises NotConverged where there are no k steps, as where a solve takes
        load steps.
        """
        self.tally.count("forward_solves")
        self.tally.count("steps", self.problem.steps)
        steps, history = self._iterates(p, self.initial(p), None, k)
        return steps, history[-1] / (history[0] or 1.0)

    def _iterates(self, p: Array, u: Array, scale: float | None, k: int) -> tuple[list[Step], tuple[float, ...]]:
        steps = Recorded(self._operations(p))
        try:
            _, history, _ = self._newton(u, p, scale, steps, polish=k, at_most=k, taken=steps.taken)
        except NotConverged as end:
            if len(steps.steps) < k:
                raise
            history = end.history
        return steps.steps, history

    @property
    def newton(self) -> Newton:
        """The steps by which real states are solved for."""
        problem = self.problem
        return "full" if problem.linear or problem.steps or not problem.line_search else self.solver.newton

    def _operations(self, p: Array) -> Operations:
        problem = self.problem
        return Operations(
            assemble=lambda u: self.tangent(u, p),
            factorize=self.factorize,
            operator=(lambda u: problem.tangent_operator(u, p)) if problem.matrix_free else None,
            substitute=self.solve_linear,
            product=self.matvec,
            step=lambda: self.tally.count("newton_iterations"),
            symmetric=problem.structure != "general",
        )

    def _direction(self, p: Array, start: State | None = None, factors: Factorization | None = None) -> Direction:
        operations = self._operations(p)
        if factors is not None:
            return Chord(operations, factors)
        if np.iscomplexobj(p) or self.newton == "full" or (self.newton == "auto" and start is not None):
            return Full(operations)
        if self.solver.linear.iterates:
            return Truncated(operations)
        if self.newton == "auto":
            return Auto(operations, self.solver.adjoint_rtol)
        return Inexact(operations, None if start is None else start.factors)

    @property
    def _who(self) -> str:
        return self.problem.name

    def _newton(
        self,
        u: Array,
        p: Array,
        scale: float | None,
        direction: Direction,
        unloading: Any = 0.0,
        polish: int = 0,
        at_most: int | None = None,
        taken: Callable[[float, Array], None] = unwatched,
    ) -> tuple[Array, tuple[float, ...], float]:
        """Newton's method on R + unloading, from u, `at_most` steps [max_steps]."""
        problem = self.problem
        system = System(
            problem.offset,
            lambda u: self.residual(u, p) + unloading,
            direction,
            problem.line_search,
            lambda u: problem.active_set(u, p),
            taken,
        )
        solver = self.solver if at_most is None else replace(self.solver, max_steps=at_most)
        return newton(system, u, solver, self._who, scale, polish)

    def relative_residual(self, u: Array, p: Array) -> float:
        """|R(u, p)|_inf / |R(u_0, p)|_inf of a state that another solver found: two residuals."""
        scale = norm(self.residual(self.initial(p), p))
        return norm(self.residual(u, p)) / (scale or 1.0)

    def tolerance(self, u: Array, state: State) -> float:
        """|R|_inf / |R_0|_inf at u (n_u,) that counts as solved: rtol, or what rounding leaves where that is more.

        |R_u| is that of `state`, a solved state near u.
        """
        least = rounding(u, state.factors.norm, self.problem.offset)
        return max(self.solver.rtol, least / state.scale if state.scale else least)

    def adjoint_residual(self, u: Array, lam: Array, p: Array) -> tuple[float, float]:
        """|R_u^T lam + J_u|_inf and |J_u|_inf, R_u assembled at u. Not counted."""
        problem = self.problem
        if Offers.PARTIALS in problem.offers:
            J_u = problem.linearize(u, p).J_u
        else:
            from gradient_routes.problems.jax64 import jax

            J_u = np.asarray(jax.grad(self.traced.objective)(u, p))
        return norm(problem.tangent(u, p).T @ lam + J_u), norm(J_u)

    def value(self, p: Array) -> float:
        """J(p) by one forward solve, or by the `value` of a black box."""
        if Offers.SOLVE in self.problem.offers:
            return float(self.solve(p).J)
        self.tally.count("forward_solves")
        return float(double(self.problem.value(p), "J", self._who))
