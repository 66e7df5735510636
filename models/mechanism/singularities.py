"""Generic ranks of a mechanism, and singularities: configurations with other ranks."""

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
#: Largest random change of each coordinate (radians, and relative to the size), and number of trials with each. A large
#: change leaves the neighbourhood of a singular configuration; a small one closes loops that a large one cannot.
_CHANGES = (0.4, 0.15, 0.05)
_TRIALS = 4


class SingularityType(enum.Enum):
    """Type of a singularity; each value is a clause for people."""

    PASSIVE = "its passive joints allow other motions than elsewhere: F jumps here"
    SERIAL = "its joints are dependent: an actuator cannot drive the platform, which loses a degree of freedom"
    CONSTRAINT = "the constraints are dependent: the platform gains a degree of freedom even with unlocked actuators"
    ACTUATION = "the platform can move with every actuator locked"
    ARCHITECTURE = "the rank is below six at all configurations: the platform can always move"


class MechanismSingularity(NamedTuple):
    """Singularity: its type, and the index of the singular member; None for the whole robot."""

    type: SingularityType
    member: int | None = None


def closed_configurations(mechanism: Mechanism, count: int = _POINTS, seed: int = 0) -> Iterator[Mechanism]:
    """Yield random closed configurations of a mechanism, at most ``count``.

    Args:
        mechanism: mechanism at any configuration.
        count: largest number of configurations.
        seed: seed of the random numbers.
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

    The rank of a member is the most frequent one at random configurations, because special configurations may allow
    more motions of nested loops, or fewer of limbs. The ranks of the robot are the largest where members have their
    generic ranks.

    Args:
        mechanism: mechanism at any configuration, which is included.
        seed: seed of the random configurations.

    Raises:
        MechanismError: the mechanism is inconsistent, or its loops close nowhere.
    """
    ranks = [wrenches_of(each).ranks for each in closed_configurations(mechanism, seed=seed)]
    if not ranks:
        raise MechanismError("", "found no closed configuration near this one: check that the mechanism is mobile")
    passive = _most_frequent([each.passive for each in ranks])
    every = _most_frequent([each.all for each in ranks])
    # A limb with dependent joints has more wrenches than generic, and would raise the ranks.
    regular = [each for each in ranks if each.passive == passive and each.all == every] or ranks
    jacobian, constraints = (
        max(number) for number in zip(*((r.jacobian, r.constraints) for r in regular), strict=True)
    )
    return RobotRanks(passive, every, jacobian, constraints)


def _most_frequent(ranks: list[tuple[int, ...]]) -> tuple[int, ...]:
    """Return the most frequent rank of each member; ties take the larger one."""
    return tuple(max(set(own), key=lambda rank: (own.count(rank), rank)) for own in zip(*ranks, strict=True))


def singularities_of(ranks: RobotRanks, generic: RobotRanks) -> tuple[MechanismSingularity, ...]:
    """Return the singularities at a configuration.

    Args:
        ranks: ranks at the configuration.
        generic: generic ranks: the ranks at almost all configurations.
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
