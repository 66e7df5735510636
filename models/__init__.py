"""Symbolic robot models and screw algebra."""

from importlib import import_module
from typing import TYPE_CHECKING

from .actuation import LimbDrive, Velocities, limb_drive, rates_expression
from .arrays import FloatArray, frozen_array, frozen_vector
from .basis import constraint_rows, rank_of_rows, reporting_matrix
from .catalog import AmbiguousModelError, RobotFunction, UnknownModelError, model_names, robot_function
from .drawing import Body, Circle, Direction, JointKind, JointSymbol, Link, LinkKind, Mark, MarkKind, Point, Scene
from .hexapod import hexapod
from .instance import (
    LegInstance,
    RobotInstance,
    Substitution,
    driven,
    homogenised,
    instantiate,
    jacobian,
    objective,
)
from .legs import LeggedPlatform, legged_platform
from .member import Member
from .model import Model, ModelError
from .parts import (
    Actuator,
    AssemblySign,
    Closure,
    Dimension,
    GenericRanks,
    JointScrews,
    Leg,
    Parameter,
    PathStructure,
    PoseSetting,
    PoseSymbols,
    Quantity,
    Unknown,
    component_names,
    rate_relations,
)
from .rotation import (
    AxisAngle,
    axis_angle_from_matrix,
    matrix_from_axis_angle,
    matrix_from_cayley,
    matrix_from_quaternion_vector,
)
from .screws import (
    Displacement,
    Screw,
    axis_from_screw,
    displacement,
    line_through,
    moved_screw,
    reciprocal_product,
    screw_displacement,
    screw_from_axis,
    unit_vector,
)
from .stewart_gough import stewart_gough
from .three_upu import three_upu
from .wrench import RowLabel, Wrench, WrenchKind, couple_about, force_along, reason_for_zero_row

if TYPE_CHECKING:
    from .joints.model.robot import robot
    from .joints.written.forms import RobotError

__all__ = [
    "Actuator",
    "AmbiguousModelError",
    "AssemblySign",
    "AxisAngle",
    "Body",
    "Circle",
    "Closure",
    "Dimension",
    "Direction",
    "Displacement",
    "FloatArray",
    "GenericRanks",
    "JointKind",
    "JointScrews",
    "JointSymbol",
    "Leg",
    "LegInstance",
    "LeggedPlatform",
    "LimbDrive",
    "Link",
    "LinkKind",
    "Mark",
    "MarkKind",
    "Member",
    "Model",
    "ModelError",
    "Parameter",
    "PathStructure",
    "Point",
    "PoseSetting",
    "PoseSymbols",
    "Quantity",
    "RobotError",
    "RobotFunction",
    "RobotInstance",
    "RowLabel",
    "Scene",
    "Screw",
    "Substitution",
    "Unknown",
    "UnknownModelError",
    "Velocities",
    "Wrench",
    "WrenchKind",
    "axis_angle_from_matrix",
    "axis_from_screw",
    "component_names",
    "constraint_rows",
    "couple_about",
    "displacement",
    "driven",
    "force_along",
    "frozen_array",
    "frozen_vector",
    "hexapod",
    "homogenised",
    "instantiate",
    "jacobian",
    "legged_platform",
    "limb_drive",
    "line_through",
    "matrix_from_axis_angle",
    "matrix_from_cayley",
    "matrix_from_quaternion_vector",
    "model_names",
    "moved_screw",
    "objective",
    "rank_of_rows",
    "rate_relations",
    "rates_expression",
    "reason_for_zero_row",
    "reciprocal_product",
    "reporting_matrix",
    "robot",
    "robot_function",
    "screw_displacement",
    "screw_from_axis",
    "stewart_gough",
    "three_upu",
    "unit_vector",
]


#: Names that most runs do not need, with their modules: imported at first use.
_JOINTS = {"RobotError": ".joints.written.forms", "robot": ".joints.model.robot"}


def __getattr__(name: str) -> object:
    if name not in _JOINTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(_JOINTS[name], __name__), name)
    return value


def __dir__() -> list[str]:
    return list(__all__)
