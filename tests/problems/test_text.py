"""Texts of other people's code are kept up to 4 kB, head and tail, wherever they come from."""

from __future__ import annotations

import json

import numpy as np
import pytest

from gradient_routes.bench.store.store import Store
from gradient_routes.problems.problem import Parameters
from gradient_routes.problems.text import MOST, shortened

TALKATIVE = """
import numpy as np
from gradient_routes import Parameters, Problem

LONG = "head " + 100_000 * "x" + " tail"

class Talkative(Problem):
    name = LONG
    notes = (LONG,)
    parameters = Parameters(np.ones(2), np.ones(2), unit=LONG, label=lambda i: f"{i}{LONG}")

    def value(self, p):
        %s

class Mine:
    start = np.ones(2)
    names = [LONG, LONG]

    def objective(self, p):
        return p @ p

    def gradient(self, p):
        raise ValueError(LONG)
"""


@pytest.mark.parametrize("most", [60, 61, 99, 100, 200])
@pytest.mark.parametrize("length", [0, 1, 59, 60, 61, 62, 99, 100, 101, 102, 110, 199, 200, 201, 202, 300])
def test_head_and_tail_are_kept(length: int, most: int) -> None:
    text = "".join(chr(c) for c in np.random.default_rng(length).integers(1, 0xD800, length))
    short = shortened(text, most)
    assert len(short) <= most
    if len(text) <= most:
        assert short == text
        return
    head, tail = short.split(" [... ")[0], short.split(" left out ...] ")[-1]
    assert text.startswith(head)
    assert text.endswith(tail)
    assert f" [... {len(text) - len(head) - len(tail)} characters left out ...] " in short


def test_names_and_units_are_shortened() -> None:
    long = 10 * MOST * "x"
    parameters = Parameters(np.ones(2), np.ones(2), unit=(long, "m"), label=lambda i: f"{i}{long}")
    assert [len(parameters.unit_of(i)) for i in (0, 1)] == [MOST, 1]
    assert len(parameters.label(1)) == MOST
    assert parameters.label(1).startswith("1x")


@pytest.mark.parametrize("does", ["raise ValueError(LONG)", "return p @ p"])
@pytest.mark.parametrize("isolate", ["--isolate", "--no-isolate"])
def test_no_row_keeps_more(cli, does: str, isolate: str) -> None:
    """Nor does one in JSON, nor a line of the terminal."""
    with open("model.py", "w") as file:
        file.write(TALKATIVE % does)
    asked = ("run", "--problem", "model.py:Talkative", "--route", "fd-central", "--min-time", "0", isolate)
    ran = cli(*asked, "--gradient")
    assert max(len(line) for line in (ran.out + ran.err).splitlines()) < 3 * MOST
    (row,) = json.loads(json.dumps(Store("results/routes.sqlite").rows()))
    assert row["status"] == ("failed" if does.startswith("raise") else "ok")
    texts = {name: value for name, value in row.items() if isinstance(value, str) and name != "stderr"}
    assert max(map(len, texts.values())) <= MOST
    if does.startswith("raise"):
        assert "ValueError: head xxx" in row["reason"]
        assert "characters left out ...] xxx" in row["traceback"]
        assert row["traceback"].endswith(" tail\n")


def test_nor_does_a_row_of_a_study(cli) -> None:
    with open("model.py", "w") as file:
        file.write(TALKATIVE % "return p @ p")
    ran = cli("check", "model.py:Mine", "--no-plot")
    assert "characters left out" in ran.out
    assert max(len(line) for line in (ran.out + ran.err).splitlines()) < 3 * MOST
    records = Store("results/routes.sqlite").records("checks")
    assert max(len(value) for row in records for value in row.values() if isinstance(value, str)) <= MOST
