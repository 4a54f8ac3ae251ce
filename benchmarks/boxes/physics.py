"""Ordinary objectives of mechanics: solves, time steps, eigenvalues; the gradient is the adjoint or the tangent."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.boxes.box import Model
from gradient_routes.problems.problem import Array

Rng = np.random.Generator


def laplacian(n: int) -> Array:
    """Of n nodes between two fixed ones, without the mesh size."""
    return 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)


def conduction(k: Array) -> Array:
    """K (n-1, n-1) of n conductors in series, both ends fixed."""
    return np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)


def steady_heat(rng: Rng) -> Model:
    """p = log k."""
    n = int(rng.integers(3, 25))
    f, data = rng.uniform(0.5, 1.5, n - 1), rng.standard_normal(n - 1)

    def J(p: Array) -> Array:
        u = np.linalg.solve(conduction(np.exp(p)), f)
        return 0.5 * np.sum((u - data) ** 2)

    def g(p: Array) -> Array:
        K = conduction(np.exp(p))
        u = np.linalg.solve(K, f)
        lam = np.linalg.solve(K.T, u - data)
        du, dl = np.diff(u, prepend=0, append=0), np.diff(lam, prepend=0, append=0)
        return -np.exp(p) * du * dl

    return Model(J, g, rng.uniform(0.2, 1.0, n))


def transient_heat(rng: Rng) -> Model:
    """Implicit Euler steps of the initial temperature p."""
    n, steps = int(rng.integers(1, 41)), 10
    B = np.linalg.matrix_power(np.linalg.inv(np.eye(n) + 0.1 * laplacian(n)), steps)
    data = rng.standard_normal(n)
    return Model(lambda p: 0.5 * np.sum((B @ p - data) ** 2), lambda p: B.T @ (B @ p - data), rng.uniform(0.5, 1.5, n))


def reaction_diffusion(rng: Rng) -> Model:
    """A u + exp(p) u^3 = f by Newton's method, converged."""
    n = int(rng.integers(2, 20))
    A, f, data = laplacian(n) + 0.5 * np.eye(n), rng.uniform(0.5, 2.0, n), rng.standard_normal(n)

    def u(p: Array) -> Array:
        u = 0 * p + f / 2.5
        for _ in range(12):
            u = u - np.linalg.solve(A + np.diag(3 * np.exp(p) * u * u), A @ u + np.exp(p) * u**3 - f)
        return u

    def g(p: Array) -> Array:
        x = u(p)
        return -np.linalg.solve(A + np.diag(3 * np.exp(p) * x * x), x - data) * np.exp(p) * x**3

    return Model(lambda p: 0.5 * np.sum((u(p) - data) ** 2), g, rng.uniform(-1.0, 1.0, n))


def advection_upwind(rng: Rng) -> Model:
    """A matrix that is not symmetric; p = sources."""
    n = int(rng.integers(3, 30))
    A = 0.3 * laplacian(n) + np.eye(n) - np.eye(n, k=-1)
    data = rng.standard_normal(n)

    def J(p: Array) -> Array:
        return 0.5 * np.sum((np.linalg.solve(A, p * p) - data) ** 2)

    return Model(
        J,
        lambda p: 2 * p * np.linalg.solve(A.T, np.linalg.solve(A, p * p) - data),
        rng.uniform(0.5, 1.5, n),
    )


Rhs = Callable[[Array, Array], Array]


def integrated(f: Rhs, f_x: Rhs, f_p: Rhs, x_0: Array, data: Array, p: Array, dt: float = 0.1) -> Model:
    """Runge-Kutta steps of x' = f(x, p); data (m, n_x). The gradient integrates dx/dp by the same steps."""

    def path(p: Array, with_tangent: bool) -> tuple[Array, Array]:
        x, S = x_0 + 0 * p[0], np.zeros((len(x_0), len(p)))
        xs, Ss = [], []
        for _ in data:
            k, K, dk, dK = 0 * x, 0 * S, 0 * x, 0 * S
            for a, b in ((0.0, 1 / 6), (0.5, 1 / 3), (0.5, 1 / 3), (1.0, 1 / 6)):
                y, Y = x + a * dt * k, S + a * dt * K
                k = f(y, p)
                dk = dk + b * k
                if with_tangent:
                    K = f_x(y, p) @ Y + f_p(y, p)
                    dK = dK + b * K
            x, S = x + dt * dk, S + dt * dK
            xs.append(x)
            Ss.append(S)
        return np.array(xs), np.array(Ss)

    def g(p: Array) -> Array:
        xs, Ss = path(p, True)
        return np.einsum("mi,mip->p", xs - data, Ss)

    return Model(lambda p: 0.5 * np.sum((path(p, False)[0] - data) ** 2), g, p)


def lotka_volterra(rng: Rng) -> Model:
    return integrated(
        lambda x, p: np.array([x[0] * (p[0] - p[1] * x[1]), -x[1] * (p[2] - p[3] * x[0])]),
        lambda x, p: np.array([[p[0] - p[1] * x[1], -p[1] * x[0]], [p[3] * x[1], p[3] * x[0] - p[2]]]),
        lambda x, p: np.array([[x[0], -x[0] * x[1], 0, 0], [0, 0, -x[1], x[0] * x[1]]]),
        np.array([1.0, 0.7]),
        rng.uniform(0.5, 1.5, (15, 2)),
        rng.uniform(0.5, 1.5, 4),
    )


def pendulum(rng: Rng) -> Model:
    return integrated(
        lambda x, p: np.array([x[1], -p[0] * np.sin(x[0]) - p[1] * x[1]]),
        lambda x, p: np.array([[0, 1], [-p[0] * np.cos(x[0]), -p[1]]]),
        lambda x, p: np.array([[0, 0], [-np.sin(x[0]), -x[1]]]),
        np.array([1.2, 0.0]),
        rng.uniform(-1, 1, (20, 2)),
        np.array([3.0, 0.2]) * rng.uniform(0.7, 1.3, 2),
    )


def epidemic(rng: Rng) -> Model:
    return integrated(
        lambda x, p: np.array([-p[0] * x[0] * x[1], p[0] * x[0] * x[1] - p[1] * x[1]]),
        lambda x, p: np.array([[-p[0] * x[1], -p[0] * x[0]], [p[0] * x[1], p[0] * x[0] - p[1]]]),
        lambda x, p: np.array([[-x[0] * x[1], 0], [x[0] * x[1], -x[1]]]),
        np.array([0.95, 0.05]),
        rng.uniform(0, 1, (20, 2)),
        np.array([2.0, 0.5]) * rng.uniform(0.7, 1.3, 2),
    )


def eigenvalue(rng: Rng) -> Model:
    """The least eigenvalue of a chain on springs p."""
    n = int(rng.integers(2, 15))

    def J(p: Array) -> Array:
        values = np.linalg.eigvals(laplacian(n) + np.diag(p))
        return values[np.argmin(values.real)]

    return Model(J, lambda p: np.linalg.eigh(laplacian(n) + np.diag(p))[1][:, 0] ** 2, rng.uniform(0.5, 1.5, n))


def log_determinant(rng: Rng) -> Model:
    n = int(rng.integers(1, 20))

    def J(p: Array) -> Array:
        return np.log(np.linalg.det(laplacian(n) + np.diag(np.exp(p))))

    def g(p: Array) -> Array:
        return np.exp(p) * np.diag(np.linalg.inv(laplacian(n) + np.diag(np.exp(p))))

    return Model(J, g, rng.uniform(0.2, 1.0, n))


def springs_in_series(rng: Rng) -> Model:
    n = int(rng.integers(1, 41))
    F, data = rng.uniform(0.5, 2.0), rng.uniform(0.5, 3.0, n)

    def g(p: Array) -> Array:
        r = np.cumsum(F / p) - data
        return -F / p**2 * np.cumsum(r[::-1])[::-1]

    return Model(lambda p: 0.5 * np.sum((np.cumsum(F / p) - data) ** 2), g, rng.uniform(0.5, 3.0, n))


def compliance(rng: Rng) -> Model:
    """SIMP: the work of the loads, stiffnesses p^3."""
    n = int(rng.integers(3, 25))
    f = rng.uniform(0.5, 1.5, n - 1)

    def g(p: Array) -> Array:
        u = np.linalg.solve(conduction(p**3), f)
        return -3 * p**2 * np.diff(u, prepend=0, append=0) ** 2

    return Model(lambda p: f @ np.linalg.solve(conduction(p**3), f), g, rng.uniform(0.3, 1.0, n))


def helmholtz(rng: Rng) -> Model:
    n = int(rng.integers(3, 20))
    f, data = rng.standard_normal((2, n))

    def A(p: Array) -> Array:
        return laplacian(n) - np.diag(0.3 * p)

    def g(p: Array) -> Array:
        u = np.linalg.solve(A(p), f)
        return 0.3 * np.linalg.solve(A(p), u - data) * u

    return Model(lambda p: 0.5 * np.sum((np.linalg.solve(A(p), f) - data) ** 2), g, 0.1 * rng.uniform(0.5, 1.5, n))


def deconvolution(rng: Rng) -> Model:
    n = int(rng.integers(3, 41))
    kernel = np.exp(-0.5 * np.linspace(-2, 2, 5) ** 2)
    data = rng.standard_normal(n + 4)

    def g(p: Array) -> Array:
        return np.correlate(np.convolve(p, kernel) - data, kernel, "valid")

    return Model(lambda p: 0.5 * np.sum((np.convolve(p, kernel) - data) ** 2), g, rng.uniform(-1, 1, n))


def robot_arm(rng: Rng) -> Model:
    n = int(rng.integers(2, 10))
    target = rng.uniform(-1, 1, 2)

    def tip(p: Array) -> Array:
        a = np.cumsum(p)
        return np.array([np.cos(a).sum(), np.sin(a).sum()]) - target

    def g(p: Array) -> Array:
        a, (x, y) = np.cumsum(p), tip(p)
        each = -x * np.sin(a) + y * np.cos(a)
        return np.cumsum(each[::-1])[::-1]

    return Model(lambda p: 0.5 * np.sum(tip(p) ** 2), g, rng.uniform(0.1, 0.9, n))


def cable(rng: Rng) -> Model:
    """Stretched springs and gravity; p = heights of the nodes."""
    n = int(rng.integers(2, 30))

    def ends(p: Array) -> Array:
        return np.diff(np.concatenate([[0.0], p, [0.0]]))

    def J(p: Array) -> Array:
        return np.sum(5 * (np.sqrt(1 + ends(p) ** 2) - 0.8) ** 2) + 0.3 * np.sum(p)

    def g(p: Array) -> Array:
        d = ends(p)
        force = 10 * (np.sqrt(1 + d * d) - 0.8) * d / np.sqrt(1 + d * d)
        return force[:-1] - force[1:] + 0.3

    return Model(J, g, rng.uniform(-0.5, 0.5, n))


def circuit(rng: Rng) -> Model:
    """The step response of a resistor and a capacitor: volts, ohms, farads."""
    t = np.linspace(1e-4, 5e-3, 20)
    data = 5.0 * (1 - np.exp(-t / 1e-3)) * rng.uniform(0.95, 1.05, 20)

    def g(p: Array) -> Array:
        e = np.exp(-t / (p[1] * p[2]))
        r = p[0] * (1 - e) - data
        rate = -p[0] * e * t / (p[1] * p[2])
        return np.array([r @ (1 - e), r @ rate / p[1], r @ rate / p[2]])

    def J(p: Array) -> Array:
        return 0.5 * np.sum((p[0] * (1 - np.exp(-t / (p[1] * p[2]))) - data) ** 2)

    return Model(J, g, np.array([4.0, 1e3, 1e-6]) * rng.uniform(0.7, 1.4, 3))


PHYSICS = (
    *(steady_heat, transient_heat, reaction_diffusion, advection_upwind, lotka_volterra, pendulum, epidemic),
    *(eigenvalue, log_determinant, springs_in_series, compliance, helmholtz, deconvolution, robot_arm, cable, circuit),
)
