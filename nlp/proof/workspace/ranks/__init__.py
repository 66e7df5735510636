"""Ranks of the matrices of any robot over a box of poses.

The modules import each other in this order: ``krawczyk`` (how passive joints follow over a box), ``rank_rule`` (the
test of a matrix), ``entry_change`` (of its entries within a tolerance), ``loop_boxes`` (boxes of a search),
``covering`` (of a workspace, and of one assembly), ``singular_pose`` (Newton's method for one), ``signs`` (exact
signs of determinants of six straight legs), and ``ranks`` (all of a robot).
"""
