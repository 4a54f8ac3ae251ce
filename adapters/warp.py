# /// script
# requires-python = ">=3.10"
# dependencies = ["warp-lang==1.19.0", "numpy>=2", "scipy>=1.11"]
# [tool.gradient-routes]
# summary = "Warp: forms by warp.fem, the adjoint by hand, R_p^T lam by a tape of the kernel of R"
# cases = { hyperelastic = { law = ["neo-hookean"], cell_type = ["hexahedron"] } }
# ///
"""The block in warp.fem: forms of R and R_u as integrands, a tape over that of R."""

from time import perf_counter

import numpy as np
import warp as wp
from newton import newton, solve
from routes_adapter import serve
from scipy.sparse import bsr_matrix
from warp import fem

wp.set_device("cpu")
real, vec, Reals, Ints = wp.float64, wp.vec3d, wp.array(dtype=wp.float64), wp.array(dtype=int)


@fem.integrand
def R(s: fem.Sample, u: fem.Field, v: fem.Field, E: Reals, modulus: Ints, mu: real, lam: real):
    F = wp.identity(n=3, dtype=real) + fem.grad(u, s)
    P = mu * F + (lam * wp.log(wp.determinant(F)) - mu) * wp.transpose(wp.inverse(F))
    return E[modulus[s.element_index]] * wp.ddot(P, fem.grad(v, s))


@fem.integrand
def R_u(s: fem.Sample, u: fem.Field, du: fem.Field, v: fem.Field, E: Reals, modulus: Ints, mu: real, lam: real):
    H, B = fem.grad(du, s), wp.transpose(wp.inverse(wp.identity(n=3, dtype=real) + fem.grad(u, s)))
    dP = mu * H + (mu + lam * wp.log(wp.determinant(B))) * B * wp.transpose(H) * B + lam * wp.ddot(B, H) * B
    return E[modulus[s.element_index]] * wp.ddot(dP, fem.grad(v, s))


class Block:
    def load(self, case):
        X, cells, nu, self.case, self.d = case["points"], case["cells"], case["nu"], case, case["data"]
        space = fem.make_polynomial_space(fem.Hexmesh(wp.array(cells, dtype=int), wp.array(X, dtype=vec)), dtype=vec)
        self.forces, self.free = wp.zeros(len(X), dtype=vec, requires_grad=True), np.full(X.shape, True)
        self.fields, self.du = {"u": space.make_field(), "v": fem.make_test(space)}, {"du": fem.make_trial(space)}
        self.values = {"mu": 0.5 / (1 + nu), "lam": nu / ((1 + nu) * (1 - 2 * nu))}
        self.values["modulus"], self.free[case["clamped"]] = wp.array(case["modulus"], dtype=int), False

    def R(self, u):
        self.fields["u"].dof_values = wp.array(u, dtype=vec)
        with wp.Tape() as self.tape:
            fem.integrate(R, fields=self.fields, values=self.values, output=self.forces)
        return self.forces.numpy() - self.case["forces"]

    def R_u(self):
        K = fem.integrate(R_u, fields=self.fields | self.du, values=self.values)
        return bsr_matrix((K.values.numpy()[: K.nnz_sync()], K.columns.numpy()[: K.nnz_sync()], K.offsets.numpy()))

    def value(self, p, rtol=1e-12):
        return self.gradient(p, rtol)["J"]

    def gradient(self, p, rtol, adjoint_rtol=None, options=None):
        E, dE = (np.exp(p), np.exp(p)) if self.case["parametrization"] == "log" else (p, 1.0)
        self.values["E"], J_u, at = wp.array(E, requires_grad=True), np.zeros(self.free.shape), self.case["sensors"]
        start, J_u[at], solved = perf_counter(), newton(self.R, self.R_u, self.free, rtol)[at] - self.d, perf_counter()
        self.tape.backward(grads={self.forces: wp.array(solve(self.R_u(), -J_u, self.free), dtype=vec)})
        g, seconds = self.values["E"].grad.numpy(), {"forward_s": solved - start, "backward_s": perf_counter() - solved}
        return {"J": 0.5 * (J_u**2).sum(), "gradient": dE * g, **seconds}


serve(Block(), "warp", versions=["warp-lang", "scipy"], tighten=True)
