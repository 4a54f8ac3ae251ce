"""Studies: one question per folder, answered by measurement."""
