"""Workspaces: a robot judged over a whole box of poses."""

import itertools
import json
import math
import tomllib
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import casadi as ca
import jsonschema
import numpy as np
import pytest
from builders import Run, case_from, edited, ends, output_of, refusal_of, saved, soaked, starter_text
from hexapods import (
    HEXAPOD,
    bounds_of,
    case_of_legs,
    clearance,
    hexapod_text,
    random_legs,
    random_workspace,
    singular_part,
    smallest,
    subject_of,
    values_of,
)
from workspace_cases import exact_rows, turned

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, CaseError, Free, Limits, json_data, load_case, load_result, result_of, solve
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.proof.enclosure.forms import Encloser
from screwsynth.nlp.proof.statement.fixed_robot import Legs, legs_of
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.numbers.bound_search import Goal, Number
from screwsynth.nlp.proof.workspace.numbers.jacobian_numbers import WorstError
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseBox, pose_box, scaled
from screwsynth.nlp.proof.workspace.robot.posed_robot import build_problem
from screwsynth.nlp.proof.workspace.scale import largest_scale
from screwsynth.nlp.proof.workspace.slices.slices import Region, slices_of
from screwsynth.nlp.proof.workspace.verdict import Outcome, Verdict
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.results.workspace import WorkspaceResult

#: The machine of LinuxCNC's hexapod kinematics; see cases/hexapod-machining.toml.
TEXT = (
    hexapod_text(0, 5)
    + """[limits]
leg_length = { min = 17, max = 44 }
actuator = { stroke_max = 30 }
platform_joint_angle = { max = 60, about = "home" }
home = { position = [0, 0, 20] }
[workspace]
position = [{ min = -5, max = 5 }, { min = -5, max = 5 }, { min = 15, max = 25 }]
rotation = { angle = { min = -20, max = 20 } }
"""
)


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return saved(tmp_path_factory.mktemp("workspace") / "machine.toml", TEXT)


@pytest.fixture(scope="module")
def case(machine: Path) -> Case:
    return load_case(str(machine))


def regular(robot: Legs, box: PoseBox, *, most_boxes: int) -> Verdict:
    problem = build_problem(case_of_legs(robot), HEXAPOD, box)
    return prove_rank(problem, problem.locked, most_boxes=most_boxes)


def determinants(robot: Legs, box: PoseBox, points: FloatArray) -> FloatArray:
    """Determinants of the legs' vectors and moments at points (K, 6), from rotation matrices."""
    span = spans(robot, box, points)
    arm = span - points[:, None, :3] + robot.base
    return np.linalg.det(np.concatenate([span, np.cross(arm, span)], axis=2))


@pytest.mark.parametrize(
    ("kind", "degrees", "outcome", "most"),
    [
        (TurnKind.ANY_AXIS, 20, Outcome.PROVED, 3919),
        (TurnKind.ANY_AXIS, 25, Outcome.PROVED, 10071),
        (TurnKind.ANY_AXIS, 30, Outcome.PROVED, 10071),
        (TurnKind.ANY_AXIS, 40, Outcome.REFUTED, 20000),
        (TurnKind.ROLL_PITCH_YAW, 30, Outcome.REFUTED, 20000),
    ],
)
def test_the_machine_is_regular_up_to_an_angle(
    case: Case, kind: TurnKind, degrees: float, outcome: Outcome, most: int
) -> None:
    box = pose_box(turned(kind, degrees))
    found = judge_workspace(case, workspace=turned(kind, degrees), with_limits=False).regularity
    assert found.outcome is outcome
    assert found.boxes <= most
    if outcome is Outcome.REFUTED:
        # Confirmed by rotation matrices and a singular value decomposition, which the search does not use.
        positive, negative = determinants(legs_of(case), box, found.sides)
        assert positive * negative < 0
        assert all(box.holds(y) for y in found.sides)
        assert singular_part(legs_of(case), found.pose) < 1e-10


@pytest.mark.parametrize("kind", list(TurnKind))
def test_expansions_enclose_exact_rows_and_a_wrong_one_does_not(case: Case, kind: TurnKind) -> None:
    rng = np.random.default_rng(7)
    box, robot = pose_box(turned(kind, 50)), legs_of(case)
    centre = box.random(40, rng)
    half = (box.upper - box.lower) * rng.uniform(0, 0.2, (40, 1))
    lower, upper = centre - half, centre + half
    problem = subject_of(robot, box).problem
    c, a, r = Encloser(problem.z, ca.vec(ca.densify(problem.posed.scaled.rows).T)).second(lower.T, upper.T)
    units = np.array([1.0, 1.0, 1.0, *[problem.length] * 3])
    middle, rest = (each.reshape(-1, 6, 6) * units for each in (c, r))
    slopes = a.reshape(40, 6, 6, -1) * units[:, None]
    wrong, unrounded = 0, 0
    for k in range(40):
        c = 0.5 * lower[k] + 0.5 * upper[k]
        h = np.maximum(upper[k] - c, c - lower[k]) * (1 + 2.0**-51) + 1e-300
        e = np.where(rng.uniform(size=6) < 0.5, np.sign(rng.normal(size=6)), rng.uniform(-1, 1, 6)) * (1 - 1e-9)
        y = [Fraction(float(a)) + Fraction(float(b)) * Fraction(float(s)) for a, b, s in zip(c, h, e, strict=True)]
        exactly = np.array(exact_rows(robot, kind, box.axis, y), dtype=object)
        value = np.vectorize(Fraction)(middle[k])
        pairs = itertools.combinations_with_replacement(range(6), 2)
        squares = [2 * x * x - 1 if i == j else x * y for i, j in pairs for x, y in [(Fraction(e[i]), Fraction(e[j]))]]
        for i, term in enumerate([*map(Fraction, e), *squares]):
            value = value + np.vectorize(Fraction)(slopes[k, :, :, i]) * term
        off = np.abs(exactly - value).astype(float)
        assert (off <= rest[k]).all()
        wrong += (off > 0.3 * rest[k]).any()
        unrounded += (off > 0).any()
    # With a fraction of the rests, or without rounding, the enclosure would not hold: the test can fail.
    assert wrong
    assert unrounded


def test_random_robots_are_never_called_regular_where_the_determinant_changes_its_sign() -> None:
    """120 robots and boxes, against dense sampling and the determinant along paths between the samples."""
    rng = np.random.default_rng(3)
    outcomes = []
    for _ in range(120):
        robot, kind = random_legs(rng), list(TurnKind)[int(rng.integers(3))]
        box = pose_box(random_workspace(rng, kind, float(rng.uniform(0.02, 0.5))))
        found = regular(robot, box, most_boxes=3000)
        outcomes.append(found.outcome)
        corners = box.clipped(box.random(30, rng) + rng.choice([-1, 1], (30, 6)) * (box.upper - box.lower))
        ends = np.concatenate([box.random(30, rng), corners])
        along = np.concatenate([ends, 0.5 * (ends[1:] + ends[:-1])])
        values = determinants(robot, box, along)
        if found.outcome is Outcome.PROVED:
            assert (values > 0).all() or (values < 0).all()
        if found.outcome is Outcome.REFUTED:
            positive, negative = determinants(robot, box, found.sides)
            assert positive > 0 > negative
    assert outcomes.count(Outcome.PROVED) > 18
    assert outcomes.count(Outcome.REFUTED) > 18


@pytest.mark.parametrize("name", ["smallest singular value", "condition number", "clearance"])
@pytest.mark.parametrize("kind", list(TurnKind))
def test_bounds_over_boxes_hold_at_samples(case: Case, kind: TurnKind, name: str) -> None:
    rng = np.random.default_rng(5)
    box, robot = pose_box(turned(kind, 25)), legs_of(case)
    number: Number = clearance(robot, box, 1, 2)
    if name != "clearance":
        number = subject_of(robot, box).spectrum(11.5, is_condition=name == "condition number")
    lower = box.random(150, rng)
    upper = np.minimum(lower + (box.upper - box.lower) * rng.uniform(0, 0.15, (150, 6)), box.upper)
    bound = bounds_of(number, lower, upper)
    least = np.full(150, np.inf)
    for _ in range(40):
        share = rng.uniform(size=(150, 6))
        share = np.where(rng.uniform(size=share.shape) < 0.4, np.round(share), share)
        least = np.minimum(least, values_of(number, lower + share * (upper - lower)))
    assert (bound <= least + 1e-12).all()
    # The bounds say something: half of these boxes have one that is less than a fifth off.
    assert np.median((least - bound) / np.abs(least)) < 0.2


def test_the_smallest_clearance_is_met_within_the_gap(case: Case) -> None:
    box, robot = pose_box(turned(TurnKind.ANY_AXIS, 20)), legs_of(case)
    number = clearance(robot, box, 1, 2)
    found = smallest(number, Goal(0.05))
    assert found.value - 0.05 <= found.bound <= found.value
    samples = values_of(number, box.random(100_000, np.random.default_rng(0)))
    assert samples.min() >= found.bound


def test_lengths_of_legs_agree_with_samples(case: Case) -> None:
    judged = judge_workspace(case, with_objective=False)
    assert judged.is_proved
    box = pose_box(judged.workspace)
    points = box.random(100_000, np.random.default_rng(2))
    lengths = np.linalg.norm(spans(legs_of(case), box, points), axis=2)
    by_name = {(each.name, each.sense.value): each for each in judged.extremes}
    for i, leg in enumerate(case.model.legs):
        short, long = (by_name[f"leg_length limb {leg.name}", sense] for sense in ("min", "max"))
        assert short.bound <= lengths[:, i].min()
        assert long.bound >= lengths[:, i].max()
        assert short.reached - 1e-3 * short.reached <= short.bound <= short.reached
        assert long.reached <= long.bound <= long.reached + 1e-3 * long.reached
        stroke = by_name[f"actuator.stroke_max limb {leg.name}", "max"]
        assert stroke.bound == pytest.approx(long.bound - short.bound)


@pytest.mark.parametrize(("away", "outcome"), [(1e-6, Outcome.PROVED), (0.0, Outcome.PROVED), (-1e-6, Outcome.REFUTED)])
def test_limits_nearer_than_the_gap_are_decided(case: Case, away: float, outcome: Outcome) -> None:
    lengths = [each for each in judge_workspace(case, with_objective=False).extremes if each.key[:4] == "leg_"]
    short, long = (of([each.reached for each in lengths if each.sense.value == of.__name__]) for of in (min, max))
    limits = f"min = {short * (1 - away)}, max = {long * (1 + away)}"
    near = tomllib.loads(TEXT.replace("min = 17, max = 44", limits))
    judged = judge_workspace(case_from(near, ""), with_objective=False).extremes
    worst = [each.outcome for each in judged if each.key[:4] == "leg_" and each.reached in (short, long)]
    assert set(worst) == {outcome}
    assert len(worst) > 1


def test_roll_pitch_and_yaw_have_the_same_poses_in_both_searches(case: Case) -> None:
    angles = (Free(-0.3, 0.1), Free(0.0, 0.25), Free(-0.1, 0.4))
    workspace = Workspace((0.5, Free(-1.0, 1.0), 20.0), Turns(TurnKind.ROLL_PITCH_YAW, angles))
    judged = judge_workspace(case, workspace=workspace, with_objective=False)
    box, robot = pose_box(workspace), legs_of(case)
    points = box.random(5000, np.random.default_rng(4))
    lengths = np.linalg.norm(spans(robot, box, points), axis=2)
    long = [each for each in judged.extremes if each.key == "leg_length.max"]
    for each, most in zip(long, lengths.max(axis=0), strict=True):
        assert most <= each.bound <= 1.02 * most


@pytest.mark.soak
def test_the_largest_box_is_found_to_a_hundredth(case: Case) -> None:
    found = largest_scale(case, time_limit=100)
    assert found.refuted
    assert found.factor < found.failed <= 1.011 * found.factor
    assert judge_workspace(
        case, workspace=scaled(turned(TurnKind.ANY_AXIS, 20), found.factor), with_objective=False
    ).is_proved


def test_the_command_proves_and_refutes(cli: Run, machine: Path, tmp_path: Path) -> None:
    target = tmp_path / "result.json"
    command = ("workspace", str(machine), "--gap", "0.01")
    out = output_of(cli(*command, "--json", str(target)))
    assert "J has full rank at every pose" in out
    assert "PROVED at every pose" in out
    result = load_result(target)
    assert isinstance(result, WorkspaceResult)
    assert result.proved
    jsonschema.validate(json.loads(target.read_text(encoding="utf-8")), result_schema())
    code, out, _ = cli(*command, "--set", "limits.leg_length.max=40")
    assert (code, "NOT PROVED" in out) == (1, True)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"position": [0, 0, 20]}, "workspace: is only one pose"),
        ({"position": [0, 0, {"min": 5, "max": 4}]}, "workspace.position[2].min"),
        ({"position": [0, 0, 20], "rotation": {"angle": 10}}, "workspace.rotation.angle"),
        ({"position": [0, 0, 20], "rotation": {"angle": {"min": -5, "max": 9}}}, "workspace.rotation.angle"),
        ({"position": [0, 0, 20], "rotation": {"roll": 5, "axis": [0, 0, 1]}}, "workspace.rotation.roll"),
        ({"position": [0, 0, 20], "rotation": {"axis": [0] * 3, "angle": ends(4, 5)}}, "workspace.rotation.axis"),
        ({"position": [0, 0, 20], "rotation": {"pitch": {"min": 0, "max": 170}}}, "workspace.rotation.pitch.max"),
        ({"position": [0, 0, 20], "rotation": {}}, "workspace.rotation.angle: is missing"),
        ({"position": [0, 0]}, "workspace.position"),
        ({"place": [0, 0, 0]}, "workspace.place: no such key"),
    ],
)
def test_bad_workspaces_are_refused(table: dict[str, object], message: str) -> None:
    with pytest.raises(CaseError) as refused:
        case_from(tomllib.loads(TEXT) | {"workspace": table})
    assert message in str(refused.value).replace(" = ", ": ") or message in str(refused.value)


@pytest.mark.parametrize("kind", list(TurnKind))
def test_a_workspace_is_written_and_read_again(case: Case, kind: TurnKind) -> None:
    workspace = turned(kind, 25)
    written = replace(case, workspace=replace(workspace, turns=replace(workspace.turns, axis=(0.0, 0.0, 1.0))))
    again = case_from(written.to_toml(), "again")
    assert again.workspace == written.workspace


#: The machine with free dimensions, for the best design that keeps its limits over a smaller workspace.
FREE = (
    edited(
        hexapod_text(0, 5),
        ("x1 = 26.5, x2 = 11.543", "x1 = { min = 20, max = 32 }, x2 = { min = 8, max = 15 }"),
        ("axis = [0, 0, 1]\npitch = inf", "axis = [1, 2, 6]\npoint = [3, 1, 12]\npitch = 0.1"),
    )
    + """[limits]
over = "workspace"
leg_length = { min = 20, max = 38 }
actuator = { stroke_max = 17 }
[workspace]
position = [{ min = -4, max = 4 }, { min = -4, max = 4 }, { min = 17, max = 23 }]
rotation = { angle = { min = -12, max = 12 } }
"""
)


def test_limits_over_a_workspace_end_with_a_proof() -> None:
    solution = solve(case_from(FREE), starts=4, jobs=1)
    proof = solution.workspace
    assert proof.is_proved
    assert not proof.first.is_proved
    assert solution.status.is_answer
    # The constraints of the exchange cost something: the first design, without them, has a larger F.
    assert proof.history[0][0] > solution.F
    design = proof.judgement.case
    robot, box = legs_of(design), pose_box(proof.judgement.workspace)
    points = box.random(100_000, np.random.default_rng(9))
    span = spans(robot, box, points)
    lengths = np.linalg.norm(span, axis=2)
    assert lengths.min() >= 20
    assert lengths.max() <= 38
    assert np.ptp(lengths, axis=0).max() <= 17
    # The design was pushed up to its limits: within a hundredth of one of them.
    assert np.ptp(lengths, axis=0).max() > 0.9 * 17 or lengths.min() < 1.01 * 20
    result = json_data(result_of(solution))
    assert result["workspace"]["proved"] is True  # type: ignore[index, call-overload]
    # Rows of limits have the numbers of the case, although those of the constraints are tighter.
    stated = {"leg_length.min": 20, "leg_length.max": 38, "actuator.stroke_max": 17}
    rows = {row.key: row for row in result_of(solution).limits}  # type: ignore[union-attr]
    assert {key: rows[key].limit for key in rows if key in stated} == pytest.approx({k: stated[k] for k in rows})
    assert any(rows[key].active and rows[key].margin != 0 for key in rows)
    jsonschema.validate(result, result_schema())
    assert "[workspace]" in design.to_toml()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[workspace]", "[workspaces]", "workspaces: no such key"),
        ('over = "workspace"', 'over = "everything"', "limits.over"),
        (FREE[FREE.index("[workspace]") :], "", "needs the table [workspace]"),
    ],
)
def test_limits_over_a_workspace_need_one(old: str, new: str, message: str) -> None:
    with pytest.raises(CaseError) as refused:
        case_from(FREE.replace(old, new))
    assert message in str(refused.value)


@pytest.mark.slow
def test_the_shipped_design_violates_nothing_at_many_poses_and_its_proof_is_accepted(cli: Run, tmp_path: Path) -> None:
    result, target = tmp_path / "result.json", str(tmp_path / "proof.json")
    solution = solve(load_case("hexapod-workspace"), starts=4)
    saved(result, json.dumps(solution.to_dict()))
    output_of(cli("workspace", "hexapod-workspace", "--of", str(result), "--gap", "2e-4", "--proof", target))
    assert output_of(cli("verify-proof", target)).startswith("PROOF VALID: 58 of 58 claims")
    proof = solution.workspace
    assert proof.is_proved
    robot, box = legs_of(proof.judgement.case), pose_box(proof.judgement.workspace)
    rng = np.random.default_rng(10)
    least, most = np.full(6, np.inf), np.zeros(6)
    for _ in range(5):
        points = box.random(50_000, rng)
        span = spans(robot, box, points)
        lengths = np.linalg.norm(span, axis=2)
        least, most = np.minimum(least, lengths.min(axis=0)), np.maximum(most, lengths.max(axis=0))
        assert (determinants(robot, box, points) < 0).all()
        home = np.add(robot.platform, (0, 0, 20)) - robot.base
        cosine = (span * home).sum(axis=2) / lengths / np.linalg.norm(home, axis=1)
        assert cosine.min() >= math.cos(math.radians(25))
        for one, other in ((0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0)):
            assert values_of(clearance(robot, box, one, other), points[:2000]).min() >= 3
    assert least.min() >= 20
    assert most.max() <= 38
    assert (most - least).max() <= 17


def spans(robot: Legs, box: PoseBox, points: FloatArray) -> FloatArray:
    """Vectors (K, 6, 3) of the legs at points (K, 6)."""
    rotation = box.rotations(points)
    return points[:, None, :3] + np.einsum("bij,lj->bli", rotation, robot.platform) - robot.base


def test_slices_show_where_the_determinant_has_which_sign(case: Case, cli: Run, machine: Path, tmp_path: Path) -> None:
    wide = replace(case, workspace=turned(TurnKind.ROLL_PITCH_YAW, 30), limits=Limits())
    slices = slices_of(wide)
    assert [each.names for each in slices][-1] == ("pitch", "yaw")
    assert {each.limits for each in slices} == {()}  # the case has none
    tilts = next(each for each in slices if each.names == ("roll", "pitch"))
    assert set(tilts.regions) == {Region.REGULAR, Region.BEYOND, Region.OPEN}
    middle = 0.5 * (tilts.boxes[:, :2] + tilts.boxes[:, 2:])
    points = np.column_stack(
        [np.zeros((len(middle), 2)), np.full(len(middle), 20.0), np.tan(middle / 2), np.zeros(len(middle))]
    )
    values = determinants(legs_of(case), pose_box(wide.workspace), points)
    for region, sign in ((Region.REGULAR, -1), (Region.BEYOND, 1)):
        assert (np.sign(values[[each is region for each in tilts.regions]]) == sign).all()
    area = np.prod(np.diff(np.tan(tilts.boxes.reshape(-1, 2, 2) / 2), axis=1), axis=2).sum()
    assert area == pytest.approx(np.prod(np.diff(np.tan(tilts.whole / 2), axis=0)))
    picture = tmp_path / "slices.svg"
    output_of(cli("workspace", str(machine), "--gap", "0.05", "--plot", str(picture)))
    text = picture.read_text(encoding="utf-8")
    assert 'id="workspace"' in text
    assert 'id="proved: no singularity, all limits satisfied"' in text


def random_errors(robot: Legs, box: PoseBox, eps: float, count: int, *, extreme: bool) -> tuple[FloatArray, FloatArray]:
    """Errors of the pose (count,), in position and rotation, of random machines at random poses, by Newton's method.

    Half of eps is the error of the legs' lengths, and half that of both joint centres.
    """
    rng = np.random.default_rng(11)
    points = box.random(count, rng)
    if extreme:
        nearest = np.where(points > 0.5 * (box.lower + box.upper), box.upper, box.lower)
        points = box.clipped(np.where(rng.uniform(size=points.shape) < 0.8, nearest, points))
    start = box.rotations(points)
    turn, position, span = start.copy(), points[:, :3].copy(), spans(robot, box, points)
    lengths = np.linalg.norm(span, axis=2)
    if extreme:
        signs = rng.choice([-1.0, 1.0], (count, 6))
        wanted = lengths + eps / 2 * signs
        along = eps / 4 * signs[:, :, None] * span / lengths[:, :, None]
        base, platform = robot.base + along, robot.platform - np.einsum("kji,klj->kli", turn, along)
    else:
        wanted = lengths + eps / 2 * rng.uniform(-1, 1, (count, 6))
        directions = rng.normal(size=(2, count, 6, 3))
        directions *= eps / 4 / np.linalg.norm(directions, axis=3, keepdims=True)
        base, platform = robot.base + directions[0], robot.platform + directions[1]
    for _ in range(6):
        arm = np.einsum("kij,klj->kli", turn, platform)
        span = position[:, None] + arm - base
        now = np.linalg.norm(span, axis=2)
        unit = span / now[:, :, None]
        step = np.linalg.solve(np.concatenate([unit, np.cross(arm, unit)], axis=2), (wanted - now)[:, :, None])[:, :, 0]
        position += step[:, :3]
        half = np.concatenate([np.full((count, 1), 2.0), step[:, 3:]], axis=1)
        w, x, y, z = half.T / np.linalg.norm(half, axis=1)
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        turn = np.array(rows).transpose(2, 0, 1) @ turn
    change = turn @ start.transpose(0, 2, 1)
    vector = np.stack([change[:, i, j] - change[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))])
    return np.linalg.norm(position - points[:, :3], axis=1), np.arcsin(np.linalg.norm(vector, axis=0) / 2)


@pytest.mark.parametrize("joint", soaked([0.0005, 0.05], [0.0005]))
def test_errors_of_the_pose_are_bounded_for_every_machine_within_its_tolerances(case: Case, joint: float) -> None:
    angle = Free(-math.radians(10), math.radians(10))
    workspace = Workspace((Free(-2.0, 2.0), Free(-2.0, 2.0), Free(18.0, 22.0)), Turns(TurnKind.ANY_AXIS, (angle,)))
    built = replace(case, joint_centre_tolerance=joint)
    judged = judge_workspace(built, workspace=workspace, gap=0.05, leg_error=2 * joint)
    position, rotation = judged.extremes[-2:]
    assert (position.name, rotation.name) == ("position error", "rotation error")
    robot, box = legs_of(case), pose_box(workspace)
    many = random_errors(robot, box, 4 * joint, 100_000, extreme=False)
    worst = random_errors(robot, box, 4 * joint, 30_000, extreme=True)
    for found, sampled, extreme in zip((position, rotation), many, worst, strict=True):
        assert found.outcome is Outcome.PROVED
        assert sampled.max() <= extreme.max() <= found.bound <= 1.5 * extreme.max()
        assert extreme.max() <= 1.02 * found.reached
        assert found.reached <= found.bound


@pytest.mark.parametrize("is_rotation", [False, True])
@pytest.mark.parametrize("kind", list(TurnKind))
def test_first_order_errors_are_bounded_over_boxes(case: Case, kind: TurnKind, is_rotation: bool) -> None:
    rng = np.random.default_rng(6)
    box = pose_box(turned(kind, 25))
    number = WorstError(subject_of(legs_of(case), box).problem, is_rotation=is_rotation)
    lower = box.random(100, rng)
    upper = np.minimum(lower + (box.upper - box.lower) * rng.uniform(0, 0.15, (100, 6)), box.upper)
    bound = bounds_of(number, lower, upper)
    least = np.zeros(100)
    for _ in range(30):
        share = np.round(rng.uniform(size=(100, 6)), int(rng.integers(2)) * 3)
        least = np.minimum(least, values_of(number, lower + share * (upper - lower)))
    assert (bound <= least).all()
    assert np.median(bound / least) < 1.1


def test_robots_with_other_rows_are_proved_and_drawn(cli: Run, tmp_path: Path) -> None:
    place = "position = [{ min = -2, max = 2 }, 0, { min = 45, max = 50 }]"
    box = f"[workspace]\n{place}\nrotation = {{ roll = {{ min = -5, max = 5 }} }}"
    file = saved(tmp_path / "robot.toml", f"{starter_text('three-upu')}\n{box}\n")
    command = ("workspace", str(file), "--set", "base_radius=50")
    result = json.loads(output_of(cli(*command, "--json", "-")))
    assert result["regular"]["outcome"] == result["constraints"]["outcome"] == "proved"
    assert result["proved"]
    assert {each["outcome"] for each in result["extremes"]} == {"proved"}
    output_of(cli(*command, "--plot", str(tmp_path / "x.png")))
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("option", [["--gap", "2"], ["--time", "0"], ["--leg-error", "-1"], ["--quantity", "mass"]])
def test_wrong_options_are_refused_in_a_sentence(cli: Run, machine: Path, option: list[str]) -> None:
    refused = refusal_of(cli("workspace", str(machine), *option))
    assert refused.startswith(f"screwsynth: {option[0]}")


def test_an_interrupt_keeps_what_is_proved(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    done = [0]
    monkeypatch.setattr("screwsynth.nlp.interruption.is_interrupted", lambda: done[0] > 1)

    def progress(_name: str, number: int, _count: int) -> None:
        done[0] = max(done[0], number)

    judged = judge_workspace(case, gap=0.05, progress=progress)
    assert judged.regularity.outcome is Outcome.PROVED
    assert judged.extremes[0].outcome is Outcome.PROVED
    assert [each.reason for each in judged.extremes].count("interrupted") > 3
    assert judged.extremes[-1].outcome is Outcome.OPEN
    assert not judged.is_proved
