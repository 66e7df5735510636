"""An import in words: links and joints, actuators, loops, and notes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from ....models.arrays import FloatArray
from ....models.mechanism import wrenches_of
from ...errors import listing
from .closing import CLOSED
from .importing import Imported
from .symmetry import SAME, Offers

#: Most names that a line lists.
_MOST_NAMES = 24


def summary_lines(found: Imported) -> Iterator[tuple[str, str]]:
    """Yield label and text of each line about a robot that was imported."""
    mechanism = found.mechanism
    yield "base", mechanism.base
    yield "platform", mechanism.platform
    kinds = Counter(joint.kind for joint in mechanism.joints)
    joints = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))
    yield "links", f"{len(mechanism.links)}, with {len(mechanism.joints)} joints: {joints}"
    driven = [joint.name for joint in mechanism.joints if joint.actuated]
    yield "actuators", f"{len(driven)}: {listing(driven[:_MOST_NAMES])}"
    if mechanism.couplings:
        yield "couplings", f"{len(mechanism.couplings)}: {listing(each.name for each in mechanism.couplings)}"
    wrenches = wrenches_of(mechanism, found.size)
    for number, member in enumerate(wrenches.members, 1):
        own = {*member.joints, *member.actuators}
        path = [joint for joint in mechanism.joints if joint.name in own][:_MOST_NAMES]
        shown = listing(f"{joint.name} {joint.kind}{'*' * joint.actuated}" for joint in path)
        yield f"member {number}", f"dim W {member.wrenches}, dim C {member.constraints}: {shown}"
    ranks = wrenches.ranks
    yield "freedoms", f"{ranks.freedoms} with free actuators, {ranks.locked} with locked ones, as the model stands"
    yield "ranks", f"{ranks.jacobian} of all wrenches, {ranks.constraints} of the constraints"
    yield "size", f"{found.size:.6g}, the largest distance of two joints"
    yield "loops", _loops(found)
    for note in found.notes:
        yield "note", note


def _loops(found: Imported) -> str:
    """Return how far the loops of the description are open."""
    if not found.gaps:
        return "closed by the description's own joints"
    share = found.worst.share(found.size)
    if share <= CLOSED:
        return "closed in the file, to rounding"
    return f"open in the file by up to {found.worst.words} ({share:.2g} of the size)"


def offer_lines(offers: Offers, size: float) -> Iterator[tuple[str, str]]:
    """Yield label and text of each circle and symmetry that was found."""
    for circle in offers.circles:
        where = f"radius {circle.radius:.6g} about {_vector(circle.axis)} through {_vector(circle.centre)}"
        yield circle.name, f"{listing(circle.joints)} lie on a circle of {where}, {_share(circle.deviation, size)}"
    if offers.fold is not None:
        orbits = "; ".join(listing(str(k + 1) for k in orbit) for orbit in offers.fold.orbits)
        where = f"about {_vector(offers.fold.axis)} through {_vector(offers.fold.centre)}"
        words = f"limbs {orbits} are copies by {360 / offers.fold.count:g} deg {where}"
        yield offers.fold.name, f"{words}, {_share(offers.fold.deviation, size)}; one limb of each can stand for them"
    for mirror in offers.mirrors:
        where = f"through {_vector(mirror.point)} with the normal {_vector(mirror.normal)}"
        yield "mirror", f"the robot is its own image in the plane {where}, {_share(mirror.deviation, size)}"
    if not (offers.circles or offers.fold or offers.mirrors):
        yield "offers", f"no circle or symmetry to {SAME:g} of the robot's size"


def _share(deviation: float, size: float) -> str:
    """Return a deviation in words."""
    return f"to {deviation / size:.2g} of the size"


def _vector(vector: FloatArray) -> str:
    """Return three numbers in brackets."""
    return f"({', '.join(f'{value + 0.0:.6g}' for value in vector)})"
