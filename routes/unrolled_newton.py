"""Newton's steps on JAX's tape, factors of every step kept: the direct form of unrolled AD."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton_steps import Step


class TapedStep:
    """A Newton step on the tape: arrays u, p, du as leaves, its length and factors of R_u(u, p) as constants."""

    def __init__(self, u: Any, p: Any, step: Step) -> None:
        self.u, self.p, self.du, self.step = u, p, jnp.asarray(step.du), step


# the leaves are declared so that they count as bytes of the tape; the object itself is passed on
jax.tree_util.register_pytree_node(TapedStep, lambda kept: ((kept.u, kept.p, kept.du), kept), lambda kept, leaves: kept)


class UnrolledNewton:
    """u_k(p) by the Newton steps that were taken, line search included; differentiable by jax.vjp, eagerly.

    One step is u' = u - a du, R_u du = R, its length a held. Differentiating it, R_u included, gives for an incoming
    u'_bar

        R_u^T w = -a u'_bar,    (u_bar, p_bar) = (u'_bar, 0) + w^T d[R - R_u du]/d(u, p)

    with du held: one transposed solve with the step's own factors, and products with second derivatives of R.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self._pullback = model.compiled.step_transposed

    def __call__(self, steps: Sequence[Step], p: Any) -> Any:
        u = jnp.asarray(steps[0].u)
        for step in steps:
            u = self._taped(step)(u, p)
        return u

    def _taped(self, step: Step) -> Callable[[Any, Any], Any]:
        taken = jax.custom_vjp(lambda u, p: jnp.asarray(step.after))
        taken.defvjp(lambda u, p: (jnp.asarray(step.after), TapedStep(u, p, step)), self._backward)
        return taken

    def _backward(self, kept: TapedStep, u_bar: Any) -> tuple[Any, Any]:
        w = self.model.solve_transposed(kept.step.factors, -kept.step.a * np.asarray(u_bar))
        by_u, by_p = self._pullback(kept.u, kept.p, kept.du, w)
        return u_bar + by_u, by_p
