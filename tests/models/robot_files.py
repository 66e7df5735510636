"""Robot files read into numbers, for tests: an evaluator of their expressions that shares no code with the package."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from builders import Array, turn_about

Value = float | Array
Table = Mapping[str, Any]

OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip


def unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "sqrt": math.sqrt, "atan2": math.atan2, "abs": abs,
    "cross": np.cross, "dot": lambda a, b: float(np.dot(a, b)), "norm": lambda a: float(np.linalg.norm(a)),
    "unit": unit,
}  # fmt: skip

#: Number of directions in ``axis`` or ``axes`` of each type of joint.
DIRECTIONS = {"R": 1, "P": 1, "H": 1, "C": 1, "Pa": 1, "U": 2, "S": 0}


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint at home, in the world frame."""

    kind: str  # R, P, H, C, U, S or Pa
    point: Array  # (3,) of its axis, or its centre
    axes: tuple[Array, ...]  # unit vectors: two for U, none for S, one for the others
    actuated: bool = False
    pitch: float = 0.0  # of H, length per radian
    to: Array | None = None  # (3,) end of the moving rod of Pa


@dataclass(frozen=True, eq=False)
class Limb:
    """Joints from base to platform: a stem, and branches behind it; without branches no stem and one branch."""

    stem: tuple[Joint, ...]
    branches: tuple[tuple[Joint, ...], ...]
    centre: Array | None = None


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot at home, in the world frame; ``home`` (3,) is the origin of its platform."""

    name: str
    home: Array
    limbs: tuple[Limb, ...]

    @property
    def actuators(self) -> int:
        """Number of actuated joints."""
        return sum(joint.actuated for limb in self.limbs for joint in every_joint(limb))


def every_joint(limb: Limb) -> tuple[Joint, ...]:
    return limb.stem + tuple(joint for branch in limb.branches for joint in branch)


def moved_joint(joint: Joint, R: Array, t: Array) -> Joint:
    to = None if joint.to is None else R @ joint.to + t
    return replace(joint, point=R @ joint.point + t, axes=tuple(R @ axis for axis in joint.axes), to=to)


def moved_limb(limb: Limb, R: Array, t: Array) -> Limb:
    return Limb(
        tuple(moved_joint(joint, R, t) for joint in limb.stem),
        tuple(tuple(moved_joint(joint, R, t) for joint in branch) for branch in limb.branches),
        None if limb.centre is None else R @ limb.centre + t,
    )


def value_of(expression: float | str, names: Mapping[str, Value]) -> Value:
    """Value of an expression: a number or a vector (3,)."""
    if not isinstance(expression, str):
        return float(expression)

    def of(node: ast.AST) -> Value:
        match node:
            case ast.Constant(value=int() | float() as number):
                return float(number)
            case ast.Name(id=name):
                return names[name]
            case ast.UnaryOp(op=op, operand=operand):
                return OPERATORS[type(op)](of(operand))
            case ast.BinOp(left=left, op=op, right=right):
                return OPERATORS[type(op)](of(left), of(right))
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
                return FUNCTIONS[name](*(of(argument) for argument in args))
        message = f"{expression!r} is not an expression of a robot file"
        raise ValueError(message)

    # Python's ^ binds weaker than + and would turn rod^2 - h^2 into another expression.
    return of(ast.parse(expression.replace("^", "**"), mode="eval").body)


def number_of(expression: float | str, names: Mapping[str, Value]) -> float:
    return float(np.asarray(value_of(expression, names)).item())


def vector_of(expressions: str | Sequence[float | str], names: Mapping[str, Value]) -> Array:
    """Vector (3,) of one expression of vectors, or of three expressions of numbers."""
    if isinstance(expressions, str):
        return np.asarray(value_of(expressions, names), dtype=float)
    return np.array([value_of(expression, names) for expression in expressions], dtype=float)


def numbers_of(table: Table, dimensions: Mapping[str, float]) -> dict[str, Value]:
    """Dimensions and derived numbers by name; angles of the file are degrees, those of expressions radians."""
    unknown = set(dimensions) - set(table["dimensions"])
    if unknown:
        message = f"{table['name']} has no dimensions {sorted(unknown)}"
        raise ValueError(message)
    names: dict[str, Value] = {"pi": math.pi}
    for name, entry in table["dimensions"].items():
        value = float(dimensions.get(name, entry["typical"]))
        names[name] = math.radians(value) if entry.get("kind", "length") == "angle" else value
    for name, expression in table.get("derived", {}).items():
        names[name] = value_of(expression, names)
    return names


def joint_of(table: Table, names: Mapping[str, Value]) -> Joint:
    kind = table["type"]
    axes = table["axes"] if kind == "U" else [table["axis"]] if DIRECTIONS[kind] else []
    return Joint(
        kind=kind,
        point=vector_of(table["at"], names),
        axes=tuple(unit(vector_of(axis, names)) for axis in axes),
        actuated=bool(table.get("actuated", False)),
        pitch=number_of(table.get("pitch", 0.0), names),
        to=vector_of(table["to"], names) if "to" in table else None,
    )


def limb_copies(table: Table, numbers: Mapping[str, Value]) -> list[Limb]:
    """The limb of one table, repeated about its axis: expressions are of the first copy's frame, which turns too."""
    names = {**numbers, **dict(zip("xyz", np.eye(3), strict=True))}
    for name, point in table.get("points", {}).items():
        names[name] = vector_of(point, names)
    chains = [table.get("joints", []), *(branch["joints"] for branch in table.get("branch", []))]
    joints = [tuple(joint_of(joint, names) for joint in chain) for chain in chains]
    limb = Limb(
        joints[0] if len(joints) > 1 else (),
        tuple(joints[1:] or joints),
        vector_of(table["centre"], names) if "centre" in table else None,
    )
    repeat = table.get("repeat", {"count": 1})
    angles = repeat.get("angles") or [360.0 * k / repeat["count"] for k in range(repeat["count"])]
    through = vector_of(repeat.get("through", [0, 0, 0]), numbers)
    copies = []
    for angle in angles:
        R = turn_about(vector_of(repeat.get("axis", [0, 0, 1]), numbers), math.radians(angle))
        copies.append(moved_limb(limb, R, through - R @ through))
    return copies


def robot_of(table: Table, dimensions: Mapping[str, float] | None = None) -> Robot:
    """The robot of a file's table at its typical dimensions, some of them replaced (degrees where they are angles)."""
    names = numbers_of(table, dimensions or {})
    limbs = [limb for entry in table["limb"] for limb in limb_copies(entry, names)]
    return Robot(str(table["name"]), vector_of(table["home"], names), tuple(limbs))
