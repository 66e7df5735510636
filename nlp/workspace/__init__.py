"""A robot judged over a whole box of poses: proofs, counterexamples, and the boxes that are left open.

The rooms and modules import each other in this order:

* ``posebox`` (a box of poses in the coordinates of the search), ``machine`` (a robot with its dimensions),
  ``verdict``, ``posed`` (a case as expressions of the pose), ``worstnumber`` and ``claims``;
* ``built`` (machines within a tolerance), ``regular`` (regular poses of six straight legs), ``general`` (of any
  robot);
* ``numbers`` (their extremes over the box), ``anybuilt`` (those of every machine within a tolerance, for any robot);
* ``anyrobot`` (ranks and reach of any robot);
* ``judge`` (all claims about a machine), ``scale`` (the largest box), ``slices`` (for pictures), and ``paper``
  (proofs as files and their checker).
"""
