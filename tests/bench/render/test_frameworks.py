"""The comparison of frameworks that is committed: what it asks for, and the page it makes of rows."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from benchmarks import frameworks
from gradient_routes.bench.cases import case
from gradient_routes.bench.store.store import Store
from gradient_routes.routes.foreign.manifest import shipped

ASKED = (
    *frameworks.ON_BAR,
    *frameworks.ON_BLOCK,
    *frameworks.RANKS,
    *frameworks.FAST,
    *frameworks.SLOW,
    *frameworks.OURS,
    *(route for routes in frameworks.MARCHED.values() for route in routes),
)
BROKEN = Path(__file__).parents[2] / "routes" / "foreign" / "misbehaving.py"


def test_it_asks_for_every_adapter_with_options_that_it_has() -> None:
    assert {spec.name for spec in case.routes(ASKED)} == {*shipped(), *frameworks.OURS}


def test_what_was_measured_before_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    committed = Path("results/frameworks.csv").read_text()
    (tmp_path / "it.csv").write_text(committed)
    for name, path in (("STORE", "no.sqlite"), ("PAGE", "it.md"), ("TABLE", "it.csv")):
        monkeypatch.setattr(frameworks, name, tmp_path / path)
    frameworks.write()
    assert (tmp_path / "it.csv").read_text() == committed
    assert (tmp_path / "it.md").read_text().count("\n|") == Path("results/frameworks.md").read_text().count("\n|")


def test_a_row_is_numbers_or_the_reason_why_not(tmp_path: Path, cli, monkeypatch: pytest.MonkeyPatch) -> None:
    store, broken = tmp_path / "some.sqlite", f"adapter[command={sys.executable} -IS {BROKEN} exits]"
    routes = ["--route=adjoint", f"--route={broken}"]
    cli("run", "--problem=bar[n=4]", *routes, "--no-timing", "--gradient", "--json", f"--store={store}")
    for name, path in (("STORE", store), ("PAGE", tmp_path / "it.md"), ("TABLE", tmp_path / "it.csv")):
        monkeypatch.setattr(frameworks, name, path)
    frameworks.write()
    lines = (tmp_path / "it.md").read_text().splitlines()
    (ours,) = (line for line in lines if line.startswith("| adjoint |") and "not measured" not in line)
    assert ours.endswith("| 0.0e+00 |"), "off itself"
    assert float(ours.split(" | ")[-2]) < 1e-14
    assert "| dolfinx[ranks=2] | not measured: run make adapters-all | " in "\n".join(lines)
    (theirs,) = (line for line in lines if line.startswith("| adapter |"))
    assert "crashed: adapter: ended with exit code 3 in gradient()" in theirs
    assert len((tmp_path / "it.csv").read_text().splitlines()) > len(Store(store).rows()) + 1
