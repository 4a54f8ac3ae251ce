"""What JAX compiles of R and J: once for all routes, points and problems by which it is the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from gradient_routes.problems.jax64 import jax
from gradient_routes.problems.problem import Array, Traced
from gradient_routes.problems.programs import program, shared


@dataclass(frozen=True)
class Unrolled:
    """sweep(u_0, p) -> J, pullback and u_k; sweep_back(pullback) -> dJ/dp; how many products with R_u both take."""

    sweep: Callable[..., Any]
    sweep_back: Callable[..., Any]
    products: int


class Compiled:
    """R(u, p) and J(u, p) of a problem, `traced`, of arrays like u and p, with products of the derivatives."""

    def __init__(self, traced: Traced, u: Any, p: Any) -> None:
        self.traced, self._at = traced, (u, p)
        self.objective = jax.jit(traced.objective)
        self.R_p_transposed = jax.jit(partial(_R_p_transposed, traced.residual))
        self.step_transposed = jax.jit(partial(_step_transposed, traced.residual))
        self.iteration = cache(self._iteration)
        self.unrolled = cache(self._unrolled)

    def _iteration(self, inner: str) -> Any:
        from gradient_routes.routes.solvers.traced_iterations import iteration

        return iteration(inner, self.traced)

    def _unrolled(self, inner: str, k: int, newton: int, checkpoint: int | None) -> Unrolled:
        """Every linear iteration of every Newton step, by jax.lax.scan."""
        from gradient_routes.routes.solvers.traced_iterations import count_products, solution

        iterate = self.iteration(inner)

        def J(u_0: Any, p: Any) -> tuple[Any, Any]:
            u = solution(iterate, u_0, p, newton, k, checkpoint)
            return self.traced.objective(u, p), u

        forward = jax.jit(lambda u_0, p: jax.vjp(partial(J, u_0), p, has_aux=True)).trace(*self._at)
        backward = jax.jit(lambda pullback: pullback(1.0)[0]).trace(forward.out_info[1])
        products = count_products(forward.jaxpr) + count_products(backward.jaxpr)
        return Unrolled(forward.lower().compile(), backward.lower().compile(), products)


def compiled(traced: Traced, u: Array, p: Array) -> tuple[Compiled, tuple[Any, Any]]:
    """Of functions of arrays like u and p; and the types of R and J."""
    R, J = program(traced.residual, u, p), program(traced.objective, u, p)
    by_p = [None if f is None else program(f, p) for f in (traced.diagonal, traced.spectral_bound)]
    made = shared(lambda *functions: Compiled(Traced(*functions), *R.in_avals), "routes", R, J, *by_p)
    return made, (R.out_avals[0].dtype, J.out_avals[0].dtype)


def _R_p_transposed(R: Any, u: Any, p: Any, lam: Any) -> Any:
    return jax.vjp(lambda p: R(u, p), p)[1](lam)[0]


def _step_transposed(R: Any, u: Any, p: Any, du: Any, w: Any) -> Any:
    """w^T d[R - R_u du]/d(u, p), du held."""

    def linearized(u: Any, p: Any) -> Any:
        value, along = jax.jvp(lambda u: R(u, p), (u,), (du,))
        return value - along

    return jax.vjp(linearized, u, p)[1](w)
