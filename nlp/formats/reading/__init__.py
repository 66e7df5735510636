"""Import of robots with closed loops from MJCF and URDF, as mechanisms and robot files.

The modules import each other in this order: ``xmltext`` (safe XML), ``description`` (tree of bodies and loops),
``mjcfclean`` and ``mjcf``, ``urdfelements``, ``urdfloops`` and ``urdf``, ``closing`` (closure of loops), ``elements``
and ``reduction`` (mechanism between base and platform), ``meeting`` and ``snapping`` (merged joints, nearly meeting
axes), ``symmetry``, ``importing``, ``freeing`` (values as dimensions), ``robotfile``, ``words`` (summary).
"""
