"""Proven bounds of the global optimum over the whole box: ``certificate`` (the value), ``branch_and_bound``."""
