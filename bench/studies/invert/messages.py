"""What `routes invert` says, as it finds it."""

from __future__ import annotations

from dataclasses import dataclass

from gradient_routes.bench.inversion.frames import Estimates
from gradient_routes.bench.inversion.history import Iterate
from gradient_routes.bench.inversion.lcurve import Point
from gradient_routes.bench.inversion.linear_map import LinearMap
from gradient_routes.bench.inversion.result import Inversion
from gradient_routes.bench.inversion.tradeoff import Trade


@dataclass(frozen=True)
class Begun:
    """An inversion begins; `truth` tells whether the true p is known, `noise` whether steps are compared with it."""

    title: str
    truth: bool
    noise: bool


@dataclass(frozen=True)
class Taken:
    """A step of it."""

    step: Iterate
    noise: bool


@dataclass(frozen=True)
class Ended:
    """An inversion has ended; `one_shot` is J of the linear least-squares answer, where there is one."""

    inversion: Inversion
    one_shot: float | None


@dataclass(frozen=True)
class Compared:
    """All inversions, to be compared."""

    inversions: list[Inversion]


@dataclass(frozen=True)
class LCurve:
    points: list[Point]
    best: Inversion


@dataclass(frozen=True)
class Trades:
    trades: list[Trade]


@dataclass(frozen=True)
class Mapped:
    """The linear answer to the problem's own data, and the map that gave it."""

    inversion: Inversion
    by: LinearMap


@dataclass(frozen=True)
class Framed:
    """The answers to frames."""

    estimates: Estimates
