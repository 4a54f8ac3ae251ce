"""Constants as people state them: the same law, exact derivatives, starts and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes.problems.coupon import Coupon
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.mechanics.constants import Constants
from gradient_routes.problems.mechanics.materials import LAWS, lame
from gradient_routes.problems.plate import Plate
from gradient_routes.routes.model import Model
from gradient_routes.routes.synthetic_data import with_synthetic_data

CHOICES = ("E,nu", "mu,lam", "K,G")
LINEAR = LAWS["linear"]


@pytest.mark.parametrize("choice", CHOICES)
def test_lame_constants_come_back_and_are_stable_wherever_p_is(choice: str) -> None:
    constants = Constants.parse(choice, LINEAR, "plate")
    for E, nu in ((2e11, 0.3), (1.0, -0.9), (3.0, 0.4999)):
        mu, lam = lame(E, nu)
        p = constants.of_lame(mu, lam)
        assert constants.lame(p) == pytest.approx((mu, lam), rel=1e-9)
        stated = constants.stated(p)
        assert (stated["E [Pa]"], stated["nu"]) == pytest.approx((E, nu), rel=1e-9)
    for p in np.random.default_rng(0).normal(scale=5.0, size=(20, 2)):
        mu, lam = constants.lame(p)
        assert mu > 0.0
        assert lam + 2.0 * mu / 3.0 > 0.0


@pytest.mark.parametrize("choice", CHOICES)
def test_derivatives_are_those_of_complex_steps(choice: str) -> None:
    constants, p = Constants.parse(choice, LINEAR, "plate"), np.array([0.3, 0.7])
    by_p = np.array([[q.imag / 1e-30 for q in constants.lame(p + 1e-30j * e)] for e in np.eye(2)]).T
    np.testing.assert_allclose(constants.by_p(p), by_p, rtol=1e-12)  # sums of terms ten times as large


@pytest.mark.parametrize("choice", CHOICES)
def test_R_p_by_hand_is_that_of_complex_steps_and_its_own_transpose(choice: str) -> None:
    plate = Plate(n=1, unknown="constants", constants=choice, nu=0.2)
    assert plate.solid.use_numpy
    p = plate.parameters.start
    u = Model(plate).solve(p).u
    R_p = plate.linearize(u, p).R_p
    by_step = np.stack([plate.residual(u + 0j, p + 1e-30j * e).imag / 1e-30 for e in np.eye(2)], axis=1)
    np.testing.assert_allclose(np.stack([R_p @ e for e in np.eye(2)], axis=1), by_step, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(R_p.T @ np.ones_like(u), by_step.sum(axis=0), rtol=1e-11, atol=1e-14)


def test_starts_are_those_given_and_a_stiffer_one_keeps_nu() -> None:
    plate = Plate(n=1, unknown="constants", constants="E:200GPa,nu:0.25")
    stated = plate.stated(plate.scaled(plate.parameters.start, 3.0))
    assert (stated["E [Pa]"], stated["nu"]) == pytest.approx((6e11, 0.25))
    plate = Plate(n=1, unknown="constants", constants="K:2,G:1.5")
    assert plate.solid.setup(plate.parameters.start).q == pytest.approx((1.5, 1.0))
    rubber = Plate(n=1, unknown="constants", law="mooney-rivlin", constants="C10:0.2MPa,C01:0.1MPa,c:1e6")
    assert rubber.parameters.start.tolist() == pytest.approx([2e5, 1e5, 1e6])
    assert [rubber.parameters.label(i) for i in range(3)] == ["C10", "C01", "c"]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"constants": "E,mu"}, "neo-hookean has E,nu or mu,lam or K,G, with starts as in E:1MPa,nu:0.3"),
        ({"constants": "E,nu", "law": "yeoh"}, "yeoh has c1,c2,c3,kappa"),
        ({"constants": "E:1qq,nu:0.3"}, "unit 'qq' is not known"),
        ({"constants": "E:1mm,nu:0.3"}, "'mm' is a unit of length, not of stress"),
        ({"constants": "E:-1,nu:0.3"}, "E = -1 Pa - choose E > 0"),
        ({"constants": "E,nu:0.5"}, "constants=E,nu:0.5"),
        ({"constants": "E:1,nu:0.5"}, "nu = 0.5 - the law is stable for -1 < nu < 0.5"),
        ({"constants": "mu:1,lam:-0.7"}, "choose lam > -2 mu/3"),
        ({"constants": "mu:1,lam"}, "give all or none"),
        ({"constants": "E:1,nu:0.3", "modulus": 2.0}, "modulus does not go with starts in constants"),
        ({"constants": "E,nu", "unknown": "modulus"}, "constants needs unknown=constants"),
    ],
)
def test_what_is_refused(options: dict, says: str) -> None:
    with pytest.raises(InputError) as refused:
        Plate(**{"n": 1, "unknown": "constants"} | options)
    assert says in str(refused.value)


def test_constants_of_curves_are_exact_and_named_as_the_user_does() -> None:
    coupon = Coupon(volume="compressible", constants="E:2MPa,nu:0.4", mode="uniaxial+shear", points=3)
    coupon = with_synthetic_data(coupon)
    p = coupon.parameters.start
    assert coupon.stated(p) == pytest.approx({"E [Pa]": 2e6, "nu": 0.4})
    assert Constants.parse("E,nu", LINEAR, "coupon").lame(p) == pytest.approx(lame(2e6, 0.4))
    u = Model(coupon).solve(p).u
    (S, R), e = (coupon.stresses(u, p + 1e-30j * np.eye(2)[1])), np.eye(2)[1]
    np.testing.assert_allclose(coupon.linearize(u, p).R_p @ e, R.imag / 1e-30, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(coupon.observation(u, p).S_p @ e, S.imag / 1e-30, rtol=1e-12, atol=1e-9)
    rubber = Coupon(law="mooney-rivlin", constants="C10:0.2MPa,C01:0.1MPa")
    assert rubber.parameters.start == pytest.approx([2e5, 1e5])
    with pytest.raises(InputError, match="neo-hookean has mu, with starts as in mu:1MPa"):
        Coupon(constants="E,nu")
