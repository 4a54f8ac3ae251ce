"""Iterations on K du = f with traceable steps: what unrolled AD puts on its tape.

A system is given by at = (u, p): K = R_u(u, p), f = -R(u, p). Linear problems are solved by the iterations of one
system, nonlinear ones by those of every Newton step. They start at du = 0, so r = f. Each step costs one product with
K; each carries its residual r along.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from jax.extend.core import jaxprs_in_params

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.problem import Traced

PRODUCTS = ("gradient_routes_matvec", "gradient_routes_matvec_transposed")
CONVERGED = 1e-30  # |r| / |f| at which CG ends: the next step would be 0 / 0


@dataclass(frozen=True)
class Iteration:
    """start(at) -> carry and step(at, carry) -> carry; a carry is a tuple that begins with (du, r)."""

    start: Callable[[Any], tuple[Any, ...]]
    step: Callable[[Any, tuple[Any, ...]], tuple[Any, ...]]

    def iterate(self, at: Any, k: int, checkpoint: int | None = None) -> Any:
        """du_k (n_u,) by jax.lax.scan, differentiable.

        With `checkpoint` c only every c-th carry is kept for the backward sweep; those between are recomputed.
        """

        def steps(carry: Any, count: int) -> Any:
            return jax.lax.scan(lambda carry, _: (self.step(at, carry), None), carry, None, length=count)[0]

        carry = self.start(at)
        if checkpoint is not None:
            leap = jax.checkpoint(lambda carry: steps(carry, checkpoint))
            carry = jax.lax.scan(lambda carry, _: (leap(carry), None), carry, None, length=k // checkpoint)[0]
            k %= checkpoint
        return steps(carry, k)[0] if k else carry[0]

    def iterations_to(self, at: Any, rtol: float, at_most: int) -> int:
        """The smallest k with |r_k|_inf <= rtol |f|_inf, or at_most."""
        return int(self._count(at, rtol, at_most))

    @cached_property
    def _count(self) -> Callable[[Any, float, int], Any]:
        @jax.jit
        def count(at: Any, rtol: Any, at_most: Any) -> Any:
            carry = self.start(at)
            target = rtol * jnp.abs(carry[1]).max()

            def unfinished(loop: Any) -> Any:
                (_, r, *_), k = loop
                return (jnp.abs(r).max() > target) & (k < at_most)

            return jax.lax.while_loop(unfinished, lambda loop: (self.step(at, loop[0]), loop[1] + 1), (carry, 0))[1]

        return count


def solution(iteration: Iteration, u_0: Any, p: Any, newton: int, k: int, checkpoint: int | None = None) -> Any:
    """u after `newton` steps u <- u + du_k from u_0, k iterations each."""

    def step(u: Any, _: Any) -> Any:
        return u + iteration.iterate((u, p), k, checkpoint), None

    return step(u_0, None)[0] if newton == 1 else jax.lax.scan(step, u_0, None, length=newton)[0]


def iteration(inner: str, traced: Traced) -> Iteration:
    """The iteration `inner`: cg, richardson or jacobi."""
    matvec = product_with_R_u(traced)

    def first_residual(at: Any) -> Any:
        return -traced.residual(*at)

    if inner == "cg":
        return conjugate_gradients(matvec, first_residual)
    weight = _known(traced.diagonal if inner == "jacobi" else traced.spectral_bound)
    return stationary(matvec, first_residual, weight=lambda at: 1.0 / weight(at[1]))


def _known(function: Callable[[Any], Any] | None) -> Callable[[Any], Any]:
    assert function is not None, "the route rejects problems that lack it"
    return function


def conjugate_gradients(matvec: Callable[[Any, Any], Any], f: Callable[[Any], Any]) -> Iteration:
    """Hestenes & Stiefel 1952. After convergence the iterate stays constant: no 0/0 in it nor in its derivative.

    Apart from `krylov.ConjugateGradients`, because a tape needs other steps than a solve:
    - every branch is a `where`, the iteration has no end and no breakdown;
    - alpha = r.d / d.Kd equals r.r / d.Kd only while rounding leaves r.d = r.r, but minimizes along d always; on
      ill-conditioned K its reverse sweep loses up to five digits less. Both amplify rounding there, without bound: the
      iterate then converges and its gradient by AD does not;
    - r.d is carried along instead of r, so that the tape keeps three vectors an iteration, not four.
    """

    def start(at: Any) -> tuple[Any, ...]:
        r = f(at)
        return jnp.zeros_like(r), r, r, r @ r, r @ r, r @ r

    def step(at: Any, carry: tuple[Any, ...]) -> tuple[Any, ...]:
        u, r, d, rr, rd, ff = carry
        Kd = matvec(at, d)
        # the unused branch of a `where` enters the derivative, too: its numbers must be finite
        moving = rr > CONVERGED**2 * ff
        alpha = jnp.where(moving, rd / jnp.where(moving, d @ Kd, 1.0), 0.0)
        u, r = u + alpha * d, r - alpha * Kd
        rr_next = r @ r
        beta = jnp.where(moving, rr_next / jnp.where(moving, rr, 1.0), 0.0)
        # r.d of the next step from the old d
        return u, r, r + beta * d, rr_next, rr_next + beta * (r @ d), ff

    return Iteration(start, step)


def stationary(matvec: Callable[[Any, Any], Any], f: Callable[[Any], Any], weight: Callable[[Any], Any]) -> Iteration:
    """u <- u + w r: Richardson's iteration where w is a number, Jacobi's where it is 1 / diag K."""

    def start(at: Any) -> tuple[Any, ...]:
        r = f(at)
        return jnp.zeros_like(r), r, weight(at)

    def step(at: Any, carry: tuple[Any, ...]) -> tuple[Any, ...]:
        u, r, w = carry
        du = w * r
        return u + du, r - matvec(at, du), w

    return Iteration(start, step)


def product_with_R_u(traced: Traced) -> Callable[[Any, Any], Any]:
    """(at, v) -> R_u v. Its pullback, by at = (u, p) and v, is one transposed product; both can be counted by name."""

    def matvec(at: Any, v: Any) -> Any:
        u, p = at
        return jax.jvp(lambda u: traced.residual(u, p), (u,), (v,))[1]

    def matvec_transposed(at: Any, v: Any, w: Any) -> Any:
        return jax.vjp(matvec, at, v)[1](w)

    matvec.__name__, matvec_transposed.__name__ = PRODUCTS  # a problem's own functions are not counted
    named, named_transposed = jax.jit(matvec), jax.jit(matvec_transposed)
    product = jax.custom_vjp(named)
    product.defvjp(lambda at, v: (named(at, v), (at, v)), lambda kept, w: named_transposed(*kept, w))
    return product


def count_products(jaxpr: Any) -> int:
    """Products with R_u or its transpose that a traced program executes, read from the program itself.

    Products are in innermost loops only: what JAX has moved out of a loop under the name of the product is common to
    the products in the loop.
    """
    return _count(jaxpr)[1]


def _count(jaxpr: Any) -> tuple[int, int]:
    """Products of a run of this jaxpr outside loops and inside them."""
    outside = inside = 0
    for eqn in jaxpr.eqns:
        if eqn.params.get("name") in PRODUCTS:
            outside += 1
            continue
        for inner in jaxprs_in_params(eqn.params):
            loose, looped = _count(inner)
            if eqn.primitive.name == "scan":
                loose, looped = 0, eqn.params["length"] * (looped or loose)
            outside, inside = outside + loose, inside + looped
    return outside, inside
