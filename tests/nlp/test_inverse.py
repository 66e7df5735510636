"""Inverse kinematics of many poses, held against distances, MuJoCo's loops, finite differences and ``evaluate``."""

from pathlib import Path

import numpy as np
import pytest
from builders import Array, Run, output_of, refusal_of, rows_of, saved, turn_about
from measures import circle_joints
from mujoco_robots import Oracle
from robot_files import robot_of
from robot_gallery import random_displacements, random_twist, table

from screwsynth.nlp import Case, Free, InputError, Rotation, Task, build_model, evaluate, formulate, inverse, load_case
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.proof.statement.fixed_robot import joint_centres
from screwsynth.nlp.units import Units

TASK = Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]))


def typical_case(name: str, position: Array | None = None, rotation: Rotation | None = None) -> Case:
    model = build_model(name)
    dimensions = {each.name: each.typical if len(each.typical) > 1 else each.typical[0] for each in model.parameters}
    place = model.home if position is None else position.tolist()
    return Case(model, dimensions, place, [TASK], rotation or Rotation(), units=Units(angle="rad"))


def random_poses(count: int, centre: Array, reach: float, turn: float) -> tuple[Array, Array]:
    rng = np.random.default_rng(count)
    p = centre + reach * rng.uniform(-1, 1, (count, 3))
    return p, np.array([turn_about(rng.normal(size=3), turn * rng.uniform()) for _ in range(count)])


def moved(p: Array, R: Array, twist: Array, step: float) -> tuple[Array, Array]:
    """Poses after a small motion with an angular velocity, and a velocity of the platform's origin."""
    size = float(np.linalg.norm(twist[:3]))
    return p + step * twist[3:], (turn_about(twist[:3], step * size) if size else np.eye(3)) @ R


def test_straight_legs_have_the_distances_of_their_joints() -> None:
    case = load_case("hexapod-linuxcnc")
    p, R = random_poses(600, np.array([0.0, 0.0, 20.0]), 5.0, 0.4)  # more than one block
    found = inverse(case, p, R)
    base, platform = circle_joints({"x1": 26.5, "x2": 11.543, "x3": 0.0, "x4": np.radians(5)})
    ends = p[:, None] + np.einsum("nij,kj->nki", R, platform)
    spans = ends - base
    lengths = np.linalg.norm(spans, axis=2)
    assert found.actuators == tuple(leg.name for leg in case.model.legs)
    assert set(found.measures) == {"leg_length"}
    assert found.closed.all()
    assert not found.singular.any()
    np.testing.assert_allclose(found.coordinates, lengths, rtol=1e-13)
    units = spans / lengths[:, :, None]
    np.testing.assert_allclose(found.jacobian, np.concatenate([units, np.cross(ends, units)], axis=2), atol=1e-11)
    rates = np.concatenate([np.cross(ends - p[:, None], units), units], axis=2)
    np.testing.assert_allclose(found.rates, rates, atol=1e-11)


@pytest.mark.parametrize("name", ["delta", "planar-3-rrr", "3-prs", "tricept"])
def test_actuators_are_where_mujoco_drove_them(name: str) -> None:
    oracle, rng = Oracle(robot_of(table(name)), 1.0), np.random.default_rng(3)
    driven, p, R, twists, rates = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((4, 3, 3)), np.zeros((4, 6)), []
    for k in range(4):
        driven[k] = random_displacements(oracle.robot, rng)
        oracle.drive(driven[k] - driven[k - 1])
        p[k], R[k] = oracle.position, oracle.rotation
        chi = oracle.feasible(random_twist(oracle.robot, rng))
        twists[k] = [*chi[:3], *(chi[3:] + np.cross(chi[:3], p[k]))]
        rates.append(oracle.rates(chi))
    for follow in ("home", "previous"):
        found = inverse(typical_case(name), p, R, follow=follow)
        assert found.closed.all()
        np.testing.assert_allclose(found.coordinates, driven, atol=2e-7)
        np.testing.assert_allclose(np.einsum("nai,ni->na", found.rates, twists), rates, atol=2e-6)


@pytest.mark.parametrize(
    ("name", "shift", "axis", "motions"),
    [
        ("6-rus", [0.05, -0.03, 0.04], [0.6, 0.0, 0.8], np.eye(6)),
        ("spherical-3-rrr", [0.0, 0.0, 0.0], [0.6, 0.0, 0.8], np.eye(6)[:3]),
        ("planar-3-rpr", [0.05, -0.03, 0.0], [0.0, 0.0, 1.0], np.eye(6)[2:5]),
    ],
)
def test_rows_joints_and_rates_are_those_of_evaluate_and_of_differences(
    name: str, shift: list[float], axis: list[float], motions: Array
) -> None:
    model = build_model(name)
    case = typical_case(name, np.array(model.home) + shift, Rotation(axis, 0.2))
    nlp = formulate(case)
    x = closed_start(nlp)
    state = evaluate(nlp, x)
    p, R = state.position[None], state.rotation[None]
    found = inverse(case, p, R)
    assert found.closed.all()
    assert found.joints == tuple(each.name for each in model.unknowns)
    np.testing.assert_allclose(found.unknowns[0], x[list(nlp.program.places.unknowns[0])], atol=1e-8)
    J = found.jacobian[0]
    np.testing.assert_allclose(J.T @ J, state.jacobian.T @ state.jacobian, atol=1e-7)
    if not model.members:
        np.testing.assert_allclose(J, state.jacobian, atol=1e-8)
    measured = np.concatenate([np.zeros(0), *(state.quantities[name] for name in dict.fromkeys(found.measures))])
    np.testing.assert_allclose(found.coordinates[0], measured, atol=1e-8)
    for twist in motions:
        ends = [moved(p[0], R[0], twist, step) for step in (-1e-5, 1e-5)]
        near = inverse(case, np.array([each[0] for each in ends]), np.array([each[1] for each in ends]))
        slope = (near.coordinates[1] - near.coordinates[0]) / 2e-5
        np.testing.assert_allclose(found.rates[0] @ twist, slope, atol=2e-6)


def test_each_pose_that_cannot_be_taken_is_flagged_and_the_others_stay() -> None:
    p, R = np.tile([0.0, 0.0, 0.0], (6, 1)), np.tile(np.eye(3), (6, 1, 1))
    p[1, 0], p[2, 2], p[3, 1] = 9.0, 0.1, np.nan  # out of reach, out of the plane, no number
    R[4] = np.diag([1.0, 1.0, -1.0])
    case = typical_case("planar-3-rrr", p[0])
    for follow in ("home", "previous"):
        found = inverse(case, p, R, follow=follow)
        assert found.closed.tolist() == [True, False, False, False, False, True]
        for values in (found.coordinates, found.unknowns, found.jacobian, found.rates):
            assert np.isnan(values[1:5]).all()
            assert np.isfinite(values[[0, 5]]).all()
    far = inverse(typical_case("delta"), [[0.0, 0.0, -9.0], [*build_model("delta").home]])
    assert far.closed.tolist() == [False, True]
    assert inverse(case, np.zeros((0, 3))).coordinates.shape == (0, 3)
    # A singular pose is closed and flagged.
    case = load_case("hexapod-linuxcnc")
    turns = np.array([turn_about([0, 0, 1], angle) for angle in np.radians([0, 30, 90, 90.001])])
    found = inverse(case, np.tile([0.0, 0.0, 20.0], (4, 1)), turns)
    assert found.closed.all()
    assert found.singular.tolist() == [False, False, True, False]


def test_joints_are_followed_from_pose_to_pose_beyond_a_turn() -> None:
    case = typical_case("planar-3-rpr")
    base, platform, _ = joint_centres(case)
    # The first leg turns about its joint of the base.
    turns = [turn_about([0, 0, 1], angle) for angle in np.linspace(0, 2 * np.pi, 26)[:-1]]
    p = np.array([base[0] - platform[0] + turn @ (platform[0] - base[0]) for turn in turns])
    home, path = inverse(case, p), inverse(case, p, follow="previous")
    assert path.closed.all()
    assert home.closed[-1]
    lengths = np.linalg.norm(p[:, None] + platform - base, axis=2)
    np.testing.assert_allclose(path.coordinates, lengths - lengths[0], atol=1e-9)
    turned = (path.unknowns[-1] - home.unknowns[-1]) / (2 * np.pi)
    np.testing.assert_allclose(turned, [1, *[0] * (len(turned) - 1)], atol=1e-9)


def test_a_robot_of_another_size_has_the_same_joints() -> None:
    case = typical_case("3-prs")
    p = np.add(case.model.home, [[0.0, 0.0, 0.03], [0.0, 0.0, -0.05]])
    large = {each.name: 50 * each.typical[0] for each in case.model.parameters if each.dimension.value == "length"}
    other = Case(case.model, {**case.parameters, **large}, case.position, case.tasks)
    found, same = inverse(other, 50 * p), inverse(case, p)
    assert found.closed.all()
    assert np.abs(same.coordinates).min() > 0.01
    np.testing.assert_allclose(found.coordinates, 50 * same.coordinates, rtol=1e-8)


def test_input_that_is_none_is_refused() -> None:
    case = typical_case("delta")
    with pytest.raises(InputError, match=r"expected arrays \(N, 3\) and \(N, 3, 3\), got \(3, 2\)"):
        inverse(case, np.zeros((3, 2)))
    with pytest.raises(InputError, match=r"got \(\) and"):
        inverse(case, 1.0)
    with pytest.raises(InputError, match="must be 'home' or 'previous'"):
        inverse(case, np.zeros((1, 3)), follow="next")  # type: ignore[arg-type]
    free = Case(case.model, {**case.parameters, "arm": Free(0.3, 0.5)}, case.position, case.tasks)
    with pytest.raises(InputError, match=r"robot\.parameters\.arm: is free, and joint positions"):
        inverse(free, np.zeros((1, 3)))


def test_the_command_writes_a_row_for_each_pose(tmp_path: Path, cli: Run) -> None:
    poses = saved(tmp_path / "poses.csv", "x;y;z;roll;pitch;yaw\n0;0;20;0;0;0\n\n1;0;20;10;0;90\n")
    out = output_of(cli("inverse", "hexapod-linuxcnc", "--poses", str(poses), "--csv", "-", "--derivatives"))
    R = turn_about([0, 0, 1], np.pi / 2) @ turn_about([1, 0, 0], np.radians(10))
    expected = inverse(load_case("hexapod-linuxcnc"), [[0, 0, 20], [1, 0, 20]], [np.eye(3), R])
    rows = rows_of(out)
    assert [row["row"] for row in rows] == ["2", "4"]
    assert {row["closed"] for row in rows} == {"yes"}
    for row, q, rates, J in zip(rows, expected.coordinates, expected.rates, expected.jacobian, strict=True):
        np.testing.assert_allclose([float(row[f"leg_length {name}"]) for name in expected.actuators], q, rtol=1e-13)
        np.testing.assert_allclose(float(row["rate 2- omega_y"]), rates[2, 1], atol=1e-11)
        np.testing.assert_allclose(float(row["J 6 m_z"]), J[5, 5], atol=1e-11)
    text = output_of(cli("inverse", "hexapod-linuxcnc", "--poses", str(poses)))
    assert "solved at all 2 poses" in text


def test_the_command_ends_with_status_1_where_poses_are_not_closed(tmp_path: Path, cli: Run) -> None:
    case, out = saved(tmp_path / "delta.toml", typical_case("delta").to_toml()), tmp_path / "out.csv"
    x, y, z = build_model("delta").home
    poses = saved(tmp_path / "poses.csv", f"x,y,z\n{x},{y},{z + 0.05}\n0,0,-9\n0,0,-8\n")
    code, text, err = cli("inverse", str(case), "--poses", str(poses), "--csv", str(out))
    assert (code, err) == (1, "")
    assert "no solution at 2 of 3 poses, the first in row 3 of" in " ".join(text.split())
    assert str(poses).replace(" ", "") in "".join(text.split())
    rows = rows_of(out.read_text(encoding="utf-8"))
    assert [row["closed"] for row in rows] == ["yes", "no", "no"]
    expected = inverse(load_case(str(case)), [[x, y, z + 0.05]])
    assert float(rows[0]["actuator_angle 1"]) == pytest.approx(expected.coordinates[0, 0], rel=1e-12)
    assert rows[1]["actuator_angle 1"] == ""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x,y,z\n0,0,a\n", ("poses.csv", "row 2, column z", "must be a number")),
        ("x,y,z\n0,0,inf\n", ("poses.csv", "row 2, column z", "finite")),
        ("x,y\n0,0\n", ("poses.csv", "column z is missing")),
        ("x,y,z,qw,qx,qy,qz\n0,0,20,1,1,0,0\n", ("poses.csv", "row 2", "unit quaternion")),
        ("x,y,z,angle\n0,0,20,1\n", ("poses.csv", "row 2", "axis")),
        ("", ("poses.csv", "no rows")),
        (None, ("--poses", "cannot be read")),
    ],
)
def test_a_bad_file_of_poses_is_refused(text: str | None, words: tuple[str, ...], tmp_path: Path, cli: Run) -> None:
    poses = tmp_path / "poses.csv"
    if text is not None:
        saved(poses, text)
    refusal_of(cli("inverse", "hexapod-linuxcnc", "--poses", str(poses)), *words)


def test_free_dimensions_and_lonely_options_are_refused(tmp_path: Path, cli: Run) -> None:
    poses = str(saved(tmp_path / "poses.csv", "x,y,z\n0,0,20\n"))
    refusal_of(cli("inverse", "paper-4.4-max", "--poses", poses), "paper-4.4-max.toml: robot.parameters", "is free")
    refusal_of(cli("inverse", "hexapod-linuxcnc", "--poses", poses, "--derivatives"), "--derivatives: needs --csv FILE")
    refusal_of(cli("inverse", "hexapod-linuxcnc", "--poses", poses, "--csv", poses), "poses.csv")
