"""The gate: what was measured now against what was measured before, a rule for every metric."""
