"""Bias and variance of the estimate: the errors by regularization and by noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.synthetic_data import CONVERGED


@dataclass(frozen=True)
class Trade:
    """Of several draws of the noise at one alpha: mean and standard deviation of p (n_p,), and mean squares over
    the parameters, total = bias + variance.
    """

    inversion: Inversion
    draws: int
    bias: float
    variance: float
    mean: Array
    sd: Array

    @property
    def row(self) -> Row:
        own = {"draws": self.draws, "bias": self.bias, "variance": self.variance, "total": self.bias + self.variance}
        return self.inversion.shared | own | {"mean": self.mean.tolist(), "sd": self.sd.tolist()}


def trade_off(
    spec: ProblemSpec, route: RouteSpec, engine: Engine, alphas: Sequence[float], draws: int, at: str = "start"
) -> Iterator[Trade]:
    """J minimized for every draw of the noise at every alpha, largest first.

    Raises InputError, and KeyboardInterrupt where a draw was interrupted, which leaves that alpha incomplete.
    """
    if not spec.options.get("noise"):
        raise InputError(f"invert: --draws {draws} of a problem without noise - write {spec.name}[noise=...]")
    problems = drawn(spec, draws)
    starts: list[Array | None] = [None] * draws
    for alpha in sorted(map(float, alphas), reverse=True):
        found = []
        for k, problem in enumerate(problems):
            found.append(invert(spec, route, engine, at, starts[k], made=problem.weighted(alpha)))
            starts[k] = found[-1].p
            if found[-1].interrupted:
                raise KeyboardInterrupt
        yield _trade(found)


def _trade(found: Sequence[Inversion]) -> Trade:
    p, truth = np.array([each.p for each in found]), found[0].truth
    assert truth is not None
    mean, shown = p.mean(axis=0), next((each for each in found if each.misled), found[0])
    bias, variance = float(np.mean((mean - truth) ** 2)), float(np.mean((p - mean) ** 2))
    return Trade(shown, len(found), bias, variance, mean, p.std(axis=0))


def drawn(spec: ProblemSpec, draws: int) -> list[Problem]:
    """The problem with several draws of noise on its data; mesh and compiled code are shared where possible."""
    seeds = range(int(spec.options.get("seed", 0)), int(spec.options.get("seed", 0)) + draws)
    bare: Problem = spec.build(**spec.options)
    twin, truth = bare.twin(), bare.truth()
    if truth is None:
        raise InputError(f"invert: --draws {draws} of a problem whose truth is not known - use synthetic data")
    if twin is None:
        return [spec.build(**spec.options | {"seed": seed}) for seed in seeds]
    u = Model(twin, CONVERGED).solve(truth).u
    return [bare.observed(u, seed) for seed in seeds]
