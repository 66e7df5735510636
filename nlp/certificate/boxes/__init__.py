"""The examination of boxes, one by one or the whole box by bisection.

The modules import each other in this order: ``examination`` (results), ``tangents``, ``firstpass``, ``tapes``
(a form as operations), ``bounding``, ``threads`` and ``engines`` (the examination in NumPy and in C), ``openboxes``
(boxes that are left), ``proofwriter``, ``boxsearch``.
"""
