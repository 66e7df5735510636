"""Summary of an import: links, joints, actuators, loops and notes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from ....models.arrays import FloatArray
from ....models.mechanism import wrenches_of
from ...errors import listing
from .closing import CLOSED
from .importing import Imported
from .symmetry import SAME, Offers

#: Largest number of names in a line.
_MOST_NAMES = 24


def summary_lines(found: Imported) -> Iterator[tuple[str, str]]:
    """Yield label and text of each summary line of an imported robot."""
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
        names = {*member.joints, *member.actuators}
        path = [joint for joint in mechanism.joints if joint.name in names][:_MOST_NAMES]
        shown = listing(f"{joint.name} {joint.kind}{'*' * joint.actuated}" for joint in path)
        wrench_dims = f"{member.wrenches} wrenches, of which {member.constraints} constraint wrenches"
        yield f"member {number}", f"{wrench_dims}; joints: {shown}"
    ranks = wrenches.ranks
    where = "at the stated configuration"
    yield "degrees of freedom", f"{ranks.freedoms} with unlocked actuators, {ranks.locked} with locked ones, {where}"
    yield "ranks", f"{ranks.jacobian} of all wrenches, {ranks.constraints} of the constraint wrenches"
    yield "size", f"{found.size:.6g}, the largest distance between two joints"
    yield "loops", _loops(found)
    for note in found.notes:
        yield "note", note


def _loops(found: Imported) -> str:
    """Return the gaps of the loops in the file as text."""
    if not found.gaps:
        return "closed by joints of the file, without gaps"
    share = found.worst.share(found.size)
    if share <= CLOSED:
        return "closed in the file, up to rounding"
    return f"open in the file by up to {found.worst.words} ({share:.2g} of the size)"


def offer_lines(offers: Offers, size: float) -> Iterator[tuple[str, str]]:
    """Yield label and text of each detected circle and symmetry."""
    for circle in offers.circles:
        where = f"radius {circle.radius:.6g} about {_vector(circle.axis)} through {_vector(circle.centre)}"
        yield circle.name, f"{listing(circle.joints)}: circle of {where}, {_share(circle.deviation, size)}"
    if offers.fold is not None:
        orbits = "; ".join(listing(str(k + 1) for k in orbit) for orbit in offers.fold.orbits)
        where = f"about {_vector(offers.fold.axis)} through {_vector(offers.fold.centre)}"
        words = f"limbs {orbits} are copies, rotated by {360 / offers.fold.count:g} deg {where}"
        yield offers.fold.name, f"{words}, {_share(offers.fold.deviation, size)}; repeat can replace the copies"
    for mirror in offers.mirrors:
        where = f"through {_vector(mirror.point)} with the normal {_vector(mirror.normal)}"
        yield "mirror", f"mirror symmetry about the plane {where}, {_share(mirror.deviation, size)}"
    if not (offers.circles or offers.fold or offers.mirrors):
        yield "offers", f"no circle or symmetry within {SAME:g} of the robot's size"


def _share(deviation: float, size: float) -> str:
    """Return a deviation as text."""
    return f"within {deviation / size:.2g} of the size"


def _vector(vector: FloatArray) -> str:
    """Return three numbers in brackets as text."""
    return f"({', '.join(f'{value + 0.0:.6g}' for value in vector)})"
