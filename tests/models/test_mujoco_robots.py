"""The oracle of ``mujoco_robots`` against reference numbers, and against published facts of known robots."""

import copy
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mujoco_robots import Oracle, scaled_twists
from numpy.typing import ArrayLike, NDArray
from robot_files import robot_of, rotation

import screwsynth.models

Array = NDArray[np.float64]
GALLERY = Path(screwsynth.models.__file__).parent / "robots"
CHI = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
ABOUT_Z = np.array([0.0, 0, 1, 0, 0, 0])


def table(name: str) -> dict[str, Any]:
    return tomllib.loads((GALLERY / f"{name}.toml").read_text(encoding="utf-8"))


def oracle(robot: str | dict[str, Any], length: float = 1.0, **dimensions: float) -> Oracle:
    return Oracle(robot_of(table(robot) if isinstance(robot, str) else robot, dimensions), length)


def with_axes(name: str, joint: int, axes: list[str]) -> dict[str, Any]:
    """A robot of the gallery with other axes of one joint in every limb."""
    changed = copy.deepcopy(table(name))
    for limb in changed["limb"]:
        limb["joints"][joint]["axes"] = axes
    return changed


def jacobian(robot: Oracle) -> Array:
    """Wrenches (m, 6), force then moment about the world origin, for a characteristic length of 1."""
    swapped = [(m.W.T @ scaled_twists(m.centre, 1.0))[:, [3, 4, 5, 0, 1, 2]] for m in robot.members()]
    return np.vstack(swapped)


def line(direction: ArrayLike, point: ArrayLike) -> Array:
    """Twist of a rotation about a line."""
    return np.concatenate([direction, np.cross(point, direction)])


# Values of an earlier, separate computation, printed with ten and six decimals; l = 0.7. For each robot: dimensions
# where they are not those of the file, F(CHI), F of the feasible part of CHI, its actuator rates, and F(CHI) with every
# actuator driven by 0.05. The legs of 6-UPS stand in the order of the file: those on one side of the pairs first.
REFERENCE: dict[str, tuple[dict[str, float], float, float, list[float], float]] = {
    "6-ups": (
        {"rb": 1, "rp": 0.6, "base_half": math.degrees(0.35), "platform_half": math.degrees(0.75), "h": 1.2},
        0.6775666447,
        0.6775666447,
        [-0.156067, -0.207255, -0.566661, 0.345771, -0.390167, -0.131767],
        0.6896774965,
    ),
    "3-rps": ({}, 0.9536868613, 0.2822638991, [0.051880, -0.095752, -0.520004], 0.9659029686),
    "3-upu": ({}, 0.7811721401, 0.2159301561, [-0.337393, -0.306747, 0.089456], 0.7929893869),
    "tricept": (
        {"turn": math.degrees(0.3)},
        0.9213889813,
        0.3712266112,
        [0.230770, -0.301242, -0.476681],
        0.9286716318,
    ),
    "delta": (
        {
            "rb": 0.4,
            "rp": 0.12,
            "arm": 0.45,
            "w": 0.1,
            "tilt": math.degrees(0.4),
            "rod": math.hypot(0.28 + 0.45 * math.cos(0.4), 0.85 - 0.45 * math.sin(0.4)),
        },
        2.5478782427,
        0.9190027654,
        [-0.355875, -0.216789, 1.581346],
        2.5578274323,
    ),
    "delta-parallelogram": (
        {
            "rb": 0.4,
            "rp": 0.12,
            "arm": 0.45,
            "tilt": math.degrees(0.4),
            "rod": math.hypot(0.28 + 0.45 * math.cos(0.4), 0.85 - 0.45 * math.sin(0.4)),
        },
        2.2416295709,
        0.4595013827,
        [-0.355875, -0.216789, 1.581346],
        2.2466369256,
    ),
    "planar-3-rrr": (
        {"turn": math.degrees(0.2)},
        1.5138660321,
        0.8315910321,
        [-1.653630, 0.169939, 0.704750],
        1.5472838594,
    ),
    "spherical-3-rrr": ({}, 2.0867, 0.4067, [0.3, -0.5, 0.7], 2.1008863285),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_reference_numbers_at_home_and_driven_away_from_it(name: str) -> None:
    dimensions, F, F_feasible, rates, F_driven = REFERENCE[name]
    robot = oracle(name, 0.7, **dimensions)
    feasible = robot.feasible(CHI)
    found = [robot.objective(CHI), robot.objective(feasible)]
    np.testing.assert_allclose(robot.rates(feasible), rates, rtol=0, atol=6e-7)
    robot.drive([0.05] * robot.robot.actuators)
    np.testing.assert_allclose([*found, robot.objective(CHI)], [F, F_feasible, F_driven], rtol=0, atol=1e-10)


def test_tsais_3_upu_has_the_known_singular_values_and_is_singular_with_equal_radii() -> None:
    robot = oracle("3-upu")
    values = np.linalg.svd(jacobian(robot), compute_uv=False)
    np.testing.assert_allclose(values, np.repeat([1.601235, 0.896811, 0.243109], 2), rtol=0, atol=6e-7)
    assert robot.objective(ABOUT_Z) == pytest.approx(2.563954, abs=6e-7)
    assert oracle("3-upu", rb=1, rp=1, h=1).ranks().J == 4


def test_the_snu_3_upu_is_in_a_constraint_singularity_at_home() -> None:
    snu = table("3-upu")
    for joint in (0, 2):
        snu["limb"][0]["joints"][joint]["axes"] = [
            "x" if axis == "y" else "cross(x, A - B)" for axis in snu["limb"][0]["joints"][joint]["axes"]
        ]
    robot = oracle(snu)
    ranks = robot.ranks()
    assert (ranks.J, ranks.constraints, ranks.freedoms, ranks.locked) == (4, 1, 5, 2)
    assert robot.objective(ABOUT_Z) == pytest.approx(3.0, abs=1e-12)
    for azimuth in (0.0, 0.4, 2.0):
        twist = line([math.cos(azimuth), math.sin(azimuth), 0], [0, 0, 1.4])
        assert robot.objective(twist) < 1e-20
    # Elsewhere the three couples are independent: the singularity is one of place.
    robot.drive([0.05, -0.03, 0.02])
    assert robot.ranks().constraints == 3


def test_a_upu_limb_without_parallel_pairs_transmits_a_force_beside_its_centre_and_no_couple() -> None:
    mixed = with_axes("3-upu", 2, ["cross(x, A - B)", "x"])
    robot = oracle(mixed)
    assert robot.objective(ABOUT_Z) == pytest.approx(3.1395, abs=6e-5)
    assert robot.objective(line([1, 0, 0], [0, 0, 1.4])) == pytest.approx(0.149, abs=6e-4)
    # Of the wrenches of a limb, the one that its actuator cannot change is a constraint: here its force is not zero.
    limb = robot.members(locked=False)[0]
    assert np.linalg.norm(limb.W[:3]) == pytest.approx(0.450, abs=6e-4)
    assert np.linalg.norm(oracle("3-upu").members(locked=False)[0].W[:3]) < 1e-12


def test_rows_of_the_3_rps_are_the_leg_and_a_force_along_the_hinge() -> None:
    robot = oracle("3-rps")
    for k, member in enumerate(robot.members()):
        R = rotation(np.array([0.0, 0, 1]), 2 * math.pi * k / 3)
        b, u = R @ [0.6, 0, 1.1], R @ [0.0, 1, 0]
        s = R @ np.array([-0.4, 0, 1.1]) / math.hypot(0.4, 1.1)
        wrenches = np.array([[*s, *np.cross(b, s)], [*u, *np.cross(b, u)]])
        expected = wrenches[:, [3, 4, 5, 0, 1, 2]] @ np.linalg.inv(scaled_twists(member.centre, 1.0))
        # Two orthonormal rows with the same projector span the same wrenches.
        np.testing.assert_allclose(expected.T @ expected, member.projector, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", ["delta", "delta-parallelogram"])
def test_motor_angles_of_the_irb_360_are_the_published_ones(name: str) -> None:
    # R. L. Williams II, "The Delta Parallel Robot", prints tenths of a degree; the digits beyond are those of closed
    # loops. His first motor stands at azimuth -90 degrees, so everything is turned.
    sides = {"rb": 0.567 / math.sqrt(12), "rp": 0.076 / math.sqrt(3), "tilt": 0.0}
    turn = rotation(np.array([0.0, 0, 1]), math.pi / 2)
    for degrees, position in (([-20.547] * 3, [0, 0, -0.9]), ([47.504, -11.569, 21.378], [0.3, 0.5, -1.1])):
        robot = oracle(name, **sides)
        robot.drive(np.deg2rad(degrees))
        # A motor's thousandth of a degree moves a platform by about 1e-5 of an arm.
        np.testing.assert_allclose(robot.position, turn @ position, rtol=0, atol=3e-5)
        np.testing.assert_allclose(robot.rotation, np.eye(3), rtol=0, atol=1e-12)


def test_two_rods_count_a_translation_twice_where_a_parallelogram_counts_it_once() -> None:
    motor = np.deg2rad([47.504, -11.569, 21.378])
    rods, parallelograms = (oracle(name, tilt=0.0) for name in ("delta", "delta-parallelogram"))
    rods.drive(motor)
    parallelograms.drive(motor)
    for v in np.eye(3):
        twist = np.concatenate([np.zeros(3), v])
        assert rods.objective(twist) == pytest.approx(2 * parallelograms.objective(twist), rel=1e-12)


def test_isotropic_robots() -> None:
    eye, orthoglide, tripteron = (oracle(name, 0.7) for name in ("spherical-3-rrr", "orthoglide", "tripteron"))
    w, v = np.array([0.3, -0.5, 0.7]), np.array([0.4, 0.6, -0.2])
    rotated, translated = np.concatenate([w, np.zeros(3)]), np.concatenate([np.zeros(3), v])
    np.testing.assert_allclose(eye.rates(rotated), w, rtol=0, atol=1e-14)
    assert eye.objective(rotated) == pytest.approx(0.49 * w @ w, abs=1e-14)
    for robot in (orthoglide, tripteron):
        np.testing.assert_allclose(robot.rates(translated), v, rtol=0, atol=1e-14)
        assert robot.objective(translated) == pytest.approx(v @ v, abs=1e-14)
    # The Tripteron is so everywhere, the Orthoglide at its centre only.
    for robot in (orthoglide, tripteron):
        robot.drive([0.1, -0.15, 0.2])
    np.testing.assert_allclose(tripteron.position, [0.1, -0.15, 0.2], rtol=0, atol=1e-14)
    np.testing.assert_allclose(tripteron.rates(translated), v, rtol=0, atol=1e-14)
    assert tripteron.objective(translated) == pytest.approx(v @ v, abs=1e-14)
    assert np.max(np.abs(orthoglide.rates(translated) - v)) > 0.05


def test_the_hexapod_of_the_paper_driven_to_the_best_pose_of_section_4_1() -> None:
    paper = {"rb": 12.0, "rp": 8.0, "base_half": 30.0, "platform_half": 8.0, "h": 45.0}
    robot = oracle("6-ups", **paper)
    p, R = np.array([-10.0, -10, 50]), rotation(np.array([0.2684, -0.2101, -0.2278]), 0.4096567)
    spans = []
    for side in (-1, 1):
        for k in range(3):
            base, platform = (math.radians(120 * k + side * half) for half in (30, 8))
            B = 12 * np.array([math.cos(base), math.sin(base), 0])
            A = 8 * np.array([math.cos(platform), math.sin(platform), 0])
            spans.append(np.linalg.norm(p + R @ A - B) - np.linalg.norm(A - B + np.array([0, 0, 45])))
    robot.drive(spans)
    np.testing.assert_allclose(robot.position, p, rtol=0, atol=1e-10)
    screw = line(np.array([2, 2, 1]) / 3, [2, 3, 6]) + np.array([0, 0, 0, 2, 2, 1]) / 3
    # The pose is printed with four decimals, and F is flat there.
    assert robot.objective(screw) == pytest.approx(407.2107, abs=1e-4)


def changed_points(name: str, **points: list[str | float]) -> dict[str, Any]:
    changed = table(name)
    for limb in changed["limb"]:
        limb["points"].update(points)
    return changed


def test_platform_singularities_lose_a_row_of_the_jacobian() -> None:
    # Distal links that meet in the middle: the platform can turn about it with all motors locked.
    planar = oracle(changed_points("planar-3-rrr", E=["2*ax", "2*ay", 0]))
    assert planar.ranks()[2:4] == (5, 3)
    assert planar.objective(ABOUT_Z) < 1e-28
    # Forearms in line: base 0.3, arms and forearms 0.25.
    five_bar = oracle("five-bar", reach=math.sqrt(0.25**2 - 0.1**2))
    assert five_bar.ranks()[2:4] == (5, 4)
    # The paper's section 4.2: six vertical legs.
    vertical = oracle("6-ups", rb=10, rp=10, base_half=15, platform_half=15)
    assert vertical.ranks().J == 3
    assert vertical.objective(ABOUT_Z) < 1e-24
    assert vertical.objective(np.array([0.0, 0, 0, 0, 0, 1])) == pytest.approx(6, abs=1e-12)


def test_constraint_singularity_of_a_delta_with_parallel_rods() -> None:
    ranks = oracle("delta", rb=0.3, arm=0.4, tilt=60, rp=0.5, rod=0.9).ranks()
    assert (ranks.J, ranks.constraints, ranks.freedoms) == (3, 2, 4)


def test_serial_singularity_of_a_stretched_limb_takes_a_freedom() -> None:
    stretched = table("planar-3-rrr")
    others = copy.deepcopy(stretched["limb"][0])
    stretched["limb"][0]["repeat"], others["repeat"] = {"angles": [0]}, {"angles": [120, 240]}
    stretched["limb"][0]["points"]["E"] = ["(rb + ax)/2", "ay/2", 0]
    stretched["limb"].append(others)
    ranks = oracle(stretched).ranks()
    assert (ranks.W, ranks.C, ranks.freedoms) == ((4, 4, 4), (4, 3, 3), 2)
    # Cranks in line with their rods: six constraints, and the platform stands still.
    crank = table("6-rus")
    for limb, sign in zip(crank["limb"], "-+", strict=True):
        limb["points"]["E"] = ["(bx + ax)/2", f"{sign}(by + ay)/2", "h/2"]
    ranks = oracle(crank).ranks()
    assert (ranks.W, ranks.C, ranks.freedoms) == ((1,) * 6, (1,) * 6, 0)


def test_passive_singularity_of_a_leg_along_the_first_axis_of_its_universal_joint() -> None:
    assert oracle(with_axes("6-ups", 0, ["A - B", "cross(A - B, y)"])).ranks().W == (2,) * 6
