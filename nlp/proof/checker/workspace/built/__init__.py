"""Proofs about every machine within a tolerance on joint centres, as the checker states and bounds them.

The rules are written here a second time, in place of those of the search, so that a mistake in one of them does not
pass both. The modules import each other in this order: ``rules`` (how far a number goes at a pose), ``statement``
(which rule each claim has), ``changes`` (rows and J), and ``built`` (what the check asks).
"""
