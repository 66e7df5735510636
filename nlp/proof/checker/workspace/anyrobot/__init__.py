"""Claims about robots that are not six straight legs, and the check of their ranks.

The modules import each other in this order: ``robotclaims`` (the claims, for both sides); for the check, ``posedrobot``
(a robot with its dimensions as expressions of the pose), ``motions`` (the matrix whose null space has the motions that
nothing resists), ``interval`` (slopes as middles and radii), ``looppoints`` (closed loops at points), ``assembly``
(closed loops over boxes), ``connected`` (whether they are those of one assembly), ``motionclaim`` (the claim that the
matrix keeps its rank over boxes), ``rankofrobot`` (this claim from a case) and ``signchange`` (a singular pose between
two others). ``singularsides`` finds these two poses for a proof that is written.
"""
