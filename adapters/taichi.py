# /// script
# requires-python = ">=3.9,<3.14"
# dependencies = ["taichi==1.7.4", "numpy>=2"]
# [tool.gradient-routes]
# summary = "Taichi: reverse mode by source transformation, through unrolled gradient descent with momentum"
# cases = { bar = {} }
# ///
"""The bar in Taichi: each iterate has a row of its own, because a tape reads them again."""

import math
import os
from time import perf_counter

import taichi as ti
from routes_adapter import serve

ti.init(arch=ti.cpu, default_fp=ti.f64, cpu_max_num_threads=int(os.environ["OMP_NUM_THREADS"]))
Reals = ti.types.ndarray(ti.f64)


@ti.kernel
def springs(p: Reals, stiffness: float, log: bool, k: Reals):
    for e in p:
        k[e] = stiffness * (ti.exp(p[e]) if log else p[e])


@ti.kernel
def descend(k: Reals, load: float, alpha: float, beta: float, j: int, u: Reals):
    for i in range(1, k.shape[0]):  # k[n] = 0
        force = k[i] * (u[j, i + 1] - u[j, i]) - k[i - 1] * (u[j, i] - u[j, i - 1]) + load * (i == k.shape[0] - 1)
        u[j + 1, i] = u[j, i] + alpha * force + beta * (u[j, i] - u[j - 1, i])


@ti.kernel
def misfit(u: Reals, sensors: ti.types.ndarray(ti.i64), data: Reals, J: Reals):
    for s in data:
        J[0] += 0.5 * (u[u.shape[0] - 1, sensors[s]] - data[s]) ** 2


class Bar:
    def load(self, case):
        self.case, self.k, self.log = case, case["area"] * case["n"] / case["length"], case["parametrization"] == "log"

    def value(self, p, rtol=1e-12):
        return self.gradient(p, rtol)["J"]

    def gradient(self, p, rtol, adjoint_rtol=None, options=None):
        n, p_, k, J = self.case["n"], zeros(len(p)), zeros(len(p) + 1), zeros(1)
        p_.from_numpy(p)
        E = [math.exp(x) if self.log else x for x in p]
        root_L, root_mu = 2 * (self.k * max(E)) ** 0.5, 2 * (self.k * min(E)) ** 0.5 * math.sin(math.pi / (4 * n + 2))
        alpha, rate = 4 / (root_L + root_mu) ** 2, (root_L - root_mu) / (root_L + root_mu)
        u, start = zeros(int(1.2 * math.log(rtol) / math.log(rate)) + 3, n + 2), perf_counter()
        with ti.ad.Tape(J):
            springs(p_, self.k, self.log, k)
            for j in range(1, u.shape[0] - 1):
                descend(k, self.case["load"], alpha, rate**2, j, u)
            misfit(u, self.case["sensors"], self.case["data"], J)
            solved = perf_counter()
        seconds = {"forward_s": solved - start, "backward_s": perf_counter() - solved}
        return {"J": J[0], "gradient": p_.grad.to_numpy(), "tape_bytes": 8 * math.prod(u.shape), **seconds}


def zeros(*shape):
    return ti.ndarray(ti.f64, shape, needs_grad=True)


serve(Bar(), "taichi", versions=["taichi"], tighten=True)
