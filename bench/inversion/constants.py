"""What the data say of constants as people state them: error bars, correlation, bounds, blind directions, thirds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.inversion.objective import Evaluation
from gradient_routes.bench.inversion.residuals import inliers
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.problem import Array, End, Problem
from gradient_routes.routes.sensitivity import FEW, RANK

FEW_PAIRS = 3  # of which pairs are listed
SEEN = 1e-6  # of a gradient that may lie in a blind direction
STEP = 1e-30  # of complex steps
FAR = 2.0  # natural changes: one Gauss-Newton step that goes on is no estimate
LOCKS = 0.49  # nu above which elements for displacements alone are too stiff
Spread = Callable[[Array], Array]


@dataclass(frozen=True)
class Constants:
    """names, value (k,), sd (k,), nan without a bar; correlation (k, k), nan without bars; remarks, a line each.

    thirds  what each third of the data along their longest extent says alone, by name. They differ by what the model
            leaves out, which error bars do not know.
    bounds  by name, of those at an end of their domain
    shown   whether they are no parameters, which have a table of their own
    """

    names: tuple[str, ...]
    value: Array
    sd: Array
    correlation: Array
    thirds: Mapping[str, tuple[float, ...]]
    bounds: Mapping[str, str]
    remarks: tuple[str, ...]
    shown: bool

    @property
    def described(self) -> list[str]:
        lines = [self._line(i) for i in range(len(self.names))] if self.shown else []
        return [*lines, *self._correlations, *self.remarks]

    def _line(self, i: int) -> str:
        name, apart = self.names[i], ", ".join(f"{third:.4g}" for third in self.thirds.get(self.names[i], ()))
        bar = "without an error bar" if np.isnan(self.sd[i]) else f"+- {self.sd[i]:.2g}"
        return f"{name} {self.value[i]:.4g} {bar}" + (f"; thirds of the data alone: {apart}" if apart else "")

    @property
    def _correlations(self) -> list[str]:
        """Pairs of up to three, else the lower triangle of the matrix."""
        short = [name.partition(" [")[0] for name in self.names]
        C, barred = self.correlation, np.flatnonzero(~np.isnan(self.sd))
        pairs = [(i, j) for i in barred for j in barred if j < i]
        if len(barred) <= FEW_PAIRS:
            said = ", ".join(f"{short[j]} and {short[i]} {C[i, j]:.2f}" for i, j in pairs)
            return [f"correlation of {said}"] if said else []
        wide = max(map(len, short))
        return [
            "correlation:",
            *(f"{short[i]:{wide}}" + "".join(f"{C[i, j]:7.2f}" for j in barred if j <= i) for i in barred),
        ]


def stated(
    problem: Problem,
    found: Evaluation,
    A: Array,
    H: Array,
    seen: Observation,
    sigma: float,
    spread: Spread | None = None,
) -> Constants | None:
    """Those of the problem, else its parameters where they are FEW; A: H with the rows of the prior.

    spread  from P (j, m) to a root (j, k) of what adds to the covariance of P y, beside data with the noise sigma
    """
    p, q = found.p, problem.parameters
    values = problem.stated(p)
    if not values and len(p) > FEW:
        return None
    if values:
        by_x = np.array([[v.imag / STEP for v in problem.stated(p + 1j * STEP * e).values()] for e in np.diag(q.scale)])
        names, value, by_x = tuple(values), np.array([float(v.real) for v in values.values()]), by_x.T
    else:
        names, value, by_x = tuple(q.label(i) for i in range(len(p))), p, np.diag(q.scale)
    ends = problem.ends(p)
    held = [end.i for end in ends]
    free = np.setdiff1d(np.arange(len(p)), held)
    _, s, V = np.linalg.svd(np.linalg.qr(A[:, free], mode="r"), full_matrices=True)
    rank = int(np.count_nonzero(s > RANK * s.max(initial=0.0)))
    V_seen, blind = V[:rank], V[rank:]
    g = by_x[:, free]
    root = (sigma or 1.0) * (g @ V_seen.T) / s[:rank] if rank else np.zeros((len(g), 0))
    if spread is not None:
        by_data = g @ (V_seen.T / s[:rank] ** 2) @ V_seen @ A[: len(H), free].T
        root = np.concatenate([root, spread(by_data)], axis=1)
    size, total = np.linalg.norm(root, axis=1), np.linalg.norm(g, axis=1)
    barred = (np.linalg.norm(g @ blind.T, axis=1) <= SEEN * total) & (size > 0.0)
    bounded = {end.name: end.bound for end in ends}
    gone = {*bounded, *(other for end in ends for other in end.others)}
    barred &= [name.partition(" [")[0] not in gone for name in names]
    sd = np.where(barred & (sigma > 0.0), size, np.nan)
    with np.errstate(invalid="ignore"):
        correlation = np.where(np.outer(barred, barred), (root @ root.T) / np.outer(size, size), np.nan)
    remarks = [_at_bound(end, float(found.gradient[end.i])) for end in ends]
    remarks += [f"blind direction: data do not see {_named(v, [q.label(i) for i in free])}" for v in blind]
    nu = dict(zip(names, value, strict=True)).get("nu", 0.0)
    if nu > LOCKS and getattr(problem, "locks", False):
        remarks.append(f"nu = {nu:.4g} is above {LOCKS}: these elements lock, and are too stiff")
    thirds = {} if ends else _thirds(problem, p, H, q.scale, seen)
    return Constants(names, value, sd, correlation, thirds, bounded, tuple(remarks), bool(values))


def _at_bound(end: End, slope: float) -> str:
    """`slope`: dJ/dp_i, whose sign is that of the derivative by the constant."""
    says = "the data want it beyond" if (slope < 0.0) == end.up else "J is least before it"
    less = "<" if slope < 0.0 else ">"
    return (
        f"{end.name} is at its bound, {end.bound}: dJ/d{end.name} {less} 0, {says}; error bars of the others are with"
        " it held"
    )


def _named(v: Array, labels: Sequence[str]) -> str:
    """A direction as a sum of parameters, in their natural changes."""
    v = v * np.sign(v[np.abs(v).argmax()])
    return " ".join(f"{c:+.2g} {label}" for c, label in zip(v, labels, strict=True) if abs(c) > 0.01).lstrip("+")


def _thirds(problem: Problem, p: Array, H: Array, scale: Array, seen: Observation) -> dict[str, tuple[float, ...]]:
    """One Gauss-Newton step from the answer for each third, with a motion of its own where that is unknown, without
    outliers.
    """
    x = seen.position
    if x is None or not problem.stated(p) or len(x) < 6 * len(p):
        return {}
    along = x[:, int(np.nanargmax(np.nanmax(x, axis=0) - np.nanmin(x, axis=0)))]
    third = np.digitize(along, np.linspace(np.nanmin(along), np.nanmax(along), 4)[1:-1])
    r, found = seen.predicted - seen.data, []
    kept = inliers(np.abs(r), seen.sigma)
    for k in range(3):
        rows = ((third == k) | np.isnan(along)) & kept  # what has no position, a force, belongs to each
        A, b = H[rows], -r[rows]
        if seen.modes is not None:
            Q, _ = np.linalg.qr(seen.modes[rows])
            A, b = A - Q @ (Q.T @ A), b - Q @ (Q.T @ b)
        if len(b) <= len(p) or np.linalg.matrix_rank(A) < len(p):
            return {}
        step = np.linalg.lstsq(A, b, rcond=None)[0]
        if np.abs(step).max() > FAR:
            return {}
        found.append(problem.stated(p + scale * step))
    return {name: tuple(float(of[name]) for of in found) for name in found[0]}
