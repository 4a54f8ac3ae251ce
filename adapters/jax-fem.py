# /// script
# requires-python = ">=3.12"
# # JAX-FEM's metadata name no dependencies; DOLFINx' wheel brings petsc4py and basix
# dependencies = [
#   "jax-fem==0.0.12", "jax==0.10.2", "dolfinx-solver-real==0.11.0.post0", "gmsh==4.15.2", "meshio==5.3.5",
#   "numpy>=2", "pyfiglet==1.0.4", "scipy==1.18.1",
# ]
# [tool.gradient-routes]
# summary = "JAX-FEM: the custom VJP of its Newton solve, at its own tolerances or at ours by a direct solver"
# cases = { hyperelastic = { law = ["neo-hookean"], cell_type = ["hexahedron"] } }
# options = { tolerances = ["default", "tight"] }
# ///
"""The block in JAX-FEM: a Problem in its ad_wrapper. What a surface map returns is added to R, as -f is here."""

import sys

from routes_adapter import serve
from mpi4py import MPI  # noqa: F401 - before petsc4py, which finds its library by that

sys.stdout = None  # no banner, and no empty line at every step
import jax.numpy as jnp
from jax_fem import logger
from jax_fem.generate_mesh import Mesh
from jax_fem.problem import Problem
from jax_fem.solver import ad_wrapper
from jax_sweeps import value_and_gradient

logger.setLevel("WARNING")


class Solid(Problem):
    def custom_init(self, case):
        self.case = case

    def set_params(self, p):
        E = (jnp.exp(p) if self.case["parametrization"] == "log" else p)[self.case["modulus"]]
        self.internal_vars = [jnp.repeat(E[:, None], self.fes[0].num_quads, axis=1)]

    def get_tensor_map(self):
        def P(H, E):
            nu, F = self.case["nu"], H + jnp.eye(3)
            mu, lmbda = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
            return mu * F + (lmbda * jnp.log(jnp.linalg.det(F)) - mu) * jnp.linalg.inv(F).T

        return P

    def compute_residual(self, u):
        return [super().compute_residual(u)[0] - self.case["forces"]]

    def newton_update(self, u):
        return [super().newton_update(u)[0] - self.case["forces"]]


class Block:
    def load(self, case):
        fixed = [lambda x, node: jnp.isin(node, case["clamped"])] * 3, [0, 1, 2], [lambda x: 0.0] * 3
        mesh = Mesh(case["points"], case["cells"])
        self.solid = Solid(mesh, vec=3, dim=3, dirichlet_bc_info=fixed, additional_info=(case,))

    def J(self, p, rtol=1e-12, tolerances="tight"):
        linear = {"spsolve_solver": {}} if tolerances == "tight" else {}  # bicgstab to 1e-10
        newton = {"tol": 0.0, "rel_tol": rtol} if tolerances == "tight" else {}  # 1e-6 [N] or 1e-8
        (u,) = ad_wrapper(self.solid, {"newton": {**newton, "linear": linear}}, linear)(p)
        return jnp.sum((u[self.solid.case["sensors"]] - self.solid.case["data"]) ** 2) / 2

    def value(self, p):
        return float(self.J(p))

    def gradient(self, p, rtol, adjoint_rtol, options):
        return value_and_gradient(lambda p: self.J(p, rtol, **options), p)


serve(Block(), "jax-fem", versions=["jax-fem", "jax", "dolfinx-solver-real"], kinds={AssertionError: "not-converged"})
