"""Environments of adapters: the interpreter and the packages that each needs, apart from ours and from each other."""
