"""The limbs of a robot given joint by joint as chains of elementary joints, in numbers at home."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray, Model
from ....models.catalog import gallery_names, gallery_tables
from ....models.joints.chain import HomeRobot, Joint, Limb
from ....models.joints.graphwords import read_robot
from ....models.joints.linkgraph import home_of
from ....models.mechanism.graph import ElementaryKind
from ...case.plain import plain_value
from .chains import Chain, Chains, Step

#: Names of the elementary joints of a joint that has several, and the suffix of each.
PARTS: Mapping[str, tuple[str, ...]] = {"U": ("first", "second"), "C": ("angle", "stroke")}
#: Distance of a parallelogram's rods from its middle, in parts of the rod: it is no dimension of the robot.
_APART = 0.1


def is_given_by_joints(model: Model) -> bool:
    """Return whether a robot is given joint by joint, so that its tables are known."""
    return bool(_tables(model))


def robot_at_home(model: Model) -> HomeRobot:
    """Return a robot given joint by joint, at home."""
    return home_of(read_robot(_tables(model)))


def joint_chains(
    model: Model, robot: HomeRobot, dimensions: FloatArray, coordinates: Mapping[tuple[str, str], float]
) -> Chains:
    """Return the limbs of a robot given joint by joint, at home.

    Args:
        model: the robot, without nested loops.
        robot: the same at home.
        dimensions: (d,) its dimensions in order, radians for angles.
        coordinates: known coordinates from home by label and part of a joint, such as ``("2:3", "first")``.
    """
    numbers = _Numbers(robot, dimensions)
    actuators = (each.name for each in model.actuators)
    known: dict[int, list[Step]] = {}
    chains = []
    for limb in robot.limbs:
        for index, joints in enumerate(limb.paths):
            steps: list[Step] = []
            for j, joint in enumerate(joints):
                if id(joint) not in known:
                    label = _label(limb, index, j)
                    # A model has its actuators in the same order.
                    actuator = next(actuators) if joint.actuated else ""
                    known[id(joint)] = _steps(joint, label, actuator, numbers, coordinates)
                steps += known[id(joint)]
            name = f"{limb.name}.{index + 1}" if len(limb.branches) > 1 else limb.name
            chains.append(Chain(limb.name, name, tuple(steps)))
    return Chains(tuple(chains), numbers.of(robot.home), np.eye(3), _notes(chains))


def _tables(model: Model) -> Mapping[str, object]:
    """Return the tables of a robot's file; none of a robot that is given by its rows."""
    definition = model.options.get("definition")
    if definition is None and model.structure and model.name in gallery_names():
        return gallery_tables(model.name)
    tables = plain_value(definition or {})
    return tables if isinstance(tables, Mapping) else {}


def clean_name(text: str) -> str:
    """Return a text as a name that every format takes: letters, digits, dots, minus and plus signs, underscores."""
    return re.sub(r"[^A-Za-z0-9_.+-]", "_", text)


class _Numbers:
    """Values of expressions of a robot's dimensions.

    Args:
        robot: the robot at home.
        dimensions: (d,) its dimensions.
    """

    def __init__(self, robot: HomeRobot, dimensions: FloatArray) -> None:
        self._symbols, self._dimensions = robot.symbols, dimensions

    def of(self, expression: SX) -> FloatArray:
        """Return the values of an expression (n, 1), (n,)."""
        found = ca.Function("numbers", [self._symbols], [ca.densify(expression)])(self._dimensions)
        return np.asarray(found.full().ravel(), dtype=np.float64)


def _label(limb: Limb, index: int, j: int) -> str:
    """Return the label of a joint of a path, such as ``2:3`` or, behind a stem, ``2.1:3``."""
    branch = f".{index + 1}" if j >= len(limb.stem) and len(limb.branches) > 1 else ""
    return f"{limb.name}{branch}:{j + 1}"


def _notes(chains: Sequence[Chain]) -> tuple[str, ...]:
    """Return notes on parallelograms."""
    steps = {step.name: step for chain in chains for step in chain.steps}.values()
    if not any(step.follows for step in steps):
        return ()
    rods = "A parallelogram is two rods with a hinge at each end. Their distance, a fifth of a rod, is our choice: the"
    rods += " robot has no such number, and the motion of its platform does not depend on it."
    driven = (
        "The rate of a driven one in results is a length; that of its hinge is an angle, the length over the rod's."
    )
    is_driven = any(step.actuated and step.side is not None for step in steps)
    return (rods, driven) if is_driven else (rods,)


def _steps(
    joint: Joint, label: str, actuator: str, numbers: _Numbers, coordinates: Mapping[tuple[str, str], float]
) -> list[Step]:
    """Return the elementary joints of a joint."""
    name = "joint_" + clean_name(label.replace(":", "_"))
    points = [numbers.of(joint.point)] * 2
    if joint.type == "S":
        return [Step(name, label, joint.name, "", "S", points[0], np.zeros(3))]
    axes = [numbers.of(each.axis) for each in joint.axes]
    pitch, side, lever = 0.0, None, None
    parts: Sequence[str] = PARTS.get(joint.type, ("",))
    kinds: list[ElementaryKind]
    match joint.type:
        case "U":
            kinds = ["R", "R"]
        case "C":
            kinds, axes = ["R", "P"], axes * 2
        case "P":
            kinds = ["P"]
        case "H":
            kinds, pitch = ["H"], float(numbers.of(joint.axes[0].pitch)[0])
        case "Pa":
            kinds, parts, axes = ["R", "R"], ("", "back"), axes * 2
            rod = numbers.of(joint.axes[0].rod)
            points = [points[0], points[0] + rod]
            side, lever = _APART * np.cross(axes[0], rod), float(np.linalg.norm(rod))
        case _:
            kinds = ["R"]
    found = []
    for k, (kind, part) in enumerate(zip(kinds, parts, strict=True)):
        follows = joint.type == "Pa" and k == 1
        value = coordinates.get((label, "" if follows else part))
        if value is not None and lever is not None:  # the way of a parallelogram, as the angle of its rods
            value /= lever
        found.append(
            Step(
                f"{name}_{part}" if part else name,
                label,
                joint.name,
                part,
                kind,
                points[k],
                axes[k],
                pitch,
                joint.actuated and not follows,
                "" if follows else actuator,
                coordinate=-value if follows and value is not None else value,
                follows=follows,
                side=side,
                lever=lever,
            )
        )
    return found
