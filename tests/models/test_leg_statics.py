"""Forces and speeds of straight legs from their directions: closed forms, frames, and every kind of a load."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from actuator_forces import Package, directions, random_loads, wrenches_of
from builders import Array, turn_about
from robot_gallery import table

from screwsynth.models import hexapod, robot, three_upu
from screwsynth.nlp.case.loads import Load, Loading, Motion


class Legs(NamedTuple):
    """Six straight legs in numbers: joint centres on the base, those on the platform in its frame, and a pose."""

    base: Array
    platform: Array
    R: Array
    p: Array

    @property
    def vector(self) -> Array:
        """Values of the parameters of the robot ``hexapod``: base_1, platform_1, base_2, ... as it has them."""
        given = {f"{plate}_{k + 1}": getattr(self, plate)[k] for plate in ("base", "platform") for k in range(6)}
        return np.concatenate([given[item.name] for item in hexapod().parameters])

    @property
    def rows(self) -> Array:
        """Rates of the legs (6, 6) by a motion ``(omega, v)`` with v of the platform's origin: d|A - B| / dt."""
        arms = self.platform @ self.R.T
        spans = self.p + arms - self.base
        u = spans / np.linalg.norm(spans, axis=1)[:, None]
        return np.hstack([np.cross(arms, u), u])

    def forces(self, wrenches: Array) -> Array:
        """Forces (6, k) with which the legs push: the platform is at rest, ``sum f_i (u_i, arm_i x u_i) + W = 0``."""
        A = np.vstack([self.rows[:, 3:].T, self.rows[:, :3].T])
        return np.asarray(np.linalg.solve(A, -wrenches))


def random_legs(rng: np.random.Generator) -> Legs:
    at = np.linspace(0, 2 * np.pi, 6, endpoint=False)
    jitter = [rng.uniform(-0.2, 0.2, 6) for _ in range(2)]
    base = np.column_stack([1.2 * np.cos(at + jitter[0]), 1.2 * np.sin(at + jitter[0]), rng.uniform(-0.1, 0.1, 6)])
    # Neighbouring legs meet on the platform, nearly, where joints of base and platform alternate: a stiff octahedron.
    shifted = at + np.where(np.arange(6) % 2, -0.35, 0.35) + 0.5 * jitter[1]
    platform = np.column_stack([0.6 * np.cos(shifted), 0.6 * np.sin(shifted), rng.uniform(-0.1, 0.1, 6)])
    axis = rng.normal(size=3)
    return Legs(
        base, platform, turn_about(axis, rng.uniform(-0.4, 0.4)), rng.uniform([-0.3, -0.3, 0.9], [0.3, 0.3, 1.3])
    )


def legs_at(loading: Loading, legs: Legs) -> tuple[Array, Array, Array]:
    return Package(hexapod(), loading).at(legs.R, legs.p, legs.vector)


def test_six_straight_legs_carry_what_their_directions_say() -> None:
    rng = np.random.default_rng(1)
    loads = random_loads(rng)
    package = Package(hexapod(), Loading(tuple(loads)))
    for _ in range(40):
        legs = random_legs(rng)
        expected = legs.forces(wrenches_of(loads, legs.R))
        _, found, _ = package.at(legs.R, legs.p, legs.vector)
        scale = np.linalg.cond(legs.rows) * np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 * scale)


def test_a_leg_that_pushes_has_a_positive_force() -> None:
    """A weight on legs that stand below the platform, symmetric about the vertical: each pushes by its sixth."""
    legs = random_legs(np.random.default_rng(0))
    at = np.radians([-10.0, 10, 110, 130, 230, 250])
    up = np.radians([-50.0, 50, 70, 170, 190, 290])
    legs = Legs(
        *(r * np.column_stack([np.cos(a), np.sin(a), 0 * a]) for r, a in ((1.0, at), (0.6, up))),
        np.eye(3),
        p=np.array([0, 0, 0.8]),
    )
    _, found, _ = legs_at(Loading((Load("weight", (0, 0, -60.0)),)), legs)
    np.testing.assert_allclose(found[:, 0], 10 / legs.rows[:, 5], rtol=1e-13)
    assert (found > 0).all()


def upu_forces(d: float, yaw: float, q: Array, w: Array) -> Array:
    """Pushes of the legs of a 3-UPU that only moves along, from the platform's equilibrium.

    The legs are ``l_i = q - d e_i`` with horizontal unit vectors e_i, 120 degrees apart, and the constraints carry
    moments alone, so that the forces sum to 0: with ``g_i = f_i / L_i``,

        q sum g_i - d sum g_i e_i + w = 0.

    The third component gives ``S = sum g_i = -w_z / q_z``; as the e_i sum to 0, and their squares to 3/2 in the plane,
    the others give ``g_i = S / 3 + 2 e_i . (w + S q) / (3 d)``. These are the forces of the legs on the platform; the
    paper with the example below writes those of the platform on the legs, the opposite ones.
    """
    azimuths = yaw + np.radians([0.0, 120.0, 240.0])
    e = np.column_stack([np.cos(azimuths), np.sin(azimuths), np.zeros(3)])
    S = -w[2] / q[2]
    g = S / 3 + 2 * e @ (w + S * q) / (3 * d)
    found = np.linalg.norm(q - d * e, axis=1) * g
    np.testing.assert_allclose(found @ ((q - d * e) / np.linalg.norm(q - d * e, axis=1)[:, None]), -w, atol=1e-12)
    return np.asarray(found)


def turned(yaw: float) -> Array:
    return turn_about([0, 0, 1.0], yaw)


def test_the_forces_of_a_translational_three_upu_have_a_closed_form() -> None:
    """Also written as ``L_i (2 (w_z (q_x c_i + q_y s_i) - q_z (w_x c_i + w_y s_i)) / d + w_z) / (3 q_z)``, negated."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        loads = random_loads(rng, 4)
        rb, d, yaw = rng.uniform(0.4, 1.0), rng.uniform(0.15, 0.35), rng.uniform(-np.pi, np.pi)
        q = rng.uniform([-0.2, -0.2, 0.3], [0.2, 0.2, 1.0])
        w = np.array([each.force for each in loads])
        expected = np.array([upu_forces(d, yaw, q, each) for each in w]).T
        # In the world of the robot's first leg along x; moments and points do not count.
        local = [Load(each.name, turned(-yaw) @ each.force, each.moment, each.point) for each in loads]
        package = Package(three_upu(axes="tsai"), Loading(tuple(local)))
        _, found, _ = package.at(np.eye(3), turned(-yaw) @ q, np.array([rb, rb - d]))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
        c, s = (f(yaw + np.radians([0.0, 120.0, 240.0])) for f in (np.cos, np.sin))
        x, y, z = q
        L = np.sqrt((x - d * c) ** 2 + (y - d * s) ** 2 + z**2)
        for k, (wx, wy, wz) in enumerate(w):
            written = L * (2 * (wz * (x * c + y * s) - z * (wx * c + wy * s)) / d + wz) / (3 * z)
            np.testing.assert_allclose(found[:, k], -written, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_the_same_closed_form_holds_for_the_robot_given_joint_by_joint() -> None:
    rng = np.random.default_rng(4)
    loads = random_loads(rng, 6)
    package = Package(robot(**table("3-upu")), Loading(tuple(loads)))
    rb, rp, h = package.typical
    for _ in range(10):
        q = np.array([0, 0, h]) + rng.uniform(-0.1, 0.1, 3)
        expected = np.array([upu_forces(rb - rp, 0.0, q, np.array(each.force)) for each in loads]).T
        _, found, _ = package.at(np.eye(3), q)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_a_published_largest_force_of_a_three_upu() -> None:
    """Base radius 0.5, platform radius 0.12, 0.45 above the base, load [2, 2, -10]: 8.1 N, by particle swarm.

    It is reached in a corner of the box of poses of 0.2 x 0.2 x 0.1.
    """
    package = Package(three_upu(axes="tsai"), Loading((Load("load", (2.0, 2.0, -10.0)),)))
    corners = np.array(np.meshgrid([-0.1, 0.1], [-0.1, 0.1], [-0.05, 0.05])).reshape(3, -1).T
    forces = {
        tuple(each): np.abs(package.at(np.eye(3), np.array([0, 0, 0.45]) + each, np.array([0.5, 0.12]))[1]).max()
        for each in corners
    }
    assert forces[0.1, -0.1, -0.05] == pytest.approx(8.08803, abs=5e-6)
    # The force of the leg along x does not depend on the sign of y.
    assert forces[0.1, 0.1, -0.05] == pytest.approx(forces[0.1, -0.1, -0.05], rel=1e-13)
    assert max(forces.values()) == pytest.approx(forces[0.1, -0.1, -0.05], rel=1e-13)
    inside = np.random.default_rng(5).uniform(-1, 1, (200, 3)) * [0.1, 0.1, 0.05]
    for each in inside:
        _, found, _ = package.at(np.eye(3), np.array([0, 0, 0.45]) + each, np.array([0.5, 0.12]))
        assert np.abs(found).max() < max(forces.values())


# -- frames, units and lines of action


def test_forces_do_not_change_where_the_whole_world_is_moved_and_turned() -> None:
    rng = np.random.default_rng(6)
    for _ in range(10):
        legs, Q, t = random_legs(rng), turn_about(rng.normal(size=3), rng.uniform(0, 3)), rng.normal(size=3) * 5
        loads = random_loads(rng, 5)
        loads += [Load("mass", mass=3.0, point=(0.1, 0.2, 0.3)), Load("turned", (1, 2, 3), (4, 5, 6), in_platform=True)]
        loads += [Load("any", any_force=2.0, any_moment=0.5, point=(0.3, -0.2, 0.4))]
        there = Legs(legs.base @ Q.T + t, legs.platform, Q @ legs.R, Q @ legs.p + t)
        turned = [
            each if each.in_platform else Load(
                each.name, Q @ each.force, Q @ each.moment, each.point,
                any_force=each.any_force, any_moment=each.any_moment, mass=each.mass,
            )
            for each in loads
        ]  # fmt: skip
        gravity, motion = np.array([0.3, -0.2, -9.0]), Motion(0.5, 0.7)
        here = legs_at(Loading(tuple(loads), motion, gravity), legs)
        moved = legs_at(Loading(tuple(turned), motion, Q @ gravity), there)
        for one, other in zip(here, moved, strict=True):
            np.testing.assert_allclose(other, one, rtol=0, atol=1e-12 * np.abs(one).max())


def test_forces_do_not_change_where_the_platform_has_another_frame() -> None:
    """Joints and points of loads in a frame with another origin and other directions; loads in world directions."""
    rng = np.random.default_rng(7)
    for _ in range(10):
        legs, Q, t = random_legs(rng), turn_about(rng.normal(size=3), rng.uniform(0, 3)), rng.normal(size=3) * 0.4
        loads = random_loads(rng, 5)
        # x_old = Q x_new + t
        there = Legs(legs.base, (legs.platform - t) @ Q, legs.R @ Q, legs.p + legs.R @ t)
        again = [Load(each.name, each.force, each.moment, Q.T @ (np.array(each.point) - t)) for each in loads]
        one, other = (legs_at(Loading(tuple(own)), at)[1] for own, at in ((loads, legs), (again, there)))
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-12 * np.abs(one).max())


def test_a_load_may_be_moved_along_its_line_of_action() -> None:
    rng = np.random.default_rng(9)
    legs, loads = random_legs(rng), random_loads(rng)
    moved = []
    for each in loads:
        along = legs.R.T @ np.array(each.force) * rng.normal() * 3
        moved.append(Load(each.name, each.force, each.moment, np.array(each.point) + along))
    one, other = (legs_at(Loading(tuple(own)), legs)[1] for own in (loads, moved))
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-12 * np.abs(one).max())
    beside = [Load(each.name, each.force, each.moment, tuple(np.array([0.1, 0.2, 0.3]) + each.point)) for each in loads]
    assert np.abs(legs_at(Loading(tuple(beside)), legs)[1] - one).max() > 1e-2 * np.abs(one).max()


# -- kinds of loads


def test_loads_in_the_platforms_directions_turn_with_it() -> None:
    rng = np.random.default_rng(10)
    legs, loads = random_legs(rng), random_loads(rng)
    own = [Load(each.name, each.force, each.moment, each.point, in_platform=True) for each in loads]
    world = [Load(each.name, legs.R @ each.force, legs.R @ each.moment, each.point) for each in loads]
    one, other = (legs_at(Loading(tuple(given)), legs)[1] for given in (own, world))
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-13 * np.abs(one).max())


def test_a_mass_is_the_force_of_its_weight_at_its_centre() -> None:
    legs = random_legs(np.random.default_rng(11))
    centre, gravity = (0.1, -0.2, 0.5), (0.5, 1.0, -8.0)
    for stated, acting in ((None, (0.0, 0.0, -9.81)), (gravity, gravity)):
        weight = Load("w", tuple(2.5 * each for each in acting), point=centre)
        expected = legs.forces(wrenches_of([weight], legs.R))
        _, found, _ = legs_at(Loading((Load("m", mass=2.5, point=centre),), gravity=stated), legs)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_opposite_loads_and_loads_that_are_always_there() -> None:
    """Each load with each sign, on top of all that are always there with each of theirs."""
    rng = np.random.default_rng(12)
    legs = random_legs(rng)
    cut, push, weight, hose = random_loads(rng, 4)

    def named(load: Load, name: str, **more: bool) -> Load:
        return Load(name, load.force, load.moment, load.point, **more)

    def of(*signed: tuple[Load, float]) -> Array:
        return np.asarray(sum(sign * legs.forces(wrenches_of([load], legs.R))[:, 0] for load, sign in signed))

    loading = Loading(
        (
            named(weight, "weight", always=True),
            named(cut, "cut", both_signs=True),
            named(hose, "hose", always=True, both_signs=True),
            named(push, "push"),
        )
    )
    names = [case.name for case in loading.cases]
    assert len(set(names)) == len(names) == 6
    _, found, _ = legs_at(loading, legs)
    expected = {
        "cut": of((cut, 1), (weight, 1), (hose, 1)),
        "cut, hose reversed": of((cut, 1), (weight, 1), (hose, -1)),
        "cut reversed": of((cut, -1), (weight, 1), (hose, 1)),
        "cut, cut reversed, hose reversed": of((cut, -1), (weight, 1), (hose, -1)),
        "push": of((push, 1), (weight, 1), (hose, 1)),
        "push, hose reversed": of((push, 1), (weight, 1), (hose, -1)),
    }
    left = dict(zip(names, found.T, strict=True))
    for name, forces in expected.items():
        (match,) = [each for each in left if np.allclose(left[each], forces, rtol=0, atol=1e-11 * np.abs(forces).max())]
        assert name.split(",")[0].split(" reversed")[0] in match
        assert ("hose reversed" in match) == ("hose reversed" in name)
        assert ("cut reversed" in match) == ("cut reversed" in name)
        left.pop(match)


def test_what_is_always_there_stands_alone_without_another_load() -> None:
    rng = np.random.default_rng(13)
    legs, (one, two) = random_legs(rng), random_loads(rng, 2)
    loading = Loading(tuple(Load(each.name, each.force, each.moment, each.point, always=True) for each in (one, two)))
    _, found, _ = legs_at(loading, legs)
    expected = legs.forces(wrenches_of([one, two], legs.R)).sum(axis=1)
    np.testing.assert_allclose(found[:, 0], expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert found.shape == (6, 1)


def test_the_largest_speeds_of_six_legs_are_reached() -> None:
    rng = np.random.default_rng(16)
    package = Package(hexapod(), Loading((), Motion(0.5, 1.2)))
    for _ in range(10):
        legs = random_legs(rng)
        speeds = package.at(legs.R, legs.p, legs.vector)[2]
        # Finite motions by the worst twist of each leg, and by many others.
        for leg, row in enumerate(legs.rows):
            worst = np.concatenate([1.2 * row[:3] / np.linalg.norm(row[:3]), 0.5 * row[3:] / np.linalg.norm(row[3:])])
            turn = directions(rng, 2000) * 1.2 * rng.uniform(0, 1, (2000, 1))
            way = directions(rng, 2000) * 0.5 * rng.uniform(0, 1, (2000, 1))
            assert np.abs(np.hstack([turn, way]) @ row).max() <= speeds[leg]
            t = 1e-5
            lengths = []
            for time in (-t, t):
                R = turn_about(worst[:3], time * np.linalg.norm(worst[:3])) @ legs.R
                ends = legs.p + time * worst[3:] + legs.platform[leg] @ R.T
                lengths.append(np.linalg.norm(ends - legs.base[leg]))
            assert (lengths[1] - lengths[0]) / (2 * t) == pytest.approx(speeds[leg], rel=1e-8)


def test_a_motion_that_only_turns_or_only_moves_along() -> None:
    legs = random_legs(np.random.default_rng(17))
    rows = legs.rows
    for linear, angular in ((0.5, 0.0), (0.0, 1.2)):
        _, _, speeds = legs_at(Loading((), Motion(linear, angular)), legs)
        expected = linear * np.linalg.norm(rows[:, 3:], axis=1) + angular * np.linalg.norm(rows[:, :3], axis=1)
        np.testing.assert_allclose(speeds, expected, rtol=1e-11)
