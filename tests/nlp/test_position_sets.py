"""Workspaces with sets of positions: disc, ring, cylinder, ball, cone, half spaces, in search, checker and case files."""

import json
import math
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from builders import case_from
from hypothesis import given, settings
from hypothesis import strategies as st
from workspace_cases import on_paper, only, rejected, stating

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, Free, Outcome, Workspace, judge_workspace
from screwsynth.nlp.case.positionsets import HalfSpace, PositionSet, SetKind
from screwsynth.nlp.proof.checker.proof_file import set_numbers, workspace_numbers
from screwsynth.nlp.proof.checker.tree import Node
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.checker.workspace.pose_boxes import pose_root
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box, scaled
from screwsynth.nlp.proof.workspace.scale import largest_scale

#: Linear Delta with the dimensions of LinuxCNC's lineardeltakins, and its carriages' stroke.
DELTA = """
name = "Linear delta"
description = "three vertical carriages, each with two rods to the platform"
home = [0, 0, "h"]
[dimensions]
R = { typical = 130.25, description = "radius of the carriage joints less that of the platform joints" }
rp = { typical = 33, description = "radius of the platform joints" }
L = { typical = 269, description = "length of the rods" }
w = { typical = 50, description = "distance between the rods" }
[derived]
h = "-sqrt(L^2 - R^2)"
[[limb]]
repeat = { count = 3 }
points = { E = ["R + rp", 0, 0], A = ["rp", 0, "h"] }
joints = [{ type = "P", at = "E", axis = "z", actuated = true }]
branch = [
    { joints = [{ type = "S", at = "E + w/2*y" }, { type = "S", at = "A + w/2*y" }] },
    { joints = [{ type = "S", at = "E - w/2*y" }, { type = "S", at = "A - w/2*y" }] },
]
"""
RADIUS, ROD = 130.25, 269.0
HOME = -math.sqrt(ROD**2 - RADIUS**2)
#: Pillars of the printer about the vertical axis.
PILLARS = np.array([[math.cos(k), math.sin(k)] for k in (0.0, 2 * math.pi / 3, 4 * math.pi / 3)])
LOWEST = -120.0


def delta(folder: Path, position: object, least: float = LOWEST, most: float = 500.0, unit: float = 1.0) -> Case:
    """Linear Delta over positions, with carriages between two heights; all lengths times a unit."""
    (folder / "delta.toml").write_text(DELTA)
    tables = {
        "robot": {
            "file": str(folder / "delta.toml"),
            "parameters": {"R": RADIUS * unit, "rp": 33 * unit, "L": ROD * unit, "w": 50 * unit},
        },
        "pose": {"position": [0, 0, HOME * unit]},
        "task": [{"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
        "workspace": {"position": position},
        "limits": {"actuator_length": {"min": least * unit, "max": most * unit}},
    }
    return case_from(tables, "printer")


def heights(points: FloatArray) -> FloatArray:
    """Heights (N, 3) of the carriages at positions (N, 3), in closed form."""
    off = RADIUS * PILLARS - points[:, None, :2]
    return np.asarray(points[:, 2:] + np.sqrt(ROD**2 - (off**2).sum(axis=2)))


def test_printable_diameter_of_a_linear_delta(tmp_path: Path) -> None:
    """The lowest carriage reaches its stop where R + r is the horizontal reach of a rod."""
    z = -235.0
    exact = 2 * (math.sqrt(ROD**2 - (LOWEST - z) ** 2) - RADIUS)
    for unit in (1.0, 1e-6):
        case = delta(tmp_path, {"disc": {"diameter": 160 * unit, "z": z * unit}}, unit=unit)
        found = largest_scale(case)
        assert found.factor is not None
        assert exact * (1 - 1e-3) <= 160 * found.factor <= exact
        assert found.positions is not None
        assert 2 * found.positions.radius == pytest.approx(160 * unit * found.factor)
        assert found.refuted
        assert found.pose is not None
        # The pose beyond violates the limit, on the rim of the next disc.
        at = found.pose.position / unit
        assert heights(at[None]).min() < LOWEST
        assert 2 * math.hypot(*at[:2]) <= 160 * found.failed * (1 + 1e-9)


def test_only_the_radius_is_scaled(tmp_path: Path) -> None:
    disc = {"disc": {"radius": 30, "z": [-260, -230], "centre": [10, 5]}}
    case = delta(tmp_path, disc)
    assert case.workspace is not None
    larger = scaled(case.workspace, 2.0)
    assert larger.position_set is not None
    assert larger.position_set.radius == 60
    assert larger.position[2] == case.workspace.position[2]
    assert larger.turns == case.workspace.turns


def test_corners_of_the_box_outside_of_the_disc_refute_nothing(tmp_path: Path) -> None:
    z, disc = -235.0, {"disc": {"radius": 110.0, "z": -235.0}}
    ends = [{"min": -110.0, "max": 110.0}, {"min": -110.0, "max": 110.0}, z]
    # The carriage of the first pillar stays above its stop in the disc, not at the corners of the box.
    rim = np.array([[-110.0 * math.cos(a), 110.0 * math.sin(a), z] for a in np.linspace(0, 2 * math.pi, 100_000)])
    corners = np.array([[x, y, z] for x in (-110.0, 110.0) for y in (-110.0, 110.0)])
    with np.errstate(invalid="ignore"):
        assert np.isnan(heights(corners)).any()
    assert LOWEST < heights(rim).min()
    round_case, square = delta(tmp_path, disc), delta(tmp_path, ends)
    judged = judge_workspace(round_case)
    assert judged.is_proved
    assert judge_workspace(square, until_fault=True).is_refuted
    lengths = [each for each in judged.extremes if each.name.startswith("actuator_length")]
    assert len(lengths) == 6
    least = min(each.bound for each in lengths if each.sense.value == "min")
    assert LOWEST <= least <= heights(rim).min()


def test_a_box_as_a_set_is_the_box(tmp_path: Path) -> None:
    ends = [{"min": -40.0, "max": 40.0}, {"min": -30.0, "max": 30.0}, {"min": -240.0, "max": -230.0}]
    far = {"normal": [1.0, 1.0, 0.0], "point": [500.0, 0.0, 0.0]}
    plain, cut = delta(tmp_path, ends), delta(tmp_path, {"box": ends, "half_spaces": [far]})
    every = [judge_workspace(case, quantities=["actuator_length"]) for case in (plain, cut)]
    for one, other in zip(*(each.extremes for each in every), strict=True):
        assert one.name == other.name
        assert one.outcome is other.outcome is Outcome.PROVED
        if one.limit is None:
            assert other.bound == pytest.approx(one.bound, rel=2e-3)


def test_proof_of_a_disc(tmp_path: Path) -> None:
    case = delta(tmp_path, {"disc": {"radius": 100.0, "z": [-236.0, -235.0]}})
    proof = on_paper(case)[1]
    assert not proof.unproved
    checked = check_workspace_proof(proof, case)
    assert len(checked.claims) == 13
    # The premise in the file is not used by the check, and another one is refused.
    for other in ({"radius": 101.0}, {"radius": 99.0}, {"centre": [0.5, 0.0]}, {"z": [-237.0, -235.0]}):
        changed = delta(tmp_path, {"disc": {"radius": 100.0, "z": [-236.0, -235.0]} | other})
        assert "another workspace" in rejected(proof, changed)
    box = delta(tmp_path, [{"min": -100.0, "max": 100.0}] * 2 + [{"min": -236.0, "max": -235.0}])
    assert "another workspace" in rejected(proof, box)
    # Without the premise, claims must be proved on the set of the case: more poses need other trees.
    wide = delta(tmp_path, {"disc": {"radius": 125.0, "z": [-236.0, -235.0]}})
    assert wide.workspace is not None
    numbers = {"workspace": workspace_numbers(wide.workspace), "position_set": set_numbers(wide.workspace)}
    forged = only(stating(proof, **numbers), "actuator_length limb 1", "min")
    assert "does not keep" in rejected(forged, wide) or "could not be shown" in rejected(forged, wide)
    assert "not outside" in rejected(only(proof, "regular", tree=bytes([Node.OUTSIDE])), case)
    tight = delta(tmp_path, {"disc": {"radius": 112.9, "z": -235.0}})
    proof = only(on_paper(tight)[1], "actuator_length limb 1", "min")
    assert check_workspace_proof(proof, tight).claims[0].limit == LOWEST
