"""Temperatures along a rod of which a fan cools the second half, of known film coefficients: `cooled_rod.csv`.

    python examples/measured/make_cooled_rod.py

The closed form of two fins in a row, held at T_0 at x = 0 and insulated at x = L, theta = T - T_inf:

    theta_1 = A cosh m_1 x + B sinh m_1 x    up to a,
    theta_2 = C cosh m_2 (L - x)             beyond,      m_i^2 = 4 h_i/(k D)

theta_1 = theta_0 at 0, and both theta and theta' agree at a.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

L, D, a = 0.4, 0.012, 0.2  # [m]
k = 110.0  # [W/m/K], brass
h = (12.0, 45.0)  # [W/m2/K], the truth: still air, and the fan
T_0, T_inf = 85.0, 21.5  # [degC]
NOISE = 0.1  # [K], normal
SEED = 17
X = np.linspace(0.02, 0.38, 13)


def rows() -> list[str]:
    m = [np.sqrt(4.0 * h_i / (k * D)) for h_i in h]
    c, s = np.cosh(m[0] * a), np.sinh(m[0] * a)
    c_2, s_2 = np.cosh(m[1] * (L - a)), np.sinh(m[1] * (L - a))
    conditions = [[1.0, 0.0, 0.0], [c, s, -c_2], [m[0] * s, m[0] * c, m[1] * s_2]]
    A, B, C = np.linalg.solve(conditions, [T_0 - T_inf, 0.0, 0.0])
    theta = np.where(X < a, A * np.cosh(m[0] * X) + B * np.sinh(m[0] * X), C * np.cosh(m[1] * (L - X)))
    T = T_inf + theta + NOISE * np.random.default_rng(SEED).standard_normal(len(X))
    return ["x [mm];T [°C]", *(f"{1e3 * x:g};{y:.2f}".replace(".", ",") for x, y in zip(X, T, strict=True))]


if __name__ == "__main__":
    Path(__file__).with_name("cooled_rod.csv").write_text("\n".join(rows()) + "\n", encoding="utf-8")
