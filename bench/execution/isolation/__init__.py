"""Processes in groups of their own, with limits, watched from outside."""
