"""Which route for me: questions, the bill of every route, reasons, what would change the answer, the words."""

from __future__ import annotations

import html
import math
from typing import Any, ClassVar

import panel as pn
import param
from bokeh.models import ColumnDataSource, Range1d

from gradient_routes.bench.advice.asked import answers_of
from gradient_routes.bench.advice.statements import OF_ROUTES
from gradient_routes.bench.execution.isolation.limits import LEAST
from gradient_routes.bench.execution.isolation.messages import Message
from gradient_routes.bench.lab.advice import Advise, Curves, answer, bill_table, glossary
from gradient_routes.bench.lab.drawing import INK, colour, plot, span
from gradient_routes.bench.lab.numbers import table
from gradient_routes.bench.lab.part import Part
from gradient_routes.bench.lab.shell import Row
from gradient_routes.bench.lab.state import written
from gradient_routes.bench.units import duration

MANY = (1, 10**9)
CAN = {
    "J(p), and nothing else": "value",
    "R, R_u and J": "solve",
    "these and R_p, J_u, J_p": "linearize",
    "R and J written in JAX": "trace",
    "R and J for complex numbers": "complex",
}


class WhichRoute(Part):
    """State: the answers, named as the options of `routes advise`."""

    slug, title = "which-route", "Which route for me?"
    lead = "Answer what you know: the bill of every route, the one to take, why, and what would change the answer."

    each: ClassVar = {"have": (*CAN.values(),)}
    have = param.List(["linearize"], item_type=str, label="What can you evaluate?")
    parameters = param.Integer(100, bounds=MANY, label="Parameters n_p")
    outputs = param.Integer(1, bounds=MANY, label="Outputs: 1, or m for d(S u)/dp")
    unknowns = param.Integer(100_000, bounds=MANY, label="Unknowns n_u, of one step")
    steps = param.Integer(0, bounds=(0, MANY[1]), label="Steps in time; 0: steady")
    newton_steps = param.Integer(1, bounds=MANY, label="Newton steps of a solve; 1: linear")
    forward = param.Number(1.0, bounds=(0.0, 1e12), inclusive_bounds=(False, True), label="A forward solve [s]")
    rtol = param.Number(1e-12, bounds=(0.0, 1.0), inclusive_bounds=(False, False), label="Solves leave |R| / |R_0|")
    error = param.Number(1e-7, bounds=(0.0, 1.0), inclusive_bounds=(False, False), label="Error the gradient may have")
    memory = param.String("8GiB", label="Memory; none: no limit")
    gradients = param.Integer(1, bounds=MANY, label="How many gradients?")
    budget = param.Number(
        None, bounds=(0.0, None), inclusive_bounds=(False, True), allow_None=True, label="Seconds for all; empty: any"
    )
    kinks = param.Boolean(False, label="J has kinks near p: contact, plasticity")
    iterate = param.Boolean(False, label="The derivative of the last iterate is wanted")

    def command(self) -> tuple[str, ...]:
        words = ["advise"]
        for name in self.fields:
            value = getattr(self, name)
            if value == self._defaults[name]:
                continue
            option = f"--{name.replace('_', '-')}"
            if isinstance(value, list):
                words += [word for each in value or ["value"] for word in (option, each)]
            else:
                words += [option] if value is True else [option, written(value)]
        return tuple(words)

    def job(self) -> Advise:
        given = {name: getattr(self, name) for name in self.fields}
        return Advise(answers_of(**given | {"budget": math.inf if self.budget is None else self.budget}))

    def content(self) -> pn.Column:
        self._answer, self._bills, self._alternatives = (
            pn.pane.HTML("", sizing_mode="stretch_width", min_height=60) for _ in range(3)
        )
        self._curves = ColumnDataSource({name: [] for name in ("n_p", *OF_ROUTES)})
        self._here = ColumnDataSource({"x": [], "y": []})
        drawn = plot(
            "parameters n_p", "time of all gradients [s]", x_axis_type="log", y_axis_type="log",
            x_range=Range1d(0.5, 2e9), y_range=Range1d(0.1, 10.0),
        )  # fmt: skip
        self._times = drawn.y_range
        for name in OF_ROUTES:
            dash = "dashed" if name.endswith("-ad") else "solid"  # they often lie on the adjoint's
            look = {"color": colour(name), "line_width": 2, "line_dash": dash, "legend_label": name}
            drawn.line("n_p", name, source=self._curves, **look)
        drawn.line("x", "y", source=self._here, color=INK, line_dash="dotted")
        drawn.legend.location = "top_left"
        words = pn.pane.HTML(glossary(), sizing_mode="stretch_width")
        figure = pn.pane.Bokeh(drawn, sizing_mode="stretch_width")
        advice = pn.Column(self._answer, self._bills, figure, self._alternatives, sizing_mode="stretch_width")
        self.drawn = (advice,)
        return pn.Column(self._controls(), advice, words, sizing_mode="stretch_width")

    def _controls(self) -> pn.Column:
        can = pn.widgets.CheckBoxGroup.from_param(self.param.have, name="", options=CAN, inline=False)
        boxes = [pn.widgets.Checkbox.from_param(self.param[name]) for name in ("kinks", "iterate")]
        kinds = {
            param.Integer: pn.widgets.IntInput,
            param.Number: pn.widgets.FloatInput,
            param.String: pn.widgets.TextInput,
        }
        numbers = [
            kinds[type(self.param[name])].from_param(self.param[name], width=220)
            for name in self.fields
            if type(self.param[name]) in kinds
        ]
        asked = pn.pane.HTML(f"<p>{self.param.have.label}</p>")
        return pn.Column(asked, can, pn.FlexBox(*numbers), *boxes, sizing_mode="stretch_width")

    def take(self, message: Message) -> None:
        if isinstance(message, Row):
            self._answer.object = answer(message.value)
            self._bills.object = bill_table(message.value)
            self._alternatives.object = self._change_table(message.value)
        elif isinstance(message, Curves):
            self._draw(message)

    def _draw(self, curves: Curves) -> None:
        none = [math.nan] * len(curves.n_p)
        self._curves.data = {"n_p": curves.n_p} | {name: curves.seconds.get(name, none) for name in OF_ROUTES}
        every = [s for line in curves.seconds.values() for s in line if math.isfinite(s)]
        span(self._times, every, log=True)
        self._here.data = {"x": [self.parameters] * 2, "y": [min(every), max(every)] if every else [1.0, 1.0]}

    def _change_table(self, advice: dict[str, Any]) -> str:
        rows = [
            (self._link(change), html.escape(change["route"]), duration(change["seconds"]))
            for change in advice["changes"]
        ]
        return "<h2>What would change it</h2>" + table(["", "best then", "time"], rows) if rows else ""

    def _link(self, change: dict[str, Any]) -> str:
        """The condition, with the address of the page where it holds; less memory than LEAST is not to be asked for."""
        if change["answer"] == "memory" and change["value"] < LEAST:
            return html.escape(change["says"])
        state = {name: getattr(self, name) for name in self.fields} | self._changed_to(change)
        return f'<a href="{html.escape(f"/{self.slug}?{self.query_of(state)}")}">{html.escape(change["says"])}</a>'

    def _changed_to(self, change: dict[str, Any]) -> dict[str, Any]:
        """The fields of the state that a change is about."""
        name, value = change["answer"], change["value"]
        named = {"n_p": "parameters", "newton": "newton_steps", "smooth": "kinks"}
        if name == "offers":
            (what,) = value
            if change["bound"] == "with":
                return {"have": [*self.have, what]}
            return {"have": ["value"] if what == "solve" else [each for each in self.have if each != what] or ["solve"]}
        if name == "smooth":
            value = not value
        if name == "memory":
            value = f"{value:.0f}"
        return {named.get(name, name): value}
