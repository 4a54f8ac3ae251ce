"""`routes advise`: what it prints and how it ends."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

BOX = """
import numpy as np
from gradient_routes import Offers, Parameters, Problem

class Box(Problem):
    name, offers = "box", Offers.VALUE
    parameters = Parameters(np.ones(3), np.ones(3))

    def value(self, p):
        return float(p @ p)

class Stuck(Box):
    def value(self, p):
        raise ValueError("no licence")
"""


def advice(cli, *arguments: str) -> dict:
    ran = cli("advise", *arguments, "--json")
    assert (ran.code, ran.err) == (0, "")
    (row,) = ran.rows
    return row


def test_it_predicts_the_work_that_run_counts(cli) -> None:
    found = advice(cli, "--problem", "bar[n=6]")
    routes = ("fd-one-sided", "fd-central", "complex-step", "tangent", "adjoint")
    named = [word for route in routes for word in ("--route", route)]
    rows = cli("run", "--problem", "bar[n=6]", *named, "--no-timing", "--no-store", "--json").rows
    predicted = {each["route"]: each for each in found["routes"]}
    assert len(rows) == len(routes)
    for row in rows:
        assert row["work"] == predicted[row["route"]]["work"]
        assert row["gradient_error"] < 1e3 * predicted[row["route"]]["error"]


def test_a_table_reasons_and_what_would_change_it(cli) -> None:
    ran = cli("advise", "--parameters", "5000", "--newton-steps", "6", "--have", "trace", "--have", "linearize")
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.startswith("one objective, 5000 parameters, 100000 unknowns, 6 Newton steps, a forward solve 1 s\n")
    assert "\nrecommended: adjoint\n" in ran.out
    assert "[Giles & Pierce 2000; Plessix 2006; Hinze et al. 2009; docs/explanation/adjoint-algebra.md]" in ran.out
    assert "\nwith at most 1 parameter " in ran.out
    assert "\nwithout the partial derivatives R_p, J_u, J_p implicit-ad " in ran.out


def test_a_black_box(cli, tmp_path: Path) -> None:
    (tmp_path / "box.py").write_text(BOX)
    found = advice(cli, "--problem", "box.py:Box")
    assert found["recommended"] == "fd-one-sided"  # J is exact to rounding: right to 1.5e-8
    assert found["answers"]["n_p"] == 3
    assert found["answers"]["offers"] == ["value"]
    ran = cli("advise", "--problem", "box.py:Stuck")
    assert ran.code == 1
    assert ran.err.count("\n") == 1
    assert "no licence" in ran.err


def test_json_has_no_infinity(cli) -> None:
    found = advice(cli, "--memory", "none", "--have", "solve")
    assert (found["answers"]["memory"], found["answers"]["budget"]) == (None, None)
    assert {each["route"] for each in found["routes"] if each["seconds"] is None} >= {"adjoint", "implicit-ad"}
    assert json.dumps(found, allow_nan=False)
    assert {change["says"] for change in found["changes"]} >= {"with the partial derivatives R_p, J_u, J_p"}


def test_where_no_route_is_possible_it_says_what_would_help(cli) -> None:
    ran = cli("advise", "--have", "value", "--forward", "60", "--budget", "600")
    assert (ran.code, ran.err) == (1, "")
    assert "no route is possible" in ran.out
    assert "with at most 9 parameters" in ran.out
    assert "with the partial derivatives R_p, J_u, J_p" in ran.out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("--parameters 0", "--parameters 0 - give a whole number from 1 to 1000000000"),
        ("--rtol 1", "--rtol 1 - give a number > 0 and < 1"),
        ("--error nan", "--error nan - give a number > 0 and < 1"),
        ("--memory much", "--memory much - give a size from 64MiB on, 4GiB say, or none"),
        ("--forward inf", "--forward inf - give seconds > 0 and <= 1e+12"),
        ("--budget -1", "--budget -1 - give seconds > 0, or inf"),
        ("--steps 1.5", "--steps 1.5 - give a whole number from 1 to 1000000000"),
        ("--have everything", "'everything' is not one of"),
        ("--problem bar --steps 3", "--steps: is told by --problem - leave it out"),
        ("--problem bar --kinks", "--kinks: is told by --problem - leave it out"),
        ("--problem nosuch", "no problem 'nosuch'"),
        ("--problem all", "--problem all: names 10 problems - name one"),
        ("--at true", "--at: is a point of a --problem - leave it out"),
        ("--columns x=A", "--columns: no --problem reads a file"),
    ],
)
def test_wrong_answers_end_in_one_line(cli, arguments: str, says: str) -> None:
    ran = cli("advise", *arguments.split())
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("routes: ")
    assert ran.err.count("\n") == 1
    assert says in ran.err
