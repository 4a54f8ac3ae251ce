"""What is said of measured data: residuals against noise, outliers, error bars in closed form."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gradient_routes.bench.cases.case import problems, routes
from gradient_routes.bench.inversion.fit import fitted
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.bench.inversion.residuals import Residuals
from gradient_routes.problems.data.observation import Observation

SIGMA = 1e-3


def residuals(r: np.ndarray, sigma: float) -> Residuals:
    return Residuals.of(Observation(r, np.zeros(len(r)), None, sigma=sigma))


def test_noise_explains_residuals_of_its_size_with_and_without_outliers() -> None:
    r = SIGMA * np.random.default_rng(0).standard_normal(1000)
    plain = residuals(r, SIGMA)
    assert (plain.outliers, plain.exceed) == (0, False)
    assert plain.rms == plain.inner_rms == pytest.approx(SIGMA, rel=0.1)
    r[:20] = 0.1
    spoilt = residuals(r, SIGMA)
    assert (spoilt.outliers, spoilt.exceed) == (20, False)
    assert spoilt.rms > 10 * spoilt.inner_rms
    assert "with 20 outliers of 1000; noise 0.001" in spoilt.described


def test_many_outliers_are_no_accidents() -> None:
    """A tenth of the data may be wrong by chance; a model that misses more of them is wrong, however well it meets
    the others.
    """
    r = SIGMA * np.random.default_rng(0).standard_normal(1000)
    for count, exceed in ((90, False), (110, True)):
        r[:count] = 0.1
        found = residuals(r, SIGMA)
        assert (found.outliers, found.exceed) == (count, exceed)
        assert ("misfit exceeds noise" in found.described) == exceed


def test_residuals_of_three_times_the_noise_exceed_it() -> None:
    found = residuals(3.0 * SIGMA * np.random.default_rng(0).standard_normal(1000), SIGMA)
    assert found.exceed
    assert found.described.startswith("misfit exceeds noise: residuals of rms 0.00")
    assert not residuals(np.ones(10), 0.0).exceed, "noise that is not stated is not exceeded"


def test_error_bars_of_one_modulus_are_the_closed_form(tmp_path) -> None:
    """u = F L / (A E), so sd(E) = sigma E^2 at F = L = A = 1."""
    (tmp_path / "d.csv").write_text("node,displacement\n1,0.25\n")
    (spec,) = problems([f"bar[n=1,parametrization=raw,data={tmp_path}/d.csv,noise={SIGMA}]"])
    found = invert(spec, routes(["adjoint"])[0], Engine())
    assert found.p == pytest.approx([4.0], rel=1e-7)
    assert found.fit is not None
    assert found.fit.sd == pytest.approx([SIGMA * 16.0], rel=1e-6)
    assert found.tables["estimates"][0]["sd"] == found.fit.sd[0]
    assert not found.unexplained


def test_noise_is_not_told_by_data_that_are_met_exactly(tmp_path) -> None:
    """Two data, two moduli that they see: residuals are rounding, and no error bar may rest on them."""
    (tmp_path / "d.csv").write_text("node,displacement\n1,0.25\n2,0.6\n")
    for noise, barred in (("", False), (f",noise={SIGMA}", True)):
        (spec,) = problems([f"bar[n=2,parametrization=raw,data={tmp_path}/d.csv{noise}]"])
        found = invert(spec, routes(["adjoint"])[0], Engine()).fit
        assert found is not None
        assert found.residuals.freedom == pytest.approx(0.0, abs=1e-9)
        assert np.isfinite(found.sd).all() == barred
        assert ("no error bars" in found.described) != barred


def test_noise_that_is_not_stated_is_that_per_degree_of_freedom() -> None:
    """Three readings of one spring: sd(E) by least squares, with m - 1 in its denominator."""
    u = np.array([0.25, 0.5, 0.74])  # of nodes 1 to 3 of a homogeneous bar of three elements
    x = np.arange(1, 4) / 3.0
    E = (x @ x) / (x @ u)
    r = x / E - u
    s = np.sqrt(r @ r / 2.0)
    H = -x / E**2
    seen = Observation(x / E, u, None)
    assert Residuals.of(seen, fitted=1.0).noise == pytest.approx(s, rel=1e-12)
    assert fitted(H[:, None], H[:, None]) == pytest.approx(1.0, rel=1e-12)
    assert fitted(H[:, None], np.concatenate([H, [1e3]])[:, None]) == pytest.approx(H @ H / (H @ H + 1e6), rel=1e-9)


def test_a_model_that_explains_nothing_is_flagged_without_noise(tmp_path, cli) -> None:
    """Data against the load: the stiffer, the better, and no modulus explains them."""
    (tmp_path / "d.csv").write_text("node,displacement\n1,-0.25\n2,-0.5\n")
    ran = cli("invert", "--problem", "bar[n=2,data=d.csv]", "--no-store", "--no-plot")
    assert ran.code == 1
    assert "nothing explained: residuals of rms 0.39" in ran.out
    ran = cli("invert", "--problem", "bar[n=2,data=d.csv]", "--no-store", "--json")
    assert ran.code == 1
    assert any("nothing explained" in (row.get("says") or "") for row in ran.rows)
    swept = ("--alpha-sweep", "1e-9", "1e-8", "2", "--no-store", "--no-plot")
    assert cli("invert", "--problem", "bar[n=2,data=d.csv]", *swept).code == 1


STRETCHED = "plate[n=2,law=linear,unknown=constants,traction=0.1,noise=1e-5,data=d.csv]"


def test_E_and_nu_are_stated_with_error_bars_and_a_misfit_is_flagged(cli, tmp_path) -> None:
    """Plane stress of a patch held by a roller: ux = -nu t x / E, uy = t y / E; then data that nothing explains."""
    E, nu, t = 2.0, 0.25, 0.1
    points = [(x, y) for x in (0.1, 0.4, 0.8) for y in (0.3, 0.7, 1.0)]
    noise = np.random.default_rng(4).standard_normal((len(points), 2)) * 1e-5
    held = "clamped=none,fixed='x@left,y@bottom'".replace("'", "")
    selector = STRETCHED.replace("n=2,", f"n=2,{held},")
    for wrong in (0.0, 0.02):
        lines = ["x,y,ux,uy"]
        for (x, y), (a, b) in zip(points, noise, strict=True):
            lines.append(f"{x},{y},{-nu * t * x / E + a + wrong * (y - 0.5) ** 2},{t * y / E + b}")
        (tmp_path / "d.csv").write_text("\n".join(lines))
        ran = cli("invert", "--problem", selector, "--no-store", "--no-plot")
        assert ran.code == (1 if wrong else 0), ran.out + ran.err
        assert ("misfit exceeds noise" in ran.out) == bool(wrong)
        if not wrong:
            number = r"([-\d.e+]+)"
            said = [re.search(rf"^{name} {number} \+- {number}", ran.out, re.M) for name in (r"E \[Pa\]", "nu")]
            (E_found, sd_E), (nu_found, sd_nu) = (map(float, found.groups()) for found in said)
            assert abs(E_found - E) < 4 * sd_E
            assert abs(nu_found - nu) < 4 * sd_nu
            assert 0.0 < sd_E < 1e-2
