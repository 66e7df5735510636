"""Straight legs of robots given joint by joint: the same machine by its rows, and NumPy's geometry, agree with them."""

from __future__ import annotations

import copy
import itertools
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import Array, Run, case_from, output_of, refusal_of, saved, starter_tables, turn_about
from generated import made, needs_compiler, written
from measures import circle_joints, segment_distance

from screwsynth.models import Model, Substitution, robot, stewart_gough
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import Case, Nlp, Status, formulate, judge_workspace, margins_of, result_of, solve, text_of
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.formats.solved.mechanism_of import mechanism_of
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofError, read_proof
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.workspace.judge import Judgement
from screwsynth.nlp.proof.workspace.proof_writer import PaperRecord, paper_of
from screwsynth.nlp.proof.workspace.verdict import Outcome


Tables = dict[str, Any]

FREE = {
    "x1": {"min": 20, "max": 32, "start": 26.5},
    "x2": {"min": 8, "max": 15, "start": 11.543},
    "x3": {"min": 0, "max": 20, "start": 4},
    "x4": {"min": 0, "max": 25, "start": 9},
}
FIXED = {"x1": 26.5, "x2": 11.543, "x3": 5, "x4": 9}
TASK = {"sense": "max", "axis": [1, 2, 6], "point": [3, 1, 12], "pitch": 0.1}
MOVES = [{"translation": each} for each in ([0, 0, 0], [3, 0, 0], [0, -3, 2])]
#: A workspace with a translation and a turn, and limits that hold over it.
WORKSPACE = {
    "position": [{"min": -1, "max": 1}, 0, {"min": 19, "max": 21}],
    "rotation": {"axis": [0, 1, 1], "angle": {"min": -4, "max": 4}},
}
HELD = {
    "leg_length": {"min": 18, "max": 36},
    "actuator": {"stroke_max": 9.2, "dead_length": 4},
    "leg_clearance": {"min": 3},
}


def leg(base: str | list[float], platform: str | list[float], axis: object, **slide: object) -> list[Tables]:
    """The joints of a leg: a universal joint, a driven slide, and a spherical joint."""
    return [
        {"type": "U", "at": base, "axes": [[1, 0, 0], [0, 1, 0]]},
        {"type": "P", "at": base, "axis": axis, "actuated": True, **slide},
        {"type": "S", "at": platform},
    ]


def octahedral(axis: str = "A - B") -> Tables:
    """The robot file of a stewart-gough with octahedral layout, joint by joint, with its parameters as dimensions."""
    limbs = []
    for k, (sign, mark) in itertools.product(range(3), (("-", "-"), ("+", "+"))):
        other = "+" if sign == "-" else "-"
        b, a = f"({120 * k}*pi/180 {sign} x3)", f"({120 * k}*pi/180 {sign} pi/3 {other} x4)"
        points = {"B": [f"x1*cos{b}", f"x1*sin{b}", 0], "A": [f"x2*cos{a}", f"x2*sin{a}", "h"]}
        limbs.append({"name": f"{k + 1}{mark}", "points": points, "joints": leg("B", "A", axis)})
    dimensions: Tables = {"x1": {"typical": 26.5}, "x2": {"typical": 11.543}}
    dimensions |= {name: {"kind": "angle", "typical": typical} for name, typical in (("x3", 5), ("x4", 9))}
    dimensions["h"] = {"typical": 20}
    return {"name": "joints", "home": [0, 0, "h"], "dimensions": dimensions, "limb": limbs}


def tables(robot_tables: Tables | None, parameters: Tables, limits: Tables, **more: object) -> Tables:
    """A case about the octahedral robot by its rows, or about one joint by joint."""
    own: Tables = {"model": "stewart-gough", "layout": "octahedral", "parameters": parameters}
    if robot_tables is not None:
        own = {"definition": robot_tables, "parameters": parameters | {"h": 20}}
    found = {"robot": own, "pose": {"position": [0, 0, 20]}, "task": [TASK], "solve": {"starts": 4, "seed": 1}}
    return copy.deepcopy({**found, "limits": limits, **more})


def both(parameters: Tables, limits: Tables, **more: object) -> tuple[Case, Case]:
    """The same case by rows, and joint by joint."""
    rows, joints = (case_from(tables(each, parameters, limits, **more)) for each in (None, octahedral()))
    return rows, joints


def margins(nlp: Nlp, x: Array) -> dict[tuple[str, str], float]:
    """The numbers that limits speak of at a point, by their names and sides."""
    return {(each.name, each.bound): each.value for each in margins_of(nlp, x, optimal=False)}


# Optima: the two descriptions of one machine


@pytest.mark.parametrize(
    ("key", "limits", "poses"),
    [
        ("leg_length.max", {"leg_length": {"min": 24, "max": 26}}, 1),
        ("leg_clearance.min", {"leg_clearance": {"min": 3}}, 1),
        ("footprint.base", {"footprint": {"base": 28, "platform": 12.5}}, 1),
        ("joint_spacing.min", {"joint_spacing": {"min": 4}}, 1),
        ("radius_ratio.max", {"radius_ratio": {"max": 0.4}}, 1),
        ("actuator_rate.max", {"actuator_rate": {"max": 15}}, 1),
        ("actuator.stroke_max", {"actuator": {"stroke_max": 4.2}}, 3),
        ("actuator.dead_length", {"actuator": {"dead_length": 28}}, 3),
    ],
)
def test_a_limit_of_legs_leads_both_descriptions_to_one_optimum(key: str, limits: Tables, poses: int) -> None:
    pose = {"position": [0, 0, 20], "displacements": MOVES[:poses]} if poses > 1 else {"position": [0, 0, 20]}
    found = []
    for case in both(FREE, limits, pose=pose):
        solution = solve(case)
        result = result_of(solution)
        assert result.status is Status.OPTIMAL
        assert any(each.active and each.key == key for each in result.margins)
        found.append((result.F, margins(solution.outcomes[0].own.nlp, solution.outcomes[0].x), result.robot.parameters))
    (F, numbers, design), (other_F, other_numbers, other_design) = found
    assert other_F == pytest.approx(F, rel=1e-8)
    assert other_numbers.keys() == numbers.keys()
    for name, value in numbers.items():
        assert other_numbers[name] == pytest.approx(value, rel=1e-6, abs=1e-6), name
    for name in FREE:
        assert other_design[name] == pytest.approx(design[name], rel=1e-5, abs=1e-5)


def test_a_3_upu_by_its_joints_has_the_lengths_of_one_by_its_rows() -> None:
    limits = {
        "leg_length": {"min": 0.5, "max": 0.9},
        "leg_clearance": {"min": 0.1},
        "footprint": {"base": 0.6, "platform": 0.3},
        "joint_spacing": {"min": 0.1},
        "radius_ratio": {"max": 0.6},
    }
    found = []
    for own, radii in (
        ({"model": "three-upu", "axes": "tsai"}, ("base_radius", "platform_radius")),
        ({"model": "3-upu"}, ("rb", "rp")),
    ):
        parameters = dict(zip(radii, (0.57735, 0.288675), strict=True)) | ({"h": 0.7} if radii[0] == "rb" else {})
        push = {"sense": "max", "axis": [0.1, 0.2, 1], "pitch": math.inf}
        case = case_from(
            {
                "robot": {**own, "parameters": parameters},
                "pose": {"position": [0.05, -0.03, 0.7]},
                "task": [push],
                "limits": limits,
            }
        )
        result = result_of(solve(case))
        found.append((result.F, {(each.name, each.bound): each.value for each in result.margins}))
    assert found[1][0] == pytest.approx(found[0][0], rel=1e-9)
    assert len(found[0][1]) == 14
    assert found[1][1] == pytest.approx(found[0][1], rel=1e-8)


# Frames


def hexapod_at(Q: Array, base: Array, arms: Array, home: Array) -> Tables:
    """Six legs between points, all turned or mirrored by Q at home, where the platform's axes are those of the world."""
    limbs = []
    for b, a in zip(base @ Q.T, (home + arms) @ Q.T, strict=True):
        joints = leg(b.tolist(), a.tolist(), (a - b).tolist())
        joints[0]["axes"] = [(Q[:, k]).tolist() for k in (0, 1)]
        limbs.append({"joints": joints})
    return {"name": "turned", "home": (Q @ home).tolist(), "limb": limbs}


@pytest.mark.parametrize("mirror", [False, True])
def test_lengths_and_distances_do_not_depend_on_the_frame(*, mirror: bool) -> None:
    rng = np.random.default_rng(3)
    base, arms = circle_joints({"x1": 26.5, "x2": 11.543, "x3": 0.1, "x4": 0.2})
    base, arms = base + rng.uniform(-2, 2, base.shape), arms + rng.uniform(-1, 1, arms.shape)
    home, p, R = np.array([1.0, 2.0, 20.0]), np.array([2.0, 1.0, 21.0]), turn_about([1, 2, 3], 0.2)
    ends = p + arms @ R.T
    Q = turn_about(rng.normal(size=3), 2.0) @ (np.diag([1.0, -1.0, 1.0]) if mirror else np.eye(3))
    turned = Q @ R @ Q.T
    vector = ca.DM(ca.inv_skew(turned - turned.T)).full().ravel() / 2
    case = case_from(
        {
            "robot": {"definition": hexapod_at(Q, base, arms, home), "parameters": {}},
            "pose": {
                "position": (Q @ p).tolist(),
                "rotation": {"axis": vector.tolist(), "angle": math.degrees(0.2)},
            },
            "task": [TASK],
            "limits": {"leg_length": {"max": 1e3}, "leg_clearance": {"min": 1e-3}, "joint_spacing": {"min": 1e-3}},
        }
    )
    nlp = formulate(case)
    values = [each.value for each in margins_of(nlp, nlp.start, optimal=False)]
    lengths = np.linalg.norm(ends - base, axis=1)
    pairs = list(itertools.combinations(range(6), 2))
    apart = [segment_distance(base[i], ends[i], base[j], ends[j]) for i, j in pairs]
    spaced = [float(np.linalg.norm(plate[i] - plate[j])) for plate in (base, arms) for i, j in pairs]
    assert sorted(values) == pytest.approx(sorted([*lengths, *apart, *spaced]), rel=1e-6)


# Which limbs are legs


def test_the_legs_of_the_gallery() -> None:
    with_legs = {"6-ups": 6, "6-sps": 6, "4-upu": 4} | dict.fromkeys(
        ("3-upu", "3-rps", "3-spr", "planar-3-rpr", "tricept", "exechon"), 3
    )
    for name in gallery_names():
        model = build_model(name)
        assert len(model.legs) == with_legs.get(name, 0), name
        # A leg is a link of its limb at home, from a joint of the base to one of the platform.
        symbols = Substitution.identity(model).all
        typical = np.array([value for item in model.parameters for value in item.typical])
        home = [typical, np.zeros(len(model.unknowns)), np.eye(3), np.array(model.home)]
        links = {each.name: each for each in model.links}
        for own in model.legs:
            link = links[" to ".join(own.centres)]
            ends = [own.base, model.pose.position + own.platform, link.start, link.start + link.span]
            found = [np.array(each).ravel() for each in ca.Function("ends", symbols, ends)(*home)]
            assert np.array(found[:2]) == pytest.approx(np.array(found[2:]), abs=1e-9), (name, own.name)
    assert "4" not in {leg.name for leg in build_model("tricept").legs}


def with_joints(joints: list[Tables]) -> Model:
    """A 6-UPS with the joints of its last limb replaced."""
    definition = octahedral()
    definition["limb"][5]["joints"] = joints
    return robot(**definition)


UP, SPIN = leg("B", "A", "A - B"), {"type": "R", "at": "A", "axis": "A - B"}
HINGES = [{"type": "R", "at": "B", "axis": axis} for axis in ([1, 0, 0], [0, 1, 0])]
#: Joints of a limb that is a leg, whatever they are called and wherever a hinge is written on its axis.
LEGS = {
    "as written": UP,
    "two hinges through one point": [*HINGES, *UP[1:]],
    "a hinge written elsewhere on its axis": [HINGES[0] | {"at": "B + 7*x"}, *UP[1:]],
    "a slide that is written off the line": [UP[0], UP[1] | {"at": [0, 0, 3]}, UP[2]],
    "against the line": [UP[0], UP[1] | {"axis": "B - A"}, UP[2]],
    "a leg that spins": [*UP[:2], SPIN, {"type": "U", "at": "A", "axes": [[1, 0, 0], [0, 1, 0]]}],
    "the slide beside the platform": [UP[0], UP[1] | {"at": "A"}, UP[2]],
}
#: Joints of a limb that is none.
OTHERS = {
    "a slide that leans": [UP[0], UP[1] | {"axis": "A - B + x"}, UP[2]],
    "a passive slide": [*UP[:2], {"type": "P", "at": "A", "axis": [0, 0, 1]}, {"type": "U", "at": "A", "axes": [[1, 0, 0], [0, 1, 0]]}],
    "a slide on the base": [UP[1], UP[0], UP[2]],
    "a hinge off the line": [HINGES[0] | {"at": "B + 3*y"}, *UP[1:]],
    "a driven hinge and a rod": [HINGES[0] | {"actuated": True}, {"type": "U", "at": [20, -20, 5], "axes": [[1, 0, 0], [0, 1, 0]]}, UP[2]],
}  # fmt: skip


@pytest.mark.parametrize("kind", LEGS)
def test_a_driven_slide_between_two_centres_is_a_leg(kind: str) -> None:
    model, by_rows = with_joints(LEGS[kind]), stewart_gough(layout="octahedral")
    assert len(model.legs) == 6
    values = [26.5, 11.543, math.radians(5), math.radians(9)]
    for own, other in zip(model.legs, by_rows.legs, strict=True):
        for end in ("base", "platform"):
            found, expected = (
                ca.evalf(ca.substitute(getattr(each, end), ca.vertcat(*[p.symbol for p in m.parameters]), ca.DM(numbers)))
                for each, m, numbers in ((own, model, [*values, 20]), (other, by_rows, values))
            )
            assert found.full() == pytest.approx(expected.full(), abs=1e-9)


@pytest.mark.parametrize("kind", OTHERS)
def test_another_limb_is_no_leg(kind: str) -> None:
    assert [leg.name for leg in with_joints(OTHERS[kind]).legs] == ["1-", "1+", "2-", "2+", "3-"]
