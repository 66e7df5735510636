"""What must not change F, how it must change where it does, and symmetric hexapods."""

from __future__ import annotations

import numpy as np
import pytest
from builders import Array, turn_about
from hypothesis import given, settings
from hypothesis import strategies as st

from screwsynth.models import ModelError, axis_angle_from_matrix, hexapod, moved_screw, stewart_gough
from screwsynth.nlp import Case, Free, RobotState, Rotation, Task, evaluate, formulate, solve

Triple = tuple[float, float, float]

HEXAPOD = hexapod()

#: Relative to F without cancellation, so the same for every case; the worst seen is 1e-15, some rounding units.
ROUNDING = 5e-15

few = settings(derandomize=True, deadline=None, max_examples=20)


def triples(limit: float) -> st.SearchStrategy[Triple]:
    coordinate = st.floats(-limit, limit, allow_subnormal=False)
    return st.tuples(coordinate, coordinate, coordinate)


joints = st.lists(triples(5), min_size=12, max_size=12)
positions = st.tuples(st.floats(-10, 10), st.floats(-10, 10), st.floats(20, 50))
axes = triples(1).filter(lambda n: bool(np.linalg.norm(n) > 1e-3))
angles = st.floats(-np.pi, np.pi)
twists = (
    st.tuples(triples(2), triples(30))
    .map(lambda parts: np.array([*parts[0], *parts[1]]))
    .filter(lambda twist: bool(np.linalg.norm(twist) > 1e-3))
)


def hexapod_state(base: Array, platform: Array, position: Array, turned: Rotation, twist: Array) -> RobotState:
    parameters = {f"base_{i + 1}": tuple(b) for i, b in enumerate(base.tolist())}
    parameters |= {f"platform_{i + 1}": tuple(a) for i, a in enumerate(platform.tolist())}
    case = Case(HEXAPOD, parameters, tuple(position.tolist()), [Task(twist)], turned)
    return evaluate(formulate(case), np.zeros(0))


def assert_same_work(one: RobotState, other: RobotState, factor: float = 1.0) -> None:
    size = max(one.size, other.size / factor**2)
    np.testing.assert_allclose(other.rates / factor, one.rates, rtol=0, atol=ROUNDING * np.sqrt(size))
    assert abs(other.F / factor**2 - one.F) <= ROUNDING * size


@few
@given(joints, positions, axes, angles, twists, axes, angles, triples(50))
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
    base, platform = np.array(centres[:6]), np.array(centres[6:])
    R = turn_about(frame_axis, frame_angle)
    here = hexapod_state(base, platform, np.array(position), Rotation(axis, angle), twist)
    there = hexapod_state(
        base @ R.T + np.array(shift),
        platform,
        R @ np.array(position) + np.array(shift),
        Rotation(*axis_angle_from_matrix(R @ turn_about(axis, angle))),
        moved_screw(twist, R, shift),
    )
    assert_same_work(here, there)


@few
@given(joints, positions, axes, angles, twists, st.floats(-3, 3).map(lambda power: 10.0**power))
def test_f_grows_with_the_square_of_the_length_unit(
    centres: list[Triple], position: Triple, axis: Triple, angle: float, twist: Array, s: float
) -> None:
    base, platform, turned = np.array(centres[:6]), np.array(centres[6:]), Rotation(axis, angle)
    one = hexapod_state(base, platform, np.array(position), turned, twist)
    scaled = np.concatenate([twist[:3], s * twist[3:]])
    other = hexapod_state(s * base, s * platform, s * np.array(position), turned, scaled)
    assert_same_work(one, other, factor=s)
    # Unit forces have no length in them; their moments have one.
    np.testing.assert_allclose(other.jacobian[:, :3], one.jacobian[:, :3], rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(other.jacobian[:, 3:] / s, one.jacobian[:, 3:], rtol=0, atol=100 * ROUNDING)


@few
@given(axes, angles, twists, positions)
def test_an_axis_and_its_opposite_with_the_opposite_angle_are_one_rotation(
    axis: Triple, angle: float, twist: Array, position: Triple
) -> None:
    parameters = {"x1": 12.0, "x2": 8.0, "x3": 0.3, "x4": 0.1}
    n = np.array(axis)
    around = angle - np.copysign(2 * np.pi, angle)
    states = [
        evaluate(formulate(Case(stewart_gough(), parameters, position, [Task(twist)], turned)), np.zeros(0))
        for turned in (Rotation(n, angle), Rotation(-7 * n, -angle), Rotation(n, around))
    ]
    assert_same_work(states[0], states[1])
    assert_same_work(states[0], states[2])


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
    rates = solution.state.rates
    assert np.allclose(rates[0::2], rates[0], rtol=1e-9)
    assert np.allclose(rates[1::2], rates[1], rtol=1e-9)
    assert solution.nlp.n == 2


def test_a_symmetry_that_does_not_exist() -> None:
    with pytest.raises(ModelError, match="symmetry"):
        hexapod(symmetry="fourfold")  # type: ignore[arg-type]
