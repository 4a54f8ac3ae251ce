"""The gate: a rule a metric, judged on both sides of its limit."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from comparisons import HERE, MIB, WORK, case, ratios, row, side, stored

from gradient_routes.bench.cases.expected import Expectation
from gradient_routes.bench.cases.row import STATUSES
from gradient_routes.bench.regression import rules
from gradient_routes.bench.regression.baseline import as_text, measured
from gradient_routes.bench.regression.compare import Comparison, compare
from gradient_routes.bench.regression.finding import Finding
from gradient_routes.bench.regression.measured import Verdict, of_store
from gradient_routes.bench.regression.times import FACTOR, ROUNDS, TimeRule, least_p
from gradient_routes.bench.regression.view import conclusion
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError


def of(found: Comparison, metric: str) -> Finding:
    (finding,) = [f for f in found.findings if f.metric == metric]
    return finding


@pytest.mark.parametrize(
    ("before", "now", "judgement"),
    [
        ("ok", "ok", "same"),
        ("ok", "failed", "worse"),
        ("ok", "timeout", "worse"),
        ("ok", "out-of-memory", "worse"),
        ("skipped", "crashed", "worse"),
        ("ok", "pruned", "worse"),
        ("ok", "skipped", "worse"),
        ("failed", "failed", "same"),
        ("failed", "crashed", "shown"),
        ("timeout", "skipped", "shown"),
        ("failed", "ok", "better"),
        ("skipped", "ok", "shown"),
    ],
)
def test_what_fails_and_did_not_is_worse(before: str, now: str, judgement: str) -> None:
    found = rules.status(case(status=before), case(status=now, reason="so it is"))
    assert found.judgement == judgement
    assert found.says == ("" if before == now else f"{before} -> {now}: so it is")


def test_every_status_has_a_judgement() -> None:
    assert {rules.status(case(status=a), case(status=b)).judgement for a in STATUSES for b in STATUSES} == {
        "same",
        "better",
        "worse",
        "shown",
    }


@pytest.mark.parametrize(
    ("before", "now", "in_a_subset"),
    [
        (60.0, 60.0, "worse"),  # a route 1000 x dearer
        (None, 60.0, "worse"),  # of a baseline that does not tell its budget
        (60.0, 1.0, "shown"),
    ],
)
def test_what_was_ok_may_be_skipped_for_another_budget_in_a_subset_only(before, now, in_a_subset: str) -> None:
    base = case(budget_s=before)
    for status in ("skipped", "pruned"):
        new = case(status=status, predicted_s=100.0, budget_s=now)
        assert rules.status(base, new).judgement == "worse"
        assert rules.status(base, new, subset=True).judgement == in_a_subset
        assert {
            f.judgement for f in compare(side(base, case(at="x")), side(new, case(at="x")), subset=True).findings
        } > {in_a_subset}


def test_a_route_that_no_longer_runs_on_a_problem_is_worse_in_a_subset_too() -> None:
    new = case(status="skipped", budget_s=1.0)
    assert rules.status(case(budget_s=60.0), new, subset=True).judgement == "worse"


def test_a_baseline_keeps_the_budget(tmp_path: Path) -> None:
    path = stored(tmp_path / "s.sqlite", row(budget_s=60.0))
    (tmp_path / "b.json").write_text(as_text(of_store(Store(path))))
    assert [c.row["budget_s"] for c in measured(tmp_path / "b.json").cases] == [60.0]


@pytest.mark.parametrize(
    ("now", "judgement", "says"),
    [
        ({}, "same", ""),
        ({"transposed_solves": 2}, "worse", "transposed_solves 1 -> 2"),
        ({"forward_solves": 0}, "better", "forward_solves 1 -> 0"),
        ({"forward_solves": 0, "matvecs": 1}, "worse", "forward_solves 1 -> 0, matvecs 0 -> 1"),
    ],
)
def test_counts_are_exact_and_named(now: dict, judgement: str, says: str) -> None:
    found = rules.work(case(), case(work=WORK | now))
    assert (found.judgement, found.says) == (judgement, says)


@pytest.mark.parametrize(
    ("before", "now", "judgement"),
    [
        (1e-16, 9e-16, "same"),
        (0.0, 9.9e-13, "same"),
        (0.0, 1.1e-12, "worse"),
        (1e-9, 9.9e-9, "same"),
        (1e-9, 1.1e-8, "worse"),
        (1e-8, 1.1e-9, "same"),
        (1e-8, 0.9e-9, "better"),
        (1e-9, None, "worse"),
        (1e-9, float("nan"), "worse"),
        (None, 1e-9, "shown"),
        (None, None, "same"),
    ],
)
def test_errors_are_compared_by_order_of_magnitude_from_rounding_on(before, now, judgement: str) -> None:
    found = rules.gradient_error(case(gradient_error=before), case(gradient_error=now))
    assert found.judgement == judgement
    assert bool(found.says) is (judgement != "same")


@pytest.mark.parametrize(
    ("before", "now", "judgement"),
    [
        (20, 25.1, "worse"),  # 25 % and 5 MiB
        (20, 24.9, "same"),
        (1, 5.9, "same"),  # many percent of little
        (100, 120, "same"),  # many MiB, few percent
        (25.1, 20, "better"),
        (0, 6, "worse"),
    ],
)
def test_memory_is_worse_by_percent_and_by_a_floor(before: float, now: float, judgement: str) -> None:
    found = rules.peak_bytes(case(peak_bytes=before * MIB), case(peak_bytes=now * MIB))
    assert found.judgement == judgement


@pytest.mark.parametrize("values", [{"memory_method": None}, {}])
@pytest.mark.parametrize("metric", ["peak_bytes", "tape_bytes"])
def test_bytes_that_are_no_longer_known_are_worse_and_found_ones_are_shown(metric: str, values: dict) -> None:
    known, unknown = case(), case(**values, **{metric: None})
    lost = of(compare(side(known), side(unknown)), metric)
    assert (lost.judgement, lost.says) == ("worse", f"{metric} is no longer known")
    assert of(compare(side(case(**{metric: None})), side(known)), metric).judgement == "shown"


def test_bytes_that_other_options_do_not_hold_are_not_compared() -> None:
    """A route resolves its options by what is at hand: fresh factors are none to hold."""
    known, other = case(case_key="a"), case(case_key="a", route_options={"factors": "fresh"}, tape_bytes=None)
    assert of(compare(side(known), side(other)), "tape_bytes").judgement == "not-compared"


@pytest.mark.parametrize(
    "values", [{"memory_method": "ru_maxrss"}, {"isolated": 1}, {"isolated": 1, "peak_bytes": None}]
)
def test_memory_measured_otherwise_is_not_compared_and_that_is_said(values: dict) -> None:
    found = rules.peak_bytes(case(), case(**({"peak_bytes": 100 * MIB} | values)))
    assert found.judgement == "not-compared"
    assert found.says


@pytest.mark.parametrize(
    ("before", "now", "judgement"),
    [(1000, 1090, "same"), (1000, 1110, "worse"), (1110, 1000, "better"), (None, 1000, "shown"), (None, None, "same")],
)
def test_bytes_that_are_counted_may_grow_by_a_tenth(before, now, judgement: str) -> None:
    held = partial(rules.held, "tape_bytes")
    assert held(case(tape_bytes=before), case(tape_bytes=now)).judgement == judgement


def test_verdicts_are_exact_in_both_directions() -> None:
    right, wrong = (Verdict("bar", "adjoint", "start", says) for says in ("agrees", "wrong-gradient"))
    assert rules.verdict(right, right).judgement == "same"
    for before, now in ((right, wrong), (wrong, right)):
        found = rules.verdict(before, now)
        assert (found.judgement, found.says) == ("worse", f"{before.verdict} -> {now.verdict}")


def test_time_is_worse_by_ranks_and_by_a_factor() -> None:
    rule = TimeRule(FACTOR, cases=20)
    base = case(ratios(), unstable=1)
    assert rule(base, case(ratios(seed=1))).judgement == "same"
    assert rule(base, case(ratios(0.98 * FACTOR))).judgement == "same"  # ranks alone would say slower
    slower = rule(base, case(ratios(1.05 * FACTOR)))
    assert slower.judgement == "worse"
    assert "unstable in base" in slower.says
    assert rule(case(ratios(1.05 * FACTOR)), base).judgement == "better"


@pytest.mark.parametrize("side", ["base", "new"])
def test_an_impossible_ratio_is_unresolved_and_compared_with_nothing(side: str) -> None:
    sound, noisy = case(ratios(0.6), ratio_floor=1.0), case(ratios(0.29), ratio_floor=1.0)
    found = TimeRule()(noisy, sound) if side == "base" else TimeRule()(sound, noisy)
    assert found.judgement == "not-compared"
    assert f"unresolved in {side}: 0.5" in found.says
    assert TimeRule()(case(ratios(0.29)), case(ratios(0.29))).judgement == "same", "of counted work that is not known"


def test_a_factor_that_ranks_do_not_confirm_is_noise() -> None:
    """Two of three rounds waited: the median says twice as slow, p = 0.005."""
    waited = [2.0] * 7 + [4.0] * 8
    assert np.median(waited) / np.median([2.0] * 15) > FACTOR
    assert TimeRule(cases=20)(case([2.0] * 15), replace(case(waited), fastest=4.0)).judgement == "same"


def test_rounds_that_waited_make_no_regression_while_the_fastest_are_as_fast() -> None:
    waited = [2.0, *ratios(2.0)]
    assert TimeRule()(case(ratios()), case(waited)).judgement == "same"


def test_the_level_is_shared_by_all_cases() -> None:
    assert TimeRule(cases=100).p == pytest.approx(1e-4)
    assert least_p(2, 2) == pytest.approx(1 / 6)
    few = TimeRule(cases=10**7)(case(ratios(n=ROUNDS)), case(ratios(9.0, n=ROUNDS)))
    assert few.judgement == "not-compared"
    assert "too few to tell" in few.says


def test_too_few_rounds_are_not_compared() -> None:
    enough, few = case(ratios(n=ROUNDS)), case(ratios(3.0, n=ROUNDS - 1))
    found = TimeRule()(enough, few)
    assert found.judgement == "not-compared"
    assert f"{ROUNDS} and {ROUNDS - 1} rounds: too few" in found.says
    assert TimeRule()(enough, case(ratios(3.0, n=ROUNDS))).judgement == "worse"


@pytest.mark.parametrize("name", ["cpu", "cores", "usable_cores", "memory_bytes", "os", "threads"])
def test_between_machines_time_is_not_compared_and_that_is_said(name: str) -> None:
    elsewhere = HERE | {name: {"OMP_NUM_THREADS": "7"} if name == "threads" else 7}
    found = TimeRule()(case(ratios()), case(ratios(3.0), environment=elsewhere))
    assert found.judgement == "not-compared"
    assert "the machines differ" in found.says
    assert name in found.says


def test_between_numbers_of_threads_time_is_not_compared() -> None:
    assert TimeRule()(case(ratios(), threads=1), case(ratios(3.0), threads=2)).judgement == "not-compared"


@pytest.mark.parametrize("other", [{"python": "2.7"}, {"versions": HERE["versions"] | {"numpy": "1.0"}}])
def test_between_versions_time_is_compared_and_they_are_said(other: dict) -> None:
    found = compare(side(case(ratios())), side(case(ratios(3.0), environment=HERE | other)))
    assert of(found, "time").judgement == "worse"
    assert found.notes[0].startswith("libraries differ in 1 of 1 cases: ")


def test_seconds_are_shown_and_never_judged() -> None:
    found = compare(side(case(ratios(), seconds=1.0)), side(case(ratios(), seconds=100.0)))
    assert of(found, "seconds").judgement == "shown"
    assert not found.worse


def test_an_expected_failure_is_no_regression_and_says_why() -> None:
    expected, other = Expectation("bar[n=8]", "adjoint", "timeout", "it is slow"), case(route="tangent")
    found = compare(side(case(), other), side(case(status="timeout"), other), [expected])
    assert not found.worse
    assert [f.says for f in found.findings if f.metric == "status"] == ["timeout, expected: it is slow", ""]
    assert conclusion(found) == ("no regression: 1 case compared by numbers, 1 by status only, nothing better or worse")
    assert compare(side(case()), side(case(status="failed")), [expected]).worse


def test_an_unexpected_success_is_shown_and_so_is_an_expectation_of_nothing() -> None:
    expected = [Expectation("bar", "adjoint", "timeout", "it is slow"), Expectation("bar", "none", "failed", "?")]
    found = compare(side(case()), side(case()), expected)
    assert not found.worse
    assert "unexpected success" in of(found, "status").says
    assert found.notes == ("expected failed of none on bar: no such case in side",)


def test_what_is_no_longer_measured_is_worse_but_for_a_subset() -> None:
    both, gone = case(), case(route="tangent")
    verdict = Verdict("bar", "adjoint", "start", "agrees")
    base, new = side(both, gone, verdicts=(verdict,)), side(both)
    assert compare(base, new).count("worse") == 2
    assert not compare(base, new, subset=True).worse
    assert [f.says for f in compare(new, base).findings if f.metric == "case"] == ["new: ok", "new: agrees"]
    assert not compare(side(both, case(route="tangent", status="skipped")), side(both)).worse


def test_a_gate_does_not_pass_by_measuring_nothing() -> None:
    with pytest.raises(InputError, match=r"of 1 cases in side and 1 in side none is in both - "):
        compare(side(case()), side(case(route="tangent")), subset=True)


@pytest.mark.parametrize(
    ("before", "now", "said"),
    [
        ("ok", "skipped", "2 ok in side, 2 skipped in side"),
        ("ok", "pruned", "2 ok in side, 2 pruned in side"),
        ("failed", "failed", "2 failed in side, 2 failed in side"),
        ("failed", "ok", "2 failed in side, 2 ok in side"),
    ],
)
@pytest.mark.parametrize("verdicts", [(), (Verdict("bar", "adjoint", "start", "agrees"),)])
def test_cases_without_a_number_to_compare_are_an_error_whatever_verdicts_agree(
    before: str, now: str, said: str, verdicts: tuple[Verdict, ...]
) -> None:
    base, new = (
        side(
            *(case(status=status, route=route, predicted_s=1e9) for route in ("adjoint", "tangent")), verdicts=verdicts
        )
        for status in (before, now)
    )
    with pytest.raises(InputError, match=rf"^compare: no numbers to compare in 2 cases in both, {said} - [^\n]+$"):
        compare(base, new)
    assert compare(side(*base.cases, case(at="x")), side(*new.cases, case(at="x"))).by_numbers == 1


def test_cases_that_all_fail_are_a_regression_and_no_error() -> None:
    assert compare(side(case()), side(case(status="crashed"))).worse


def test_cases_are_paired_by_key_and_where_a_version_had_none_by_name() -> None:
    resolved = case(case_key="a", route_options={"iterations": 9})
    assert not compare(side(case(case_key="a")), side(resolved)).worse
    assert not compare(side(case()), side(case(case_key="a"))).worse
    with pytest.raises(InputError, match="none is in both"):  # the same names, solved to another tolerance
        compare(side(case(case_key="a")), side(case(case_key="b")))
