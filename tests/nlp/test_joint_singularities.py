"""Singularities of robots given joint by joint: kinds, limbs, joints and screws, against closed forms."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from builders import ran

from screwsynth.models import Dimension, Model, robot, robot_function
from screwsynth.nlp import Case, Free, PointKind, Status, Task, evaluate, formulate, json_data, result_of, solve
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.evidence.singularities import Singularity, SingularityKind, _null_twists, is_passive_singular

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


def assert_same_span(found: np.ndarray | None, expected: object) -> None:
    """Both are bases of one space."""
    assert found is not None
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
    assert {part.actuation for part in mobility.parts.values()} == {0.0}


def test_what_rounding_leaves_of_constraints_is_nothing_in_any_unit() -> None:
    model, size = robot_function("planar-3-rrr")(), 1e6
    values = {
        item.name: item.typical[0] * (size if item.dimension is Dimension.LENGTH else 1) for item in model.parameters
    }
    task = Task([0, 0, 1, 0.3 * size, 0.2 * size, 0])
    nlp = formulate(Case(model, values, [size * each for each in model.home], [task]))
    mobility = mobility_of(nlp, nlp.start, evaluate(nlp, nlp.start))
    assert mobility.constrained == 0


def test_joints_without_a_direction_are_singular() -> None:
    nlp = formulate(Case(robot(**tomllib.loads(FIVE_BAR)), {}, [0, 1, 0], TURN))
    point = nlp.start.copy()
    point[nlp.program.places.unknowns[0][-1]] = np.nan
    assert is_passive_singular(nlp, point)


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


def test_a_five_bar_with_links_in_line_turns_about_an_elbow() -> None:
    (each,) = found_at_home(robot(**tomllib.loads(FIVE_BAR)))
    assert each.kind is SingularityKind.ACTUATION
    # The platform is the distal link of the second limb, or with the other the whole line: its joint at (0.5, 1, 0).
    assert_same_span(each.gained, force_along([0.5, 1, 0], [0, 0, 1]))


def test_a_crank_and_its_rod_in_line_lock_their_line() -> None:
    text = """
        points = { B = [1, 0, 0], A = [0.6, 0, 1], E = "0.6*B + 0.4*A" }
        joints = [{ type = "R", at = "B", axis = "y", actuated = true },
                  { type = "U", at = "E", axes = ["y", "x"] }, { type = "S", at = "A" }]
    """
    (each,) = found_at_home(with_first_limb(text))
    assert (each.kind, each.limb, each.joints) == (SingularityKind.SERIAL, "1", ("1:1", "1:2", "1:3"))
    assert_same_span(each.locking, force_along([1, 0, 0], [-0.4, 0, 1]))


def test_a_joint_that_takes_part_by_rounding_alone_is_not_named() -> None:
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
        assert_same_span(np.vstack([each.locking, leg]), [across, leg, force_along([0.6, 0, 1], [1, 0, 0])])


def passive_at_a_bound() -> Model:
    """A leg whose angle against the first axis of its universal joint is zero where the dimension e is."""
    text = """
        points = { B = [1, 0, 0], A = ["0.6 + e", 0, 1] }
        joints = [{ type = "U", at = "B", axes = [[-0.4, 0, 1], "y"] },
                  { type = "P", at = "B", axis = "A - B", actuated = true }, { type = "S", at = "A" }]
    """
    return with_first_limb(text, e={"typical": 0.1})


def test_a_passive_singularity_is_refused_as_an_optimum() -> None:
    found = []
    for sense in ("max", "min"):
        task = Task.screw(sense, axis=[0, 1, 0], point=[0, 0, 0], pitch=0.2)
        solution = solve(Case(passive_at_a_bound(), {"e": Free(0.0, 0.2)}, (0, 0, 1), [task]), starts=4)
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
    definition = SNU.replace("\n    ", "\n").replace("name =", "[robot.definition]\nname =", 1)
    definition = definition.replace("[[limb]]", "[[robot.definition.limb]]")
    case = tmp_path / "snu.toml"
    case.write_text(
        f"{definition}\n[pose]\nposition = [0, 0, 0.7]\n[[task]]\nname = 't'\nsense = 'max'\n"
        "axis = [0, 0, 1]\npoint = [0, 0, 0]\npitch = 0\n"
    )
    result = ran("evaluate", str(case))
    assert "singular: the constraints are dependent" in result.output
    assert result.output.count("  gained: rotation about") == 2
    assert "through (0, 0, 1.4)" in result.output
    (each,) = json.loads(ran("evaluate", str(case), "--json", "-").out)["joints"]["singularities"]
    assert each["kind"] == "constraint"
    assert "limb" not in each
    for motion in each["gained"]:
        assert motion["pitch"] == pytest.approx(0, abs=1e-12)
        assert motion["point"] == pytest.approx([0, 0, 1.4])
