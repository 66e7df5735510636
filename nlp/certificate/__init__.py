"""Proven bounds of the global optimum over the whole box, and their proofs. Nothing here imports a solver.

``standardform`` (a program as functions and conditions: a ``form``), ``reduction`` (without unknowns in closed form,
with a ``lift`` back), ``spectral`` (conditions that follow from limits on singular values), ``separation`` (its limbs)
and ``kinks`` (derivatives of fmin and fmax) serve search and check. The search is in the rooms ``enclosing`` (ranges
over boxes), ``boxes`` (their examination) and ``limbs`` (F taken apart), which import each other in this order, and in
``incumbent``, ``certificate`` and ``branchandbound``. The check is in the room ``paper``, of which the search imports
``proof`` alone.
"""
