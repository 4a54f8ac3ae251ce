"""Temperatures in a wall that is heated from one side, of known diffusivity and film coefficient: `heated_wall.csv`.

    python examples/measured/make_heated_wall.py

The closed form of a slab at T_inf that is held at T_b at x = 0 from t = 0 on and loses heat by h at x = L, Bi = h L/k
(Carslaw & Jaeger 1959, Conduction of Heat in Solids, ch. 3), with theta = T - T_inf and theta_b = T_b - T_inf:

    theta = theta_b (1 - Bi/(1 + Bi) x/L) - theta_b sum_n C_n sin(mu_n x/L) exp(-mu_n^2 a t/L^2)
    mu_n cot mu_n = -Bi,    C_n = 2 (mu_n^2 + Bi^2) / (mu_n (mu_n^2 + Bi^2 + Bi))
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import brentq

L = 0.1  # [m]
rho_c = 2300.0 * 880.0  # [J/m3/K], concrete
a, h = 6.5e-7, 15.0  # [m2/s], [W/m2/K], the truth
T_b, T_inf = 60.0, 20.0  # [degC]
NOISE = 0.2  # [K], normal
SEED = 13
X = (0.02, 0.05, 0.08)  # [m], thermocouples
EVERY, LAG = 600.0, 20.0  # [s]: between two scans, and from one thermocouple to the next within a scan
SCANS = 30


def theta(x: float, t: float) -> float:
    """T - T_inf over T_b - T_inf."""
    Bi = h * L / (a * rho_c)
    mu = np.array(
        [brentq(lambda m: m * np.cos(m) + Bi * np.sin(m), (n + 0.5) * np.pi, (n + 1) * np.pi) for n in range(40)]
    )
    C = 2.0 * (mu**2 + Bi**2) / (mu * (mu**2 + Bi**2 + Bi))
    fading = C * np.sin(mu * x / L) * np.exp(-(mu**2) * a * t / L**2)
    return float(1.0 - Bi / (1.0 + Bi) * x / L - fading.sum())


def rows() -> list[str]:
    times = [(EVERY * scan + LAG * k, x) for scan in range(1, SCANS + 1) for k, x in enumerate(X)]
    noise = NOISE * np.random.default_rng(SEED).standard_normal(len(times))
    T = [T_inf + (T_b - T_inf) * theta(x, t) + e for (t, x), e in zip(times, noise, strict=True)]
    lines = [f"{t / 60.0:.4f},{1e3 * x:g},{y:.2f}" for (t, x), y in zip(times, T, strict=True)]
    return ["t [min],x [mm],T [degC]", *lines]


if __name__ == "__main__":
    Path(__file__).with_name("heated_wall.csv").write_text("\n".join(rows()) + "\n", encoding="utf-8")
