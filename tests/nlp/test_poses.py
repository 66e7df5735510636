"""Several poses: where they are, what F is over them, limits at all of them, and between each two of many."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import Array, Run, case_from, case_of, edited, output_of, refusal_of, saved
from measures import exponential, placed_joints

from screwsynth.models import matrix_from_axis_angle, screw_from_axis
from screwsynth.nlp import Case, CaseError, PointKind, Solution, certify, evaluate, examine, json_data, result_of, solve
from screwsynth.nlp.case.pose import along_screw, over_grid
from screwsynth.nlp.evidence.kkt import linearise
from screwsynth.nlp.evidence.tolerance import BuiltRobot, tolerance_loss
from screwsynth.nlp.program import limits as program_limits
from screwsynth.nlp.program.formulation import formulate, formulate_each
from screwsynth.nlp.program.pairs import with_all_pairs, with_pairs_at
from screwsynth.nlp.program.sampling import starting_points
from screwsynth.nlp.proof.statement.standard_form import standard_form
from screwsynth.nlp.solver.status import Phase, Status

HEAD = """
units.length = "cm"
robot = { model = "stewart-gough", layout = "octahedral", parameters = PARAMETERS }
""".replace(
    "PARAMETERS", "{ x1 = { min = 8, max = 16 }, x2 = { min = 4, max = 9 }, x3 = { min = 2, max = 28 }, x4 = 20 }"
)
TASK = '[[task]]\nname = "drive"\nsense = "SENSE"\naxis = [2, 2, 1]\npoint = [2, 3, 6]\npitch = 1\n'
SOLVE = "[solve]\nstarts = 4\n"
ALONG = """
[pose]
position = [{ min = -10, max = 10 }, { min = -10, max = 10 }, { min = 20, max = 50 }]
rotation = { angle = { min = -30, max = 30 } }
along_task = { first = -15, last = 15, count = 3 }
"""
GRID = """
[pose]
position = [0, 0, { min = 20, max = 50 }]
rotation = { axis = [1, 0, 0], angle = { min = -20, max = 20 } }
grid = { x = { min = -4, max = 4, count = 2 }, z = { min = 0, max = 5, count = 2 } }
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
#: The task under another name, with another pitch, and both together.
LIFT = edited(TASK, ("drive", "lift"), ("pitch = 1", "pitch = 5"))
TOGETHER = f'[combine]\nmethod = "weighted-sum"\n{LIFT}{TASK}{SOLVE}'.replace("SENSE", "max")


def text_of(poses: str, over: str = "sum", limits: str = "", sense: str = "max") -> str:
    combine = f'[combine]\nover_poses = "{over}"\n' if over else ""
    return HEAD + poses + TASK.replace("SENSE", sense) + SOLVE + combine + limits


def poses_case(poses: str, over: str = "sum", limits: str = "", sense: str = "max") -> Case:
    return case_from(text_of(poses, over, limits, sense), "poses")


def by_hand(result: dict[str, Any], pose: dict[str, Any], twist: Array) -> tuple[float, Array]:
    """F, and the six leg lengths, at a pose of a result, from the design alone."""
    base, _, ends = placed_joints(result, pose["pose"])
    lengths = np.linalg.norm(ends - base, axis=1)
    forces = (ends - base) / lengths[:, None]
    rates = np.cross(base, forces) @ twist[:3] + forces @ twist[3:]
    return float(rates @ rates), lengths


def test_poses_along_a_screw_are_its_exponential() -> None:
    twist = screw_from_axis([1, 2, 2], [3, -1, 4], 0.7)
    for amount, step in zip((-0.8, 0.0, 1.3), along_screw(twist, (-0.8, 0.0, 1.3)), strict=True):
        series = exponential(twist, amount)
        np.testing.assert_allclose(step.rotation, series[:3, :3], atol=1e-12)
        np.testing.assert_allclose(step.translation, series[:3, 3], atol=1e-12)
    (moved,) = along_screw(screw_from_axis([0, 0, 3], [0, 0, 0], math.inf), [2.5])
    np.testing.assert_allclose(moved.translation, [0, 0, 2.5])
    assert len(over_grid([[0, 1], [0], [2, 3, 4]])) == 6
    solution = solve(poses_case(ALONG))
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
@pytest.mark.parametrize("over", ["sum", "mean", "worst"])
@pytest.mark.parametrize("sense", ["max", "min"])
def test_objective_over_poses_is_the_sum_mean_or_worst_of_what_each_has(kind: str, over: str, sense: str) -> None:
    case = poses_case(KINDS[kind], over, LIMITS.replace("7.5", "12"), sense)
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


@pytest.mark.parametrize("kind", KINDS)
def test_limits_hold_at_every_pose(kind: str) -> None:
    result = json_data(result_of(solve(poses_case(KINDS[kind], "sum", LIMITS))))
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
        result = json_data(result_of(solve(poses_case(ALONG, "mean", LIMITS.replace("7.5", str(stroke))))))
        row = next(row for row in result["limits"] if row["key"] == "actuator.stroke_max")
        costs[stroke] = (result["F"], row["cost"], row["active"])
    assert costs[7.5][2]
    assert costs[7.5][1] == pytest.approx((costs[7.51][0] - costs[7.49][0]) / 0.02, rel=0.01)


def test_one_listed_pose_is_that_pose() -> None:
    one = LISTED.rpartition("[[pose]]")[0]
    first, second = (solve(poses_case(pose, "")) for pose in (one, one.replace("[[pose]]", "[pose]")))
    assert first.F == second.F
    assert "poses" not in json_data(result_of(first))


def test_several_tasks_over_several_poses_are_brought_together() -> None:
    text = HEAD + edited(ALONG, ("count = 3", 'count = 3, task = "drive"')) + TOGETHER
    compromise = solve(case_from(edited(text, ("[combine]", '[combine]\nover_poses = "mean"')), "two"))
    assert compromise.all_solved
    assert compromise.combination.value == pytest.approx(sum(outcome.F for outcome in compromise.outcomes), rel=1e-9)
    states = [evaluate(compromise.outcomes[0].own.nlp, compromise.x, k).F for k in range(3)]
    assert pytest.approx(np.mean(states), rel=1e-9) == compromise.outcomes[0].F


@pytest.mark.parametrize("over", ["sum", "mean", "worst"])
def test_inexact_joints_cost_what_sampling_over_all_poses_finds(over: str) -> None:
    solution = solve(poses_case(ALONG, over))
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
        text = f"{HEAD}{ALONG.partition('along')[0]}{TOGETHER}[limits]\nleg_length = {{ max = {longest} }}\n"
        combined: dict[str, Any] = json_data(result_of(solve(case_from(text, "two"))))["combined"]
        return combined

    (row,) = together(40.0)["limits"]
    assert row["active"]
    high, low = (together(40.0 + step)["value"] for step in (1e-2, -1e-2))
    assert row["cost"] == pytest.approx((high - low) / 2e-2, rel=0.01)


def test_an_optimum_over_poses_has_its_evidence_and_starts_lie_in_every_poses_ball() -> None:
    solution = solve(poses_case(ALONG, "worst"))
    assert solution.evidence.kind is PointKind.STRICT_MAXIMUM
    names = {side.name for side in solution.evidence.active}
    assert {"F pose 1", "F pose 3"} & names
    assert not any(side.name == "level" for side in solution.evidence.active)
    nlp = formulate(poses_case(LISTED.replace("{ axis = [0, 1, 0], angle", "{ angle")))
    for name in ("pose1_q_x", "pose2_q_x"):
        at = [variable.name for variable in nlp.program.variables].index(name)
        sizes = np.linalg.norm(starting_points(nlp, 60, 1)[:, at : at + 3], axis=1)
        assert sizes.max() <= math.sin(math.radians(10)) + 1e-12
        assert np.median(sizes) > 0.7 * math.sin(math.radians(10))


def test_commands_and_generated_code_have_every_pose(cli: Run, tmp_path: Path) -> None:
    path = saved(tmp_path / "poses.toml", text_of(ALONG, "worst"))
    assert "worst over 3 poses" in output_of(cli("solve", str(path)))
    result = json.loads(output_of(cli("evaluate", str(path), "--json", "-")))
    assert result["F"] == pytest.approx(min(pose["F"] for pose in result["poses"]))
    output_of(cli("codegen", str(path), "--no-measure", "--out", str(tmp_path / "c")))
    manifest = json.loads((tmp_path / "c" / "manifest.json").read_text(encoding="utf-8"))
    assert "level" in [number["name"] for number in manifest["variables"]]


def test_numbers_of_each_listed_pose_can_be_set(cli: Run, tmp_path: Path) -> None:
    path = saved(tmp_path / "poses.toml", text_of(LISTED))
    words = ["--set", "pose2_p_z=33", "--set", "pose2_angle=7", "--set", "x1=11", "--set", "pose1_axis=0,1,0"]
    second = json.loads(output_of(cli("evaluate", str(path), *words, "--json", "-")))["poses"][1]["pose"]
    assert second["position"] == [3, 0, 33]
    assert second["angle"] == pytest.approx(7)
    refusal_of(cli("evaluate", str(path), "--set", "angle=7"), "angle: cannot be set", "pose1_angle")


def test_a_task_has_one_program_over_poses_and_the_worst_of_several_tasks_is_refused() -> None:
    assert len(formulate_each(poses_case(GRID))[0].program.robots) == 4
    tables = tomllib.loads(text_of(LISTED, "worst"))
    tables["task"].append({**tables["task"][0], "name": "other"})
    with pytest.raises(CaseError, match=r"combine\.over_poses = \"worst\": must be 'sum' or 'mean'"):
        case_from(tables, "two")


def hexapod_at(
    count: int, stroke: float, *, over: str = "mean", starts: int = 4, free_legs: int = 6, sense: str = "max"
) -> Case:
    """Return a hexapod of twelve irregular joints, twelve coordinates of which are free, at several random poses."""
    numbers, parameters, poses = np.random.default_rng(7), {}, []
    for i in range(6):
        for plate, radius, half in (("base", 12.0, 20), ("platform", 8.0, 45)):
            a = math.radians(120 * (i // 2) + half * (1 if i % 2 else -1))
            at = [radius * each + numbers.uniform(-0.5, 0.5) for each in (math.cos(a), math.sin(a))]
            is_free = plate == "base" and i < free_legs
            ranges = [{"min": each - 2, "max": each + 2} if is_free else each for each in at]
            parameters[f"{plate}_{i + 1}"] = [*ranges, 0]
    for _ in range(count):
        position = [*numbers.uniform(-6, 6, 2).tolist(), numbers.uniform(19, 21)]
        axis = [numbers.normal() for _ in range(3)]
        poses.append({"position": position, "rotation": {"axis": axis, "angle": numbers.uniform(0, 12)}})
    return case_of(
        {"model": "hexapod", "parameters": parameters},
        pose=poses,
        combine={"over_poses": over},
        solve={"starts": starts},
        task=[{"name": "drive", "sense": sense, "axis": [2, 2, 1], "point": [2, 3, 6], "pitch": 1}],
        limits={"actuator": {"dead_length": 6, "stroke_max": stroke}},
    )


def lengths_of(solution: Solution) -> Array:
    """Return the lengths (poses, legs), from the joints and poses of a result alone."""
    result = json_data(result_of(solution))
    base, platform = (
        np.array([result["parameters"][f"{plate}_{i}"] for i in range(1, 7)]) for plate in ("base", "platform")
    )
    rows = []
    for pose in result["poses"]:
        R, p = np.array(pose["pose"]["rotation_matrix"]), np.array(pose["pose"]["position"])
        rows.append(np.linalg.norm(p + platform @ R.T - base, axis=1))
    return np.array(rows)


@pytest.mark.parametrize("over", ["mean", "worst"])
def test_few_pairs_give_the_answer_of_all_pairs(over: str, monkeypatch: pytest.MonkeyPatch) -> None:
    case = hexapod_at(7, 4.1, over=over)
    few = solve(case)
    assert few.status is Status.OPTIMAL
    monkeypatch.setattr(program_limits, "_ALL_PAIRS", 7)
    every = solve(case)
    assert len(every.nlp.program.constraints) >= 7 * 6 * 6 * 2 > 4 * len(few.nlp.program.constraints)
    assert pytest.approx(every.F, rel=1e-9) == few.F
    np.testing.assert_allclose(few.x, every.x, atol=1e-6)
    assert few.evidence.kind is every.evidence.kind
    # The limit binds, and costs the same.
    margins = [json_data(result_of(each))["limits"] for each in (few, every)]
    rows = [next(row for row in each if row["key"] == "actuator.stroke_max") for each in margins]
    assert rows[0]["active"]
    assert rows[1]["active"]
    assert rows[0]["cost"] == pytest.approx(rows[1]["cost"], rel=1e-6)


def test_every_pair_of_25_poses_holds() -> None:
    stroke = 5.2
    solution = solve(hexapod_at(25, stroke))
    assert solution.status is Status.OPTIMAL
    lengths = lengths_of(solution)
    strokes = np.ptp(lengths, axis=0)
    assert strokes.max() == pytest.approx(stroke, abs=1e-8)
    assert (lengths.min(axis=0) - strokes).min() >= 6 - 1e-8
    # One row for the limit tells the largest stroke, and each leg has a margin, bound or not.
    result = json_data(result_of(solution))
    row = next(each for each in result["limits"] if each["key"] == "actuator.stroke_max")
    assert row["value"] == pytest.approx(strokes.max(), rel=1e-9)
    margins = [each for each in result["margins"] if each["key"] == "actuator.stroke_max"]
    for i in range(6):
        own = [each["value"] for each in margins if f"limb {i + 1} " in each["name"]]
        assert max(own) == pytest.approx(strokes[i], rel=1e-9)
    # Few of the 2 * 6 * 25 * 24 constraints were needed.
    assert len(solution.nlp.program.constraints) < 25 * 12


def test_a_point_outside_of_a_pair_that_is_no_constraint_is_judged_infeasible() -> None:
    nlp = formulate(hexapod_at(9, 3.0))
    assert not nlp.program.constraints
    assert linearise(nlp, nlp.start).violation == 0
    evidence = examine(nlp, nlp.start)
    assert evidence.feasibility > 1e-3
    assert any(name.startswith("actuator.stroke_max limb") for name in evidence.violated)
    whole = with_all_pairs(nlp)
    assert linearise(whole, nlp.start).violation >= evidence.feasibility
    limbs = [{name.partition(" poses")[0] for name in each.violated} for each in (evidence, examine(whole, nlp.start))]
    assert limbs[0] == limbs[1]


def test_an_impossible_stroke_is_relaxed_by_what_all_poses_need() -> None:
    solution = solve(hexapod_at(12, 3.0, starts=2))
    assert solution.status is Status.INFEASIBLE
    (needed,) = (each for each in solution.relaxation if each.key == "actuator.stroke_max")
    enough = solve(hexapod_at(12, needed.needed * (1 + 1e-6), starts=4))
    assert enough.status is Status.OPTIMAL
    assert solve(hexapod_at(12, needed.needed * (1 - 1e-3), starts=2)).status is Status.INFEASIBLE


def test_a_certificate_states_every_pair_and_is_proved() -> None:
    nlp = formulate(hexapod_at(5, 4.0))
    from_few, from_start = (standard_form(each) for each in (with_pairs_at(nlp, [nlp.lower]), nlp))
    assert len(from_few.conditions) == len(from_start.conditions) == 2 * 6 * 5 * 4
    assert [each.name for each in from_few.conditions] == [each.name for each in from_start.conditions]
    case = hexapod_at(5, 3.5, free_legs=1)
    certified = certify(case, gap=1e-3)
    assert certified.is_proved
    assert certified.certificate.bound >= certified.solution.F


def test_the_program_over_many_poses_stays_small() -> None:
    assert len(solve(hexapod_at(40, 5.3, starts=2)).nlp.program.constraints) <= 12 * 12


@pytest.mark.slow
def test_a_hundred_poses_are_solved() -> None:
    solution = solve(hexapod_at(100, 5.3))
    assert solution.status is Status.OPTIMAL
    assert np.ptp(lengths_of(solution), axis=0).max() <= 5.3 + 1e-8


def test_a_solve_says_which_phase_it_is_in() -> None:
    seen: list[tuple[Phase, int, int]] = []
    solve(hexapod_at(5, 1.0, starts=2), phase=lambda *row: seen.append(row))
    phases = list(dict.fromkeys(phase for phase, _, _ in seen))
    assert phases == [Phase.FORMULATING, Phase.STARTS, Phase.RELAXATION]
    assert all(0 <= done <= total for _, done, total in seen)
    assert any(done == total > 0 for phase, done, total in seen if phase is Phase.RELAXATION)
    seen.clear()
    solve(hexapod_at(5, 12.0, starts=2), phase=lambda *row: seen.append(row))
    assert [phase for phase, _, _ in seen][-1] is Phase.EVIDENCE


def test_a_worst_case_is_not_held_back_by_the_estimate_of_its_level() -> None:
    # F of random points is far below F of joints in the corners of their ranges.
    ends = {"min": -100, "max": 100}
    parameters = {f"{plate}_{i}": [ends, ends, 0] for plate in ("base", "platform") for i in range(1, 7)}
    case = case_of(
        {"model": "hexapod", "parameters": parameters},
        pose=[{"position": [0, 0, 10]}, {"position": [0, 1, 10]}],
        combine={"over_poses": "worst"},
        task=[{"sense": "max", "axis": [0, 0, 1], "point": [0, 0, 0], "pitch": 0}],
        solve={"starts": 2},
    )
    solution = solve(case)
    assert solution.status is Status.OPTIMAL
    assert "level" not in [side.name for side in solution.evidence.active]

    # The worst pose by hand, of the answer and of joints in two corners of their squares.
    def worst(base: Array, platform: Array) -> float:
        values = []
        for p in ((0, 0, 10), (0, 1, 10)):
            span = np.array(p) + platform - base
            moments = np.cross(base, span / np.linalg.norm(span, axis=1)[:, None])
            values.append(float((moments[:, 2] ** 2).sum()))
        return min(values)

    state = solution.state
    assert state is not None
    plates = [np.array([state.parameters[f"{each}_{i}"] for i in range(1, 7)]) for each in ("base", "platform")]
    assert pytest.approx(worst(*plates), rel=1e-9) == solution.F
    corner = np.tile([100.0, 100, 0], (6, 1))
    assert solution.F >= worst(corner, np.tile([100.0, -100, 0], (6, 1))) > 59_000
