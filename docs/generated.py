"""The reference pages, generated from the declarations that the program itself reads.

`python docs/generated.py` writes them and results/README.md, the columns of the store, which is committed.
"""

from __future__ import annotations

import enum
import inspect
import re
import runpy
import textwrap
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, get_args

import click

import gradient_routes
from gradient_routes.bench.advice.glossary import GLOSSARY
from gradient_routes.bench.advice.literature import SOURCES
from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.options import options_of
from gradient_routes.bench.cli import main
from gradient_routes.bench.store import schema
from gradient_routes.bench.verification.result import EXIT, INCONCLUSIVE, MEANING, Verdict
from gradient_routes.problems.problem import OFFERED_AS, offer_names
from gradient_routes.routes.route import Route

HERE = Path(__file__).parent
REFERENCE = HERE / "reference"
TOUR = runpy.run_path(str(HERE / "tour.py"))["tour"]
RESULTS = HERE.parent / "results" / "README.md"


def pages() -> dict[str, str]:
    """File name -> Markdown, of every reference page."""
    return {
        "commands.md": commands(),
        "problems.md": registered("problem"),
        "routes.md": registered("route"),
        "verdicts.md": verdicts(),
        "tables.md": tables(),
        "python.md": python(),
        "glossary.md": glossary(),
        "tour.md": TOUR(str(HERE.parent / "examples" / "tour.ipynb")),
    }


def write(folder: Path = REFERENCE) -> None:
    """Write the pages that have changed, so that only those are built again."""
    folder.mkdir(exist_ok=True)
    for name, text in pages().items():
        path = folder / name
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


def commands() -> str:
    """Every command with its help, its arguments and its options."""
    head = "Every option of every command. `routes COMMAND --help` prints the same.\n"
    body = [_command(name, command) for name, command in sorted(main.commands.items())]
    return "\n".join(["# Commands\n", head, *body])


def _command(name: str, command: click.Command) -> str:
    context = click.Context(command, info_name=name, parent=click.Context(main, info_name="routes"))
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    options = [p for p in command.params if isinstance(p, click.Option)]
    rows = [(_flags(p, context), plain(p.help or ""), _default(p, context)) for p in options]
    return "\n".join(
        [
            f"## `routes {name}`\n",
            f"```text\n{usage}\n```\n",
            paragraphs(command.help or ""),
            table(("option", "meaning", "default"), rows),
        ]
    )


def _flags(option: click.Option, context: click.Context) -> str:
    record = option.get_help_record(context)
    return code(record[0] if record else ", ".join(option.opts))


def _default(option: click.Option, context: click.Context) -> str:
    default = option.get_default(context) if option.show_default else None
    if default is None or isinstance(default, bool):
        return ""
    return code(" ".join(map(str, default)) if isinstance(default, list | tuple) else str(default))


def registered(kind: registry.Kind) -> str:
    """Every built-in problem or route with its options, from the registry."""
    entries = [e for e in registry.registered(kind) if e.origin == registry.BUILT_IN]
    head = f"`routes list {kind}s` prints the same, with those of installed plug-ins. Options are written in brackets:"
    example = {"problem": "`'bar[n=64,noise=0.01]'`", "route": "`'adjoint[factors=fresh]'`"}[kind]
    offers = table(("name", "what it is"), [(code(offer_names(o)[0]), plain(text)) for o, text in OFFERED_AS.items()])
    what = "What a problem offers and a route needs" if kind == "problem" else "What a route needs of a problem"
    body = [_entry(kind, entry) for entry in entries]
    return "\n".join([f"# {kind.capitalize()}s\n", f"{head} {example}.\n", f"{what}:\n", offers, *body])


def _entry(kind: registry.Kind, entry: registry.Entry) -> str:
    target = entry.load()
    if isinstance(target, Route):
        contract = f"Needs: {', '.join(offer_names(target.needs))}."
    else:
        contract = f"Offers: {', '.join(offer_names(target.offers))}."
    function = registry.factory_of(target)
    rows = [(code(o.text), plain(o.help)) for o in options_of(function).values()]
    options = table(("option", "meaning"), rows) if rows else "No options.\n"
    doc = inspect.getdoc(function) or ""
    text = f"```text\n{doc}\n```\n" if isinstance(target, Route) else paragraphs(doc)  # a route's is its equation
    return "\n".join([f"## {entry.name}\n", text, f"{contract}\n", options])


def verdicts() -> str:
    """Every verdict with its meaning and the exit code of `routes check` and `routes vcurve`."""
    rows = [(code(v), plain(MEANING[v]), str(EXIT.get(v, INCONCLUSIVE))) for v in get_args(Verdict)]
    head = "What `routes check` and `routes vcurve` conclude, and the exit code they end with.\n"
    last = "Exit code 2 is wrong usage. [Read a verdict](../how-to/read-a-verdict.md) says what to do about each.\n"
    return "\n".join(["# Verdicts\n", head, table(("verdict", "meaning", "exit code"), rows), last])


def tables(title: str = "Tables and columns") -> str:
    """Every table of the store with its columns."""
    head = (
        "`routes run` and the studies append their results to `results/routes.sqlite` below the current folder."
        " `routes export --table TABLE` writes a table as CSV, Parquet or JSON. An absent value is NULL, never NaN."
        " Columns that hold objects (options, a gradient, versions) are JSON text.\n"
    )
    body = [
        f"## {name}\n\n" + table(("column", "unit", "meaning"), [(code(c.name), c.unit, plain(c.meaning)) for c in cs])
        for name, cs in schema.tables().items()
    ]
    return "\n".join([f"# {title}\n", head, *body])


def glossary() -> str:
    """Every term, with its page and its sources, and the literature that is cited."""
    terms = []
    for term in GLOSSARY:
        links = [f"[more](../{term.page})", *(f"[{key}]({SOURCES[key].link})" for key in term.sources)]
        terms.append(f"**{plain(term.name)}**: {plain(term.meaning)} ({', '.join(links)})\n")
    sources = [f"- **{key}**: {plain(source.text)} <{source.link}>" for key, source in sorted(SOURCES.items())]
    head = "The words of these pages, and the literature behind what `routes advise` says.\n"
    return "\n".join(["# Glossary\n", head, *terms, "## Literature\n", *sources, ""])


def python() -> str:
    """Every public name with its signature and its docstring."""
    head = "`import gradient_routes` gives these names. They are the public interface; everything else may change.\n"
    return "\n".join(["# Python\n", head, *(_public(name) for name in sorted(gradient_routes.__all__))])


def _public(name: str) -> str:
    target = getattr(gradient_routes, name)
    if not (inspect.isclass(target) or inspect.isfunction(target)):  # the name of a type
        return f"## `{name}`\n\n```text\n{target}\n```\n"
    parts = [f"## `{name}`\n", paragraphs(inspect.getdoc(target) or "")]
    if isinstance(target, enum.EnumMeta):
        return "\n".join([*parts, table(("member",), [(code(member),) for member in target.__members__])])
    methods = [
        (code(_call(key, value)), plain((inspect.getdoc(value) or "").split("\n\n")[0]))
        for key, value in vars(target).items()
        if inspect.isclass(target) and inspect.isfunction(value) and value.__doc__ and not key.startswith("_")
    ]
    if methods:
        parts.append(table(("method", "meaning"), methods))
    if not (inspect.isclass(target) and issubclass(target, Exception)):
        parts.insert(1, f"```text\n{_call(name, target)}\n```\n")
    return "\n".join(parts)


def _call(name: str, target: Callable[..., Any]) -> str:
    """`name(parameters)` with defaults and without annotations, which the text explains; lines of 80 columns."""
    if inspect.isclass(target) and issubclass(target, Exception):
        return f"{name}(message)"
    given = inspect.signature(target)
    shown = [q.replace(annotation=q.empty) for q in given.parameters.values() if q.name != "self"]
    signature = str(given.replace(parameters=shown, return_annotation=given.empty))
    signature = re.sub(r"<function (\w+) at 0x\w+>", r"\1", signature)
    signature = re.sub(r"<module '(\w+)' from [^>]+>", r"\1", signature)  # not where it is installed
    return textwrap.fill(f"{name}{signature}", 80, subsequent_indent=" " * 4, break_long_words=False)


def paragraphs(text: str) -> str:
    """A help text or docstring: what click or the author has laid out by hand stays as it is."""
    done = []
    for part in re.split(r"\n\s*\n", inspect.cleandoc(text)):
        if part.startswith("\b\n"):
            done.append(f"```text\n{part[2:]}\n```\n")
        elif part.startswith(">>>") or re.search(r"^  |\S  +\S", part, re.MULTILINE):
            done.append(f"```text\n{textwrap.dedent(part)}\n```\n")
        else:
            done.append(plain(part) + "\n")
    return "\n".join(done)


# escapes, emphasis, HTML, links; lists, quotes and headings where a text begins
SPECIAL = re.compile(r"[\\*<]|(?<!\w)_|_(?!\w)|\](?=\()|^[#>+-]")


def plain(text: str) -> str:
    """Words that Markdown must not read: only what stands between backticks is code."""
    pieces = re.split(r"(`[^`]*`)", " ".join(text.split()))
    return "".join(p if p.startswith("`") else re.sub(SPECIAL, r"\\\g<0>", p) for p in pieces)


def code(text: str) -> str:
    return f"`{text}`"


def table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *(tuple(cell.replace("|", r"\|") for cell in row) for row in rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"


if __name__ == "__main__":
    write()
    RESULTS.write_text(tables("Results"))
