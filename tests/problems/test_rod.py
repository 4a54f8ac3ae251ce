"""The rod against the closed forms of fins and the complex step; its data files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import relative_error, somewhere

from gradient_routes.bench.cases.case import problems, routes
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array
from gradient_routes.problems.rod import Rod
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.model import Model
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent

VARIANTS: dict[str, dict[str, Any]] = {
    "film": {},
    "conductivity": {"unknown": "conductivity", "parametrization": "raw", "tip": "convective", "noise": 0.1},
    "flux": {"unknown": "flux", "flux": -3e3, "tip": "27degC"},
    "parts": {"unknown": "film+conductivity", "flux": 2e4, "parts": 4, "alpha": 0.1, "parametrization": "raw"},
    "sign": {"unknown": "conductivity+flux", "n": 1, "tip": "convective"},
    "variation": {"parts": 5, "n": 5, "alpha": 2.0, "phi": "tv", "tip": "20degC", "area": 1e-5, "perimeter": "12mm"},
}
L, K, H, D, Q, T_0 = 0.4, 110.0, 18.0, 0.012, 5e4, 80.0  # the closed forms' rod; T_0 above the surroundings
ROD = {"length": "400mm", "conductivity": K, "film": H, "diameter": "12mm"}
M = np.sqrt(4.0 * H / (K * D))


@pytest.mark.parametrize("name", VARIANTS)
def test_every_exact_route_gives_the_gradient(name: str) -> None:
    rod = with_synthetic_data(Rod(**VARIANTS[name]))
    p = rod.parameters.start * 1.05 if VARIANTS[name].get("parametrization") == "raw" else somewhere(rod)
    exact = complex_step.prepare(Model(rod), p)(p).gradient
    for route in (tangent, adjoint):
        assert relative_error(route.prepare(Model(rod), p)(p).gradient, exact) < 1e-12, route.name


def fin(x: Array, base: bool, tip: str) -> Array:
    """theta of a fin (Incropera & DeWitt, Fundamentals of Heat and Mass Transfer, table 3.4), and of one under a flux.

    theta = a cosh m (L - x) + b sinh m (L - x), b/a = h/(m k) of a tip that loses heat; T(L) = T_0/4 where prescribed.
    """
    y, end = M * (L - x), M * L
    if tip not in ("insulated", "convective"):
        a = T_0 / 4.0
        b = (T_0 - a * np.cosh(end)) / np.sinh(end) if base else (Q / (K * M) - a * np.sinh(end)) / np.cosh(end)
        return np.asarray(a * np.cosh(y) + b * np.sinh(y))
    ratio = H / (M * K) if tip == "convective" else 0.0
    size = np.cosh(y) + ratio * np.sinh(y)
    if base:
        return np.asarray(T_0 * size / (np.cosh(end) + ratio * np.sinh(end)))
    return np.asarray(Q / (K * M) * size / (np.sinh(end) + ratio * np.cosh(end)))


@pytest.mark.parametrize("tip", ["insulated", "convective", "313.15"])
@pytest.mark.parametrize("heated", [{"base": 373.15}, {"flux": Q}], ids=["base", "flux"])
def test_temperatures_converge_to_the_closed_form(heated: dict[str, Any], tip: str) -> None:
    """By a factor of 4 for half the element length."""
    off = []
    for n in (10, 20, 40):
        rod = Rod(**ROD, **heated, tip=tip, n=n).twin()
        theta = rod.excess(Model(rod).solve(rod.parameters.start).u)
        off.append(np.abs(theta - fin(np.linspace(0.0, L, n + 1), "base" in heated, tip)).max())
    assert off[0] < 1e-2 * T_0
    assert np.array(off[:-1]) / off[1:] == pytest.approx([4.0, 4.0], rel=0.02)


def test_heat_flows_out_as_it_flows_in() -> None:
    """The sum of R over all nodes is the balance of the whole rod."""
    rod = Rod(**ROD, flux=Q, tip="convective").twin()
    u = Model(rod).solve(rod.parameters.start).u
    lost = H * rod.fin.P * rod.dx * ((u[:-1] + u[1:]) / 2.0).sum() + H * rod.fin.A * u[-1]
    assert lost == pytest.approx(Q * np.pi * D**2 / 4.0, rel=1e-12)


def thermocouples(folder: Path, celsius: bool) -> str:
    path, x = folder / "rod.csv", np.array([20.0, 60.0, 100.0, 210.0, 350.0])
    T = fin(x / 1e3, True, "insulated") + 20.0
    if celsius:
        rows = [f"{x_i:g};{T_i!r};Ann".replace(".", ",") for x_i, T_i in zip(x, T.tolist(), strict=True)]
        path.write_text("\n".join(["# brass", "x [mm];T [°C];by", *rows]))
    else:
        rows = [f"{x_i / 1e3!r},{T_i + 273.15!r}" for x_i, T_i in zip(x.tolist(), T.tolist(), strict=True)]
        path.write_text("\n".join(["x,T", *rows]))
    return str(path)


def test_a_file_in_degrees_celsius_is_that_in_kelvin(tmp_path: Path) -> None:
    known = {"base": "100degC", "ambient": "20degC"}
    celsius = Rod(data=thermocouples(tmp_path, True), **ROD, **known, noise="0.1degC")
    assert celsius.noise == pytest.approx(0.1)
    assert celsius.notes[0] == "read x in mm, factor 0.001 / T in °C, plus 273.15 / not read: by"
    kelvin = Rod(data=thermocouples(tmp_path, False), **ROD, base=373.15, ambient=293.15)
    assert kelvin.notes == ("start: film=18",)
    np.testing.assert_allclose(celsius.d, kelvin.d, atol=1e-12)
    assert celsius.truth() is None


def test_any_start_finds_the_film_coefficient_of_a_closed_form(tmp_path: Path) -> None:
    """Within the error of 200 elements, (m dx)^2/12 = 2e-5."""
    data, found, steps = thermocouples(tmp_path, True), [], []
    for start in ("", f",film={1e-6 * H}", f",film={1e6 * H}"):
        options = f"n=200,length=400mm,diameter=12mm,conductivity={K},base=100degC,ambient=20degC{start}"
        (spec,) = problems([f"rod[data={data},{options}]"])
        ended = invert(spec, routes(["adjoint"])[0], Engine())
        assert ended.end.startswith("converged")
        found.append(np.exp(ended.p[0]))
        steps.append(len(ended.iterates))
    assert np.ptp(found) < 1e-12 * H  # for inversions start from what the data tell
    assert len({*steps}) == 1
    assert found[0] == pytest.approx(H, rel=1e-4)


def test_a_plateau_is_no_minimum(tmp_path: Path) -> None:
    """Where the first step goes to so great a loss of heat that T is that of the surroundings, J is level."""
    options = f"length=400mm,diameter=12mm,conductivity={K},base=100degC,ambient=20degC"
    (spec,) = problems([f"rod[data={thermocouples(tmp_path, True)},n=200,{options}]"])
    ended = invert(spec, routes(["adjoint"])[0], Engine(), start=np.log([1e-3 * H]))  # where the user wants it
    assert ended.end == "stopped: J is level here, p no longer matters to the data - choose another start, or bounds"
    assert np.exp(ended.p[0]) > 1e6 * H


@pytest.mark.parametrize(
    ("unknown", "known"),
    [
        ("film", {"conductivity": K, "base": "100degC"}),
        ("conductivity", {"film": H, "base": "100degC"}),
        ("film+flux", {"conductivity": K}),
        ("conductivity+flux", {"film": H}),
        ("film+conductivity", {"flux": K * M * T_0 * np.tanh(M * L)}),
    ],
)
def test_the_start_is_what_the_closed_form_tells_of_the_data(
    unknown: Any, known: dict[str, Any], tmp_path: Path
) -> None:
    """Within half a step of the m L that are tried, 2.3 % from one to the next."""
    options = {"length": "400mm", "diameter": "12mm", "ambient": "20degC"} | known
    rod = Rod(unknown=unknown, data=thermocouples(tmp_path, True), **options)
    truth = {"film": H, "conductivity": K, "flux": K * M * T_0 * np.tanh(M * L)}
    assert {name: rod.sizes[name] / truth[name] for name in truth if name in unknown} == pytest.approx(
        dict.fromkeys(unknown.split("+"), 1.0), rel=0.03
    )


def test_a_known_flux_tells_film_and_conductivity_and_a_known_base_their_ratio() -> None:
    (spec,) = problems(["rod[unknown=film+conductivity,flux=2e4,parts=2]"])
    ended = invert(spec, routes(["adjoint"])[0], Engine(optimizer="gauss-newton"))
    np.testing.assert_allclose(ended.p, spec().truth(), rtol=1e-9)
    assert any("film / conductivity alone" in note for note in Rod(unknown="film+conductivity").notes)


def test_a_finer_rod_has_the_same_parameters_and_data() -> None:
    rod = with_synthetic_data(Rod(parts=2, alpha=0.1))
    finer, p = rod.refined(rod.parameters.start)
    assert (finer.n, p.tolist()) == (40, rod.parameters.start.tolist())
    assert Model(finer).value(p) == pytest.approx(Model(rod).value(p), rel=1e-2)  # O(dx^2)


FILE = {
    "data": "rod.csv",
    "length": "400mm",
    "base": "100degC",
    "ambient": "20degC",
    "diameter": "12mm",
    "conductivity": K,
}
BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no elements": ({"n": 0}, "n=0"),
    "parts": ({"parts": 3}, "parts that divide n"),
    "alpha": ({"alpha": 1.0}, "alpha needs parts"),
    "film": ({"film": 0.0}, "film=0"),
    "diameter": ({"diameter": "3kg"}, "unit 'kg' is not known"),
    "area": ({"area": 1e-4}, "area needs perimeter"),
    "both": ({"base": 300.0, "unknown": "film+flux"}, "both at x=0"),
    "no heat": ({"base": "20degC"}, "no heat flows"),
    "no flux": ({"flux": 0.0}, "flux=0"),
    "nothing free": ({"n": 1, "tip": "300"}, "no unknown"),
    "tip": ({"tip": "open"}, "tip=open"),
    "sensors": ({"sensors": 0}, "sensors=0"),
    "noise": ({"noise": -1.0}, "noise=-1"),
    "length as noise": ({"noise": "1mm"}, "not of temperature change"),
    "no file": ({"units": "mm"}, "units needs data=FILE"),
    "no base": (FILE | {"base": None}, "do not tell base or flux - state"),
    "no ambient": (FILE | {"ambient": None, "length": None}, "do not tell length, ambient - state"),
    "no film": (FILE | {"unknown": "conductivity"}, "do not tell film - state"),
    "bare temperature": (FILE | {"ambient": 20.0}, "T of rod.csv is in degC"),
    "short": (FILE | {"length": 0.1}, "line 6: x = 0.21 m is not on the rod, from 0 to 0.1 m, nor are 1 others"),
    "pressure": (FILE | {"units": "T:Pa"}, "'Pa' is a unit of stress, not of temperature"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    thermocouples(tmp_path, True)
    options, says = BAD[case]
    with pytest.raises(InputError) as caught:
        Rod(**options)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert " - " in str(caught.value), "an error says what to do"


def test_doubtful_input_is_told(tmp_path: Path) -> None:
    data = thermocouples(tmp_path, True)
    warmer = Rod(**FILE | {"data": data, "base": "70degC"})
    assert "data lie beyond 293.15 to 343.15 K" in warmer.read_as[-1]
    assert "2 elements are coarse" in Rod(n=2).notes[0]
    cold = Rod(**FILE | {"data": data, "film": 1e6 * H})
    assert any("no heat reaches the first thermocouple at this start" in note for note in cold.notes)
    with pytest.raises(InputError, match="are not made yet"):
        Model(Rod()).value(Rod().parameters.start)
