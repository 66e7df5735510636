"""Proven smallest and largest values of numbers over a workspace.

``extremes`` (by the certificate's search) and ``strokes`` come from expressions; ``boundsearch``, ``clearance``,
``singular``, ``poseerror`` and ``ownsearches`` are searches of their own, best box first; ``robotlimits``
has the limits of robots that are not six straight legs, ``askedvalues`` singular values that no limit asks for.
"""
