"""`routes invert`: p estimated from data."""
