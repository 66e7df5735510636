"""From a description to the mechanism between base and platform: rigid bodies merged, side chains left out."""

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

#: Most names that a message lists.
_MOST_NAMES = 12
#: Rounding of a distance, as a part of it.
_UP = 1e-12


@dataclass(frozen=True)
class Ends:
    """Base, platform and actuators by name, as the user gives them; empty for what the description says.

    Attributes:
        platform: a body, or a frame on one, whose origin is that of the platform.
        base: a body; empty for the fixed root.
        actuated: joints; empty for those with an actuator in the description.
    """

    platform: str
    base: str = ""
    actuated: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Reduced:
    """The mechanism between base and platform.

    Attributes:
        mechanism: of rigid links and joints, at the stated configuration.
        size: largest distance of two of its joints, length.
        gaps: how far the loops are open that closing joints close.
        notes: sentences about what was left out.
    """

    mechanism: Mechanism
    size: float
    gaps: tuple[Gap, ...]
    notes: tuple[str, ...]

    @property
    def worst(self) -> Gap:
        """The gap of the loop that is open most; one of 0 where there is no loop."""
        return max(self.gaps, key=lambda gap: gap.share(self.size), default=Gap("", 0.0, 0.0))


def size_of(given: Description) -> float:
    """Return the largest distance between joints of a description, 1 where all are in one place."""
    points = [each.point for each in given.joints]
    points += [(given.place_of(each.first) @ each.first_frame).position for each in given.closures]
    return _extent(points)


def _extent(points: Sequence[np.ndarray]) -> float:
    """Return the largest distance between points, 1 where it is zero."""
    if len(points) < 2:
        return 1.0
    cloud = np.array(points)
    # Two points are no farther apart than both from the middle: the farthest ones decide, but for clouds like a sphere.
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
    """Return the mechanism that joins base and platform.

    Args:
        given: the description.
        ends: base, platform and actuators.

    Raises:
        InputError: a name means nothing, the platform is on an open chain or is part of the base, or nothing drives it.
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
        raise InputError(f"{given.source}: --platform {ends.platform}: is rigidly joined to the base {base}")
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
    own = {each.name for each in kept}
    # A closure counts where it is a joint that is kept, or two; where it welds bodies of a link that is kept; and where
    # it is a further ball of a hinge there.
    gaps = [
        gap_of(each, bodies)
        for each in given.closures
        if own & {each.name, f"{each.name} 1"} or {leader[each.first], leader[each.second]} <= names.keys()
    ]
    gaps += [gap_of_coupling(given, each) for each in given.couplings if _holds(given, each, own, leader, names)]
    return Reduced(mechanism, _extent([each.point for each in kept]), tuple(gaps), (*given.notes, *notes, *more))


def _holds(
    given: Description, coupling: Coupling, own: set[str], leader: dict[str, str], names: dict[str, str]
) -> bool:
    """Return whether a coupling ties joints that are kept, or fixes a joint within a link that is kept."""
    tied = [name for name, _ in coupling.factors]
    if len(tied) > 1:
        return own.issuperset(tied)
    return all(leader[joint.outer] in names for joint in given.joints if joint.name in tied)


def check_names(given: Description) -> None:
    """Refuse names with characters that no text shows.

    Raises:
        InputError: there is one.
    """
    for kind, names in {
        "body": [each.name for each in given.bodies],
        "joint": [*(each.name for each in given.joints), *(each.name for each in given.closures)],
        "frame": list(given.frames),
        "robot": [given.name],
    }.items():
        for name in names:
            if not name.isprintable() or not name.strip():
                raise InputError(f"{given.source}: the {kind} {name!r} has a name with characters that cannot be shown")


def _check_places(given: Description) -> None:
    """Refuse places that are no finite numbers, or too large.

    Raises:
        InputError: there is one.
    """
    places = {f"body {each.name}": each.place.position for each in given.bodies}
    places |= {f"joint {each.name}": each.point for each in given.joints}
    for each in given.closures:
        places |= {f"joint {each.name}": np.concatenate([each.first_frame.position, each.second_frame.position])}
    for name, place in places.items():
        if not float(np.abs(place).max()) <= LARGEST:
            raise InputError(f"{given.source}: the {name} has a coordinate above {LARGEST:g}, or one that is no number")


def _platform(given: Description, name: str) -> tuple[str, Frame]:
    """Return the body of the platform, and the place of its frame."""
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
    """Refuse a platform to which no path, or only one, leads from the base."""
    where = f"{given.source}: --platform {ends.platform}:"
    base = ends.base or given.root
    if not kept:
        raise InputError(f"{where} no joints lead to it from the base {base}; choose the base by --base")
    links = {leader[name] for each in kept for name in (each.inner, each.outer)} | set(nodes)
    if len(kept) < len(links):
        fault = "is at the end of an open chain"
        raise InputError(
            f"{where} {fault} of {len(kept)} joints from the base {base}; a parallel robot has two or more"
        )


def _coupled_motors(
    given: Description, moving: list[MechanismJoint], kept: list[MechanismJoint], leader: dict[str, str]
) -> list[MechanismJoint]:
    """Return joints beside the mechanism that couplings tie to several of its joints, such as motors of a differential.

    Such a coupling closes a loop. A joint counts that has a link of the mechanism; a coupling does whose other joints
    all count.

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
    """Return the actuated joints of the mechanism, and notes about actuators elsewhere."""
    own = {each.name: None for each in kept}
    if ends.actuated:
        for name in ends.actuated:
            if name not in own:
                hint = nearest(name, list(own)[:_MOST_NAMES])
                fault = "is no joint between base and platform"
                raise InputError(f"{given.source}: --actuated {name}: {fault}; {hint}")
    wanted = set(ends.actuated) or set(given.driven)
    for each in kept:
        if each.name in wanted and each.kind == "S":
            raise InputError(
                f"{given.source}: the ball joint {each.name} has an actuator; hinges and slides may have one"
            )
    leading = _leading(given, own.keys())
    outside = sorted(wanted - own.keys() - leading)
    notes = [f"actuators outside the mechanism were left out: {listing(outside[:_MOST_NAMES])}"] if outside else []
    driven = wanted & own.keys()
    if not driven and not wanted & leading:
        able = [each.name for each in kept if each.kind in ("R", "P")]
        fault = "no joint between base and platform has an actuator; name them by --actuated, of"
        raise InputError(f"{given.source}: {fault} {listing(able[:_MOST_NAMES])}")
    return driven, notes


def _leading(given: Description, own: Set[str]) -> set[str]:
    """Return the joints outside the mechanism to which couplings tie joints of it."""
    found: set[str] = set()
    for each in given.couplings:
        names = {name for name, _ in each.factors}
        if names & own:
            found |= names - own
    return found


def _couplings(
    given: Description, kept: list[MechanismJoint], driven: set[str]
) -> tuple[tuple[Coupling, ...], set[str], list[str]]:
    """Return the couplings within the mechanism; a joint coupled to a driven one outside it counts as driven."""
    own = {each.name for each in kept}
    inside: list[Coupling] = []
    driven = set(driven)
    notes: list[str] = []
    for each in given.couplings:
        names = [name for name, _ in each.factors]
        if len(names) < 2 or not own & set(names):
            continue
        if set(names) <= own:
            inside.append(each)
            continue
        within, without = sorted(own & set(names)), sorted(set(names) - own)
        if set(without) & given.driven:
            driven |= set(within)
            notes.append(
                f"{listing(within)} is driven through {listing(without)}; its rate is that of the joint itself"
            )
        else:
            notes.append(f"the coupling of {listing(within)} with {listing(without)} was left out")
    return tuple(inside), driven, notes


def _link_names(
    given: Description, kept: list[MechanismJoint], leader: dict[str, str], given_names: dict[str, str]
) -> dict[str, str]:
    """Return the name of each rigid link by its first body, in the order of the bodies."""
    order = {name: k for k, name in enumerate(bodies_of(given, kept))}
    keys = {leader[name] for each in kept for name in (each.inner, each.outer)} | set(given_names)
    return {key: given_names.get(key, key) for key in sorted(keys, key=lambda key: order.get(key, len(order)))}


def _oriented(
    kept: list[MechanismJoint], leader: dict[str, str], start: str, driven: set[str], names: dict[str, str]
) -> list[MechanismJoint]:
    """Return the joints with the link nearer to the base inside.

    The motion of the first body relative to the second about the opposite axis has the same coordinate.
    """
    depth = {start: 0}
    waiting, neighbours = [start], incident([(leader[each.inner], leader[each.outer]) for each in kept])
    for node in waiting:  # which grows
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
