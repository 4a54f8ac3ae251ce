"""One colour, marker and dash for a name, the same in every figure: routes have theirs, others get them in turn."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from hashlib import blake2b

from gradient_routes.bench.cases.selector import bare
from gradient_routes.bench.render.terminal.palette import ROUTES

MARKERS = {  # as Vega names them
    "fd-one-sided": "triangle-down",
    "fd-central": "triangle-up",
    "complex-step": "diamond",
    "tangent": "square",
    "adjoint": "circle",
    "unrolled-ad": "cross",
    "implicit-ad": "triangle-right",
}
# Tol's muted palette (2021), told apart by the colour-blind; none of it is a route's
OTHERS = ("#332288", "#882255", "#999933", "#44AA99", "#AA4499", "#117733", "#DDCC77", "#661100")
SHAPES = ("circle", "triangle-down", "triangle-right", "cross", "diamond", "square", "triangle-up", "triangle-left")
DASHES = ((1, 0), (6, 3), (2, 3), (8, 3, 2, 3), (12, 4), (4, 2, 1, 2))
PAPER, NIGHT = "#ffffff", "#14171a"
INK, SOFT, FAINT = "#1b1f24", "#596069", "#e4e7ea"
AT_NIGHT = {PAPER: NIGHT, INK: "#e6e9ec", SOFT: "#a0a8b1", FAINT: "#262b31"}
CONTRAST = 3.0  # of marks on what is behind them (WCAG 2.1, 1.4.11)


@dataclass(frozen=True)
class Style:
    """How a series looks: its colour as declared, on paper and at night; dashes tell variants."""

    colour: str
    marker: str = "circle"
    dash: tuple[int, ...] = DASHES[0]

    @property
    def light(self) -> str:
        return readable(self.colour, PAPER)

    @property
    def dark(self) -> str:
        return readable(self.colour, NIGHT)


GREY = Style("#4a5058")


def of_route(name: str) -> Style:
    """That of a route; of one that is not built in, the same in every report."""
    if name in ROUTES:
        return Style(ROUTES[name], MARKERS[name])
    digest = blake2b(name.encode("utf-8", "backslashreplace"), digest_size=2).digest()
    return Style(OTHERS[digest[0] % len(OTHERS)], SHAPES[digest[1] % len(SHAPES)])


def of_routes(names: Iterable[str]) -> dict[str, Style]:
    """Variants of one route have its colour, and dashes of their own."""
    found: dict[str, Style] = {}
    variants: dict[str, int] = {}
    for name in dict.fromkeys(names):
        k = variants[bare(name)] = variants.get(bare(name), -1) + 1
        found[name] = replace(of_route(bare(name)), dash=DASHES[k % len(DASHES)])
    return found


def others(names: Iterable[str]) -> dict[str, Style]:
    """Of what is no route, in the order given."""
    unique = list(dict.fromkeys(names))
    n = len(OTHERS)
    return {name: Style(OTHERS[k % n], SHAPES[k % n], DASHES[k // n % len(DASHES)]) for k, name in enumerate(unique)}


def readable(colour: str, background: str) -> str:
    """The colour, mixed with black or white as far as the background needs."""
    towards = 0.0 if luminance(background) > 0.5 else 1.0
    red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    for percent in range(0, 101, 2):
        mixed = [channel + (towards - channel) * percent / 100.0 for channel in (red, green, blue)]
        found = "#" + "".join(f"{round(255 * channel):02x}" for channel in mixed)
        if contrast(found, background) >= CONTRAST:
            return found
    return colour


def contrast(one: str, other: str) -> float:
    """WCAG 2.1: 1 to 21."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def luminance(colour: str) -> float:
    channels = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
