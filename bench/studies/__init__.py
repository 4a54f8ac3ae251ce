"""One question per file, answered by measurement."""
