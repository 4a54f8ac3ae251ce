"""What a reading tells, which one decides, and which lines are read again or compared."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gradient_routes.bench.verification.comparison import Pair, _in_part, _pair_of
from gradient_routes.bench.verification.diagnosis import deciding
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.foreign import subject
from gradient_routes.bench.verification.guarded import Guarded
from gradient_routes.bench.verification.lines import Line, components, directions
from gradient_routes.bench.verification.locate import Worst
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.plateau import Level
from gradient_routes.bench.verification.quotients import Quotients
from gradient_routes.bench.verification.reading import Reading, stencil_changes
from gradient_routes.bench.verification.registered import _iterated
from gradient_routes.bench.verification.scales import with_scales
from gradient_routes.bench.verification.tightening import _lines

P = np.array([2.0, 4.0, 1.0, 3.0, 5.0])
SUBJECT = subject(lambda p: float(p @ p), lambda p: 2.0 * p, P)


def cubic(c: float) -> Reading:
    """J = c t^3: central quotients are c h^2, the slope is 0."""
    h = 10.0 ** np.arange(-6.0, -0.9, 0.25)
    zero = np.zeros_like(h)
    reading = Reading(Quotients(Line("", np.ones(1)), 0.0, h, c * h**3, -c * h**3, zero, zero), 0.0, 1.0, 0.0)
    vars(reading)["level"] = Level(0.0, 0.0, 1e-6, 1e-5)
    return reading


@pytest.mark.parametrize("h", [1e-2, 0.1, 3.0])
def test_truncation_is_extrapolated_by_the_square_of_the_step(h: float) -> None:
    assert cubic(7.0).truncation(h) == pytest.approx(7.0 * h**2, rel=1e-6)


def test_active_sets_are_counted_inside_the_stencil() -> None:
    steps = subject(lambda p: float(p @ p), lambda p: 2.0 * p, [1.0], active_set=lambda p: p[0] > 1.5)
    changes = stencil_changes(steps, np.ones(1))
    assert changes is not None
    assert [changes(h).count for h in (0.25, 0.4, 0.6, 4.0)] == [0, 0, 1, 1]


def read(says: str, whole: bool = True, **more: Any) -> Any:
    line = directions(SUBJECT, 1, 0)[0] if whole else components(SUBJECT, [1])[0]
    return SimpleNamespace(says=says, index=line.index, quotients=SimpleNamespace(line=line), off=0.5, **more)


def test_of_two_breaks_the_larger_kink_decides() -> None:
    jump, small, kink = (read("kink", broken=b, kink=k) for b, k in ((1, None), (1, 0.5), (None, 2.0)))
    assert deciding([jump, small, kink]) is small
    assert deciding([kink, jump]) is jump


def test_whole_lines_and_wrong_components_are_read_again() -> None:
    one, other = read("agrees"), read("plateau")
    wrong, right = read("plateau", whole=False), read("agrees", whole=False)
    assert _lines([one, right, wrong, other], other) == [other, one, wrong]
    assert _lines([one, right, wrong, other], wrong) == [one, wrong, other]


def test_no_scale_is_found_where_J_is_zero_and_no_other_parameter_may_move() -> None:
    held = subject(lambda p: float(p[1]), lambda p: np.array([0.0, 1.0]), [2e4, 0.0], bounds=([0.0, -1.0], [2e4, 1.0]))
    found = with_scales(held, Guarded(held.objective), 0.0)
    assert found.scale.tolist() == [2e4, 2e4]
    assert "J does not respond" in found.notes[0]


def test_iterates_are_taken_further_as_the_tolerance_falls() -> None:
    assert _iterated({"inner": "cg", "iterations": 10}, 1e-3) == {"inner": "cg", "iterations": 79}  # 10^0.9 times
    assert _iterated({"iterations": None}, 1e-3) == {"iterations": None}


def test_a_component_that_was_found_is_compared_in_its_natural_change() -> None:
    seen = Examination.of(SUBJECT, Plan(), Guarded(SUBJECT.objective))
    pair = _pair_of(Worst("p_2", 1, 3.0, 5.0), seen, seen.read(seen.lines()[0], Plan().steps))
    assert (pair.line.index, pair.slope, pair.quotient) == (1, 12.0, 20.0)


def test_exact_components_beside_others_off_by_one_factor_are_a_proof() -> None:
    """Only components count, whatever whole lines show."""
    seen = Examination.of(SUBJECT, Plan(), Guarded(SUBJECT.objective))
    whole = Pair(directions(SUBJECT, 1, 0)[0], 1.0, 1.3, 1e-9, 1e-3)
    quotients = (1.0, 1.0, 1.5, 1.5)
    parts = [Pair(line, 1.0, q, 1e-9, 1e-3) for line, q in zip(components(SUBJECT, range(4)), quotients, strict=True)]
    said = "2 slopes along components are exact, 2 are off by the factor 0.666667"
    assert _in_part(seen, [whole, *parts], None) == said
    assert _in_part(seen, [whole, *parts[1:]], None) is None
