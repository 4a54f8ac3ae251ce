"""Floor 2, routes: solve R(u, p) = 0 and differentiate J(p). Imports the contract of problems only."""
