"""Protocols that other software speaks: foreign models as subjects of a check, and our problems served to others."""
