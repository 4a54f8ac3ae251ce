"""Problems M u' + K u = f in time: conduction, and transport by a flow."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np

from gradient_routes.problems.data.histories import Histories
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.units import quantity
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.matrices.sparse import BlockDiagonal, SymmetricPattern
from gradient_routes.problems.problem import Array, Linearization, Offers
from gradient_routes.problems.transient import Transient

SchemeName = Literal["backward-euler", "crank-nicolson"]
OF_NEW: dict[SchemeName, float] = {"backward-euler": 1.0, "crank-nicolson": 0.5}  # weight of u_t in the balance
STEPS_MAX, STATE_MAX = 10**6, 10**8


def check_march(who: str, steps: int, dt: float | str | None, cells: int) -> float | None:
    """dt in s, None where it is not given. Raises InputError, also for a march of too many cells."""
    if not 1 <= steps <= STEPS_MAX:
        raise InputError(f"{who}: steps={steps} - choose 1 <= steps <= {STEPS_MAX}")
    if steps * cells > STATE_MAX:
        raise InputError(f"{who}: {steps} steps of {cells} cells - choose at most {STATE_MAX:g} in all")
    h = None if dt is None else quantity(dt, "time", f"{who}: dt={dt}")
    if h is not None and not 1e-30 <= h <= 1e30:
        raise InputError(f"{who}: dt={dt} - choose dt > 0, from 1e-30 to 1e30 s")
    return h


@dataclass(frozen=True, eq=False)
class Probe:
    """What m sensors read: sum_a N_a u_a of the nodes about them, u being `given` where dofs (m, k) are -1.

    N (m, k), x (m, d) [m]
    """

    dofs: Array
    N: Array
    x: Array
    given: float = 0.0

    def read(self, u: Any, xp: Any = np) -> Any:
        """(m,)."""
        return (self.N * xp.append(u, self.given)[self.dofs]).sum(axis=1)

    def matrix(self, n: int) -> Any:
        """The derivative, sparse (m, n)."""
        from scipy.sparse import csr_array

        i, a = np.nonzero(self.dofs >= 0)
        return csr_array((self.N[i, a], (i, self.dofs[i, a])), shape=(len(self.N), n))


class FirstOrder(Transient):
    """M(p) u' + R(u, p) = 0 in steps of h, R affine in u, read by sensors in time:

        R_t = M (u_t - u_{t-1})/h + R(a u_t + (1 - a) u_{t-1}, p),    J = 1/2 c sum_k (y_k - d_k)^2 + alpha Phi

    a = 1: backward Euler, of order 1; a = 1/2: Crank & Nicolson 1947, of order 2. Data between two steps are compared
    with both: the state is then (u_t, y_{t-1}), with what the sensors read before the step as unknowns of their own.
    The methods from `stored` to `field_at_start` are a problem's own.
    """

    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    linear = constant = True
    c: float = 1.0
    row: float = 1.0  # of what is read before a step, so that all of R has one unit
    h: float
    a: float
    n_field: int
    probe: Probe
    histories: Histories | None = None
    noise: float = 0.0
    seed: int = 0

    def set_march(self, n_field: int, steps: int, h: float, scheme: SchemeName, probe: Probe, between: bool) -> None:
        self.n_field, self.steps, self.h, self.a, self.probe = n_field, steps, h, OF_NEW[scheme], probe
        self.held = len(probe.N) if between else 0
        self.n_state = steps * (n_field + self.held)
        self._kept: tuple[Array, tuple[Any, Any]] | None = None

    # --- what a problem gives

    def stored(self, rate: Any, p: Any, xp: Any = np) -> Any:
        """M(p) times a rate of u, (n_field,)."""
        raise NotImplementedError

    def balance(self, u: Any, p: Any, xp: Any = np) -> Any:
        """R(u, p), (n_field,)."""
        raise NotImplementedError

    def matrix(self, p: Array, of_rate: float, of_state: float) -> Any:
        """of_rate M + of_state R_u, of p's dtype."""
        raise NotImplementedError

    def by_p(self, rate: Array, u: Array, p: Array) -> ByProducts:
        """The derivative of both terms by p, (n_field, n_p)."""
        raise NotImplementedError

    def field_at_start(self, p: Any, xp: Any = np) -> Any:
        """u_0 (n_field,), of p's dtype."""
        return xp.zeros(self.n_field, dtype=p.dtype)

    # --- a step

    def initial_state(self, p: Any, xp: Any = np) -> Any:
        return xp.concatenate([self.field_at_start(p, xp), xp.zeros(self.held)])

    def _means(self, z: Any, before: Any) -> tuple[Any, Any]:
        """The rate of u and the u that R is of."""
        u, v = z[: self.n_field], before[: self.n_field]
        return (u - v) / self.h, self.a * u + (1.0 - self.a) * v

    def step_residual(self, t: Any, u: Any, v: Any, p: Any, xp: Any = np) -> Any:
        rate, mean = self._means(u, v)
        R = self.stored(rate, p, xp) + self.balance(mean, p, xp)
        if not self.held:
            return R
        return xp.concatenate([R, self.row * (u[self.n_field :] - self.probe.read(v[: self.n_field], xp))])

    def matrices(self, p: Array) -> tuple[Any, Any]:
        """R_u and R_v of every step."""
        if self._kept is None or not np.array_equal(self._kept[0], p):
            new = self.matrix(p, 1.0 / self.h, self.a)
            old = self.matrix(p, -1.0 / self.h, 1.0 - self.a)
            if self.held:
                from scipy.sparse import block_array, csr_array

                m, dofs = self.held, np.arange(self.held)[:, None]
                one = SymmetricPattern.of_elements(dofs, m).assemble(np.full((m, 1), self.row, p.dtype))
                new = BlockDiagonal((new, one))
                old = block_array([[old.full(), None], [-self.row * self._S, csr_array((m, m))]], format="csr")
            self._kept = p.copy(), (new, old)
        return self._kept[1]

    def step_tangent(self, t: int, u: Array, v: Array, p: Array) -> Any:
        return self.matrices(p)[0]

    def step_coupling(self, t: int, u: Array, v: Array, p: Array) -> Any:
        return self.matrices(p)[1]

    def _missed(self, t: Any, u: Any, xp: Any = np) -> Any:
        now = self.probe.read(u[: self.n_field], xp)
        return self.data.residual(t, u[self.n_field :] if self.held else now, now, xp)

    def step_objective(self, t: Any, u: Any, p: Any, xp: Any = np) -> Any:
        return 0.5 * self.c * xp.sum(self._missed(t, u, xp) ** 2)

    def step_linearize(self, t: int, u: Array, v: Array, p: Array) -> Linearization:
        before, now = self.data.pulls(t, self._missed(t, u), len(self.probe.N))
        J_u = self.c * np.concatenate([self._S.T @ now, before[: self.held]])
        R_p, n = self.by_p(*self._means(u, v), p), self.n_field
        if self.held:
            none, above = np.zeros(self.held), R_p
            R_p = ByProducts(lambda dp: np.concatenate([above @ dp, none]), lambda lam: above.T @ lam[:n])
        return Linearization(R_p, J_u, np.zeros_like(p))

    def below(self, A: Any) -> Any:
        """A (n_field, n_p), sparse, with rows of zeros for what is read before a step."""
        from scipy.sparse import csr_array, vstack

        return vstack([A, csr_array((self.held, A.shape[1]))], format="csr") if self.held else A

    # --- data

    @cached_property
    def _S(self) -> Any:
        """Of what sensors read, (m, n_field)."""
        return self.probe.matrix(self.n_field)

    @property
    def data(self) -> Histories:
        """Raises InputError where synthetic data are not made yet."""
        if self.histories is None:
            raise InputError(
                f"{self.name}: synthetic data are not made yet - solve for them:"
                f" gradient_routes.routes.synthetic_data.with_synthetic_data({self.name.replace('-', '_')})"
            )
        return self.histories

    def read(self, u: Array) -> Array:
        """What sensors read after every step, (T, m)."""
        return np.stack([self.probe.read(z[: self.n_field]) for z in u.reshape(self.steps, -1)])

    def twin(self) -> Self | None:
        return self._with_data(np.zeros((self.steps, len(self.probe.N)))) if self.histories is None else None

    def observed(self, u: Array, seed: int | None = None) -> Self:
        rng, d = np.random.default_rng(self.seed if seed is None else seed), self.read(u)
        return self._with_data(d + self.noise * rng.standard_normal(d.shape))

    def _with_data(self, d: Array) -> Self:
        other = copy.copy(self)  # shares the mesh
        other.histories = Histories.of_every_step(len(self.probe.N), d)
        return other

    def observation(self, u: Array, p: Array) -> Observation:
        from scipy.sparse import csr_array

        data, root, n = self.data, self.c**0.5, self.n_field
        k = np.arange(len(data.d))
        S = self._S[data.sensor].tocoo()
        rows, columns, values = [S.row], [S.col], [data.w[S.row] * S.data]
        if self.held:
            rows, columns = [*rows, k], [*columns, n + data.sensor]
            values = [*values, 1.0 - data.w]
        row = np.concatenate(rows)
        at = (data.step[row] - 1) * (n + self.held) + np.concatenate(columns)
        S_u = csr_array((root * np.concatenate(values), (row, at)), shape=(len(k), self.n_state))
        now = self.read(u)
        before = u.reshape(self.steps, -1)[:, n:] if self.held else now
        which = data.step - 1, data.sensor
        predicted = (1.0 - data.w) * before[which] + data.w * now[which]
        x, t = self.probe.x, (data.step - 1 + data.w) * self.h
        extent = np.ptp(x, axis=0).max() or 1.0  # the march is as long as the sensors are apart
        return Observation(
            root * predicted,
            root * data.d,
            S_u,
            sigma=root * self.noise,
            weight=root,
            label=lambda k: f"{self._place(x[data.sensor[k]])} at {t[k]:.6g} s",
            position=np.column_stack([x[data.sensor], t / (self.steps * self.h) * extent]),
        )

    @staticmethod
    def _place(x: Array) -> str:
        return f"T at ({', '.join(f'{x_i:.3g}' for x_i in x)})"

    def candidates_at(self, x: Array) -> Candidates:
        """Every node in every step, the nodes at x (n_field, d)."""
        n, step = self.n_field, self.n_field + self.held
        t, i = np.divmod(np.arange(self.steps * n), n)
        label = lambda k: f"{self._place(x[i[k]])} at {(t[k] + 1) * self.h:.6g} s"  # noqa: E731
        return Candidates(t * step + i, label, x[i])
