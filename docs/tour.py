"""The notebook tour as a page of the site: text, code, and what each cell shows. Formulas become MathML: no network."""

from __future__ import annotations

import re
from collections.abc import Iterator

import nbformat

from gradient_routes.bench.lab.formula import with_formulas

TABLE, STYLED = re.compile(r"<table[^>]*>"), "<table class='docutils'>"  # as those of the site
LAST = "This page is a notebook: [examples/tour.ipynb](../../examples/tour.ipynb).\n"
CODE = re.compile(r"(```.*?```|`[^`]*`)", re.DOTALL)


def tour(path: str) -> str:
    """Markdown, of a notebook in a folder beside docs/, for a page in docs/reference/."""
    cells = nbformat.read(path, as_version=4).cells
    return "\n\n".join([*(part for cell in cells for part in _cell(cell)), LAST])


def _cell(cell: nbformat.NotebookNode) -> Iterator[str]:
    if cell.cell_type == "markdown":
        parts = CODE.split(cell.source.replace("](../docs/", "](../"))  # code at odd places
        yield "".join(part if k % 2 else with_formulas(part) for k, part in enumerate(parts))
        return
    yield f"```python\n{cell.source}\n```"
    for output in cell.outputs:
        if html := output.get("data", {}).get("text/html"):
            yield f"````{{raw}} html\n{TABLE.sub(STYLED, html)}\n````"
        else:
            yield f"```text\n{output.get('text') or output.data['text/plain']}\n```"
