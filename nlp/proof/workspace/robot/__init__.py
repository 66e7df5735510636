"""A robot over a box of poses, as expressions of the search's coordinates.

The modules import each other in this order: ``pose_box`` (the box), ``closed_loops`` (loops followed by Newton's
method), ``motion_matrix`` (whose rank is judged), ``posed_robot`` (loop equations and sparse matrices),
``tolerance_model`` (every machine within a tolerance).
"""
