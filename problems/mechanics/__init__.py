"""Solid mechanics: stored energies, loaded solids, and what p stands for in them."""
