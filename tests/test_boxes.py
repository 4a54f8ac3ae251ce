"""The truth about black boxes, by complex steps: right gradients are right, wrong ones are wrong where it is said."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from benchmarks.boxes.box import Box, Model, Truth
from benchmarks.boxes.families import FAMILIES
from benchmarks.boxes.faults import natural
from gradient_routes.bench.verification.result import Verdict
from gradient_routes.problems.problem import Array

BOXES = {name: family.boxes(0) for name, family in FAMILIES.items()}
ALL = [box for boxes in BOXES.values() for box in boxes]
VERDICTS = {*get_args(Verdict), "unrepeatable"}
ZERO = 1e-4  # of the gradient beside a stationary point: below it the gradient there is 0
CORRECT = 1e-6  # relative error of a component that is right beside wrong ones


def widths(box: Box) -> Array:
    return natural(Model(box.objective, box.gradient, box.start, box.options))


def beside(box: Box) -> Array:
    """A point some 5 % away, within the bounds."""
    rng, p = np.random.default_rng(1), box.start
    away = 0.05 * widths(box) * rng.uniform(0.5, 1.5, len(p)) * rng.choice([-1.0, 1.0], len(p))
    lower, upper = box.options.get("bounds", (-np.inf, np.inf))
    return np.clip(p + np.where((p + away < lower) | (p + away > upper), -away, away), lower, upper)


def slopes(box: Box, p: Array) -> Array:
    """dJ/dp of the J that is meant, by complex steps."""
    assert box.smooth is not None
    steps = 1e-30 * np.diag(widths(box))
    with np.errstate(all="ignore"):
        return np.array([np.imag(box.smooth(p + 1j * step)) / step.sum() for step in steps])


def asked(box: Box) -> tuple[list[tuple[Array, Array]], float]:
    """Pairs of gradient and slopes, in natural changes, at p and beside it, before and after other calls; and by how
    much J(p) changed, relative to the gradient.
    """
    p, q, w = box.start, beside(box), widths(box)
    exact = {0: slopes(box, p) * w if not box.kinked else np.full(len(p), np.nan), 1: slopes(box, q) * w}
    first, pairs = box.objective(p.copy()), []
    for elsewhere, at in ((0, 0), (1, 0), (0, 0), (0, 1), (1, 0)):
        box.objective((p, q)[elsewhere].copy())
        g = np.array(box.gradient((p, q)[at].copy()), dtype=float) * w
        if not (box.kinked and at == 0):
            pairs.append((g, exact[at]))
    size = max(float(np.linalg.norm(e)) for _, e in pairs)
    return pairs, abs(box.objective(p.copy()) - first) / (size or 1.0)


def whole(pairs: list[tuple[Array, Array]]) -> float:
    """The largest relative error."""
    floor = ZERO * max(float(np.linalg.norm(exact)) for _, exact in pairs)
    return max(
        float(np.linalg.norm(g - exact)) / (max(float(np.linalg.norm(exact)), floor) or 1.0) for g, exact in pairs
    )


def by_component(pairs: list[tuple[Array, Array]]) -> Array:
    """(n_p,) the largest relative error of every component."""
    size = max(float(np.linalg.norm(exact)) for _, exact in pairs)
    errors = [np.abs(g - e) / np.maximum(np.maximum(np.abs(g), np.abs(e)), 1e-200) for g, e in pairs]
    rounding = [np.abs(g - e) <= 1e-12 * size for g, e in pairs]
    return np.max(np.where(np.all(rounding, axis=0) & (size < 1e10), 0.0, errors), axis=0)


def test_there_are_as_many_as_promised() -> None:
    assert len(FAMILIES) >= 100
    assert len(ALL) >= 300
    assert sum(box.truth == "right" and len(box.expect) == 1 for box in ALL) >= 100
    assert {box.truth for box in ALL} == set(get_args(Truth))
    assert {1, 2, 20} <= {len(box.start) for box in ALL}


@pytest.mark.parametrize("name", BOXES)
def test_a_family_is_consistent(name: str) -> None:
    boxes = BOXES[name]
    assert len({box.name for box in boxes}) == len(boxes)
    for box, again in zip(boxes, FAMILIES[name].boxes(0), strict=True):
        assert box.expect
        assert box.expect <= VERDICTS
        assert box.truth == "right" or "agrees" not in box.expect
        assert np.array_equal(box.start, again.start)
    assert any(
        len(a.start) != len(b.start) or (a.start != b.start).any()
        for a, b in zip(boxes, FAMILIES[name].boxes(1), strict=True)
    ), "the seed changes nothing"


@pytest.mark.parametrize("name", [name for name, boxes in BOXES.items() if boxes[0].smooth is not None])
def test_gradients_are_what_they_are_said_to_be(name: str) -> None:
    for box in FAMILIES[name].boxes(0):
        with np.errstate(all="ignore"):
            pairs, moved = asked(box)
        if box.truth == "right":
            assert whole(pairs) <= box.error, box.name
            continue
        error = by_component(pairs)
        assert max(whole(pairs), float(error.max()), moved) >= box.error, box.name
        if box.wrong is not None:
            assert set(np.flatnonzero(error > CORRECT).tolist()) == box.wrong, box.name


STEPS = 10.0 ** np.arange(-7.0, 0.0)


@pytest.mark.parametrize("name", [name for name, boxes in BOXES.items() if boxes[0].smooth is not None])
def test_wrong_components_stand_out_of_what_the_objective_itself_shows(name: str) -> None:
    """Where nothing but `wrong-gradient` is right: along the worst component a quotient of J is nearer to the truth."""
    for box in FAMILIES[name].boxes(0):
        if box.expect != {"wrong-gradient"} or box.kinked:
            continue
        w, p = widths(box), box.start
        with np.errstate(all="ignore"):
            exact, given = slopes(box, p) * w, np.asarray(box.gradient(p.copy()), dtype=float) * w
            error = np.abs(given - exact)
            lower, upper = box.options.get("bounds", (-np.inf, np.inf))
            real = (error > CORRECT * np.maximum(np.abs(exact), np.abs(given))) & (lower < upper)
            i = int(np.argmax(np.where(real, error, 0.0)))
            v = np.where(np.arange(len(p)) == i, w, 0.0)
            ahead, behind = (np.array([value(box, p + sign * h * v) for h in STEPS]) for sign in (1.0, -1.0))
            J = value(box, p)
        quotients = np.concatenate([(ahead - J) / STEPS, (J - behind) / STEPS, (ahead - behind) / (2.0 * STEPS)])
        assert np.nanmin(np.abs(quotients - exact[i])) < 0.5 * error[i], box.name


def value(box: Box, p: Array) -> float:
    """J(p), NaN where it has none; of a solver that can be tightened, then."""
    tighten = box.options.get("tighten")
    J = box.objective if tighten is None else tighten(1e-3)[0]
    lower, upper = box.options.get("bounds", (-np.inf, np.inf))
    try:
        return float(J(p)) if ((p >= lower) & (p <= upper)).all() else float("nan")
    except RuntimeError:
        return float("nan")


@pytest.mark.parametrize("seed", range(3))
def test_a_kept_branch_has_the_gradient_of_that_branch(seed: int) -> None:
    for box in FAMILIES["keeps-its-branch"].boxes(seed):
        p, h = box.start, 1e-6
        found = np.array([(box.objective(p + h * e) - box.objective(p - h * e)) / (2 * h) for e in np.eye(len(p))])
        g = np.asarray(box.gradient(p))
        off = float(np.linalg.norm(g - found) / np.linalg.norm(found))
        assert (off < 1e-7) if box.truth == "right" else (off > 1.0)
        before = box.objective(p)
        box.objective(2.0 * p)
        assert abs(box.objective(p) - before) > 1e-2, "natural steps do not leave the branch"


def test_infinite_slopes_are_infinite() -> None:
    for box in FAMILIES["infinite-slope"].boxes(0):
        first = np.eye(len(box.start))[0]
        slope = [(box.objective(box.start + h * first) - box.objective(box.start)) / h for h in (1e-3, 1e-6, 1e-9)]
        assert slope[2] > 3.0 * slope[1] > 9.0 * slope[0]
