"""Results as tables of text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ...models import Dimension, WrenchKind, component_names
from ..case.case import Case
from ..case.pose import Free, Value, sizes_of_turn
from ..units import Units
from .text import TextTable
from .wording import NOISE, SET, motion_words, number, numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..case.settings import Search
    from ..solver.multistart import ProgramSolution
    from .data import ActiveData, CombinedData, OptimalityData, SolveResult
    from .evaluation import PrincipalMotionsData
    from .parts import LimitData, MarginData, PosesData, RobotData, SensitivityData, VersionsData

#: A rotation by less than this, radians, has no determined axis.
_TURNED = 1e-9
#: Largest number of places named where a limit is active.
_PLACES = 3
#: Largest number of optima shown in full.
MOST_OPTIMA = 12


def design_table(
    case: Case,
    robot: RobotData,
    *,
    reached: bool = False,
    active: Sequence[ActiveData] = (),
    sensitivity: Sequence[SensitivityData] = (),
) -> TextTable:
    """Return every dimension and the pose: value, unit, the range of a free one, and its active bound or limit.

    Args:
        case: the case.
        robot: at the point.
        reached: whether the point is only the one that a failed solve reached.
        active: bounds and limits that hold the point.
        sensitivity: of the optimal F to fixed numbers.
    """
    units = case.units
    # Variables' bounds come first among the active sides, and the first side of a name stays: no constraint hides one.
    held = {side.name: f"{side.bound}, {side.multiplier:.4g} F" for side in reversed(active)}
    fixed = {row.name: f"fixed, {row.derivative + 0.0:+.4g} F" for row in sensitivity}
    column = ("held by",) if held or fixed else ()
    rows: list[tuple[str, ...]] = []

    def add(name: str, dimension: Dimension, value: float, given: Value) -> None:
        row = (
            name,
            _number_text(value, given, units, dimension),
            units.label(dimension),
            _range_text(given, units, dimension),
        )
        reason = held.get(name) or fixed.get(name)
        why = f"{reason}/{units.label(dimension) or 'unit'}" if reason else ""
        rows.append((*row, *((why,) if column else ())))

    for parameter in case.model.parameters:
        shown = robot.parameters[parameter.name]
        values = shown if isinstance(shown, tuple) else (shown,)
        for name, value, given in zip(
            case.component_names(parameter), values, case.components(parameter.name), strict=True
        ):
            add(name, parameter.dimension, value, given)
    stated = (robot.pose,) if robot.several is None else robot.several.stated_poses
    for prefix, pose, found in zip(case.pose_prefixes, case.poses, stated, strict=True):
        for name, value, given in zip(component_names("p", 3), found.position, pose.position, strict=True):
            add(f"{prefix}{name}", Dimension.LENGTH, value, given)
        angle, is_held = pose.rotation.angle, pose.rotation.axis is not None
        turned = abs(units.to_internal(found.angle, Dimension.ANGLE)) > _TURNED
        if not is_held and isinstance(angle, Free):
            # Then only the size of the angle is limited, and its sign is arbitrary.
            angle = Free(*sizes_of_turn(angle))
        axis = numbers(found.axis) if turned or is_held else "none"
        row = (f"{prefix}axis", axis, "", "" if is_held else "any direction")
        rows.append((*row, *(("",) if column else ())))
        add(f"{prefix}angle", Dimension.ANGLE, found.angle, angle)
    headers = ("", "reached" if reached else "value", "unit", "free between", *column)
    return TextTable(headers, tuple(rows))


def solved_design_table(case: Case, result: SolveResult, robot: RobotData) -> TextTable:
    """Return the design of a solve, with its active bounds where the point is an answer."""
    reached = result.reached is not None
    active = () if reached or result.optimality is None else result.optimality.active
    return design_table(case, robot, reached=reached, active=active, sensitivity=result.sensitivity or ())


def combined_design_table(case: Case, combined: CombinedData, robot: RobotData) -> TextTable:
    """Return the design at the combined point of several tasks."""
    reached = combined.method_point is None
    active = () if reached or combined.optimality is None else combined.optimality.active
    return design_table(case, robot, reached=reached, active=active)


def _number_text(value: float, given: Value, units: Units, dimension: Dimension) -> str:
    """Return a number's text, 0 where it is rounding error beside the range of a free number."""
    if isinstance(given, Free):
        width = units.shown(given.upper - given.lower, dimension)
        value = 0.0 if abs(value) < NOISE * width else value
    return number(value)


def _range_text(given: Value, units: Units, dimension: Dimension) -> str:
    """Return the range of a free number; empty for a fixed one."""
    if not isinstance(given, Free):
        return ""
    return f"{units.shown(given.lower, dimension):g} .. {units.shown(given.upper, dimension):g}"


def robot_table(case: Case, robot: RobotData) -> TextTable:
    """Return the robot at every pose, or every limb where there is one pose."""
    return _limb_table(case, robot) if robot.several is None else _pose_table(case, robot.several)


def _pose_table(case: Case, several: PosesData) -> TextTable:
    """Return the robot at every pose: F, position and angle, and the range of each measure over its limbs."""
    measures = [item for item in case.model.quantities if item.name in several.poses[0].quantities]
    words = [item.name.replace("_", " ").removesuffix(" angle") for item in measures]
    labels = [f"{word}\n{case.units.label(item.dimension)}" for word, item in zip(words, measures, strict=True)]
    rows = []
    for k, pose in enumerate(several.poses):
        ranges = []
        for item in measures:
            values = pose.quantities[item.name].values()
            low = "" if item.dimension is Dimension.ANGLE else f"{min(values):.5g} .. "
            ranges.append(f"{low}{max(values):.5g}")
        at = [number(value) for value in (*pose.pose.position, pose.pose.angle)]
        rows.append((str(k + 1), number(pose.F), *at, *ranges, str(pose.rank)))
    return TextTable(("pose", "F", *component_names("p", 3), "angle", *labels, "rank"), tuple(rows))


def _limb_table(case: Case, robot: RobotData) -> TextTable:
    """Return every row of the Jacobian: its rate, its share of F, and the measures of its limb."""
    model, rates = case.model, robot.rates or ()
    couples = any(row.kind is WrenchKind.COUPLE for row in model.wrenches)
    measures = [item for item in model.quantities if item.name in robot.quantities]
    labels = [f"{item.name.replace('_', ' ')}\n{case.units.label(item.dimension)}" for item in measures]
    total = sum(rate**2 for rate in rates)
    rows = []
    for row, rate in zip(model.wrenches, rates, strict=True):
        share = f"{100 * rate**2 / total:.1f} %" if total > 0 and not robot.task_is_free else ""
        shown = [f"{robot.quantities[item.name].get(row.limb, math.nan):.5g}" for item in measures]
        rows.append((row.limb, *((row.kind.value,) if couples else ()), f"{rate:+.6g}", share, *shown))
    return TextTable(("limb", *(("wrench",) if couples else ()), "rate", "share of F", *labels), tuple(rows))


def jacobian_table(case: Case, robot: RobotData) -> TextTable:
    """Return the Jacobian."""
    rows = zip(case.model.wrenches, robot.jacobian, strict=True)
    return TextTable(
        ("J", "f_x", "f_y", "f_z", "m_x", "m_y", "m_z"),
        tuple((row.limb, *(f"{value:+.6g}" for value in values)) for row, values in rows),
    )


def principal_table(motions: PrincipalMotionsData, units: Units) -> TextTable:
    """Return the motions at which F is stationary: those of unit rotation, then translations of unit speed."""
    rows = []
    for kind in (motions.rotations, motions.translations):
        noise = NOISE * kind[-1].F
        for rank, motion in zip(("least", "", "most"), kind, strict=True):
            F = 0.0 if noise >= motion.F else motion.F
            rows.append((rank, number(F), motion_words(motion.motion, units)))
    return TextTable(("resisted", "F", "motion"), tuple(rows))


def limit_table(limits: Sequence[LimitData]) -> TextTable:
    """Return every limit of the case: how near the design comes to it, where, and its cost."""
    rows = []
    for row in limits:
        where = [_place(name) for name in row.active] or [_place(row.nearest)]
        more = f" and {len(where) - _PLACES} more" if len(where) > _PLACES else ""
        cost = f"{row.cost + 0.0:+.4g} F/{row.unit or 'unit'}" if row.active and row.cost else ""
        margin = _limit_number_text(row.margin, row.limit) + (", active" if row.active else "")
        shown = ", ".join(where[:_PLACES]) + more
        rows.append(
            (row.key, f"{row.limit:g}", row.unit, _limit_number_text(row.value, row.limit), margin, shown, cost)
        )
    return TextTable(("limit", "", "unit", "nearest", "margin", "where", "costs"), tuple(rows))


def _limit_number_text(value: float | None, limit: float) -> str:
    """Return a number's text, 0 where it is rounding error beside a limit."""
    if value is None:
        return "none"
    return f"{0.0 if abs(value) < NOISE * (abs(limit) or 1.0) else value:.6g}"


def _place(name: str) -> str:
    """Return the place of a limit: its name without the first word."""
    return name.partition(" ")[2]


def outcome_table(combined: CombinedData) -> TextTable:
    """Return each task at the combined point."""
    rows = []
    for task in combined.tasks:
        F, best, loss = ("none" if value is None else number(value) for value in (task.F, task.best, task.loss))
        best += "" if task.unique else " (not unique)"
        verdict = "" if task.verdict is None else task.verdict.value
        rows.append((task.name, task.sense.value, f"{task.weight:g}", F, best, loss, verdict))
    return TextTable(("task", "sense", "weight", "F", "best alone", "loss", "at this point"), tuple(rows))


def margin_table(margins: Sequence[MarginData]) -> TextTable:
    """Return every margin."""
    rows = [
        (
            row.name,
            row.bound,
            "none" if row.value is None else f"{row.value:.6g}",
            f"{row.limit:.6g}",
            "none" if row.margin is None else f"{row.margin:.4g}",
            row.unit,
            "active" if row.active else "",
        )
        for row in margins
    ]
    return TextTable(("where", "bound", "value", "limit", "margin", "unit", ""), tuple(rows))


def active_table(optimality: OptimalityData) -> TextTable:
    """Return the active bounds and limits with their multipliers."""
    rows = [(side.name, side.bound, f"{side.value:.7g}", f"{side.multiplier:.4g}") for side in optimality.active]
    return TextTable(("", "side", "value", "multiplier, F per unit"), tuple(rows))


def optimum_table(solution: ProgramSolution) -> TextTable:
    """Return the best of the distinct optima that a solve found: F, and every variable."""
    units, variables = solution.nlp.case.units, solution.nlp.program.variables
    labels = [(variable.name, units.label(variable.dimension)) for variable in variables]
    rows = []
    for found in solution.optima[:MOST_OPTIMA]:
        spread = f", a set over {100 * found.spread:.0f} % of the ranges" if found.spread > SET else ""
        at = [
            f"{units.shown(float(value), variable.dimension):.6g}"
            for value, variable in zip(found.x, variables, strict=True)
        ]
        rows.append((f"F = {found.F:.7g}, {found.count} starts{spread}", *at))
    return TextTable(("", *(f"{name}, {unit}" if unit else name for name, unit in labels)), tuple(rows))


def origin_table(versions: VersionsData, search: Search, seconds: float) -> TextTable:
    """Return versions, seed, starts and time: all that the numbers depend on."""
    rows = [(name, str(getattr(versions, name))) for name in versions.marks]
    rows += [("seed", str(search.seed)), ("starts", str(search.starts)), ("seconds", f"{seconds:.3g}")]
    return TextTable(("", ""), tuple(rows))
