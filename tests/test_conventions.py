"""The tables of docs/explanation/conventions.md hold what the frameworks return, run in their environments."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections import defaultdict

import jax
import pytest
import scipy
from commands import ROOT

from gradient_routes.routes.foreign.manifest import manifest, shipped

PAGE = ROOT / "docs" / "explanation" / "conventions.md"
SCRIPTS = ROOT / "examples" / "conventions"
ADAPTER = {name: name.lower() for name in ("Warp", "Taichi", "DOLFINx", "Lineax")} | {"PyTorch": "torch"}
OURS = {"JAX": jax.__version__, "SciPy": scipy.__version__}
RELEASE = re.compile(r"\w+ \d[\d.]*")


def tabulated() -> dict[str, dict[str, str]]:
    """Framework and version -> row -> cell. A table has a column for each framework, or names it in its second."""
    found: dict[str, dict[str, str]] = defaultdict(dict)
    for table in re.findall(r"(?:^\|.*\|\n)+", PAGE.read_text(), re.MULTILINE):
        head, _, *rows = [re.split(r" *(?<!\\)\| *", line)[1:-1] for line in table.splitlines()]
        for row in rows if RELEASE.search(table) else []:
            name, *cells = (cell.replace(r"\|", "|") for cell in row)
            if head[1] == "with":
                found[cells[0]][name] = ", ".join(filter(None, cells[1:]))
            else:
                found |= {of: found[of] | {name: cell} for of, cell in zip(head[1:], cells, strict=True) if cell}
    return {of: rows for of, rows in found.items() if RELEASE.fullmatch(of)}


def written(value: float | str | list[float | str]) -> str:
    """A result as it stands in a cell."""
    if isinstance(value, list):
        return ", ".join(map(written, value))
    return value if isinstance(value, str) else f"{value + 0.0:.3g}".replace("nan", "NaN")  # + 0: -0 is 0


TABULATED = tabulated()


@pytest.mark.parametrize("of", TABULATED)
def test_a_framework_returns_what_its_column_says(of: str) -> None:
    name, version = of.split()
    python = sys.executable
    if name in ADAPTER:
        found = manifest(shipped()[ADAPTER[name]])
        if not found.ready:
            pytest.skip(f"{found.name} has no environment here: routes environments create {found.name}")
        python = str(found.python)
    elif OURS[name] != version:
        pytest.skip(f"the table is of {of}, here is {OURS[name]}")
    script = SCRIPTS / f"with_{name.lower()}.py"
    ran = subprocess.run([python, "-I", str(script)], capture_output=True, text=True, timeout=600)
    assert ran.returncode == 0, ran.stderr
    ((says, rows),) = json.loads(ran.stdout).items()
    assert says == of
    assert {row: written(value) for row, value in rows.items()} == TABULATED[of]


def test_every_script_has_its_results_in_the_page() -> None:
    assert {f"with_{of.split()[0].lower()}.py" for of in TABULATED} == {path.name for path in SCRIPTS.glob("*.py")}
