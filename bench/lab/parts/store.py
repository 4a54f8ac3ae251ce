"""A store: its tables, filtered, and every figure of its report."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import panel as pn
import param

from gradient_routes.bench.command_options import STORE
from gradient_routes.bench.execution.isolation.channel import Call
from gradient_routes.bench.execution.isolation.messages import Ended, Message, Returned
from gradient_routes.bench.lab import looking
from gradient_routes.bench.lab.part import Part
from gradient_routes.bench.lab.state import option
from gradient_routes.bench.store.filter import COLUMNS, Filter
from gradient_routes.bench.store.schema import tables
from gradient_routes.bench.store.store import Store

ANY = "any"
FIELDS = {name: name for name in COLUMNS} | {"status": "ended"}  # column -> parameter
FRAME = "width: 100%; height: min(56rem, 88vh); border: 1px solid var(--edge); border-radius: 5px"


class KeptRows(Part):
    """State: what is seen, a table or a section of the report, and which of its rows."""

    slug, title = "store", "Your store"
    lead = "What routes has kept: every table, filtered, and every figure of the report."

    show = param.Selector(objects=["table", "figures"], doc="what is seen")
    table = param.Selector(objects=[*tables()], doc="a table of the store")
    section = param.String("", doc="of the report; none: the first with a figure")
    problem = param.String("", doc="rows of this problem, by its name without options")
    route = param.String("", doc="rows of this route, by its name without options")
    ended = param.String("", label="status", doc="rows with this status")
    verdict = param.String("", doc="rows with this verdict")
    search = param.String("", doc="rows with this text in any column")
    first = param.Integer(0, bounds=(0, None), doc="rows before those that are sent")

    @property
    def where(self) -> Filter:
        """What is asked of rows; nothing of columns that the table lacks."""
        return Filter(**{name: getattr(self, FIELDS[name]) for name in self._filtered}, search=self.search)

    @property
    def _filtered(self) -> list[str]:
        there = {column.name for column in tables()[self.table]} if self.show == "table" else {*COLUMNS}
        return [name for name in COLUMNS if name in there]

    def command(self) -> tuple[str, ...]:
        where = self.where
        given = [(name, value) for name in (*COLUMNS, "search") if (value := getattr(where, name))]
        filters = [word for name, value in given for word in option(name, value)]
        store = () if self.place.store == STORE else option("store", str(self.place.store))
        if self.show == "figures":
            return ("report", "-o", "report.html", *filters, *store)
        return ("export", "--table", self.table, *filters, *store)

    def job(self) -> Call:
        store = Store(self.place.store, looking.PATIENCE)
        if self.show == "figures":
            return Call(looking.drawn, (store, self.where, self.section))
        return Call(looking.rows, (store, self.table, self.where, self.first))

    def content(self) -> pn.Column:
        self._seen = pn.pane.HTML("", sizing_mode="stretch_width", min_height=200)
        self.drawn = (self._seen,)
        self._count = pn.pane.HTML("", sizing_mode="stretch_width")
        self._selects = {name: self._select(name) for name in (*COLUMNS, "section")}
        self._earlier, self._later_rows = (
            pn.widgets.Button(name=f"{word} {looking.MOST} rows", disabled=True, width=140)
            for word in ("previous", "next")
        )
        self._earlier.on_click(lambda _: self._turn(-looking.MOST))
        self._later_rows.on_click(lambda _: self._turn(looking.MOST))
        self._table = pn.widgets.Select.from_param(self.param.table, width=170)
        search = pn.widgets.TextInput.from_param(self.param.search, width=200, placeholder="text in any column")
        shown = pn.widgets.RadioBoxGroup.from_param(self.param.show, inline=True, align="center")
        self.param.watch(self._again, ["show", "table", *FIELDS.values(), "search"])
        self._fit()
        return pn.Column(
            pn.FlexBox(shown, self._table, *self._selects.values(), search, align_items="end"),
            pn.FlexBox(self._earlier, self._later_rows, self._count, align_items="center"),
            self._seen,
            sizing_mode="stretch_width",
        )

    def _select(self, name: str) -> pn.widgets.Select:
        field = FIELDS.get(name, name)
        value = getattr(self, field)
        select = pn.widgets.Select(name=name, options={ANY: "", **({value: value} if value else {})}, value=value)
        select.width = 170
        select.param.watch(lambda event: setattr(self, field, event.new or ""), "value")
        self.param.watch(lambda event: setattr(select, "value", event.new), field)
        return select

    def _again(self, *_: Any) -> None:
        """Other rows are asked for: begin with the first of them."""
        self.first = 0
        self._fit()

    def _fit(self) -> None:
        """Show the controls that mean something."""
        table = self.show == "table"
        for name, select in self._selects.items():
            select.visible = name in self._filtered or (name == "section" and not table)
        for widget in (self._table, self._earlier, self._later_rows):
            widget.visible = table

    def _turn(self, rows: int) -> None:
        self.first = max(0, self.first + rows)

    def _offer(self, name: str, choices: Mapping[str, str]) -> None:
        """Choices of a select: what is shown, by value; the one chosen stays."""
        chosen = getattr(self, FIELDS.get(name, name))
        known = {"": ANY, **({chosen: chosen} if chosen else {}), **choices}
        self._selects[name].options = {text: value for value, text in known.items()}

    def _offer_rows(self, choices: looking.Choices) -> None:
        for name, counted in choices.items():
            self._offer(name, {value: f"{value} ({count})" for value, count in counted.items()})

    def take(self, message: Message) -> None:
        match message:
            case Returned(looking.Rows() as rows):
                self._list(rows)
            case Returned(looking.Drawn() as drawn):
                self._frame(drawn)

    def _list(self, rows: looking.Rows) -> None:
        self._offer_rows(rows.choices)
        last = min(rows.first + looking.MOST, rows.kept)
        of = f"{rows.kept} rows" if rows.kept == rows.every else f"{rows.kept} of {rows.every} rows"
        said = f"Rows {rows.first + 1} to {last} of {of}." if last > rows.first else f"None of {of}."
        self._count.object = f"<p>{said}</p>"
        self._earlier.disabled, self._later_rows.disabled = rows.first == 0, last == rows.kept
        self._seen.object = rows.text

    def _frame(self, drawn: looking.Drawn) -> None:
        self._offer_rows(drawn.choices)
        self._offer("section", drawn.sections)
        self._count.object = ""
        self._seen.object = (
            f'<iframe title="{escape(drawn.sections[drawn.section])}" sandbox="allow-scripts allow-downloads"'
            f' style="{FRAME}" srcdoc="{escape(drawn.page)}"></iframe>'
        )

    def end(self, end: Ended, code: int) -> None:
        if end.reason:
            self._seen.object = self._count.object = ""
