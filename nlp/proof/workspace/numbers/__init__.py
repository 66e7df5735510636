"""Proven smallest and largest values of numbers over a workspace.

The modules import each other in this order: ``bound_search`` (the search of numbers over boxes), ``extremes`` (verdicts
on claims, and the certificate's search); ``expressions`` (of all machines), ``jacobian_numbers`` (singular values and
the worst error of the pose to first order), ``clearance`` (of legs), ``quadratic_forms`` (numbers of second order) and
``motors`` (forces, speeds and powers of actuators); ``searched`` (claims about all but the second of these),
``strokes`` (claims that follow from lengths of legs), ``pose_error`` (the whole errors of the pose);
``second_order_change`` (bounds of second derivatives by errors of joint centres), ``machines`` (claims about every
machine within a tolerance).
"""
