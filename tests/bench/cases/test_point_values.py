"""--at VALUES: p itself in a command, all of it in order or some by name, and what it may not be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gradient_routes.bench.cases.case import point
from gradient_routes.bench.cases.point_values import shown
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.problems.problem import Parameters, Problem

RUN = ("run", "--problem", "bar[n=3,sensors=2]", "--route", "adjoint", "--no-timing", "--json")


def test_all_values_or_some_by_name() -> None:
    bar = Bar(n=3, sensors=2)
    np.testing.assert_array_equal(point(bar, "0.1,-2e-1, .3"), [0.1, -0.2, 0.3])
    np.testing.assert_array_equal(point(bar, "log E_3=-0.3, log E_1 = 0.1"), [0.1, 0.0, -0.3])
    np.testing.assert_array_equal(point(Bar(n=1), "0.5"), [0.5])
    p = np.random.default_rng(0).standard_normal(3)
    np.testing.assert_array_equal(point(bar, ",".join(map(repr, p.tolist()))), p, "every digit")


@pytest.mark.parametrize(
    ("at", "says"),
    [
        ("1,2", "--at 1,2: p has 2 values, the problem has 3 parameters - give 3"),
        ("0.5", "p has 1 values"),
        ("1,x,3", "no file, and 'x' no number"),
        ("1,,3", "no file, and '' no number"),
        ("", "no file, and '' no number"),
        ("1_0,1,1", "no file, and '1_0' no number"),
        ("nan,1,1", "nan is not finite"),
        ("1,-inf,1", "-inf is not finite"),
        ("1,-2,3", "--at 1,-2,3: E_2 = -2 is outside 0 < E_2"),
        ("E_2=-2", "E_2 = -2 is outside 0 < E_2"),
        ("E_4=1", "no file, and 'E_4' no parameter - the parameters are E_1, E_2, E_3"),
        ("E_1=1,E_1=1", "E_1 is given twice"),
        ("E_1=1,2", "'2' has no name"),
        ("E_1=", "no file, and '' no number"),
        ("no.csv", "no.csv: cannot be read"),
    ],
)
def test_what_is_no_point_is_named(at: str, says: str) -> None:
    with pytest.raises(RoutesError) as error:
        point(Bar(n=3, sensors=2, parametrization="raw"), at)
    assert says in str(error.value)
    assert "\n" not in str(error.value)


def test_names_that_are_not_unique_name_nothing() -> None:
    class Twins(Problem):
        name = "twins"
        parameters = Parameters(start=[1.0, 1.0], scale=[1.0, 1.0], label=lambda i: "k")

    np.testing.assert_array_equal(point(Twins(), "2,3"), [2.0, 3.0])
    with pytest.raises(InputError, match="not unique - give all 2 values"):
        point(Twins(), "k=2")


def test_what_exists_as_a_file_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "1,2").write_text("log_E\n0.3\n0.4\n")
    np.testing.assert_array_equal(point(Bar(n=2), "1,2"), [0.3, 0.4])
    np.testing.assert_array_equal(point(Bar(n=2), "1,3"), [1.0, 3.0])


def test_a_store_keeps_the_text_and_resumes_by_it(cli) -> None:
    row, named = (cli(*RUN, "--at", at).rows[0] for at in ("0.1,0,-0.3", "log E_1=0.1,log E_3=-0.3"))
    assert row["at"] == "0.1,0,-0.3"
    assert (row["gradient"], row["case_key"] == named["case_key"]) == (named["gradient"], False)
    assert "0 of 1 cases run" in cli(*RUN, "--at", "0.1,0,-0.3", "--resume").err
    assert "1 of 1 cases run" in cli(*RUN, "--at", "0.1,0,-0.4", "--resume").err


def test_code_of_ones_own_takes_values_without_names(cli, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("def J(p): return p @ p\ndef dJ(p): return 2 * p\n")
    check = ("check", "--objective", "mine.py:J", "--gradient", "mine.py:dJ", "--no-store", "--no-plot", "--at")
    assert cli(*check, "1.5,2").out.startswith("mine.py:dJ: agrees")
    for wrong in ("p_1=3", "1,nan"):
        ran = cli(*check, wrong)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)


def test_tables_show_long_ones_short_and_apart() -> None:
    long, other = (",".join(["0.123456789"] * 99 + [last]) for last in "12")
    assert shown("log E_1=0.1,log E_3=-0.3") == "log E_1=0.1,log E_3=-0.3"
    assert shown(long).startswith("0.123456789,0.123456789,... (100 values, #")
    assert shown(long) != shown(other)
    assert shown("a/very/long/path/of/a/file/of/moduli.csv") == "a/very/long/path/of/a/file/of/moduli.csv"
