"""Random mechanisms with nested, serial and coupled loops against the constrained Jacobian of MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from casadi import SX
from engine_comparison import Differences, compare
from random_mechanisms import Array, Builder, random_mechanism, unit

from screwsynth.models import GenericRanks, RobotError, robot
from screwsynth.models.joints.chain import Joint
from screwsynth.models.joints.motion import AxisKind, JointAxis

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


def table(name: str, kind: str, between: tuple[str, str], at: Sequence[float], **more: Any) -> dict[str, Any]:  # noqa: ANN401
    return {"name": name, "type": kind, "between": list(between), "at": list(at), **more}


def arm_with_driven_branches() -> dict[str, Any]:
    """A driven arm that carries a rod and two driven struts to a platform with a ball joint on the base."""
    joints = [table("arm", "R", ("base", "arm"), (0.3, 0, 0), axis=[0.1, 1, 0.2], actuated=True)]
    for k, (x, y) in enumerate(((0.5, 0.1), (-0.3, 0.6), (-0.4, -0.5))):
        high = (0.2 + 0.3 * y, 0.1 - 0.4 * x, 1.1)
        joints.append(table(f"low{k}", "U", ("arm", f"tube{k}"), (x, y, 0.2), axes=[[1, 0, 0], [0, 1, 0]]))
        if k:
            ends = (f"tube{k}", f"rod{k}")
            joints.append(
                table(f"strut{k}", "P", ends, (x, y, 0.2), axis=[high[0] - x, high[1] - y, 0.9], actuated=True)
            )
        joints.append(table(f"high{k}", "S", (f"rod{k}" if k else "tube0", "platform"), high))
    joints.append(table("post", "S", ("base", "platform"), (0.1, 0.1, 0.8)))
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


def test_loops_at_a_dead_centre_determine_the_rates_that_they_hold() -> None:
    """A crank and its rod in line hold a foot's motor at home, and with it the hip's: both were not determined."""
    links = ["base", "thigh", "shin", "heel", "crank", "rod", "platform"]
    ends = {
        "hip": ("base", "thigh"),
        "knee": ("thigh", "shin"),
        "ankle": ("shin", "heel"),
        "foot": ("heel", "platform"),
        "low": ("heel", "crank"),
        "middle": ("crank", "rod"),
        "high": ("rod", "platform"),
    }
    places = [(0, 1, 0), (0.3, 0.7, 0), (-0.2, 0.4, 0), (0, 0, 0), (0, -0.5, 0), (0.15, -0.2, 0), (0.3, 0.1, 0)]
    joints = [
        table(name, "R", between, at, axis="z", actuated=name in ("hip", "foot"))
        for (name, between), at in zip(ends.items(), places, strict=True)
    ]
    tables = {"name": "dead centre", "home": [0.1, -0.2, 0], "links": links, "joint": joints}
    assert_equal(compare(tables, driven=2))


def test_links_that_hang_on_one_joint_leave_a_network_as_it_is() -> None:
    """A member with such a link was left out of F, and of all that follows."""
    tables = random_mechanism(24)
    assert any(sum(link in each["between"] for each in tables["joint"]) == 1 for link in tables["links"])
    assert_equal(compare(tables, driven=1))


def test_two_loops_that_leave_one_link_and_come_back_to_it_are_read() -> None:
    links = ["base", "a", "b", "c", "platform"]
    joints = [
        table("m", "R", ("base", "a"), (0, 0, 0), axis="z", actuated=True),
        *(
            table(f"l{k}", "R", ends, (k, 1, 0), axis="z")
            for k, ends in enumerate((("a", "b"), ("b", "c"), ("c", "a")))
        ),
        table("p", "R", ("b", "platform"), (1, 2, 0), axis="z"),
        table("q", "P", ("base", "platform"), (2, 0, 0), axis="x", actuated=True),
    ]
    assert robot("loop", home=(1, 2, 0), links=links, joint=joints).generic is not None


def test_each_joint_has_variables_of_its_own_also_where_it_is_soon_forgotten() -> None:
    """Ball joints in nested loops shared their angles where one had the address of another one before it."""
    module = import_module("screwsynth.models.joints.robot")
    variable = module._Builder(frame=None)._variables("1", {})
    axis = JointAxis(AxisKind.ROTATION, SX([0, 0, 1]), SX.zeros(3), False, SX(0), SX.zeros(3))
    symbols = [variable(Joint("", "R", SX.zeros(3), (axis,), actuated=False), 0) for _ in range(20)]
    assert len({each.element_hash() for each in symbols}) == 20
