"""The complex step: a derivative without a subtraction, so that the step can be tiny (Squire & Trapp 1998)."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Offers, Result, Work, route

RELATIVE_STEP = 1e-30  # its square is far below eps, itself far above the smallest float

POLISH = 1  # the imaginary part, a derivative, converges one Newton step after the real part, which is tested


def cost(n_p: int, forward: ForwardWork, **options: Any) -> Work:
    return forward.full(n_p, polish=POLISH)


@route("complex-step", needs=Offers.SOLVE | Offers.COMPLEX, cost=cost)
def complex_step(model: Model, p: Array) -> Result:
    """dJ/dp_i = Im J(p + i h e_i) / h,  h = 1e-30 scale_i (1e-30 |p_i| where that is less)."""
    gradient = np.empty_like(p)
    scale = model.parameters.scale
    for i, h in enumerate(RELATIVE_STEP * np.where(p == 0.0, scale, np.minimum(np.abs(p), scale))):
        q = p.astype(np.complex128)
        q[i] += 1j * h
        J = model.solve(q, polish=POLISH).J
        gradient[i] = J.imag / h
    return Result(float(J.real), gradient)
