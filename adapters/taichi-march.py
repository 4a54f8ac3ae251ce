# /// script
# requires-python = ">=3.9,<3.14"
# dependencies = ["taichi==1.7.4", "numpy>=2"]
# [tool.gradient-routes]
# summary = "Taichi in the manner of DiffTaichi: an explicit march on its tape, the states of all steps kept"
# environment = "taichi"
# cases = { vibrating-bar = { scheme = ["central-difference"] } }
# ///
"""The vibrating bar in Taichi (Hu et al. 2020): a kernel for each step, a row of u and v for each state."""

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
def step(t: int, h: float, mass: float, k: Reals, F: Reals, u: Reals, v: Reals):
    for i in range(1, k.shape[0]):  # k[n] = 0
        last = i == k.shape[0] - 1
        force = k[i] * (u[t - 1, i + 1] - u[t - 1, i]) - k[i - 1] * (u[t - 1, i] - u[t - 1, i - 1]) + last * F[t - 1]
        v[t, i] = v[t - 1, i] + h * force / (mass * (0.5 if last else 1.0))
        u[t, i] = u[t - 1, i] + h * v[t, i]


@ti.kernel
def misfit(u: Reals, sensors: ti.types.ndarray(ti.i64), data: Reals, J: Reals):
    for t, s in data:
        J[0] += 0.5 * (u[t + 1, sensors[s]] - data[t, s]) ** 2


class Bar:
    def load(self, case):
        self.case, self.L_e = case, case["length"] / case["n"]
        self.log, self.mass = case["parametrization"] == "log", case["density"] * case["area"] * self.L_e

    def value(self, p):
        return self.gradient(p)["J"]

    def gradient(self, p, rtol=None, adjoint_rtol=None, options=None):
        n, case, p_, k, J = len(p), self.case, zeros(len(p)), zeros(len(p) + 1), zeros(1)
        p_.from_numpy(p)
        u, v, start = zeros(case["steps"] + 1, n + 2), zeros(case["steps"] + 1, n + 2), perf_counter()
        with ti.ad.Tape(J):
            springs(p_, case["area"] / self.L_e, self.log, k)
            for t in range(1, case["steps"] + 1):
                step(t, case["dt"], self.mass, k, case["force"], u, v)
            misfit(u, case["sensors"], case["data"], J)
            solved = perf_counter()
        seconds = {"forward_s": solved - start, "backward_s": perf_counter() - solved}
        kept = 2 * 8 * (case["steps"] + 1) * (n + 2)
        return {"J": J[0], "gradient": p_.grad.to_numpy(), "tape_bytes": kept, **seconds}


def zeros(*shape):
    return ti.ndarray(ti.f64, shape, needs_grad=True)


serve(Bar(), "taichi-march", versions=["taichi"])
