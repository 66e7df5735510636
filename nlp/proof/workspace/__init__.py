"""Judgement of a robot over a domain, a box of poses or a tool path: proofs, counterexamples, and open claims.

The rooms and modules import each other in this order:

* ``verdict`` (of one claim), ``proof_record`` (records of searches for a proof file), ``robot`` (a robot as expressions
  over the box), ``ranks`` (ranks of its matrices), ``numbers`` (bounds of quantities, also over every robot within the
  tolerance), ``path_motion``, ``path_tubes``, ``path_knots`` (speeds along a tool path, and its knots);
* ``judgement`` (all verdicts), ``judging`` (steps that are the same over every domain), ``home_poses`` (single poses in
  the home assembly mode), ``judge`` (a box of poses), ``scale`` (the largest box), ``proof_writer`` (proof files),
  ``slices`` (pictures);
* ``path_domain``, ``path_faults``, ``path_ranks``, ``path_judge`` (a tool path);
* ``range_values``, ``edge_samples``, ``local_coordinates`` and ``axis_ranges`` (free travel from a pose).
"""
