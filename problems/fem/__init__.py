"""Finite elements: meshes, elements, boundary conditions, and the assembly of residuals and tangents."""
