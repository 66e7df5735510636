"""Several poses: where they are, what F is over them, and that limits hold at all of them."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import Array, Run, case_from, output_of, refusal_of, saved
from measures import exponential, placed_joints

from screwsynth.models import matrix_from_axis_angle, screw_from_axis
from screwsynth.nlp import Case, CaseError, PointKind, Status, evaluate, formulate, json_data, result_of, solve
from screwsynth.nlp.case.pose import along_screw, over_grid
from screwsynth.nlp.evidence.tolerance import BuiltRobot, tolerance_loss
from screwsynth.nlp.program.formulation import formulate_each

HEAD = """
[units]
length = "cm"
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = { min = 8, max = 16 }, x2 = { min = 4, max = 9 }, x3 = { min = 2, max = 28 }, x4 = 20 }
"""
TASK = """
[[task]]
name = "drive"
sense = "SENSE"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1

[solve]
starts = 4
"""
ALONG = """
[pose]
position = [{ min = -10, max = 10 }, { min = -10, max = 10 }, { min = 20, max = 50 }]
rotation = { angle = { min = -30, max = 30 } }
[pose.along_task]
first = -15
last = 15
count = 3
"""
GRID = """
[pose]
position = [0, 0, { min = 20, max = 50 }]
rotation = { axis = [1, 0, 0], angle = { min = -20, max = 20 } }
[pose.grid]
x = { min = -4, max = 4, count = 2 }
z = { min = 0, max = 5, count = 2 }
"""
LISTED = """
[[pose]]
position = [0, { min = -5, max = 5 }, { min = 20, max = 50 }]
rotation = { angle = { min = -20, max = 20 } }
[[pose]]
position = [3, 0, 30]
rotation = { axis = [0, 1, 0], angle = { min = -20, max = 20 } }
"""
KINDS = {"along": ALONG, "grid": GRID, "listed": LISTED}
LIMITS = """
[limits]
leg_length = { min = 22, max = 42 }
actuator = { dead_length = 14, stroke_max = 7.5 }
leg_clearance = { min = 3 }
"""


def case_of(poses: str, over: str = "sum", limits: str = "", sense: str = "max") -> Case:
    combine = f'[combine]\nover_poses = "{over}"\n'
    return case_from(HEAD + poses + TASK.replace("SENSE", sense) + combine + limits, "poses")


#: The task under another name, with another pitch.
LIFT = TASK.partition("[solve]")[0].replace("drive", "lift").replace("pitch = 1", "pitch = 5")


def by_hand(result: dict[str, Any], pose: dict[str, Any], twist: Array) -> tuple[float, Array]:
    """F, and the six leg lengths, at a pose of a result, from the design alone."""
    base, _, ends = placed_joints(result, pose["pose"])
    lengths = np.linalg.norm(ends - base, axis=1)
    forces = (ends - base) / lengths[:, None]
    rates = np.cross(base, forces) @ twist[:3] + forces @ twist[3:]
    return float(rates @ rates), lengths


def test_displacements_along_a_screw_are_its_exponential() -> None:
    twist = screw_from_axis([1, 2, 2], [3, -1, 4], 0.7)
    for amount, step in zip((-0.8, 0.0, 1.3), along_screw(twist, (-0.8, 0.0, 1.3)), strict=True):
        series = exponential(twist, amount)
        np.testing.assert_allclose(step.rotation, series[:3, :3], atol=1e-12)
        np.testing.assert_allclose(step.translation, series[:3, 3], atol=1e-12)
    (moved,) = along_screw(screw_from_axis([0, 0, 3], [0, 0, 0], math.inf), [2.5])
    np.testing.assert_allclose(moved.translation, [0, 0, 2.5])
    assert len(over_grid([[0, 1], [0], [2, 3, 4]])) == 6


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("over", ["sum", "mean", "worst"])
@pytest.mark.parametrize("sense", ["max", "min"])
def test_objective_over_poses_is_the_sum_mean_or_worst_of_what_each_has(kind: str, over: str, sense: str) -> None:
    case = case_of(KINDS[kind], over, LIMITS.replace("7.5", "12"), sense)
    solution = solve(case)
    assert solution.status is Status.OPTIMAL
    result = json.loads(json.dumps(json_data(result_of(solution)), allow_nan=False))
    twist = np.array(result["task"]["twist"])
    found = [by_hand(result, pose, twist)[0] for pose in result["poses"]]
    assert len(found) == case.pose_count
    worst = min if sense == "max" else max
    expected = {"sum": sum(found), "mean": np.mean(found), "worst": worst(found)}[over]
    assert result["F"] == pytest.approx(expected, rel=1e-9)
    for value, pose in zip(found, result["poses"], strict=True):
        assert pose["F"] == pytest.approx(value, rel=1e-9)


def test_poses_along_the_task_are_moved_with_it() -> None:
    solution = solve(case_of(ALONG))
    result = json_data(result_of(solution))
    twist = np.array(result["task"]["twist"])
    stated = result["pose"]
    R0, p0 = np.array(stated["rotation_matrix"]), np.array(stated["position"])
    s = twist[:3]
    for degrees, pose in zip((-15, 0, 15), result["poses"], strict=True):
        angle = math.radians(degrees)
        Q = ca.evalf(matrix_from_axis_angle(ca.SX(s.tolist()), ca.SX(angle))).full()
        through = np.cross(s, twist[3:])
        np.testing.assert_allclose(np.array(pose["pose"]["rotation_matrix"]), Q @ R0, atol=1e-12)
        expected = through + Q @ (p0 - through) + angle * (s @ twist[3:]) * s
        np.testing.assert_allclose(pose["pose"]["position"], expected, atol=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_limits_hold_at_every_pose(kind: str) -> None:
    result = json_data(result_of(solve(case_of(KINDS[kind], "sum", LIMITS))))
    assert result["status"] == "optimal"
    twist = np.array(result["task"]["twist"])
    lengths = np.array([by_hand(result, pose, twist)[1] for pose in result["poses"]])
    stroke = np.ptp(lengths, axis=0)
    rows = {row["key"]: row for row in result["limits"]}
    assert rows["leg_length.max"]["value"] == pytest.approx(lengths.max(), rel=1e-9)
    assert rows["leg_length.min"]["value"] == pytest.approx(lengths.min(), rel=1e-9)
    assert rows["actuator.stroke_max"]["value"] == pytest.approx(stroke.max(), rel=1e-9)
    assert rows["actuator.dead_length"]["value"] == pytest.approx((lengths.min(axis=0) - stroke).min(), rel=1e-9)
    assert min(row["margin"] for row in result["margins"]) >= -1e-8
    assert any(row["active"] for row in result["margins"])


def test_what_a_stroke_costs_is_what_moving_it_does() -> None:
    costs = {}
    for stroke in (7.49, 7.5, 7.51):
        result = json_data(result_of(solve(case_of(ALONG, "mean", LIMITS.replace("7.5", str(stroke))))))
        row = next(row for row in result["limits"] if row["key"] == "actuator.stroke_max")
        costs[stroke] = (result["F"], row["cost"], row["active"])
    assert costs[7.5][2]
    assert costs[7.5][1] == pytest.approx((costs[7.51][0] - costs[7.49][0]) / 0.02, rel=0.01)


def test_one_listed_pose_is_that_pose() -> None:
    one = LISTED.rpartition("[[pose]]")[0]
    task = TASK.replace("SENSE", "max")
    first, second = (solve(case_from(HEAD + pose + task)) for pose in (one, one.replace("[[pose]]", "[pose]")))
    assert first.F == second.F
    assert "poses" not in json_data(result_of(first))


def test_starting_points_lie_in_every_poses_ball() -> None:
    from screwsynth.nlp.program.sampling import starting_points  # noqa: PLC0415

    nlp = formulate(case_of(LISTED.replace("{ axis = [0, 1, 0], angle", "{ angle")))
    for name in ("pose1_q_x", "pose2_q_x"):
        at = [variable.name for variable in nlp.program.variables].index(name)
        sizes = np.linalg.norm(starting_points(nlp, 60, 1)[:, at : at + 3], axis=1)
        assert sizes.max() <= math.sin(math.radians(10)) + 1e-12
        assert np.median(sizes) > 0.7 * math.sin(math.radians(10))


def test_several_tasks_over_several_poses_are_brought_together() -> None:
    combined = '[combine]\nmethod = "weighted-sum"\nover_poses = "mean"\n'
    text = HEAD + ALONG.replace("count = 3", 'count = 3\ntask = "drive"') + combined + LIFT + TASK
    compromise = solve(case_from(text.replace("SENSE", "max"), "two"))
    assert compromise.all_solved
    assert compromise.combination.value == pytest.approx(sum(outcome.F for outcome in compromise.outcomes), rel=1e-9)
    states = [evaluate(compromise.outcomes[0].own.nlp, compromise.x, k).F for k in range(3)]
    assert pytest.approx(np.mean(states), rel=1e-9) == compromise.outcomes[0].F


@pytest.mark.parametrize("over", ["sum", "mean", "worst"])
def test_inexact_joints_cost_what_sampling_over_all_poses_finds(over: str) -> None:
    solution = solve(case_of(ALONG, over))
    robot = BuiltRobot(solution.nlp, solution.x)
    assert robot.evaluate(np.zeros((12, 3)))[0] == pytest.approx(solution.F, rel=1e-9)
    lost = tolerance_loss(solution.nlp, solution.x, 1e-3)
    assert lost.loss_there == pytest.approx(lost.loss, rel=1e-2)
    random = np.random.default_rng(2)
    for _ in range(100):
        errors = random.normal(size=(12, 3))
        errors *= 1e-3 / np.linalg.norm(errors, axis=1, keepdims=True)
        assert solution.F - robot.evaluate(errors)[0] <= 1.01 * lost.loss


def test_limits_of_tasks_brought_together_have_the_cost_of_their_value() -> None:
    def together(longest: float) -> dict[str, Any]:
        text = HEAD + ALONG.partition("[pose.along")[0] + '[combine]\nmethod = "weighted-sum"\n' + LIFT + TASK
        text = text.replace("SENSE", "max") + f"\n[limits]\nleg_length = {{ max = {longest} }}\n"
        combined: dict[str, Any] = json_data(result_of(solve(case_from(text, "two"))))["combined"]
        return combined

    (row,) = together(40.0)["limits"]
    assert row["active"]
    high, low = (together(40.0 + step)["value"] for step in (1e-2, -1e-2))
    assert row["cost"] == pytest.approx((high - low) / 2e-2, rel=0.01)


def test_an_optimum_over_poses_has_its_evidence() -> None:
    solution = solve(case_of(ALONG, "worst"))
    assert solution.evidence.kind is PointKind.STRICT_MAXIMUM
    names = {side.name for side in solution.evidence.active}
    assert {"F pose 1", "F pose 3"} & names
    assert not any(side.name == "level" for side in solution.evidence.active)


def test_commands_and_generated_code_have_every_pose(cli: Run, tmp_path: Path) -> None:
    text = HEAD + ALONG + TASK.replace("SENSE", "max") + '[combine]\nover_poses = "worst"\n'
    path = saved(tmp_path / "poses.toml", text)
    assert "worst over 3 poses" in output_of(cli("solve", str(path)))
    result = json.loads(output_of(cli("evaluate", str(path), "--json", "-")))
    assert result["F"] == pytest.approx(min(pose["F"] for pose in result["poses"]))
    output_of(cli("codegen", str(path), "--no-measure", "--out", str(tmp_path / "c")))
    manifest = json.loads((tmp_path / "c" / "manifest.json").read_text(encoding="utf-8"))
    assert "level" in [number["name"] for number in manifest["variables"]]


def test_numbers_of_each_listed_pose_can_be_set(cli: Run, tmp_path: Path) -> None:
    path = saved(tmp_path / "poses.toml", HEAD + LISTED + TASK.replace("SENSE", "max"))
    words = ["--set", "pose2_p_z=33", "--set", "pose2_angle=7", "--set", "x1=11", "--set", "pose1_axis=0,1,0"]
    second = json.loads(output_of(cli("evaluate", str(path), *words, "--json", "-")))["poses"][1]["pose"]
    assert second["position"] == [3, 0, 33]
    assert second["angle"] == pytest.approx(7)
    refusal_of(cli("evaluate", str(path), "--set", "angle=7"), "angle: cannot be set", "pose1_angle")


def test_a_task_of_one_pose_has_one_program_for_all_tasks() -> None:
    assert len(formulate_each(case_of(GRID))[0].program.robots) == 4


def test_worst_over_poses_with_several_tasks_is_refused() -> None:
    tables = tomllib.loads(HEAD + LISTED + TASK.replace("SENSE", "max") + '[combine]\nover_poses = "worst"\n')
    tables["task"].append({**tables["task"][0], "name": "other"})
    with pytest.raises(CaseError, match=r"combine\.over_poses = \"worst\": must be 'sum' or 'mean'"):
        case_from(tables, "two")
