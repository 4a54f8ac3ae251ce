"""Codes of others as routes: each in a process and an environment of its own, spoken to in messages."""
