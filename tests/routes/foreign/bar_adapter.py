# /// script
# requires-python = ">=3.9"
# dependencies = ["numpy"]
# [tool.gradient-routes]
# summary = "the bar by cumulative sums, for tests"
# cases = { bar = { parametrization = ["log"] } }
# options = { sums = ["cumulative", "pairwise"] }
# ///
"""The bar by hand, right, or with the mistake that its argument names."""

import sys

import numpy as np
from routes_adapter import Unsupported, serve

MISTAKE = sys.argv[3] if len(sys.argv) > 3 else None


class Bar:
    def load(self, case):
        if case["parametrization"] != "log":
            raise Unsupported(f"log E, not {case['parametrization']}")
        self.case = case
        self.k = case["area"] * case["n"] / case["length"]
        return {}

    def solve(self, p):
        u = np.cumsum(self.case["load"] / (self.k * np.exp(p)))
        return u, u[self.case["sensors"] - 1] - self.case["data"]

    def value(self, p, rtol):
        J = 0.5 * (self.solve(p)[1] ** 2).sum()
        return 3 * J if MISTAKE == "another-J" else J

    def gradient(self, p, rtol, adjoint_rtol, options):
        assert options in ({}, {"sums": "cumulative"})
        u, r = self.solve(p)
        J_u = np.zeros(len(p))
        np.add.at(J_u, self.case["sensors"] - 1, r)
        g = -np.cumsum(J_u[::-1])[::-1] * np.diff(u, prepend=0.0)
        if MISTAKE == "sign":
            g[0] = -g[0]
        if MISTAKE == "loose":
            g = g * (1 + rtol)
        return {"J": self.value(p, rtol), "gradient": 3 * g if MISTAKE == "another-J" else g, "forward_s": 1e-6}


print("a framework that prints while it is imported")
serve(Bar(), "bar-by-hand", versions=["numpy"], tighten=True)
