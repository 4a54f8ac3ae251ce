"""The coupon: homogeneous specimens under given stretches, whose nominal stress tells the constants q of a law.

F = diag(lambda, ..) of each datum by its mode, see `mechanics/homogeneous.py`. With P = dW/dF,

    compressible      u = t - 1 at each datum,             R = P_33(u, q),             stress P_11
    incompressible    u = the pressure of J = 1 [Pa],      R = u - t P_33(q),          stress P_11 - u/lambda
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.data.curves import read_curves
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.data.regularization import Prior
from gradient_routes.problems.data.units import standard_deviation
from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.matrices.sparse import SymmetricPattern, SymmetricSparse
from gradient_routes.problems.mechanics.constants import Constants
from gradient_routes.problems.mechanics.homogeneous import MODES, States
from gradient_routes.problems.mechanics.stability import STRETCHES, stable_range
from gradient_routes.problems.problem import (
    Array,
    End,
    Linearization,
    Offers,
    Parameters,
    ParameterView,
    Problem,
    Traced,
)

TRUE = np.array([1.3, 0.8, 1.2, 1.1])  # of synthetic data, in units of the start
POINTS_MAX = 10**5


class Coupon(Problem):
    """Stress-stretch curves of rubber: the constants of a stored energy sought from nominal stresses.

    State u (m,), for each datum its thinning t - 1, or the pressure [Pa] of an incompressible material, of which the
    last constant of a law is no parameter. J = 1/2 |P_11 - d|^2 [Pa2] over all points of all curves. Without data, the
    curves are those of 1.3, 0.8, 1.2 and 1.1 times the constants of the start.
    """

    name = "coupon"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    from_rest = True
    regularization: Prior

    def __init__(
        self,
        *,
        mode: Annotated[
            str | None, "uniaxial, equibiaxial, shear, or uniaxial+shear.. [uniaxial; all of a file]"
        ] = None,
        law: Annotated[Literal["neo-hookean", "mooney-rivlin", "yeoh", "ogden", "linear"], "W"] = "neo-hookean",
        volume: Annotated[Literal["incompressible", "compressible"], "whether it may change"] = "incompressible",
        modulus: Annotated[float | None, "E of the start [Pa] [1; fitted to a file]"] = None,
        nu: Annotated[float, "of the start, of a compressible material"] = 0.45,
        constants: Annotated[
            str | None, "that are unknown: C10,C01 .., compressible E,nu mu,lam K,G; with starts as in C10:0.2MPa"
        ] = None,
        stretch: Annotated[float, "last one of synthetic curves, from 1"] = 2.0,
        points: Annotated[int, "of a synthetic curve"] = 8,
        data: Annotated[str | None, "file of columns stretch,stress, and mode if several [synthetic]"] = None,
        columns: Annotated[str | None, "of the file, stretch:NAME,stress:NAME [by its header]"] = None,
        units: Annotated[str | None, "of the file, such as MPa [the header's, else Pa]"] = None,
        noise: Annotated[
            float | str | None, "standard deviation of a file's data, added to others [Pa], or 5kPa"
        ] = None,
        seed: Annotated[int, "of that noise"] = 0,
        alpha: Annotated[float, "weight of Phi = 1/2 |(q - q_0)/s|^2, from the start q_0 of sizes s [Pa2]"] = 0.0,
    ) -> None:
        from gradient_routes.problems.mechanics.materials import LAWS
        from gradient_routes.problems.mechanics.principal_stress import stress

        self.law, self.incompressible = LAWS[law], volume == "incompressible"
        asked = [] if mode is None else [part.strip() for part in mode.split("+")]
        _check(asked, law, self.incompressible, nu, stretch, points, seed)
        check_applies(
            "coupon",
            ("data=FILE", data is not None, True, {"columns": columns, "units": units}),
            ("data=FILE", data is not None, False, {"stretch": stretch != 2.0, "points": points != 8}),
            ("volume=compressible", not self.incompressible, True, {"nu": nu != 0.45}),
            ("starts in constants", ":" in (constants or ""), False, {"modulus": modulus is not None}),
        )
        self.noise, self.seed = standard_deviation(noise, data is not None, "coupon", "stress"), seed
        self.d: Array | None = None
        self.modes: Sequence[str]
        if data is None:
            asked = asked or ["uniaxial"]
            lam = np.tile(1.0 + (stretch - 1.0) * np.arange(1, points + 1) / points, len(asked))
            self.modes = [name for name in asked for _ in range(points)]
        else:
            curves = read_curves(data, asked, [*MODES], columns, units, self.noise)
            self.modes, lam, self.d, self.noise = curves.modes, curves.stretch, curves.stress, curves.sigma
            self.read_as, self.measured = curves.notes, True
        self.states, self.n_state, self.synthetic = States.of(self.modes, lam), len(lam), data is None
        self.stress = stress(law)
        self.linear = self.incompressible or law == "linear"
        self.structure = "spd" if self.incompressible else "symmetric"
        self.offset = 0.0 if self.incompressible else 1.0
        self.pattern = SymmetricPattern.of_elements(np.arange(self.n_state)[:, None], self.n_state)
        stated = None if constants is None else Constants.parse(constants, LAWS[law], "coupon", self.incompressible)
        self.constants = stated
        fitted = modulus is None and data is not None and not (stated and {*stated.start} - {"nu"})
        tells = None if data is None else self._fitted()
        if fitted and tells is None:
            raise InputError(
                "coupon: stresses and stretches of the data do not go together - tension is > 0, at stretch > 1"
            )
        E = modulus if modulus is not None else tells if fitted and tells else 1.0
        if not 1e-30 <= E <= 1e30:
            raise InputError(f"coupon: modulus={E:g} Pa - choose one from 1e-30 to 1e30")
        if data is not None and (fitted or modulus is not None):
            self.read_as = (*self.read_as, f"start: a modulus of {E:.4g} Pa")
        E, nu = (E, nu) if stated is None else stated.small_strain(E, nu)
        of_shear = 2.0 * (1.0 + nu) / 3.0 if self.incompressible else 1.0  # mu = E/3
        q = np.array(self.law.of_modulus(of_shear * E, nu))
        self.law.check(tuple(q))
        self.n_param = len(q) - self.incompressible
        start = q[: self.n_param]
        scale = np.abs(start) * (tells or E) / E  # of the data, wherever the start is
        self.parameters = Parameters(
            start=start,
            scale=scale,
            lower=np.where(self.law.positive[: self.n_param], 0.0, -np.inf),
            unit="Pa",
            label=self.law.constants.__getitem__,
        )
        if stated is not None:
            self.parameters = stated.parameters(start, self.parameters)
        self.regularization = Prior(alpha, "amplitude", origin=self.parameters.start, scale=self.parameters.scale)
        self.regularization.check("coupon")
        same = law == "mooney-rivlin" and self.incompressible and {*self.modes} == {"shear"}
        blind = ("curves of shear alone tell c1 + c2, neither of them: I1 = I2 - add another mode",) if same else ()
        self.read_as = (*self.read_as, *blind) if data is not None else self.read_as
        self.notes = self.read_as if data is not None else blind

    def _fitted(self) -> float | None:
        """E of the incompressible neo-Hookean curves E/3 (lambda - t^2/lambda) with the least |P_11 - d|^2; None if it
        is not > 0.
        """
        lam = self.states.stretch
        f = (lam - (1.0 + self.states.isochoric) ** 2 / lam) / 3.0
        d = self._data()
        return float(f @ d / (f @ f)) if f @ d > 0.0 else None

    # --- the equations

    @cached_property
    def _isochoric_basis(self) -> Array:
        """B (m, 2, n_p) of P_11 and P_33 where J = 1; the last constant of a law does nothing there."""
        return np.asarray(self.stress.basis(self.states.strains(self.states.isochoric)))[:, :, : self.n_param]

    def _basis(self, u: Any, xp: Any = np) -> Any:
        """B (m, 2, n_p), P_11 and P_33 by p."""
        return xp.asarray(self._isochoric_basis if self.incompressible else self.stress.basis(self.states.strains(u)))

    def _q(self, p: Any, xp: Any = np) -> Any:
        """Constants of the law (n_p,)."""
        return xp.stack(self.constants.lame(p, xp)) if self.constants and self.constants.paired else p

    def _by_p(self, B: Array, p: Array) -> Array:
        """B (m, n_p) by constants of the law, by p."""
        return B @ self.constants.by_p(p) if self.constants and self.constants.paired else B

    def stresses(self, u: Any, p: Any, xp: Any = np) -> tuple[Any, Any]:
        """The nominal stress of every datum and R, both (m,) [Pa]."""
        P = self._basis(u, xp) @ self._q(p, xp)
        if not self.incompressible:
            return P[:, 0], P[:, 1]
        return P[:, 0] - u / self.states.stretch, u - (1.0 + self.states.isochoric) * P[:, 1]

    def initial(self, p: Array) -> Array:
        u = np.zeros_like(self.states.isochoric) if self.incompressible else self.states.isochoric
        return u.astype(p.dtype)

    def residual(self, u: Any, p: Any, xp: Any = np) -> Any:
        return self.stresses(u, p, xp)[1]

    def tangent(self, u: Array, p: Array) -> SymmetricSparse:
        """The diagonal dR/du."""
        return self.pattern.assemble(np.ones_like(u) if self.incompressible else self._by_u(u, p)[:, 1])

    def _by_u(self, u: Array, p: Array) -> Array:
        """dP_11/du and dP_33/du, (m, 2)."""
        return np.asarray(self.stress.along(self.states.strains(u), self.states.thinned) @ self._q(p))

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        """J = 1/2 |P_11 - d|^2 + alpha Phi [Pa2]."""
        J = 0.5 * xp.sum((self.stresses(u, p, xp)[0] - self._data()) ** 2)
        return J + self.regularization.value(xp, p) if self.alpha else J

    def linearize(self, u: Array, p: Array) -> Linearization:
        (S_u, S_p), R_p = self._sensing(u, p)
        misfit = self.stresses(u, p)[0] - self._data()
        J_p = S_p.T @ misfit
        return Linearization(R_p, S_u * misfit, J_p + self.regularization.gradient(p) if self.alpha else J_p)

    def _sensing(self, u: Array, p: Array) -> tuple[tuple[Array, Array], Array]:
        """dS/du (m,), the diagonal, dS/dp (m, n_p) of the stresses S, and R_p (m, n_p)."""
        B = self._basis(u)
        if self.incompressible:
            return (-1.0 / self.states.stretch, B[:, 0]), -(1.0 + self.states.isochoric)[:, None] * B[:, 1]
        return (self._by_u(u, p)[:, 0], self._by_p(B[:, 0], p)), self._by_p(B[:, 1], p)

    def observation(self, u: Array, p: Array) -> Observation:
        from scipy import sparse

        (S_u, S_p), _ = self._sensing(u, p)
        label = [f"{mode} {lam:.4g}" for mode, lam in zip(self.modes, self.states.stretch, strict=True)]
        at, mode, by_u = self.states.stretch[:, None], np.array(self.modes), sparse.diags_array(S_u).tocsr()
        S, name = self.stresses(u, p)[0], label.__getitem__
        return Observation(S, self._data(), by_u, S_p, self.noise, name, position=at, quantity=mode)

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        return self.regularization, p, np.ones_like(p)

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jnp

        return Traced(residual=lambda u, p: self.residual(u, p, jnp), objective=lambda u, p: self.objective(u, p, jnp))

    # --- a start of the size of the data

    def scaled(self, p: Array, factor: float) -> Array | None:
        """Of data, here stresses, 1 / factor times as large; None where p are not linear in them."""
        return None if self.constants and self.constants.paired else p / factor

    def stiffened(self, factor: float) -> Coupon:
        other = copy.copy(self)
        other.parameters = replace(self.parameters, start=self.parameters.start / factor)
        return other

    # --- data

    def _data(self) -> Array:
        if self.d is None:
            raise InputError(
                "coupon: synthetic data are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(coupon)"
            )
        return self.d

    def truth(self) -> Array | None:
        if not self.synthetic:
            return None
        paired = self.constants is not None and self.constants.paired
        return self.parameters.start + 0.2 if paired else self.parameters.start * TRUE[: self.n_param]

    def stated(self, p: Array) -> Mapping[str, Any]:
        return self.constants.stated(p) if self.constants and self.constants.paired else {}

    def ends(self, p: Array) -> list[End]:
        return self.constants.ends(p) if self.constants and self.constants.paired else []

    def twin(self) -> Coupon | None:
        return self._with_data(np.zeros(self.n_state)) if self.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> Coupon:
        truth = self.truth()
        assert truth is not None
        rng = np.random.default_rng(self.seed if seed is None else seed)
        return self._with_data(self.stresses(u, truth)[0] + self.noise * rng.standard_normal(self.n_state))

    def _with_data(self, d: Array) -> Coupon:
        other = copy.copy(self)
        other.d = d
        return other

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        """The misfit of each curve and the criterion of Akaike (1974), in remarks.

        AIC = m ln(rss/m) + 2 (n_p + 1), from m stresses of one unknown noise, in Pa.
        """
        off, modes = self.stresses(u, p)[0] - self._data(), np.array(self.modes)
        said = []
        for mode in dict.fromkeys(self.modes):
            at = modes == mode
            rms, size = np.sqrt(np.mean(off[at] ** 2)), np.abs(self._data()[at]).max()
            said.append(f"{mode}: rms misfit {rms:.3g} Pa of {at.sum()} points, {rms / size:.2g} of the largest stress")
        rss, m = off @ off, len(off)
        if rss > 0.0:
            said.append(f"AIC = {m * np.log(rss / m) + 2 * (len(p) + 1):.1f}: of several laws the least is the best")
        return ParameterView(remarks=(*said, *self._stability(p)))

    def _stability(self, p: Array) -> list[str]:
        """Of every mode, measured or not."""
        if self.law.name == "linear":
            return []
        q, said = np.append(self._q(p), np.zeros(int(self.incompressible))), []
        for mode in MODES:
            found = stable_range(lambda H: self._principal(H, q), mode, self.incompressible)
            where = "at no stretch" if found is None else f"at stretches {found[0]:.3g} to {found[1]:.3g}"
            said.append(f"{mode}: stable {where}, of {STRETCHES[0]:g} to {STRETCHES[-1]:g}")
        return said

    def _principal(self, H: Array, q: Array) -> Array:
        """P_i (m, 3) of diagonals of H (m, 3), as many at a time as there are data: of that size it is compiled."""
        turned = np.concatenate([np.roll(H, -i, axis=1) for i in range(3)])  # P_11 is the first of a turned H
        pieces = -(-len(turned) // self.n_state)
        padded = np.zeros((pieces * self.n_state, 3))
        padded[: len(turned)] = turned
        P = [np.asarray(self.stress.basis(some))[:, 0] @ q for some in np.split(padded, pieces)]
        return np.concatenate(P)[: len(turned)].reshape(3, -1).T


def _check(asked: list[str], law: str, incompressible: bool, nu: float, stretch: float, points: int, seed: int) -> None:
    """Raises InputError."""
    for name in asked:
        if name not in MODES or asked.count(name) > 1:
            raise InputError(f"coupon: mode={'+'.join(asked)}: '{name}' - choose each once among {', '.join(MODES)}")
    if law == "linear" and incompressible:
        raise InputError(
            "coupon: law=linear has no state of constant volume at finite strain - take volume=compressible"
        )
    if not -1.0 < nu < 0.5 - 1e-9:
        raise InputError(f"coupon: nu={nu:g} - choose -1 < nu < 0.5")
    if not 0.0 < stretch <= 100.0 or stretch == 1.0:
        raise InputError(f"coupon: stretch={stretch:g} - choose one from 0 to 100 that is not 1, the length at rest")
    if not 1 <= points <= POINTS_MAX or seed < 0:
        raise InputError(f"coupon: points={points},seed={seed} - choose 1 to {POINTS_MAX} points, and a seed >= 0")
