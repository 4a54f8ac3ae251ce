"""READ FIRST. What a problem is, and the laws that it obeys.

    min_p  J(p) = 1/2 |S u(p) - d|^2 + alpha Phi(p)     subject to  R(u(p), p) = 0

A problem is physics only: it evaluates R, J and their partial derivatives at a given (u, p).
It never solves and never differentiates through a solve: routes do.
"""

from __future__ import annotations

import copy
import enum
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from gradient_routes.problems.errors import DomainError, InputError, NotOffered
from gradient_routes.problems.text import shortened

if TYPE_CHECKING:
    from gradient_routes.problems.contact import Stop
    from gradient_routes.problems.data.observation import Candidates, Observation
    from gradient_routes.problems.data.regularization import Prior

Array = NDArray[Any]
Drive = Literal["load", "displacement", "load and displacement"]
Structure = Literal["spd", "symmetric", "general"]
Discretization = Literal["quadrature", "stabilization", "mesh"]


class Offers(enum.Flag):
    """What a problem offers, and a route or a study needs. SOLVE contains VALUE, LINEARIZE contains SOLVE.

    Every bit has a name, STATE and PARTIALS included: Python 3.11.2 drops bits that have none.
    From OBSERVATION on: one bit a method, set where a class overrides that method of Problem.
    """

    VALUE = 1
    STATE = 2
    SOLVE = VALUE | STATE
    PARTIALS = 4
    LINEARIZE = SOLVE | PARTIALS
    TRACE = 8
    COMPLEX = 16
    OBSERVATION = 32
    ACTIVE_SET = 64
    REFINED = 128
    INTEGRAL = 256
    CONTINUOUS_ADJOINT = 512
    FIELDS = 1024
    INCONSISTENT_ADJOINT = 2048
    CASE = 4096


OPTIONAL = (
    Offers.OBSERVATION,
    Offers.ACTIVE_SET,
    Offers.REFINED,
    Offers.INTEGRAL,
    Offers.CONTINUOUS_ADJOINT,
    Offers.FIELDS,
    Offers.INCONSISTENT_ADJOINT,
    Offers.CASE,
)
OFFERED_AS = {
    Offers.VALUE: "J(p) as a number",
    Offers.SOLVE: "R(u, p), R_u and J(u, p) as numbers",
    Offers.LINEARIZE: "the partial derivatives R_p, J_u, J_p",
    Offers.TRACE: "R and J written in jax.numpy",
    Offers.COMPLEX: "R and J for complex arrays",
    Offers.CASE: "a description for other codes",
}


def offer_names(offers: Offers) -> list[str]:
    """The most specific names: LINEARIZE stands for the SOLVE and VALUE it contains."""
    names = [o for o in OFFERED_AS if o in offers]
    return [str(o.name).lower() for o in names if not any(o in other and o is not other for other in names)]


class Operator(Protocol):
    """Anything with `@` and `.T`: a NumPy array, a SciPy sparse matrix, a matrix given by its structure."""

    @property
    def T(self) -> Any: ...
    def __matmul__(self, v: Any, /) -> Any: ...


class Nuisance(Protocol):
    """Independent unit normal variables b (k,) that R and S depend on besides."""

    def pulled(self, w: Array, lam: Array) -> Array:
        """d(w . S u)/db (k,) through u as well, for w (m,) and R_u^T lam = S_u^T w."""
        ...


def default_label(i: int) -> str:
    return f"p_{i + 1}"


@dataclass(frozen=True)
class Label:
    """Names of components, shortened."""

    of: Callable[[int], str]

    def __call__(self, i: int) -> str:
        return shortened(self.of(i))


@dataclass(frozen=True)
class Parameters:
    """The vector p of length n_p: its starting point, the size of its natural changes, its bounds.

    start        (n_p,) the documented starting point
    scale        (n_p,) > 0, a natural change of p_i: finite differences step by max(|p_i|, scale_i)
    lower, upper the ends of the open interval of p_i, one number for all or (n_p,)
    unit         of p_i for tables, one for all or one each
    label        name of component i (counted from 0)
    position     (n_p, d), d <= 3, of p_i [m]; None where it has none
    """

    start: Array
    scale: Array
    lower: Array | float = -np.inf
    upper: Array | float = np.inf
    unit: str | tuple[str, ...] = "1"
    label: Callable[[int], str] = default_label
    position: Array | None = None

    def __post_init__(self) -> None:
        units = shortened(self.unit) if isinstance(self.unit, str) else tuple(map(shortened, self.unit))
        object.__setattr__(self, "unit", units)
        if not isinstance(self.label, Label):
            object.__setattr__(self, "label", Label(self.label))
        for name in ("start", "scale"):  # an array of integers would truncate every step
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        if self.start.ndim != 1 or self.scale.shape != self.start.shape or not (self.scale > 0).all():
            raise InputError(
                f"parameters: start {self.start.shape} and scale {self.scale.shape} - give two vectors of one length,"
                " scale > 0"
            )
        if self.position is not None and self.position.shape not in [(len(self), d) for d in (1, 2, 3)]:
            raise InputError(
                f"parameters: positions {self.position.shape} of {len(self)} parameters - give ({len(self)}, d), d <= 3"
            )

    def __len__(self) -> int:
        return len(self.start)

    def natural(self, p: Array) -> Array:
        """max(|p_i|, scale_i), (n_p,): the change of each component by a relative step of 1."""
        return np.asarray(np.maximum(np.abs(p), self.scale))

    def bounds(self, i: int) -> tuple[float, float]:
        """The open interval of component i."""
        lower, upper = (np.broadcast_to(bound, self.start.shape)[i] for bound in (self.lower, self.upper))
        return float(lower), float(upper)

    def unit_of(self, i: int) -> str:
        return self.unit if isinstance(self.unit, str) else self.unit[i]

    def check(self, p: Array, who: str) -> Array:
        """p as float64. Raises DomainError or InputError that names the first wrong component."""
        p = np.asarray(p, dtype=np.float64)
        if p.shape != self.start.shape:
            raise InputError(f"{who}: p has {p.size} values, the problem has {len(self)} parameters - give {len(self)}")
        bad = np.flatnonzero(~((p > self.lower) & (p < self.upper) & np.isfinite(p)))
        if bad.size:
            i = int(bad[0])
            lower, upper = self.bounds(i)
            more = f" (and {bad.size - 1} more)" if bad.size > 1 else ""
            raise DomainError(
                f"{who}: {self.label(i)} = {p[i]:g} is outside {lower:g} < {self.label(i)} < {upper:g}{more}"
                " - choose values inside"
            )
        return p


@dataclass(frozen=True)
class Linearization:
    """Partial derivatives at (u, p): R_p (n_u, n_p) as an Operator, J_u (n_u,), J_p (n_p,)."""

    R_p: Operator
    J_u: Array
    J_p: Array


@dataclass(frozen=True)
class Traced:
    """The same physics as pure functions of jax.numpy arrays.

    residual(u, p) -> (n_u,), objective(u, p) -> scalar; both must equal the NumPy ones.
    For stationary iterations on a linear problem, optional:
    diagonal(p) -> (n_u,) of R_u, and spectral_bound(p), a differentiable upper bound of its largest eigenvalue.
    """

    residual: Callable[[Any, Any], Any]
    objective: Callable[[Any, Any], Any]
    diagonal: Callable[[Any], Any] | None = None
    spectral_bound: Callable[[Any], Any] | None = None


@dataclass(frozen=True)
class Reference:
    """A gradient to compare others with, computed by other means than any route.

    size is the norm of the terms whose sum is the gradient: where |gradient| is below their rounding, errors are
    relative to size instead (a zero has no relative error).
    """

    name: str
    gradient: Array
    size: float


@dataclass(frozen=True)
class End:
    """A constant at its bound, where p_i has gone far up, or down, and which others go with it."""

    i: int
    name: str
    bound: str
    up: bool
    others: tuple[str, ...] = ()


class Problem:
    """Base of all problems. Set the attributes, override the methods that `offers` promises.

    name       as in selectors
    parameters what p is
    offers     what the methods below provide; a route needing more is skipped with a reason. OPTIONAL members are
               added for the methods of their names that a class overrides
    n_state    n_u, the number of free unknowns (0 for a black box)
    linear     R is affine in u: one Newton step solves it
    offset     |X| where R is a function of positions X + u: its rounding is relative to X + u
    structure  of R_u: "spd", "symmetric" (indefinite) or "general"
    load_steps a solve that fails is repeated by steps of the load: R(u, p) - (1 - t) R(u_0, p) = 0, t from 0 to 1
    matrix_free  tangent_operator gives products with R_u without assembling it
    line_search  False where full Newton steps converge from anywhere, R being convex with R_u^{-1} >= 0 (Ortega &
               Rheinboldt 1970, 13.3.4) or by an active-set method: halving steps would hinder it
    affine     u is an affine function of p: R is affine in u and p is a load
    affine_at_rest  it is where u is small: p is a load, and u = 0 without it
    steps      in time; 0: a steady problem
    regularization  the prior, whose weight is alpha; None where there can be none
    stop       of a state that meets an obstacle: the contact law, None where there is none
    typical    the component of p, counted from 0, that a study of single components shows unless told others; None:
               no one in particular
    start_from_data  whether the start of p says nothing of the body that was measured: its size comes from the data
    from_rest  whether data are zero without the load, and so as large as what p is there to explain
    drive      what moves the body: a load, displacements of its boundary that are known, or both
    measured   whether the data come from a file
    notes      sentences a user should read beside the result
    read_as    those of them that say how a data file was read
    """

    name: str
    parameters: Parameters
    offers: Offers = Offers.VALUE
    n_state: int = 0
    linear: bool = False
    offset: float = 0.0
    structure: Structure = "general"
    load_steps: bool = False
    matrix_free: bool = False
    line_search: bool = True
    affine: bool = False
    affine_at_rest: bool = False
    steps: int = 0
    regularization: Prior | None = None
    stop: Stop | None = None
    typical: int | None = None
    start_from_data: bool = False
    from_rest: bool = False
    drive: Drive = "load"
    measured: bool = False
    notes: tuple[str, ...] = ()
    read_as: tuple[str, ...] = ()

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        for offer in OPTIONAL:
            method = str(offer.name).lower()
            if getattr(cls, method) is not getattr(Problem, method):
                cls.offers |= offer

    def value(self, p: Array) -> float:
        """J(p), for a black box that offers VALUE only."""
        raise NotOffered(f"{self.name}: offers no J(p) - solve R(u, p) = 0 and use objective(u, p)")

    def initial(self, p: Array) -> Array:
        """The state (n_u,) a cold forward solve starts from, of p's dtype."""
        return np.zeros(self.n_state, dtype=p.dtype)

    def residual(self, u: Array, p: Array) -> Array:
        """R(u, p), (n_u,)."""
        raise NotOffered(f"{self.name}: offers no residual R(u, p)")

    def tangent(self, u: Array, p: Array) -> Any:
        """R_u(u, p): a Chain, a SciPy sparse matrix or an (n_u, n_u) array."""
        raise NotOffered(f"{self.name}: offers no tangent R_u")

    def tangent_operator(self, u: Array, p: Array) -> Operator:
        """R_u for products only, unassembled; offered where `matrix_free` says so."""
        raise NotOffered(f"{self.name}: offers no unassembled products with R_u")

    def objective(self, u: Array, p: Array) -> Any:
        """J(u, p), a real number (complex where u or p is)."""
        raise NotOffered(f"{self.name}: offers no objective J(u, p)")

    def linearize(self, u: Array, p: Array) -> Linearization:
        """R_p, J_u, J_p at (u, p)."""
        raise NotOffered(f"{self.name}: offers no partial derivatives R_p, J_u, J_p")

    def traced(self) -> Traced:
        """R and J for JAX. Import jax inside, through `problems.jax64`."""
        raise NotOffered(f"{self.name}: offers no jax.numpy version of R and J")

    def observation(self, u: Array, p: Array) -> Observation | None:
        """The data term of J at (u, p), datum by datum; None where J is no sum of squares."""
        return None

    @property
    def alpha(self) -> float:
        """The weight of Phi in J."""
        return 0.0 if self.regularization is None else self.regularization.alpha

    def weighted(self, alpha: float) -> Problem:
        """This problem, its data and its mesh, with another weight of Phi."""
        if self.regularization is None:
            raise NotOffered(f"{self.name}: has no Phi(p) to weigh")
        other = copy.copy(self)
        other.regularization = replace(self.regularization, alpha=alpha)
        return other

    def scaled(self, p: Array, factor: float) -> Array | None:
        """The parameters (n_p,) of a body `factor` times as stiff as that of p: what loads add to a small u is
        1 / factor times that of p, forces of known displacements are `factor` times as large. None where p sets no
        stiffness, or where no datum depends on it.
        """
        return None

    def stiffened(self, factor: float) -> Problem:
        """This problem, its data and its mesh, from a start that is `factor` times as stiff."""
        raise NotOffered(f"{self.name}: its start has no stiffness to multiply")

    def told_by_data(self, p: Array) -> tuple[Problem, float] | None:
        """This problem from a start that its data tell, and by what factor, at least 1, p is off; None where they tell
        none.
        """
        return None

    def stated(self, p: Array) -> Mapping[str, Any]:
        """What p means in constants that people state, such as E and nu, by name with the unit; holomorphic."""
        return {}

    def ends(self, p: Array) -> list[End]:
        """What p states that is at an end of its domain."""
        return []

    def taken_as_exact(self, u: Array, p: Array) -> Nuisance | None:
        """What R takes as exact at a solved state and is known with noise, beside the data; None where nothing is."""
        return None

    def candidates(self) -> Candidates | None:
        """What sensors can read; None: any unknown of the state."""
        return None

    def prior(self, p: Array) -> tuple[Prior, Array, Array] | None:
        """The prior, theta (n_p,) at p, and dtheta_i/dp_i (n_p,); None where there can be no prior."""
        return None

    def completed(self, given: Mapping[str, float]) -> Array | None:
        """p (n_p,) of which only some components are given, by name; None where they do not tell the others."""
        return None

    def reference(self, p: Array) -> Reference | None:
        """A gradient by other means (a closed form), or None."""
        return None

    def truth(self) -> Array | None:
        """The p (n_p,) that made the data, where they are synthetic."""
        return None

    def twin(self) -> Problem | None:
        """The problem whose state at truth() gives the synthetic data of this one; None where the data are known."""
        return None

    def observed(self, u: Array, seed: int | None = None) -> Problem:
        """This problem with the readings of its sensors at the state u (n_u,) as data, and noise if it has any: drawn
        from `seed`, or from the problem's own seed where that is None.
        """
        raise NotOffered(f"{self.name}: has no synthetic data")

    def load_cases(self) -> list[Problem]:
        """One problem for the data of each load case, whose misfits add up to this one's; [] where it has only one."""
        return []

    def active_set(self, u: Array, p: Array) -> Hashable | None:
        """The active smooth branch of a piecewise smooth R at (u, p), a word or a tuple; None where R is smooth."""
        return None

    def tip(self, u: Array) -> float | None:
        """The displacement [m] that `stop` limits; None where there is nothing to limit."""
        return None

    def with_stop(self, stop: Stop) -> Problem:
        """This problem, its data and its mesh, with another stop."""
        raise NotOffered(f"{self.name}: has no stop to exchange")

    def refined(self, p: Array) -> tuple[Problem, Array] | None:
        """The same problem on a mesh of half the mesh size, and p on it; None where there is no such mesh."""
        return None

    def integral(self, u: Array, p: Array) -> tuple[float, Array] | None:
        """The integral that J, a sum over nodes, approximates, and its derivative by u (n_u,)."""
        return None

    def continuous_adjoint(self, u: Array, p: Array) -> tuple[Any, Operator] | None:
        """The adjoint equation differentiated first and discretized then: A and Q, A lam = -J_u, dJ/dp = J_p + Q^T lam.

        They equal R_u^T and R_p only as the mesh size h goes to 0, and so does the gradient.
        """
        return None

    def inconsistent_adjoint(self, u: Array, p: Array, other: Discretization) -> tuple[Any, Operator, Array] | None:
        """The adjoint equation with another quadrature, stabilization or mesh than R: A, Q and b, A lam = -b,
        dJ/dp = J_p + Q^T lam. None where there is no such mesh.

        As those of the continuous adjoint they equal R_u^T, R_p and J_u only as h goes to 0.
        """
        return None

    def case(self) -> dict[str, Any]:
        """This problem told to another code: numbers, texts and arrays, by names. Raises NotOffered for what cannot be.

        `kind` says which of these it is:
        bar           n, length [m], area [m^2], load [N], sensors (m,) nodes counted from 1, data (m,) [m]
        hyperelastic  points (n, 3) [m], cell_type and cells (n_e, k) in VTK's order, clamped nodes, forces (n, 3) [N]
                      dead nodal forces, sensors (m,) nodes, data (m, 3) [m], law, nu, modulus (n_e,) index in p
        vibrating-bar the bar's, but no load: scheme, steps T, dt [s], density [kg/m^3], force (T + 1,) [N] at times 0
                      to T dt, data (T, m)
        All: parametrization, log or raw: p is log E or E [Pa]; J = 1/2 |S u - d|^2. Nodes count from 0 where not said.
        """
        raise NotOffered(f"{self.name}: is not described to other codes")

    def condition(self, p: Array) -> float | None:
        """An estimate of the condition number of R_u, used only to predict numbers of iterations."""
        return None

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        """What is worth showing beside the gradient, parameter by parameter."""
        return ParameterView()

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields | None:
        """u, lam and dJ/dp (n_p,) on the problem's mesh, or None where it has none."""
        return None


@dataclass(frozen=True)
class Fields:
    """Fields on a mesh, for a viewer.

    points     (n, 3) [m]
    cell_type  the name of the one kind of cell in meshio, such as "hexahedron"
    cells      (n_e, k), points of every cell, in meshio's (VTK's) order
    point_data by name, (n,) or (n, 3)
    cell_data  by name, (n_e,) or (n_e, 3)
    """

    points: Array
    cell_type: str
    cells: Array
    point_data: Mapping[str, Array] = field(default_factory=dict)
    cell_data: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class ParameterView:
    """Columns (n_p,) to show beside a gradient, and a `mark` for parameters that no datum depends on, the `blind`.

    remarks: sentences on the state, to show below them.
    """

    columns: Mapping[str, Array] = field(default_factory=dict)
    blind: Array | None = None
    mark: str = "blind"
    remarks: tuple[str, ...] = ()
