"""Numbers of actuators as objectives: optima, bounds and proofs against forces computed here, and their refusals.

The robot is a 3-UPU that translates, whose legs lie along the lines between two circles of joints at 120 degrees. Its
forces f hold a load w: ``sum f_i s_i = -w`` with the unit vectors s_i along the legs.
"""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
from builders import Array, Run, case_from, edited, output_of, refusal_of, saved, unbroken

from screwsynth.nlp import CaseError, case_from_tables, certify, solve
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.results.evidence import certified_of
from screwsynth.nlp.results.result import result_of

LOAD = np.array([2.0, 2.0, -10.0])
HALF = np.array([0.1, 0.1, 0.05])
UPU = """\
[robot]
model = "three-upu"
axes = "tsai"
azimuth = "free"
parameters = { base_radius = { min = 0.11, max = 0.5 }, platform_radius = 0.1, azimuth = { min = -30, max = 30 } }
[[load]]
name = "handling"
force = [2, 2, -10]
[objective]
minimise = "actuator_force"
"""
TASK = '[[task]]\nsense = "min"\naxis = [0, 0, 1]\npitch = inf\n'
SIDE = "{ min = -0.1, max = 0.1, count = 2 }"
CORNERS = f"""{UPU}[pose]
position = [0, 0, {{ min = 0.15, max = 1.05 }}]
grid = {{ x = {SIDE}, y = {SIDE}, z = {{ min = -0.05, max = 0.05, count = 2 }} }}
[limits]
leg_length = {{ max = 1 }}
actuator = {{ stroke_max = 0.4 }}
"""
BOX = f"""{UPU}[pose]
position = [0, 0, 0.575]
[limits]
over = "workspace"
leg_length = {{ max = 1 }}
[workspace]
position = [{{ min = -0.1, max = 0.1 }}, {{ min = -0.1, max = 0.1 }}, {{ min = 0.525, max = 0.625 }}]
"""


def largest(difference: float, azimuth: float, points: Array) -> float:
    """The largest size of a force at points (k, 3) of the platform, for a difference of radii and an azimuth."""
    angles = azimuth + np.radians([0.0, 120.0, 240.0])
    feet = difference * np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    spans = points[:, None, :] - feet
    units = spans / np.linalg.norm(spans, axis=2, keepdims=True)
    forces = np.linalg.solve(units.transpose(0, 2, 1), -np.broadcast_to(LOAD, points.shape)[..., None])
    return float(np.abs(forces).max())


def corners(z: float) -> Array:
    return np.array([np.array([0, 0, z]) + np.array(signs) * HALF for signs in itertools.product((-1, 1), repeat=3)])


def test_the_largest_force_at_the_corners_of_a_box_is_least_where_no_other_design_is_better() -> None:
    found = solve(case_from(CORNERS))
    radius, azimuth, z = found.x[:3]
    assert pytest.approx(largest(radius - 0.1, azimuth, corners(z)), rel=1e-9) == found.F
    assert pytest.approx(7.53214, abs=1e-5) == found.F  # known from a search of its own
    rng = np.random.default_rng(0)
    for _ in range(4000):
        other = rng.uniform([0.011, -np.pi / 6, 0.15], [0.4, np.pi / 6, 1.05])
        assert largest(other[0], other[1], corners(other[2])) >= found.F * (1 - 1e-9)
    data = result_of(found).objective
    assert (data.minimise, data.unit, data.bound) == ("actuator_force", "N", None)
    assert data.value == pytest.approx(found.F)


def test_its_bound_is_proved_to_a_thousandth() -> None:
    certified = certify(case_from(CORNERS), gap=1e-3)
    certificate = certified.certificate
    assert certified.is_proved
    assert certificate.incumbent * (1 - 1e-3) <= certificate.bound <= certificate.incumbent
    data = certified_of(certified).objective
    assert data.bound == certificate.bound
    assert data.gap == pytest.approx(certificate.incumbent - certificate.bound)


def test_over_a_box_no_point_exceeds_what_is_proved_and_no_design_is_below_the_bound() -> None:
    certified = certify(case_from(BOX), gap=1e-3)
    data = certified_of(certified).objective
    assert certified.solution.workspace.is_proved
    radius, azimuth = certified.solution.x[:2]
    rng = np.random.default_rng(1)
    points = np.array([0, 0, 0.575]) + rng.uniform(-1, 1, (20_000, 3)) * HALF
    points = np.concatenate([points, corners(0.575)])
    reached = largest(radius - 0.1, azimuth, points)
    assert reached <= data.value <= reached * (1 + 2e-3)
    for _ in range(2000):
        other = rng.uniform([0.01, -np.pi / 6], [0.4, np.pi / 6])
        assert largest(other[0], other[1], corners(0.575)) >= data.bound
    judged = certified.solution.workspace.judgement
    assert all(each.outcome is Outcome.PROVED for each in judged.extremes if each.limit is not None)


@pytest.mark.parametrize("measure", ["actuator_speed", "actuator_power"])
def test_speeds_and_powers_are_objectives_too(measure: str) -> None:
    text = CORNERS.replace("actuator_force", measure) + "[motion]\nlinear = 2\n"
    found = solve(case_from(text))
    # Along its line a leg is as fast as the platform, and its rate is no faster in any direction.
    assert pytest.approx(2.0 if measure == "actuator_speed" else 2 * 7.532143634, rel=1e-6) == found.F


def test_a_case_with_an_objective_is_the_same_when_it_is_written_and_read_again() -> None:
    case = case_from(BOX)
    again = case_from(case.to_toml())
    assert again.to_toml() == case.to_toml()
    assert again.tasks[0].measure == "actuator_force"
    assert not again.tasks[0].is_stated
    # A task beside the objective changes nothing.
    both = CORNERS.replace("[objective]", TASK + "[objective]")
    one, other = (solve(case_from(text)) for text in (CORNERS, both))
    assert pytest.approx(one.F, rel=1e-9) == other.F


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (('[[load]]\nname = "handling"\nforce = [2, 2, -10]\n', ""), "needs a table [[load]]"),
        (('"actuator_force"', '"actuator_speed"'), "needs the table [motion]"),
        (('"actuator_force"', '"mass"'), "must be one of 'actuator_force'"),
        (
            ("[objective]", TASK.replace("min", "max") + "[objective]"),
            "objective.minimise needs no task: remove [[task]]",
        ),
        (("[objective]", 2 * TASK + "[objective]"), "at most once with objective.minimise"),
        (("minimise", "maximise"), "must be 'smallest_singular_value'"),
    ],
    ids=["no load", "no motion", "unknown", "sense", "two tasks", "maximise"],
)
def test_objectives_that_mean_nothing_are_refused(change: tuple[str, str], sentence: str) -> None:
    with pytest.raises(CaseError, match=re.escape(sentence)):
        case_from(edited(CORNERS, change))


def test_a_proof_file_states_the_root_of_what_its_tree_bounds(cli: Run, tmp_path: Path) -> None:
    case, proof = saved(tmp_path / "case.toml", CORNERS), tmp_path / "case.proof"
    status, _, _ = cli("certify", str(case), "--gap", "0.01", "--proof", str(proof))
    assert status == 0
    out = unbroken(output_of(cli("verify-proof", str(proof), str(case))))
    assert "PROOF VALID: the largest actuator force over all actuators and loads, at 8 poses is at least 7.45" in out
    stated = json.loads(proof.read_text())
    (claim,) = stated["claims"]
    claim["bound"] *= 1.03**2
    altered = saved(tmp_path / "altered.proof", json.dumps(stated))
    status, _, err = cli("verify-proof", str(altered))
    assert status == 1
    assert "rejected" in err


def test_what_has_no_meaning_for_objectives_of_actuators_is_refused(cli: Run, tmp_path: Path) -> None:
    case = str(saved(tmp_path / "case.toml", CORNERS))
    refusal_of(cli("codegen", case, "--out", str(tmp_path / "c")), "objective.minimise", "is not supported in C")
    goals = ("--goal", "min F", "--goal", "min limits.leg_length.max")
    refusal_of(cli("pareto", case, *goals), "the case optimises actuator_force")
    over = str(saved(tmp_path / "over.toml", BOX))
    refusal_of(cli("certify", over, "--proof", str(tmp_path / "x.proof")), "proof")


def test_every_speed_of_a_motor_that_turns_is_in_the_unit_of_angles_of_the_case() -> None:
    """One motor whose axis is that of the platform's only rotation has the platform's speed."""
    pivot = {"type": "R", "at": "0*x", "axis": "z", "actuated": True}
    tables = {
        "robot": {"definition": {"name": "pivot", "limb": [{"joints": [pivot]}]}},
        "pose": {"position": [0, 0, 0], "rotation": {"axis": [0, 0, 1], "angle": {"min": -30, "max": 30}}},
        "motion": {"angular": 90},
        "objective": {"minimise": "actuator_speed"},
        "limits": {"over": "workspace"},
        "workspace": {"position": [0, 0, 0], "rotation": {"axis": [0, 0, 1], "angle": {"min": -20, "max": 20}}},
    }
    found = result_of(solve(case_from_tables(tables, name="pivot", source="here"), starts=1))
    assert pytest.approx(90) == found.F
    assert [each.F for each in found.starts.optima] == [pytest.approx(90)]
    assert [each.F for each in found.workspace.designs] == [pytest.approx(90)]
