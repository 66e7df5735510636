"""Ranks over a workspace of robots with nested loops, and singular values, strokes and clearances of any robot."""

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from numpy.typing import ArrayLike
from workspace_cases import problem_of, rank_of

from screwsynth.models import FloatArray, homogenised, robot, three_upu
from screwsynth.nlp import Case, Free, Limits, Outcome, Sense, Task, TurnKind, Turns, Workspace, judge_workspace
from screwsynth.nlp.case.limits.clearance import LegClearance, LinkClearance
from screwsynth.nlp.case.limits.legs import Actuator
from screwsynth.nlp.case.limits.limit import Limit
from screwsynth.nlp.case.limits.singular_values import ConditionNumber, SmallestSingularValue
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.evidence.closing import closed_in_place
from screwsynth.nlp.evidence.state import evaluate
from screwsynth.nlp.proof.statement.posed_layout import extreme_program
from screwsynth.nlp.proof.statement.tolerance import coordinate_layout
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseBox, pose_box, pose_coordinates
from screwsynth.nlp.proof.workspace.robot.posed_robot import NotJudgedError

HOME = np.array([0.0, 1.0])
#: A motor, both ends of a coupler, the rocker's pivot, its elbow, and the platform's hinge.
ROCKER = np.array([(0.6, -0.7), (0.6, -0.98), (0.3, -1), (0, -1), (0.3, -0.4), (0.4, 0.8)])
#: Two further limbs: a motor, an elbow, and the platform's hinge.
LIMBS = np.array([[(-1.5, 0), (-1.2, 0.9), (-0.3, 1.1)], [(1.5, 0), (1.3, 0.9), (0.3, 1.1)]])


def hinge(name: str, one: str, other: str, at: ArrayLike, **driven: bool) -> dict[str, Any]:
    return {"name": name, "type": "R", "between": [one, other], "at": [*map(float, at), 0.0], "axis": "z"} | driven


def case_of(rocker: FloatArray, middle: float, half: tuple[float, float], degrees: float) -> Case:
    """A planar robot with three limbs, one of which a crank and a coupler drive, over a box about (0, middle)."""
    m, k, w, q, e, f = rocker
    joints = [
        hinge("m3", "base", "crank", m, actuated=True),
        hinge("k3", "crank", "coupler", k),
        hinge("w3", "coupler", "rocker", w),
        hinge("q3", "base", "rocker", q),
        hinge("e3", "rocker", "d3", e),
        hinge("f3", "d3", "platform", f),
    ]
    for n, (motor, elbow, end) in enumerate(LIMBS, 1):
        joints += [hinge(f"m{n}", "base", f"p{n}", motor, actuated=True), hinge(f"e{n}", f"p{n}", f"d{n}", elbow)]
        joints.append(hinge(f"f{n}", f"d{n}", "platform", end))
    links = ["base", "crank", "coupler", "rocker", "d3", "p1", "d1", "p2", "d2", "platform"]
    model = robot("rocker", home=(0, 1, 0), links=links, joint=joints)
    turn = math.radians(degrees)
    place = Free(-half[0], half[0]), Free(middle - half[1], middle + half[1]), 0
    workspace = Workspace(place, Turns(TurnKind.AXIS, (Free(-turn, turn),), (0, 0, 1)))
    return Case(model, {}, (0, middle, 0), [Task([0, 0, 0.7, 0.4, 0.6, 0])], workspace=workspace)


def corner(a: FloatArray, b: FloatArray, at_home: tuple[FloatArray, FloatArray, FloatArray]) -> FloatArray:
    """The point at home's distances from two points, on home's side of their line."""
    a0, b0, c0 = at_home
    r, s = np.linalg.norm(c0 - a0), np.linalg.norm(c0 - b0)
    d = float(np.linalg.norm(b - a))
    u = (b - a) / d
    along = (r**2 - s**2 + d**2) / (2 * d)
    side = np.sign((b0 - a0)[0] * (c0 - a0)[1] - (b0 - a0)[1] * (c0 - a0)[0])
    return np.asarray(a + along * u + side * math.sqrt(r**2 - along**2) * np.array([-u[1], u[0]]))


def locked(rocker: FloatArray, pose: FloatArray) -> FloatArray:
    """Conditions (12, 12) on rates of platform and passive joints with locked motors, at a pose (x, y, angle)."""
    c, s = math.cos(pose[2]), math.sin(pose[2])

    def moved(point: FloatArray) -> FloatArray:
        return np.asarray(pose[:2] + np.array([[c, -s], [s, c]]) @ (point - HOME))

    def turn(point: FloatArray) -> FloatArray:
        return np.array([1.0, point[1] - pose[1], pose[0] - point[0]])

    m, k0, w0, q, e0, f0 = rocker
    f = moved(f0)
    e = corner(q, f, (q, f0, e0))
    turned = complex(*(e - q)) / complex(*(e0 - q)) * complex(*(w0 - q))
    w = q + np.array([turned.real, turned.imag])
    k = corner(m, w, (m, w0, k0))
    M = np.zeros((12, 12))
    for n, (motor, elbow, end) in enumerate(LIMBS):
        tip = moved(end)
        rows = slice(3 * n, 3 * n + 3)
        M[rows, :3] = np.eye(3)
        M[rows, 3 + 2 * n], M[rows, 4 + 2 * n] = -turn(corner(motor, tip, (motor, end, elbow))), -turn(tip)
    M[6:9, :3] = np.eye(3)
    M[6:9, 7], M[6:9, 8], M[6:9, 9] = -turn(q), -turn(e), -turn(f)
    M[9:, 7], M[9:, 10], M[9:, 11] = -turn(q), turn(k), turn(w)
    return M


def poses_of(case: Case, count: int, seed: int) -> FloatArray:
    ends = [each for each in (*case.workspace.position, *case.workspace.turns.angles) if isinstance(each, Free)]
    low, high = (np.array([float(getattr(each, name)) for each in ends]) for name in ("lower", "upper"))
    return np.asarray(np.random.default_rng(seed).uniform(low, high, (count, 3)))


def signs_of(rocker: FloatArray, case: Case, count: int = 1000) -> set[float]:
    """Signs of the determinant at random poses; none of them is singular."""
    matrices = np.array([locked(rocker, pose) for pose in poses_of(case, count, 7)])
    assert float(np.linalg.svd(matrices, compute_uv=False)[:, -1].min()) > 1e-9
    return set(np.sign(np.linalg.det(matrices)).tolist())


def test_a_box_in_which_a_loop_loses_its_rank_is_not_regular() -> None:
    """Where coupler and rocker are in line, the locked crank does not hold the rocker."""
    case = case_of(ROCKER, 1.008, (0.002, 0.004), 0.1)
    assert signs_of(ROCKER, case) == {-1.0, 1.0}
    problem = problem_of(case)
    assert prove_rank(problem, problem.locked, most_boxes=3000).outcome is not Outcome.PROVED


@pytest.mark.parametrize("middle", [1.0057, 1.0101])
def test_boxes_beside_it_are_regular(middle: float) -> None:
    case = case_of(ROCKER, middle, (1e-4, 1.7e-3), 0.01)
    assert len(signs_of(ROCKER, case)) == 1
    problem = problem_of(case)
    assert prove_rank(problem, problem.locked, most_boxes=200).outcome is Outcome.PROVED


def test_the_check_shows_no_box_about_a_singular_pose() -> None:
    case = case_of(ROCKER, 1.008, (0.002, 0.004), 0.1)
    low, high = 1.0057, 1.0101
    side = np.linalg.det(locked(ROCKER, np.array([0, low, 0])))
    while high - low > 1e-12:
        y = 0.5 * (low + high)
        low, high = (y, high) if side * np.linalg.det(locked(ROCKER, np.array([0, y, 0]))) > 0 else (low, y)
    claim = rank_of(case)
    half = np.array([1e-7, 1e-7, 0, 1e-7, 0, 0])
    centres = np.array([[0, y, 0, 0, 0, 0] for y in (low, 1.0062, 1.0095)])
    assert claim.attempt(centres - half, centres + half).holds.tolist() == [False, True, True]


def test_random_robots_have_no_singular_pose_where_they_are_regular() -> None:
    rng, proved, open_boxes = np.random.default_rng(3), 0, 0
    for _ in range(12):
        rocker = ROCKER + rng.uniform(-0.04, 0.04, ROCKER.shape)
        case = case_of(rocker, rng.uniform(0.98, 1.03), (2e-3, 2e-3), 0.1)
        try:
            problem = problem_of(case)
        except NotJudgedError:
            continue
        if prove_rank(problem, problem.locked, most_boxes=600).outcome is Outcome.PROVED:
            proved += 1
            assert len(signs_of(rocker, case)) == 1
        else:
            open_boxes += 1
    assert proved > 4


def test_the_objective_is_open_where_a_member_without_motions_has_loops_that_may_lose_their_rank() -> None:
    """The platform rides on a rocker by two hinges. Where coupler and rocker are in line it moves, and F is 0."""
    joints = [
        hinge("m", "base", "crank", (0.6, 0.3), actuated=True), hinge("k", "crank", "coupler", (0.6, 0.02)),
        hinge("w", "coupler", "rocker", (0.3, 0)), hinge("q", "base", "rocker", (0, 0)),
        hinge("f", "rocker", "platform", (0.1, 0.2)), hinge("g", "rocker", "platform", (0.2, -0.3)),
    ]  # fmt: skip
    model = robot("four", home=(0, 0, 0), links=["base", "crank", "coupler", "rocker", "platform"], joint=joints)
    turns = Turns(TurnKind.AXIS, (Free(-0.1, 0.1),), (0, 0, 1))
    case = Case(model, {}, (0, 0, 0), [Task([0, 0, 1, 0, 0, 0])], workspace=Workspace((0, 0, 0), turns))
    judged = judge_workspace(case, time_limit=0.5, jobs=1)
    assert judged.regularity.outcome is not Outcome.PROVED
    assert [each.outcome for each in judged.extremes] == [Outcome.OPEN, Outcome.OPEN]


#: Lengths by which moments are divided, and others that are the characteristic lengths of the cases.
LENGTHS, CHARACTERISTIC = {"three-upu": 30.0}, 0.3
#: Random poses, steps of the descent from the best of them, and poses in each step.
POSES, STEPS, AROUND = 40, 6, 8


def robot_case(name: str, *limits: Limit) -> Case:
    model = three_upu(axes="tsai") if name == "three-upu" else build_model(name)
    values = {item.name: item.typical[0] for item in model.parameters}
    home = [0.0, 0.0, 40.0] if name == "three-upu" else list(model.home)
    task, length = Task([0, 0, 0, 0, 0, 1]), CHARACTERISTIC
    return Case(model, values, home, [task], limits=Limits(*limits), characteristic_length=length)


def small_workspace(case: Case, part: float, degrees: float) -> Workspace:
    """Positions within a part of the robot's size about home, and rotations up to an angle each."""
    values = [float(each) for name in case.parameters for each in case.components(name)]
    size, angle = max(map(abs, [*case.position, *values])), math.radians(degrees)
    turns = Turns(TurnKind.ROLL_PITCH_YAW, (Free(-angle, angle),) * 3) if degrees else Turns()
    return Workspace([Free(each - part * size, each + part * size) for each in case.position], turns)


class Numbers(NamedTuple):
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
    [
        *(("three-upu", 0.1, 0.0), ("6-rus", 0.03, 4.0)),
        *(pytest.param(*each, marks=pytest.mark.soak) for each in (("6-ups", 0.05, 5.0), ("tripteron", 0.03, 0.0))),
    ],
)
def test_no_pose_is_beyond_a_proven_number(name: str, part: float, degrees: float) -> None:
    has_legs, length = name == "three-upu", LENGTHS.get(name, 0.4)
    # Links of 6-rus have 60 distances.
    apart: list[Limit] = [LegClearance(1.0) if has_legs else LinkClearance(1e-3)]
    apart += [Actuator(stroke_max=30.0)] if name in ("three-upu", "6-ups") else []
    spectral = SmallestSingularValue(1e-3, length), ConditionNumber(1e4, length)
    case = robot_case(name, *spectral, *(apart if name != "6-rus" else []))
    workspace = small_workspace(case, part, degrees)
    case = replace(case, workspace=workspace)
    judged = judge_workspace(case, gap=0.05, with_objective=False)
    found = {(each.name, each.sense): each for each in judged.extremes if each.limit is not None}
    box, rng = pose_box(workspace), np.random.default_rng(4)
    at, given = AtPoses(case, box, length), list(box.random(POSES, rng)[:, list(box.free)])
    smallest, condition = found["smallest_singular_value", Sense.MIN], found["condition_number", Sense.MAX]
    assert smallest.outcome is condition.outcome is Outcome.PROVED
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
