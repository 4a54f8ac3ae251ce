"""The vectors and matrices behind a gradient of a small bar, all of them formed, to be looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.cases import case
from gradient_routes.bench.execution.isolation.channel import Channel
from gradient_routes.bench.lab.shell import Command
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.matrices.tridiagonal import difference
from gradient_routes.problems.problem import Array
from gradient_routes.routes.model import Model


@dataclass(frozen=True)
class Algebra:
    """Of J(p) and R(u, p) = 0 at a solved state of a bar of n elements, with n_u = n_p = n.

    u, R, R_u, R_p   (n,) [m], (n,) [N], (n, n) [N/m], (n, n) [N]: R_u u = f, R_p = dR/dp
    du_dp            (n, n) [m]: -R_u^{-1} R_p
    S_u, d, sensors  displacements at the sensors and the data (m,) [m], their nodes, counted from 1
    J, J_u, J_p      [m2], (n,) [m], (n,) [m2]
    lam              (n,): R_u^T lam = -J_u
    strain, strain_adjoint   (n,), of u and of lam: their product times A L_e E_e is dJ/d log E_e
    volume, E        A L_e [m3], E_e (n,) [Pa]
    """

    u: Array
    R: Array
    R_u: Array
    R_p: Array
    du_dp: Array
    S_u: Array
    d: Array
    sensors: Array
    J: float
    J_u: Array
    J_p: Array
    lam: Array
    strain: Array
    strain_adjoint: Array
    volume: float
    E: Array

    @property
    def gradient(self) -> Array:
        """J_p + R_p^T lam, (n,)."""
        return np.asarray(self.J_p + self.R_p.T @ self.lam)


def algebra(selector: str, at: str) -> Algebra:
    """Of a bar named by a selector, at a point p as --at takes it. Raises InputError."""
    problem = case.problems([selector])[0]()
    assert isinstance(problem, Bar)
    p = case.point(problem, at)
    model, n = Model(problem), problem.n
    state = model.solve(p)
    lin, factors, eye = model.linearize(state), model.factors_at(state), np.eye(n)
    R_u = np.stack([problem.tangent(state.u, p) @ e for e in eye], axis=1)
    R_p = np.stack([lin.R_p @ e for e in eye], axis=1)
    du_dp = -np.stack([factors.solve(column) for column in R_p.T], axis=1)
    lam = factors.solve_transposed(-lin.J_u)
    data, L_e = problem.observation(state.u, p), problem.L_e
    return Algebra(
        u=state.u, R=problem.residual(state.u, p), R_u=R_u, R_p=R_p, du_dp=du_dp,
        S_u=data.predicted, d=data.data, sensors=problem.sensors.nodes,
        J=state.J, J_u=lin.J_u, J_p=lin.J_p, lam=lam,
        strain=difference(state.u) / L_e, strain_adjoint=difference(lam) / L_e,
        volume=problem.A * L_e, E=problem.modulus(p),
    )  # fmt: skip


@dataclass(frozen=True)
class WithAlgebra:
    """A command about a bar, its rows, then the algebra behind them."""

    command: Command
    selector: str
    at: str
    name: str = "derivation"

    def __call__(self, channel: Channel) -> None:
        self.command(channel)
        channel.say(algebra(self.selector, self.at))
