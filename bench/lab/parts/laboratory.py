"""Any route on any problem: its gradient, its bill, its V-curve, a kink, unrolled iterations."""

from __future__ import annotations

from typing import Any, get_args

import panel as pn
import param

from gradient_routes.bench.execution.isolation.channel import Job
from gradient_routes.bench.execution.isolation.messages import Ended, Message
from gradient_routes.bench.lab import chosen
from gradient_routes.bench.lab.part import Part
from gradient_routes.bench.lab.results import Result
from gradient_routes.bench.lab.results.bill import Bill
from gradient_routes.bench.lab.results.kink import Kink
from gradient_routes.bench.lab.results.unrolling import Unrolling
from gradient_routes.bench.lab.results.vcurve import VCurve
from gradient_routes.bench.lab.running import Running
from gradient_routes.bench.lab.shell import Row
from gradient_routes.problems.contact import StopName
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.faulty_adjoint import Fault

DEFAULT, ALL = "default", "all"
MODES = {
    "gradient": "gradients and their bill",
    "vcurve": "V-curve and verdict",
    "kink": "kink of J(s)",
    "unrolling": "unrolled iterations",
}
RTOL = "1e-12"
TOLERANCES = (RTOL, "1e-10", "1e-8", "1e-6", "1e-4", "1e-3", "1e-2")
SOLVERS = {"auto: direct": "auto", "krylov: ends at rtol": "krylov", "descent: ends at rtol": "descent"}
STEPS = (DEFAULT, *(f"{digit}e-{k}" for k in range(16, 0, -1) for digit in (1, 3)), "1")
ITERATIONS = (DEFAULT, *map(str, (1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 24, 32, 64, 128, 256, 512)))
STOPS = get_args(StopName)
SHORT = ("--points", "17")  # of a sweep
FAULTS = get_args(get_args(Fault)[0])
WRAPPED = ".bk-input-group { flex-wrap: wrap; gap: .1rem .9rem }"
ALWAYS = ("mode", "problem", "options")
OF_ROUTES = {  # controls that are options of some routes
    "step": ("fd-one-sided", "fd-central"),
    "iterations": ("unrolled-ad",),
    "inner": ("unrolled-ad",),
    "fault": ("faulty-adjoint",),
}
SHOWN = {  # in a mode
    "gradient": ("routes", "others", "step", "iterations", "inner", "fault", "rtol", "linear_solver"),
    "vcurve": ("judged", "step", "iterations", "inner", "fault", "rtol", "linear_solver"),
    "kink": ("routes", "tip_stop", "step", "fault", "rtol"),
    "unrolling": ("inner",),
}


class Laboratory(Part):
    """State: what is asked, the problem and its options, the routes and theirs, the solver."""

    slug, title = "laboratory", "Routes to a gradient"
    lead = "Any route on any problem: is its gradient right, and what does it cost?"

    mode = param.Selector(default="gradient", objects=[*MODES])
    problem = param.Selector(default="bar", objects=chosen.names("problem"))
    options = param.String("")
    routes = param.List(["fd-one-sided", "fd-central", "tangent", "adjoint"], item_type=str)
    judged = param.String("adjoint")
    step = param.Selector(default=DEFAULT, objects=[*STEPS])
    iterations = param.Selector(default=DEFAULT, objects=[*ITERATIONS])
    inner = param.Selector(default=DEFAULT, objects=[DEFAULT, "cg", "richardson", "jacobi", "direct"])
    fault = param.Selector(default="sign", objects=[*FAULTS])
    rtol = param.Selector(default=RTOL, objects=[*TOLERANCES])
    linear_solver = param.Selector(default="auto", objects=[*SOLVERS.values()])
    tip_stop = param.Selector(default="penalty", objects=[*STOPS])

    @property
    def at_once(self) -> bool:
        """Gradients of a bar take less than a second."""
        return bool(self.mode == "gradient" and self.problem == "bar")

    # the state as a command

    def command(self) -> tuple[str, ...]:
        match self.mode:
            case "gradient":
                return ("run", *self._of(), *self._named(), *self._solver(), "--gradient", "--no-timing")
            case "vcurve":
                return ("vcurve", *self._of(), "--route", self._route(self.judged), *self._solver())
            case "kink":
                fixed = {"stop": self.tip_stop} if self.problem == "bar" else {}
                return ("kink", *self._of(**fixed), *self._named(), *self._solver(), *SHORT)
            case _:
                inner = () if self.inner == DEFAULT else ("--inner", self.inner)
                return ("unrolling", *self._of(), *inner)

    def _of(self, **fixed: str) -> tuple[str, str]:
        return "--problem", chosen.problem(self.problem, self.options, small=True, **fixed)

    def _named(self) -> list[str]:
        """Every route once: `all` stands for those that it names."""
        if not self.routes:
            raise InputError("no route is chosen - choose one, or several")
        beside = [name for name in self.routes if name != ALL and not (ALL in self.routes and chosen.sound(name))]
        names = [*([ALL] if ALL in self.routes else []), *map(self._route, dict.fromkeys(beside))]
        return [word for name in names for word in ("--route", name)]

    def _route(self, name: str) -> str:
        """With the options of the page."""
        set_here = {
            "fd-one-sided": {"step": self.step},
            "fd-central": {"step": self.step},
            "unrolled-ad": {"inner": self.inner, "iterations": self.iterations},
            "faulty-adjoint": {"fault": self.fault},
        }.get(name, {})
        return chosen.route(name, **{key: value for key, value in set_here.items() if value != DEFAULT})

    def _solver(self) -> list[str]:
        loose = [] if self.rtol == RTOL else ["--rtol", self.rtol]
        return loose + ([] if self.linear_solver == "auto" else ["--linear-solver", self.linear_solver])

    def job(self) -> Job:
        """The mode may be another one when it begins."""
        found = super().job()
        self._next = self.mode
        return found

    @property
    def expected(self) -> int:
        """Rows to come, where that is known."""
        if self.mode != "gradient":
            return 0
        named = self._named()[1::2]
        beside = len([name for name in named if name != ALL])
        return beside + (sum(map(chosen.sound, chosen.applying(self.problem)[0])) if ALL in named else 0)

    # what is seen

    def content(self) -> pn.Column:
        results: dict[str, Result] = {"gradient": Bill(), "vcurve": VCurve(), "kink": Kink(), "unrolling": Unrolling()}
        self._running = Running(self, results)
        self._choosing = False
        self._controls = self._widgets()
        self.param.watch(self._fit, ["mode", "problem", "routes", "judged"])
        self._fit()
        first = [self._controls[name] for name in ALWAYS]
        more = [widget for name, widget in self._controls.items() if name not in ALWAYS]
        above = pn.FlexBox(*first), pn.FlexBox(*more), self._running.panel(), self.status, self.shown
        return pn.Column(*above, *self._running.panels.values(), sizing_mode="stretch_width")

    def _widgets(self) -> dict[str, pn.viewable.Viewable]:
        of, narrow = self.param, {"width": 150}
        look = {"inline": True, "sizing_mode": "stretch_width", "stylesheets": [WRAPPED]}
        self._own, self._others = (
            pn.widgets.CheckBoxGroup(label=name, **look) for name in ("Routes", "By other codes")
        )
        for group in (self._own, self._others):
            group.param.watch(self._choose, "value")
        select = pn.widgets.Select.from_param
        slider = pn.widgets.DiscreteSlider
        return {
            "mode": select(of.mode, label="What", options={words: name for name, words in MODES.items()}, width=210),
            "problem": select(of.problem, label="Problem", width=170),
            "options": pn.widgets.TextInput.from_param(
                of.options, label="Further options of the problem", placeholder="n=16,alpha=1e-3", width=260
            ),
            "routes": self._own,
            "others": pn.Card(
                self._others,
                title="Routes by other codes",
                collapsed=True,
                sizing_mode="stretch_width",
                hide_header=False,
            ),
            "judged": select(of.judged, label="Route", options=[self.judged], **narrow),
            "tip_stop": select(of.tip_stop, label="Stop beyond the tip", **narrow),
            "step": slider.from_param(of.step, label="Step h of differences", options=[*STEPS], width=200),
            "iterations": slider.from_param(
                of.iterations, label="Unrolled iterations", options=[*ITERATIONS], width=200
            ),
            "inner": select(of.inner, label="Iteration on the tape", **narrow),
            "fault": select(of.fault, label="Fault of faulty-adjoint", **narrow),
            "rtol": select(of.rtol, label="Forward solve to rtol", **narrow),
            "linear_solver": select(of.linear_solver, label="Linear solver", options=SOLVERS, width=180),
        }

    def _fit(self, *_: Any) -> None:
        """Show the controls and results of the mode, and the routes that apply to the problem."""
        own, others = chosen.applying(self.problem)
        self._controls["judged"].options = [*dict.fromkeys([*own, *others, self.judged])]
        self._choosing = True
        odd = [name for name in self.routes if name not in (ALL, *own, *others)]  # to be seen, and taken away
        for group, names in ((self._own, [ALL, *own, *odd]), (self._others, others)):
            group.options = names
            group.value = [name for name in self.routes if name in names]
        self._choosing = False
        for name, widget in self._controls.items():
            widget.visible = name in ALWAYS or (name in SHOWN[self.mode] and self._matters(name))
        for name, panel in self._running.panels.items():
            panel.visible = name == self.mode
        self._running.follow()

    def _matters(self, control: str) -> bool:
        """Whether an option of one route is that of a route chosen."""
        of = OF_ROUTES.get(control)
        named = [self.judged] if self.mode == "vcurve" else self.routes
        return of is None or self.mode == "unrolling" or any(name in of or name == ALL for name in named)

    def _choose(self, *_: Any) -> None:
        if not self._choosing:
            self.routes = [*self._own.value, *self._others.value]

    # what comes

    def begin(self) -> None:
        self._running.begin(self._next, self.expected)

    def queue(self, before: int) -> None:
        super().queue(before)
        self._running.waits()

    def take(self, message: Message) -> None:
        if isinstance(message, Row):
            self._running.take(message.value)

    def end(self, end: Ended, code: int) -> None:
        self._running.end()
