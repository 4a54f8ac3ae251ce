"""The report in a browser: every figure drawn, filters and tables true to the numbers, whatever the names hold."""

from __future__ import annotations

import csv
import gzip
import io
import json
import re
from dataclasses import dataclass, replace
from html import unescape
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.browser import DARK, NAMES, browser, opened
from benchmarks.invented_store import MAKERS, ROUTES, fill, measured, whole_row
from gradient_routes.bench.cases.registry import study_tables
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.cases.selector import bare
from gradient_routes.bench.render import html, markdown, pictures
from gradient_routes.bench.render.figure import Axis, Figure, Section, Table
from gradient_routes.bench.render.marks import MARKS
from gradient_routes.bench.render.picking import real
from gradient_routes.bench.render.sections import sections
from gradient_routes.bench.render.source import Source, newest, read
from gradient_routes.bench.render.style import CONTRAST, NIGHT, PAPER, contrast, of_route
from gradient_routes.bench.render.terminal.palette import ROUTES as COLOURS
from gradient_routes.bench.render.vega import overlaps, records, spec, svg
from gradient_routes.bench.render.view import View
from gradient_routes.bench.store.store import Store

in_browser = pytest.mark.skipif(browser() is None, reason=f"no browser here: none of {', '.join(NAMES)}")
HOSTILE = "</script><script>alert(1)</script> \"quoted\", 'so', `so` & <b>λ ü 中 𝄞</b> -- ]]> | $x$ "
WHEN = "2026-01-02T00:00:00.000+00:00"

# runs in the page, before its own script and after it; nothing of it is in the report
BEFORE = """<script>
window.wrong = [];
window.onerror = (what) => wrong.push(String(what));
window.onunhandledrejection = (event) => wrong.push(String(event.reason));
window.alert = () => wrong.push("alert");
</script></head>"""
AFTER = """<script>(async () => {
const filters = document.querySelector(".filters");
const drawn = report.figures.filter((figure) => figure.specs);
const set = async (name, value, checked) => {
  const box = [...filters.querySelectorAll(`[name=${name}]`)].find((box) => box.value === value);
  box.checked = checked;
  box.dispatchEvent(new Event("change", { bubbles: true }));
  await report.drawAll();
};
const MARKS = ["point", "bar", "rect mark"].map((role) => `.plot [aria-roledescription="${role}"]`).join();
const marks = () => Object.fromEntries(drawn.map((figure) => [figure.id, figure.node.querySelectorAll(MARKS).length]));
for (const figure of drawn) figure.all = true;
report.filtered();
await report.drawAll();
const seen = { whole: marks() };
seen.csv = Object.fromEntries(report.figures.map((figure) => [figure.id, report.csv(figure)]));
for (const details of document.querySelectorAll(".numbers details")) details.open = true;
for (const figure of report.figures) report.table(figure);
const ROWS = "tbody tr:not([hidden])";
const rows = () => Object.fromEntries(report.figures.map((f) => [f.id, f.node.querySelectorAll(ROWS).length]));
seen.tables = rows();
await set("route", "adjoint", false);
seen.route = marks();
seen.fewer = rows();
seen.shorter = report.csv(report.figures.find((figure) => figure.id === "error-and-time"));
await set("route", "adjoint", true);
await set("family", "bar", false);
seen.problem = marks();
await set("family", "bar", true);
seen.again = marks();
seen.chosen = [];
for (const select of document.querySelectorAll(".tools select")) for (const option of select.options) {
  select.value = option.value;
  select.dispatchEvent(new Event("change", { bubbles: true }));
  const figure = report.figures.find((figure) => figure.node === select.closest("figure"));
  await report.drawAll();
  seen.chosen.push(figure.node.querySelectorAll(".plot svg").length);
}
const curves = report.figures.find((figure) => figure.id === "v-curves");
[...curves.table.querySelectorAll("th button")].find((button) => button.textContent.startsWith("step")).click();
seen.sorted = [...curves.table.tBodies[0].rows].map((tr) => curves.rows[tr.place].step);
seen.focusable = document.querySelectorAll(".numbers .scroll[tabindex='0'][aria-label]").length;
seen.scripts = document.scripts.length;
seen.width = [document.documentElement.scrollWidth, window.innerWidth];
seen.paper = getComputedStyle(document.body).backgroundColor;
seen.wrong = wrong;
document.body.append(Object.assign(document.createElement("pre"), { id: "seen", textContent: JSON.stringify(seen) }));
})();</script></body>"""


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
        store.append_study(name, {name: [whole_row(name, hostile_study())]}, WHEN)
    source = read(store)
    made = sections(source)
    return Report(source, made, html.report(source, made))


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
    body, _, end = report.page.replace("</head>", BEFORE, 1).rpartition("</body>")
    page.write_text(f"{body}{AFTER}{end}", "utf-8")
    told = opened(page, *options, width=width)
    found = re.search(r'<pre id="seen">(.*?)</pre>', told.dom, re.DOTALL)
    assert found is not None, told.console
    return json.loads(unescape(found[1])) | {"console": told.console}


def points(figure: Figure, kept: Any = lambda problem, route: True) -> int:
    """Marks of a page: known numbers, on log axes none below 0 and zeros in y alone; of cells unknown ones, too."""
    table, x, y = figure.table, figure.x[0], figure.y[0]
    count = 0
    for i in range(len(table.rows)):
        who = [table.column(name)[i] if name in table.names else None for name in ("problem", "route")]
        for column in figure.fold or [""]:
            at = [table.column(axis.column or column)[i] for axis in (x, y)]
            out = (x.scale == "log" and at[0] is not None and at[0] <= 0) or (
                y.scale == "log" and at[1] is not None and at[1] < 0
            )
            count += None not in at and not out and kept(*who)
    return count


def expected(report: Report, kept: Any = lambda problem, route: True) -> dict[str, int]:
    return {figure.id: points(figure, kept) for figure in report.figures if figure.mark}


def test_every_table_of_the_store_has_a_figure(report: Report) -> None:
    filled = {name for make in MAKERS for name in make("bar", 8, np.random.default_rng(0))}
    assert set(study_tables()) <= filled, "the invented store leaves a table empty: nothing would be tested"
    assert len(report.sections) == len({section.id for section in report.sections}) >= 9
    assert len(report.figures) == len({figure.id for figure in report.figures}) >= 22
    assert all(figure.says or figure.id == "machines" for figure in report.figures)


@in_browser
def test_a_browser_draws_every_number_and_filters_it(report: Report, tmp_path: Path) -> None:
    found = seen(report, tmp_path)
    assert (found["wrong"], complaints(found)) == ([], [])
    assert found["scripts"] == 5, "the data, the library, the page's and the two of this test"
    assert found["whole"] == found["again"] == expected(report)
    assert found["route"] == expected(report, lambda problem, route: bare(route) != "adjoint")
    assert found["problem"] == expected(report, lambda problem, route: bare(problem) != "bar")
    assert found["route"] != found["whole"] != found["problem"]
    assert set(found["chosen"]) == {1}
    assert found["sorted"] == sorted(found["sorted"], key=lambda step: (step is None, step))
    assert len(set(found["sorted"])) > 1
    assert found["focusable"] == len(report.figures)
    assert found["paper"] == "rgb(255, 255, 255)"
    assert found["width"][0] <= found["width"][1]
    for figure in report.figures:
        assert found["tables"][figure.id] == len(figure.table.rows)
        same_numbers(figure, found["csv"][figure.id])
        routes = figure.table.column("route") if "route" in figure.table.names else []
        assert found["fewer"][figure.id] == len(figure.table.rows) - sum(bare(route) == "adjoint" for route in routes)
    assert "adjoint" not in {row["route"] for row in csv.DictReader(io.StringIO(found["shorter"]))}


def complaints(found: dict[str, Any]) -> list[str]:
    """Of the console; Vega-Lite warns of scales that panels do not share, as is meant."""
    return [line for line in found["console"] if "WARN " not in line]


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
    assert (found["wrong"], complaints(found)) == ([], [])


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
    assert page.tags.count("script") == 3
    assert all(link.startswith("#") for link in page.links)
    own = re.sub(r"<script>const n=.*?</script>", "", report.page, flags=re.DOTALL)  # the library's names of schemas
    assert len(own) < len(report.page) - 800_000
    assert not re.search(r"@import|url\((?!#)|https?://", own.replace("\\u003c", "<"))
    assert "default-src 'none'" in own
    rows = sum(len(figure.table.rows) + 1 for figure in report.figures)
    assert page.tags.count("tr") == rows
    assert page.tags.count("table") == len(report.figures)
    assert page.tags.count("details") >= page.tags.count("noscript") == sum(f.mark is not None for f in report.figures)


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
    pytest.importorskip("vl_convert", reason="figures need gradient-routes[pictures]")
    store = Store(tmp_path / "routes.sqlite")
    fill(store, cases=8, studies=0)
    ran = cli("report", "--store", "routes.sqlite", "--figures", "figures", "--format", "md", "-o", "there.md")
    assert ran.code == 0, ran.err
    wanted = {
        f"{f.id}.{format}" for s in sections(read(store)) for f in s.figures if f.mark for format in pictures.FORMATS
    }
    assert {path.name for path in (tmp_path / "figures").iterdir()} == wanted
    starts = {"png": b"\x89PNG", "svg": b"<svg", "pdf": b"%PDF"}
    for name in wanted:
        assert (tmp_path / "figures" / name).read_bytes().startswith(starts[name.rpartition(".")[2]])
    for name in re.findall(r"!\[.*\]\(<(.*)>\)", (tmp_path / "there.md").read_text()):
        assert (tmp_path / name).is_file()


def test_every_figure_compiles_on_all_its_axes_and_holds_user_text_as_text(report: Report) -> None:
    vl_convert = pytest.importorskip("vl_convert", reason="figures need gradient-routes[pictures]")
    drawn = [figure for figure in report.figures if figure.mark]
    assert {figure.mark for figure in drawn} == set(MARKS)
    for figure in drawn:
        for k in range(max(len(figure.x), len(figure.y))):  # every axis of either, which do not know of each other
            x, y = k % len(figure.x), k % len(figure.y)
            vl_convert.vegalite_to_vega(spec(figure, x, y) | {"datasets": {"rows": records(figure)}})
    shown = {figure.id: svg(figure) for figure in drawn}
    assert not any("<script" in picture or "<b>" in picture for picture in shown.values())
    assert any("&lt;/script&gt;" in picture for picture in shown.values()), "no figure shows a hostile name"
    assert shown["error-and-time"] == svg(next(figure for figure in drawn if figure.id == "error-and-time"))


def test_zeros_are_in_a_strip_of_their_own_and_what_lies_on_each_other_is_said() -> None:
    pytest.importorskip("vl_convert", reason="figures need gradient-routes[pictures]")
    columns = [real("x", "1", ""), real("y", "1", "")]
    rows = [{"x": x, "y": y} for y in (1.0, 2.0, 0.0) for x in (1.0, 2.0, 3.0)]
    series = ("one", "two", "one")
    figure = Figure(
        "f", "title", "says", Table.of(columns, rows), "line", (Axis("x", "x"),), (Axis("y", "y", "", "log"),)
    )
    figure = replace(figure, series=tuple(name for name in series for _ in range(3)))
    assert "exactly 0" in svg(figure)
    assert overlaps(figure) == ""
    same = replace(figure, table=Table.of(columns, [row | {"y": 1.0} for row in rows]))
    assert "exactly 0" not in svg(same)
    assert "one and two" in overlaps(same)


def test_the_library_in_the_page_is_the_one_that_draws_pictures() -> None:
    vl_convert = pytest.importorskip("vl_convert", reason="figures need gradient-routes[pictures]")
    library = gzip.decompress(files("gradient_routes.bench.render").joinpath("vega.js.gz").read_bytes()).decode()
    versions = re.findall(r"\b\d+\.\d+\.\d+\b", library)
    assert vl_convert.get_vega_version().lstrip("v") in versions
    assert any(version.startswith(f"{vl_convert.get_vegalite_versions()[-1]}.") for version in versions)


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
        styles = View(figure, figure.x[0], figure.y[0]).styles if figure.mark else {}
        for name, style in styles.items():
            if figure.routes and bare(name) in COLOURS:
                assert style.colour == COLOURS[bare(name)], figure.id


def test_the_newest_study_of_each_thing_asked_is_shown() -> None:
    rows = [{"study_id": k, "problem": p, "route": "adjoint", "at": "start"} for k, p in ((1, "a"), (2, "b"), (3, "a"))]
    assert [row["study_id"] for row in newest(rows, study_tables()["checks"].question)] == [2, 3]


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
    "the store": (["-o", "routes.sqlite"], "is another file of this run"),
    "the store by a link": (["-o", "link.html"], "is another file of this run"),
    "a directory": (["-o", "folder"], "Is a directory"),
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


def test_figures_without_vl_convert_say_what_to_install(cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(Store(tmp_path / "routes.sqlite"), cases=8, studies=0)
    monkeypatch.setattr(pictures, "find_spec", lambda name: None)
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
