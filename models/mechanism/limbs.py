"""Robot-file tables of a mechanism: limbs with branches if its graph has them, else links and joints.

Values are written unchanged, in the world frame: the configuration of the mechanism is the robot's home.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..arrays import FloatArray
from .decomposition import Decomposition, GraphJoint, LimbPaths, Network, Step, decompose
from .graph import Mechanism, MechanismError, MechanismJoint, check_mechanism
from .topology import incident

#: Tolerance for a parallelogram, on axis entries and relative to the rods: only rounding is smaller, as a robot file
#: states an exact one.
_SAME = 1e-9
#: Characters that are not allowed in names of a robot file.
_NO_NAME = re.compile(r"[^A-Za-z0-9_]")


class _FileJoint(NamedTuple):
    """Joint of a robot file: elementary, or a parallelogram in place of four hinges."""

    graph: GraphJoint
    table: dict[str, Any]
    names: tuple[str, ...]


def limbs_of(mechanism: Mechanism) -> dict[str, Any]:
    """Return the tables of a robot file with limbs.

    Joints without effect on the platform are left out. Four passive hinges that form a parallelogram become one joint
    ``Pa``. The tables are the arguments of :func:`screwsynth.models.robot`. They contain neither joint ranges, which a
    case limits, nor a rotation of the platform frame, whose axes are parallel to the world axes at home.

    Raises:
        MechanismError: the mechanism is inconsistent, or has a part that is not a limb: nested loops, coupled joints,
            or a passive joint before branches.
    """
    joints, found = _decomposed(mechanism)
    if found.networks:
        raise MechanismError(*_sentence(found.networks[0], joints))
    limbs = [_limb_table(limb, joints) for limb in found.limbs]
    return {**_head(mechanism), "limb": limbs}


def links_of(mechanism: Mechanism) -> dict[str, Any]:
    """Return the robot-file tables with links and joints, which every mechanism has.

    Raises:
        MechanismError: the mechanism is inconsistent.
    """
    check_mechanism(mechanism)
    names = _names([link.name for link in mechanism.links])
    labels = _names([joint.name for joint in mechanism.joints])
    tables: dict[str, Any] = {
        **_head(mechanism),
        "links": [names[link.name] for link in mechanism.links],
        "base": names[mechanism.base],
        "platform": names[mechanism.platform],
        "joint": [
            {
                "name": labels[each.name],
                "type": each.kind,
                "between": [names[each.inner], names[each.outer]],
                **({} if each.kind == "weld" else _joint_values(each)),
            }
            for each in mechanism.joints
        ],
    }
    if mechanism.couplings:
        tables["coupling"] = [
            {"factors": {labels[name]: factor for name, factor in coupling.factors}} for coupling in mechanism.couplings
        ]
    return tables


def robot_tables(mechanism: Mechanism) -> dict[str, Any]:
    """Return the robot-file tables of a mechanism: with limbs if it has them, else with links and joints.

    Raises:
        MechanismError: the mechanism is inconsistent.
    """
    _, found = _decomposed(mechanism)
    return links_of(mechanism) if found.networks else limbs_of(mechanism)


def _head(mechanism: Mechanism) -> dict[str, Any]:
    """Return the first robot-file tables of a mechanism: name and home."""
    return {"name": mechanism.name or "robot", "home": _numbers(mechanism.link(mechanism.platform).position)}


def _decomposed(mechanism: Mechanism) -> tuple[list[_FileJoint], Decomposition]:
    """Return the robot-file joints of a mechanism, and its limbs by joint indices."""
    check_mechanism(mechanism)
    joints = _file_joints(mechanism)
    index = {name: k for k, each in enumerate(joints) for name in each.names}
    couplings = [[index[name] for name, _ in coupling.factors] for coupling in mechanism.couplings]
    return joints, decompose(mechanism.base, mechanism.platform, [each.graph for each in joints], couplings)


def _sentence(network: Network, joints: Sequence[_FileJoint]) -> tuple[str, str]:
    """Return the joints of a part that is not a limb, and the reason, as place and fault of a message."""
    names = [name for k in network.joints for name in joints[k].names]
    shown = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
    return f"joints {shown}", f"do not form a limb with branches: {network.reason}"


def _limb_table(limb: LimbPaths, joints: Sequence[_FileJoint]) -> dict[str, Any]:
    def tables(steps: Sequence[Step]) -> list[dict[str, Any]]:
        taken: set[str] = set()
        return [_named(_outward(joints[step.joint].table, step.is_outward), taken) for step in steps]

    if len(limb.branches) == 1:
        return {"joints": tables((*limb.stem, *limb.branches[0]))}
    found: dict[str, Any] = {"joints": tables(limb.stem)} if limb.stem else {}
    return {**found, "branch": [{"joints": tables(branch)} for branch in limb.branches]}


def _named(table: dict[str, Any], taken: set[str]) -> dict[str, Any]:
    """Return a joint's table without its name if another joint of the chain has the same name."""
    if table["name"] in taken:
        return {key: value for key, value in table.items() if key != "name"}
    taken.add(table["name"])
    return table


def _outward(table: dict[str, Any], is_outward: bool) -> dict[str, Any]:
    """Return a joint's table in the order from base to platform.

    For a joint stated in the other order, the axis is reversed, so that the coordinate keeps its sign.
    """
    if is_outward:
        return table
    turned = dict(table)
    if "axis" in turned:
        turned["axis"] = [-value + 0.0 for value in turned["axis"]]
    if "to" in turned:
        turned["at"], turned["to"] = turned["to"], turned["at"]
        turned["axis"] = table["axis"]
    return turned


def _file_joints(mechanism: Mechanism) -> list[_FileJoint]:
    """Return the joints of a mechanism, with parallelograms in place of four hinges."""
    left = list(mechanism.joints)
    coupled = {name for coupling in mechanism.couplings for name, _ in coupling.factors}
    names = _names([joint.name for joint in mechanism.joints])
    found: list[_FileJoint] = []
    rods = [rod for rod in _rods(mechanism) if not coupled & {joint.name for joint in rod.joints}]
    while rods:
        rod = rods.pop(0)
        twin = next((each for each in rods if rod.is_parallel_to(each)), None)
        if twin is None:
            continue
        rods.remove(twin)
        used = {joint.name for each in (rod, twin) for joint in each.joints}
        left = [joint for joint in left if joint.name not in used]
        middle = (rod.start + twin.start) / 2
        table = {
            "type": "Pa",
            "name": names[rod.joints[0].name],
            "at": _numbers(middle),
            "to": _numbers(middle + rod.span),
            "axis": _numbers(rod.joints[0].axis),
        }
        ends = GraphJoint(*rod.ends)
        found.append(_FileJoint(ends, table, tuple(joint.name for each in (rod, twin) for joint in each.joints)))
    for joint in left:
        graph = GraphJoint(joint.inner, joint.outer, joint.actuated, joint.kind == "weld")
        table = {"type": joint.kind, "name": names[joint.name], **_joint_values(joint)}
        found.append(_FileJoint(graph, table, (joint.name,)))
    order = {joint.name: k for k, joint in enumerate(mechanism.joints)}
    return sorted(found, key=lambda each: order[each.names[0]])


class _Rod(NamedTuple):
    """Link between two passive hinges: adjacent links, hinges, start point and span."""

    ends: tuple[str, str]
    joints: tuple[MechanismJoint, MechanismJoint]
    start: FloatArray
    span: FloatArray

    def is_parallel_to(self, other: _Rod) -> bool:
        """Return True if this rod and another rod are the long sides of a parallelogram."""
        if self.ends != other.ends or self.joints[0].name == other.joints[0].name:
            return False
        length = float(np.linalg.norm(self.span))
        axes = [joint.axis for each in (self, other) for joint in each.joints]
        apart = other.start - self.start
        flat = np.cross(np.cross(apart, self.span), axes[0])
        area = float(np.linalg.norm(np.cross(apart, self.span)))
        return (
            all(float(np.linalg.norm(np.cross(axes[0], axis))) < _SAME for axis in axes)
            and float(np.abs(self.span - other.span).max()) < _SAME * length
            and area > _SAME * length**2
            and float(np.linalg.norm(flat)) < _SAME * area
        )


def _rods(mechanism: Mechanism) -> list[_Rod]:
    """Return the links with two passive hinges and no other joint, ends in alphabetical order."""
    found = []
    of_link = incident((joint.inner, joint.outer) for joint in mechanism.joints)
    for link in mechanism.links:
        own = [mechanism.joints[k] for k, _ in of_link.get(link.name, ())]
        if len(own) != 2 or link.name in (mechanism.base, mechanism.platform):
            continue
        if any(joint.kind != "R" or joint.actuated for joint in own):
            continue
        far = [joint.outer if joint.inner == link.name else joint.inner for joint in own]
        if far[0] == far[1]:
            continue
        first, second = sorted(zip(far, own, strict=True), key=lambda pair: pair[0])
        span = second[1].point - first[1].point
        found.append(_Rod((first[0], second[0]), (first[1], second[1]), first[1].point, span))
    return found


def _joint_values(joint: MechanismJoint) -> dict[str, Any]:
    """Return position, axis, pitch and actuation of a joint for a robot file."""
    found: dict[str, Any] = {"at": _numbers(joint.point)}
    if joint.kind in ("R", "P", "H"):
        found["axis"] = _numbers(joint.axis)
    if joint.kind == "H":
        found["pitch"] = float(joint.pitch)
    if joint.actuated:
        found["actuated"] = True
    return found


def _numbers(vector: FloatArray) -> list[float]:
    """Return a vector as a list of numbers, without negative zeros."""
    return [float(value) + 0.0 for value in vector]


def _names(names: Sequence[str]) -> dict[str, str]:
    """Return valid and unique robot-file names."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        word = _NO_NAME.sub("_", name)
        word = word if word and not word[0].isdigit() else f"j{word}"
        number, unique = 2, word
        while unique in taken:
            unique, number = f"{word}_{number}", number + 1
        found[name] = unique
        taken.add(unique)
    return found
