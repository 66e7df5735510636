"""A robot judged over a whole box of poses: proofs, counterexamples, and the boxes that are left open.

The modules import each other in this order:

* ``posebox`` (a box of poses in the coordinates of the search), ``machine`` (a robot with its dimensions);
* regular poses: ``rows`` and ``regularity`` (the examination of boxes in NumPy), ``engines`` (the same in C), ``exact``
  (signs of determinants without rounding), ``inverse`` (of the rows over boxes), ``builtrank`` (singular machines
  within a tolerance), ``verdict`` and ``search``;
* numbers: ``posed`` (a case as expressions of the pose), ``worstnumber``, ``worst`` and ``worstplates`` (the worst
  machine within a tolerance), ``claims``, ``builtclaims`` (about all machines), ``extremes`` (bounds by the
  certificate's search), ``boundsearch``, ``clearance``, ``builtsingular``, ``singular`` and ``poseerror`` (searches of
  their own), ``ownsearches`` and ``strokes``;
* any robot: ``closedform`` (unknowns that follow from the pose), the room ``general`` (ranks of matrices over boxes),
  ``anyrobot`` (ranks and reach) and ``askedvalues`` (singular values that no limit asks for);
* ``judge`` (all claims about a machine), ``scale`` (the largest box) and ``slices`` (for pictures).
"""
