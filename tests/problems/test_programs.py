"""What is compiled for one problem serves those that compute the same, and no other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conftest import relative_error

from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.programs import KEPT, LARGEST, program, shared
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.unrolled_ad import unrolled_ad

X = np.linspace(0.1, 0.9, 4)


def times(c: Any) -> Callable[[Any], Any]:
    return lambda x: jnp.sum(c * jnp.sin(x) ** 2)


def within(c: Any) -> Callable[[Any], Any]:
    """The constant in a function that is compiled apart."""
    return jax.jit(times(c))


def looped(c: Any) -> Callable[[Any], Any]:
    return lambda x: jax.lax.fori_loop(0, 3, lambda i, s: s + times(c)(x) * s, 1.0)


def branched(c: Any) -> Callable[[Any], Any]:
    return lambda x: jax.lax.cond(x[0] > 0.5, times(c), times(2.0), x)


def derived(c: Any) -> Callable[[Any], Any]:
    """c in a derivative that its author has given, which is not part of what is traced of the value."""

    @jax.custom_vjp
    def f(x: Any) -> Any:
        return times(1.0)(x)

    f.defvjp(lambda x: (f(x), x), lambda x, g: (g * c * x,))
    return f


def known(f: Callable[[Any], Any], x: Any = X) -> object:
    """The same object for functions that are taken to be the same."""
    return shared(lambda *functions: object(), "test", program(f, x))


@pytest.mark.parametrize("make", [times, within, looped, branched], ids=lambda make: make.__name__)
@pytest.mark.parametrize("c", [0.3, X, X[:1].astype(np.float32)], ids=["number", "array", "float32"])
def test_equal_constants_make_equal_programs_and_one_bit_makes_another(make: Any, c: Any) -> None:
    assert known(make(c)) is known(make(np.copy(c)[()]))
    assert known(make(c)) is not known(make(np.nextafter(c, c + 1)))
    assert known(make(c)) is not known(make(c), X[:-1] if np.ndim(c) == 0 or len(c) == 1 else X.astype(complex))


def test_signs_of_zero_and_operations_count() -> None:
    assert known(times(0.0)) is not known(times(-0.0))
    assert known(times(X)) is not known(lambda x: jnp.sum(X * jnp.cos(x) ** 2))
    assert known(lambda x: jnp.sum(x, axis=0)) is not known(lambda x: jnp.max(x, axis=0))
    assert known(lambda x: x - X) is not known(lambda x: X - x)


def test_derivatives_that_authors_give_are_never_shared() -> None:
    """Not even of one function: its derivative may have changed with what it reads."""
    f = derived(1.0)
    assert known(f) is not known(f)
    assert known(jax.jit(f)) is not known(jax.jit(f))


@pytest.mark.parametrize("make", [times, within], ids=lambda make: make.__name__)
def test_what_is_kept_has_constants_of_its_own(make: Any) -> None:
    c = X.copy()
    f = shared(lambda f: f, "kept", program(make(c), X))
    was = float(f(X))
    c *= 2.0
    assert float(f(X)) == float(jax.jit(f)(X)) == was
    assert shared(lambda f: f, "kept", program(make(X), X)) is f


def test_few_and_small_ones_are_kept() -> None:
    large = np.ones(LARGEST // 8 + 1)
    assert known(times(large), large) is not known(times(large), large)
    first = known(times(1.0))
    for k in range(KEPT):
        known(times(2.0 + k))
    assert known(times(1.0)) is not first


def test_problems_alike_share_what_is_compiled() -> None:
    alike = {id(Model(Bar(noise=0.1, seed=seed)).compiled) for seed in (1, 1)}
    others = {id(Model(Bar(noise=0.1, seed=2)).compiled), id(Model(Bar(alpha=0.1)).compiled), id(Model(Bar()).compiled)}
    assert (len(alike), len(others | alike)) == (1, 4)


def test_solids_alike_share_what_is_compiled_and_others_do_not() -> None:
    one, same, other = (Block(n=1, derivatives="ad", traction=t) for t in (0.2, 0.2, 0.3))
    assert one.solid.traced_residual is same.solid.traced_residual is not other.solid.traced_residual


@pytest.mark.parametrize("route", [implicit_ad, unrolled_ad], ids=lambda route: route.name)
def test_a_problem_that_is_changed_in_place_is_compiled_anew(route: Any) -> None:
    bar = Bar(n=5)
    p = bar.parameters.start + 0.1
    for d in (bar.sensors.d.copy(), 2.0 * bar.sensors.d):
        bar.sensors.d[:] = d
        g = route.prepare(Model(bar), p)(p).gradient
        assert relative_error(g, bar.reference(p).gradient) < 1e-9
