"""J as a sum of squares, 1/2 |r(x)|^2, r = (S u - d, rho): what Gauss-Newton methods see beside a gradient."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.bench.inversion.diagnosis import explained
from gradient_routes.bench.inversion.history import History
from gradient_routes.bench.inversion.objective import OUTSIDE, Evaluation, Objective
from gradient_routes.bench.inversion.optimizers import Ended, Limits, Watching, accept, spent, start_of
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array
from gradient_routes.routes.newton import State
from gradient_routes.routes.sensitivity import Sensitivity

WALL = 30.0  # times the residuals of the last step, where J is not defined: no region can be trusted there
LSMR = {"regularize": False, "atol": 1e-8, "btol": 1e-8}  # whole Gauss-Newton steps
TRIALS = 20  # evaluations an iteration, at most
TIGHT = 1e-15  # SciPy's own tolerances: when to stop is ours to say


class Residuals:
    """r (m + k,) and its derivative by x, from a forward solve and products with H = d(S u)/dp."""

    def __init__(self, objective: Objective) -> None:
        self.objective, self.problem = objective, objective.problem
        self._state: tuple[Array, State] | None = None
        self._last: Array | None = None

    def __call__(self, x: Array) -> Array:
        """r; where J is not defined, those of the last step times WALL."""
        try:
            p = self._p(x)
            r = np.concatenate([self._seen(self.state(x), p), self._prior(p)[0]])
        except OUTSIDE as error:
            last = self.objective.accepted
            assert last is not None
            if self._last is None:
                raise
            self.objective.tried.append(Evaluation(x, last.p, WALL * last.J, last.by_x, last.gradient, str(error)))
            return WALL * self._last
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

        p, T = self._p(x), self.objective.variables.slope(x)
        H = Sensitivity(self.objective.model, self.state(x), T)
        B = self._prior(p)[1] * T
        m = H.shape[0]
        return LinearOperator(
            (m + B.shape[0], len(x)),
            matvec=lambda v: np.concatenate([H @ np.ravel(v), B @ np.ravel(v)]),
            rmatvec=lambda w: (H.T @ np.ravel(w)[:m]) + B.T @ np.ravel(w)[m:],
            dtype=np.float64,
        )

    def dense(self, x: Array) -> Array:
        """The same as an array."""
        p, T = self._p(x), self.objective.variables.slope(x)
        return np.concatenate(
            [Sensitivity(self.objective.model, self.state(x), T).dense(), (self._prior(p)[1] * T).toarray()]
        )

    def evaluated(self, x: Array, derivative: Any) -> Evaluation:
        """J and its gradient by the chain rule, dJ/dx = (dr/dx)^T r."""
        r = self(x)
        self._last = r
        by_x = np.asarray(derivative.T @ r)
        return Evaluation(x.copy(), self._p(x), 0.5 * float(r @ r), by_x, by_x / self.objective.variables.slope(x))

    def _p(self, x: Array) -> Array:
        return self.problem.parameters.check(self.objective.variables.p(x), self.problem.name)

    def _seen(self, state: State, p: Array) -> Array:
        seen = self.problem.observation(state.u, p)
        if seen is None:
            raise InputError(f"invert: {self.problem.name} is no sum of squares - take --optimizer lbfgs")
        return seen.predicted - seen.data

    def _prior(self, p: Array) -> tuple[Array, Any]:
        """rho and drho/dp; none of either where nothing regularizes."""
        from scipy import sparse

        prior = self.problem.prior(p)
        if prior is None or prior[0].alpha == 0.0:
            return np.zeros(0), sparse.csr_array((0, len(p)))
        Phi, theta, by_p = prior
        rho, slope = Phi.residuals(theta)
        return rho, (Phi.differences(len(p)) * by_p).multiply(slope[:, None]).tocsr()


def gauss_newton(objective: Objective, history: History, limits: Limits) -> str:
    """Gauss-Newton in a trust region, each step by products with H (LSMR): SciPy's least_squares, trf."""
    return _by_least_squares(
        objective, history, limits, Residuals.derivative, method="trf", tr_solver="lsmr", tr_options=LSMR
    )


def levenberg_marquardt(objective: Objective, history: History, limits: Limits) -> str:
    """Levenberg-Marquardt on the whole of H: MINPACK's, by SciPy. Raises InputError for fewer data than parameters."""
    residuals = Residuals(objective)
    m, n = len(residuals(start_of(objective))), len(start_of(objective))
    if m < n:
        raise InputError(
            f"invert: levenberg-marquardt with {m} data for {n} parameters - regularize by alpha=, or take gauss-newton"
        )
    return _by_least_squares(objective, history, limits, Residuals.dense, method="lm")


def _by_least_squares(objective: Objective, history: History, limits: Limits, derivative: Any, **method: Any) -> str:
    from scipy.optimize import least_squares

    residuals = Residuals(objective)

    def jac(x: Array) -> Any:
        """Asked for where a step has been accepted."""
        by_x = derivative(residuals, x)
        assert objective.accepted is not None
        if not np.array_equal(x, objective.accepted.x):
            objective.tried.append(residuals.evaluated(x, by_x))
            accept(objective, history, limits, x)
            if len(history.iterates) > limits.iterations:
                raise Ended(spent(limits))
        return by_x

    most = TRIALS * limits.iterations  # steps that come back are no iterations
    tolerances: Any = {"xtol": TIGHT, "ftol": TIGHT, "gtol": TIGHT, "max_nfev": most}
    try:
        result: Any = least_squares(residuals, start_of(objective), jac=jac, **tolerances, **method)
    except Ended as end:
        return str(end)
    return spent(limits) if result.status == 0 else explained(objective)


def trust(objective: Objective, history: History, limits: Limits) -> str:
    """Newton-CG in a trust region (Steihaug 1983), SciPy's, with Gauss-Newton products and the route's gradient."""
    from scipy.optimize import minimize

    residuals = Residuals(objective)
    known: dict[bytes, Any] = {}

    def hessp(x: Array, v: Array) -> Array:
        if x.tobytes() not in known:
            known.clear()
            known[x.tobytes()] = residuals.derivative(x)
        A = known[x.tobytes()]
        return np.asarray(A.rmatvec(A.matvec(v))) / objective.J_0

    def take(x: Array) -> None:
        """SciPy tells of steps that it rejects, too: it has not moved then."""
        assert objective.accepted is not None
        if not np.array_equal(x, objective.accepted.x):
            accept(objective, history, limits, x)

    watch = Watching(take)
    more: Any = {"callback": watch, "options": {"maxiter": limits.iterations, "gtol": 0.0}}
    result: Any = minimize(objective, start_of(objective), jac=True, hessp=hessp, method="trust-ncg", **more)
    return watch.end or (spent(limits) if result.status == 1 else explained(objective))
