"""Limits of a case: what a design must keep to be built."""
