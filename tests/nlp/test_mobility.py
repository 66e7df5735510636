"""Mobility of robots joint by joint: singularities against closed forms, platforms behind loops and driven joints."""

import json
import math
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import case_file, case_tables, ran

from screwsynth.models import Dimension, Model, robot, robot_function
from screwsynth.nlp import Case, Free, Limits, PointKind, Status, Task, evaluate, formulate, json_data, result_of, solve
from screwsynth.nlp.case.limits.rates import ActuatorRate
from screwsynth.nlp.case.workspace import Workspace
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.evidence.margins import margins_of
from screwsynth.nlp.evidence.mobility import Mobility, mobility_of
from screwsynth.nlp.evidence.screwvalues import ScrewMotion, ScrewWrench, wrench_of
from screwsynth.nlp.evidence.singularities import Singularity, SingularityKind, _null_twists, is_passive_singular
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.words.summary import case_summary

TURN = [Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=0)]
LEG = [
    {"type": "U", "at": "B", "axes": ["x", "y"]},
    {"type": "P", "at": "B", "axis": "A - B", "actuated": True},
    {"type": "S", "at": "A"},
]
SNU = """
    name = "snu"
    home = [0, 0, 0.7]
    [[limb]]
    repeat = { count = 3 }
    points = { B = [0.57735, 0, 0], A = [0.288675, 0, 0.7] }
    joints = [{ type = "U", at = "B", axes = ["x", "cross(x, A - B)"] },
              { type = "P", at = "B", axis = "A - B", actuated = true },
              { type = "U", at = "A", axes = ["cross(x, A - B)", "x"] }]
"""
DELTA = """
    name = "parallel rods"
    home = [0, 0, -0.9]
    [[limb]]
    repeat = { count = 3 }
    points = { B = [0.4, 0, 0], E = [0.8, 0, -0.2], A = [0.8, 0, -0.9] }
    joints = [{ type = "R", at = "B", axis = "y", actuated = true }]
    branch = [{ joints = [{ type = "S", at = "E + 0.05*y" }, { type = "S", at = "A + 0.05*y" }] },
              { joints = [{ type = "S", at = "E - 0.05*y" }, { type = "S", at = "A - 0.05*y" }] }]
"""
FIVE_BAR = """
    name = "five-bar, distal links in line"
    [[limb]]
    points = { B = [-1, 0, 0], E = [-0.5, 1, 0], A = [0, 1, 0] }
    joints = [{ type = "R", at = "B", axis = "z", actuated = true }, { type = "R", at = "E", axis = "z" },
              { type = "R", at = "A", axis = "z" }]
    [[limb]]
    points = { B = [1, 0, 0], E = [0.5, 1, 0], A = [0, 1, 0] }
    joints = [{ type = "R", at = "B", axis = "z", actuated = true }, { type = "R", at = "E", axis = "z" }]
"""


def with_first_limb(text: str, **dimensions: object) -> Model:
    """Return a platform on a limb and five legs."""
    legs = [
        {"repeat": {"angles": angles}, "points": {"B": [1, 0, 0], "A": [0.5, offset, 1]}, "joints": LEG}
        for angles, offset in (([120, 240], 0.4), ([20, 140, 260], -0.4))
    ]
    return robot(name="six", home=[0, 0, 1], limb=[tomllib.loads(text), *legs], dimensions=dimensions)


def found_at_home(model: Model, free: bool = False) -> list[Singularity]:
    x, y, z = model.home
    pose = (Free(x - 1, x + 1), Free(y - 1, y + 1), z) if free else (x, y, z)
    nlp = formulate(Case(model, {}, pose, TURN))
    found = mobility_of(nlp, nlp.start, evaluate(nlp, nlp.start))
    return list(found.singularities)


def force_along(point: object, direction: object) -> np.ndarray:
    unit = np.asarray(direction) / np.linalg.norm(direction)
    return np.concatenate([unit, np.cross(point, unit)])


def assert_same_span(screws: Sequence[ScrewMotion | ScrewWrench] | None, expected: object) -> None:
    """Both are bases of one space."""
    assert screws is not None
    found = np.array([each.twist if isinstance(each, ScrewMotion) else each.wrench for each in screws])
    rows = np.atleast_2d(expected)
    assert len(found) == len(rows)
    np.testing.assert_allclose(found @ np.linalg.pinv(rows) @ rows, found, rtol=0, atol=1e-9)


def test_stretched_planar_limbs_lock_the_line_of_their_links_and_meet_in_the_centre() -> None:
    model = robot_function("planar-3-rrr")()
    values = {item.name: item.typical[0] for item in model.parameters} | {"turn": 0.0, "bend": 0.0}
    nlp = formulate(Case(model, values, (Free(-1, 1), Free(-1, 1), 0.0), TURN))
    mobility = mobility_of(nlp, nlp.start, evaluate(nlp, nlp.start))
    *serial, platform = mobility.singularities
    for k, each in enumerate(serial):
        assert (each.kind, each.limb) == (SingularityKind.SERIAL, str(k + 1))
        assert each.joints == tuple(f"{k + 1}:{j}" for j in (1, 2, 3))
        angle = 2 * np.pi * k / 3
        assert_same_span(each.locking, force_along([0, 0, 0], [np.cos(angle), np.sin(angle), 0]))
    assert platform.kind is SingularityKind.ACTUATION
    assert_same_span(platform.gained, [0, 0, 1, 0, 0, 0])
    # An actuator that does not drive the platform has no rate, and its limb resists by constraints alone.
    assert set(mobility.actuator_rates.values()) == {float("inf")}
    assert {part.actuation for part in mobility.parts} == {0.0}


def test_what_rounding_leaves_of_constraints_is_nothing_in_any_unit() -> None:
    model, size = robot_function("planar-3-rrr")(), 1e6
    factors = {item.name: size if item.dimension is Dimension.LENGTH else 1 for item in model.parameters}
    values = {item.name: item.typical[0] * factors[item.name] for item in model.parameters}
    task = Task([0, 0, 1, 0.3 * size, 0.2 * size, 0])
    nlp = formulate(Case(model, values, [size * each for each in model.home], [task]))
    mobility = mobility_of(nlp, nlp.start, evaluate(nlp, nlp.start))
    assert mobility.constrained == 0


def test_constraint_singularities_gain_motions_that_are_known() -> None:
    (snu,) = found_at_home(robot(**tomllib.loads(SNU)))
    assert snu.kind is SingularityKind.CONSTRAINT
    # Rotations about horizontal lines through (0, 0, 1.4).
    lines = [force_along([0, 0, 1.4], axis) for axis in ([1, 0, 0], [0, 1, 0])]
    assert_same_span(snu.gained, lines)
    delta, locked = found_at_home(robot(**tomllib.loads(DELTA)))
    assert (delta.kind, locked.kind) == (SingularityKind.CONSTRAINT, SingularityKind.ACTUATION)
    turn, x, y, z = np.eye(6)[2:]
    assert_same_span(delta.gained, [turn, x, y, z])
    assert_same_span(locked.gained, [turn, x, y])
    # Wrenches of no special place: they do no work in the twists.
    wrenches = np.random.default_rng(0).normal(size=(4, 6))
    twists = _null_twists(wrenches, np.array([3.0, -2.0, 5.0]))
    assert np.linalg.matrix_rank(twists) == len(twists) == 2
    np.testing.assert_allclose(twists[:, 3:] @ wrenches[:, :3].T, -twists[:, :3] @ wrenches[:, 3:].T, atol=1e-12)


def test_similar_plates_are_singular_by_their_architecture() -> None:
    leg = {"repeat": {"count": 3}, "joints": LEG}
    limbs = [leg | {"points": {"B": [1, side, 0], "A": [0.5, side / 2, 1]}} for side in (-0.3, 0.3)]
    *_, architecture = found_at_home(robot(name="similar plates", home=[0, 0, 1], limb=limbs))
    assert architecture.kind is SingularityKind.ARCHITECTURE
    # The power of the leg from b, along z - b/2, is v_z - b.v/2 + b.(z x w).
    assert_same_span(architecture.gained, [[0, 0, 1, 0, 0, 0], [0, -1, 0, 2, 0, 0], [1, 0, 0, 0, 2, 0]])


def test_a_five_bar_with_links_in_line_turns_about_an_elbow_and_no_direction_is_singular() -> None:
    (each,) = found_at_home(robot(**tomllib.loads(FIVE_BAR)))
    assert each.kind is SingularityKind.ACTUATION
    # The platform is the distal link of the second limb, or with the other the whole line: its joint at (0.5, 1, 0).
    assert_same_span(each.gained, force_along([0.5, 1, 0], [0, 0, 1]))
    nlp = formulate(Case(robot(**tomllib.loads(FIVE_BAR)), {}, [0, 1, 0], TURN))
    point = nlp.start.copy()
    point[nlp.program.places.unknowns[0][-1]] = np.nan
    assert is_passive_singular(nlp, point)


def test_a_singular_limb_names_the_joints_that_take_part() -> None:
    text = """
        points = { B = [1, 0, 0], A = [0.6, 0, 1], E = "0.6*B + 0.4*A" }
        joints = [{ type = "R", at = "B", axis = "y", actuated = true },
                  { type = "U", at = "E", axes = ["y", "x"] }, { type = "S", at = "A" }]
    """
    (each,) = found_at_home(with_first_limb(text))
    assert (each.kind, each.limb, each.joints) == (SingularityKind.SERIAL, "1", ("1:1", "1:2", "1:3"))
    assert_same_span(each.locking, force_along([1, 0, 0], [-0.4, 0, 1]))
    text = """
        points = { B = [1, 0.3, 0.1], A = [0.6, 0.4, 1.1], C = [0.9, 0.5, 0.4], E = "(A + C)/2 + 0.3*x" }
        joints = [{ type = "R", at = "C", axis = "A - C" }, { type = "R", at = "B", axis = [1, 4, 0.3] },
                  { type = "R", at = "E", axis = [1, 4, 0.3], actuated = true }, { type = "S", at = "A" }]
    """
    (each,) = found_at_home(with_first_limb(text))
    assert (each.kind, each.limb, each.joints) == (SingularityKind.PASSIVE, "1", ("1:1", "1:4"))


@pytest.mark.parametrize("is_bent", [True, False])
def test_a_leg_along_the_first_axis_of_its_universal_joint_resists_across_too(is_bent: bool) -> None:
    middle = '{ type = "R", at = "E", axis = "y", actuated = true }'
    slide = '{ type = "P", at = "B", axis = "A - B", actuated = true }'
    text = f"""
        points = {{ B = [1, 0, 0], A = [0.6, 0, 1], E = "(A + B)/2 + 0.3*x" }}
        joints = [{{ type = "U", at = "B", axes = ["A - B", "y"] }}, {middle if is_bent else slide},
                  {{ type = "S", at = "A" }}]
    """
    (each,) = found_at_home(with_first_limb(text))
    assert (each.kind, each.limb, each.joints) == (SingularityKind.PASSIVE, "1", ("1:1", "1:3"))
    assert each.locking is not None
    across, leg = force_along([0.6, 0, 1], [0, 1, 0]), force_along([0.6, 0, 1], [-0.4, 0, 1])
    if is_bent:
        assert_same_span(each.locking, across)
    else:
        # The second axis of a straight leg may have any angle about it, as the leg may turn about itself: all forces
        # through the ball joint but the leg's own.
        assert len(each.locking) == 2
        assert_same_span([*each.locking, wrench_of(leg)], [across, leg, force_along([0.6, 0, 1], [1, 0, 0])])


def test_a_passive_singularity_is_refused_as_an_optimum() -> None:
    """A leg whose angle against the first axis of its universal joint is zero where the dimension e is."""
    text = """
        points = { B = [1, 0, 0], A = ["0.6 + e", 0, 1] }
        joints = [{ type = "U", at = "B", axes = [[-0.4, 0, 1], "y"] },
                  { type = "P", at = "B", axis = "A - B", actuated = true }, { type = "S", at = "A" }]
    """
    model, found = with_first_limb(text, e={"typical": 0.1}), []
    for sense in ("max", "min"):
        task = Task.screw(sense, axis=[0, 1, 0], point=[0, 0, 0], pitch=0.2)
        solution = solve(Case(model, {"e": Free(0.0, 0.2)}, (0, 0, 1), [task]), starts=4)
        found.append((solution, float(solution.x[0])))
    (refused,) = [each for each, e in found if e == 0.0]
    (kept,) = [each for each, e in found if e > 0.0]
    assert kept.status is Status.OPTIMAL
    assert refused.status is Status.LIMB_SINGULAR
    assert not refused.optima
    assert refused.evidence is None or refused.evidence.kind is PointKind.LIMB_SINGULAR
    data = json_data(result_of(refused))
    assert (data["status"], data["F"]) == ("singular limb", None)
    assert list(data["starts"]["failed"]) == ["ended where passive joints of a limb are dependent, so that F jumps"]


def test_commands_and_json_state_the_screws(tmp_path: Path) -> None:
    task = {"name": "t", "sense": "max", "axis": [0, 0, 1], "point": [0, 0, 0], "pitch": 0}
    tables = case_tables({"definition": tomllib.loads(SNU)}, pose={"position": [0, 0, 0.7]}, task=[task])
    case = str(case_file(tmp_path, tables))
    output = ran("evaluate", case).output
    assert "singular: the constraints are dependent" in output
    assert output.count("  gained motion: rotation about") == 2
    assert "through (0, 0, 1.4)" in output
    joints = json.loads(ran("evaluate", case, "--json", "-").output)["joints"]
    (each,) = joints["singularities"]
    assert each["kind"] == "constraint"
    assert "limb" not in each
    for motion in each["gained"]:
        assert motion["pitch"] == pytest.approx(0, abs=1e-12)
        assert motion["point"] == pytest.approx([0, 0, 1.4])


ALONG_X = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)


def hinge(name: str, ends: tuple[str, str], at: Sequence[float], axis: object = "z", *, driven: bool = False) -> Any:  # noqa: ANN401
    return {"name": name, "type": "R", "between": list(ends), "at": list(at), "axis": axis, "actuated": driven}


def five_bar(wrist: Sequence[object] = ("z",)) -> Model:
    """A five-bar between (-0.4, 0), (-0.8, 0.6), (0, 1), (0.8, 0.6) and (0.4, 0), with driven hinges at (0, 1)."""
    bodies = ["left", *(f"wrist{k}" for k in range(1, len(wrist))), "platform"]
    joints = [
        hinge("m1", ("base", "arm1"), (-0.4, 0, 0), driven=True),
        hinge("m2", ("base", "arm2"), (0.4, 0, 0), driven=True), hinge("e1", ("arm1", "left"), (-0.8, 0.6, 0)),
        hinge("e2", ("arm2", "right"), (0.8, 0.6, 0)), hinge("middle", ("left", "right"), (0, 1, 0)),
    ]  # fmt: skip
    pairs = zip(wrist, bodies, bodies[1:], strict=False)
    joints += [hinge(f"w{k}", (one, other), (0, 1, 0), axis, driven=True) for k, (axis, one, other) in enumerate(pairs)]
    return robot("five-bar", home=(0, 1, 0), links=["base", "arm1", "arm2", "right", *bodies], joint=joints)


def mobility(model: Model, twist: Sequence[float] = ALONG_X) -> Mobility:
    nlp = formulate(Case(model, {}, model.home, [Task(twist)]))
    found = mobility_of(nlp, nlp.start, evaluate(nlp, nlp.start))
    assert found is not None
    return found


def test_a_five_bar_with_a_wrist_has_the_rates_that_are_found_by_hand() -> None:
    """Rod (0.8, 0.4) and arm (-0.4, 0.6): q z x arm has the velocity of (0, 1) along the rod, q (-0.64) = 0.8."""
    found = mobility(five_bar())
    assert found.freedoms == 3
    assert found.constrained == 0
    assert found.actuator_rates == pytest.approx({"m1": -1.25, "m2": -1.25, "w0": 0.625}, abs=1e-13)
    # The wrist alone turns the platform; a motion out of the plane is none of its own.
    about = mobility(five_bar(), (0, 0, 1, 1, 0, 0))
    assert about.actuator_rates == pytest.approx({"m1": 0, "m2": 0, "w0": 1}, abs=1e-13)
    assert mobility(five_bar(), (0, 0, 0, 0, 0, 1)).constrained > 0.1
    # Three wrist axes that meet: five freedoms.
    assert mobility(five_bar(("z", "x", "y"))).freedoms == 5


def test_a_limit_on_rates_is_judged_by_these_rates() -> None:
    for largest, kept in ((1.1, False), (1.3, True)):
        case = Case(five_bar(), {}, (0, 1, 0), [Task(ALONG_X)], limits=Limits(ActuatorRate(largest)))
        nlp = formulate(case)
        margins = margins_of(nlp, nlp.start, optimal=False)
        assert sorted(abs(each.value) for each in margins) == pytest.approx([0.625, 1.25, 1.25], abs=1e-12)
        assert any(each.violated for each in margins) is not kept


def test_solve_shows_the_rates_and_that_the_motion_is_possible() -> None:
    case = Case(five_bar(), {}, (Free(-0.1, 0.1), 1, 0), [Task(ALONG_X)])
    solution = solve(case, starts=2)
    joints = result_of(solution).robot.joints
    assert (joints.freedoms, joints.feasible) == (3, True)
    # At x: the arm's rate q1 by the law of cosines of both halves, from finite differences of the arm's angle.
    x = float(result_of(solution).robot.pose.position[0])
    step = 1e-6
    slopes = [(arm_angle(side, x + step) - arm_angle(side, x - step)) / (2 * step) for side in (-1, 1)]
    assert [each.rate for each in joints.actuators[:2]] == pytest.approx(slopes, abs=1e-8)


def arm_angle(side: int, x: float) -> float:
    """Angle of an arm of length sqrt(0.52) whose rod of length sqrt(0.8) ends at (x, 1)."""
    dx, dy = x - 0.4 * side, 1.0
    reach = math.hypot(dx, dy)
    inner = math.acos((0.52 + reach**2 - 0.8) / (2 * math.sqrt(0.52) * reach))
    return math.atan2(dy, dx) - side * inner


def test_the_constraints_keep_their_rank_over_a_workspace() -> None:
    place = Workspace((Free(-0.01, 0.01), Free(0.99, 1.01), 0))
    case = Case(five_bar(), {}, (0, 1, 0), [Task(ALONG_X)], workspace=place)
    judgement = judge_workspace(case, time_limit=30)
    assert judgement.regularity.outcome is Outcome.PROVED
    assert judgement.constraints.outcome is Outcome.PROVED


def overdriven(*, driven: bool) -> Model:
    """A four-bar whose two cranks are driven, with the platform on a hinge of its coupler, driven or not."""
    joints = [
        hinge("m1", ("base", "a"), (0, 0, 0), driven=True), hinge("m2", ("base", "b"), (1, 0, 0), driven=True),
        hinge("e1", ("a", "coupler"), (0.1, 0.5, 0)), hinge("e2", ("b", "coupler"), (1.3, 0.8, 0)),
        hinge("spin", ("coupler", "platform"), (0.5, 1, 0), "x", driven=driven),
    ]  # fmt: skip
    return robot("overdriven", home=(0.5, 1, 0), links=["base", "a", "b", "coupler", "platform"], joint=joints)


@pytest.mark.parametrize("driven", [True, False])
def test_more_motors_than_freedoms_have_rates_that_fit(driven: bool) -> None:
    """The coupler turns about the pole, where its cranks meet: a unit turn is (e1 - pole).(e1 - a) / |e1 - a|^2."""
    model = overdriven(driven=driven)
    a, b, c, d = (np.array(each) for each in ((0.0, 0), (1.0, 0), (0.1, 0.5), (1.3, 0.8)))
    s, _ = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)
    pole = a + s * (c - a)
    found = mobility(model, (0, 0, 1, pole[1], -pole[0], 0))
    assert (found.freedoms, found.constrained) == (2, 0)
    rates = [float((end - pole) @ (end - start) / ((end - start) @ (end - start))) for start, end in ((a, c), (b, d))]
    assert list(found.actuator_rates.values()) == pytest.approx([*rates, 0][: 2 + driven], abs=1e-12)
    # Behind a passive hinge the loop demands a relation of the rates, which those of least squares keep too.
    assert model.actuators[0].relations.shape[0] == (not driven)
    values = list(mobility(model).actuator_rates.values())
    if not driven:
        assert values[0] * rates[1] == pytest.approx(values[1] * rates[0], abs=1e-12)
    case = Case(model, {}, model.home, [Task(ALONG_X)], limits=Limits(ActuatorRate(1.0)))
    nlp = formulate(case)
    limited = sorted(abs(each.value) for each in margins_of(nlp, nlp.start, optimal=False))
    assert limited == pytest.approx(sorted(abs(each) for each in values), abs=1e-9)


def test_a_rate_that_the_motion_does_not_determine_is_said_to_be_none() -> None:
    """Two driven hinges about one axis: only the sum of their rates moves the five-bar's platform."""
    model = five_bar(("z", "z"))
    found = mobility(model)
    assert found.freedoms == 3
    assert {name for name, rate in found.actuator_rates.items() if math.isnan(rate)} == {"w0", "w1"}
    assert found.actuator_rates["m1"] == pytest.approx(-1.25, abs=1e-12)
    assert (model.generic.idle, model.generic.undetermined) == (1, ("w0", "w1"))
    case = Case(model, {}, (Free(-0.1, 0.1), 1, 0), [Task(ALONG_X)])
    words = "\n".join(str(each) for each in case_summary(case, result_of(solve(case, starts=1))))
    assert "w0: undetermined" in words
    assert "does not determine the rates of actuators w0, w1: they can move while the platform stands still" in words
    with pytest.raises(CaseError, match=r"actuator_rate.*does not determine the rates of w0, w1"):
        replace(case, limits=Limits(ActuatorRate(1.0)))
