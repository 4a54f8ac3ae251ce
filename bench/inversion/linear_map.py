"""The linear map from readings to parameters: factorized and inverted once, applied to any number of frames.

    p(d) = argmin 1/2 |y_0 + H (p - p_0) - d|^2 + alpha Phi(p),     H = S_u R_u^{-1} (-R_p) + S_p at p_0, y_0 = S u(p_0)

Where u is affine in p (tractions, loads, a source) this is the minimum of J; elsewhere one Gauss-Newton step from p_0.
Phi is linearized, too: 1/2 |rho_0 + B (p - p_0)|^2. Inverse finite element methods (Tessler & Spangler 2005) find u
from strains in this manner, by one least-squares operator that is made beforehand.
"""

from __future__ import annotations

import zipfile
import zlib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import BinaryIO

import numpy as np

from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.inversion import posterior
from gradient_routes.bench.inversion.history import History
from gradient_routes.bench.inversion.least_squares import Residuals
from gradient_routes.bench.inversion.linear_regime import LinearRegime
from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.bench.inversion.optimizers import Limits, Stopped, converged, flat
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

MOST = 5e7  # entries of a map
LINEAR = "the linear answer"
SUFFICES, INSUFFICIENT = f"{LINEAR} suffices", f"{LINEAR} does not suffice"


@dataclass(frozen=True, eq=False)
class LinearMap:
    """Data d (m,) of a frame to p = offset + gain d, (n_p,), both in their own units.

    gain (n_p, m), offset (n_p,)
    H (m, n_p), rest (m,)  y = rest + H p: what the linear model reads, with the weights of J
    weight (m,)            of the data in J
    modes (m, k)           eliminated from J, orthonormal
    sigma                  of the noise, with these weights; 0 where it is not known
    sd (n_p,)              standard deviation of p by the noise, nan where unbounded
    rank                   directions of p that data and Phi determine; along others p stays at p_0
    names, units (n_p,)    of p; readings (m,): names of the data, in their order
    problem                selector of the problem
    """

    gain: Array
    offset: Array
    H: Array
    rest: Array
    weight: Array
    modes: Array
    sigma: Array
    sd: Array
    rank: Array
    names: Array
    units: Array
    readings: Array
    problem: Array

    def __call__(self, d: Array) -> Array:
        """p (F, n_p) of frames d (F, m); or (n_p,) of one (m,)."""
        return np.asarray(d @ self.gain.T + self.offset)

    def residual(self, d: Array, p: Array) -> Array:
        """(F, m), with the weights of J and without what is eliminated from it."""
        w = d * self.weight
        return np.asarray(p @ self.H.T + self.rest - w + (w @ self.modes) @ self.modes.T)

    def save(self, file: BinaryIO) -> None:
        """As .npz, arrays of numbers and words only."""
        np.savez(file, **{each.name: getattr(self, each.name) for each in fields(self)})

    @classmethod
    def load(cls, path: Path) -> LinearMap:
        """Raises InputError for a file that is no map."""
        names = [each.name for each in fields(cls)]
        no_map = InputError(f"--map {path}: is no map - write one by routes invert --linear -o {path}")
        try:
            with np.load(located(path), allow_pickle=False) as file:
                found = cls(**{name: file[name] for name in names})
        except OSError as error:
            raise InputError(f"--map {path}: cannot be read: {error.strerror or error} - check the path") from error
        except (ValueError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
            raise no_map from error
        if not found._consistent:
            raise no_map
        return found

    @property
    def _consistent(self) -> bool:
        if self.gain.ndim != 2 or self.modes.ndim != 2:
            return False
        (n_p, m), k = self.gain.shape, self.modes.shape[1]
        shapes = {
            "offset": (n_p,),
            "H": (m, n_p),
            "rest": (m,),
            "weight": (m,),
            "modes": (m, k),
            "sigma": (),
            "rank": (),
        }
        numbers = all(getattr(self, name).shape == of for name, of in shapes.items())
        numbers = numbers and all(getattr(self, name).dtype == float for name in ("gain", "sd", *shapes))
        words = self.names.shape == self.units.shape == (n_p,) and self.readings.shape == (m,)
        return numbers and words and all(np.isfinite(getattr(self, name)).all() for name in ("gain", *shapes))

    @property
    def described(self) -> str:
        n_p, m = self.gain.shape
        free = n_p - int(self.rank)
        left = f"; {free} of {n_p} directions are determined by nothing, p stays at the start there" if free else ""
        bars = self.sd[np.isfinite(self.sd)]
        noise = f"; noise moves p by {bars.min():.2g} to {bars.max():.2g}" if bars.size else ""
        return f"map of {self.problem}: {m} readings to {n_p} parameters{noise}{left}"


def linear_map(objective: Objective, selector: str) -> LinearMap:
    """About the last accepted step, by min(m, n_p) solves with one factorization of R_u. Raises InputError where it is
    too large, or Phi has no quadratic.
    """
    problem, at, x = objective.problem, objective.accepted, objective.accepted.x
    prior, n_p = problem.regularization, len(objective.accepted.x)
    if prior is not None and prior.kind == "tv" and prior.alpha:
        raise InputError(f"{problem.name}: --linear: total variation is not quadratic - take phi=tikhonov")
    residuals = Residuals(objective)
    r = residuals(x)
    seen = _seen(objective, residuals.state(x).u)
    m = len(seen.data)
    if m * n_p > MOST or min(len(r), n_p) > posterior.MOST:
        raise InputError(f"{problem.name}: --linear: a map of {m} readings to {n_p} parameters is too large")
    A, T = residuals.dense(x), objective.variables.slope(x)
    U, s, V_T = np.linalg.svd(A, full_matrices=False)
    known = s > max(A.shape) * posterior.EPS * s[0]
    inverse = T[:, None] * (V_T[known].T / s[known]) @ U[:, known].T  # dp by -r
    weight = np.broadcast_to(np.asarray(seen.weight * seen.relative, dtype=float), (m,))
    H = A[:m] / T
    y_0 = np.concatenate([seen.predicted, r[m:]])
    q = problem.parameters
    return LinearMap(
        gain=np.ascontiguousarray(inverse[:, :m] * weight),
        offset=at.p - inverse @ y_0,
        H=H,
        rest=seen.predicted - H @ at.p,
        weight=np.array(weight),
        modes=np.zeros((m, 0)) if seen.modes is None else seen.modes,
        sigma=np.array(seen.sigma),
        sd=posterior.known(problem, at.p, A[:m], T, seen.sigma).sd,
        rank=np.array(float(known.sum())),
        names=np.array([q.label(i) for i in range(n_p)]),
        units=np.array([q.unit_of(i) for i in range(n_p)]),
        readings=np.array([seen.label(k) for k in range(m)]),
        problem=np.array(selector),
    )


def at_once(objective: Objective, history: History, limits: Limits) -> str:
    """The minimum of the linear model for the problem's own data."""
    return whole_step(linear_map(objective, objective.problem.name), objective, history, limits)


def whole_step(by: LinearMap, objective: Objective, history: History, limits: Limits) -> str:
    """The map's answer to the problem's own data, and whether its readings there are those of the problem."""
    problem = objective.problem
    seen = _seen(objective, problem.initial(objective.accepted.p))
    x = objective.variables.x(by(seen.data / by.weight))
    found = objective.at(x)
    if found.outside is not None:
        raise Stopped(f"stopped: the linear answer leaves the domain: {found.outside}")
    history.take(found)
    objective.accept(x)
    if flat(objective, found, limits):  # as where u is affine in p
        return converged(objective, limits)
    u = objective.model.solve(found.p).u if found.u is None else found.u
    y = np.asarray(_seen(objective, u).predicted)
    off = by.rest + by.H @ found.p - y
    if seen.sigma:
        return LinearRegime.of(off, seen.sigma).described(LINEAR)
    relative = float(np.linalg.norm(off) / np.linalg.norm(seen.data))
    return f"{LINEAR}: its readings differ from those of the problem by {relative:.2g} of the data"


def _seen(objective: Objective, u: Array) -> Observation:
    seen = objective.problem.observation(u, objective.accepted.p)
    assert seen is not None  # or Residuals had refused
    return seen
