"""What the data can say of p: read off H = d(S u)/dp, never off one gradient.

A gradient is H^T r: zero where nothing sees a parameter, and as well where several compensate one another, or where
the residual r happens to be orthogonal to what does see it. H tells them apart.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, point
from gradient_routes.bench.cases.machine import available_bytes
from gradient_routes.bench.cases.options import convert, options_of
from gradient_routes.bench.cases.registry import factory_of
from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.bench.inversion import posterior
from gradient_routes.bench.units import size
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import OFFERED_AS, Array, Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State
from gradient_routes.routes.sensitivity import Sensitivity
from gradient_routes.routes.singular_values import Svd, randomized, whole

EPS = float(np.finfo(np.float64).eps)
WHOLE = posterior.MOST  # solves that a whole H may take
SHARE = 4  # of the memory at hand, what H may take
MODES = 32  # singular values to begin with where H is never whole
MOST_MODES = 512
MOST = 10**5  # parameters: each is a row of what is kept


@dataclass(frozen=True, eq=False)
class Identified:
    """One experiment at p. Columns of H are scaled by natural changes of p, its rows by the weights of the data in J.

    products            with H (m, n_p)
    H                   whole, None where it is known by products only
    svd                 of it
    sigma               of the noise on its rows, 0 where none is known
    posterior_sd (n_p,) in the unit of each parameter, nan where unbounded or not computed
    prior_sd (n_p,)     nan where unbounded, None where there is no prior
    """

    spec: ProblemSpec
    at: str
    problem: Problem
    state: State
    products: Sensitivity
    H: Array | None
    svd: Svd
    sigma: float
    posterior_sd: Array
    prior_sd: Array | None
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<Identified {self.spec.selector}: {self.rank} of {len(self.state.p)} directions>"

    def _repr_html_(self) -> str:
        """In a notebook."""
        from gradient_routes.bench.studies.identify import page

        return page.fragment(self)

    @property
    def natural(self) -> Array:
        """Changes of p, (n_p,)."""
        return self.products.scale

    @property
    def data(self) -> int:
        """m."""
        return self.products.shape[0]

    @property
    def threshold(self) -> float:
        """What a singular value must exceed to be told from noise, or from rounding where none is known."""
        s_1 = float(self.svd.s[0])
        return max(self.sigma, max(self.data, len(self.state.p)) * EPS * s_1)

    @property
    def identifiable(self) -> Array:
        """(k,), of the singular values."""
        return np.asarray(self.svd.s > self.threshold)

    @property
    def rank(self) -> int:
        return int(self.identifiable.sum())

    @property
    def complete(self) -> bool:
        """Whether no identifiable direction is left out."""
        return self.svd.beyond <= self.threshold

    @property
    def kinds(self) -> Array:
        """blind, weak or seen, (n_p,)."""
        weak = np.hypot(self.svd.norms, self.svd.beyond) <= self.threshold  # what products have left out could be there
        return np.where(self.svd.blind, "blind", np.where(weak, "weak", "seen"))

    @property
    def null_share(self) -> Array:
        """|P_0 e_i|^2, (n_p,), P_0 onto the directions that are not identifiable."""
        seen = (self.svd.V[:, self.identifiable] ** 2).sum(axis=1)
        return np.asarray(np.clip(1.0 - seen, 0.0, 1.0))


def identify(
    spec: ProblemSpec, at: str = "start", noise: float | None = None, solver: Solver | None = None,
    modes: int | None = None,
) -> Identified:  # fmt: skip
    """H at p, and what follows from it.

    noise  standard deviation of a reading, instead of the problem's own
    modes  singular values by random products; None: all of them where H can be had whole

    Raises InputError, DomainError, and what the forward solve raises.
    """
    if noise is not None and not 0.0 < noise < np.inf:
        raise InputError(f"--noise {noise:g} - give a finite standard deviation > 0")
    if modes is not None and modes < 1:
        raise InputError(f"--modes {modes} - give at least 1")
    with redirect_stdout(sys.stderr):
        problem = spec()
    if Offers.LINEARIZE not in problem.offers:
        raise InputError(f"identify: needs {OFFERED_AS[Offers.LINEARIZE]}, which {problem.name} does not offer")
    p = point(problem, at)
    if len(p) > MOST:
        raise InputError(f"identify: {len(p)} parameters, each a row that is kept - take at most {MOST}")
    model = Model(problem, solver)
    with np.errstate(all="ignore"), redirect_stdout(sys.stderr):
        state = model.solve(p)
        products = Sensitivity(model, state, problem.parameters.natural(p))
        sigma = products.seen.sigma if noise is None else noise * products.seen.weight
        H, svd = _spectrum(products, sigma, modes)
        known = posterior.known(problem, p, H, products.scale, sigma)
    found = Identified(spec, at, problem, state, products, H, svd, sigma, known.sd, known.prior_sd, ())
    return replace(found, notes=tuple(filter(None, (*problem.notes, _left_out(found), known.why_not))))


def _spectrum(H: Sensitivity, sigma: float, modes: int | None) -> tuple[Array | None, Svd]:
    """Whole where that is affordable; else as many random products as it takes to get below the noise."""
    m, n_p = H.shape
    memory = available_bytes()
    fits = memory is None or 8 * m * n_p <= memory // SHARE
    if modes is None and min(m, n_p) <= WHOLE and fits:
        entries = H.dense()
        return entries, whole(entries)
    k = modes or MODES
    svd = randomized(H, H.shape, k)
    while modes is None and svd.beyond > max(sigma, max(m, n_p) * EPS * svd.s[0]) and 2 * k <= MOST_MODES:
        k *= 2
        svd = randomized(H, H.shape, k)
    return None, svd


def _left_out(found: Identified) -> str:
    if found.H is not None:
        return ""
    m, n_p = found.data, len(found.state.p)
    more = "" if found.complete else "; rank and columns are at least what is said - ask for more: --modes"
    return (
        f"H, {m} x {n_p} ({size(8.0 * m * n_p)}), by random products: the {len(found.svd.s)} largest singular values,"
        f" the next at most {found.svd.beyond:.2g}{more}"
    )


def varied(spec: ProblemSpec, changes: Sequence[tuple[str, str]]) -> list[ProblemSpec]:
    """The problem itself, then with one of its options changed at a time, (name, text) each. Raises InputError."""
    specs, known = [spec], options_of(factory_of(spec.build))
    for name, text in changes:
        if name not in known:
            raise InputError(f"{spec.name}: no option '{name}' to vary - {did_you_mean(name, known)}")
        other = replace(spec, options=spec.options | {name: convert(known[name], text, spec.name)})
        if other.options not in [s.options for s in specs]:
            specs.append(other)
    return specs
