"""Contact of the tip of the bar with a stop: exact (Signorini), penalty and smoothed penalties.

g = u_N - gap is the penetration [m], q >= 0 the contact force [N] added to R at node N. Exact contact is
g <= 0, q >= 0, g q = 0; the other laws are functions q(g) that allow g > 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol

import numpy as np

from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.matrices.tridiagonal import BorderedTridiagonal, Tridiagonal, add_to_last
from gradient_routes.problems.problem import Array, Structure

StopName = Literal["none", "penalty", "softplus", "quadratic", "multiplier"]
GAP, K_C, STOP_WIDTH = 0.8, 100.0, 0.01  # [m], the tip at E = 1 moves by 1 m; [N/m]; [m]


class ContactLaw(Protocol):
    """q(g), convex, nondecreasing and >= the penalty law; for complex g the real part selects the branch.

    k_c [N/m] is the stiffness for large g. xp: numpy or jax.numpy.
    """

    @property
    def k_c(self) -> float: ...

    def force(self, g: Any, xp: Any = np) -> Any:
        """q [N]."""
        ...

    def stiffness(self, g: Any) -> Any:
        """k = dq/dg [N/m]."""
        ...

    def energy(self, g: Any) -> Any:
        """The integral of q from -inf to g [J], g real."""
        ...

    def active_set(self, g: Any) -> str | None:
        """open or closed; None for continuously differentiable q."""
        ...


@dataclass(frozen=True)
class Penalty:
    """q = k_c max(0, g)."""

    k_c: float

    def force(self, g: Any, xp: Any = np) -> Any:
        return xp.where(g.real > 0.0, self.k_c * g, 0.0)

    def stiffness(self, g: Any) -> Any:
        return np.where(g.real > 0.0, self.k_c, 0.0)[()]

    def energy(self, g: Any) -> Any:
        return 0.5 * self.k_c * np.maximum(g, 0.0) ** 2

    def active_set(self, g: Any) -> str | None:
        return "closed" if g.real > 0.0 else "open"


@dataclass(frozen=True)
class Softplus:
    """q = k_c w log(1 + exp(g / w)) with the width w: q > 0 everywhere, at most k_c w log 2 above the penalty."""

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
        e = np.exp(np.where(x.real > 0.0, -x, x))
        return (self.k_c * np.where(x.real > 0.0, 1.0, e) / (1.0 + e))[()]

    def energy(self, g: Any) -> Any:
        """-k_c w^2 Li_2(-exp(x)), x = g / w; beyond 0 by Li_2(-exp(x)) + Li_2(-exp(-x)) = -pi^2 / 6 - x^2 / 2."""
        from scipy.special import spence  # Li_2(1 - z)

        x = g / self.width
        below = -spence(1.0 + np.exp(-np.abs(x)))
        return self.k_c * self.width**2 * np.where(x > 0.0, np.pi**2 / 6.0 + x**2 / 2.0 - below, below)

    def active_set(self, g: Any) -> str | None:
        return None


@dataclass(frozen=True)
class Quadratic:
    """The penalty with q = k_c (g + w)^2 / (4 w) for |g| <= w, the width: once differentiable."""

    k_c: float
    width: float

    def force(self, g: Any, xp: Any = np) -> Any:
        w = self.width
        rounded = xp.where(g.real < -w, 0.0, self.k_c * (g + w) ** 2 / (4.0 * w))
        return xp.where(g.real > w, self.k_c * g, rounded)

    def stiffness(self, g: Any) -> Any:
        w = self.width
        return np.where(g.real < -w, 0.0, np.where(g.real > w, self.k_c, self.k_c * (g + w) / (2.0 * w)))[()]

    def energy(self, g: Any) -> Any:
        w = self.width
        rounded = np.maximum(g + w, 0.0) ** 3 / (12.0 * w)
        return self.k_c * np.where(g > w, 0.5 * g**2 + w**2 / 6.0, rounded)

    def active_set(self, g: Any) -> str | None:
        return None


@dataclass(frozen=True)
class CompliantStop:
    """A stop with the contact law q(g): R = K u - f + q(g) e_N, R_u = K + k e_N e_N^T.

    gap [m] of the unloaded bar; < 0: the stop presses on it. n_multipliers is the number of unknowns added to u.
    """

    gap: float
    law: ContactLaw
    n_multipliers: ClassVar[int] = 0
    structure: ClassVar[Structure] = "spd"

    @property
    def vanishes_when_open(self) -> bool:
        """Whether q = 0 exactly for g far below 0."""
        return not isinstance(self.law, Softplus)

    def residual(self, R: Any, u: Any, xp: Any = np) -> Any:
        """R(u, p), (N + n_multipliers,), from R (N,) of the bar without stop."""
        return add_to_last(R, self.law.force(u[-1] - self.gap, xp), xp)

    def tangent(self, D: Array, u: Array) -> Tridiagonal:
        """R_u for a bar with the spring constants D (N,)."""
        return Tridiagonal(D, self.law.stiffness(u[-1] - self.gap))

    def in_contact(self, u: Array) -> bool:
        """Whether dq/dg != 0."""
        return bool(self.law.stiffness(u[-1] - self.gap) != 0.0)

    def active_set(self, u: Array) -> str | None:
        return self.law.active_set(u[-1] - self.gap)

    def equilibrium(self, g_0: Any, C: Any) -> tuple[Any, Any, Any]:
        """g, q and kappa = k / (1 + k C) in equilibrium with a bar of compliance C [m/N]; g_0 is g without the stop.

        g + C q(g) = g_0, hence dq/dC = kappa (F - q) under the load F. Newton's method from the solution of the penalty
        law decreases monotonically to g, as q is convex and not below the penalty.
        """
        g, g_next = np.inf, g_0 / (1.0 + C * self.law.k_c) if g_0 > 0.0 else g_0
        while g_next < g:
            g, k = g_next, self.law.stiffness(g_next)
            g_next = (g_0 + C * (k * g - self.law.force(g))) / (1.0 + C * k)
        q = self.law.force(g) if k * C < 1.0 else (g_0 - g) / C  # the formula with less cancellation
        return g, q, k / (1.0 + C * k)


@dataclass(frozen=True)
class RigidStop:
    """Exact contact with a multiplier lam [N], the last entry of the state, equal to q at the solution.

    R is the gradient of the augmented Lagrangian Pi(u) + (max(0, lam + c g)^2 - lam^2) / (2 c) (Rockafellar 1973):

        (K u - f + max(0, lam + c g) e_N,  (max(0, lam + c g) - lam) / c)

    Newton's method for it is the primal-dual active set method (Hintermueller, Ito & Kunisch 2002); with one node it
    ends after at most three steps for any start and any c > 0 [N/m].
    """

    gap: float
    c: float = 1.0
    n_multipliers: ClassVar[int] = 1
    structure: ClassVar[Structure] = "symmetric"
    vanishes_when_open: ClassVar[bool] = True

    def _trial_force(self, u: Any) -> Any:
        """lam + c g."""
        return u[-1] + self.c * (u[-2] - self.gap)

    def residual(self, R: Any, u: Any, xp: Any = np) -> Any:
        pressing = self._trial_force(u)
        closed = pressing.real > 0.0
        missed = xp.where(closed, u[-2:-1] - self.gap, -u[-1:] / self.c)
        return xp.concatenate([add_to_last(R, xp.where(closed, pressing, 0.0), xp), missed])

    def tangent(self, D: Array, u: Array) -> BorderedTridiagonal:
        return BorderedTridiagonal(D, self.c, self.in_contact(u))

    def in_contact(self, u: Array) -> bool:
        return bool(self._trial_force(u).real > 0.0)

    def active_set(self, u: Array) -> str | None:
        return "closed" if self.in_contact(u) else "open"

    def equilibrium(self, g_0: Any, C: Any) -> tuple[Any, Any, Any]:
        """The limit of CompliantStop.equilibrium for k_c to infinity."""
        return (0.0 * C, g_0 / C, 1.0 / C) if g_0 > 0.0 else (g_0, 0.0 * C, 0.0 * C)


Stop = CompliantStop | RigidStop


def make_stop(kind: StopName, gap: float, k_c: float, width: float, who: str, default: float = GAP) -> Stop | None:
    """The stop for these options, None for kind=none. Raises InputError for invalid options, and for unused ones unless
    they are the defaults, `default` of the gap.
    """
    smooth = kind in ("softplus", "quadratic")
    check_applies(
        who,
        ("stop=penalty, say", kind != "none", True, {"gap": gap != default}),
        ("stop=penalty, softplus or quadratic", kind == "penalty" or smooth, True, {"k_c": k_c != K_C}),
        ("stop=softplus or quadratic", smooth, True, {"width": width != STOP_WIDTH}),
    )
    if not math.isfinite(gap):
        raise InputError(f"{who}: gap={gap:g} - a distance is finite, < 0 where the stop reaches into the bar")
    for name, value in (("k_c", k_c), ("width", width)):
        if not 0.0 < value < math.inf:
            raise InputError(f"{who}: {name}={value:g} - choose a finite {name} > 0")
    if kind == "none":
        return None
    if kind == "multiplier":
        return RigidStop(gap)
    laws: dict[str, ContactLaw] = {
        "penalty": Penalty(k_c),
        "softplus": Softplus(k_c, width),
        "quadratic": Quadratic(k_c, width),
    }
    return CompliantStop(gap, laws[kind])
