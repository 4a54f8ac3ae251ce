# /// script
# requires-python = ">=3.12"
# dependencies = ["feax==0.8.0", "jax==0.11.2", "numpy>=2"]
# [tool.gradient-routes]
# summary = "feax: the custom VJP of its Newton solve with SuperLU, at its own tolerances or at ours"
# cases = { hyperelastic = { law = ["neo-hookean"], cell_type = ["hexahedron"] } }
# options = { tolerances = ["default", "tight"] }
# ///
"""The block in feax. As in JAX-FEM, what a surface map returns is added to R; here -f, as an extra residual."""

from functools import cache

from routes_adapter import serve
import feax as fe
import jax.numpy as jnp
from feax.solvers.newton import NewtonLineSearchError
from jax_sweeps import value_and_gradient


class Solid(fe.Problem):
    def custom_init(self, nu):
        self.nu = nu

    def get_tensor_map(self):
        def P(H, E):
            nu, F = self.nu, H + jnp.eye(3)
            mu, lmbda = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
            return mu * F + (lmbda * jnp.log(jnp.linalg.det(F)) - mu) * jnp.linalg.inv(F).T

        return P


class Block:
    def load(self, case):
        fixed, f = case["points"][case["clamped"]], jnp.ravel(case["forces"])
        solid = Solid(fe.Mesh(case["points"], case["cells"]), vec=3, dim=3, additional_info=(case["nu"],))
        base = fe.DirichletBCSpec(lambda x: (jnp.abs(fixed - x).max(axis=1) < 1e-9).any(), "all", 0.0)
        bc = fe.DirichletBCConfig([base]).create_bc(solid)
        ts, start = fe.TracedStructure.from_problem(solid), fe.zero_like_initial_guess(solid, bc)

        @cache  # with what it compiles
        def J(rtol=1e-12, tolerances="tight"):
            newton = fe.NewtonOptions(tol=0.0, rel_tol=rtol) if tolerances == "tight" else fe.NewtonOptions()
            superlu = fe.DirectSolverOptions(solver="spsolve")
            solve = fe.create_solver(
                solid, bc, superlu, newton_options=newton, extra_residual_fn=lambda u: -f, traced_structure=ts
            )

            def of(p):
                E = (jnp.exp(p) if case["parametrization"] == "log" else p)[case["modulus"]]
                u = solve(fe.TracedParams(volume_vars=(E,)), start, traced_structure=ts).field(0)
                return jnp.sum((u[case["sensors"]] - case["data"]) ** 2) / 2

            return of

        self.J = J

    def value(self, p):
        return float(self.J()(p))

    def gradient(self, p, rtol, adjoint_rtol, options):
        return value_and_gradient(self.J(rtol, **options), p)


serve(Block(), "feax", versions=["feax", "jax"], kinds={NewtonLineSearchError: "not-converged"})
