"""The command line: what it prints, what it keeps, how it ends."""

from __future__ import annotations

import os
import pty
import re
import select
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import ROOT, shell, with_routes
from forks import Forks

from gradient_routes.bench.cases.row import COLUMNS
from gradient_routes.bench.cases.samples import Elapsed
from gradient_routes.bench.commands.version import checked_out
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.bar import Bar
from gradient_routes.routes.tally import KINDS

FIELDS = (
    "problem problem_options route route_options status reason n_state n_param objective gradient gradient_norm "
    "gradient_error reference prepare_s first_s seconds forward_s peak_bytes tape_bytes work predicted_work"
).split()
HELP = """
from gradient_routes.bench.cli import main
main(["--help"], standalone_mode=False)"""
QUICK = ("--min-time", "0")


def run(cli, *arguments: str, problem: str = "bar", route: str = "adjoint"):
    return cli("run", "--problem", problem, "--route", route, *QUICK, *arguments)


def test_json_rows_are_complete(cli) -> None:
    ran = run(cli, "--json", route="all")
    assert (ran.code, ran.err) == (0, "")
    names = "fd-one-sided fd-central complex-step tangent adjoint unrolled-ad implicit-ad"
    assert [row["route"] for row in ran.rows] == names.split()
    bar = Bar()
    reference = bar.reference(bar.parameters.start)
    for row in ran.rows:
        assert set(FIELDS) <= row.keys() == {c.name for c in COLUMNS}
        assert row["status"] == "ok"
        assert row["work"].keys() == set(KINDS)
        assert row["work"] == row["predicted_work"]
        assert row["gradient_error"] < (1e-5 if row["route"].startswith("fd") else 1e-12)
        assert row["gradient_norm"] == pytest.approx(np.linalg.norm(row["gradient"]), rel=1e-15)
        np.testing.assert_allclose(row["gradient"], reference.gradient, rtol=1e-5, atol=1e-12)
        assert row["seconds"] > 0 < row["forward_s"]
        assert row["peak_bytes"] >= 0
        assert (row["tape_bytes"] is not None) == row["route"].endswith("-ad")
    assert {row["objective"] for row in ran.rows} != {None}


def test_long_gradients_come_on_demand(cli) -> None:
    problem = "bar[n=65]"
    assert run(cli, "--json", problem=problem).rows[0]["gradient"] is None
    assert len(run(cli, "--json", "--gradient", problem=problem).rows[0]["gradient"]) == 65


def test_the_table_tells_the_bill(cli) -> None:
    out = run(cli, route="all").out
    for words in (
        "n_u",
        "n_p",
        "error",
        "cost / forward solve",
        "1 fwd + 8 lin",
        "1 fwd + 1 adj",
        "16 fwd",
        "KiB",
        "<1 MiB",
        "closed form",
    ):
        assert words in out
    assert "3 of 8 elements lie behind the last sensor: blind" in out


def test_tables_fit_80_columns(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    long = ("--route", "unrolled-ad[inner=jacobi,iterations=100]", "--route", "fd-central[start=chord]")
    out = [run(cli, *long, problem="bar[n=8,sensors=1,3,5,7]", route="all").out]
    store = "results/routes.sqlite"
    out += [cli(*command).out for command in (["report"], ["status"], ["compare", store, store])]
    for table in out:
        rows = [line for line in table.splitlines() if ":" not in line and "; " not in line]
        assert len(rows) > 3
        assert max(map(len, rows)) <= 80
    assert "1 fwd" in out[0]


def test_lists_and_gradients_fit_80_columns(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    listed = cli("list").out
    assert max(map(len, listed.splitlines())) <= 80
    assert "fault=sign|factor|transpose|missing-term|stale|loose|functional|otd|scale\n" in listed
    assert "…" not in listed
    shown = run(cli, "--gradient").out.partition("bar by adjoint\n")[2]
    assert max(map(len, shown.splitlines())) <= 80
    assert "-0.00962261" in shown


def test_gradient_view_shows_strains_and_the_blind(cli) -> None:
    out = run(cli, "--gradient").out
    assert "eps[u]" in out
    assert "eps[lam]" in out
    assert sum(line.rstrip().endswith("blind") for line in out.splitlines() if line.startswith("log E_")) == 3
    assert "1000 more" not in run(cli, "--gradient", problem="bar[n=1064]").out.split("...")[0]
    assert "... 1000 more" in run(cli, "--gradient", problem="bar[n=1064]").out


@pytest.mark.parametrize(("iterations", "blind"), [(100, "blind*"), (2000, "blind")])
def test_the_view_says_whether_the_solution_is_blind_or_the_iterate_too(cli, iterations: int, blind: str) -> None:
    """After 100 iterations of Jacobi's method J depends on the elements behind the last sensor."""
    route = f"unrolled-ad[inner=jacobi,iterations={iterations}]"
    lines = cli("run", "--problem", "bar", "--route", route, "--gradient", *QUICK).out.splitlines()
    marks = [line.rpartition(" ")[2].strip() for line in lines if line.startswith("log E_")]
    assert marks[5:] == [blind] * 3
    assert not any("blind" in mark for mark in marks[:5])
    told = [line for line in lines if line.startswith("* blind for the solution, not for this iterate: |R| / |R_0| =")]
    assert len(told) == (blind == "blind*")


def test_grids_and_repeats_multiply(cli) -> None:
    problems = ("--problem", "bar[n=1|2]", "--problem", "bar[sensors=1,3]")
    ran = cli("run", *problems, "--route", "fd-central[start=cold|warm]", "--route", "adjoint", "--json", *QUICK)
    assert [(r["n_param"], r["route"], r["route_options"].get("start")) for r in ran.rows] == [
        (n, *route) for n in (1, 2, 8) for route in (("fd-central", "cold"), ("fd-central", "warm"), ("adjoint", None))
    ]


def test_points_to_differentiate_at(cli, tmp_path: Path) -> None:
    truth = run(cli, "--json", "--at", "true").rows[0]
    assert truth["objective"] < 1e-30
    assert truth["gradient_error"] < 1e-15
    assert "relative to its terms" in truth["reference"]
    (tmp_path / "p.csv").write_text("log_E\n" + "0.5\n" * 8)
    halfway = run(cli, "--json", "--at", "p.csv").rows[0]
    bar = Bar()
    np.testing.assert_allclose(halfway["gradient"], bar.reference(np.full(8, 0.5)).gradient, rtol=1e-12)


def test_many_moduli_answer_in_seconds(cli) -> None:
    """The tutorial has a million of them."""
    ran = run(cli, "--json", "--budget", "6", problem="bar[n=100000]", route="all")
    rows = {row["route"]: row for row in ran.rows}
    done = {name for name, row in rows.items() if row["status"] == "ok"}
    assert done == {"adjoint", "implicit-ad"}
    for name in rows.keys() - done:
        assert rows[name]["status"] == "skipped"
        assert "predicted" in rows[name]["reason"]
        assert "--budget inf" in rows[name]["reason"]
        assert rows[name]["predicted_s"] > 6
    for name in done:
        assert rows[name]["gradient_error"] < 1e-12


def test_the_budget_is_the_users(cli) -> None:
    skipped = run(cli, "--json", "--budget", "1e-9").rows[0]
    assert skipped["status"] == "skipped"
    assert skipped["seconds"] is None
    assert run(cli, "--json", "--budget", "inf").rows[0]["status"] == "ok"


def test_iterations_that_turn_out_too_dear_are_not_taped(cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The estimate of k ends at n_u, rounding does not: the bill is asked for again once k is known."""
    price = Elapsed(1e-5, 1e-5)  # of a solve, and of each of 2 k products
    monkeypatch.setattr("gradient_routes.bench.execution.cost_model.price_of", lambda call: (price, call()))
    p = 2.0 * np.random.default_rng(0).standard_normal(1000)
    np.savetxt(tmp_path / "p.csv", p, header="log_E", comments="")
    problem = "bar[n=1000,sensors=1000]"
    row = run(cli, "--json", "--at", "p.csv", "--budget", "0.021", problem=problem, route="unrolled-ad").rows[0]
    assert row["status"] == "skipped"
    assert row["predicted_s"] > 0.021
    assert row["predicted_work"]["matvecs"] > 2 * 1000
    assert row["route_options"]["iterations"] == row["predicted_work"]["matvecs"] // 2


def test_a_tape_beyond_memory_is_not_tried(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gradient_routes.bench.execution.cost_model.available_bytes", lambda: 10_000)
    row = run(cli, "--json", route="unrolled-ad[iterations=100]").rows[0]
    assert "of memory at hand" in row["reason"]
    assert run(cli, "--json", "--budget", "inf", route="unrolled-ad[iterations=100]").rows[0]["status"] == "ok"


def test_notes_and_reasons_name_their_problem(cli) -> None:
    out = run(cli, "--budget", "1e-9", problem="bar[n=8|16]").out
    assert "note: bar[n=16]: 11 of 16" in out
    assert "skipped: bar[n=16]: adjoint: predicted" in out


def test_an_overflowing_tape_is_a_failed_row_not_a_nan(cli, tmp_path: Path) -> None:
    """On rough moduli the backward sweep of CG amplifies without bound: the row says so, the next case runs."""
    p = np.random.default_rng(0).standard_normal(1000)
    np.savetxt(tmp_path / "p.csv", p, header="log_E", comments="")
    ran = cli("run", "--problem", "bar[n=1000,sensors=1000]", "--route", "unrolled-ad", "--route", "adjoint", "--json",
              "--at", "p.csv", *QUICK)  # fmt: skip
    assert ran.code == 1
    assert ran.rows[0]["status"] == "failed"
    assert "backward sweep" in ran.rows[0]["reason"]
    assert ran.rows[0]["gradient"] is None
    assert ran.rows[1]["status"] == "ok"


SINGLE = """
import numpy as np
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.route import Offers, route

@route("single", needs=Offers.LINEARIZE, cost=lambda n_p, forward: adjoint.cost(n_p, forward, factors="refined"))
def single(model, p):
    return (result := adjoint.function(model, p))._replace(gradient=result.gradient.astype(np.float32))
"""


def test_a_gradient_in_single_precision_is_told_how_to_get_double(cli, tmp_path: Path) -> None:
    (tmp_path / "single.py").write_text(SINGLE)
    noted = {row["route"]: row["note"] for row in run(cli, "--json", "--route", "single.py:single").rows}
    assert "single: gradient in float32: compute in float64 (JAX: jax.config" in noted["single.py:single"]
    assert "float64" not in noted["adjoint"]


def test_a_step_out_of_the_domain_fails_its_case_only(cli, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("E\n" + "1e-9\n" * 8)
    ran = cli("run", "--problem", "bar[parametrization=raw]", "--route", "fd-central", "--route", "adjoint", "--json",
              "--at", "p.csv", *QUICK)  # fmt: skip
    assert ran.code == 1
    assert "passes its bound 0" in ran.rows[0]["reason"]
    assert ran.rows[1]["status"] == "ok"


WRONG = {
    "unknown problem": (["run", "--problem", "barr", "--route", "adjoint"], "no problem 'barr' - did you mean 'bar'?"),
    "unknown route": (["run", "--problem", "bar", "--route", "adjiont"], "did you mean 'adjoint'?"),
    "unknown option": (["run", "--problem", "bar[m=8]", "--route", "adjoint"], "bar: no option 'm'"),
    "option of no option": (["run", "--problem", "bar", "--route", "adjoint[h=1]"], "adjoint: no option 'h'"),
    "grid with a typo": (["run", "--problem", "bar[n=8|1x]", "--route", "adjoint"], "n=1x is not a whole number"),
    "broken selector": (["run", "--problem", "bar[n=8", "--route", "adjoint"], "write NAME"),
    "options of all": (["run", "--problem", "all[n=8]", "--route", "adjoint"], "'all' takes no options"),
    "zero N": (["run", "--problem", "bar[n=0]", "--route", "adjoint"], "choose n >= 1"),
    "negative N": (["run", "--problem", "bar[n=-8]", "--route", "adjoint"], "choose n >= 1"),
    "sensor out of range": (["run", "--problem", "bar[sensors=3,9]", "--route", "adjoint"], "nodes 1..8"),
    "sensor repeated": (["run", "--problem", "bar[sensors=3,3]", "--route", "adjoint"], "each node once"),
    "negative alpha": (["run", "--problem", "bar[alpha=-1]", "--route", "adjoint"], "finite and >= 0"),
    "no data file": (["run", "--problem", "bar[data=no.csv]", "--route", "adjoint"], "no.csv: cannot be read"),
    "data without truth": (
        ["run", "--problem", f"bar[data={ROOT}/examples/bar_displacements.csv]", "--route", "adjoint", "--at", "true"],
        "not known",
    ),
    "no p file": (["run", "--problem", "bar", "--route", "adjoint", "--at", "no.csv"], "no.csv: cannot be read"),
    "bad step": (["run", "--problem", "bar", "--route", "fd-central[step=-1]"], "finite and > 0"),
    "bad iterations": (["run", "--problem", "bar", "--route", "unrolled-ad[iterations=0]"], "at least 1"),
    "bad budget": (["run", "--problem", "bar", "--route", "adjoint", "--budget", "nan"], "--budget"),
    "bad time": (["run", "--problem", "bar", "--route", "adjoint", "--min-time", "inf"], "--min-time"),
    "bad point after a good one": (
        ["run", "--problem", "bar[n=8|0]", "--route", "adjoint"],
        "choose n >= 1",
    ),
    "export of nothing": (["export", "--store", "no.sqlite"], "no such file"),
    "report of nothing": (["report", "--store", "no.sqlite"], "no such file"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_usage_is_one_line_and_exit_code_two(cli, case: str) -> None:
    arguments, says = WRONG[case]
    ran = cli(*arguments)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("routes: ")
    assert says in ran.err
    assert ran.err.count("\n") == 1
    assert not list(Path().glob("results/*")), "nothing ran, nothing is kept"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("E\n" + "1\n" * 7, "7 values, the problem has 8"),
        ("E\n" + "1\n" * 7 + "x\n", "line 9, column E: 'x' is not a number"),
        ("E\n" + "1\n" * 7 + "nan\n", "nan is not finite"),
        ("E\n" + "1\n" * 7 + "-2\n", "E_8 = -2 is outside 0 < E_8"),
        ("E,F\n" + "1,2\n" * 8, "has 2 columns"),
        ("1\n" * 8, "line 1 holds numbers"),
        ("", "empty"),
    ],
)
def test_wrong_points_are_named(cli, tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "p.csv").write_text(text)
    ran = run(cli, "--at", "p.csv", problem="bar[parametrization=raw]")
    assert (ran.code, ran.out) == (2, "")
    assert says in ran.err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("run --problem bar", "--route"),
        ("rnu", "No such command 'rnu'"),
        ("export --format xls", "'xls'"),
        ("list everything", "'everything'"),
        ("run --problem bar --route adjoint --bugdet 3", "--bugdet"),
    ],
)
def test_wrong_flags_are_one_line_too(cli, arguments: str, says: str) -> None:
    ran = cli(*arguments.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err
    assert "--help" in ran.err


def test_debug_shows_the_traceback(cli, tmp_path: Path) -> None:
    plain = cli("run", "--problem", "barr", "--route", "adjoint")
    debug = cli("run", "--problem", "barr", "--route", "adjoint", "--debug")
    assert (plain.code, "Traceback" in plain.err) == (2, False)
    assert (debug.code, "Traceback" in debug.err) == (2, True)
    (tmp_path / "p.csv").write_text("E\n" + "1e-9\n" * 8)
    case = ("run", "--no-store", "--problem", "bar[parametrization=raw]", "--route", "fd-central", "--at", "p.csv")
    assert "Traceback" not in cli(*case, "--no-isolate").err
    assert "DomainError" in cli(*case, "--debug", "--isolate").err


@pytest.mark.parametrize("what", [[], ["problems"], ["routes"]])
def test_list_shows_options_and_contracts(cli, what: list[str]) -> None:
    out = cli("list", *what).out
    assert ("parametrization=log|raw" in out) == (what != ["routes"])
    assert ("inner=cg|richardson|jacobi" in out) == (what != ["problems"])
    assert ("offers: linearize, trace, complex" in out) == (what != ["routes"])
    assert ("R_u^T lam = -J_u" in out) == (what != ["problems"])


def test_help_names_every_verb(cli) -> None:
    out = cli("--help").out
    for verb in ("list", "run", "export", "report"):
        assert verb in out
        assert cli(verb, "--help").code == 0


def test_version_says_version_commit_and_python(cli, tmp_path: Path) -> None:
    said = cli("--version").out
    assert re.fullmatch(r"routes \d+\.\d+\S*( \(commit [0-9a-f]{7,}(-dirty)?\))?, Python 3\.\d+\.\d+\n", said)
    assert ("commit" in said) == (ROOT / ".git").exists()
    assert checked_out(tmp_path) is None
    (tmp_path / ".git").mkdir()
    assert checked_out(tmp_path) is None, "not a checkout that git can read"


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("run --problem ", {"bar", "block", "plate", "advection", "all"}),
        ("run --problem bar --route f", {"fd-one-sided", "fd-central", "faulty-adjoint"}),
        ("vcurve --problem b", {"bar", "block"}),
        ("run --problem ./my_m", {"./my_m"}),
        ("run --at ", {"start", "true"}),
    ],
)
def test_completion_offers_registered_names(words: str, offered: set[str], tmp_path: Path) -> None:
    spaced = {"_ROUTES_COMPLETE": "bash_complete", "COMP_WORDS": f"routes {words}"}
    done = shell("routes", tmp_path, **spaced, COMP_CWORD=str(len(words.split(" "))))
    assert {line.partition(",")[2] for line in done.stdout.splitlines()} >= offered
    assert (done.stderr, "numpy" in done.stdout) == ("", False)


@pytest.mark.parametrize("name", ["bash", "zsh", "fish"])
def test_completion_scripts_name_the_program(name: str, tmp_path: Path) -> None:
    if name == "bash" and shutil.which("bash") is None:
        pytest.skip("bash is not installed")
    assert "_ROUTES_COMPLETE" in shell("routes", tmp_path, _ROUTES_COMPLETE=f"{name}_source").stdout


@pytest.mark.parametrize(("code", "light"), [("import gradient_routes", "click"), (HELP, "numpy")])
def test_the_first_commands_import_little(code: str, light: str) -> None:
    """Seconds are of the machine; what costs them is what is imported."""
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys; print('\\n'.join(sys.modules))"],
        env=with_routes(), capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert not {light, "numpy", "rich", "ctypes", "sqlite3", "hashlib", "email.parser"} & set(done.stdout.splitlines())


def test_piped_output_has_no_control_codes_and_a_closed_pipe_is_no_error(forks: Forks, tmp_path: Path) -> None:
    run = "run --no-isolate --min-time 0 --problem 'bar[n=1|2|3]' --route adjoint --route tangent"
    done = forks.run(tmp_path, *shlex.split(run))
    assert "bar[n=3]" in done.out
    assert "\x1b" not in done.out + done.err
    cut = shell(f"routes {run} --json | head -1", tmp_path)
    assert "Traceback" not in cut.stderr


@pytest.mark.parametrize(
    ("study", "table"), [("invert", "inversion"), ("tolerance --route adjoint --tightest 1e-3 --json", "tolerance")]
)
def test_a_study_whose_reader_leaves_is_kept(study: str, table: str, forks: Forks, tmp_path: Path) -> None:
    """It has gone before anything is printed."""
    cut = forks.run(tmp_path, *study.split(), "--problem", "bar", "--no-isolate", stdout=None)
    assert (cut.out, cut.err) == ("", "")
    assert len(Store(tmp_path / "results" / "routes.sqlite").records(table)) > 2


def test_a_terminal_gets_a_progress_bar_for_more_than_one_case(tmp_path: Path) -> None:
    def screen(problem: str) -> str:
        leader, follower = pty.openpty()
        command = [str(Path(sys.executable).with_name("routes")), "run", "--no-store", "--no-timing"]
        asked = ["--no-isolate", "--problem", problem, "--route", "adjoint"]
        child = subprocess.Popen([*command, *asked], stdout=follower, stderr=follower, cwd=tmp_path, close_fds=True)
        os.close(follower)
        shown = b""
        while child.poll() is None or select.select([leader], [], [], 0.1)[0]:
            try:
                shown += os.read(leader, 65536) if select.select([leader], [], [], 0.1)[0] else b""
            except OSError:  # the other end is closed
                break
        os.close(leader)
        assert child.wait() == 0
        return shown.decode()

    assert "cases" in screen("bar[n=1|2]")
    assert "cases" not in screen("bar")


def test_a_row_that_is_being_kept_is_kept_whatever_interrupts(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    append = Store.append_all

    def interrupted(*arguments: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        return append(*arguments)

    monkeypatch.setattr(Store, "append_all", interrupted)
    ran = cli("run", "--problem", "bar[n=2|3]", "--route", "adjoint", "--min-time", "0", "--json")
    assert ran.code == 130
    assert len(ran.rows) == len(Store(Path("results/routes.sqlite")).rows()) == 1
