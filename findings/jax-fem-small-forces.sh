#!/usr/bin/env bash
# Software:  jax-fem 0.0.12 with jax 0.10.2, PETSc of dolfinx-solver-real 0.11.0.post0, Python 3.12
# Behaviour: Newton stops when |R| <= 1e-6 or |R| <= 1e-8 |R_0|, whichever comes first, and the first one has a unit:
#            with moduli and tractions in a unit 1e5 times larger, u = 0 is returned as the solution, without a word.
#            tol = 0 does not mend it: the linear solver's own 1e-10 is absolute too, and steps have no limit. What a
#            surface map returns is added to R: a positive one pushes. The package names no dependencies.
# Output:    a cube of E = 1, pulled by t = 0.1: u = -0.1
#            E = 1e-3, t = 1e-4: u = -0.1
#            E = 1e-5, t = 1e-6: u = 0
#            E = 1e-10, t = 1e-11, tol = 0: 10 steps, and no end
# Used in:   adapters/jax-fem.py
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check jax-fem==0.0.12 jax==0.10.2 \
  dolfinx-solver-real==0.11.0.post0 gmsh==4.15.2 meshio==5.3.5 numpy==2.5.5 pyfiglet==1.0.4 scipy==1.18.1
cd "$folder"
cat >program.py <<'PROGRAM'
from mpi4py import MPI  # before petsc4py
import itertools
import sys

import jax.numpy as jnp
import numpy as np

sys.stdout, console = None, sys.stdout  # JAX-FEM prints a banner, and an empty line at every step
from jax_fem import logger
from jax_fem.generate_mesh import Mesh
from jax_fem.problem import Problem
from jax_fem.solver import solver

LIMIT = 10


def limited(record):
    if record.getMessage().split() == ["iter", str(LIMIT)]:
        raise StopIteration
    return record.levelno > 20  # INFO


logger.addFilter(limited)


class Cube(Problem):
    """Linear elastic, E = unit and nu = 0, clamped at z = 0; a surface map on its top."""

    def custom_init(self, unit):
        self.unit = unit

    def get_tensor_map(self):
        return lambda H: self.unit * (H + H.T) / 2

    def get_surface_maps(self):
        return [lambda u, x: jnp.array([0.0, 0.0, 0.1 * self.unit])]


def height(unit, **newton):
    points = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    cells = np.array([[0, 4, 6, 2, 1, 5, 7, 3]])
    clamp = [lambda x: jnp.isclose(x[2], 0.0)] * 3, [0, 1, 2], [lambda x: 0.0] * 3
    top = [lambda x: jnp.isclose(x[2], 1.0)]
    cube = Cube(Mesh(points, cells), 3, 3, dirichlet_bc_info=clamp, location_fns=top, additional_info=(unit,))
    return float(solver(cube, {"newton": newton})[0][7, 2])


for unit, expected in ((1.0, -0.1), (1e-3, -0.1), (1e-5, 0.0)):
    found = height(unit)
    print(f"E = {unit:g}, t = {0.1 * unit:g}: u = {found:g}", file=console)
    assert abs(found - expected) < 1e-12, "it behaves otherwise now: is the adapter right?"
try:
    raise AssertionError(f"tol = 0: u = {height(1e-10, tol=0.0)}, it behaves otherwise now: is the adapter right?")
except StopIteration:
    print(f"E = 1e-10, t = 1e-11, tol = 0: {LIMIT} steps, and no end", file=console)
PROGRAM
venv/bin/python program.py
