"""`routes identify`: what the data determine of p."""
