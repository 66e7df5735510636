"""A robot over a box of poses, as expressions of the search's coordinates.

The modules import each other in this order: ``pose_box`` (the box), ``posed_model`` (a model's matrices as
expressions), ``posed_robot`` (which of these count over the box; every machine within a tolerance).
"""
