"""The error of a gradient, factor by factor: each partial derivative, each linear solve, each product.

    dJ/dp = J_p + R_p^T lam,    R_u^T lam = -J_u,    R(u, p) = 0

Derivatives are tested by complex steps where R and J take complex numbers and keep their imaginary parts, else by
central differences.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.bench.verification.finding import Finding
from gradient_routes.problems.problem import Array, Linearization, Offers, Problem
from gradient_routes.routes.finite_difference import CENTRAL
from gradient_routes.routes.imaginary import RELATIVE_STEP, losses
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import norm
from gradient_routes.routes.route import Result

STEPS = (0.01, 1.0, 100.0)  # times the usual one
EXACT = 1e-9  # relative error of derivatives by complex steps: rounding, summed over many elements
DIFFERENCED = 1e-6  # the same by central differences
TINY = 1e-6  # of |J_u| |u|: |J_p v| below which it is compared with that
SOLVED = 1e-7  # relative residual of solves to 1e-12, with their condition
CONVERGED = 1e-9  # forward residual
ASKED = 10.0  # times the tolerance of a solve: it is measured in another norm
ALIKE = 1e-6  # relative scatter of ratios that are one number
SIGN = "the sign of lam"


def along(f: Callable[[Array], Array], x: Array, v: Array, exact: bool, times: float = 1.0) -> Array:
    """df/dx v by a complex step, or by a central difference whose step is `times` the usual one."""
    size = (norm(x) or 1.0) / (norm(v) or 1.0)
    if exact:
        h = RELATIVE_STEP * size
        return np.asarray(np.imag(f(x + 1j * h * v)) / h)
    h = times * CENTRAL * size
    return np.asarray((f(x + h * v) - f(x - h * v)) / (2.0 * h))


def relative(a: Array, b: Array, least: float = 0.0) -> float:
    """|a - b| / max(|b|, least), absolute where both are zero."""
    return float(np.linalg.norm(a - b) / (max(float(np.linalg.norm(b)), least) or 1.0))


@dataclass(frozen=True)
class Function:
    """R or J of (u, p); exact: differentiated by complex steps."""

    f: Callable[[Array, Array], Array]
    exact: bool

    @property
    def limit(self) -> float:
        return EXACT if self.exact else DIFFERENCED

    def __call__(self, u: Array, p: Array) -> Array:
        dtype = np.result_type(u, p)
        return self.f(u.astype(dtype), p.astype(dtype))

    def off(self, given: Array, f: Callable[[Array], Array], x: Array, v: Array, least: float = 0.0) -> float:
        """|given - df/dx v| relative to it, or to `least`; the least of three steps where differences are central: no
        one step suits all.
        """
        steps = (1.0,) if self.exact else STEPS
        return min(relative(given, along(f, x, v, self.exact, times), least) for times in steps)


class Factors:
    """R_u, R_p, J_u, J_p at a state u and parameters p, tested against R and J."""

    def __init__(self, problem: Problem, u: Array, p: Array, seed: int = 0) -> None:
        self.problem, self.u, self.p = problem, u, p
        lost, taken = losses(problem, u, p), Offers.COMPLEX in problem.offers
        self.R = Function(problem.residual, taken and "residual" not in lost)
        self.J = Function(problem.objective, taken and "objective" not in lost)
        self.lin: Linearization = problem.linearize(u, p)
        rng = np.random.default_rng(seed)
        natural = problem.parameters.natural(p)
        self.v = rng.choice([-1.0, 1.0], len(p)) * rng.uniform(0.5, 1.5, len(p)) * natural
        self.du, self.lam = rng.standard_normal((2, len(u)))
        self.du *= norm(u) or 1.0

    def findings(self) -> Iterator[Finding]:
        """The derivatives that the problem gives, against R and J; the transposes, against what they transpose."""
        R, J, lin, R_u = self.R, self.J, self.lin, self.problem.tangent(self.u, self.p)
        v, du, lam = self.v, self.du, self.lam
        off = self._by_p(R, lin.R_p @ v, v)
        yield _derivative("dR/dp", off, R, "R", "" if off <= R.limit else f", {self._column()}")
        yield _derivative("R_u", self._by_u(R, R_u @ du, du), R, "R")
        yield _derivative("J_u", self._by_u(J, np.asarray(lin.J_u @ du), du), J, "J")
        least = TINY * norm(lin.J_u) * norm(self.u)  # at the start that a datum tells, J_p may be rounding
        yield _derivative("J_p", self._by_p(J, np.asarray(lin.J_p @ v), v, least), J, "J")
        yield _identity("<lam, R_p v> = <R_p^T lam, v>", lam * (lin.R_p @ v), (lin.R_p.T @ lam) * v)
        yield _identity("<lam, R_u w> = <R_u^T lam, w>", lam * (R_u @ du), (R_u.T @ lam) * du)

    def _by_p(self, f: Function, given: Array, v: Array, least: float = 0.0) -> float:
        """|given - df/dp v| relative."""
        return f.off(given, lambda p: f(self.u, p), self.p, v, least)

    def _by_u(self, f: Function, given: Array, v: Array) -> float:
        """|given - df/du v| relative."""
        return f.off(given, lambda u: f(u, self.p), self.u, v)

    def _column(self) -> str:
        """The first wrong column of R_p, by bisection, and the factor it is off by."""
        members: Array = np.arange(len(self.p))
        while len(members) > 1:
            left, right = np.array_split(members, 2)
            v = np.where(np.isin(np.arange(len(self.p)), left), self.v, 0.0)
            members = right if self._by_p(self.R, self.lin.R_p @ v, v) <= self.R.limit else left
        i = int(members[0])
        e = np.zeros_like(self.p)
        e[i] = 1.0
        given, wanted = np.asarray(self.lin.R_p @ e), along(lambda p: self.R(self.u, p), self.p, e, self.R.exact)
        name = f"parameter {self.problem.parameters.label(i)}"
        share = float(given @ wanted / (wanted @ wanted or 1.0))
        if relative(given, share * wanted) <= self.R.limit:
            return f"{name}, off by the factor {share:.3g}"
        rows = np.flatnonzero(np.abs(given - wanted) > self.R.limit * norm(wanted))
        return f"{name}, {len(rows)} of {len(given)} rows, first {rows[0] + 1}" if rows.size else name


def _derivative(name: str, off: float, f: Function, of: str, where: str = "") -> Finding:
    how = "complex step" if f.exact else "central difference"
    culprit = None if off <= f.limit else name + where
    return Finding(f"{name} against {how} of {of}", off, f.limit, culprit=culprit)


def _identity(name: str, left: Array, right: Array) -> Finding:
    size = float(np.abs(left).sum() + np.abs(right).sum()) or 1.0
    off = abs(float(left.sum() - right.sum())) / size
    return Finding(name, off, EXACT, culprit=None if off <= EXACT else f"a transpose: {name}")


def assembly(model: Model, result: Result, p: Array, gradient: Array) -> Iterator[Finding]:
    """How a route put its gradient together: its state, its functional, its adjoint, its product."""
    problem, solver = model.problem, model.solver
    if result.u is None:
        return
    u = np.asarray(result.u)
    off = norm(problem.residual(u, p)) / (norm(problem.residual(problem.initial(p), p)) or 1.0)
    limit = max(CONVERGED, ASKED * solver.rtol)
    culprit = None if off <= limit else "the forward state, which is not solved"
    yield Finding("forward residual |R(u, p)| / |R(u_0, p)|", off, limit, culprit=culprit)
    J = float(problem.objective(u, p))
    if result.J is not None:
        off = abs(result.J - J) / (abs(J) or 1.0)
        culprit = "the functional: J of the route is not J(u, p) of the problem" if off > SOLVED else None
        yield Finding("J of the route against J(u, p)", off, SOLVED, f"{result.J:.6g} and {J:.6g}", culprit)
    if result.lam is None:
        return
    lam, lin, R_u = np.asarray(result.lam), problem.linearize(u, p), problem.tangent(u, p)
    off = relative(R_u.T @ lam, -lin.J_u)
    limit = max(SOLVED, ASKED * solver.adjoint_rtol)
    culprit, by_mesh = (None, False) if off <= limit else _adjoint(R_u, lam, lin.J_u)
    yield Finding("adjoint residual |R_u^T lam + J_u| / |J_u|", off, limit, culprit=culprit, by_mesh=by_mesh)
    product = np.asarray(lin.R_p.T @ lam)
    off = relative(gradient, lin.J_p + product)
    culprit, by_mesh = (None, False) if off <= SOLVED else _product(problem, p, gradient, lin, product)
    yield Finding("gradient against J_p + R_p^T lam", off, SOLVED, culprit=culprit, by_mesh=by_mesh)


def _adjoint(R_u: Any, lam: Array, J_u: Array) -> tuple[str, bool]:
    """The mistake in lam, and whether it may be an error of the discretization."""
    if relative(R_u @ lam, -J_u) <= SOLVED:
        return "the transpose: the solve used R_u instead of R_u^T", False
    if relative(R_u.T @ lam, J_u) <= SOLVED:
        return SIGN, False
    return "the adjoint solve: R_u^T lam = -J_u does not hold", True


def _product(problem: Problem, p: Array, g: Array, lin: Linearization, product: Array) -> tuple[str, bool]:
    """The mistake in g, which is not J_p + R_p^T lam, and whether it may be an error of the discretization."""
    right = lin.J_p + product
    if relative(g, product) <= SOLVED:
        return "a missing term: J_p was dropped", False
    if relative(g, lin.J_p - product) <= SOLVED:
        return SIGN, False
    wrong = np.flatnonzero(np.abs(g - right) > SOLVED * (float(np.linalg.norm(right)) or 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        by_scale = (g / right / np.exp(-p))[wrong]
        ratio = ((g - lin.J_p) / product)[wrong]
    if _one(by_scale) and abs(float(np.median(by_scale)) - 1.0) <= ALIKE:
        return "the chain rule of p = log(...): dJ/dp was left as dJ/dexp(p)", False
    names = ", ".join(problem.parameters.label(int(i)) for i in wrong[:3])
    what = f"dR/dp, parameter {names}" if len(wrong) <= 3 else f"dR/dp, {len(wrong)} parameters, {names} among them"
    if _one(ratio):
        return f"{what}, off by the factor {float(np.median(ratio)):.3g}", False
    return what, len(wrong) > 3


def _one(values: Array) -> bool:
    """Whether all values are one number."""
    return bool(np.isfinite(values).all()) and float(np.ptp(values)) <= ALIKE * float(np.abs(values).max())
