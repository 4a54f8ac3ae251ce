"""The figures of the bar inverter, one element above the other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bokeh.events import Tap
from bokeh.models import BasicTicker, BasicTickFormatter, ColumnDataSource, FixedTicker, Range1d, Whisker
from bokeh.plotting import figure
from bokeh.transform import dodge

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.lab import inverted
from gradient_routes.bench.lab.drawing import INK, colour, plot, span

LEFT = 78  # [px] of every figure, so that elements stand above each other
MODULI = -0.3, 0.5  # log E that are always in view, so that bars and not axes move
ADJOINT, FORWARD = colour("adjoint"), colour("tangent")
LOOKS = {"bias": ("square", "solid"), "variance": ("triangle", "dashed"), "total": ("circle", "dotted")}
NUMBERS = [
    ("element", "@e @blind"), ("log E", "@estimate{0.0000}, truth @truth{0.0000}"), ("dJ/d log E", "@gradient"),
    ("strains of u, λ", "@strain, @adjoint_strain"),
]  # fmt: skip


class Figures:
    """Of a bar of n elements: sources, and what is drawn from them. `tap` is called with the node that was hit."""

    def __init__(self, n: int, tap: Callable[[int], None]) -> None:
        self.n = n
        empty = [{"view": {}, "estimate": 0.0, "truth": 0.0, "gradient": 0.0, "blind": 0} for _ in range(n)]
        self.elements = ColumnDataSource(inverted.elements(empty))
        self.blind = ColumnDataSource({"left": [], "right": []})
        self.bars = ColumnDataSource({"e": [], "centre": [], "low": [], "high": []})
        self.nodes = ColumnDataSource(
            {"x": [i + 0.5 for i in range(1, n + 1)], "node": [*map(str, range(1, n + 1))], "look": [0.0] * n}
        )
        self.stop = ColumnDataSource({"x": []})
        self.path = ColumnDataSource(inverted.path([]))
        self.trades = ColumnDataSource(inverted.tradeoff([]))
        self.along = Range1d(0.35, n + 1.05)
        self.bar, self.moduli = self._bar(tap), self._moduli()
        self.strains = [
            self._panel("strain of u", "strain", FORWARD),
            self._panel("strain of λ", "adjoint_strain", ADJOINT),
            self._products(),
        ]
        self.cost, self.tradeoff = self._cost(), self._tradeoff()

    def sensors(self, nodes: list[int], stop: bool) -> None:
        """Show where sensors are, and whether there is a stop."""
        self.nodes.patch({"look": [(slice(self.n), [float(i + 1 in nodes) for i in range(self.n)])]})
        self.stop.data = {"x": [self.n + 0.95] if stop else []}

    def take(self, steps: list[Row], estimates: list[Row], trades: list[Row], trade: Row | None) -> None:
        """Show rows; `trade` is that of the spread beside the estimates."""
        self.elements.data = inverted.elements(estimates)
        self.blind.data = inverted.blind(estimates)
        self.bars.data = inverted.bars(estimates, trade)
        self.path.data = inverted.path(steps)
        self.trades.data = inverted.tradeoff(trades)
        self._scale()

    def _scale(self) -> None:
        """All axes. Those that scale by themselves warn of figures that are still empty."""
        of, squares = self.elements.data, [v for name in LOOKS for v in self.trades.data[name] if v > 0.0]
        moduli = [*of["estimate"], *of["truth"], *self.bars.data["low"], *self.bars.data["high"]]
        u, lam, product = self.strains
        span(self.moduli.y_range, [*moduli, *MODULI])
        span(u.y_range, [*of["strain"], 0.0])
        span(lam.y_range, [*of["adjoint_strain"], 0.0])
        span(product.y_range, [*of["product"], *of["gradient"], 0.0])
        span(self.cost.x_range, [*self.path.data["solves"], 0.0, 1.0])
        span(self.cost.y_range, self.path.data["misfit"], log=True)
        span(self.tradeoff.y_range, squares, log=True)

    def _aligned(self, y: str, legend: bool = False, **options: Any) -> figure:
        drawn = plot("", y, x_range=self.along, min_border_left=LEFT, **{"y_range": (-1.0, 1.0), **options})
        drawn.xaxis.ticker = FixedTicker(ticks=[*range(1, self.n + 1)])
        drawn.xgrid.visible = False
        drawn.vstrip(
            "left", "right", source=self.blind, fill_alpha=0.0, line_alpha=0.0, hatch_pattern="right_diagonal_line",
            hatch_color=INK, hatch_alpha=0.35, hatch_scale=10, **({"legend_label": "blind"} if legend else {}),
        )  # fmt: skip
        return drawn

    def _bar(self, tap: Callable[[int], None]) -> figure:
        """The bar with its nodes; a tap switches the sensor of the nearest node."""
        n = self.n
        drawn = self._aligned("", height=100)
        drawn.hbar([0.0], left=[0.5], right=[n + 0.5], height=0.5, color=INK, fill_alpha=0.25)
        drawn.segment([0.5], [-0.8], [0.5], [0.8], color=INK, line_width=5)
        drawn.segment("x", -0.8, "x", 0.8, source=self.stop, color=colour("fd-one-sided"), line_width=5)
        drawn.scatter("x", 0.0, source=self.nodes, size=11, color=INK, fill_alpha=0.2, line_width=2)
        drawn.scatter("x", 0.0, source=self.nodes, size=20, color=ADJOINT, alpha="look")
        drawn.text("x", -0.95, "node", source=self.nodes, color=INK, text_align="center", text_font_size="11px")
        drawn.text([n + 0.62], [0.0], ["F →"], color=INK, text_baseline="middle")
        drawn.axis.visible, drawn.ygrid.visible, drawn.outline_line_color = False, False, None

        def hit(event: Tap) -> None:
            node = round(event.x - 0.5)
            if 1 <= node <= n:
                tap(node)

        drawn.on_event(Tap, hit)
        return drawn

    def _moduli(self) -> figure:
        drawn = self._aligned("log E (0: the start)", legend=True, height=260, hover=NUMBERS)
        drawn.vbar(
            "e", 0.7, "estimate", source=self.elements, color=ADJOINT, fill_alpha=0.5, legend_label="estimate",
            hatch_pattern="hatch", hatch_color="white", hatch_alpha=0.9,
        )  # fmt: skip
        drawn.segment(
            dodge("e", -0.3), "truth", dodge("e", 0.3), "truth", source=self.elements, color=INK, line_width=4,
            legend_label="truth",
        )  # fmt: skip
        drawn.scatter("e", "centre", source=self.bars, marker="diamond", size=8, color=colour("fd-central"))
        whisker = Whisker(base="e", lower="low", upper="high", source=self.bars, line_color=colour("fd-central"))
        whisker.line_width = 2
        whisker.upper_head.line_color = whisker.lower_head.line_color = colour("fd-central")
        drawn.add_layout(whisker)
        return drawn

    def _panel(self, y: str, column: str, ink: str) -> figure:
        drawn = self._aligned(y, height=120, hover=[("element", "@e @blind"), (y, f"@{column}")])
        drawn.vbar("e", 0.7, column, source=self.elements, color=ink, fill_alpha=0.75)
        drawn.yaxis.ticker = BasicTicker(desired_num_ticks=3, num_minor_ticks=0)
        drawn.yaxis.formatter = BasicTickFormatter(precision=1)
        return drawn

    def _products(self) -> figure:
        drawn = self._panel("dJ/d log E [m²]", "product", ADJOINT)
        drawn.height, drawn.xaxis.axis_label = 160, "element"
        drawn.scatter("e", "gradient", source=self.elements, marker="diamond", size=9, color=INK)
        return drawn

    def _cost(self) -> figure:
        drawn = plot(
            "solves, forward and adjoint", "misfit [m²]", height=220, y_axis_type="log",
            x_range=(0.0, 1.0), y_range=(0.1, 10.0), min_border_left=LEFT,
            hover=[("iteration", "@iteration"), ("misfit", "@misfit"), ("solves", "@forward_solves + @adjoint_solves")],
        )  # fmt: skip
        drawn.line("solves", "misfit", source=self.path, color=ADJOINT)
        drawn.scatter("solves", "misfit", source=self.path, color=ADJOINT, size=5)
        return drawn

    def _tradeoff(self) -> figure:
        drawn = plot(
            "α", "mean square, over elements", height=240, x_axis_type="log", y_axis_type="log", x_range=(1e-8, 1.0),
            y_range=(0.1, 10.0), min_border_left=LEFT, hover=[("α", "@alpha"), *((n, f"@{n}") for n in LOOKS)],
        )  # fmt: skip
        for (name, (marker, dash)), ink in zip(LOOKS.items(), (FORWARD, ADJOINT, INK), strict=True):
            drawn.line("alpha", name, source=self.trades, color=ink, line_dash=dash, legend_label=name)
            drawn.scatter("alpha", name, source=self.trades, color=ink, marker=marker, size=8, legend_label=name)
        return drawn
