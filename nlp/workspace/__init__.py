"""A robot judged over a whole box of poses: proofs, counterexamples, and the boxes that are left open.

The modules import each other in this order:

* ``posebox`` (a box of poses in the coordinates of the search), ``machine`` (a robot with its dimensions);
* regular poses: ``rows`` and ``regularity`` (the examination of boxes in NumPy), ``engines`` (the same in C), ``exact``
  (signs of determinants without rounding), ``verdict`` and ``search``;
* numbers: ``posed`` (a case as expressions of the pose), ``claims``, ``extremes`` (bounds by the certificate's search),
  ``boundsearch``, ``clearance``, ``inverse``, ``singular`` and ``poseerror`` (searches of their own), ``ownsearches``;
* any robot: ``closedform`` (unknowns that follow from the pose), the room ``general`` (ranks of matrices over boxes),
  ``anyrobot`` (ranks and reach) and ``askedvalues`` (singular values that no limit asks for);
* ``judge`` (all claims about a machine), ``scale`` (the largest box) and ``slices`` (for pictures).
"""
