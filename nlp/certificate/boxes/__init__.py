"""The examination of boxes, one by one or the whole box by bisection.

The modules import each other in this order: ``examination`` (results), ``tangents``, ``firstpass``, ``bounding``,
``threads`` and ``engines`` (the examination in NumPy and in C), ``openboxes`` (boxes that are left), ``proofwriter``,
``boxsearch``.
"""
