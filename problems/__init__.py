"""Floor 1, physics: R(u, p), J(u, p) and their partial derivatives. Imports neither routes nor bench."""
