"""The rules from a diagnosis to a verdict, each at its threshold."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.locate import Located, Worst
from gradient_routes.bench.verification.result import Check, Refined, Tightened
from gradient_routes.bench.verification.segment import Segment
from gradient_routes.bench.verification.verdict import verdict

FACTOR = Finding("dR/dp against complex step of R", 0.0, 1e-9)
WRONG = Finding("a test", 1.0, 1e-9, culprit="the sign of lam")


LINES = {whole: SimpleNamespace(whole=whole) for whole in (True, False)}


def line(says: str, off: float = 0.0, index: int | None = None, whole: bool = True) -> Any:
    quotients = SimpleNamespace(line=LINES[whole])
    return SimpleNamespace(name="v", says=says, off=off, error=off, index=index, quotients=quotients, moves=True)


def tightened(*offs: float, says: str = "plateau", moved: bool = True) -> tuple[Tightened, ...]:
    lines = [line(says, off) for off in offs]
    return tuple(Tightened(1e-3, one, (one,), 0.0, 0.0, moved) for one in lines)


def agreeing(*findings: Finding, moves: bool = True) -> Check:
    one = line("agrees")
    one.moves = moves
    return Check("g", readings=(one,), deciding=one, findings=findings)


def plateau(off: float, **more: Any) -> Check:
    reading = line("plateau", off)
    return Check("g", readings=(reading,), deciding=reading, **more)


def located(right: int, *pairs: tuple[float, float], slope: float | None = None, contrast: float = 100.0) -> Located:
    worst = tuple(Worst("p", k, given, found) for k, (given, found) in enumerate(pairs))
    return Located(worst, right, slope=slope, contrast=contrast)


LOCAL = located(3, (2.0, 1.0))
ALL_OFF = located(0, *((1.005, 1.0) for _ in range(3)), slope=1.005)


@pytest.mark.parametrize(
    ("check", "expected"),
    [
        (Check("g"), "undetermined"),
        (Check("g", deciding=line("kink")), "non-smooth"),
        (agreeing(), "agrees"),
        (agreeing(moves=False), "undetermined"),
        (agreeing(Finding("Taylor: h^2", 0.3, 0.15)), "undetermined"),
        (agreeing(Finding("complex step", 0.3, 0.15)), "agrees"),
        (Check("g", deciding=line("agrees", index=0, whole=False)), "noise-limited"),
        (Check("g", deciding=line("noise")), "noise-limited"),
        (Check("g", deciding=line("noise"), tightened=tightened(0.0, says="agrees")), "solver-limited"),
        (Check("g", deciding=line("noise"), tightened=tightened(0.0, says="noise")), "noise-limited"),
        # the solver: the plateau is gone, or still falling at the end
        (plateau(0.3, tightened=tightened(0.0, says="agrees")), "solver-limited"),
        (plateau(0.3, tightened=tightened(0.2, 0.0666)), "solver-limited"),
        (plateau(0.3, tightened=tightened(0.2, 0.0667)), "undetermined"),  # less than to a third of the step before
        (plateau(0.3, tightened=tightened(0.6, 0.11)), "undetermined"),  # less than to a third of the first
        (plateau(0.3, tightened=tightened(0.09, 0.0811)), "wrong-gradient"),  # has ended at 0.9 of the step before
        (plateau(0.3, tightened=tightened(0.3, 0.269)), "undetermined"),  # moves
        (plateau(0.3, tightened=tightened(0.3, 0.271)), "wrong-gradient"),  # stands
        # the mesh
        (plateau(0.3, refined=Refined((0.3, 0.3 * 2**-0.601))), "inconsistent-discretization"),
        (plateau(0.3, refined=Refined((0.3, 0.3 * 2**-0.601)), located=LOCAL), "wrong-gradient"),
        (plateau(0.3, refined=Refined((0.3, 0.3 * 2**-0.599))), "undetermined"),
        (plateau(0.3, refined=Refined((0.3, 0.3 * 2**-0.1))), "undetermined"),  # one mesh is too few
        (plateau(0.3, refined=Refined((0.3, 0.3, 0.3 * 2**-0.299))), "wrong-gradient"),
        (plateau(0.3, refined=Refined((0.3, 0.3, 0.3 * 2**-0.301))), "undetermined"),
        # the gradient: a factor is wrong, or few components are
        (plateau(0.001, findings=(WRONG,)), "wrong-gradient"),
        (plateau(0.001, located=LOCAL), "wrong-gradient"),
        (plateau(0.001, located=located(3, (1.05, 1.0), contrast=99.0)), "undetermined"),
        (plateau(0.001, located=located(2, (1.05, 1.0))), "undetermined"),
        # alike at a second point, or right over a segment
        (plateau(0.001, compared="the same ratio"), "wrong-gradient"),
        (plateau(0.3, segment=Segment(0.0999, 1.0)), "solver-limited"),
        (plateau(0.3, segment=Segment(0.1001, 1.0)), "wrong-gradient"),
        (plateau(0.003, segment=Segment(0.1001, 1.0)), "undetermined"),
        (plateau(0.3, segment=Segment(0.0, 1.0), compared="the same ratio"), "wrong-gradient"),
        # another answer to the same question, unless it is a loose solve's
        (plateau(0.3, unrepeatable="J changes"), "unrepeatable"),
        (plateau(0.3, unrepeatable="J changes", tightened=tightened(0.0, says="agrees")), "solver-limited"),
        (plateau(0.001, located=located(5, (1.05, 1.0), (1.05, 1.0))), "undetermined"),
        (plateau(0.001, located=located(6, (1.05, 1.0), (1.05, 1.0))), "wrong-gradient"),
        # nothing was tightened: only gross errors are the gradient's
        (plateau(0.0099), "undetermined"),
        (plateau(0.0101), "wrong-gradient"),
        (plateau(0.0101, not_done=("out of calls",)), "undetermined"),
        (plateau(0.001, located=located(0, (1.0, 0.91))), "undetermined"),
        (plateau(0.001, located=located(0, (1.0, 0.89))), "wrong-gradient"),
        (plateau(0.001, located=ALL_OFF), "undetermined"),
        (plateau(0.001, located=located(0, *((1.02, 1.0) for _ in range(3)), slope=1.02)), "wrong-gradient"),
        # tightening that changes nothing tests nothing, unless the factors were tested
        (plateau(0.001, tightened=tightened(0.001, moved=False)), "undetermined"),
        (plateau(0.001, tightened=tightened(0.001, moved=False), findings=(FACTOR,)), "wrong-gradient"),
    ],
)
def test_a_diagnosis_has_one_verdict(check: Check, expected: str) -> None:
    assert verdict(check) == expected


def test_a_factor_is_common_only_where_all_agree() -> None:
    three = [(1.5, 1.0), (3.0, 2.0), (1.5 * 0.985, 1.0)]
    assert located(0, *three, slope=1.5).factor == pytest.approx(1.5)
    assert located(0, *three[:2], (1.5 * 0.975, 1.0), slope=1.5).factor is None
    assert located(0, *three).factor is None, "the whole gradient has no factor"
    assert np.isclose(Worst("p", 0, 1.0, -4.0).off, 1.25)
