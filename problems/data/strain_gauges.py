"""Strains at points: those of small displacements, by the gradients of the shape functions in the cell of each point.

    e_ij = 1/2 (du_i/dx_j + du_j/dx_i),    linear in u, whatever the law;    exy is half the angle gamma_xy

A rigid motion of what measured, small as it is, changes no strain.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.problems.data.csv import NumberFile
from gradient_routes.problems.data.headers import pairs, plain, split_header
from gradient_routes.problems.data.placing import Placed
from gradient_routes.problems.data.table import Group, Table
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import Geometry
from gradient_routes.problems.problem import Array

NAMES = ("exx", "eyy", "ezz", "exy", "eyz", "exz")
GROUP = Group(NAMES, "ratio", need="none", gaps=True)


def names(axes: str) -> tuple[str, ...]:
    """Of the components in these axes."""
    return tuple(name for name in NAMES if {*name[1:]} <= {*axes})


def has_strains(path: str | Path, columns: str | None) -> bool:
    """Whether a file has a column of strains."""
    given = pairs(columns, f"{path}: columns={columns}", "x:NAME,ux:NAME") if columns else {}
    return bool({*NAMES} & {*given, *(plain(split_header(header)[0]) for header in NumberFile.opened(path).names)})


def strains_of(table: Table, axes: str) -> Array:
    """(n_rows, s), nan where not measured. Raises InputError for a component that a plane body has not."""
    odd = [name for name in NAMES if name in table.columns and name not in names(axes)]
    if odd:
        raise InputError(
            f"{table.path}: column {odd[0]}: a plane body has the strains {', '.join(names(axes))} - remove the column"
        )
    return table.stack(names(axes))


@dataclass(frozen=True, eq=False)
class StrainGauges:
    """Where strains are read and what was measured there.

    nodes (m, k), B (m, k, d, s)  strain s of a point is sum of B_kis u_i(node_k)
    x (m, d)                      the points [m]
    e, measured (m, s)            the data [1], 0 where not measured
    names (s,)                    of the components
    weight                        of their misfits in J
    """

    nodes: Array
    B: Array
    x: Array
    e: Array
    measured: Array
    names: tuple[str, ...]
    weight: float = 1.0

    @classmethod
    def of(cls, geometry: Geometry, placed: Placed, e: Array, axes: str, weight: float) -> StrainGauges | None:
        """Of the points that are placed, with strains e (m, s), nan where not measured; None without any."""
        rows = np.flatnonzero(~np.isnan(e).all(axis=1))
        if not rows.size:
            return None
        nodes, e = placed.nodes[rows], e[rows]
        _, dN_ref = geometry.element.shape_functions(placed.xi[rows].T)
        J = np.einsum("mai,maj->mij", geometry.X[nodes], dN_ref)
        dN = np.einsum("maj,mji->mai", dN_ref, np.linalg.inv(J))
        B = np.zeros((*dN.shape, e.shape[1]))
        for s, name in enumerate(names(axes)):
            i, j = (axes.index(axis) for axis in name[1:])
            B[:, :, i, s] += 0.5 * dN[:, :, j]
            B[:, :, j, s] += 0.5 * dN[:, :, i]
        measured = ~np.isnan(e)
        return cls(nodes, B, placed.x[rows], np.where(measured, e, 0.0), measured, names(axes), weight)

    def read(self, U: Any) -> Any:
        """(m, s), from the nodes' displacements U (m, k, d)."""
        return (self.B * U[..., None]).sum((1, 2))

    def residual(self, U: Any) -> Any:
        """w (S u - e) of what is measured, (m_measured,), holomorphic."""
        return self.weight * (self.read(U) - self.e)[self.measured]

    def forces(self, r: Array) -> Array:
        """Derivative of 1/2 |w (S u - e)|^2 with respect to U, (m, k, d), for its residual r."""
        by_e = np.zeros(self.measured.shape)
        by_e[self.measured] = self.weight * r
        return np.asarray(np.einsum("mkis,ms->mki", self.B, by_e))

    def matrix(self, index: Array, columns: int) -> Any:
        """S (m_measured, columns), sparse, of unknowns numbered by index (n_nodes, d)."""
        from scipy import sparse

        point, s = np.nonzero(self.measured)
        at, B = index[self.nodes[point]], self.B[point, :, :, s]  # (m_measured, k, d)
        row = np.broadcast_to(np.arange(len(point))[:, None, None], at.shape)
        return sparse.csr_array((B.ravel(), (row.ravel(), at.ravel())), shape=(len(point), columns))

    @property
    def said(self) -> str:
        """What shear strains are, where some are measured, else empty."""
        shear = [name for name, of in zip(self.names, self.measured.T, strict=True) if of.any() and name[1] != name[2]]
        return f"{', '.join(shear)}: half the change of the right angle, gamma/2" if shear else ""

    @property
    def quantities(self) -> Array:
        return np.array(self.names)[np.nonzero(self.measured)[1]]

    @property
    def positions(self) -> Array:
        return self.x[np.nonzero(self.measured)[0]]
