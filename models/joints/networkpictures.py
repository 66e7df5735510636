"""The drawing of a network of links and joints: each link as lines between its joints, in the order of their names."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from casadi import SX

from ..drawing import Body, JointKind, JointSymbol, Link, LinkKind, Point
from .network import OpenNetwork

#: Joints whose link between them can only push and pull.
_ROD_ENDS = ("U", "S")


@dataclass(frozen=True, eq=False)
class NetworkDrawing:
    """Points, lines and symbols of a network.

    Attributes:
        points: of its joints, and of slides on both links.
        links: lines between them.
        joints: symbols.
        base, platform: name, place and place at home of the points on base and platform.
    """

    points: list[Point]
    links: list[Link]
    joints: list[JointSymbol]
    base: list[tuple[str, SX, SX]]
    platform: list[tuple[str, SX, SX]]


def network_drawing(name: str, network: OpenNetwork, *, carries: bool) -> NetworkDrawing:
    """Return the drawing of a network.

    Args:
        name: of the limb that the network is.
        network: at any pose.
        carries: whether the limb resists the platform.
    """
    found = NetworkDrawing([], [], [], [], [])
    limb = name if carries else None
    ends: dict[str, list[tuple[str, str]]] = {}
    for k in network.joints:
        joint, label = network.joint(k), f"{name}:{network.graph.joints[k].name}"
        inner, outer = network.ends(k)
        moves = joint.type in ("P", "H", "C", "Pa")
        home = joint.point + joint.axes[0].rod if joint.type == "Pa" else joint.point
        places = [(label, inner, network.motions[inner].point(joint.point), joint.point)]
        if moves:
            places.append((f"{label} end", outer, network.motions[outer].point(home), home))
        else:
            places.append((label, outer, places[0][2], joint.point))
        for point, body, place, at_home in places:
            if all(point != each.name for each in found.points):
                found.points.append(Point(point, place, _body(network, inner, outer)))
            if body in (network.base, network.platform):
                target = found.base if body == network.base else found.platform
                target.append((point, place, at_home))
            else:
                ends.setdefault(body, []).append((point, joint.type))
        if moves:
            found.links.append(Link(label, f"{label} end", Body.LIMB, limb, LinkKind.BAR))
        axes = (
            ()
            if joint.type == "S"
            else tuple(
                screw[3:] if joint.type in ("P", "Pa") else screw[:3] for screw in network.screws[k][: len(joint.axes)]
            )
        )
        axes = axes[:1] if joint.type == "C" else axes
        found.joints.append(
            JointSymbol(
                label, JointKind(joint.type), places[0][2], axes, _body(network, inner, outer), limb, joint.actuated
            )
        )
    for own in ends.values():
        is_rod = len(own) == 2 and all(kind in _ROD_ENDS for _, kind in own)
        pairs = list(zip(own, [*own[1:], own[0]], strict=True)) if len(own) > 2 else list(pairwise(own))
        found.links.extend(
            Link(one[0], other[0], Body.LIMB, limb, LinkKind.ROD if is_rod else LinkKind.BAR) for one, other in pairs
        )
    return found


def _body(network: OpenNetwork, inner: str, outer: str) -> Body:
    """Return the body that a joint is drawn with."""
    if network.base in (inner, outer):
        return Body.BASE
    return Body.PLATFORM if network.platform in (inner, outer) else Body.LIMB
