"""Searches that take F apart into limbs.

The modules import each other in this order: ``limbsearch`` (limbs that share no variable); ``limbmodels`` (upper models
of limbs), ``ownboxes``, ``limbsums``, ``sharedcuts``, ``sharedrecord`` (the proof of such a search)
and ``sharedsearch`` (limbs that share some).
"""
