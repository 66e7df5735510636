"""Proved bounds of the global optimum of a program: ``certificate`` (the result), ``branch_and_bound`` (the search)."""
