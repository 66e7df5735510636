"""Starter: a commented case file for any robot."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from ...models import Dimension, Model, Parameter
from ..units import Units
from .settings import Search
from .toml import option_text, plain_value, toml_text

_UNITS = Units("cm", "deg")

#: Half range of a starter's free numbers, as a part of their typical values.
_SPREAD = 0.25
#: Other rotations, for a robot that can make them: one with fewer than six freedoms keeps to its own.
_ROTATIONS = (
    "# rotation = { axis = [0, 0, 1], angle = { min = -20, max = 20 } }   # about this axis only",
    "# rotation = { axis = [0, 0, 1], angle = 10 }                        # fixed; left out: no rotation",
)


def starter_case(model: Model, robot_file: str | None = None) -> str:
    """Return the text of a case file for a robot at its typical dimensions, with the pose and one dimension free.

    The case can be solved as it is. Comments in the text explain its keys.

    Args:
        model: the robot.
        robot_file: name of the file that the robot is from, beside the case; None for a robot by name or definition.
    """
    z, search = model.home[2], Search()
    lengths = [abs(value) for item in model.parameters if item.dimension is Dimension.LENGTH for value in item.typical]
    reach = _SPREAD * (math.hypot(*model.home) or max(lengths, default=0.0) or _size(model)) or 1.0
    position = ", ".join(_free_number(value, reach) for value in model.home)
    options = [f"{key} = {option_text(value)}" for key, value in model.options.items() if key != "definition"]
    definition = model.options.get("definition")
    units = _units_of(model)
    robot = f'model = "{model.name}"' if definition is None else f"definition = {toml_text(plain_value(definition))}"
    if robot_file is not None:
        robot = f"file = {json.dumps(robot_file, ensure_ascii=False)}"
    lines = [
        f'title = "My {model.name}"',
        "",
        "[units]",
        f"length = {json.dumps(units.length, ensure_ascii=False)}".ljust(28)
        + "# a label, carried to every output; nothing is converted",
        f'angle = "{units.angle}"               # or "rad"',
        "",
        "[robot]",
        robot,
        *options,
        *(
            ["characteristic_length = 1   # by which unit couples count beside unit forces"]
            if model.has_couples
            else []
        ),
        "",
        "# A number is fixed; { min = a, max = b } is free between its bounds, with an optional start.",
        "[robot.parameters]",
        *(_parameter_line(parameter, units, is_free=index == 0) for index, parameter in enumerate(model.parameters)),
        "",
        "[pose]                        # of the platform in the base's frame, z along the base's normal",
        f"position = [{position}]",
        "rotation = { angle = { min = -20, max = 20 } }                        # any axis, at most 20 deg",
        *(_ROTATIONS if model.generic is None or model.generic.constraints == 0 else ()),
        "",
        "[[task]]                      # the motion that the platform must make",
        'name = "my task"',
        'sense = "max"                 # or "min": much or little work rate into this motion',
        "axis = [0, 1, 2]              # direction of the screw axis, any length but zero",
        f"point = [0, 0, {z:g}]".ljust(30) + "# any point on it",
        "pitch = 2                     # translation per radian; 0: a rotation; inf: a translation along the axis",
        "",
        "# [limits]                    # of a buildable design; see the documentation for all",
        *_limit_lines(model),
        "",
        "[solve]",
        f"starts = {search.starts}".ljust(30) + "# starting points; more find the best of several optima more surely",
        f"seed = {search.seed}",
    ]
    return "\n".join(lines) + "\n"


def _limit_lines(model: Model) -> list[str]:
    """Return lines of limits, as comments."""
    if not model.legs:
        return ["# rate_share = { max = 0.5 }"]
    z, apart = model.home[2], math.inf
    cone = ["# base_joint_angle = 45       # half angle of each joint's cone about the base's normal"]
    if model.joints:
        ends = [ca.horzcat(*[getattr(leg, plate) for leg in model.legs]).T for plate in ("base", "platform")]
        base, platform = (
            each.full() for each in ca.Function("ends", [model.symbols], ends).call([ca.DM(model.typical)])
        )
        lengths = np.linalg.norm(platform + model.home - base, axis=1)
        z, cone = float(f"{lengths.max():.3g}"), []
        # Legs that share a joint have no clearance.
        pairs = itertools.combinations(range(len(base)), 2)
        apart = min((math.dist(plate[i], plate[j]) for i, j in pairs for plate in (base, platform)), default=0.0)
    clearance = 0.02 * z
    return [
        f"# leg_length = {{ min = {0.5 * z:g}, max = {1.5 * z:g} }}",
        *cone,
        *([f"# leg_clearance = {{ min = {clearance:g} }}"] if apart > clearance else []),
    ]


def _size(model: Model) -> float:
    """Return the largest distance of a point of a robot's drawing from the origin of its body, at typical dimensions.

    It is 0 for a robot without a drawing, or with one that depends on more than the dimensions.
    """
    symbols, typical = model.symbols, ca.DM(model.typical)
    sizes = []
    for point in model.scene.points:
        size = ca.norm_2(point.position)
        if not ca.symvar(ca.substitute(size, symbols, ca.SX(typical))):
            sizes.append(float(ca.Function("size", [symbols], [size])(typical)))
    return max((each for each in sizes if math.isfinite(each)), default=0.0)


def _units_of(model: Model) -> Units:
    """Return the units of a starter: that of a robot given joint by joint, where it states one, or plainly ``unit``."""
    return _UNITS if not model.structure else Units(model.length_unit or "unit", "deg")


def _parameter_line(parameter: Parameter, units: Units, *, is_free: bool) -> str:
    """Return the line of a parameter, free about its value in a starter or fixed there."""
    values = [units.shown(value, parameter.dimension) for value in parameter.starter or parameter.typical]
    width = _SPREAD * max(abs(value) for value in values) or 1.0
    domain = [units.shown(end, parameter.dimension) for end in (parameter.lower, parameter.upper)]
    texts = [_free_number(value, width, domain) if is_free else f"{value:.10g}" for value in values]
    text = texts[0] if len(texts) == 1 else f"[{', '.join(texts)}]"
    unit = units.label(parameter.dimension) or "a plain number"
    return f"{parameter.name} = {text}   # {parameter.description}, {unit}"


def _free_number(middle: float, width: float, domain: Sequence[float] = (-math.inf, math.inf)) -> str:
    """Return a range about a number as TOML; the number alone where its domain leaves no range."""
    lower, upper = max(middle - width, domain[0]), min(middle + width, domain[1])
    return f"{{ min = {lower:g}, max = {upper:g} }}" if lower < upper else f"{middle:g}"
