"""Every example of a check is listed in a guide with its verdict, and gets it."""

from __future__ import annotations

import ast
import re

import numpy as np
import pytest
from commands import ROOT

from gradient_routes import check

EXAMPLES = ROOT / "examples" / "check"
ROW = re.compile(r"^\| `examples/check/(\w+\.py:\w+)` \|.*\| `([\w-]+)` \|$", re.MULTILINE)


def listed(guide: str) -> dict[str, str]:
    """Example -> verdict, as a guide has it."""
    return dict(ROW.findall((ROOT / "docs" / "how-to" / guide).read_text()))


CAUSES = listed("name-the-cause.md")
OTHERS = listed("check-your-own-code.md")  # run in test_documents and test_check_cli


def loaded(target: str):
    """The class of an example, its file run."""
    file, name = target.split(":")
    space: dict = {}
    exec(compile((EXAMPLES / file).read_text(), file, "exec"), space)
    return space[name]


@pytest.mark.parametrize(("target", "says"), CAUSES.items(), ids=CAUSES)
def test_an_example_gets_the_verdict_that_its_guide_states(cli, target: str, says: str) -> None:
    ran = cli("check", f"{EXAMPLES}/{target}", "--json", "--no-store")
    (answer,) = ran.rows
    assert (ran.err, answer["verdict"]) == ("", says)
    assert ran.code == {"agrees": 0, "wrong-gradient": 1, "noise-limited": 3}[says]


def test_no_example_is_left_out() -> None:
    classes = {
        f"{file.name}:{node.name}"
        for file in EXAMPLES.glob("*.py")
        for node in ast.parse(file.read_text()).body
        if isinstance(node, ast.ClassDef)
    }
    assert classes == CAUSES.keys() | OTHERS.keys()


def test_a_faulty_example_stands_beside_one_that_agrees() -> None:
    by_file: dict[str, set[str]] = {}
    for target, says in CAUSES.items():
        by_file.setdefault(target.split(":")[0], set()).add(says)
    assert len(by_file) == 7
    assert all("agrees" in says and len(says) == 2 for says in by_file.values())


@pytest.mark.parametrize(
    ("target", "start"),
    [
        ("flat_element.py:DeterminantTimesInverse", np.append(loaded("flat_element.py:Cofactors").start[:8], 1e-3)),
        ("equal_stretches.py:Masked", [1.1, 0.0, 0.0, 0.9]),
        ("equal_stretches.py:InJax", [1.1, 0.0, 0.0, 0.9]),
    ],
)
def test_a_fault_that_shows_at_one_point_is_not_seen_at_another(target: str, start) -> None:
    """As the docstrings say: these formulas are right away from the point that they fail at."""
    assert check(loaded(target)(), start=np.array(start)).verdict == "agrees"


def test_an_absolute_tolerance_returns_zero_near_the_data_alone() -> None:
    absolute = loaded("absolute_tolerance.py:Absolute")()
    assert not absolute.gradient(absolute.start).any()
    assert absolute.gradient(absolute.start / 1e3).all()


def test_a_component_is_named() -> None:
    found = check(loaded("index_past_end.py:PastEnd")())
    assert found.culprit is not None
    assert "k_6" in found.culprit
