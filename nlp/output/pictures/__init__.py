"""Pictures of a robot and its task as files.

The modules import each other in this order: ``poses`` (the robot at each pose), ``posture`` (numbers at one pose),
``drawing`` (the robot with its task), ``solutions`` (drawings of a solution), ``view``; then, with Matplotlib,
``labels``, ``canvas``, ``frame``, ``joints`` (symbols), ``painting`` and ``figures``, and the pictures of numbers
(``curves``, ``fronts``, ``sweeps``, ``workspaceslices``); at last ``plot``, which is public.
``style``, ``requirements``, ``crossings`` and ``fonts`` stand alone.
"""
