"""The laboratory in the cells of a notebook."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import gradient_routes.lab
from gradient_routes.bench.lab.numbers import number
from gradient_routes.problems.errors import InputError

CELLS = (
    """import asyncio
import panel as pn
import gradient_routes.lab
shown = gradient_routes.lab.derivation(sensors="2", octaves="1,0,0,0,0,0,0,0")""",
    """while "<td>" not in (found := " ".join(pane.object for pane in shown.select(pn.pane.HTML))):
    await asyncio.sleep(0.1)
print(found)""",
)


def test_a_cell_computes_what_it_shows(tmp_path: Path) -> None:
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS])
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    text = notebook.cells[1].outputs[0]["text"]
    assert f"<td>{number(1 / 16)}</td>" in text  # u_1 = F L_e / (A E_1), with E_1 twice that of the start


def test_outside_of_a_notebook_it_says_where_to_go() -> None:
    with pytest.raises(InputError, match="see the pages of `routes lab`"):
        gradient_routes.lab.derivation()
