"""Ranks of the matrices of any robot over a box of poses.

The modules import each other in this order: ``krawczyk`` (how passive joints follow over a box), ``rank_rule`` (the
test of a matrix), ``entry_change`` (of its entries within a tolerance), ``loop_boxes`` (boxes of a search),
``connected`` (of one assembly), ``covering`` (of a workspace), ``singular_pose`` (Newton's method for one),
``refuters`` (search for singular poses), ``search``, and ``ranks`` (all of a robot).
"""
