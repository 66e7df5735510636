"""Contents of a robot file as text and numbers of a checked form: dimensions, points, limbs or links, and joints.

The tables of a robot file and the arguments of :func:`~screwsynth.models.joints.model.robot.robot` have the same keys.
Links and joints describe shapes that limbs with branches cannot. :mod:`.chain` evaluates the expressions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from ...fileversions import ROBOT_FILES, VERSION_KEY
from ...parts import Dimension
from .forms import (
    NAME,
    Expression,
    RobotError,
    VectorExpression,
    check_names,
    expression_of,
    list_of,
    name_of,
    real_of,
    refuse_other_keys,
    table_of,
    text_of,
    triple_of,
    vector_of,
)

#: Joint types with their keys in addition to ``type`` and ``at``.
_JOINT_KEYS: Mapping[str, tuple[str, ...]] = {
    "R": ("axis", "actuated"),
    "P": ("axis", "actuated"),
    "H": ("axis", "pitch", "actuated"),
    "C": ("axis",),
    "U": ("axes",),
    "S": (),
    "Pa": ("axis", "to", "actuated"),
}
#: Common keys of robot files, besides those of limbs, or of links and joints.
_HEAD_KEYS = (VERSION_KEY, "name", "description", "length_unit", "home", "dimensions", "derived")
#: Largest number of limbs of a robot, with all copies.
MOST_LIMBS = 24
#: Largest number of joints from base to platform, and of branches of a limb: known robots have at most half of them.
_MOST_JOINTS = 12
_MOST_BRANCHES = 6
#: Largest number of joints of a robot with all copies. So many took 4 s to read; 288 did not end within 200 s.
_MOST_IN_ALL = 120
#: Fault message for a branch with branches of its own.
NESTED_BRANCH = "is a branch of a branch; allowed are branches of a limb, each with joints up to the platform"
#: Angle below which two copies of a limb coincide, degrees.
_SAME_ANGLE = 1e-6
#: Keys of a robot file for links and joints, in addition to the common keys.
GRAPH_KEYS = ("links", "base", "platform", "points", "joint", "coupling")
_MOST_COUPLINGS = 40
#: Types of joints with one coordinate, which may be coupled and actuated.
_COUPLED = ("R", "P", "H")


@dataclass(frozen=True)
class DimensionWords:
    """Dimension as written: typical value (degrees for an angle), kind and description."""

    typical: float
    kind: Dimension
    description: str


@dataclass(frozen=True)
class JointWords:
    """Joint as written: type, place in the robot file, point, axes and further values; None for missing keys."""

    place: str
    type: str
    at: VectorExpression
    axes: tuple[VectorExpression, ...]
    actuated: bool = False
    pitch: Expression = 0.0
    to: VectorExpression | None = None
    name: str = ""


@dataclass(frozen=True)
class RepeatWords:
    """Copies of a limb by rotation about an axis: angles in degrees, direction and point of the axis."""

    angles: tuple[float, ...]
    axis: tuple[float, float, float]
    through: tuple[float, float, float]


@dataclass(frozen=True)
class LimbWords:
    """Limb as written: names and arrangement of its copies, points, joints of the stem and of each branch."""

    place: str
    names: tuple[str, ...]
    repeat: RepeatWords | None
    points: Mapping[str, VectorExpression]
    stem: tuple[JointWords, ...]
    branches: tuple[tuple[JointWords, ...], ...]
    centre: VectorExpression | None


@dataclass(frozen=True)
class LinkJointWords:
    """Joint between two links, by their names; ``joint`` is None for a weld."""

    place: str
    name: str
    between: tuple[str, str]
    joint: JointWords | None


@dataclass(frozen=True)
class CouplingWords:
    """Linear relation of joint coordinates: its place in the robot file, and the factor of each joint by name."""

    place: str
    factors: Mapping[str, Expression]


@dataclass(frozen=True)
class GraphWords:
    """Robot as links and joints: names of links, base and platform, points, joints and couplings."""

    links: tuple[str, ...]
    base: str
    platform: str
    points: Mapping[str, VectorExpression]
    joints: tuple[LinkJointWords, ...]
    couplings: tuple[CouplingWords, ...]


@dataclass(frozen=True)
class RobotWords:
    """Robot as it is written in a robot file, with limbs or with links and joints."""

    name: str
    description: str
    home: VectorExpression
    limbs: tuple[LimbWords, ...]
    dimensions: Mapping[str, DimensionWords] = field(default_factory=dict)
    derived: Mapping[str, Expression] = field(default_factory=dict)
    length_unit: str = ""
    graph: GraphWords | None = None


def read_robot(tables: Mapping[str, object]) -> RobotWords:
    """Return a robot from tables with limbs, or with links and joints.

    Args:
        tables: tables of a robot file, as ``tomllib`` returns them.

    Raises:
        RobotError: a key is unknown or missing, or a value has a form that is not allowed.
    """
    if fault := ROBOT_FILES.fault(tables.get(VERSION_KEY, 1)):
        raise RobotError(f"{VERSION_KEY} = {tables[VERSION_KEY]!r}", fault)
    given = [key for key in GRAPH_KEYS if tables.get(key) is not None]
    if given and tables.get("limb") is not None:
        raise RobotError(given[0], "conflicts with limb: give the robot by limbs, or by links and joints")
    refuse_other_keys("", tables, (*_HEAD_KEYS, *(GRAPH_KEYS if given else ()), "limb"))
    head = _head(tables)
    return replace(head, graph=_graph(tables)) if given else replace(head, limbs=_limbs(tables.get("limb")))


def _limbs(limbs: object) -> tuple[LimbWords, ...]:
    if not isinstance(limbs, Sequence) or isinstance(limbs, str) or not limbs:
        raise RobotError("limb", "is missing: a robot needs at least one [[limb]]")
    read: list[LimbWords] = []
    for index, each in enumerate(limbs):
        read.append(
            _limb(f"limb {index + 1}", table_of(f"limb {index + 1}", each), sum(len(one.names) for one in read))
        )
    names = [limb for each in read for limb in each.names]
    if len(names) > MOST_LIMBS:
        raise RobotError("limb", f"has {len(names)} limbs with all copies; at most {MOST_LIMBS} are allowed")
    joints = sum(len(each.names) * (len(each.stem) + sum(map(len, each.branches))) for each in read)
    if joints > _MOST_IN_ALL:
        raise RobotError("limb", f"has {joints} joints with all copies; at most {_MOST_IN_ALL} are allowed")
    for limb in names:
        if names.count(limb) > 1:
            raise RobotError("limb", f"has two limbs with the name {limb!r}")
    return tuple(read)


def _head(tables: Mapping[str, object]) -> RobotWords:
    """Return a robot without limbs: name, home, dimensions and derived quantities."""
    name = tables.get("name")
    if not isinstance(name, str) or not name.strip():
        raise RobotError("name", "is missing: give the robot's name as a text")
    name_of("name", name)
    dimensions = {
        key: _dimension(key, value) for key, value in table_of("dimensions", tables.get("dimensions")).items()
    }
    derived = {
        key: expression_of(f"derived.{key}", value) for key, value in table_of("derived", tables.get("derived")).items()
    }
    check_names([*dimensions, *derived], "a dimension")
    return RobotWords(
        name=name,
        description=text_of("description", tables.get("description", "")) or f"{name}, given joint by joint",
        home=vector_of("home", tables.get("home", (0.0, 0.0, 0.0))),
        limbs=(),
        dimensions=dimensions,
        derived=derived,
        length_unit=name_of("length_unit", tables.get("length_unit", "")),
    )


def _limb(place: str, table: Mapping[str, object], before: int) -> LimbWords:
    """Return a limb from its table in a robot file.

    Args:
        place: place of the limb, for messages.
        table: keys of the limb.
        before: number of the limbs stated before this limb, with all copies.
    """
    refuse_other_keys(place, table, ("name", "repeat", "points", "joints", "branch", "centre"))
    repeat = None if table.get("repeat") is None else _repeat(f"{place}, repeat", table["repeat"])
    count = 1 if repeat is None else len(repeat.angles)
    given = name_of(f"{place}, name", table.get("name", ""))
    names = [str(before + k + 1) for k in range(count)]
    if given:
        names = [given] if repeat is None else [f"{given}{k + 1}" for k in range(count)]
    points = {
        key: vector_of(f"{place}, point {key}", value)
        for key, value in table_of(f"{place}, points", table.get("points")).items()
    }
    check_names(points, "a point", place)
    stem = _joints(place, table.get("joints", ()))
    _check_path(place, stem)
    branches = [
        _joints(f"{place}, branch {k + 1}", _only_joints(f"{place}, branch {k + 1}", branch))
        for k, branch in enumerate(list_of(f"{place}, branch", table.get("branch", ())))
    ]
    for branch in branches:
        _check_path(place, [*stem, *branch])
    if len(branches) > _MOST_BRANCHES:
        raise RobotError(f"{place}, branch", f"has {len(branches)} branches; at most {_MOST_BRANCHES} are allowed")
    if not stem and not branches:
        raise RobotError(f"{place}, joints", "is missing: a limb needs at least one joint")
    if len(branches) == 1:
        raise RobotError(f"{place}, branch", "has only one branch: write its joints into the list of the limb")
    centre = None if table.get("centre") is None else vector_of(f"{place}, centre", table["centre"])
    return LimbWords(place, tuple(names), repeat, points, stem, tuple(branches), centre)


def _check_path(place: str, joints: Sequence[JointWords]) -> None:
    """Refuse too many joints of one chain, invalid joint names, and repeated ones."""
    if len(joints) > _MOST_JOINTS:
        raise RobotError(f"{place}, joints", f"has {len(joints)} joints; at most {_MOST_JOINTS} are allowed")
    names = [joint.name for joint in joints if joint.name]
    for joint in joints:
        if joint.name:
            _check_name(f"{joint.place}, name", joint.name)
        if names.count(joint.name) > 1:
            raise RobotError(f"{place}, joints", f"has two joints with the name {joint.name!r}")


def _only_joints(place: str, branch: object) -> object:
    """Return the joints of a branch; refuse a branch with other keys."""
    table = table_of(place, branch)
    if "branch" in table:
        raise RobotError(f"{place}, branch", NESTED_BRANCH)
    refuse_other_keys(place, table, ("joints",))
    if not table.get("joints"):
        raise RobotError(f"{place}, joints", "is missing: a branch needs at least one joint")
    return table["joints"]


def _joints(place: str, value: object) -> tuple[JointWords, ...]:
    return tuple(
        _joint_words(f"{place}, joint {k + 1}", table_of(f"{place}, joint {k + 1}", each))
        for k, each in enumerate(list_of(f"{place}, joints", value))
    )


def _joint_words(place: str, table: Mapping[str, object]) -> JointWords:
    kind = table.get("type")
    if not isinstance(kind, str) or kind not in _JOINT_KEYS:
        raise RobotError(f"{place}, type", f"is {kind!r}; allowed are {', '.join(_JOINT_KEYS)}")
    place = f"{place} ({kind})"
    allowed = ("type", "name", "at", *_JOINT_KEYS[kind])
    if "actuated" in table and "actuated" not in allowed:
        raise RobotError(
            f"{place}, actuated", "is not allowed for this type: write each axis as a separate joint R or P"
        )
    refuse_other_keys(place, table, allowed)
    for key in allowed:
        if key not in ("actuated", "name") and key not in table:
            raise RobotError(f"{place}, {key}", "is missing")
    axes: tuple[VectorExpression, ...] = ()
    if "axis" in allowed:
        axes = (vector_of(f"{place}, axis", table["axis"]),)
    if "axes" in allowed:
        written = list_of(f"{place}, axes", table["axes"])
        if len(written) != 2:
            raise RobotError(f"{place}, axes", f"has {len(written)} axes; a universal joint has 2")
        axes = tuple(vector_of(f"{place}, axes[{k}]", each) for k, each in enumerate(written))
    actuated = table.get("actuated", False)
    if not isinstance(actuated, bool):
        raise RobotError(f"{place}, actuated", f"is {actuated!r}; allowed are true and false")
    return JointWords(
        place=place,
        type=kind,
        at=vector_of(f"{place}, at", table["at"]),
        axes=axes,
        actuated=actuated,
        pitch=expression_of(f"{place}, pitch", table.get("pitch", 0.0)),
        to=None if "to" not in table else vector_of(f"{place}, to", table["to"]),
        name=text_of(f"{place}, name", table.get("name", "")),
    )


def _repeat(place: str, value: object) -> RepeatWords:
    """Return the copies of a limb: evenly spaced if a count is given, otherwise at the stated angles."""
    table = table_of(place, value)
    refuse_other_keys(place, table, ("count", "angles", "axis", "through"))
    if ("count" in table) == ("angles" in table):
        raise RobotError(place, "needs count or angles, and not both")
    if "count" in table:
        count = table["count"]
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_LIMBS:
            raise RobotError(f"{place}, count", f"is {count!r}; allowed are whole numbers from 1 to {MOST_LIMBS}")
        angles = tuple(360.0 * k / count for k in range(count))
    else:
        angles = tuple(real_of(f"{place}, angles", each) for each in list_of(f"{place}, angles", table["angles"]))
        for angle in angles:
            if sum(math.isclose(math.remainder(angle - each, 360.0), 0.0, abs_tol=_SAME_ANGLE) for each in angles) > 1:
                raise RobotError(f"{place}, angles", f"has {angle:g} twice; each copy needs an angle of its own")
        if not 1 <= len(angles) <= MOST_LIMBS:
            raise RobotError(f"{place}, angles", f"has {len(angles)} angles; allowed are 1 to {MOST_LIMBS}")
    axis = triple_of(f"{place}, axis", table.get("axis", (0.0, 0.0, 1.0)))
    if not any(axis):
        raise RobotError(f"{place}, axis", "is zero: it needs a direction")
    return RepeatWords(angles, axis, triple_of(f"{place}, through", table.get("through", (0.0, 0.0, 0.0))))


def _dimension(name: str, value: object) -> DimensionWords:
    place = f"dimensions.{name}"
    table = table_of(place, value)
    refuse_other_keys(place, table, ("typical", "kind", "description"))
    if "typical" not in table:
        raise RobotError(f"{place}, typical", "is missing: a dimension needs a typical value")
    kinds = {item.value: item for item in Dimension}
    kind = table.get("kind", "length")
    if not isinstance(kind, str) or kind not in kinds:
        raise RobotError(f"{place}, kind", f"is {kind!r}; allowed are {', '.join(kinds)}")
    typical = real_of(f"{place}, typical", table["typical"])
    return DimensionWords(typical, kinds[kind], text_of(f"{place}, description", table.get("description", "")))


def _graph(tables: Mapping[str, object]) -> GraphWords:
    links = _links(tables)
    base, platform = (_end(tables, role, links) for role in ("base", "platform"))
    if base == platform:
        raise RobotError("platform", f"is {platform!r}, which is the base; two links are needed")
    points = {key: vector_of(f"point {key}", value) for key, value in table_of("points", tables.get("points")).items()}
    check_names(points, "a point")
    written = list_of("joint", tables.get("joint") or ())
    if not written:
        raise RobotError("joint", "is missing: a robot of links needs tables [[joint]]")
    if len(written) > _MOST_IN_ALL:
        raise RobotError("joint", f"has {len(written)} joints; at most {_MOST_IN_ALL} are allowed")
    joints = [_joint(k + 1, table_of(f"joint {k + 1}", each), links) for k, each in enumerate(written)]
    names = [joint.name for joint in joints]
    for joint in joints:
        if names.count(joint.name) > 1:
            raise RobotError(joint.place, "is given twice; each joint needs a name of its own")
    unused = [link for link in links if not any(link in joint.between for joint in joints)]
    if unused:
        raise RobotError(f"links, {unused[0]}", "has no joint; give this link a joint, or remove it from links")
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
    links = [text_of("links", each) for each in list_of("links", tables.get("links") or ())]
    if not links:
        raise RobotError("links", 'is missing: give the names of all links, such as ["base", "arm", "platform"]')
    for name in links:
        _check_name(f"links, {name}", name)
        if links.count(name) > 1:
            raise RobotError(f"links, {name}", "is given twice; each link needs a name of its own")
    return links


def _end(tables: Mapping[str, object], role: str, links: Sequence[str]) -> str:
    """Return the link that is the base or the platform, by default the link of this name."""
    name = text_of(role, tables.get(role, role))
    if name not in links:
        raise RobotError(role, f"is {name!r}, which is not a link; links are {', '.join(links)}")
    return name


def _check_name(place: str, name: str) -> None:
    """Refuse a name that is not an identifier."""
    if not NAME.fullmatch(name):
        raise RobotError(place, f"is {name!r}; letters, digits and _ are allowed, a letter first")


def _joint(number: int, table: Mapping[str, object], links: Sequence[str]) -> LinkJointWords:
    name = text_of(f"joint {number}, name", table.get("name", f"joint_{number}"))
    _check_name(f"joint {number}, name", name)
    place = f"joint {name}"
    between = [text_of(f"{place}, between", each) for each in list_of(f"{place}, between", table.get("between", ()))]
    if len(between) != 2:
        raise RobotError(
            f"{place}, between",
            f"has {len(between)} links; a joint connects 2 links: give first the link nearer to the base",
        )
    for link in between:
        if link not in links:
            raise RobotError(f"{place}, between", f"has {link!r}, which is not a link; links are {', '.join(links)}")
    if between[0] == between[1]:
        raise RobotError(f"{place}, between", f"has the link {link!r} twice; two different links are needed")
    rest = {key: value for key, value in table.items() if key != "between"}
    if table.get("type") == "weld":
        refuse_other_keys(f"{place} (weld)", rest, ("name", "type"))
        return LinkJointWords(place, name, (between[0], between[1]), None)
    joint = _joint_words(place, {**rest, "name": name})
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
            raise RobotError(f"{place}, {name}", f"is not a joint; joints are {', '.join(types)}")
        if types[name] not in _COUPLED:
            raise RobotError(f"{place}, {name}", f"is a joint {types[name]}; only R, P and H have one coordinate")
    if len(factors) < 2:
        raise RobotError(f"{place}, factors", f"has {len(factors)} joints; a coupling needs 2 or more")
    return CouplingWords(place, factors)
