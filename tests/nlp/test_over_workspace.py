"""Several tasks, several poses and the worst F over a workspace: designs held to grids of poses and of designs.

The robot is LinuxCNC's hexapod with a free radius of its base; work rates and lengths follow from the joints alone.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from builders import Array, Run, case_file, case_from, ends, refusal_of, saved, shipped_tables, turn_about
from measures import circle_joints

from screwsynth.nlp import Case, CaseError, Outcome, certify, json_data, load_case, load_result, round_design, solve
from screwsynth.nlp.results.result import result_of
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver.solution import Solution

LIFT = {"name": "lift", "sense": "max", "axis": [0, 0, 1], "pitch": math.inf}
TURN = {"name": "turn", "sense": "max", "axis": [0, 0, 1], "point": [0, 0, 0], "pitch": 0}
#: Its largest F at the stated pose is that of the widest base, and its largest worst F that of one in between.
TILT = {"name": "tilt", "sense": "max", "axis": [1, 0, 0], "point": [0, 0, 10], "pitch": 0}
TWISTS = {"lift": np.eye(6)[5], "turn": np.eye(6)[2], "tilt": np.array([1.0, 0, 0, 0, 10, 0])}
RADII = np.linspace(15, 35, 401)
#: Poses of the box, its corners among them, and stated ones.
SIDES = (-4, -2, 0, 2, 4)
POSITIONS = [np.array(each) for each in itertools.product(SIDES, SIDES, (17, 18.5, 20, 21.5, 23))]
TURNS = np.radians(np.linspace(-10, 10, 5))
HOME, HIGHER = (np.array([0.0, 0, 20]), 0.0), (np.array([1.0, 0, 22]), 0.0)
BOX = [(position, turn) for position in POSITIONS for turn in TURNS]
LEGS = {"min": 20, "max": 38}


def tables_of(tasks: Sequence[dict[str, Any]] = (LIFT,), **keys: object) -> dict[str, Any]:
    tables = shipped_tables("hexapod-linuxcnc")
    tables["robot"]["parameters"]["x1"] = {"min": 15, "max": 35}
    tables["task"] = [dict(task) for task in tasks]
    tables["limits"] = {"over": "workspace", "leg_length": LEGS}
    turn = {"axis": [0, 0, 1], "angle": ends(10)}
    tables["workspace"] = {"position": [ends(4), ends(4), ends(3, 20)], "rotation": turn}
    return tables | {"solve": {"starts": 3}} | keys


def spans(radii: Array, poses: Sequence[tuple[Array, float]]) -> tuple[Array, Array]:
    """Joints of the base (R, 1, 6, 3), and vectors along the legs (R, N, 6, 3)."""
    joints = [circle_joints({"x1": each, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)}) for each in radii]
    base, platform = np.array([each for each, _ in joints])[:, None], joints[0][1]
    tips = np.array([position + platform @ turn_about((0, 0, 1), turn).T for position, turn in poses])
    return base, tips - base


def rates_squared(radii: Array, poses: Sequence[tuple[Array, float]], task: str) -> Array:
    """F (R, N) of designs at poses."""
    base, legs = spans(radii, poses)
    units = legs / np.linalg.norm(legs, axis=3)[..., None]
    twist = TWISTS[task]
    return np.asarray(((units @ twist[3:] + np.cross(base, units) @ twist[:3]) ** 2).sum(axis=2))


def kept() -> Array:
    lengths = np.linalg.norm(spans(RADII, BOX)[1], axis=3)
    return np.asarray((lengths.min(axis=(1, 2)) >= LEGS["min"]) & (lengths.max(axis=(1, 2)) <= LEGS["max"]))


def radius_of(solution: Solution) -> float:
    return float(solution.x[[each.name for each in solution.outcomes[0].own.nlp.program.variables].index("x1")])


def proved_over_workspace(case: Case) -> Solution:
    """The solution of a case, whose proof over the workspace holds, and whose legs keep their limits on the grid."""
    solution = solve(case)
    assert solution.status.is_answer
    assert solution.workspace.is_proved
    lengths = np.linalg.norm(spans(np.array([radius_of(solution)]), BOX)[1], axis=3)
    assert LEGS["min"] <= lengths.min() <= lengths.max() <= LEGS["max"]
    return solution


def test_the_worst_f_over_a_workspace_is_the_best_of_a_grid_of_designs_and_proved() -> None:
    case = case_from(tables_of([TILT], objective={"over": "workspace"}))
    solution = proved_over_workspace(case)
    worst = rates_squared(RADII, BOX, "tilt").min(axis=1)
    best = int(np.where(kept(), worst, -np.inf).argmax())
    assert radius_of(solution) == pytest.approx(RADII[best], abs=0.3)
    assert pytest.approx(worst[best], rel=2e-3) == solution.F
    # The stated pose alone has another design, which is worse at its worst pose.
    plain = proved_over_workspace(case_from(tables_of([TILT])))
    assert radius_of(plain) > radius_of(solution) + 1
    assert np.interp(radius_of(plain), RADII, worst) < solution.F * (1 - 2e-3)
    # What is proved is below F at every pose, and near the smallest.
    rng = np.random.default_rng(0)
    inside = zip(rng.uniform([-4, -4, 17], [4, 4, 23], (5000, 3)), rng.uniform(TURNS[0], TURNS[-1], 5000), strict=True)
    least = rates_squared(np.array([radius_of(solution)]), [*inside, *BOX], "tilt").min()
    data = result_of(solution).objective  # type: ignore[union-attr]
    assert data.value is not None
    assert (data.over, data.minimise) == ("workspace", None)
    assert least * (1 - 2e-3) <= data.value <= least
    assert data.value >= solution.F * (1 - 1e-3)
    (claim,) = [each for each in solution.workspace.judgement.extremes if each.name == "F"]  # type: ignore[union-attr]
    assert claim.outcome is Outcome.PROVED
    assert claim.bound == data.value


def test_the_largest_f_over_a_workspace_is_minimised_and_bounded() -> None:
    """The bound of `certify` follows from poses of the box, and so no design of the grid is below it."""
    case = case_from(tables_of([TILT | {"sense": "min"}], objective={"over": "workspace"}))
    certified = certify(case, gap=1e-3)
    solution, certificate = certified.solution, certified.certificate
    worst = np.where(kept(), rates_squared(RADII, BOX, "tilt").max(axis=1), np.inf)
    assert pytest.approx(worst.min(), rel=5e-3) == solution.F
    assert certificate.bound <= worst.min()
    assert certificate.bound >= solution.F * (1 - 6e-3)
    again = case_from(case.to_toml())
    assert again.worst_everywhere
    assert again.to_toml() == case.to_toml()


def test_the_worst_f_of_a_point_is_f_there() -> None:
    """A box of hardly any size about the stated pose."""
    near = {"position": [0, 0, {"min": 20 - 1e-5, "max": 20 + 1e-5}]}
    one, other = (
        solve(case_from(tables_of([TILT], workspace=near, **keys)))
        for keys in ({}, {"objective": {"over": "workspace"}})
    )
    assert other.workspace.is_proved
    assert pytest.approx(one.F, rel=1e-5) == other.F
    assert radius_of(other) == pytest.approx(radius_of(one), abs=1e-3)


@pytest.mark.parametrize("method", ["weighted-sum", "worst-case"])
def test_several_tasks_are_combined_as_on_a_grid(method: str) -> None:
    weights = {"weighted-sum": (100.0, 1.0), "worst-case": (1.0, 115.0)}[method]
    tasks = [task | {"weight": weight} for task, weight in zip((LIFT, TURN), weights, strict=True)]
    solution = proved_over_workspace(case_from(tables_of(tasks, combine={"method": method})))
    F = np.array([rates_squared(RADII, [HOME], name)[:, 0] for name in ("lift", "turn")])
    scaled = 2 * np.array(weights) / sum(weights)
    value = scaled @ F if method == "weighted-sum" else (F / scaled[:, None]).min(axis=0)
    best = int(np.where(kept(), value, -np.inf).argmax())
    assert solution.combination.value == pytest.approx(value[best], rel=3e-3)
    assert radius_of(solution) == pytest.approx(RADII[best], abs=0.1)
    # Each task by itself keeps the limits over the workspace too, and so loses by the combination alone.
    for row, outcome in zip(F, solution.outcomes, strict=True):
        assert pytest.approx(row[kept()].max(), rel=3e-3) == outcome.own.F
        assert pytest.approx(np.interp(radius_of(solution), RADII, row), rel=1e-3) == outcome.F
        assert outcome.loss == pytest.approx(outcome.own.F - outcome.F)


def test_a_task_of_hardly_any_weight_changes_nothing() -> None:
    tasks = [LIFT, TURN | {"weight": 1e-9}]
    both = proved_over_workspace(case_from(tables_of(tasks, combine={"method": "weighted-sum"})))
    alone = proved_over_workspace(case_from(tables_of([LIFT])))
    assert radius_of(both) == pytest.approx(radius_of(alone), abs=1e-3)
    assert pytest.approx(alone.F, rel=1e-4) == both.outcomes[0].F
    assert both.outcomes[0].loss == pytest.approx(0, abs=1e-4)


@pytest.mark.parametrize("over_poses", ["mean", "worst"])
def test_several_stated_poses_have_limits_over_a_workspace(over_poses: str) -> None:
    poses = [{"position": position.tolist()} for position, _ in (HOME, HIGHER)]
    solution = proved_over_workspace(case_from(tables_of(pose=poses, combine={"over_poses": over_poses})))
    F = rates_squared(RADII, [HOME, HIGHER], "lift")
    value = F.mean(axis=1) if over_poses == "mean" else F.min(axis=1)
    assert pytest.approx(value[kept()].max(), rel=3e-3) == solution.F


def test_f_along_a_path_is_its_worst_too_and_tasks_are_combined_along_it(tmp_path: Path) -> None:
    text = "G20\nG94 F60\nG1 X-4 Y0 Z18\nG1 X4 Y3 Z22\nM2\n"
    path = {"file": str(saved(tmp_path / "line.ngc", text))}
    along = [(position, 0.0) for position in np.linspace((-4.0, 0, 18), (4.0, 3, 22), 41)]
    tables = tables_of([TILT], path=path, limits={"over": "path", "leg_length": {"min": 10, "max": 60}})
    worst = rates_squared(RADII, along, "tilt").min(axis=1)
    solution = solve(case_from(tables | {"objective": {"over": "path"}}))
    assert solution.path.is_proved
    assert pytest.approx(worst.max(), rel=2e-3) == solution.F
    assert "the smallest value along the path (maximised)" in solution.table()
    tasks = [LIFT | {"weight": 100}, TURN]
    both = solve(case_from(tables | {"task": tasks, "combine": {"method": "weighted-sum"}}))
    value = np.array([200, 2]) / 101 @ [rates_squared(RADII, [HOME], name)[:, 0] for name in ("lift", "turn")]
    assert both.path.is_proved
    assert both.combination.value == pytest.approx(value.max(), rel=1e-3)


def test_results_of_several_tasks_have_the_proof(tmp_path: Path) -> None:
    """A robot with loops, of which the exchange adds variables, too: pages and tables are of the design alone."""
    tables = tables_of([LIFT, TURN], combine={"method": "worst-case"}, limits={"over": "workspace"})
    sizes = {"rb": {"min": 0.7, "max": 1.5}, "rp": {"min": 0.4, "max": 1.0}, "h": 1.1}
    tables["robot"] = {"model": "3-rps", "parameters": sizes}
    tables["pose"] = {"position": [ends(0.2), ends(0.2), 1.1], "rotation": {"axis": [1, 0, 0], "angle": 0}}
    tables["task"] = [TILT | {"point": [0, 0, 1]}, TILT | {"axis": [0, 1, 0], "point": [0, 0, 1.1], "name": "other"}]
    tables["limits"]["actuator_length"] = ends(0.2)
    rotation = {"roll": ends(10), "pitch": ends(10), "yaw": ends(5)}
    tables["workspace"] = {"position": [ends(0.2), ends(0.2), ends(0.1, 1.1)], "rotation": rotation}
    solution = solve(case_from(tables | {"units": {"length": "m"}, "solve": {"starts": 1}}))
    shown, written = solution.table(), solution.to_dict()
    assert "proved: no singularity and no violated limit at any pose" in shown
    assert "poses that were added as constraints" in shown
    jsonschema.validate(written, result_schema())
    assert json_data(load_result(saved(tmp_path / "out.json", json.dumps(written)))) == written
    assert written["workspace"]["poses"]  # type: ignore[index, call-overload]
    assert 'id="workspace-limits"' in solution.report()


def test_what_cannot_be_combined_over_a_workspace_is_refused(cli: Run, tmp_path: Path) -> None:
    worst = {"objective": {"over": "workspace"}}
    poses = [{"position": [0, 0, 20]}, {"position": [0, 0, 21]}]
    both = {"combine": {"method": "weighted-sum"}}
    average = "combine.method = \"average\": must be 'weighted-sum' or 'worst-case' with limits"
    for keys, words in [
        (tables_of([LIFT, TURN]), average),
        (tables_of([LIFT, TURN], **both, **worst), 'objective.over = "workspace": needs exactly one [[task]], got 2'),
        (tables_of(limits={}, **worst), 'objective.over = "workspace": needs limits over the same poses'),
        (tables_of(objective={"over": "path"}), 'objective.over = "path": needs limits over the same poses'),
        (tables_of(objective={}), "objective.minimise: is missing: give minimise, over, or both"),
        (tables_of(pose=poses, **worst), "combine.over_poses = \"sum\": must be 'worst' together with objective.over"),
    ]:
        refusal_of(cli("solve", str(case_file(tmp_path, keys))), words)
    path = {"file": "path.csv", "place": {"x": {"min": -1, "max": 1}}}
    along = tables_of([LIFT, TURN], limits={"over": "path"}, path=path, **both)
    with pytest.raises(CaseError, match=r"path\.place: must be fixed if several tasks are combined"):
        solve(case_from(along))
    # A bound from poses of the workspace has no proof file.
    over = str(case_file(tmp_path, tables_of([TILT], **worst)))
    refusal_of(cli("certify", over, "--proof", str(tmp_path / "x.proof")), "proof")
    assert load_case(over).at_stated_poses().worst_everywhere is False


def test_listed_and_round_numbers_are_chosen_and_bounded_by_the_worst_f_over_a_workspace() -> None:
    """The bound is of the largest F along a line, and not of that at the stated pose alone."""
    line = [(np.array([0.0, 0, z]), 0.0) for z in np.linspace(17, 23, 61)]
    worst = rates_squared(RADII, line, "tilt").max(axis=1)
    tables = tables_of([TILT | {"sense": "min"}], objective={"over": "workspace"})
    tables["workspace"] = {"position": [0, 0, {"min": 17, "max": 23}]}
    tables["robot"]["parameters"]["x1"] = {"values": [23, 25, 27]}
    certified = certify(case_from(tables), gap=1e-3)
    assert certified.is_proved
    assert pytest.approx(np.interp([23, 25, 27], RADII, worst).min(), rel=2e-3) == certified.solution.F
    tables["robot"]["parameters"]["x1"] = {"min": 22.5, "max": 27}
    certified = certify(round_design(solve(case_from(tables)), 2), gap=1e-3)
    assert certified.is_proved
    assert pytest.approx(np.interp([24, 26], RADII, worst).min(), rel=2e-3) == certified.solution.F
