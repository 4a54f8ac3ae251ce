"""`routes unrolling`: error and tape of unrolled AD against the iteration count."""
