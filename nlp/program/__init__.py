"""Nonlinear program of a case."""
