"""The report in a browser: every figure drawn, filters and tables true to the numbers, whatever the names hold."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import dataclass
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.browser import DARK, NAMES, browser, opened
from benchmarks.invented_store import MAKERS, ROUTES, fill, measured, whole_row
from gradient_routes.bench.cases.registry import study_tables
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.render import draw, html, markdown
from gradient_routes.bench.render.figure import Figure, Section
from gradient_routes.bench.render.picking import bare
from gradient_routes.bench.render.sections import sections
from gradient_routes.bench.render.source import ASKED, Source, newest, read
from gradient_routes.bench.render.style import CONTRAST, NIGHT, PAPER, contrast, of_route
from gradient_routes.bench.render.terminal.palette import ROUTES as COLOURS
from gradient_routes.bench.store.store import Store

in_browser = pytest.mark.skipif(browser() is None, reason=f"no browser here: none of {', '.join(NAMES)}")
HOSTILE = "</script><script>alert(1)</script> \"quoted\", 'so', `so` & <b>λ ü 中 𝄞</b> -- ]]> | $x$ "
WHEN = "2026-01-02T00:00:00.000+00:00"

# runs in the page, before its own script and after it; nothing of it is in the report
BEFORE = """<script>
window.wrong = [];
window.onerror = (what) => wrong.push(String(what));
window.alert = () => wrong.push("alert");
</script></head>"""
AFTER = """<script>
const click = (node) => node.dispatchEvent(new MouseEvent("click", { bubbles: true }));
const marks = () => Object.fromEntries(report.states.filter((s) => s.figure.series.length).map((s) => [
  s.figure.id, s.node.querySelectorAll(".panel .point, .panel .bar, .panel .cell").length]));
for (const state of report.states) state.all = true;
report.drawAll();
report.filtered();
const seen = { whole: marks() };
seen.csv = Object.fromEntries(report.states.map((s) => [s.figure.id, report.csv(s)]));
for (const toggle of document.querySelectorAll(".tools [aria-expanded]")) click(toggle);
seen.tables = Object.fromEntries(report.states.map((s) => [s.figure.id, s.node.querySelectorAll("tbody tr").length]));
click([...document.querySelectorAll(".chip")].find((chip) => chip.dataset.name === "adjoint"));
seen.route = marks();
seen.shorter = report.csv(report.states.find((s) => s.figure.id === "error-and-time"));
click(document.querySelector(".clear"));
click([...document.querySelectorAll(".problems input")].find((box) => box.dataset.family === "bar"));
seen.problem = marks();
click(document.querySelector(".clear"));
seen.again = marks();
const legend = report.states.find((s) => s.figure.id === "error-and-time").node.querySelector(".legend button");
seen.name = legend.textContent;
click(legend);
seen.legend = marks()["error-and-time"];
seen.chosen = [];
for (const select of document.querySelectorAll(".tools select")) for (const option of select.options) {
  select.value = option.value;
  select.dispatchEvent(new Event("change"));
  seen.chosen.push(select.closest("figure").querySelectorAll(".panel").length);
}
const svg = document.querySelector("#v-curves .panel svg");
svg.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
seen.tip = document.querySelector(".tip").textContent;
svg.dispatchEvent(new KeyboardEvent("keydown", { key: "+" }));
seen.zoomed = !document.querySelector("#v-curves .tools button").hidden;
seen.scripts = document.scripts.length;
seen.width = [document.documentElement.scrollWidth, window.innerWidth];
seen.paper = getComputedStyle(document.body).backgroundColor;
seen.wrong = wrong;
document.body.append(Object.assign(document.createElement("pre"), { id: "seen", textContent: JSON.stringify(seen) }));
</script></body>"""


@dataclass(frozen=True)
class Report:
    """A store with every table filled, its sections and its page."""

    source: Source
    sections: list[Section]
    page: str

    @property
    def figures(self) -> list[Figure]:
        return [figure for section in self.sections for figure in section.figures]


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    store = Store(tmp_path_factory.mktemp("report") / "routes.sqlite")
    fill(store, cases=90, studies=1)
    store.append(hostile(), None)
    for name in ("checks", "inversion", "placement", "estimates"):
        store.append_study({name: [whole_row(name, hostile_study())]}, WHEN)
    source = read(store)
    made = sections(source)
    return Report(source, made, html.page(source, made))


def hostile() -> dict[str, Any]:
    words = {"problem": HOSTILE, "route": HOSTILE, "problem_options": {HOSTILE: HOSTILE}, "route_options": {}}
    long = {"reason": HOSTILE * 200, "stderr": HOSTILE * 50, "traceback": HOSTILE * 50, "status": "crashed"}
    return empty_row() | words | long | {"at": HOSTILE, "settings": {}, "seconds": float("nan"), "started": WHEN}


def hostile_study() -> dict[str, Any]:
    words = dict.fromkeys(("problem", "route", "at", "experiment", "optimizer", "label", "says", "parameter"), HOSTILE)
    numbers = {"iteration": 0, "misfit": float("inf"), "objective": float("nan"), "estimate": float("nan"), "step": 1}
    verdict = {"verdict": HOSTILE, "next": HOSTILE, "sensor": HOSTILE, "criterion": HOSTILE, "value": 1.0}
    return words | numbers | verdict | {"problem_options": {}, "route_options": {}}


def seen(report: Report, folder: Path, *options: str, width: int = 1280) -> dict[str, Any]:
    page = folder / "report.html"
    page.write_text(report.page.replace("</head>", BEFORE, 1).replace("</body>", AFTER, 1), "utf-8")
    told = opened(page, *options, width=width)
    found = re.search(r'<pre id="seen">(.*?)</pre>', told.dom, re.DOTALL)
    assert found is not None, told.console
    return json.loads(unescape(found[1])) | {"console": told.console}


def points(figure: Figure, kept: Any = lambda problem, route: True) -> int:
    """Marks that a page draws first: known numbers, on log axes none below 0; cells once for each value."""
    table = figure.table
    x, y = figure.x[0], figure.y[0]
    count = 0
    for series in figure.series:
        for i in series.rows:
            at = [table.column(own or axis.column)[i] for own, axis in ((series.x, x), (series.y, y))]
            negative = any(a.scale == "log" and v is not None and v < 0 for a, v in zip((x, y), at, strict=True))
            who = [table.column(name)[i] if name in table.names else None for name in ("problem", "route")]
            drawn = None not in at and not negative and kept(*who)
            count += drawn * (len(draw.valued(figure, series.facet)) if figure.mark == "cells" else 1)
    return count


def expected(report: Report, kept: Any = lambda problem, route: True) -> dict[str, int]:
    return {figure.id: points(figure, kept) for figure in report.figures if figure.series}


def test_every_table_of_the_store_has_a_figure(report: Report) -> None:
    filled = {name for make in MAKERS for name in make("bar", 8, np.random.default_rng(0))}
    assert set(study_tables()) <= filled, "the invented store leaves a table empty: nothing would be tested"
    assert len(report.sections) == len({section.id for section in report.sections}) >= 9
    assert len(report.figures) == len({figure.id for figure in report.figures}) >= 22
    assert all(figure.says or figure.id == "machines" for figure in report.figures)


@in_browser
def test_a_browser_draws_every_number_and_filters_it(report: Report, tmp_path: Path) -> None:
    found = seen(report, tmp_path)
    assert (found["wrong"], found["console"]) == ([], [])
    assert found["scripts"] == 4, "the data, the renderer and the two of this test"
    assert found["whole"] == found["again"] == expected(report)
    assert found["route"] == expected(report, lambda problem, route: bare(route) != "adjoint")
    assert found["problem"] == expected(report, lambda problem, route: bare(problem) != "bar")
    assert found["route"] != found["whole"] != found["problem"]
    assert all(panels > 0 for panels in found["chosen"])
    assert found["zoomed"]
    assert found["paper"] == "rgb(255, 255, 255)"
    assert found["width"][0] <= found["width"][1]
    assert "step" in found["tip"]
    (first,) = [figure for figure in report.figures if figure.id == "error-and-time"]
    hidden = sum(len(series.rows) for series in first.series if series.name == found["name"])
    assert found["legend"] == expected(report)["error-and-time"] - hidden < found["whole"]["error-and-time"]
    for figure in report.figures:
        assert found["tables"][figure.id] == min(200, len(figure.table.rows))
        same_numbers(figure, found["csv"][figure.id])
    assert "adjoint" not in {row["route"] for row in csv.DictReader(io.StringIO(found["shorter"]))}


def same_numbers(figure: Figure, text: str) -> None:
    """CSV as RFC 4180 has it, every digit kept."""
    head, *rows = csv.reader(io.StringIO(text, newline=""))
    assert [name.partition(" [")[0] for name in head] == figure.table.names
    assert len(rows) == len(figure.table.rows)
    for row, values in zip(rows, figure.table.rows, strict=True):
        for cell, value in zip(row, values, strict=True):
            if isinstance(value, int | float):
                assert float(cell) == value
            else:
                assert cell == (value or "")


@in_browser
def test_a_phone_at_night_shows_all_of_it_in_its_width(report: Report, tmp_path: Path) -> None:
    found = seen(report, tmp_path, DARK, width=360)
    content, window = found["width"]
    assert content <= window <= 500
    assert found["paper"] == "rgb(20, 23, 26)"
    assert found["whole"] == expected(report)
    assert (found["wrong"], found["console"]) == ([], [])


class Words(HTMLParser):
    """Elements of a page that runs no script."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attributes if name in ("src", "href")]


def test_without_scripts_and_network_the_numbers_are_there(report: Report) -> None:
    page = Words()
    page.feed(report.page)
    assert page.tags.count("script") == 2
    assert all(link.startswith("#") for link in page.links)
    assert not re.search(r"@import|url\((?!#)|https?://(?!www\.w3\.org/2000/svg)", report.page.replace("\\u003c", "<"))
    rows = sum(len(figure.table.rows) + 1 for figure in report.figures)
    assert page.tags.count("tr") == rows
    assert page.tags.count("table") == page.tags.count("noscript") == len(report.figures)


def test_markdown_has_the_same_sections_and_no_markup_of_the_data(report: Report) -> None:
    text = markdown.text(report.source, report.sections, "figures", ["error-and-time"])
    assert [line[3:] for line in text.splitlines() if line.startswith("## ")] == [s.title for s in report.sections]
    assert "![What accuracy costs](<figures/error-and-time.png>)" in text
    outside = re.sub(r"^(`{3,})\n.*?^\1$", "", text, flags=re.MULTILINE | re.DOTALL)
    assert "<script>" not in re.sub(r"\\.", "", outside)
    for block in re.findall(r"(?:^\|.*\n)+", outside, re.MULTILINE):
        cells = {len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}
        assert len(cells) == 1, "a cell breaks the table it is in"


def test_figures_for_a_paper(cli, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="figures need gradient-routes[pictures]")
    store = Store(tmp_path / "routes.sqlite")
    fill(store, cases=8, studies=0)
    ran = cli("report", "--store", "routes.sqlite", "--figures", "figures", "--format", "md", "-o", "there.md")
    assert ran.code == 0, ran.err
    wanted = {
        f"{f.id}.{format}" for s in sections(read(store)) for f in s.figures if f.series for format in draw.FORMATS
    }
    assert {path.name for path in (tmp_path / "figures").iterdir()} == wanted
    for name in re.findall(r"!\[.*\]\(<(.*)>\)", (tmp_path / "there.md").read_text()):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_every_kind_of_figure_is_drawn_for_a_paper(report: Report) -> None:
    pytest.importorskip("matplotlib", reason="figures need gradient-routes[pictures]")
    drawn = {figure.mark: draw.picture(figure) for figure in report.figures if figure.series}
    assert set(drawn) == {"points", "line", "bars", "cells"} | ({"ranges"} if "break_even" in study_tables() else set())
    assert all(len(picture.axes) >= 1 for picture in drawn.values())


@pytest.mark.parametrize("name", [*COLOURS, "somebodys-route", HOSTILE])
def test_a_route_is_seen_on_paper_and_at_night_and_looks_the_same_in_every_report(name: str) -> None:
    style = of_route(name)
    assert style == of_route(name)
    assert contrast(style.light, PAPER) >= CONTRAST <= contrast(style.dark, NIGHT)


def test_routes_are_told_apart_without_colour_and_keep_theirs(report: Report) -> None:
    built_in = [of_route(name) for name in COLOURS]
    assert len({style.marker for style in built_in}) == len({style.colour for style in built_in}) == len(COLOURS)
    assert of_route("somebodys-route").colour not in COLOURS.values()
    for figure in report.figures:
        for series in figure.series:
            if bare(series.name) in COLOURS and series.name.partition(",")[0] == series.name:
                assert series.style.colour == COLOURS[bare(series.name)], figure.id


def test_the_newest_study_of_each_thing_asked_is_shown() -> None:
    rows = [{"study_id": k, "problem": p, "route": "adjoint", "at": "start"} for k, p in ((1, "a"), (2, "b"), (3, "a"))]
    assert [row["study_id"] for row in newest(rows, ASKED["checks"])] == [2, 3]


def test_the_newest_run_of_a_case_is_shown(tmp_path: Path) -> None:
    store = Store(tmp_path / "routes.sqlite")
    rng = np.random.default_rng(0)
    for key in ("a", "b", "a"):
        row = {"problem": "bar", "problem_options": {"n": 8}, "route": "adjoint", "at": "start", "case_key": key}
        store.append(empty_row() | row | measured("adjoint", 8, rng) | {"route_options": {}, "settings": {}}, None)
    source = read(store)
    assert (source.kept, [row["case_id"] for row in source.cases]) == (3, [3, 2])


def test_an_empty_store_says_what_to_run(cli, tmp_path: Path) -> None:
    Store(tmp_path / "empty.sqlite").append_all([])
    assert cli("report", "--store", "empty.sqlite", "-o", "report.html").code == 0
    page = (tmp_path / "report.html").read_text()
    assert "routes run --problem bar --route all" in page
    assert "<figure" not in page


MISUSE = {
    "the store": (["-o", "routes.sqlite"], "is the store itself"),
    "the store by a link": (["-o", "link.html"], "is the store itself"),
    "a directory": (["-o", "folder"], "is a directory"),
    "nowhere": (["-o", "nowhere/report.html"], "No such file"),
    "figures into a file": (["--figures", "routes.sqlite"], "exists"),
    "no store": (["-o", "report.html", "--store", "no.sqlite"], "no such file"),
}


@pytest.mark.parametrize(("arguments", "says"), MISUSE.values(), ids=MISUSE)
def test_what_cannot_be_written_is_refused_in_a_line(cli, tmp_path: Path, arguments: list[str], says: str) -> None:
    fill(Store(tmp_path / "routes.sqlite"), cases=8, studies=0)
    (tmp_path / "folder").mkdir()
    (tmp_path / "link.html").symlink_to(tmp_path / "routes.sqlite")
    before = (tmp_path / "routes.sqlite").read_bytes()
    ran = cli("report", "--store", "routes.sqlite", *arguments)
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert says in ran.err
    assert (tmp_path / "routes.sqlite").read_bytes() == before
    assert not (tmp_path / "report.html").exists()


def test_figures_without_matplotlib_say_what_to_install(cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(Store(tmp_path / "routes.sqlite"), cases=8, studies=0)
    monkeypatch.setattr(draw, "find_spec", lambda name: None)
    ran = cli("report", "--store", "routes.sqlite", "--figures", "figures")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "pip install 'gradient-routes[pictures]'" in ran.err


def test_the_format_is_that_of_the_name_and_stdout_takes_both(cli, tmp_path: Path) -> None:
    fill(Store(tmp_path / "routes.sqlite"), cases=8, studies=0)
    store = ("--store", "routes.sqlite")
    assert cli("report", *store, "--format", "md").out.startswith("# Routes to the gradient")
    assert cli("report", *store, "-o", "-").out.startswith("<!doctype html>")
    cli("report", *store, "-o", "a.md")
    assert (tmp_path / "a.md").read_text().startswith("# Routes")
    assert "routes report -o report.html" in cli("report", *store).out
    assert len(ROUTES) == 8
