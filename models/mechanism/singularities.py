"""Generic ranks of a mechanism, and the singularities that show where its ranks at a configuration differ from them."""

from __future__ import annotations

import enum
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .closing import closed_nearby
from .graph import Mechanism, MechanismError
from .motions import Motions
from .wrenches import RobotRanks, wrenches_of

#: Number of random closed configurations; the largest ranks among them are generic.
_POINTS = 4
#: Largest random change of each coordinate, radians and parts of the size, and number of trials with each. A large one
#: leaves the neighbourhood of a singular configuration; a small one finds closed loops where large ones do not close.
_CHANGES = (0.4, 0.15, 0.05)
_TRIALS = 4


class SingularityType(enum.Enum):
    """Type of a singularity; each value is a clause for people."""

    PASSIVE = "its passive joints allow other motions than elsewhere: F jumps here"
    SERIAL = "its joints are dependent: an actuator cannot drive the platform, which loses a freedom"
    CONSTRAINT = "the constraints are dependent: the platform gains a freedom even with free actuators"
    ACTUATION = "the platform can move with every actuator locked"
    ARCHITECTURE = "the rank is below six at all configurations: the platform can always move"


class MechanismSingularity(NamedTuple):
    """A singularity: its type, and the number of the member that it belongs to, from 0; None for the whole robot."""

    type: SingularityType
    member: int | None = None


def closed_configurations(mechanism: Mechanism, count: int = _POINTS, seed: int = 0) -> Iterator[Mechanism]:
    """Yield random closed configurations of a mechanism, at most so many.

    Args:
        mechanism: at any configuration.
        count: of configurations.
        seed: of the random numbers.
    """
    motions = Motions(mechanism)
    stated = motions.stated
    rng = np.random.default_rng(seed)
    found = 0
    for change in _CHANGES:
        for _ in range(_TRIALS):
            if found == count:
                return
            step = change * rng.uniform(-1.0, 1.0, motions.count)
            other = closed_nearby(motions, motions.stepped(stated, step, motions.placed(stated)))
            if other is not None:
                found += 1
                yield other.mechanism


def generic_ranks(mechanism: Mechanism, seed: int = 0) -> RobotRanks:
    """Return the ranks of a mechanism at almost all closed configurations.

    The rank of a member is the most frequent one at random configurations: nested loops may allow more motions at a
    special one, and limbs fewer. The ranks of the robot are the largest where members have theirs.

    Args:
        mechanism: at any configuration, which counts as well.
        seed: of the random configurations.

    Raises:
        MechanismError: the mechanism contradicts itself, or its loops close nowhere.
    """
    ranks = [wrenches_of(each).ranks for each in closed_configurations(mechanism, seed=seed)]
    if not ranks:
        raise MechanismError(
            "", "has loops that could not be closed at any configuration near this one: is it movable?"
        )
    passive = _most_frequent([each.passive for each in ranks])
    every = _most_frequent([each.all for each in ranks])
    # A limb with dependent joints has more wrenches than elsewhere, and would raise the ranks.
    regular = [each for each in ranks if each.passive == passive and each.all == every] or ranks
    jacobian, constraints = (
        max(number) for number in zip(*((r.jacobian, r.constraints) for r in regular), strict=True)
    )
    return RobotRanks(passive, every, jacobian, constraints)


def _most_frequent(ranks: list[tuple[int, ...]]) -> tuple[int, ...]:
    """Return the most frequent rank of each member, the larger one of two that are equally so."""
    return tuple(max(set(own), key=lambda rank: (own.count(rank), rank)) for own in zip(*ranks, strict=True))


def singularities_of(ranks: RobotRanks, generic: RobotRanks) -> tuple[MechanismSingularity, ...]:
    """Return the singularities at a configuration.

    Args:
        ranks: there.
        generic: at almost all configurations.
    """
    found: list[MechanismSingularity] = []
    for k, passive in enumerate(ranks.passive):
        if passive != generic.passive[k]:
            found.append(MechanismSingularity(SingularityType.PASSIVE, k))
        elif ranks.all[k] != generic.all[k]:
            found.append(MechanismSingularity(SingularityType.SERIAL, k))
    if not found and ranks.constraints < generic.constraints:
        found.append(MechanismSingularity(SingularityType.CONSTRAINT))
    elif not found and ranks.jacobian < generic.jacobian:
        found.append(MechanismSingularity(SingularityType.ACTUATION))
    if generic.jacobian < 6:
        found.append(MechanismSingularity(SingularityType.ARCHITECTURE))
    return tuple(found)
