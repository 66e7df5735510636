"""Symbolic robots and the screw algebra they are written in."""

from screwsynth.models.arrays import FloatArray, frozen_array
from screwsynth.models.catalog import RobotFunction, UnknownModelError, model_names, robot_function
from screwsynth.models.drawing import Body, Circle, Direction, Link, Mark, MarkKind, Point, Scene
from screwsynth.models.hexapod import hexapod
from screwsynth.models.legs import LeggedPlatform, legged_platform
from screwsynth.models.model import (
    Closure,
    Dimension,
    Leg,
    Model,
    ModelError,
    Parameter,
    PoseSymbols,
    Quantity,
    Unknown,
    Wrench,
    WrenchKind,
    component_names,
    couple_about,
    force_along,
)
from screwsynth.models.rotation import (
    axis_angle_from_matrix,
    matrix_from_axis_angle,
    matrix_from_cayley,
    matrix_from_quaternion_vector,
)
from screwsynth.models.screws import (
    Screw,
    axis_from_screw,
    displacement,
    line_through,
    moved_screw,
    reciprocal_product,
    screw_from_axis,
    unit_vector,
)
from screwsynth.models.stewart_gough import stewart_gough
from screwsynth.models.three_upu import three_upu

__all__ = [
    "Body",
    "Circle",
    "Closure",
    "Dimension",
    "Direction",
    "FloatArray",
    "Leg",
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
    "Scene",
    "Screw",
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
    "hexapod",
    "legged_platform",
    "line_through",
    "matrix_from_axis_angle",
    "matrix_from_cayley",
    "matrix_from_quaternion_vector",
    "model_names",
    "moved_screw",
    "reciprocal_product",
    "robot_function",
    "screw_from_axis",
    "stewart_gough",
    "three_upu",
    "unit_vector",
]
