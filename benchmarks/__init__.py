"""Development benchmarks, not installed: limits, verdict quality, cost of the harness."""
