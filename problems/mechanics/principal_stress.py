"""Stresses of homogeneous states by the stored energies of `materials.py`, which are linear in their constants."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.mechanics.materials import LAWS


@dataclass(frozen=True, eq=False)
class Stress:
    """First Piola-Kirchhoff stresses P_11 and P_33 of diagonals of H (m, 3), real or complex, by the constants q.

    Every law is linear in them: P = B q. basis(H) is B (m, 2, n_q), along(H, V) its derivative in directions V (m, 3).
    """

    basis: Callable[[Any], Any]
    along: Callable[[Any, Any], Any]


@cache
def stress(law: str) -> Stress:
    """Of the stored energy of a law, compiled."""
    W, n_q = LAWS[law].W, len(LAWS[law].constants)

    def one(H: Any, q: Any, i: int) -> Any:
        direction = jnp.eye(3, dtype=H.dtype)[i]
        return jax.jvp(lambda H: W(jnp.diag(H), tuple(q)), (H,), (direction,))[1]

    def basis(H: Any) -> Any:
        """(2, n_q)."""
        return jnp.stack([jax.vmap(lambda q: one(H, q, i))(jnp.eye(n_q)) for i in (0, 2)])  # noqa: B023

    def along(H: Any, V: Any) -> Any:
        return jax.jvp(basis, (H,), (V.astype(H.dtype),))[1]

    return Stress(jax.jit(jax.vmap(basis)), jax.jit(jax.vmap(along)))
