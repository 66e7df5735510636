"""A robot judged over a whole box of poses: proofs, counterexamples, and the boxes that are left open.

The rooms and modules import each other in this order:

* ``verdict``; ``paper_record`` (what searches keep for a proof); ``robot`` (a robot as expressions over the box),
  ``ranks`` (of its matrices), ``numbers`` (their extremes, also over every machine within a tolerance);
* ``path_motion``, ``path_tubes``, ``path_knots``, ``path_judge`` (a programmed path: speeds by its times, how far the
  platform is from it between knots, the knots, and all claims);
* ``home_poses`` (machines at single poses, in home's assembly), ``judge`` (all claims about a machine), ``scale`` (the
  largest box), ``slices`` (for pictures), ``proof_writer`` (proofs as files);
* ``path_judge`` (a path); ``edge_samples``, ``alone`` and ``axis_ranges`` (how far a pose can move).
"""
