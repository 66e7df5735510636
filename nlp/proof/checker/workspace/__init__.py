"""Checker of proofs about workspaces and paths; it uses no code of the search.

The modules import each other in this order: ``pose_boxes`` (box of pose coordinates, and claims on pieces of it),
``path_poses`` (poses along a path) and ``path_root`` (claims on pieces of it), ``forms`` (arithmetic),
``motion_matrix`` (the robot as expressions of the pose), ``statement`` (claims that a proof must name, also for robots
within the tolerance), ``closed_loops``, ``path_loops``, ``ranks`` (claims about ranks of any robot), ``number_claims``
(claims about quantities that are no single expression), ``path_premises`` (the path of a proof), and ``check``.
"""
