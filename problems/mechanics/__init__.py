"""Solid mechanics: stored energies, loaded solids and design variables."""
