"""Imported models: equalities as MuJoCo computes them, loops closed, decimals that contradict each other."""

# ruff: noqa: E501 - XML in one line an element

# ruff: noqa: ANN401, E501 - MuJoCo has no stubs; XML in one line an element

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, assert_words, edited, output_of, refusal_of

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
from screwsynth.nlp.formats.frames import Frame, rotation_vector
from screwsynth.nlp.formats.reading.closing import close, gap_of, gap_of_coupling
from screwsynth.nlp.formats.reading.description import Description
from screwsynth.nlp.formats.reading.importing import Imported, Request, import_robot
from screwsynth.nlp.formats.reading.mjcf import read_mjcf
from screwsynth.nlp.formats.reading.reduction import Ends
from screwsynth.nlp.formats.reading.robotfile import check_text, robot_file_text
from screwsynth.nlp.formats.reading.snapping import near_misses, snapped
from screwsynth.nlp.formats.reading.xmltext import read_xml

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
    with pytest.raises(InputError, match=r"--snap 1: not all axes that nearly meet or are nearly parallel"):
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
    assert_words(words, "nearly meet: off by 8e-07", "they were not changed; --snap")
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
    assert "tip stays open by 3e-07 and 0 deg (least squares), because dimensions in the file are inconsistent" in note
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
    words = r"the loop tip is open by 0\.01 and 0 deg.*Newton's method, also from other starts"
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
        (bars("revolute", 0.0), "loop_joint tip, axis: is missing: a joint of type revolute needs an axis"),
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


def test_fixed_joints_with_actuators_and_couplings_move_nothing(tmp_path: Path) -> None:
    """Loops are closed as without them: a fixed joint has no coordinate to keep, or to couple."""
    path, text = tmp_path / "bars.urdf", bars("spherical", 0.0)
    plain = imported(path, text).mechanism
    fixed = '<link name="f"/><joint name="fix" type="fixed"><parent link="a"/><child link="f"/>{}</joint>{}'
    for more in (
        fixed.format("", '<transmission><joint name="fix"/></transmission>'),
        fixed.format('<mimic joint="left" multiplier="2"/>', ""),
    ):
        found = imported(path, edited(text, ("<loop_joint", f"{more}<loop_joint"))).mechanism
        for one, other in zip(found.joints, plain.joints, strict=True):
            np.testing.assert_array_equal(one.point, other.point)


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
    words = "the robot is singular at the stated configuration: the platform can move with every actuator locked"
    assert any(words in note for note in found.notes)


mujoco = pytest.importorskip("mujoco")

INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
JOINTS = ("hinge", "slide", "ball", "free", "hinge slide", "hinge hinge hinge", "slide hinge ball", "")


def text(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)


def unit(rng: np.random.Generator, size: int) -> Array:
    vector = rng.normal(size=size)
    return np.asarray(vector / np.linalg.norm(vector))


def bodies(rng: np.random.Generator) -> tuple[str, list[str]]:
    """Three trees of bodies, and the names of their hinges and slides."""
    names: list[str] = []

    def body(number: int, depth: int) -> str:
        kinds = str(rng.choice([kind for kind in JOINTS if depth == 0 or kind != "free"])).split()
        place = f'pos="{text(rng.normal(size=3))}" quat="{text(rng.normal(size=4))}"'
        joints = ""
        for k, kind in enumerate(kinds):
            name = f"j{number}_{k}"
            if kind == "free":
                joints += f'<freejoint name="{name}"/>'
            else:
                own = "" if kind == "ball" else f'axis="{text(unit(rng, 3))}" ref="{rng.normal()!r}"'
                names.extend([] if kind == "ball" else [name])
                joints += f'<joint name="{name}" type="{kind}" pos="{text(rng.normal(size=3))}" {own}/>'
        site = f'<site name="s{number}" pos="{text(rng.normal(size=3))}" quat="{text(rng.normal(size=4))}"/>'
        inner = body(number + 1, depth + 1) if depth < 2 else ""
        return f'<body name="b{number}" {place}>{INERTIA}{joints}{site}{inner}</body>'

    return "".join(body(10 * k, 0) for k in (1, 2, 3)), names


def equalities(rng: np.random.Generator, scalar: list[str]) -> str:
    """Equalities of every form, each once, between random bodies of different trees."""

    def pair(letter: str) -> tuple[str, str]:
        one, other = rng.choice([1, 2, 3], 2, replace=False)
        return f"{letter}{one}{rng.integers(3)}", f"{letter}{other}{rng.integers(3)}"

    forms = {
        "connect_body": ("connect", f'anchor="{text(rng.normal(size=3))}"', "body"),
        "connect_world": ("connect", f'anchor="{text(rng.normal(size=3))}"', "world"),
        "connect_site": ("connect", "", "site"),
        "weld_body": ("weld", "", "body"),
        "weld_anchor": ("weld", f'anchor="{text(rng.normal(size=3))}"', "body"),
        "weld_pose": ("weld", f'relpose="{text(rng.normal(size=7))}"', "body"),
        "weld_both": ("weld", f'anchor="{text(rng.normal(size=3))}" relpose="{text(rng.normal(size=7))}"', "body"),
        "weld_world": ("weld", f'anchor="{text(rng.normal(size=3))}"', "world"),
        "weld_site": ("weld", "", "site"),
    }
    found = ""
    for name, (tag, own, ends) in forms.items():
        one, other = pair("s" if ends == "site" else "b")
        second = "" if ends == "world" else f'{ends if ends == "site" else "body"}2="{other}"'
        first = "site1" if ends == "site" else "body1"
        found += f'<{tag} name="{name}" {first}="{one}" {second} {own}/>'
    first, second = rng.choice(scalar, 2, replace=False)
    found += (
        f'<joint name="gear" joint1="{first}" joint2="{second}" polycoef="{rng.normal()!r} {rng.normal()!r} 0 0 0"/>'
    )
    return found + f'<joint name="held" joint1="{second}" polycoef="{rng.normal()!r} 0 0 0 0"/>'


def random_positions(rng: np.random.Generator, model: Any, near: float | None = None) -> Array:
    """Random coordinates, or some near those of the reference configuration."""
    qpos = np.array(model.qpos0)
    mujoco.mj_integratePos(model, qpos, rng.normal(size=model.nv) * (2.0 if near is None else near), 1.0)
    return qpos


def residuals(model: Any, data: Any) -> dict[str, Array]:
    """MuJoCo's violation of each equality, by its name."""
    equal = data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
    return {
        model.equality(k).name: data.efc_pos[equal & (data.efc_id == k)].copy()
        for k in range(model.neq)
        if (equal & (data.efc_id == k)).any()
    }


def read(folder: Path, model_text: str, qpos: Array) -> tuple[Description, Any, Any]:
    """A model read at a keyframe, and MuJoCo's model and data there."""
    path = folder / "m.xml"
    path.write_text(
        model_text.replace("</mujoco>", f'<keyframe><key name="k" qpos="{text(qpos)}"/></keyframe></mujoco>')
    )
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    return read_mjcf(read_xml(path), path, "k"), model, data


def test_what_equalities_are_open_by_is_what_mujoco_says(tmp_path: Path) -> None:
    """Connects, welds and joint equalities, with sites, anchors and relative poses, at 25 random configurations."""
    checked = 0
    for seed in range(25):
        rng = np.random.default_rng(seed)
        tree, scalar = bodies(rng)
        if len(scalar) < 2:
            continue
        model_text = f"<mujoco><worldbody>{tree}</worldbody><equality>{equalities(rng, scalar)}</equality></mujoco>"
        qpos = random_positions(rng, mujoco.MjModel.from_xml_string(model_text))
        given, model, data = read(tmp_path, model_text, qpos)
        places = {body.name: body.place for body in given.bodies}
        found = residuals(model, data)
        gaps = [gap_of(each, places) for each in given.closures]
        gaps += [gap_of_coupling(given, each) for each in given.couplings]
        assert len(gaps) == 11
        for gap in gaps:
            if gap.name not in found:
                assert gap.distance == pytest.approx(0, abs=1e-12)  # between bodies that cannot move
                continue
            rows = found[gap.name]
            checked += 1
            if len(rows) == 1:
                assert gap.distance + gap.angle == pytest.approx(abs(rows[0]), abs=1e-12)
                continue
            assert gap.distance == pytest.approx(np.linalg.norm(rows[:3]), abs=1e-12), gap.name
            if len(rows) == 6:
                # MuJoCo's rows of a rotation are the vector part of its quaternion.
                assert np.sin(gap.angle / 2) == pytest.approx(np.linalg.norm(rows[3:]), abs=1e-12), gap.name
    assert checked > 200


def closed_model(rng: np.random.Generator) -> str:
    """Two chains of seven freedoms, with equalities of a random form that hold at the reference configuration."""

    def chain(letter: str) -> str:
        joints = [("hinge", "hinge"), ("slide", "hinge"), ("hinge",), ("ball",)]
        inner = ""
        for k in reversed(range(4)):
            own = "".join(
                f'<joint name="{letter}{k}{n}" type="{kind}" pos="{text(0.2 * rng.normal(size=3))}"'
                + ("/>" if kind == "ball" else f' axis="{text(unit(rng, 3))}"/>')
                for n, kind in enumerate(joints[k])
            )
            end = '<site name="end_' + letter + '"/>' if k == 3 else ""
            place = f'pos="{text(0.5 * rng.normal(size=3))}" quat="{text(rng.normal(size=4))}"'
            inner = f'<body name="{letter}{k}" {place}>{INERTIA}{own}{end}{inner}</body>'
        return inner

    plain = f"<mujoco><worldbody>{chain('a')}{chain('c')}</worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(plain)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    A, C = (Frame(data.body(name).xpos.copy(), data.body(name).xmat.reshape(3, 3).copy()) for name in ("a3", "c3"))
    anchor = rng.normal(size=3)
    there = C.inverse() @ A
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, there.inverse().rotation.ravel())
    match int(rng.integers(5)):
        case 0:
            tie = f'<connect name="tie" body1="a3" body2="c3" anchor="{text(anchor)}"/>'
        case 1:
            tie = f'<weld name="tie" body1="a3" body2="c3" anchor="{text(anchor)}"/>'
        case 2:
            # The place in the first body's frame is that of the anchor, which is given in the second's.
            place = (there.inverse() @ Frame(anchor)).position
            tie = f'<weld name="tie" body1="a3" body2="c3" anchor="{text(anchor)}" relpose="{text(place)} {text(quaternion)}"/>'
        case 3:
            place = there.inverse().position
            tie = f'<weld name="tie" body1="a3" body2="c3" relpose="{text(place)} {text(quaternion)}"/>'
        case _:
            mujoco.mju_mat2Quat(quaternion, there.rotation.ravel())
            own = f'pos="{text(there.position)}" quat="{text(quaternion)}"'
            plain = plain.replace('<site name="end_c"/>', f'<site name="end_c" {own}/>')
            tie = f'<{"weld" if rng.integers(2) else "connect"} name="tie" site1="end_a" site2="end_c"/>'
    gear = '<joint name="gear" joint1="a00" joint2="c10" polycoef="0 0.3 0 0 0"/>'
    return plain.replace("</worldbody>", f"</worldbody><equality>{tie}{gear}</equality>")


def coordinates(model: Any, given: Description, places: dict[str, Frame], start: Array) -> Iterator[tuple[int, Array]]:
    """Address and value of MuJoCo's coordinates of each joint, from the places of bodies before and after."""
    parents = {body.name: body.parent for body in given.bodies}
    before = {body.name: body.place for body in given.bodies}
    for joint in given.joints:
        address = model.joint(joint.name).qposadr[0] if joint.kind != "weld" else -1
        parent, after = parents[joint.outer], places[joint.outer]
        if joint.kind == "S":
            # The last joint of its body, which hangs on the body before with its own quaternion at the reference.
            own = np.zeros(9)
            mujoco.mju_quat2Mat(own, model.body(joint.outer).quat)
            quaternion = np.zeros(4)
            mujoco.mju_mat2Quat(quaternion, (own.reshape(3, 3).T @ places[parent].rotation.T @ after.rotation).ravel())
            yield address, quaternion
        elif joint.kind in ("R", "P"):
            way = (places[parent].inverse() @ after) @ (before[parent].inverse() @ before[joint.outer]).inverse()
            axis = before[parent].rotation.T @ joint.axis
            moved = axis @ (way.position if joint.kind == "P" else rotation_vector(way.rotation))
            yield address, np.array([start[address] + moved])


def test_loops_that_newtons_method_closes_are_closed_for_mujoco(tmp_path: Path) -> None:
    """Each form of equality, from 20 configurations near a closed one: MuJoCo's residuals vanish at its coordinates."""
    for seed in range(20):
        rng = np.random.default_rng(100 + seed)
        model_text = closed_model(rng)
        start = random_positions(rng, mujoco.MjModel.from_xml_string(model_text), 0.1)
        given, model, data = read(tmp_path, model_text, start)
        assert max(np.abs(rows).max() for rows in residuals(model, data).values()) > 1e-3
        closed = close(given, 1.0).description
        places = {body.name: body.place for body in closed.bodies}
        for address, values in coordinates(model, given, places, start):
            data.qpos[address : address + len(values)] = values
        mujoco.mj_forward(model, data)
        for name in ("a3", "c3"):
            np.testing.assert_allclose(data.body(name).xpos, places[name].position, atol=1e-9, err_msg=str(seed))
        for name, rows in residuals(model, data).items():
            assert np.abs(rows).max() < 1e-10, (seed, name)
        assert all(abs(value) < 1e-10 for value in closed.offsets.values())


def platform_on_legs(rng: np.random.Generator, is_plain: bool) -> str:
    """Six legs U-P-S, whose last joints are connects, or welds of a small body behind a ball, in random forms."""
    legs, ties = "", ""
    turn = np.zeros(9)
    for k in range(6):
        azimuth = np.pi / 3 * k
        foot = np.array([np.cos(azimuth + 0.2), np.sin(azimuth + 0.2), 0.1 * np.sin(3 * k)])
        head = np.array([0.6 * np.cos(azimuth - 0.2 * (-1) ** k), 0.6 * np.sin(azimuth - 0.2 * (-1) ** k), 1.0])
        way = head - foot
        quaternion = unit(rng, 4)
        mujoco.mju_quat2Mat(turn, quaternion)
        R = turn.reshape(3, 3)
        ball = f'<body name="ball{k}" pos="{text(way)}" quat="{text(quaternion)}">{INERTIA}<joint name="a{k}" type="ball"/></body>'
        own = f'<site name="l{k}" pos="{text(way)}"/>'
        form = 0 if is_plain else int(rng.integers(5))
        if form == 0:
            ties += f'<connect name="t{k}" site1="l{k}" site2="p{k}"/>'
        elif form == 1:
            ties += f'<connect name="t{k}" body1="slide{k}" body2="top" anchor="{text(way)}"/>'
        else:
            own += ball
            anchor = rng.normal(size=3)
            # The platform's frame is parallel to the world's: the anchor, and the platform, in the small body's frame.
            place = R.T @ (np.array([0.0, 0.0, 1.0]) + anchor - head)
            inverse = np.array([quaternion[0], *-quaternion[1:]])
            pose = {
                2: f'anchor="{text(anchor)}"',
                3: f'anchor="{text(anchor)}" relpose="{text(place)} {text(inverse)}"',
                4: f'relpose="{text(R.T @ (np.array([0.0, 0.0, 1.0]) - head))} {text(inverse)}"',
            }[form]
            ties += f'<weld name="t{k}" body1="ball{k}" body2="top" {pose}/>'
        legs += (
            f'<body name="u{k}" pos="{text(foot)}">{INERTIA}<joint name="x{k}" axis="1 0 0"/><joint name="y{k}" axis="0 1 0"/>'
            f'<body name="slide{k}">{INERTIA}<joint name="q{k}" type="slide" axis="{text(way)}"/>{own}</body></body>'
        )
        legs += ""
    sites = "".join(
        f'<site name="p{k}" pos="{text(np.array([0.6 * np.cos(a), 0.6 * np.sin(a), 0.0]))}"/>'
        for k, a in enumerate(np.pi / 3 * k - 0.2 * (-1) ** k for k in range(6))
    )
    motors = "".join(f'<motor joint="q{k}"/>' for k in range(6))
    top = f'<body name="top" pos="0 0 1"><freejoint/>{INERTIA}{sites}</body>'
    return (
        f"<mujoco><worldbody>{legs}{top}</worldbody><equality>{ties}</equality><actuator>{motors}</actuator></mujoco>"
    )


def test_a_platform_is_one_robot_by_connects_and_by_welds(tmp_path: Path) -> None:
    """Balls welded to the platform by anchors and poses: work rates are those of connects, without --close."""

    def work_rates(model_text: str) -> Array:
        path = tmp_path / "m.xml"
        path.write_text(model_text)
        found = import_robot(Request(path, Ends("top")))
        assert not any("open" in note for note in found.notes)
        assert all(
            limb["joints"][0]["type"] == "U" and limb["joints"][2]["type"] == "S" for limb in found.tables["limb"]
        )
        J = wrenches_of(found.mechanism, 1.0).jacobian
        return np.asarray(J.T @ J)

    plain = work_rates(platform_on_legs(np.random.default_rng(0), is_plain=True))
    for seed in range(4):
        found = work_rates(platform_on_legs(np.random.default_rng(seed), is_plain=False))
        np.testing.assert_allclose(found, plain, rtol=0, atol=1e-9 * plain.max())


def test_keyframes_mocap_bodies_and_tendons(tmp_path: Path) -> None:
    """A model is read where a keyframe has it; what is left out is named, with what it acts on."""
    model_text = platform_on_legs(np.random.default_rng(0), is_plain=True)
    model_text = model_text.replace(
        "</worldbody>",
        '<body name="hand" mocap="true" pos="0 0 2"><site name="tip"/></body><site name="hook"/></worldbody>',
    )
    tendons = '<tendon><spatial name="rope"><site site="tip"/><site site="hook"/></spatial></tendon>'
    more = '<weld name="grip" body1="hand" body2="top"/><tendon name="knot" tendon1="rope"/></equality>' + tendons
    model_text = model_text.replace("</equality>", more).replace(
        "</actuator>", '<motor name="winch" tendon="rope"/></actuator>'
    )
    model = mujoco.MjModel.from_xml_string(model_text)
    qpos = np.array(model.qpos0)
    qpos[2:18:3] += 0.1
    path = tmp_path / "m.xml"
    keys = f'<keyframe><key name="up" qpos="{text(qpos)}"/><key qpos="{text(model.qpos0)}"/></keyframe></mujoco>'
    path.write_text(model_text.replace("</mujoco>", keys))
    low = import_robot(Request(path, Ends("top")))
    notes = " | ".join(low.notes)
    for words in (
        "equality grip was omitted: it has a mocap body",
        "equality knot was omitted: the kind tendon is not supported",
        "actuator 'winch' was omitted: it acts on the tendon 'rope'; name a joint by --actuated",
    ):
        assert words in notes
    with pytest.raises(InputError, match=r"is open by 0\.1 .*choose another configuration with --keyframe: 2"):
        import_robot(Request(path, Ends("top"), keyframe="up"))
    # The platform follows the legs, which are longer in the keyframe.
    high = import_robot(Request(path, Ends("top"), closes=True, keyframe="up"))
    tops = [next(link.position for link in each.mechanism.links if link.name == "top") for each in (low, high)]
    assert tops[1][2] > tops[0][2] + 0.1
    assert np.allclose(import_robot(Request(path, Ends("top"), keyframe="2")).tables["home"], low.tables["home"])
    with pytest.raises(InputError, match=r"--keyframe upp: no such keyframe; did you mean 'up'"):
        import_robot(Request(path, Ends("top"), keyframe="upp"))
