"""MJCF and URDF with closed loops as a mechanism and as a robot file.

The modules in order, each of which imports only those before it: ``xmltext`` (XML as elements, with hostile text
refused), ``frames`` (places of bodies), ``description`` (a tree of bodies with loops that equations close), ``includes``
and ``mjcf``, ``urdfloops`` and ``urdf`` (the two formats), ``newton`` (loops closed), ``blocks`` and ``reduction`` (from
a description to the mechanism between base and platform), ``meeting`` (hinges that are one ball or universal joint).
"""
