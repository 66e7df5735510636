"""Results as tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from ...models import Dimension, Model, Parameter, component_names
from ..case.case import Case
from ..case.pose import Free, Value, sizes_of_turn
from ..units import Units

if TYPE_CHECKING:
    from ..results.regression import CaseCheck

#: A free number below this part of its range is shown as 0; in JSON it stands as it is.
_NOISE = 1e-9
#: So many violated limits are shown.
_SHOWN = 8
#: A rotation by less than this has no axis that means anything.
_TURNED = 1e-9


def print_solution(console: Console, case: Case, result: dict[str, Any]) -> None:
    """The result of a solve, as :func:`screwsynth.nlp.results.data.result_of` gives it."""
    console.print(headline(case, result))
    if "parameters" in result:
        console.print(design_table(case, result))
        console.print(pose_table(case, result) if "poses" in result else limb_table(case, result))
    if result.get("limits"):
        console.print(limit_table(result))
    if "tolerance" in result:
        console.print(tolerance_line(case, result))
    for line in verdict_lines(case, result):
        console.print(line)
    for line in certificate_lines(result["certificate"]):
        console.print(line)


def print_certified(console: Console, case: Case, result: dict[str, Any]) -> None:
    """What is proved of a case, as :func:`screwsynth.nlp.results.data.certified_of` gives it."""
    console.print(_title(case))
    for task in result["tasks"]:
        if len(result["tasks"]) > 1:
            console.print(_labelled("task", f"{task['name']}, {task['sense']} F"))
        for line in certificate_lines(task["certificate"]):
            console.print(line)
    if len(result["tasks"]) > 1 and result["certificate"] is not None:
        console.print(_labelled("combined by", case.method.value))
        for line in certificate_lines(result["certificate"]):
            console.print(line)


def print_compromise(console: Console, case: Case, result: dict[str, Any]) -> None:  # noqa: C901 - line by line
    """Several tasks brought together, as :func:`screwsynth.nlp.results.data.compromise_of` gives it."""
    combined = result["combined"]
    console.print(_title(case))
    console.print(_labelled("combined by", combined["method"]), Text(f"({result['status']})"))
    if "reached" in combined:
        console.print(Text(f"{result['status']}: this is no answer", style="bold red"))
    for name in combined["violated"]:
        console.print(Text(f"violated: {name}", style="red"))
    if "parameters" in combined:
        console.print(design_table(case, combined))
    if combined.get("limits"):
        console.print(limit_table(combined))
    console.print(outcome_table(combined))
    if combined["value"] is not None:
        console.print(_labelled(combined["method"], _number(combined["value"])))
        console.print(_labelled("verdict", combined["optimality"]["kind"]))
    for task in result["tasks"]:
        for line in certificate_lines(task["certificate"]):
            console.print(_labelled("task", task["task"]["name"]) if "task" in task else Text())
            console.print(line)
    for line in certificate_lines(combined["certificate"]):
        console.print(line)
    for notice in combined["notices"]:
        console.print(_labelled("note", notice))
    if "rank" in combined:
        for line in singularity_lines(case, {**combined, "task_is_free": False}):
            console.print(line)


def outcome_table(combined: dict[str, Any]) -> Table:
    """What bringing several tasks together means for each."""
    table = _table("task", "sense", "weight", "F", "best alone", "loss", "at this point")
    for task in combined["tasks"]:
        shown = [_number(task[key]) if task[key] is not None else "none" for key in ("F", "best", "loss")]
        unique = "" if task["unique"] else " (not unique)"
        table.add_row(
            task["name"], task["sense"], f"{task['weight']:g}", shown[0], shown[1] + unique, shown[2], task["verdict"]
        )
    return table


def print_checks(console: Console, checks: Iterable[CaseCheck]) -> None:
    """Cases beside what they must compute and what the literature prints."""
    from .checks import describe  # noqa: PLC0415 - a solve does not need it

    table = _table("case", "expected", "published", "seconds")
    faults: list[Text] = []
    for check in checks:
        reproduced = sum(row.reproduced for row in check.published)
        held = sum(row.passed for row in check.expected)
        published = f"{reproduced} reproduced, {len(check.published) - reproduced} not" if check.published else ""
        table.add_row(
            Text(check.name, style="" if check.passed else "bold red"),
            f"{held} of {len(check.expected)} hold",
            published,
            f"{check.seconds:.1f}",
        )
        faults += [
            Text(f"{check.name}: {row.quantity} is {row.computed}, expected {row.expected} within {row.tolerance:g}")
            for row in check.expected
            if not row.passed
        ]
        faults += [Text(f"{check.name}: newly changed: {describe(row)}") for row in check.published if not row.passed]
    console.print(table)
    for fault in faults:
        console.print(fault, style="red")
    console.print(
        "all hold" if not faults else f"{len(faults)} do not hold", style="green" if not faults else "bold red"
    )


def print_state(console: Console, case: Case, result: dict[str, Any]) -> None:
    """The robot at one point, with its Jacobian."""
    console.print(_title(case))
    for task in result["tasks"]:
        console.print(_task(task, case.units))
        console.print(_labelled("F", _number(0.0 if task["task_is_free"] else task["F"])))
    for line in _violated(result["violated"]):
        console.print(line)
    console.print(design_table(case, result))
    console.print(pose_table(case, result) if "poses" in result else limb_table(case, result))
    if result["limits"]:
        console.print(limit_table(result))
    console.print(_jacobian(case, result))
    console.print(_labelled("singular values", _listed(result["singular_values"])))
    console.print(_principal(case, result["principal_motions"]))
    for line in singularity_lines(case, result):
        console.print(line)


def print_models(console: Console, models: Iterable[tuple[str, str]]) -> None:
    """Names and descriptions of robots."""
    table = _table("robot", "what it is")
    for name, description in models:
        table.add_row(name, description)
    console.print(table)


def print_model(
    console: Console, name: str, model: Model | None, options: Sequence[tuple[str, str, str | None]]
) -> None:
    """One robot: its options (name, what is allowed, default), parameters, rows and measures.

    Without a model, because an option has no default, only the options are shown.
    """
    console.print(Text(name, style="bold"))
    if model is not None:
        console.print(Text(model.description))
    if options:
        table = _table("option", "allowed", "default")
        for option, allowed, default in options:
            table.add_row(option, allowed, "none: must be given" if default is None else default)
        console.print(table)
    if model is None:
        return
    table = _table("parameter", "measures", "allowed (angles in deg)", "what it is")
    for parameter in model.parameters:
        components = ", ".join(parameter.components)
        table.add_row(components, parameter.dimension.value, _domain(parameter), parameter.description)
    console.print(table)
    table = _table("row", "limb", "wrench")
    for index, row in enumerate(model.wrenches):
        table.add_row(str(index + 1), row.limb, row.kind.value)
    console.print(table)
    if model.quantities:
        table = _table("quantity", "measures", "what it is")
        for quantity in model.quantities:
            table.add_row(quantity.name, quantity.dimension.value, quantity.description)
        console.print(table)


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 3, 0, 0))
    for column in columns:
        table.add_column(column, overflow="fold")
    return table


def _title(case: Case) -> Text:
    return Text(case.title or case.name, style="bold")


def _labelled(label: str, text: str) -> Text:
    return Text.assemble((f"{label}  ", "dim"), text)


def _number(value: float) -> str:
    return f"{value + 0.0:.7g}"


def _listed(values: Iterable[float]) -> str:
    return "  ".join(f"{value + 0.0:.5g}" for value in values)


def headline(case: Case, result: dict[str, Any]) -> RenderableType:
    """What was found: title, task, and F or the status of what is no answer."""
    status = result["status"]
    top = Group(_title(case), _task(result["task"], case.units)) if "task" in result else _title(case)
    if result["F"] is None:
        return Group(top, Text(f"{status}: this is not an optimum", style="bold red"))
    over = f", {result['over_poses']} over {len(result['poses'])} poses" if "poses" in result else ""
    word = {"max": "largest", "min": "smallest"}[result["sense"]] if status == "optimal" else "fixed point:"
    if status == "optimal" and result["optimality"]["kind"].startswith("stationary"):
        status = "stationary, not proven optimal"
    if result["singular"]:
        status += f", singular: rank {result['rank']}"
    # What is left of an F that nothing resists is rounding.
    F = 0.0 if result.get("task_is_free") and "poses" not in result else result["F"]
    return Group(top, Text.assemble(f"{word} F = ", (_number(F), "bold green"), f"   ({status}{over})"))


def _task(task: dict[str, Any], units: Units) -> Text:
    return _labelled("task", f"{task['name']}, {task['sense']} F: {motion_words(task, units)}")


def design_table(case: Case, result: dict[str, Any]) -> Table:
    """Every dimension and the pose: value, unit, the range it was free in, and the limit it lies on."""
    reached = "reached" in result
    held = {side["name"]: side for side in (result.get("optimality") or {}).get("active", []) if not reached}
    owed = {row["name"]: row["derivative"] for row in result.get("sensitivity", [])}
    table = _table(
        "", "reached" if reached else "value", "unit", "free between", *(["held by"] if held or owed else [])
    )
    units = case.units

    def add(name: str, dimension: Dimension, value: float, given: Value) -> None:
        row = [name, _settled(value, given, units, dimension), units.label(dimension), _range(given, units, dimension)]
        unit = units.label(dimension) or "unit"
        fixed = f"fixed, {owed[name] + 0.0:+.4g} F/{unit}" if name in owed else ""
        table.add_row(*row, *([_held(held, name, unit) or fixed] if held or owed else []))

    for parameter in case.model.parameters:
        shown = result["parameters"][parameter.name]
        values = shown if isinstance(shown, list) else [shown]
        for name, value, given in zip(parameter.components, values, case.components(parameter.name), strict=True):
            add(name, parameter.dimension, value, given)
    stated = result.get("stated_poses", [result["pose"]])
    for prefix, pose, found in zip(case.pose_prefixes, case.poses, stated, strict=True):
        for name, value, given in zip(component_names("p", 3), found["position"], pose.position, strict=True):
            add(f"{prefix}{name}", Dimension.LENGTH, value, given)
        angle, is_held = pose.rotation.angle, pose.rotation.axis is not None
        turned = abs(units.to_internal(found["angle"], Dimension.ANGLE)) > _TURNED
        if not is_held and isinstance(angle, Free):
            # The sign of the angle means nothing then: what is allowed is its size.
            angle = Free(*sizes_of_turn(angle))
        axis = _listed(found["axis"]) if turned or is_held else "none"
        table.add_row(f"{prefix}axis", axis, "", "" if is_held else "any direction")
        add(f"{prefix}angle", Dimension.ANGLE, found["angle"], angle)
    return table


def pose_table(case: Case, result: dict[str, Any]) -> Table:
    """The robot at every pose: F, where it stands, and the range of each measure over its limbs."""
    measures = [item for item in case.model.quantities if item.name in result["poses"][0]["quantities"]]
    words = [item.name.replace("_", " ").removesuffix(" angle") for item in measures]
    labels = [f"{word}\n{case.units.label(item.dimension)}" for word, item in zip(words, measures, strict=True)]
    table = _table("pose", "F", *component_names("p", 3), "angle", *labels, "rank")
    for k, pose in enumerate(result["poses"]):
        ranges = []
        for item in measures:
            values = pose["quantities"][item.name].values()
            low = "" if item.dimension is Dimension.ANGLE else f"{min(values):.5g} .. "
            ranges.append(f"{low}{max(values):.5g}")
        at = [_number(value) for value in (*pose["pose"]["position"], pose["pose"]["angle"])]
        table.add_row(str(k + 1), _number(pose["F"]), *at, *ranges, str(pose["rank"]))
    return table


def _settled(value: float, given: Value, units: Units, dimension: Dimension) -> str:
    """A number, 0 where it is rounding error beside the range that it was free in."""
    if isinstance(given, Free):
        width = units.shown(given.upper - given.lower, dimension)
        value = 0.0 if abs(value) < _NOISE * width else value
    return _number(value)


def _range(given: Value, units: Units, dimension: Dimension) -> str:
    if not isinstance(given, Free):
        return ""
    return f"{units.shown(given.lower, dimension):g} .. {units.shown(given.upper, dimension):g}"


def _held(held: dict[str, Any], name: str, unit: str) -> str:
    side = held.get(name)
    return "" if side is None else f"{side['bound']}, {side['multiplier']:.4g} F/{unit}"


def limb_table(case: Case, result: dict[str, Any]) -> Table:
    """Every row of the Jacobian: its rate, its share of F, and the measures of its limb."""
    couples = any(row.kind.value == "couple" for row in case.model.wrenches)
    measures = list(result["quantities"])
    labels = [f"{name.replace('_', ' ')}\n{case.units.label(_dimension(case.model, name))}" for name in measures]
    table = _table("limb", *(["wrench"] if couples else []), "rate", "share of F", *labels)
    total = sum(rate**2 for rate in result["rates"])
    for row, rate in zip(case.model.wrenches, result["rates"], strict=True):
        share = f"{100 * rate**2 / total:.1f} %" if total > 0 and not result["task_is_free"] else ""
        shown = [f"{result['quantities'][name].get(row.limb, float('nan')):.5g}" for name in measures]
        table.add_row(row.limb, *([row.kind.value] if couples else []), f"{rate:+.6g}", share, *shown)
    return table


def _dimension(model: Model, name: str) -> Dimension:
    return next(quantity.dimension for quantity in model.quantities if quantity.name == name)


def _jacobian(case: Case, result: dict[str, Any]) -> Table:
    table = _table("J", "f_x", "f_y", "f_z", "m_x", "m_y", "m_z")
    for row, values in zip(case.model.wrenches, result["jacobian"], strict=True):
        table.add_row(row.limb, *(f"{value:+.6g}" for value in values))
    return table


def limit_table(result: dict[str, Any]) -> Table:
    """Every limit of the case: how near the design comes to it, where, and what it costs."""
    table = _table("limit", "", "unit", "nearest", "margin", "where", "costs")
    for row in result["limits"]:
        where = [_place(name) for name in row["active"]] or [_place(row["nearest"])]
        shown = ", ".join(where[:3]) + (f" and {len(where) - 3} more" if len(where) > 3 else "")
        unit = row["unit"] or "unit"
        cost = f"{row['cost'] + 0.0:+.4g} F/{unit}" if row["active"] and row["cost"] else ""
        value, margin = ("none" if row[key] is None else _beside(row[key], row["limit"]) for key in ("value", "margin"))
        margin += ", active" if row["active"] else ""
        table.add_row(row["key"], f"{row['limit']:g}", row["unit"], value, margin, shown, cost)
    return table


def tolerance_line(case: Case, result: dict[str, Any]) -> Text:
    """What inexact joint centres may cost."""
    lost, unit = result["tolerance"], case.units.length
    part = f" ({100 * lost['loss'] / result['F']:.2g} %)" if result["F"] else ""
    text = f"{lost['joint_centre']:g} {unit} at every joint centre: F may be worse by {lost['loss']:.4g}{part}"
    return _labelled("tolerance", text)


def _beside(value: float, limit: float) -> str:
    """A number, 0 where it is rounding error beside a limit."""
    return f"{0.0 if abs(value) < _NOISE * (abs(limit) or 1.0) else value:.6g}"


def _place(name: str) -> str:
    """Where a limit is, from its name: everything behind what it limits."""
    return name.partition(" ")[2]


def certificate_lines(certificate: dict[str, Any] | None) -> Iterable[Text]:
    """What is proved, and what it took."""
    if certificate is None:
        return
    style = "bold green" if certificate["status"] == "proved" else "bold red"
    yield Text.assemble(("certificate  ", "dim"), (certificate["statement"], style))
    gap = certificate["gap"]
    if gap is not None:
        relative = certificate["relative_gap"]
        part = "" if relative is None else f" ({relative:.2e} of it)"
        yield _labelled("gap", f"{gap:.3g}{part}")
    left = f", {certificate['open']:,} left" if certificate["open"] else ""
    boxes = f"{certificate['boxes']:,} boxes{left} in {certificate['seconds']:.2f} s"
    yield _labelled("search", f"{boxes}, engine {certificate['engine']}")


def verdict_lines(case: Case, result: dict[str, Any]) -> Iterable[Text]:
    """What the point is, by which evidence, and how the starts ended."""
    evidence = result["optimality"]
    if evidence is not None:
        yield _labelled("verdict", evidence["kind"])
        for direction in evidence["flat_directions"]:
            yield _labelled("flat along", ", ".join(f"{name} {rate:+.4g}" for name, rate in direction.items()))
        if evidence["stationarity"] is not None:
            checks = f"stationarity {evidence['stationarity']:.1e}, feasibility {evidence['feasibility']:.1e}"
            curvature = evidence["reduced_hessian_eigenvalues"]
            smallest = f", smallest curvature {min(curvature):.2e}" if curvature else ", no free direction left"
            yield _labelled("evidence", checks + ("" if "reached" in result else smallest))
    yield from _violated((result.get("reached") or {}).get("violated", []))
    for row in result.get("relaxation", []):
        unit = f" {row['unit']}" if row["unit"] else ""
        yield Text(f"would be feasible with {row['key']} = {row['needed']:.6g}{unit} instead of {row['limit']:g}{unit}")
    yield from _starts(result["starts"])
    if "rank" in result and "reached" not in result:
        yield from singularity_lines(case, result)


def _violated(sides: Sequence[dict[str, Any]]) -> Iterable[Text]:
    if len(sides) > _SHOWN:
        yield Text(f"{len(sides)} limits are violated; the first {_SHOWN}:", style="red")
    for side in sides[:_SHOWN]:
        wanted = {"min": "at least", "max": "at most", "equal": "exactly"}[side["bound"]]
        yield Text(f"violated: {side['name']} = {side['value']:.6g}, must be {wanted} {side['limit']:.6g}", style="red")


def _starts(starts: dict[str, Any]) -> Iterable[Text]:
    if not starts["run"]:
        return
    yield _labelled("starts", f"{starts['converged']} of {starts['run']} converged")
    for sentence, count in starts["failed"].items():
        yield Text(f"  {count}: {sentence}", style="yellow")
    for index, found in enumerate(starts["optima"][:5]):
        note = f", spread over {100 * found['spread']:.0f} % of the ranges" if found["spread"] > 1e-3 else ""
        if index and _number(found["F"]) == _number(starts["optima"][index - 1]["F"]):
            note += ", at another point"
        yield Text(f"  {found['count']} at F = {_number(found['F'])}{note}")
    if len(starts["optima"]) > 5:
        yield Text(f"  and {len(starts['optima']) - 5} worse optima")


def _principal(case: Case, motions: dict[str, Any]) -> Table:
    """Motions at which F is stationary: among those of unit rotation, and among translations of unit speed."""
    table = _table("resisted", "F", "motion")
    for kind in ("rotations", "translations"):
        ranks = ("least", "", "most")
        for rank, motion in zip(ranks, motions[kind], strict=True):
            noise = _NOISE * motions[kind][-1]["F"]
            table.add_row(rank, _number(motion["F"] if motion["F"] > noise else 0.0), motion_words(motion, case.units))
    return table


def singularity_lines(case: Case, result: dict[str, Any]) -> Iterable[Text]:
    """Rank of the Jacobian, and the motions that nothing resists."""
    if result["task_is_free"]:
        words = motion_words(result["task"], case.units)
        yield Text(
            f"singular: F is 0, so the platform can make the task's motion ({words}) with every actuator locked",
            style="yellow",
        )
    if not result["singular"]:
        yield _labelled("rank of J", f"{result['rank']}")
        return
    several = " combinations of" if len(result["free_motions"]) > 1 else ""
    yield _labelled("rank of J", f"{result['rank']}: the structure is singular; nothing resists{several}")
    for motion in result["free_motions"]:
        yield Text(f"  {motion_words(motion, case.units)}")


def motion_words(motion: dict[str, Any], units: Units) -> str:
    """A motion in words: its axis, point and pitch."""

    def vector(values: Sequence[float]) -> str:
        noise = _NOISE * max(1.0, *map(abs, values))
        return f"({', '.join(f'{value if abs(value) > noise else 0:.4g}' for value in values)})"

    if motion["pitch"] == "inf":
        return f"translation along {vector(motion['axis'])}"
    pitch = "rotation" if abs(motion["pitch"]) < 1e-9 else f"screw of pitch {motion['pitch']:.5g} {units.length}"
    return f"{pitch} about {vector(motion['axis'])} through {vector(motion['point'])}"


def _domain(parameter: Parameter) -> str:
    units = Units()
    ends = [units.shown(end, parameter.dimension) for end in (parameter.lower, parameter.upper)]
    lower = "" if ends[0] == -float("inf") else f">= {ends[0]:g}"
    upper = "" if ends[1] == float("inf") else f"<= {ends[1]:g}"
    return ", ".join(part for part in (lower, upper) if part) or "any"
