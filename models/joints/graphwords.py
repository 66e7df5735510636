"""A robot as links and joints, as it is written: for shapes that limbs with branches do not have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from .forms import (
    NAME,
    RobotError,
    check_names,
    expression_of,
    list_of,
    refuse_other_keys,
    table_of,
    text_of,
    vector_of,
)
from .words import (
    HEAD_KEYS,
    MOST_IN_ALL,
    CouplingWords,
    GraphWords,
    LinkJointWords,
    RobotWords,
    joint_words,
    read_head,
    read_words,
)

#: Keys of a robot file with links and joints beside those of every robot file.
GRAPH_KEYS = ("links", "base", "platform", "points", "joint", "coupling")
_MOST_COUPLINGS = 40
#: Joints with one coordinate, which a coupling relates and an actuator drives.
_COUPLED = ("R", "P", "H")


def read_robot(tables: Mapping[str, object]) -> RobotWords:
    """Return a robot from its tables, which have limbs, or links and joints.

    Args:
        tables: as ``tomllib`` returns those of a robot file.

    Raises:
        RobotError: a key is unknown or missing, or a value has a form that is not allowed.
    """
    given = [key for key in GRAPH_KEYS if tables.get(key) is not None]
    if not given:
        return read_words(tables)
    if tables.get("limb") is not None:
        raise RobotError(given[0], "cannot stand beside limb: give the robot by limbs, or by links and joints")
    refuse_other_keys("", tables, (*HEAD_KEYS, *GRAPH_KEYS, "limb"))
    return replace(read_head(tables), graph=_graph(tables))


def _graph(tables: Mapping[str, object]) -> GraphWords:
    """Return links, joints and couplings."""
    links = _links(tables)
    base, platform = (_end(tables, role, links) for role in ("base", "platform"))
    if base == platform:
        raise RobotError("platform", f"is {platform!r}, which is the base; two links are needed")
    points = {key: vector_of(f"point {key}", value) for key, value in table_of("points", tables.get("points")).items()}
    check_names(points, "a point")
    written = list_of("joint", tables.get("joint") or ())
    if not written:
        raise RobotError("joint", "is missing: a robot of links needs tables [[joint]]")
    if len(written) > MOST_IN_ALL:
        raise RobotError("joint", f"has {len(written)} joints; at most {MOST_IN_ALL} are allowed")
    joints = [_joint(k + 1, table_of(f"joint {k + 1}", each), links) for k, each in enumerate(written)]
    names = [joint.name for joint in joints]
    for joint in joints:
        if names.count(joint.name) > 1:
            raise RobotError(joint.place, "is given twice; each joint needs a name of its own")
    unused = [link for link in links if not any(link in joint.between for joint in joints)]
    if unused:
        raise RobotError(f"links, {unused[0]}", "has no joint; each link needs one, or is left out")
    couplings = list_of("coupling", tables.get("coupling") or ())
    if len(couplings) > _MOST_COUPLINGS:
        raise RobotError("coupling", f"has {len(couplings)} couplings; at most {_MOST_COUPLINGS} are allowed")
    return GraphWords(
        links=tuple(links),
        base=base,
        platform=platform,
        points=points,
        joints=tuple(joints),
        couplings=tuple(_coupling(k + 1, each, joints) for k, each in enumerate(couplings)),
    )


def _links(tables: Mapping[str, object]) -> list[str]:
    """Return the names of the links."""
    links = [text_of("links", each) for each in list_of("links", tables.get("links") or ())]
    if not links:
        raise RobotError("links", 'is missing: give the names of all links, such as ["base", "arm", "platform"]')
    for name in links:
        _check_name(f"links, {name}", name)
        if links.count(name) > 1:
            raise RobotError(f"links, {name}", "is given twice; each link needs a name of its own")
    return links


def _end(tables: Mapping[str, object], role: str, links: Sequence[str]) -> str:
    """Return the link that is the base or the platform: the one of this name, where the file names none."""
    name = text_of(role, tables.get(role, role))
    if name not in links:
        raise RobotError(role, f"is {name!r}, which is no link; links are {', '.join(links)}")
    return name


def _check_name(place: str, name: str) -> None:
    """Refuse a name that is no word."""
    if not NAME.fullmatch(name):
        raise RobotError(place, f"is {name!r}; letters, digits and _ are allowed, a letter first")


def _joint(number: int, table: Mapping[str, object], links: Sequence[str]) -> LinkJointWords:
    """Return a joint between two links."""
    name = text_of(f"joint {number}, name", table.get("name", f"joint_{number}"))
    _check_name(f"joint {number}, name", name)
    place = f"joint {name}"
    between = [text_of(f"{place}, between", each) for each in list_of(f"{place}, between", table.get("between", ()))]
    if len(between) != 2:
        raise RobotError(f"{place}, between", f"has {len(between)} links; a joint is between 2, the base's side first")
    for link in between:
        if link not in links:
            raise RobotError(f"{place}, between", f"has {link!r}, which is no link; links are {', '.join(links)}")
    if between[0] == between[1]:
        raise RobotError(f"{place}, between", f"has the link {link!r} twice; two different links are needed")
    rest = {key: value for key, value in table.items() if key != "between"}
    if table.get("type") == "weld":
        refuse_other_keys(f"{place} (weld)", rest, ("name", "type"))
        return LinkJointWords(place, name, (between[0], between[1]), None)
    joint = joint_words(place, {**rest, "name": name})
    return LinkJointWords(joint.place, name, (between[0], between[1]), joint)


def _coupling(number: int, value: object, joints: Sequence[LinkJointWords]) -> CouplingWords:
    """Return a coupling of joints with one coordinate each."""
    place = f"coupling {number}"
    table = table_of(place, value)
    refuse_other_keys(place, table, ("factors",))
    written = table_of(f"{place}, factors", table.get("factors"))
    types = {each.name: "weld" if each.joint is None else each.joint.type for each in joints}
    factors = {name: expression_of(f"{place}, {name}", factor) for name, factor in written.items()}
    for name in factors:
        if name not in types:
            raise RobotError(f"{place}, {name}", f"is no joint; joints are {', '.join(types)}")
        if types[name] not in _COUPLED:
            raise RobotError(f"{place}, {name}", f"is a joint {types[name]}; only R, P and H have one coordinate")
    if len(factors) < 2:
        raise RobotError(f"{place}, factors", f"has {len(factors)} joints; a coupling needs 2 or more")
    return CouplingWords(place, factors)
