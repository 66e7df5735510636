"""Solved robots in other formats: MuJoCo finds their wrenches and rates, and workshops their lengths."""

import io
import re
import tomllib
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import ezdxf
import mujoco
import numpy as np
import pytest
from builders import (
    EACH_KIND,
    FEW_KINDS,
    Array,
    case_from,
    case_of,
    rows_of,
    saved,
    saved_with_robot,
    soaked,
    starter,
    starter_tables,
    starter_text,
    turn_about,
)
from link_robots import CASE, COUPLING, ROBOT
from mujoco_trees import Tree

from screwsynth.models import WrenchKind, robot
from screwsynth.models.catalog import SHIPPED
from screwsynth.models.mechanism import Coupling, Mechanism, MechanismJoint, MechanismLink, links_of, wrenches_of
from screwsynth.models.rotation import quaternion_from_matrix
from screwsynth.nlp import (
    Case,
    Free,
    InputError,
    JointMotion,
    Limits,
    Nlp,
    QuantityLimit,
    Task,
    evaluate,
    formulate,
    load_case,
)
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.formats.export import exported_files, files_at
from screwsynth.nlp.formats.frames import roll_pitch_yaw_of
from screwsynth.nlp.formats.reading.importing import Imported, Request, import_robot
from screwsynth.nlp.formats.reading.reduction import Ends
from screwsynth.nlp.formats.solved.mechanism_of import Exported, mechanism_of
from screwsynth.nlp.formats.writing.mjcf import mjcf_text
from screwsynth.nlp.formats.writing.urdf import urdf_of

ROBOTS = (*EACH_KIND, *SHIPPED)
#: Some of them together, and all of them in `make soak`.
EACH = pytest.mark.parametrize(
    "names", soaked([FEW := (*FEW_KINDS, "three-upu", "hexapod"), ROBOTS], [FEW]), ids=["few", "all"]
)
#: One of each kind of limb and of closing, for tests that build the robot again.
SOME = ("3-rps", "delta-parallelogram", "three-upu")
OTHERS = ("delta", "exechon", "spherical-3-rrr", "6-rss", "hexapod")


@cache
def placed(name: str, seed: int) -> tuple[Nlp, Array]:
    """A robot's program, and a closed point of it: its start for seed 0, else a random one near it."""
    nlp = formulate(starter(name))
    start = closed_start(nlp)
    if seed == 0:
        return nlp, start
    # A tenth of the range to each side, of unknowns a hundredth: from there, loops close in the same assembly.
    part = np.array([0.01 if each.name.startswith("q") else 0.1 for each in nlp.program.variables])
    random = np.random.default_rng(seed).uniform(-1, 1, nlp.n)
    x = close_equations(nlp, start + part * random * (nlp.upper - nlp.lower))
    assert loops_are_closed(nlp, x), name
    return nlp, x


@cache
def exported(name: str, seed: int) -> Exported:
    return mechanism_of(*placed(name, seed))


def tree_of(found: Exported) -> Tree:
    return Tree(mjcf_text(found.mechanism), found.size)


def reread(folder: Path, name: str, text: str) -> Imported:
    """A robot's file, imported."""
    return import_robot(Request(saved(folder / name, text), Ends("platform")))


def work_rates(J: Array) -> Array:
    """J'J, from which F of every twist follows, in parts of its largest entry."""
    squares = J.T @ J
    return squares / np.abs(squares).max()


@pytest.mark.parametrize("seed", soaked([0, 1], [1]))
@EACH
def test_mujoco_finds_closed_loops_and_the_rows_of_the_result(names: tuple[str, ...], seed: int) -> None:
    for name in names:
        nlp, x = placed(name, seed)
        found, state = exported(name, seed), evaluate(nlp, x)
        tree = tree_of(found)
        assert tree.open <= 1e-9, name
        body = tree.data.body("platform")
        np.testing.assert_allclose(body.xpos, state.position, atol=1e-12 * found.size)
        np.testing.assert_allclose(body.xmat.reshape(3, 3), state.rotation, atol=1e-12)
        limbs = [row.limb for row in nlp.program.model.rows]
        words = {joint.name: joint.label.partition(":")[0].partition(".")[0] for joint in found.joints}
        wrenches = tree.wrenches(words.__getitem__)
        J = state.jacobian / np.array([1.0, 1.0, 1.0, *[found.size] * 3])
        for limb in dict.fromkeys(limbs):
            rows = J[[k for k, each in enumerate(limbs) if each == limb]]
            own = wrenches.pop(limb)
            assert own.shape[1] == len(rows), (name, limb)
            basis = np.linalg.qr(own)[0]
            assert np.linalg.matrix_rank(basis.T @ rows.T, 1e-9) == np.linalg.matrix_rank(rows, 1e-9)
            np.testing.assert_allclose(rows - rows @ basis @ basis.T, 0.0, atol=1e-10, err_msg=f"{name} {limb}")
        assert all(rest.shape[1] == 0 for rest in wrenches.values()), name


@EACH
def test_actuator_rates_in_mujoco_are_those_of_the_result(names: tuple[str, ...]) -> None:
    chi = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
    for name in names:
        nlp, x = placed(name, 1)
        found = exported(name, 1)
        tree = tree_of(found)
        basis = tree.feasible_twists()
        twist = basis @ (basis.T @ chi)
        motion, rest = tree.motion(twist)
        assert rest <= 1e-9 * found.size, name
        twisted = formulate(replace(nlp.case, tasks=[Task(tuple(twist))]))
        state = evaluate(twisted, x)
        mobility = mobility_of(twisted, x, state)
        if mobility is None:
            rows = zip(nlp.program.model.rows, state.rates, strict=True)
            rates = {row.limb: rate for row, rate in rows if row.kind is WrenchKind.FORCE}
        else:
            assert mobility.constrained <= 1e-9, name
            rates = dict(mobility.actuator_rates)
        expected = [rates[joint.actuator] for joint in found.joints if joint.actuator]
        np.testing.assert_allclose(motion[tree.driven], expected, atol=1e-8 * found.size, err_msg=name)


@pytest.mark.parametrize("name", ["delta", "stewart-gough"])
def test_position_actuators_that_follow_the_rates_move_the_platform_by_the_task(name: str) -> None:
    found = exported(name, 1)
    tree = tree_of(found)
    basis = tree.feasible_twists()
    twist = basis @ basis.T @ np.array([0.0, 0.0, 0.1 / found.size, 0.3, 0.2, -0.4])
    motion, _ = tree.motion(twist)
    # So small a way that the twist is the same along it to a part of a thousand; the ramp begins and ends at rest.
    amount, seconds = 1e-3 * found.size / np.linalg.norm(twist[3:]), 0.5
    start = tree.data.body("platform").xpos.copy()
    steps = round(seconds / tree.model.opt.timestep)
    for k in range(9 * steps):  # the aligned platform turns slowly to where its legs hold it
        part = min(1.0, (k + 1) / steps)
        tree.data.ctrl[:] = amount * motion[tree.driven] * part**2 * (3 - 2 * part)
        mujoco.mj_step(tree.model, tree.data)
    moved = tree.data.body("platform").xpos - start
    wanted = amount * (twist[3:] + np.cross(twist[:3], start))
    assert np.linalg.norm(moved - wanted) <= 2e-3 * np.linalg.norm(wanted)
    assert tree.open <= 1e-8


@EACH
def test_export_import_export_import_keeps_the_rows_of_every_robot(names: tuple[str, ...], tmp_path: Path) -> None:
    for name in names:
        nlp, x = placed(name, 1)
        J = work_rates(evaluate(nlp, x).jacobian)
        mechanism = first = exported(name, 1).mechanism
        for _ in range(2):
            mechanism = reread(tmp_path, "robot.xml", mjcf_text(mechanism)).mechanism
        urdf = urdf_of(first)
        saved(tmp_path / "robot.yaml", urdf.loops_text(first))
        for each in (mechanism, reread(tmp_path, "robot.urdf", urdf.text).mechanism):
            again = wrenches_of(each, nlp.case.characteristic_length).jacobian
            np.testing.assert_allclose(work_rates(again), J, atol=1e-10, err_msg=name)


def rebuilt(tables: dict[str, object], nlp: Nlp) -> Nlp:
    """The program of a robot file's tables at its home, with the task and length of another program."""
    model = robot(**tables)  # type: ignore[arg-type] # the tables of a robot file
    tasks, length = nlp.case.tasks, nlp.case.characteristic_length
    case = Case(model=model, parameters={}, position=model.home, tasks=tasks, characteristic_length=length)
    return formulate(case)


@pytest.mark.parametrize("name", soaked([*SOME, *OTHERS], SOME))
def test_a_case_of_an_imported_robot_has_the_same_rows_and_is_exported_again(name: str, tmp_path: Path) -> None:
    for seed in (0, 1):
        nlp, x = placed(name, seed)
        state = evaluate(nlp, x)
        program, point = nlp, x
        for _ in range(2):
            text = exported_files(mechanism_of(program, point), ["mjcf"])["robot.xml"]
            program = rebuilt(reread(tmp_path, "robot.xml", text).tables, nlp)
            point = np.zeros(program.n)
            again = evaluate(program, point)
            assert again.jacobian.shape == state.jacobian.shape
            np.testing.assert_allclose(work_rates(again.jacobian), work_rates(state.jacobian), atol=1e-10)
            assert abs(again.F - state.F) <= 1e-10 * state.size


@EACH
def test_urdf_loads_in_mujoco_and_its_loop_frames_coincide(names: tuple[str, ...]) -> None:
    for name in names:
        found = exported(name, 1)
        urdf = urdf_of(found.mechanism)
        # MuJoCo merges links that are fixed to others, unless it is told not to.
        kept = urdf.text.replace("<link", '<mujoco><compiler fusestatic="false"/></mujoco>\n  <link', 1)
        model = mujoco.MjModel.from_xml_string(kept)
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        assert urdf.loops, name
        for loop in urdf.loops:
            first, second = data.body(loop.first), data.body(loop.second)
            np.testing.assert_allclose(first.xpos, second.xpos, atol=1e-9 * found.size)
            if loop.kind == "6d":
                np.testing.assert_allclose(first.xmat, second.xmat, atol=1e-9)
        platform = next(link for link in found.mechanism.links if link.name == "platform")
        np.testing.assert_allclose(data.body("platform").xpos, platform.position, atol=1e-9 * found.size)
        np.testing.assert_allclose(data.body("platform").xmat.reshape(3, 3), platform.rotation, atol=1e-9)


def test_screws_couplings_and_welds_of_any_mechanism_are_written() -> None:
    links = tuple(MechanismLink(name) for name in ("base", "a", "b", "c", "platform"))
    x, z = np.eye(3)[0], np.eye(3)[2]
    joints = (
        MechanismJoint("screw", "H", "base", "a", np.zeros(3), z, pitch=0.25, actuated=True, range=(-1.0, 2.0)),
        MechanismJoint("slide", "P", "base", "b", x, z),
        MechanismJoint("hinge", "R", "base", "c", -x, x),
        MechanismJoint("fixed", "weld", "a", "platform", z),
        MechanismJoint("ball", "S", "b", "platform", x + z),
    )
    couplings = (Coupling("two", (("screw", 0.5), ("slide", -2.0))),)
    three = (*couplings, Coupling("three", (("screw", 1.0), ("slide", 2.0), ("hinge", 3.0))))
    model = mujoco.MjModel.from_xml_string(mjcf_text(Mechanism("any", links, joints, "base", "platform", three)))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert (model.neq, model.ntendon, model.nu) == (4, 1, 1)
    np.testing.assert_allclose(model.actuator_ctrlrange, [[-1.0, 2.0]])
    assert model.body("platform").parentid == model.body("a").id
    urdf = urdf_of(Mechanism("any", links, joints, "base", "platform", couplings))
    mimic = r'<joint name="(\w+)"(?:(?!</joint>).)*<mimic joint="(\w+)" multiplier="([^"]+)"'
    factors = [(name, other, float(by)) for name, other, by in re.findall(mimic, urdf.text, re.DOTALL)]
    assert sorted(factors) == [("screw_slide", "screw", 0.25), ("slide", "screw", 0.25)]
    with pytest.raises(InputError, match="'three' cannot be written as URDF: it has 3 joints"):
        urdf_of(Mechanism("any", links, joints, "base", "platform", three))


def test_ranges_count_from_the_pose_and_reach_the_actuators() -> None:
    limits = {"actuator_length": {"min": -0.4, "max": 0.5}, "joint": {"1:1": {"max": 30}}}
    nlp = formulate(case_from(tomllib.loads(starter_text("3-rps")) | {"limits": limits}))
    found = mechanism_of(nlp, closed_start(nlp))
    state = evaluate(nlp, closed_start(nlp))
    joints = {joint.name: joint for joint in found.mechanism.joints}
    for k in range(3):
        at = state.quantities["actuator_length"][k]
        np.testing.assert_allclose(joints[f"joint_{k + 1}_2"].range, [-0.4 - at, 0.5 - at], atol=1e-12)
    hinge = joints["joint_1_1"]
    words = {joint.name: joint for joint in found.joints}
    assert hinge.range[1] == pytest.approx(np.radians(30) - words["joint_1_1"].coordinate, abs=1e-12)
    assert joints["joint_2_1"].range is None
    model = mujoco.MjModel.from_xml_string(mjcf_text(found.mechanism))
    expected = [joints[f"joint_{k + 1}_2"].range for k in range(3)]
    np.testing.assert_allclose(model.actuator_ctrlrange, expected, atol=1e-15)


def test_tables_hold_the_joints_in_every_frame() -> None:
    found = exported("tricept", 1)
    units = found.case.units
    files = exported_files(found, ["csv"])
    assert list(files) == ["README.md", "joints.csv", "links.csv", "cut-list.csv", "plates.csv"]
    frames = {}
    for row in rows_of(files["links.csv"]):
        origin = np.array([float(row[f"{c} [{units.length}]"]) for c in "xyz"])
        axes = np.array([[float(row[f"{own} axis {c}"]) for c in "xyz"] for own in "xyz"]).T
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)
        frames[row["link"]] = origin, axes
    rows = rows_of(files["joints.csv"])
    assert len(rows) == len(found.mechanism.joints)
    for row, joint in zip(rows, found.mechanism.joints, strict=True):
        for frame, link in (("base", "base"), ("platform", "platform"), ("inner", joint.inner), ("outer", joint.outer)):
            origin, axes = frames[link]
            place = np.array([float(row[f"{c} in {frame} [{units.length}]"]) for c in "xyz"])
            np.testing.assert_allclose(origin + axes @ place, joint.point, atol=1e-12)
            if joint.kind != "S":
                axis = np.array([float(row[f"axis {c} in {frame}"]) for c in "xyz"])
                np.testing.assert_allclose(axes @ axis, joint.axis, atol=1e-12)


def test_plates_are_drawn_to_scale_with_their_unit_and_their_offsets(tmp_path: Path) -> None:
    found = exported("hexapod", 1)
    up = {"joint_1_1_first": np.array([0, 0, 0.5])}
    moved = tuple(replace(each, point=each.point + up.get(each.name, 0)) for each in found.mechanism.joints)
    tilted = replace(found, mechanism=replace(found.mechanism, joints=moved))
    files = exported_files(tilted, ["dxf"])
    assert files == exported_files(tilted, ["dxf"])
    assert "joint centres of the base are not in one plane" in " ".join(files["README.md"].split())
    rows = rows_of(files["plates.csv"])
    offsets = [float(row["offset from plane [cm]"]) for row in rows if row["plate"] == "base"]
    assert max(map(abs, offsets)) > 0.02
    for plate in ("base", "platform"):
        document = ezdxf.readfile(saved(tmp_path / "plate.dxf", files[f"{plate}.dxf"]))
        assert document.units == 5
        assert not document.audit().errors
        circles = np.array([each.dxf.center for each in document.modelspace().query("CIRCLE")])
        own = [row for row in rows if row["plate"] == plate]
        stated = [[float(row[f"{c} in drawing [cm]"]) for c in "xy"] for row in own]
        np.testing.assert_allclose(circles[:, :2], stated, atol=1e-9)
        (outline,) = document.modelspace().query("LWPOLYLINE")
        assert outline.closed
        assert len(outline) == 6


def test_rotations_survive_their_three_forms() -> None:
    rng, (x, y, z) = np.random.default_rng(1), np.eye(3)
    for _ in range(200):
        R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        R *= np.linalg.det(R)
        if rng.uniform() < 0.5:  # half a turn, and a pitch of 90 degrees, where the forms have their seams
            pitched = turn_about(z, rng.uniform(-3, 3)) @ turn_about(y, np.pi / 2)
            R = R @ np.diag([1.0, -1.0, -1.0]) @ R.T if rng.uniform() < 0.5 else pitched
        found = np.zeros(9)
        mujoco.mju_quat2Mat(found, quaternion_from_matrix(R))
        np.testing.assert_allclose(found.reshape(3, 3), R, atol=1e-14)
        roll, pitch, yaw = roll_pitch_yaw_of(R)
        np.testing.assert_allclose(turn_about(z, yaw) @ turn_about(y, pitch) @ turn_about(x, roll), R, atol=1e-14)


def test_links_that_are_limbs_are_exported_with_the_labels_of_limbs() -> None:
    nlp, _ = placed("3-rps", 0)
    found = exported("3-rps", 0)
    program = rebuilt(links_of(found.mechanism), nlp)
    again = mechanism_of(program, closed_start(program))
    one, other = ([(joint.label, joint.actuator) for joint in each.joints] for each in (again, found))
    assert one == other
    for one, other in zip(again.mechanism.joints, found.mechanism.joints, strict=True):
        np.testing.assert_allclose(one.point, other.point, atol=1e-12)


def test_a_driven_parallelogram_has_the_range_of_its_way_as_an_angle() -> None:
    rod = 2.0
    driven = {"type": "Pa", "at": (0, 0, 0), "to": (0, 0, rod), "axis": "y", "actuated": True}
    model = robot("swing", home=(0, 0, rod), limb=[{"joints": [driven]}])
    limits = Limits(QuantityLimit("actuator_length", max=1.5), JointMotion("1:1", min=-1.0))
    nlp = formulate(Case(model, {}, [Free(-2, 2), 0.0, Free(0, 3)], [Task(np.eye(6)[3])], limits=limits))
    x = close_equations(nlp, np.array([rod * np.sin(0.4), rod * np.cos(0.4), 0.4]))
    found = mechanism_of(nlp, x)
    (joint,) = (each for each in found.mechanism.joints if each.actuated)
    words = next(each for each in found.joints if each.actuator)
    assert words.coordinate is not None
    assert 0.3 < words.coordinate < 0.5
    np.testing.assert_allclose(joint.range, np.array([-1.0, 1.5]) / rod - words.coordinate, atol=1e-12)
    assert tree_of(found).open <= 1e-9


# Nested loops and coupled joints in other programs' formats: MuJoCo finds the rates of the result, an import its J.


@pytest.mark.parametrize("coupling", ["", COUPLING])
def test_nested_loops_and_coupled_joints_are_exported(coupling: str, tmp_path: Path) -> None:
    free = "{ min = -0.1, max = 0.1 }, { min = 0.9, max = 1.1 }, 0]\n"
    free += "rotation = { axis = [0, 0, 1], angle = { min = -10, max = 10 } }"
    limits = "[limits]\nactuator_angle = { min = -40, max = 50 }\n"
    nlp = formulate(load_case(saved_with_robot(tmp_path, ROBOT + coupling, CASE.replace("0, 1, 0]", free) + limits)))
    start = closed_start(nlp)
    x = close_equations(nlp, start + 0.05 * np.random.default_rng(1).uniform(-1, 1, nlp.n))
    state = evaluate(nlp, x)
    assert np.abs(state.position - [0, 1, 0]).max() > 1e-3
    found = mechanism_of(nlp, x)
    tree = tree_of(found)
    assert tree.open <= 1e-9
    np.testing.assert_allclose(tree.data.body("platform").xpos, state.position, atol=1e-9)
    for mechanism in (found.mechanism, reread(tmp_path, "robot.xml", mjcf_text(found.mechanism)).mechanism):
        J = wrenches_of(mechanism, nlp.case.characteristic_length).jacobian
        np.testing.assert_allclose(work_rates(J), work_rates(state.jacobian), atol=1e-8)
    angle = next(joint.coordinate for joint in found.joints if joint.name == "motor")
    motor = next(joint for joint in found.mechanism.joints if joint.name == "motor")
    np.testing.assert_allclose(motor.range, np.radians([-40, 50]) - angle, atol=1e-12)
    basis = tree.feasible_twists()
    assert basis.shape[1] == (1 if coupling else 2)
    twist = basis @ basis.T @ np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
    twisted = formulate(replace(nlp.case, tasks=[Task(tuple(twist))]))
    mobility = mobility_of(twisted, x, evaluate(twisted, x))
    assert mobility is not None
    rates = [mobility.actuator_rates[joint.actuator] for joint in found.joints if joint.actuator]
    np.testing.assert_allclose(tree.motion(twist)[0][tree.driven], rates, atol=1e-7)
    # Another assembly of the four-bar has the same actuators, and is not reached from home.
    flipped = x + 0.5 * np.array([each.name == "q2_2" for each in nlp.program.variables])
    with pytest.raises(InputError, match="lead from home to another assembly mode or pose"):
        mechanism_of(nlp, flipped)


def centres_of(files: dict[str, str], unit: str) -> dict[str, Array]:
    """Joint centres in the frame of the base, by joint."""
    rows = rows_of(files["joints.csv"])
    return {row["joint"]: np.array([float(row[f"{c} in base [{unit}]"]) for c in "xyz"]) for row in rows}


def lengths_of(row: dict[str, str], unit: str, *names: str) -> list[float]:
    return [float(row[f"{name} [{unit}]"]) for name in names]


@pytest.mark.parametrize("name", ["exechon", "6-rus"])
def test_every_link_is_listed_with_the_distances_of_its_centres_and_drawn_with_them(name: str) -> None:
    nlp = formulate(starter(name))
    unit = nlp.case.units.length
    files = files_at(nlp, closed_start(nlp), ["csv", "dxf"], 1)
    centres = centres_of(files, unit)
    links: dict[str, list[str]] = {}
    for row in rows_of(files["joints.csv"]):
        for link in (row["inner link"], row["outer link"]):
            links.setdefault(link, []).append(row["joint"])
    listed: dict[str, list[float]] = {}
    for row in rows_of(files["cut-list.csv"]):
        parts, ends = row["parts"].split(), [row["from joint"].split(), row["to joint"].split()]
        assert len(parts) == int(row["quantity"])
        if row["item"] == "link":
            (length,) = lengths_of(row, unit, "length")
            first, last = (centres[joints[0]] for joints in ends)
            assert length == pytest.approx(np.linalg.norm(last - first), rel=1e-12)
            for part in parts:
                listed.setdefault(part, []).append(length)
    for link, joints in links.items():
        points = np.unique(np.round([centres[joint] for joint in joints], 9), axis=0)
        apart = sorted(float(np.linalg.norm(b - a)) for a, b in combinations(points, 2))
        if link in ("base", "platform"):
            assert link not in listed
            continue
        np.testing.assert_allclose(sorted(listed.get(link, [])), apart, rtol=1e-7)
        assert (f"{link}.dxf" in files) == bool(apart)
        if apart:
            space = ezdxf.read(io.StringIO(files[f"{link}.dxf"])).modelspace()
            drawn = [np.array(circle.dxf.center)[:2] for circle in space.query("CIRCLE")]
            found = sorted(float(np.linalg.norm(b - a)) for a, b in combinations(drawn, 2))
            np.testing.assert_allclose(found, apart, rtol=1e-7)  # of these robots every link is flat
            assert f"`{link}.dxf`: Outline" in files["README.md"]
    assert any(int(row["quantity"]) > 1 for row in rows_of(files["cut-list.csv"]))


def hexapod_with(limits: dict[str, Any]) -> Case:
    """A case with limits at three poses: the stated one, a higher one, and one that is turned too."""
    turned = {"rotation": turn_about((0, 1, 0), 0.2).tolist(), "translation": [1, 0, 2]}
    moves = [{"translation": [0, 0, 0]}, {"translation": [0, 0, 4]}, turned]
    pose = starter_tables("hexapod")["pose"] | {"displacements": moves}
    return case_of("hexapod", pose=pose, limits=limits)


def test_legs_have_their_strokes_over_all_poses_and_within_their_limits() -> None:
    nlp = formulate(hexapod_with({"leg_length": {"min": 3, "max": 400}}))
    unit, x = nlp.case.units.length, closed_start(nlp)
    at_poses = []
    for pose in (1, 2, 3):
        files = files_at(nlp, x, ["csv"], pose)
        centres = centres_of(files, unit)
        legs = [name for name in centres if name.endswith("_3")]
        at_poses.append([np.linalg.norm(centres[leg] - centres[leg.removesuffix("_3") + "_1_first"]) for leg in legs])
        rows = [row for row in rows_of(files["cut-list.csv"]) if row["item"] == "length of a leg"]
        slides = {name: row for row in rows for name in row["parts"].split()}
        found = [lengths_of(slides[leg.removesuffix("_3") + "_2"], unit, "length") for leg in legs]
        np.testing.assert_allclose(np.ravel(found), at_poses[-1], rtol=1e-12)
    lengths = np.array(at_poses)
    names = ("smallest used", "largest used", "stroke used", "smallest allowed", "largest allowed", "stroke allowed")
    found = np.array([lengths_of(slides[leg.removesuffix("_3") + "_2"], unit, *names) for leg in legs])
    np.testing.assert_allclose(found[:, 0], lengths.min(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], lengths.max(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found[:, 2], np.ptp(lengths, axis=0), atol=1e-12)
    np.testing.assert_allclose(found[:, 3:], [[3, 400, 397]] * 6, rtol=1e-12)
    assert np.ptp(lengths, axis=0).min() > 0.5


@pytest.mark.parametrize(
    ("least", "most", "largest", "dead"),
    [
        (None, None, 5.5, None), (3, 400, 5.5, None), (3, 400, 500, None), (None, None, None, 2),
        (3, 30, None, 2), (10, 22, 500, 9), (10, 14, None, 9), (None, 24, 500, 4), (None, 24, 9, 4),
        (None, 24, None, None),
    ],
)  # fmt: skip
def test_the_stroke_allowed_is_the_largest_one_within_all_limits(
    least: float | None, most: float | None, largest: float | None, dead: float | None
) -> None:
    given = {"leg_length": {"min": least, "max": most}, "actuator": {"stroke_max": largest, "dead_length": dead}}
    limits = {name: {key: value for key, value in table.items() if value is not None} for name, table in given.items()}
    nlp = formulate(hexapod_with({name: table for name, table in limits.items() if table}))
    files = files_at(nlp, closed_start(nlp), ["csv"], 1)
    rows = [row for row in rows_of(files["cut-list.csv"]) if row["item"] == "length of a leg"]
    assert len(rows) > 1
    unit = nlp.case.units.length
    for row in rows:
        (shortest,) = lengths_of(row, unit, "smallest used")
        # Each retracted length up to the shortest one used, and the longest stroke that the limits leave from there.
        retracted = np.linspace(0 if least is None else least, max(shortest, least or 0), 200_001)
        ends = [np.full(retracted.size, np.inf if largest is None else largest)]
        ends += [] if most is None else [most - retracted]
        ends += [] if dead is None else [retracted - dead]
        stroke = float(np.minimum.reduce(ends).max())
        found = row[f"stroke allowed [{unit}]"]
        if largest is None and dead is None and least is None:
            assert found == ""
        else:
            assert float(found) == pytest.approx(stroke, abs=1e-3)
