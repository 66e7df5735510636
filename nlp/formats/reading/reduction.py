"""Reduction of a description to the mechanism between base and platform: rigid bodies merged, side chains removed."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from ....models.mechanism import Coupling, Mechanism, MechanismJoint, MechanismLink
from ....models.mechanism.topology import between, incident
from ...errors import InputError, listing, nearest
from ..frames import Frame
from .closing import Gap, gap_of, gap_of_coupling
from .description import LARGEST, Description
from .elements import bodies_of, elements_of, rigid_groups

#: Largest number of names in a message.
_MOST_NAMES = 12
#: Relative rounding error of a distance.
_UP = 1e-12


@dataclass(frozen=True)
class Ends:
    """Names of base, platform and actuated joints, as given by the user.

    Attributes:
        platform: name of the platform: a body, or a frame on a body, whose origin becomes that of the platform frame.
        base: name of the base body; empty for the fixed root.
        actuated: names of the actuated joints; empty for the joints with an actuator in the description.
    """

    platform: str
    base: str = ""
    actuated: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Reduced:
    """Mechanism between base and platform.

    Attributes:
        mechanism: mechanism of rigid links and joints, at the stated configuration.
        size: largest distance between two joints of the mechanism, length.
        gaps: gap of each loop in the description.
        notes: notes about omitted elements.
    """

    mechanism: Mechanism
    size: float
    gaps: tuple[Gap, ...]
    notes: tuple[str, ...]

    @property
    def worst(self) -> Gap:
        """Largest gap of all loops; 0 without loops."""
        return max(self.gaps, key=lambda gap: gap.share(self.size), default=Gap("", 0.0, 0.0))


def size_of(given: Description) -> float:
    """Return the largest distance between joints of a description; 1 if all coincide."""
    points = [each.point for each in given.joints]
    points += [(given.place_of(each.first) @ each.first_frame).position for each in given.closures]
    return _extent(points)


def _extent(points: Sequence[np.ndarray]) -> float:
    """Return the largest distance between points; 1 if all coincide."""
    if len(points) < 2:
        return 1.0
    cloud = np.array(points)
    # The distance of two points is at most the sum of their distances from the middle, so that few pairs are compared.
    away = np.linalg.norm(cloud - (cloud.min(axis=0) + cloud.max(axis=0)) / 2, axis=1)
    order = np.argsort(-away, kind="stable")
    cloud, away, largest = cloud[order], away[order] * (1 + _UP), 0.0
    for k, each in enumerate(cloud):
        if 2 * away[k] < largest:
            break
        count = int(np.searchsorted(-away, away[k] - largest, side="right"))
        largest = max(largest, float(np.linalg.norm(cloud[:count] - each, axis=1).max(initial=0.0)))
    return largest or 1.0


def reduce(given: Description, ends: Ends) -> Reduced:
    """Return the mechanism that connects base and platform.

    Args:
        given: the description.
        ends: names of base, platform and actuated joints.

    Raises:
        InputError: a name is unknown, the platform is on an open chain or rigidly joined to the base, or the mechanism
            has no actuator.
    """
    check_names(given)
    _check_places(given)
    platform, origin = _platform(given, ends.platform)
    base = ends.base or given.root
    if base not in {body.name for body in given.bodies}:
        every = [body.name for body in given.bodies]
        raise InputError(f"{given.source}: --base {base}: no such body; {nearest(base, every[:_MOST_NAMES])}")
    elements = elements_of(given, size_of(given))
    leader = rigid_groups(elements, bodies_of(given, elements))
    moving = [each for each in elements if leader[each.inner] != leader[each.outer]]
    start, end = leader[base], leader[platform]
    if start == end:
        raise InputError(
            f"{given.source}: --platform {ends.platform}: is rigidly joined to the base {base}; choose a moving body"
        )
    edges = [(leader[each.inner], leader[each.outer]) for each in moving]
    kept = [moving[k] for k in between(edges, start, end)]
    motors = _coupled_motors(given, moving, kept, leader)
    if not motors:
        _refuse_open(given, ends, kept, leader, (start, end))
    kept += motors
    driven, notes = _driven(given, ends, kept)
    names = _link_names(given, kept, leader, {start: base, end: ends.platform})
    couplings, driven, more = _couplings(given, kept, driven)
    joints = _oriented(kept, leader, start, driven, names)
    places = {key: origin if key == end else given.place_of(key) for key in names}
    mechanism = Mechanism(
        name=given.name.strip(),
        links=tuple(MechanismLink(name, places[key].position, places[key].rotation) for key, name in names.items()),
        joints=tuple(joints),
        base=base,
        platform=ends.platform,
        couplings=couplings,
    )
    bodies = {body.name: body.place for body in given.bodies}
    joint_names = {each.name for each in kept}
    # Closures of the mechanism are its joints, and closures between bodies of its rigid links.
    gaps = [
        gap_of(each, bodies)
        for each in given.closures
        if joint_names & {each.name, f"{each.name} 1"} or {leader[each.first], leader[each.second]} <= names.keys()
    ]
    gaps += [
        gap_of_coupling(given, each) for each in given.couplings if _is_within(given, each, joint_names, leader, names)
    ]
    return Reduced(mechanism, _extent([each.point for each in kept]), tuple(gaps), (*given.notes, *notes, *more))


def _is_within(
    given: Description, coupling: Coupling, joint_names: set[str], leader: dict[str, str], names: dict[str, str]
) -> bool:
    """Return whether a coupling is between joints of the mechanism, or fixes a joint within one of its rigid links."""
    tied = [name for name, _ in coupling.factors]
    if len(tied) > 1:
        return joint_names.issuperset(tied)
    return all(leader[joint.outer] in names for joint in given.joints if joint.name in tied)


def check_names(given: Description) -> None:
    """Refuse names with characters that cannot be printed.

    Raises:
        InputError: a name is empty or has such a character.
    """
    for kind, names in {
        "body": [each.name for each in given.bodies],
        "joint": [*(each.name for each in given.joints), *(each.name for each in given.closures)],
        "frame": list(given.frames),
        "robot": [given.name],
    }.items():
        for name in names:
            if not name.isprintable() or not name.strip():
                fault = "must have a name of printable characters, and not only spaces"
                raise InputError(f"{given.source}: the {kind} {name!r} {fault}")


def _check_places(given: Description) -> None:
    """Refuse coordinates that are not finite, or too large.

    Raises:
        InputError: there is such a coordinate.
    """
    places = {f"body {each.name}": each.place.position for each in given.bodies}
    places |= {f"joint {each.name}": each.point for each in given.joints}
    for each in given.closures:
        places |= {f"joint {each.name}": np.concatenate([each.first_frame.position, each.second_frame.position])}
    for name, place in places.items():
        if not float(np.abs(place).max()) <= LARGEST:
            raise InputError(f"{given.source}: the {name} must have finite coordinates of at most {LARGEST:g}")


def _platform(given: Description, name: str) -> tuple[str, Frame]:
    """Return the body of the platform, and the platform frame in the world."""
    bodies = [body.name for body in given.bodies]
    if name in bodies:
        return name, given.place_of(name)
    if name in given.frames:
        body, frame = given.frames[name]
        return body, given.place_of(body) @ frame
    hint = nearest(name, [*bodies, *given.frames][: _MOST_NAMES * 2])
    raise InputError(f"{given.source}: --platform {name}: no such body or frame; {hint}")


def _refuse_open(
    given: Description, ends: Ends, kept: list[MechanismJoint], leader: dict[str, str], nodes: tuple[str, str]
) -> None:
    """Refuse a platform that is not connected to the base, or only by a single open chain."""
    where = f"{given.source}: --platform {ends.platform}:"
    base = ends.base or given.root
    if not kept:
        raise InputError(f"{where} no joints connect it to the base {base}; choose the base with --base")
    links = {leader[name] for each in kept for name in (each.inner, each.outer)} | set(nodes)
    if len(kept) < len(links):
        fault = "is at the end of an open chain"
        raise InputError(
            f"{where} {fault} of {len(kept)} joints from the base {base}; a parallel robot has two or more chains"
        )


def _coupled_motors(
    given: Description, moving: list[MechanismJoint], kept: list[MechanismJoint], leader: dict[str, str]
) -> list[MechanismJoint]:
    """Return joints outside of the mechanism that couplings tie to several joints of it, such as differential motors.

    Such a coupling closes a loop. A joint counts if one of its links belongs to the mechanism. A coupling counts if all
    its other joints count.

    Args:
        given: the description.
        moving: all joints that move.
        kept: joints between base and platform.
        leader: body that stands for each rigid group.
    """
    own = {each.name for each in kept}
    links = {leader[name] for each in kept for name in (each.inner, each.outer)}
    beside = {
        each.name: each
        for each in moving
        if each.name not in own and each.kind != "S" and {leader[each.inner], leader[each.outer]} & links
    }
    found: dict[str, MechanismJoint] = {}
    for coupling in given.couplings:
        names = {name for name, _ in coupling.factors}
        others = names - own
        if len(names & own) > 1 and others and others <= beside.keys():
            found |= {name: beside[name] for name, _ in coupling.factors if name in others}
    return list(found.values())


def _driven(given: Description, ends: Ends, kept: list[MechanismJoint]) -> tuple[set[str], list[str]]:
    """Return the actuated joints of the mechanism, and notes about other actuators."""
    inside = {each.name: None for each in kept}
    if ends.actuated:
        for name in ends.actuated:
            if name not in inside:
                hint = nearest(name, list(inside)[:_MOST_NAMES])
                fault = "no such joint between base and platform"
                raise InputError(f"{given.source}: --actuated {name}: {fault}; {hint}")
    wanted = set(ends.actuated) or set(given.driven)
    for each in kept:
        if each.name in wanted and each.kind == "S":
            raise InputError(
                f"{given.source}: the ball joint {each.name} must not have an actuator; only hinges and slides may"
            )
    leading = _leading(given, inside.keys())
    outside = sorted(wanted - inside.keys() - leading)
    notes = [f"actuators outside of the mechanism were omitted: {listing(outside[:_MOST_NAMES])}"] if outside else []
    driven = wanted & inside.keys()
    if not driven and not wanted & leading:
        able = [each.name for each in kept if each.kind in ("R", "P")]
        fault = "no joint between base and platform has an actuator; name actuated joints with --actuated; allowed:"
        raise InputError(f"{given.source}: {fault} {listing(able[:_MOST_NAMES])}")
    return driven, notes


def _leading(given: Description, inside: Set[str]) -> set[str]:
    """Return the joints outside of the mechanism that are coupled to joints of the mechanism."""
    found: set[str] = set()
    for each in given.couplings:
        names = {name for name, _ in each.factors}
        if names & inside:
            found |= names - inside
    return found


def _couplings(
    given: Description, kept: list[MechanismJoint], driven: set[str]
) -> tuple[tuple[Coupling, ...], set[str], list[str]]:
    """Return the couplings within the mechanism, its actuated joints, and notes.

    A joint of the mechanism that is coupled to an actuated joint outside of it counts as actuated.
    """
    joint_names = {each.name for each in kept}
    inside: list[Coupling] = []
    driven = set(driven)
    notes: list[str] = []
    for each in given.couplings:
        names = [name for name, _ in each.factors]
        if len(names) < 2 or not joint_names & set(names):
            continue
        if set(names) <= joint_names:
            inside.append(each)
            continue
        within, without = sorted(joint_names & set(names)), sorted(set(names) - joint_names)
        if set(without) & given.driven:
            driven |= set(within)
            notes.append(
                f"{listing(within)} is driven by {listing(without)}; its rate in results is that of the joint itself"
            )
        else:
            notes.append(f"the coupling of {listing(within)} with {listing(without)} was omitted")
    return tuple(inside), driven, notes


def _link_names(
    given: Description, kept: list[MechanismJoint], leader: dict[str, str], given_names: dict[str, str]
) -> dict[str, str]:
    """Return the name of each rigid link by its representative body, in the order of the bodies."""
    order = {name: k for k, name in enumerate(bodies_of(given, kept))}
    keys = {leader[name] for each in kept for name in (each.inner, each.outer)} | set(given_names)
    return {key: given_names.get(key, key) for key in sorted(keys, key=lambda key: order.get(key, len(order)))}


def _oriented(
    kept: list[MechanismJoint], leader: dict[str, str], start: str, driven: set[str], names: dict[str, str]
) -> list[MechanismJoint]:
    """Return the joints with the link nearer to the base as inner link.

    If the links are exchanged, the axis is reversed, so that the joint coordinate stays the same.
    """
    depth = {start: 0}
    waiting, neighbours = [start], incident([(leader[each.inner], leader[each.outer]) for each in kept])
    for node in waiting:  # the list grows in the loop
        for _, other in neighbours[node]:
            if other not in depth:
                depth[other] = depth[node] + 1
                waiting.append(other)
    joints = []
    for each in kept:
        first, second = leader[each.inner], leader[each.outer]
        turned = depth[second] < depth[first]
        inner, outer = (second, first) if turned else (first, second)
        axis = -each.axis + 0.0 if turned else each.axis
        actuated = each.name in driven
        joints.append(replace(each, inner=names[inner], outer=names[outer], axis=axis, actuated=actuated))
    return joints
