"""expected.toml: which failures are known, and why."""

from __future__ import annotations

from pathlib import Path

import pytest

from gradient_routes.bench.cases.expected import beside, judged, read
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.problems.errors import InputError

ENTRY = """
[[expected]]
problem = "bar[n=1e6]"
route = "unrolled-ad"
status = "out-of-memory"
reason = "the tape of a million iterates"
"""


def row(**values):
    options = {"problem_options": {"n": 1_000_000, "data": None}, "route_options": {"inner": "cg"}}
    return empty_row() | {"problem": "bar", "route": "unrolled-ad", "status": "out-of-memory"} | options | values


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "expected.toml"
    path.write_text(text)
    return path


def test_a_row_that_fails_as_expected_is_expected_with_its_reason(tmp_path: Path) -> None:
    found = judged(row(), read(written(tmp_path, ENTRY)))
    assert found is not None
    assert (found.word, found.says) == ("expected", "expected: the tape of a million iterates")


def test_a_row_that_is_ok_all_the_same_is_an_unexpected_success(tmp_path: Path) -> None:
    found = judged(row(status="ok"), read(written(tmp_path, ENTRY)))
    assert found is not None
    assert found.word == "unexpected success"
    assert "out-of-memory was expected: the tape of a million iterates" in found.says


def test_failing_in_another_way_is_not_expected(tmp_path: Path) -> None:
    assert judged(row(status="crashed"), read(written(tmp_path, ENTRY))) is None


@pytest.mark.parametrize(
    ("problem", "route", "matches"),
    [
        ("bar", "unrolled-ad", True),
        ("all", "all", True),
        ("bar[n=1000000,data=none]", "unrolled-ad[inner=cg|jacobi]", True),
        ("bar[n=8|1e6]", "all", True),
        ("bar[n=8]", "unrolled-ad", False),
        ("bar[n=many]", "unrolled-ad", False),
        ("bar[unheard=1]", "all", False),
        ("bar", "unrolled-ad[inner=jacobi]", False),
        ("block", "unrolled-ad", False),
        ("bar", "adjoint", False),
    ],
)
def test_selectors_match_by_name_and_by_the_options_they_name(
    tmp_path: Path, problem: str, route: str, matches: bool
) -> None:
    text = ENTRY.replace("bar[n=1e6]", problem).replace("unrolled-ad", route)
    (expectation,) = read(written(tmp_path, text))
    assert expectation.matches(row()) is matches


def test_of_two_entries_the_one_with_the_status_counts(tmp_path: Path) -> None:
    other = ENTRY.replace("out-of-memory", "timeout").replace("the tape", "the time")
    found = judged(row(), read(written(tmp_path, other + ENTRY)))
    assert found is not None
    assert found.expectation.status == "out-of-memory"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[expected]\n", "is no TOML"),
        ("expect = 1\n", "unknown key 'expect' - write entries under [[expected]]"),
        ("expected = 1\n", "is no list of entries"),
        ("expected = [1]\n", "entry 1: is no table"),
        (ENTRY + "why = 'so'\n", "entry 1: unknown key 'why'"),
        (ENTRY + "reasons = 'so'\n", "entry 1: unknown key 'reasons' - did you mean 'reason'?"),
        (ENTRY.replace("out-of-memory", "ok"), "entry 1: status 'ok'"),
        (ENTRY.replace("out-of-memory", "time-out"), "entry 1: status 'time-out' - did you mean 'timeout'?"),
        (ENTRY.replace("the tape of a million iterates", " "), 'entry 1: has no reason - write reason = "..."'),
        (ENTRY.replace('status = "out-of-memory"', ""), "entry 1: has no status"),
        (ENTRY.replace('"bar[n=1e6]"', "3"), "entry 1: has no problem"),
        (ENTRY + ENTRY.replace("bar[n=1e6]", "bar[n"), "entry 2: problem: selector 'bar[n'"),
        (ENTRY.replace("bar[n=1e6]", "all[n=8]"), "'all' takes no options"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line_that_names_it(tmp_path: Path, text: str, said: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError) as refused:
        read(path)
    line = str(refused.value)
    assert line.startswith(str(path))
    assert said in line
    assert " - " in line
    assert "\n" not in line


def test_a_file_that_is_no_text_or_not_there_is_refused(tmp_path: Path) -> None:
    binary = tmp_path / "expected.toml"
    binary.write_bytes(b"\xff\xfe")
    for path in (binary, tmp_path / "none.toml", tmp_path):
        with pytest.raises(InputError, match=" - "):
            read(path)


def test_without_a_file_beside_the_store_nothing_is_expected(tmp_path: Path) -> None:
    assert beside(tmp_path / "routes.sqlite") == ()
    written(tmp_path, ENTRY)
    assert len(beside(tmp_path / "routes.sqlite")) == 1
