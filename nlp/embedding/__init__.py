"""C for embedding: the objective and the solver of a case, from the templates in ``c``.

The modules import each other in this order: ``ctext`` and ``calls`` import none; ``subject`` and ``runtimelimits``
import ``ctext``; ``loops`` and ``stages`` import the modules named so far; ``manifest`` imports ``ctext`` and
``runtimelimits``, ``measure`` imports ``manifest``, and ``codegen`` imports all of them. ``library`` loads a folder.
"""
