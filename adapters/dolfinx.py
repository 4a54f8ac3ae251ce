# /// script
# requires-python = ">=3.12"
# dependencies = ["dolfinx-solver-real==0.11.0.post0", "numpy>=2"]
# [tool.gradient-routes]
# summary = "DOLFINx: forms and their derivatives by UFL, the adjoint by hand, PETSc's Newton with MUMPS"
# cases = { hyperelastic = { law = ["neo-hookean"], cell_type = ["hexahedron"] } }
# options = { ranks = ["1", "2", "4", "8"] }
# launch = ["mpiexec", "-n", "{ranks}"] # of the environment: MPICH comes with petsc4py's wheel
# ///
"""The block in DOLFINx: nodal forces and sensors are integrals over vertices, and lam^T R_p is a form too."""

from time import perf_counter

from routes_adapter import NotConverged
from mpi4py.MPI import COMM_WORLD  # before DOLFINx, whose wheel finds its library by that
import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx.fem.petsc import NonlinearProblem
from dolfinx_case import displacements
from ranks import serve_on_ranks

MUMPS = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps", "snes_stol": 1e-14}


class Block:
    def load(self, case):
        V, node = displacements(case, COMM_WORLD)
        Q = fem.functionspace(V.mesh, ("DG", 0))
        u, lam, f, d, S, p = (fem.Function(space) for space in (V, V, V, V, V, Q))
        read, of = np.nonzero(node[:, None] == case["sensors"])
        f.x.array[:] = case["forces"][node].ravel()
        d.x.array.reshape(-1, 3)[read], S.x.array.reshape(-1, 3)[read] = case["data"][of], 1
        E, nu, F = ufl.exp(p) if case["parametrization"] == "log" else p, case["nu"], ufl.Identity(3) + ufl.grad(u)
        mu, lmbda, ln_J = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu)), ufl.ln(ufl.det(F))
        W = mu / 2 * (ufl.inner(F, F) - 3) - mu * ln_J + lmbda / 2 * ln_J**2
        R = ufl.derivative(W * ufl.dx(metadata={"quadrature_degree": 3}) - ufl.inner(f, u) * ufl.dP, u)
        J = ufl.inner(S, ufl.elem_mult(u - d, u - d)) / 2 * ufl.dP
        self.J, self.J_u, self.lam_R_p = fem.form([J, ufl.derivative(J, u), ufl.derivative(ufl.action(R, lam), p)])
        self.clamp = fem.dirichletbc(np.zeros(3), np.flatnonzero(np.isin(node, case["clamped"])).astype(np.int32), V)
        self.problem = NonlinearProblem(R, u, bcs=[self.clamp], petsc_options_prefix="block_", petsc_options=MUMPS)
        self.u, self.p, self.lam, self.modulus = u, p, lam, case["modulus"][V.mesh.topology.original_cell_index]

    def value(self, p, rtol=1e-12):
        self.p.x.array[:], self.u.x.array[:] = p[self.modulus], 0
        self.problem.solver.setTolerances(rtol=rtol, atol=0)
        self.problem.solve()
        if (reason := self.problem.solver.reason) < 0:
            raise NotConverged(f"SNES, reason {reason}")
        return COMM_WORLD.allreduce(fem.assemble_scalar(self.J))

    def gradient(self, p, rtol, adjoint_rtol, options):
        start, J = perf_counter(), self.value(p, rtol)
        solved, snes, b = perf_counter(), self.problem.solver, fem.assemble_vector(self.J_u)
        b.scatter_reverse(la.InsertMode.add)
        self.clamp.set(b.array, alpha=0)
        snes.computeJacobian(self.problem.x, self.problem.A)
        snes.ksp.solveTranspose(-b.petsc_vec, self.lam.x.petsc_vec)
        self.lam.x.scatter_forward()
        g = COMM_WORLD.allreduce(np.bincount(self.modulus, fem.assemble_vector(self.lam_R_p).array, len(p)))
        return {"J": J, "gradient": g, "forward_s": solved - start, "backward_s": perf_counter() - solved}


serve_on_ranks(Block(), COMM_WORLD, "dolfinx", versions=["dolfinx-solver-real", "numpy"])
