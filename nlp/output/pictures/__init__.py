"""Pictures of a robot and its task as files.

The modules import each other in this order: ``posture`` (the robot as numbers at one pose and at each pose),
``loads`` (arrows of forces), ``drawing`` (the robot with its task), ``solutions`` (drawings of a solution), ``view``;
then, with Matplotlib, ``labels``, ``canvas``, ``joints`` (symbols), ``painting`` and ``figures``, and the pictures of
numbers (``curves``, ``regions``, ``workspaces``, and ``paths`` after ``pathpanels``, its content), ``robots`` side by
side, and ``designs``, which chooses the picture of a table; at last ``plot``, which is public. ``style``,
``requirements`` and ``fonts`` stand alone.
"""

import logging

# Matplotlib's advice, on fonts without a weight and folders of its own, would go to standard error, and so into
# notebooks; a program that sets up logging still gets it.
logging.getLogger("matplotlib").addHandler(logging.NullHandler())
