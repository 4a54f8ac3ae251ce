"""routes compare: a rule a metric, judged on both sides of its limit; baselines; what is refused."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from bench.environment import environment
from bench.expected import Expectation
from bench.gate import rules
from bench.gate.baseline import as_text, measured, write
from bench.gate.compare import Comparison, compare
from bench.gate.finding import Finding
from bench.gate.measured import Case, Measured, Verdict, of_store
from bench.gate.times import FACTOR, ROUNDS, TimeRule, least_p
from bench.rows import STATUSES, empty_row
from bench.store import Store
from bench.study_rows import CHECKS
from bench.timing import Samples
from bench.views.compare import conclusion, lines
from bench.views.compare_text import as_json, markdown
from problems.errors import InputError
from routes.tally import KINDS

MIB = 2**20
HERE = environment()
WORK = dict.fromkeys(KINDS, 0) | {"forward_solves": 1, "transposed_solves": 1}
OPTIONS = {"problem_options": {"n": 8}, "route_options": {"factors": "refined"}}
NUMBERS = {"work": WORK, "gradient_error": 1e-15, "peak_bytes": 20 * MIB, "tape_bytes": 1000, "memory_method": "VmHWM"}


def row(**values):
    base = {"problem": "bar", "route": "adjoint", "at": "start", "status": "ok"} | OPTIONS | NUMBERS
    return empty_row() | base | values


def case(ratios=(), environment=HERE, **values) -> Case:
    return Case(row(**values), environment, tuple(ratios), min(ratios) if len(ratios) else None)


def side(*cases: Case, verdicts: tuple[Verdict, ...] = ()) -> Measured:
    return Measured("side", cases, verdicts)


def of(found: Comparison, metric: str) -> Finding:
    (finding,) = [f for f in found.findings if f.metric == metric]
    return finding


def ratios(scale: float = 1.0, n: int = 40, seed: int = 0) -> list[float]:
    """Rounds about 2 forward solves, with the noise of a machine at work."""
    return list(scale * 2.0 * (1 + 0.05 * np.random.default_rng(seed).random(n)))


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
    write(tmp_path / "b.json", of_store(Store(path)))
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


def stored(path: Path, *rows, seconds=(), verdict: str | None = "agrees") -> Path:
    store = Store(path)
    for one in rows:
        store.append(one, Samples(tuple(seconds), (0.5,) * len(seconds)) if seconds else None)
    if verdict is not None:
        check = dict.fromkeys(c.name for c in CHECKS) | {"problem": "bar", "route": "adjoint", "at": "start"}
        store.append_study({"checks": [check | {"verdict": verdict}]}, "now")
    return path


def test_the_latest_row_of_a_case_counts_with_its_own_rounds(tmp_path: Path) -> None:
    path = stored(tmp_path / "s.sqlite", row(gradient_error=1.0), verdict="wrong-gradient")
    stored(path, row(gradient_error=2.0), row(route="tangent"), seconds=(1.0, 2.0), verdict="agrees")
    found = of_store(Store(path))
    assert [c.row["gradient_error"] for c in found.cases] == [2.0, 1e-15]
    assert found.cases[0].ratios == (2.0, 4.0)
    assert found.cases[0].fastest == 2.0
    assert [v.verdict for v in found.verdicts] == ["agrees"]


def test_a_baseline_says_what_its_store_says(tmp_path: Path) -> None:
    rows = [row(), row(route="tangent", status="failed", reason="of ~/private", work=None, host="my-host")]
    path = stored(tmp_path / "s.sqlite", *rows, seconds=ratios(n=120))
    write(tmp_path / "b.json", of_store(Store(path)))
    text = (tmp_path / "b.json").read_text()
    back = measured(tmp_path / "b.json")
    assert as_text(back) == text
    assert "my-host" not in text
    assert "~/private" not in text
    assert not compare(back, measured(path)).worse
    assert {len(c.ratios) for c in back.cases} == {40}  # every third of 120: at most 50
    assert [c.row["work"] for c in back.cases] == [WORK, None]


def test_the_order_of_measuring_does_not_matter_to_a_baseline(tmp_path: Path) -> None:
    rows = [row(), row(route="tangent"), row(problem="block")]
    texts = [as_text(of_store(Store(stored(tmp_path / f"{i}", *rows[::i])))) for i in (1, -1)]
    assert texts[0] == texts[1]


@pytest.fixture
def base(tmp_path: Path) -> Path:
    """A store of one case that is ok, and its baseline beside it."""
    path = stored(tmp_path / "base.sqlite", row(), seconds=ratios())
    write(tmp_path / "base.json", of_store(Store(path)))
    return path


def test_exit_code_0_where_nothing_is_worse(cli, base: Path) -> None:
    for before in ("base.sqlite", "base.json"):
        ran = cli("compare", before, "base.sqlite")
        assert (ran.code, ran.err) == (0, "")
        assert ran.out.splitlines()[-1] == (
            "no regression: 1 case compared by numbers, 0 by status only and 1 verdict, nothing better or worse"
        )


def test_exit_code_1_on_a_regression_that_all_formats_name(cli, tmp_path: Path, base: Path) -> None:
    worse = row(work=WORK | {"transposed_solves": 2})
    stored(tmp_path / "new.sqlite", worse, seconds=ratios(2.0), verdict="wrong-gradient")
    table = cli("compare", "base.json", "new.sqlite")
    assert table.code == 1
    for words in (
        "worse: adjoint on bar: transposed_solves 1 -> 2",
        "worse: adjoint on bar: agrees -> wrong-gradient",
        "forward solves: x 2, limit x 1.25",
        "1 fwd + 1 adj -> 1 fwd + 2 adj",
        "a regression: 1 case compared by numbers, 0 by status only and 1 verdict, 3 worse",
    ):
        assert words in table.out
    found = json.loads(cli("compare", "base.json", "new.sqlite", "--format", "json").out)
    assert found["worse"] is True
    assert [f["metric"] for f in found["findings"] if f["judgement"] == "worse"] == ["work", "time", "verdict"]
    ran = cli("compare", "base.json", "new.sqlite", "-o", "new.md")
    assert (ran.code, ran.err) == (1, "")
    text = (tmp_path / "new.md").read_text()
    assert "- ❌ worse: adjoint on bar: transposed\\_solves 1 → 2" in text
    assert "| bar | adjoint | ok | **1 fwd + 1 adj → 1 fwd + 2 adj** ❌ |" in text
    assert cli("compare", "base.json", "new.sqlite", "--factor", "3", "--format", "json").out.count('"worse"') == 2 + 2


def test_expected_failures_are_read_beside_new_or_where_it_is_said(cli, tmp_path: Path, base: Path) -> None:
    (tmp_path / "new").mkdir()
    for path in (tmp_path / "base.sqlite", tmp_path / "new" / "s.sqlite"):
        stored(path, row(route="tangent"))
    write(tmp_path / "base.json", of_store(Store(tmp_path / "base.sqlite")))
    stored(tmp_path / "new" / "s.sqlite", row(status="timeout"))
    assert cli("compare", "base.json", "new/s.sqlite").code == 1
    entry = 'problem = "bar"\nroute = "adjoint"\nstatus = "timeout"\nreason = "it is slow"\n'
    (tmp_path / "new" / "expected.toml").write_text(f"[[expected]]\n{entry}")
    assert cli("compare", "base.json", "new/s.sqlite").code == 0
    (tmp_path / "none.toml").write_text("")
    assert cli("compare", "base.json", "new/s.sqlite", "--expected", "none.toml").code == 1


def test_the_same_is_said_once_of_many_cases() -> None:
    cases = [case(route_options={"i": i}) for i in range(5)]
    said = [line for _, line in lines(compare(side(*cases), side(*cases)))]
    assert said == ["not compared: 5 cases: time, of 0 and 0 rounds: too few, 15 are needed - raise --min-time"]


def test_names_of_others_break_no_markdown() -> None:
    wild = {"problem": "m.py:A|<b>", "route": "a_b*", "problem_options": {"x": "`"}, "route_options": {}}
    found = compare(side(case(**wild)), side(case(**(wild | {"status": "failed", "reason": "1\n| 2"}))))
    text = markdown(found)
    assert "<b>" not in text
    assert "m.py:A\\|&lt;b>\\[x=\\`\\]" in text
    assert max(line.count("|") - line.count("\\|") for line in text.splitlines()) == 10
    assert json.loads(as_json(found))["worse"]
    assert conclusion(found) == "a regression: 0 cases compared by numbers, 1 by status only, 1 worse"


BROKEN = {
    "none.json": (None, "no such file"),
    "folder": ("", "is a directory"),
    "text.txt": ("hello", "is neither a store nor a baseline"),
    "list.json": ("[1]", "is neither a store nor a baseline"),
    "other.json": ('{"a": 1}', "is neither a store nor a baseline"),
    "empty": ("", "is empty"),
    "newer.json": ('{"gradient-routes baseline": 2}', "version 2"),
    "cut.json": ('{"gradient-routes baseline": 1,\n"cases": [', "broken in line 2"),
    "torn.json": ('{"gradient-routes baseline": 1, "environments": {}, "verdicts": []}', "broken: KeyError: 'cases'"),
    "bare.json": ('{"gradient-routes baseline": 1, "environments": {}, "cases": [], "verdicts": []}', "no case and no"),
    "odd.json": ('{"gradient-routes baseline": 1, "environments": {}, "cases": [3], "verdicts": []}', "broken"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_cannot_be_compared_is_refused_in_one_line(cli, tmp_path: Path, base: Path, name: str) -> None:
    content, said = BROKEN[name]
    path = tmp_path / name
    if name == "folder":
        path.mkdir()
    elif content is not None:
        path.write_text(content)
    for sides in ((name, "base.json"), ("base.json", name)):
        ran = cli("compare", *sides)
        assert (ran.code, ran.out) == (2, "")
        assert said in ran.err
        assert len(ran.err.splitlines()) == 1


def test_any_single_value_of_a_baseline_may_be_wrong_without_a_traceback(cli, tmp_path: Path, base: Path) -> None:
    """Numbers where text should be, text where numbers should be: a line or a comparison, never a traceback."""
    content = json.loads((tmp_path / "base.json").read_text())
    for name in content["cases"][0]:
        for wrong in (None, 3, "x", [], {}, [None], {"x": "y"}, 10**400):
            broken = content | {"cases": [content["cases"][0] | {name: wrong}]}
            (tmp_path / "broken.json").write_text(json.dumps(broken))
            ran = cli("compare", "broken.json", "base.sqlite")
            assert ran.code in (0, 1, 2), (name, wrong)
            assert len(ran.err.splitlines()) == (ran.code == 2)


def test_a_store_without_rows_and_one_of_another_program_are_refused(cli, tmp_path: Path, base: Path) -> None:
    Store(tmp_path / "bare.sqlite").append_ended("check", "timeout", "after 1 s", "")
    with closing(sqlite3.connect(tmp_path / "other.sqlite")) as db:
        db.execute("CREATE TABLE t (x)")
    for name, said in (("bare.sqlite", "holds no case and no verdict"), ("other.sqlite", "of another program")):
        ran = cli("compare", "base.json", name)
        assert (ran.code, len(ran.err.splitlines())) == (2, 1)
        assert said in ran.err


@pytest.mark.parametrize("factor", ["1", "0", "-2", "inf", "nan"])
def test_a_factor_that_judges_nothing_is_refused(cli, base: Path, factor: str) -> None:
    assert cli("compare", "base.json", "base.json", "--factor", factor).code == 2


def test_no_output_replaces_what_is_read(cli, tmp_path: Path, base: Path) -> None:
    for output in ("base.json", "base.sqlite"):
        assert cli("compare", "base.json", "base.sqlite", "-o", output).code == 2
    assert cli("baseline", "--store", "base.sqlite", "-o", "base.sqlite").code == 2
    (tmp_path / "mine.txt").write_text("precious")
    ran = cli("baseline", "--store", "base.sqlite", "-o", "mine.txt")
    assert (ran.code, (tmp_path / "mine.txt").read_text()) == (2, "precious")
    assert "is there and no baseline" in ran.err


def test_a_run_compares_to_its_own_baseline(cli) -> None:
    run = ("run", "--problem", "bar[n=2]", "--route", "adjoint", "--route", "fd-central", "--min-time", "0")
    assert cli(*run).code == 0
    ran = cli("baseline")
    assert (ran.code, ran.out) == (0, "2 cases of results/routes.sqlite in results/baseline.json\n")
    assert cli(*run).code == 0
    assert cli("compare", "results/baseline.json", "results/routes.sqlite").code == 0
