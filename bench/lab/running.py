"""A command that takes longer: buttons to run and stop it, how far it is, its rows as they come."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import panel as pn

from gradient_routes.bench.lab.part import Part
from gradient_routes.bench.lab.results import Result

FEW = 20  # rows that are told one by one


class Running:
    """Run and Stop of a part, a bar that moves as rows come, and what is drawn of them, by what was asked.

    What was drawn before stays until the first row, or the end.
    """

    def __init__(self, part: Part, results: Mapping[str, Result]) -> None:
        self._part, self._results = part, results
        self.panels = {name: result.panel() for name, result in results.items()}
        part.drawn = (*self.panels.values(),)
        self._fresh, self._drawn = False, ""
        self.run = pn.widgets.Button(label="Run", color="primary", width=90, on_click=lambda _: part.start())
        self.stop = pn.widgets.Button(label="Stop", width=90, disabled=True, on_click=lambda _: part.stop())
        self.progress = pn.pane.HTML("", width=330)
        self._of, self._come = 0, 0
        self.follow()

    def panel(self) -> pn.FlexBox:
        return pn.FlexBox(self.run, self.stop, self.progress, align_items="center", gap="0.6rem")

    def follow(self) -> None:
        """The state has changed: where changes are computed at once, there is nothing to press."""
        self.run.visible = self.stop.visible = not self._part.at_once

    def waits(self) -> None:
        self.stop.disabled = False

    def begin(self, asked: str, rows: int = 0) -> None:
        """A job begins; `rows` are expected, 0: nobody knows."""
        self.stop.disabled = False
        self._fresh, self._drawn = True, asked
        self._of, self._come = rows, 0
        self._show("running")

    def take(self, row: dict[str, Any]) -> None:
        """A row has come."""
        self._renew().take(row)
        self._come += 1
        if self._come < FEW or self._come % FEW == 0:
            self._show("")

    def end(self) -> None:
        self._renew().close()
        self.stop.disabled = True
        self.progress.object = ""

    def _renew(self) -> Result:
        result = self._results[self._drawn]
        if self._fresh:
            result.clear()
            self._fresh = False
        return result

    def _show(self, word: str) -> None:
        known = f'max="{self._of}" value="{self._come}"' if self._of else ""
        rows = "row" if self._come == 1 else "rows"
        said = word or (f"{self._come} of {self._of} {rows}" if self._of else f"{self._come} {rows}")
        self.progress.object = f'<p><progress aria-label="{escape(said)}" {known}></progress> {said}</p>'
