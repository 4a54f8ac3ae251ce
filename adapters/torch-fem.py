# /// script
# requires-python = ">=3.10"
# dependencies = ["torch-fem==0.14.0", "torch==2.13.0"]
# [tool.gradient-routes]
# summary = "torch-fem: adjoint of its Newton solve by autograd, with a direct solver or conjugate gradients"
# cases = { hyperelastic = { law = ["neo-hookean"], cell_type = ["hexahedron"] }, bar = {} }
# options = { solver = ["direct", "cg"] }
# ///
"""The block and the bar in torch-fem: a model, solve() with its differentiable parameters, backward()."""

from time import perf_counter

import torch
from routes_adapter import serve
from torchfem import Solid, Truss
from torchfem.materials import Hyperelastic3D, IsotropicElasticity1D
from torchfem.sparse import ConvergenceError

torch.set_default_dtype(torch.float64)
ConvergenceError.kind = "not-converged"


def neo_hookean(F, q):
    C = F.mT @ F
    ln_J = 0.5 * torch.logdet(C)
    return q[0] / 2 * (torch.trace(C) - 3) - q[0] * ln_J + q[1] / 2 * ln_J**2


class TorchFem:
    def load(self, case):
        self.case = {name: torch.as_tensor(it) if hasattr(it, "dtype") else it for name, it in case.items()}
        if case["kind"] == "bar":
            x, n = torch.linspace(0.0, case["length"], case["n"] + 1)[:, None], case["n"]
            forces, data = torch.zeros_like(x), self.case["data"][:, None]
            forces[-1], cells = case["load"], torch.arange(n)[:, None] + torch.arange(2)
            self.case.update(points=x, cells=cells, forces=forces, clamped=0, data=data)

    def model(self, E):
        case, nu = self.case, self.case.get("nu")
        if case["kind"] == "bar":
            model = Truss(case["points"], case["cells"], IsotropicElasticity1D(E))
            model.areas = torch.full_like(E, case["area"])
        else:
            E = E[case["modulus"]]
            q = torch.stack([E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))], dim=-1)
            model = Solid(case["points"], case["cells"], Hyperelastic3D(neo_hookean, q))
        model.forces, model.constraints[case["clamped"]] = case["forces"], True
        return model

    def J(self, p, rtol, stol, method="direct"):
        model = self.model(torch.exp(p) if self.case["parametrization"] == "log" else p)
        u, *_ = model.solve(rtol=rtol, atol=0.0, stol=stol, method=method, differentiable_parameters=p)
        return 0.5 * ((u[self.case["sensors"]] - self.case["data"]) ** 2).sum()

    def value(self, p, rtol=1e-12):
        return self.J(torch.as_tensor(p), rtol, rtol).item()

    def gradient(self, p, rtol, adjoint_rtol, options):
        p, start = torch.tensor(p, requires_grad=True), perf_counter()
        J = self.J(p, rtol, min(rtol, adjoint_rtol), options["solver"])
        solved = perf_counter()
        J.backward()
        seconds = {"forward_s": solved - start, "backward_s": perf_counter() - solved}
        return {"J": J.item(), "gradient": p.grad.numpy(), **seconds}


serve(TorchFem(), "torch-fem", versions=["torch-fem", "torch"], tighten=True)
