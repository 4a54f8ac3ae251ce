"""Unknown constants as people state them: E,nu or mu,lam or K,G of laws with two, else the law's own, C10 and so on.

Parameters of the former are logarithms of what must be positive, so that the law is stable wherever they are:

    E,nu     log E, logit nu:  nu = -1 + 1.5 / (1 + exp(-b)),  mu = E (1 + exp(-b)) / 3,  K = E (1 + exp(b)) / 9
    mu,lam   log mu, log K     with K = lam + 2 mu / 3
    K,G      log K, log G      with G = mu
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.data.units import quantity
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.mechanics.design_variables import THETA_MAX, DesignVariables, Setup, constants
from gradient_routes.problems.problem import Array, End, Parameters

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.materials import MaterialLaw

PAIRS = {("E", "nu"): ("log E", "logit nu"), ("mu", "lam"): ("log mu", "log K"), ("K", "G"): ("log K", "log G")}
ALSO = {
    "mooney-rivlin": {"C10": "c1", "C01": "c2"},
    "yeoh": {"C10": "c1", "C20": "c2", "C30": "c3", "K": "kappa"},
    "ogden": {"K": "kappa"},
}
NU_ENDS = -0.99, 0.499  # beyond them nu is at its bound
LOGIT_MAX = 25.0  # nu to 2e-11 of -1 and 0.5
TRUTH = np.log(1.3)


@dataclass(frozen=True)
class Constants:
    """Which constants are unknown, by name, and those starts that the user has given [Pa, 1]."""

    names: tuple[str, ...]
    start: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, text: str | None, law: MaterialLaw, who: str) -> Constants:
        """Those of the option `constants`; mu,lam where it is not given, else those of the law as it names them."""
        return cls.parse(text or ",".join(law.constants), law, who)

    @classmethod
    def parse(cls, text: str, law: MaterialLaw, who: str, incompressible: bool = False) -> Constants:
        """`E,nu` or `E:200GPa,nu:0.3`; of an incompressible material the last constant of the law is none.

        Raises InputError for constants that the law has not, and bad starts.
        """
        parts = [part.partition(":") for part in text.split(",")]
        names = tuple(name.strip() for name, _, _ in parts)
        also = ALSO.get(law.name, {})
        constants = law.constants[: len(law.constants) - incompressible]
        pairs = list(PAIRS) if constants == ("mu", "lam") else []
        if names not in pairs and tuple(also.get(name, name) for name in names) != constants:
            own = [] if pairs else [constants]
            known = " or ".join(",".join(one) for one in [*pairs, *own])
            raise InputError(f"{who}: constants={text} - {law.name} has {known}, with starts as in {pairs_of(known)}")
        start = {
            name.strip(): quantity(value, "ratio" if name.strip() == "nu" else "stress", f"{who}: constants={text}")
            for name, colon, value in parts
            if colon
        }
        if start and len(start) < len(names) and names != ("E", "nu"):
            raise InputError(f"{who}: constants={text}: a start for some of them only - give all or none")
        found = cls(names, start)
        found._check(law, f"{who}: constants={text}")
        return found

    @property
    def paired(self) -> bool:
        """Whether p are the logarithms above."""
        return self.names in PAIRS

    def _check(self, law: MaterialLaw, who: str) -> None:
        positive = dict(zip(self.names, law.positive, strict=False))  # incompressible: without the last
        if self.paired:
            positive = {name: name in ("E", "mu", "K", "G") for name in self.names}
        for name, value in self.start.items():
            if positive[name] and not 0.0 < value < np.inf:
                raise InputError(f"{who}: {name} = {value:g} Pa - choose {name} > 0")
        nu = self.start.get("nu", 0.0)
        if not -1.0 + 1e-5 < nu < 0.5 - 1e-5:
            raise InputError(f"{who}: nu = {nu:g} - the law is stable for -1 < nu < 0.5")
        if self.names == ("mu", "lam") and self.start and not self.start["lam"] + 2.0 * self.start["mu"] / 3.0 > 0.0:
            raise InputError(f"{who}: lam + 2 mu/3 = K is not > 0, and the law unstable - choose lam > -2 mu/3")

    def parameters(self, q: Array, plain: Parameters) -> Parameters:
        """From constants q of the law, or the starts; `plain` are those of q as they are."""
        given = np.array([self.start[name] for name in self.names if name in self.start])
        if not self.paired:
            q = given if given.size else q
            scale = np.where(q == 0.0, np.abs(q).max(), np.abs(q))
            return replace(plain, start=q, scale=scale, label=lambda i: self.names[i])
        if self.names == ("K", "G") and given.size:
            given = np.array([given[1], given[0] - 2.0 * given[1] / 3.0])
        most = np.array([THETA_MAX, LOGIT_MAX if self.names == ("E", "nu") else THETA_MAX])
        return Parameters(
            start=self.of_lame(*(q if self.names == ("E", "nu") or not given.size else given)),
            scale=np.ones(2),
            lower=-most,
            upper=most,
            unit=("log Pa", "1" if self.names == ("E", "nu") else "log Pa"),
            label=lambda i: PAIRS[self.names][i],  # type: ignore[index]
        )

    def small_strain(self, E: float, nu: float) -> tuple[float, float]:
        """E and nu as given, else these."""
        return self.start.get("E", E), self.start.get("nu", nu)

    def design(self, mesh: Mesh, law: MaterialLaw, nu: float, E: float) -> DesignVariables:
        """From the starts, else from those of the modulus E and nu."""
        plain = constants(mesh, law, nu, E)
        parameters = self.parameters(np.array(law.of_modulus(*self.small_strain(E, nu))), plain.parameters)
        if not self.paired:
            return replace(plain, parameters=parameters, truth=1.3 * parameters.start)

        def apply(s: Setup, p: Any, xp: Any) -> Setup:
            return replace(s, q=self.lame(p, xp))

        return replace(
            plain,
            parameters=parameters,
            apply=apply,
            truth=parameters.start + TRUTH,
            chain=self.by_p,
            by_stiffness=np.array([1.0, 0.0 if self.names == ("E", "nu") else 1.0]),
        )

    def of_law(self, q: Sequence[float]) -> Array:
        """p of all constants q [Pa] of the law. Raises InputError for mu and lam of an unstable one."""
        if not self.paired:
            return np.array(q)
        mu, lam = q
        K = lam + 2.0 * mu / 3.0
        if not (mu > 0.0 and K > 0.0):
            raise InputError(f"mu={mu:g}, lam={lam:g}: K = {K:g} Pa - the law is stable for mu > 0, lam > -2 mu/3")
        return self.of_lame(mu, lam)

    def of_lame(self, mu: float, lam: float) -> Array:
        """p of Lame's constants."""
        K = lam + 2.0 * mu / 3.0
        if self.names == ("E", "nu"):
            return np.array([np.log(9.0 * K * mu / (3.0 * K + mu)), np.log(3.0 * K / mu)])
        return np.log([mu, K] if self.names == ("mu", "lam") else [K, mu])

    def lame(self, p: Any, xp: Any = np) -> tuple[Any, Any]:
        """mu, lam [Pa]."""
        a, b = xp.exp(p[0]), xp.exp(p[1])
        if self.names == ("E", "nu"):
            mu, K = a * (1.0 + 1.0 / b) / 3.0, a * (1.0 + b) / 9.0
        else:
            mu, K = (a, b) if self.names == ("mu", "lam") else (b, a)
        return mu, K - 2.0 * mu / 3.0

    def by_p(self, p: Array) -> Array:
        """d(mu, lam)/dp, (2, 2)."""
        a, b = np.exp(p)
        if self.names == ("E", "nu"):
            mu, K = np.array([a * (1.0 + 1.0 / b), -a / b]) / 3.0, np.array([a * (1.0 + b), a * b]) / 9.0
        else:
            mu, K = np.array([a, 0.0]), np.array([0.0, b])
            mu, K = (mu, K) if self.names == ("mu", "lam") else (np.array([0.0, b]), np.array([a, 0.0]))
        return np.stack([mu, K - 2.0 * mu / 3.0])

    def stated(self, p: Array) -> dict[str, Any]:
        """Their values, and E and nu in any case."""
        mu, lam = self.lame(p)
        K = lam + 2.0 * mu / 3.0
        own = {"mu [Pa]": mu, "lam [Pa]": lam} if self.names == ("mu", "lam") else {"K [Pa]": K, "G [Pa]": mu}
        E, nu = 9.0 * K * mu / (3.0 * K + mu), (3.0 * K - 2.0 * mu) / (6.0 * K + 2.0 * mu)
        return ({} if self.names == ("E", "nu") else own) | {"E [Pa]": E, "nu": nu}

    def ends(self, p: Array) -> list[End]:
        """The one that says how compressible the material is, where that is nearly not at all, or no bound to it."""
        nu = float(self.stated(p)["nu"])
        low, high = NU_ENDS
        if low < nu < high:
            return []
        up = nu >= high
        if self.names == ("E", "nu"):
            return [End(1, "nu", "0.5" if up else "-1", up)]
        i = int((self.names == ("K", "G")) != up)  # K is infinite, or G
        return [End(i, self.names[i], "infinity", True, ("nu", "lam") if self.names[i] == "mu" else ("nu",))]


def pairs_of(known: str) -> str:
    """The first choice with starts."""
    return ",".join(f"{name}:{'0.3' if name == 'nu' else '1MPa'}" for name in known.partition(" or ")[0].split(","))
