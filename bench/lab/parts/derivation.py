"""Deriving the discrete adjoint: each line of it beside the numbers of a bar."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import panel as pn
import param
from bokeh.models import ColumnDataSource, PrintfTickFormatter

from gradient_routes.bench.execution.isolation.messages import Message
from gradient_routes.bench.lab.algebra import Algebra, WithAlgebra
from gradient_routes.bench.lab.drawing import INK, colour, plot
from gradient_routes.bench.lab.formula import with_formulas
from gradient_routes.bench.lab.numbers import matrix, number, table, vector
from gradient_routes.bench.lab.part import Part
from gradient_routes.bench.lab.shell import Command, Row
from gradient_routes.bench.lab.state import option, written

N = 8
LN2 = float(np.log(2.0))
OCTAVES = 2.0  # E from 1/4 to 4 of the start
STRAINS = (r"\varepsilon_e(u)", r"\varepsilon_e(\lambda)")
PRODUCT = (*(f"${strain}$" for strain in STRAINS), rf"$A\,L_e\,E_e\;{STRAINS[0]}\,{STRAINS[1]}$ [m<sup>2</sup>]")
WORK = ("forward_solves", "solves", "transposed_solves")
LINES = {
    "state": r"""<h2>1. A state for every p</h2><p>Moduli $p_e = \log E_e$ determine the displacements $u$ by
        equilibrium, $$R(u, p) = K(p)\,u - f = 0.$$ $R$ is linear in $u$ here; nothing below depends on that.</p>""",
    "objective": r"""<h2>2. An objective of the state</h2><p>Sensors read some displacements, $S u$; $J$ compares them
        with the data $d$: $$J = \tfrac{1}{2}\,|S u - d|^2.$$</p>""",
    "chain": r"""<h2>3. The chain rule, twice</h2><p>$R$ stays zero when $p$ changes, so
        $$R_u\,\frac{du}{dp} + R_p = 0, \qquad \frac{dJ}{dp} = J_p + J_u^T\,\frac{du}{dp}.$$
        $R_u$ is the stiffness matrix; column $e$ of $R_p$ holds the forces of element $e$.</p>""",
    "sensitivity": r"""<h2>4. The matrix that nobody should form</h2><p>$$\frac{du}{dp} = -R_u^{-1} R_p$$ has
        $n_u \times n_p$ entries. Both factors are sparse; it is dense: element $e$ moves every node behind it, by the
        same amount, and none before it.</p>""",
    "parentheses": r"""<h2>5. Two ways to put the parentheses</h2><p>$$\frac{dJ}{dp} = J_p - J_u^T
        \left(R_u^{-1} R_p\right) = J_p - \left(J_u^T R_u^{-1}\right) R_p.$$ The first takes a linear solve for
        every parameter, the second one solve with $R_u^T$. Counted by the harness:</p>""",
    "adjoint": r"""<h2>6. The adjoint equation</h2><p>$$R_u^T \lambda = -J_u.$$ $\lambda$ is the displacement of the
        same bar, under the residuals $d - S u$ as loads at the sensors.</p>""",
    "product": r"""<h2>7. A product for each element</h2><p>$$\frac{dJ}{dp} = J_p + R_p^T \lambda, \qquad
        \frac{dJ}{dp_e} = A\,L_e\,E_e\;\varepsilon_e(u)\;\varepsilon_e(\lambda).$$ Behind the last sensor the
        adjoint bar carries no force: its strain is 0 and so is the gradient. Those elements are blind.</p>""",
}


class Derivation(Part):
    """State: log2 of the moduli over that of the start, and the nodes with a sensor."""

    slug, title = "derivation", "The discrete adjoint"
    lead = "Change a modulus or a sensor: every number beside every line follows."

    each: ClassVar = {"octaves": (-OCTAVES, OCTAVES), "sensors": (1, N)}
    octaves = param.List([0.0] * N, item_type=float, bounds=(N, N), doc="log2 of E_e / E of the start")
    sensors = param.List([1, 3, 5], item_type=int, bounds=(0, N), doc="nodes")

    @property
    def selector(self) -> str:
        return f"bar[sensors={written(sorted(self.sensors) or [0])}]"

    @property
    def at(self) -> str:
        """p, as --at takes it."""
        return written([LN2 * k for k in self.octaves]) if any(self.octaves) else "start"

    def command(self) -> tuple[str, ...]:
        routes = ("--route", "tangent", "--route", "adjoint")
        at = option("at", self.at) if any(self.octaves) else ()
        return ("run", "--problem", self.selector, *routes, *at, "--gradient", "--no-timing")

    def job(self) -> WithAlgebra:
        return WithAlgebra(Command(self.command(), self.place.folder), self.selector, self.at)

    def content(self) -> pn.Column:
        self._rows: dict[str, dict[str, Any]] = {}
        self._live = {name: pn.pane.HTML("", sizing_mode="stretch_width", min_height=60) for name in LINES}
        x = [(i + 1) / N for i in range(N)]
        self._bar = ColumnDataSource({"x": [0.0, *x], "u": [0.0, *x], "lam": [0.0, *x]})
        self._loads = ColumnDataSource({"x": x, "load": x})
        self._elements = ColumnDataSource({"e": [e + 1 for e in range(N)], "g": x})
        figures = {"adjoint": self._adjoint_bar(), "product": self._products()}
        steps: list[pn.viewable.Viewable] = []
        for name, line in LINES.items():
            steps += [pn.pane.HTML(with_formulas(line), sizing_mode="stretch_width"), self._live[name]]
            steps += [figures[name]] if name in figures else []
        derived = pn.Column(*steps, sizing_mode="stretch_width")
        self.drawn = (derived,)
        return pn.Column(self._controls(), derived, sizing_mode="stretch_width")

    def _controls(self) -> pn.Column:
        sliders = [
            pn.widgets.FloatSlider(
                name=f"E_{e + 1}", start=-OCTAVES, end=OCTAVES, step=0.05, value=k, width=140,
                format=PrintfTickFormatter(format="2^%.2f E_0"),
            )
            for e, k in enumerate(self.octaves)
        ]  # fmt: skip

        def move(_: object) -> None:
            self.octaves = [float(slider.value) for slider in sliders]  # 0 comes as an integer

        for slider in sliders:
            slider.param.watch(move, "value")
        sensors = pn.widgets.CheckButtonGroup.from_param(self.param.sensors, options=[*range(1, N + 1)])
        label = pn.pane.HTML("<p>Sensors at nodes</p>", width=140)
        return pn.Column(pn.FlexBox(*sliders), pn.FlexBox(label, sensors, align_items="center"))

    def _adjoint_bar(self) -> pn.pane.Bokeh:
        drawn = plot("x [L]", "u [m], others scaled", x_range=(0.0, 1.03))
        drawn.line("x", "u", source=self._bar, color=INK, line_width=2, legend_label="u")
        drawn.line("x", "lam", source=self._bar, color=colour("adjoint"), line_width=2, legend_label="λ")
        drawn.scatter("x", "lam", source=self._bar, color=colour("adjoint"), size=6)
        drawn.vbar(
            "x",
            0.015,
            "load",
            source=self._loads,
            color=colour("fd-central"),
            legend_label="loads d - S u",
        )
        return pn.pane.Bokeh(drawn, sizing_mode="stretch_width")

    def _products(self) -> pn.pane.Bokeh:
        drawn = plot("element", "dJ/d log E_e [m2]", hover=[("element", "@e"), ("dJ/d log E", "@g")])
        drawn.vbar("e", 0.8, "g", source=self._elements, color=colour("adjoint"))
        return pn.pane.Bokeh(drawn, sizing_mode="stretch_width")

    def take(self, message: Message) -> None:
        if isinstance(message, Row):
            self._rows[message.value["route"]] = message.value
        elif isinstance(message, Algebra):
            self._draw(message)

    def _draw(self, a: Algebra) -> None:
        nodes = elements = [str(i + 1) for i in range(N)]
        at_sensors = [f"node {i}" for i in a.sensors]
        forward, reverse = (self._rows[name] for name in ("tangent", "adjoint"))
        live = {
            "state": vector("node", a.u, nodes, "$u$ [m]") + f"<p>$|R|$ = {number(float(np.linalg.norm(a.R)))} N</p>",
            "objective": table(
                ["sensor", "$S u$ [m]", "$d$ [m]", "$S u - d$ [m]"],
                [[i, *map(number, row)] for i, *row in zip(at_sensors, a.S_u, a.d, a.S_u - a.d, strict=True)],
            )
            + f"<p>$J$ = {number(a.J)} m<sup>2</sup></p>",
            "chain": f'<div class="row">{matrix("$R_u$ [N/m]", a.R_u)}{matrix("$R_p$ [N]", a.R_p)}</div>',
            "sensitivity": matrix(r"$du/dp$ [m]", a.du_dp),
            "parentheses": table(
                ["route", "forward solves", "linearized solves", "transposed solves", "$dJ/dp_1$ [m<sup>2</sup>]"],
                [
                    [row["route"], *(str(row["work"][k]) for k in WORK), number(row["gradient"][0], 6)]
                    for row in (forward, reverse)
                ],
            ),
            "adjoint": vector("node", a.lam, nodes, "$\\lambda$"),
            "product": table(
                ["element", "$E_e$ [Pa]", *PRODUCT, "<code>routes run</code>"],
                [
                    [e, *map(number, row), number(g, 6)]
                    for e, *row, g in zip(
                        elements, a.E, a.strain, a.strain_adjoint,
                        a.volume * a.E * a.strain * a.strain_adjoint, reverse["gradient"], strict=True,
                    )
                ],
            ),
        }  # fmt: skip
        for name, text in live.items():
            self._live[name].object = with_formulas(text)
        scale, at = np.abs(a.u).max(initial=0.0), a.sensors - 1
        lam, loads = (v * scale / (np.abs(v).max(initial=0.0) or 1.0) for v in (a.lam, -a.J_u))
        self._bar.data = {"x": self._bar.data["x"], "u": [0.0, *a.u], "lam": [0.0, *lam]}
        self._loads.data = {"x": a.sensors / N, "load": loads[at]}
        self._elements.data = {"e": self._elements.data["e"], "g": reverse["gradient"]}
