"""Proofs of workspaces, and their checker, which uses nothing of the search.

The modules import each other in this order: ``pose_boxes`` (the box of coordinates, and claims shown on pieces of it),
``forms`` (arithmetic), ``motion_matrix`` (the robot as expressions of the pose), ``statement`` (claims that a proof
must name, for both sides, and every machine within a tolerance), ``closed_loops``, ``ranks`` (claims about ranks of any
robot), ``number_claims`` (those about numbers that are no single expression), and ``check``.
"""
