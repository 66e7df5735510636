"""Singular values, strokes and clearances of any robot over a workspace: no pose is beyond a proven bound."""

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest

from screwsynth.models import FloatArray, homogenised, three_upu
from screwsynth.nlp import Case, ConditionNumber, Free, LegClearance, Limits, LinkClearance, SmallestSingularValue, Task
from screwsynth.nlp.case.limits.legs import Actuator
from screwsynth.nlp.case.limits.limit import Limit
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.case.task import Sense
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.evidence.closing import closed_in_place
from screwsynth.nlp.evidence.state import evaluate
from screwsynth.nlp.proof.statement.posed_layout import extreme_program
from screwsynth.nlp.proof.statement.tolerance import coordinate_layout
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseBox, pose_box, pose_coordinates
from screwsynth.nlp.proof.workspace.verdict import Outcome

#: Lengths by which moments are divided, and others that are the characteristic lengths of the cases.
LENGTHS, CHARACTERISTIC = {"three-upu": 30.0}, 0.3
#: Random poses, steps of the descent from the best of them, and poses in each step.
POSES, STEPS, AROUND = 40, 6, 8


def robot_case(name: str, *limits: Limit, tolerance: float | None = None) -> Case:
    """A case about a robot with its typical dimensions at home."""
    model = three_upu(axes="tsai") if name == "three-upu" else build_model(name)
    values = {item.name: item.typical[0] for item in model.parameters}
    home = [0.0, 0.0, 40.0] if name == "three-upu" else list(model.home)
    return Case(
        model,
        values,
        home,
        [Task([0, 0, 0, 0, 0, 1])],
        limits=Limits(*limits),
        characteristic_length=CHARACTERISTIC,
        joint_centre_tolerance=tolerance,
    )


def small_workspace(case: Case, part: float, degrees: float) -> Workspace:
    """Positions within a part of the robot's size about home, and rotations up to an angle each."""
    values = [float(each) for name in case.parameters for each in case.components(name)]
    size, angle = max(map(abs, [*case.position, *values])), math.radians(degrees)
    turns = Turns(TurnKind.ROLL_PITCH_YAW, (Free(-angle, angle),) * 3) if degrees else Turns()
    return Workspace([Free(each - part * size, each + part * size) for each in case.position], turns)


class Numbers(NamedTuple):
    """Numbers of the design at one pose."""

    smallest: float
    condition: float
    distances: dict[str, float]
    lengths: dict[str, float]


class AtPoses:
    """The design at single poses, its loops closed from home and its J as evaluate has it."""

    def __init__(self, case: Case, box: PoseBox, length: float) -> None:
        self._length = length
        layout = coordinate_layout(replace(case, limits=Limits(), joint_centre_tolerance=None), pose_coordinates(box))
        self._nlp = nlp = extreme_program(layout, ca.SX(0), Sense.MIN)
        robot, inner = layout.robots[0], set(nlp.program.places.inner)
        self._given = [k for k in range(nlp.n) if k not in inner]
        links = [(each.name, frozenset([each.name]), each.base, each.span) for each in robot.legs]
        links += [(each.name, each.ends, each.start, each.span) for each in robot.links]
        self._names = [(name, ends) for name, ends, _, _ in links]
        ends = [ca.vertcat(start, start + span) for _, _, start, span in links]
        self._ends = ca.Function("ends", [nlp.program.x, nlp.program.p], [ca.densify(ca.horzcat(*ends))])

    def numbers(self, given: FloatArray) -> Numbers | None:
        """The numbers at given numbers of a pose; None where the loops do not close."""
        x = self._nlp.start.copy()
        x[self._given] = given
        closed = closed_in_place(self._nlp, x)
        if closed is None:
            return None
        state = evaluate(self._nlp, closed)
        J = np.array(homogenised(np.array(state.jacobian), np.array(state.position), self._length)).T
        values = np.linalg.svd(J, compute_uv=False)
        ends = self._ends(closed, self._nlp.arguments).full().T.reshape(-1, 2, 3)
        pairs = itertools.combinations(range(len(ends)), 2)
        distances = {
            f"{self._names[i][0]} and {self._names[j][0]}": distance(ends[i], ends[j])
            for i, j in pairs
            if not self._names[i][1] & self._names[j][1]
        }
        lengths = {name: float(np.linalg.norm(b - a)) for (name, _), (a, b) in zip(self._names, ends, strict=True)}
        return Numbers(float(values[-1]), float(values[0] / values[-1]), distances, lengths)


def distance(one: FloatArray, other: FloatArray) -> float:
    """Distance of two segments (2, 3), from points of both: at most it is less by what lies between these."""
    share = np.linspace(0, 1, 21)
    a, b = (each[0] + share[:, None] * (each[1] - each[0]) for each in (one, other))
    return float(np.linalg.norm(a[:, None] - b, axis=2).min())


def descended(
    at: AtPoses, box: PoseBox, value: Callable[[Numbers], float], given: list[FloatArray], rng: np.random.Generator
) -> float:
    """The smallest value that random poses, and steps from the best of them, find."""
    free = list(box.free)
    known = [(value(found), y) for y in given if (found := at.numbers(y)) is not None]
    best, y = min(known, key=lambda each: each[0])
    step = 0.3
    for _ in range(STEPS):
        for _ in range(AROUND):
            moved = y + step * (box.upper - box.lower)[free] * rng.normal(size=len(free))
            moved = np.clip(moved, box.lower[free], box.upper[free])
            found = at.numbers(moved)
            if found is not None and value(found) < best:
                best, y = value(found), moved
        step *= 0.5
    return best


@pytest.mark.parametrize(
    ("name", "part", "degrees"),
    [("three-upu", 0.1, 0.0), ("6-rus", 0.03, 4.0), ("6-ups", 0.05, 5.0), ("tripteron", 0.03, 0.0)],
)
def test_no_pose_is_beyond_a_proven_number(name: str, part: float, degrees: float) -> None:
    has_legs, length = name == "three-upu", LENGTHS.get(name, 0.4)
    # Links of 6-rus have 60 distances.
    apart: list[Limit] = [LegClearance(1.0) if has_legs else LinkClearance(1e-3)]
    apart += [Actuator(stroke_max=30.0)] if name in ("three-upu", "6-ups") else []
    case = robot_case(
        name, SmallestSingularValue(1e-3, length), ConditionNumber(1e4, length), *(apart if name != "6-rus" else [])
    )
    workspace = small_workspace(case, part, degrees)
    case = replace(case, workspace=workspace)
    judged = judge_workspace(case, gap=0.05, with_objective=False)
    found = {(each.name, each.sense): each for each in judged.extremes if each.limit is not None}
    box, rng = pose_box(workspace), np.random.default_rng(4)
    at, given = AtPoses(case, box, length), list(box.random(POSES, rng)[:, list(box.free)])
    smallest = found["smallest_singular_value", Sense.MIN]
    condition = found["condition_number", Sense.MAX]
    for each in (smallest, condition):
        assert each.outcome is Outcome.PROVED, each
    assert smallest.bound <= descended(at, box, lambda each: each.smallest, given, rng)
    assert -condition.bound <= descended(at, box, lambda each: -each.condition, given, rng)
    distances = [each for each in judged.extremes if "clearance" in each.key]
    assert distances or name == "6-rus"
    for each in distances[:: max(len(distances) // 3, 1)]:
        pair = each.name.partition(" ")[2].partition(" ")[2]
        assert math.isfinite(each.bound)
        assert each.bound <= descended(at, box, lambda here, pair=pair: here.distances[pair], given, rng)
    for each in (each for each in judged.extremes if each.key == "actuator.stroke_max"):
        leg = each.name.rpartition(" ")[2]
        lengths = [here.lengths[leg] for y in given if (here := at.numbers(y)) is not None]
        assert each.outcome is Outcome.PROVED
        assert max(lengths) - min(lengths) <= each.bound
