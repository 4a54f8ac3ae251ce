"""The error budget of a gradient, factor by factor: each partial derivative, each linear solve, each product.

    dJ/dp = J_p + R_p^T lam,    R_u^T lam = -J_u,    R(u, p) = 0

No step size enters where R and J take complex numbers; elsewhere one central difference of R stands in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from gradient_routes.bench.verification.finding import Finding
from gradient_routes.problems.problem import Array, Linearization, Offers, Problem
from gradient_routes.routes.complex_step import RELATIVE_STEP
from gradient_routes.routes.finite_difference import CENTRAL
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import norm
from gradient_routes.routes.route import Result

STEPS = (0.01, 1.0, 100.0)  # times the usual one
EXACT = 1e-9  # relative: a few roundings, times what sums over many elements make of them
DIFFERENCED = 1e-6  # central differences where there are no complex steps
SOLVED = 1e-7  # residuals relative to their right-hand side, of solves to 1e-12 and the condition they have
CONVERGED = 1e-9  # of the forward residual
ASKED = 10.0  # times the tolerance asked of a solve: in another norm, at another scale
ALIKE = 1e-6  # relative scatter of a ratio that is one number


def along(f: Callable[[Array], Array], x: Array, v: Array, exact: bool, times: float = 1.0) -> Array:
    """df/dx v by a complex step, or by a central difference whose step is `times` the usual one."""
    size = (norm(x) or 1.0) / (norm(v) or 1.0)
    if exact:
        h = RELATIVE_STEP * size
        return np.asarray(np.imag(f(x + 1j * h * v)) / h)
    h = times * CENTRAL * size
    return np.asarray((f(x + h * v) - f(x - h * v)) / (2.0 * h))


def missed(given: Array, f: Callable[[Array], Array], x: Array, v: Array, exact: bool) -> float:
    """|given - df/dx v| relative; of central differences the best of three steps, for no one step suits all."""
    return min(relative(given, along(f, x, v, exact, times)) for times in ((1.0,) if exact else STEPS))


def relative(a: Array, b: Array) -> float:
    """|a - b| / |b|, absolute where b is zero."""
    return float(np.linalg.norm(a - b) / (np.linalg.norm(b) or 1.0))


class Factors:
    """R_u, R_p, J_u, J_p at a state u for p, held against R and J themselves."""

    def __init__(self, problem: Problem, u: Array, p: Array, seed: int = 0) -> None:
        self.problem, self.u, self.p = problem, u, p
        self.exact = Offers.COMPLEX in problem.offers
        self.limit = EXACT if self.exact else DIFFERENCED
        self.lin: Linearization = problem.linearize(u, p)
        self.R_u = problem.tangent(u, p)
        rng = np.random.default_rng(seed)
        natural = problem.parameters.natural(p)
        self.v = rng.choice([-1.0, 1.0], len(p)) * rng.uniform(0.5, 1.5, len(p)) * natural
        self.du, self.lam = rng.standard_normal((2, len(u)))
        self.du *= norm(u) or 1.0

    def _by_p(self, f: Callable[[Array, Array], Array]) -> Callable[[Array], Array]:
        u = self.u.astype(complex) if self.exact else self.u
        return lambda p: f(u, p)

    def _by_u(self, f: Callable[[Array, Array], Array]) -> Callable[[Array], Array]:
        p = self.p.astype(complex) if self.exact else self.p
        return lambda u: f(u, p)

    def findings(self) -> Iterator[Finding]:
        """The derivatives a problem gives by hand, against R and J; the transposes, against what they transpose."""
        R, J = self.problem.residual, self.problem.objective
        how = "complex step" if self.exact else "central difference"
        u, p, du, v, lin = self.u, self.p, self.du, self.v, self.lin
        off = missed(lin.R_p @ v, self._by_p(R), p, v, self.exact)
        yield self._derivative("dR/dp", off, f"{how} of R", self._column)
        yield self._derivative("R_u", missed(self.R_u @ du, self._by_u(R), u, du, self.exact), f"{how} of R")
        off = missed(np.asarray(lin.J_u @ du), self._by_u(J), u, du, self.exact)
        yield self._derivative("J_u", off, f"{how} of J")
        off = missed(np.asarray(lin.J_p @ v), self._by_p(J), p, v, self.exact)
        yield self._derivative("J_p", off, f"{how} of J")
        lam = self.lam
        yield self._identity("<lam, R_p v> = <R_p^T lam, v>", lam * (self.lin.R_p @ v), (self.lin.R_p.T @ lam) * v)
        yield self._identity("<lam, R_u w> = <R_u^T lam, w>", lam * (self.R_u @ du), (self.R_u.T @ lam) * du)

    def _derivative(self, name: str, off: float, how: str, blame: Callable[[], str] | None = None) -> Finding:
        wrong = not off <= self.limit
        culprit = (name + (f", {blame()}" if blame is not None else "")) if wrong else None
        return Finding(f"{name} against {how}", off, self.limit, culprit=culprit)

    @staticmethod
    def _identity(name: str, left: Array, right: Array) -> Finding:
        size = float(np.abs(left).sum() + np.abs(right).sum()) or 1.0
        off = abs(float(left.sum() - right.sum())) / size
        return Finding(name, off, EXACT, culprit=None if off <= EXACT else f"a transpose: {name}")

    def _column(self) -> str:
        """The first wrong column of R_p, by halving, and the factor it is off by."""
        members: Array = np.arange(len(self.p))
        while len(members) > 1:
            left, right = np.array_split(members, 2)
            members = left if self._wrong(left) else right
        i = int(members[0])
        e = np.zeros_like(self.p)
        e[i] = 1.0
        wanted = along(self._by_p(self.problem.residual), self.p, e, self.exact)
        given, name = np.asarray(self.lin.R_p @ e), self.problem.parameters.label(i)
        share = float(given @ wanted / (wanted @ wanted or 1.0))
        if relative(given, share * wanted) <= self.limit:
            return f"parameter {name}, off by the factor {share:.3g}"
        rows = np.flatnonzero(np.abs(given - wanted) > self.limit * norm(wanted))
        return (
            f"parameter {name}, {len(rows)} of {len(given)} rows, first {rows[0] + 1}"
            if rows.size
            else f"parameter {name}"
        )

    def _wrong(self, members: Array) -> bool:
        v = np.zeros_like(self.v)
        v[members] = self.v[members]
        return not missed(self.lin.R_p @ v, self._by_p(self.problem.residual), self.p, v, self.exact) <= self.limit


def assembly(model: Model, result: Result, p: Array, gradient: Array) -> Iterator[Finding]:
    """How a route put its gradient together: its state, its adjoint, its functional, its product."""
    problem, solver = model.problem, model.solver
    if result.u is None:
        return
    u = np.asarray(result.u)
    R_0 = norm(problem.residual(problem.initial(p), p)) or 1.0
    residual = norm(problem.residual(u, p)) / R_0
    wanted = max(CONVERGED, ASKED * solver.rtol)
    unsolved = None if residual <= wanted else "the forward state, which is not solved"
    yield Finding("forward residual |R(u, p)| / |R(u_0, p)|", residual, wanted, culprit=unsolved)
    J = float(problem.objective(u, p))
    if result.J is not None:
        off = abs(result.J - J) / (abs(J) or 1.0)
        wrong = "the functional: the route's J is not the problem's at the same u" if off > SOLVED else None
        yield Finding("J of the route against J(u, p)", off, SOLVED, f"{result.J:.6g} and {J:.6g}", wrong)
    if result.lam is None:
        return
    lam, lin, R_u = np.asarray(result.lam), problem.linearize(u, p), problem.tangent(u, p)
    off = relative(R_u.T @ lam, -lin.J_u)
    wanted = max(SOLVED, ASKED * solver.adjoint_rtol)
    culprit, by_mesh = (None, False) if off <= wanted else _adjoint(R_u, lam, lin.J_u)
    yield Finding("adjoint residual |R_u^T lam + J_u| / |J_u|", off, wanted, culprit=culprit, by_mesh=by_mesh)
    product = np.asarray(lin.R_p.T @ lam)
    off = relative(gradient, lin.J_p + product)
    culprit, by_mesh = _product(problem, p, gradient, lin, product)
    yield Finding("gradient against J_p + R_p^T lam", off, SOLVED, culprit=culprit, by_mesh=by_mesh)


def _adjoint(R_u: Any, lam: Array, J_u: Array) -> tuple[str, bool]:
    """Which mistake makes lam what it is; whether it may be one of the discretization."""
    if relative(R_u @ lam, -J_u) <= SOLVED:
        return "the transpose: R_u was solved with where R_u^T should be", False
    if relative(R_u.T @ lam, J_u) <= SOLVED:
        return "the sign of lam", False
    return "the adjoint solve: R_u^T lam = -J_u does not hold", True


def _product(
    problem: Problem, p: Array, gradient: Array, lin: Linearization, product: Array
) -> tuple[str | None, bool]:
    """Which mistake makes the gradient other than J_p + R_p^T lam; whether it may be one of the discretization."""
    right, size = lin.J_p + product, float(np.linalg.norm(lin.J_p + product)) or 1.0
    if float(np.linalg.norm(gradient - right)) <= SOLVED * size:
        return None, False
    if relative(gradient, product) <= SOLVED:
        return "a missing term: J_p was dropped", False
    if relative(gradient, lin.J_p - product) <= SOLVED:
        return "the sign of lam", False
    wrong = np.flatnonzero(np.abs(gradient - right) > SOLVED * size)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_scale = (gradient / right / np.exp(-p))[wrong]
        ratio = ((gradient - lin.J_p) / product)[wrong]
    if _one(by_scale) and abs(float(np.median(by_scale)) - 1.0) <= ALIKE:
        return "the chain rule of p = log(...): dJ/dp was left as dJ/dexp(p)", False
    names = ", ".join(problem.parameters.label(int(i)) for i in wrong[:3])
    what = f"dR/dp, parameter {names}" if len(wrong) <= 3 else f"dR/dp, {len(wrong)} parameters, {names} among them"
    if _one(ratio):
        return f"{what}, off by the factor {float(np.median(ratio)):.3g}", False
    return what, len(wrong) > 3


def _one(values: Array) -> bool:
    """Whether these are one number."""
    return bool(np.isfinite(values).all()) and float(np.ptp(values)) <= ALIKE * float(np.abs(values).max())
