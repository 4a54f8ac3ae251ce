"""The regularization alpha Phi(theta), a term of J."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

Phi = Literal["tikhonov", "tv", "amplitude"]
FieldPhi = Literal["tikhonov", "tv"]
PHI_WIDTH = 0.01  # jump of log E: 1 %


@dataclass(frozen=True, eq=False)
class Prior:
    """alpha Phi of theta (n,); D theta are the differences between neighbours.

    tikhonov   Phi = 1/2 |D theta|^2
    tv         Phi = sum of sqrt((D theta)_k^2 + width^2) - width, total variation rounded below jumps of `width`
    amplitude  Phi = 1/2 |theta - origin|^2, in units of `scale`

    pairs (m, 2) of neighbours; None: consecutive components.
    """

    alpha: float = 0.0
    kind: Phi = "tikhonov"
    width: float = PHI_WIDTH
    pairs: Array | None = None
    origin: Array | float = 0.0
    scale: Array | float = 1.0

    def check(self, who: str) -> None:
        """Raises InputError."""
        if not 0.0 <= self.alpha < math.inf:
            raise InputError(f"{who}: alpha={self.alpha:g} - a weight is finite and >= 0")
        if not 0.0 < self.width < math.inf:
            raise InputError(f"{who}: phi_width={self.width:g} - a jump is rounded over a width > 0")

    def jumps(self, theta: Any) -> Any:
        """D theta, (m,)."""
        if self.kind == "amplitude":
            return (theta - self.origin) / self.scale
        if self.pairs is None:
            return theta[1:] - theta[:-1]
        return theta[self.pairs[:, 0]] - theta[self.pairs[:, 1]]

    def value(self, xp: Any, theta: Any) -> Any:
        """alpha Phi, holomorphic. xp: numpy or jax.numpy."""
        jumps = self.jumps(theta)
        if self.kind == "tv":
            return self.alpha * xp.sum(xp.sqrt(jumps**2 + self.width**2) - self.width)
        return 0.5 * self.alpha * xp.sum(jumps**2)

    def gradient(self, theta: Array) -> Array:
        """alpha dPhi/dtheta = alpha D^T diag(weights) D theta, (n,), of theta's dtype if pairs is None."""
        flow = self.alpha * self.weights(theta) * self.jumps(theta)
        if self.kind == "amplitude":
            return np.asarray(flow / self.scale)
        gradient = np.zeros_like(theta)
        if self.pairs is None:
            gradient[1:] += flow
            gradient[:-1] -= flow
            return gradient
        np.add.at(gradient, self.pairs[:, 0], flow)
        np.subtract.at(gradient, self.pairs[:, 1], flow)
        return gradient

    def weights(self, theta: Array) -> Array:
        """(m,) in D^T diag(weights) D: the Hessian of Phi; for tv with lagged weights (Vogel & Oman 1996)."""
        jumps = self.jumps(theta)
        return np.asarray(1.0 / np.sqrt(jumps**2 + self.width**2) if self.kind == "tv" else np.ones_like(jumps))

    def residuals(self, theta: Array) -> tuple[Array, Array]:
        """rho (m,) with alpha Phi = 1/2 |rho|^2, and drho/d(D theta), (m,)."""
        jumps, root = self.jumps(theta), math.sqrt(self.alpha)
        if self.kind != "tv":
            return root * jumps, np.full_like(jumps, root)
        size = np.sqrt(jumps**2 + self.width**2)
        half = np.sqrt((size + self.width) / 2.0)  # |j| / sqrt(2 (size - width)), without its 0 / 0
        return root * jumps / half, root * half / size

    def differences(self, n: int) -> Any:
        """D as a sparse matrix (m, n)."""
        from scipy import sparse

        if self.kind == "amplitude":
            return sparse.diags_array(1.0 / np.broadcast_to(self.scale, n)).tocsr()
        pairs = self.pairs if self.pairs is not None else np.stack([np.arange(1, n), np.arange(n - 1)], axis=1)
        rows = np.repeat(np.arange(len(pairs)), 2)
        signs = np.tile([1.0, -1.0], len(pairs))
        return sparse.csr_array((signs, (rows, pairs.ravel())), shape=(len(pairs), n))
