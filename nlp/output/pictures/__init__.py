"""Pictures of a robot and its task as files.

The modules import each other in this order: ``posture`` (numbers at one pose), ``drawing`` (the robot with its task),
``solutions`` (drawings of a solution); then, with Matplotlib, ``view``, ``labels``, ``canvas``, ``painting`` and
``figures``. ``style`` and ``requirements`` stand alone.
"""
