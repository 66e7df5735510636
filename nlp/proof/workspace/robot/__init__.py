"""A robot over a box of poses, as expressions of the search's coordinates.

The modules import each other in this order: ``pose_box`` (the box), ``posed_model`` (a model's matrices as
expressions), ``path_turns``, ``long_turns`` and ``path_cover`` (boxes of pieces of a tool path), ``posed_robot`` (a
robot over a box; all robots within the tolerance).
"""
