"""Regular poses of six straight legs.

The modules import each other in this order: ``rows`` and ``regularity`` (the examination of boxes in NumPy),
``engines`` (the same in C), ``exact`` (signs of determinants without rounding), ``inverse`` (of the rows over boxes),
``search``.
"""
