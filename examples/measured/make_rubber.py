"""Stress-stretch curves of a rubber of known constants, as a laboratory would write them: `rubber.csv`.

    python examples/measured/make_rubber.py

Yeoh's law, incompressible, W = sum_i c_i (I1 - 3)^i, in uniaxial and equibiaxial tension and in pure shear:

    P = 2 (lambda - lambda_t^2/lambda) W'(I1),    lambda_t the stretch of the free direction
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

C = (0.19, -0.002, 0.00005)  # [MPa], the truth
NOISE = 0.005  # [MPa], normal
SEED = 17
TESTS = {  # stretches, and the exponents of the two other directions
    "uniaxial": ([1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0], (-0.5, -0.5)),
    "equibiaxial": ([1.1, 1.3, 1.6, 2.0, 2.5, 3.0], (1.0, -2.0)),
    "shear": ([1.1, 1.3, 1.6, 2.0, 2.5, 3.0], (0.0, -1.0)),
}


def rows() -> list[str]:
    rng, lines = np.random.default_rng(SEED), ["mode,stretch,stress [MPa]"]
    for mode, (stretches, (across, free)) in TESTS.items():
        lam = np.array(stretches)
        i1 = lam**2 + lam ** (2.0 * across) + lam ** (2.0 * free) - 3.0
        P = 2.0 * (lam - lam ** (2.0 * free - 1.0)) * (C[0] + 2.0 * C[1] * i1 + 3.0 * C[2] * i1**2)
        P = P + NOISE * rng.standard_normal(len(lam))
        lines += [f"{mode},{x:g},{y:.3f}" for x, y in zip(lam, P, strict=True)]
    return lines


if __name__ == "__main__":
    Path(__file__).with_name("rubber.csv").write_text("\n".join(rows()) + "\n")
