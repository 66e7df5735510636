"""Pictures of a robot and its task as files.

The modules import each other in this order: ``poses`` (the robot at each pose), ``posture`` (numbers at one pose),
``drawing`` (the robot with its task), ``solutions`` (drawings of a solution), ``view``; then, with Matplotlib,
``labels``, ``canvas``, ``joints`` (symbols), ``painting`` and ``figures``; at last ``plot``, which is public.
``style``, ``requirements``, ``crossings`` and ``fonts`` stand alone.
"""
