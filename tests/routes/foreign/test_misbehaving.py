"""Adapters that are killed, hang, babble or lie: each is a row of its own, typed, with its reason."""

from __future__ import annotations

import gc
import sys
from pathlib import Path

import psutil
import pytest
from click.testing import CliRunner
from commands import Ran, eventually

from gradient_routes.bench.cli import main

ADAPTER = Path(__file__).parent / "misbehaving.py"
ROWS = {
    "killed": ("crashed", "was ended by signal SIGKILL in gradient()"),
    "exits": ("crashed", "ended with exit code 3 in gradient()"),
    "dies-during-load": ("crashed", "ended with exit code 1 in load()"),
    "half-a-frame": ("failed", "4 bytes for an array of shape [8], which has 64"),
    "babbles": ("failed", "it wrote b'iteration 1: |R| = 3.2e-1\\n' - stdout is for messages alone"),
    "babbles-a-huge-line": ("failed", f"it wrote b'{'x' * 80}' ..."),
    "no-object": ("failed", "it wrote b'[1, 2]\\n', which is no JSON object"),
    "another-version": ("failed", "speaks version 2 of the protocol, this is version 1 - renew the adapter"),
    "another-id": ("failed", "gradient(): no result with id 3 - mend the adapter"),
    "no-base64": ("failed", "an array that is no base64"),
    "short": ("failed", "64 bytes for an array of shape [9], which has 72"),
    "nan": ("non-finite", "1 of 8 gradient components not finite, first log E_8 = nan"),
    "infinite-J": ("non-finite", "J = inf"),
    "endless-J": ("failed", "J = 1000"),
    "text-J": ("failed", "J = '0.5' - give a number"),
    "wrong-length": ("failed", "gradient of shape (9,) for 8 parameters"),
    "wrong-shape": ("failed", "gradient of shape (1, 8) for 8 parameters"),
    "integers": ("failed", "the gradient is an array of int64 - give an array of float64"),
    "float32": ("failed", "the gradient is {'float32': [8]"),
    "complex": ("failed", "the gradient is {'complex128': [8]"),
    "a-list": ("failed", "the gradient is [1.0, 1.0"),
    "negative-seconds": ("failed", "forward_s = -1.0 - give a number >= 0, or leave it out"),
    "nan-residual": ("failed", "residual = nan - give a number >= 0, or leave it out"),
    "not-converged": ("not-converged", "gradient(): as it is told"),
    "singular": ("failed", "gradient(): as it is told"),
    "domain": ("failed", "gradient(): as it is told"),
    "memory": ("out-of-memory", "gradient(): as it is told"),
    "unsupported": ("skipped", "gradient(): as it is told"),
    "bug": ("failed", "gradient(): as it is told"),
    "no-such-case": ("skipped", "load(): it knows no bar"),
    "another-J": ("other-functional", "its J is 1, ours 0.00878"),
    "nearly-J": ("other-functional", "its J is 0.00882"),
}


def route(kind: str) -> str:
    return f"adapter[command={sys.executable} -IS {ADAPTER} {kind}]"


def running() -> list[list[str]]:
    """What the adapters were told that still run."""
    found = [process.info["cmdline"] or [] for process in psutil.process_iter(["cmdline"])]
    return [words for words in found if str(ADAPTER) in words]


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> dict:
    """All in one run, in this process."""
    asked = [f"--route={route(kind)}" for kind in ROWS]
    command = ["run", "--problem=bar", *asked, "--route=adjoint", "--no-isolate", "--no-timing", "--no-store", "--json"]
    ran = CliRunner().invoke(main, command)
    assert ran.exit_code == 1
    found = Ran(ran.exit_code, ran.stdout, ran.stderr).rows
    assert len(found) == len(ROWS) + 1
    return {str(row["route_options"].get("command", "adjoint")).split()[-1]: row for row in found}


@pytest.mark.parametrize("kind", ROWS)
def test_it_is_a_typed_row_that_says_what_happened(kind: str, rows: dict) -> None:
    status, says = ROWS[kind]
    row = rows[kind]
    assert row["status"] == status
    assert says in row["reason"]
    assert row["reason"].startswith("adapter: ")
    assert "\n" not in row["reason"]
    assert len(row["reason"]) < 300
    assert row["gradient_error"] is None, "nothing that misbehaves is judged"


def test_the_others_of_the_run_are_as_alone(rows: dict) -> None:
    assert rows["adjoint"]["status"] == "ok"
    assert rows["adjoint"]["gradient_error"] < 1e-15


def test_none_of_their_processes_is_left(rows: dict) -> None:
    gc.collect()
    eventually(lambda: not [words for words in running() if words[-1] in ROWS])


def test_what_another_code_says_of_itself_is_kept(rows: dict) -> None:
    assert rows["another-J"]["peer"] == {"name": "another-J", "versions": {"it": "[1, 2]"}}
    assert rows["another-J"]["memory_method"] == "by another-J itself"


def test_its_compilation_is_that_of_the_first_call_its_times_are_those_of_the_second(cli) -> None:
    (row,) = cli(*"run --problem bar --no-store --json --no-timing --route".split(), route("warms-up")).rows
    asked_before = 2  # describe and load
    assert (row["peer"]["compile_s"], row["peer"]["forward_s"]) == (asked_before + 1, asked_before + 2)


def test_a_gradient_that_is_wrong_for_our_J_is_warned_of(cli) -> None:
    ran = cli(*"run --problem bar --no-store --json --no-timing --route".split(), route("wrong"))
    (row,) = ran.rows
    assert row["gradient_error"] > 1.0
    assert "adapter: its J is ours, yet the gradient is wrong: do not use it" in row["note"]


def test_one_that_hangs_is_ended_at_the_limit_with_its_process(cli) -> None:
    ran = cli(*"run --problem bar --no-store --json --isolate --timeout 3 --route".split(), route("hangs"))
    (row,) = ran.rows
    assert (ran.code, row["status"]) == (1, "timeout")
    eventually(lambda: not [words for words in running() if words[-1] == "hangs"])


@pytest.mark.parametrize(
    ("route", "says"),
    [
        (
            "adapter[command=/nowhere/such]",
            "/nowhere/such cannot be started: No such file or directory - check the command",
        ),
        ("adapter", "no command - give one: --route 'adapter[command=./mine]'"),
        ("adapter[command='it]", "No closing quotation"),
    ],
)
def test_a_command_that_is_none_says_so(route: str, says: str, cli) -> None:
    ran = cli("run", "--problem=bar", "--no-timing", "--no-store", "--json", f"--route={route}")
    assert says in (ran.err if ran.code == 2 else ran.rows[0]["reason"])
