"""Parts that several kinds of result share: the case, poses, motions, the robot at a point, limits and their margins.

Numbers are in the case's units. Nothing is ever NaN or infinite, but an infinite pitch, which is the string ``"inf"``.
"""

import math
from collections.abc import Mapping
from typing import Final, Literal, TypeAlias

from ..case.overrides import Settings
from ..case.pose import OverPoses
from ..case.task import Sense
from ..evidence.loads import ActuatorLoading
from ..evidence.screwvalues import ScrewMotion
from ..evidence.state import PlatformPose
from ..program.free_joints import FreeJoint
from ..program.nlp import Bound
from ..system.jsonvalues import Absent, Inline, JsonObject, Known, Vector, Vector3, Vector6
from .joints import JointsData

#: Version of a result, the newest of :data:`screwsynth.models.fileversions.RESULT_FILES`.
SchemaVersion: TypeAlias = Literal[1]
SCHEMA: Final = 1

#: Values of a quantity by the limb or joint that has it.
ByOwner: TypeAlias = Mapping[str, float]
#: Numbers that replace those of a case file, by the names of ``--set``; an infinite one is a text.
SettingsData: TypeAlias = Mapping[str, float | Vector | Literal["inf", "-inf"]]
Jacobian: TypeAlias = tuple[Vector6, ...]


def settings_data(settings: Settings) -> SettingsData | None:
    """Return numbers that replace those of a case file as JSON has them; None without any."""
    return {name: _setting_data(value) for name, value in settings.items()} or None


def _setting_data(value: float | list[float]) -> float | Vector | Literal["inf", "-inf"]:
    if isinstance(value, list):
        return tuple(value)
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return float(value)


def settings_from_data(data: SettingsData) -> Settings:
    """Return the numbers that replace those of a case file from their JSON."""
    return {name: list(value) if isinstance(value, tuple) else float(value) for name, value in data.items()}


class UnitsData(JsonObject):
    """Units of the case.

    Attributes:
        length: label of the length unit.
        angle: unit of angles.
    """

    length: str
    angle: Literal["deg", "rad"]


class HeadData(JsonObject):
    """The case that a result is about.

    Attributes:
        schema: version of the result's keys.
        case: name of the case, its file's.
        title: title of the case.
        model: name of the robot.
        units: of every number.
    """

    schema: SchemaVersion
    case: str
    title: str
    model: str
    units: UnitsData


class VersionsData(JsonObject):
    """Versions of the programs that the numbers depend on."""

    screwsynth: str
    casadi: str
    numpy: str
    python: str


class TaskData(JsonObject):
    """A task of the case.

    Attributes:
        name: of the task.
        sense: whether F is maximised or minimised.
        motion: of the platform.
        stated_point: the axis's point that the case states; absent where it states none.
    """

    name: str
    sense: Sense
    motion: Inline[ScrewMotion]
    stated_point: Absent[Vector3]


class PoseStateData(JsonObject):
    """The robot at one of several poses.

    Attributes:
        F: objective at this pose alone.
        pose: of the platform.
        jacobian: unit wrenches as rows, force then moment about the world origin.
        rates: one for each row.
        rank: of the Jacobian.
        singular: whether the rank is below six.
        singular_values: of the Jacobian with moments about the platform's origin, divided by their longest arm, largest
            first.
        quantities: leg lengths, joint angles and the like, by limb.
        limited_quantities: what the case's limits speak of beside the quantities, by limb: angles from the mounting
            axes that they state, and lengths of legs of a robot given joint by joint; absent without any.
    """

    F: float
    pose: PlatformPose
    jacobian: Jacobian
    rates: Vector
    rank: int
    singular: bool
    singular_values: Vector
    quantities: Mapping[str, ByOwner]
    limited_quantities: Absent[Mapping[str, ByOwner]]


class PosesData(JsonObject):
    """The robot at every pose of a case with several.

    Attributes:
        stated_poses: poses that the case states, before their displacements.
        over_poses: how F is combined over the poses.
        poses: the robot at every pose.
    """

    stated_poses: tuple[PlatformPose, ...]
    over_poses: OverPoses
    poses: tuple[PoseStateData, ...]


class RobotData(JsonObject):
    """The robot at a point; with several poses, at the first.

    Attributes:
        parameters: dimensions by name; three numbers for a point or direction.
        pose: of the platform; with several poses, the first that the case states.
        task: the task that the rates belong to; absent where there are several.
        limbs: limb of each row of the Jacobian.
        members: member of its limb that applies each row: the limb, with a number where the limb has several.
        jacobian: unit wrenches as rows, force then moment about the world origin.
        rates: work rate of each row in the task's motion.
        rank: of the Jacobian.
        singular: whether the rank is below six.
        singular_values: of the Jacobian with moments about the platform's origin, divided by their longest arm, largest
            first.
        free_motions: basis of the motions that no row resists.
        task_is_free: whether F is zero, so that nothing resists the task's motion.
        quantities: leg lengths, joint angles and the like, by limb.
        limited_quantities: what the case's limits speak of beside the quantities, by limb: angles from the mounting
            axes that they state, and lengths of legs of a robot given joint by joint; absent without any.
        characteristic_length: that relates couples to forces; absent for robots without constraint couples.
        length_dependence: relative derivative of F by it, ``(l / F) dF/dl``, over all poses; absent for such robots,
            where F is 0, and with several tasks.
        joints: freedoms, actuator rates and singularities of a robot given joint by joint; absent for others.
        free_joints: positions, at every pose, of driven joints that the pose does not determine; absent without any.
        loading: forces and speeds of its actuators; absent without loads and motions.
        several: the robot at every pose; absent where there is one.
    """

    parameters: Mapping[str, float | Vector]
    pose: PlatformPose
    task: Absent[TaskData]
    limbs: tuple[str, ...]
    members: tuple[str, ...]
    jacobian: Jacobian
    rates: Absent[Vector]
    rank: int
    singular: bool
    singular_values: Vector
    free_motions: tuple[ScrewMotion, ...]
    task_is_free: Absent[bool]
    quantities: Mapping[str, ByOwner]
    limited_quantities: Absent[Mapping[str, ByOwner]]
    characteristic_length: Absent[float]
    length_dependence: Absent[float]
    joints: Absent[JointsData]
    free_joints: Absent[tuple[FreeJoint, ...]]
    loading: Inline[ActuatorLoading | None]
    several: Inline[PosesData | None]


class ViolationData(JsonObject):
    """A bound or constraint that a point lies outside of.

    Attributes:
        name: variable or constraint.
        bound: side of it.
        value: at the point.
        limit: that it must keep.
        unit: of both; absent for a plain number.
    """

    name: str
    bound: Bound
    value: float
    limit: float
    unit: Absent[str]


class LimitData(JsonObject):
    """A limiting number of the case, over all legs, joints and poses.

    Attributes:
        key: dotted key, below limits, of the number.
        limit: the number.
        unit: of limit, value and margin.
        nearest: where the margin is least.
        value: measured there.
        margin: least margin, positive inside.
        active: everywhere that the point lies on the limit.
        violated: everywhere that the point lies outside of the limit.
        cost: derivative of the optimal F by the number; null where the point is no optimum.
    """

    key: str
    limit: float
    unit: str
    nearest: str
    value: Known
    margin: Known
    active: tuple[str, ...]
    violated: tuple[str, ...]
    cost: float | None
