"""What must not change F, how it must change where it does, and symmetric hexapods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from builders import Array
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from screwsynth.models import ModelError, hexapod, moved_screw, stewart_gough
from screwsynth.nlp import Case, Free, RobotState, Rotation, Task, evaluate, formulate, solve

Triple = tuple[float, float, float]

HEXAPOD = hexapod()
CIRCLES = {"aligned": stewart_gough(layout="aligned"), "octahedral": stewart_gough(layout="octahedral")}

#: Relative to F without cancellation, so the same for every case; the worst seen is 1e-15, some rounding units.
ROUNDING = 5e-15

few = settings(derandomize=True, deadline=None, max_examples=20)


def triples(limit: float) -> st.SearchStrategy[Triple]:
    coordinate = st.floats(-limit, limit, allow_subnormal=False)
    return st.tuples(coordinate, coordinate, coordinate)


joints = st.lists(triples(5), min_size=12, max_size=12)
positions = st.tuples(st.floats(-10, 10), st.floats(-10, 10), st.floats(20, 50))
angles = st.floats(-np.pi, np.pi)
twists = st.tuples(triples(2), triples(30)).map(lambda parts: np.array([*parts[0], *parts[1]]))


def quaternion(axis: Sequence[float], angle: float) -> Array:
    """Unit quaternion, scalar first; an axis too short to have a direction is taken as z."""
    n = np.array(axis)
    size = np.linalg.norm(n)
    n = n / size if size > 1e-3 else np.array([0.0, 0.0, 1.0])
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * n)])


def product(a: Array, b: Array) -> Array:
    scalar = a[0] * b[0] - a[1:] @ b[1:]
    return np.array([scalar, *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def matrix(q: Array) -> Array:
    """Rotation matrix of a unit quaternion, column by column as the turned base vectors."""
    conjugate = q * np.array([1.0, -1.0, -1.0, -1.0])
    return np.array([product(product(q, np.array([0.0, *e])), conjugate)[1:] for e in np.eye(3)]).T


def rotation(q: Array) -> Rotation:
    size = float(np.linalg.norm(q[1:]))
    return Rotation(q[1:] if size > 0 else (0.0, 0.0, 1.0), float(2 * np.arctan2(size, q[0])))


def hexapod_states(
    base: Array, platform: Array, position: Array, turned: Rotation, twists: Sequence[Array]
) -> list[RobotState]:
    parameters = {f"base_{i + 1}": tuple(b) for i, b in enumerate(base.tolist())}
    parameters |= {f"platform_{i + 1}": tuple(a) for i, a in enumerate(platform.tolist())}
    tasks = [Task(twist, name=str(index)) for index, twist in enumerate(twists)]
    case = Case(HEXAPOD, parameters, tuple(position.tolist()), tasks, turned)
    return [evaluate(formulate(case, index), np.zeros(0)) for index in range(len(tasks))]


def hexapod_state(base: Array, platform: Array, position: Array, turned: Rotation, twist: Array) -> RobotState:
    return hexapod_states(base, platform, position, turned, [twist])[0]


def assert_same_work(one: RobotState, other: RobotState, factor: float = 1.0) -> None:
    size = max(one.size, other.size / factor**2)
    np.testing.assert_allclose(other.rates / factor, one.rates, rtol=0, atol=ROUNDING * np.sqrt(size))
    assert abs(other.F / factor**2 - one.F) <= ROUNDING * size


@few
@given(joints, positions, triples(1), angles, twists, triples(1), angles, triples(50))
def test_f_is_the_same_in_any_world_frame(
    centres: list[Triple],
    position: Triple,
    axis: Triple,
    angle: float,
    twist: Array,
    frame_axis: Triple,
    frame_angle: float,
    shift: Triple,
) -> None:
    assume(np.linalg.norm(twist) > 1e-3)
    base, platform = np.array(centres[:6]), np.array(centres[6:])
    pose, frame = quaternion(axis, angle), quaternion(frame_axis, frame_angle)
    R = matrix(frame)
    here = hexapod_state(base, platform, np.array(position), rotation(pose), twist)
    there = hexapod_state(
        base @ R.T + np.array(shift),
        platform,
        R @ np.array(position) + np.array(shift),
        rotation(product(frame, pose)),
        moved_screw(twist, R, shift),
    )
    assert_same_work(here, there)


@few
@given(joints, positions, triples(1), angles, twists, st.floats(-3, 3).map(lambda power: 10.0**power))
def test_f_grows_with_the_square_of_the_length_unit(
    centres: list[Triple], position: Triple, axis: Triple, angle: float, twist: Array, s: float
) -> None:
    assume(np.linalg.norm(twist) > 1e-3)
    base, platform, turned = np.array(centres[:6]), np.array(centres[6:]), rotation(quaternion(axis, angle))
    one = hexapod_state(base, platform, np.array(position), turned, twist)
    scaled = np.concatenate([twist[:3], s * twist[3:]])
    other = hexapod_state(s * base, s * platform, s * np.array(position), turned, scaled)
    assert_same_work(one, other, factor=s)
    # Unit forces have no length in them; their moments have one.
    np.testing.assert_allclose(other.jacobian[:, :3], one.jacobian[:, :3], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(other.jacobian[:, 3:] / s, one.jacobian[:, 3:], rtol=0, atol=100 * ROUNDING)


@few
@given(joints, positions, triples(1), angles, twists, twists)
def test_f_is_a_quadratic_form_in_the_twist(
    centres: list[Triple], position: Triple, axis: Triple, angle: float, one: Array, other: Array
) -> None:
    assume(min(np.linalg.norm(t) for t in (one, other, one + other, one - other)) > 1e-3)
    base, platform, turned = np.array(centres[:6]), np.array(centres[6:]), rotation(quaternion(axis, angle))
    combined = (one, other, one + other, one - other, -3 * one)
    a, b, c, d, e = hexapod_states(base, platform, np.array(position), turned, combined)
    assert abs(c.F + d.F - 2 * a.F - 2 * b.F) <= ROUNDING * (a.size + b.size)
    assert_same_work(a, e, factor=-3.0)


@few
@given(joints, positions, triples(1), angles, twists, st.lists(st.floats(-3, 0.5), min_size=6, max_size=6))
def test_a_joint_that_slides_along_its_leg_changes_nothing(
    centres: list[Triple], position: Triple, axis: Triple, angle: float, twist: Array, slides: list[float]
) -> None:
    assume(np.linalg.norm(twist) > 1e-3)
    pose = quaternion(axis, angle)
    base, platform = np.array(centres[:6]), np.array(centres[6:])
    ends = np.array(position) + platform @ matrix(pose).T
    slid = base + np.array(slides)[:, None] * (ends - base)
    one = hexapod_state(base, platform, np.array(position), rotation(pose), twist)
    other = hexapod_state(slid, platform, np.array(position), rotation(pose), twist)
    # Half a leg knows its direction half as well.
    size = one.size + other.size
    np.testing.assert_allclose(other.rates, one.rates, rtol=0, atol=4 * ROUNDING * np.sqrt(size))
    assert abs(other.F - one.F) <= 4 * ROUNDING * size


@few
@given(triples(1), angles, twists, positions)
def test_an_axis_and_its_opposite_with_the_opposite_angle_are_one_rotation(
    axis: Triple, angle: float, twist: Array, position: Triple
) -> None:
    assume(np.linalg.norm(axis) > 1e-3)
    assume(np.linalg.norm(twist) > 1e-3)
    parameters = {"x1": 12.0, "x2": 8.0, "x3": 0.3, "x4": 0.1}
    n = np.array(axis)
    around = angle - np.copysign(2 * np.pi, angle)
    states = [
        evaluate(formulate(Case(CIRCLES["aligned"], parameters, position, [Task(twist)], turned)), np.zeros(0))
        for turned in (Rotation(n, angle), Rotation(-7 * n, -angle), Rotation(n, around))
    ]
    assert_same_work(states[0], states[1])
    assert_same_work(states[0], states[2])


def circle_joints(layout: str, x1: float, x2: float, x3: float, x4: float) -> tuple[Array, Array]:
    """Base and platform joint centres (6, 3) in the order 1-, 1+, 2-, ... as complex numbers of the plane."""
    base, platform = [], []
    for pair in range(3):
        for sign in (-1, 1):
            middle = np.exp(2j * np.pi * pair / 3)
            base.append(x1 * middle * np.exp(1j * sign * x3))
            platform.append(x2 * middle * np.exp(1j * sign * (x4 if layout == "aligned" else np.pi / 3 - x4)))
    flat = [np.array(points) for points in (base, platform)]
    return tuple(np.column_stack([z.real, z.imag, np.zeros(6)]) for z in flat)  # type: ignore[return-value]


def circle_state(
    layout: str, parameters: dict[str, float], position: Array, axis: Array, angle: float, twist: Array
) -> RobotState:
    case = Case(CIRCLES[layout], parameters, tuple(position.tolist()), [Task(twist)], Rotation(axis, angle))
    return evaluate(formulate(case), np.zeros(0))


def random_circle_case(rng: np.random.Generator) -> tuple[dict[str, float], Array, Array, float, Array]:
    parameters = {
        "x1": rng.uniform(5, 15),
        "x2": rng.uniform(3, 10),
        "x3": rng.uniform(0, np.pi / 6),
        "x4": rng.uniform(0, np.pi / 6),
    }
    twist = np.concatenate([rng.normal(size=3), rng.normal(0, 10, size=3)])
    position = rng.uniform([-10, -10, 20], [10, 10, 50])
    return parameters, position, rng.normal(size=3), float(rng.uniform(-1.0, 1.0)), twist


@pytest.mark.parametrize("layout", CIRCLES)
def test_a_third_of_a_turn_of_task_and_pose_permutes_the_rates(layout: str) -> None:
    rng = np.random.default_rng(5)
    third = matrix(quaternion((0, 0, 1), 2 * np.pi / 3))
    for _ in range(20):
        parameters, position, axis, angle, twist = random_circle_case(rng)
        one = circle_state(layout, parameters, position, axis, angle, twist)
        # The joints of both plates fall onto each other, so the platform's turn is third * R * third'.
        turned = moved_screw(twist, third, (0, 0, 0))
        other = circle_state(layout, parameters, third @ position, third @ axis, angle, turned)
        # Leg 2 now does what leg 1 did.
        np.testing.assert_allclose(np.roll(one.rates, 2), other.rates, rtol=0, atol=ROUNDING * np.sqrt(one.size))
        # The test would pass for any robot if a permutation were no change.
        assert np.max(np.abs(one.rates - other.rates)) > 0.01 * np.max(np.abs(one.rates))


@pytest.mark.parametrize("layout", CIRCLES)
def test_the_mirror_image_of_task_and_pose_swaps_the_legs_of_pairs(layout: str) -> None:
    rng = np.random.default_rng(6)
    mirror = np.diag([1.0, -1.0, 1.0])
    for _ in range(20):
        parameters, position, axis, angle, twist = random_circle_case(rng)
        one = circle_state(layout, parameters, position, axis, angle, twist)
        # Angular velocities and axes of rotation are axial: a mirror turns them the other way.
        image = np.concatenate([-mirror @ twist[:3], mirror @ twist[3:]])
        other = circle_state(layout, parameters, mirror @ position, -mirror @ axis, angle, image)
        # 1- and 1+ change places, 2- and 3+, 2+ and 3-.
        swapped = one.rates[[1, 0, 5, 4, 3, 2]]
        np.testing.assert_allclose(swapped, other.rates, rtol=0, atol=ROUNDING * np.sqrt(one.size))


@pytest.mark.parametrize("layout", CIRCLES)
def test_a_hexapod_with_the_joints_of_a_stewart_gough_platform_has_its_jacobian(layout: str) -> None:
    rng = np.random.default_rng(7)
    for _ in range(20):
        parameters, position, axis, angle, twist = random_circle_case(rng)
        one = circle_state(layout, parameters, position, axis, angle, twist)
        base, platform = circle_joints(layout, **parameters)
        other = hexapod_state(base, platform, position, Rotation(axis, angle), twist)
        # Joint centres differ by a rounding unit of 15 length units, moments have arms of that size.
        np.testing.assert_allclose(other.jacobian[:, :3], one.jacobian[:, :3], rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(other.jacobian[:, 3:], one.jacobian[:, 3:], rtol=0, atol=15 * ROUNDING)
        assert_same_work(one, other)


def test_aligned_and_octahedral_are_one_robot_only_when_the_platform_is_a_regular_hexagon() -> None:
    # At x4 = 30 degrees both layouts place platform joint k+- at 120 k +- 30: the only robot that they share.
    rng = np.random.default_rng(8)
    parameters, position, axis, angle, twist = random_circle_case(rng)
    hexagon = parameters | {"x4": np.pi / 6}
    assert_same_work(*(circle_state(layout, hexagon, position, axis, angle, twist) for layout in CIRCLES))
    triangle = parameters | {"x4": 0.0}
    one, other = (circle_state(layout, triangle, position, axis, angle, twist) for layout in CIRCLES)
    assert abs(one.F - other.F) > 0.01 * one.F


# Symmetric hexapods are hexapods whose joints are computed beside them.

TASK = Task.screw("max", axis=[1, 2, 3], point=[2, -1, 20], pitch=1.5)
POSITION, ROTATION = (1.0, -2.0, 33.0), Rotation([1, 2, 0.5], 0.3)
#: For each symmetry: given leg, whether it is reflected, and by how many degrees it is turned, for legs 1 to 6.
LEGS = {
    "none": [(k, False, 0) for k in range(1, 7)],
    "mirror": [(1, False, 0), (1, True, 0), (3, False, 0), (4, False, 0), (4, True, 0), (3, True, 0)],
    "threefold": [(1, False, 0), (2, False, 0), (1, False, 120), (2, False, 120), (1, False, 240), (2, False, 240)],
    "threefold-mirror": [(1, mirrored, turn) for turn in (0, 120, 240) for mirrored in (False, True)],
}


def image(joint: np.ndarray, mirrored: bool, degrees: float) -> list[float]:
    """The image of a joint in cylindrical coordinates."""
    radius, azimuth = np.hypot(joint[0], joint[1]), np.degrees(np.arctan2(joint[1], joint[0]))
    azimuth = np.radians((-azimuth if mirrored else azimuth) + degrees)
    return [float(radius * np.cos(azimuth)), float(radius * np.sin(azimuth)), float(joint[2])]


@pytest.mark.parametrize("symmetry", list(LEGS))
def test_a_symmetric_hexapod_is_the_hexapod_with_its_images(symmetry: str) -> None:
    random = np.random.default_rng(3)
    model = hexapod(symmetry=symmetry)  # type: ignore[arg-type]
    given = {item.name: np.array(item.typical) + random.uniform(-2, 2, 3) for item in model.parameters}
    assert sorted(given) == sorted(
        f"{plate}_{leg}" for plate in ("base", "platform") for leg in {k for k, *_ in LEGS[symmetry]}
    )
    whole = {
        f"{plate}_{number}": image(given[f"{plate}_{leg}"], mirrored, degrees)
        for plate in ("base", "platform")
        for number, (leg, mirrored, degrees) in enumerate(LEGS[symmetry], 1)
    }
    states = [
        evaluate(formulate(Case(robot, values, POSITION, [TASK], ROTATION)), np.zeros(0))
        for robot, values in (
            (model, {name: list(map(float, each)) for name, each in given.items()}),
            (hexapod(), whole),
        )
    ]
    assert np.allclose(states[0].jacobian, states[1].jacobian, rtol=0, atol=1e-12)
    assert [mark.parameter for mark in model.scene.marks] == list(given)


def test_free_numbers_keep_the_symmetry_and_move_every_leg() -> None:
    model = hexapod(symmetry="threefold-mirror")
    parameters = {"base_1": [Free(8, 13), Free(-5, -3), 0.0], "platform_1": [5.5, -5.5, 0.0]}
    case = Case(model, parameters, (0, 0, 30), [Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=3)])
    solution = solve(case, starts=3)
    assert solution.status.is_answer
    # By symmetry the legs of each hand have one rate in a screw about the axis of symmetry.
    assert solution.state is not None
    rates = solution.state.rates
    assert np.allclose(rates[0::2], rates[0], rtol=1e-9)
    assert np.allclose(rates[1::2], rates[1], rtol=1e-9)
    assert solution.nlp.n == 2


def test_a_symmetry_that_does_not_exist() -> None:
    with pytest.raises(ModelError, match="symmetry"):
        hexapod(symmetry="fourfold")  # type: ignore[arg-type]
