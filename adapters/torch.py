# /// script
# requires-python = ">=3.10"
# dependencies = ["torch==2.13.0", "numpy>=2"]
# [tool.gradient-routes]
# summary = "PyTorch alone: autograd through a dense direct solve, or through conjugate gradients"
# cases = { bar = {} }
# options = { strategy = ["implicit", "unrolled"] }
# ///
"""The bar in PyTorch, as its users write it: assemble, solve, backward()."""

from time import perf_counter

import torch
from routes_adapter import serve

torch.set_default_dtype(torch.float64)


class Bar:
    def load(self, case):
        n = case["n"]
        self.B = torch.eye(n) - torch.diag(torch.ones(n - 1), -1)  # elongations of the elements
        self.f = torch.zeros(n)
        self.f[-1] = case["load"]
        self.sensors, self.d = torch.as_tensor(case["sensors"]) - 1, torch.as_tensor(case["data"])
        self.stiffness = case["area"] * n / case["length"]
        self.log = case["parametrization"] == "log"

    def J(self, p, solve):
        k = self.stiffness * (torch.exp(p) if self.log else p)
        u = solve(self.B.T @ (k[:, None] * self.B), self.f)
        return 0.5 * ((u[self.sensors] - self.d) ** 2).sum()

    def value(self, p):
        return self.J(torch.as_tensor(p), torch.linalg.solve).item()

    def gradient(self, p, rtol, adjoint_rtol, options):
        solve = torch.linalg.solve if options["strategy"] == "implicit" else self.iterations
        p, start, saved = torch.tensor(p, requires_grad=True), perf_counter(), {}

        def save(x):
            saved[x.data_ptr()] = x.nbytes
            return x

        with torch.autograd.graph.saved_tensors_hooks(save, lambda x: x):
            J = self.J(p, solve)
        solved = perf_counter()
        J.backward()
        phases = {"forward_s": solved - start, "backward_s": perf_counter() - solved, "tape_bytes": sum(saved.values())}
        return {"J": J.item(), "gradient": p.grad.numpy(), **phases}

    @staticmethod
    def iterations(K, f):
        """Conjugate gradients, n of them, on the tape."""
        x, r, d = torch.zeros_like(f), f, f
        for _ in range(len(f)):
            alpha = (r @ r) / (d @ K @ d)
            x, r_new = x + alpha * d, r - alpha * (K @ d)
            d, r = r_new + (r_new @ r_new) / (r @ r) * d, r_new
        return x


serve(Bar(), "torch", versions=["torch"])
