#!/usr/bin/env bash
# Software:  lineax 0.1.1, jax 0.10.2 on a CPU, Python 3.11
# Behaviour: throw=False of lineax.linear_solve holds for the value only. Where CG stops at max_steps, the value comes
#            with its result, and the derivative of the same call raises, in reverse and in forward mode: the solves
#            that differentiation adds do not know of throw=False. Code that looks at `result` to skip a step of an
#            optimizer never gets there. With steps enough, all of them return.
# Output:    2 steps: value 15, max_steps_reached
#            2 steps: grad raises
#            2 steps: jvp raises
#            20 steps: value 36, successful
#            20 steps: grad -36
#            20 steps: jvp -36
# Used in:   docs/explanation/conventions.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check lineax==0.1.1 jax==0.10.2 numpy==2.4.6
cd "$folder"
cat >program.py <<'PROGRAM'
import equinox as eqx
import jax
import lineax as lx
import numpy as np

jax.config.update("jax_enable_x64", True)
K = 2 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1)
K[-1, -1] = 1  # a bar of 8 springs under its weight: u_8 = 36 / p


def end(p, steps):
    A = lx.MatrixLinearOperator(p * K, lx.positive_semidefinite_tag)
    solution = lx.linear_solve(A, np.ones(8), lx.CG(1e-12, 1e-12, max_steps=steps), throw=False)
    return solution.value[-1], solution.result == lx.RESULTS.successful


def u_8(p, steps):
    return end(p, steps)[0]


def said(derivative, steps):
    """A compiled derivative at p = 1."""
    try:
        return f"{eqx.filter_jit(derivative)(1.0, steps):g}"
    except eqx.EquinoxRuntimeError as error:
        assert "The maximum number of solver steps was reached" in str(error)
        return "raises"


def tangent(p, steps):
    return jax.jvp(lambda p: u_8(p, steps), (p,), (1.0,))[1]


for steps, derivative in ((2, "raises"), (20, "-36")):
    value, successful = end(1.0, steps)
    print(f"{steps} steps: value {value:g}, {'successful' if successful else 'max_steps_reached'}")
    found = {"grad": said(jax.grad(u_8), steps), "jvp": said(tangent, steps)}
    for name, says in found.items():
        print(f"{steps} steps: {name} {says}")
    assert successful == (steps == 20) and set(found.values()) == {derivative}, "it behaves otherwise now: change the table"
PROGRAM
venv/bin/python program.py 2>stderr || { cat stderr >&2; exit 1; }
