"""Rows and work rates of legs against a physics engine and formulas that share no code with the package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np
import pytest
from builders import Array, turn_about

from screwsynth.models import Model, hexapod, stewart_gough
from screwsynth.nlp import Case, RobotState, Rotation, Task, evaluate, formulate

Joints = Mapping[str, tuple[Array, Array]]

KINDS = ("aligned", "octahedral", "hexapod")
ROBOTS = 70  # of each kind, each with one twist of finite pitch, one of zero pitch and one pure translation

MODELS: dict[str, Model] = {
    "aligned": stewart_gough(layout="aligned"),
    "octahedral": stewart_gough(layout="octahedral"),
    "hexapod": hexapod(),
}


@dataclass(frozen=True)
class Scene:
    """A robot in numbers: its joint centres as found here, and its state as the package has it."""

    names: tuple[str, ...]
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


def circle_joints(layout: str, x1: float, x2: float, x3: float, x4: float) -> Joints:
    """Joint centres of the Stewart-Gough platform from its definition in words, in degrees."""
    joints = {}
    for pair in range(3):
        for mark, sign in (("+", 1.0), ("-", -1.0)):
            beta = 120.0 * pair + sign * np.rad2deg(x3)
            alpha = 120.0 * pair + sign * (np.rad2deg(x4) if layout == "aligned" else 60.0 - np.rad2deg(x4))
            base = x1 * np.array([np.cos(np.deg2rad(beta)), np.sin(np.deg2rad(beta)), 0.0])
            platform = x2 * np.array([np.cos(np.deg2rad(alpha)), np.sin(np.deg2rad(alpha)), 0.0])
            joints[f"{pair + 1}{mark}"] = (base, platform)
    return joints


def random_robot(kind: str, rng: np.random.Generator) -> tuple[dict[str, float | tuple[float, ...]], Joints]:
    if kind != "hexapod":
        x1, x2 = rng.uniform(5, 15), rng.uniform(3, 10)
        # The ends of the half angles' range are robots of their own: the triangle and the regular hexagon.
        x3, x4 = (float(rng.choice([0.0, np.pi / 6, rng.uniform(0, np.pi / 6)], p=[0.15, 0.15, 0.7])) for _ in "34")
        return {"x1": x1, "x2": x2, "x3": x3, "x4": x4}, circle_joints(kind, x1, x2, x3, x4)
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
def scenes(kind: str) -> tuple[Scene, ...]:
    rng = np.random.default_rng([2024, KINDS.index(kind)])
    made = []
    for _ in range(ROBOTS):
        parameters, joints = random_robot(kind, rng)
        # High enough that no joint of the platform comes near the base, however the platform is turned.
        position = rng.uniform([-10, -10, 20], [10, 10, 50])
        axis, angle, twists = rng.normal(size=3), float(rng.uniform(-np.pi / 3, np.pi / 3)), random_twists(rng)
        tasks = [Task(twist, name=str(index)) for index, twist in enumerate(twists)]
        case = Case(MODELS[kind], parameters, position.tolist(), tasks, Rotation(axis, angle))
        states = tuple(evaluate(formulate(case, task), np.zeros(0)) for task in range(len(tasks)))
        names = tuple(row.limb for row in MODELS[kind].wrenches)
        made.append(
            Scene(
                names=names,
                base=np.array([joints[name][0] for name in names]),
                platform=np.array([joints[name][1] for name in names]),
                axis=axis,
                angle=angle,
                position=position,
                twists=twists,
                states=states,
            )
        )
    return tuple(made)


@cache
def engine_rates(kind: str) -> tuple[tuple[Array, Array], ...]:
    """Tendon velocities (3, 6), one row for each twist, and tendon lengths (6,) of each robot in MuJoCo."""
    found = []
    for scene in scenes(kind):
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


@pytest.mark.parametrize("kind", KINDS)
def test_rates_are_the_tendon_velocities_of_a_physics_engine(kind: str) -> None:
    # Both sides are closed forms in double precision: some tens of rounding units of their terms remain.
    for scene, (velocities, lengths) in zip(scenes(kind), engine_rates(kind), strict=True):
        for twist, state, rates in zip(scene.twists, scene.states, velocities, strict=True):
            np.testing.assert_allclose(state.rates, rates, rtol=0, atol=4e-15 * scene.reach(twist))
            # F is down to 3e-4 of what it would be without cancellation, so its relative error is larger.
            assert pytest.approx(float(rates @ rates), rel=1e-13) == state.F
        np.testing.assert_allclose(scene.states[0].quantities["leg_length"], lengths, rtol=4e-15)


@pytest.mark.parametrize("kind", KINDS)
def test_rows_of_the_jacobian_are_unit_forces_along_the_legs_with_moments_about_the_world_origin(kind: str) -> None:
    for scene in scenes(kind):
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


@pytest.mark.parametrize("kind", KINDS)
def test_joint_angles_are_those_between_a_leg_and_the_plates(kind: str) -> None:
    for scene in scenes(kind):
        spans = scene.ends - scene.base
        for name, normal in (
            ("base_joint_angle", np.array([0.0, 0.0, 1.0])),
            ("platform_joint_angle", turn_about(scene.axis, scene.angle)[:, 2]),
        ):
            # atan2 is accurate at every angle; an arc cosine loses digits as 1e-16 / sin(angle) near 0.
            angles = np.arctan2(np.linalg.norm(np.cross(normal, spans), axis=1), spans @ normal)
            np.testing.assert_allclose(
                np.sin(angles) * (scene.states[0].quantities[name] - angles), np.zeros(6), rtol=0, atol=2e-15
            )


def test_the_random_scenes_are_worth_testing() -> None:
    # Guards the tests above: relative errors of F mean little where F is nearly zero by cancellation.
    sizes = [(state.F, state.size) for kind in KINDS for scene in scenes(kind) for state in scene.states]
    assert len(sizes) == 9 * ROBOTS
    assert min(F / size for F, size in sizes) > 1e-4
    assert all(state.rank == 6 for scene in scenes("hexapod") for state in scene.states)
