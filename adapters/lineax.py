# /// script
# requires-python = ">=3.11"
# dependencies = ["lineax==0.1.1", "optimistix==0.1.0", "jax==0.10.2", "numpy>=2"]
# [tool.gradient-routes]
# summary = "Lineax and Optimistix: implicit differentiation of a linear solve, or of Newton's method"
# cases = { bar = {} }
# options = { solver = ["tridiagonal", "cg", "newton", "newton-unrolled"] }
# ///
"""The bar in Lineax, a tridiagonal operator and its solve, or in Optimistix, the root of the residual."""

import equinox as eqx
import jax
import jax.numpy as jnp
import lineax as lx
import optimistix as optx
from jax_sweeps import value_and_gradient
from routes_adapter import serve

jax.config.update("jax_enable_x64", True)
eqx.EquinoxRuntimeError.kind = "not-converged"


class Bar:
    def load(self, case):
        self.case = case
        self.f = jnp.zeros(case["n"]).at[-1].set(case["load"])
        self.J = jax.jit(self.J, static_argnums=(1, 2))

    def J(self, p, rtol, solver="tridiagonal"):
        E = jnp.exp(p) if self.case["parametrization"] == "log" else p
        k = E * self.case["area"] * self.case["n"] / self.case["length"]
        diagonal, beside = k + jnp.append(k[1:], 0.0), -k[1:]
        K = lx.TridiagonalLinearOperator(diagonal, beside, beside)
        atol = rtol * self.case["load"]  # with 0, CG ends after a step and Newton never
        if solver.startswith("newton"):
            newton, R = optx.Newton(rtol, atol), lambda u, K: K.mv(u) - self.f
            way = optx.RecursiveCheckpointAdjoint() if solver == "newton-unrolled" else optx.ImplicitAdjoint()
            u = optx.root_find(R, newton, jnp.zeros_like(self.f), args=K, adjoint=way).value
        else:
            K = lx.TaggedLinearOperator(K, lx.positive_semidefinite_tag)
            u = lx.linear_solve(K, self.f, lx.CG(rtol, atol) if solver == "cg" else lx.Tridiagonal()).value
        return 0.5 * jnp.sum((u[self.case["sensors"] - 1] - self.case["data"]) ** 2)

    def value(self, p, rtol=1e-12):
        return float(self.J(p, rtol))

    def gradient(self, p, rtol, adjoint_rtol, options):
        return value_and_gradient(lambda p: self.J(p, rtol, **options), p)


serve(Bar(), "lineax", versions=["lineax", "optimistix", "jax"], tighten=True)
