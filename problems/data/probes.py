"""Probes: displacements read at nodes, at markers on the surface or at measured points, and the misfit to data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.data.boundary_values import BoundaryValues
from gradient_routes.problems.data.load_cases import CASE, LOAD, LoadCases, vector_group
from gradient_routes.problems.data.placing import Outside, place
from gradient_routes.problems.data.repeats import without_repeats
from gradient_routes.problems.data.strain_gauges import GROUP, StrainGauges, has_strains, strains_of
from gradient_routes.problems.data.table import Group, Table, read_table
from gradient_routes.problems.data.units import doubt
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import BRICKS
from gradient_routes.problems.fem.mesh import AXES, Mesh
from gradient_routes.problems.problem import Array

NOWHERE = np.zeros(0, dtype=int)


@dataclass(frozen=True, eq=False)
class Probes:
    """Points at which displacements are read.

    nodes (m, k), N (m, k)  a point's displacement is sum_k N_k u(node_k)
    x (m, d)                the points [m]
    measured (m, d)         which components are measured
    weights (m, d)          of the misfits in J, relative to their mean accuracy; None: 1
    """

    nodes: Array
    N: Array
    x: Array
    measured: Array
    weights: Array | None = None

    def at(self, rows: Array | slice) -> Probes:
        """Some of the points."""
        weights = None if self.weights is None else self.weights[rows]
        return Probes(self.nodes[rows], self.N[rows], self.x[rows], self.measured[rows], weights)

    def read(self, U: Any) -> Any:
        """(m, d) [m], from the nodes' displacements U (m, k, d)."""
        return (self.N[..., None] * U).sum(1)

    def residual(self, U: Any, d: Any) -> Any:
        """w (S u - d) of what is measured, (m_measured,), holomorphic."""
        r = self.read(U) - d
        return (r if self.weights is None else self.weights * r)[self.measured]

    def forces(self, r: Array) -> Array:
        """Derivative of 1/2 |w (S u - d)|^2 with respect to U, (m, k, d), for its residual r."""
        by_x = np.zeros(self.measured.shape)
        by_x[self.measured] = r
        if self.weights is not None:
            by_x = self.weights * by_x
        return np.asarray(self.N[..., None] * by_x[:, None])


def at_nodes(mesh: Mesh, nodes: Array) -> Probes:
    x = mesh.geometry.X[nodes]
    return Probes(nodes[:, None], np.ones((len(nodes), 1)), x, np.ones(x.shape, dtype=bool))


def markers(mesh: Mesh, face: str, count: int, in_plane: bool, seed: int) -> Probes:
    """Random points on a face, uniform by area; `in_plane` leaves out the component closest to the normal."""
    facets, geometry = mesh.boundary(face), mesh.geometry
    area = facets.areas(geometry.X, np).sum(axis=1)
    if not area.sum() > 0.0:
        raise InputError(f"{mesh.who}: face={face} lies on the axis and has no area - choose another face")
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(area), size=count, p=area / area.sum())
    s = rng.uniform(size=(geometry.dim - 1, count))
    if geometry.dim == 3 and geometry.element.name not in BRICKS:  # map the square to the triangle
        s = np.where(s.sum(axis=0) > 1.0, 1.0 - s, s)
    sides = facets.sides[chosen]
    xi = np.concatenate([geometry.element.on_side(int(side), s[:, [i]])[0] for i, side in enumerate(sides)], axis=1)
    N, _ = geometry.element.shape_functions(xi)
    nodes = geometry.nodes[facets.cells[chosen]]
    measured = np.ones((count, geometry.dim), dtype=bool)
    if in_plane:
        normal = facets.normals(geometry.X[facets.nodes], np).sum(axis=(0, 1))
        measured[:, int(np.abs(normal).argmax())] = False
    return Probes(nodes, N, np.einsum("ma,mai->mi", N, geometry.X[nodes]), measured)


@dataclass(frozen=True)
class Measured:
    """What a file holds: for each load case probes and data d (m, d) [m]; noise sigma [m], 0 if unknown; the loads of
    its cases, where it names any; displacements of a measured boundary in every case, or none; notes on how it was
    read; and strains, in one load case.

    sigma is that of the strains [1] where no displacement was measured.
    """

    probes: tuple[Probes, ...]
    d: tuple[Array, ...]
    sigma: float
    loads: LoadCases | None
    boundary: tuple[BoundaryValues, ...]
    notes: tuple[str, ...]
    strains: StrainGauges | None = None


def read_probes(
    mesh: Mesh,
    path: str,
    columns: str | None = None,
    units: str | None = None,
    outside: Outside = "refuse",
    noise: float = 0.0,
    boundary: Array = NOWHERE,
    strain_noise: float = 0.0,
) -> Measured:
    """Read x,y,z and any of ux,uy,uz and of exx,eyy.., of a plane body x,y and ux,uy; an empty cell was not measured.

    See `read_table`, `LoadCases` and `place`. Points that tell the displacements of the nodes `boundary` are no data.
    The noise is `noise` [m], or that of columns sigma or sigma_x, sigma_y, sigma_z, by which data are then weighted;
    of strains, which weigh by the ratio of both, `strain_noise` [1].
    Raises InputError for a file that cannot be understood, and for points outside the body.
    """
    axes = AXES[: mesh.geometry.dim]
    strained = has_strains(path, columns)
    table = read_table(path, (*groups(axes, "none" if strained else "any"), GROUP), columns, units)
    x, d = table.stack(axes), table.stack([f"u{axis}" for axis in axes])
    e = strains_of(table, axes) if strained else np.empty((len(x), 0))
    sigma, loads = noise_of(table, axes, d, noise), LoadCases.of(table, axes)
    case = np.zeros(len(x), dtype=int) if loads is None else loads.rows
    if strained and case.any():
        raise InputError(f"{path}: strains under several loads are not read - keep the rows of one load")
    both = np.c_[np.broadcast_to(sigma, d.shape), np.full(e.shape, strain_noise)] if strained else sigma
    kept, repeated = np.zeros(len(x), dtype=bool), set()
    for k in range(case.max() + 1):
        of = case == k
        among = both[of] if isinstance(both, np.ndarray) else both
        kept[of], said = without_repeats(path, x[of], np.c_[d, e][of], table.lines[of], among)
        repeated.add(said)
    around = []
    for k in range(case.max() + 1) if len(boundary) else ():
        whole = np.flatnonzero(kept & (case == k) & ~np.isnan(d).any(axis=1))
        among = sigma[whole] if isinstance(sigma, np.ndarray) else sigma
        X = mesh.geometry.X[boundary]
        around.append(BoundaryValues.of(X, x[whole], d[whole], among, f"{path}: boundary=measured"))
        kept[whole[around[-1].used]] = False
    if not kept.any():
        raise InputError(f"{path}: all points tell boundary=measured, none is left as a datum - measure inside, too")
    placed = place(mesh, x[kept], path, outside)
    rows = np.flatnonzero(kept)[placed.rows]
    d, e, case, weights = d[rows], e[rows], case[rows], None
    measured = ~np.isnan(d)
    seen = measured.any(axis=1) | (~np.isnan(e)).any(axis=1)
    blind = np.setdiff1d(np.arange(1 if loads is None else len(loads.values)), case[seen])
    if blind.size:
        where = "" if loads is None else f" under load {loads.named(blind[0])}, case {blind[0] + 1}"
        raise InputError(f"{path}: measures nothing{where} - give at least one row with a displacement")
    if isinstance(sigma, np.ndarray):
        level = float(np.mean(sigma[rows][measured] ** -2.0) ** -0.5)
        weights = level / np.where(measured, sigma[rows], level)
        sigma = level
    doubtful = doubt(sigma, float(np.abs(d[measured]).max())) if measured.any() else ""
    weight, sigma = _weighed(path, bool(measured.any()), bool((~np.isnan(e)).any()), sigma, strain_noise)
    strains = StrainGauges.of(mesh.geometry, placed, e, axes, weight)
    everything = Probes(placed.nodes, placed.N, placed.x, measured, weights)
    cases = "" if loads is None else loads.said(rows)
    shear = "" if strains is None else strains.said
    notes = tuple(filter(None, (table.said, shear, cases, *sorted(repeated), *placed.said, doubtful)))
    d = np.where(measured, d, 0.0)
    of_case = [slice(None)] if loads is None else [np.flatnonzero(case == k) for k in range(case.max() + 1)]
    each = tuple(everything.at(of) for of in of_case), tuple(d[of] for of in of_case)
    return Measured(*each, sigma, loads, tuple(around), notes, strains)


def _weighed(path: str, moved: bool, strained: bool, sigma: float, strain_noise: float) -> tuple[float, float]:
    """The weight of strains in J, and the noise of all data as J weighs them. Raises InputError."""
    if not strained and strain_noise:
        raise InputError(f"{path}: strain_noise={strain_noise:g}, but no strain was measured - leave it out")
    if not strained:
        return 1.0, sigma
    if not moved and sigma:
        raise InputError(f"{path}: noise={sigma:g} is of displacements, and strains alone were measured: strain_noise=")
    if not moved:
        return 1.0, strain_noise
    if not (sigma and strain_noise):
        raise InputError(
            f"{path}: displacements and strains in one J are weighed by their noise - state both, as in"
            " noise=0.4um,strain_noise=20microstrain"
        )
    return sigma / strain_noise, sigma


def groups(axes: str, need: str = "any") -> tuple[Group, ...]:
    """The columns of coordinates, displacements, their noise, and load cases."""
    return (
        Group(tuple(axes), "length", marked=False),
        Group(tuple(f"u{axis}" for axis in axes), "length", need=need, gaps=True),
        Group(("sigma", *(f"sigma_{axis}" for axis in axes)), "length", need="none", gaps=True),
        LOAD,
        vector_group(axes),
        CASE,
    )


def noise_of(table: Table, axes: str, d: Array, noise: float) -> Array | float:
    """sigma (m, d) [m] of the data by columns, or `noise`. Raises InputError unless columns are positive."""
    single = [f"sigma_{axis}" for axis in axes]
    given = [name for name in ("sigma", *single) if name in table.columns]
    if not given:
        return noise
    if noise:
        raise InputError(f"{table.path}: noise={noise:g} and column {given[0]} both state the noise - keep one")
    if "sigma" in given and len(given) > 1:
        raise InputError(f"{table.path}: columns {', '.join(given)} state the noise twice - keep one")
    sigma = table.stack(["sigma"] * len(axes) if "sigma" in given else single)
    bad = np.flatnonzero((~np.isnan(d) & ~(sigma > 0.0)).any(axis=1))
    if bad.size:
        i = int(bad[0])
        c = int(np.flatnonzero(~np.isnan(d[i]) & ~(sigma[i] > 0.0))[0])
        has = "none" if np.isnan(sigma[i, c]) else f"{sigma[i, c]:g} m"
        raise InputError(
            f"{table.path}: line {table.lines[i]}: the noise of u{axes[c]} is {has}, in {bad.size} rows"
            f" in all it is not above 0 - give a standard deviation > 0 of every value"
        )
    return sigma
