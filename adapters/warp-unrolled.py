# /// script
# requires-python = ">=3.10"
# dependencies = ["warp-lang==1.19.0", "numpy>=2", "scipy>=1.11"]
# [tool.gradient-routes]
# summary = "Warp: its tape of kernels, through unrolled gradient descent with momentum"
# environment = "warp"
# cases = { bar = {} }
# ///
"""The bar in Warp: each iterate is an array of its own, because a tape reads them again."""

import math
from time import perf_counter

import warp as wp
from routes_adapter import serve

wp.set_device("cpu")
real, Reals = wp.float64, wp.array(dtype=wp.float64)


@wp.kernel
def springs(p: Reals, stiffness: real, log: bool, k: Reals):
    e = wp.tid()
    k[e] = stiffness * wp.where(log, wp.exp(p[e]), p[e])


@wp.kernel
def descend(k: Reals, load: real, alpha: real, beta: real, u_old: Reals, u: Reals, u_new: Reals):
    i = wp.tid() + 1
    force = k[i] * (u[i + 1] - u[i]) - k[i - 1] * (u[i] - u[i - 1]) + wp.where(i == k.shape[0] - 1, load, real(0.0))
    u_new[i] = u[i] + alpha * force + beta * (u[i] - u_old[i])


@wp.kernel
def misfit(u: Reals, sensors: wp.array(dtype=wp.int64), data: Reals, J: Reals):
    s = wp.tid()
    wp.atomic_add(J, 0, real(0.5) * (u[sensors[s]] - data[s]) ** real(2.0))


class Bar:
    def load(self, case):
        self.case, self.k, self.log = case, case["area"] * case["n"] / case["length"], case["parametrization"] == "log"
        self.sensors, self.data = wp.array(case["sensors"]), wp.array(case["data"])

    def value(self, p, rtol=1e-12):
        return self.gradient(p, rtol)["J"]

    def gradient(self, p, rtol, adjoint_rtol=None, options=None):
        n, E = len(p), [math.exp(x) if self.log else x for x in p]
        root_L, root_mu = 2 * (self.k * max(E)) ** 0.5, 2 * (self.k * min(E)) ** 0.5 * math.sin(math.pi / (4 * n + 2))
        alpha, rate = 4 / (root_L + root_mu) ** 2, (root_L - root_mu) / (root_L + root_mu)
        steps = int(1.2 * math.log(rtol) / math.log(rate)) + 1
        p, k, J, *u = wp.array(p, requires_grad=True), zeros(n + 1), zeros(1), *(zeros(n + 2) for _ in range(steps + 2))
        start = perf_counter()
        with wp.Tape() as tape:
            wp.launch(springs, n, [p, self.k, self.log], [k])
            for j in range(steps):
                wp.launch(descend, n, [k, self.case["load"], alpha, rate**2, u[j], u[j + 1]], [u[j + 2]])
            wp.launch(misfit, len(self.data), [u[-1], self.sensors, self.data], [J])
        solved = perf_counter()
        tape.backward(J)
        seconds = {"forward_s": solved - start, "backward_s": perf_counter() - solved}
        return {"J": J.numpy().item(), "gradient": p.grad.numpy(), "tape_bytes": 8 * (n + 2) * (steps + 2), **seconds}


def zeros(n):
    return wp.zeros(n, dtype=real, requires_grad=True)


serve(Bar(), "warp-unrolled", versions=["warp-lang"], tighten=True)
