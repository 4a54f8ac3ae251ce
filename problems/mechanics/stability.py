"""Over which stretches a fitted law is stable: its curve rises, and work of added stress on added strain is positive.

    dP_11/dlambda > 0 along the curve,    sum_i dtau_i deps_i > 0 for all deps_i = dlambda_i/lambda_i  (Drucker 1959)

with tau_i = lambda_i P_i, Kirchhoff's principal stresses; of constant volume, sum_i deps_i = 0 and the pressure does no
work. Derivatives are central differences: a compiled derivative would take longer than all of the fit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradient_routes.problems.mechanics.homogeneous import States
from gradient_routes.problems.problem import Array

STRETCHES = np.unique(np.append(np.geomspace(0.1, 10.0, 200), 1.0))
TRACELESS = np.array([[1.0, -1.0, 0.0], [0.5, 0.5, -1.0]])
H_STEP = 1e-5  # of differences: errors of 1e-10
NEWTON_STEPS = 20
Principal = Callable[[Array], Array]  # stresses P_i (m, 3) of diagonals of H = F - I, (m, 3)


def stable_range(P_of: Principal, mode: str, incompressible: bool) -> tuple[float, float] | None:
    """The least and greatest of STRETCHES about 1 that are stable; None if none is."""
    states = States.of([mode] * len(STRETCHES), STRETCHES)
    H = states.strains(states.isochoric if incompressible else _thinning(P_of, states))
    P = P_of(H)
    nominal = P[:, 0] - (states.isochoric + 1.0) / STRETCHES * P[:, 2] if incompressible else P[:, 0]
    rises = np.diff(nominal) > 0.0
    holds = _drucker(P_of, H, P, TRACELESS if incompressible else np.eye(3))
    low = high = int(np.searchsorted(STRETCHES, 1.0))
    if not holds[low]:
        return None
    while low > 0 and holds[low - 1] and rises[low - 1]:
        low -= 1
    while high < len(STRETCHES) - 1 and holds[high + 1] and rises[high]:
        high += 1
    return float(STRETCHES[low]), float(STRETCHES[high])


def _drucker(P_of: Principal, H: Array, P: Array, directions: Array) -> Array:
    """(m,), whether the quadratic form of dtau_i deps_i is positive definite in the directions (k, 3)."""
    work = []
    for v in directions:
        V = (1.0 + H) * v
        work.append((V * P + (1.0 + H) * _along(P_of, H, V)) @ directions.T)
    G = np.stack(work, axis=1)
    sound = np.isfinite(G).all(axis=(1, 2))
    G = np.where(sound[:, None, None], (G + G.swapaxes(1, 2)) / 2.0, 0.0)
    return np.asarray(np.linalg.eigvalsh(G)[:, 0] > 0.0)


def _along(P_of: Principal, H: Array, V: Array) -> Array:
    """The derivative of P in directions V, (m, 3)."""
    return (P_of(H + H_STEP * V) - P_of(H - H_STEP * V)) / (2.0 * H_STEP)


def _thinning(P_of: Principal, states: States) -> Array:
    """t - 1 where P_33 = 0, by Newton's method; NaN where it does not converge."""
    u = states.isochoric
    with np.errstate(all="ignore"):
        for _ in range(NEWTON_STEPS):
            H = states.strains(u)
            step = P_of(H)[:, 2] / _along(P_of, H, (1.0 + u)[:, None] * states.thinned)[:, 2] * (1.0 + u)
            u = np.maximum(u - step, (u - 1.0) / 2.0)  # t is halved at most
            wrong = ~(np.abs(step) <= 1e-9 * (1.0 + u))
            if not wrong.any():
                break
    return np.where(wrong, np.nan, u)
