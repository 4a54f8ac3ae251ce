"""Buttons for what takes longer: run, stop, and how far it is."""

from __future__ import annotations

from html import escape

import panel as pn

from gradient_routes.bench.lab.part import Part

FEW = 20  # rows that are told one by one


class Running:
    """Run and Stop of a part, and a bar that moves as rows come: of so many, where that is known."""

    def __init__(self, part: Part) -> None:
        self._part = part
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

    def leave(self) -> None:
        """What is drawn is not of the state of the part any more."""
        self._part.say("changed: press Run to compute it", bad=False)

    def waits(self) -> None:
        self.stop.disabled = False

    def begin(self, rows: int = 0) -> None:
        """A job begins; `rows` are expected, 0: nobody knows."""
        self.stop.disabled = False
        self._of, self._come = rows, 0
        self._show("running")

    def row(self) -> None:
        """One has come."""
        self._come += 1
        if self._come < FEW or self._come % FEW == 0:
            self._show("")

    def end(self) -> None:
        self.stop.disabled = True
        self.progress.object = ""

    def _show(self, word: str) -> None:
        known = f'max="{self._of}" value="{self._come}"' if self._of else ""
        rows = "row" if self._come == 1 else "rows"
        said = word or (f"{self._come} of {self._of} {rows}" if self._of else f"{self._come} {rows}")
        self.progress.object = f'<p><progress aria-label="{escape(said)}" {known}></progress> {said}</p>'
