"""Cases about the machine of LinuxCNC's hexapod kinematics, in inches; see cases/hexapod-machining.toml."""

from screwsynth.models import hexapod
from screwsynth.nlp import Case, Task
from screwsynth.nlp.proof.statement.machine import Legs
from screwsynth.nlp.proof.workspace.numbers.bound_search import Number, OverPoses
from screwsynth.nlp.proof.workspace.numbers.searched import Subject
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseBox

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


def case_of_legs(robot: Legs) -> Case:
    """A case about six legs with these joint centres."""
    given = {f"{plate}_{i + 1}": getattr(robot, plate)[i].tolist() for plate in ("base", "platform") for i in range(6)}
    task = Task([0, 0, 0, 0, 0, 1])
    return Case(HEXAPOD, given, [0.0, 0.0, 0.0], [task], joint_centre_tolerance=robot.tolerance or None)


def subject_of(robot: Legs, box: PoseBox, shortest: float = 0.0) -> Subject:
    """Six legs over a box."""
    return Subject(case_of_legs(robot), HEXAPOD, box, robot, shortest=shortest)


def over(subject: Subject, number: Number) -> OverPoses:
    """Bounds and values of a number over boxes of poses."""
    return OverPoses(number, subject.problem)


def clearance(robot: Legs, box: PoseBox, one: int, other: int) -> OverPoses:
    """The distance of two legs."""
    return over(subject := subject_of(robot, box), subject.clearance((one, other)))
