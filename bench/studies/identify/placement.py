"""Where to measure next: sensors chosen one by one, each the one that tells most beside those chosen before.

With G the rows of H over sigma and Gamma the covariance before, D-optimal choices maximize log det(I + G Gamma G^T),
A-optimal ones minimize the trace of the covariance after (Chaloner & Verdinelli 1995, Bayesian design). A reading g
changes them by the determinant lemma and by Sherman & Morrison:

    log(1 + g C g^T)      and      |C g^T|^2 / (1 + g C g^T),      C <- C - C g^T g C / (1 + g C g^T)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gradient_routes.bench.inversion import posterior
from gradient_routes.bench.studies.identify.identifiability import Identified
from gradient_routes.bench.units import size
from gradient_routes.problems.data.observation import Candidates
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.sensitivity import Sensitivity

Criterion = Literal["D", "A"]
LARGEST = 2**29  # bytes of the readings of all candidates; above, of a random subset of them


@dataclass(frozen=True, eq=False)
class Choice:
    """A sensor, the criterion with it and all before, and how many directions are then identifiable."""

    sensor: str
    position: Array | None
    value: float
    rank: int


@dataclass(frozen=True, eq=False)
class Placement:
    """The proposal; `before` is the criterion without it."""

    criterion: Criterion
    candidates: int
    before: float
    choices: tuple[Choice, ...]
    notes: tuple[str, ...]


def place(one: Identified, count: int, criterion: Criterion = "D", afresh: bool = False, seed: int = 0) -> Placement:
    """`count` sensors beside those of the experiment, or instead of them. Raises InputError."""
    H, sigma, n_p = one.products, one.sigma, len(one.state.p)
    _check(count, sigma, n_p)
    candidates, notes = _candidates(one.problem, H, afresh, seed)
    if count > len(candidates.at):
        left = "" if afresh else " that nothing measures yet"
        raise InputError(f"--place {count}: there are {len(candidates.at)} candidates{left} - place at most that many")
    present = np.zeros((0, n_p)) if afresh else H.dense() if one.H is None else one.H
    readings = H.seen.weight * H.readings(candidates.at)
    precision, assumed = _prior_precision(one, sigma)
    C = np.linalg.inv(precision + present.T @ present / sigma**2)
    chosen, gains = greedy(readings / sigma, C, count, criterion)
    if criterion == "D":
        seen = present @ np.linalg.inv(precision) @ present.T
        before = float(np.linalg.slogdet(np.eye(len(present)) + seen / sigma**2)[1])
        values = before + np.cumsum(gains)
    else:
        before = float(C.trace())
        values = before - np.cumsum(gains)
    choices = []
    for k, (j, value) in enumerate(zip(chosen, values, strict=True), start=1):
        s = np.linalg.svd(np.concatenate([present, readings[chosen[:k]]]), compute_uv=False)
        x = None if candidates.position is None else candidates.position[j]
        choices.append(Choice(candidates.label(j), x, float(value), int((s > one.threshold).sum())))
    return Placement(criterion, len(candidates.at), before, tuple(choices), (*notes, *assumed))


def _check(count: int, sigma: float, n_p: int) -> None:
    if not sigma:
        raise InputError("--place: weighs what sensors see against their noise, and none is known - give --noise SIGMA")
    if n_p > posterior.MOST:
        raise InputError(f"--place: a dense covariance of {n_p} parameters - take at most {posterior.MOST}")
    if count < 1:
        raise InputError(f"--place {count} - place at least 1 sensor")


def greedy(G: Array, C: Array, count: int, criterion: Criterion) -> tuple[list[int], list[float]]:
    """Rows of G (k, n), each with what it gains on the covariance C (n, n) that those before leave; no row twice."""
    Q = G @ C  # (k, n)
    chosen: list[int] = []
    gains: list[float] = []
    for _ in range(count):
        d = 1.0 + np.einsum("kn,kn->k", Q, G)
        gain = np.log(d) if criterion == "D" else (Q**2).sum(axis=1) / d
        gain[chosen] = -np.inf
        j = int(gain.argmax())
        chosen.append(j)
        gains.append(float(gain[j]))
        Q = Q - np.outer(G @ Q[j], Q[j] / d[j])
    return chosen, gains


def _prior_precision(one: Identified, sigma: float) -> tuple[Array, list[str]]:
    """(n_p, n_p), definite, of natural changes; what had to be assumed for that."""
    rows = posterior.prior_rows(one.problem, one.state.p, one.natural)
    n_p = len(one.state.p)
    known = np.zeros((n_p, n_p)) if rows is None else rows.T @ rows / sigma**2
    if rows is not None and np.isfinite(posterior.prior_deviations(rows)).all():
        return known, []
    beside = "" if rows is None else " beside Phi, which knows no level"
    return known + np.eye(n_p), [f"prior of the placement: one natural change of each parameter{beside}"]


def _candidates(problem: Problem, H: Sensitivity, afresh: bool, seed: int) -> tuple[Candidates, list[str]]:
    """What is not measured yet, as much of it as fits in memory."""
    offered = problem.candidates() or Candidates(np.arange(problem.n_state), lambda j: f"u_{j + 1}")
    kept, notes = np.arange(len(offered.at)), []
    if not afresh:
        kept = np.flatnonzero(~np.isin(offered.at, _measured((H.seen.whole or H.seen).S_u)))
    room = max(1, LARGEST // (8 * H.shape[1]))
    if len(kept) > room:
        needed = size(8.0 * len(kept) * H.shape[1])
        notes = [f"{room} of {len(kept)} candidates, at random (seed {seed}): what all of them read takes {needed}"]
        kept = np.sort(np.random.default_rng(seed).choice(kept, room, replace=False))
    position = None if offered.position is None else offered.position[kept]
    return Candidates(offered.at[kept], lambda j: offered.label(int(kept[j])), position), notes


def _measured(S_u: Any) -> Array:
    """The unknowns that a datum reads by themselves."""
    from scipy import sparse

    S = sparse.csr_array(S_u)
    alone = np.diff(S.indptr) == 1
    return np.asarray(S.indices[S.indptr[:-1][alone]])
