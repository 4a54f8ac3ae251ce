"""Loads by direction and by total force: the same body turned, resultants, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.plate import Plate
from gradient_routes.problems.problem import Problem
from gradient_routes.routes.model import Model

SOFT = {"n": 2, "modulus": 1.0, "derivatives": "hand"}


def resultant(problem) -> np.ndarray:
    return problem.solid.dead_forces(problem.solid.base, 0, np).sum(axis=(0, 1))


def stretch(problem: Problem, face: str, axis: int) -> np.ndarray:
    """Displacements of a face along an axis, sorted."""
    u, nodes = Model(problem).solve(problem.parameters.start).u, problem.mesh.boundary(face).node_set
    U = problem.solid.displacements(u, problem.solid.setup(problem.parameters.start), 0, nodes)
    return np.sort(U[:, axis])


def test_a_body_that_is_turned_is_stretched_the_same() -> None:
    up = Block(**SOFT)
    for direction in ("x", "normal", "2,0,0"):
        aside = Block(**SOFT, clamped="left", loaded="right", direction=direction)
        np.testing.assert_allclose(stretch(aside, "right", 0), stretch(up, "top", 2), rtol=1e-9)
    down = Block(**SOFT, clamped="top", loaded="bottom", direction="normal")
    np.testing.assert_allclose(-stretch(down, "bottom", 2)[::-1], stretch(up, "top", 2), rtol=1e-9)


def test_a_grip_moves_along_its_direction() -> None:
    block = Block(**SOFT, load="displacement", displacement=0.1, direction="0,0.6,-0.8")
    assert stretch(block, "top", 1) == pytest.approx(0.06)
    assert stretch(block, "top", 2) == pytest.approx(-0.08)


def test_a_force_is_the_resultant() -> None:
    for problem, expected in (
        (Block(n=2, size="1,2,3", force=0.6, direction="-z"), (0.0, 0.0, -0.6)),
        (Plate(n=2, size="1,2", thickness=0.1, force=0.6, direction="3,4"), (0.36, 0.48)),
    ):
        assert resultant(problem) == pytest.approx(expected, abs=1e-14)
        assert problem.solid.base.load == pytest.approx(0.3 if len(expected) == 3 else 6.0)


def test_unknown_tractions_start_along_the_direction() -> None:
    block = Block(n=2, unknown="traction", traction=-0.2, direction="0,0.6,0.8")
    t = block.parameters.start.reshape(-1, 3)
    assert t == pytest.approx(np.broadcast_to([0.0, -0.12, -0.16], t.shape))
    assert block.parameters.scale == pytest.approx(np.full(t.size, 0.2))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"direction": "up"}, "give x, y, z, normal, or 3 numbers such as 0,0,-1"),
        ({"direction": "0,0,0"}, "direction=0,0,0"),
        ({"direction": "1,2"}, "direction=1,2"),
        ({"direction": "x", "cases": 2}, "direction"),
        ({"direction": "x", "load": "follower"}, "direction"),
        ({"force": float("nan")}, "finite"),
        ({"force": 1.0, "traction": 1.0}, "traction does not go with force"),
        ({"force": 1.0, "load": "displacement"}, "force"),
    ],
)
def test_what_cannot_be_is_one_line(options: dict, says: str) -> None:
    with pytest.raises(InputError, match=says) as refused:
        Block(n=1, **options)
    assert "\n" not in str(refused.value)


def test_the_normal_of_a_curved_face_is_refused() -> None:
    with pytest.raises(InputError, match="not flat"):
        Plate(body="hole", loaded="hole", direction="normal")
