"""Unrolled AD: the gradient of the k-th iterate, its tape, and no NaN beyond convergence."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from conftest import relative_error, somewhere

from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import InputError, NotConverged
from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.problem import Array, Linearization, Offers, Parameters, Problem, Traced
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import ForwardWork
from gradient_routes.routes.solvers.traced_iterations import iteration, solution
from gradient_routes.routes.unrolled_ad import KEPT, unrolled_ad

INNER = tuple(KEPT)
OPEN = unrolled_ad.defaults


@pytest.mark.parametrize("k", [3, 6])
@pytest.mark.parametrize("inner", INNER)
def test_it_is_the_gradient_of_the_kth_iterate(inner: str, k: int) -> None:
    """Equal to central differences of the k-step objective, and not the gradient of the solution."""
    bar = Bar(n=6, sensors=6)
    p = somewhere(bar)
    traced, zero = bar.traced(), np.zeros(6)
    iterate = iteration(inner, traced)
    result = unrolled_ad.prepare(Model(bar), p, inner=inner, iterations=k)(p)

    @jax.jit
    def compiled(p: np.ndarray) -> jax.Array:
        return traced.objective(solution(iterate, zero, p, 1, k), p)

    def J_k(p: np.ndarray) -> float:
        return float(compiled(p))

    h = 1e-5
    fd = np.array([(J_k(p + h * e) - J_k(p - h * e)) / (2 * h) for e in np.eye(6)])
    assert relative_error(result.gradient, fd) < 1e-7  # h^2, and eps J / h
    assert result.J == pytest.approx(J_k(p), rel=1e-12)
    converged = inner == "cg" and k == 6  # conjugate gradients end after n_u steps
    assert (relative_error(result.gradient, bar.reference(p).gradient) < 1e-9) == converged
    assert (result.residual < 1e-10) == converged


@pytest.mark.parametrize("inner", INNER)
def test_the_iterate_is_the_textbook_one(inner: str) -> None:
    bar = Bar(n=5, sensors=5)
    p = somewhere(bar)
    K = np.column_stack([bar.tangent(p, p) @ e for e in np.eye(5)])
    u, r, d = np.zeros(5), bar.f.copy(), bar.f.copy()
    for _ in range(3):
        if inner == "cg":
            alpha = r @ r / (d @ K @ d)
            u, r_next = u + alpha * d, r - alpha * K @ d
            d, r = r_next + (r_next @ r_next) / (r @ r) * d, r_next
        else:
            w = 1 / np.diag(K) if inner == "jacobi" else 1 / float(bar.traced().spectral_bound(p))
            u = u + w * (bar.f - K @ u)
    np.testing.assert_allclose(iteration(inner, bar.traced()).iterate((np.zeros(5), p), 3), u, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("beyond", [1, 200])
@pytest.mark.parametrize("start", ["start", "somewhere"])
def test_conjugate_gradients_stand_still_after_convergence(start: str, beyond: int) -> None:
    bar = Bar(n=8)
    p = bar.parameters.start if start == "start" else somewhere(bar)
    result = unrolled_ad.prepare(Model(bar), p, inner="cg", iterations=8 + beyond)(p)
    assert relative_error(result.gradient, bar.reference(p).gradient) < 1e-10


@pytest.mark.parametrize("inner", INNER)
def test_default_iterations_are_what_the_tolerance_needs(inner: str) -> None:
    bar = Bar(n=6)
    p, model = somewhere(bar), Model(bar)
    k = unrolled_ad.resolve(model, p, **OPEN | {"inner": inner})["iterations"]
    enough = unrolled_ad.prepare(model, p, inner=inner, iterations=k)(p)
    short = unrolled_ad.prepare(model, p, inner=inner, iterations=k - 1)(p)
    assert enough.residual <= 2 * model.solver.rtol < 20 * short.residual  # 2: the residual carried along drifts
    assert short.residual > model.solver.rtol
    expected = unrolled_ad.expect(model, p, **OPEN | {"inner": inner})["iterations"]
    assert k / 5 < expected < 5 * k  # an estimate for a bill: Jacobi hardly feels the contrast it includes


@pytest.mark.parametrize("checkpoint", [None, 10])
@pytest.mark.parametrize("inner", INNER)
def test_the_tape_is_as_large_as_declared(inner: str, checkpoint: int | None) -> None:
    bar = Bar(n=500)
    p, options = bar.parameters.start, {"inner": inner, "checkpoint": checkpoint}
    tapes = [unrolled_ad.prepare(Model(bar), p, iterations=k, **options)(p).tape for k in (20, 40)]
    declared = unrolled_ad.tape(bar, iterations=20, newton=1, **options)
    assert tapes[1] - tapes[0] == declared  # bytes of 20 iterations, exactly; the rest does not grow
    assert tapes[0] - declared < 10 * 8 * 500


@cache
def after_30_iterations(inner: str, checkpoint: int | None) -> tuple[Array, int]:
    """The gradient and the products it took."""
    bar = Bar(n=40)
    model, p = Model(bar), somewhere(bar)
    g = unrolled_ad.prepare(model, p, inner=inner, iterations=30, newton=1, checkpoint=checkpoint)(p).gradient
    return g, model.tally.work.matvecs


@pytest.mark.parametrize(
    ("inner", "checkpoint"), [("cg", 1), ("cg", 4), ("cg", 7), ("cg", 30), ("richardson", 4), ("jacobi", 7)]
)
def test_checkpoints_change_the_bill_and_not_the_gradient(inner: str, checkpoint: int) -> None:
    """30 iterations: multiples of the distance, a remainder, one checkpoint only."""
    (whole, _), (g, products) = after_30_iterations(inner, None), after_30_iterations(inner, checkpoint)
    np.testing.assert_allclose(g, whole, rtol=1e-9, atol=1e-12 * abs(whole).max())
    assert products == 60 + 30 - 30 % checkpoint


@pytest.mark.parametrize(("problem", "newton", "k"), [(Bar(stop="softplus"), 1, 4), (Block(n=2), 2, 3)])
def test_conjugate_gradients_inside_newton_give_the_gradient_of_their_iterate(problem, newton: int, k: int) -> None:
    """Equal to central differences of the same few iterations, far from the solution."""
    p, traced = problem.parameters.start, problem.traced()
    iterate, u_0 = iteration("cg", traced), np.zeros(problem.n_state)
    result = unrolled_ad.prepare(Model(problem), p, inner="cg", iterations=k, newton=newton)(p)

    @jax.jit
    def J_k(p: np.ndarray) -> jax.Array:
        return traced.objective(solution(iterate, u_0, p, newton, k), p)

    h = 1e-5
    fd = np.array([float(J_k(p + h * e) - J_k(p - h * e)) / (2 * h) for e in np.eye(len(p))])
    assert relative_error(result.gradient, fd) < 1e-7  # h^2, and eps J / h
    assert relative_error(result.gradient, implicit_ad.prepare(Model(problem), p)(p).gradient) > 1e-3


def test_converged_conjugate_gradients_inside_newton_give_the_gradient_of_the_solution() -> None:
    bar = Bar(n=4, stop="softplus")
    p, model = bar.parameters.start, Model(bar)
    options = unrolled_ad.resolve(model, p, **OPEN | {"inner": "cg"})
    assert options["newton"] == model.solve(p).work.newton_iterations
    result = unrolled_ad.prepare(model, p, **options)(p)
    assert relative_error(result.gradient, implicit_ad.prepare(Model(bar), p)(p).gradient) < 1e-9
    each = (result.tape - unrolled_ad.prepare(model, p, **options | {"iterations": 10})(p).tape) / (
        unrolled_ad.tape(bar, **options) - unrolled_ad.tape(bar, **options | {"iterations": 10})
    )
    assert each == 1.0


@pytest.mark.parametrize("k", [1, 2, 3])
def test_the_newton_loop_gives_the_gradient_of_the_kth_newton_iterate(k: int) -> None:
    """Equal to a complex step through k Newton steps written here, and not the gradient of the solution."""
    block = Block(n=2)
    p = block.parameters.start
    result = unrolled_ad.prepare(Model(block), p, inner="direct", iterations=k)(p)

    def u_k(q: np.ndarray) -> np.ndarray:
        u = block.initial(q)
        for _ in range(k):
            u = u - np.linalg.solve(block.tangent(u, q).full().toarray(), block.residual(u, q))
        return u

    h = 1e-30
    steps = [p + 1j * h * e for e in np.eye(len(p))]
    exact = np.array([block.objective(u_k(q), q).imag / h for q in steps])
    assert relative_error(result.gradient, exact) < 1e-11  # cond(R_u) eps of two solvers
    solution = implicit_ad.prepare(Model(block), p)(p).gradient
    assert relative_error(result.gradient, solution) > (1e-3, 1e-5, 1e-9)[k - 1]


class Arctan(Problem):
    """R = arctan(s (u - p)), J = u^2/2: full Newton steps from afar fly apart, the line search halves them."""

    name = "arctan"
    offers = Offers.LINEARIZE | Offers.TRACE
    n_state = 2
    parameters = Parameters(start=np.array([2.0, -3.0]), scale=np.ones(2))
    s = np.array([1.0, 2.0])

    def residual(self, u: Array, p: Array, xp=np) -> Array:
        return xp.arctan(self.s * (u - p))

    def tangent(self, u: Array, p: Array) -> Array:
        return np.diag(self.s / (1.0 + (self.s * (u - p)) ** 2))

    def objective(self, u: Array, p: Array) -> float:
        return 0.5 * u @ u

    def linearize(self, u: Array, p: Array) -> Linearization:
        return Linearization(-self.tangent(u, p), u, np.zeros(2))

    def traced(self) -> Traced:
        return Traced(lambda u, p: self.residual(u, p, jnp), self.objective)


def test_the_tape_has_the_step_lengths_of_the_forward_solve() -> None:
    problem = Arctan()
    p, model = problem.parameters.start, Model(problem)
    state = model.solve(p)
    assert state.work.residuals > state.work.newton_iterations + 1  # steps were halved
    k = unrolled_ad.resolve(model, p, **OPEN)["iterations"]
    gradient = unrolled_ad.prepare(model, p, inner="direct", iterations=k)
    before = model.tally.work
    result = gradient(p)
    np.testing.assert_array_equal(result.u, state.u)
    assert result.residual == state.residual
    assert relative_error(result.gradient, p) < 1e-9
    counted = model.tally.work - before
    assert counted == unrolled_ad.cost(
        2, ForwardWork(state.work, linear=False), **OPEN | {"inner": "direct", "iterations": k}
    )


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_the_gradient_of_an_iterate_of_damped_steps_is_that_of_a_difference(k: int) -> None:
    problem = Arctan()
    p = problem.parameters.start
    iterates = unrolled_ad.prepare(Model(problem), p, inner="direct", iterations=k)
    lengths = [step.a for step in Model(problem).newton_iterates(p, k)[0]]
    assert min(lengths) < 1.0

    def u_k(q: np.ndarray) -> np.ndarray:
        u = np.zeros(2)
        for a in lengths:
            u = u - a * np.linalg.solve(problem.tangent(u, q), problem.residual(u, q))
        return u

    h = 1e-6
    fd = [(u_k(p + h * e) @ u_k(p + h * e) - u_k(p - h * e) @ u_k(p - h * e)) / (4 * h) for e in np.eye(2)]
    assert relative_error(iterates(p).gradient, np.array(fd)) < 1e-7
    np.testing.assert_allclose(iterates(p).u, u_k(p), rtol=1e-13)


def test_a_block_pressed_by_damped_steps_has_the_gradient_of_its_solution() -> None:
    block = Block(n=2, traction=-1.0)
    p, model = block.parameters.start, Model(block)
    state = model.solve(p)
    assert state.work.residuals > state.work.newton_iterations + 1
    result = unrolled_ad.prepare(model, p, inner="direct", iterations=state.work.newton_iterations)(p)
    np.testing.assert_array_equal(result.u, state.u)
    assert relative_error(result.gradient, implicit_ad.prepare(Model(block), p)(p).gradient) < 1e-8


def test_an_iteration_that_gets_stuck_has_no_gradient() -> None:
    """Beyond the load that this block bears the line search finds no step, nor does the tape."""
    block = Block(n=2, traction=-3.0)
    p = block.parameters.start
    with pytest.raises(NotConverged, match=r"block: not converged in . steps: \|R\| / \|R_0\| = "):
        unrolled_ad.prepare(Model(block), p, inner="direct", iterations=40)(p)


def test_the_tape_of_the_newton_loop_holds_the_factors_of_every_step() -> None:
    block = Block(n=2)
    p, model = block.parameters.start, Model(block)
    tapes = [unrolled_ad.prepare(model, p, inner="direct", iterations=k)(p).tape for k in (2, 4)]
    factors = model.solve(p).factors.nbytes
    arrays = 8 * (2 * block.n_state + len(p))  # u, du and p of a step
    assert tapes[1] - tapes[0] == pytest.approx(2 * (factors + arrays), rel=0.1)  # p is shared, u counted once


def test_wrong_iterations_are_wrong_usage() -> None:
    for k in (0, -5):
        with pytest.raises(InputError, match="choose at least 1"):
            unrolled_ad.check(inner="cg", iterations=k, newton=None, checkpoint=None)
        with pytest.raises(InputError, match="choose at least 1"):
            unrolled_ad.check(inner="cg", iterations=None, newton=None, checkpoint=k)
    with pytest.raises(InputError, match="inner=direct"):
        unrolled_ad.check(inner="direct", iterations=None, newton=2, checkpoint=None)
    keeps = {"inner": "direct", "iterations": None, "newton": None, "checkpoint": 2}
    assert "there are none in time" in str(unrolled_ad.missing(Bar(n=3), **keeps))
