"""Limits on joints and links of robots joint by joint, by forward kinematics; every limit at every leg and pose."""

from __future__ import annotations

import copy
import itertools
import math
import pickle
import tomllib
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import builders
import casadi as ca
import numpy as np
import pytest
from builders import Array, Run, case_from, case_of, edited, saved_with_robot, soaked, starter_tables, turn_about
from casadi import SX
from generated import COMPILERS, written
from measures import circle_joints, leg_measures, segment_distance

import screwsynth.models
from screwsynth.models import Model, Substitution, robot, stewart_gough
from screwsynth.nlp import Case, Limits, Nlp, Search, Status, Task, certify, evaluate, formulate, load_case, solve
from screwsynth.nlp.case.limits.clearance import LinkClearance
from screwsynth.nlp.case.limits.constraint import NUMBER, BoundedConstraint, Constraint
from screwsynth.nlp.case.limits.joint_motion import JointCone, JointMotion
from screwsynth.nlp.case.limits.rates import ActuatorRate
from screwsynth.nlp.embedding.library import load_compiled
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.margins import margins_of
from screwsynth.nlp.evidence.sensitivity import Hindrance, sensitivities
from screwsynth.nlp.program.places import FreeRotation
from screwsynth.nlp.program.repeated import without_repeated
from screwsynth.nlp.program.sampling import starting_points
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus

Place = tuple[Array, Array]

B, E, A, M = [1.0, 0.1, 0.0], [1.1, -0.2, 0.5], [0.6, 0.2, 1.1], [0.8, 0.3, 0.6]


def joint(kind: str, at: list[float], *axes: list[float], **others: object) -> dict[str, Any]:
    own: dict[str, Any] = {"axis": axes[0]} if len(axes) == 1 else {"axes": list(axes)} if axes else {}
    return {"type": kind, "at": at, **own, **others}


DRIVEN = {"actuated": True}
C, H, P, Pa, R, S, U = (partial(joint, kind) for kind in ("C", "H", "P", "Pa", "R", "S", "U"))
U1, U2 = U(B, [1, 0.1, 0], [0, 1, 0.2]), U(A, [0.2, 1, 0], [1, 0, 0.3])
#: Limbs of every form of opening: with the joint at which the path is opened, rods, and joints that are taken as one.
LIMBS = {
    "spherical at the end": [R(B, [0, 1, 0]), P(B, [-0.4, 0.1, 1.1], **DRIVEN), S(A)],
    "driven rod": [U1, P(B, [-0.4, 0.1, 1.1], **DRIVEN), S(A)],
    "driven rod, slide aside": [U1, P(M, [0.1, 0.2, 1], **DRIVEN), S(A)],
    "driven rod, slide against": [U1, P(M, [0.1, 0.2, -1], **DRIVEN), S(A)],
    "rod from the platform": [S(B), P(M, [0.1, 0.2, 1], **DRIVEN), U2],
    "crank and rod": [R(B, [0, 1, 0], **DRIVEN), U(E, [1, 0, 0.2], [0.1, 1, 0]), S(A)],
    "rod before a hinge": [U(E, [1, 0, 0.2], [0, 1, 0]), S(A), R([0.4, 0, 0.6], [0, 1, 0.3], **DRIVEN)],
    "universal": [U1, P(M, [-0.4, 0.1, 1.1], **DRIVEN), U2],
    "hinge": [R(B, [0, 1, 0.1], **DRIVEN), R(E, [0, 1, 0]), R(A, [0.1, 1, 0])],
    "helical": [H(B, [0, 0.2, 1], pitch=0.1), P(B, [0, 1, 0], **DRIVEN), R(E, [1, 0, 0]), U(A, [1, 0.1, 0], [0, 1, 0])],
    "cylindrical": [C(B, [0, 0.2, 1]), R(E, [1, 0, 0], **DRIVEN), U(A, [1, 0.1, 0], [0, 1, 0])],
    "two hinges as one": [R(B, [1, 0, 0]), R(B, [0, 1, 0.4]), P(M, [-0.4, 0.1, 1.1], **DRIVEN), U2],
    "three hinges as one": [
        R(B, [0, 1, 0], **DRIVEN), R(E, [0, 1, 0.2]), R(A, [1, 0, 0]), R(A, [0.3, 1, 0]), R(A, [0, 0.2, 1]),
    ],
    "hinge and universal as one": [
        R(B, [0, 1, 0], **DRIVEN), R(E, [0, 1, 0.2]), R(A, [1, 0, 0]), U(A, [0.3, 1, 0], [0, 0.2, 1]),
    ],
    "parallelogram": [R(B, [0, 1, 0], **DRIVEN), R(E, [0, 1, 0]), Pa(E, [1, 0, 0.3], to=A), R(A, [0, 1, 0.1])],
}  # fmt: skip


def moved(each: dict[str, Any], q: Array) -> Place:
    """Displacement of a joint's far side by finite coordinates: R and t of ``x -> R x + t``."""
    p, kind = np.array(each["at"]), each["type"]
    if kind == "P":
        return np.eye(3), q[0] * np.array(each["axis"]) / np.linalg.norm(each["axis"])
    if kind == "Pa":
        rod = np.array(each["to"]) - p
        return np.eye(3), turn_about(each["axis"], q[0]) @ rod - rod
    if kind == "S":
        R = turn_about(list(q), float(np.linalg.norm(q)))
    elif kind == "U":
        R = turn_about(each["axes"][0], q[0]) @ turn_about(each["axes"][1], q[1])
    else:
        R = turn_about(each["axis"], q[0])
    along = q[1] if kind == "C" else q[0] * each.get("pitch", 0.0)
    step = along * np.array(each.get("axis", [0, 0, 0])) / np.linalg.norm(each.get("axis", [1]))
    return R, p - R @ p + step


def forward(limb: list[dict[str, Any]], coordinates: list[Array]) -> list[Place]:
    """Displacement of every body from the base on, the platform last."""
    places: list[Place] = [(np.eye(3), np.zeros(3))]
    for each, q in zip(limb, coordinates, strict=True):
        R, t = places[-1]
        own, step = moved(each, q)
        places.append((R @ own, R @ step + t))
    return places


def unknowns_at(model: Model, platform: Place) -> Array:
    """Unknowns that close the loops with the platform at a place, from home."""
    own = Substitution.identity(model)
    loops, closure = (ca.vertcat(ca.SX(0, 1), *[each.scaled for each in part]) for part in (model.loops, model.closure))
    slopes = ca.jacobian(closure, own.unknowns)
    function = ca.Function("loops", own.all, [ca.densify(each) for each in (closure, slopes, loops)])
    z = np.zeros(len(model.unknowns))
    for _ in range(30):
        residual, J, every = (each.full() for each in function(np.zeros(0), z, *platform))
        z = z - np.linalg.lstsq(J, residual.ravel(), rcond=1e-10)[0] if len(z) else z
    assert np.abs(every).max(initial=0.0) < 1e-11
    return z


def measured(model: Model, platform: Place) -> dict[str, Array]:
    """Coordinates of the model's joints by label, with the platform at a place."""
    outputs = [ca.vertcat(ca.SX(0, 1), *[one.measured for one in each.coordinates]) for each in model.joints]
    function = ca.Function("joints", Substitution.identity(model).all, [ca.densify(each) for each in outputs])
    values = function.call([np.zeros(0), unknowns_at(model, platform), *platform])
    return {each.label: np.array(value).ravel() for each, value in zip(model.joints, values, strict=True)}


SIZES = {"U": 2, "C": 2, "S": 3}


def coordinates_of(limb: list[dict[str, Any]], seed: int) -> list[Array]:
    rng = np.random.default_rng(seed)
    reach = {"P": 0.15}
    return [rng.uniform(-1, 1, SIZES.get(each["type"], 1)) * reach.get(each["type"], 0.5) for each in limb]


@pytest.mark.parametrize("name", LIMBS)
def test_coordinates_of_joints_are_those_of_forward_kinematics(name: str) -> None:
    limb = LIMBS[name]
    model = robot(name="limb", limb=[{"joints": limb}])
    for seed in range(3):
        given = coordinates_of(limb, seed)
        found = measured(model, forward(limb, given)[-1])
        for k, (each, q) in enumerate(zip(limb, given, strict=True)):
            expected = [] if each["type"] == "S" else q
            assert found[f"1:{k + 1}"] == pytest.approx(expected, abs=1e-8)


#: The first of three limbs with a crank and a rod, in turns of 120 degrees about z.
RUS = [
    joint("R", B, [0, 1, 0], name="crank", **DRIVEN),
    joint("U", E, [1, 0, 0.2], [0.1, 1, 0], name="elbow"),
    joint("S", A, name="ball"),
]
TURN = [0.1, -0.05, 0.12]


def rus_case(**limits: object) -> Case:
    axis = [float(each) for each in np.array(TURN) / np.linalg.norm(TURN)]
    return case_of(
        {"definition": {"name": "rus", "limb": [{"joints": RUS, "repeat": {"count": 3}}]}},
        pose={"position": [0.05, -0.03, -0.05], "rotation": {"axis": axis, "angle": math.degrees(math.hypot(*TURN))}},
        task=[{"name": "one", "sense": "max", "axis": [0, 0.3, 1], "point": [0.2, 0, 0], "pitch": 0.1}],
        limits=limits,
    )


def turned(limb: list[dict[str, Any]], Q: Array) -> list[dict[str, Any]]:
    def of(value: list[float]) -> list[float]:
        x, y, z = (float(each) for each in Q @ np.array(value))
        return [x, y, z]

    keys = ("at", "axis", "to")
    return [
        {k: of(v) if k in keys else [of(one) for one in v] if k == "axes" else v for k, v in each.items()}
        for each in limb
    ]


def inverse(limb: list[dict[str, Any]], *platforms: Place) -> list[Array]:
    """Coordinates of a limb with six, by Newton's method on finite differences, along places of the platform."""
    sizes = [SIZES.get(each["type"], 1) for each in limb]

    def residual(z: Array, platform: Place) -> Array:
        R, t = forward(limb, np.split(z, np.cumsum(sizes)[:-1]))[-1]
        return np.concatenate([(R - platform[0]).ravel(), t - platform[1]])

    z = np.full(sum(sizes), 1e-3)
    for place in platforms:
        for _ in range(5):
            J = np.column_stack([residual(z + h, place) - residual(z - h, place) for h in 1e-6 * np.eye(len(z))]) / 2e-6
            z = z - np.linalg.lstsq(J, residual(z, place), rcond=None)[0]
    assert np.abs(residual(z, platforms[-1])).max() < 1e-10
    return np.split(z, np.cumsum(sizes)[:-1])


def angle_between(one: Array, other: Array) -> float:
    return math.atan2(float(np.linalg.norm(np.cross(one, other))), float(one @ other))


def test_margins_are_those_of_finite_motions_of_all_copies() -> None:
    """Cranks, elbows, cones about the link and about an axis, distances of links and rates, at one pose."""
    up = [0.1, 0.2, 1.0]
    case = rus_case(
        joint={
            "crank": {"min": -80, "max": 85},
            "elbow": {"first": {"max": 80}, "second": {"min": -80}, "cone": 89, "axis": up},
            "ball": {"cone": 88},
            "2:3": {"cone": 87, "axis": up},
        },
        link_clearance={"min": 0.9},
        actuator_rate={"max": 5},
    )
    nlp = formulate(case)
    x = close_equations(nlp, nlp.start)
    rows = {(row.key, row.name.rpartition(" joint ")[2]): row.value for row in margins_of(nlp, x, optimal=False)}
    others = {row.name: row.value for row in margins_of(nlp, x, optimal=False)}
    again = pickle.loads(pickle.dumps(nlp))  # noqa: S301 - its own pickle
    margins = [[vars(row) for row in margins_of(each, x, optimal=False)] for each in (again, nlp)]
    assert margins[0] == margins[1]
    angle, p = float(np.linalg.norm(TURN)), np.array([0.05, -0.03, -0.05])
    way = [(turn_about(TURN, s * angle), s * p) for s in (0.5, 1)]
    R, _ = way[-1]
    links: dict[str, tuple[Array, Array]] = {}
    for k in range(3):
        Q = turn_about([0, 0, 1], 2 * math.pi * k / 3)
        limb, label = turned(RUS, Q), str(k + 1)
        found = inverse(limb, *way)
        (R1, t1), (R2, t2) = forward(limb, found)[1:3]
        places = [np.array(each["at"]) for each in limb]
        rod = R2 @ (places[2] - places[1])
        elbow, ball = R1 @ places[1] + t1, R2 @ places[2] + t2
        expected = {
            ("joint.crank.max", f"{label}:1"): found[0][0],
            ("joint.elbow.first.max", f"{label}:2"): found[1][0],
            ("joint.elbow.second.min", f"{label}:2"): found[1][1],
            ("joint.elbow.cone", f"{label}:2"): angle_between(rod, R1 @ Q @ up),
            ("joint.ball.cone", f"{label}:3"): angle_between(rod, R @ (places[2] - places[1])),
        }
        if k == 1:
            expected["joint.2:3.cone", "2:3"] = angle_between(rod, R @ Q @ up)
        for key, value in expected.items():
            assert rows[key] == pytest.approx(value, abs=1e-8), key
        links |= {f"{label}:1 to {label}:2": (places[0], elbow), f"{label}:2 to {label}:3": (elbow, ball)}
    pairs = [each for each in itertools.combinations(links, 2) if each[0][0] != each[1][0]]
    assert len(pairs) == 12
    for one, other in pairs:
        name = f"link_clearance links {one} and {other}"
        if name in others:
            assert others[name] == pytest.approx(segment_distance(*links[one], *links[other]), abs=1e-9)
    # The two links of a limb share a joint.
    assert sum(name.startswith("link_clearance") for name in others) == 12
    # The rates are those of the cranks along the task's motion.
    omega, v = np.array(case.tasks[0].twist[:3]), np.array(case.tasks[0].twist[3:])
    h = 1e-5
    for k in range(3):
        limb = turned(RUS, turn_about([0, 0, 1], 2 * math.pi * k / 3))
        ahead, behind = (
            inverse(limb, *way, (turn_about(list(omega), s * h * float(np.linalg.norm(omega))) @ R,
                                 turn_about(list(omega), s * h * float(np.linalg.norm(omega))) @ p + s * h * v))[0][0]
            for s in (1, -1)
        )  # fmt: skip
        assert others[f"actuator_rate actuator {k + 1}"] == pytest.approx(abs(ahead - behind) / (2 * h), rel=1e-4)


RPS = edited(
    (Path(screwsynth.models.__file__).parent / "robots" / "3-rps.toml").read_text(encoding="utf-8"),
    ("actuated = true", 'actuated = true, name = "slide"'),
    ('"S"', '"S", name = "ball"'),
)
RPS_CASE = """
units.length = "m"
robot = { file = "robot.toml", parameters = PARAMETERS }
pose.position = [{ min = -0.3, max = 0.3 }, { min = -0.3, max = 0.3 }, { min = 0.9, max = 1.3 }]
pose.rotation.angle = { min = -30, max = 30 }
task = [{ sense = "max", axis = [1, 0.3, 0], point = [0, 0, 1.1], pitch = 0.2 }]
""".replace("PARAMETERS", "{ rb = { min = 0.8, max = 1.2 }, rp = { min = 0.4, max = 0.7 }, h = 1.1 }")
SLIDE = "[limits.joint]\nslide = { min = -0.05, max = 0.08 }\n"


def test_an_active_limit_has_its_cost_and_a_case_file_of_its_own(tmp_path: Path) -> None:
    limits = SLIDE + '"1:1" = { min = -5 }\nball = { cone = 20 }\n'
    case = replace(load_case(saved_with_robot(tmp_path, RPS, RPS_CASE + limits)), search=Search(starts=3))
    slide, hinge = JointMotion("slide", min=-0.05, max=0.08), JointMotion("1:1", min=-math.radians(5))
    assert case.limits == Limits(slide, hinge, JointCone("ball", math.radians(20)))
    assert case_from(case.to_toml(), "case").limits == case.limits

    def solved(step: float) -> float:
        moved = JointMotion("slide", min=-0.05, max=0.08 + step)
        solution = solve(replace(case, limits=Limits(moved, *case.limits.items[1:])))
        assert solution.status is Status.OPTIMAL
        return solution.F

    solution = solve(case)
    own = solution.outcomes[0].own
    rows = [row for row in margins_of(own.nlp, own.x, optimal=True) if row.key == "joint.slide.max" and row.active]
    assert [row.value for row in rows] == pytest.approx([0.08] * 2, abs=1e-9)
    assert sum(row.cost or 0.0 for row in rows) == pytest.approx((solved(1e-4) - solved(-1e-4)) / 2e-4, rel=1e-4)


REFUSALS = {
    "slade = { max = 1 }": "limits.joint.slade: no such joint of '3-RPS'; allowed: slide, ball, 1:1, 1:2, 1:3",
    '"4:1" = { max = 1 }': "limits.joint.4:1: no such joint of '3-RPS'",
    '"1:ball" = { max = 1 }': "limits.joint.1:ball: joint 1:3 is of type S; allowed is only cone",
    '"1:1" = { cone = 9 }': "limits.joint.1:1.cone: joint 1:1 (R) has no cone: cone is allowed only for joints U and S",
    '"1:1" = { first = { max = 9 } }': "limits.joint.1:1.first: joint 1:1 is of type R; allowed are min and max",
    '"1:1" = {}': "limits.joint.1:1: is empty: it must have min, max, first, second, angle, stroke or cone",
    '"1:1" = { max = 181 }': "limits.joint.1:1.max = 181.0: must be finite and at most 180 deg",
    '"1:1" = { min = -181 }': "limits.joint.1:1.min = -181.0: must be at least -180 deg",
    '"1:1" = { min = 9, max = 3 }': "limits.joint.1:1.min = 9.0: must be below max = 3 deg",
    '"1:1" = { max = nan }': "limits.joint.1:1.max = nan: must be finite",
    '"1:1" = { max = "9" }': 'limits.joint.1:1.max = "9": must be a number',
    '"1:1" = { mux = 9 }': "limits.joint.1:1.mux: no such key; did you mean 'max'?",
    '"1:1" = 9': "limits.joint.1:1 = 9: must be a table",
    "ball = { cone = 0 }": "limits.joint.ball.cone = 0.0: must be above 0 deg and at most 180 deg",
    "ball = { axis = [0, 0, 1] }": "limits.joint.ball",
    "ball = { cone = 9, axis = [0, 0, 0] }": "limits.joint.ball.axis = [0.0, 0.0, 0.0]: must be three finite numbers",
    "ball = { cone = 9, axis = [0, 0] }": "limits.joint.ball.axis: must",
    "[limits]\nbase_joint_angle = 30": "limits.base_joint_angle: no such limit for the robot '3-RPS'",
    "[limits]\nlink_clearance = { min = 0 }": "limits.link_clearance.min = 0.0: must be above 0 m",
    "[limits]\nactuator_rate = { max = -1 }": "limits.actuator_rate.max = -1.0: must be above 0",
    "[limits]\njoint = 3": "limits.joint = 3: must be a table",
}


def test_limits_that_mean_nothing_are_refused_in_one_sentence(tmp_path: Path) -> None:
    single = edited(RPS, ("count = 3", "count = 1"))
    for text, fault in REFUSALS.items():
        limits = text if text.startswith("[") else f"[limits.joint]\n{text}"
        with pytest.raises(CaseError) as error:
            load_case(saved_with_robot(tmp_path, single, RPS_CASE + limits))
        sentence = str(error.value)
        assert sentence.startswith("case.toml: "), text
        assert fault in sentence, (text, sentence)
        assert "\n" not in sentence
    two = RPS.replace('type = "R", at', 'type = "R", name = "slide", at')
    with pytest.raises(CaseError, match=r"robot\.toml: limb 1, joints: has two joints with the name 'slide'"):
        load_case(saved_with_robot(tmp_path, two, RPS_CASE + SLIDE))
    legs = case_from(starter_tables(stewart_gough()), "legs")
    for limit, key in ((JointMotion("1:1", max=1.0), "joint.1:1"), (LinkClearance(1.0), "link_clearance")):
        with pytest.raises(
            CaseError, match=rf"limits\.{key}: no such limit for the robot 'stewart-gough'; allowed: leg_length"
        ):
            replace(legs, limits=Limits(limit))
    rods = robot(name="rods", limb=[{"joints": [joint("S", B), joint("S", A)]}, {"joints": LIMBS["hinge"]}])
    with pytest.raises(CaseError, match="joint 1:1 is of type S"):
        Case(rods, {}, (0.0, 0.0, 0.0), legs.tasks, limits=Limits(JointMotion("1:1", max=1.0)))


def test_rates_of_legs_are_work_rates_and_a_proof_treats_ranges_cones_and_clearance() -> None:
    case = case_from(starter_tables(stewart_gough()), "legs")
    nlp = formulate(replace(case, limits=Limits(ActuatorRate(2.0))))
    rows = [row.value for row in margins_of(nlp, nlp.start, optimal=False)]
    assert sorted(rows) == pytest.approx(sorted(np.abs(evaluate(nlp, nlp.start).rates)), rel=1e-12)
    # The angle of the joint at which a hinged limb is opened has a proof too: it is written without an arc
    # tangent.
    model = robot(name="hinges", limb=[{"joints": LIMBS["hinge"]}, {"joints": LIMBS["universal"]}])
    turn = [Task.screw("max", axis=[0, 1, 0], point=[0, 0, 0], pitch=0)]
    case = Case(model, {}, (0.0, 0.0, 0.0), turn, limits=Limits(JointMotion("1:2", max=1.0), JointCone("2:1", 1.0)))
    assert certify(case).certificate.status is CertificateStatus.PROVED
    # Distances of links are made of pieces, which are covered too; this box has no design that keeps the limit.
    apart = certify(replace(case, limits=Limits(LinkClearance(2.0)))).certificate
    assert apart.status in (CertificateStatus.PROVED, CertificateStatus.INFEASIBLE)


def test_numbers_of_joints_are_set_on_the_command_line(tmp_path: Path, cli: Run) -> None:
    name = saved_with_robot(tmp_path, RPS, RPS_CASE + SLIDE)
    for setting, shown in (
        ("limits.joint.slide.max=0.01", "joint.slide.max"),
        ("limits.joint.1:1.min=-7", "joint.1:1.min"),
        ("limits.joint.ball.cone=30", "joint.ball.cone"),
    ):
        out = builders.output_of(cli("evaluate", name, "--set", setting, "--set", "rb=1", "--set", "p_z=1.1"))
        assert shown in out


def test_links_begin_on_the_body_that_moves_with_a_slide() -> None:
    """A link behind a slide begins where the slide is; a slide along its link makes the link longer."""
    for slide, limb in (
        (0, [P(B, [0, 0.2, 1], **DRIVEN), R(B, [0, 1, 0]), S(A)]),
        (1, [R(B, [0, 1, 0]), P(B, [-0.4, 0.1, 1.1], **DRIVEN), S(A)]),
        (1, [U1, P([0.8, 0.15, 0.55], [-0.4, 0.1, 1.1], **DRIVEN), S(A)]),
        (1, [R(B, [0, 1, 0]), P(B, [0, 0.2, 1], **DRIVEN), S(A)]),
    ):
        model = robot(name="limb", limb=[{"joints": limb}])
        (link,) = model.links
        given = coordinates_of(limb, 1)
        places = forward(limb, given)
        outputs = [link.start, link.start + link.span]
        function = ca.Function("link", Substitution.identity(model).all, [ca.densify(each) for each in outputs])
        values = function.call([np.zeros(0), unknowns_at(model, places[-1]), *places[-1]])
        start, end = (np.array(each).ravel() for each in values)
        R1, t1 = places[1 if slide == 0 else 0]
        assert start == pytest.approx(R1 @ np.array(B) + t1, abs=1e-8)
        assert end == pytest.approx(places[-1][0] @ np.array(A) + places[-1][1], abs=1e-8)


HOME = np.array([0, 0, 20.0])


def worst_numbers(numbers: dict[str, float], R: Array, twist: Array) -> dict[str, float]:
    """What each limit of the hexapod speaks of, over all legs."""
    base, platform = circle_joints(numbers)
    p = np.array([numbers["p_x"], numbers["p_y"], numbers["p_z"]])
    at_home = HOME + platform - base
    u = p + platform @ R.T - base
    u /= np.linalg.norm(u, axis=1)[:, None]
    squares = (u @ twist[3:] + np.cross(base, u) @ twist[:3]) ** 2
    share = {"rate_share.max": float((squares / squares.sum()).max())}
    return leg_measures(base, platform, R, p, at_home, at_home @ R.T) | share


def kept(nlp: Nlp, x: Array, p: Array) -> dict[str, float]:
    """The worst number of each limit in the constraints of a program, at any values of variables and arguments."""
    constraints = nlp.program.constraints
    expressions = [each.expression if each.exact is None else each.exact for each in constraints]
    values = ca.Function("g", [nlp.program.x, nlp.program.p], [ca.vertcat(*expressions)])(x, p).full().ravel()
    found: dict[str, list[float]] = {}
    for each, value in zip(constraints, values, strict=True):
        for key in each.keys:
            if key and (key.endswith(".min") or "max" in key or "footprint" in key):
                number = float(value) if each.exact is not None else each.reading.from_value(float(value))
                found.setdefault(key, []).append(number)
    return {key: min(values) if key.endswith(".min") else max(values) for key, values in found.items()}


@pytest.mark.parametrize("name", ["hexapod-machining", "hexapod-workspace", "free-wrist", "drilling-spindle"])
def test_constraints_judge_every_leg_at_any_numbers(name: str) -> None:
    # The arguments are numbers of the program like the variables: C sets them, and sensitivities vary them.
    nlp = formulate(load_case(name))
    rng, names = np.random.default_rng(3), [each.name for each in nlp.program.arguments]
    rotation = nlp.program.places.rotations[0]
    for x in starting_points(nlp, 40, 5):
        p = nlp.arguments.copy()
        for k, each in enumerate(names):
            if each in ("p_x", "p_y"):
                p[k] += rng.uniform(-3, 3)
        (twist,) = nlp.program.places.twists
        p[twist] += rng.normal(size=6)
        variables = {each.name: value for each, value in zip(nlp.program.variables, x, strict=True)}
        numbers = dict(zip(names, p, strict=True)) | variables
        if isinstance(rotation, FreeRotation):
            q = x[list(rotation.q)]
            size = float(np.linalg.norm(q))
            R = turn_about(q / size, 2 * math.asin(size)) if size else np.eye(3)
        elif "axis_x" in names:
            axis = np.array([numbers[f"axis_{c}"] for c in "xyz"])
            R = turn_about(axis / np.linalg.norm(axis), numbers["angle"])
        else:
            R = np.eye(3)
        exact, own = worst_numbers(numbers, R, p[twist]), kept(nlp, x, p)
        for key, value in own.items():
            if key in exact:
                assert value == pytest.approx(exact[key], rel=1e-6, abs=1e-6), key


def test_what_is_one_function_is_one_constraint_and_no_other() -> None:
    program = formulate(load_case("hexapod-machining")).program
    words = ("leg_clearance", "spacing", "foot")
    assert [sum(key in each.name for each in program.constraints) for key in words] == [15, 8, 2]

    x, p = SX.sym("x", 3), SX.sym("p", 2)
    a, b, c = ca.vertsplit(x)
    third = 2 * math.pi / 3

    def left(*expressions: SX, key: str = "k.min") -> list[int]:
        items = [
            BoundedConstraint(Constraint(str(k), each, NUMBER, (key, "")), 0.0, math.inf)
            for k, each in enumerate(expressions)
        ]
        return [int(item.constraint.name) for item in without_repeated(items, x, p)]

    def chord(k: int) -> SX:
        x, y = (a * f(k * third + b) - a * f(k * third - b) for f in (ca.cos, ca.sin))
        return x**2 + y**2

    root = ca.sqrt(1 - c**2)
    assert left(chord(0), chord(1), chord(2), 4 * a**2 * ca.sin(b) ** 2) == [0]
    assert left((root + a) * (root - a), 1 - c * c - a * a) == [0]
    assert left(a * b + p[0], p[0] + b * a, a * b) == [0, 2]
    # Alike at most points of a box, or nearly so everywhere.
    assert left(ca.fmax(a, b - 100), ca.fmax(a, c - 100)) == [0, 1]
    assert left(ca.fmin(a, b), ca.fmin(a, b + 1e-10 * c)) == [0, 1]
    assert left(a + 1e-11 * b, a) == [0, 1]
    assert left(ca.fmax(a * b + b, c), ca.fmax(b * (1 + a), c)) == [0]


TABLES = tomllib.loads(load_case("hexapod-machining").to_toml())


def limited(rng: np.random.Generator) -> Case:
    """The hexapod with joints near each other, and with a random task and random limits."""
    tables = copy.deepcopy(TABLES)
    limits = tables["limits"]
    limits["joint_spacing"]["min"] = 2
    limits["leg_length"] = {"min": rng.uniform(18, 25), "max": rng.uniform(30, 40)}
    limits["leg_clearance"]["min"] = rng.uniform(1.5, 4.5)
    limits["rate_share"]["max"] = rng.uniform(0.4, 0.7)
    for key in ("base_joint_angle", "platform_joint_angle"):
        limits[key]["max"] = rng.uniform(12, 35)
    task = {"axis": rng.normal(size=3).tolist(), "point": rng.uniform(-12, 12, 3).tolist(), "pitch": 0.2}
    tables["task"] = [task | {"sense": "max"}]
    tables["solve"]["starts"] = 8
    tables.pop("expect", None)
    return case_from(tables, "random")


@pytest.mark.parametrize("count", soaked([2, 12], [2]))
def test_no_solve_with_random_limits_answers_a_wrong_design(count: int) -> None:
    rng, answers = np.random.default_rng(count), 0
    for _ in range(count):
        case = limited(rng)
        solution = solve(case)
        if not solution.status.is_answer:
            continue
        answers += 1
        state = solution.state
        numbers = {name: float(value[0]) for name, value in state.parameters.items()}
        numbers |= dict(zip(("p_x", "p_y", "p_z"), state.position, strict=True))
        twist = np.asarray(case.tasks[0].twist, dtype=np.float64)
        found = worst_numbers(numbers, np.asarray(state.rotation), twist)
        for limit in case.limits:
            ends = {f"{limit.key}.{end}": getattr(limit, end, None) for end in ("min", "max")}
            for key, number in ends.items():
                if number is not None and key in found:
                    over = number - found[key] if key.endswith("min") else found[key] - number
                    assert over <= 1e-6, (key, number, found[key])
    assert answers


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hexapod-machining", "free-wrist"])
def test_no_c_with_random_limits_answers_a_wrong_design(name: str, tmp_path: Path) -> None:
    if not COMPILERS:
        pytest.skip("no C compiler is installed")
    case, count = load_case(name), 300
    compiled, nlp, rng = load_compiled(written(case, tmp_path)), formulate(case), np.random.default_rng(8)
    names = [each.name for each in nlp.program.arguments]
    size = nlp.upper[0] / 32
    p = np.tile(nlp.arguments, (count, 1))
    (twist,) = nlp.program.places.twists
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    p[:, twist] = np.hstack([axes, np.cross(rng.uniform(-15, 15, (count, 3)) * size, axes) + 0.3 * size * axes])
    for each in ("p_x", "p_y"):
        if each in names:
            p[:, names.index(each)] = rng.uniform(-4, 4, count) * size
    limits = {
        each.key: each.default * rng.uniform(*((0.5, 1.2) if each.key.endswith("min") else (0.8, 1.6)), count)
        for each in compiled.limits
        if not each.key.startswith("angle")
    }
    limits["leg_length.max"] = np.maximum(limits["leg_length.max"], 1.05 * limits["leg_length.min"])
    found = compiled.solve(p=p, limits=limits, seeds=4)
    assert found.ok.mean() > 0.9
    for k in np.flatnonzero(found.ok):
        variables = {each.name: value for each, value in zip(nlp.program.variables, found.x[k], strict=True)}
        numbers = dict(zip(names, p[k], strict=True)) | variables
        values = worst_numbers(numbers, found.R[k].reshape(3, 3), p[k, list(twist)])
        for key, number in limits.items():
            over = number[k] - values[key] if key.endswith("min") else values[key] - number[k]
            assert over <= 1e-6 * max(1.0, number[k]), (key, k)


def test_a_limit_that_binds_on_all_legs_alike_gives_a_corner_and_no_slope() -> None:
    case = load_case("free-wrist")
    own = solve(case)
    rows = {row.name: row for row in sensitivities(own.nlp, own.x)}
    assert {name: row.hindrance for name, row in rows.items()} == dict.fromkeys(rows, Hindrance.CORNER)
    assert all(row.derivative is None for row in rows.values())

    def moved(step: float) -> float:
        return solve(replace(case, position=(step, *case.position[1:]))).F

    # The least F grows with a step to either side: the slopes on both sides have one sign.
    slopes = [(moved(step) - own.F) / abs(step) for step in (-0.5, 0.5)]
    assert min(slopes) > 1e-3
