# /// script
# requires-python = ">=3.10"
# dependencies = ["torch==2.13.0", "numpy>=2"]
# [tool.gradient-routes]
# summary = "PyTorch alone: autograd through the loop of an implicit march, its matrix inverted once"
# environment = "torch"
# cases = { vibrating-bar = { scheme = ["newmark"] } }
# ///
"""The vibrating bar in PyTorch: M + h^2/4 K inverted once, a loop over steps, backward().

A factor would be cheaper to make, but reversing cholesky_solve or lu_solve takes N^3 in every step.
"""

from time import perf_counter

import torch
from routes_adapter import serve
from torch_tape import saved_bytes

torch.set_default_dtype(torch.float64)


class Bar:
    def load(self, case):
        n, self.case, self.tape = case["n"], case, None
        L_e, A = case["length"] / n, case["area"]
        self.B = torch.eye(n) - torch.diag(torch.ones(n - 1), -1)  # elongations of the elements
        self.M = torch.full((n,), case["density"] * A * L_e)
        self.M[-1] /= 2
        self.sensors, self.d = torch.as_tensor(case["sensors"]) - 1, torch.as_tensor(case["data"])
        self.stiffness, self.log = A / L_e, case["parametrization"] == "log"
        self.f = torch.zeros(case["steps"], n)
        self.f[:, -1] = torch.as_tensor(case["force"][1:] + case["force"][:-1]) / 2

    def J(self, p):
        """Steps by the change of v: (M + h^2/4 K) dv = h (f - K (u + h/2 v)), f the mean of the step."""
        k, h = self.stiffness * (torch.exp(p) if self.log else p), self.case["dt"]
        inverse = torch.linalg.inv(torch.diag(self.M) + h**2 / 4 * self.B.T @ (k[:, None] * self.B))
        u, v, J = torch.zeros(len(p)), torch.zeros(len(p)), 0.0
        for f, d in zip(self.f, self.d, strict=True):
            dv = inverse @ (h * (f - self.B.T @ (k * (self.B @ (u + h / 2 * v)))))
            u, v = u + h * v + h / 2 * dv, v + dv
            J = J + 0.5 * ((u[self.sensors] - d) ** 2).sum()
        return J

    def value(self, p):
        with torch.no_grad():
            return self.J(torch.as_tensor(p)).item()

    def gradient(self, p, rtol, adjoint_rtol, options):
        p = torch.tensor(p, requires_grad=True)
        self.tape = self.tape or saved_bytes(lambda: self.J(p))
        start = perf_counter()
        J = self.J(p)
        solved = perf_counter()
        J.backward()
        phases = {"forward_s": solved - start, "backward_s": perf_counter() - solved, "tape_bytes": self.tape}
        return {"J": J.item(), "gradient": p.grad.numpy(), **phases}


serve(Bar(), "torch-march", versions=["torch"])
