"""Slices, limits and designs over a workspace for robots that are not six straight legs, held to kinematics of ours."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest
from builders import case_from, ran
from numpy.typing import NDArray

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, Solution, load_case, pareto, solve
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.front.data import front_result
from screwsynth.nlp.output.fronttable import front_words
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.slices.slice_limits import KEPT, UNDECIDED
from screwsynth.nlp.proof.workspace.slices.slices import Region, Slice, slices_of
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.solver.semi_infinite import WorkspaceProof

NOTICE = "the limits are taken at the stated pose alone, not over the workspace"

DELTA = """
[units]
length = "m"
[robot]
model = "delta"
[robot.parameters]
rb = 0.164
rp = 0.044
arm = {arm}
rod = {rod}
w = 0.131
tilt = 20
[pose]
position = [0, 0, -0.9]
[[task]]
name = "vertical"
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
{over}
actuator_angle = {{ min = -60, max = 60 }}
[workspace]
position = [{{ min = -0.25, max = 0.25 }}, {side}, {{ min = -1.0, max = -0.8 }}]
[solve]
starts = 1
"""
TRIPOD = """
[units]
length = "m"
[robot]
model = "3-rps"
[robot.parameters]
rb = {rb}
rp = {rp}
h = 1.1
[pose]
position = [{{ min = -0.2, max = 0.2 }}, {{ min = -0.2, max = 0.2 }}, 1.1]
rotation = {{ axis = [1, 0, 0], angle = 0 }}
[[task]]
name = "tilt"
sense = "max"
axis = [0, 1, 0]
point = [0, 0, 1.1]
pitch = 0
[limits]
{over}
actuator_length = {{ min = -0.2, max = 0.2 }}
[workspace]
position = [{{ min = -0.2, max = 0.2 }}, {{ min = -0.2, max = 0.2 }}, {height}]
rotation = {{ roll = {{ min = -10, max = 10 }}, pitch = {{ min = -10, max = 10 }}, yaw = {{ min = -5, max = 5 }} }}
[solve]
starts = 1
"""
OVER = 'over = "workspace"'
HEXAPOD = f"""
[units]
length = "in"
[robot]
model = "stewart-gough"
layout = "octahedral"
[robot.parameters]
x1 = {{ min = 20, max = 32 }}
x2 = 11
x3 = 4
x4 = 9
[pose]
position = [0, 0, 20]
[[task]]
name = "tap"
sense = "max"
axis = [1, 2, 6]
point = [3, 1, 12]
pitch = 0.1
[limits]
{OVER}
footprint = {{ base = 28 }}
[workspace]
position = [0, 0, {{ min = 19, max = 21 }}]
"""
THREE_UPU = """
[robot]
model = "three-upu"
axes = "tsai"
characteristic_length = 1
[robot.parameters]
base_radius = { min = 30, max = 60 }
platform_radius = 25
[pose]
position = [0, 0, 50]
[[task]]
name = "lift"
sense = "max"
axis = [0, 1, 2]
point = [0, 0, 50]
pitch = 2
[workspace]
position = [0, 0, { min = 45, max = 55 }]
"""


def case_of(text: str, **values: str) -> Case:
    return case_from(text.format(**values), "mine")


def number(case: Case, name: str) -> float:
    (value,) = case.components(name)
    assert isinstance(value, float)
    return value


def arms(case: Case, p: FloatArray) -> FloatArray:
    """Angles (N, 3) of a Delta's arms away from home at positions (N, 3), in home's branch; NaN out of reach."""
    rb, rp, arm, rod = (number(case, name) for name in ("rb", "rp", "arm", "rod"))
    tilt, found = math.radians(20), []
    for azimuth in (0, 2 * math.pi / 3, 4 * math.pi / 3):
        x = math.cos(azimuth) * p[:, 0] + math.sin(azimuth) * p[:, 1] + rp - rb
        y = -math.sin(azimuth) * p[:, 0] + math.cos(azimuth) * p[:, 1]
        z = p[:, 2]
        K, R = (x * x + y * y + z * z + arm**2 - rod**2) / (2 * arm), np.hypot(x, z)
        with np.errstate(invalid="ignore"):
            # The elbow is outside: at home the angle below the horizontal is that of the tilt.
            found.append(np.arctan2(-z, x) - np.arccos(K / R) - tilt)
    return np.stack(found, axis=1)


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


def proof_of(solution: Solution) -> WorkspaceProof:
    assert solution.workspace is not None
    return solution.workspace


def drawn(each: Slice, rng: np.random.Generator) -> tuple[FloatArray, NDArray[np.int16], list[Region]]:
    """A random point (B, 2) of each box, the limit there, and the region."""
    points = each.boxes[:, :2] + rng.uniform(size=(len(each.boxes), 2)) * (each.boxes[:, 2:] - each.boxes[:, :2])
    return points, each.binding, list(each.regions)


def test_a_design_of_a_delta_is_exchanged_until_it_is_proved() -> None:
    text = {"rod": "{ min = 0.7, max = 1.3 }", "arm": "0.25", "side": "0"}
    solution = solve(case_of(DELTA, over=OVER, **text))
    proof = proof_of(solution)
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
    text = {"rb": "{ min = 0.7, max = 1.5 }", "rp": "{ min = 0.4, max = 1.0 }"}
    solution = solve(case_of(TRIPOD, over=OVER, height="{ min = 1.0, max = 1.2 }", **text))
    proof = proof_of(solution)
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
    case = case_of(DELTA, over="", rod="0.94", arm="0.22", side="0")
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
    for k, each in enumerate(found.limits):
        own = angles[limit == k]
        beyond = own > each.limit if each.key.endswith("max") else own < each.limit
        if each.key.startswith("workspace."):
            continue
        assert len(own) > 20
        assert beyond.any(axis=1).all()
    # What is undecided lies along curves.
    size = np.prod(found.boxes[:, 2:] - found.boxes[:, :2], axis=1)
    assert size[limit == UNDECIDED][~is_unreached[limit == UNDECIDED]].sum() < 0.1 * size.sum()
    assert is_unreached.any()


@pytest.mark.slow
def test_slices_and_limits_of_a_robot_with_loops_hold_at_every_point() -> None:
    case = case_of(TRIPOD, over="", rb="1.0", rp="0.6", height="1.1")
    (found,) = slices_of(case)
    assert found.names == ("roll", "pitch")
    points, limit, regions = drawn(found, np.random.default_rng(1))
    lengths, _ = tripod(case, points[:, 0], points[:, 1], np.full(len(points), 1.1))
    is_regular = np.array([region is Region.REGULAR for region in regions])
    assert (np.abs(lengths) <= 0.2)[is_regular & (limit == KEPT)].all()
    # Boxes that touch are of one assembly.
    size = np.prod(found.boxes[:, 2:] - found.boxes[:, :2], axis=1)
    assert size[[region is Region.REGULAR for region in found.regions]].sum() > 0.9 * size.sum()
    for k, each in enumerate(found.limits):
        own = lengths[limit == k]
        beyond = own > each.limit if each.key.endswith("max") else own < each.limit
        if each.key.startswith("workspace."):
            continue
        assert len(own) > 20
        assert beyond.any(axis=1).all()
    judged = judge_workspace(case, with_objective=False)
    assert judged.is_proved
    largest = max(abs(each.bound) for each in judged.extremes if each.limit is not None)
    rng = np.random.default_rng(0)
    roll, pitch = rng.uniform(-math.radians(10), math.radians(10), (2, 10_000))
    assert np.abs(tripod(case, roll, pitch, np.full(10_000, 1.1))[0]).max() < largest <= 0.2 * (1 + 1e-9)
    tight = case_of(TRIPOD.replace("min = -0.2, max = 0.2 }}\n[work", "min = -0.08, max = 0.2 }}\n[work"), over="",
                    rb="1.0", rp="0.6", height="1.1")  # fmt: skip
    refuted = [each for each in judge_workspace(tight, with_objective=False).extremes if each.limit is not None]
    assert {each.outcome for each in refuted if each.limit == -0.08} == {Outcome.REFUTED}
    worst = tripod(case, roll, pitch, np.full(10_000, 1.1))[0].min()
    assert min(each.reached for each in refuted) <= worst


def test_a_slice_is_drawn_where_no_loops_close_at_its_ends() -> None:
    """The legs reach no further than the sum of their lengths, and the slice is wider than the workspace."""
    lengths = {item.name: item.typical[0] for item in build_model("planar-3-rrr").parameters}
    text = "[robot]\nmodel = 'planar-3-rrr'\n[robot.parameters]\n"
    text += "".join(f"{name} = {value}\n" for name, value in lengths.items())
    text += "[pose]\nposition = [0, 0, 0]\n[[task]]\nsense = 'max'\naxis = [0, 0, 1]\npoint = [0, 0, 0]\npitch = 0.1\n"
    half = sum(lengths.values())
    text += f"[workspace]\nposition = [{{min = -{half}, max = {half}}}, {{min = -{half}, max = {half}}}, 0]\n"
    (found,) = slices_of(case_from(text, "mine"))
    assert {Region.UNKNOWN} <= set(found.regions)


def test_slices_need_two_numbers_that_the_robot_can_choose() -> None:
    text = TRIPOD.replace("roll = {{ min = -10, max = 10 }}, ", "")
    with pytest.raises(CaseError, match="two numbers of the pose"):
        slices_of(case_of(text, over="", rb="1.0", rp="0.6", height="1.1"))


def test_a_design_of_three_legs_keeps_its_strokes_over_the_workspace() -> None:
    text = THREE_UPU.replace("min = 45, max = 55", "min = 47, max = 53")
    text += f"[limits]\n{OVER}\nactuator = {{ stroke_max = 5.5 }}\n"
    proof = proof_of(solve(case_from(text, "mine")))
    assert proof.is_proved
    # Without rotation the platform's joints stay above those of the base by the difference of the radii.
    stroke = np.diff(np.hypot(number(proof.judgement.case, "base_radius") - 25, [47, 53]))[0]
    assert 5.5 * (1 - 3e-3) < stroke < 5.5


@pytest.mark.slow
def test_a_design_of_a_robot_with_loops_is_proved_for_every_machine_within_a_tolerance() -> None:
    text = TRIPOD.replace("[solve]", "[tolerance]\njoint_centre = 0.0005\n[solve]")
    free = {"rb": "{ min = 0.7, max = 1.5 }", "rp": "{ min = 0.4, max = 1.0 }", "height": "{ min = 1.0, max = 1.2 }"}
    proof, exact = (proof_of(solve(case_of(each, over=OVER, **free))) for each in (text, TRIPOD))
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


def test_a_front_and_a_compiled_sweep_say_that_limits_hold_at_the_stated_pose(tmp_path: Path) -> None:
    path = tmp_path / "hexapod.toml"
    path.write_text(HEXAPOD, encoding="utf-8")
    front = pareto(load_case(str(path)), ["max F", "min limits.footprint.base"], points=2, starts=1)
    assert front_result(front).notice == NOTICE
    assert NOTICE in front_words(front)
    table, data = tmp_path / "sweep.csv", tmp_path / "sweep.json"
    options = ("--over", "task.pitch=0.1,0.2", "--starts", "1", "--engine", "compiled", "--out", str(table))
    run = ran("sweep", str(path), *options, "--json", str(data))
    assert run.code == 0, run.output
    assert NOTICE in run.output
    result = json.loads(data.read_text(encoding="utf-8"))
    assert result["notice"] == NOTICE
    assert result["notes"] == [NOTICE, NOTICE]
