"""Robots of any topology in numbers, and wrenches of members: against symbolic forms, MuJoCo and mechanics."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from builders import Array, turn_about
from casadi import SX
from engine_comparison import Differences, compare, objective, program_at, with_twist
from mechanism_robots import Engine, four_bar_delta, geared, projector, without
from mujoco_robots import Oracle
from random_mechanisms import Builder, random_mechanism, unit
from robot_files import Joint, every_joint, robot_of
from robot_gallery import CHI, GALLERY, LENGTH, size_of, snu, table

from screwsynth.models import GenericRanks, Model, RobotError, Substitution, axis_angle_from_matrix, instantiate, robot
from screwsynth.models.joints.home.chain import Joint as ChainJoint
from screwsynth.models.joints.home.motion import AxisKind, JointAxis
from screwsynth.models.mechanism import (
    check_mechanism,
    close,
    limbs_of,
    links_of,
    mechanism_of,
    robot_tables,
    wrenches_of,
)
from screwsynth.models.mechanism.graph import Coupling, Mechanism, MechanismError, MechanismJoint, MechanismLink
from screwsynth.models.mechanism.singularities import SingularityType, generic_ranks, singularities_of
from screwsynth.nlp import evaluate
from screwsynth.nlp.evidence.assembly import unknowns_from_home
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.evidence.singularities import SingularityKind


def driven(mechanism: Mechanism, seed: int, reach: float = 0.05) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    return {joint.name: float(rng.uniform(-reach, reach)) for joint in mechanism.joints if joint.actuated}


def value_at_home(tables: dict[str, Any]) -> float:
    """F of the symbolic model at home."""
    model = robot(**tables)
    own = Substitution.identity(model)
    F = instantiate(model, own, ca.SX(LENGTH), [ca.SX(CHI)]).F
    typical = np.concatenate([np.zeros(0), *[item.typical for item in model.parameters]])
    return float(ca.Function("F", own.all, [F])(typical, np.zeros(len(model.unknowns)), np.eye(3), model.home))


def values_of(model: Model, plate: MechanismLink) -> tuple[list[float], list[Any]]:
    """F and the actuators' work rates (m, a) of the symbolic model at home, and at a pose along the path from there."""
    own = Substitution.identity(model)
    instance = instantiate(model, own, ca.SX(LENGTH), [ca.SX(CHI)])
    function = ca.Function("F", own.all, [instance.F, ca.densify(instance.driven)])
    typical = np.concatenate([np.zeros(0), *[item.typical for item in model.parameters]])
    axis, angle = axis_angle_from_matrix(plate.rotation)
    unknowns = unknowns_from_home(model, typical, np.concatenate([angle * axis, plate.position]))
    assert unknowns is not None
    home = function(typical, np.zeros(len(model.unknowns)), np.eye(3), model.home)
    there = function(typical, unknowns, plate.rotation, plate.position)
    return [float(home[0]), float(there[0])], [home[1].full(), there[1].full()]


@pytest.mark.parametrize("name", GALLERY)
def test_gallery_at_home_and_driven_is_that_of_the_engine(name: str) -> None:
    """Universal joints are two hinges here, and parallelograms four, in a loop of their own."""
    oracle, mechanism = Oracle(robot_of(table(name)), LENGTH), mechanism_of(table(name))
    for seed in (0, 1):
        if seed:
            values = driven(mechanism, seed)
            oracle.drive(list(values.values()))
            mechanism = close(mechanism, actuators=values).mechanism
        found, ranks = wrenches_of(mechanism, LENGTH), oracle.ranks()
        assert found.objective(CHI) == pytest.approx(oracle.objective(CHI), rel=1e-9)
        for own, member in zip(found.members, oracle.members(), strict=True):
            np.testing.assert_allclose(own.projector, member.projector, rtol=0, atol=1e-9)
            # The rows span the same wrenches, and are orthonormal in scaled coordinates.
            resisted = pytest.approx(np.sum(own.resisted(CHI) ** 2), abs=1e-9)
            assert np.sum((own.rows @ CHI[[3, 4, 5, 0, 1, 2]]) ** 2) == resisted
        feasible = oracle.feasible(CHI)
        rates = list(found.rates(feasible).values())
        np.testing.assert_allclose(rates, oracle.rates(feasible), rtol=1e-9, atol=1e-9)
        assert tuple(each.wrenches for each in found.members) == ranks.W
        assert tuple(each.constraints for each in found.members) == ranks.C
        own_ranks = found.ranks
        assert (own_ranks.jacobian, own_ranks.constraints) == (ranks.J, ranks.constraints)
        assert (own_ranks.freedoms, own_ranks.locked) == (ranks.freedoms, ranks.locked)


def test_every_robot_of_the_gallery_comes_back_as_limbs() -> None:
    """Parallelograms of four hinges become Pa again; F of the model from the tables is that of the numbers."""
    for name in ["3-rps", "delta", "delta-parallelogram"]:
        mechanism = mechanism_of(table(name))
        tables = limbs_of(mechanism)
        assert tables == robot_tables(mechanism)
        types = [joint["type"] for limb in tables["limb"] for joint in limb.get("joints", [])]
        assert ("Pa" in types) == (name == "delta-parallelogram")
        assert value_at_home(tables) == pytest.approx(wrenches_of(mechanism, LENGTH).objective(CHI), rel=1e-9)
        # Joints that are given from the platform's side are turned over.
        turned = [replace(each, inner=each.outer, outer=each.inner, axis=-each.axis) for each in mechanism.joints]
        joints = tuple(pair[k % 2] for k, pair in enumerate(zip(mechanism.joints, turned, strict=True)))
        flipped = replace(mechanism, joints=joints)
        assert value_at_home(limbs_of(flipped)) == pytest.approx(value_at_home(tables), rel=1e-9)


@pytest.mark.parametrize("name", ["delta-parallelogram", "four-bar delta", "geared"])
def test_nested_loops_and_couplings_against_the_engines_jacobians(name: str) -> None:
    tables = {"four-bar delta": four_bar_delta(), "geared": geared()}.get(name)
    mechanism = mechanism_of(tables or table(name))
    # The engine's model of the largest robot takes seconds: it is compared away from home only.
    for seed in (1,) if name == "four-bar delta" else (0, 1):
        mechanism = close(mechanism, actuators=driven(mechanism, seed, 0.1 * seed)).mechanism
        found, engine = wrenches_of(mechanism, LENGTH), Engine(mechanism)
        free = engine.platform_twists(locked=False)
        locked = engine.platform_twists(locked=True)
        assert (found.ranks.freedoms, found.ranks.locked) == (free.shape[1], locked.shape[1])
        np.testing.assert_allclose(found.feasible - free @ (free.T @ found.feasible), 0, atol=1e-9)
        chi = free @ (free.T @ CHI)
        np.testing.assert_allclose(list(found.rates(chi).values()), engine.rates(chi), rtol=1e-9, atol=1e-9)
        total = 0.0
        for member in found.members:
            # The member alone: without the links of all others.
            passed = {name for other in found.members if other is not member for name in other.joints}
            others, own = (
                {link for each in mechanism.joints if each.name in names for link in (each.inner, each.outer)}
                for names in (passed, member.joints)
            )
            alone = Engine(without(mechanism, others - own - {mechanism.base, mechanism.platform}))
            P = projector(alone.platform_twists(locked=True), member.centre, LENGTH)
            np.testing.assert_allclose(member.projector, P, rtol=0, atol=1e-9)
            scaled = np.concatenate([CHI[3:] + np.cross(CHI[:3], member.centre), LENGTH * CHI[:3]])
            total += float(np.sum((P @ scaled) ** 2))
        assert found.objective(CHI) == pytest.approx(total, rel=1e-9)


def test_the_symbolic_form_of_nested_loops_has_the_numbers_of_the_mechanism() -> None:
    for tables in (four_bar_delta(), geared(), links_of(mechanism_of(table("delta-parallelogram")))):
        mechanism = mechanism_of(tables)
        found = wrenches_of(mechanism, LENGTH)
        model = robot(**tables)
        there = close(mechanism, actuators=driven(mechanism, 2)).mechanism
        plate = next(link for link in there.links if link.name == there.platform)
        for configuration, F, works in zip((mechanism, there), *values_of(model, plate), strict=True):
            own = wrenches_of(configuration, LENGTH)
            assert pytest.approx(own.objective(CHI), rel=1e-9) == F
            # The rows of a member are those of its projector, in scaled coordinates.
            driving = list(own.actuators)
            for number, member in enumerate(own.members):
                columns = [driving.index(name) for name in member.actuators]
                rows = works[6 * number : 6 * number + 6]
                np.testing.assert_allclose(rows[:, columns], member.actuation, rtol=0, atol=1e-9)
                np.testing.assert_array_equal(np.delete(rows, columns, axis=1), 0)
        assert (model.generic.jacobian, model.generic.constraints) == (found.ranks.jacobian, found.ranks.constraints)
        assert [each.wrenches for each in model.structure] == [each.wrenches for each in found.members]
        assert {name for each in model.structure for name in each.nested} == {each.name for each in mechanism.joints}


def test_numbers_do_not_depend_on_frame_tree_or_order() -> None:
    """Moved in the world, with links in another order, and joints given from the other side."""
    R, t = turn_about([1, 2, -1], math.radians(70)), np.array([3.0, -2, 1])
    for name in ("delta", "delta-parallelogram", "exechon"):
        mechanism = mechanism_of(table(name))
        links = [replace(e, position=R @ e.position + t, rotation=R @ e.rotation) for e in mechanism.links[::-1]]
        joints = [
            replace(e, point=R @ e.point + t, axis=-(R @ e.axis), inner=e.outer, outer=e.inner)
            for e in mechanism.joints[::-1]
        ]
        moved = replace(mechanism, links=tuple(links), joints=tuple(joints))
        chi = np.concatenate([R @ CHI[:3], R @ CHI[3:] + np.cross(t, R @ CHI[:3])])
        one, other = wrenches_of(mechanism, LENGTH), wrenches_of(moved, LENGTH)
        assert other.objective(chi) == pytest.approx(one.objective(CHI), rel=1e-9)
        assert other.rates(chi) == pytest.approx(dict(one.rates(CHI)), rel=1e-9)
        assert sorted(other.ranks.passive) == sorted(one.ranks.passive)


def with_points(name: str, **points: Any) -> dict[str, Any]:  # noqa: ANN401 - expressions
    changed = copy.deepcopy(table(name))
    for limb in changed["limb"]:
        limb["points"].update(points)
    return changed


def stretched() -> dict[str, Any]:
    changed = copy.deepcopy(table("planar-3-rrr"))
    others = copy.deepcopy(changed["limb"][0])
    changed["limb"][0]["repeat"], others["repeat"] = {"angles": [0]}, {"angles": [120, 240]}
    changed["limb"][0]["points"]["E"] = ["(rb + ax)/2", "ay/2", 0]
    changed["limb"].append(others)
    return changed


def along_first_axis() -> dict[str, Any]:
    changed = copy.deepcopy(table("6-ups"))
    for limb in changed["limb"]:
        limb["joints"][0]["axes"] = ["A - B", "cross(A - B, y)"]
    return changed


@pytest.mark.parametrize(
    ("tables", "dimensions", "kinds"),
    [
        (snu(), {}, {SingularityType.CONSTRAINT}),
        (with_points("planar-3-rrr", E=["2*ax", "2*ay", 0]), {}, {SingularityType.ACTUATION}),
        (table("five-bar"), {"reach": math.sqrt(0.25**2 - 0.1**2)}, {SingularityType.ACTUATION}),
        (table("delta"), {"rb": 0.3, "arm": 0.4, "tilt": 60, "rp": 0.5, "rod": 0.9}, {SingularityType.CONSTRAINT}),
        (stretched(), {}, {SingularityType.SERIAL}),
        (along_first_axis(), {}, {SingularityType.PASSIVE}),
        (table("3-rps"), {}, set()),
    ],
    ids=["snu", "planar", "five-bar", "delta", "stretched", "passive", "regular"],
)
def test_singularities_are_told_apart(tables: Any, dimensions: Any, kinds: set[SingularityType]) -> None:  # noqa: ANN401
    mechanism = mechanism_of(tables, dimensions)
    ranks = wrenches_of(mechanism).ranks
    assert {each.type for each in singularities_of(ranks, generic_ranks(mechanism))} == kinds


def test_closing_at_a_pose_and_at_actuators_agree_and_reach_what_is_wanted() -> None:
    for name in ("delta", "3-rps", "6-rus"):
        mechanism = mechanism_of(table(name))
        wanted = driven(mechanism, 3, 0.1)
        there = close(mechanism, actuators=wanted)
        assert there.residual < 1e-13
        assert {key: there.coordinates[key] for key in wanted} == pytest.approx(wanted, abs=1e-14)
        plate = next(link for link in there.mechanism.links if link.name == "platform")
        by_pose = close(mechanism, position=plate.position, rotation=plate.rotation)
        assert {key: by_pose.coordinates[key] for key in wanted} == pytest.approx(wanted, abs=1e-9)
        assert 0.1 < by_pose.nearness < 10
        # A loop that the description leaves open is closed first.
        first = mechanism.joints[-1]
        opened = replace(mechanism, joints=(*mechanism.joints[:-1], replace(first, outer_point=first.point + 1e-4)))
        assert close(opened).residual < 1e-13
    with pytest.raises(MechanismError, match="do not close"):
        close(mechanism, position=plate.position + 50)


def test_links_that_hang_on_one_joint_carry_nothing() -> None:
    """A 6-RUS with 36 links that hang on one joint each: 60 joints."""
    tables = table("6-rus")
    mechanism = mechanism_of(tables)
    joints, links = list(mechanism.joints), list(mechanism.links)
    for k, each in enumerate(mechanism.joints[:9]):
        for n in range(4):
            links.append(MechanismLink(f"extra {k} {n}"))
            joints.append(replace(each, name=f"extra {k} {n}", outer=f"extra {k} {n}", actuated=False))
    large = replace(mechanism, joints=tuple(joints), links=tuple(links))
    assert len(large.joints) >= 60
    found = wrenches_of(large, LENGTH)
    assert found.objective(CHI) == pytest.approx(wrenches_of(mechanism, LENGTH).objective(CHI), rel=1e-9)


def broken(**changes: Any) -> Mechanism:  # noqa: ANN401 - any field
    return replace(mechanism_of(table("planar-3-rrr")), **changes)


def test_a_mechanism_that_contradicts_itself_is_refused_in_one_sentence() -> None:
    good = broken()
    first, *rest = good.joints
    cases = [
        (broken(base="ground"), "base: is 'ground', which is not a link"),
        (broken(platform="base"), "platform: is 'base', which is the base"),
        (broken(joints=tuple(replace(j, actuated=False) for j in good.joints)), "actuated: is given at no joint"),
        (broken(joints=(replace(first, axis=np.zeros(3)), *rest)), "joint 1:1, axis: is zero; a direction is needed"),
        (broken(joints=(replace(first, axis=2 * first.axis), *rest)), "has length 2; a unit vector is needed"),
        (broken(joints=(replace(first, outer="none"), *rest)), "has the link 'none', which is unknown"),
        (broken(joints=(replace(first, outer=first.inner), *rest)), "connects the link 'base' to itself"),
        (broken(joints=(first, *good.joints)), "joint 1:1: is given twice"),
        (broken(joints=(replace(first, kind="S"), *rest)), "joint 1:1 (S): is actuated; only R, P and H joints can be"),
        (broken(joints=(replace(first, point=np.full(3, np.nan)), *rest)), "has a point that is not finite"),
        (broken(links=(*good.links, MechanismLink("loose"))), "link loose: is not connected to the base"),
        (broken(joints=good.joints[:3], links=tuple(e for e in good.links if e.name[5:6] in ("", "1", "o"))), "chain"),
        (broken(couplings=(Coupling("c", (("1:1", 1.0),)),)), "coupling c: couples fewer than two joints"),
        (broken(couplings=(Coupling("c", (("1:1", 1.0), ("9", 1.0))),)), "has the joint '9', which is unknown"),
        (broken(joints=(replace(first, range=(1.0, 0.0)), *rest)), "range: is (1.0, 0.0)"),
    ]
    for mechanism, sentence in cases:
        with pytest.raises(MechanismError) as error:
            check_mechanism(mechanism)
        assert sentence in str(error.value)
        assert str(error.value).isprintable()
    with pytest.raises(MechanismError, match=r"^joints .*motor1.*do not form a limb with branches: "):
        limbs_of(mechanism_of(four_bar_delta()))


def test_welds_and_locked_actuators_make_one_body() -> None:
    """A link that is split by a weld changes nothing; a joint directly between base and platform is a member."""
    mechanism = mechanism_of(table("tricept"))
    last = mechanism.joints[-1]
    weld = MechanismJoint("bolts", "weld", "flange", "platform", np.zeros(3))
    joints = (*mechanism.joints[:-1], replace(last, outer="flange"), weld)
    split = replace(mechanism, links=(*mechanism.links, MechanismLink("flange")), joints=joints)
    assert wrenches_of(split).objective(CHI) == pytest.approx(wrenches_of(mechanism).objective(CHI), rel=1e-12)
    pin = MechanismJoint("pin", "S", "base", "platform", np.array([0.0, 0, 1]))
    pinned = replace(mechanism, joints=(*mechanism.joints, pin))
    added = wrenches_of(pinned).objective(CHI) - wrenches_of(mechanism).objective(CHI)
    velocity = CHI[3:] + np.cross(CHI[:3], [0, 0, 1])
    assert added == pytest.approx(float(velocity @ velocity), rel=1e-12)


# Wrenches and centre of a member against the forces and couples that mechanics gives for each type of limb.

X, Y, Z = np.eye(3)


class Expected(NamedTuple):
    """Centre (3,), and directions (3,) of unit forces through it and of couples of size ``l``."""

    centre: Array
    forces: Sequence[Array]
    couples: Sequence[Array] = ()


Limb = Callable[[Sequence[Joint]], Expected]


def along(joints: Sequence[Joint], first: int, second: int) -> Array:
    return joints[second].point - joints[first].point


def rod(first: int) -> Limb:
    """A rod to the platform's ball joint: a force along it."""
    return lambda j: Expected(j[first + 1].point, [along(j, first, first + 1)])


def slide(second: int, ball: int) -> Limb:
    """A driven slide from joint 0 between ball joint and hinge: forces along it and along the hinge."""
    return lambda j: Expected(j[ball].point, [along(j, 0, second), j[second - ball].axes[0]])


def crank(hinge: int) -> Limb:
    """A link between a hinge and the platform's ball joint: forces along it and along the hinge."""
    return lambda j: Expected(j[2].point, [along(j, hinge, 2), j[hinge].axes[0]])


def parallel_universals(first: int) -> Limb:
    """A link between universal joints: a force along it and a couple about the normal of the platform joint's axes."""
    return lambda j: Expected(j[2].point, [along(j, first, 2)], [np.cross(*j[2].axes)])


def planar(first: int) -> Limb:
    """A link in the plane of x and y: a force along it, and what holds the plane."""
    return lambda j: Expected(j[2].point, [along(j, first, 2), Z], [X, Y])


def parallelogram(j: Sequence[Joint]) -> Expected:
    """A hinge about y, a parallelogram and a hinge: a force along the rod, and no other rotation than about y."""
    return Expected(j[3].point, [along(j, 1, 3)], [X, Z])


LIMBS: dict[tuple[str, int], Limb] = {
    **{(name, 0): lambda j: Expected(j[2].point, [along(j, 0, 2)]) for name in ("6-ups", "6-sps", "tricept")},
    **{(name, 0): rod(1) for name in ("6-pus", "6-rus", "6-rss", "delta")},
    **{(name, 0): rod(1) for name in ("ankle", "linear-delta", "rotary-delta", "servo-hexapod")},
    **{(name, 0): crank(1) for name in ("3-prs", "3-rrs")},
    **{(name, 0): parallel_universals(0) for name in ("3-upu", "4-upu")},
    **{(name, 0): parallel_universals(1) for name in ("3-puu", "4-ruu")},
    **{(name, 0): planar(1) for name in ("planar-3-rrr", "planar-3-prr", "five-bar-plotter")},
    **{(name, 0): parallelogram for name in ("delta-parallelogram", "orthoglide")},
    ("3-rps", 0): slide(2, 2),
    ("3-spr", 0): slide(2, 0),
    ("exechon", 2): slide(2, 0),
    ("exechon", 0): lambda j: Expected(j[0].point, [along(j, 0, 2), j[2].axes[0]], [np.cross(*j[0].axes)]),
    ("tricept", 3): lambda j: Expected(j[0].point, [X, Y], [np.cross(*j[0].axes)]),
    ("tripteron", 0): lambda j: Expected(j[3].point, [X], [Y, Z]),
    ("planar-3-rpr", 0): planar(0),
    **{(name, 0): lambda j: Expected(j[1].point, [X, Y, Z], [X, Y]) for name in ("five-bar", "five-bar-pen")},
    **{(name, 1): planar(1) for name in ("five-bar", "five-bar-pen")},
    ("five-bar-plotter", 2): lambda j: Expected(j[1].point, [Z], [X, Y, Z]),
    ("pentapod", 0): lambda j: Expected(j[0].point, [along(j, 0, 2)]),
    ("pentapod", 5): lambda j: Expected(j[3].point, [], [Z]),
    ("spherical-3-rrr", 0): lambda j: Expected(0 * j[0].point, [X, Y, Z], [X]),
}


@pytest.mark.parametrize(("name", "limb"), LIMBS)
def test_wrenches_of_a_member_are_those_of_its_mechanics(name: str, limb: int) -> None:
    robot = robot_of(table(name))
    expected = LIMBS[name, limb](every_joint(robot.limbs[limb]))
    rows = [np.concatenate([f / np.linalg.norm(f), np.zeros(3)]) for f in expected.forces]
    rows += [np.concatenate([np.zeros(3), m / np.linalg.norm(m)]) for m in expected.couples]
    member = Oracle(robot, LENGTH).members()[limb]
    rounding = 1e-14 * max(1.0, size_of(robot))
    np.testing.assert_allclose(member.centre, expected.centre, rtol=0, atol=rounding)
    np.testing.assert_allclose(np.array(rows) @ np.array(rows).T, np.eye(len(rows)), rtol=0, atol=1e-14)
    # Orthonormal rows with the same projector span the same wrenches.
    np.testing.assert_allclose(np.array(rows).T @ np.array(rows), member.projector, rtol=0, atol=rounding)


def test_every_robot_of_the_gallery_has_a_limb_here() -> None:
    assert {name for name, _ in LIMBS} == set(GALLERY)


#: Largest difference, in parts of the largest number of its kind.
EQUAL = 1e-10
#: Robots that take little time: networks of one and of several members, with relations of actuators (18, 20), and limbs
#: with actuators in their branches.
QUICK = (0, 12, 14, 18, 20, 46)
#: Others, in the first two of which axes of universal joints are unknowns.
MANY = (63, 243, 101, 103, 104, 105, 106, 108, 109, 110, 112)


def assert_equal(found: Differences) -> None:
    assert max(found.F, found.rates, found.spaces) < EQUAL
    assert found.configurations >= 2


@pytest.mark.parametrize("seed", QUICK)
def test_random_mechanisms_have_the_numbers_of_the_engine(seed: int) -> None:
    assert_equal(compare(random_mechanism(seed)))


@pytest.mark.slow
def test_many_random_mechanisms_have_the_numbers_of_the_engine() -> None:
    done = 0
    for seed in MANY:
        try:
            found = compare(random_mechanism(seed))
        except RobotError:  # such as a graph whose passive joints leave the platform free
            continue
        assert_equal(found)
        done += 1
    assert done > 9


@pytest.mark.parametrize(
    ("stages", "freedoms"),
    [
        (("delta", "hinge", "hinge", "hinge"), 6),  # a Delta with a wrist of three axes
        # A leg: hip and ankle of two struts or cranks each, and a knee.
        pytest.param(("ankle", "four_bar", "ankle"), 5, marks=pytest.mark.soak),
        (("five_bar", "hinge"), 3),
        (("overdriven",), 1),  # a four-bar with two motors
    ],
)
def test_stages_one_after_another_have_all_their_freedoms(stages: Sequence[str], freedoms: int) -> None:
    builder = Builder(np.random.default_rng(3))
    links = ["base", *(builder.link() for _ in stages[1:]), "platform"]
    x, y, z = np.eye(3)
    for k, (stage, one, other) in enumerate(zip(stages, links, links[1:], strict=False)):
        at = 0.7 * k * z
        if stage in ("four_bar", "five_bar", "overdriven"):
            arms = ("R", at - 0.5 * y, [x], True), ("R", at + 0.5 * y, [x], stage != "four_bar")
            ends = ("R", at - 0.6 * y + 0.6 * z, [x], False), ("R", at + 0.8 * y + 0.5 * z, [x], False)
            knee = [("R", at + 0.9 * z, [x], False)] if stage == "five_bar" else []
            builder.chain(one, other, [arms[0], ends[0]])
            builder.chain(one, other, [arms[1], ends[1], *knee])
        else:
            getattr(builder, stage)(one, other, at)
    tables = {"name": "stages", "links": [*builder.links, "platform"], "joint": builder.joints, "home": [0.1, 0.2, 1.0]}
    model = robot(**tables)
    assert (6 - model.generic.constraints, model.generic.idle) == (freedoms, 0)
    assert_equal(compare(tables, driven=1))


def joint_table(name: str, kind: str, between: tuple[str, str], at: Sequence[float], **more: Any) -> dict[str, Any]:  # noqa: ANN401
    return {"name": name, "type": kind, "between": list(between), "at": list(at), **more}


def arm_with_driven_branches() -> dict[str, Any]:
    """A driven arm that carries a rod and two driven struts to a platform with a ball joint on the base."""
    joints = [joint_table("arm", "R", ("base", "arm"), (0.3, 0, 0), axis=[0.1, 1, 0.2], actuated=True)]
    for k, (x, y) in enumerate(((0.5, 0.1), (-0.3, 0.6), (-0.4, -0.5))):
        high = (0.2 + 0.3 * y, 0.1 - 0.4 * x, 1.1)
        joints.append(joint_table(f"low{k}", "U", ("arm", f"tube{k}"), (x, y, 0.2), axes=[[1, 0, 0], [0, 1, 0]]))
        if k:
            ends = (f"tube{k}", f"rod{k}")
            way = [high[0] - x, high[1] - y, 0.9]
            joints.append(joint_table(f"strut{k}", "P", ends, (x, y, 0.2), axis=way, actuated=True))
        joints.append(joint_table(f"high{k}", "S", (f"rod{k}" if k else "tube0", "platform"), high))
    joints.append(joint_table("post", "S", ("base", "platform"), (0.1, 0.1, 0.8)))
    links = ["base", "arm", "tube0", "tube1", "rod1", "tube2", "rod2", "platform"]
    return {"name": "arm", "home": [0, 0, 1], "links": links, "joint": joints}


def test_actuators_of_a_branch_drive_that_branch_alone() -> None:
    """The same rule in limbs with branches: no actuator of one branch does work in the wrenches of another one."""
    tables = arm_with_driven_branches()
    model = robot(**tables)
    assert [each.members for each in model.actuators] == [("1.1", "1.2", "1.3"), ("1.2",), ("1.3",)]
    assert model.generic == GenericRanks(6, 3)
    assert_equal(compare(tables, driven=1))


def four_bar(builder: Builder) -> str:
    """A driven four-bar from the base; return its coupler."""
    coupler, z = builder.link(), np.array([0.0, 0.0, 1.0])
    for side, driven in ((-0.5, True), (0.5, False)):
        places = np.array([side, 0, 0]), np.array([1.4 * side, 0.6, 0])
        builder.chain("base", coupler, [("R", places[0], [z], driven), ("R", places[1], [z], False)])
    return coupler


def strut(builder: Builder, start: str, foot: Array, way: Array) -> None:
    """A driven strut to the platform."""
    steps = [("U", foot, [np.eye(3)[0], np.eye(3)[1]], False), ("P", foot, [way], True), ("S", foot + way, [], False)]
    builder.chain(start, "platform", steps)


def test_short_rods_of_nested_loops_lose_no_digits() -> None:
    """A platform on a coupler by one strut and five rods, of which two are short: it had one freedom, not two."""
    builder = Builder(np.random.default_rng(1))
    coupler = four_bar(builder)
    for k in range(6):
        foot, way = 0.4 * builder.rng.normal(size=3) + [0, 0.6, 0.3], builder.rng.normal(size=3)
        way *= (1e-3 if k in (1, 2) else 0.5) / np.linalg.norm(way)
        if k:
            builder.chain(coupler, "platform", [("S", foot, [], False), ("S", foot + way, [], False)])
        else:
            strut(builder, coupler, foot, 0.5 * way / np.linalg.norm(way))
    links = [*builder.links, "platform"]
    tables = {"name": "rods", "home": [0.1, 0.2, 0.3], "links": links, "joint": builder.joints}
    assert_equal(compare(tables, driven=1, regular=1e-8))


@pytest.mark.parametrize(("kind", "near"), [("R", 1e-4), ("S", 1e-3)])
def test_dependent_screws_that_nearly_lose_a_rank_keep_their_complement(kind: str, near: float) -> None:
    """A four-bar carries a ball joint and, behind it, a hinge that nearly goes through the ball, or a ball joint."""
    builder = Builder(np.random.default_rng(4))
    coupler, at = four_bar(builder), np.array([0.2, 0.7, 0.4])
    axes = [unit(builder.rng)] if kind == "R" else []
    builder.chain(coupler, "platform", [("S", at, [], False), (kind, at + near * unit(builder.rng), axes, False)])
    for _ in range(4 if kind == "R" else 5):
        strut(builder, "base", 0.6 * builder.rng.normal(size=3), 0.3 * unit(builder.rng) + [0, 0, 0.5])
    tables = {"name": "near", "home": [0.1, 0.2, 0.3], "links": [*builder.links, "platform"], "joint": builder.joints}
    assert_equal(compare(tables, driven=1, regular=1e-8))


#: Name, links and place of hinges of planar robots. Of each some are in line at home.
Hinges = dict[str, tuple[tuple[str, str], tuple[float, float]]]

#: A leg, and beside its foot a crank and its rod in line.
LEG: Hinges = {
    "hip": (("base", "thigh"), (0, 1)),
    "knee": (("thigh", "shin"), (0.3, 0.7)),
    "ankle": (("shin", "heel"), (-0.2, 0.4)),
    "foot": (("heel", "platform"), (0, 0)),
    "low": (("heel", "crank"), (0, -0.5)),
    "middle": (("crank", "rod"), (0.15, -0.2)),
    "high": (("rod", "platform"), (0.3, 0.1)),
}
#: The same with a foot of four motors: more joints than its crank and rod have.
TOES: Hinges = {
    **LEG,
    "foot": (("heel", "toe1"), (0, 0)),
    "toe1": (("toe1", "toe2"), (0.1, -0.3)),
    "toe2": (("toe2", "toe3"), (0.2, 0.1)),
    "toe3": (("toe3", "platform"), (0.4, -0.1)),
}
#: A limb beside other joints.
BESIDE: Hinges = {"x": (("base", "bar"), (-1, 0.2)), "z": (("bar", "platform"), (-0.6, 0.9))}
#: A closed loop of three links in whose last one a dead centre, or a flat four-bar, is.
INSIDE: Hinges = {
    "a": (("base", "one"), (0, 0)),
    "b": (("one", "platform"), (0.2, 0.8)),
    "c": (("base", "two"), (1, 0.1)),
    "foot": (("two", "three"), (1.1, 0.5)),
    "low": (("two", "crank"), (1.2, 0.6)),
    "middle": (("crank", "rod"), (1.5, 0.8)),
    "high": (("rod", "three"), (1.8, 1.0)),
    "d": (("three", "one"), (0.5, 0.7)),
    **BESIDE,
}
FLAT: Hinges = {**INSIDE, "middle": (("crank", "rod"), (1.5, 0.9)), "high": (("rod", "three"), (1.35, 0.75))}
#: A driven four-bar whose rocker and coupler are in line, and a flat parallelogram: the platform gains a motion.
IN_LINE: Hinges = {
    "m": (("base", "crank"), (0, 0)),
    "n": (("crank", "coupler"), (0.2, 0.5)),
    "o": (("coupler", "rocker"), (0.5, 0.2)),
    "p": (("rocker", "base"), (0.8, -0.1)),
    "q": (("coupler", "platform"), (0.4, 0.9)),
    **BESIDE,
}
PARALLELOGRAM: Hinges = {
    **IN_LINE,
    "n": (("crank", "coupler"), (0.3, 0.1)),
    "o": (("coupler", "rocker"), (0.9, 0.3)),
    "p": (("rocker", "base"), (0.6, 0.2)),
}


def planar_robot(hinges: Hinges, motors: Sequence[str], home: Sequence[float] = (0.1, 0.9, 0)) -> dict[str, Any]:
    """A planar robot in a plane that is at an angle to all axes, so that its singularities are those of rounding."""
    R = turn_about([1, 2, -1], 1.1)
    joints = [
        joint_table(name, "R", between, (R @ [*at, 0.0]).tolist(), axis=R[:, 2].tolist(), actuated=name in motors)
        for name, (between, at) in hinges.items()
    ]
    links = dict.fromkeys([*(link for between, _ in hinges.values() for link in between), "platform"])
    return {"name": "planar", "home": (R @ home).tolist(), "links": list(links), "joint": joints}


def reordered(tables: dict[str, Any], count: int, seed: int = 0) -> list[dict[str, Any]]:
    """A robot with its joints in the order given, in the opposite one, and in random ones, so many in all."""
    rng, joints = np.random.default_rng(seed), tables["joint"]
    orders = [range(len(joints)), range(len(joints))[::-1], *(rng.permutation(len(joints)) for _ in range(count))]
    return [{**tables, "joint": [joints[k] for k in order]} for order in orders[:count]]


@pytest.mark.parametrize(
    ("tables", "count"),
    [
        # A crank and its rod in line hold a foot's motor at home: the hip's rate was not determined. With the foot
        # behind them F was wrong, and a degree of freedom was missing.
        (planar_robot(LEG, ("hip", "foot"), (0.1, -0.2, 0)), 5),
        (planar_robot(TOES, ("hip", "foot", "toe1", "toe2", "toe3"), (0.1, -0.2, 0)), 3),
        (planar_robot({**LEG, **BESIDE}, ("hip", "foot"), (0.1, -0.2, 0)), 3),
        (planar_robot(INSIDE, ("d", "x")), 5),
        (planar_robot(FLAT, ("c", "x")), 5),
        (geared(), 3),
        (random_mechanism(12), 3),
        (random_mechanism(0), 2),  # one member has no passive joint: its centre was that of the joint written last
    ],
    ids=["leg", "toes", "leg beside", "inside", "flat", "geared", "random", "no passive joint"],
)
def test_numbers_of_the_model_do_not_depend_on_the_order_of_joints(tables: dict[str, Any], count: int) -> None:
    """At home, which is a dead centre of the first five, and away from it: all of them are the engine's."""
    for each in reordered(tables, count):
        assert_equal(compare(each, driven=1))


@pytest.mark.parametrize(
    ("hinges", "motors"), [(IN_LINE, "mx"), (PARALLELOGRAM, "mx")], ids=["in line", "flat parallelogram"]
)
def test_where_loops_lose_their_rank_numbers_are_those_of_the_point(hinges: Hinges, motors: str) -> None:
    """Locked actuators allow the platform more than near by, where F is another one: the point is passive singular."""
    for tables in reordered(planar_robot(hinges, motors), 5):
        home = mechanism_of(tables)
        nlp, x = program_at(robot(**tables), home, home)
        state, engine, numbers = evaluate(nlp, x), Engine(home), wrenches_of(home, LENGTH)
        centres = {each.joints or each.actuators: each.centre for each in numbers.members}
        assert pytest.approx(objective(home, centres, CHI), rel=1e-10) == state.F
        free, locked = (engine.platform_twists(locked=each) for each in (False, True))
        mobility = mobility_of(nlp, x, state)
        assert (mobility.freedoms, 6 - state.rank) == (free.shape[1], locked.shape[1])
        assert SingularityKind.PASSIVE in {each.kind for each in mobility.singularities}
        chi = free @ (free.T @ CHI)
        nlp = with_twist(nlp, chi)
        rates = mobility_of(nlp, x, evaluate(nlp, x)).actuator_rates.values()
        np.testing.assert_allclose(sorted(rates), sorted(engine.rates(chi)), rtol=1e-9, atol=1e-9)


def test_links_that_hang_on_one_joint_leave_a_network_as_it_is() -> None:
    """A member with such a link was left out of F, and of all that follows."""
    tables = random_mechanism(24)
    assert any(sum(link in each["between"] for each in tables["joint"]) == 1 for link in tables["links"])
    assert_equal(compare(tables, driven=1))


def test_two_loops_that_leave_one_link_and_come_back_to_it_are_read() -> None:
    links = ["base", "a", "b", "c", "platform"]
    loop = (("a", "b"), ("b", "c"), ("c", "a"))
    joints = [
        joint_table("m", "R", ("base", "a"), (0, 0, 0), axis="z", actuated=True),
        *(joint_table(f"l{k}", "R", ends, (k, 1, 0), axis="z") for k, ends in enumerate(loop)),
        joint_table("p", "R", ("b", "platform"), (1, 2, 0), axis="z"),
        joint_table("q", "P", ("base", "platform"), (2, 0, 0), axis="x", actuated=True),
    ]
    assert robot("loop", home=(1, 2, 0), links=links, joint=joints).generic is not None


def test_each_joint_has_variables_of_its_own_also_where_it_is_soon_forgotten() -> None:
    """Ball joints in nested loops shared their angles where one had the address of another one before it."""
    module = import_module("screwsynth.models.joints.model.robot")
    variable = module._Builder(frame=None)._variables("1", {})
    axis = JointAxis(AxisKind.ROTATION, SX([0, 0, 1]), SX.zeros(3), False, SX(0), SX.zeros(3))
    symbols = [variable(ChainJoint("", "R", SX.zeros(3), (axis,), actuated=False), 0) for _ in range(20)]
    assert len({each.element_hash() for each in symbols}) == 20
