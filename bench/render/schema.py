"""The store's tables, documented: `python -m bench.render.schema > results/README.md`."""

from __future__ import annotations

from collections.abc import Iterable

from gradient_routes.bench.cases.column import Column
from gradient_routes.bench.store.schema import tables

HEAD = """# Results

`routes run` keeps every case in `routes.sqlite` here, append-only; `routes report` prints it and
`routes export --table TABLE --format csv|parquet|json` hands it to other programs. An absent value is NULL, never NaN.
Columns that hold objects (options, gradient, threads, versions) are JSON text.
"""


def markdown() -> str:
    """All tables and columns with their units and meanings."""
    return HEAD + "".join(f"\n## {name}\n\n{_table(columns)}" for name, columns in tables().items())


def _table(columns: Iterable[Column]) -> str:
    lines = ["| column | unit | meaning |", "|---|---|---|"]
    lines += [f"| `{c.name}` | {c.unit} | {c.meaning.replace('|', chr(92) + '|')} |" for c in columns]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(markdown(), end="")
