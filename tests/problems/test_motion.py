"""Rigid motion eliminated from J: against its minimum over the motion, by every exact route, and what is not seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import relative_error

from gradient_routes.bench.cases.case import routes
from gradient_routes.problems.block import Block
from gradient_routes.problems.data.motion import Motion
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.plate import Plate
from gradient_routes.routes.model import Model
from gradient_routes.routes.sensitivity import Sensitivity

SHIFT, TURN = np.array([0.01, -0.02, 0.03]), np.array([0.002, -0.001, 0.003])
NAMES = ("ux [m]", "uy [m]", "uz [m]", "rotation in yz [rad]", "rotation in zx [rad]", "rotation in xy [rad]")


def moved_block() -> tuple[Block, np.ndarray]:
    """A block whose data are those of p, moved rigidly, and p."""
    block = Block(n=2, derivatives="hand", unknown="layers", layers=2, data="twin", motion="rigid", sensors="right")
    p = np.array([0.1, -0.2])
    still = block.observed(Model(block.twin()).solve(p).u)
    x = still.data.probes[0].x
    rigid = SHIFT + np.cross(TURN, x - x.mean(axis=0))
    return still._with(replace(still.data, d=(still.data.d[0] + rigid,))), p


@pytest.fixture(scope="module")
def moved() -> tuple[Block, np.ndarray]:
    return moved_block()


def test_the_motion_is_found_and_the_rest_fits(moved: tuple[Block, np.ndarray]) -> None:
    block, p = moved
    u = Model(block).solve(p).u
    assert block.objective(u, p) < 1e-28
    found = block.data.moved(u, p)
    assert block.view(p, u, None).remarks[0].startswith(f"eliminated from J: {NAMES[0]} 0.01, ")
    assert tuple(found) == NAMES
    assert [*found.values()] == pytest.approx([*SHIFT, *TURN], abs=1e-12)


def test_J_is_the_least_over_the_motion(moved: tuple[Block, np.ndarray]) -> None:
    """By least squares over the modes, written down here."""
    block, p = moved[0], moved[1] + 0.3
    u, probes = Model(block).solve(p).u, block.data.probes[0]
    U = block.solid.displacements(u, block.solid.setup(p), 0, probes.nodes)
    r = (probes.read(U) - block.data.d[0]).ravel()
    x = probes.x - probes.x.mean(axis=0)
    modes = [np.broadcast_to(e, x.shape) for e in np.eye(3)] + [np.cross(e, x) for e in np.eye(3)]
    B = np.stack([mode.ravel() for mode in modes], axis=1)
    left = r + B @ np.linalg.lstsq(B, -r, rcond=None)[0]
    assert block.objective(u, p) == pytest.approx(0.5 * left @ left, rel=1e-12)


@pytest.mark.parametrize("route", ["adjoint", "tangent", "implicit-ad"])
def test_exact_routes_agree_with_complex_steps(moved: tuple[Block, np.ndarray], route: str) -> None:
    block, p = moved[0], moved[1] + 0.3
    gradients = []
    for each in routes([route, "complex-step"]):
        gradients.append(each.route.prepare(Model(block), p, **each.options)(p).gradient)
    assert relative_error(*gradients) < 1e-12


def test_the_gradient_is_H_transposed_times_the_residuals(moved: tuple[Block, np.ndarray]) -> None:
    block, p = moved[0], moved[1] + 0.3
    model = Model(block)
    state = model.solve(p)
    H, seen = Sensitivity(model, state), block.observation(state.u, p)
    r = seen.predicted - seen.data
    assert 0.5 * r @ r == pytest.approx(block.objective(state.u, p), rel=1e-12)
    (adjoint,) = routes(["adjoint"])
    assert relative_error(H.T @ r, adjoint.route.prepare(model, p)(p).gradient) < 1e-12
    assert relative_error(H.dense().T @ r, H.T @ r) < 1e-12
    assert seen.modes.shape == (len(r), 6)
    read = seen.whole.S_u @ state.u  # what the sensors read, motion and all
    assert read == pytest.approx(
        block.data.probes[0].read(block.data._probe_displacements(state.u, block.solid.setup(p))[0]).ravel()
    )


def test_weights_are_those_of_J() -> None:
    """The least over the motion of weighted squares is not that of plain ones."""
    rng = np.random.default_rng(0)
    x, r, w = rng.standard_normal((9, 2)), rng.standard_normal((9, 2)), rng.uniform(0.5, 2.0, (9, 2))
    measured = np.ones((9, 2), dtype=bool)
    motion = Motion.of("rigid", x, measured, w, turns=False)
    c = x - x.mean(axis=0)
    B = np.stack([w * [1.0, 0.0], w * [0.0, 1.0], w * np.stack([-c[:, 1], c[:, 0]], axis=1)], axis=-1).reshape(18, 3)
    m = np.linalg.lstsq(B, -(w * r).ravel(), rcond=None)[0]
    assert [*motion.of_residual((w * r)[measured]).values()] == pytest.approx(m, rel=1e-10)
    assert motion.projected((w * r)[measured]) == pytest.approx((w * r).ravel() + B @ m, rel=1e-10)


def test_what_data_do_not_tell_apart_is_nan() -> None:
    """Points on the x axis do not see a rotation about it."""
    x = np.stack([np.linspace(0.0, 1.0, 5), np.zeros(5), np.zeros(5)], axis=1)
    motion = Motion.of("rigid", x, np.ones(x.shape, dtype=bool), None, turns=False)
    found = motion.of_residual(-np.ravel(SHIFT + np.cross(TURN, x - x.mean(axis=0))))
    assert np.isnan(found["rotation in yz [rad]"])
    assert [found[name] for name in NAMES if "yz" not in name] == pytest.approx([*SHIFT, *TURN[1:]])


def test_a_body_of_revolution_moves_along_its_axis_alone() -> None:
    x = np.random.default_rng(1).uniform(size=(4, 2))
    assert Motion.of("rigid", x, np.ones(x.shape, dtype=bool), None, turns=True).names == ("uy [m]",)


@pytest.mark.parametrize("problem", [Block, Plate])
def test_data_that_are_all_motion_are_refused(tmp_path, problem) -> None:
    axes = "xyz"[: 3 if problem is Block else 2]
    corners = np.array(np.meshgrid(*[[0.2, 0.9]] * len(axes))).reshape(len(axes), -1).T
    lines = [",".join(map(str, [*x, *np.full(len(axes), 0.1)])) for x in corners]
    header = ",".join([*axes, *(f"u{axis}" for axis in axes)])
    (tmp_path / "d.csv").write_text("\n".join([header, *lines]))
    with pytest.raises(InputError, match="motion= leaves nothing of the data"):
        problem(n=2, data=str(tmp_path / "d.csv"), motion="translation")


def test_motion_is_of_data() -> None:
    with pytest.raises(InputError, match="motion"):
        Block(n=2, motion="rigid")
