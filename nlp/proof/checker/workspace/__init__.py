"""Proofs of workspaces and paths, and their checker, which uses nothing of the search.

The modules import each other in this order: ``pose_boxes`` (the box of coordinates, and claims shown on pieces of it),
``path_poses`` (poses along a path) and ``path_root`` (claims shown on pieces of it), ``forms`` (arithmetic),
``motion_matrix`` (the robot as expressions of the pose), ``statement`` (claims that a proof must name, for both sides,
and every machine within a tolerance), ``closed_loops``, ``path_loops``, ``ranks`` (claims about ranks of any robot),
``number_claims`` (those about numbers that are no single expression), ``path_premises`` (the path of a proof), and
``check``.
"""
