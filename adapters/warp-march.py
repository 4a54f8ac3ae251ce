# /// script
# requires-python = ">=3.10"
# dependencies = ["warp-lang==1.19.0", "numpy>=2", "scipy>=1.11"]
# [tool.gradient-routes]
# summary = "Warp: an explicit march on its tape of kernels, the states of all steps kept"
# environment = "warp"
# cases = { vibrating-bar = { scheme = ["central-difference"] } }
# ///
"""The vibrating bar in Warp: a kernel for each step, a row of u and v for each state."""

from time import perf_counter

import warp as wp
from routes_adapter import serve

wp.set_device("cpu")
real, Reals, Rows = wp.float64, wp.array(dtype=wp.float64), wp.array2d(dtype=wp.float64)


@wp.kernel
def springs(p: Reals, stiffness: real, log: bool, k: Reals):
    e = wp.tid()
    k[e] = stiffness * wp.where(log, wp.exp(p[e]), p[e])


@wp.kernel
def step(t: int, h: real, mass: real, k: Reals, F: Reals, u: Rows, v: Rows):
    i = wp.tid() + 1  # k[n] = 0
    s, last = t - 1, wp.where(i == k.shape[0] - 1, real(1.0), real(0.0))
    force = k[i] * (u[s, i + 1] - u[s, i]) - k[i - 1] * (u[s, i] - u[s, i - 1]) + last * F[s]
    v[t, i] = v[s, i] + h * force / (mass * (real(1.0) - real(0.5) * last))
    u[t, i] = u[s, i] + h * v[t, i]


@wp.kernel
def misfit(u: Rows, sensors: wp.array(dtype=wp.int64), data: Rows, J: Reals):
    t, s = wp.tid()
    wp.atomic_add(J, 0, real(0.5) * (u[t + 1, int(sensors[s])] - data[t, s]) ** real(2.0))


class Bar:
    def load(self, case):
        self.case, self.log, L_e = case, case["parametrization"] == "log", case["length"] / case["n"]
        self.stiffness, self.mass = case["area"] / L_e, case["density"] * case["area"] * L_e
        self.sensors, self.data, self.F = (wp.array(case[name]) for name in ("sensors", "data", "force"))

    def value(self, p):
        return self.gradient(p)["J"]

    def gradient(self, p, rtol=None, adjoint_rtol=None, options=None):
        n, T, h, p = len(p), self.case["steps"], self.case["dt"], wp.array(p, requires_grad=True)
        k, J, u, v, start = zeros(n + 1), zeros(1), zeros(T + 1, n + 2), zeros(T + 1, n + 2), perf_counter()
        with wp.Tape() as tape:
            wp.launch(springs, n, [p, self.stiffness, self.log], [k])
            for t in range(1, T + 1):
                wp.launch(step, n, [t, h, self.mass, k, self.F], [u, v])
            wp.launch(misfit, self.data.shape, [u, self.sensors, self.data], [J])
        solved = perf_counter()
        tape.backward(J)
        seconds = {"forward_s": solved - start, "backward_s": perf_counter() - solved}
        return {"J": J.numpy().item(), "gradient": p.grad.numpy(), "tape_bytes": 16 * (T + 1) * (n + 2), **seconds}


def zeros(*shape):
    return wp.zeros(shape, dtype=real, requires_grad=True)


serve(Bar(), "warp-march", versions=["warp-lang"])
