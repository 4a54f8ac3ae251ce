"""`routes scaling`: cost against problem size."""
