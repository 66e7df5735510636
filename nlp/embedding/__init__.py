"""C for embedding: the objective and the solver of a case, from the templates in ``c``.

The modules import each other in this order: ``ctext`` and ``calls`` import none; ``subject`` and ``runtimelimits``
import ``ctext``; ``loops`` and ``stages`` import the modules named so far; ``manifest`` imports ``ctext`` and
``runtimelimits``, and ``measure`` imports ``manifest``. ``kinematics`` imports none; ``driveaxes``,
``kinematicsjoints`` and ``kinematicslimits`` import it, and ``kinematicsfiles`` imports these. ``codegen`` imports all
modules named so far, and ``targets`` imports ``kinematicsfiles``. ``library`` loads a folder.
"""
