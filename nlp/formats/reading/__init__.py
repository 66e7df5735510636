"""MJCF and URDF with closed loops as a mechanism and as a robot file.

The modules in order, each of which imports only those before it: ``extra`` (libraries that only some formats need),
``xmltext`` (XML as elements, hostile text refused), ``frames`` (places of bodies), ``description`` (a tree of bodies
with loops that equations close), ``includes``, ``mjcfclean`` and ``mjcf`` (MJCF), ``urdfelements``, ``urdfloops`` and
``urdf`` (URDF), ``newton`` (loops closed), ``elements`` and ``reduction`` (from a description to the
mechanism between base and platform), ``meeting``, ``snapping`` and ``universal`` (hinges that are one joint, or
nearly), ``importing`` (all of it), ``tablejoints``, ``symmetry`` and ``freeing`` (numbers that become dimensions),
``filetext``, ``checking`` and ``robotfile`` (the file, read again), ``words`` (lines about it).
"""
