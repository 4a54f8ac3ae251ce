"""Verbs that are not studies: what exists, what a store holds, and what changed."""
