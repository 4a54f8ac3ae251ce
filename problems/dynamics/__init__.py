"""Motion: schemes of time integration and the matrices of their steps."""
