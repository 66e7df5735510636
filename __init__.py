"""Optimal geometry and pose of parallel robots for a motion, with evidence and proofs.

The first steps, with every number in the units of the case, here centimetres and degrees::

    import screwsynth as ss

    case = ss.load_case("hexapod-machining")  # of the package; a path reads a case file of your own
    state = ss.evaluate(case)  # nothing is optimised: free numbers are at their starts
    print(f"F = {state.F:.1f} (cm/rad)^2 at the start")
    solution = ss.solve(case)
    print(f"F = {solution.F:.1f} (cm/rad)^2, height = {solution['p_z']:.2f} cm")
    shorter = case.replace({"limits.leg_length.max": 32, "limits.base_joint_angle": 40})  # cm, deg
    print(f"F = {ss.solve(shorter).F:.1f} (cm/rad)^2 with legs of at most 32 cm")

Names are imported when they are first used. :mod:`screwsynth.nlp` and :mod:`screwsynth.models` have the same names, and
``screwsynth.models`` those of the screw algebra beside them.
"""

# Absolute: pytest imports this file a second time, under the name of the folder that the repository is in.
from screwsynth.nlp import __version__ as __version__
from screwsynth.nlp.system.lazynames import lazy_names

# The public names stand in ``__init__.pyi``.
__all__, __getattr__ = lazy_names(__name__, __name__, __file__)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
