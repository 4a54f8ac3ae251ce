"""A chain of masses between linear springs, each held by a cubic one: a nonlinear problem in one file."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from gradient_routes import Array, InputError, Linearization, Offers, Parameters, Problem


class Duffing(Problem):
    """K u + c u^3 = f with K = k tridiag(-1, 2, -1): find k and c from the displacements u.

    State u (n,) [m]; parameters p = (k [N/m], c [N/m^3]).
    """

    name = "duffing"
    offers = Offers.LINEARIZE | Offers.COMPLEX
    structure = "spd"

    def __init__(
        self,
        *,
        n: Annotated[int, "number of masses"] = 4,
        load: Annotated[float, "force on every mass [N]"] = 1.0,
    ) -> None:
        if n < 1:
            raise InputError(f"duffing: n={n} masses - choose n >= 1")
        self.n_state = n
        self.laplacian = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
        self.f = np.full(n, load)
        self.parameters = Parameters(
            start=np.ones(2), scale=np.ones(2), lower=0.0, unit=("N/m", "N/m^3"), label=lambda i: "kc"[i]
        )
        self.d = 0.8 * load * np.sin(np.pi * np.arange(1, n + 1) / (n + 1))

    def residual(self, u: Array, p: Array) -> Array:
        k, c = p
        return k * (self.laplacian @ u) + c * u**3 - self.f

    def tangent(self, u: Array, p: Array) -> Array:
        k, c = p
        return k * self.laplacian + np.diag(3.0 * c * u**2)

    def objective(self, u: Array, p: Array) -> Array:
        return 0.5 * np.sum((u - self.d) ** 2)

    def linearize(self, u: Array, p: Array) -> Linearization:
        R_p = np.column_stack([self.laplacian @ u, u**3])  # (n, 2)
        return Linearization(R_p, J_u=u - self.d, J_p=np.zeros(2))
