"""A robot over a box of poses, as expressions of the search's coordinates.

The modules import each other in this order: ``pose_box`` (the box), ``closed_loops`` (loops followed by Newton's
method), ``posed_model`` (a model's matrices as expressions), ``posed_robot`` (which of these count over the box; every
machine within a tolerance).
"""
