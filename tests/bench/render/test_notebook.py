"""Results in a notebook: what they say, pictures that load nothing, numbers; the same at every execution."""

from __future__ import annotations

import base64
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from commands import ROOT

from gradient_routes import check, identify, invert, vcurve
from gradient_routes.bench.render import notebook

PICTURE = re.compile(r"src='data:image/svg\+xml;base64,([^']+)'")
DATA = ROOT / "examples" / "bar_displacements.csv"
MADE = {
    "vcurve": lambda: vcurve("bar[n=3,sensors=2]", per_decade=2),
    "check": lambda: check(lambda p: p @ p, lambda p: -2 * p, start=np.ones(2), name="<b>mine</b>"),
    "invert": lambda: invert("bar[n=3,sensors=2]", optimizer="gauss-newton"),
    "measured": lambda: invert(f"bar[data={DATA},noise=0.001,alpha=1e-3]", optimizer="gauss-newton"),
    "identify": lambda: identify("bar[n=3,sensors=2]", noise=0.01),
    "cells": lambda: identify("plate[n=2,derivatives=hand]", noise=0.01),
}
SAYS = {
    "vcurve": ("<span class='verdict good'>agrees</span>", "Next: use the gradient"),
    "check": ("<span class='verdict bad'>wrong-gradient</span>", "&lt;b&gt;mine&lt;/b&gt;", "Wrong components"),
    "invert": ("converged", "forward solves", "1 of 3 blind", "truth"),
    "measured": ("<span class='verdict unsure'>misfit exceeds noise</span>", "note: misfit exceeds noise: residuals"),
    "identify": ("2 of 3 directions identifiable", "1 blind", "null share"),
    "cells": ("directions identifiable", "null share"),
}


@pytest.mark.parametrize("what", MADE)
def test_results_show_themselves(what: str) -> None:
    found = MADE[what]()
    shown = found._repr_html_()
    for words in SAYS[what]:
        assert words in shown
    pictures = [ET.fromstring(base64.b64decode(code)) for code in PICTURE.findall(shown)]
    assert pictures
    assert all(picture.tag.endswith("svg") for picture in pictures)
    assert not re.search(r"<b>mine|<script|https?:|seconds", shown)
    if what != "cells":  # Vega counts gradients of legends on, in one process
        assert shown == found._repr_html_()
    assert " at 0x" not in repr(found)


def test_pictures_keep_labels_and_round_places_only() -> None:
    (code,) = PICTURE.findall(vcurve("bar[n=2]", steps=(1e-4, 1.0), per_decade=2)._repr_html_())
    drawn = base64.b64decode(code).decode()
    assert ">0.001</text>" in drawn
    assert not re.search(r"translate\([^)]*\.\d\d", drawn)


def test_without_vl_convert_a_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "find_spec", lambda name: None)
    shown = MADE["identify"]()._repr_html_()
    assert "pip install 'gradient-routes[pictures]'" in shown
    assert "<img" not in shown
    assert "2 of 3 directions identifiable" in shown
