"""The complex step: a derivative without a subtraction, so that the step can be tiny (Squire & Trapp 1998)."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array
from gradient_routes.routes.imaginary import RELATIVE_STEP, refuse_losses, refuse_zeros
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork, Gradient, Offers, Result, Work, route

POLISH = 1  # the imaginary part, a derivative, converges one Newton step after the real part, which is tested


def cost(n_p: int, forward: ForwardWork, **options: Any) -> Work:
    return forward.full(n_p, polish=POLISH)


@route("complex-step", needs=Offers.SOLVE | Offers.COMPLEX, cost=cost, staged=True)
def complex_step(model: Model, p: Array) -> Gradient:
    """dJ/dp_i = Im J(p + i h e_i) / h,  h = 1e-30 scale_i (1e-30 |p_i| where that is less).

    R and J are tested first, at a state whose solve is not counted, and components that are exactly 0 once, by solves
    that are not counted. Raises LostImaginaryPart.
    """
    tested: list[bool] = []
    refuse_losses(model.problem, Model(model.problem, model.solver).solve(p).u, p)
    scale = model.parameters.scale

    def gradient(p: Array) -> Result:
        g = np.empty_like(p)
        for i, h in enumerate(RELATIVE_STEP * np.where(p == 0.0, scale, np.minimum(np.abs(p), scale))):
            q = p.astype(np.complex128)
            q[i] += 1j * h
            state = model.solve(q, polish=POLISH)
            g[i] = state.J.imag / h
        if not tested:
            refuse_zeros(model.problem, Model(model.problem, model.solver).value, p, g)
            tested.append(True)
        return Result(float(state.J.real), g, state.u.real)

    return gradient
