"""C for embedding: the objective of a case and a whole solver, from the templates in ``c``.

The modules import each other in this order: ``ctext`` and ``calls`` stand alone; ``subject`` and ``runtimelimits`` use
``ctext``; ``loops`` and ``stages`` each use those before; ``manifest`` uses ``ctext`` and ``runtimelimits``,
``measure`` uses ``manifest``, and ``codegen`` uses all of them. ``library`` loads a folder.
"""
