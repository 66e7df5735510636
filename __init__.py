"""Optimal geometry and pose of parallel robots for a motion, with evidence and proofs.

A platform of fixed dimensions drives a screw; its pose is free::

    from math import radians
    import screwsynth as ss

    dimensions = {"x1": 12, "x2": 8, "x3": radians(30), "x4": radians(8)}  # cm; angles are radians in Python
    position = [ss.Free(-10, 10), ss.Free(-10, 10), ss.Free(20, 50)]  # cm, free between bounds
    rotation = ss.Rotation(axis=None, angle=ss.Free(-radians(30), radians(30)))
    task = ss.Task.screw("max", axis=[2, 2, 1], point=[2, 3, 6], pitch=1)  # point in cm, pitch in cm/rad
    limits, units = ss.Limits(leg_length=(None, 60)), ss.Units("cm", "deg")
    case = ss.Case(ss.stewart_gough(), dimensions, position, [task], rotation, limits=limits, units=units)
    solution = ss.solve(case)
    p_z, angle = solution["p_z"], solution["angle"]
    print(f"F = {solution.F:.1f} (cm/rad)² at p_z = {p_z:.1f} cm, turned by {angle:.1f} deg")

``solution["p_z"]`` and ``case.replace(x2=7)`` take numbers by the names of ``--set``, in the units of the case;
arguments of types such as :class:`Free` and :class:`Rotation` are radians.

Names are imported when they are first used. :mod:`screwsynth.nlp` has the same names but for those of robots, which
are in :mod:`screwsynth.models` with the rest of the screw algebra.
"""

# By its name, not by __name__ or a relative import: the folder of the package is that of the repository, and pytest
# imports this file once more under the name of that folder, whatever it is.
from screwsynth.nlp import __version__ as __version__
from screwsynth.nlp.system.lazynames import lazy_names

# ``__init__.pyi`` lists the public names.
__all__, __getattr__ = lazy_names("screwsynth", "screwsynth", __file__)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
