"""Arrays of a problem in integers or in float32: what is whole is converted, what lacks digits is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from conftest import relative_error
from scipy.sparse import csr_array

from gradient_routes.bench.api import run
from gradient_routes.problems.errors import LowPrecision
from gradient_routes.problems.jax64 import jnp
from gradient_routes.problems.problem import Array, Linearization, Offers, Parameters, Problem, Traced
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.finite_difference import fd_central
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Route
from gradient_routes.routes.tangent import tangent
from gradient_routes.routes.unrolled_ad import unrolled_ad

NUMPY = ("initial", "residual", "tangent", "objective")
TRACED = ("residual", "objective")
ARRAYS = [*NUMPY, *(f.name for f in fields(Linearization)), *(f"traced {name}" for name in TRACED)]
KINDS = ("int64", "uint8", "bool", "float16", "float32", "complex64", "longdouble", "object")
ROUTES = (adjoint, tangent, complex_step, implicit_ad, unrolled_ad, fd_central)

K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
B = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


class Cast(Problem):
    """R = K u - B p, J = |u|^2/2 + 3 p_1 + p_2, with one array made another kind of number."""

    name = "cast"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    n_state = 3
    linear = True
    structure = "spd"
    parameters = Parameters(start=np.array([0.3, -0.2]), scale=np.ones(2))

    def __init__(self, array: str = "", kind: Callable[[Any], Any] = lambda A: A, sparse: bool = False) -> None:
        self.array, self.kind, self.sparse = array, kind, sparse

    def cast(self, array: str, A: Any) -> Any:
        return self.kind(A) if array == self.array else A

    def initial(self, p: Array) -> Array:
        return self.cast("initial", np.zeros(3, p.dtype))

    def residual(self, u: Array, p: Array) -> Array:
        return self.cast("residual", K @ u - B @ p)

    def tangent(self, u: Array, p: Array) -> Array:
        A = K.astype(np.result_type(u, p))
        return self.cast("tangent", csr_array(A) if self.sparse else A)

    def objective(self, u: Array, p: Array) -> Any:
        return self.cast("objective", 0.5 * u @ u + 3.0 * p[0] + p[1])

    def linearize(self, u: Array, p: Array) -> Linearization:
        R_p = csr_array(-B) if self.sparse else -B
        return Linearization(self.cast("R_p", R_p), self.cast("J_u", u), self.cast("J_p", np.array([3.0, 1.0])))

    def traced(self) -> Traced:
        return Traced(
            lambda u, p: self.cast("traced residual", K @ u - B @ p),
            lambda u, p: self.cast("traced objective", 0.5 * u @ u + 3.0 * p[0] + p[1]),
        )


EXACT = B.T @ np.linalg.solve(K, np.linalg.solve(K, B @ Cast.parameters.start)) + [3.0, 1.0]
WHOLE = ("initial", "tangent", "R_p", "J_p")  # of whole numbers at every u and p


def needed(array: str, route: Route) -> bool:
    """Whether a route asks a problem for an array."""
    if route is unrolled_ad and array in ("tangent", "objective"):
        return False  # conjugate gradients on the tape
    if array.startswith("traced"):
        return Offers.TRACE in route.needs
    return array not in ("R_p", "J_u", "J_p") or Offers.PARTIALS in route.needs


def gradient(problem: Problem, route: Route) -> Array:
    p = problem.parameters.start
    model = Model(problem)
    return route.prepare(model, p)(p).gradient


@pytest.mark.parametrize("route", ROUTES, ids=lambda route: route.name)
@pytest.mark.parametrize("sparse", [False, True], ids=["dense", "sparse"])
@pytest.mark.parametrize("array", WHOLE)
def test_whole_numbers_are_converted(array: str, sparse: bool, route: Route) -> None:
    """An integer J_p would truncate every product that is added to it."""
    problem = Cast(array, lambda A: A.astype(np.int64) if np.isrealobj(A) else A, sparse)
    assert relative_error(gradient(problem, route), EXACT) < 1e-9


@pytest.mark.parametrize("route", ROUTES, ids=lambda route: route.name)
@pytest.mark.parametrize("array", ARRAYS)
def test_numbers_of_fewer_digits_are_refused(array: str, route: Route) -> None:
    xp = jnp if array.startswith("traced") else np

    def half(A: Any) -> Any:
        complex_ = xp.iscomplexobj(A)
        return xp.asarray(A).astype(xp.complex64 if complex_ else xp.float32)

    problem = Cast(array, half)
    if not needed(array, route):
        assert relative_error(gradient(problem, route), EXACT) < 1e-9
        return
    with pytest.raises(LowPrecision, match=r"^cast: .* in (float32|complex64) - compute in float64 \(JAX: ") as told:
        gradient(problem, route)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("array", [name for name in ARRAYS if not name.startswith("traced")])
def test_every_array_is_of_64_bits_beyond_the_border(array: str, kind: str) -> None:
    """Or the problem is refused: nothing else comes in."""
    p = Cast.parameters.start
    model = Model(Cast(array, lambda A: np.asarray(A).astype(kind)))
    try:
        u = model.initial(p)
        state = Model(Cast()).solve(p)
        lin = model.linearize(state)
        found = [u, model.residual(u, p), model.tangent(u, p), model.objective(u, p), lin.R_p, lin.J_u, lin.J_p]
    except LowPrecision:
        refused = True
    else:
        refused = False
        assert {str(np.asarray(A).dtype) for A in found} == {"float64"}
    assert refused == (kind in ("float16", "float32", "complex64", "object"))


def test_a_row_says_what_lacks_digits() -> None:
    row = run(Cast("J_p", np.float32), "adjoint", timing=False).iloc[0]
    assert row["status"] == "failed"
    assert row["reason"].startswith("cast: J_p in float32 - compute in float64 (JAX: ")
