"""Regression gate: new measurements against a committed baseline, one rule per metric."""
