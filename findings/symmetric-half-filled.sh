#!/usr/bin/env bash
# Software:  jax 0.10.2 and torch 2.13.0 with scipy 1.17.1, on a CPU, Python 3.11
# Behaviour: of a symmetric matrix of which only the lower half is filled, functions that read only that half return the
#            right value and a wrong slope, without an error. PyTorch and cho_solve of JAX share the slope with the half
#            that they do not read: half of it is left. jax.scipy.linalg.solve gives one of the wrong sign. eigh of JAX
#            reads both halves in spite of UPLO="L" or lower=True, unlike NumPy and SciPy; with symmetrize_input=False
#            it reads one, but only until it is differentiated: value_and_grad returns another value than the function.
#            (jax-ml/jax#12795 has the slope of eigh.)
# Output:    of the lower half of ((2, a), (a, 2)), a = 1: value; value and slope of value_and_grad; exact
#            largest eigenvalue, jax eigh L, symmetrize_input=False: 3; 2.5, 0.5; 3, 1
#            largest eigenvalue, jax eigh L: 2.5; 2.5, 0.5; 3, 1
#            largest eigenvalue, jax.scipy eigh lower: 2.5; 2.5, 0.5; 3, 1
#            largest eigenvalue, torch eigvalsh: 3; 3, 0.5; 3, 1
#            u_1, jax.scipy solve lower pos: 0.3333; 0.3333, 0.1111; 0.3333, -0.1111
#            u_1, jax.scipy cho_solve: 0.3333; 0.3333, -0.05556; 0.3333, -0.1111
#            u_1, torch cholesky_solve: 0.3333; 0.3333, -0.05556; 0.3333, -0.1111
#            scipy eigh lower: 3; scipy solve lower pos: 0.3333
# Used in:   docs/explanation/conventions.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
  jax==0.10.2 torch==2.13.0 scipy==1.17.1 numpy==2.4.6
cd "$folder"
cat >program.py <<'PROGRAM'
import jax
import jax.numpy as jnp
import jax.scipy.linalg as of_jax
import numpy as np
import scipy.linalg
import torch

jax.config.update("jax_enable_x64", True)
torch.set_default_dtype(torch.float64)


def lower(a):
    return jnp.array([[2, 0], [a, 2]])


def lower_torch(a):
    two = torch.tensor(2.0)
    return torch.stack([two, 0 * two, a, two]).reshape(2, 2)


one, eigenvalue, u_1 = np.ones(2), (3.0, 1.0), (1 / 3, -1 / 9)
seen = {  # function: (value, value and slope by value_and_grad), exact
    "largest eigenvalue, jax eigh L, symmetrize_input=False": ((3.0, 2.5, 0.5), eigenvalue),
    "largest eigenvalue, jax eigh L": ((2.5, 2.5, 0.5), eigenvalue),
    "largest eigenvalue, jax.scipy eigh lower": ((2.5, 2.5, 0.5), eigenvalue),
    "largest eigenvalue, torch eigvalsh": ((3.0, 3.0, 0.5), eigenvalue),
    "u_1, jax.scipy solve lower pos": ((1 / 3, 1 / 3, 1 / 9), u_1),
    "u_1, jax.scipy cho_solve": ((1 / 3, 1 / 3, -1 / 18), u_1),
    "u_1, torch cholesky_solve": ((1 / 3, 1 / 3, -1 / 18), u_1),
}


def by_jax(f):
    return float(f(1.0)), *map(float, jax.value_and_grad(f)(1.0))


def by_torch(f):
    a = torch.tensor(1.0, requires_grad=True)
    value = f(lower_torch(a))
    value.backward()
    return value.item(), value.item(), a.grad.item()


found = [
    by_jax(lambda a: jnp.linalg.eigh(lower(a), UPLO="L", symmetrize_input=False)[0][1]),
    by_jax(lambda a: jnp.linalg.eigh(lower(a), UPLO="L")[0][1]),
    by_jax(lambda a: of_jax.eigh(lower(a), lower=True, eigvals_only=True)[1]),
    by_torch(lambda A: torch.linalg.eigvalsh(A)[1]),
    by_jax(lambda a: of_jax.solve(lower(a), one, lower=True, assume_a="pos")[0]),
    by_jax(lambda a: of_jax.cho_solve(of_jax.cho_factor(lower(a), lower=True), one)[0]),
    by_torch(lambda A: torch.cholesky_solve(torch.ones(2, 1), torch.linalg.cholesky(A))[0, 0]),
]
print("of the lower half of ((2, a), (a, 2)), a = 1: value; value and slope of value_and_grad; exact")
for (name, (expected, exact)), one_found in zip(seen.items(), found):
    print("{}: {:.4g}; {:.4g}, {:.4g}; {:.4g}, {:.4g}".format(name, *one_found, *exact))
    assert np.allclose(one_found, expected, rtol=1e-12), "it behaves otherwise now: change the table"
A = np.array([[2.0, 0.0], [1.0, 2.0]])
values = scipy.linalg.eigh(A, lower=True, eigvals_only=True)[1], scipy.linalg.solve(A, one, lower=True, assume_a="pos")[0]
print("scipy eigh lower: {:.4g}; scipy solve lower pos: {:.4g}".format(*values))
assert np.allclose(values, (eigenvalue[0], u_1[0]), rtol=1e-12)
PROGRAM
venv/bin/python program.py
