"""Ranks over a workspace of robots with nested loops, held to planar kinematics of ours in which no loop is solved."""

import math
from typing import Any

import numpy as np
import pytest

from screwsynth.models import FloatArray, robot
from screwsynth.nlp import Case, Free, Outcome, Task, TurnKind, Turns, Workspace, judge_workspace
from screwsynth.nlp.proof.checker.workspace.pose_boxes import pose_root
from screwsynth.nlp.proof.checker.workspace.ranks import rank_claim
from screwsynth.nlp.proof.statement.claims import REGULAR
from screwsynth.nlp.proof.statement.machine import workspace_of_case
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import NotJudgedError, build_problem

HOME = np.array([0.0, 1.0])
#: A motor, both ends of a coupler, the rocker's pivot, its elbow, and the platform's hinge.
ROCKER = np.array([(0.6, -0.7), (0.6, -0.98), (0.3, -1), (0, -1), (0.3, -0.4), (0.4, 0.8)])
#: Two further limbs: a motor, an elbow, and the platform's hinge.
LIMBS = np.array([[(-1.5, 0), (-1.2, 0.9), (-0.3, 1.1)], [(1.5, 0), (1.3, 0.9), (0.3, 1.1)]])


def hinge(name: str, one: str, other: str, at: FloatArray, *, driven: bool = False) -> dict[str, Any]:
    table: dict[str, Any] = {
        "name": name,
        "type": "R",
        "between": [one, other],
        "at": [*map(float, at), 0.0],
        "axis": "z",
    }
    return table | ({"actuated": True} if driven else {})


def case_of(rocker: FloatArray, middle: float, half: tuple[float, float], degrees: float) -> Case:
    """A planar robot with three limbs, one of which a crank and a coupler drive, over a box about (0, middle)."""
    m, k, w, q, e, f = rocker
    joints = [
        hinge("m3", "base", "crank", m, driven=True),
        hinge("k3", "crank", "coupler", k),
        hinge("w3", "coupler", "rocker", w),
        hinge("q3", "base", "rocker", q),
        hinge("e3", "rocker", "d3", e),
        hinge("f3", "d3", "platform", f),
    ]
    for n, (motor, elbow, end) in enumerate(LIMBS, 1):
        joints.append(hinge(f"m{n}", "base", f"p{n}", motor, driven=True))
        joints += [hinge(f"e{n}", f"p{n}", f"d{n}", elbow), hinge(f"f{n}", f"d{n}", "platform", end)]
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
    problem = build_problem(case, case.model, pose_box(workspace_of_case(case)))
    assert prove_rank(problem, problem.locked, most_boxes=3000).outcome is not Outcome.PROVED


@pytest.mark.parametrize("middle", [1.0057, 1.0101])
def test_boxes_beside_it_are_regular(middle: float) -> None:
    case = case_of(ROCKER, middle, (1e-4, 1.7e-3), 0.01)
    assert len(signs_of(ROCKER, case)) == 1
    problem = build_problem(case, case.model, pose_box(workspace_of_case(case)))
    assert prove_rank(problem, problem.locked, most_boxes=200).outcome is Outcome.PROVED


def test_the_check_shows_no_box_about_a_singular_pose() -> None:
    case = case_of(ROCKER, 1.008, (0.002, 0.004), 0.1)
    low, high = 1.0057, 1.0101
    side = np.linalg.det(locked(ROCKER, np.array([0, low, 0])))
    while high - low > 1e-12:
        y = 0.5 * (low + high)
        low, high = (y, high) if side * np.linalg.det(locked(ROCKER, np.array([0, y, 0]))) > 0 else (low, y)
    assert case.workspace is not None
    claim = rank_claim(case, case.model, pose_root(workspace_of_case(case)), REGULAR)
    half = np.array([1e-7, 1e-7, 0, 1e-7, 0, 0])
    centres = np.array([[0, y, 0, 0, 0, 0] for y in (low, 1.0062, 1.0095)])
    assert claim.attempt(centres - half, centres + half).holds.tolist() == [False, True, True]


def test_random_robots_have_no_singular_pose_where_they_are_regular() -> None:
    rng, proved, open_boxes = np.random.default_rng(3), 0, 0
    for _ in range(12):
        rocker = ROCKER + rng.uniform(-0.04, 0.04, ROCKER.shape)
        case = case_of(rocker, rng.uniform(0.98, 1.03), (2e-3, 2e-3), 0.1)
        try:
            problem = build_problem(case, case.model, pose_box(workspace_of_case(case)))
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
        hinge("m", "base", "crank", np.array([0.6, 0.3]), driven=True),
        hinge("k", "crank", "coupler", np.array([0.6, 0.02])),
        hinge("w", "coupler", "rocker", np.array([0.3, 0])),
        hinge("q", "base", "rocker", np.array([0, 0])),
        hinge("f", "rocker", "platform", np.array([0.1, 0.2])),
        hinge("g", "rocker", "platform", np.array([0.2, -0.3])),
    ]
    model = robot("four", home=(0, 0, 0), links=["base", "crank", "coupler", "rocker", "platform"], joint=joints)
    turns = Turns(TurnKind.AXIS, (Free(-0.1, 0.1),), (0, 0, 1))
    case = Case(model, {}, (0, 0, 0), [Task([0, 0, 1, 0, 0, 0])], workspace=Workspace((0, 0, 0), turns))
    judged = judge_workspace(case, time_limit=0.5, jobs=1)
    assert judged.regularity.outcome is not Outcome.PROVED
    assert [each.outcome for each in judged.extremes] == [Outcome.OPEN, Outcome.OPEN]
