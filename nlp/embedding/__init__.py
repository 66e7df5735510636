"""C for embedding: the objective of a case and a whole solver, from the templates in ``c``.

The modules import each other in this order: ``ctext``, ``casaditext``, ``subject`` and ``calls`` stand alone;
``loops``, ``stages`` and ``looptext`` each use those before; ``codegen`` uses all.
"""
