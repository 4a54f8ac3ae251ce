"""`routes compare` and `routes baseline`: find regressions."""

from __future__ import annotations

import io
from contextlib import nullcontext, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import debug_option, replaces, store_option
from gradient_routes.bench.ranges import Real
from gradient_routes.bench.sanitize import echo

if TYPE_CHECKING:
    from gradient_routes.bench.regression.compare import Comparison
    from gradient_routes.bench.store.output_files import Output

BASELINE = Path("results") / "baseline.json"
PATH = click.Path(path_type=Path)
FACTOR = "Times are worse if their median grows by this factor and a rank test confirms it."
OUTPUT = f"File to write [stdout]. {replaces('.md', '.json', '.txt')}"
WRITTEN = f"File to write. {replaces('.json')}"
SUBSET = "Allow NEW to lack cases of BASE and to skip cases under another --budget."
EXPECTED = "File of known failures. [expected.toml beside NEW, if it exists]"


@click.command()
@click.argument("base", type=PATH)
@click.argument("new", type=PATH)
@click.option("--format", type=click.Choice(["table", "md", "json"]), help="[by the suffix of FILE, else table]")
@click.option("-o", "--output", type=PATH, metavar="FILE", help=OUTPUT)
@click.option("--factor", type=Real(min=1.0, min_open=True), default=1.25, show_default=True, help=FACTOR)
@click.option("--subset", is_flag=True, help=SUBSET)
@click.option("--expected", type=PATH, metavar="FILE", help=EXPECTED)
@debug_option
def compare(
    base: Path,
    new: Path,
    format: str | None,
    output: Path | None,
    factor: float,
    subset: bool,
    expected: Path | None,
) -> None:
    """Find what is worse in NEW than in BASE.

    BASE and NEW are stores or files of `routes baseline`; the latest row of every case is compared. Worse is:

    \b
    status   a case that was answered and now fails, or that was ok and is no
             longer run, unless expected.toml names it
    work     any count that is larger
    error    an order of magnitude more, above 1e-13
    verdict  any other verdict
    memory   25 % and 5 MiB more; for tapes and factors 10 %
    time     relative to a forward solve of the same run: by --factor and a
             rank test of all rounds; not compared between different machines
    missing  a case or a number of BASE that NEW does not have

    Seconds are shown but not compared. There must be a case that is ok in both.

    Exit code: 0 if nothing is worse, 1 for a regression, 2 for wrong usage.
    """
    from gradient_routes.bench.cases import expected as expectations
    from gradient_routes.bench.regression.baseline import measured
    from gradient_routes.bench.regression.compare import compare as compare_sides
    from gradient_routes.bench.store.cases import uncollected
    from gradient_routes.bench.store.output_files import Output

    known = expectations.beside(new) if expected is None else expectations.read(expected)
    with uncollected():
        sides = measured(base), measured(new)
    file = None if output is None else Output("compare -o", output, (".md", ".json", ".txt"))
    if file is not None:
        file.check([base, new, expected or new.parent / expectations.FILE])
    with uncollected():
        found = compare_sides(*sides, known, factor, subset)
    _write(found, format or _format_of(output), file)
    raise click.exceptions.Exit(1 if found.worse else 0)


def _format_of(output: Path | None) -> str:
    suffix = "" if output is None else output.suffix.lstrip(".")
    return suffix if suffix in ("md", "json") else "table"


def _write(found: Comparison, format: str, output: Output | None) -> None:
    """Print the comparison, or write it to the file and print its conclusion."""
    from gradient_routes.bench.regression.text import as_json, markdown
    from gradient_routes.bench.regression.view import conclusion, show_comparison
    from gradient_routes.bench.render.terminal.tables import console

    text = io.StringIO()
    with nullcontext() if output is None else redirect_stdout(text):
        if format == "table":
            show_comparison(console(), found)
        else:
            echo(markdown(found) if format == "md" else as_json(found), nl=False)
    if output is not None:
        with output.open() as file:
            file.write(text.getvalue().encode("utf-8", "backslashreplace"))
        echo(f"{conclusion(found)}; all of it in {output.path}")


@click.command()
@click.option("-o", "--output", type=PATH, default=BASELINE, show_default=True, help=WRITTEN)
@store_option
@debug_option
def baseline(output: Path, store: Path) -> None:
    """Write a small text file for `routes compare`.

    It holds the latest row of every case and every verdict of a store.
    """
    from gradient_routes.bench.regression.baseline import MARK, as_text
    from gradient_routes.bench.regression.measured import of_store
    from gradient_routes.bench.store.output_files import Output
    from gradient_routes.bench.store.store import Store

    found = of_store(Store(store))
    output.parent.mkdir(parents=True, exist_ok=True)
    target = Output("baseline -o", output, (".json",), MARK)
    target.check([store])
    with target.text() as file:
        file.write(as_text(found))
    counts = {"case": len(found.cases), "verdict": len(found.verdicts)}
    said = " and ".join(f"{n} {what}{'s' if n > 1 else ''}" for what, n in counts.items() if n)
    echo(f"{said} of {store} in {output}")
