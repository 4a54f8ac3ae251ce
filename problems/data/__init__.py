"""Measured and synthetic data: sensors, probes, observations, priors, CSV files."""
