"""The coupon against closed forms of rubber elasticity and the complex step; constants found again; its data files."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROOT, relative_error
from scipy.optimize import brentq
from test_materials import STRESS

from gradient_routes.bench.cases.case import problems, routes
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.bench.inversion.optimizers import Limits
from gradient_routes.problems.coupon import Coupon
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.mechanics.homogeneous import MODES
from gradient_routes.problems.mechanics.materials import ALPHA, LAWS
from gradient_routes.problems.mechanics.stability import stable_range
from gradient_routes.problems.problem import Array
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent

RUBBERS = ("neo-hookean", "mooney-rivlin", "yeoh", "ogden")
VOLUMES = ("incompressible", "compressible")
EVERY = ["+".join(names) for k in (1, 2, 3) for names in combinations(MODES, k)]
TIGHT = Solver(rtol=1e-14)
M = 12  # data of all curves together: one size, compiled once for each law


def options(mode: str, law: str, volume: str) -> dict[str, Any]:
    return {"mode": mode, "law": law, "volume": volume, "points": M // len(mode.split("+"))}


def energy_slopes(law: str, q: Array, lam: Array, t: Array) -> Array:
    """dW/dlambda_i of the principal stretches of an incompressible specimen, without the pressure, (3, m)."""
    s = np.stack([lam, *t])
    I1 = (s**2).sum(axis=0)
    if law == "ogden":
        return np.asarray(sum(mu * s ** (alpha - 1.0) for mu, alpha in zip(q, ALPHA, strict=True)))
    if law == "mooney-rivlin":
        return np.asarray(2.0 * s * (q[0] + q[1] * (I1 - s**2)))
    c = (q[0] / 2.0, 0.0, 0.0) if law == "neo-hookean" else q
    return np.asarray(2.0 * s * (c[0] + 2.0 * c[1] * (I1 - 3.0) + 3.0 * c[2] * (I1 - 3.0) ** 2))


@pytest.mark.parametrize("law", RUBBERS)
def test_incompressible_curves_are_those_of_the_textbook(law: str) -> None:
    """P_11 = W_1 - W_3 lambda_3 / lambda_1 with the principal stretches (Ogden 1984, sec. 7.2)."""
    coupon = with_synthetic_data(Coupon(**options("+".join(MODES), law, "incompressible")))
    lam, modes = coupon.states.stretch, np.array(coupon.modes)
    across = np.select([modes == "uniaxial", modes == "equibiaxial"], [lam**-0.5, lam], 1.0)
    thin = np.select([modes == "uniaxial", modes == "equibiaxial"], [lam**-0.5, lam**-2.0], 1.0 / lam)
    W = energy_slopes(law, coupon.truth(), lam, np.stack([across, thin]))
    np.testing.assert_allclose(coupon.d, W[0] - W[2] * thin / lam, rtol=1e-12)


@pytest.mark.parametrize("law", ["neo-hookean", "mooney-rivlin"])
def test_compressible_curves_are_free_of_stress_across(law: str) -> None:
    coupon = with_synthetic_data(Coupon(**options("uniaxial", law, "compressible")))
    truth, lam = coupon.truth(), coupon.states.stretch
    t = 1.0 + Model(coupon, TIGHT).solve(truth).u
    np.testing.assert_allclose(STRESS[law](lam, t, *truth), coupon.d, rtol=1e-12)
    assert (t > lam**-0.5).all()  # volume grows in tension
    assert np.abs(coupon.residual(t - 1.0, truth)).max() < 1e-14


# complex kernels of the other laws of compressible rubber compile for 2 to 20 s
EXACT = [*((law, "incompressible") for law in RUBBERS), ("neo-hookean", "compressible")]


@pytest.mark.parametrize(("law", "volume"), EXACT)
def test_every_exact_route_gives_the_gradient(law: str, volume: str) -> None:
    coupon = with_synthetic_data(Coupon(**options("+".join(MODES), law, volume), alpha=1e-3))
    p = coupon.parameters.start * np.linspace(0.9, 1.2, len(coupon.parameters))
    exact = complex_step.prepare(Model(coupon, TIGHT), p)(p).gradient
    by_jax = [implicit_ad] if law == "neo-hookean" else []
    for route in (tangent, adjoint, *by_jax):
        assert relative_error(route.prepare(Model(coupon, TIGHT), p)(p).gradient, exact) < 1e-12, route.name


@pytest.mark.parametrize("volume", VOLUMES)
@pytest.mark.parametrize("law", RUBBERS)
def test_every_combination_of_curves_gives_its_constants_back(law: str, volume: str) -> None:
    engine = Engine("gauss-newton", Limits(100, 1e-15))
    # compressible rubber, which takes long, has all curves at once, and one alone; one curve tells the four constants
    # of Ogden's law so badly that it takes hundreds of steps
    some = [EVERY[0], EVERY[-1]] if law == "neo-hookean" else EVERY[-1:]
    every = EVERY if volume == "incompressible" else some
    for mode in every:
        given = ",".join(f"{name}={value}" for name, value in options(mode, law, volume).items())
        (spec,) = problems([f"coupon[{given}]"])
        made = spec()
        ended = invert(spec, routes(["adjoint"])[0], engine, made=made)
        if (mode, law, volume) == ("shear", "mooney-rivlin", "incompressible"):
            assert made.notes == ("curves of shear alone tell c1 + c2, neither of them: I1 = I2 - add another mode",)
            assert ended.p.sum() == pytest.approx(made.truth().sum(), rel=1e-9)
        else:
            np.testing.assert_allclose(ended.p, made.truth(), rtol=1e-6, err_msg=mode)


def test_a_law_is_stable_as_far_as_its_curve_rises_and_drucker_s_work_is_positive() -> None:
    """Yeoh's law with c2 = -c1/10, in tension up to the largest stress, in compression up to that of lambda P."""
    coupon, q = Coupon(mode="uniaxial+shear", law="yeoh", points=M // 2), np.array([1.0, -0.1, 0.0, 0.0])
    i1 = np.polynomial.Polynomial([2.0, -3.0, 0.0, 1.0])  # lambda (I1 - 3) = lambda^3 - 3 lambda + 2

    def P(lam: float) -> float:
        return 2.0 * (lam - lam**-2.0) * (1.0 - 0.2 * i1(lam) / lam)

    def slope(f: Any, lam: float) -> float:
        return float((f(lam + 1e-5) - f(lam - 1e-5)) / 2e-5)

    least = brentq(lambda lam: slope(lambda x: x * P(x), lam), 0.2, 0.9)
    most = brentq(lambda lam: slope(P, lam), 1.1, 3.0)
    found = stable_range(lambda H: coupon._principal(H, q), "uniaxial", incompressible=True)
    np.testing.assert_allclose(found, (least, most), rtol=np.log(100.0) / 199 * 1.01)  # a step of the stretches tried
    assert stable_range(lambda H: coupon._principal(H, -q), "uniaxial", incompressible=True) is None


def test_stability_of_a_compressible_law_is_that_of_a_nearly_incompressible_one() -> None:
    law, coupon = LAWS["mooney-rivlin"], Coupon(mode="uniaxial", law="mooney-rivlin", points=M)
    q = np.array(law.of_modulus(1.0, 0.4999))
    q[1] = -0.05 * q[0]  # softens in equibiaxial tension
    for mode in MODES:
        one, other = (stable_range(lambda H: coupon._principal(H, q), mode, closed) for closed in (True, False))
        assert (one is None, other is None) == (False, False)
        np.testing.assert_allclose(one, other, rtol=0.05, err_msg=mode)


@pytest.mark.parametrize("optimizer", ["gauss-newton", "lbfgs"])
def test_any_start_and_any_unit_of_stress_give_the_same_constants_in_as_many_steps(
    optimizer: Any, tmp_path: Path
) -> None:
    """L-BFGS called three times the constants converged: its tolerance was relative to the slope at the start."""
    lam = np.linspace(1.1, 3.0, M)
    i1, t = lam**2 + 2.0 / lam - 3.0, lam**-0.5
    P = 2.0 * (lam - t**2 / lam) * (0.19e6 - 4e3 * i1 + 150.0 * i1**2)
    P = P * (1.0 + 1e-3 * np.random.default_rng(0).standard_normal(M))
    found = []
    for unit, modulus in ((1.0, None), (1.0, 1.0), (1.0, 1e12), (1e6, None), (1e9, None)):
        path = tmp_path / f"{unit:g}.csv"
        np.savetxt(path, np.stack([lam, P / unit], 1), "%.17g", ",", header="stretch,stress", comments="")
        given = "" if modulus is None else f",modulus={modulus}"
        (spec,) = problems([f"coupon[law=yeoh,mode=uniaxial,data={path}{given}]"])
        ended = invert(spec, routes(["adjoint"])[0], Engine(optimizer))
        found.append((ended.p * unit, len(ended.iterates)))
    for p, steps in found[1:]:
        np.testing.assert_allclose(p, found[0][0], rtol=1e-6)
        assert abs(steps - found[0][1]) <= 2


def curve(folder: Path, text: str) -> str:
    path = folder / "curves.csv"
    path.write_text(text)
    return str(path)


TWO = "stretch;stress [MPa];mode\n1,5;1,1;uniaxial\n2;1,9;uniaxial\n\n# dry\n1,2;0,8;equibiaxial\n1,5;1,5;equibiaxial\n"


def test_curves_of_a_file_are_told_apart_by_their_mode(tmp_path: Path) -> None:
    data = curve(tmp_path, TWO)
    coupon = Coupon(data=data, noise="5kPa")
    assert list(coupon.modes) == ["uniaxial"] * 2 + ["equibiaxial"] * 2
    np.testing.assert_allclose(coupon.states.stretch, [1.5, 2.0, 1.2, 1.5])
    np.testing.assert_allclose(coupon.d, [1.1e6, 1.9e6, 0.8e6, 1.5e6])
    assert coupon.noise == 5e3
    assert coupon.notes[0] == "read stretch, mode as given / stress in MPa, factor 1e+06"
    one = Coupon(data=data, mode="equibiaxial")
    np.testing.assert_allclose(one.d, [0.8e6, 1.5e6])
    assert "2 rows of other modes are left out" in one.notes


@pytest.mark.parametrize(("header", "unit"), [("stress [MPa]", 1e6), ("stress", 1.0)])
def test_a_file_starts_at_its_modulus_in_any_unit(header: str, unit: float, tmp_path: Path) -> None:
    """The start is the answer where the data are neo-Hookean and incompressible: mu (lambda - lambda^-2)."""
    lam, mu = np.array([0.7, 1.3, 1.9]), 0.4
    rows = [f"{x!r},{s!r}" for x, s in zip(lam.tolist(), (mu * (lam - lam**-2)).tolist(), strict=True)]
    coupon = Coupon(data=curve(tmp_path, "\n".join([f"stretch,{header}", *rows])), mode="uniaxial")
    np.testing.assert_allclose(coupon.parameters.start, [mu * unit], rtol=1e-14)
    assert coupon.truth() is None
    state = Model(coupon).solve(coupon.parameters.start)
    assert state.J < 1e-28 * unit**2
    remarks = coupon.view(state.p, state.u, None).remarks
    assert remarks[0].startswith("uniaxial: rms misfit")
    assert remarks[0].endswith("of the largest stress")


def test_the_criterion_of_akaike_tells_the_law_that_made_the_data() -> None:
    """Of the curves that are kept as an example, by Yeoh's law; the linear least-squares answers by NumPy."""
    aic = {}
    for law in RUBBERS:
        coupon = Coupon(data=str(ROOT / "examples" / "measured" / "rubber.csv"), law=law)
        p, u = coupon.parameters.start, coupon.initial(coupon.parameters.start)
        A = coupon.observation(u, p).S_p + coupon.linearize(u, p).R_p / coupon.states.stretch[:, None]
        p = np.linalg.lstsq(A, coupon.d)[0]
        state = Model(coupon).solve(p)
        rss, m = 2.0 * state.J, len(coupon.d)
        (said,) = (remark for remark in coupon.view(p, state.u, None).remarks if remark.startswith("AIC"))
        assert float(said[6:].partition(":")[0]) == pytest.approx(m * np.log(rss / m) + 2 * (len(p) + 1), abs=0.1)
        aic[law] = m * np.log(rss / m) + 2 * (len(p) + 1)
    assert min(aic, key=aic.__getitem__) == "yeoh"


BAD: dict[str, tuple[dict[str, Any], str, str]] = {
    "no stretch": ({"mode": "uniaxial"}, "stretch,stress\n1.5,1\n0,2\n", "line 3: stretch 0 is no length"),
    "unknown in the file": ({}, TWO.replace("2;1,9;uniaxial", "2;1,9;torsion"), "line 3: mode 'torsion' is not known"),
    "without data": ({"mode": "shear"}, TWO, "no row is of mode shear - choose among uniaxial, equibiaxial"),
    "which mode": ({"mode": "uniaxial+shear"}, "stretch,stress\n1.5,1\n", "no column mode tells"),
    "no mode": ({}, "stretch,stress\n1.5,1\n", "no column mode tells"),
    "strain": ({"mode": "uniaxial"}, "strain,stress\n0.5,1\n", "no column stretch"),
    "opposite": ({"mode": "uniaxial"}, "stretch,stress\n1.5,-1\n", "do not go together"),
    "unit of the mode": ({"units": "mode:mm"}, TWO, "leave the unit out"),
    "synthetic options": ({"points": 3}, TWO, "points"),
    "noise": ({"noise": 0.0}, TWO, "> 0, or leave it out"),
}
BAD_ALONE: dict[str, tuple[dict[str, Any], str]] = {
    "mode": ({"mode": "torsion"}, "mode=torsion: 'torsion' - choose each once among uniaxial, equibiaxial, shear"),
    "twice": ({"mode": "shear+shear"}, "choose each once"),
    "linear": ({"law": "linear"}, "take volume=compressible"),
    "nu": ({"nu": 0.5, "volume": "compressible"}, "nu=0.5"),
    "nu of what": ({"nu": 0.3}, "nu needs volume=compressible"),
    "Mooney's nu": ({"law": "mooney-rivlin", "nu": 0.1, "volume": "compressible"}, "c = -0.03"),
    "stretch": ({"stretch": -1.0}, "stretch=-1"),
    "at rest": ({"stretch": 1.0}, "stretch=1"),
    "points": ({"points": 0}, "points=0"),
    "modulus": ({"modulus": 0.0}, "modulus=0"),
    "no file": ({"units": "MPa"}, "units needs data=FILE"),
}


@pytest.mark.parametrize("case", [*BAD, *BAD_ALONE])
def test_bad_input_is_one_line(case: str, tmp_path: Path) -> None:
    if case in BAD:
        given, text, says = BAD[case]
        given = given | {"data": curve(tmp_path, text)}
    else:
        given, says = BAD_ALONE[case]
    with pytest.raises(InputError) as caught:
        Coupon(**given)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert " - " in str(caught.value), "an error says what to do"
