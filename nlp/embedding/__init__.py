"""C for embedding: the objective of a case and a whole solver, from the templates in ``c``.

The modules import each other in this order: ``ctext`` and ``stages`` stand alone, ``codegen`` uses both.
"""
