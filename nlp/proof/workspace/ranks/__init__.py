"""Ranks of the matrices of any robot over a box of poses.

The modules import each other in this order: ``krawczyk`` (dependent coordinates over a box), ``rank_rule`` (rank of one
matrix over boxes), ``loop_boxes`` (boxes of a search in one assembly mode), ``followed`` (joint positions along a
path), ``singular_pose`` (search for a singular pose), and ``ranks`` (all ranks of a robot).
"""
