"""routes compare and routes baseline: exit codes, formats, what is refused."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from comparisons import WORK, case, ratios, row, side, stored

from gradient_routes.bench.regression.baseline import as_text, measured
from gradient_routes.bench.regression.compare import compare
from gradient_routes.bench.regression.measured import of_store
from gradient_routes.bench.regression.text import as_json, markdown
from gradient_routes.bench.regression.view import conclusion, lines
from gradient_routes.bench.store.store import Store


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
    (tmp_path / "b.json").write_text(as_text(of_store(Store(path))))
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
    (tmp_path / "base.json").write_text(as_text(of_store(Store(path))))
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
    (tmp_path / "base.json").write_text(as_text(of_store(Store(tmp_path / "base.sqlite"))))
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
    Store(tmp_path / "bare.sqlite").append_study("check", {}, "now", "timeout", "after 1 s", "")
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
    assert "is there and no gradient-routes baseline" in ran.err


def test_a_run_compares_to_its_own_baseline(cli) -> None:
    run = ("run", "--problem", "bar[n=2]", "--route", "adjoint", "--route", "fd-central", "--min-time", "0")
    assert cli(*run).code == 0
    ran = cli("baseline")
    assert (ran.code, ran.out) == (0, "2 cases of results/routes.sqlite in results/baseline.json\n")
    assert cli(*run).code == 0
    assert cli("compare", "results/baseline.json", "results/routes.sqlite").code == 0
