"""The cells that points lie in, and their reference coordinates there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.fem.elements import Element, Geometry, cofactors
from gradient_routes.problems.problem import Array

NEWTON_TOLERANCE = 1e-12  # of a cell's size: residual, and step
START = 0.25  # reference coordinates at which Newton's method starts
REACH = (-4.0, 5.0)  # reference coordinates beyond which the map may fold
INSIDE = 1e-9  # in reference coordinates: distance outside a cell that is attributed to rounding
MARGIN = 0.1  # of a cell's extent: sides may be curved
NEAREST = 8  # cells that a point outside of all is measured from
PAIRS = 50_000  # points and cells at a time, to bound the memory


@dataclass(frozen=True)
class Located:
    """cells (m,), xi (m, d) and the distance (m,) [m] of each point to its cell, 0 inside.

    Outside, xi continues the map of the cell where it can be continued, and the distance is that to the nearest point
    found in the cell.
    """

    cells: Array
    xi: Array
    distance: Array


def locate(geometry: Geometry, x: Array) -> Located:
    """Locate points x (m, d): in the cells with the nearest centres, then in all cells whose boxes hold them."""
    from scipy.spatial import KDTree

    search = _Search.of(geometry, x)
    scale = np.median(np.ptp(search.X, axis=1), axis=0)
    tree = KDTree(geometry.centres / scale)
    search.attempt(np.arange(len(x)), np.asarray(tree.query(x / scale)[1]))
    left, count = search.outside(np.arange(len(x))), min(NEAREST, len(search.X))
    nearest = np.asarray(tree.query(x[left] / scale, k=[*range(1, count + 1)])[1])
    for k in range(1, count):
        more = search.found.distance[left] > 0.0
        search.attempt(left[more], nearest[more, k])
    search.attempt(*search.boxes_about(search.outside(left)))
    return search.found


def holders(geometry: Geometry, x: Array, tolerance: float) -> tuple[Array, Array]:
    """All pairs of one of the points x (m, d) and a cell that holds it, up to a tolerance in reference coordinates."""
    search = _Search.of(geometry, x)
    points, cells = search.boxes_about(np.arange(len(x)))
    held = np.zeros(len(points), dtype=bool)
    for k in range(0, len(points), PAIRS):
        some, these = points[k : k + PAIRS], cells[k : k + PAIRS]
        xi, distance = search.in_cells(x[some], these)
        near = distance <= tolerance * search.size[these]
        held[k : k + PAIRS] = near & (geometry.element.outside(xi) <= tolerance)
    return points[held], cells[held]


@dataclass(frozen=True, eq=False)
class _Search:
    """Points x (m, d), what is found of them, and of every cell: nodes X (n_e, n_a, d), size (n_e,), and the linear
    map x_0 + F_0 (xi - START), by x_0 (n_e, d) and F_0^-1 (n_e, d, d).
    """

    element: Element
    x: Array
    found: Located
    X: Array
    size: Array
    x_0: Array
    inverse: Array

    @classmethod
    def of(cls, geometry: Geometry, x: Array) -> _Search:
        X = geometry.X[geometry.nodes]
        N, dN = geometry.element.shape_functions(np.full((geometry.dim, 1), START))
        cof, det = cofactors(np.einsum("eai,aj->eij", X, dN[0]), np)
        found = Located(np.zeros(len(x), dtype=int), np.zeros_like(x), np.full(len(x), np.inf))
        inverse = cof.swapaxes(1, 2) / det[:, None, None]
        return cls(geometry.element, x, found, X, np.ptp(X, axis=1).max(axis=1), N[0] @ X, inverse)

    def outside(self, points: Array) -> Array:
        """Those of these points that no cell holds so far."""
        return points[self.found.distance[points] > 0.0]

    def attempt(self, points: Array, cells: Array) -> None:
        """Try pairs of a point (k,) and a cell (k,); what is nearer than before is kept."""
        found = self.found
        for k in range(0, len(points), PAIRS):
            some, these = points[k : k + PAIRS], cells[k : k + PAIRS]
            xi, distance = self.in_cells(self.x[some], these)
            order = np.lexsort((distance, some))
            best = order[np.append(True, np.diff(some[order]) > 0)]  # the nearest cell of every point
            better = best[distance[best] < found.distance[some[best]]]
            where = some[better]
            found.cells[where], found.xi[where], found.distance[where] = these[better], xi[better], distance[better]

    def boxes_about(self, at: Array) -> tuple[Array, Array]:
        """Pairs of one of the points `at` and a cell whose box, widened by MARGIN, holds it."""
        from scipy.spatial import KDTree

        if not at.size:
            return at, at
        margin = MARGIN * self.size[:, None]
        low, high = self.X.min(axis=1) - margin, self.X.max(axis=1) + margin
        tree, radius = KDTree(self.x[at]), 0.5 * (high - low).max(axis=1)
        near = tree.query_ball_point(0.5 * (low + high), radius, p=np.inf, return_sorted=False)
        cells = np.repeat(np.arange(len(near)), [len(points) for points in near])
        points = at[np.concatenate([np.asarray(points, dtype=int) for points in near])]
        held = ((low[cells] <= self.x[points]) & (self.x[points] <= high[cells])).all(axis=1)
        return points[held], cells[held]

    def in_cells(self, x: Array, cells: Array) -> tuple[Array, Array]:
        """xi (m, d) of points x (m, d) in a cell (m,) each, x = sum_a N_a(xi) X_a by Newton's method, and distances."""
        element, X, size = self.element, self.X[cells], self.size[cells]
        rounded = NEWTON_TOLERANCE * size + 4.0 * np.finfo(float).eps * np.abs(x).max(axis=1)
        xi = START + np.einsum("kij,kj->ki", self.inverse[cells], x - self.x_0[cells])
        xi = np.clip(xi, *REACH)
        for _ in range(20):
            N, dN = element.shape_functions(xi.T)
            r = np.einsum("ka,kai->ki", N, X) - x
            error = np.abs(r).max(axis=1)
            if (error <= rounded).all():  # at once if all maps are affine
                break
            cof, det = cofactors(np.einsum("kai,kaj->kij", X, dN), np)
            before, xi = xi, np.clip(xi - np.einsum("kij,ki->kj", cof, r) / det[:, None], *REACH)
            if np.abs(xi - before).max() <= NEWTON_TOLERANCE:
                break
        reached = error <= INSIDE * size
        distance = np.zeros(len(x))
        out = np.flatnonzero(~reached | (element.outside(xi) > INSIDE))
        nearest = element.nearest(xi[out])
        N, _ = element.shape_functions(nearest.T)
        distance[out] = np.linalg.norm(np.einsum("ka,kai->ki", N, X[out]) - x[out], axis=1)
        xi[~reached] = element.nearest(xi[~reached])
        return xi, distance
