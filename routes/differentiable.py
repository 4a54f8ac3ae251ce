"""A forward solve as a function that JAX differentiates: for the route implicit-ad, and for jax.grad in user code."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.problem import Array
from gradient_routes.routes.linearized_solve import LinearizedSolver
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State


class Solved:
    """A solved state on JAX's tape: its arrays u, p are leaves, its factors are a constant; lam once it is known."""

    def __init__(self, state: State) -> None:
        self.state = state
        self.lam: Array | None = None


jax.tree_util.register_pytree_node(
    # the leaves are declared so that they count as bytes of the tape; the object itself is passed on
    Solved,
    lambda solved: ((solved.state.u, solved.state.p), solved),
    lambda solved, leaves: solved,
)


def differentiable_solve(
    model: Model, factors: str = "refined", on_solved: Callable[[Solved], None] | None = None
) -> Callable[[Any], Any]:
    """p -> u(p) with R(u, p) = 0, to be differentiated by jax.grad or jax.vjp, eagerly (not under jit).

    The implicit function theorem is its pullback: u_bar -> R_p^T lam with R_u^T lam = -u_bar, one transposed
    solve with `factors` as LinearizedSolver takes them. `on_solved` is called with each state that a pullback holds.
    """
    R_p_transposed = model.compiled.R_p_transposed

    @jax.custom_vjp
    def solve(p: Any) -> Any:
        return jnp.asarray(model.solve(np.asarray(p)).u)

    def forward(p: Any) -> tuple[Any, Solved]:
        solved = Solved(model.solve(np.asarray(p)))
        if on_solved is not None:
            on_solved(solved)
        return jnp.asarray(solved.state.u), solved

    def backward(solved: Solved, u_bar: Any) -> tuple[Any]:
        lam = LinearizedSolver(model, solved.state, factors).solve_transposed(-np.asarray(u_bar))
        solved.lam = lam
        return (R_p_transposed(solved.state.u, solved.state.p, lam),)

    solve.defvjp(forward, backward)
    return solve


def held_bytes(pullback: Any) -> int:
    """Bytes of the arrays that a pullback of jax.vjp holds until it is called: the tape."""
    arrays = {id(leaf): leaf.nbytes for leaf in jax.tree.leaves(pullback)}
    return sum(arrays.values())
