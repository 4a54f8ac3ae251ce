"""J in treads, as after rounding inside: steps smaller than a tread see another slope than J has.

Differences of J at equal distances tell noise from smoothness (Hamming 1973, chapter 6; More & Wild 2011): those of a
smooth J shrink from one order to the next, those of treads do not.
"""

from __future__ import annotations

import math

import numpy as np

from gradient_routes.bench.verification.guarded import Guarded
from gradient_routes.bench.verification.lines import Line
from gradient_routes.bench.verification.quotients import Quotients
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

POINTS = 11
ORDERS = 3  # orders of differences whose noise must be alike
ALIKE = 4.0  # ratio of noises that are
THIRD = 3  # order of differences of which a kink changes two, a jump three
FEW, LEAST = 0.35, 0.5  # quantile of them, and the noises it is at least: 2 where they are normal
GONE = 0.1
ABRUPT = 300.0  # growth between two steps of what departs from a slope: a smooth J departs by 10 to 100
ROUNDINGS = 30.0  # roundings of J below which a departure is none


def tread_noise(J: Guarded, subject: Subject, line: Line, h: float) -> float | None:
    """Standard deviation of J between p + h v and p + 2 h v, None where J is smooth there or has no value.

    Eleven calls, behind p where the points ahead are outside the bounds.
    """
    t = h * (1.0 + np.arange(POINTS) / (POINTS - 1))
    for side in (1.0, -1.0):
        points = [subject.p + side * each * line.v for each in t]
        if all(map(subject.inside, points)) and J.left() >= POINTS:
            return difference_noise(np.array([J(q) for q in points]))
    return None


def difference_noise(values: Array) -> float | None:
    """The noise of values at equal distances (m,), None where their differences do not show one."""
    if not np.isfinite(values).all():
        return None
    noises, signs = [], []
    for order in range(1, len(values) - 2):
        differences = np.diff(values, order)
        unit = math.factorial(order) ** 2 / math.factorial(2 * order)
        noises.append(math.sqrt(unit * float(np.mean(differences**2))))
        signs.append(bool((differences > 0).any() and (differences < 0).any()))
    for k in range(len(noises) - ORDERS + 1):
        some = noises[k : k + ORDERS]
        if signs[k] and min(some) > 0.0 and max(some) <= ALIKE * min(some):
            return some[0] if _everywhere(values, some[0]) else None
    return None


def _everywhere(values: Array, noise: float) -> bool:
    """Whether most differences have this noise: a kink or a jump among the points makes few of them large."""
    third = np.abs(np.diff(values, THIRD))
    return bool(np.quantile(third, FEW) >= LEAST * noise)


def abrupt(q: Quotients, small: float, large: float, eps: float) -> bool:
    """Whether J leaves its slope at small steps at once, on one side at least: smooth J do so by degrees.

    small, large: the slopes at small and at large steps, less the gradient's. Where the quotients have gone a tenth of
    the way between them the departure of J, which then is their difference times h, is compared with smaller steps.
    """
    least = ROUNDINGS * eps * abs(q.J) or np.finfo(np.float64).tiny
    for dJ, s in ((q.J_plus - q.J, q.s_plus), (q.J - q.J_minus, q.s_minus)):
        away = np.abs(dJ / q.h - s - small) * q.h
        known = np.isfinite(away)
        away, h = away[known], q.h[known]
        gone = np.flatnonzero((away >= GONE * abs(large - small) * h) & (away > ABRUPT * least))
        if gone.size and gone[0] > 0 and away[gone[0]] > ABRUPT * max(away[: gone[0]].max(), least):
            return True
    return False
