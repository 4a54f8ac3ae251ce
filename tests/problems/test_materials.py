"""Stored energies and their derivatives: invariance, hand-derived against AD, sums of powers, closed forms."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.assembly_jax import _second_derivative, gradient
from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.mechanics.isotropic_functions import power_trace
from gradient_routes.problems.mechanics.materials import ALPHA, LAWS, MaterialLaw, lame

E, NU = 1.7, 0.3
POINTS = 64
IDENTITY = np.eye(3)
HYPERELASTIC = [law for law in LAWS.values() if law.name != "linear"]
BY_HAND = [law for law in LAWS.values() if law.numpy]
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
by_hand = pytest.mark.parametrize("law", BY_HAND, ids=lambda law: law.name)
hyperelastic = pytest.mark.parametrize("law", HYPERELASTIC, ids=lambda law: law.name)


def random_F(*points: int, seed: int = 0, complex_: bool = False) -> np.ndarray:
    """Deformation gradients (*points, 3, 3), det F from 0.4 on: F^-1 then costs no digits."""
    rng = np.random.default_rng(seed)
    m = int(np.prod(points))
    F = IDENTITY + 0.15 * rng.standard_normal((2 * m, 3, 3))
    F = F[np.linalg.det(F) > 0.4][:m].reshape(*points, 3, 3)
    return F + 0.1j * rng.standard_normal(F.shape) if complex_ else F


def rotation(seed: int = 0) -> np.ndarray:
    Q = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    return Q * np.sign(np.linalg.det(Q))


@cache
def energies(name: str, derivative: str = "W") -> Callable[[Any, Any], np.ndarray]:
    """W, P, A or P_q by AD, of H (n_e, n_q, 3, 3) and q of (n_e,), compiled."""
    W = LAWS[name].W
    f = {"W": W, "P": gradient(W, 0), "A": _second_derivative(W), "P_q": partial(by_constants, gradient(W, 0))}[
        derivative
    ]
    return jax.jit(jax.vmap(jax.vmap(f, (0, None))))


def by_constants(P: Callable[[Any, Any], Any], H: Any, q: tuple[Any, ...]) -> tuple[Any, ...]:
    def along(i: int) -> Any:
        return jax.jvp(lambda c: P(H, (*q[:i], c, *q[i + 1 :])), (q[i],), (jnp.ones_like(q[i]),))[1]

    return tuple(along(i) for i in range(len(q)))


def at(law: MaterialLaw, derivative: str, F: np.ndarray) -> np.ndarray:
    """At points F (n, 3, 3), n <= POINTS, with the constants of (E, NU)."""
    return at_H(law, derivative, F - IDENTITY)


def at_H(law: MaterialLaw, derivative: str, H: np.ndarray) -> np.ndarray:
    """At H = F - I."""
    padded = np.concatenate([H, np.zeros((POINTS - len(H), 3, 3))])
    return np.asarray(by_ad(law, derivative, padded, np.full(POINTS, E)))[: len(H)]


def by_ad(law: MaterialLaw, derivative: str, H: np.ndarray, moduli: np.ndarray) -> Any:
    """At H (POINTS, 3, 3) with a modulus each: always of one shape, compiled once."""
    found = energies(law.name, derivative)(H[:, None], law.of_modulus(moduli, NU))
    return jax.tree.map(lambda each: np.asarray(each)[:, 0], found)


def close(a: Any, b: Any, rtol: float) -> None:
    """Entrywise, relative to the largest: entries of a tensor that vanish have no digits of their own."""
    np.testing.assert_allclose(a, b, rtol=0, atol=rtol * np.abs(b).max())


@every_law
def test_the_natural_state_is_free_of_energy_and_stress(law: MaterialLaw) -> None:
    assert abs(at(law, "W", IDENTITY[None])).max() < 1e-15 * E
    assert abs(at(law, "P", IDENTITY[None])).max() < 1e-15 * E


@every_law
def test_moduli_at_small_strains_are_those_of_linear_elasticity(law: MaterialLaw) -> None:
    mu, lam = lame(E, NU)
    one = IDENTITY
    A = lam * np.einsum("iJ,kL->iJkL", one, one)
    A += mu * (np.einsum("ik,JL->iJkL", one, one) + np.einsum("iL,kJ->iJkL", one, one))
    close(at(law, "A", one[None])[0], A, 1e-13)


@pytest.mark.parametrize(
    ("law", "hand"),
    [(law, hand) for law in LAWS.values() for hand in (False, True) if law.numpy or not hand],
    ids=lambda given: given.name if isinstance(given, MaterialLaw) else "hand" if given else "ad",
)
def test_the_stress_of_any_small_strain_has_all_its_digits(law: MaterialLaw, hand: bool) -> None:
    """P(e D)/e = A D + O(e) for strains e from 1e-2 to 1e-20, for stretches, rotations and what lies between."""
    rng = np.random.default_rng(5)
    D = rng.standard_normal((8, 3, 3)) + np.stack([IDENTITY] * 4 + [np.zeros((3, 3))] * 4)
    q = law.of_modulus(E, NU)
    linear = np.einsum("iJkL,nkL->niJ", at_H(law, "A", np.zeros((1, 3, 3)))[0], D)

    def off(e: float) -> float:
        P = law.numpy.P(e * D, q) if hand and law.numpy else at_H(law, "P", e * D)
        return float(np.abs(P / e - linear).max() / np.abs(linear).max())

    nonlinear = off(1e-2) / 1e-2
    for e in 10.0 ** -np.arange(3, 21):
        assert off(e) <= 2.0 * nonlinear * e + 1e-14


@by_hand
def test_the_derivatives_by_constants_of_any_small_strain_have_all_their_digits(law: MaterialLaw) -> None:
    D, q = np.random.default_rng(6).standard_normal((8, 3, 3)), law.of_modulus(E, NU)
    for of_constant, tiny in zip(law.numpy.P_q(1e-9 * D, q), law.numpy.P_q(1e-18 * D, q), strict=True):
        close(tiny * 1e9, of_constant, 1e-7)


@hyperelastic
def test_energies_are_objective_and_isotropic(law: MaterialLaw) -> None:
    F, Q = random_F(50), rotation()
    W = at(law, "W", F)
    close(at(law, "W", Q @ F), W, 1e-13)
    close(at(law, "W", F @ Q), W, 1e-13)
    assert W.min() > 0


def test_the_linear_energy_is_isotropic_and_invariant_to_small_rotations() -> None:
    law, F, Q = LAWS["linear"], random_F(50), rotation()
    close(at(law, "W", Q @ F @ Q.T), at(law, "W", F), 1e-13)
    close(at(law, "P", F + (Q - Q.T)), at(law, "P", F), 1e-13)


@every_law
def test_moduli_are_symmetric(law: MaterialLaw) -> None:
    A = at(law, "A", random_F(50))
    close(A.transpose(0, 3, 4, 1, 2), A, 1e-13)


@hyperelastic
def test_angular_momentum_is_balanced(law: MaterialLaw) -> None:
    """P F^T, J times Cauchy's stress, is symmetric."""
    F = random_F(50)
    tau = at(law, "P", F) @ F.transpose(0, 2, 1)
    close(tau.transpose(0, 2, 1), tau, 1e-13)


@every_law
def test_a_complex_step_of_the_energy_is_the_stress(law: MaterialLaw) -> None:
    F, h = random_F(20), 1e-30
    P = np.stack([at(law, "W", F + 1j * h * D.reshape(3, 3)).imag / h for D in np.eye(9)], axis=1).reshape(F.shape)
    close(P, at(law, "P", F), 1e-13)


@every_law
def test_third_derivatives_at_the_natural_state_are_those_of_cauchys_integral(
    law: MaterialLaw, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where stretches coincide: d^3 W/dt^3 along t D, by AD three times and by W on a circle of t."""
    D = np.random.default_rng(3).standard_normal((3, 3))
    q = law.of_modulus(E, NU)
    if law.name == "ogden":  # one term of its sum compiles in a third of the time
        monkeypatch.setattr("gradient_routes.problems.mechanics.energies.ALPHA", ALPHA[:1])
        q = (q[0], q[-1])

    def along(f: Callable[[float], Any]) -> Callable[[float], Any]:
        return lambda t: jax.jvp(f, (t,), (1.0,))[1]

    d3 = jax.jit(along(along(along(lambda t: law.W(t * D, q)))))(0.0)
    r, n = 0.1, 64  # truncated by r^64 of a series that converges beyond 0.2
    circle = r * np.exp(2j * np.pi * np.arange(n) / n)
    W = np.asarray(jax.jit(jax.vmap(law.W, (0, None)))(circle[:, None, None] * D, q))
    integral = (W / circle**3).mean()
    assert d3 == pytest.approx(6.0 * integral.real, rel=1e-9, abs=1e-10)  # rounding over r^3


@by_hand
@pytest.mark.parametrize("complex_", [False, True], ids=["real", "complex"])
@pytest.mark.parametrize("derivative", ["W", "P", "A", "P_q"])
def test_derivatives_by_hand_are_those_of_ad(law: MaterialLaw, derivative: str, complex_: bool) -> None:
    """To 1e-13: both are a few dozen operations of condition one away from F."""
    F = random_F(301, 8, seed=1, complex_=complex_)  # more points than are treated at a time
    moduli = np.linspace(1.0, 3.0, 301) * (1.0 + 0.1j if complex_ else 1.0)
    q = law.of_modulus(moduli, NU)
    byhand = getattr(law.numpy, derivative)(F - IDENTITY, tuple(c[:, None] for c in q))
    some = np.linspace(0, 300, POINTS).astype(int), np.arange(POINTS) % 8
    ad = jax.tree.leaves(by_ad(law, derivative, F[some] - IDENTITY, moduli[some[0]]))
    for a, b in zip(byhand if derivative == "P_q" else [byhand], ad, strict=True):
        assert a.dtype == F.dtype
        close(a[some], b, 1e-13)


@by_hand
@pytest.mark.parametrize("derivative", ["W", "P", "A"])
def test_derivatives_by_hand_take_any_number_of_points_and_constants(law: MaterialLaw, derivative: str) -> None:
    f, q, H = getattr(law.numpy, derivative), law.of_modulus(E, NU), random_F(4) - IDENTITY
    close(f(H, q)[2], f(H[2], q), 1e-14)  # sums are taken in another order
    close(f(H, tuple(np.full(4, c) for c in q)), f(H, q), 1e-14)
    close(f(H[2], tuple(np.full((5, 1), c) for c in q))[4, 0], f(H[2], q), 1e-14)
    assert f(H[:0], q).shape == (0, *f(H[2], q).shape)


@by_hand
def test_a_body_turned_inside_out_has_no_number(law: MaterialLaw) -> None:
    H, q = np.diag([0.0, 0.0, -2.0]), law.of_modulus(E, NU)
    assert np.isnan(law.W(H, q))
    assert np.isnan(law.numpy.W(H, q))
    assert np.isnan(law.numpy.P(H, q)).all()
    assert np.isnan(gradient(law.W, 0)(H, q)).all()


@pytest.mark.parametrize("s", [0.65, 2.5, -1.0, 0.0, 2.0, 3.0, 1.3, -0.4, 3.9])
def test_sums_of_powers_are_those_of_eigenvalues(s: float) -> None:
    corners = np.stack(np.meshgrid(*3 * [[1 / 3, 1.0, 3.0]]), axis=-1).reshape(-1, 3)  # where it is least exact
    stretches = np.vstack([corners, 3.0 ** np.random.default_rng(0).uniform(-1, 1, (200, 3))])
    F = rotation(1) * stretches[:, None] @ rotation(2)
    x = np.linalg.eigvalsh(F.transpose(0, 2, 1) @ F)
    e = x.sum(axis=1), x[:, 0] * x[:, 1] + x[:, 1] * x[:, 2] + x[:, 2] * x[:, 0], x.prod(axis=1)
    np.testing.assert_allclose(jax.vmap(partial(power_trace, s=s))(*e), (x**s).sum(axis=1), rtol=5e-12)


def test_ogdens_energy_is_that_of_principal_stretches() -> None:
    law, F = LAWS["ogden"], random_F(64)
    stretches, J = np.linalg.svd(F)[1], np.linalg.det(F)
    *mu, kappa = law.of_modulus(E, NU)
    W = kappa / 4 * (J**2 - 1 - 2 * np.log(J))
    for mu_r, alpha in zip(mu, ALPHA, strict=True):
        W += mu_r / alpha * (((stretches / J[:, None] ** (1 / 3)) ** alpha).sum(axis=1) - 3)
    close(at(law, "W", F), W, 1e-13)


def neo_hookean_stress(s: float, t: float, mu: float, lam: float) -> float:
    return mu * s + (lam * np.log(s * t * t) - mu) / s


def mooney_rivlin_stress(s: float, t: float, c1: float, c2: float, c: float) -> float:
    J = s * t * t
    return 2 * c1 * s + 4 * c2 * s * t * t + (2 * c * (J - 1) * J - 2 * (c1 + 2 * c2)) / s


def yeoh_stress(s: float, t: float, c1: float, c2: float, c3: float, kappa: float) -> float:
    J = s * t * t
    x = (s * s + 2 * t * t) / J ** (2 / 3) - 3
    return (c1 + 2 * c2 * x + 3 * c3 * x * x) * 4 / 3 * (s - t * t / s) / J ** (2 / 3) + kappa / 2 * (J - 1 / J) * J / s


def ogden_stress(s: float, t: float, *q: float) -> float:
    *mu, kappa = q
    J = s * t * t
    iso = sum(m * 2 / 3 * (s**a - t**a) / J ** (a / 3) for m, a in zip(mu, ALPHA, strict=True))
    return iso / s + kappa / 2 * (J - 1 / J) * J / s


def linear_stress(s: float, t: float, mu: float, lam: float) -> float:
    return 2 * mu * (s - 1) + lam * (s - 1 + 2 * (t - 1))


STRESS = {
    "neo-hookean": neo_hookean_stress,
    "mooney-rivlin": mooney_rivlin_stress,
    "yeoh": yeoh_stress,
    "ogden": ogden_stress,
    "linear": linear_stress,
    "arap": lambda s, t, mu, lam: 2.0 * mu * (s - 1.0) + lam * (s * t * t - 1.0) * t * t,
}


@every_law
@pytest.mark.parametrize(("s", "t"), [(1.5, 1.0), (2.5, 0.7), (0.6, 1.2)])
def test_a_uniaxial_stretch_has_the_stress_of_the_closed_form(law: MaterialLaw, s: float, t: float) -> None:
    P = at(law, "P", np.diag([s, t, t])[None])[0]
    q = law.of_modulus(E, NU)
    assert P[0, 0] == pytest.approx(STRESS[law.name](s, t, *q), rel=1e-12)
    assert P[1, 1] == pytest.approx(P[2, 2], rel=1e-13)
    assert abs(P - np.diag(np.diag(P))).max() < 1e-14 * E


@every_law
def test_constants_are_linear_in_the_modulus_and_pass_every_kind_of_it(law: MaterialLaw) -> None:
    moduli = np.array([0.5, 1.0, 2.0])
    q = law.of_modulus(1.0, NU)
    assert len(q) == len(law.constants) == len(law.positive)
    for E in (moduli, moduli * (1 + 1e-30j), jnp.asarray(moduli)):
        for c, one in zip(law.of_modulus(E, NU), q, strict=True):
            np.testing.assert_allclose(c, E * one, rtol=1e-14)
    _, dq = jax.jvp(lambda E: law.of_modulus(E, NU), (1.0,), (1.0,))
    np.testing.assert_allclose(dq, q, rtol=1e-14)
    law.check(law.of_modulus(moduli, NU))


def test_an_energy_without_lower_bound_is_refused() -> None:
    law = LAWS["mooney-rivlin"]
    law.check(law.of_modulus(1.0, 0.15))
    q = law.of_modulus(1.0, 0.1)
    assert law.W(19.0 * IDENTITY, q) < 0
    with pytest.raises(InputError, match=r"mooney-rivlin: c = -0.0340909 Pa, so .* - choose c > 0") as caught:
        law.check(q)
    assert "\n" not in str(caught.value)
