"""Text of users is text wherever it is shown: no control bytes in a terminal, no markup in a page or a picture."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import suppress
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from commands import ROOT, Ran, with_routes

from gradient_routes.bench import sanitize
from gradient_routes.bench.cases.column import Column
from gradient_routes.bench.cli import main
from gradient_routes.bench.render.figure import Axis, Figure, Guide, Table
from gradient_routes.bench.render.html import report
from gradient_routes.bench.render.sections import sections
from gradient_routes.bench.render.source import read
from gradient_routes.bench.render.vega import spec, svg
from gradient_routes.bench.store.store import Store

# a title for the window, colours by ESC and by one character, one back, delete; none of it does any harm
CONTROLS = "\x1b]0;mark\x07\x1b[31m\x9b32m\x08\x7f"
MARK = f"<b id=mark>&amp; </script>{CONTROLS}{{{{mark}}}} ' + mark + \""
USER = f"""
import os
import sys
import numpy as np
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Offers, Parameters, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.route import Offers, route

MARK = {MARK!r}

class Mine(Problem):
    offers = Offers.VALUE
    name = "mine " + MARK
    notes = ("note " + MARK,)
    n_state = 1

    def __init__(self, *, does: str = "well", data: str = ""):
        if does == "refuse":
            raise InputError("refusal " + MARK)
        self.does = does
        label = lambda i: f"label {{i}} " + MARK
        self.parameters = Parameters(np.ones(2), np.ones(2), unit="unit " + MARK, label=label)

    def value(self, p):
        if self.does == "crash":
            print("said " + MARK, file=sys.stderr, flush=True)
            os._exit(3)
        if self.does == "raise":
            raise ValueError("reason " + MARK)
        return float(p @ p)

@route("route " + MARK, needs=Offers.VALUE, cost=lambda n_p, forward: n_p * forward.cold)
def own(model, p):
    return (model.value(p), 2.0 * p)
"""

FILE = f"m{CONTROLS[-2:]}<b id=mark>&.py"


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a store of cases that are ok, fail and are refused, and of a check, with the mark wherever it may
    stand.
    """
    folder = tmp_path_factory.mktemp("filled")
    (folder / FILE).write_text(USER)
    routes = ("--route", f"{FILE}:own", "--no-isolate")
    run = ("run", "--no-timing", "--route", "fd-central", *routes, "--problem")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for does in ("well", "raise"):
            CliRunner().invoke(main, [*run, f"{FILE}:Mine[does={does},data={CONTROLS[-2:]}<b id=mark>]"])
        CliRunner().invoke(main, ["check", "--problem", f"{FILE}:Mine", *routes])
    assert (folder / "results" / "routes.sqlite").exists()
    return folder


@pytest.fixture
def store(filled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(filled, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "results" / "routes.sqlite"


def controls(text: str) -> set[str]:
    return {c for c in text if (ord(c) < 32 and c not in "\n\t") or 127 <= ord(c) < 160}


def clean(ran: Ran) -> str:
    """What a command has printed, in which no control characters are."""
    said = ran.out + ran.err
    assert not controls(said), said
    return said


RUN = ("run", "--no-timing", "--no-store", "--route", "fd-central", "--problem")
SHOWN = {
    "table and gradient": (*RUN, f"{FILE}:Mine", "--gradient"),
    "rows": (*RUN, f"{FILE}:Mine", "--json"),
    "a reason": (*RUN, f"{FILE}:Mine[does=raise]"),
    "a traceback": (*RUN, f"{FILE}:Mine[does=raise]", "--debug"),
    "a refusal": (*RUN, f"{FILE}:Mine[does=refuse]"),
    "a refusal's traceback": (*RUN, f"{FILE}:Mine[does=refuse]", "--debug"),
    "no such file": (*RUN, f"{CONTROLS}.py:Mine"),
    "no such problem": (*RUN, CONTROLS),
    "no such option": ("run", f"--{CONTROLS}"),
    "no such command": (CONTROLS,),
    "no such choice": ("list", "--format", CONTROLS),
    "a header": (*RUN, "bar", "--at", "header.csv"),
    "a cell": (*RUN, "bar", "--at", "cell.csv"),
    "a header of data": (*RUN, "bar[data=header.csv]"),
    "a cell of data": (*RUN, "bar[data=cell.csv]"),
    "a store": ("report", "--store", f"{CONTROLS}.sqlite"),
    "a page": ("report", "-o", f"{CONTROLS}.html"),
    "a baseline": ("baseline", "-o", f"{CONTROLS}.json"),
    "a comparison": ("compare", "results/routes.sqlite", f"{CONTROLS}.json"),
    "a check": ("check", "--problem", f"{FILE}:Mine", "--route", f"{FILE}:own"),
    "a check that fails": ("check", "--problem", f"{FILE}:Mine[does=raise]", "--route", f"{FILE}:own"),
    "a curve": ("vcurve", "--problem", f"{FILE}:Mine", "--route", f"{FILE}:own"),
    "a file of expectations": (*RUN, "bar", "--expected", f"{CONTROLS}.toml"),
}


@pytest.mark.parametrize("shown", SHOWN)
def test_no_control_characters_of_others_are_printed(shown: str, cli, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(USER)
    (tmp_path / "header.csv").write_text(f"{CONTROLS},p{CONTROLS}\n1,2\n")
    (tmp_path / "cell.csv").write_text(f"node,displacement\n1,{CONTROLS}\n")
    assert clean(cli(*SHOWN[shown]))


@pytest.mark.parametrize("verb", ["report", "status", "compare", "baseline"])
def test_what_a_store_holds_is_printed_without(verb: str, store: Path, cli) -> None:
    arguments = [str(store), str(store)] if verb == "compare" else ["--store", str(store)]
    for form in ([], ["--format", "md"] if verb in ("report", "compare") else ["--json"] if verb == "status" else []):
        assert "mark" in clean(cli(verb, *arguments, *form)) or verb == "baseline"


def test_the_last_words_of_a_process_are_printed_without(cli, tmp_path: Path) -> None:
    (tmp_path / "m.py").write_text(USER)
    done = cli("run", "--problem", "m.py:Mine[does=crash]", "--route", "fd-central", "--no-timing", "--isolate")
    assert "| said <b id=mark>" in clean(done)
    assert done.code == 1


def test_what_a_process_says_is_passed_on_without(capsys: pytest.CaptureFixture[str]) -> None:
    """It may go back to the start of its own line, as bars of progress do."""
    sanitize.pass_on(f"{CONTROLS}10 %\r20 %\n".encode())
    assert capsys.readouterr().err == "]0;mark[31m32m10 %\r20 %\n"


def seen(folder: Path, *arguments: str) -> str:
    """What a terminal gets from a command, without the line ends and styles that are its own."""
    ours, theirs = os.openpty()
    with subprocess.Popen(
        ["routes", *arguments], cwd=folder, env=with_routes(), stdout=theirs, stderr=theirs
    ) as process:
        os.close(theirs)
        said = b""
        with suppress(OSError):  # EIO: nobody has the other end any more
            while piece := os.read(ours, 65536):
                said += piece
        os.close(ours)
    assert process.returncode == 0
    return re.sub(r"\x1b\[[0-9;]*m", "", said.decode().replace("\r\n", "\n"))


@pytest.mark.parametrize("verb", ["report", "status", "export"])
def test_a_terminal_gets_none(verb: str, store: Path) -> None:
    said = seen(store.parent.parent, verb)
    assert "mark" in said
    assert not controls(said)


class Page(HTMLParser):
    """Its elements with an id, how many scripts there are, and the data."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.scripts = 0
        self.data, self._in_data = "", False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.ids += [str(value) for name, value in attrs if name == "id"]
        self.scripts += tag == "script"
        self._in_data = tag == "script" and ("id", "data") in attrs

    def handle_data(self, text: str) -> None:
        if self._in_data:
            self.data, self._in_data = text, False


def test_a_page_shows_marks_and_has_none(store: Path) -> None:
    source = read(Store(store))
    text = report(source, sections(source))
    page = Page(text)
    assert "mark" not in page.ids
    assert page.scripts == text.count("</script>") >= 2
    assert not controls(text.split("<script", 1)[0]), "what is read; libraries may hold what they want"
    assert "<b id=mark>" in str(json.loads(page.data)), "what the script shows is the text itself"
    for shown in ("reason &lt;b id=mark&gt;&amp;amp; &lt;/script&gt;", "m&lt;b id=mark&gt;&amp;.py:own"):
        assert shown in text, shown


def coincident(name: str) -> Figure:
    """Two lines that lie on each other, and whatever a figure has of texts."""
    columns = [Column("x", "REAL", "1", ""), Column("problem", "TEXT", "", name), Column("y", "REAL", "1", "")]
    rows = [{"x": float(x), "problem": name, "y": float(x)} for x in (1, 2, 3, 1, 2, 3)]
    return Figure(
        "figure",
        name,
        name,
        Table.of(columns, rows),
        "line",
        x=(Axis("x", name, name),),
        y=(Axis("", name),),
        series=(name,) * 3 + (f"other {name}",) * 3,
        panels=(f"panel {name}",) * 6,
        fold={"y": f"folded {name}"},
        guides=(Guide("x", 1.5, name),),
        note="problem",
    )


def expressions(of: Any) -> Iterator[str]:
    """What of a specification Vega evaluates."""
    if isinstance(of, dict):
        for key, value in of.items():
            if key in ("calculate", "filter", "test", "expr", "signal", "labelExpr", "update") and isinstance(
                value, str
            ):
                yield value
            yield from expressions(value)
    elif isinstance(of, list):
        for value in of:
            yield from expressions(value)


def test_no_text_of_a_figure_is_evaluated() -> None:
    """Names stand in expressions as JSON literals only; nothing is a signal."""
    drawn = spec(coincident(MARK))
    found = list(expressions(drawn))
    literal = re.compile(r'"(?:[^"\\]|\\.)*"')
    assert any("mark" in expression for expression in found), "the names of folded columns do stand in one"
    assert not [e for e in found if "mark" in literal.sub("", e)]
    assert '"signal"' not in json.dumps(drawn)
    assert '"expr"' not in json.dumps(drawn)


def test_a_picture_shows_marks_and_has_none(store: Path) -> None:
    pytest.importorskip("vl_convert", reason="vl-convert is not installed: pip install 'gradient-routes[pictures]'")
    source = read(Store(store))
    figure = next(f for section in sections(source) for f in section.figures if f.mark)
    for drawn in (figure, coincident(sanitize.plain(MARK))):
        root = ET.fromstring(svg(drawn))  # raises where a character is none of XML
        assert not [node for node in root.iter() if node.get("id") == "mark"]
        assert "mark" in "".join(root.itertext())


PRINTING = {"echo", "secho", "print", "print_exc", "print_exception", "print_stack"}


def test_there_is_one_place_that_prints() -> None:
    """Beside the console of tables, which removes control characters as well."""
    found, consoles = [], []
    for path in sorted((ROOT / "bench").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Call):
                continue
            called = ast.unparse(node.func)
            name = called.rpartition(".")[2]
            own = called in ("echo", "self._print", "out.print", "console().print")
            if (name in PRINTING and not own) or re.fullmatch(r"sys\.(__)?std(out|err)(__)?\.write\w*", called):
                found.append(f"{path.relative_to(ROOT)}: {called}")
            if name == "Console":
                consoles.append(path.name)
    assert {where.partition(":")[0] for where in found} == {"bench/sanitize.py"}, found
    assert not consoles, "Terminal is the console"


def test_plain_text_is_left_as_it_is() -> None:
    assert sanitize.plain("λ ü 中\n\tend") == "λ ü 中\n\tend"
    assert sanitize.plain(f"a{CONTROLS}b") == "a]0;mark[31m32mb"
