#!/usr/bin/env bash
# Software:  lineax 0.1.1, optimistix 0.1.0, jax 0.10.2 on a CPU, Python 3.11
# Behaviour: lineax.CG compares each component of the residual with atol + rtol |b_i|. With atol=0 and a right-hand side
#            that has a zero, as one force at one node has, 0/0 counts as converged: it ends after one step with the
#            result `successful`, x and the gradient through it are wrong. optimistix.Newton compares the residual with
#            atol alone, rtol has no part in it: with atol=0 it takes all 256 steps and fails, though the first has
#            solved the linear system to rounding.
# Output:    CG, atol=0: |x| 0.67, steps 1, successful, gradient -0.59
#            CG, atol=1e-12: |x| 3.7, steps 5, successful, gradient -18
#            Newton, atol=0: |x| 3.7, steps 256, failed
#            Newton, atol=1e-12: |x| 3.7, steps 2, successful
# Used in:   adapters/lineax.py, whose atol is rtol times the load
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check lineax==0.1.1 optimistix==0.1.0 jax==0.10.2
cd "$folder"
cat >program.py <<'PROGRAM'
import jax
import jax.numpy as jnp
import lineax as lx
import optimistix as optx

jax.config.update("jax_enable_x64", True)
b = jnp.array([0.0, 0.0, 0.0, 1.0])  # a bar of four springs, pulled at its end


def operator(k):
    k = k * jnp.ones(4)
    A = jnp.diag(k + jnp.append(k[1:], 0.0)) - jnp.diag(k[1:], 1) - jnp.diag(k[1:], -1)
    return lx.MatrixLinearOperator(A, lx.positive_semidefinite_tag)


def cg(k, atol):
    return lx.linear_solve(operator(k), b, lx.CG(rtol=1e-12, atol=atol))


def words(result, success):
    return "successful" if result == success else "failed"


found = {}
for atol in (0.0, 1e-12):
    solution = cg(1.5, atol)
    slope = jax.grad(lambda k: jnp.sum(cg(k, atol).value ** 2))(1.5)
    steps, said = int(solution.stats["num_steps"]), words(solution.result, lx.RESULTS.successful)
    found["CG", atol] = (steps, said, float(slope))
    print(f"CG, atol={atol:g}: |x| {jnp.linalg.norm(solution.value):.2g}, steps {steps}, {said}, gradient {slope:.2g}")
for atol in (0.0, 1e-12):
    newton = optx.Newton(rtol=1e-12, atol=atol)
    solution = optx.root_find(lambda x, k: operator(k).mv(x) - b, newton, jnp.zeros(4), args=1.5, throw=False)
    steps, said = int(solution.stats["num_steps"]), words(solution.result, optx.RESULTS.successful)
    found["Newton", atol] = (steps, said)
    print(f"Newton, atol={atol:g}: |x| {jnp.linalg.norm(solution.value):.2g}, steps {steps}, {said}")
assert found["CG", 0.0][:2] == (1, "successful"), "it behaves otherwise now: may atol be 0?"
assert abs(found["CG", 0.0][2] / found["CG", 1e-12][2]) < 0.1 and found["CG", 1e-12][1] == "successful"
assert found["Newton", 0.0] == (256, "failed"), "it behaves otherwise now: may atol be 0?"
assert found["Newton", 1e-12][1] == "successful"
PROGRAM
venv/bin/python program.py
