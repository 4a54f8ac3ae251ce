"""What is said of measured data: residuals against noise, outliers, error bars in closed form."""

from __future__ import annotations

import re

import meshio
import numpy as np
import pytest

from benchmarks.intervals import PROBLEMS, covered
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


PATCH = "plate[n=1,clamped=none,fixed=x@left,y@bottom,law=linear,unknown=constants,traction=0.1,noise=1e-5,data=d.csv"


def patch(nu: float, columns: str) -> str:
    """Plane stress of E = 2 Pa pulled by 0.1 Pa: ux = -nu t x / E, uy = t y / E, with noise."""
    noise = iter(np.random.default_rng(4).standard_normal(200) * 1e-5)
    of = {"ux": lambda x, y: -nu * 0.05 * x, "uy": lambda x, y: 0.05 * y}
    rows = [
        ",".join(f"{v:.9g}" for v in (x, y, *(of[name](x, y) + next(noise) for name in columns.split(","))))
        for x in (0.1, 0.4, 0.6, 0.8)
        for y in (0.3, 0.5, 0.7, 1.0)
    ]
    return "\n".join([f"x,y,{columns}", *rows])


def said(cli, folder, constants: str, nu: float = 0.25, columns: str = "ux,uy") -> dict:
    (folder / "d.csv").write_text(patch(nu, columns))
    problem = f"{PATCH},constants={constants}]"
    ran = cli("invert", "--problem", problem, "--optimizer", "gauss-newton", "--no-store", "--json")
    return {row["constant"]: row for row in ran.rows if row["table"] == "constants"} | {"code": ran.code}


def test_constants_of_every_choice_are_the_same_with_the_same_bars(cli, tmp_path) -> None:
    """E and nu from E,nu and from K,G; sd(E) and their correlation as of closed-form least squares."""
    one, other = said(cli, tmp_path, "E:1,nu:0.4"), said(cli, tmp_path, "K,G")
    for name in ("E [Pa]", "nu"):
        assert one[name]["value"] == pytest.approx(other[name]["value"], rel=1e-6)
        assert one[name]["sd"] == pytest.approx(other[name]["sd"], rel=1e-5)
    x, y = (np.array([0.1, 0.4, 0.6, 0.8]), np.array([0.3, 0.5, 0.7, 1.0]))
    sd_y = 1e-5 / np.sqrt(4 * y @ y)  # of the strains t/E and nu t/E
    sd_x = 1e-5 / np.sqrt(4 * x @ x)
    E, nu = one["E [Pa]"]["value"], one["nu"]["value"]
    by = np.array([[-(E**2) / 0.1, 0.0], [-nu * E / 0.1, E / 0.1]])  # E and nu by the strains
    C = by @ np.diag([sd_y**2, sd_x**2]) @ by.T
    assert [one["E [Pa]"]["sd"], one["nu"]["sd"]] == pytest.approx(np.sqrt(np.diag(C)), rel=1e-6)
    assert one["E [Pa]"]["correlations"]["nu"] == pytest.approx(C[0, 1] / np.sqrt(C[0, 0] * C[1, 1]), rel=1e-6)
    assert other["K [Pa]"]["value"] == pytest.approx(E / 3 / (1 - 2 * nu), rel=1e-5)


def test_residuals_are_fields_on_the_points_of_the_data(cli, tmp_path) -> None:
    (tmp_path / "d.csv").write_text(patch(0.25, "ux,uy"))
    files = ("-o", str(tmp_path / "p.vtu"), "--no-store", "--json")
    ran = cli("invert", "--problem", f"{PATCH},constants=E,nu]", "--optimizer", "gauss-newton", *files)
    rows = [row for row in ran.rows if row["table"] == "residuals" and row["quantity"] == "uy"]
    grid = meshio.read(tmp_path / "p.vtu")
    at = grid.cells_dict["vertex"].ravel()
    known = {(x, y): r for (x, y, _), r in zip(grid.points[at], grid.point_data["residual_uy"][at], strict=True)}
    assert len(rows) == len(known) == 16
    assert all(known[row["x"], row["y"]] == pytest.approx(row["residual"], abs=1e-18) for row in rows)
    assert np.isnan(grid.point_data["residual_over_noise_ux"][: at[0]]).all()
    assert np.isnan(grid.point_data["u"][at]).all()


def test_a_constant_at_its_bound_has_no_bar_and_the_other_one_has_with_it_held(cli, tmp_path) -> None:
    """Data of nu = 0.7: nu ends at 0.5, and E is that of one unknown, E^2 sigma / (t |(y, x/2)|)."""
    found = said(cli, tmp_path, "E,nu", nu=0.7)
    assert found["code"] == 1
    assert (found["nu"]["bound"], found["nu"]["sd"]) == ("0.5", None)
    assert found["nu"]["value"] == pytest.approx(0.5, abs=1e-6)
    squares = 4 * (np.array([0.3, 0.5, 0.7, 1.0]) ** 2).sum() + (np.array([0.1, 0.4, 0.6, 0.8]) ** 2).sum()
    sd = found["E [Pa]"]["value"] ** 2 * 1e-5 / (0.1 * np.sqrt(squares))
    assert found["E [Pa]"]["sd"] == pytest.approx(sd, rel=1e-5)
    ran = cli("invert", "--problem", f"{PATCH},constants=E,nu]", "--no-store", "--no-plot")
    assert "nu is at its bound, 0.5: dJ/dnu < 0, the data want it beyond; error bars of the others are" in ran.out
    ran = cli("invert", "--problem", f"{PATCH}]", "--no-store", "--no-plot")  # mu, lam: never past it
    assert "lam is at its bound, infinity: dJ/dlam < 0, the data want it beyond" in ran.out


def test_a_blind_direction_is_named_and_gets_no_bar(cli, tmp_path) -> None:
    found = said(cli, tmp_path, "K,G", columns="uy")
    assert found["K [Pa]"]["sd"] is found["G [Pa]"]["sd"] is found["nu"]["sd"] is None
    assert found["E [Pa]"]["sd"] == pytest.approx(
        4e-5 / (0.1 * np.sqrt(4 * (0.3**2 + 0.5**2 + 0.7**2 + 1.0))), rel=1e-3
    )
    ran = cli("invert", "--problem", f"{PATCH},constants=K,G]", "--no-store", "--no-plot")
    assert re.search(r"^blind direction: data do not see 0.99 log K -0.15 log G$", ran.out, re.M)
    assert "\nnu 0.3 without an error bar\n" in ran.out


def test_the_study_of_intervals_counts_parameters_and_constants() -> None:
    counted = {name: held.shape for name, held in covered(PROBLEMS[0], 2)}
    assert counted == dict.fromkeys(["log mu", "log K", "mu [Pa]", "lam [Pa]", "E [Pa]", "nu"], (2,))
