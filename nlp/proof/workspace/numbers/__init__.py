"""Proved smallest and largest values of quantities over a workspace.

The modules import each other in this order: ``bound_search`` (branch and bound over boxes of poses), ``extremes``
(verdicts by the search of ``certify``); quantities: ``expressions``, ``jacobian_numbers`` (singular values, first-order
pose error), ``clearance`` (of legs), ``quadratic_forms`` and ``motors`` (actuator forces, speeds and powers);
``searched`` (claims by branch and bound), ``strokes`` (claims from leg lengths), ``pose_error`` (full pose errors);
``second_order_change`` and ``within_tolerance`` (claims about every robot within the tolerance).
"""
