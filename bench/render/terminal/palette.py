"""Colour and mark of each route, distinguishable by the colour-blind (Okabe & Ito 2008)."""

from __future__ import annotations

ROUTES = {
    "fd-one-sided": "#E69F00",
    "fd-central": "#D55E00",
    "complex-step": "#56B4E9",
    "tangent": "#009E73",
    "adjoint": "#0072B2",
    "unrolled-ad": "#CC79A7",
    "implicit-ad": "#F0E442",
}

MARKS = {
    "fd-one-sided": "1",
    "fd-central": "2",
    "complex-step": "C",
    "tangent": "T",
    "adjoint": "A",
    "unrolled-ad": "U",
    "implicit-ad": "I",
}  # in plots


def route_style(name: str) -> str:
    """The rich style of a route; none for plug-ins."""
    return ROUTES.get(name, "")
