"""Linear solvers: factorizations and iterations for R_u x = b and R_u^T x = b."""
