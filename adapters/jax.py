# /// script
# requires-python = ">=3.11"
# dependencies = ["jax==0.10.2", "numpy>=2"]
# [tool.gradient-routes]
# summary = "JAX alone: reverse mode through a dense direct solve, or through conjugate gradients"
# cases = { bar = {} }
# options = { strategy = ["implicit", "unrolled"] }
# ///
"""The bar in JAX, as its users write it: assemble, solve, jax.vjp."""

import jax
import jax.numpy as jnp
from jax_sweeps import value_and_gradient
from routes_adapter import serve

jax.config.update("jax_enable_x64", True)


class Bar:
    def load(self, case):
        self.case = case
        n = case["n"]
        self.B = jnp.eye(n) - jnp.eye(n, k=-1)  # elongations of the elements
        self.f = jnp.zeros(n).at[-1].set(case["load"])
        self.J = jax.jit(self.J, static_argnums=1)

    def J(self, p, solve):
        E = jnp.exp(p) if self.case["parametrization"] == "log" else p
        k = E * self.case["area"] * self.case["n"] / self.case["length"]
        u = solve(self.B.T @ (k[:, None] * self.B), self.f)
        return 0.5 * jnp.sum((u[self.case["sensors"] - 1] - self.case["data"]) ** 2)

    def value(self, p):
        return float(self.J(p, jnp.linalg.solve))

    def gradient(self, p, rtol, adjoint_rtol, options):
        solve = jnp.linalg.solve if options["strategy"] == "implicit" else self.iterations
        return value_and_gradient(lambda p: self.J(p, solve), p)

    def iterations(self, K, f):
        """Conjugate gradients, n of them, on the tape."""

        def step(_, xrd):
            x, r, d = xrd
            alpha = (r @ r) / (d @ K @ d)
            x, r_new = x + alpha * d, r - alpha * K @ d
            return x, r_new, r_new + (r_new @ r_new) / (r @ r) * d

        return jax.lax.fori_loop(0, len(f), step, (jnp.zeros_like(f), f, f))[0]


serve(Bar(), "jax", versions=["jax", "jaxlib"])
