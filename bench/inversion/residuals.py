"""Residuals of measured data against their noise: does the model explain the data?"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.inversion.local_noise import NORMAL, Noise, of_neighbours, repeated
from gradient_routes.bench.inversion.moran import Moran
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.problem import Array

FAR = 5.0  # standard deviations beyond which a residual is an outlier
EXCESS = 2.0  # times the noise, above which it does not explain the residuals
SHARED = 2.0  # variances of the noise, above which a part that neighbours share is no noise that is correlated,
SHARED_OF_ESTIMATED = 4.0  # and where that noise is estimated from what neighbours do not share
MANY_OUTLIERS = 0.1  # of the data, above which they are no accidents
NOTHING = 0.99  # of the data, residuals that leave them as they are
EXPLAINED = 0.01  # of the data, residuals that nobody minds who does not know the noise
EXCEEDS = "misfit exceeds noise"
CORRELATED = "residuals are correlated in space"
EXPLAINS_NOTHING = "nothing explained"


@dataclass(frozen=True)
class Residuals:
    """Of S u - d in the unit of the data: how many; their root mean square; that of those which are no outliers, per
    degree of freedom; the number of outliers.

    sigma    the noise that is stated, 0 where it is not
    freedom  data that are no outliers, less what was fitted to them
    size     root mean square of d - S u_0: residuals of a model that says nothing
    told     the noise that residuals tell, where none is stated
    moran    their correlation in space
    prior    whether J has a prior, whose bias is correlated in space, too
    """

    count: int
    rms: float
    inner_rms: float
    outliers: int
    sigma: float
    freedom: float
    size: float = math.inf
    told: Noise | None = None
    moran: Moran | None = None
    prior: bool = False

    @classmethod
    def of(
        cls,
        seen: Observation,
        fitted: float = 0.0,
        unloaded: Observation | None = None,
        H: Array | None = None,
        prior: bool = False,
    ) -> Residuals:
        """`fitted`: how many data p takes up; `unloaded`: the data term at u_0; H (m, n_p), by p."""
        r = (seen.predicted - seen.data) / seen.weight
        sigma, x = seen.sigma / seen.weight, seen.position
        kept = inliers(np.abs(r), sigma)
        inner, modes = r[kept], np.zeros((len(r), 0)) if seen.modes is None else seen.modes
        freedom = len(inner) - fitted - modes.shape[1]
        inner_rms = rms(inner, max(1.0, freedom))
        size = math.inf if unloaded is None else rms(unloaded.predicted - unloaded.data, len(r)) / seen.weight
        told, moran = None, None
        if x is not None and freedom >= 1.0:
            quantity = np.full(len(r), "") if seen.quantity is None else seen.quantity
            basis = modes if H is None else np.concatenate([H, modes], axis=1)
            moran = Moran.of(inner, x[kept], quantity[kept], basis[kept])
            told = None if sigma else repeated(inner, x[kept], quantity[kept])
            if not sigma and told is None and moran is not None and moran.correlated:
                told = of_neighbours(inner, x[kept], quantity[kept], freedom / len(inner))
        if not sigma and freedom >= 1.0 and (told is None or told.sigma > inner_rms):
            told = Noise(inner_rms, "the residuals themselves")
        outliers = len(r) - len(inner)
        return cls(len(r), rms(r, len(r)), inner_rms, outliers, sigma, freedom, size, told, moran, prior)

    @property
    def noise(self) -> float:
        """As stated, else as the residuals tell; 0 where they cannot, with no more data than were fitted."""
        return self.sigma or (self.told.sigma if self.told else 0.0)

    @property
    def source(self) -> str:
        """Where the noise is known from, in words, empty where it is not known."""
        return "stated" if self.sigma else self.told.source if self.told else ""

    @property
    def chi2(self) -> float:
        """Per datum that is left, without outliers; nan without noise."""
        return (self.inner_rms / self.noise) ** 2 if self.noise else math.nan

    @property
    def shared_rms(self) -> float:
        """Of the part that neighbours share: Moran's I is its share of the variance."""
        return 0.0 if self.moran is None else self.inner_rms * math.sqrt(max(0.0, self.moran.I))

    @property
    def nothing(self) -> bool:
        """Whether the model explains none of the data: residuals are as large as they are."""
        return self.rms > NOTHING * self.size > 0.0

    @property
    def exceed(self) -> bool:
        """Whether the residuals are no noise of the size that is stated."""
        larger = self.inner_rms > EXCESS * self.sigma or self.outliers > MANY_OUTLIERS * self.count
        return self.sigma > 0.0 and larger

    @property
    def correlated(self) -> bool:
        """Whether residuals are correlated in space, beyond chance."""
        return self.moran is not None and self.moran.correlated

    @property
    def shared(self) -> bool:
        """Whether what neighbours share is no noise: too large for that, and due to the model alone."""
        large = self.shared_rms**2 > (SHARED if self.sigma else SHARED_OF_ESTIMATED) * self.noise**2
        minded = self.sigma > 0.0 or self.rms > EXPLAINED * self.size
        return self.correlated and large and minded and not self.prior

    @property
    def verdict(self) -> str:
        """What is wrong, empty where the model explains the data."""
        if self.nothing:
            return EXPLAINS_NOTHING
        return EXCEEDS if self.exceed else CORRELATED if self.shared else ""

    @property
    def unexplained(self) -> bool:
        return bool(self.verdict)

    @property
    def described(self) -> str:
        beyond = f"; {self.rms:.3g} with {self.outliers} outliers of {self.count}" if self.outliers else ""
        if self.nothing:
            return f"{EXPLAINS_NOTHING}: residuals of rms {self.rms:.3g}, of data of rms {self.size:.3g}"
        if not self.noise:
            return "no error bars: noise is not stated, and no data are left to tell it - give noise="
        of_size, noise = f"rms {self.inner_rms:.3g}{beyond}", f"noise {self.noise:.3g}"
        chi2 = f"chi^2 per datum {self.chi2:.3g}"
        if self.exceed:
            times = f"{self.inner_rms / self.sigma:.2g} times as much"
            said = f"{EXCEEDS}: residuals of {of_size} against {noise}, {times}; {chi2}"
        elif self.told is None or self.told.source != "the residuals themselves":
            how = f", not stated, estimated from {self.told.source}" if self.told else ""
            said = f"residuals: {of_size}; {noise}{how}; {chi2}"
        else:
            said = f"residuals: {of_size}; noise not stated, taken from them"
        return "\n".join([said, *self._correlation])

    @property
    def _correlation(self) -> list[str]:
        if self.moran is None or not self.correlated:
            return []
        how = f"{CORRELATED}: Moran's I {self.moran.I:.2f}, {self.moran.z:.3g} standard deviations above chance"
        if self.shared:
            return [
                f"{how}; the part that neighbours share, rms {self.shared_rms:.3g}, is no noise of {self.noise:.3g}"
            ]
        if self.prior:
            return [f"{how}: by the model, or by the weight of Phi"]
        return [f"{how}: error bars, which take them for independent, are too small"]


def inliers(r: Array, sigma: float) -> Array:
    """Which residuals of sizes r are no outliers."""
    return np.asarray(r <= FAR * max(NORMAL * float(np.median(r)), sigma))


def rms(r: Array, freedom: float) -> float:
    return float(np.sqrt(np.sum(r**2) / freedom)) if len(r) else 0.0
