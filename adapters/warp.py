# /// script
# requires-python = ">=3.10"
# dependencies = ["warp-lang==1.19.0", "numpy>=2", "scipy>=1.11"]
# [tool.gradient-routes]
# summary = "Warp: R by warp.fem on a tape, whose backward sweeps give R_u^T v and R_p^T lam"
# cases = { hyperelastic = { law = ["neo-hookean"], cell_type = ["hexahedron"] } }
# ///
"""The block in warp.fem: Newton's method and the adjoint by conjugate gradients over the tape of R."""

import numpy as np
import warp as wp
import warp.fem as fem
from newton_cg import newton, solve
from routes_adapter import serve

wp.set_device("cpu")
real = wp.float64


@fem.integrand
def work(s: fem.Sample, u: fem.Field, v: fem.Field, E: wp.array(dtype=real), modulus: wp.array(dtype=int), nu: real):
    F = wp.identity(n=3, dtype=real) + fem.grad(u, s)
    mu = E[modulus[s.element_index]] / (real(2.0) * (real(1.0) + nu))
    lam = real(2.0) * mu * nu / (real(1.0) - real(2.0) * nu)
    P = mu * F + (lam * wp.log(wp.determinant(F)) - mu) * wp.transpose(wp.inverse(F))
    return wp.ddot(P, fem.grad(v, s))


class Block:
    def load(self, case):
        mesh = fem.Hexmesh(wp.array(case["cells"], dtype=int), wp.array(case["points"], dtype=wp.vec3d))
        space = fem.make_polynomial_space(mesh, dtype=wp.vec3d)
        self.case, self.fields = case, {"u": space.make_field(), "v": fem.make_test(space)}
        self.u, self.R = self.fields["u"].dof_values, wp.zeros(len(case["points"]), dtype=wp.vec3d, requires_grad=True)
        self.u.requires_grad, self.free = True, np.ones_like(case["points"])
        self.free[case["clamped"]] = 0.0
        self.values = {"modulus": wp.array(case["modulus"], dtype=int), "nu": case["nu"]}

    def residual(self, u):
        self.u.assign(u)
        with wp.Tape() as self.tape:
            fem.integrate(work, fields=self.fields, values=self.values, output=self.R)
        return self.free * (self.R.numpy() - self.case["forces"])

    def pull_back(self, v):
        self.tape.zero()
        self.tape.backward(grads={self.R: wp.array(v, dtype=wp.vec3d)})
        return self.free * self.u.grad.numpy()

    def value(self, p):
        return self.gradient(p)["J"]

    def gradient(self, p, rtol=1e-12, adjoint_rtol=1e-12, options=None):
        E, dE = (np.exp(p), np.exp(p)) if self.case["parametrization"] == "log" else (p, 1.0)
        self.values["E"], J_u = wp.array(E, requires_grad=True), np.zeros_like(self.free)
        u = newton(self.residual, self.pull_back, np.zeros_like(self.free), rtol)
        J_u[self.case["sensors"]] = u[self.case["sensors"]] - self.case["data"]
        self.pull_back(solve(self.pull_back, -self.free * J_u, adjoint_rtol))
        return {"J": 0.5 * (J_u**2).sum(), "gradient": self.values["E"].grad.numpy() * dE}


serve(Block(), "warp", versions=["warp-lang", "scipy"])
