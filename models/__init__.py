"""Symbolic robots, and the screw algebra in which they are written."""

from .arrays import FloatArray, frozen_array, frozen_vector
from .catalog import AmbiguousModelError, RobotFunction, UnknownModelError, model_names, robot_function
from .drawing import Body, Circle, Direction, Link, Mark, MarkKind, Point, Scene
from .hexapod import hexapod
from .instance import (
    LegInstance,
    RobotInstance,
    Substitution,
    homogenised,
    instantiate,
    jacobian,
    objective,
    reason_for_zero_row,
)
from .legs import LeggedPlatform, legged_platform
from .model import Model, ModelError
from .parts import Closure, Dimension, Leg, Parameter, PoseSymbols, Quantity, Unknown, component_names
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
from .wrench import Wrench, WrenchKind, couple_about, force_along

__all__ = [
    "AmbiguousModelError",
    "AxisAngle",
    "Body",
    "Circle",
    "Closure",
    "Dimension",
    "Direction",
    "Displacement",
    "FloatArray",
    "Leg",
    "LegInstance",
    "LeggedPlatform",
    "Link",
    "Mark",
    "MarkKind",
    "Model",
    "ModelError",
    "Parameter",
    "Point",
    "PoseSymbols",
    "Quantity",
    "RobotFunction",
    "RobotInstance",
    "Scene",
    "Screw",
    "Substitution",
    "Unknown",
    "UnknownModelError",
    "Wrench",
    "WrenchKind",
    "axis_angle_from_matrix",
    "axis_from_screw",
    "component_names",
    "couple_about",
    "displacement",
    "force_along",
    "frozen_array",
    "frozen_vector",
    "hexapod",
    "homogenised",
    "instantiate",
    "jacobian",
    "legged_platform",
    "line_through",
    "matrix_from_axis_angle",
    "matrix_from_cayley",
    "matrix_from_quaternion_vector",
    "model_names",
    "moved_screw",
    "objective",
    "reason_for_zero_row",
    "reciprocal_product",
    "robot_function",
    "screw_displacement",
    "screw_from_axis",
    "stewart_gough",
    "three_upu",
    "unit_vector",
]
