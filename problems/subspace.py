"""A problem in an affine subspace of its parameters: p = base + V c. Routes run on c as they run on p."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.errors import NotOffered
from gradient_routes.problems.problem import (
    Array,
    Discretization,
    Linearization,
    Operator,
    Parameters,
    ParameterView,
    Problem,
    Reference,
    Traced,
)
from gradient_routes.problems.wrapped import Wrapped

if TYPE_CHECKING:
    from gradient_routes.problems.contact import Stop
    from gradient_routes.problems.data.observation import Observation


@dataclass(frozen=True)
class Selection:
    """The (n_p, m) matrix of the columns `index` (m,) of the identity; only `index` is stored."""

    index: Array
    n_p: int

    @property
    def T(self) -> SelectionTransposed:
        return SelectionTransposed(self)

    def __matmul__(self, c: Any) -> Any:
        """c (m,) scattered into n_p components; traceable."""
        if isinstance(c, np.ndarray):
            v = np.zeros(self.n_p, c.dtype)
            v[self.index] = c
            return v
        from gradient_routes.problems.jax64 import jnp

        return jnp.zeros(self.n_p, jnp.asarray(c).dtype).at[self.index].set(c)


@dataclass(frozen=True)
class SelectionTransposed:
    """Picks the components `index` of a vector (n_p,)."""

    T: Selection

    def __matmul__(self, g: Any) -> Any:
        return g[self.T.index]


@dataclass(frozen=True)
class Product:
    """The matrix A B, never formed."""

    A: Operator
    B: Operator

    @property
    def T(self) -> Product:
        return Product(self.B.T, self.A.T)

    def __matmul__(self, v: Any) -> Any:
        return self.A @ (self.B @ v)


@dataclass(frozen=True)
class Coordinates(Parameters):
    """c (m,) of p = base + V c. It is valid where c is within its bounds and p(c) within those of p."""

    p: Callable[[Array], Array] = field(kw_only=True)
    of: Parameters = field(kw_only=True)

    def check(self, c: Array, who: str) -> Array:
        c = super().check(c, who)
        self.of.check(self.p(c), who)
        return c


class Subspace(Wrapped):
    """`problem` as a function of c (m,) alone, p = base + V c; its gradient is V^T dJ/dp.

    V (n_p, m) is a dense array for directions, a Selection for components; see the two functions below.
    """

    typical = None

    def __init__(self, problem: Problem, V: Operator, base: Array, **parameters: Any) -> None:
        super().__init__(problem)
        self.V, self.base, self._given = V, base, parameters
        self.parameters = Coordinates(**parameters, p=self.p, of=problem.parameters)

    def p(self, c: Any) -> Any:
        """p (n_p,) at c (m,); traceable."""
        return self.base + self.V @ c

    def _of(self, problem: Problem) -> Subspace:
        """The same subspace of a problem with the same parameters."""
        return Subspace(problem, self.V, self.base, **self._given)

    def linearize(self, u: Array, p: Array) -> Linearization:
        lin = super().linearize(u, p)
        return Linearization(Product(lin.R_p, self.V), lin.J_u, self.V.T @ lin.J_p)

    def traced(self) -> Traced:
        inner = self.problem.traced()
        diagonal, bound = inner.diagonal, inner.spectral_bound
        return Traced(
            residual=lambda u, c: inner.residual(u, self.p(c)),
            objective=lambda u, c: inner.objective(u, self.p(c)),
            diagonal=None if diagonal is None else lambda c: diagonal(self.p(c)),
            spectral_bound=None if bound is None else lambda c: bound(self.p(c)),
        )

    def reference(self, p: Array) -> Reference | None:
        """Its size is at most |V| times that of the whole gradient."""
        inner = super().reference(p)
        if inner is None:
            return None
        norm = 1.0 if isinstance(self.V, Selection) else float(np.linalg.norm(np.asarray(self.V)))
        return Reference(inner.name, self.V.T @ inner.gradient, norm * inner.size)

    def observation(self, u: Array, p: Array) -> Observation | None:
        inner = super().observation(u, p)
        return inner if inner is None or inner.S_p is None else replace(inner, S_p=Product(inner.S_p, self.V))

    def continuous_adjoint(self, u: Array, p: Array) -> tuple[Any, Operator] | None:
        inner = super().continuous_adjoint(u, p)
        return None if inner is None else (inner[0], Product(inner[1], self.V))

    def inconsistent_adjoint(self, u: Array, p: Array, other: Discretization) -> tuple[Any, Operator, Array] | None:
        inner = super().inconsistent_adjoint(u, p, other)
        return None if inner is None else (inner[0], Product(inner[1], self.V), inner[2])

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        """The rows of the components; a direction has none."""
        if not isinstance(self.V, Selection):
            return ParameterView()
        inner = super().view(p, u, lam)
        columns = {name: self.V.T @ column for name, column in inner.columns.items()}
        return ParameterView(
            columns, None if inner.blind is None else self.V.T @ inner.blind, inner.mark, inner.remarks
        )

    def truth(self) -> Array | None:
        """None where the true p is not in the subspace."""
        truth = self.problem.truth()
        if truth is None:
            return None
        V = self.V
        c = (V.T @ truth) if isinstance(V, Selection) else np.linalg.lstsq(np.asarray(V), truth - self.base)[0]
        return c if np.allclose(self.p(c), truth, rtol=1e-12, atol=0.0) else None

    def twin(self) -> Problem | None:
        twin = self.problem.twin()
        return None if twin is None else self._of(twin)

    def observed(self, u: Array, seed: int | None = None) -> Problem:
        return self._of(self.problem.observed(u, seed))

    def weighted(self, alpha: float) -> Problem:
        return self._of(self.problem.weighted(alpha))

    def with_stop(self, stop: Stop) -> Problem:
        return self._of(self.problem.with_stop(stop))

    def load_cases(self) -> list[Problem]:
        return [self._of(one) for one in self.problem.load_cases()]

    def prior(self, p: Array) -> None:
        """A prior of all of theta is none of c."""
        return

    def refined(self, p: Array) -> None:
        """A finer mesh has other parameters than V knows."""
        return

    def case(self) -> dict[str, Any]:
        raise NotOffered(f"{self.name}: a part of its parameters is not described to other codes")

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> None:
        """A part of a gradient is no field."""
        return


def components(problem: Problem, p: Array, index: Array) -> Subspace:
    """The problem in the components `index` (m,) of p, the others held: c_j = p_index[j] with its scale and bounds.

    Finite differences therefore take the same steps as in the whole gradient.
    """
    of, V = problem.parameters, Selection(np.asarray(index), len(p))
    base = p.copy()
    base[V.index] = 0.0  # 0 + c = c without rounding
    lower, upper = (np.broadcast_to(bound, p.shape)[V.index] for bound in (of.lower, of.upper))
    return Subspace(
        problem,
        V,
        base,
        start=p[V.index],
        scale=of.scale[V.index],
        lower=lower,
        upper=upper,
        unit=tuple(of.unit_of(int(i)) for i in V.index),
        label=lambda j: of.label(int(V.index[j])),
        position=None if of.position is None else of.position[V.index],
    )


def directions(problem: Problem, p: Array, m: int, seed: int) -> Subspace:
    """The problem along m random directions v_i = xi_i max(|p_i|, s_i) from p, where c = 0.

    xi_i has a random sign and a size of 1/2 to 3/2, so that no component of a direction is nearly zero.
    The bounds of c_j keep p + v_j c_j within the bounds of p; several c_j together may leave them.
    """
    of = problem.parameters
    rng = np.random.default_rng(seed)
    xi = rng.choice([-1.0, 1.0], (m, len(p))) * rng.uniform(0.5, 1.5, (m, len(p)))
    V = (xi * of.natural(p)).T
    lower, upper = _room(p, V, of)
    return Subspace(
        problem,
        V,
        p,
        start=np.zeros(m),
        scale=np.ones(m),
        lower=lower,
        upper=upper,
        label=lambda j: f"direction {j + 1}",
    )


def _room(p: Array, V: Array, of: Parameters) -> tuple[Array, Array]:
    """The largest open intervals (m,) of c_j about 0 in which p + v_j c_j is within the bounds of p."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = [(np.broadcast_to(bound, p.shape) - p)[:, None] / V for bound in (of.lower, of.upper)]
    below, above = np.fmin(*ends), np.fmax(*ends)
    return np.fmax.reduce(below, initial=-np.inf), np.fmin.reduce(above, initial=np.inf)
