"""Phi(p), the prior. Its weight alpha stands in J and nowhere else."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.problem import Array


def tikhonov(xp: Any, theta: Any) -> Any:
    """Phi = 1/2 |D theta|^2, D the differences of neighbours on a line; 0 for a single one. xp: numpy or jax.numpy."""
    return 0.5 * xp.sum((theta[1:] - theta[:-1]) ** 2)


def tikhonov_gradient(theta: Array) -> Array:
    """dPhi/dtheta = D^T D theta, (n,)."""
    D_theta = np.diff(theta)
    gradient = np.zeros_like(theta)
    gradient[1:] += D_theta
    gradient[:-1] -= D_theta
    return gradient


def tikhonov_between(xp: Any, theta: Any, pairs: Array) -> Any:
    """Phi = 1/2 sum over pairs (m, 2) of neighbours of (theta_i - theta_j)^2. xp: numpy or jax.numpy."""
    return 0.5 * xp.sum((theta[pairs[:, 0]] - theta[pairs[:, 1]]) ** 2)


def tikhonov_between_gradient(theta: Array, pairs: Array) -> Array:
    """dPhi/dtheta, (n,)."""
    jumps = theta[pairs[:, 0]] - theta[pairs[:, 1]]
    return np.bincount(pairs[:, 0], jumps, len(theta)) - np.bincount(pairs[:, 1], jumps, len(theta))
