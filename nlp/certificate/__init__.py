"""Proven bounds of the global optimum, and their proofs. Nothing here imports a solver."""
