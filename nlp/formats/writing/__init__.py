"""Writers of mechanisms in the formats of other programs.

The modules import each other in this order: ``numbers`` (numbers as text), ``tree`` (spanning tree and loop closures),
``shapes`` (displayed lines of links), ``mjcf``, ``urdf``, ``tables`` (CSV), ``plates`` (joint centres in the plane of a
plate, and DXF), ``cutlist``, ``readme``.
"""
