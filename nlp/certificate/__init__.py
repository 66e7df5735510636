"""The proven bound of the global optimum: a branch and bound, its proofs on paper, and their checker."""
