"""Boxes are judged alike in any order, misjudgements counted by what they are, the table fits a terminal."""

from __future__ import annotations

import io
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from benchmarks import confusion
from benchmarks.boxes.box import RIGHT, WRONG, Box
from benchmarks.boxes.judging import Judged, judge, judge_all
from benchmarks.boxes.report import show, write

SOUND = Judged("heat", "ordinary", "right", 0, "right", True, ("agrees",), "agrees", "it agrees", (), 100, 1)
FALSE = replace(SOUND, box="sign", truth="wrong", expect=("wrong-gradient",), verdict="wrong-gradient")


def test_boxes_are_judged_and_named() -> None:
    p = np.array([0.3, 0.5, 0.9, 1.2])
    right = Box("right", p, lambda p: float(p @ p), lambda p: 2 * p, "right", RIGHT, wrong=frozenset())
    one = replace(right, name="one", gradient=lambda p: 2 * p * [1, 1, 2, 1], truth="wrong", expect=WRONG)
    found = judge(right, "squares", "ordinary", 3)
    assert found.id == "squares/right@3"
    assert (found.verdict, found.fault, found.named) == ("agrees", "", ())
    assert 20 < found.calls <= 240
    assert judge(replace(one, wrong=frozenset({2})), "squares", "ordinary", 0).named == ()
    assert judge(replace(one, wrong=frozenset({1})), "squares", "ordinary", 0).named == (2,)
    refused = judge(replace(right, options={"scale": -1.0}), "squares", "ordinary", 0)
    assert (refused.verdict, refused.fault) == ("refused", "other")


@pytest.mark.parametrize(
    ("judged", "fault"),
    [
        (SOUND, ""),
        (FALSE, ""),
        (replace(FALSE, verdict="agrees"), "acquitted"),
        (replace(SOUND, expect=("non-smooth",)), "acquitted"),
        (replace(SOUND, verdict="wrong-gradient"), "convicted"),
        (replace(SOUND, verdict="unrepeatable"), "convicted"),
        (replace(SOUND, verdict="undetermined"), "other"),
        (replace(FALSE, verdict="undetermined"), "open"),
        (replace(FALSE, verdict="undetermined", knowable=False), "other"),
        (replace(FALSE, verdict="unrepeatable"), "other"),
    ],
)
def test_a_misjudgement_is_counted_as_what_it_is(judged: Judged, fault: str) -> None:
    assert judged.fault == fault


def test_processes_change_nothing() -> None:
    alone, together = (judge_all(2, "trigonometric/", jobs) for jobs in (1, 2))
    assert alone == together
    assert {judged.seed for judged in alone} == {0, 1}
    assert len({(judged.calls, judged.says) for judged in alone}) > 2


def test_the_table_fits_a_terminal() -> None:
    out = Console(file=io.StringIO(), width=80, highlight=False)
    wrong = replace(FALSE, verdict="agrees", family="newton-tol-tightened-in-vain", named=(3,))
    show(out, [SOUND, FALSE, *[wrong] * 1000])
    lines = out.file.getvalue().splitlines()
    end = next(k for k, line in enumerate(lines) if line.startswith("all"))
    assert max(map(len, lines[: end + 1])) <= 80
    assert lines[end].split() == ["all", "1002", "1000", "1000"]
    assert lines[0].split()[1:] == ["checked", "acquitted", "convicted", "named", "open", "other"]
    assert "acquitted newton-tol-tightened-in-vain/sign@0: agrees, right: wrong-gradient; named p_4;" in "\n".join(
        lines
    )


def test_rows_are_written(tmp_path: Path) -> None:
    write([SOUND], tmp_path / "rows.json")
    (row,) = json.loads((tmp_path / "rows.json").read_text())
    assert row["id"] == "heat/right@0"
    assert row["fault"] == ""


@pytest.mark.parametrize(("verdict", "code"), [("wrong-gradient", 0), ("undetermined", 0), ("agrees", 1)])
def test_the_exit_code_is_that_of_acquittals(verdict: str, code: int, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["confusion", "--boxes"])
    monkeypatch.setattr(confusion, "judge_all", lambda *_: [SOUND, replace(FALSE, verdict=verdict)])
    with pytest.raises(SystemExit) as ended:
        confusion.main()
    assert ended.value.code == code


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--seeds", "0"], "0 - give a whole number, 1 at least"),
        (["--jobs", "x"], "x - give a whole number, 1 at least"),
        (["--json", "no-such-folder/rows.json"], "there is no folder no-such-folder"),
    ],
)
def test_bad_options_are_refused(arguments: list[str], said: str, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "argv", ["confusion", "--boxes", *arguments])
    with pytest.raises(SystemExit) as ended:
        confusion.main()
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


def test_a_name_that_no_box_has_is_refused(monkeypatch) -> None:
    monkeypatch.setattr(sys, "argv", ["confusion", "--boxes", "--only", "no-such-box", "--seeds", "1", "--jobs", "1"])
    with pytest.raises(SystemExit, match="no box contains 'no-such-box'"):
        confusion.main()
