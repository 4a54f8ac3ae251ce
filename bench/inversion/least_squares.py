"""J as a sum of squares, 1/2 |r(x)|^2 with r = (S u - d, rho), and the Gauss-Newton methods that use it."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.bench.inversion.diagnosis import explained
from gradient_routes.bench.inversion.history import History
from gradient_routes.bench.inversion.objective import Evaluation, Objective
from gradient_routes.bench.inversion.optimizers import Limits, Stopped, accept, minimized, spent
from gradient_routes.problems.errors import OUTSIDE, InputError
from gradient_routes.problems.problem import Array
from gradient_routes.routes.newton import State
from gradient_routes.routes.sensitivity import FEW, RANK, Sensitivity

BEYOND = 30.0  # residuals where J is not defined, in those of the last step: no trust region extends there
LSMR = {"regularize": False, "atol": 1e-8, "btol": 1e-8}  # whole Gauss-Newton steps
TRIALS = 20  # evaluations an iteration, at most
TIGHT = 1e-15  # SciPy's own tolerances, which must not stop it: `accept` does


class Residuals:
    """r (m + k,) and its derivative by x, from a forward solve and products with H = d(S u)/dp."""

    def __init__(self, objective: Objective) -> None:
        self.objective, self.problem = objective, objective.problem
        self._state: tuple[Array, State] | None = None
        self._last: Array | None = None

    def __call__(self, x: Array) -> Array:
        """r; where J is not defined, the residuals of the last step times BEYOND."""
        try:
            p = self._p(x)
            r = np.concatenate([self._data(self.state(x), p), self._prior(p)[0]])
        except OUTSIDE as error:
            if self._last is None:
                raise
            last = self.objective.accepted
            self.objective.tried.append(Evaluation(x, last.p, BEYOND * last.J, last.by_x, last.gradient, str(error)))
            return BEYOND * self._last
        self._last = r if self._last is None else self._last
        return r

    def state(self, x: Array) -> State:
        """The forward solve at x, once."""
        if self._state is None or not np.array_equal(self._state[0], x):
            self._state = x.copy(), self.objective.model.solve(self._p(x))
        return self._state[1]

    def derivative(self, x: Array) -> Any:
        """dr/dx as a LinearOperator."""
        from scipy.sparse.linalg import LinearOperator

        H, B = self._blocks(x)
        m = H.shape[0]
        return LinearOperator(
            (m + B.shape[0], len(x)),
            matvec=lambda v: np.concatenate([H @ np.ravel(v), B @ np.ravel(v)]),
            rmatvec=lambda w: (H.T @ np.ravel(w)[:m]) + B.T @ np.ravel(w)[m:],
            dtype=np.float64,
        )

    def dense(self, x: Array) -> Array:
        """dr/dx as an array."""
        H, B = self._blocks(x)
        return np.concatenate([H.dense(), B.toarray()])

    def evaluated(self, x: Array, derivative: Any) -> Evaluation:
        """J and its gradient by the chain rule, dJ/dx = (dr/dx)^T r."""
        r = self._last = self(x)
        by_x = np.asarray(derivative.T @ r)
        p, u = self._p(x), self.state(x).u
        return Evaluation(x.copy(), p, 0.5 * float(r @ r), by_x, by_x / self.objective.variables.slope(x), u=u)

    def _p(self, x: Array) -> Array:
        return self.problem.parameters.check(self.objective.variables.p(x), self.problem.name)

    def _blocks(self, x: Array) -> tuple[Sensitivity, Any]:
        """d(S u)/dx and drho/dx."""
        T = self.objective.variables.slope(x)
        return Sensitivity(self.objective.model, self.state(x), T), self._prior(self._p(x))[1] * T

    def _data(self, state: State, p: Array) -> Array:
        seen = self.problem.observation(state.u, p)
        if seen is None:
            raise InputError(f"invert: {self.problem.name} is no sum of squares - use --optimizer lbfgs")
        return seen.predicted - seen.data

    def _prior(self, p: Array) -> tuple[Array, Any]:
        """rho and drho/dp; both empty without regularization."""
        from scipy import sparse

        prior = self.problem.prior(p)
        if prior is None or prior[0].alpha == 0.0:
            return np.zeros(0), sparse.csr_array((0, len(p)))
        Phi, theta, by_p = prior
        rho, slope = Phi.residuals(theta)
        return rho, (Phi.differences(len(p)) * by_p).multiply(slope[:, None]).tocsr()


def gauss_newton(objective: Objective, history: History, limits: Limits) -> str:
    """Gauss-Newton in a trust region, each step by products with H (LSMR): SciPy's least_squares, trf."""
    lsmr = {"method": "trf", "tr_solver": "lsmr", "tr_options": LSMR}
    return _by_least_squares(objective, history, limits, Residuals.derivative, lsmr)


def levenberg_marquardt(objective: Objective, history: History, limits: Limits) -> str:
    """Levenberg-Marquardt with H as an array: MINPACK's, by SciPy. Raises InputError for fewer data than parameters."""
    x = objective.accepted.x
    m, n = len(Residuals(objective)(x)), len(x)
    if m < n:
        raise InputError(
            f"invert: levenberg-marquardt with {m} data for {n} parameters - regularize by alpha=, or use gauss-newton"
        )
    return _by_least_squares(objective, history, limits, Residuals.dense, {"method": "lm"})


def seen(residuals: Residuals, x: Array) -> Array | None:
    """An orthonormal basis (n, k) of the directions of x that data or Phi see, of FEW x; None where they see all.

    Where k is 1, gradient and step are parallel, and SciPy makes a plane of them that reaches in a blind direction. A
    component that nothing depends on at all is left in: no step moves it, and it may be seen later.
    """
    if len(x) > FEW:
        return None
    A, every = residuals.dense(x), np.eye(len(x))
    depends = A.any(axis=0)
    _, s, V = np.linalg.svd(np.linalg.qr(A[:, depends], mode="r"))
    rank = np.count_nonzero(s > RANK * s.max(initial=0.0))
    if rank in (0, np.count_nonzero(depends)):
        return None
    return np.concatenate([every[:, ~depends], every[:, depends] @ V[:rank].T], axis=1)


def _by_least_squares(objective: Objective, history: History, limits: Limits, derivative: Any, method: Any) -> str:
    from scipy.optimize import least_squares

    residuals, x_0 = Residuals(objective), objective.accepted.x.copy()
    basis = seen(residuals, x_0)
    y_0 = x_0 if basis is None else np.zeros(basis.shape[1])
    by, how = derivative, method
    if len(y_0) == 1 and method["method"] == "trf":  # its search in a plane of two directions ends in IndexError
        by, how = Residuals.dense, {"method": "trf", "tr_solver": "exact"}

    def x_of(y: Array) -> Array:
        return y if basis is None else x_0 + basis @ y

    def r(y: Array) -> Array:
        return residuals(x_of(y))

    def jac(y: Array) -> Any:
        """Called where a step has been accepted."""
        x = x_of(y)
        by_x = by(residuals, x)
        if not np.array_equal(x, objective.accepted.x):
            objective.tried.append(residuals.evaluated(x, by_x))
            accept(objective, history, limits, x)
            if len(history.iterates) > limits.iterations:
                raise Stopped(spent(limits))
        return by_x if basis is None else by_x @ basis

    most = TRIALS * limits.iterations  # rejected steps are not iterations
    gtol = TIGHT if method["method"] == "lm" else None  # a cosine there, else a slope in the units of J
    tolerances: Any = {"xtol": TIGHT, "ftol": TIGHT, "gtol": gtol, "max_nfev": most}
    result: Any = least_squares(r, y_0, jac=jac, **tolerances, **how)
    if result.status == 0:
        return spent(limits)
    now = None if basis is None else seen(residuals, objective.accepted.x)
    if basis is not None and (now is None or now.shape[1] > basis.shape[1]):  # as from a start that is far off
        return _by_least_squares(objective, history, limits, derivative, method)
    return explained(objective)


def trust(objective: Objective, history: History, limits: Limits) -> str:
    """Newton-CG in a trust region (Steihaug 1983), SciPy's, with Gauss-Newton products and the route's gradient."""
    residuals = Residuals(objective)
    known: dict[bytes, Any] = {}

    def hessp(x: Array, v: Array) -> Array:
        if x.tobytes() not in known:
            known.clear()
            known[x.tobytes()] = residuals.derivative(x)
        A = known[x.tobytes()]
        return np.asarray(A.rmatvec(A.matvec(v))) / objective.J_0

    return minimized(objective, history, limits, {}, method="trust-ncg", hessp=hessp)
