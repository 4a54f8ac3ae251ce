"""Colours: a route has the same one everywhere, told apart by the colour-blind (Okabe & Ito 2008)."""

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


def route_style(name: str) -> str:
    """The rich style of a route; plug-ins have none of their own."""
    return ROUTES.get(name, "")
