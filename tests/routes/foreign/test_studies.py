"""Studies ask an adapter as they ask our routes: tolerances reach it, sizes reach it, its J is ours."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

import pytest

from gradient_routes.routes.foreign.manifest import ADAPTERS, START

SCRIPT = Path(__file__).parent / "bar_adapter.py"


@pytest.fixture
def loose(tmp_path: Path) -> str:
    """A route whose gradient is off by rtol, which says nothing of it."""
    words = [sys.executable, "-c", START, str(ADAPTERS / "python"), str(SCRIPT), "loose"]
    program = tmp_path / "loose"
    program.write_text(f"#!/bin/sh\nexec {shlex.join(words)}\n")
    program.chmod(0o755)
    return f"adapter[command={program}]"


def test_the_tolerance_of_a_study_reaches_the_adapter(loose: str, cli) -> None:
    ran = cli("tolerance", "--problem=bar", f"--route={loose}", "--tightest=1e-4", "--no-store", "--json", "--no-plot")
    errors = {row["rtol"]: row["gradient_error"] for row in ran.rows}
    assert errors == pytest.approx({10.0**-k: 10.0**-k for k in range(1, 5)}, rel=1e-6)


def test_sizes_reach_the_adapter(loose: str, cli) -> None:
    sizes = [f"--problem=bar[n={n}]" for n in (3, 30, 9000)]  # the last in frames
    ran = cli("run", *sizes, f"--route={loose}", "--no-store", "--json", "--no-timing")
    assert [row["gradient_error"] for row in ran.rows] == pytest.approx([1e-12] * 3, rel=0.2)
    assert [row["n_param"] for row in ran.rows] == [3, 30, 9000]


def test_a_v_curve_of_the_adapter_agrees(loose: str, cli) -> None:
    ran = cli("vcurve", "--problem=bar", f"--route={loose}", "--no-store", "--json", "--no-plot")
    assert ran.code == 0


def test_its_gradient_inverts(loose: str, cli) -> None:
    ran = cli("invert", "--problem=bar", f"--route={loose}", "--no-store", "--json", "--no-plot")
    assert ran.code == 0
    seen = [row for row in ran.rows if row.get("estimate") is not None and not row["blind"]]
    assert len(seen) == 5
    for row in seen:
        assert row["estimate"] == pytest.approx(row["truth"], abs=1e-6)
