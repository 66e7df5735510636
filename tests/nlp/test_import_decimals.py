"""Models whose decimals contradict each other: closed by least squares, axes moved so that they meet, names kept."""

# ruff: noqa: E501 - XML in one line an element

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, edited, output_of, refusal_of

from screwsynth.models import robot
from screwsynth.models.mechanism import (
    Mechanism,
    MechanismJoint,
    MechanismLink,
    mechanism_of,
    robot_tables,
    wrenches_of,
)
from screwsynth.nlp import InputError
from screwsynth.nlp.formats.reading.importing import Imported, Request, import_robot
from screwsynth.nlp.formats.reading.reduction import Ends
from screwsynth.nlp.formats.reading.robotfile import check_text, robot_file_text
from screwsynth.nlp.formats.reading.snapping import near_misses, snapped

E = np.eye(3)


def limb(points: list[Array], axes: list[Array], driven: int = 0) -> dict[str, Any]:
    joints: list[dict[str, Any]] = [
        {"type": "R", "at": list(map(float, p)), "axis": list(map(float, a))} for p, a in zip(points, axes, strict=True)
    ]
    joints[driven]["actuated"] = True
    return {"joints": joints}


def planar() -> dict[str, Any]:
    """3-RRR: nine parallel axes."""
    ways = [np.array([np.cos(a), np.sin(a), 0.0]) for a in (0.1, 2.2, 4.3)]
    across = [np.cross(E[2], way) for way in ways]
    legs = [limb([w, 0.7 * w + 0.4 * t + 0.1 * E[2], 0.35 * w], [E[2]] * 3) for w, t in zip(ways, across, strict=True)]
    return {"name": "planar", "home": [0, 0, 0], "limb": legs}


def spherical() -> dict[str, Any]:
    """3-RRR: nine axes through one point, which is no joint's place."""

    def unit(vector: Array) -> Array:
        return np.asarray(vector / np.linalg.norm(vector))

    centre = np.array([0.2, -0.1, 0.3])
    legs = []
    for k in range(3):
        axes = [unit(E[k] + 0.3 * E[(k + 1) % 3]), unit(E[(k + 1) % 3] + 0.2), unit(E[(k + 2) % 3] - 0.4 * E[k])]
        legs.append(limb([centre + (0.5 + 0.1 * j) * axis for j, axis in enumerate(axes)], axes))
    return {"name": "spherical", "home": [0, 0, 0], "limb": legs}


def screws_and_hinges() -> dict[str, Any]:
    """Slides along hinges' axes, hinges that meet, a ball on the axis of two hinges, and two balls in one place."""
    legs = []
    for k, angle in enumerate((0.2, 2.4, 4.1)):
        way = np.array([np.cos(angle), np.sin(angle), 0.0])
        rail = np.array([0.2 * k, 0.3, 1.0]) / np.linalg.norm([0.2 * k, 0.3, 1.0])
        legs.append({
            "joints": [
                {"type": "P", "at": list(way), "axis": list(rail), "actuated": True},
                {"type": "R", "at": list(way), "axis": list(rail)},
                {"type": "R", "at": list(way), "axis": list(np.cross(way, E[2]))},
                {"type": "R", "at": list(0.5 * way + E[2]), "axis": list(np.cross(way, E[2]))},
                {"type": "R", "at": list(0.5 * way + E[2]), "axis": list(way)},
            ]
        })  # fmt: skip
    foot, way = np.array([0.1, -0.8, 0.2]), np.array([0.0, 0.6, 0.8])
    on_axis = [{"type": "R", "at": list(foot + shift * way), "axis": list(way)} for shift in (0.0, 0.5)]
    balls = [{"type": "S", "at": list(foot + 0.8 * way)}] * 2
    legs.append({"joints": [*on_axis, *balls]})
    return {"name": "cylinders", "home": [0, 0, 1], "limb": legs}


def delta() -> dict[str, Any]:
    """Three arms with parallelograms, each of four hinges with two rods."""
    legs = []
    for angle in (0.3, 2.5, 4.4):
        way = np.array([np.cos(angle), np.sin(angle), 0.0])
        axis = np.cross(E[2], way)
        elbow, head = 0.8 * way, 0.2 * way - E[2]
        legs.append({
            "joints": [
                {"type": "R", "at": list(0.4 * way), "axis": list(axis), "actuated": True},
                {"type": "R", "at": list(elbow), "axis": list(axis)},
                {"type": "Pa", "at": list(elbow), "to": list(head), "axis": list(np.cross(axis, head - elbow))},
                {"type": "R", "at": list(head), "axis": list(axis)},
            ]
        })  # fmt: skip
    return {"name": "delta", "home": [0, 0, -1], "limb": legs}


def disturbed(given: Mechanism, rng: np.random.Generator, by: float) -> Mechanism:
    """A mechanism whose places and axes are off, as decimals of a file leave them."""

    def joint(each: MechanismJoint) -> MechanismJoint:
        axis = each.axis + by * rng.uniform(-1, 1, 3) * np.any(each.axis != 0)
        return replace(each, point=each.point + by * rng.uniform(-1, 1, 3), axis=axis / (np.linalg.norm(axis) or 1.0))

    return replace(given, joints=tuple(joint(each) for each in given.joints))


@pytest.mark.parametrize(
    "tables", [planar(), spherical(), screws_and_hinges(), delta()], ids=lambda tables: tables["name"]
)
def test_axes_that_nearly_meet_are_told_and_snapped(tables: dict[str, Any]) -> None:
    """Freedoms of overconstrained robots vanish with decimals, and come back exactly: twists near the true ones."""
    exact = mechanism_of(tables)
    true = wrenches_of(exact, 1.0)
    assert not list(near_misses(exact, 1.0))
    for seed in range(3):
        rng = np.random.default_rng(seed)
        by = float(10.0 ** rng.uniform(-8, -5.5))
        off = disturbed(exact, rng, by)
        if tables["name"] != "cylinders" and by > 1e-6:
            assert wrenches_of(off, 1.0).ranks.freedoms < true.ranks.freedoms
        notes = list(near_misses(off, 1.0))
        assert notes
        assert all("--snap" in note for note in notes)
        found, note = snapped(off, 1.0, 6 * by)
        assert "were made exact" in note
        again = wrenches_of(found, 1.0)
        assert (again.ranks.freedoms, again.ranks.constraints) == (true.ranks.freedoms, true.ranks.constraints)
        assert not list(near_misses(found, 1.0))
        for one, other in zip(found.joints, exact.joints, strict=True):
            assert np.abs(one.point - other.point).max() < 20 * by
            assert np.abs(one.axis - other.axis).max() < 20 * by
            if one.kind != "S":
                assert np.linalg.norm(one.axis) == pytest.approx(1, abs=1e-15)
        shapes = [
            [joint["type"] for limb in robot_tables(each)["limb"] for joint in limb["joints"]]
            for each in (found, exact)
        ]
        assert shapes[0] == shapes[1]
        P, Q = (np.linalg.pinv(each.jacobian) @ each.jacobian for each in (again, true))
        np.testing.assert_allclose(P, Q, atol=300 * by)


def test_parallelograms_of_decimals_stay_four_hinges() -> None:
    """Rods that are parallel but for 1e-7 are no exact parallelogram: a file that said so would state other rates."""
    off = disturbed(mechanism_of(delta()), np.random.default_rng(0), 1e-7)
    tables = robot_tables(off)
    assert "Pa" not in str(tables)
    assert check_text(robot_file_text(tables), off, 1.0) <= 1e-9


def test_relations_that_move_joints_too_far_are_refused() -> None:
    """Ten balls in a row, each within the length of the next, would all come to one point."""
    row = [MechanismJoint(f"b{k}", "S", "base", "platform", np.array([0.9 * k, 0.0, 0.0])) for k in range(10)]
    links = (MechanismLink("base"), MechanismLink("platform"))
    given = Mechanism("row", links, tuple(row), "base", "platform")
    with pytest.raises(InputError, match=r"--snap 1: the axes cannot all be made to meet or to be parallel"):
        snapped(given, 10.0, 1.0)
    np.testing.assert_allclose([each.point for each in snapped(given, 10.0, 0.5)[0].joints], [j.point for j in row])


def legs_of_decimals(by: float) -> str:
    """Six legs of hinges alone beside the driven slide, whose axes miss each other by a length."""
    legs, ties, motors, sites = "", "", "", ""
    for k in range(6):
        a, b = np.pi / 3 * k + 0.2, np.pi / 3 * k - 0.2 * (-1) ** k
        foot, head = np.array([np.cos(a), np.sin(a), 0]), np.array([0.6 * np.cos(b), 0.6 * np.sin(b), 1.0])
        way = " ".join(map(repr, map(float, head - foot)))
        mass = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        hinges = "".join(
            f'<joint name="{letter}{k}" pos="{pos}" axis="{axis}"/>'
            for letter, pos, axis in (
                ("a", "0 0 0", "1 0 0"),
                ("b", f"0 0 {by!r}", "0 1 0"),
                ("c", f"{by!r} {by!r} 0", "0 0 1"),
            )
        )
        legs += (
            f'<body pos="{float(foot[0])!r} {float(foot[1])!r} 0">{mass}<joint name="x{k}" axis="1 0 0"/>'
            f'<joint name="y{k}" pos="0 0 {by!r}" axis="0 1 0"/><body>{mass}<joint name="q{k}" type="slide" axis="{way}"/>'
            f'<body name="end{k}" pos="{way}">{mass}{hinges}<site name="l{k}"/></body></body></body>'
        )
        sites += f'<site name="p{k}" pos="{float(head[0])!r} {float(head[1])!r} 0"/>'
        ties += f'<weld name="t{k}" site1="l{k}" site2="p{k}"/>'
        motors += f'<motor joint="q{k}"/>'
    top = f'<body name="top" pos="0 0 1"><freejoint/>{sites}</body>'.replace("<freejoint/>", "<freejoint/>" + mass)
    return (
        f"<mujoco><worldbody>{legs}{top}</worldbody><equality>{ties}</equality><actuator>{motors}</actuator></mujoco>"
    )


def test_snap_reads_legs_as_straight_ones(tmp_path: Path, cli: Run) -> None:
    """Hinges that miss each other by decimals: ball and universal joints with --snap, and a note without."""
    pytest.importorskip("mujoco")
    model, out = tmp_path / "legs.xml", tmp_path / "legs.toml"
    model.write_text(legs_of_decimals(8e-7))
    text = output_of(cli("import", str(model), "--platform", "top", "--out", str(out)))
    words = " ".join(text.split())
    assert "nearly meet: off by 8e-07" in words
    assert "they stay as they are; --snap" in words
    plain = import_robot(Request(model, Ends("top")))
    found = import_robot(Request(model, Ends("top"), snap=3e-6))
    assert [[joint["type"] for joint in each["joints"]] for each in plain.tables["limb"]] == [list("RRPRRR")] * 6
    assert [[joint["type"] for joint in each["joints"]] for each in found.tables["limb"]] == [list("UPS")] * 6
    J = [wrenches_of(each.mechanism, 1.0).jacobian for each in (plain, found)]
    np.testing.assert_allclose(J[0].T @ J[0], J[1].T @ J[1], atol=1e-5)
    refusal_of(
        cli("import", str(model), "--platform", "top", "--out", str(out), "--snap", "-1"),
        "--snap -1: must be finite and not negative",
    )


FIVE_BAR = """<robot name="bars"><link name="base"/>{links}
<loop_joint name="tip" type="{kind}"><link1 link="b" xyz="0.8 -0.1 {off}"/><link2 link="d" xyz="0.8 0.1 0"/>{axis}</loop_joint>
<transmission><joint name="left"/></transmission><transmission><joint name="right"/></transmission></robot>"""


def bars(kind: str, off: float, axis: str = "", mimic: str = "") -> str:
    """A five-bar in the plane z = 0, its tip a joint of a kind that is off by a length across the plane."""

    def hinge(name: str, parent: str, child: str, xyz: str, more: str = "") -> str:
        return (
            f'<link name="{child}"/><joint name="{name}" type="continuous"><origin xyz="{xyz}"/><axis xyz="0 0 1"/>'
            f'<parent link="{parent}"/><child link="{child}"/>{more}</joint>'
        )

    links = hinge("left", "base", "a", "0 0.5 0") + hinge("elbow_left", "a", "b", "0.5 0.3 0")
    links += hinge("right", "base", "c", "0 -0.5 0") + hinge("elbow_right", "c", "d", "0.5 -0.3 0", mimic)
    # The elbows are at y = 0.8 and -0.8: the tips would be 1.4 apart, and the loop is closed by Newton's method.
    return FIVE_BAR.format(links=links, kind=kind, off=off, axis=axis)


def imported(path: Path, text: str, *, closes: bool = True) -> Imported:
    path.write_text(text)
    return import_robot(Request(path, Ends("d"), closes=closes))


def test_overconstrained_loops_are_closed_by_least_squares(tmp_path: Path) -> None:
    """A hinge closes a planar loop that is off by 3e-7 across the plane: the rest is closed, and what is left told."""
    path = tmp_path / "bars.urdf"
    axis = '<axis xyz="0 0 1"/>'
    exact = imported(path, bars("revolute", 0.0, axis))
    assert wrenches_of(exact.mechanism, 1.0).ranks.freedoms == 2
    assert not any("stays open" in note for note in exact.notes)
    found = imported(path, bars("revolute", 3e-7, axis))
    (note,) = [note for note in found.notes if "stays open" in note]
    assert "tip stays open by 3e-07 and 0 deg, the least squares of numbers that contradict each other" in note
    for one, other in zip(found.mechanism.joints, exact.mechanism.joints, strict=True):
        np.testing.assert_allclose(one.point, other.point, atol=1e-6)
    # With axes that are parallel but for 2e-7, and one motor, the joints could close it by turning far: they do not.
    for off in (0.0, 3e-7):
        text = bars("revolute", off, axis).replace('<transmission><joint name="right"/></transmission>', "")
        text = text.replace('xyz="0 0 1"/><parent link="a"', f'xyz="{2 / 3 * off!r} 0 1"/><parent link="a"')
        tilted = imported(path, text)
        assert any("stays open" in note for note in tilted.notes) == (off > 0)
        exact = tilted if off == 0 else exact
    for one, other in zip(tilted.mechanism.joints, exact.mechanism.joints, strict=True):
        np.testing.assert_allclose(one.point, other.point, atol=1e-5)
    words = r"the loop tip is open by 0\.01 and 0 deg.*Newton's method, which came no closer"
    with pytest.raises(InputError, match=words):
        imported(path, bars("revolute", 0.01, axis))


def test_loop_joints_and_offsets_of_mimic(tmp_path: Path) -> None:
    """<loop_joint> closes a loop by a ball or a hinge; a joint that mimics another with an offset is moved to it."""
    path = tmp_path / "bars.urdf"
    for kind, axis, joint in (("spherical", "", "S"), ("revolute", '<axis xyz="0 0 2"/>', "R")):
        found = imported(path, bars(kind, 0.0, axis))
        assert {each.name: each.kind for each in found.mechanism.joints}["tip"] == joint
        assert wrenches_of(found.mechanism, 1.0).ranks.freedoms == 2
    for text, words in (
        (bars("revolute", 0.0), "loop_joint tip, axis: is missing; a joint of the type revolute needs it"),
        (bars("hinge", 0.0), 'loop_joint tip, type = "hinge": must be one of'),
        (bars("spherical", 0.0).replace('link2 link="d"', 'link2 link="x"'), 'link2 = "x": must be one of the links'),
    ):
        with pytest.raises(InputError, match=words):
            imported(path, text)
    text = bars("spherical", 0.0, mimic='<mimic joint="elbow_left" multiplier="-1" offset="0.1"/>')
    with pytest.raises(InputError, match="is open by"):
        imported(path, text, closes=False)
    found = imported(path, text)
    assert {gap.name: gap.angle for gap in found.gaps}["elbow_right mimic"] == pytest.approx(0.1)
    place = {each.name: each.point for each in found.mechanism.joints}
    angles = []
    for side, sign in (("left", 1), ("right", -1)):
        arm, rod = place[f"elbow_{side}"] - place[side], place["tip"] - place[f"elbow_{side}"]
        turned = [np.arctan2(way[1], way[0]) for way in (arm, rod)]
        stated = [np.arctan2(sign * 0.3, 0.5), np.arctan2(-sign * 0.1, 0.8)]
        angles.append((turned[1] - turned[0]) - (stated[1] - stated[0]))
    assert angles[1] == pytest.approx(-angles[0] + 0.1, abs=1e-9)


def test_motors_keep_their_names() -> None:
    """A limb with two motors, and a network with one: the joints' names, unless another limb has them."""

    def two(names: tuple[str, str], other: str) -> list[str]:
        tables = planar()
        tables["limb"][0] |= {"name": "q4"}
        tables["limb"][1]["name"] = other
        for k, name in enumerate(names):
            tables["limb"][0]["joints"][k] |= {"name": name, "actuated": True}
        return [each.name for each in robot(**tables).actuators]

    assert two(("q4", "q5"), "other") == ["q4", "q5", "other", "3"]
    assert two(("q4", "other"), "other") == ["q4", "q4.2", "other", "3"]


def test_a_singular_model_is_told(tmp_path: Path) -> None:
    """A five-bar whose distal bars are in line stands where locked motors do not hold it."""
    elbows = ("0.5 0.3 0", "0.5 -0.4 0"), ("0.5 -0.3 0", "0.5 0.4 0")
    tips = ("0.8 -0.1", "0.3 -0.1"), ("0.8 0.1", "0.3 0.1")
    text = edited(bars("revolute", 0.0, '<axis xyz="0 0 1"/>'), *elbows, *tips)
    path = tmp_path / "bars.urdf"
    regular = imported(path, text, closes=False)
    assert not any("singular" in note for note in regular.notes)
    found = imported(path, text.replace("0.3 -0.1", "0 -0.1").replace("0.3 0.1", "0 0.1"), closes=False)
    words = "the robot is singular where it stands: the platform can move with every actuator locked"
    assert any(words in note for note in found.notes)
