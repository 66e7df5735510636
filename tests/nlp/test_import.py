"""Robots read from MJCF and URDF: the same robot in every form, its maker's motor rates, loops closed, dimensions."""

from __future__ import annotations

import json
import sys
import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
import reachy
from builders import Array, Run, assert_words, output_of, refusal_of, saved, turn_about

from screwsynth.models import RobotError, Substitution, jacobian, robot
from screwsynth.models.mechanism import mechanism_of, wrenches_of
from screwsynth.models.mechanism.topology import between
from screwsynth.nlp import InputError, load_case
from screwsynth.nlp.formats.frames import Frame, rotation_from_roll_pitch_yaw
from screwsynth.nlp.formats.reading.closing import close, gap_of
from screwsynth.nlp.formats.reading.importing import Imported, Request, import_robot
from screwsynth.nlp.formats.reading.reduction import Ends, _extent
from screwsynth.nlp.formats.reading.robotfile import check_text, robot_file_text
from screwsynth.nlp.formats.reading.urdf import read_urdf
from screwsynth.nlp.formats.reading.xmltext import read_xml

STEWARTS = tuple(f"stewart_{k}" for k in range(1, 7))


def imported(folder: Path, text: str, name: str, ends: Ends, *, loops: str = "", closes: bool = True) -> Imported:
    path = saved(folder / name, text)
    path.with_suffix(".yaml").unlink(missing_ok=True)
    if loops:
        path.with_suffix(".yaml").write_text(loops, encoding="utf-8")
    return import_robot(Request(path, ends, closes))


def work_rates(tables: dict[str, Any]) -> Array:
    """J'J of a robot file at home: F of every motion."""
    J = wrenches_of(mechanism_of(tables), 0.1).jacobian
    return np.asarray(J.T @ J)


def test_motor_rates_of_reachy_mini_are_its_makers() -> None:
    """The shipped robot against inverse kinematics in closed form from the maker's other file, at 40 poses."""
    model = load_case("reachy-mini").model
    own = Substitution.identity(model)
    closure = ca.vertcat(*[each.expression for each in model.closure])
    length = ca.SX.sym("length")
    rows = ca.densify(jacobian(model.wrenches, length, model.members))
    screws = ca.densify(ca.horzcat(*[each.screws for each in model.actuators]))
    unknowns = own.all[1]
    function = ca.Function("head", [*own.all, length], [closure, ca.jacobian(closure, unknowns), rows, screws])
    typical = ca.DM([value for each in model.parameters for value in each.typical])
    rng = np.random.default_rng(5)
    worst_angle = worst_rate = 0.0
    for _ in range(40):
        axis = rng.normal(size=3)
        R = turn_about(axis, rng.uniform(-0.35, 0.35))
        p = reachy.HOME + rng.uniform(-0.01, 0.01, 3)
        q = np.zeros(unknowns.numel())
        for _ in range(12):
            values = [each.full() for each in function(typical, q, R, p, 1.0)]
            q -= np.linalg.solve(values[1], values[0]).ravel()
        assert np.abs(values[0]).max() < 1e-15
        twist = np.concatenate([rng.normal(size=3), 0.1 * rng.normal(size=3)])
        # Row and screw are (force, moment) and (omega, v): the row's work rate in a twist is crosswise.
        crossed = np.hstack([values[2][:, 3:], values[2][:, :3]])
        crossed_twist = values[2][:, :3] @ twist[3:] + values[2][:, 3:] @ twist[:3]
        rates = crossed_twist / np.einsum("ij,ji->i", crossed, values[3])
        expected = np.array([motor.rate(p, R, twist) for motor in reachy.MOTORS])
        angles = np.array([motor.angle(p, R) for motor in reachy.MOTORS])
        worst_angle = max(worst_angle, float(np.abs(q - angles).max()))
        worst_rate = max(worst_rate, float(np.abs(rates - expected).max() / np.abs(expected).max()))
    assert worst_rate < 1.5e-5
    assert worst_angle < 1.5e-5


def test_one_robot_in_six_forms(tmp_path: Path) -> None:
    """MJCF with sites, and URDF with frames, with pairs in YAML and with constraints, are the same six limbs."""
    head, driven = Ends("head", "torso"), Ends("head", "", STEWARTS)
    pairs = json.dumps({
        "closed_loop": [[f"loop{k}_A", f"loop{k}_B"] for k in range(1, 7)],
        "type": ["3d"] * 6,
        "name_mot": list(STEWARTS),
    })  # fmt: skip
    balls = json.dumps({
        "closed_loop": [[f"closing_{k}_1", f"closing_{k}_2"] for k in range(1, 7)],
        "type": ["3D"] * 6,
        "name_mot": list(STEWARTS),
        "joint_name": [f"passive_{k}_{letter}" for k in range(1, 7) for letter in "xyz"],
        "joint_type": ["FIXED", "FIXED", "SPHERICAL"] * 6,
    })  # fmt: skip
    found = [
        imported(tmp_path, reachy.mjcf(), "head.xml", head, closes=False),
        imported(tmp_path, reachy.mjcf(lift=0.002), "lifted.xml", head),
        imported(tmp_path, reachy.urdf("frames"), "frames.urdf", driven),
        imported(tmp_path, reachy.urdf("pairs"), "pairs.urdf", Ends("head"), loops=pairs),
        imported(tmp_path, reachy.urdf("frames"), "balls.urdf", Ends("head"), loops=balls),
        imported(tmp_path, reachy.urdf("constraints"), "constraints.urdf", driven),
    ]
    first = work_rates(found[0].tables)
    for each in found:
        shapes = [[joint["type"] for joint in limb["joints"]] for limb in each.tables["limb"]]
        assert shapes == [["R", "S", "S"]] * 6
        assert {limb["name"] for limb in each.tables["limb"]} == set(STEWARTS)
        np.testing.assert_allclose(work_rates(each.tables), first, rtol=0, atol=1e-9 * first.max())
    # Newton's method brings the head down: the motors stay where they are.
    assert [gap.distance for gap in found[1].gaps] == pytest.approx([0.002] * 6, rel=1e-9)
    assert {joint["name"] for joint in found[0].tables["limb"][0]["joints"]} == {"stewart_1", "passive_1", "loop_1"}
    path = Path(__file__).parents[2] / "cases" / "robots" / "reachy-mini-head.toml"
    shipped = tomllib.loads(path.read_text(encoding="utf-8"))
    np.testing.assert_allclose(work_rates(shipped), first, rtol=0, atol=3e-5 * first.max())


def hinge(name: str, links: str, origin: str, *, turn: str = "0 0 0") -> str:
    parent, child = links.split()
    return (
        f'<link name="{child}"/><joint name="{name}" type="revolute"><origin xyz="{origin}" rpy="{turn}"/>'
        f'<axis xyz="1 0 0"/><parent link="{parent}"/><child link="{child}"/></joint>'
    )


FIVE_BAR = (
    '<robot name="five-bar"><link name="base"/>'
    + hinge("mot1", "base a", "0 0.15 0")
    + hinge("mot2", "base b", "0 -0.15 0")
    + hinge("elbow1", "a c", "0 0.1 -0.4")
    + hinge("elbow2", "b d", "0 -0.1 -0.4")
    + hinge("end_A", "c one", "0 -0.26 -0.4", turn="1.2 0 0")
    + hinge("end_B", "d two", "0 0.23 -0.41")
    + "</robot>"
)


def test_newton_closes_a_planar_loop_with_idle_hinges(tmp_path: Path) -> None:
    """A weld between two hinges about one axis, as example-parallel-robots writes a hinge that closes a loop."""
    loops = "closed_loop: [[end_A, end_B]]\ntype: [6d]\nname_mot: [mot1, mot2]\n"
    found = imported(tmp_path, FIVE_BAR, "five.urdf", Ends("d"), loops=loops)
    paths = sorted([joint["name"] for joint in limb["joints"]] for limb in found.tables["limb"])
    assert paths == [["mot1", "elbow1", "end_A"], ["mot2", "elbow2"]]
    place = {joint["name"]: np.array(joint["at"]) for limb in found.tables["limb"] for joint in limb["joints"]}
    np.testing.assert_array_equal(place["mot1"], [0, 0.15, 0])
    # The links keep their lengths, and the arms stay: their motors are driven joints.
    np.testing.assert_allclose(place["elbow1"], [0, 0.25, -0.4], atol=1e-15)
    assert np.linalg.norm(place["end_A"] - place["elbow1"]) == pytest.approx(np.hypot(0.26, 0.4), abs=1e-14)
    assert np.linalg.norm(place["end_A"] - place["elbow2"]) == pytest.approx(np.hypot(0.23, 0.41), abs=1e-14)
    ranks = wrenches_of(mechanism_of(found.tables), 0.5).ranks
    assert (ranks.freedoms, ranks.jacobian) == (2, 6)


NESTED = """<mujocoinclude><body name="arm" pos="0.4 0 0" euler="0 90 0">
<joint name="motor" axis="0 1 0" ref="10"/><joint name="swivel" axis="1 0 0"/>
<site name="s1" pos="-0.1 0.1 0.3"/><site name="s2" pos="-0.1 -0.1 0.3"/>
<site name="t1" pos="-0.6 0.1 0.3"/><site name="t2" pos="-0.6 -0.1 0.3"/></body></mujocoinclude>"""
MAIN = """<mujoco model="mixed"><compiler eulerseq="xyz"/><default><joint type="hinge" range="-30 40"/>
<default class="slide"><joint type="slide" axis="0 0 1" range="-0.1 0.2"/></default></default>
<option integrator="RK4"/><sensor><jointpos joint="motor"/></sensor>
<worldbody><include file="parts/arm.xml"/>
<body name="table" pos="0.7 0 0.1"><joint name="lift" class="slide"/><body name="plate" pos="0 0 0.1"/></body>
<body name="shaft" pos="0 0.5 0"><joint name="gear" axis="0 1 0"/></body></worldbody>
<equality><connect name="hinge_a" body1="arm" body2="plate" anchor="0 0.1 0"/>
<connect name="hinge_b" body1="arm" body2="plate" anchor="0 -0.1 0"/>
<joint name="train" joint1="motor" joint2="gear" polycoef="0 -2 0 0 0"/>
<connect body1="arm" body2="table" anchor="0 0 0" active="false"/></equality>
<actuator><velocity joint="gear"/><motor name="pull" tendon="rope"/></actuator></mujoco>"""


def test_files_defaults_angles_hinges_of_two_connects_and_gears(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xml").write_text(NESTED, encoding="utf-8")
    found = imported(tmp_path, MAIN, "main.xml", Ends("plate"), closes=False)
    joints = {joint.name: joint for joint in found.mechanism.joints}
    assert {name: joint.kind for name, joint in joints.items()} == {
        "motor": "R", "swivel": "R", "lift": "P", "hinge_a": "R",
    }  # fmt: skip
    # The body turns about y by 90 degrees: the first axis stays, and x of the body is -z of the world.
    np.testing.assert_allclose(joints["motor"].axis, [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(np.abs(joints["swivel"].axis), [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(np.abs(joints["hinge_a"].axis), [0, 1, 0], atol=1e-15)
    assert joints["lift"].range == pytest.approx((-0.1, 0.2))
    assert joints["motor"].range == pytest.approx(np.radians([-40, 30]))  # counted from the configuration, at ref
    assert joints["motor"].actuated  # through the gear, which is on a side chain
    notes = " ".join(found.notes)
    assert_words(notes, "gear", "not active", "'pull'")
    assert [joint["type"] for limb in found.tables["limb"] for joint in limb["joints"]].count("U") == 1


def test_suggestions_become_dimensions(tmp_path: Path, cli: Run) -> None:
    model, out = tmp_path / "head.xml", tmp_path / "robot.toml"
    model.write_text(reachy.mjcf(names=False), encoding="utf-8")
    text = output_of(cli("import", str(model), "--platform", "head", "--close", "--suggest"))
    assert_words(
        text, "circle1", "circle2", "circle3", "limbs 1, 3, 5; 2, 4, 6 are copies, rotated by 120 deg", "mirror"
    )
    dimensions = ("--free", "fold", "circle3=rp", "stewart_1.axis")
    output_of(cli("import", str(model), "--platform", "nose", "--close", "--out", str(out), *dimensions))
    tables = tomllib.loads(out.read_text(encoding="utf-8"))
    assert tables["dimensions"]["rp"]["typical"] == pytest.approx(0.03, abs=1e-6)
    assert [limb["repeat"]["count"] for limb in tables["limb"]] == [3, 3]
    np.testing.assert_allclose(tables["home"], reachy.HOME + np.array([0.05, 0, 0]), atol=1e-6)
    larger = mechanism_of(tables, {"rp": 0.035})
    (platform,) = [link for link in larger.links if link.name == "platform"]
    ends = [joint.point for joint in larger.joints if joint.name.endswith(":3")]
    assert len(ends) == 6
    np.testing.assert_allclose([np.hypot(*end[:2]) for end in ends], 0.035, atol=1e-6)
    assert platform.position[0] == pytest.approx(0.05, abs=1e-6)
    # Without copies and dimensions the robot is that of the model, to rounding; with them, to its decimals.
    text = output_of(cli("import", str(model), "--platform", "head", "--close", "--out", "-"))
    plain = work_rates(tomllib.loads(text))
    np.testing.assert_allclose(work_rates(tables), plain, rtol=0, atol=1e-4 * plain.max())


def test_a_slide_follows_the_joints_that_it_joins(tmp_path: Path, cli: Run) -> None:
    feet = [(1, 0), (-0.5, 0.8), (-0.5, -0.8), (0.9, 0.3), (-0.2, 0.9), (-0.7, -0.5)]
    legs = "".join(
        f'<body name="leg{k}" pos="{x} {y} 0"><joint name="b{k}" type="ball"/><body name="rod{k}">'
        f'<joint name="p{k}" type="slide" axis="{0.6 * x - x} {0.6 * y - y} 1"/><site name="a{k}_1" pos="{0.6 * x - x} '
        f'{0.6 * y - y} 1"/></body></body>'
        for k, (x, y) in enumerate(feet)
    )
    sites = "".join(f'<site name="a{k}_2" pos="{0.6 * x} {0.6 * y} 0"/>' for k, (x, y) in enumerate(feet))
    connects = "".join(f'<connect name="a{k}" site1="a{k}_1" site2="a{k}_2"/>' for k in range(6))
    motors = "".join(f'<motor joint="p{k}"/>' for k in range(6))
    model, out = tmp_path / "sps.xml", tmp_path / "sps.toml"
    model.write_text(
        f'<mujoco><worldbody>{legs}<body name="top" pos="0 0 1"><freejoint/>{sites}</body></worldbody>'
        f"<equality>{connects}</equality><actuator>{motors}</actuator></mujoco>",
        encoding="utf-8",
    )
    output_of(cli("import", str(model), "--platform", "top", "--out", str(out), "--free", "a0=A", "b3"))
    text = out.read_text(encoding="utf-8")
    out.write_text("mine\n", encoding="utf-8")
    refusal_of(cli("import", str(model), "--platform", "top", "--out", str(out)), "screwsynth did not write it")
    tables = tomllib.loads(text)
    moved = mechanism_of(tables, {"A_x": 0.7, "b3_z": -0.2})
    joints = {joint.name: joint for joint in moved.joints}
    for leg in ("p0", "p3"):
        ball, slide, end = (f"{leg}:{k}" for k in (1, 2, 3))
        way = joints[end].point - joints[ball].point
        np.testing.assert_allclose(joints[slide].axis, way / np.linalg.norm(way), atol=1e-14, err_msg=leg)
    assert len(robot(**tables).parameters) == 6
    assert list(tables["dimensions"]) == ["A_x", "A_y", "A_z", "b3_x", "b3_y", "b3_z"]


def test_paths_between_two_nodes_are_those_of_a_search() -> None:
    def simple_paths(
        edges: list[tuple[str, str]], node: str, last: str, used: tuple[int, ...], seen: set[str]
    ) -> set[int]:
        if node == last:
            return set(used)
        found: set[int] = set()
        for k, (a, b) in enumerate(edges):
            if node in (a, b) and k not in used:
                other = b if node == a else a
                if other not in seen:
                    found |= simple_paths(edges, other, last, (*used, k), seen | {other})
        return found

    rng = np.random.default_rng(3)
    sizes = set()
    for _ in range(60):
        count = int(rng.integers(4, 11))
        edges = [(str(a), str(b)) for a, b in rng.integers(0, 6, size=(count, 2)) if a != b]
        expected = simple_paths(edges, "0", "1", (), {"0"})
        assert set(between(edges, "0", "1")) == expected
        sizes.add(len(expected))
    assert len(sizes) > 4  # graphs of many kinds, those without a path among them


def test_the_written_robot_is_refused_where_it_is_another(tmp_path: Path) -> None:
    found = imported(tmp_path, reachy.mjcf(), "head.xml", Ends("head"))
    text = robot_file_text(found.tables)
    assert check_text(text, found.mechanism, found.size) < 1e-12
    # The place of a motor, which the rods' forces do not depend on but the motor's rate does, and of a rod's end.
    for number, wrong in (("0.0766", "0.0767"), ("0.1495", "0.1496")):
        other = text.replace(number, wrong, 1)
        assert other != text
        with pytest.raises(InputError, match="work rates of the robot file must differ by at most"):
            check_text(other, found.mechanism, found.size)
    with pytest.raises(RobotError):
        robot(**{**found.tables, "limb": [{"joints": []}]})


CLOSINGS = [
    f"""<link name="a{k}"/><link name="b{k}"/><link name="c{k}"/>
<joint name="turn{k}" type="revolute"><origin xyz="0.1 0 {k}" rpy="0.2 0.1 0"/><axis xyz="1 2 0"/>
<parent link="base"/><child link="a{k}"/></joint>
<joint name="slide{k}" type="prismatic"><origin xyz="0.3 0.2 0" rpy="0.5 0 0.3"/><axis xyz="0 1 1"/>
<parent link="a{k}"/><child link="b{k}"/></joint>
<joint name="loose{k}" type="floating"><origin xyz="0.5 0.1 {k}.2" rpy="0.2 0.1 -0.3"/>
<parent link="base"/><child link="c{k}"/></joint>
<constraint name="end{k}" type="{kind}">
<parent link="b{k}"/><parent_origin xyz="0.1 0.2 0.05" rpy="0.1 0.4 0"/><parent_axis xyz="1 0 1"/>
<child link="c{k}"/><child_origin xyz="0 0.1 0.1" rpy="0.3 0 0"/><child_axis xyz="0 1 1"/></constraint>"""
    for k, kind in enumerate(["spherical", "fixed", "revolute", "prismatic", "cylindrical", "universal"])
]


def test_newton_closes_every_kind_of_joint(tmp_path: Path) -> None:
    path = saved(tmp_path / "all.urdf", f'<robot name="all"><link name="base"/>{"".join(CLOSINGS)}</robot>')
    given = read_urdf(read_xml(path), path)
    before = {body.name: body.place for body in given.bodies}
    assert all(gap_of(each, before).distance > 0.01 for each in given.closures)
    angles = {
        each.name: float(place(each.first, each.first_frame, before) @ place(each.second, each.second_frame, before))
        for each in given.closures
    }
    closed = close(given, 1.0).description
    after = {body.name: body.place for body in closed.bodies}
    for each in closed.closures:
        A, B = after[each.first] @ each.first_frame, after[each.second] @ each.second_frame
        apart, cosine = A.rotation.T @ (B.position - A.position), float(A.rotation[:, 2] @ B.rotation[:, 2])
        # What each joint leaves free, told from its frames alone.
        free_way = each.closing.value in ("slide", "cylinder")
        assert np.abs(apart[:2] if free_way else apart).max() < 1e-12, each.name
        if each.closing.value in ("hinge", "cylinder"):
            assert abs(cosine) == pytest.approx(1, abs=1e-12)
        if each.closing.value in ("weld", "slide"):
            np.testing.assert_allclose(A.rotation, B.rotation, atol=1e-12)
        if each.closing.value == "universal":
            assert cosine == pytest.approx(angles[each.name], abs=1e-12)
    # The joints of the tree still hold: slides keep their direction, hinges their distance from the base.
    for body in ("b0", "b3"):
        hinge_body = f"a{body[1]}"
        before_way = (before[hinge_body].inverse() @ before[body]).position
        after_way = (after[hinge_body].inverse() @ after[body]).position
        slide = rotation_from_roll_pitch_yaw(0.5, 0, 0.3) @ np.array([0, 1, 1])
        np.testing.assert_allclose(np.cross(after_way - before_way, slide), 0, atol=1e-12)


def place(body: str, frame: Frame, places: dict[str, Frame]) -> Array:
    """The axis z of a frame on a body, in the world."""
    return np.asarray((places[body] @ frame).rotation[:, 2])


# Loops that Newton's method leaves open where a model stands: other starts, and loops that cannot close at all.


def model(end: str) -> str:
    """Two chains along x from the base: the end of the one, at (2, 0, 0), is joined to a place of the other's plate."""

    def link(name: str, place: str, joint: str, inner: str) -> str:
        hinge = f'<joint name="{joint}" axis="0 0 1"/><geom size="1"/>'
        return f'<body name="{name}" pos="{place}">{hinge}{inner}</body>'

    one = link("a1", "0 0 0", "a_root", link("a2", "1 0 0", "a_knee", '<site name="a_end" pos="1 0 0"/>'))
    plate = link("plate", "1 0 0", "c_end", f'<site name="p" pos="{end}"/>')
    other = link("c1", "-0.5 0 0", "c_root", plate)
    equality = '<equality><connect name="shut" site1="a_end" site2="p"/></equality>'
    motor = '<actuator><motor joint="c_root"/></actuator>'
    return f"<mujoco><worldbody>{one}{other}</worldbody>{equality}{motor}</mujoco>"


def test_a_straight_chain_is_closed_from_another_start(tmp_path: Path) -> None:
    """Every joint moves the ends across x, along which they are apart: Newton's step is zero."""
    found = imported(tmp_path, model("1 0 0"), "loop.xml", Ends("plate"))
    place = {joint["name"]: np.array(joint["at"]) for limb in found.tables["limb"] for joint in limb["joints"]}
    chain: list[Array] = [place["a_root"], place["a_knee"]]
    for one, other in pairwise(chain):
        assert np.linalg.norm(other - one) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(place["c_end"] - place["c_root"]) == pytest.approx(1.0, abs=1e-12)
    assert any("Newton's method" in note for note in found.notes)


def test_a_loop_that_cannot_close_is_named_with_its_least_gap(tmp_path: Path) -> None:
    """All hinges are parallel to z, in which the ends differ by 0.25: no motion of any joint changes that."""
    with pytest.raises(InputError, match="Newton's method, also from other starts") as fault:
        imported(tmp_path, model("1 0.3 0.25"), "loop.xml", Ends("plate"))
    words = str(fault.value)
    assert "gaps relative to the size: shut by" in words
    size = float(words.partition("robot's size ")[2].split()[0])
    assert float(words.partition("shut by ")[2].partition(")")[0]) * size == pytest.approx(0.25, rel=0.02)
    assert "correct the frames" in words


def calls_of_import(count: int, folder: Path) -> int:
    """Number of calls, also of built-in functions, in the import of a chain of links; it is refused as an open one."""
    kinds = ("revolute", "planar", "fixed")
    chain = "".join(
        f'<link name="l{k}"/><joint name="j{k}" type="{kinds[k % 3]}"><parent link="l{k - 1}"/><child link="l{k}"/>'
        f'<origin xyz="{k % 2} 0 0.01"/><axis xyz="0 1 {k % 2}"/></joint>'
        for k in range(1, count)
    )
    path = saved(folder / f"{count}.urdf", f'<robot name="chain"><link name="l0"/>{chain}</robot>')
    calls = 0

    def count_call(_frame: object, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    request = Request(path, Ends(f"l{count - 1}"))
    sys.setprofile(count_call)
    try:
        with pytest.raises(InputError, match="at the end of an open chain"):
            import_robot(request)
    finally:
        sys.setprofile(None)
    return calls


def test_import_of_a_chain_takes_a_time_that_grows_linearly(tmp_path: Path) -> None:
    assert calls_of_import(600, tmp_path) < 2.2 * calls_of_import(300, tmp_path)


def test_the_size_of_a_robot_is_the_largest_distance_of_its_joints() -> None:
    rng = np.random.default_rng(2)
    clouds = [rng.normal(size=(200, 3)) * scale for scale in ([1, 1, 1], [9, 1, 0], [0, 0, 1e-7])]
    clouds += [each / np.linalg.norm(each, axis=1, keepdims=True) + 1e6 for each in clouds[:1]]
    for cloud in clouds:
        apart = max(float(np.linalg.norm(cloud - each, axis=1).max()) for each in cloud)
        assert _extent(list(cloud)) == apart
    assert _extent([np.ones(3)] * 3) == 1.0
