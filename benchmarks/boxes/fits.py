"""Ordinary objectives: curve fits, likelihoods, test functions of optimization."""

from __future__ import annotations

import numpy as np

from benchmarks.boxes.box import Model
from gradient_routes.problems.problem import Array

Rng = np.random.Generator


def _sigmoid(z: Array) -> Array:
    return 1.0 / (1.0 + np.exp(-z))


def linear_least_squares(rng: Rng) -> Model:
    n = int(rng.integers(1, 41))
    A, b = rng.standard_normal((n + 5, n)), rng.standard_normal(n + 5)
    return Model(lambda p: 0.5 * (A @ p - b) @ (A @ p - b), lambda p: A.T @ (A @ p - b), rng.uniform(-2, 2, n))


def weighted_least_squares(rng: Rng) -> Model:
    n = int(rng.integers(2, 20))
    A, b, c = rng.standard_normal((30, n)), rng.standard_normal(30), 10.0 ** rng.uniform(-2, 2, 30)
    return Model(
        lambda p: 0.5 * (c * (A @ p - b)) @ (A @ p - b), lambda p: A.T @ (c * (A @ p - b)), rng.uniform(1, 3, n)
    )


def exponential_fit(rng: Rng) -> Model:
    m = int(rng.integers(1, 4))
    t = np.linspace(0, 2, 25)
    data = np.exp(-1.3 * t) + 0.1 * rng.standard_normal(25)

    def r(p: Array) -> Array:
        return p[:m] @ np.exp(-np.outer(p[m:], t)) - data

    def g(p: Array) -> Array:
        e = np.exp(-np.outer(p[m:], t))
        return np.concatenate([e @ r(p), -(p[:m, None] * e * t) @ r(p)])

    return Model(lambda p: 0.5 * r(p) @ r(p), g, rng.uniform(0.5, 2.0, 2 * m))


def peaks(rng: Rng) -> Model:
    x = np.linspace(0, 10, 60)
    data = np.exp(-((x - 4.0) ** 2)) + 0.05 * rng.standard_normal(60)

    def r(p: Array) -> Array:
        return p[0] * np.exp(-0.5 * ((x - p[1]) / p[2]) ** 2) + p[3] - data

    def g(p: Array) -> Array:
        z = (x - p[1]) / p[2]
        e = np.exp(-0.5 * z * z)
        return np.array([e, p[0] * e * z / p[2], p[0] * e * z * z / p[2], np.ones(60)]) @ r(p)

    return Model(lambda p: 0.5 * r(p) @ r(p), g, np.array([1.0, 4.5, 1.2, 0.1]) * rng.uniform(0.8, 1.25, 4))


def michaelis_menten(rng: Rng) -> Model:
    s = np.linspace(0.1, 5, 15)
    data = 2.0 * s / (0.7 + s) * rng.uniform(0.95, 1.05, 15)

    def g(p: Array) -> Array:
        r = p[0] * s / (p[1] + s) - data
        return np.array([r @ (s / (p[1] + s)), -r @ (p[0] * s / (p[1] + s) ** 2)])

    return Model(lambda p: 0.5 * np.sum((p[0] * s / (p[1] + s) - data) ** 2), g, rng.uniform(0.5, 3.0, 2))


def logistic_regression(rng: Rng) -> Model:
    n = int(rng.integers(1, 25))
    X, y = rng.standard_normal((40, n)), rng.choice([-1.0, 1.0], 40)

    def g(p: Array) -> Array:
        return -X.T @ (y * _sigmoid(-y * (X @ p))) + 0.1 * p

    return Model(lambda p: np.sum(np.log(1 + np.exp(-y * (X @ p)))) + 0.05 * p @ p, g, rng.uniform(-1, 1, n))


def softmax_regression(rng: Rng) -> Model:
    n, k = int(rng.integers(2, 7)), 3
    X, y = rng.standard_normal((30, n)), rng.integers(0, k, 30)
    Y = np.eye(k)[y]

    def J(p: Array) -> Array:
        Z = X @ p.reshape(n, k)
        return np.sum(np.log(np.exp(Z).sum(1)) - (Z * Y).sum(1))

    def g(p: Array) -> Array:
        E = np.exp(X @ p.reshape(n, k))
        return (X.T @ (E / E.sum(1, keepdims=True) - Y)).ravel()

    return Model(J, g, rng.uniform(-1, 1, n * k))


def poisson_regression(rng: Rng) -> Model:
    n = int(rng.integers(1, 12))
    X, y = rng.uniform(-1, 1, (30, n)), rng.poisson(3.0, 30)
    return Model(
        lambda p: np.sum(np.exp(X @ p) - y * (X @ p)), lambda p: X.T @ (np.exp(X @ p) - y), rng.uniform(-1, 1, n)
    )


def student_t(rng: Rng) -> Model:
    n = int(rng.integers(1, 12))
    A, b = rng.standard_normal((25, n)), rng.standard_t(3, 25)

    def g(p: Array) -> Array:
        r = A @ p - b
        return A.T @ (4.0 * r / (3.0 + r * r))

    return Model(lambda p: 2.0 * np.sum(np.log(1 + (A @ p - b) ** 2 / 3.0)), g, rng.uniform(-1, 1, n))


def normal_likelihood(rng: Rng) -> Model:
    x = rng.normal(2.0, 1.5, 40)

    def g(p: Array) -> Array:
        z = (x - p[0]) / p[1]
        return np.array([-np.sum(z) / p[1], len(x) / p[1] - np.sum(z * z) / p[1]])

    return Model(lambda p: np.sum(0.5 * ((x - p[0]) / p[1]) ** 2 + np.log(p[1])), g, rng.uniform(1.0, 3.0, 2))


def gaussian_process(rng: Rng) -> Model:
    """The negative log-likelihood, p = log of length, amplitude and noise."""
    x, y = np.linspace(0, 1, 10), rng.standard_normal(10)
    D = (x[:, None] - x) ** 2

    def K(p: Array) -> tuple[Array, Array]:
        S = np.exp(2 * p[1] - 0.5 * D * np.exp(-2 * p[0]))
        return S, S + np.exp(2 * p[2]) * np.eye(10)

    def J(p: Array) -> Array:
        _, C = K(p)
        return 0.5 * y @ np.linalg.solve(C, y) + 0.5 * np.log(np.linalg.det(C))

    def g(p: Array) -> Array:
        S, C = K(p)
        inverse = np.linalg.inv(C)
        a = inverse @ y
        B = inverse - np.outer(a, a)
        return np.array([0.5 * np.sum(B * S * D) * np.exp(-2 * p[0]), np.sum(B * S), np.trace(B) * np.exp(2 * p[2])])

    return Model(J, g, np.array([-1.0, 0.2, -0.7]) + rng.uniform(-0.2, 0.2, 3))


def tanh_network(rng: Rng) -> Model:
    m, x = int(rng.integers(1, 10)), np.linspace(-2, 2, 20)
    data = np.sin(x)

    def r(p: Array) -> Array:
        return p[2 * m :] @ np.tanh(np.outer(p[:m], x) + p[m : 2 * m, None]) - data

    def g(p: Array) -> Array:
        T = np.tanh(np.outer(p[:m], x) + p[m : 2 * m, None])
        back = p[2 * m :, None] * (1 - T * T) * r(p)
        return np.concatenate([back @ x, back.sum(1), T @ r(p)])

    return Model(lambda p: 0.5 * r(p) @ r(p), g, rng.uniform(0.3, 1.5, 3 * m) * rng.choice([-1, 1], 3 * m))


def kl_divergence(rng: Rng) -> Model:
    n = int(rng.integers(2, 30))
    q = rng.dirichlet(np.full(n, 2.0)) + 1e-3

    def J(p: Array) -> Array:
        s = np.exp(p) / np.exp(p).sum()
        return s @ np.log(s / q)

    def g(p: Array) -> Array:
        s = np.exp(p) / np.exp(p).sum()
        a = np.log(s / q)
        return s * (a - s @ a)

    return Model(J, g, rng.uniform(0.2, 2.0, n))


def rosenbrock(rng: Rng) -> Model:
    n = int(rng.integers(2, 20))

    def g(p: Array) -> Array:
        out, d = np.zeros(n), p[1:] - p[:-1] ** 2
        out[1:] += 200 * d
        out[:-1] += -400 * p[:-1] * d - 2 * (1 - p[:-1])
        return out

    return Model(lambda p: np.sum(100 * (p[1:] - p[:-1] ** 2) ** 2 + (1 - p[:-1]) ** 2), g, rng.uniform(-1.5, 1.5, n))


def styblinski(rng: Rng) -> Model:
    n = int(rng.integers(1, 41))
    return Model(
        lambda p: 0.5 * np.sum(p**4 - 16 * p**2 + 5 * p), lambda p: 2 * p**3 - 16 * p + 2.5, rng.uniform(-2.5, 1.5, n)
    )


def trigonometric(rng: Rng) -> Model:
    n = int(rng.integers(1, 30))
    a, K = rng.standard_normal(12), rng.uniform(-2, 2, (12, n))
    return Model(lambda p: a @ np.sin(K @ p), lambda p: K.T @ (a * np.cos(K @ p)), rng.uniform(0.2, 1.5, n))


def power_product(rng: Rng) -> Model:
    """A Cobb-Douglas function."""
    n = int(rng.integers(2, 10))
    a = rng.uniform(0.2, 1.5, n)
    return Model(lambda p: np.exp(a @ np.log(p)), lambda p: np.exp(a @ np.log(p)) * a / p, rng.uniform(0.5, 3.0, n))


def quadratic_form(rng: Rng) -> Model:
    n = int(rng.integers(1, 41))
    V, _ = np.linalg.qr(rng.standard_normal((n, n)))
    Q, b = V @ np.diag(10.0 ** rng.uniform(-4, 2, n)) @ V.T, rng.standard_normal(n)
    return Model(lambda p: 0.5 * p @ (Q @ p) - b @ p, lambda p: 0.5 * (Q + Q.T) @ p - b, rng.uniform(-3, 3, n))


def log_sum_exp(rng: Rng) -> Model:
    n = int(rng.integers(2, 41))
    return Model(lambda p: np.log(np.exp(p).sum()), lambda p: np.exp(p) / np.exp(p).sum(), rng.uniform(0.5, 2.0, n))


def cosine_similarity(rng: Rng) -> Model:
    n = int(rng.integers(2, 30))
    c = rng.standard_normal(n)

    def g(p: Array) -> Array:
        s = p @ p
        return c / np.sqrt(s) - (c @ p) * p / s**1.5

    return Model(lambda p: c @ p / np.sqrt(p @ p), g, rng.uniform(0.5, 2.0, n))


def factorization(rng: Rng) -> Model:
    m, k = int(rng.integers(2, 7)), 2
    M = rng.standard_normal((m, m))

    def both(p: Array) -> tuple[Array, Array, Array]:
        U, V = p.reshape(2, m, k)
        return U, V, U @ V.T - M

    def J(p: Array) -> Array:
        return 0.5 * np.sum(both(p)[2] ** 2)

    def g(p: Array) -> Array:
        U, V, R = both(p)
        return np.concatenate([(R @ V).ravel(), (R.T @ U).ravel()])

    return Model(J, g, rng.uniform(0.3, 1.5, 2 * m * k))


def log_barrier(rng: Rng) -> Model:
    """Undefined beyond the constraints: J is NaN at natural steps."""
    n = int(rng.integers(1, 12))
    A, c = rng.uniform(0.0, 1.0, (n + 3, n)), rng.standard_normal(n)
    p = rng.uniform(0.2, 1.0, n)
    b = A @ p + rng.uniform(0.2, 1.0, n + 3)
    return Model(lambda q: c @ q - np.sum(np.log(b - A @ q)), lambda q: c + A.T @ (1 / (b - A @ q)), p)


FITS = (
    *(linear_least_squares, weighted_least_squares, exponential_fit, peaks, michaelis_menten, logistic_regression),
    *(softmax_regression, poisson_regression, student_t, normal_likelihood, gaussian_process, tanh_network),
    *(kl_divergence, rosenbrock, styblinski, trigonometric, power_product, quadratic_form, log_sum_exp),
    *(cosine_similarity, factorization, log_barrier),
)
