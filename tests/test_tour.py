"""examples/tour.ipynb: its cells run, its numbers hold, and what it shows is what they print now."""

from __future__ import annotations

import base64
import re

import nbformat
import pytest
from nbclient.exceptions import CellExecutionError

from benchmarks.tour import KERNEL, LANGUAGE, TOUR, executed, read

NUMBER = re.compile(r"(?<![\w.])\d[\d.]*(?:e[-+]?\d+)?")
FORMULA = re.compile(r"\$\$.*?\$\$|\$[^$]*\$|`[^`]*`|```.*?```|\]\([^)]*\)", re.DOTALL)
LARGEST = 300_000  # bytes
NOISE = re.compile(r"/(home|tmp|work|Users)/| at 0x|\d (ms|us|s)\b|[Ww]arning")


@pytest.fixture(scope="module")
def tour() -> nbformat.NotebookNode:
    return read()


def code(tour: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    return [cell for cell in tour.cells if cell.cell_type == "code"]


def shape(cell: nbformat.NotebookNode) -> list[str]:
    """What a cell shows, without pictures and digits, which rounding changes."""
    shown = [output.get("text") or output.data.get("text/html", output.data["text/plain"]) for output in cell.outputs]
    return [re.sub(r"-?\d[\d.]*(e[-+]?\d+)?", "#", re.sub(r"base64,[^']*", "", text)) for text in shown]


def test_the_tour_runs_and_shows_what_is_committed(tour: nbformat.NotebookNode) -> None:
    now = executed(tour)
    for before, after in zip(code(tour), code(now), strict=True):
        assert shape(after) == shape(before), f"{before.source}\n- python -m benchmarks.tour, then read it again"
        assert all(output.output_type != "stream" or output.name == "stdout" for output in after.outputs)


def test_a_cell_that_raises_fails(tour: nbformat.NotebookNode) -> None:
    broken = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("assert 1 == 2, 'not so'")])
    with pytest.raises(CellExecutionError, match="not so"):
        executed(broken)


def test_every_number_of_the_text_stands_in_code(tour: nbformat.NotebookNode) -> None:
    """Where it is asserted, or what the cells were given."""
    held = {float(number) for cell in code(tour) for number in re.findall(NUMBER, cell.source)}
    told = [
        number.rstrip(".")
        for cell in tour.cells
        if cell.cell_type == "markdown"
        for number in NUMBER.findall(FORMULA.sub("", cell.source))
    ]
    assert len(told) > 10
    assert not [number for number in told if float(number) not in held]


def test_what_is_committed_is_small_and_of_no_machine(tour: nbformat.NotebookNode) -> None:
    assert TOUR.stat().st_size < LARGEST
    assert tour.metadata == KERNEL | LANGUAGE
    assert [cell.execution_count for cell in code(tour)] == [*range(1, len(code(tour)) + 1)]
    assert not any(cell.metadata for cell in tour.cells)
    pictures = re.findall(r"base64,([^']+)'", str(tour))
    assert len(pictures) > 8
    text = re.sub(r"base64,[^']*", "", TOUR.read_text())
    for shown in (text, *(base64.b64decode(picture).decode() for picture in pictures)):
        assert not NOISE.search(shown), NOISE.search(shown)
