"""The public interface: lazy, typed, complete; its examples are what they print; it answers as the command does."""

from __future__ import annotations

import ast
import doctest
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from commands import ROOT
from duffing.problem import Duffing

import gradient_routes
from gradient_routes import (
    InputError,
    NotConverged,
    Offers,
    Parameters,
    Problem,
    Store,
    identify,
    invert,
    route,
    run,
    vcurve,
)
from gradient_routes.bench.cases import sources
from gradient_routes.problems.bar import Bar
from gradient_routes.routes.adjoint import adjoint

EXAMPLES = {"run", "vcurve", "invert", "identify", "check", "assert_gradient", "Store", "gradient_routes"}
PACKAGE = Path(gradient_routes.__file__).parent


def examples() -> list[doctest.DocTest]:
    """Of the package and of all that it exports."""
    finder, found = doctest.DocTestFinder(recurse=False, exclude_empty=True), []
    public = {name: getattr(gradient_routes, name) for name in gradient_routes.__all__}
    for name, thing in {"gradient_routes": gradient_routes, **public}.items():
        if thing is gradient_routes or thing.__module__.startswith("gradient_routes."):
            found += finder.find(thing, name, module=False, globs=dict(public))
    return [test for test in found if test.examples]


@pytest.mark.parametrize("test", examples(), ids=lambda test: test.name)
def test_examples_print_what_they_show(test: doctest.DocTest, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    said: list[str] = []
    doctest.DocTestRunner().run(test, out=said.append)
    assert not said, "".join(said)


def test_every_function_has_an_example() -> None:
    assert {test.name for test in examples()} >= EXAMPLES


def test_public_names_are_defined_where_they_are_said_to_be() -> None:
    """For import, for `dir`, for `import *` and for type checkers alike."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    typed = {
        alias.name: node.module
        for block in tree.body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert typed == gradient_routes.PUBLIC
    assert {*dir(gradient_routes)} >= {*gradient_routes.__all__} == {*gradient_routes.PUBLIC}
    space: dict = {}
    exec("from gradient_routes import *", space)
    for name, module in gradient_routes.PUBLIC.items():
        assert space[name] is getattr(import_module(module), name)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        gradient_routes.nothing  # noqa: B018


def test_the_package_loads_nothing_before_it_is_used(tmp_path: Path) -> None:
    code = "import sys, gradient_routes; print([m for m in sys.modules if m.partition('.')[0] in ('numpy', 'click')])"
    assert subprocess.check_output([sys.executable, "-c", code], text=True, cwd=tmp_path) == "[]\n"


def test_a_problem_that_imports_public_names_rests_on_their_modules(tmp_path: Path) -> None:
    """A digest tells when code has changed that a gradient depends on, by whatever name it was imported."""
    contract = PACKAGE / "problems" / "problem.py"
    for line in (
        "from gradient_routes import Problem",
        "import gradient_routes as gr",
        "from gradient_routes import *",
    ):
        file = tmp_path / "mine.py"
        file.write_text(line.format("gradient_routes"))
        assert contract in sources.closure(file, tmp_path, None), line
    file.write_text("import json\n")
    assert sources.closure(file, tmp_path, None) == {file}


def test_run_takes_problems_and_routes_of_a_notebook() -> None:
    @route("twice", needs=Offers.LINEARIZE, cost=lambda n_p, forward: adjoint.cost(n_p, forward, factors="refined"))
    def twice(model, p):
        return adjoint.prepare(model, p)(p)

    frame = run([Duffing(), "bar[n=2]"], [twice, "adjoint"], timing=False)
    assert list(zip(frame["problem"], frame["route"], strict=True)) == [
        ("duffing", "twice"), ("duffing", "adjoint"), ("bar", "twice"), ("bar", "adjoint"),
    ]  # fmt: skip
    assert set(frame["status"]) == {"ok"}
    assert frame["gradient_error"].max() < 1e-12
    assert frame["seconds"].isna().all()


def test_run_times_where_it_is_asked_to() -> None:
    frame = run("bar", "adjoint", min_time=0.0)
    assert (frame["seconds"] > 0).all()


def test_a_case_that_fails_is_a_row() -> None:
    class Broken(Problem):
        name, offers, n_state = "broken", Offers.VALUE, 0
        parameters = Parameters(start=np.ones(2), scale=np.ones(2))

        def value(self, p):
            raise ValueError("no mesh")

    (row,) = run(Broken(), "fd-central").to_dict("records")
    assert row["status"] == "failed"
    assert "no mesh" in row["reason"]


def test_the_store_gives_frames(tmp_path: Path) -> None:
    store = Store(tmp_path / "kept.sqlite")
    frame = run("bar[n=2]", ["adjoint", "tangent"], timing=False, store=store)
    cases = store.cases()
    assert list(cases["gradient_error"]) == list(frame["gradient_error"])
    assert str(cases["n_param"].dtype) == "Int64"
    store.append_study("tolerance", {"tolerance": []}, "2026-01-01T00:00:00Z")
    assert list(store.studies()["study"]) == ["tolerance"]
    assert store.studies("tolerance").empty
    assert "reference" in Store(ROOT / "results" / "reference.sqlite").cases().columns
    assert len(Store(ROOT / "results" / "reference.sqlite").studies("points")) > 100


def test_an_inversion_finds_what_the_command_finds(cli) -> None:
    found = invert("bar[n=3]", optimizer="gauss-newton", rtol=1e-13)
    rows = cli("invert", "--problem", "bar[n=3]", "--optimizer", "gauss-newton", "--rtol", "1e-13", "--json").rows
    estimates = [row["estimate"] for row in rows if row["table"] == "estimates"]
    assert found.p.tolist() == estimates


def test_solver_options_reach_the_solver() -> None:
    nonlinear = "bar[stop=penalty]"
    assert run(nonlinear, "adjoint", timing=False, max_steps=1)["status"][0] == "not-converged"
    for function in (identify, invert):
        with pytest.raises(NotConverged):
            function(nonlinear, max_steps=1)
    assert vcurve(nonlinear, max_steps=1).verdict == "undetermined"


@pytest.mark.parametrize(
    ("ask", "says"),
    [
        (lambda: run("bra"), "no problem 'bra' - did you mean 'bar'?"),
        (lambda: run("bar", "adjoin"), "did you mean 'adjoint'?"),
        (lambda: run([Bar(n=2), Bar(n=3)]), "problems: two are named 'bar' - give each a name of its own"),
        (lambda: run(Bar(n=2), store="x.sqlite"), "give problem and route as selectors"),
        (lambda: run("bar", min_time=-1.0), "give seconds >= 0"),
        (lambda: run("bar", budget=0.0), "give seconds > 0"),
        (lambda: run("bar", components=1, directions=1), "give one of them"),
        (lambda: vcurve("bar[n=2|3]"), "'bar[n=2|3]': names 2 - name one"),
        (lambda: vcurve("bar", per_decade=1), "give 2 to 100"),
        (lambda: vcurve("bar", rtol=2.0), "give 0 < rtol < 1"),
        (lambda: invert("bar", optimizer="lbfg"), "did you mean 'lbfgs'?"),
        (lambda: invert("bar", positive="lg"), "did you mean 'log'?"),
        (lambda: invert("bar", iterations=-1), "iterations=-1, tolerance=1e-09, rate=0.1 - give iterations >= 0"),
        (lambda: invert("bar", tolerance=1.0), "a tolerance below 1"),
        (lambda: invert("bar", rate=float("nan")), "a rate > 0"),
        (lambda: invert("bar", linear_solver="lu"), "--linear-solver lu - "),
        (lambda: identify("bar", noise=-1.0), "give a finite standard deviation > 0"),
        (lambda: Store("nowhere.sqlite").cases(), "no such file"),
        (lambda: Store("nowhere.sqlite").studies("cases"), "no table 'cases' of studies"),
    ],
)
def test_what_cannot_be_asked_is_an_input_error_of_one_line(ask, says: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as caught:
        ask()
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("missing", ["pandas", "pyarrow"])
def test_what_is_not_installed_is_said_with_the_extra_that_has_it(missing: str, cli, monkeypatch) -> None:
    cli("run", "--problem", "bar[n=1]", "--route", "adjoint", "--no-timing")
    monkeypatch.setitem(sys.modules, missing, None)
    ran = cli("export", "-o", "cases.parquet")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert f"needs {missing}, which is not installed - pip install 'gradient-routes[parquet]'" in ran.err
    assert cli("export", "-o", "cases.csv").code == 0
    if missing == "pandas":
        with pytest.raises(InputError, match=r"pip install 'gradient-routes\[frames\]'"):
            run("bar", "adjoint")
