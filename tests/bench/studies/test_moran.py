"""Residuals that are correlated in space, and noise that nobody has stated: closed forms, laws, rates of alarms."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes.bench.inversion.local_noise import of_neighbours, repeated
from gradient_routes.bench.inversion.moran import Moran, neighbours
from gradient_routes.bench.inversion.residuals import Residuals
from gradient_routes.problems.data.observation import Observation

ONE = np.zeros(8, dtype=int)


def test_neighbours_are_the_nearest_of_the_same_quantity() -> None:
    """On a line, W is 1 between those that find each other, 1/2 where one finds the other."""
    W = neighbours(np.arange(4.0)[:, None], ONE[:4]).toarray()
    assert W.tolist() == [[0, 1, 0.5, 0], [1, 0, 1, 0.5], [0.5, 1, 0, 1], [0, 0.5, 1, 0]]
    apart = neighbours(np.arange(4.0)[:, None], np.array(["ux", "uy"] * 2)).toarray()
    assert apart.tolist() == [[0, 0, 1, 0], [0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0]]


def test_a_datum_is_no_neighbour_of_itself_where_several_are_at_one_place() -> None:
    W = neighbours(np.zeros((8, 2)), ONE)
    assert W.diagonal().tolist() == [0.0] * 8


def test_moments_are_those_of_the_formula_by_dense_matrices() -> None:
    """E and var of e^T W e / e^T e for e = M eps, by traces of the matrices themselves."""
    g = np.random.default_rng(1)
    x, X, eps = g.random((40, 2)), g.standard_normal((40, 3)), g.standard_normal(40)
    M = np.eye(40) - X @ np.linalg.pinv(X)
    W, e, f = neighbours(x, np.zeros(40)).toarray(), M @ eps, 37.0
    mean = np.trace(M @ W) / f
    second = (np.trace(M @ W) ** 2 + 2.0 * np.trace(M @ W @ M @ W)) / (f * (f + 2.0))
    found = Moran.of(e, x, np.zeros(40), X)
    assert found is not None
    quotient = e @ W @ e / (e @ e)
    assert found.I == pytest.approx(40 / W.sum() * quotient, rel=1e-12)
    assert found.z == pytest.approx((quotient - mean) / np.sqrt(second - mean**2), rel=1e-10)


def test_two_few_residuals_tell_no_correlation() -> None:
    assert Moran.of(np.ones(8), np.arange(8.0)[:, None], ONE, np.ones((8, 1))) is None
    assert Moran.of(np.zeros(20), np.arange(20.0)[:, None], np.zeros(20), np.zeros((20, 0))) is None


def judged(e: np.ndarray, x: np.ndarray, X: np.ndarray, sigma: float) -> Residuals:
    """Residuals e of data of size 5, to which X was fitted."""
    seen = Observation(e, np.zeros(len(e)), None, sigma=sigma, position=x)
    unloaded = Observation(np.full(len(e), 5.0), np.zeros(len(e)), None)
    return Residuals.of(seen, X.shape[1], unloaded, X)


@pytest.mark.parametrize(("m", "d", "sigma"), [(12, 1, 0.0), (60, 2, 1.0)])
def test_right_models_are_hardly_ever_flagged(m: int, d: int, sigma: float) -> None:
    """200 seeds: at most 5 in 100 may be; the level is 1 in 1000."""
    said = 0
    for seed in range(200):
        g = np.random.default_rng(seed)
        x, e = g.random((m, d)), g.standard_normal(m)
        X = np.c_[np.ones(m), x]
        found = judged(e - X @ np.linalg.lstsq(X, e, rcond=None)[0], x, X, sigma)
        said += found.correlated or found.unexplained
    assert said <= 10


def test_what_neighbours_share_is_flagged_where_it_is_no_noise() -> None:
    """A wave beside noise 1: of rms 0.7 it is said only; of rms 1.6 flagged, though chi^2 is below 4; without noise
    stated that is estimated, and the wave has to be twice as large.
    """
    g = np.random.default_rng(2)
    x = g.random((300, 2))
    wave, noise = np.sqrt(2.0) * np.sin(9.0 * x[:, 0]), g.standard_normal(300)
    for size, sigma, verdict in (
        (0.7, 1.0, ""),
        (1.6, 1.0, "residuals are correlated in space"),
        (1.6, 0.0, ""),
        (2.8, 0.0, "residuals are correlated in space"),
        (2.8, 1.0, "misfit exceeds noise"),
    ):
        found = judged(size * wave + noise, x, np.ones((300, 1)), sigma)
        assert found.verdict == verdict, size
        assert found.correlated
        assert "residuals are correlated in space: Moran's I 0." in found.described
        assert ("error bars, which take them for independent, are too small" in found.described) == (verdict == "")
        assert found.noise == pytest.approx(1.0, rel=0.15)
        assert ("estimated from neighbouring points; chi^2 per datum" in found.described) == (sigma == 0.0)


def test_a_prior_may_correlate_residuals_and_is_named() -> None:
    x = np.linspace(0.0, 1.0, 50)[:, None]
    seen = Observation(np.sin(9.0 * x[:, 0]), np.zeros(50), None, sigma=0.5, position=x)
    found = Residuals.of(seen, prior=True)
    assert found.verdict == ""
    assert found.described.endswith("by the model, or by the weight of Phi")


def test_noise_of_smooth_data_is_what_neighbours_do_not_share() -> None:
    """Linear data have none; repeated ones tell it alike."""
    g = np.random.default_rng(3)
    x = np.repeat(g.random((200, 2)), 2, axis=0)
    smooth, quantity = np.sin(2.0 * x[:, 0]) + x[:, 1], np.zeros(400)
    found = repeated(smooth + 1e-3 * g.standard_normal(400), x, quantity)
    assert found is not None
    assert found.source == "repeated points"
    assert repeated(smooth[::2], x[::2], quantity[::2]) is None
    assert found.sigma == pytest.approx(1e-3, rel=0.15)
    each = of_neighbours(smooth[::2] + 1e-2 * g.standard_normal(200), x[::2], quantity[::2], 1.0)
    assert each is not None
    assert each.source == "neighbouring points"
    assert each.sigma == pytest.approx(1e-2, rel=0.25)
    linear = of_neighbours(3.0 * x[::2, 0] - x[::2, 1], x[::2], quantity[::2], 1.0)
    assert linear is not None
    assert linear.sigma < 1e-12
    assert of_neighbours(g.standard_normal(9), x[:18:2], quantity[:9], 1.0) is None
