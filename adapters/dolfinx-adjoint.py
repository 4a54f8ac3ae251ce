# /// script
# requires-python = ">=3.12"
# dependencies = [
#   "dolfinx-solver-real==0.11.0.post0", "h5py>=3.11", "numpy>=2", "packaging>=24.2", "pyadjoint-ad==2026.10.0",
# ]
# [tool.gradient-routes]
# summary = "dolfinx-adjoint: DOLFINx with a tape of pyadjoint, started from zero each time, MUMPS"
# without-dependencies = ["dolfinx-adjoint==0.4.0", "fenicsx-compat==0.4.0"] # they want DOLFINx by another name
# cases = { hyperelastic = { law = ["neo-hookean"], cell_type = ["hexahedron"] } }
# ///
"""The block in DOLFINx with dolfinx-adjoint: nodal forces and sensors are integrals over vertices."""

from time import perf_counter

from routes_adapter import NotConverged, serve
from mpi4py import MPI  # before DOLFINx, whose wheel finds its library by that
import dolfinx_adjoint
import numpy as np
import pyadjoint
import ufl
from dolfinx import fem
from dolfinx_case import displacements

MUMPS = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}


class Block:
    def load(self, case):
        V, node = displacements(case, MPI.COMM_SELF)
        Q = fem.functionspace(V.mesh, ("DG", 0))
        u, f, d, S, p = (dolfinx_adjoint.Function(space) for space in (V, V, V, V, Q))
        read, of = np.nonzero(node[:, None] == case["sensors"])
        f.x.array[:] = case["forces"][node].ravel()
        d.x.array.reshape(-1, 3)[read], S.x.array.reshape(-1, 3)[read] = case["data"][of], 1
        E, nu, F = ufl.exp(p) if case["parametrization"] == "log" else p, case["nu"], ufl.Identity(3) + ufl.grad(u)
        mu, lmbda, ln_J = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu)), ufl.ln(ufl.det(F))
        W = mu / 2 * (ufl.inner(F, F) - 3) - mu * ln_J + lmbda / 2 * ln_J**2
        R = ufl.derivative(W * ufl.dx(metadata={"quadrature_degree": 3}) - ufl.inner(f, u) * ufl.dP, u)
        self.J = ufl.inner(S, ufl.elem_mult(u - d, u - d)) / 2 * ufl.dP
        clamp = fem.dirichletbc(np.zeros(3), np.flatnonzero(np.isin(node, case["clamped"])).astype(np.int32), V)
        self.problem = dolfinx_adjoint.NonlinearProblem(
            R, u, bcs=[clamp], petsc_options=MUMPS | {"snes_stol": 1e-14}, adjoint_petsc_options=MUMPS
        )
        self.u, self.p, self.modulus = u, p, case["modulus"][V.mesh.topology.original_cell_index]

    def value(self, p, rtol=1e-12):
        pyadjoint.set_working_tape(pyadjoint.Tape())
        self.p.x.array[:], self.u.x.array[:] = p[self.modulus], 0
        snes = self.problem.solver
        snes.setTolerances(rtol=rtol, atol=0)
        self.problem.solve()
        if snes.reason < 0:
            raise NotConverged(f"SNES, reason {snes.reason} after {snes.its} iterations")
        return dolfinx_adjoint.assemble_scalar(self.J)

    def gradient(self, p, rtol, adjoint_rtol, options):
        start, J = perf_counter(), self.value(p, rtol)
        solved, reduced = perf_counter(), pyadjoint.ReducedFunctional(J, pyadjoint.Control(self.p))
        g = np.bincount(self.modulus, reduced.derivative().x.array, len(p))
        return {"J": float(J), "gradient": g, "forward_s": solved - start, "backward_s": perf_counter() - solved}


serve(Block(), "dolfinx-adjoint", versions=["dolfinx-adjoint", "pyadjoint-ad", "dolfinx-solver-real"])
