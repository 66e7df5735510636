"""Cases about the machine of LinuxCNC's hexapod kinematics, in inches; see cases/hexapod-machining.toml."""

import numpy as np

from screwsynth.models import FloatArray, hexapod
from screwsynth.nlp import Case, Free, Task, TurnKind, Turns, Workspace
from screwsynth.nlp.interruption import within
from screwsynth.nlp.proof.statement.fixed_robot import Legs
from screwsynth.nlp.proof.statement.tolerance import built_model
from screwsynth.nlp.proof.workspace.numbers.bound_search import Goal, Minimum, Number, smallest_values
from screwsynth.nlp.proof.workspace.numbers.clearance import Clearance
from screwsynth.nlp.proof.workspace.numbers.searched import Subject
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseBox, PoseNumbers
from screwsynth.nlp.proof.workspace.robot.posed_robot import build_problem, family_of

#: A robot of any six straight legs.
HEXAPOD = hexapod()

_MACHINE = """
[units]
length = "in"
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = {{ x1 = 26.5, x2 = 11.543, x3 = {x3}, x4 = {x4} }}
[pose]
position = [0, 0, 20]
"""
PUSH = """[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
"""


def hexapod_text(x3: float, x4: float, task: str = PUSH) -> str:
    """The tables of the robot, of its pose and of a task, a push upwards if left out."""
    return _MACHINE.format(x3=x3, x4=x4) + task


#: Over a small workspace; limits follow.
SMALL = (
    hexapod_text(5, 9)
    + "[workspace]\nposition = [{ min = -0.2, max = 0.2 }, 0, { min = 19.8, max = 20.2 }]\n[limits]\n"
)


#: The machine of LinuxCNC's hexapod kinematics, joints apart, with every limit that errors of joint centres change. The
#: limits are wide: the numbers that are proved are compared.
EVERY_LIMIT = (
    hexapod_text(4, 5, "")
    + """[tolerance]
joint_centre = 0.02
[[task]]
sense = "max"
axis = [1, 2, 6]
point = [3, 1, 12]
pitch = 0.1
[limits]
leg_length = { min = 10, max = 60 }
actuator = { stroke_max = 30, dead_length = 1 }
base_joint_angle = 80
platform_joint_angle = { max = 60, about = "home" }
home = { position = [0, 0, 20] }
joint_spacing = { min = 1 }
footprint = { base = 40, platform = 20 }
radius_ratio = { min = 0.1, max = 0.9 }
leg_clearance = { min = 0.5 }
smallest_singular_value = { min = 0.1, length = 11.5 }
condition_number = { max = 30, length = 11.5 }
rate_share = { max = 0.9 }
actuator_rate = { max = 60 }
custom = ["x1 - 2*x2 >= 0"]
[workspace]
position = [{ min = -1, max = 1 }, { min = -1, max = 1 }, { min = 19, max = 21 }]
rotation = { angle = { min = -6, max = 6 } }
"""
)


def case_of_legs(robot: Legs) -> Case:
    """A case about six legs with these joint centres."""
    given = {f"{plate}_{i + 1}": getattr(robot, plate)[i].tolist() for plate in ("base", "platform") for i in range(6)}
    task = Task([0, 0, 0, 0, 0, 1])
    return Case(HEXAPOD, given, [0.0, 0.0, 0.0], [task], joint_centre_tolerance=robot.tolerance or None)


def subject_of(robot: Legs, box: PoseBox, shortest: float = 0.0) -> Subject:
    """Six legs over a box."""
    case = case_of_legs(robot)
    machines = build_problem(case, HEXAPOD, box)
    if robot.tolerance:
        machines = family_of(case, built_model(HEXAPOD), machines, robot.tolerance)
    return Subject(case, HEXAPOD, machines, shortest=shortest)


def clearance(robot: Legs, box: PoseBox, one: int, other: int) -> Clearance:
    """The distance of two legs."""
    return Clearance(subject_of(robot, box).problem, robot, (one, other))


def random_legs(rng: np.random.Generator, tolerance: float = 0.0) -> Legs:
    base, platform = (
        np.column_stack([rng.uniform(-size, size, (6, 2)), rng.uniform(-1, 1, 6)]) for size in (10.0, 6.0)
    )
    return Legs(base, platform, tolerance)


def random_workspace(rng: np.random.Generator, kind: TurnKind, size: float) -> Workspace:
    """Rotations up to an angle, and positions within four times as many units of length about a random one."""
    turns = (Free(-size, size),) * (3 if kind is TurnKind.ROLL_PITCH_YAW else 1)
    place = tuple(Free(float(c - 4 * size), float(c + 4 * size)) for c in rng.uniform((-3, -3, 9), (3, 3, 15)))
    return Workspace(place, Turns(kind, turns, (0.6, 0.0, 0.8)))


def singular_part(robot: Legs, pose: PoseNumbers) -> float:
    """The smallest singular value of unit rows of six legs at a pose, in parts of the largest."""
    arm = robot.platform @ pose.rotation.T
    span = pose.position + arm - robot.base
    J = np.hstack([span, np.cross(arm, span)]) / np.linalg.norm(span, axis=1, keepdims=True)
    values = np.linalg.svd(J, compute_uv=False)
    return float(values[-1] / values[0])


def values_of(number: Number, points: FloatArray) -> FloatArray:
    """The values of a number at points (K, 6)."""
    return np.asarray(number.values(points[:, list(number.problem.free)])[:, 0])


def bounds_of(number: Number, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """The lower bounds of a number over boxes (B, 6)."""
    free = list(number.problem.free)
    return np.asarray(number.bounds(lower[:, free], upper[:, free])[:, 0])


def smallest(number: Number, goal: Goal, time_limit: float | None = None) -> Minimum:
    """The smallest value of one number."""
    with within(time_limit):
        (found,) = smallest_values(number, [goal])
    return found
