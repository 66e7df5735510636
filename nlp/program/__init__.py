"""The nonlinear program of a case."""
