# /// script
# requires-python = ">=3.12"
# dependencies = ["dolfinx-solver-real==0.11.0.post0", "numpy>=2"]
# [tool.gradient-routes]
# summary = "DOLFINx: forms and their derivatives by UFL, the adjoint by hand, PETSc's Newton with MUMPS"
# cases = { hyperelastic = { law = ["neo-hookean"], cell_type = ["hexahedron"] } }
# ///
"""The block in DOLFINx: nodal forces and sensors are integrals over vertices, and lam^T R_p is a form too."""

from time import perf_counter

from routes_adapter import NotConverged, serve
from mpi4py import MPI  # before DOLFINx, whose wheel finds its library by that
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import NonlinearProblem, assemble_vector

MUMPS = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps", "snes_stol": 1e-14}


class Block:
    def load(self, case):
        hex8, order = basix.ufl.element("Lagrange", "hexahedron", 1, shape=(3,)), [0, 1, 3, 2, 4, 5, 7, 6]  # of VTK's
        body = mesh.create_mesh(MPI.COMM_SELF, case["cells"][:, order], hex8, case["points"])
        V, Q, read = fem.functionspace(body, hex8), fem.functionspace(body, ("DG", 0)), case["sensors"]
        at = np.empty(len(case["points"]), np.int32)  # the node of V, by the case's
        at[np.array(body.geometry.input_global_indices)[body.geometry.dofmaps[0]]] = V.dofmap.list
        u, lam, f, d, S, p = (fem.Function(space) for space in (V, V, V, V, V, Q))
        for nodal, nodes, values in ((f, ..., case["forces"]), (d, read, case["data"]), (S, read, 1)):
            nodal.x.array.reshape(-1, 3)[at[nodes]] = values
        E, nu, F = ufl.exp(p) if case["parametrization"] == "log" else p, case["nu"], ufl.Identity(3) + ufl.grad(u)
        mu, lmbda, ln_J = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu)), ufl.ln(ufl.det(F))
        W = mu / 2 * (ufl.inner(F, F) - 3) - mu * ln_J + lmbda / 2 * ln_J**2
        R = ufl.derivative(W * ufl.dx(metadata={"quadrature_degree": 3}) - ufl.inner(f, u) * ufl.dP, u)
        J = ufl.inner(S, ufl.elem_mult(u - d, u - d)) / 2 * ufl.dP
        self.J, self.J_u, self.lam_R_p = fem.form([J, ufl.derivative(J, u), ufl.derivative(ufl.action(R, lam), p)])
        self.clamp = fem.dirichletbc(np.zeros(3), np.sort(at[case["clamped"]]), V)
        self.problem = NonlinearProblem(R, u, bcs=[self.clamp], petsc_options_prefix="block_", petsc_options=MUMPS)
        self.u, self.p, self.lam, self.modulus = u, p, lam, case["modulus"][body.topology.original_cell_index]

    def value(self, p, rtol=1e-12):
        self.p.x.array[:], self.u.x.array[:] = p[self.modulus], 0
        snes = self.problem.solver
        snes.setTolerances(rtol=rtol, atol=0)
        self.problem.solve()
        if snes.reason < 0:
            raise NotConverged(f"SNES, reason {snes.reason} after {snes.its} iterations")
        return fem.assemble_scalar(self.J)

    def gradient(self, p, rtol, adjoint_rtol, options):
        start, J = perf_counter(), self.value(p, rtol)
        solved, snes, b = perf_counter(), self.problem.solver, assemble_vector(self.J_u)
        self.clamp.set(b.array_w, alpha=0)
        snes.computeJacobian(self.problem.x, self.problem.A)
        snes.ksp.solveTranspose(-b, self.lam.x.petsc_vec)
        g = np.bincount(self.modulus, assemble_vector(self.lam_R_p).array, len(p))
        return {"J": J, "gradient": g, "forward_s": solved - start, "backward_s": perf_counter() - solved}


serve(Block(), "dolfinx", versions=["dolfinx-solver-real", "numpy"])
