"""What p stands for in a solid: moduli, layers, constants of the law, tractions, a shape, or one amplitude."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import Facets
from gradient_routes.problems.fem.mesh import Body
from gradient_routes.problems.problem import Array, Parameters

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.materials import Law

UnknownName = Literal["modulus", "layers", "constants", "traction", "shape", "load"]
FIELDS: tuple[UnknownName, ...] = ("modulus", "layers")
MATERIAL: tuple[UnknownName, ...] = ("modulus", "layers", "constants")
MAX_DEFAULT_LAYERS = 4
THETA_MAX = 300.0  # exp of it is far from float64's end, and so are its squares


@dataclass(frozen=True)
class Setting:
    """What a solid needs to know at p.

    q     constants of the law, numbers or (n_e,) [Pa]
    X     positions of the nodes (n_nodes, 3) [m]
    load  the amplitude, [Pa] or [m], or tractions (n_f, 3) [Pa]
    """

    q: tuple[Any, ...]
    X: Any
    load: Any


@dataclass(frozen=True)
class Unknown:
    """What p is.

    apply   (setting, p, xp) -> the setting with p in its place
    truth   the p (n_p,) behind synthetic data
    q_p     (p) -> per constant of the law, its derivative by the one parameter each cell depends on and that
            parameter's number, (n_e,) both; None where p is no material
    group   (n_e,), the number of each cell's modulus, where p are moduli
    nodes   numbers of the nodes whose positions p are, where they are
    is_load p is the load's amplitude
    """

    parameters: Parameters
    apply: Callable[[Setting, Any, Any], Setting]
    truth: Array
    q_p: Callable[[Array], list[tuple[Array, Array]]] | None = None
    group: Array | None = None
    nodes: Array | None = None
    is_load: bool = False


def default_modulus(x: Array) -> Array:
    """E(x) = 1 + 0.4 sin(2 pi x) cos(2 pi y) + 0.3 z [Pa] at points x (..., 3) of the unit cube."""
    x, y, z = np.moveaxis(x, -1, 0)
    return np.asarray(1.0 + 0.4 * np.sin(2.0 * np.pi * x) * np.cos(2.0 * np.pi * y) + 0.3 * z)


def inclusion(x: Array) -> Array:
    """E(x) = 4 in a ball of radius 0.3 about (0.5, 0.5, 0.6), or at the point next to its centre, else 1 [Pa]."""
    r = np.linalg.norm(x - [0.5, 0.5, 0.6], axis=-1)
    return np.where(r < max(0.3, 1.001 * r.min()), 4.0, 1.0)


def moduli(body: Body, law: Law, nu: float, log: bool, blank: bool) -> Unknown:
    """One Young's modulus a cell. `blank`: start from E = 1 everywhere instead of the default field."""
    x = body.relative(body.geometry.centres)
    start = np.ones(len(x)) if blank else default_modulus(x)
    cells = np.arange(len(x))
    return _of_modulus(law, nu, log, start, inclusion(x), cells, body.geometry.centres, "E")


def layers(body: Body, law: Law, nu: float, log: bool, blank: bool, count: int | None) -> Unknown:
    """One Young's modulus per layer, of `count` layers of equal height; None: the most, up to 4, that all hold a cell.

    Raises InputError where a layer holds no cell's centre.
    """
    height = body.relative(body.geometry.centres)[:, 2]
    if count is None:
        count = next(n for n in range(MAX_DEFAULT_LAYERS, 0, -1) if not _empty_layers(height, n).size)
    empty = _empty_layers(height, count)
    if empty.size:
        raise InputError(
            f"{body.who}: layers={count}, but no cell's centre lies in layer {empty[0] + 1} - choose fewer"
        )
    layer = _layer_numbers(height, count)
    z = (np.arange(count) + 0.5) / count
    middle = np.stack([np.full(count, 0.5)] * 2 + [z], axis=1)
    start = np.ones(count) if blank else 1.0 + 0.3 * z
    position = body.box[0] + middle * (body.box[1] - body.box[0])
    return _of_modulus(law, nu, log, start, inclusion(middle), layer, position, "E_layer")


def _layer_numbers(height: Array, count: int) -> Array:
    """The layer (n_e,) of cells whose centres lie at a height from 0 to 1."""
    return np.asarray(np.minimum((height * count).astype(int), count - 1))


def _empty_layers(height: Array, count: int) -> Array:
    return np.setdiff1d(np.arange(count), _layer_numbers(height, count))


def _of_modulus(
    law: Law, nu: float, log: bool, start: Array, truth: Array, group: Array, position: Array, name: str
) -> Unknown:
    """Moduli E, cell e having that of group[e]; the law's constants are proportional to it."""

    def q(p: Any, xp: Any) -> tuple[Any, ...]:
        return law.of_modulus((xp.exp(p) if log else p)[group], nu)

    def q_p(p: Array) -> list[tuple[Array, Array]]:
        return [(c if log else c / p[group], group) for c in q(p, np)]

    parameters = Parameters(
        start=np.log(start) if log else start,
        scale=np.ones(len(start)),
        lower=-THETA_MAX if log else 0.0,
        upper=THETA_MAX if log else np.inf,
        unit="log Pa" if log else "Pa",
        label=(lambda i: f"log {name}_{i + 1}") if log else (lambda i: f"{name}_{i + 1}"),
        position=position,
    )
    truth = np.log(truth) if log else truth
    return Unknown(parameters, lambda s, p, xp: replace(s, q=q(p, xp)), truth, q_p, group)


def constants(body: Body, law: Law, nu: float) -> Unknown:
    """The constants of the law, the same in every cell."""
    start = np.array(law.of_modulus(1.0, nu))
    parameters = Parameters(
        start=start,
        scale=np.where(start == 0.0, 1.0, np.abs(start)),
        lower=np.where(law.positive, 0.0, -np.inf),
        unit="Pa",
        label=lambda i: law.constants[i],
    )
    ones = np.ones(len(body.geometry.nodes))

    def q_p(p: Array) -> list[tuple[Array, Array]]:
        return [(ones, np.full(len(ones), i)) for i in range(len(p))]

    return Unknown(parameters, lambda s, p, xp: replace(s, q=tuple(p)), 1.3 * start, q_p)


def tractions(body: Body, facets: Facets, amplitude: float) -> Unknown:
    """The traction vector on every loaded facet, facet by facet."""
    n_f = len(facets.cells)
    start = np.zeros((n_f, 3))
    start[:, 2] = amplitude
    x = facets.centres
    bump = 1.0 + 0.5 * np.prod(np.sin(np.pi * body.relative(x)[:, :2]), axis=1)
    parameters = Parameters(
        start=start.ravel(),
        scale=np.full(3 * n_f, abs(amplitude) or 1.0),
        unit="Pa",
        label=lambda i: f"t_{'xyz'[i % 3]}({i // 3 + 1})",
        position=np.repeat(x, 3, axis=0),
    )
    truth = np.ravel(start * bump[:, None])
    return Unknown(parameters, lambda s, p, xp: replace(s, load=p.reshape(n_f, 3)), truth)


def shape(body: Body, where: str, held: Array) -> Unknown:
    """The positions of the nodes on a part of the surface, but for the nodes `held`."""
    nodes = np.setdiff1d(body.surface(where).node_set, held)
    if not nodes.size:
        raise InputError(f"{body.who}: surface={where}: all its nodes are clamped or loaded - choose a free surface")
    X, n = body.geometry.X, len(body.geometry.X)
    index: Array = np.arange(3 * n)  # into (X, p)
    moved = np.ravel(3 * nodes[:, None] + np.arange(3))
    index[moved] = 3 * n + np.arange(len(moved))
    index = index.reshape(n, 3)
    cell = float(np.cbrt(body.geometry.metric[1].sum() / len(body.geometry.nodes)))
    parameters = Parameters(
        start=X[nodes].ravel(),
        scale=np.full(len(moved), cell),
        unit="m",
        label=lambda i: f"{'xyz'[i % 3]}({nodes[i // 3] + 1})",
        position=np.repeat(X[nodes], 3, axis=0),
    )
    inward = body.box.mean(axis=0) - X[nodes]
    truth = np.ravel(X[nodes] + 0.05 * inward)

    def apply(s: Setting, p: Any, xp: Any) -> Setting:
        return replace(s, X=xp.concatenate([X.ravel(), p])[index])

    return Unknown(parameters, apply, truth, nodes=nodes)


def amplitude(name: str, start: float, unit: str) -> Unknown:
    """One number: how strong the load is."""
    parameters = Parameters(
        start=np.array([start]), scale=np.array([abs(start) or 1.0]), unit=unit, label=lambda i: name
    )
    return Unknown(parameters, lambda s, p, xp: replace(s, load=p[0]), np.array([1.25 * start]), is_load=True)
