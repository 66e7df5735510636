"""Tables of robots: options, parameters, quantities, rows of the Jacobian, and loops."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from ...models import Dimension, Model, Parameter
from ..case.robots import ModelOption
from ..units import Units
from .joints import idle_words
from .lines import counted
from .text import Line, TextTable, Tone, in_part


def models_table(models: Iterable[tuple[str, str]]) -> TextTable:
    """Return names and descriptions of robots."""
    return TextTable(("robot", "description"), tuple(models))


def models_words(models: Iterable[tuple[str, str]]) -> Iterator[Line | TextTable]:
    """Yield the names of robots, grouped by the motion at the end of each description, then the descriptions."""
    listed = tuple(models)
    motions: dict[str, list[str]] = {}
    for name, description in listed:
        motions.setdefault(description.rpartition("; ")[2] if "; " in description else "other robots", []).append(name)
    yield Line(f"{counted(len(listed), 'robot')}; screwsynth models NAME shows one", tone=Tone.TITLE)
    for motion, names in sorted(motions.items(), key=lambda each: (each[0] == "other robots", -len(each[1]))):
        yield Line(", ".join(names), label=motion)
    yield from in_part("descriptions", [models_table(listed)])


def model_words(name: str, model: Model | None, options: Sequence[ModelOption]) -> Iterator[Line | TextTable]:
    """Yield a robot: its options, parameters, quantities, loops and rows.

    Args:
        name: name of the robot.
        model: the robot; None if an option without a default is missing, so that only the options are shown.
        options: options of the robot.
    """
    yield Line(name, tone=Tone.TITLE)
    if model is not None:
        yield Line(model.description)
    if options:
        choices = [
            (option.name, option.allowed, option.default or "none: must be given", option.meaning) for option in options
        ]
        # The meaning is annotated by few robots of other packages.
        columns = 4 if any(option.meaning for option in options) else 3
        headers = ("option", "allowed", "default", "meaning")
        yield TextTable(headers[:columns], tuple(row[:columns] for row in choices))
    if model is None:
        return
    yield TextTable(
        ("parameter", "kind", "allowed", "meaning"),
        tuple(
            (", ".join(item.components), item.dimension.value, _domain(item), item.description)
            for item in model.parameters
        ),
    )
    if model.structure:
        yield from _freedom_lines(model)
        if model.legs:
            words = f"{', '.join(leg.name for leg in model.legs)} (a case can limit their lengths: leg_length)"
            yield Line(words, label="straight legs")
    words = (
        "limb wrenches of magnitudes f_i do work in the motion of a task at a rate of at most sqrt(sum f_i^2) sqrt(F)"
    )
    yield Line(words if not model.actuators else f"{words}; for actuator forces state [[load]]", label="power")
    if model.quantities:
        rows = [(item.name, item.dimension.value, item.description) for item in model.quantities]
        yield TextTable(("quantity", "kind", "meaning"), tuple(rows))
    for remark in model.remarks:
        yield Line(remark, label="note")
    yield from in_part("members", _member_tables(model))
    yield from in_part("loops", _loop_words(model))
    rows = [(str(index + 1), row.member, row.kind.value) for index, row in enumerate(model.rows)]
    yield from in_part("rows of J", [TextTable(("row", "limb", "wrench"), tuple(rows))])


def _member_tables(model: Model) -> Iterator[TextTable]:
    """Yield the members of a robot defined by joints."""
    rows = [(each.name, each.joints, str(each.wrenches), str(each.constraints)) for each in model.structure]
    if rows:
        yield TextTable(("member", "joints (* actuated)", "wrenches", "constraints"), tuple(rows))


def _freedom_lines(model: Model) -> Iterator[Line]:
    """Yield the degrees of freedom and the ranks of a robot defined by joints."""
    if model.generic is not None:
        freedoms, rank = 6 - model.generic.constraints, model.rank
        yield Line(f"{freedoms} with unlocked actuators", label="degrees of freedom")
        yield Line(f"{rank} of J, {model.generic.constraints} of the constraint wrenches", label="ranks")
        if model.generic.undetermined:
            yield Line(idle_words(model.generic.undetermined), label="note")


def _loop_words(model: Model) -> Iterator[Line | TextTable]:
    """Yield the opened loops of a robot defined by joints."""
    if not model.structure:
        return
    unknowns, every = len(model.unknowns), sum(each.equations for each in model.structure)
    free = _free_joint_words(model)
    if free:
        yield Line(f"{free}, which the pose does not determine", label="variables")
    if every == 0:
        how = f"the pose and these {len(model.free_joints)} variables (no equations)"
        how = how if free else "the pose (no unknowns, no equations)"
        yield Line(f"closed by {how}", label="loops")
        return
    loops = [
        (each.name, each.opened, str(each.unknowns), str(each.equations), str(each.equations - each.kept))
        for each in model.structure
    ]
    yield TextTable(("loop", "opened at", "unknowns", "equations", "redundant"), tuple(loops))
    kept = len(model.closure)
    words = f"{unknowns} unknowns{', including these variables' if free else ''}, {every} equations"
    words += f", {every - kept} of them redundant" if kept < every else ", none of them redundant"
    yield Line(words, label="loops")


def _free_joint_words(model: Model) -> str:
    """Return the names of the free actuator coordinates in words; empty without any."""
    joints, ending = model.free_joints, "s" * (len(model.free_joints) > 1)
    return f"coordinate{ending} of actuated joint{ending} {', '.join(joints)}" if joints else ""


def _domain(parameter: Parameter) -> str:
    """Return the allowed values of a parameter, angles in degrees."""
    units = Units()
    lower, upper = (units.shown(end, parameter.dimension) for end in (parameter.lower, parameter.upper))
    unit = " deg" if parameter.dimension is Dimension.ANGLE else ""
    parts = ["" if math.isinf(lower) else f">= {lower:g}{unit}", "" if math.isinf(upper) else f"<= {upper:g}{unit}"]
    return ", ".join(part for part in parts if part) or "any"


def unknown_lines(model: Model, *, all_assemblies: bool) -> Iterator[Line]:
    """Yield the joint coordinates that are variables of the nonlinear program: free ones, then unknowns of loops.

    Args:
        model: the robot.
        all_assemblies: If true, the search covers all assembly modes, not only the working mode of home.
    """
    if free := _free_joint_words(model):
        yield Line(f"{free}, which the pose does not determine", label="variables")
    counts: dict[str, int] = {}
    for each in model.structure:
        counts[each.limb] = counts.get(each.limb, 0) + each.unknowns
    for actuator in model.actuators:
        if actuator.joint in model.free_joints:
            counts[actuator.limb] -= 1
    modes = set() if all_assemblies else {each.limb for each in model.signs if each.is_mode}
    groups: dict[tuple[int, bool], list[str]] = {}
    for limb, count in counts.items():
        if count:
            groups.setdefault((count, limb in modes), []).append(limb)
    for (count, in_mode), limbs in groups.items():
        who = f"limb {limbs[0]}" if len(limbs) == 1 else f"limbs {', '.join(limbs)}"
        what = f"{count} joint coordinate{'s' * (count > 1)}{' each' * (len(limbs) > 1)}"
        where = "home's working mode" if in_mode else "all assembly modes"
        yield Line(f"{who}: {what}, from the loop equations; covers {where}", label="unknowns")
