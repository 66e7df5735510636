"""Chains at a configuration as the links and joints of a mechanism."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from ....models import FloatArray
from ....models.mechanism import MechanismJoint, MechanismLink
from .chains import STILL, Chain, Chains, Moved, Step
from .linkframes import link_rotation
from .placing import Values, displacements

#: Names of the two links that every robot has.
BASE, PLATFORM = "base", "platform"
#: Names of the two rods of a parallelogram.
_RODS = ("_a", "_b")


class Assembled(NamedTuple):
    """Links and joints of a robot.

    Attributes:
        links: with their frames.
        joints: each with the step of its chain.
    """

    links: tuple[MechanismLink, ...]
    joints: tuple[tuple[MechanismJoint, Step], ...]


def assembled(chains: Chains, values: Values, moved: Moved, size: float) -> Assembled:
    """Return the links and joints of chains at a configuration.

    Args:
        chains: the chains.
        values: coordinates of their joints.
        moved: displacement of the platform from the stated pose.
        size: length of the order of the robot's own.
    """
    joints: dict[str, tuple[MechanismJoint, Step]] = {}
    places: dict[str, tuple[FloatArray, FloatArray]] = {}
    for chain in chains.chains:
        bodies = displacements(chain, values)
        for k, step in enumerate(chain.steps):
            before = bodies[k - 1] if k else STILL
            # The short sides of a parallelogram do not turn with its rods.
            carrier = bodies[k] if step.follows else before
            for name, inner, outer, side in _joints_of(chain, k):
                at = step.point if side is None else step.point + side
                if name not in joints:
                    is_driven = step.actuated and (side is None or name.endswith(_RODS[0]))
                    point, axis = carrier.point(at), before.R @ step.axis
                    joint = MechanismJoint(name, step.kind, inner, outer, point, axis, step.pitch, is_driven)
                    joints[name] = joint, step
                if outer not in (PLATFORM, *places):
                    origin = bodies[k].point(at) if side is None else carrier.point(at)
                    places[outer] = origin, bodies[k].R @ step.axis
    found = [joint for joint, _ in joints.values()]
    links = [MechanismLink(BASE)]
    links += [MechanismLink(name, place[0], _frame(name, *place, found, size)) for name, place in places.items()]
    links.append(MechanismLink(PLATFORM, moved.point(chains.origin), moved.R @ chains.rotation))
    return Assembled(tuple(links), tuple(joints.values()))


def _joints_of(chain: Chain, k: int) -> list[tuple[str, str, str, FloatArray | None]]:
    """Return the joints of a step: name, inner and outer link, and distance from the step's point, if any."""
    step = chain.steps[k]
    inner = BASE if k == 0 else _link_behind(chain, k - 1)
    outer = _link_behind(chain, k)
    if step.side is None:
        return [(step.name, inner, outer, None)]
    found: list[tuple[str, str, str, FloatArray | None]] = []
    for rod, sign in zip(_RODS, (1.0, -1.0), strict=True):
        ends = (f"{inner}{rod}", outer) if step.follows else (inner, f"{outer}{rod}")
        found.append((f"{step.name}{rod}", *ends, sign * step.side))
    return found


def _link_behind(chain: Chain, k: int) -> str:
    """Return the name of the link behind a step of a chain."""
    last = k == len(chain.steps) - 1
    return PLATFORM if last else chain.steps[k].name.replace("joint_", "link_", 1)


def _frame(
    name: str, origin: FloatArray, axis: FloatArray, joints: Iterable[MechanismJoint], size: float
) -> FloatArray:
    """Return the axes of a link's frame."""
    others = [joint for joint in joints if joint.inner == name]
    return link_rotation([origin, *(joint.point for joint in others)], [axis, *(each.axis for each in others)], size)
