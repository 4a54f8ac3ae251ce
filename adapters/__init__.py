"""Adapters: other frameworks behind the adapter protocol, one script each, run by their own Python.

Each says what it needs and what it knows in its inline metadata; `routes environments` makes its environment.
"""
