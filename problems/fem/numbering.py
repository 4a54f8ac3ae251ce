"""Degrees of freedom at the nodes of small elements: gathered, scattered, and columns of derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class Numbering:
    """dofs (n_e, k), degrees of freedom 0..n-1 at the nodes of every element, -1 where u is given.

    entries (n, most)  flat indices of each degree of freedom in dofs; -1 where fewer than `most` elements meet
    """

    dofs: Array
    entries: Array

    @classmethod
    def of(cls, nodes: Array, free: Array) -> Numbering:
        """From nodes (n_e, k) of a mesh; free (n_nodes,) says which of them carry a degree of freedom."""
        dofs = np.where(free, np.cumsum(free) - 1, -1)[nodes]
        return cls(dofs, _inverse(dofs, int(free.sum())))

    def gather(self, u: Any, xp: Any = np, given: float = 0.0) -> Any:
        """u (n,) at the nodes of every element, (n_e, k), `given` where there is no degree of freedom."""
        return xp.append(u, given)[self.dofs]

    def scatter(self, R_e: Any, xp: Any = np) -> Any:
        """The sums (n,) of what elements give to their nodes, (n_e, k)."""
        return xp.append(R_e, 0.0)[self.entries].sum(axis=1)

    def means(self, values: Any, xp: Any = np) -> Any:
        """At each degree of freedom (n,), the mean of the values (n_e,) of the elements that meet there."""
        ones = np.ones(self.dofs.shape)
        return self.scatter(values[:, None] * ones, xp) / self.scatter(ones)

    def means_by(self, column: Array, count: int) -> Any:
        """Their derivative by values (count,) that elements share, sparse (n, count)."""
        ones = np.ones(self.dofs.shape)
        return self.columns(ones / self.gather(self.scatter(ones), given=1.0), column, count)

    def columns(self, by_e: Array, column: Array | None = None, count: int | None = None) -> Any:
        """The sparse (n, count) matrix with by_e[e] (k,) in the rows dofs[e] of the column of e, by default e."""
        from scipy.sparse import csr_array

        e, a = np.nonzero(self.dofs >= 0)
        at = e if column is None else column[e]
        shape = len(self.entries), len(self.dofs) if count is None else count
        return csr_array((by_e[e, a], (self.dofs[e, a], at)), shape=shape)

    def products(self, by_e: Array, column: Array, count: int) -> ByProducts:
        """The same matrix, not assembled: real."""

        def reverse(w: Array) -> Array:
            return np.bincount(column, (self.gather(w) * by_e).sum(axis=1), minlength=count)

        return ByProducts(lambda v: self.scatter(by_e * v[column][:, None]), reverse)


def _inverse(dofs: Array, n: int) -> Array:
    flat = dofs.ravel()
    order = np.argsort(flat, kind="stable")
    order = order[flat[order] >= 0]
    node = flat[order]
    first = np.searchsorted(node, np.arange(n))
    place = np.arange(len(node)) - first[node]
    entries = np.full((n, 1 + int(place.max(initial=0))), -1)
    entries[node, place] = order
    return entries
