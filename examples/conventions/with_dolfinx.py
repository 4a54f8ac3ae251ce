"""What UFL, compiled by DOLFINx, returns where there is no derivative, and what DOLFINx says of unfinished solves."""

import json
from importlib.metadata import version

from mpi4py import MPI  # before DOLFINx, whose wheel finds its library by that
import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import LinearProblem, NonlinearProblem

max_, min_, where, sqrt = ufl.max_value, ufl.min_value, ufl.conditional, ufl.sqrt
SLOPES = {
    "max(x, y) at 1, 1": (max_, 1, 1),
    "min(x, y) at 1, 1": (min_, 1, 1),
    "max(x, 0)": (lambda x: max_(x, 0), 0),
    "max(0, x)": (lambda x: max_(0, x), 0),
    "x where x > 0, else 0": (lambda x: where(x > 0, x, 0), 0),
    "x where x >= 0, else 0": (lambda x: where(x >= 0, x, 0), 0),
    "(x + |x|) / 2": (lambda x: (x + abs(x)) / 2, 0),
    "max(min(x, 1), 0) at 0": (lambda x: max_(min_(x, 1), 0), 0),
    "max(min(x, 1), 0) at 1": (lambda x: max_(min_(x, 1), 0), 1),
    "|x|": (abs, 0),
    "sqrt(x^2)": (lambda x: sqrt(x**2), 0),
    "sqrt(x)": (sqrt, 0),
    "x^0.5": (lambda x: x**0.5, 0),
    "x^1.5": (lambda x: x**1.5, 0),
    "sqrt(x)^3": (lambda x: sqrt(x) ** 3, 0),
    "x^n by x and n at 0, 2": (lambda x, n: x**n, 0, 2),
    "sqrt(x^2 + y^2)": (lambda x, y: sqrt(x**2 + y**2), 0, 0),
    "atan2(y, x)": (ufl.atan2, 0, 0),
    "sqrt(x) where x > 0, else 0": (lambda x: where(x > 0, sqrt(x), 0), 0),
    "det [[1, 0], [0, a]]": (lambda a: ufl.det(ufl.as_matrix([[1, 0], [0, a]])), 0),
}
bar = mesh.create_unit_interval(MPI.COMM_SELF, 8)
V = fem.functionspace(bar, ("Lagrange", 1))
v, clamp = ufl.TestFunction(V), fem.dirichletbc(0.0, fem.locate_dofs_geometrical(V, lambda x: x[0] == 0), V)


def slopes(f, *at):
    at = [ufl.variable(fem.Constant(bar, float(x))) for x in at]
    return [ufl.diff(f(*at), x) for x in at]


def by_cg():
    """CG without a preconditioner on -u'' = 1, u(1) = 1/2, after 2 iterations."""
    u = ufl.TrialFunction(V)
    options = {"ksp_type": "cg", "pc_type": "none", "ksp_max_it": 2}
    a, L = u.dx(0) * v.dx(0) * ufl.dx, fem.Constant(bar, 72.0) * v * ufl.dx  # u(1) = 36
    problem = LinearProblem(a, L, bcs=[clamp], petsc_options_prefix="linear_", petsc_options=options)
    u = problem.solve()
    return [f"`solver.reason` {problem.solver.reason}", float(u.x.array[-1])]


def by_newton():
    u = fem.Function(V)
    options = {"ksp_type": "preonly", "pc_type": "lu", "snes_max_it": 2}
    R = (u.dx(0) * v.dx(0) + (u**3 - 72) * v) * ufl.dx
    problem = NonlinearProblem(R, u, bcs=[clamp], petsc_options_prefix="nonlinear_", petsc_options=options)
    problem.solve()
    return [f"`solver.reason` {problem.solver.reason}", float(u.x.array[-1])]


all_slopes = {name: slopes(*case) for name, case in SLOPES.items()}
expression = fem.Expression(ufl.as_vector([s for each in all_slopes.values() for s in each]), np.array([[0.5]]))
values = iter(expression.eval(bar, np.array([0], np.int32)).ravel().tolist())
found = {name: [next(values) for _ in each] for name, each in all_slopes.items()}
found |= {"`dolfinx.fem.petsc.LinearProblem`, CG": by_cg(), "`dolfinx.fem.petsc.NonlinearProblem`": by_newton()}
print(json.dumps({f"DOLFINx {version('dolfinx-solver-real').partition('.post')[0]}": found}))
