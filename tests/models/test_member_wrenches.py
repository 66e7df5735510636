"""Wrenches and centre of a member against the forces and couples that mechanics gives for each type of limb."""

import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from mujoco_robots import Oracle
from numpy.typing import NDArray
from robot_files import Joint, every_joint, robot_of

import screwsynth.models

Array = NDArray[np.float64]
GALLERY = Path(screwsynth.models.__file__).parent / "robots"
LENGTH = 0.7
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
    hinge = second - ball
    return lambda j: Expected(j[ball].point, [along(j, 0, second), j[hinge].axes[0]])


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
    ("6-ups", 0): lambda j: Expected(j[2].point, [along(j, 0, 2)]),
    ("6-sps", 0): lambda j: Expected(j[2].point, [along(j, 0, 2)]),
    ("6-pus", 0): rod(1),
    ("6-rus", 0): rod(1),
    ("6-rss", 0): rod(1),
    ("delta", 0): rod(1),
    ("3-rps", 0): slide(2, 2),
    ("3-spr", 0): slide(2, 0),
    ("exechon", 2): slide(2, 0),
    ("3-prs", 0): crank(1),
    ("3-rrs", 0): crank(1),
    ("3-upu", 0): parallel_universals(0),
    ("4-upu", 0): parallel_universals(0),
    ("3-puu", 0): parallel_universals(1),
    ("4-ruu", 0): parallel_universals(1),
    ("exechon", 0): lambda j: Expected(j[0].point, [along(j, 0, 2), j[2].axes[0]], [np.cross(*j[0].axes)]),
    ("tricept", 0): lambda j: Expected(j[2].point, [along(j, 0, 2)]),
    ("tricept", 3): lambda j: Expected(j[0].point, [X, Y], [np.cross(*j[0].axes)]),
    ("delta-parallelogram", 0): parallelogram,
    ("orthoglide", 0): parallelogram,
    ("tripteron", 0): lambda j: Expected(j[3].point, [X], [Y, Z]),
    ("planar-3-rrr", 0): planar(1),
    ("planar-3-prr", 0): planar(1),
    ("planar-3-rpr", 0): planar(0),
    ("five-bar", 0): lambda j: Expected(j[1].point, [X, Y, Z], [X, Y]),
    ("five-bar", 1): planar(1),
    ("spherical-3-rrr", 0): lambda j: Expected(0 * j[0].point, [X, Y, Z], [X]),
}


@pytest.mark.parametrize(("name", "limb"), LIMBS)
def test_wrenches_of_a_member_are_those_of_its_mechanics(name: str, limb: int) -> None:
    robot = robot_of(tomllib.loads((GALLERY / f"{name}.toml").read_text(encoding="utf-8")))
    expected = LIMBS[name, limb](every_joint(robot.limbs[limb]))
    rows = [np.concatenate([f / np.linalg.norm(f), np.zeros(3)]) for f in expected.forces]
    rows += [np.concatenate([np.zeros(3), m / np.linalg.norm(m)]) for m in expected.couples]
    member = Oracle(robot, LENGTH).members()[limb]
    np.testing.assert_allclose(member.centre, expected.centre, rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.array(rows) @ np.array(rows).T, np.eye(len(rows)), rtol=0, atol=1e-14)
    # Orthonormal rows with the same projector span the same wrenches.
    np.testing.assert_allclose(np.array(rows).T @ np.array(rows), member.projector, rtol=0, atol=1e-14)


def test_every_robot_of_the_gallery_has_a_limb_here() -> None:
    assert {name for name, _ in LIMBS} == {path.stem for path in GALLERY.glob("*.toml")}
