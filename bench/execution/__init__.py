"""Execution: measured phases of a case, confined processes, executors, limits."""
