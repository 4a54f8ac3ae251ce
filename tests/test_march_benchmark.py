"""benchmarks.march at a small size: its rows, the steps that it counts, and what it says of an absent framework."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from benchmarks import march


def test_a_small_run_counts_steps_and_compares_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without routes that compile. Steps marched again: 4 floor(19/5), and the formula of revolve."""
    ways = [way for way in march.ways(4) if way[0] is march.adjoint]
    for name, value in (("ways", lambda slots: ways), ("EXACT", march.EXACT[:3]), ("REPEATS", 1)):
        monkeypatch.setattr(march, name, value)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(march, "STOPS", ("none", "quadratic"))
    small = "--elements 4 --steps 20 --stops-at 6 --peers diffrax"
    monkeypatch.setattr(sys, "argv", ["march", *small.split()])
    march.main()
    said = capsys.readouterr().out
    again = {line.split()[0]: line.split()[-3] for line in said.splitlines() if line.endswith("same bits")}
    assert again["adjoint[checkpoint=sqrt]"] == str(4 * (19 // 5))
    assert again["adjoint[checkpoint=revolve=4]"] == str(3 * 20 - 21 - 20 + 1)
    assert "routes environments create diffrax" in " ".join(said.split())
