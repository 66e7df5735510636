"""Robots of any topology with numerical dimensions: links and joints as a graph, at one configuration.

The modules in order, each of which imports only those before it: ``topology`` (connected parts, bridges, spanning
trees), ``graph`` (links, joints and couplings, and checks of a mechanism), ``motions`` (links and screws at any
coordinates), ``descent`` (joints moved until equations are satisfied), ``closing`` (closed loops at a pose or at
actuator coordinates), ``decomposition`` (limbs, branches, and parts that resist the platform), ``limbs`` (tables of a
robot file), ``mobility`` (twists that joints allow), ``centre`` (centre of a member), ``wrenches`` (wrenches, F, rates
and ranks), ``singularities`` (ranks compared with generic ones). Mechanisms of robot files are made in
:mod:`screwsynth.models.joints.home.mechanisms`.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from .closing import ClosedMechanism, close
from .graph import Coupling, Mechanism, MechanismError, MechanismJoint, MechanismLink, check_mechanism
from .limbs import limbs_of, links_of, robot_tables
from .singularities import MechanismSingularity, SingularityType, generic_ranks, singularities_of
from .wrenches import MemberWrenches, RobotRanks, RobotWrenches, wrenches_of

if TYPE_CHECKING:
    from ..joints.home.mechanisms import mechanism_of

__all__ = [
    "ClosedMechanism",
    "Coupling",
    "Mechanism",
    "MechanismError",
    "MechanismJoint",
    "MechanismLink",
    "MechanismSingularity",
    "MemberWrenches",
    "RobotRanks",
    "RobotWrenches",
    "SingularityType",
    "check_mechanism",
    "close",
    "generic_ranks",
    "limbs_of",
    "links_of",
    "mechanism_of",
    "robot_tables",
    "singularities_of",
    "wrenches_of",
]


def __getattr__(name: str) -> object:
    """Return ``mechanism_of``, imported at first use because it reads robot files and needs symbols."""
    if name != "mechanism_of":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    function: object = import_module("..joints.home.mechanisms", __name__).mechanism_of
    return function
