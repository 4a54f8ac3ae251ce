"""What is known of p after the data, and before: standard deviations under the Gaussian approximation.

exp(-J / sigma^2) with J = 1/2 |S u - d|^2 + alpha Phi is, about its maximum, a Gaussian whose precision is
(H^T H + alpha D^T W D) / sigma^2 = A^T A: alpha weighs Phi against the data, whatever their noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.problem import Array, Problem

EPS = float(np.finfo(np.float64).eps)
MOST = 3000  # parameters, or data where there is no prior: singular values of A then take a minute
SHARE = 1e-12  # |P_0 e_i|^2 up to which it is rounding that a direction without information shares in p_i


@dataclass(frozen=True, eq=False)
class Known:
    """Standard deviations (n_p,) after and before the data, nan where unbounded; why those after are not computed.

    prior_sd is None where there is no prior.
    """

    sd: Array
    prior_sd: Array | None = None
    why_not: str = ""


def known(problem: Problem, p: Array, H: Array | None, scale: Array, sigma: float) -> Known:
    """Of p, from H (m, n_p) of changes `scale`, None where it is not known whole, and the noise, 0 where it is not."""
    nothing, stated = np.full(len(p), np.nan), problem.prior(p)
    with_prior = stated is not None and stated[0].alpha > 0.0
    if not sigma:
        return Known(nothing, None, "no noise is known, hence no posterior - state one: --noise SIGMA")
    if H is None:
        return Known(nothing, None, "no posterior: H is known by products only")
    if (len(p) if with_prior else min(H.shape)) > MOST:
        return Known(nothing, None, f"no posterior of {len(p)} parameters: its covariance is dense, at most {MOST}")
    prior = prior_rows(problem, p, scale)
    if prior is None:
        return Known(scale * sigma * deviations(H))
    sd = deviations(np.concatenate([H, prior]))
    return Known(scale * sigma * sd, scale * sigma * prior_deviations(prior))


def prior_rows(problem: Problem, p: Array, scale: Array) -> Array | None:
    """sqrt(alpha W) D dtheta/dp diag(scale), (k, n_p), or None without a prior; W of total variation standing still."""
    stated = problem.prior(p)
    if stated is None or stated[0].alpha == 0.0:
        return None
    prior, theta, by_p = stated
    D = prior.differences(len(p)).toarray() * (by_p * scale)
    return np.asarray(np.sqrt(prior.alpha * prior.weights(theta))[:, None] * D)


def deviations(A: Array) -> Array:
    """sqrt(diag((A^T A)^{-1})), (n,), of A (k, n); nan where A leaves a component unbounded.

    By singular values of A: those of A^T A would lose half the digits.
    """
    sd = np.full(A.shape[1], np.nan)
    stated = A.any(axis=0)
    if not stated.any():
        return sd
    A = A[:, stated]
    _, s, V_T = np.linalg.svd(np.linalg.qr(A, mode="r") if len(A) > A.shape[1] else A, full_matrices=False)
    informed = s > max(A.shape) * EPS * s[0]
    s, V_T = s[informed], V_T[informed]
    bounded = 1.0 - (V_T**2).sum(axis=0) < SHARE
    sd[stated] = np.where(bounded, np.linalg.norm(V_T / s[:, None], axis=0), np.nan)
    return sd


def prior_deviations(A: Array) -> Array:
    """The same of prior rows alone. Differences of neighbours know no level: what they charge nothing is unbounded."""
    level_free = (np.count_nonzero(A, axis=1) > 1).any() or len(A) < A.shape[1]
    return np.full(A.shape[1], np.nan) if level_free else deviations(A)
