"""Files of a mechanism for other programs.

The modules in order, each of which imports only those before it: ``numbers`` (numbers as text), ``tree`` (a spanning
tree and the loops that close it), ``shapes`` (lines and sizes that show a link), ``mjcf``, ``urdf``, ``tables`` (CSV),
``plates`` (joint centres in the plane of their plate, and DXF), ``readme``.
"""
