"""Matrices with a fixed pattern: sparse and tridiagonal."""
