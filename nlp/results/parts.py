"""Parts of several kinds of result: the case, poses, motions, the robot at a point, limits and their margins.

Values are in the case's units. No value is NaN or infinite; an infinite pitch is the string ``"inf"``.
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

#: Values of a quantity by limb or joint.
ByOwner: TypeAlias = Mapping[str, float]
#: Values that replace those of a case file, by the names of ``--set``; an infinite value is a text.
SettingsData: TypeAlias = Mapping[str, float | Vector | Literal["inf", "-inf"]]
Jacobian: TypeAlias = tuple[Vector6, ...]


def settings_data(settings: Settings) -> SettingsData | None:
    """Return the values that replace values of a case file, as JSON; None without such values."""
    return {name: _setting_data(value) for name, value in settings.items()} or None


def _setting_data(value: float | list[float]) -> float | Vector | Literal["inf", "-inf"]:
    if isinstance(value, list):
        return tuple(value)
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return float(value)


def settings_from_data(data: SettingsData) -> Settings:
    """Return the values that replace those of a case file, from their JSON."""
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
    """Case of a result.

    Attributes:
        schema: version of the result's keys.
        case: name of the case: name of its file without suffix.
        title: title of the case.
        model: name of the robot.
        units: units of all values.
    """

    schema: SchemaVersion
    case: str
    title: str
    model: str
    units: UnitsData


class VersionsData(JsonObject):
    """Versions of the software on which the values depend."""

    screwsynth: str
    casadi: str
    numpy: str
    python: str


class TaskData(JsonObject):
    """Task of the case.

    Attributes:
        name: name of the task.
        sense: sense of the optimisation: F is maximised or minimised.
        motion: motion of the platform.
        stated_point: point of the axis in the case; absent if the case has no such point.
    """

    name: str
    sense: Sense
    motion: Inline[ScrewMotion]
    stated_point: Absent[Vector3]


class PoseStateData(JsonObject):
    """Robot at one of several poses.

    Attributes:
        F: objective at this pose only.
        pose: pose of the platform.
        jacobian: unit wrenches as rows, force then moment about the world origin.
        rates: work rate of each row.
        rank: rank of the Jacobian.
        singular: If true, the rank is below six.
        singular_values: singular values of the Jacobian, largest first, with moments about the platform's origin,
            divided by the longest moment of any unit wrench of a limb.
        quantities: quantities such as leg lengths and joint angles, by name and limb.
        limited_quantities: further quantities that the case limits, by name and limb: joint angles from stated mounting
            axes, and leg lengths of a robot defined by joints; absent without any.
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
    """Robot at every pose of a case with several poses.

    Attributes:
        stated_poses: poses that the case states, before their displacements.
        over_poses: combination of F over the poses: sum, mean or worst.
        poses: robot at every pose.
    """

    stated_poses: tuple[PlatformPose, ...]
    over_poses: OverPoses
    poses: tuple[PoseStateData, ...]


class RobotData(JsonObject):
    """Robot at a point; with several poses, at the first pose.

    Attributes:
        parameters: dimensions by name; three numbers for a point or direction.
        pose: pose of the platform; with several poses, the first stated pose.
        task: task to which the rates belong; absent with several tasks.
        limbs: limb of each row of the Jacobian.
        members: name of the member of each row of J: the limb, with a number if the limb has several members.
        jacobian: unit wrenches as rows, force then moment about the world origin.
        rates: work rate of each row in the task's motion.
        rank: rank of the Jacobian.
        singular: If true, the rank is below six.
        singular_values: singular values of the Jacobian, largest first, with moments about the platform's origin,
            divided by the longest moment of any unit wrench of a limb.
        free_motions: basis of the motions that no row resists.
        task_is_free: If true, F is zero: nothing resists the task's motion.
        quantities: quantities such as leg lengths and joint angles, by name and limb.
        limited_quantities: further quantities that the case limits, by name and limb: joint angles from stated mounting
            axes, and leg lengths of a robot defined by joints; absent without any.
        characteristic_length: factor between couples and forces; absent for robots without constraint couples.
        length_dependence: relative derivative of F with respect to the characteristic length, ``(l / F) dF/dl``; absent
            without a characteristic length, for F = 0, and with several tasks.
        joints: degrees of freedom, actuator rates and singularities of a robot defined by joints; absent for other
            robots.
        free_joints: actuator coordinates that the pose does not determine, at every pose; absent if there are none.
        loading: forces and speeds of the actuators; absent without loads and motions.
        several: robot at every pose; absent for a single pose.
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
    """Violated bound or constraint.

    Attributes:
        name: name of the variable or constraint.
        bound: side: smallest, largest or required value.
        value: value at the point; undetermined for a force under loads at a singular point.
        limit: allowed value.
        unit: unit of both values; absent for a plain number.
    """

    name: str
    bound: Bound
    value: Known
    limit: float
    unit: Absent[str]


class LimitData(JsonObject):
    """Limit of the case, over all legs, joints and poses.

    Attributes:
        key: dotted key of the limit, below ``limits``.
        limit: allowed value.
        unit: unit of limit, value and margin.
        nearest: place with the smallest margin.
        value: value at this place.
        margin: smallest margin, positive inside the limit.
        active: places at which the limit is active.
        violated: places at which the limit is violated.
        cost: derivative of the optimal F with respect to the allowed value; null if the point is not an optimum.
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
