"""Central differences at h and 2 h, extrapolated: four solves a parameter, O(h^4). A route in one file."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np

from gradient_routes import Array, ForwardWork, Model, Offers, Result, Work, route

STEP = float(np.finfo(np.float64).eps) ** (1 / 5)  # balances the truncation h^4 against the round-off eps / h


def cost(n_p: int, forward: ForwardWork, **options: Any) -> Work:
    return forward.solves(4 * n_p)


@route("fd-extrapolated", needs=Offers.VALUE, cost=cost)
def fd_extrapolated(model: Model, p: Array, *, step: Annotated[float | None, "h_i / max(|p_i|, s_i)"] = None) -> Result:
    """(8 (J(p + h) - J(p - h)) - (J(p + 2 h) - J(p - 2 h))) / 12 h (Richardson 1911)."""
    h = (STEP if step is None else step) * model.parameters.natural(p)
    gradient = np.empty_like(p)
    for i in range(len(p)):
        J = {s: J_near(model, p, i, s * h[i]) for s in (-2, -1, 1, 2)}
        gradient[i] = (8 * (J[1] - J[-1]) - (J[2] - J[-2])) / (12 * h[i])
    return Result(None, gradient)


def J_near(model: Model, p: Array, i: int, h: float) -> float:
    q = p.copy()
    q[i] += h
    return model.value(model.parameters.check(q, "fd-extrapolated"))
