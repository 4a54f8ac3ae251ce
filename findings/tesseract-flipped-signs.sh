#!/usr/bin/env bash
# Software:  tesseract-core 1.15.0 with numpy 2.4.6, Python 3.11
# Behaviour: `tesseract-runtime check-gradients` compares by numpy.allclose(..., rtol=0.1, atol=1e-8). The absolute
#            tolerance has no option. A gradient whose components are below it passes whatever it is: with moduli of
#            1e11 Pa one of the wrong sign, and one of zeros, also where --eps suits the moduli. The same springs with
#            their moduli in 1e11 Pa fail as they should.
# Output:    moduli in Pa: sign: passed, zero: passed
#            moduli in Pa, --eps 1e5: sign: passed, zero: passed
#            moduli in 1e11 Pa: sign: failed, zero: failed
# Used in:   docs/how-to/umbridge-and-tesseract.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check 'tesseract-core[runtime]==1.15.0' numpy==2.4.6
cd "$folder"
cat >tesseract_api.py <<'API'
import os

import numpy as np
from pydantic import BaseModel
from tesseract_core.runtime import Array, Differentiable, Float64

FACTOR = {"sign": -1.0, "zero": 0.0}[os.environ["FAULT"]]
LOAD = 1e9 / float(os.environ["UNIT"])  # so that displacements are the same


class InputSchema(BaseModel):
    E: Differentiable[Array[(3,), Float64]]


class OutputSchema(BaseModel):
    J: Differentiable[Float64]


def misfits(E):
    return np.cumsum(LOAD / E) - 0.02


def apply(inputs: InputSchema) -> OutputSchema:
    r = misfits(inputs.E)
    return OutputSchema(J=0.5 * r @ r)


def vector_jacobian_product(inputs, vjp_inputs, vjp_outputs, cotangent_vector):
    E = inputs.E
    return {"E": FACTOR * -np.cumsum(misfits(E)[::-1])[::-1] * LOAD / E**2 * cotangent_vector["J"]}
API
cat >program.py <<'PROGRAM'
import json
import os
import subprocess


def verdict(unit, fault, *more):
    buffer = [2.1e11 / unit, 0.7e11 / unit, 1.1e11 / unit]
    E = {"object_type": "array", "shape": [3], "dtype": "float64", "data": {"buffer": buffer, "encoding": "json"}}
    command = ["venv/bin/tesseract-runtime", "check-gradients", "--no-show-progress", *more]
    variables = {"TESSERACT_API_PATH": "tesseract_api.py", "FAULT": fault, "UNIT": str(unit)}
    command.append(json.dumps({"inputs": {"E": E}}))
    done = subprocess.run(command, env=os.environ | variables, capture_output=True, text=True)
    said = done.stdout + done.stderr
    assert ("passed" in said, "failed" in said) == (done.returncode == 0, done.returncode != 0), said
    return "failed" if done.returncode else "passed"


for name, unit, more, expected in (
    ("moduli in Pa", 1.0, (), "passed"),
    ("moduli in Pa, --eps 1e5", 1.0, ("--eps", "1e5"), "passed"),
    ("moduli in 1e11 Pa", 1e11, (), "failed"),
):
    found = {fault: verdict(unit, fault, *more) for fault in ("sign", "zero")}
    print(f"{name}: " + ", ".join(f"{fault}: {said}" for fault, said in found.items()))
    assert set(found.values()) == {expected}, "it behaves otherwise now: change the page"
PROGRAM
venv/bin/python program.py
