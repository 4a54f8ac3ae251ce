"""A stop beyond the tip of the bar: laws of the contact force that pushes the tip back, exact and smoothed.

g = u_N - gap is the penetration [m], q >= 0 the force [N] that R gains at node N. Exact contact (Signorini) is
g <= 0, q >= 0, g q = 0; the other laws are functions q(g) that let the tip go beyond the gap.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol

import numpy as np

from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.matrices.tridiagonal import Bordered, Chain, at_last
from gradient_routes.problems.problem import Array, Structure

StopName = Literal["none", "penalty", "softplus", "quadratic", "multiplier"]
GAP, K_C, WIDTH = 0.8, 100.0, 0.01  # [m] the bar at E = 1 reaches 1; [N/m]; [m]


class Law(Protocol):
    """q(g), convex, increasing and nowhere below the penalty; the real part of a complex g chooses the branch.

    k_c [N/m] is the stiffness far beyond the gap. xp: numpy or jax.numpy.
    """

    @property
    def k_c(self) -> float: ...

    def force(self, g: Any, xp: Any = np) -> Any:
        """q [N]."""
        ...

    def stiffness(self, g: Any) -> Any:
        """k = dq/dg [N/m]."""
        ...

    def branch(self, g: Any) -> str | None:
        """The active set; None where q is continuously differentiable."""
        ...


@dataclass(frozen=True)
class Penalty:
    """q = k_c max(0, g)."""

    k_c: float

    def force(self, g: Any, xp: Any = np) -> Any:
        return xp.where(g.real > 0.0, self.k_c * g, 0.0)

    def stiffness(self, g: Any) -> Any:
        return self.k_c if g.real > 0.0 else 0.0

    def branch(self, g: Any) -> str | None:
        return "closed" if g.real > 0.0 else "open"


@dataclass(frozen=True)
class Softplus:
    """q = k_c w log(1 + exp(g / w)), w the width: above the penalty by k_c w log 2 at most, never quite 0."""

    k_c: float
    width: float

    def force(self, g: Any, xp: Any = np) -> Any:
        x = g / self.width
        closed = x.real > 0.0
        e = xp.exp(xp.where(closed, -x, x))  # never overflows
        # log(1 + e) = 2 artanh(e / (2 + e)): NumPy's log1p drops small real parts of complex numbers
        return self.k_c * self.width * (xp.where(closed, x, 0.0) + 2.0 * xp.arctanh(e / (2.0 + e)))

    def stiffness(self, g: Any) -> Any:
        x = g / self.width
        return self.k_c / (1.0 + np.exp(-x)) if x.real > 0.0 else self.k_c * np.exp(x) / (1.0 + np.exp(x))

    def branch(self, g: Any) -> str | None:
        return None


@dataclass(frozen=True)
class Quadratic:
    """The penalty with its kink rounded: q = k_c (g + w)^2 / (4 w) for |g| <= w, the width."""

    k_c: float
    width: float

    def force(self, g: Any, xp: Any = np) -> Any:
        w = self.width
        rounded = xp.where(g.real < -w, 0.0, self.k_c * (g + w) ** 2 / (4.0 * w))
        return xp.where(g.real > w, self.k_c * g, rounded)

    def stiffness(self, g: Any) -> Any:
        w = self.width
        return 0.0 if g.real < -w else self.k_c if g.real > w else self.k_c * (g + w) / (2.0 * w)

    def branch(self, g: Any) -> str | None:
        return None


@dataclass(frozen=True)
class Compliant:
    """A stop that gives way by a law q(g): R = K u - f + q(g) e_N, R_u = K + k e_N e_N^T.

    gap [m] of the unloaded bar; < 0: the stop reaches into it. `multipliers` are the unknowns it adds to the state.
    """

    gap: float
    law: Law
    multipliers: ClassVar[int] = 0
    structure: ClassVar[Structure] = "spd"

    @property
    def fades(self) -> bool:
        """Whether the force is exactly 0 far from the stop."""
        return not isinstance(self.law, Softplus)

    def balance(self, R: Any, u: Any, xp: Any = np) -> Any:
        """R(u, p), (N + multipliers,), from that of the bar alone, R (N,)."""
        return at_last(R, self.law.force(u[-1] - self.gap, xp), xp)

    def tangent(self, D: Array, u: Array) -> Chain:
        """R_u of a bar with the spring constants D (N,)."""
        return Chain(D, self.law.stiffness(u[-1] - self.gap))

    def touched(self, u: Array) -> bool:
        """Whether the tip feels the stop: k != 0."""
        return bool(self.law.stiffness(u[-1] - self.gap) != 0.0)

    def active_set(self, u: Array) -> str | None:
        return self.law.branch(u[-1] - self.gap)

    def in_series(self, g_0: Any, C: Any) -> tuple[Any, Any, Any]:
        """g, q and kappa = k / (1 + k C) of a bar of compliance C [m/N] that would reach g_0 if nothing stopped it.

        g + C q(g) = g_0, hence dq/dC = kappa (F - q) under the load F. By Newton's method from the penalty's g, from
        where it falls to the solution, q being convex and above the penalty.
        """
        g, g_next = np.inf, g_0 / (1.0 + C * self.law.k_c) if g_0 > 0.0 else g_0
        while g_next < g:
            g, k = g_next, self.law.stiffness(g_next)
            g_next = (g_0 + C * (k * g - self.law.force(g))) / (1.0 + C * k)
        q = self.law.force(g) if k * C < 1.0 else (g_0 - g) / C  # where rounding of g matters less
        return g, q, k / (1.0 + C * k)


@dataclass(frozen=True)
class Rigid:
    """Exact contact with a multiplier lam [N], the state's last entry, which is q at the solution.

    R is the gradient of the augmented Lagrangian Pi(u) + (max(0, lam + c g)^2 - lam^2) / (2 c) (Rockafellar 1973):

        (K u - f + max(0, lam + c g) e_N,  (max(0, lam + c g) - lam) / c)

    Newton's method on it is the primal-dual active set method (Hintermueller, Ito & Kunisch 2002); one node's set is
    found in three steps from anywhere, for any c > 0 [N/m].
    """

    gap: float
    c: float = 1.0
    multipliers: ClassVar[int] = 1
    structure: ClassVar[Structure] = "symmetric"
    fades: ClassVar[bool] = True

    def _pressing(self, u: Any) -> Any:
        """lam + c g."""
        return u[-1] + self.c * (u[-2] - self.gap)

    def balance(self, R: Any, u: Any, xp: Any = np) -> Any:
        pressing = self._pressing(u)
        closed = pressing.real > 0.0
        missed = xp.where(closed, u[-2:-1] - self.gap, -u[-1:] / self.c)
        return xp.concatenate([at_last(R, xp.where(closed, pressing, 0.0), xp), missed])

    def tangent(self, D: Array, u: Array) -> Bordered:
        return Bordered(D, self.c, self.touched(u))

    def touched(self, u: Array) -> bool:
        return bool(self._pressing(u).real > 0.0)

    def active_set(self, u: Array) -> str | None:
        return "closed" if self.touched(u) else "open"

    def in_series(self, g_0: Any, C: Any) -> tuple[Any, Any, Any]:
        """The limit of Compliant's as k grows beyond bounds."""
        return (0.0 * C, g_0 / C, 1.0 / C) if g_0 > 0.0 else (g_0, 0.0 * C, 0.0 * C)


Stop = Compliant | Rigid


def stop_of(kind: StopName, gap: float, k_c: float, width: float, who: str) -> Stop | None:
    """The stop that options ask for, or None. Raises InputError for options that it would ignore or cannot take."""
    smooth = kind in ("softplus", "quadratic")
    check_applies(
        who,
        ("stop=penalty, say", kind != "none", True, {"gap": gap != GAP}),
        ("stop=penalty, softplus or quadratic", kind == "penalty" or smooth, True, {"k_c": k_c != K_C}),
        ("stop=softplus or quadratic", smooth, True, {"width": width != WIDTH}),
    )
    if not math.isfinite(gap):
        raise InputError(f"{who}: gap={gap:g} - a distance is finite, < 0 where the stop reaches into the bar")
    for name, value in (("k_c", k_c), ("width", width)):
        if not 0.0 < value < math.inf:
            raise InputError(f"{who}: {name}={value:g} - choose a finite {name} > 0")
    if kind == "none":
        return None
    if kind == "multiplier":
        return Rigid(gap)
    laws: dict[str, Law] = {
        "penalty": Penalty(k_c),
        "softplus": Softplus(k_c, width),
        "quadratic": Quadratic(k_c, width),
    }
    return Compliant(gap, laws[kind])
