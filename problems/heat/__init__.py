"""Conduction of heat: what is sought of it."""
