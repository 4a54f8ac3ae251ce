"""Data of one's own: a CSV file is dropped, parameters are estimated, the result is taken along."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from typing import Any

import panel as pn
import param

from gradient_routes.bench.execution.isolation.channel import Job
from gradient_routes.bench.execution.isolation.messages import Ended, Message
from gradient_routes.bench.lab import chosen, upload
from gradient_routes.bench.lab.part import Part
from gradient_routes.bench.lab.results.estimates import Inversion
from gradient_routes.bench.lab.results.identified import Identified
from gradient_routes.bench.lab.running import Running
from gradient_routes.bench.lab.shell import Row
from gradient_routes.problems.errors import InputError

MODES = {"invert": "estimate the parameters", "identify": "what the data determine"}
PROBLEMS = ("bar", "plate", "rod", "coupon", "block", "heat", "vibrating-bar")  # that take data from files
OPTIMIZERS = ("lbfgs", "gauss-newton", "levenberg-marquardt", "trust")
ESTIMATES = "estimates.csv"  # what the command writes
DROP = """.filepond--root, .filepond--drop-label { background: transparent !important; color: var(--ink) !important }
.filepond--root { border: 1px dashed var(--edge); border-radius: 5px } .filepond--panel-root { background: var(--wash) }
.filepond--credits { display: none }"""
EXAMPLE, READINGS = "bar_readings.csv", "node,displacement\n1,0.0908\n2,0.1796\n3,0.3256\n4,0.4408\n5,0.5457\n"


class OwnData(Part):
    """State: what is asked, the problem and its options, the file by its name, its noise, units and columns."""

    slug, title = "own-data", "Your own data"
    lead = "Drop a CSV file of displacements: what do they say of the moduli, and how well?"

    mode = param.Selector(default="invert", objects=[*MODES])
    problem = param.Selector(default="bar", objects=[*PROBLEMS])
    options = param.String("")
    data = param.String("")
    noise = param.String("")
    units = param.String("")
    columns = param.String("")
    optimizer = param.Selector(default="lbfgs", objects=[*OPTIMIZERS])

    @property
    def at_once(self) -> bool:
        """A bar takes less than a second."""
        return bool(self.problem == "bar")

    def command(self) -> tuple[str, ...]:
        if not self.data:
            raise InputError("no data yet - drop a CSV file above, or try the example")
        if self.data != upload.plain(self.data):
            raise InputError(f"data={self.data[:60]} is no plain name of a file - drop the file above")
        fixed = {"data": self.data} | ({"noise": self.noise} if self.noise else {})
        if odd := next((v for v in (self.noise,) if any(sign in v for sign in ",|[]=/\\")), None):
            raise InputError(f"noise {odd} is no number with a unit - write 1e-3 or 0.4um")
        of = chosen.problem(self.problem, self.options, **fixed)
        read = [(name, getattr(self, name)) for name in ("columns", "units") if getattr(self, name)]
        reading = [word for name, value in read for word in (f"--{name}", value)]
        if self.mode == "identify":
            return ("identify", "--problem", of, *reading)
        how = () if self.optimizer == "lbfgs" else ("--optimizer", self.optimizer)
        return ("invert", "--problem", of, *reading, *how, "-o", ESTIMATES)

    def job(self) -> Job:
        """What an earlier one has written is not offered as that of this one; the mode may change before it begins."""
        found = super().job()
        self._estimates().unlink(missing_ok=True)
        self._next = self.mode
        return found

    # what is seen

    def content(self) -> pn.Column:
        self._running = Running(self, {"invert": Inversion(), "identify": Identified()})
        self._take_along = pn.widgets.FileDownload(
            callback=self._estimates, filename=ESTIMATES, label="Estimates as CSV", embed=False, auto=True, width=200,
            disabled=True,
        )  # fmt: skip
        example = pn.widgets.FileDownload(
            callback=lambda: StringIO(READINGS), filename=EXAMPLE, label="An example to drop", embed=False, auto=True,
            width=200,
        )  # fmt: skip
        self._dropped = pn.widgets.FileDropper(
            multiple=False, max_file_size=f"{upload.MOST // 2**20}MB", label="CSV file", sizing_mode="stretch_width",
            max_width=460, stylesheets=[DROP],
        )  # fmt: skip
        self._dropped.param.watch(self._keep, "value")
        self._optimizer = pn.widgets.Select.from_param(self.param.optimizer, label="Optimizer", width=150)
        self.param.watch(self._fit, ["mode", "problem", "data"])
        self._fit()
        return pn.Column(
            pn.FlexBox(self._dropped, example), pn.FlexBox(*self._widgets(), self._optimizer), self._running.panel(),
            self.status, self.shown, *self._running.panels.values(), self._take_along, sizing_mode="stretch_width",
        )  # fmt: skip

    def _widgets(self) -> list[pn.widgets.Widget]:
        of = self.param
        select, field = pn.widgets.Select.from_param, pn.widgets.TextInput.from_param
        return [
            select(of.mode, label="What", options={words: name for name, words in MODES.items()}, width=210),
            select(of.problem, label="Problem", width=150),
            field(of.noise, label="Noise, standard deviation", placeholder="1e-3 or 0.4um", width=180),
            field(of.units, label="Units, where not in the header", placeholder="mm, or x=mm,ux=um", width=200),
            field(of.columns, label="Columns, where not by header", placeholder="x=NAME,ux=NAME", width=200),
            field(of.options, label="Further options of the problem", placeholder="n=8,length=250mm", width=260),
        ]

    def _fit(self, *_: Any) -> None:
        self._optimizer.visible = self.mode == "invert"
        for name, panel in self._running.panels.items():
            panel.visible = name == self.mode and bool(self.data)
        self._take_along.visible = self.mode == "invert" and bool(self.data)
        self._running.follow()

    def _keep(self, event: Any) -> None:
        """A file was dropped, or taken away."""
        if not event.new:
            self.data = ""
        for name, content in event.new.items():
            try:
                kept = upload.keep(self.place.folder, name, content)
            except InputError as error:
                self.say(str(error))
            else:
                self.data = kept
                self.start()

    def _estimates(self) -> Path:
        return self.place.folder / ESTIMATES

    # what comes

    def begin(self) -> None:
        self._take_along.disabled = True
        self._running.begin(self._next)

    def queue(self, before: int) -> None:
        super().queue(before)
        self._running.waits()

    def take(self, message: Message) -> None:
        if isinstance(message, Row):
            self._running.take(message.value)

    def end(self, end: Ended, code: int) -> None:
        self._running.end()
        self._take_along.disabled = not self._estimates().is_file()
