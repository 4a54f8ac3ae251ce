"""Inversion: J minimized with any route as the source of gradients."""
