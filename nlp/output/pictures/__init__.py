"""Pictures of robots, tasks and results as files.

The modules import each other in this order: ``posture`` (geometry of the robot at a pose), ``loads`` (arrows of
forces), ``drawing`` (robot with its task), ``solutions`` (drawings of a solution), ``view``; then, with Matplotlib,
``labels``, ``canvas``, ``joints`` (symbols), ``painting``, ``figures``, the charts (``curves``, ``regions``,
``workspaces``, ``paths`` with ``pathpanels``), ``robots`` side by side, and ``designs``, which chooses the picture of a
table; at last ``plot``, which is public. ``style``, ``requirements`` and ``fonts`` import none of these.
"""

import logging

# Matplotlib's hints on fonts and cache folders would go to standard error, and into notebooks; a program that sets up
# logging still gets them.
logging.getLogger("matplotlib").addHandler(logging.NullHandler())
