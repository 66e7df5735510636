"""C for embedding: the objective of a case and a whole solver, from the templates in ``c``.

The modules import each other in this order: ``ctext``, ``casaditext`` and ``calls`` stand alone; ``subject`` and
``runtimelimits`` use ``ctext``, ``held`` uses ``runtimelimits``; ``loops``, ``stages`` and ``looptext`` each use those
before; ``unitdata`` uses ``runtimelimits``, ``manifest`` uses both, and ``codegen`` uses
all of them. ``folder`` reads the file that ``manifest`` writes, and ``library`` loads the folder.
"""
