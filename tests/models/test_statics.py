"""Forces and speeds of actuators against MuJoCo's constrained Jacobian, and of straight legs from their directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from actuator_forces import LOADS, Feasible, Package, directions, feasible, random_loads, scene, wrenches_of
from builders import EACH_KIND, Array, turn_about
from engine_comparison import is_regular, unknowns_at
from mechanism_robots import Engine
from mujoco_robots import Oracle
from random_mechanisms import random_mechanism
from robot_files import robot_of
from robot_gallery import FILES, GALLERY, LENGTH, NETWORKS, RANKS, model_of, random_displacements, table

from screwsynth.models import Dimension, hexapod, robot, three_upu
from screwsynth.models.catalog import gallery_names
from screwsynth.models.mechanism import mechanism_of
from screwsynth.models.mechanism.singularities import closed_configurations
from screwsynth.models.statics import degrees_of_freedom, driven_joints, statics_hindrance
from screwsynth.nlp.case.loads import Load, Loading, Motion
from screwsynth.nlp.errors import CaseError

DRIVEN_POSES = 5
#: Largest difference of a force, as a part of the largest of the robot's forces under the load.
AGREEMENT = 1e-10


def driven(name: str, seed: int) -> Oracle:
    """A robot of the gallery with random positions of its actuators."""
    oracle = Oracle(robot_of(table(name)), LENGTH)
    oracle.drive(random_displacements(oracle.robot, np.random.default_rng([seed, *name.encode()])))
    return oracle


def test_all_robots_of_the_gallery_have_as_many_actuators_as_freedoms() -> None:
    assert set(gallery_names()) == {*GALLERY, *NETWORKS}
    for name in GALLERY:
        model, ranks = model_of(name), RANKS[name]
        assert (len(driven_joints(model)), degrees_of_freedom(model)) == (ranks.freedoms, ranks.freedoms)
        assert statics_hindrance(model) == ""


@pytest.mark.parametrize("name", FILES)
def test_forces_equal_those_of_virtual_work_in_mujoco(name: str) -> None:
    """Also of files with actuated screws, cylindrical joints, two actuators in a limb, and limbs without any."""
    package, loads = scene(name)
    rng = np.random.default_rng([12, *name.encode()])
    for k in range(DRIVEN_POSES + 1):
        oracle = Oracle(robot_of(table(name)), LENGTH)
        if k:
            oracle.drive(random_displacements(oracle.robot, rng))
        expected = feasible(oracle).forces(wrenches_of(loads, oracle.rotation))
        smallest, largest, _ = package.at(oracle.rotation, oracle.position)
        assert largest.shape == (len(oracle.actuated), LOADS)
        np.testing.assert_array_equal(smallest, largest)  # no load has a part of any direction
        assert (np.abs(largest - expected).max(axis=0) / np.abs(expected).max(axis=0)).max() < AGREEMENT


#: Random mechanisms with nested, serial and coupled loops that have as many actuators as freedoms, up to five.
MECHANISMS = (14, 18, 46, 101, 103, 105, 106, 109, 110)


@pytest.mark.parametrize("seed", MECHANISMS)
def test_forces_of_mechanisms_of_any_topology_equal_those_of_virtual_work_in_mujoco(seed: int) -> None:
    """Every link is a free body of the engine, and every joint rows on its Jacobians (``mechanism_robots``)."""
    tables = random_mechanism(seed)
    model, home = robot(**tables), mechanism_of(tables)
    loads = random_loads(np.random.default_rng(seed))
    package = Package(model, Loading(tuple(loads)))
    count = 0
    for there in (home, *closed_configurations(home, count=3)):
        engine = Engine(there)
        if not is_regular(engine, 1e-4):
            continue
        (plate,) = (each for each in there.links if each.name == there.platform)
        R, p = plate.rotation, plate.position
        names = [each.name for each in there.joints if each.actuated]
        order = [names.index(each.name) for each in model.joints if each.name in names]
        assert len(order) == len(package.names)
        twists = engine.platform_twists(locked=False).T
        omega, v = twists[:, :3], twists[:, 3:]
        rates = np.array([engine.rates(each) for each in twists])[:, order]
        motions = Feasible(rates, np.hstack([omega, v + np.cross(omega, p)]))
        expected = motions.forces(wrenches_of(loads, R))
        found = package.numbers(package.typical, unknowns_at(model, home, there), R, p)[1].full()
        # Their singular values go down to 1e-4 of the largest, which takes four digits.
        assert (np.abs(found - expected).max(axis=0) / np.abs(expected).max(axis=0)).max() < 1e-9
        count += 1
    assert count >= 2


#: Tables of mechanisms whose forces no load determines, by their seeds, and why.
HINDERED = {
    0: "its platform cannot move",
    12: "it has 2 actuators for 1 degree of freedom, so internal forces between actuators are not determined by the "
    "load",
    20: "its 2 actuators do not control the 4 degrees of freedom of its platform",
    112: "its 1 actuator does not control the 2 degrees of freedom of its platform",
}


@pytest.mark.parametrize("seed", HINDERED)
def test_mechanisms_whose_forces_are_not_determined_say_why(seed: int) -> None:
    assert statics_hindrance(robot(**random_mechanism(seed))) == HINDERED[seed]


@pytest.mark.parametrize("name", ["6-rus", "3-rps", "delta", "planar-3-rrr", "6-ups"])
def test_the_comparison_would_see_a_moment_about_another_point(name: str) -> None:
    """Half a length unit is far above the agreement: the test above tells points apart, and so directions of them."""
    package, loads = scene(name)
    oracle = Oracle(robot_of(table(name)), LENGTH)
    R, p = oracle.rotation, oracle.position
    wrong = wrenches_of(loads, R)
    wrong[3:] += np.cross(np.array([0.3, 0.2, 0.5]), wrong[:3].T).T
    _, found, _ = package.at(R, p)
    differences = np.abs(found - feasible(oracle).forces(wrong)).max()
    # A platform that only moves along has no moments that count.
    assert differences < AGREEMENT if name == "delta" else differences > 1e-2


@pytest.mark.parametrize("name", EACH_KIND)
def test_forces_and_speeds_follow_the_unit_of_length(name: str) -> None:
    """In millimetres instead of metres: forces stay, torques per radian have a thousand times the number."""
    k = 1000.0
    package, loads = scene(name)
    oracle = Oracle(robot_of(table(name)), LENGTH)
    oracle.drive(random_displacements(oracle.robot, np.random.default_rng(13)))
    scaled = [Load(each.name, each.force, k * np.array(each.moment), k * np.array(each.point)) for each in loads]
    other = Package(package.model, Loading(tuple(scaled), Motion(0.7 * k, 0.4)))
    sizes = [(np.size(item.typical), item.dimension is Dimension.LENGTH) for item in package.model.parameters]
    lengths = np.concatenate([np.full(size, k if is_length else 1.0) for size, is_length in sizes])
    one = package.at(oracle.rotation, oracle.position)
    two = other.at(oracle.rotation, k * oracle.position, lengths * package.typical)
    kinds = [joint.dimension for joint in driven_joints(package.model)]
    assert package.names == other.names
    power = np.array([k if kind is Dimension.ANGLE else 1.0 for kind in kinds])
    np.testing.assert_allclose(two[1] / power[:, None], one[1], rtol=0, atol=1e-11 * np.abs(one[1]).max())
    # Speeds have a unit of length where forces have none: force times speed is a power. Sizes of vectors that are 0 are
    # 1e-12 in any unit, to be smooth.
    np.testing.assert_allclose(two[2], one[2] * k / power, rtol=1e-10, atol=1e-12 * 0.7 * k)


@pytest.mark.parametrize("name", ["3-rps", "4-upu", "6-rus", "delta", "planar-3-rrr", "spherical-3-rrr", "tricept"])
def test_loads_of_any_direction_are_bounded_by_what_some_direction_reaches(name: str) -> None:
    """By brute force over directions of the force, and over those of the moment, which do not depend on each other."""
    rng = np.random.default_rng([14, *name.encode()])
    oracle = Oracle(robot_of(table(name)), LENGTH)
    oracle.drive(random_displacements(oracle.robot, rng))
    point, force, a, b = rng.normal(size=3) * 0.3, rng.normal(size=3), 1.7, 0.6
    load = Load("tool", tuple(force), point=tuple(point), any_force=a, any_moment=b)
    smallest, largest, _ = Package(model_of(name), Loading((load,))).at(oracle.rotation, oracle.position)
    count = 20_000
    forces, moments = (size * directions(rng, count) for size in (a, b))
    arm = oracle.rotation @ point
    given = np.hstack([np.vstack([forces.T, np.cross(arm, forces).T]), np.vstack([0 * moments.T, moments.T])])
    fixed = np.concatenate([force, np.cross(arm, force)])[:, None]
    tau = feasible(oracle).forces(np.hstack([fixed, given]))
    centre, by_force, by_moment = tau[:, 0], tau[:, 1 : count + 1], tau[:, count + 1 :]
    most = centre + by_force.max(axis=1) + by_moment.max(axis=1)
    least = centre + by_force.min(axis=1) + by_moment.min(axis=1)
    scale = np.abs(tau).max()
    for bound, reached, sign in ((largest[:, 0], most, 1), (smallest[:, 0], least, -1)):
        excess = sign * (bound - reached)
        assert excess.min() > -1e-10 * scale
        assert excess.max() < 1e-3 * scale


#: Robots whose platform's rotations and translations do not depend on each other.
EXACT_SPEEDS = ("3-puu", "3-upu", "6-pus", "6-rus", "delta", "delta-parallelogram", "planar-3-rrr")


def largest_speeds(motions: Feasible, linear: float, angular: float, rng: np.random.Generator) -> Array:
    """Largest speeds (a,) over random motions of the platform within the fastest ones, each scaled up to them."""
    basis = motions.rates.T, motions.twists.T  # (a, n), (6, n)
    weights = rng.normal(size=(basis[0].shape[1], 20_000))
    # Of motions of different kinds too: few of the basis at a time.
    weights *= rng.random(weights.shape) < rng.random(20_000)
    rates, twists = (each @ weights for each in basis)
    turn, way = (np.linalg.norm(twists[part], axis=0) for part in (slice(0, 3), slice(3, 6)))
    with np.errstate(divide="ignore"):
        times = np.minimum(angular / turn, linear / way)
    kept = np.isfinite(times)
    return np.asarray(np.abs(rates[:, kept] * times[kept]).max(axis=1))


@pytest.mark.parametrize("name", EACH_KIND)
def test_no_motion_within_the_fastest_ones_drives_an_actuator_faster(name: str) -> None:
    rng = np.random.default_rng([15, *name.encode()])
    package, _ = scene(name)
    oracle = Oracle(robot_of(table(name)), LENGTH)
    oracle.drive(random_displacements(oracle.robot, rng))
    motions = feasible(oracle)
    speeds = package.at(oracle.rotation, oracle.position)[2]
    sampled = largest_speeds(motions, 0.7, 0.4, rng)
    assert (sampled <= speeds * (1 + 1e-9)).all()
    if name in EXACT_SPEEDS:
        # Fastest motions without the formula: those along alone, and those about an axis alone.
        reached = np.zeros(len(speeds))
        for part, other, size in ((slice(3, 6), slice(0, 3), 0.7), (slice(0, 3), slice(3, 6), 0.4)):
            _, values, V = np.linalg.svd(motions.twists[:, other].T)
            pure = V[int(np.sum(values > 1e-9)) :].T
            # max |rates w| with |twists w| = size; spins move neither.
            twists, rates = motions.twists.T[part] @ pure, motions.rates.T @ pure
            if np.abs(twists).max(initial=0.0) > 1e-9:
                reached += size * np.linalg.norm(rates @ np.linalg.pinv(twists, rcond=1e-9), axis=1)
        np.testing.assert_allclose(speeds, reached, rtol=1e-9)


def is_refused(load: Load, name: str) -> bool:
    try:
        Loading((load,)).check_work(model_of(name))
    except CaseError:
        return True
    return False


#: Robots whose limbs share their constraints; and two of whose limbs each has wrenches of its own.
SHARED = ("4-upu", "delta-parallelogram", "five-bar", "planar-3-rpr", "spherical-3-rrr", "tripteron")
APART = ("3-upu", "delta")


@pytest.mark.parametrize("name", [*SHARED, *APART])
def test_loads_are_refused_that_no_actuator_feels_and_no_limb_is_said_to_hold(name: str) -> None:
    oracle = driven(name, 15)
    there, R = feasible(oracle), oracle.rotation
    units = [tuple(row) for row in np.eye(3).tolist()]
    for load in (
        *(Load(force=unit) for unit in units),
        *(Load(moment=unit) for unit in units),
        Load(force=(0, 0, 2), moment=(1, 0, 0), point=(0.1, -0.2, 0.3)),
        Load(force=(0, 1, 2), moment=(1, 2, 3)),
        Load(force=(0, 1e-6, 2)),
    ):
        force, moment = np.split(wrenches_of([load], R).ravel(), 2)
        felt = np.abs(there.twists @ np.concatenate([moment, force])).max() > 1e-10
        assert is_refused(load, name) == (name in SHARED and not felt), load
    turns, moves = (bool((np.abs(there.twists[:, part]) > 1e-10).any()) for part in (slice(0, 3), slice(3, 6)))
    assert is_refused(Load(any_moment=1.0), name) == (name in SHARED and not turns)
    assert is_refused(Load(any_force=1.0), name) == (name in SHARED and not moves)
    assert not is_refused(Load(any_force=1.0, any_moment=1.0), name)


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
    R = turn_about(rng.normal(size=3), rng.uniform(-0.4, 0.4))
    return Legs(base, platform, R, rng.uniform([-0.3, -0.3, 0.9], [0.3, 0.3, 1.3]))


def legs_at(loading: Loading, legs: Legs) -> tuple[Array, Array, Array]:
    return Package(hexapod(), loading).at(legs.R, legs.p, legs.vector)


def test_six_straight_legs_carry_what_their_directions_say_and_push_with_positive_forces() -> None:
    rng = np.random.default_rng(1)
    loads = random_loads(rng)
    package = Package(hexapod(), Loading(tuple(loads)))
    for _ in range(40):
        legs = random_legs(rng)
        expected = legs.forces(wrenches_of(loads, legs.R))
        _, found, _ = package.at(legs.R, legs.p, legs.vector)
        scale = np.linalg.cond(legs.rows) * np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 * scale)
    # A weight on legs that stand below the platform, symmetric about the vertical: each pushes by its sixth.
    at, up = np.radians([[-10.0, 10, 110, 130, 230, 250], [-50.0, 50, 70, 170, 190, 290]])
    base, platform = (r * np.column_stack([np.cos(a), np.sin(a), 0 * a]) for r, a in ((1.0, at), (0.6, up)))
    legs = Legs(base, platform, np.eye(3), np.array([0, 0, 0.8]))
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


def about_z(yaw: float) -> Array:
    return turn_about([0, 0, 1.0], yaw)


def test_the_forces_of_a_three_upu_by_rows_and_joint_by_joint_have_a_closed_form() -> None:
    # Also written as ``L_i (2 (w_z (q_x c_i + q_y s_i) - q_z (w_x c_i + w_y s_i)) / d + w_z) / (3 q_z)``,
    # negated.
    rng = np.random.default_rng(3)
    for _ in range(60):
        loads = random_loads(rng, 4)
        rb, d, yaw = rng.uniform(0.4, 1.0), rng.uniform(0.15, 0.35), rng.uniform(-np.pi, np.pi)
        q = rng.uniform([-0.2, -0.2, 0.3], [0.2, 0.2, 1.0])
        w = np.array([each.force for each in loads])
        expected = np.array([upu_forces(d, yaw, q, each) for each in w]).T
        # In the world of the robot's first leg along x; moments and points do not count.
        local = [Load(each.name, about_z(-yaw) @ each.force, each.moment, each.point) for each in loads]
        package = Package(three_upu(axes="tsai"), Loading(tuple(local)))
        _, found, _ = package.at(np.eye(3), about_z(-yaw) @ q, np.array([rb, rb - d]))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
        c, s = (f(yaw + np.radians([0.0, 120.0, 240.0])) for f in (np.cos, np.sin))
        x, y, z = q
        L = np.sqrt((x - d * c) ** 2 + (y - d * s) ** 2 + z**2)
        for k, (wx, wy, wz) in enumerate(w):
            written = L * (2 * (wz * (x * c + y * s) - z * (wx * c + wy * s)) / d + wz) / (3 * z)
            np.testing.assert_allclose(found[:, k], -written, rtol=0, atol=1e-12 * np.abs(expected).max())
    rng = np.random.default_rng(4)
    loads = random_loads(rng, 6)
    package = Package(model_of("3-upu"), Loading(tuple(loads)))
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

    def largest_at(place: Array) -> float:
        _, found, _ = package.at(np.eye(3), np.array([0, 0, 0.45]) + place, np.array([0.5, 0.12]))
        return float(np.abs(found).max())

    forces = {tuple(each): largest_at(each) for each in corners}
    assert forces[0.1, -0.1, -0.05] == pytest.approx(8.08803, abs=5e-6)
    # The force of the leg along x does not depend on the sign of y.
    assert forces[0.1, 0.1, -0.05] == pytest.approx(forces[0.1, -0.1, -0.05], rel=1e-13)
    assert max(forces.values()) == pytest.approx(forces[0.1, -0.1, -0.05], rel=1e-13)
    inside = np.random.default_rng(5).uniform(-1, 1, (200, 3)) * [0.1, 0.1, 0.05]
    assert all(largest_at(each) < max(forces.values()) for each in inside)


def test_forces_do_not_change_where_the_whole_world_is_moved_and_turned() -> None:
    rng = np.random.default_rng(6)
    for _ in range(10):
        legs, Q, t = random_legs(rng), turn_about(rng.normal(size=3), rng.uniform(0, 3)), rng.normal(size=3) * 5
        loads = random_loads(rng, 5)
        loads += [Load("mass", mass=3.0, point=(0.1, 0.2, 0.3)), Load("turned", (1, 2, 3), (4, 5, 6), in_platform=True)]
        loads += [Load("any", any_force=2.0, any_moment=0.5, point=(0.3, -0.2, 0.4))]
        there = Legs(legs.base @ Q.T + t, legs.platform, Q @ legs.R, Q @ legs.p + t)
        world = [
            each if each.in_platform else Load(
                each.name, Q @ each.force, Q @ each.moment, each.point,
                any_force=each.any_force, any_moment=each.any_moment, mass=each.mass,
            )
            for each in loads
        ]  # fmt: skip
        gravity, motion = np.array([0.3, -0.2, -9.0]), Motion(0.5, 0.7)
        here = legs_at(Loading(tuple(loads), motion, gravity), legs)
        moved = legs_at(Loading(tuple(world), motion, Q @ gravity), there)
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


def test_loads_turn_with_the_platform_and_a_mass_is_its_weight_at_its_centre() -> None:
    rng = np.random.default_rng(10)
    legs, loads = random_legs(rng), random_loads(rng)
    own = [Load(each.name, each.force, each.moment, each.point, in_platform=True) for each in loads]
    world = [Load(each.name, legs.R @ each.force, legs.R @ each.moment, each.point) for each in loads]
    one, other = (legs_at(Loading(tuple(given)), legs)[1] for given in (own, world))
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-13 * np.abs(one).max())
    legs = random_legs(np.random.default_rng(11))
    centre, gravity = (0.1, -0.2, 0.5), (0.5, 1.0, -8.0)
    for stated, acting in ((None, (0.0, 0.0, -9.81)), (gravity, gravity)):
        weight = Load("w", tuple(2.5 * each for each in acting), point=centre)
        expected = legs.forces(wrenches_of([weight], legs.R))
        _, found, _ = legs_at(Loading((Load("m", mass=2.5, point=centre),), gravity=stated), legs)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_opposite_loads_and_loads_that_are_always_there() -> None:
    # Each load with each sign, on top of all that are always there with each of theirs.
    rng = np.random.default_rng(12)
    legs = random_legs(rng)
    cut, push, weight, hose = random_loads(rng, 4)

    def named(load: Load, name: str, **more: bool) -> Load:
        return Load(name, load.force, load.moment, load.point, **more)

    def of(*signed: tuple[Load, float]) -> Array:
        return np.asarray(sum(sign * legs.forces(wrenches_of([load], legs.R))[:, 0] for load, sign in signed))

    own = (named(weight, "weight", always=True), named(cut, "cut", both_signs=True))
    loading = Loading((*own, named(hose, "hose", always=True, both_signs=True), named(push, "push")))
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
    legs = random_legs(np.random.default_rng(17))
    rows = legs.rows
    for linear, angular in ((0.5, 0.0), (0.0, 1.2)):
        _, _, speeds = legs_at(Loading((), Motion(linear, angular)), legs)
        expected = linear * np.linalg.norm(rows[:, 3:], axis=1) + angular * np.linalg.norm(rows[:, :3], axis=1)
        np.testing.assert_allclose(speeds, expected, rtol=1e-11)
