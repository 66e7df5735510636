"""Forces and speeds of actuators against MuJoCo's constrained Jacobian, at home and at driven poses."""

from __future__ import annotations

import numpy as np
import pytest
from actuator_forces import LOADS, Feasible, Package, directions, feasible, random_loads, scene, wrenches_of
from builders import EACH_KIND, Array
from engine_comparison import is_regular, unknowns_at
from mechanism_robots import Engine
from mujoco_robots import Oracle
from random_mechanisms import random_mechanism
from robot_files import robot_of
from robot_gallery import FILES, GALLERY, LENGTH, RANKS, random_displacements, table

from screwsynth.models import Dimension, robot
from screwsynth.models.catalog import gallery_names
from screwsynth.models.mechanism import mechanism_of
from screwsynth.models.mechanism.singularities import closed_configurations
from screwsynth.models.statics import driven_joints, freedoms_of, statics_hindrance
from screwsynth.nlp.case.loads import Load, Loading, Motion
from screwsynth.nlp.errors import CaseError

DRIVEN_POSES = 5
#: Largest difference of a force, as a part of the largest of the robot's forces under the load.
AGREEMENT = 1e-10


def check_robot(name: str, poses: int) -> float:
    package, loads = scene(name)
    rng = np.random.default_rng([12, *name.encode()])
    worst = 0.0
    for k in range(poses + 1):
        oracle = Oracle(robot_of(table(name)), LENGTH)
        if k:
            oracle.drive(random_displacements(oracle.robot, rng))
        expected = feasible(oracle).forces(wrenches_of(loads, oracle.rotation))
        smallest, largest, _ = package.at(oracle.rotation, oracle.position)
        assert largest.shape == (len(oracle.actuated), LOADS)
        np.testing.assert_array_equal(smallest, largest)  # no load has a part of any direction
        worst = max(worst, float((np.abs(largest - expected).max(axis=0) / np.abs(expected).max(axis=0)).max()))
    assert worst < AGREEMENT, worst
    return worst


def test_all_24_robots_of_the_gallery_have_as_many_actuators_as_freedoms() -> None:
    assert len(gallery_names()) == len(GALLERY) == 24
    for name in GALLERY:
        model, ranks = robot(**table(name)), RANKS[name]
        assert (len(driven_joints(model)), freedoms_of(model)) == (ranks.freedoms, ranks.freedoms)
        assert statics_hindrance(model) == ""


@pytest.mark.parametrize("name", FILES)
def test_forces_equal_those_of_virtual_work_in_mujoco(name: str) -> None:
    """Also of files with actuated screws, cylindrical joints, two actuators in a limb, and limbs without any."""
    check_robot(name, DRIVEN_POSES)


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
    12: "it has 2 actuators for 1 freedom, so that they can load each other with forces that no load determines",
    20: "its 2 actuators do not hold the 4 freedoms of its platform",
    112: "its 1 actuator does not hold the 2 freedoms of its platform",
}


@pytest.mark.parametrize("seed", HINDERED)
def test_mechanisms_whose_forces_are_not_determined_say_why(seed: int) -> None:
    assert statics_hindrance(robot(**random_mechanism(seed))) == HINDERED[seed]


@pytest.mark.parametrize("name", ["6-rus", "3-rps", "delta", "planar-3-rrr", "six legs"])
def test_the_comparison_would_see_a_moment_about_another_point(name: str) -> None:
    """Half a length unit is far above the agreement: the test above tells points apart, and so directions of them."""
    name = "6-ups" if name == "six legs" else name
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
    lengths = np.concatenate(
        [
            np.full(np.size(item.typical), k if item.dimension is Dimension.LENGTH else 1.0)
            for item in package.model.parameters
        ]
    )
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
    smallest, largest, _ = Package(robot(**table(name)), Loading((load,))).at(oracle.rotation, oracle.position)
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
        Loading((load,)).check_work(robot(**table(name)))
    except CaseError:
        return True
    return False


#: Robots whose limbs share their constraints; and two of whose limbs each has wrenches of its own.
SHARED = ("4-upu", "delta-parallelogram", "five-bar", "planar-3-rpr", "spherical-3-rrr", "tripteron")
APART = ("3-upu", "delta")


@pytest.mark.parametrize("name", [*SHARED, *APART])
def test_loads_are_refused_that_no_actuator_feels_and_no_limb_is_said_to_hold(name: str) -> None:
    oracle = Oracle(robot_of(table(name)), LENGTH)
    oracle.drive(random_displacements(oracle.robot, np.random.default_rng([15, *name.encode()])))
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
