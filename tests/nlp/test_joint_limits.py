"""Limits on joints, links and actuators of robots given joint by joint, held to forward kinematics in numpy."""

from __future__ import annotations

import itertools
import math
import pickle
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import Array, Run, case_from, edited, output_of, saved_with_robot, starter_tables, turn_about
from measures import segment_distance

import screwsynth.models
from screwsynth.models import Model, Substitution, robot, stewart_gough
from screwsynth.nlp import (
    ActuatorRate,
    Case,
    CaseError,
    CertificateStatus,
    JointCone,
    JointMotion,
    Limits,
    LinkClearance,
    Search,
    Status,
    Task,
    certify,
    evaluate,
    formulate,
    load_case,
    margins_of,
    solve,
)
from screwsynth.nlp.evidence.kkt import close_equations

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
        R(B, [0, 1, 0], **DRIVEN),
        R(E, [0, 1, 0.2]),
        R(A, [1, 0, 0]),
        R(A, [0.3, 1, 0]),
        R(A, [0, 0.2, 1]),
    ],
    "hinge and universal as one": [
        R(B, [0, 1, 0], **DRIVEN),
        R(E, [0, 1, 0.2]),
        R(A, [1, 0, 0]),
        U(A, [0.3, 1, 0], [0, 0.2, 1]),
    ],
    "parallelogram": [R(B, [0, 1, 0], **DRIVEN), R(E, [0, 1, 0]), Pa(E, [1, 0, 0.3], to=A), R(A, [0, 1, 0.1])],
}


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
    tables = {
        "robot": {"definition": {"name": "rus", "limb": [{"joints": RUS, "repeat": {"count": 3}}]}},
        "pose": {
            "position": [0.05, -0.03, -0.05],
            "rotation": {"axis": axis, "angle": math.degrees(math.hypot(*TURN))},
        },
        "task": [{"name": "one", "sense": "max", "axis": [0, 0.3, 1], "point": [0.2, 0, 0], "pitch": 0.1}],
        "limits": limits,
    }  # fmt: skip
    return case_from(tables, "rus")


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
    assert margins_of(again, x, optimal=False) == margins_of(nlp, x, optimal=False)
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
[units]
length = "m"
[robot]
file = "robot.toml"
parameters = { rb = { min = 0.8, max = 1.2 }, rp = { min = 0.4, max = 0.7 }, h = 1.1 }
[pose]
position = [{ min = -0.3, max = 0.3 }, { min = -0.3, max = 0.3 }, { min = 0.9, max = 1.3 }]
rotation = { angle = { min = -30, max = 30 } }
[[task]]
sense = "max"
axis = [1, 0.3, 0]
point = [0, 0, 1.1]
pitch = 0.2
[limits.joint]
slide = { min = -0.05, max = 0.08 }
"""


def test_an_active_limit_has_its_cost_and_a_case_file_of_its_own(tmp_path: Path) -> None:
    case = replace(
        load_case(saved_with_robot(tmp_path, RPS, RPS_CASE + '"1:1" = { min = -5 }\nball = { cone = 20 }\n')),
        search=Search(starts=3),
    )
    slide, hinge = JointMotion("slide", min=-0.05, max=0.08), JointMotion("1:1", min=-math.radians(5))
    assert case.limits == Limits(slide, hinge, JointCone("ball", math.radians(20)))
    again = case_from(case.to_toml(), "case")
    assert again.limits == case.limits

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
    "slade = { max = 1 }": "limits.joint.slade: is no joint of '3-RPS'; it has slide, ball, 1:1, 1:2, 1:3",
    '"4:1" = { max = 1 }': "limits.joint.4:1: is no joint of '3-RPS'",
    '"1:ball" = { max = 1 }': "limits.joint.1:ball: joint 1:3 is of type S, which may have only cone",
    '"1:1" = { cone = 9 }': "limits.joint.1:1.cone: joint 1:1 (R) has none: a cone is for joints U and S",
    '"1:1" = { first = { max = 9 } }': "limits.joint.1:1.first: joint 1:1 is of type R, which may have min and max",
    '"1:1" = {}': "limits.joint.1:1: must have min, max, first, second, angle, stroke or cone",
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
    "[limits]\nbase_joint_angle = 30": "limits.base_joint_angle: is nothing that '3-RPS' has",
    "[limits]\nlink_clearance = { min = 0 }": "limits.link_clearance.min = 0.0: must be above 0 m",
    "[limits]\nactuator_rate = { max = -1 }": "limits.actuator_rate.max = -1.0: must be above 0",
    "[limits]\njoint = 3": "limits.joint = 3: must be a table",
}


def test_limits_that_mean_nothing_are_refused_in_one_sentence(tmp_path: Path) -> None:
    single = edited(RPS, ("count = 3", "count = 1"))
    for written, fault in REFUSALS.items():
        limits = written if written.startswith("[") else f"[limits.joint]\n{written}"
        with pytest.raises(CaseError) as error:
            load_case(saved_with_robot(tmp_path, single, RPS_CASE.partition("[limits.joint]")[0] + limits))
        sentence = str(error.value)
        assert sentence.startswith("case.toml: "), written
        assert fault in sentence, (written, sentence)
        assert "\n" not in sentence
    two = RPS.replace('type = "R", at', 'type = "R", name = "slide", at')
    with pytest.raises(CaseError, match=r"robot\.toml: limb 1, joints: has two joints with the name 'slide'"):
        load_case(saved_with_robot(tmp_path, two, RPS_CASE))
    legs = case_from(starter_tables(stewart_gough()), "legs")
    for limit, key in ((JointMotion("1:1", max=1.0), "joint.1:1"), (LinkClearance(1.0), "link_clearance")):
        with pytest.raises(CaseError, match=rf"limits\.{key}: is nothing that 'stewart-gough' has; it has leg_length"):
            replace(legs, limits=Limits(limit))
    rods = robot(name="rods", limb=[{"joints": [joint("S", B), joint("S", A)]}, {"joints": LIMBS["hinge"]}])
    with pytest.raises(CaseError, match="joint 1:1 is of type S"):
        Case(rods, {}, (0.0, 0.0, 0.0), legs.tasks, limits=Limits(JointMotion("1:1", max=1.0)))


def test_rates_of_straight_legs_are_their_work_rates() -> None:
    case = case_from(starter_tables(stewart_gough()), "legs")
    nlp = formulate(replace(case, limits=Limits(ActuatorRate(2.0))))
    rows = [row.value for row in margins_of(nlp, nlp.start, optimal=False)]
    assert sorted(rows) == pytest.approx(sorted(np.abs(evaluate(nlp, nlp.start).rates)), rel=1e-12)


def test_numbers_of_joints_are_set_on_the_command_line(tmp_path: Path, cli: Run) -> None:
    name = saved_with_robot(tmp_path, RPS, RPS_CASE)
    for setting, shown in (
        ("limits.joint.slide.max=0.01", "joint.slide.max"),
        ("limits.joint.1:1.min=-7", "joint.1:1.min"),
        ("limits.joint.ball.cone=30", "joint.ball.cone"),
    ):
        out = output_of(cli("evaluate", name, "--set", setting, "--set", "rb=1", "--set", "p_z=1.1"))
        assert shown in out


def test_a_proof_treats_ranges_cones_and_clearance() -> None:
    """The angle of the joint at which a hinged limb is opened has a proof too: it is written without an arc tangent."""
    model = robot(name="hinges", limb=[{"joints": LIMBS["hinge"]}, {"joints": LIMBS["universal"]}])
    turn = [Task.screw("max", axis=[0, 1, 0], point=[0, 0, 0], pitch=0)]
    case = Case(model, {}, (0.0, 0.0, 0.0), turn, limits=Limits(JointMotion("1:2", max=1.0), JointCone("2:1", 1.0)))
    assert certify(case).certificate.status is CertificateStatus.PROVED
    # Distances of links are made of pieces, which are covered too; this box has no design that keeps the limit.
    apart = certify(replace(case, limits=Limits(LinkClearance(2.0)))).certificate
    assert apart.status in (CertificateStatus.PROVED, CertificateStatus.INFEASIBLE)


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
