#!/usr/bin/env bash
# Software:  numdifftools 0.11.2 with numpy 2.4.6, Python 3.11
# Behaviour: the steps of Gradient do not follow the size of p. For p of 1e-9 central differences are all wrong, without a
#            warning, and method="complex" is right to 1e-10; for p of 1e11 central differences lose seven digits.
# Output:    central p of 1e+00: error 1e-13
#            central p of 1e+11: error 3e-06
#            central p of 1e-09: error 1e+00
#            complex p of 1e+00: error 8e-18
#            complex p of 1e+11: error 1e-15
#            complex p of 1e-09: error 3e-11
# Used in:   docs/explanation/other-checkers.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check numdifftools==0.11.2 numpy==2.4.6
cd "$folder"
venv/bin/python - <<'PROGRAM'
import numdifftools
import numpy as np

d = np.array([0.9, 0.7, 0.4])
limits = {"central": ((0, 1e-11), (1e-8, 1e-4), (0.9, 1.1)), "complex": ((0, 1e-14), (0, 1e-13), (0, 1e-9))}
for method, bounds in limits.items():
    for s, (least, most) in zip((1.0, 1e11, 1e-9), bounds):
        p = s * np.array([1.0, 2.0, 3.0])
        exact = -(s / p - d) * s / p**2
        found = numdifftools.Gradient(lambda p: 0.5 * np.sum((s / p - d) ** 2), method=method)(p)
        error = np.linalg.norm(found - exact) / np.linalg.norm(exact)
        print(f"{method} p of {s:.0e}: error {error:.0e}")
        assert least <= error <= most, "it behaves otherwise now: change the table"
PROGRAM
