#!/usr/bin/env bash
# Software:  SciPy 1.17.1, Python 3.11
# Behaviour: least_squares(method="trf", tr_solver="lsmr") ends in an IndexError for a single unknown, wherever a step is
#            longer than the trust region: it looks for it in a plane of two directions. tr_solver="exact" does not.
# Output:    exact [0.51460752]
#            lsmr IndexError: index 1 is out of bounds for axis 1 with size 1
# Used in:   bench/inversion/least_squares.py, which takes "exact" for one unknown
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check scipy==1.17.1
cd "$folder"
cat >program.py <<'PROGRAM'
import numpy as np
from scipy.optimize import least_squares


def residual(x):
    return np.array([np.exp(x[0]) - 1.0, np.exp(2.0 * x[0]) - 3.0])


def jacobian(x):
    return np.array([[np.exp(x[0])], [2.0 * np.exp(2.0 * x[0])]])


print("exact", least_squares(residual, [0.01], jacobian, tr_solver="exact").x)
try:
    least_squares(residual, [0.01], jacobian, tr_solver="lsmr")
except IndexError as error:
    print(f"lsmr IndexError: {error}")
else:
    raise SystemExit("one unknown works now: may lsmr be used?")
PROGRAM
"$folder/venv/bin/python" program.py
