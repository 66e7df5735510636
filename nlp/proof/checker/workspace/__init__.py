"""Proofs of workspaces, and their checker, which uses nothing of the search.

The modules import each other in this order: ``statement`` (claims that a proof must name, for both sides); for the
check, ``pose_boxes`` (the box of coordinates, and claims shown on pieces of it), ``forms`` (arithmetic),
``motion_matrix`` (the robot as expressions of the pose), ``closed_loops``, ``ranks`` (claims about ranks of any robot),
``leg_claims`` (numbers of six straight legs that are no single expression), and ``check``. ``tolerance`` is about every
machine within a tolerance on joint centres.
"""
