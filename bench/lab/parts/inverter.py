"""Eight moduli of a bar from a few displacements, by gradients: what data see, and what noise and alpha do."""

from __future__ import annotations

import html
import shlex
from typing import ClassVar, get_args

import panel as pn
import param

from gradient_routes.bench.cases.column import Row as Columns
from gradient_routes.bench.execution.isolation.channel import Job
from gradient_routes.bench.execution.isolation.messages import Message
from gradient_routes.bench.lab import inverted
from gradient_routes.bench.lab.inverter_figures import Figures
from gradient_routes.bench.lab.part import Part
from gradient_routes.bench.lab.pool import Pool
from gradient_routes.bench.lab.shell import Command, Commands, Row
from gradient_routes.bench.lab.state import written
from gradient_routes.problems.contact import StopName

N = 8
MOST = 200  # iterations of a whole run
DRAWS = 20
SWEEP = ("1e-8", "1", "9")  # weights alpha of redrawn noise
OPTIMIZERS = ["lbfgs", "gauss-newton", "descent", "trust"]
STOPS = [*get_args(StopName)]
READ = """<p><b>Bars</b>: estimates at iterate k, 0 being the start. <b>Dashes</b>: the truth. <b>Hatched</b>: blind, no
    datum depends on the element. Below them what the gradient is made of: A L E times the strain of u times that of λ;
    diamonds are the whole of dJ/d log E, with the share of α Φ.</p>"""

SPREAD = """<h2>The same with {draws} draws of the noise</h2><p>Whiskers above: mean and standard deviation of their
    estimates at α = {alpha:g}. Bias is what Φ and blindness do, variance is what noise does. The bars are those of
    <code>{once}</code>.</p>"""


class Inverter(Part):
    """State: the problem, its data and their noise, the optimizer and its iterations; draws of the noise, 0 for one."""

    slug, title = "inverter", "Adjoint bar inverter"
    lead = "Switch sensors, add noise, weigh Phi, step: what a gradient finds, what it costs, and what it cannot see."

    each: ClassVar = {"sensors": (1, N)}
    sensors = param.List([1, 3, 5], item_type=int, bounds=(0, N), doc="nodes")
    noise = param.Number(1e-3, bounds=(0.0, 1.0), doc="standard deviation [m]")
    seed = param.Integer(0, bounds=(0, 10**6))
    alpha = param.Number(0.0, bounds=(0.0, 100.0), doc="weight of Phi")
    stop_at = param.Selector(default="none", objects=STOPS, doc="beyond the tip")
    gap = param.Number(0.8, bounds=(0.0, 2.0), doc="that the tip may move [m]")
    optimizer = param.Selector(default="lbfgs", objects=OPTIMIZERS)
    iterations = param.Integer(MOST, bounds=(0, MOST))
    draws = param.Integer(0, bounds=(0, 100))

    figures: Figures
    _redrawing = False

    def selector(self, alpha: float) -> str:
        """The bar of this state, as --problem takes it."""
        given = {"noise": self.noise, "seed": self.seed, "alpha": alpha}
        options = [f"sensors={written(sorted(self.sensors) or [0])}"]
        options += [f"{name}={written(value)}" for name, value in given.items() if value]
        if self.stop_at != "none":
            options += [f"stop={self.stop_at}", f"gap={written(self.gap)}"]
        return f"bar[{','.join(options)}]"

    def command(self) -> tuple[str, ...]:
        if not self.draws:
            return self._once()
        draws = ("--draws", str(self.draws), "--tolerance", "1e-6")
        sweep = ("--alpha-sweep", *SWEEP, *draws)
        return ("invert", "--problem", self.selector(0.0), "--optimizer", "gauss-newton", *sweep)

    def _once(self) -> tuple[str, ...]:
        how = ("--optimizer", self.optimizer, "--iterations", str(self.iterations))
        return ("invert", "--problem", self.selector(self.alpha), *how)

    def job(self) -> Job:
        once, asked = (Command(arguments, self.place.folder) for arguments in (self._once(), self.command()))
        return Commands((once, asked)) if self.draws else once

    def pool(self) -> Pool:
        return self.place.long if self.draws else self.place.quick

    def _changed(self, *moves: param.parameterized.Event) -> None:
        """Any move ends redrawing; it is asked for anew."""
        if self._redrawing:
            self._redrawing = False
            self.stop()
        if self.draws and all(move.name != "draws" for move in moves):
            self.draws = 0  # comes back to here
            return
        self._redrawing = self.draws > 0
        self.figures.sensors(self.sensors, self.stop_at != "none")
        super()._changed(*moves)

    def content(self) -> pn.Column:
        self._redrawing = self.draws > 0
        self._steps: list[Columns] = []
        self._estimates: list[Columns] = []
        self._trades: list[Columns] = []
        self.figures = Figures(N, self.switch)
        self.figures.sensors(self.sensors, self.stop_at != "none")
        self._meter, self._verdict, self._numbers, self._spread = (
            pn.pane.HTML("", sizing_mode="stretch_width") for _ in range(4)
        )
        drawn = [self.figures.bar, self.figures.moduli, *self.figures.strains]
        aligned = pn.Column(*(pn.pane.Bokeh(each, sizing_mode="stretch_width") for each in drawn))
        tradeoff = pn.pane.Bokeh(self.figures.tradeoff, sizing_mode="stretch_width")
        cost = pn.pane.Bokeh(self.figures.cost, sizing_mode="stretch_width")
        self._redrawn = pn.Column(self._spread, tradeoff, sizing_mode="stretch_width", visible=False)
        found = pn.Column(
            self._meter,
            self._verdict,
            aligned,
            pn.pane.HTML(READ, sizing_mode="stretch_width"),
            cost,
            self._redrawn,
            self._numbers,
            sizing_mode="stretch_width",
        )
        self.drawn = (found,)
        return pn.Column(self._controls(), found, sizing_mode="stretch_width")

    def _controls(self) -> pn.Column:
        params = self.param
        sensors = pn.widgets.CheckButtonGroup.from_param(params.sensors, options=[*range(1, N + 1)])
        select = pn.widgets.Select.from_param
        gap = pn.widgets.FloatSlider.from_param(params.gap, start=0.5, end=1.2, step=0.01, name="Gap [m]", width=150)
        choices = [
            self._logarithmic("noise", "Noise [m]", -5, -1),
            pn.widgets.IntInput.from_param(params.seed, name="Seed of it", width=90),
            self._logarithmic("alpha", "Weight α of Φ", -9, 0),
            select(params.optimizer, name="Optimizer", width=130),
            select(params.stop_at, name="Stop beyond the tip", description=None, width=140),
            gap,
        ]
        params.stop_at.rx.watch(lambda stop: setattr(gap, "disabled", stop == "none"))
        gap.disabled = self.stop_at == "none"
        moves = {
            "step back": lambda: self.iterate(self._at - 1),
            "step": lambda: self.iterate(self._at + 1),
            "run": lambda: self.iterate(MOST),
            "reset": lambda: self.iterate(0),
            f"redraw the noise {DRAWS} times": lambda: setattr(self, "draws", DRAWS),
        }
        buttons = [pn.widgets.Button(name=name, on_click=lambda _, move=move: move()) for name, move in moves.items()]
        label = pn.pane.HTML("<p>Sensors at nodes</p>", width=140)
        return pn.Column(pn.FlexBox(label, sensors, align_items="center"), pn.FlexBox(*choices), pn.FlexBox(*buttons))

    def _logarithmic(self, field: str, name: str, least: int, most: int) -> pn.widgets.DiscreteSlider:
        """0, then 1, 2 and 5 of every decade, and what the URL says."""
        decades = [float(f"{d}e{k}") for k in range(least, most) for d in (1, 2, 5)]
        values = sorted({0.0, *decades, 10.0**most, getattr(self, field)})
        slider = pn.widgets.DiscreteSlider(
            name=name, options={f"{v:g}": v for v in values}, value=getattr(self, field), width=190
        )
        slider.param.watch(lambda move: setattr(self, field, move.new), "value")
        return slider

    @property
    def _at(self) -> int:
        """The iterate that is shown."""
        return int(self._steps[-1]["iteration"]) if self._steps else self.iterations

    def iterate(self, k: int) -> None:
        """Show the iterate k."""
        self.iterations = min(max(k, 0), MOST)

    def switch(self, node: int) -> None:
        """A sensor at a node, or none."""
        self.sensors = sorted({*self.sensors} ^ {node})

    def begin(self) -> None:
        self._new: dict[str, list[Columns]] = {"inversion": [], "estimates": [], "tradeoff": []}
        if self.draws:
            self.say("redrawing the noise, from the largest weight to the least; any change ends it", bad=False)

    def take(self, message: Message) -> None:
        if isinstance(message, Row):
            self._new.setdefault(message.value["table"], []).append(message.value)
            if len(self._new["estimates"]) == N:  # the last row of an inversion, or one of redrawn noise
                self._draw()

    def _draw(self) -> None:
        self._steps, self._estimates, self._trades = (
            self._new[name] for name in ("inversion", "estimates", "tradeoff")
        )
        trade = inverted.nearest(self._trades, self.alpha)
        self.figures.take(self._steps, self._estimates, self._trades, trade)
        self._meter.object = inverted.meter(self._steps)
        self._verdict.object = f'<p role="status">{html.escape(self._steps[-1]["says"])}</p>'
        self._numbers.object = inverted.numbers(self._estimates, trade)
        self._redrawn.visible = bool(self._trades)
        once = html.escape(f"routes {shlex.join(self._once())}")
        self._spread.object = "" if trade is None else SPREAD.format(**trade, once=once)
