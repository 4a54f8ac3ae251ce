"""Histories: some unknowns of the state, read after every step, and their data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

Label = Callable[[int], str]


@dataclass(frozen=True, eq=False)
class EveryStep:
    """S and d of J = 1/2 sum_t |S u_t - d_t|^2, in `steps` of h [s] whose states have n unknowns each.

    at (m,)    the unknowns that are read
    name       of an unknown, for tables
    d (T, m)   None for synthetic data that are not computed yet
    noise      standard deviation of the noise on d
    """

    who: str
    steps: int
    n: int
    h: float
    at: Array
    name: Label
    noise: float = 0.0
    d: Array | None = None

    @property
    def data(self) -> Array:
        """d. Raises InputError for synthetic data that are not computed yet."""
        if self.d is None:
            raise InputError(
                f"{self.who}: synthetic data are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(problem)"
            )
        return self.d

    def zeros(self) -> EveryStep:
        """With d = 0, to solve for the state that synthetic data are read from."""
        return replace(self, d=np.zeros((self.steps, len(self.at))))

    def synthesized(self, u: Array, seed: int) -> EveryStep:
        """With the data read from the states of all steps, plus noise."""
        d = self.read(u)
        return replace(self, d=d + self.noise * np.random.default_rng(seed).standard_normal(d.shape))

    def read(self, u: Any, xp: Any = np) -> Any:
        """S u_t of every step, (T, m)."""
        return xp.reshape(u, (self.steps, self.n))[:, self.at]

    def misfit(self, u: Any, xp: Any = np) -> Any:
        return 0.5 * xp.sum((self.read(u, xp) - self.data) ** 2)

    def step_misfit(self, t: Any, u: Any, xp: Any = np) -> Any:
        """That of the state u (n,) after step t, which is traced where xp is jax.numpy."""
        return 0.5 * xp.sum((u[self.at] - xp.asarray(self.data)[t - 1]) ** 2)

    def step_misfits(self, t_0: int, u: Array) -> tuple[Array, Array]:
        """Those of the states u (k, n) after steps t_0 + 1..t_0 + k, (k,), and S^T (S u - d), (k, n)."""
        off, by_u = u[:, self.at] - self.data[t_0 : t_0 + len(u)], np.zeros_like(u)
        by_u[:, self.at] = off
        return 0.5 * (off**2).sum(axis=1), by_u

    def observation(self, u: Array) -> Observation:
        from scipy import sparse

        at = self._of_all_steps(self.at)
        S = sparse.csr_array((np.ones(len(at)), (np.arange(len(at)), at)), shape=(len(at), self.steps * self.n))
        return Observation(self.read(u).ravel(), self.data.ravel(), S, sigma=self.noise, label=self._label(at))

    def candidates(self, at: Array, position: Array) -> Candidates:
        """The unknowns `at` (m,) at positions (m, d) in every step."""
        every = self._of_all_steps(at)
        return Candidates(every, self._label(every), np.tile(position, (self.steps, 1)))

    def _of_all_steps(self, at: Array) -> Array:
        return np.asarray((self.n * np.arange(self.steps)[:, None] + at).ravel())

    def _label(self, at: Array) -> Label:
        return lambda k: f"{self.name(int(at[k] % self.n))} at {(at[k] // self.n + 1) * self.h:.3g} s"
