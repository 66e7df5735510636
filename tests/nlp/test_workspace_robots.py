"""Robots that are not six straight legs over a workspace: slices, limits, designs, and one rule for refutations."""

import itertools
import json
import math
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import EACH_KIND, PUSH_UP, Run, case_file, case_of, ends, soaked
from hexapods import hexapod_text
from numpy.typing import NDArray
from path_cases import delta_angles
from workspace_cases import box_of, on_paper, problem_of, root_of

from screwsynth.models import Dimension, FloatArray
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import (
    Case,
    Judgement,
    Outcome,
    RobotState,
    Solution,
    build_model,
    formulate,
    judge_workspace,
    load_case,
)
from screwsynth.nlp.case.pose import Rotation
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.evidence import state
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.front.data import front_designs, front_result
from screwsynth.nlp.front.front import pareto
from screwsynth.nlp.interruption import within
from screwsynth.nlp.proof.checker.proof_file import ProofError
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.checker.workspace.closed_loops import start_of
from screwsynth.nlp.proof.checker.workspace.motion_matrix import PosedRobot, motion_matrix
from screwsynth.nlp.proof.statement.posed_layout import at_one_pose
from screwsynth.nlp.proof.workspace.home_poses import Homes
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank, prove_ranks
from screwsynth.nlp.proof.workspace.ranks.singular_pose import SingularSearch
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseNumbers
from screwsynth.nlp.proof.workspace.robot.posed_robot import NotJudgedError
from screwsynth.nlp.proof.workspace.slices.slice_limits import KEPT, UNDECIDED
from screwsynth.nlp.proof.workspace.slices.slices import Region, Slice, slices_of
from screwsynth.nlp.solver.solve import solve

NOTICE = "the limits are evaluated only at the stated pose, not over the workspace"


def delta(arm: float, rod: object, **limits: object) -> Case:
    """A Delta that moves in a plane."""
    robot = {"rb": 0.164, "rp": 0.044, "arm": arm, "rod": rod, "w": 0.131, "tilt": 20}
    given = {"units": {"length": "m"}, "pose": {"position": [0, 0, -0.9]}, "task": [PUSH_UP], "solve": {"starts": 1}}
    place = {"position": [ends(0.25), 0, ends(0.1, -0.9)]}
    limits |= {"actuator_angle": ends(60)}
    return case_of({"model": "delta", "parameters": robot}, **given, limits=limits, workspace=place)


def tripod_case(rb: object = 1.0, rp: object = 0.6, height: object = 1.1, **tables: Any) -> Case:  # noqa: ANN401
    """A 3-RPS whose position, roll, pitch and yaw are within ranges about home."""
    limits = {"actuator_length": ends(0.2)} | tables.pop("limits", {})
    given = {"units": {"length": "m"}, "solve": {"starts": 1}, "limits": limits}
    given["pose"] = {"position": [ends(0.2), ends(0.2), 1.1], "rotation": {"axis": [1, 0, 0], "angle": 0}}
    given["task"] = [{"sense": "max", "axis": [0, 1, 0], "point": [0, 0, 1.1], "pitch": 0}]
    turns = {"roll": ends(10), "pitch": ends(10), "yaw": ends(5)}
    given["workspace"] = {"position": [ends(0.2), ends(0.2), height], "rotation": turns}
    return case_of({"model": "3-rps", "parameters": {"rb": rb, "rp": rp, "h": 1.1}}, **given | tables)


#: Free dimensions of it, and a range of heights.
FREE = {"rb": {"min": 0.7, "max": 1.5}, "rp": {"min": 0.4, "max": 1.0}, "height": {"min": 1.0, "max": 1.2}}
OVER = {"over": "workspace"}


@cache
def exact_design() -> Solution:
    return solve(tripod_case(**FREE, limits=OVER))


def number(case: Case, name: str) -> float:
    (value,) = case.components(name)
    assert isinstance(value, float)
    return value


def arms(case: Case, p: FloatArray) -> FloatArray:
    """Angles (N, 3) of a Delta's arms away from home at positions (N, 3), in home's branch; NaN out of reach."""
    return delta_angles(p, *(number(case, name) for name in ("rb", "rp", "arm", "rod")))


def tripod(case: Case, roll: FloatArray, pitch: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lengths (N, 3) of the legs of a 3-RPS away from home, and its yaw (N,), which follows from roll and pitch.

    Joints of the platform stay in the planes through the axes of the base at 0, 120 and 240 degrees.
    """
    rb, rp = number(case, "rb"), number(case, "rp")
    one, zero = np.ones_like(roll), np.zeros_like(roll)
    about_x = np.array([[one, zero, zero], [zero, np.cos(roll), -np.sin(roll)], [zero, np.sin(roll), np.cos(roll)]])
    about_y = np.array([[np.cos(pitch), zero, np.sin(pitch)], [zero, one, zero], [-np.sin(pitch), zero, np.cos(pitch)]])
    M = np.einsum("ijn,jkn->nik", about_y, about_x)
    yaw = np.arctan2(M[:, 0, 1] - M[:, 1, 0], M[:, 0, 0] + M[:, 1, 1])
    c, s = np.cos(yaw), np.sin(yaw)
    about_z = np.array([[c, -s, zero], [s, c, zero], [zero, zero, one]]).transpose(2, 0, 1)
    R = about_z @ M
    p = np.stack([rp / 2 * (R[:, 0, 0] - R[:, 1, 1]), -rp * R[:, 1, 0], z], axis=1)
    lengths = []
    for azimuth in (0, 2 * math.pi / 3, 4 * math.pi / 3):
        out = np.array([math.cos(azimuth), math.sin(azimuth), 0])
        lengths.append(np.linalg.norm(p + R @ (rp * out) - rb * out, axis=1))
    return np.stack(lengths, axis=1) - math.hypot(rb - rp, 1.1), yaw


def drawn(each: Slice, rng: np.random.Generator) -> tuple[FloatArray, NDArray[np.int16], list[Region]]:
    """A random point (B, 2) of each box, the limit there, and the region."""
    points = each.boxes[:, :2] + rng.uniform(size=(len(each.boxes), 2)) * (each.boxes[:, 2:] - each.boxes[:, :2])
    return points, each.binding, list(each.regions)


def assert_beyond(found: Slice, limit: NDArray[np.int16], values: FloatArray) -> None:
    """Where a limit on actuators is violated at points, a number of theirs is beyond it."""
    for k, each in enumerate(found.limits):
        if each.key.startswith("workspace."):
            continue
        own = values[limit == k]
        beyond = own > each.limit if each.key.endswith("max") else own < each.limit
        assert len(own) > 20
        assert beyond.any(axis=1).all()


def test_a_design_of_a_delta_is_exchanged_until_it_is_proved() -> None:
    solution = solve(delta(0.25, {"min": 0.7, "max": 1.3}, **OVER))
    proof = solution.workspace
    assert proof.is_proved
    assert len(proof.history) > 1
    names = {each.name for each in proof.poses}
    assert any(name.startswith("reach limb ") for name in names)
    rng = np.random.default_rng(0)
    poses = rng.uniform((-0.25, 0, -1.0), (0.25, 0, -0.8), (100_000, 3))
    poses[:4] = list(itertools.product((-0.25, 0.25), (0,), (-1.0, -0.8)))
    angles = arms(proof.judgement.case, poses)
    assert np.isfinite(angles).all()
    assert np.abs(angles).max() < math.radians(60)
    # The design that is best at the stated pose has a larger F, and does not reach all poses.
    alone = arms(proof.first.case, poses)
    assert not (np.abs(alone) <= math.radians(60)).all()
    assert proof.history[0][0] > solution.F


@pytest.mark.slow
def test_a_design_of_a_robot_with_loops_is_exchanged_until_it_is_proved() -> None:
    proof = exact_design().workspace
    assert proof.is_proved
    assert proof.first.is_regular
    assert len(proof.poses) >= 1
    rng = np.random.default_rng(0)
    roll, pitch = rng.uniform(-math.radians(10), math.radians(10), (2, 100_000))
    z = rng.uniform(1.0, 1.2, 100_000)
    lengths, yaw = tripod(proof.judgement.case, roll, pitch, z)
    assert np.abs(yaw).max() < math.radians(5)
    assert np.abs(lengths).max() < 0.2
    assert np.abs(tripod(proof.first.case, roll, pitch, z)[0]).max() > 0.25
    # Nothing is given away: the worst pose is near its limit.
    assert np.abs(lengths).max() > 0.19


def test_slices_of_a_delta_hold_at_every_point() -> None:
    case = delta(0.22, 0.94)
    (found,) = slices_of(case)
    assert found.names == ("p_x", "p_z")
    assert {each.key for each in found.limits} == {"actuator_angle.min", "actuator_angle.max"}
    points, limit, regions = drawn(found, np.random.default_rng(1))
    angles = arms(case, np.stack([points[:, 0], np.zeros(len(points)), points[:, 1]], axis=1))
    reached = np.isfinite(angles).all(axis=1)
    kept = reached & (np.abs(angles) <= math.radians(60)).all(axis=1)
    is_regular = np.array([region is Region.REGULAR for region in regions])
    is_unreached = np.array([region is Region.UNREACHED for region in regions])
    assert kept[is_regular & (limit == KEPT)].all()
    assert not reached[is_unreached].any()
    assert_beyond(found, limit, angles)
    # What is undecided lies along curves.
    size = np.prod(found.boxes[:, 2:] - found.boxes[:, :2], axis=1)
    assert size[limit == UNDECIDED][~is_unreached[limit == UNDECIDED]].sum() < 0.1 * size.sum()
    assert is_unreached.any()


@pytest.mark.slow
def test_slices_and_limits_of_a_robot_with_loops_hold_at_every_point() -> None:
    case = tripod_case()
    (found,) = slices_of(case)
    assert found.names == ("roll", "pitch")
    points, limit, regions = drawn(found, np.random.default_rng(1))
    lengths, _ = tripod(case, points[:, 0], points[:, 1], np.full(len(points), 1.1))
    is_regular = np.array([region is Region.REGULAR for region in regions])
    assert (np.abs(lengths) <= 0.2)[is_regular & (limit == KEPT)].all()
    # Boxes that touch are of one assembly.
    size = np.prod(found.boxes[:, 2:] - found.boxes[:, :2], axis=1)
    assert size[[region is Region.REGULAR for region in found.regions]].sum() > 0.9 * size.sum()
    assert_beyond(found, limit, lengths)
    judged = judge_workspace(case, with_objective=False)
    assert judged.is_proved
    largest = max(abs(each.bound) for each in judged.extremes if each.limit is not None)
    rng = np.random.default_rng(0)
    roll, pitch = rng.uniform(-math.radians(10), math.radians(10), (2, 10_000))
    assert np.abs(tripod(case, roll, pitch, np.full(10_000, 1.1))[0]).max() < largest <= 0.2 * (1 + 1e-9)
    tight = tripod_case(limits={"actuator_length": {"min": -0.08, "max": 0.2}})
    refuted = [each for each in judge_workspace(tight, with_objective=False).extremes if each.limit is not None]
    assert {each.outcome for each in refuted if each.limit == -0.08} == {Outcome.REFUTED}
    worst = tripod(case, roll, pitch, np.full(10_000, 1.1))[0].min()
    assert min(each.reached for each in refuted) <= worst


def test_a_slice_is_drawn_where_no_loops_close_at_its_ends() -> None:
    """The legs reach no further than the sum of their lengths, and the slice is wider than the workspace."""
    lengths = {item.name: item.typical[0] for item in build_model("planar-3-rrr").parameters}
    half, task = ends(sum(lengths.values())), PUSH_UP | {"point": [0, 0, 0], "pitch": 0.1}
    robot, place = {"model": "planar-3-rrr", "parameters": lengths}, {"position": [half, half, 0]}
    (found,) = slices_of(case_of(robot, pose={"position": [0, 0, 0]}, task=[task], workspace=place))
    assert {Region.UNKNOWN} <= set(found.regions)


def test_slices_need_two_numbers_that_the_robot_can_choose() -> None:
    turns = {"pitch": ends(10), "yaw": ends(5)}
    case = tripod_case(workspace={"position": [ends(0.2), ends(0.2), 1.1], "rotation": turns})
    with pytest.raises(CaseError, match="two independent coordinates of the pose"):
        slices_of(case)


def test_a_design_of_three_legs_keeps_its_strokes_over_the_workspace() -> None:
    robot = {"model": "three-upu", "axes": "tsai", "characteristic_length": 1}
    robot["parameters"] = {"base_radius": {"min": 30, "max": 60}, "platform_radius": 25}
    task = {"sense": "max", "axis": [0, 1, 2], "point": [0, 0, 50], "pitch": 2}
    given = {"pose": {"position": [0, 0, 50]}, "workspace": {"position": [0, 0, ends(3, 50)]}}
    case = case_of(robot, **given, task=[task], limits=OVER | {"actuator": {"stroke_max": 5.5}})
    proof = solve(case).workspace
    assert proof.is_proved
    # Without rotation the platform's joints stay above those of the base by the difference of the radii.
    stroke = np.diff(np.hypot(number(proof.judgement.case, "base_radius") - 25, [47, 53]))[0]
    assert 5.5 * (1 - 3e-3) < stroke < 5.5


@pytest.mark.slow
def test_a_design_of_a_robot_with_loops_is_proved_for_every_machine_within_a_tolerance() -> None:
    proof = solve(tripod_case(**FREE, limits=OVER, tolerance={"joint_centre": 0.0005})).workspace
    exact = exact_design().workspace
    assert proof.is_proved
    errors = [each.errors for each in proof.poses if each.errors is not None]
    assert errors
    assert max(float(np.linalg.norm(each, axis=1).max()) for each in errors) == pytest.approx(0.0005)
    # The worst machine is near the limit, and the exact design keeps room for it.
    reached = [abs(each.reached) for each in proof.judgement.extremes if each.limit is not None]
    assert 0.2 * (1 - 3e-3) < max(reached) <= 0.2
    rng = np.random.default_rng(0)
    roll, pitch = rng.uniform(-math.radians(10), math.radians(10), (2, 100_000))
    z = rng.uniform(1.0, 1.2, 100_000)
    longest, exactly = (np.abs(tripod(each.judgement.case, roll, pitch, z)[0]).max() for each in (proof, exact))
    assert longest < exactly


def test_a_front_and_a_compiled_sweep_say_that_limits_hold_at_the_stated_pose(cli: Run, tmp_path: Path) -> None:
    tables = tomllib.loads(hexapod_text(4, 9)) | {"workspace": {"position": [0, 0, ends(1, 20)]}}
    tables["robot"]["parameters"] |= {"x1": {"min": 20, "max": 32}, "x2": 11}
    tables["task"] = [{"sense": "max", "axis": [1, 2, 6], "point": [3, 1, 12], "pitch": 0.1}]
    path = case_file(tmp_path, tables | {"limits": OVER | {"footprint": {"base": 28}}})
    front = pareto(load_case(str(path)), ["max F", "min limits.footprint.base"], points=2, starts=1)
    assert front_result(front).notice == NOTICE
    assert NOTICE in [line.text for line in front_designs(front, front_result(front)).before]
    table, data = tmp_path / "sweep.csv", tmp_path / "sweep.json"
    options = ("--over", "task.pitch=0.1,0.2", "--starts", "1", "--engine", "compiled", "--out", str(table))
    code, out, err = cli("sweep", str(path), *options, "--json", str(data))
    assert code == 0
    assert NOTICE in out + err
    result = json.loads(data.read_text(encoding="utf-8"))
    assert result["notice"] == NOTICE
    assert result["notes"] == [NOTICE, NOTICE]


#: Robots whose platform does not turn.
TRANSLATIONS = ("3-puu", "3-upu", "delta", "delta-parallelogram", "orthoglide", "tripteron")


def size_of(name: str) -> float:
    model = build_model(name)
    return max(abs(each) for each in (*model.home, *(item.typical[0] for item in model.parameters)))


def case_over(
    name: str,
    position: list[Any],
    rotation: dict[str, Any] | None = None,
    limit: float = 0.0,
    spread: float = 0.0,
    seed: int = 0,
) -> Case:
    """A robot of the gallery over a workspace, with dimensions off by a part, and a limit on its actuators.

    The limit is in parts of the robot's size for slides, and 100 degrees times as much for cranks.
    """
    model, rng = build_model(name), np.random.default_rng(seed)
    parameters, (quantity, *_) = {}, model.quantities
    for item in model.parameters:
        value = item.typical[0] * (1 + rng.uniform(-spread, spread))
        parameters[item.name] = math.degrees(value) if item.dimension is Dimension.ANGLE else value
    most = 100 * limit if quantity.dimension is Dimension.ANGLE else limit * size_of(name)
    workspace = {"position": position} | ({"rotation": rotation} if rotation else {})
    return case_of(
        {"model": name, "parameters": parameters}, units={"length": "m"}, pose={"position": list(model.home)},
        task=[PUSH_UP | {"name": "lift"}], limits={quantity.name: ends(most)} if limit else None, workspace=workspace,
    )  # fmt: skip


def tilts(half: float) -> dict[str, Any]:
    return {name: ends(half) for name in ("roll", "pitch", "yaw")}


def about_home(name: str, part: float, degrees: float, limit: float = 0.0) -> Case:
    position = [ends(part * size_of(name), each) for each in build_model(name).home]
    return case_over(name, position, None if name in TRANSLATIONS else tilts(degrees), limit)


def shown(case: Case, pose: PoseNumbers) -> tuple[RobotState, int]:
    """The robot and its freedoms as the command that is printed shows them, its loops closed from home."""
    x, y, z = pose.axis.tolist()
    one = at_one_pose(case, tuple(pose.position.tolist()), Rotation((x, y, z), pose.angle))
    nlp = formulate(one)
    point = closed_start(nlp)
    assert state.loops_are_closed(nlp, point)
    found = state.evaluate(nlp, point)
    mobility = mobility_of(nlp, point, found)
    return found, 6 if mobility is None else mobility.freedoms


def check_shown(case: Case, judged: Judgement) -> int:
    """Check what refutes by what ``evaluate`` shows there; return the number of refutations."""
    count = 0
    for rank, is_of_constraints in zip(judged.ranks, (False, True), strict=False):
        if rank.outcome is Outcome.REFUTED and rank.pose is not None:
            found, freedoms = shown(case, rank.pose)
            assert freedoms > 6 - case.model.generic.constraints if is_of_constraints else found.is_singular
            count += 1
    for each in judged.extremes:
        name, _, limb = each.name.partition(" limb ")
        if each.outcome is not Outcome.REFUTED or each.key == "reach":
            continue
        assert each.pose is not None
        if each.key.startswith("workspace."):
            continue
        (quantity,) = (item for item in case.model.quantities if item.name == name)
        value = shown(case, each.pose)[0].quantities[name][quantity.owners.index(limb)]
        assert math.isclose(value, each.reached, rel_tol=1e-6, abs_tol=1e-9)
        count += 1
    return count


def verdicts(judged: Judgement) -> list[tuple[str, str, Outcome]]:
    ranks = [(f"rank {k}", "", each.outcome) for k, each in enumerate(judged.ranks)]
    return [*ranks, *((each.name, each.sense.value, each.outcome) for each in judged.extremes)]


def check_agreement(name: str, part: float, degrees: float, limit: float) -> int:
    """Check that verdicts are the same with a proof on paper and without, and refutations those that are shown."""
    case = about_home(name, part, degrees, limit)
    judged = judge_workspace(case, with_objective=False, jobs=1)
    again, _ = on_paper(case, with_objective=False, jobs=1)
    assert verdicts(judged) == verdicts(again)
    assert {each.outcome for each in judged.extremes if each.limit} <= {Outcome.PROVED, Outcome.REFUTED}
    count = check_shown(case, judged)
    assert check_shown(case, again) == count
    return count


@pytest.mark.parametrize("name", soaked(["3-prs", *EACH_KIND], ["3-prs"]))
def test_limits_are_judged_alike_with_a_proof_and_without(name: str) -> None:
    count, sides = check_agreement(name, 0.02, 5, 0.01), 2 * len(build_model(name).quantities[0].owners)
    assert count == sides if name in ("3-prs", "five-bar") else count >= sides


def test_limits_that_only_another_assembly_passes_are_proved_and_not_refuted() -> None:
    """The arms of a five-bar linkage by the law of cosines, elbows outside; one inside is beyond the limit."""
    case = about_home("five-bar", 0.02, 5, 0.4)
    judged, proof = on_paper(case, with_objective=False, jobs=1)
    limits = [each for each in judged.extremes if each.limit is not None and not each.key.startswith("workspace.")]
    assert [each.outcome for each in limits] == [Outcome.PROVED] * 4
    box = box_of(case)
    base, link, reach = 0.3, 0.25, 0.4
    points = np.vstack([[0, reach], np.random.default_rng(0).uniform(box.lower[:2], box.upper[:2], (20_000, 2))])
    for limb, side in (("1", -1.0), ("2", 1.0)):
        x, y = points[:, 0] - side * base / 2, points[:, 1]
        angles = np.arctan2(y, x) - side * np.arccos(np.hypot(x, y) / (2 * link))
        angles = angles[1:] - angles[0]
        own = [each for each in limits if each.name == f"actuator_angle limb {limb}"]
        low, high = (next(each for each in own if each.sense.value == sense) for sense in ("min", "max"))
        assert low.bound <= angles.min() < angles.max() <= high.bound
        assert low.reached <= angles.min() + 1e-3
        assert high.reached >= angles.max() - 1e-3
    # A bound over all assemblies is not within the limit; the proof follows the loops in that of home.
    assert not [each for each in proof.unproved if each.name.startswith("actuator_angle")]
    checked = {each.name for each in check_workspace_proof(proof, case).claims}
    assert checked >= {"regular", "yaw", "actuator_angle limb 1", "actuator_angle limb 2"}


def planar(part: float, degrees: float, seed: int) -> Case:
    """A planar 3-RRR in its plane, with dimensions off by up to 5 %."""
    away, turns = ends(part * size_of("planar-3-rrr")), {"axis": [0, 0, 1], "angle": ends(degrees)}
    return case_over("planar-3-rrr", [away, away, 0.0], turns, 0.0, 0.05, seed)


def test_a_singular_pose_of_another_working_mode_refutes_nothing() -> None:
    case = planar(0.44809968, 21.472688, 9)
    box = box_of(case)
    problem, homes = problem_of(case), Homes(case, box, (), None)
    # Newton's method alone finds a pose that is singular with an arm bent the other way.
    other = prove_rank(problem, problem.locked, most_boxes=4000)
    assert other.outcome is Outcome.REFUTED
    assert not shown(case, other.pose)[0].is_singular
    assert not homes.is_singular(box.coordinates(other.pose), None, constraints=False)
    search = SingularSearch(problem, problem.locked, lambda at: homes.is_singular(at.y, at.errors, constraints=False))
    found = prove_rank(problem, problem.locked, most_boxes=4000, look=search.look)
    assert found.outcome is Outcome.REFUTED
    assert shown(case, found.pose)[0].is_singular


def test_ranks_are_refuted_by_what_is_shown_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    case = planar(0.13426, 19.47242, 3)
    problem, homes = problem_of(case), Homes(case, box_of(case), (), None)
    found = prove_ranks(problem, homes.is_singular)
    judged = Judgement(case, case.workspace, found)
    assert check_shown(case, judged) == 1
    assert [
        homes.is_singular(box_of(case).coordinates(found[0].pose), None, constraints=each) for each in (False, True)
    ] == [True, False]
    monkeypatch.setattr(Homes, "is_singular", lambda *_, **__: False)
    with within(0.2):
        assert prove_ranks(problem, homes.is_singular)[0].outcome is Outcome.OPEN


@pytest.mark.parametrize(
    ("name", "away", "seed"),
    [("delta", (0.0, 0.0, 0.0), 1), ("delta", (0.0, 0.0, 0.0), 2), ("delta", (0.03, 0.01, -0.02), 3),
     ("delta", (0.1, -0.05, 0.1), 4), ("tripteron", (0.1, -0.05, 0.1), 5), ("3-puu", (0.0, 0.03, -0.03), 6)],
)  # fmt: skip
def test_proofs_about_robots_that_do_not_turn_are_accepted(name: str, away: tuple[float, ...], seed: int) -> None:
    """Dimensions are off by up to 3 %, positions about a point away from home."""
    size, home = size_of(name), build_model(name).home
    middle = [each + part * size for each, part in zip(home, away, strict=True)]
    case = case_over(name, [ends(0.02 * size, each) for each in middle], spread=0.03, seed=seed)
    judged, proof = on_paper(case, with_limits=False, with_objective=False, jobs=1)
    assert judged.is_regular
    assert [each.name for each in check_workspace_proof(proof, case).claims] == ["regular", "constraints regular"]


def test_a_proof_over_a_narrow_range_of_poses_is_accepted() -> None:
    """The yaw of a 3-RPS follows from the rest, and is not within the narrow range stated: the claim is about more."""
    size = size_of("3-rps")
    position = [ends(0.1 * size), ends(0.1 * size), {"min": 1.13, "max": 1.13 + 2e-6 * size}]
    turns = {"roll": ends(1e-4, 0.0501), "pitch": ends(1e-4, -1.1499), "yaw": ends(1e-4, 0.3001)}
    case = case_over("3-rps", position, turns, spread=0.03)
    judged, proof = on_paper(case, with_limits=False, with_objective=False, jobs=1)
    assert judged.is_regular
    assert len(check_workspace_proof(proof, case).claims) == 2


def test_a_proof_of_loops_that_are_closed_box_by_box_is_accepted() -> None:
    case = about_home("3-rps", 0.1, 20)
    judged, proof = on_paper(case, with_limits=False, with_objective=False, jobs=1)
    assert judged.ranks[0].boxes > 10
    assert len(check_workspace_proof(proof, case).claims) == 2


@pytest.mark.parametrize(("name", "arm"), [("3-rps", 0.0), ("tricept", 1.0)])
def test_freedoms_in_the_check_are_those_that_are_known(name: str, arm: float) -> None:
    """At home the platform rises, and turns about horizontal lines: through its origin, or an arm below it."""
    case = about_home(name, 0.05, 10)
    robot = PosedRobot(case, case.model, root_of(case))
    start = start_of(robot)
    matrix, freedoms = motion_matrix(robot, start, is_locked=False)
    motions = np.linalg.svd(robot.at(matrix, start))[2][-freedoms:, :6]
    # Velocities of the origin, then rotations times the length.
    turn = robot.length
    known = np.array([[0, 0, 1, 0, 0, 0], [0, -arm, 0, turn, 0, 0], [arm, 0, 0, 0, turn, 0]])
    assert np.linalg.matrix_rank(motions) == 3
    assert motions == pytest.approx(motions @ np.linalg.pinv(known) @ known, abs=1e-9)


def test_the_check_begins_in_the_working_mode_of_home() -> None:
    """Far from home the loops of a 4-RUU close with a limb bent the other way alone."""
    size = size_of("4-ruu")
    tried = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        middle = np.array(build_model("4-ruu").home) + rng.uniform(-0.5, 0.5, 3) * size
        case = case_over("4-ruu", [ends(0.01 * size, each) for each in middle.tolist()], tilts(1))
        robot = PosedRobot(case, closed_form(case.model).model, root_of(case))
        try:
            problem_of(case)
        except NotJudgedError:
            with pytest.raises(ProofError, match="in the home assembly mode"):
                start_of(robot)
            tried += 1
        else:
            start_of(robot)
    assert 0 < tried < 6
