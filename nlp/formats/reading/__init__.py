"""MJCF and URDF with closed loops as a mechanism and as a robot file.

The modules in order, each of which imports only those before it: ``xmltext`` (XML as elements, hostile text refused),
``description`` (a tree of bodies with loops that equations close), ``mjcfclean`` and ``mjcf`` (MJCF), ``urdfelements``,
``urdfloops`` and ``urdf`` (URDF), ``newton`` (loops closed), ``elements`` and ``reduction`` (from a description to the
mechanism between base and platform), ``meeting`` and ``snapping`` (joints that are one, and axes that nearly meet),
``symmetry`` (circles and copies of limbs), ``importing`` (all of it), ``freeing`` (numbers that become dimensions),
``robotfile`` (the file, read again), ``words`` (lines about it).
"""
