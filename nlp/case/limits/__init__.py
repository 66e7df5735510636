"""Limits of a case, which a design must keep to be built."""
