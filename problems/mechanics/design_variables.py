"""Design variables p of a solid: moduli, layers, material constants, tractions, nodal positions or a load amplitude."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.facets import Facets
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.problem import Array, Parameters

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.materials import MaterialLaw

DesignName = Literal["modulus", "layers", "regions", "constants", "traction", "shape", "load"]
PlaneDesign = Literal["modulus", "layers", "regions", "constants", "thickness", "traction", "shape", "load"]
AnyDesign = DesignName | PlaneDesign
CELLWISE: tuple[AnyDesign, ...] = ("modulus", "thickness")
FIELDS: tuple[AnyDesign, ...] = (*CELLWISE, "layers")  # whose components have neighbours
MODULI: tuple[AnyDesign, ...] = (*FIELDS, "regions")
MATERIAL: tuple[AnyDesign, ...] = (*MODULI, "constants")
FITTED: tuple[AnyDesign, ...] = ("modulus", "layers", "regions", "constants")  # to data: stresses
MAX_DEFAULT_LAYERS = 4
THETA_MAX = 300.0  # exp(THETA_MAX) and its square stay in float64's range


@dataclass(frozen=True)
class Setup:
    """Everything R depends on besides u.

    q     material constants, numbers or (n_e,) [Pa]
    X     nodal positions (n_nodes, d) [m]
    load  the amplitude [Pa] or [m], or tractions (n_f, d) [Pa]
    k     stiffnesses of a support on springs [Pa/m]
    """

    q: tuple[Any, ...]
    X: Any
    load: Any
    k: Any = 0.0


@dataclass(frozen=True)
class DesignVariables:
    """The meaning of p.

    apply              (setup, p, xp) -> the setup with p inserted
    truth              the p (n_p,) that synthetic data are computed from
    q_p                (p) -> for every material constant, its derivative with respect to the one parameter a cell
                       depends on, and the index of that parameter, both (n_e,); None unless p sets the material
    field              E or t, if p are moduli or thicknesses of cells or layers
    parameter_of_cell  (n_e,) index of each cell's parameter, if it is such a field
    moved_nodes        the nodes whose positions p are, if it is a shape
    is_load            whether p is the load amplitude
    chain              (p) -> dq/dp (n_q, n_p), where p sets constants q that q_p takes for p
    by_stiffness       (n_p,), dp by the logarithm of the stiffness, where that is constant and p no field
    """

    parameters: Parameters
    apply: Callable[[Setup, Any, Any], Setup]
    truth: Array
    q_p: Callable[[Array], list[tuple[Array, Array]]] | None = None
    field: str | None = None
    parameter_of_cell: Array | None = None
    moved_nodes: Array | None = None
    is_load: bool = False
    chain: Callable[[Array], Array] | None = None
    by_stiffness: Array | None = None


def default_modulus(x: Array) -> Array:
    """E(x) = 1 + 0.4 sin(2 pi x) cos(2 pi y) + 0.3 z [Pa] at points x (..., 3) of the unit cube, or its section."""
    x, y, z = np.moveaxis(_in_cube(x), -1, 0)
    return np.asarray(1.0 + 0.4 * np.sin(2.0 * np.pi * x) * np.cos(2.0 * np.pi * y) + 0.3 * z)


def inclusion(x: Array) -> Array:
    """E(x) = 4 in a ball of radius 0.3 about (0.5, 0.5, 0.6), at least at the point nearest its centre, else 1 [Pa]."""
    r = np.linalg.norm(_in_cube(x) - [0.5, 0.5, 0.6], axis=-1)
    return np.where(r < max(0.3, 1.001 * r.min()), 4.0, 1.0)


def _in_cube(x: Array) -> Array:
    """Points (..., d) in the unit cube (..., 3): a plane body is its section y = 0.5."""
    return x if x.shape[-1] == 3 else np.insert(x, 1, 0.5, axis=-1)


def moduli(mesh: Mesh, law: MaterialLaw, nu: float, log: bool, uniform: bool, E: float) -> DesignVariables:
    """One Young's modulus per cell. `uniform`: start from the modulus E instead of the default field of that size."""
    x = mesh.normalized(mesh.geometry.centres)
    start = np.ones(len(x)) if uniform else default_modulus(x)
    cells = np.arange(len(x))
    return _cellwise(_moduli_q(law, nu), log, E, start, inclusion(x), cells, mesh.geometry.centres, "E")


def thicknesses(mesh: Mesh, q: tuple[Any, ...], log: bool, uniform: bool) -> DesignVariables:
    """One thickness per cell of a plane body; its loads are those of the nominal thickness.

    A cell of thickness t and constants q deforms as one of the nominal thickness t_0 and constants q t/t_0.
    """
    x, t_0 = mesh.normalized(mesh.geometry.centres), mesh.geometry.thickness
    start = np.ones(len(x)) if uniform else default_modulus(x)
    cells = np.arange(len(x))

    def q_of(t: Any) -> tuple[Any, ...]:
        return tuple(c * (t / t_0) for c in q)

    centres = mesh.geometry.centres
    return _cellwise(q_of, log, t_0, start, inclusion(x), cells, centres, "t", unit="m")


def _moduli_q(law: MaterialLaw, nu: float) -> Callable[[Any], tuple[Any, ...]]:
    return lambda E: law.of_modulus(E, nu)


def layers(
    mesh: Mesh, law: MaterialLaw, nu: float, log: bool, uniform: bool, E: float, count: int | None
) -> DesignVariables:
    """One Young's modulus per layer, of `count` layers of equal height; None: the most, up to 4, that all hold a cell.

    Raises InputError where a layer holds no cell's centre.
    """
    height = mesh.normalized(mesh.geometry.centres)[:, -1]
    if count is None:
        count = next(n for n in range(MAX_DEFAULT_LAYERS, 0, -1) if not _empty_layers(height, n).size)
    empty = _empty_layers(height, count)
    if empty.size:
        raise InputError(
            f"{mesh.who}: layers={count}, but no cell's centre lies in layer {empty[0] + 1} - choose fewer"
        )
    layer = _layer_numbers(height, count)
    middle = np.full((count, mesh.geometry.dim), 0.5)
    middle[:, -1] = z = (np.arange(count) + 0.5) / count
    start = np.ones(count) if uniform else 1.0 + 0.3 * z
    position = mesh.bounding_box[0] + middle * (mesh.bounding_box[1] - mesh.bounding_box[0])
    return _cellwise(_moduli_q(law, nu), log, E, start, inclusion(middle), layer, position, "E_layer")


def regions(mesh: Mesh, law: MaterialLaw, nu: float, log: bool, uniform: bool, E: float) -> DesignVariables:
    """One Young's modulus per region that the mesh file names. Raises InputError unless each cell is in one of them."""
    names = list(mesh.regions)
    centres = mesh.geometry.centres
    member = np.array([np.isin(np.arange(len(centres)), cells) for cells in mesh.regions.values()])
    count = member.sum(axis=0) if names else np.zeros(len(centres))
    wrong = np.flatnonzero(count != 1)
    if wrong.size:
        has = ", ".join(names) or "none"
        raise InputError(
            f"{mesh.who}: unknown=regions: {wrong.size} of {len(count)} cells are in no region or in several of those"
            f" that the mesh names ({has}), first cell {wrong[0] + 1} - give each cell one"
        )
    region, ones = member.argmax(axis=0), np.ones(len(names))
    position = np.array([centres[inside].mean(axis=0) for inside in member])
    x = mesh.normalized(position)
    start = ones if uniform else default_modulus(x)
    return _cellwise(_moduli_q(law, nu), log, E, start, inclusion(x), region, position, "E", names=names)


def _layer_numbers(height: Array, count: int) -> Array:
    """The layer (n_e,) of cells whose centres lie at a height from 0 to 1."""
    return np.asarray(np.minimum((height * count).astype(int), count - 1))


def _empty_layers(height: Array, count: int) -> Array:
    return np.setdiff1d(np.arange(count), _layer_numbers(height, count))


def _cellwise(
    q_of: Callable[[Any], tuple[Any, ...]],
    log: bool,
    size: float,
    start: Array,
    truth: Array,
    parameter_of_cell: Array,
    position: Array,
    name: str,
    unit: str = "Pa",
    names: list[str] | None = None,
) -> DesignVariables:
    """A value v in each cell e, v[parameter_of_cell[e]], to which the constants q_of(v) are proportional.

    start and truth are in units of `size`.
    """
    start, truth = size * start, size * truth

    def q(p: Any, xp: Any) -> tuple[Any, ...]:
        return q_of((xp.exp(p) if log else p)[parameter_of_cell])

    def q_p(p: Array) -> list[tuple[Array, Array]]:
        return [(c if log else c / p[parameter_of_cell], parameter_of_cell) for c in q(p, np)]

    parameters = Parameters(
        start=np.log(start) if log else start,
        scale=np.full(len(start), 1.0 if log else size),
        lower=-THETA_MAX if log else 0.0,
        upper=THETA_MAX if log else np.inf,
        unit=f"log {unit}" if log else unit,
        label=lambda i: f"{'log ' if log else ''}{name}_{names[i] if names else i + 1}",
        position=position,
    )
    truth = np.log(truth) if log else truth
    return DesignVariables(parameters, lambda s, p, xp: replace(s, q=q(p, xp)), truth, q_p, name[0], parameter_of_cell)


def constants(mesh: Mesh, law: MaterialLaw, nu: float, E: float) -> DesignVariables:
    """The material constants, the same in every cell, from those of the modulus E."""
    start = np.array(law.of_modulus(E, nu))
    parameters = Parameters(
        start=start,
        scale=np.where(start == 0.0, E, np.abs(start)),
        lower=np.where(law.positive, 0.0, -np.inf),
        unit="Pa",
        label=lambda i: law.constants[i],
    )
    ones = np.ones(len(mesh.geometry.nodes))

    def q_p(p: Array) -> list[tuple[Array, Array]]:
        return [(ones, np.full(len(ones), i)) for i in range(len(p))]

    return DesignVariables(parameters, lambda s, p, xp: replace(s, q=tuple(p)), 1.3 * start, q_p)


def tractions(mesh: Mesh, facets: Facets, t: Array) -> DesignVariables:
    """The traction vector of every loaded facet, t (d,) at the start."""
    x = facets.centres
    start, d, amplitude = np.broadcast_to(t, x.shape), mesh.geometry.dim, float(np.linalg.norm(t))
    bump = 1.0 + 0.5 * np.prod(np.sin(np.pi * mesh.normalized(x)[:, :-1]), axis=1)
    parameters = Parameters(
        start=start.ravel(),
        scale=np.full(start.size, abs(amplitude) or 1.0),
        unit="Pa",
        label=lambda i: f"t_{'xyz'[i % d]}({i // d + 1})",
        position=np.repeat(x, d, axis=0),
    )
    truth = np.ravel(start * bump[:, None])
    return DesignVariables(parameters, lambda s, p, xp: replace(s, load=p.reshape(start.shape)), truth)


def shape(mesh: Mesh, where: str, held: Array) -> DesignVariables:
    """Positions of the nodes on boundary `where` except the nodes `held`. Raises InputError if none is left."""
    nodes = np.setdiff1d(mesh.boundary(where).node_set, held)
    if not nodes.size:
        raise InputError(f"{mesh.who}: surface={where}: all its nodes are clamped or loaded - choose a free surface")
    X, d = mesh.geometry.X, mesh.geometry.dim
    index = np.arange(X.size).reshape(X.shape)  # into (X, p)
    index[nodes] = X.size + np.arange(nodes.size * d).reshape(-1, d)
    parameters = Parameters(
        start=X[nodes].ravel(),
        scale=np.full(nodes.size * d, mesh.geometry.cell_size),
        unit="m",
        label=lambda i: f"{'xyz'[i % d]}({nodes[i // d] + 1})",
        position=np.repeat(X[nodes], d, axis=0),
    )
    inward = mesh.bounding_box.mean(axis=0) - X[nodes]
    truth = np.ravel(X[nodes] + 0.05 * inward)

    def apply(s: Setup, p: Any, xp: Any) -> Setup:
        return replace(s, X=xp.concatenate([X.ravel(), p])[index])

    return DesignVariables(parameters, apply, truth, moved_nodes=nodes)


def amplitude(name: str, start: float, unit: str) -> DesignVariables:
    """One parameter, the load amplitude."""
    parameters = Parameters(
        start=np.array([start]), scale=np.array([abs(start) or 1.0]), unit=unit, label=lambda i: name
    )
    return DesignVariables(parameters, lambda s, p, xp: replace(s, load=p[0]), np.array([1.25 * start]), is_load=True)
