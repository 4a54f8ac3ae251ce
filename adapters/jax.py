# /// script
# requires-python = ">=3.11"
# dependencies = ["jax==0.10.2", "numpy>=2"]
# [tool.gradient-routes]
# summary = "JAX alone: reverse mode through a dense direct solve, or through conjugate gradients"
# cases = { bar = {} }
# options = { strategy = ["implicit", "unrolled"] }
# ///
"""The bar in JAX, as its users write it: assemble, solve, jax.value_and_grad."""

import jax
import jax.numpy as jnp
from routes_adapter import serve

jax.config.update("jax_enable_x64", True)


class Bar:
    def load(self, case):
        self.case = case
        n = case["n"]
        self.B = jnp.eye(n) - jnp.eye(n, k=-1)  # elongations of the elements
        self.f = jnp.zeros(n).at[-1].set(case["load"])
        return {}

    def J(self, p, solve):
        E = jnp.exp(p) if self.case["parametrization"] == "log" else p
        k = E * self.case["area"] * self.case["n"] / self.case["length"]
        u = solve(self.B.T @ (k[:, None] * self.B), self.f)
        return 0.5 * jnp.sum((u[self.case["sensors"] - 1] - self.case["data"]) ** 2)

    def value(self, p):
        return float(self.J(p, jnp.linalg.solve))

    def gradient(self, p, rtol, adjoint_rtol, options):
        solve = jnp.linalg.solve if options["strategy"] == "implicit" else self.iterations
        J, g = jax.value_and_grad(self.J)(p, solve)
        return {"J": float(J), "gradient": jax.device_get(g)}

    def iterations(self, K, f):
        """Conjugate gradients, n of them, on the tape."""
        x, r, d = jnp.zeros_like(f), f, f
        for _ in range(len(f)):
            alpha = (r @ r) / (d @ K @ d)
            x, r_new = x + alpha * d, r - alpha * K @ d
            d, r = r_new + (r_new @ r_new) / (r @ r) * d, r_new
        return x


serve(Bar(), "jax", versions=["jax", "jaxlib"])
