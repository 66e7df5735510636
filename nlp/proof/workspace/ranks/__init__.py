"""Ranks of the matrices of any robot over a box of poses.

The modules import each other in this order: ``krawczyk`` (dependent coordinates over a box), ``rank_rule`` (the test of
a matrix), ``loop_boxes`` (boxes of a search, and of one assembly), ``singular_pose`` (search for one), and ``ranks``
(all of a robot).
"""
