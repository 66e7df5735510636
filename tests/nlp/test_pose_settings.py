"""Settings for every pose of a workspace, against kinematics written here: affine, and existence."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, case_file, case_from, case_tables, output_of, refusal_of, unbroken
from jsonschema import Draft202012Validator

from screwsynth.nlp import Case, CaseError, Free, Outcome, case_text, load_case, solve
from screwsynth.nlp.case.pose import PerPose, ends_of
from screwsynth.nlp.case.workspace import PoseSettings, Workspace
from screwsynth.nlp.proof.checker.proof_file import ProofError, read_proof
from screwsynth.nlp.proof.checker.tree import Node
from screwsynth.nlp.proof.checker.workspace.settings_check import BoxChecker, check_settings_proof
from screwsynth.nlp.proof.statement.fixed_robot import workspace_of_case
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.judgement import Judgement
from screwsynth.nlp.proof.workspace.pose_settings import SettingsProof, prove_settings
from screwsynth.nlp.proof.workspace.settings_proof_writer import settings_proof_of
from screwsynth.nlp.results.schema import result_schema

NAME = "hexapod-base-slides"
SHORT, LONG, PLATFORM, CENTRE = 24.0, 34.0, 11.543, np.array([0.0, 0.0, 20.0])
RANGE = {"min": 20, "max": 32, "per": "pose"}
AFFINE = {**RANGE, "at": 25.2, "slope": [0, 0, -0.85]}


def tables_of(x1: object, half: float, settings: str | None, **tables: Any) -> dict[str, Any]:  # noqa: ANN401 - tables
    """The tables of the shipped case with another base radius and cube, and with limits at the stated pose."""
    found = case_tables(NAME, expect=None, limits={"leg_length": {"min": SHORT, "max": LONG}})
    found["robot"]["parameters"]["x1"] = x1
    position = [{"min": c - half, "max": c + half} for c in CENTRE.tolist()]
    found["workspace"] = {"position": position} | ({} if settings is None else {"settings": settings})
    return {key: value for key, value in (found | tables).items() if value is not None}


def slides(x1: object, half: float, settings: str | None) -> Case:
    """The case of :func:`tables_of`."""
    return case_from(tables_of(x1, half, settings), "slides")


def judged(x1: object, half: float, settings: str | None) -> Judgement:
    """Verdicts on the case of :func:`tables_of`."""
    return judge_workspace(slides(x1, half, settings))


def lengths(x1: Array, p: Array) -> Array:
    """Lengths (P, 6) of the legs: each corner of the base has two joints, for the two nearest platform joints."""
    ends = []
    for k in range(3):
        base = np.radians(120 * k)
        for turn in (-1, 1):
            joint = base + turn * np.radians(60 - 5)
            a = PLATFORM * np.array([np.cos(joint), np.sin(joint), 0.0])
            b = x1[:, None] * np.array([np.cos(base), np.sin(base), 0.0])
            ends.append(np.linalg.norm(p + a - b, axis=1))
    return np.stack(ends, axis=1)


def violation(x1: Array, p: Array) -> Array:
    """Largest violation (P,) of the limits on the legs; at most 0 where all hold."""
    own = lengths(x1, p)
    return np.maximum(own.max(axis=1) - LONG, SHORT - own.min(axis=1))


def positions(half: float, count: int = 100_000) -> Array:
    """Random positions (count, 3) of a cube, half of them on its faces, edges and corners."""
    rng = np.random.default_rng(1)
    found = rng.uniform(-half, half, (count, 3))
    found[::2] = np.where(rng.uniform(size=found[::2].shape) < 0.5, found[::2], half * np.sign(found[::2]))
    return found + CENTRE


def at_pose(cli: Run, folder: Path, x1: object, p: Array) -> Mapping[str, Any]:
    """What ``evaluate`` says about the robot at a position."""
    file, out = str(case_file(folder, tables_of(x1, 4.2, "affine"))), str(folder / "evaluated.json")
    places = [part for axis, value in zip("xyz", p, strict=True) for part in ("--set", f"p_{axis}={float(value)!r}")]
    cli("evaluate", file, *places, "--json", out)
    found: dict[str, Any] = json.loads(Path(out).read_text(encoding="utf-8"))
    return found


def test_the_robot_follows_its_settings(cli: Run, tmp_path: Path) -> None:
    slope = [0.1, -0.2, -0.85]
    for p in positions(4.2, 4):
        x1 = 25.2 + np.dot(slope, p - CENTRE)
        found = at_pose(cli, tmp_path, {**AFFINE, "slope": slope}, p)["quantities"]
        assert found["x1_setting"] == pytest.approx({"x1": x1}, rel=1e-12)
        assert list(found["leg_length"].values()) == pytest.approx(lengths(np.array([x1]), p[None])[0], rel=1e-12)


def test_an_affine_setting_is_proved_where_one_value_fails() -> None:
    found, p = judged(AFFINE, 4.2, "affine"), positions(4.2)
    assert found.is_proved
    own = lengths(25.2 - 0.85 * (p[:, 2] - 20), p)
    assert np.abs(own - np.clip(own, SHORT, LONG)).max() == 0
    bounds = {each.sense.value: [] for each in found.extremes}
    for each in found.extremes:
        if each.name.startswith("leg_length"):
            bounds[each.sense.value].append(each.bound)
    # Samples are within the proved bounds, and come close to them.
    assert (own.min(axis=0) >= bounds["min"]).all()
    assert (own.max(axis=0) <= bounds["max"]).all()
    assert own.min(axis=0) == pytest.approx(bounds["min"], rel=2e-3)
    assert own.max(axis=0) == pytest.approx(bounds["max"], rel=2e-3)
    setting = {each.sense.value: each.bound for each in found.extremes if each.name == "x1_setting"}
    assert setting == pytest.approx({"min": 25.2 - 0.85 * 4.2, "max": 25.2 + 0.85 * 4.2}, rel=2e-3)


def test_one_value_for_all_poses_reaches_a_smaller_cube() -> None:
    assert judged(25.3, 2.9, None).is_proved
    p = positions(3.0, 10_000)
    for x1 in np.arange(20, 32.05, 0.1):
        assert violation(np.full(len(p), x1), p).max() > 0
    assert all(judged(x1, 3.0, None).is_refuted for x1 in (20.0, 24.0, 25.2, 25.3, 25.4, 28.0, 32.0))


@pytest.mark.parametrize(("slope", "end"), [(-2.0, "max"), (2.0, "min")])
def test_a_setting_that_leaves_its_range_is_refuted(slope: float, end: str) -> None:
    found = judged({**AFFINE, "at": 29 if end == "max" else 22, "slope": [0, 0, slope]}, 4.2, "affine")
    wrong = {(each.name, each.sense.value): each for each in found.extremes if each.fails}
    assert wrong["x1_setting", end].outcome is Outcome.REFUTED


def test_every_pose_of_a_cube_has_a_setting() -> None:
    found, p = prove_settings(slides(RANGE, 4.2, "any")), positions(4.2)
    assert found.outcome is Outcome.PROVED
    ends = np.array([[ends_of(each) for each in box.workspace.position] for box in found.boxes])
    assert np.prod(ends[:, :, 1] - ends[:, :, 0], axis=1).sum() == pytest.approx(8.4**3, rel=1e-12)
    covered = np.zeros(len(p), dtype=bool)
    for (low, high), (x1,) in zip(np.moveaxis(ends, 2, 1), (box.values for box in found.boxes), strict=True):
        assert 20 <= x1 <= 32
        inside = ((p >= low) & (p <= high)).all(axis=1)
        assert violation(np.full(int(inside.sum()), x1), p[inside]).max(initial=-1) <= 1e-9 * LONG
        covered |= inside
    assert covered.all()


def test_a_pose_without_any_setting_refutes() -> None:
    found = prove_settings(slides(RANGE, 4.4, "any"))
    assert found.outcome is Outcome.REFUTED
    assert found.pose is not None
    assert (np.abs(found.pose.position - CENTRE) <= 4.4).all()
    x1 = np.linspace(20, 32, 120_001)
    assert violation(x1, np.repeat(found.pose.position[None], len(x1), axis=0)).min() > 0


def test_catalogue_values_are_settings() -> None:
    listed = {"values": [21, 25, 29], "per": "pose"}
    found, p = prove_settings(slides(listed, 3.0, "any")), positions(3.0)
    assert found.outcome is Outcome.PROVED
    assert {x1 for box in found.boxes for x1 in box.values} <= {21, 25, 29}
    assert np.minimum.reduce([violation(np.full(len(p), x1), p) for x1 in (21.0, 25.0, 29.0)]).max() <= 0
    refuted = prove_settings(slides({"values": [20, 32], "per": "pose"}, 3.0, "any"))
    assert refuted.outcome is Outcome.REFUTED
    assert refuted.pose is not None
    assert violation(np.array([20.0, 32.0]), np.repeat(refuted.pose.position[None], 2, axis=0)).min() > 0


def test_a_stopped_search_says_so() -> None:
    found = prove_settings(slides(RANGE, 4.2, "any"), time_limit=0.0)
    assert (found.outcome, found.boxes, found.open) == (Outcome.OPEN, (), 1)
    assert "time" in found.reason


def test_a_solve_finds_value_and_slope() -> None:
    solution = solve(load_case(NAME), starts=4)
    assert solution.status.is_answer
    assert pytest.approx(2.990456, rel=1e-6) == solution.F
    x1, slope = solution.parameters["x1"], solution.parameters["x1_slope"][2]
    p = positions(4.2)
    found = x1 + slope * (p[:, 2] - 20)
    assert violation(found, p).max() <= 0
    assert (found.min() >= 20 - 1e-9, found.max() <= 32 + 1e-9) == (True, True)


def test_proof_files_are_about_the_policy(cli: Run, tmp_path: Path) -> None:
    file, proof = str(case_file(tmp_path, tables_of(AFFINE, 4.2, "affine"))), str(tmp_path / "proof.json")
    out = unbroken(output_of(cli("workspace", file, "--proof", proof)))
    assert "x1 = 25.2 - 0.85 (z - 20), set at a standstill" in out
    assert "x1_setting: at most" in output_of(cli("verify-proof", proof, file))
    for change in ("x1=25.3", "x1_slope_z=-0.84", "x1.max=28"):
        assert cli("verify-proof", proof, file, "--set", change)[0] == 1
    # A policy that is proved nowhere in the file: the leaves no longer show it.
    text = Path(proof).read_text(encoding="utf-8")
    Path(proof).write_text(text.replace("-0.85]", "-0.95]"), encoding="utf-8")
    steeper = str(case_file(tmp_path, tables_of({**AFFINE, "slope": [0, 0, -0.95]}, 4.2, "affine"), "steeper.toml"))
    assert cli("verify-proof", proof, steeper)[0] == 1


@pytest.mark.parametrize(("x1", "settings"), [(AFFINE, "affine"), (RANGE, "any"), (RANGE, "affine")])
def test_a_written_case_has_the_same_settings(x1: object, settings: str) -> None:
    case = slides(x1, 4.2, settings)
    text = case_text(case)
    assert 'per = "pose"' in text
    assert f'settings = "{settings}"' in text
    assert case_text(case_from(text, "slides")) == text


def test_python_states_settings_too() -> None:
    case = slides(25.2, 4.2, None)
    workspace = slides(RANGE, 4.2, "affine").workspace
    assert workspace is not None
    assert workspace.settings is PoseSettings.AFFINE
    made = Case(
        case.model,
        {**case.parameters, "x1": PerPose(Free(20, 32), 25.2, (0.0, 0.0, -0.85))},
        case.position,
        case.tasks,
        units=case.units,
        limits=case.limits,
        workspace=workspace,
    )
    assert judge_workspace(made).is_proved
    assert made.replace(x1=25.0).components("x1") == (25.0,)


def test_values_slopes_and_ranges_are_set_by_name() -> None:
    case = slides(AFFINE, 4.2, "affine")
    assert case.replace(x1_slope_z=-0.5).components("x1_slope") == (0.0, 0.0, -0.5)
    assert case.replace({"x1_slope": [0, 0, 0], "x1": 26}).components("x1_slope") == (0.0, 0.0, 0.0)
    fixed = slides(RANGE, 2.9, "any").replace(x1=25.3)
    assert judge_workspace(fixed).is_proved


def test_results_follow_the_schema(cli: Run, tmp_path: Path) -> None:
    check, out = Draft202012Validator(result_schema()), tmp_path / "out.json"
    for x1, half, settings, code in ((AFFINE, 4.2, "affine", 0), (RANGE, 3.4, "any", 0), (RANGE, 4.4, "any", 1)):
        file = str(case_file(tmp_path, tables_of(x1, half, settings)))
        ended = cli("workspace", file, "--json", str(out), "--all")
        assert ended[0] == code
        check.validate(json.loads(out.read_text(encoding="utf-8")))
    assert "no setting at  (-4.4, -4.4, 15.6)" in ended[1]
    found = json.loads(out.read_text(encoding="utf-8"))
    assert (found["outcome"], found["pose"]["position"]) == ("refuted", pytest.approx([-4.4, -4.4, 15.6]))


POSE: dict[str, object] = {"min": 20, "max": 32, "per": "pose"}


@pytest.mark.parametrize(
    ("x1", "settings", "tables", "words"),
    [
        (POSE, None, {}, "workspace.settings: is missing"),
        ({"min": 20, "max": 32}, "affine", {}, 'workspace.settings = "affine": has no effect: write per = "pose"'),
        (POSE, "affine", {"workspace": None}, "needs the table [workspace]"),
        ({**POSE, "at": 33}, "affine", {}, "must lie between min and max, 20 and 32"),
        ({**POSE, "at": 25, "slope": [0, 0]}, "affine", {}, "robot.parameters.x1.slope"),
        ({**POSE, "at": 25}, "any", {}, "robot.parameters.x1.at: is for settings = 'affine'"),
        ({**POSE, "start": 25}, "affine", {}, "robot.parameters.x1.start"),
        ({"min": 20, "max": 32, "at": 25}, None, {}, 'robot.parameters.x1.at: has an effect only with per = "pose"'),
        ({"values": [20, 25], "per": "pose"}, "affine", {}, "robot.parameters.x1.values: needs settings = 'any'"),
        (POSE, "affine", {"motion": {"linear": 1, "angular": 1}}, "motion: is not supported with settings = 'affine'"),
        (POSE, "affine", {"tolerance": {"joint_centre": 0.01}}, "tolerance.joint_centre: is not supported"),
        (POSE, "affine", {"limits": {"footprint": {"base": 30}}}, "limits.footprint: is not supported"),
        (POSE, "affine", {"limits": {"actuator_speed": {"max": 3}}}, "limits.actuator_speed: is not supported"),
        # A stroke compares poses, and each box of poses has its own setting.
        (POSE, "any", {"limits": {"actuator": {"stroke_max": 1}}}, "limits.actuator: is not supported with settings"),
        (
            POSE,
            "any",
            {"limits": {"over": "workspace", "leg_length": {"max": 34}}},
            "must be 'affine' with limits over",
        ),
    ],
)
def test_bad_settings_are_refused(x1: object, settings: str | None, tables: dict[str, Any], words: str) -> None:
    with pytest.raises(CaseError) as found:
        case_from(tables_of(x1, 4.2, settings, **tables), "slides")
    assert words in str(found.value)


@pytest.mark.parametrize("settings", ["affine", "any"])
def test_mounting_poses_need_stated_settings(settings: str) -> None:
    limits = {"base_joint_angle": {"max": 30, "about": "home"}, "home": {"position": [0, 0, 20]}}
    with pytest.raises(CaseError, match=r"base_joint_angle.about: must not be 'home'"):
        case_from(tables_of(RANGE, 4.2, settings, limits=limits), "slides")


def test_commands_refuse_what_they_cannot_do_with_settings(cli: Run, tmp_path: Path) -> None:
    any_file = str(case_file(tmp_path, tables_of(RANGE, 4.2, "any"), "any.toml"))
    for option in ("--html", "--plot"):
        target = tmp_path / "out.json"
        refusal_of(cli("workspace", any_file, option, str(target)), f"{option}: is not supported with settings")
        assert not target.exists()
    affine = str(case_file(tmp_path, tables_of(AFFINE, 4.2, "affine"), "affine.toml"))
    (tmp_path / "path.csv").write_text("t,x,y,z\n0,0,0,20\n1,1,0,20\n", encoding="utf-8")
    refusal_of(cli("path", affine, "--along", str(tmp_path / "path.csv")), "workspace.settings")
    refusal_of(cli("codegen", affine, "--kinematics", "--out", str(tmp_path / "c")), "workspace.settings")


def test_a_robot_given_by_joints_has_settings_for_any_pose_only() -> None:
    tables = case_tables("linear-delta")
    name = next(iter(tables["robot"]["parameters"]))
    value = tables["robot"]["parameters"][name]
    centre = value if isinstance(value, int | float) else value["min"]
    tables["robot"]["parameters"][name] = {"min": 0.9 * centre, "max": 1.1 * centre, "per": "pose"}
    position = tables["pose"]["position"]
    middle = [each if isinstance(each, int | float) else (each["min"] + each["max"]) / 2 for each in position]
    tables["workspace"] = {"position": [{"min": c - 1, "max": c + 1} for c in middle], "settings": "affine"}
    with pytest.raises(CaseError, match=r"must be 'any' for 'linear-delta'"):
        case_from(tables, "delta")
    tables["workspace"]["settings"] = "any"
    assert prove_settings(case_from(tables, "delta")).outcome is Outcome.PROVED


#: Rotations besides the positions of a cube.
TURNS: dict[str, object] = {"yaw": {"min": -3, "max": 3}, "pitch": 0, "roll": 0}


def turned_tables(half: float, **limits: object) -> dict[str, Any]:
    """The tables of a cube with rotations, whose settings are any values."""
    found = tables_of(POSE, half, "any", limits={"leg_length": {"min": SHORT, "max": LONG}} | limits)
    found["workspace"]["rotation"] = TURNS
    return found


@cache
def settings_of_cube() -> SettingsProof:
    """Settings for a cube with rotations, and with a limit on the base."""
    found = prove_settings(case_from(turned_tables(3.2, footprint={"base": 30}), "slides"))
    assert found.is_proved
    return found


def test_a_proof_of_settings_is_checked_box_by_box() -> None:
    found = settings_of_cube()
    case, proof = found.case, settings_proof_of(found, "")
    (claim,) = proof.claims
    assert len(claim.sides) > 4
    again = read_proof(proof.as_text(), "again")
    checked = check_settings_proof(again, case)
    assert checked.leaves == len(claim.sides)
    # The boxes cover every pose, and their settings keep the lengths there, by kinematics of this test.
    rng, count = np.random.default_rng(5), 20_000
    low, high = (np.array(each) for each in ((-3.2, -3.2, 16.8, 0, 0, -3), (3.2, 3.2, 23.2, 0, 0, 3)))
    y = rng.uniform(low, high, (count, 6))
    y[::2] = np.where(rng.random((len(y[::2]), 6)) < 0.5, low, high)
    y[:, 3:] = np.radians(y[:, 3:])
    ends = [box_ends(each.workspace) for each in found.boxes]
    reached = np.zeros(count, dtype=bool)
    for (lower, upper), values in zip(ends, claim.sides, strict=True):
        inside = ((y >= lower - 1e-15) & (y <= upper + 1e-15)).all(axis=1)
        legs = turned_lengths(np.full(inside.sum(), values[0]), y[inside])
        assert legs.max(initial=SHORT) <= LONG + 1e-9
        assert legs.min(initial=LONG) >= SHORT - 1e-9
        reached |= inside
    assert reached.all()


def box_ends(workspace: Workspace) -> tuple[Array, Array]:
    """Ends (6,) of position, roll, pitch and yaw of a box."""
    lower, upper = np.array([ends_of(each) for each in (*workspace.position, *workspace.turns.angles)]).T
    return lower, upper


def turned_lengths(x1: Array, y: Array) -> Array:
    """Lengths (P, 6) of the legs at positions with roll, pitch and yaw (P, 6)."""
    (a, b, c), (d, e, f) = np.cos(y[:, 3:]).T, np.sin(y[:, 3:]).T
    rows = [
        [c * b, c * e * d - f * a, c * e * a + f * d],
        [f * b, f * e * d + c * a, f * e * a - c * d],
        [-e, b * d, b * a],
    ]
    R, ends = np.moveaxis(np.array(rows), 2, 0), []
    for k in range(3):
        base = np.radians(120 * k)
        for turn in (-1, 1):
            joint = base + turn * np.radians(60 - 5)
            arm = PLATFORM * R @ np.array([np.cos(joint), np.sin(joint), 0.0])
            ends.append(np.linalg.norm(y[:, :3] + arm - x1[:, None] * [np.cos(base), np.sin(base), 0.0], axis=1))
    return np.stack(ends, axis=1)


ALTERED: list[tuple[str, dict[str, Any], str]] = [
    ("a value out of its range", {"sides": (33.0,)}, "that the case does not allow"),
    ("not a number", {"sides": (math.nan,)}, "that the case does not allow"),
    ("a value that fails", {"sides": (20.0,)}, "could not be proved"),
    ("a base that is too large", {"sides": (30.5,)}, "footprint"),
    ("no value", {"sides": None}, "value of each setting for each box"),
    ("a value too many", {"sides": (25.0, 25.0)}, "value of each setting for each box"),
    ("a box too few", {"tree": slice(0, -1)}, "incomplete"),
    ("a box that is called outside", {"tree": Node.OUTSIDE}, "node OUTSIDE"),
]


@pytest.mark.parametrize(("name", "change", "words"), ALTERED)
def test_altered_proofs_of_settings_are_rejected(name: str, change: dict[str, Any], words: str) -> None:
    assert name
    case, proof = settings_of_cube().case, settings_proof_of(settings_of_cube(), "")
    (claim,) = proof.claims
    if "sides" in change:
        given = change["sides"]
        claim = replace(claim, sides=claim.sides[:-1] if given is None else (given, *claim.sides[1:]))
    elif isinstance(change["tree"], slice):
        claim = replace(claim, tree=claim.tree[change["tree"]])
    else:
        claim = replace(claim, tree=claim.tree[:-1] + bytes([change["tree"]]))
    with pytest.raises(ProofError, match=words):
        check_settings_proof(replace(proof, claims=(claim,)), case)


@pytest.mark.parametrize(
    "tables",
    [turned_tables(3.3), turned_tables(3.2, leg_length={"min": 25.5, "max": 34}), tables_of(RANGE, 3.2, "any")],
)
def test_proofs_of_settings_are_about_their_case(tables: dict[str, Any]) -> None:
    proof = settings_proof_of(settings_of_cube(), "")
    with pytest.raises(ProofError):
        check_settings_proof(proof, case_from(tables, "slides"))


def test_commands_write_and_check_proofs_of_settings(cli: Run, tmp_path: Path) -> None:
    proof = tmp_path / "proof.json"
    file = str(case_file(tmp_path, tables_of(RANGE, 3.0, "any"), "any.toml"))
    output_of(cli("workspace", file, "--proof", str(proof)))
    text = unbroken(output_of(cli("verify-proof", str(proof), file)))
    assert "PROOF VALID: 1 of 1 claims about the workspace of any" in text
    assert "every pose has a value of each setting that satisfies all limits" in text
    # A claim that is not proved writes no file.
    missing = tmp_path / "missing.json"
    large = str(case_file(tmp_path, tables_of(RANGE, 4.4, "any"), "large.toml"))
    assert cli("workspace", large, "--proof", str(missing))[0] == 1
    assert not missing.exists()
    code, _, err = cli("verify-proof", str(proof), large)
    assert (code, "rejected" in err) == (1, True)
    # The proof of a fixed setting is no proof of this claim.
    fixed = tmp_path / "fixed.json"
    one = str(case_file(tmp_path, tables_of(25.3, 2.0, None), "one.toml"))
    output_of(cli("workspace", one, "--proof", str(fixed)))
    code, _, err = cli("verify-proof", str(fixed), file)
    assert (code, "one claim" in err) == (1, True)


def test_a_limit_without_a_rule_of_the_checker_is_rejected() -> None:
    tables = case_tables("linear-delta")
    position = [each if isinstance(each, int | float) else each["min"] for each in tables["pose"]["position"]]
    tables["workspace"] = {"position": [{"min": c - 1, "max": c + 1} for c in position]}
    tables["limits"] = {"smallest_singular_value": {"min": 0.01, "length": 100}}
    stated = tables["robot"]["parameters"]
    stated |= {name: each["min"] for name, each in stated.items() if isinstance(each, dict)}
    case = case_from(tables, "delta")
    with pytest.raises(ProofError, match="no rule for smallest_singular_value"):
        BoxChecker(case, workspace_of_case(case))
