"""Rows and work rates of legs against a physics engine and formulas, and what must not change F."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np
import pytest
from builders import Array, soaked, turn_about
from hypothesis import given, settings
from hypothesis import strategies as st
from measures import circle_joints

from screwsynth.models import Model, ModelError, axis_angle_from_matrix, hexapod, moved_screw, stewart_gough
from screwsynth.nlp import Case, Free, RobotState, Rotation, Task, evaluate, formulate, solve

Joints = Mapping[str, tuple[Array, Array]]

KINDS = ("aligned", "octahedral", "hexapod")
#: Robots of each kind, always and in all, each with twists of finite and of zero pitch and a pure translation.
FEW, MANY = 30, 70
each_kind = pytest.mark.parametrize(
    "drawn", soaked(itertools.product(KINDS, (FEW, MANY)), [(kind, FEW) for kind in KINDS])
)

MODELS: dict[str, Model] = {
    "aligned": stewart_gough(), "octahedral": stewart_gough(layout="octahedral"), "hexapod": hexapod(),
}  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """A robot in numbers: its joint centres as found here, and its state as the package has it."""

    base: Array  # (6, 3), world
    platform: Array  # (6, 3), platform frame
    axis: Array
    angle: float
    position: Array
    twists: Array  # (3, 6)
    states: tuple[RobotState, ...]  # one for each twist

    @property
    def ends(self) -> Array:
        """World coordinates of the platform joints."""
        return self.position + self.platform @ turn_about(self.axis, self.angle).T

    @staticmethod
    def reach(twist: Array) -> float:
        """Size of the terms that ``m . omega + f . v`` adds up, with arms of 60 length units at most."""
        return float(np.linalg.norm(twist[3:]) + 60 * np.linalg.norm(twist[:3]))


def random_robot(kind: str, rng: np.random.Generator) -> tuple[dict[str, float | tuple[float, ...]], Joints]:
    if kind != "hexapod":
        x1, x2 = rng.uniform(5, 15), rng.uniform(3, 10)
        # The ends of the half angles' range are robots of their own: the triangle and the regular hexagon.
        x3, x4 = (float(rng.choice([0.0, np.pi / 6, rng.uniform(0, np.pi / 6)], p=[0.15, 0.15, 0.7])) for _ in "34")
        values = {"x1": x1, "x2": x2, "x3": x3, "x4": x4}
        names = (f"{pair}{side}" for pair in (1, 2, 3) for side in "-+")
        return dict(values), dict(zip(names, zip(*circle_joints(values, kind), strict=True), strict=True))
    parameters: dict[str, float | tuple[float, ...]] = {}
    joints = {}
    for leg in "123456":
        base, platform = rng.uniform([-15, -15, -4], [15, 15, 4]), rng.uniform([-9, -9, -3], [9, 9, 3])
        parameters[f"base_{leg}"] = tuple(base.tolist())
        parameters[f"platform_{leg}"] = tuple(platform.tolist())
        joints[leg] = (base, platform)
    return parameters, joints


def random_twists(rng: np.random.Generator) -> Array:
    twists = []
    for pitch in (float(rng.normal(0, 5)), 0.0):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        point = rng.uniform([-20, -20, -20], [20, 20, 60])
        twists.append(rng.uniform(0.3, 3) * np.concatenate([axis, np.cross(point, axis) + pitch * axis]))
    twists.append(np.concatenate([np.zeros(3), rng.normal(0, 3, size=3)]))
    return np.array(twists)


@cache
def scenes(kind: str, count: int = FEW) -> tuple[Scene, ...]:
    rng = np.random.default_rng([2024, KINDS.index(kind)])
    made = []
    for _ in range(count):
        parameters, joints = random_robot(kind, rng)
        # High enough that no joint of the platform comes near the base, however the platform is turned.
        position = rng.uniform([-10, -10, 20], [10, 10, 50])
        axis, angle, twists = rng.normal(size=3), float(rng.uniform(-np.pi / 3, np.pi / 3)), random_twists(rng)
        tasks = [Task(twist, name=str(index)) for index, twist in enumerate(twists)]
        case = Case(MODELS[kind], parameters, position.tolist(), tasks, Rotation(axis, angle))
        states = tuple(evaluate(formulate(case, task), np.zeros(0)) for task in range(len(tasks)))
        names = tuple(row.limb for row in MODELS[kind].wrenches)
        base, platform = (np.array([joints[name][plate] for name in names]) for plate in (0, 1))
        made.append(Scene(base, platform, axis, angle, position, twists, states))
    return tuple(made)


@cache
def engine_rates(kind: str, count: int) -> tuple[tuple[Array, Array], ...]:
    """Tendon velocities (3, 6), one row for each twist, and tendon lengths (6,) of each robot in MuJoCo."""
    found = []
    for scene in scenes(kind, count):
        model = mujoco.MjModel.from_xml_string(platform_on_tendons(scene))
        data = mujoco.MjData(model)
        velocities = []
        for twist in scene.twists:
            omega, v = twist[:3], twist[3:]
            half, axis = scene.angle / 2, scene.axis / np.linalg.norm(scene.axis)
            data.qpos[:3], data.qpos[3], data.qpos[4:] = scene.position, np.cos(half), np.sin(half) * axis
            # A free joint's velocity: of the body's origin in world axes, then the angular one in the body's axes.
            data.qvel[:3] = v + np.cross(omega, scene.position)
            data.qvel[3:] = turn_about(scene.axis, scene.angle).T @ omega
            mujoco.mj_forward(model, data)
            velocities.append(np.array(data.ten_velocity))
        found.append((np.array(velocities), np.array(data.ten_length)))
    return tuple(found)


def platform_on_tendons(scene: Scene) -> str:
    def sites(kind: str, points: Array) -> str:
        # repr keeps every bit of a double.
        places = (" ".join(repr(float(c)) for c in point) for point in points)
        return "".join(f'<site name="{kind}{i}" pos="{place}"/>' for i, place in enumerate(places))

    tendons = "".join(f'<spatial><site site="B{i}"/><site site="A{i}"/></spatial>' for i in range(6))
    return f"""
        <mujoco>
          <worldbody>
            {sites("B", scene.base)}
            <body>
              <freejoint/>
              <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
              {sites("A", scene.platform)}
            </body>
          </worldbody>
          <tendon>{tendons}</tendon>
        </mujoco>"""


@each_kind
def test_rates_are_the_tendon_velocities_of_a_physics_engine(drawn: tuple[str, int]) -> None:
    # Both sides are closed forms in double precision: some tens of rounding units of their terms remain.
    for scene, (velocities, lengths) in zip(scenes(*drawn), engine_rates(*drawn), strict=True):
        for twist, state, rates in zip(scene.twists, scene.states, velocities, strict=True):
            np.testing.assert_allclose(state.rates, rates, rtol=0, atol=4e-15 * scene.reach(twist))
            # F is down to 3e-4 of what it would be without cancellation, so its relative error is larger.
            assert pytest.approx(float(rates @ rates), rel=1e-13) == state.F
        np.testing.assert_allclose(scene.states[0].quantities["leg_length"], lengths, rtol=4e-15)


@each_kind
def test_rows_of_the_jacobian_are_unit_forces_along_the_legs_with_moments_about_the_origin(
    drawn: tuple[str, int],
) -> None:
    for scene in scenes(*drawn):
        spans = scene.ends - scene.base
        along = spans / np.linalg.norm(spans, axis=1, keepdims=True)
        # Either joint of a leg gives its moment; the code may not use the platform joint, so this does.
        expected = np.hstack([along, np.cross(scene.ends, along)])
        for twist, state in zip(scene.twists, scene.states, strict=True):
            # Some rounding units of 1 and of an arm of 60 length units.
            np.testing.assert_allclose(state.jacobian[:, :3], expected[:, :3], rtol=0, atol=2e-15)
            np.testing.assert_allclose(state.jacobian[:, 3:], expected[:, 3:], rtol=0, atol=6e-14)
            swapped = np.concatenate([twist[3:], twist[:3]])
            np.testing.assert_allclose(state.jacobian @ swapped, state.rates, rtol=0, atol=2e-15 * scene.reach(twist))


@each_kind
def test_joint_angles_are_those_between_a_leg_and_the_plates(drawn: tuple[str, int]) -> None:
    for scene in scenes(*drawn):
        spans = scene.ends - scene.base
        normals = {"base": np.array([0.0, 0.0, 1.0]), "platform": turn_about(scene.axis, scene.angle)[:, 2]}
        for plate, normal in normals.items():
            # atan2 is accurate at every angle; an arc cosine loses digits as 1e-16 / sin(angle) near 0.
            angles = np.arctan2(np.linalg.norm(np.cross(normal, spans), axis=1), spans @ normal)
            off = scene.states[0].quantities[f"{plate}_joint_angle"] - angles
            np.testing.assert_allclose(np.sin(angles) * off, np.zeros(6), rtol=0, atol=2e-15)


def test_the_random_scenes_are_worth_testing() -> None:
    # Guards the tests above: relative errors of F mean little where F is nearly zero by cancellation.
    sizes = [(state.F, state.size) for kind in KINDS for scene in scenes(kind) for state in scene.states]
    assert len(sizes) == 9 * FEW
    assert min(F / size for F, size in sizes) > 1e-4
    assert all(state.rank == 6 for scene in scenes("hexapod") for state in scene.states)


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
    centres: list[Triple], position: Triple, axis: Triple, angle: float, twist: Array,
    frame_axis: Triple, frame_angle: float, shift: Triple,
) -> None:  # fmt: skip
    base, platform = np.array(centres[:6]), np.array(centres[6:])
    R = turn_about(frame_axis, frame_angle)
    here = hexapod_state(base, platform, np.array(position), Rotation(axis, angle), twist)
    turned, t = Rotation(*axis_angle_from_matrix(R @ turn_about(axis, angle))), np.array(shift)
    place = R @ np.array(position) + t
    there = hexapod_state(base @ R.T + t, platform, place, turned, moved_screw(twist, R, shift))
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
IMAGES = {
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


@pytest.mark.parametrize("symmetry", list(IMAGES))
def test_a_symmetric_hexapod_is_the_hexapod_with_its_images(symmetry: str) -> None:
    random = np.random.default_rng(3)
    model = hexapod(symmetry=symmetry)  # type: ignore[arg-type]
    given = {item.name: np.array(item.typical) + random.uniform(-2, 2, 3) for item in model.parameters}
    legs = {k for k, *_ in IMAGES[symmetry]}
    assert sorted(given) == sorted(f"{plate}_{leg}" for plate in ("base", "platform") for leg in legs)
    whole = {
        f"{plate}_{number}": image(given[f"{plate}_{leg}"], mirrored, degrees)
        for plate in ("base", "platform")
        for number, (leg, mirrored, degrees) in enumerate(IMAGES[symmetry], 1)
    }
    robots = ((model, {name: list(map(float, each)) for name, each in given.items()}), (hexapod(), whole))
    cases = [Case(robot, values, POSITION, [TASK], ROTATION) for robot, values in robots]
    states = [evaluate(formulate(case), np.zeros(0)) for case in cases]
    assert np.allclose(states[0].jacobian, states[1].jacobian, rtol=0, atol=1e-12)
    assert [mark.parameter for mark in model.scene.marks] == list(given)


def test_free_numbers_keep_a_symmetry_that_exists_and_move_every_leg() -> None:
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
    with pytest.raises(ModelError, match="symmetry"):
        hexapod(symmetry="fourfold")  # type: ignore[arg-type]
