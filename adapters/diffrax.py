# /// script
# requires-python = ">=3.11"
# dependencies = ["diffrax==0.7.2", "lineax==0.1.1", "optimistix==0.1.0", "equinox==0.13.8", "jax==0.10.2", "numpy>=2"]
# [tool.gradient-routes]
# summary = "Diffrax: Newmark's steps as a solver of its own, backward by RecursiveCheckpointAdjoint"
# cases = { vibrating-bar = { scheme = ["newmark"] } }
# ///
"""The vibrating bar in Diffrax, marched by a solver that takes Newmark's steps; J is marched along, not kept."""

import diffrax as dfx
import jax
import jax.numpy as jnp
from diffrax_newmark import Newmark
from jax_sweeps import value_and_gradient
from routes_adapter import serve

jax.config.update("jax_enable_x64", True)


class Bar:
    def load(self, case):
        n, self.case = case["n"], case
        self.L_e, self.A = case["length"] / n, case["area"]
        self.M = jnp.full(n, case["density"] * self.A * self.L_e).at[-1].divide(2)
        self.compiled = jax.jit(self.J)

    def J(self, p):
        case, n = self.case, self.case["n"]
        k = (jnp.exp(p) if case["parametrization"] == "log" else p) * self.A / self.L_e
        known = self.M, case["dt"], case["force"], case["sensors"], case["data"]
        solution = dfx.diffeqsolve(
            dfx.ODETerm(lambda t, y, args: y),
            Newmark(),
            0.0,
            case["steps"] * case["dt"],
            None,
            (jnp.zeros(n), jnp.zeros(n), jnp.array(0.0)),
            (k, *map(jnp.asarray, known)),
            stepsize_controller=dfx.StepTo(case["dt"] * jnp.arange(case["steps"] + 1)),
            adjoint=dfx.RecursiveCheckpointAdjoint(),
            max_steps=case["steps"],
        )
        return solution.ys[2][0]

    def value(self, p):
        return float(self.compiled(p))

    def gradient(self, p, rtol, adjoint_rtol, options):
        return value_and_gradient(self.compiled, p)


serve(Bar(), "diffrax", versions=["diffrax", "jax"])
