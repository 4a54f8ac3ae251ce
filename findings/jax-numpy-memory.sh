#!/usr/bin/env bash
# Software:  jax 0.10.2 on a CPU, Python 3.11
# Behaviour: jax.vjp(f, x) of a NumPy array keeps that array, not a copy: where it is overwritten before the pull-back, as
#            by an optimizer that works in place, the gradient is wrong, without an error. jax.device_put(x) shares the
#            memory of x where that begins at a multiple of 64 bytes, and copies it elsewhere: JAX's own array, said to
#            be immutable, changes with x, or does not, by where NumPy happens to have put x. jnp.asarray copies.
#            (jax-ml/jax#37830 has device_put.)
# Output:    of sum(x * x) at 1.1, x = 5 after the forward sweep: exact 2.2
#            at a multiple of 64 bytes: x 10, jax.device_put(x) 10, jnp.asarray(x) 2.2
#            8 bytes beyond it: x 10, jax.device_put(x) 2.2, jnp.asarray(x) 2.2
# Used in:   docs/explanation/conventions.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check jax==0.10.2 numpy==2.4.6
cd "$folder"
cat >program.py <<'PROGRAM'
import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)
memory = np.empty(16)
start = -memory.ctypes.data % 64 // 8


def slope(put, offset):
    """dJ/dx_1 of J = sum(x * x), pulled back after x was overwritten."""
    x = memory[start + offset :][:4]
    x[:] = 1.1
    J, pull = jax.vjp(lambda x: jnp.sum(x * x), put(x))
    J.block_until_ready()
    x[:] = 5.0
    return round(float(pull(1.0)[0][0]), 6)


print("of sum(x * x) at 1.1, x = 5 after the forward sweep: exact 2.2")
found = {}
for place, offset in (("at a multiple of 64 bytes", 0), ("8 bytes beyond it", 1)):
    found[place] = [slope(put, offset) for put in (lambda x: x, jax.device_put, jnp.asarray)]
    print("{}: x {:g}, jax.device_put(x) {:g}, jnp.asarray(x) {:g}".format(place, *found[place]))
assert [*found.values()] == [[10.0, 10.0, 2.2], [10.0, 2.2, 2.2]], "it behaves otherwise now: change the table"
PROGRAM
venv/bin/python program.py
