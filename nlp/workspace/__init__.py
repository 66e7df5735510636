"""A robot judged over a whole box of poses: proofs, counterexamples, and the boxes that are left open.

The rooms and modules import each other in this order:

* ``posebox`` (a box of poses in the coordinates of the search), ``machine`` (a robot with its dimensions),
  ``verdict``, ``posed`` and ``boxlayout`` (a case as expressions of the pose, and of its coordinates), ``worstnumber``,
  ``claims`` and ``closedlayout`` (the case without unknowns in closed form);
* ``built`` (machines within a tolerance), ``regular`` (regular poses of six straight legs), ``general`` (of any
  robot);
* ``numbers`` (their extremes over the box), ``anybuilt`` (those of every machine within a tolerance, for any robot);
* ``builtlegs`` (claims about every machine of six straight legs), ``homeposes`` (machines at single poses, in home's
  assembly), ``anyrobot`` (ranks of any robot), ``looplimits`` (limits of robots with loops);
* ``judge`` (all claims about a machine), ``scale`` (the largest box), ``slices`` (for pictures), and ``paper``
  (proofs as files and their checker).
"""
