"""`routes compare` and `routes baseline`: is anything worse than it was?"""

from __future__ import annotations

import sys
from contextlib import nullcontext, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import debug_option, store_option
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.regression.compare import Comparison

BASELINE = Path("results") / "baseline.json"
PATH = click.Path(path_type=Path)
FACTOR = "By which the median ratio of times must grow, beside a test by ranks, to be worse."
SUBSET = "NEW need not hold all that BASE holds, nor run what another --budget skips."
EXPECTED = "File of expected failures. [expected.toml beside NEW, if there is one]"


@click.command()
@click.argument("base", type=PATH)
@click.argument("new", type=PATH)
@click.option("--format", type=click.Choice(["table", "md", "json"]), help="[that of FILE's name, else table]")
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File to write [stdout].")
@click.option("--factor", type=float, default=1.25, show_default=True, help=FACTOR)
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
    """Is NEW worse than BASE? Stores, or baselines that `routes baseline` wrote; the latest row of every case counts.

    \b
    status   worse where a case fails or is no longer run that did not, but for those that expected.toml names
    work     exact: more of any count is worse
    error    worse by an order of magnitude, from 1e-13 on
    verdict  exact
    memory   worse by 25 % and 5 MiB; bytes of tapes and factors by 10 %; no longer measured
    time     in forward solves of the same run: worse by ranks of all rounds and by --factor;
             not compared between different machines. Seconds are shown, never judged.

    A case of BASE that NEW lacks is worse, too, and no case that is ok in both is an error.

    Exit code: 0 nothing is worse, 1 a regression, 2 wrong usage.
    """
    from gradient_routes.bench.cases import expected as expectations
    from gradient_routes.bench.regression.baseline import measured
    from gradient_routes.bench.regression.compare import compare as compare_sides
    from gradient_routes.bench.store.output_files import check_writable

    if not 1 < factor < float("inf"):
        raise InputError(f"--factor {factor:g} - give a number > 1")
    known = expectations.beside(new) if expected is None else expectations.read(expected)
    sides = measured(base), measured(new)
    if output is not None:
        check_writable("-o", output, [base, new, expected or new.parent / expectations.FILE])
    found = compare_sides(*sides, known, factor, subset)
    _write(found, format or _format_of(output), output)
    raise click.exceptions.Exit(1 if found.worse else 0)


def _format_of(output: Path | None) -> str:
    suffix = "" if output is None else output.suffix.lstrip(".")
    return suffix if suffix in ("md", "json") else "table"


def _write(found: Comparison, format: str, output: Path | None) -> None:
    """To stdout, or to the file and the conclusion to stdout."""
    from gradient_routes.bench.regression.text import as_json, markdown
    from gradient_routes.bench.regression.view import conclusion, show_comparison
    from gradient_routes.bench.render.terminal.tables import console

    where = nullcontext(sys.stdout) if output is None else output.open("w", encoding="utf-8")
    with where as file, redirect_stdout(file):
        if format == "table":
            show_comparison(console(), found)
        else:
            click.echo(markdown(found) if format == "md" else as_json(found), nl=False)
    if output is not None:
        click.echo(f"{conclusion(found)}; all of it in {output}")


@click.command()
@click.option("-o", "--output", type=PATH, default=BASELINE, show_default=True, help="File to write.")
@store_option
@debug_option
def baseline(output: Path, store: Path) -> None:
    """Write the latest row of every case and verdict of a store as a small text file, for `routes compare`."""
    from gradient_routes.bench.regression.baseline import write
    from gradient_routes.bench.regression.measured import of_store
    from gradient_routes.bench.store.output_files import check_writable
    from gradient_routes.bench.store.store import Store

    found = of_store(Store(store))
    output.parent.mkdir(parents=True, exist_ok=True)
    check_writable("-o", output, [store])
    write(output, found)
    counts = {"case": len(found.cases), "verdict": len(found.verdicts)}
    said = " and ".join(f"{n} {what}{'s' if n > 1 else ''}" for what, n in counts.items() if n)
    click.echo(f"{said} of {store} in {output}")
