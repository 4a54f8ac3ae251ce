"""Processes that can be stopped: groups of their own, with limits, watched from outside."""
