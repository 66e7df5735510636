"""Results as lines of text; each line has a label and a tone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from ..case.case import Case
from ..case.task import Sense, Task
from ..evidence.optimality import CURVED, PointKind
from ..proof.certificate.certificate import CertificateStatus
from ..results.rounding import ordered, robot_size, settled, task_F
from ..solver.status import Status
from ..units import Units, objective_unit
from .joints import convention_lines, joint_lines, motion_words, reach_of, screw_words, triple
from .numbers import key_words, number, per_words, quantity_words, residual, rounded_to
from .objective import objective_words
from .text import Line, Tone

if TYPE_CHECKING:
    from ..evidence.optimality import Evidence
    from ..evidence.tolerance import ToleranceLoss
    from ..results.choices import ChoiceData, RoundingData
    from ..results.data import CertificateData, ChangeData, CombinedData, CombinedResult, SolveResult, StartsData
    from ..results.parts import LimitData, RobotData, TaskData, ViolationData

#: Largest number of violated limits, and of optima, that are shown.
_VIOLATIONS, _OPTIMA = 8, 5
#: Digits of the value of a limit with which an infeasible case would be feasible.
_DIGITS = 6
#: Relative difference of the objective between two solves of one nonlinear program; below it, solver error.
_UNCHANGED = 1e-9
#: Relative gain of an objective by a change from task to task, below which there is no gain.
_NO_GAIN = 1e-6
#: Rank of J of a robot that is not singular.
_FULL_RANK = 6
#: Share of searches that converged, of which there are many, up to which the result has a caution.
_FEW, _MANY = 0.125, 8
#: Smallest over largest singular value of J, below which a regular robot has a caution.
_NEAR = 1e-3
#: Motions that move with a tool path, by the key of the case file.
_FOLLOWED = {
    "feed": "translation along the feed at each point",
    "tool": "rotation about the tool's axis at each point",
    "thrust": "translation along the tool's axis at each point",
}
#: Distance of optimal points, as a fraction of the variable ranges: more distant points are a set, not one optimum.
SET = 1e-3


def counted(count: int, noun: str) -> str:
    """Return a count and its noun; the noun is plural unless the count is 1."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def title_line(case: Case) -> Line:
    """Return the title of a case."""
    return Line(case.title or case.name, tone=Tone.TITLE)


def task_lines(task: TaskData, units: Units) -> Iterator[Line]:
    """Yield name, sense and motion of a task; then the axis point nearest to the origin, unless the case states it."""
    points = _stated_and_nearest(task)
    if points is None:
        yield Line(f"{task.name}, {task.sense.value} F: {motion_words(task.motion, units)}", label="task")
        return
    stated, nearest = points
    screw = screw_words(task.motion, units, reach_of(task.motion, 0.0))
    yield Line(f"{task.name}, {task.sense.value} F: {screw} through {stated}", label="task")
    yield Line(f"nearest to the origin at {nearest}", label="task axis")


def followed_words(task: Task) -> str:
    """Return the motion of a task that moves with the tool path of its case."""
    return _FOLLOWED[task.follows]


def task_words(task: TaskData, units: Units) -> str:
    """Return a task's motion in words, with the stated point of its axis and the point nearest to the origin."""
    points = _stated_and_nearest(task)
    if points is None:
        return motion_words(task.motion, units)
    stated, nearest = points
    screw = screw_words(task.motion, units, reach_of(task.motion, 0.0))
    return f"{screw} through {stated}, nearest to the origin at {nearest}"


class _Points(NamedTuple):
    """Two points of a task axis as text: the stated point, and the point nearest to the origin."""

    stated: str
    nearest: str


def _stated_and_nearest(task: TaskData) -> _Points | None:
    """Return both points of a task axis; None if the case states no point or the nearest point."""
    if task.stated_point is None or task.motion.point is None:
        return None
    size = reach_of(task.motion, 0.0)
    points = _Points(triple(task.stated_point, size), triple(task.motion.point, size))
    return None if points.stated == points.nearest else points


def headline(result: SolveResult, case: Case) -> Line:
    """Return F with its unit, or the status of a solve without an answer.

    A singular answer is a caution, unless its case expects the singularity.

    Args:
        result: result of a task.
        case: the case.
    """
    robot = result.robot
    task = None if robot is None else robot.task
    measured = result.objective
    unit = "" if task is None else f" {objective_unit([task.motion.twist], case.units)}"
    unit = unit if measured is None else f" {measured.unit}"
    if result.status is Status.INTERRUPTED:
        best = None if result.reached is None or result.reached.violated else result.reached.F
        words = ", no design within the limits so far" if best is None else f": best F so far = {number(best)}{unit}"
        return Line(f"stopped before the end{words}{_not_proved(result, case, ', ')}", tone=Tone.NO_ANSWER)
    if result.status is Status.NOT_PROVED:
        found = "" if result.reached is None or result.reached.F is None else number(result.reached.F) + unit
        return Line(f"{_not_proved(result, case)}: the best design has F = {found}", tone=Tone.NO_ANSWER)
    if result.F is None:
        return Line(_no_optimum_words(result), tone=Tone.NO_ANSWER)
    several = None if robot is None else robot.several
    is_measured = measured is not None and measured.minimise is not None
    how = "" if several is None else "largest" if is_measured else several.over_poses.value
    over = "" if several is None else f", {how} over {len(several.poses)} poses"
    word, status = "at the given point", result.status.value
    is_compared = result.choice is not None or result.rounding is not None
    if result.status is Status.LOCAL:
        word = "local maximum" if result.sense is Sense.MAX else "local minimum"
    elif result.status is Status.OPTIMAL or is_compared:
        word = "largest" if result.sense is Sense.MAX else "smallest"
    if result.status is Status.EVALUATED and is_compared:
        status = "chosen" if result.rounding is None else "rounded"
    elif result.optimality is not None and result.optimality.kind is PointKind.UNDECIDED:
        status = "stationary, not proven optimal"
    if robot is not None and robot.singular:
        status = f"SINGULAR: rank {robot.rank}, {status}"
    tone = Tone.CAUTION if is_unasked_singularity(robot, case) else Tone.ANSWER
    # F of a task that nothing resists is rounding error.
    F = 0.0 if robot is not None and robot.task_is_free and several is None else task_F(robot, result.F)
    return Line(number(F), tone=tone, before=f"{word} F = ", after=f"{unit}   ({status}{over})")


def _no_optimum_words(result: SolveResult) -> str:
    """Return the status of a solve without an answer; if the best points did not converge, with their F."""
    reached, starts = result.reached, result.starts
    is_open = result.status is Status.NOT_CONVERGED and bool(starts.optima) and reached is not None
    if not is_open or reached is None or reached.F is None or reached.violated:
        return f"{result.status.value}: this is not an optimum"
    best = starts.optima[0]
    converged = f"{best.count} of {starts.run} searches converged at F = {number(best.F)}"
    return f"not converged: {converged}, but an unconverged point has F = {number(reached.F)}"


def _not_proved(result: SolveResult, case: Case, before: str = "") -> str:
    """Return ``before``, then ``not proved`` with the domain; empty if the limits over the domain are proved."""
    proof = result.workspace or result.path
    return "" if proof is None or proof.proved else f"{before}not proved {case.limits_where}"


def is_unasked_singularity(robot: RobotData | None, case: Case) -> bool:
    """Return whether a robot is singular at one pose or more, although its case does not expect a singularity."""
    if robot is None or case.expect.singular:
        return False
    return robot.singular or (robot.several is not None and any(pose.singular for pose in robot.several.poses))


def heading_lines(case: Case, result: SolveResult) -> Iterator[Line]:
    """Yield title, task, and F or the status."""
    yield title_line(case)
    if result.robot is not None and result.robot.task is not None:
        yield from task_lines(result.robot.task, case.units)
    yield from objective_lines(case)
    yield headline(result, case)
    if result.objective is not None and result.objective.over is not None and result.F is not None:
        value, sign = result.objective.value, ">=" if result.sense is Sense.MAX else "<="
        words = (
            f"no bound of F over the {result.objective.over} is proved"
            if value is None
            else f"F {sign} {number(value)} everywhere {case.limits_where} (proved)"
        )
        yield Line(words, label="bound", tone=Tone.NO_ANSWER if value is None else Tone.ANSWER)


def objective_lines(case: Case) -> Iterator[Line]:
    """Yield the meaning of F, if F is not the sum of squared work rates."""
    words = objective_words(case)
    if words:
        yield Line(words, label="F is")


def evidence_lines(result: SolveResult, case: Case) -> Iterator[Line]:
    """Yield the kind of the point, the evidence of optimality, and the violated or infeasible limits."""
    if result.optimality is not None:
        yield optimality_line(result.optimality)
    yield from check_lines(result)
    yield from fault_lines(result, case)


def check_lines(result: SolveResult) -> Iterator[Line]:
    """Yield the evidence of optimality: flat directions, stationarity, feasibility and curvature."""
    evidence = result.optimality
    if evidence is not None:
        for direction in evidence.flat:
            steps = [f"{name} by {rate:+.4g}" for name, rate in direction.items()]
            moved = " and ".join(each for each in (", ".join(steps[:-1]), steps[-1]) if each)
            yield Line(f"changing {moved} keeps F: other designs are equally good", label="flat direction")
        if math.isfinite(evidence.stationarity):
            checks = f"stationarity {residual(evidence.stationarity)}, feasibility {residual(evidence.feasibility)}"
            curvature = evidence.eigenvalues
            smallest = "; active bounds and limits leave no free direction"
            if len(curvature):
                smallest = (
                    f"; smallest eigenvalue of the reduced Hessian {settled(min(curvature), 1.0, CURVED) or 0:.3g}"
                )
            yield Line(checks + (smallest if result.reached is None else ""), label="evidence")


def fault_lines(result: SolveResult, case: Case) -> Iterator[Line]:
    """Yield the limits that a failed solve violates, and the values with which the case would be feasible."""
    yield from violation_lines(() if result.reached is None else result.reached.violated)
    for sentence in relaxation_sentences(result, case):
        yield Line(sentence)


def optimality_line(evidence: Evidence) -> Line:
    """Return the kind of a point, such as a strict local maximum."""
    return Line(evidence.kind.value, label="optimality")


def relaxation_sentences(result: SolveResult, case: Case) -> Iterator[str]:
    """Yield the value of each limit with which an infeasible case would be feasible.

    Over a workspace or along a path, the value follows from a few poses: it is necessary, perhaps not sufficient.
    """
    for row in result.relaxation or ():
        unit, is_upper = f" {row.unit}" if row.unit else "", row.needed > row.limit
        # The rounding keeps the sentence true.
        needed = rounded_to(row.needed, _DIGITS, up=is_upper)
        if case.limits_over:
            more = "more" if is_upper else "less"
            yield f"infeasible {case.limits_where} unless {row.key} = {needed}{unit} or {more}, not {row.limit:g}{unit}"
        else:
            yield f"would be feasible with {row.key} = {needed}{unit} instead of {row.limit:g}{unit}"


def costliest_words(limits: Sequence[LimitData], *, in_words: bool = False) -> str | None:
    """Return a sentence about the active limit with the largest relative effect on F; None without such a limit.

    Args:
        limits: limits of the case.
        in_words: If true, the key of the limit is in words.
    """
    costly = [(row, row.cost) for row in limits if row.active and row.cost]
    if not costly:
        return None
    row, cost = max(costly, key=lambda each: ordered(abs(each[1] * (each[0].limit or 1.0))))
    name = key_words(f"limits.{row.key}") if in_words else row.key
    return f"The active limit with the largest relative effect is {name}: F {cost:+.4g} {per_words(row.unit)}."


def active_limit_lines(limits: Sequence[LimitData], title: str = "") -> Iterator[Line]:
    """Yield the active limits of a design with the derivative of F, and the violated limits; nothing without limits.

    Args:
        limits: limits of the case.
        title: poses that the limits cover; empty for all poses of the case.
    """
    where = f"; {title}" if title else ""
    if not limits:
        return
    active = [row for row in limits if row.active and not row.violated]
    kept = len(active) + sum(not (row.active or row.violated) for row in limits)
    texts = []
    for row in active:
        cost = f" (F {row.cost:+.4g} {per_words(row.unit)})" if row.cost else ""
        texts.append(f"{row.key} = {number(row.limit, digits=6)} {row.unit}".rstrip() + cost)
    share = "1" if len(limits) == 1 else f"all {kept}" if kept == len(limits) else f"{kept} of {len(limits)}"
    if texts:
        rest = f"; {share} limits satisfied" if kept > len(active) else ""
        yield Line(", ".join(texts), label="active limits", after=rest + where)
    elif kept:
        yield Line(f"{share} satisfied, none active", label="limits", after=where)
    if kept < len(limits):
        words = ", ".join(row.key for row in limits if row.violated)
        yield Line(words, label="violated limits", tone=Tone.FAULT)


def violation_lines(sides: Sequence[ViolationData]) -> Iterator[Line]:
    """Yield the violated bounds and limits of a point."""
    if len(sides) > _VIOLATIONS:
        yield Line(f"{len(sides)} limits are violated; the first {_VIOLATIONS}:", tone=Tone.FAULT)
    for side in sides[:_VIOLATIONS]:
        wanted = {"min": "at least", "max": "at most", "equal": "exactly"}[side.bound]
        value, limit = (
            f"{each:.6g} {side.unit or ''}".rstrip() if math.isfinite(each) else "undetermined"
            for each in (side.value, side.limit)
        )
        yield Line(f"violated: {quantity_words(side.name)} = {value}, must be {wanted} {limit}", tone=Tone.FAULT)


def starts_caution(starts: StartsData) -> Line | None:
    """Return the caution that an unconverged search reached a better point, or that few searches converged."""
    if not starts.optima:
        return None
    if starts.better is None:
        few = f"only {starts.converged} of {starts.run} searches converged: a better optimum may exist"
        is_few = starts.run >= _MANY and starts.converged <= _FEW * starts.run
        return Line(f"{few}; raise solve.starts", label="note", tone=Tone.CAUTION) if is_few else None
    reached = f"an unconverged search reached F = {number(starts.better)} within the limits"
    best = f"{starts.converged} of {starts.run} searches converged, the best at F = {number(starts.optima[0].F)}"
    return Line(f"{best}; {reached}: raise solve.max_iterations or solve.starts", label="note", tone=Tone.CAUTION)


def starts_lines(starts: StartsData, robot: RobotData | None = None) -> Iterator[Line]:
    """Yield the outcomes of the starts.

    Args:
        starts: starts of a solve.
        robot: robot at the best optimum, which gives the rounding error of F; None if unknown.
    """
    if not starts.run:
        return
    yield Line(f"{starts.converged} of {starts.run} converged", label="starts")
    for sentence, count in starts.failed.items():
        yield Line(f"  {count}: {sentence}", tone=Tone.CAUTION)
    for index, found in enumerate(starts.optima[:_OPTIMA]):
        note = f", a set over {100 * found.spread:.0f} % of the ranges" if found.spread > SET else ""
        F = number(task_F(robot, found.F))
        if index and number(task_F(robot, starts.optima[index - 1].F)) == F:
            note += ", at a different point"
        note += f", in {found.assembly}" if found.assembly else ""
        yield Line(f"  {found.count} at F = {F}{note}")
    worse = len(starts.optima) - _OPTIMA
    if worse > 0:
        yield Line(f"  and {worse} {'optimum' if worse == 1 else 'optima'} with a worse F")


def singularity_lines(robot: RobotData, units: Units) -> Iterator[Line]:
    """Yield the rank of the Jacobian, and the motions that are free with all actuators locked."""
    if robot.task_is_free and robot.task is not None:
        words = task_words(robot.task, units)
        free = f"singular: F is 0, so the platform can make the task's motion ({words}) with every actuator locked"
        yield Line(free, tone=Tone.CAUTION)
    if robot.joints is not None:
        yield from joint_lines(robot, robot.joints, units)
    yield from convention_lines(robot)
    if not robot.singular:
        share = robot.singular_values[-1] / robot.singular_values[0]
        if share < _NEAR:
            words = f"nearly singular: the smallest singular value is {share:.2g} of the largest"
            yield Line(f"{robot.rank}, {words}", label="rank of J", tone=Tone.CAUTION)
        else:
            yield Line(f"{robot.rank}", label="rank of J")
        return
    several = " combinations of" if len(robot.free_motions) > 1 else ""
    yield Line(f"{robot.rank}: singular; with all actuators locked nothing resists{several}", label="rank of J")
    for motion in robot.free_motions:
        yield Line(f"  {motion_words(motion, units, robot_size(robot))}")


def exclusion_lines(case: Case, robot: RobotData | None) -> Iterator[Line]:
    """Yield the limit that excludes singular designs, for an answer that is singular although its case expects none.

    Nothing is yielded if the case has this limit or minimises a quantity of the actuators, or if the robot is singular
    at all poses.
    """
    limits = {each.name for each in case.limits}
    if not is_unasked_singularity(robot, case) or case.model.rank < _FULL_RANK or "smallest_singular_value" in limits:
        return
    if any(task.measure for task in case.tasks):
        return
    words = "add smallest_singular_value = { min = ..., length = ... } to [limits] to exclude singular designs"
    yield Line(words, label="advice")


def tolerance_line(lost: ToleranceLoss, F: float | None, units: Units) -> Line:
    """Return the loss of F caused by joint-centre errors."""
    part = f" ({100 * lost.loss / F:.2g} %)" if F else ""
    text = f"joint centres off by {lost.tolerance:g} {units.length}: F may be worse by {lost.loss:.4g}{part}"
    return Line(text, label="tolerance")


def certificate_lines(certificate: CertificateData | None) -> Iterator[Line]:
    """Yield the proved statement, the gap, and the number of examined boxes."""
    if certificate is None:
        return
    tone = Tone.ANSWER if certificate.status is CertificateStatus.PROVED else Tone.NO_ANSWER
    yield Line(certificate.statement, label="certificate", tone=tone)
    if certificate.gap is not None:
        share = "" if certificate.relative_gap is None else f"{certificate.relative_gap:.2e} relative, "
        yield Line(f"{share}{certificate.gap:.3g} in F", label="gap", part="search")
    left = f", {certificate.open:,} undecided," if certificate.open else ""
    word = "box" if certificate.boxes == 1 else "boxes"
    boxes = f"{certificate.boxes:,} {word} examined{left} in {certificate.seconds:.2f} s"
    yield Line(f"{boxes}{engine_words(certificate.engine)}", label="search", part="search")


def engine_words(engine: str) -> str:
    """Return the words about the engine of a search; empty without a search."""
    return " by compiled C" if engine == "c" else ""


def choice_lines(
    choice: ChoiceData | None, rounding: RoundingData | None = None, *, is_answer: bool = True
) -> Iterator[Line]:
    """Yield the values chosen from lists, the rounding of dimensions, and the outcome of each search.

    Args:
        choice: choice among listed values; None without lists.
        rounding: rounding of the dimensions; None without rounding.
        is_answer: If true, the solve gave an answer.
    """
    tone = Tone.PLAIN if is_answer else Tone.FAULT
    if choice is not None:
        chosen = ", ".join(
            f"{each.name} = {each.value:.7g} {each.unit}".rstrip()
            for each in choice.numbers
            if math.isfinite(each.value)
        )
        yield Line(f"{chosen}: {choice.statement}" if is_answer else choice.statement, label="chosen values", tone=tone)
    if rounding is not None:
        yield Line(rounding.statement, label="rounded", tone=tone)
        if rounding.loss is not None:
            size = settled(rounding.loss, abs(rounding.before), _UNCHANGED)
            word = "worse" if rounding.loss >= 0 else "better"
            part = "" if rounding.relative_loss is None else f" ({100 * abs(rounding.relative_loss):.2g} %)"
            text = f"{word} by {abs(rounding.loss):.3g}{part} than {rounding.before:.7g} before rounding"
            yield Line(text if size else f"{rounding.before:.7g}, unchanged by rounding", label="objective")


def combined_lines(result: CombinedResult) -> Iterator[Line]:
    """Yield the method of combination, and the limits that the combined point violates."""
    combined, status = result.combined, result.status.value
    yield Line(f"{combined.method.value} ({status})", label="tasks combined by")
    if combined.method_point is None:
        yield Line(f"{status}: this is not an optimum", tone=Tone.NO_ANSWER)
    for name in combined.violated:
        yield Line(f"violated: {name}", tone=Tone.FAULT)


def combined_value_lines(combined: CombinedData) -> Iterator[Line]:
    """Yield the value of the combined objective and the kind of its point; nothing without a value."""
    if combined.value is None:
        return
    yield Line(number(combined.value), label=f"{combined.method.value} objective")
    if combined.optimality is not None:
        yield optimality_line(combined.optimality)


def change_lines(result: CombinedResult) -> Iterator[Line]:
    """Yield the gain by each dimension or pose that changes from task to task, without rounding."""
    for change in result.combined.changes or ():
        words = _gain_words(change, result.combined) + (", before rounding" if result.rounding is not None else "")
        yield Line(words, label=f"{change.name} per task")


def _gain_words(change: ChangeData, combined: CombinedData) -> str:
    """Return the gain by a change from task to task in words."""
    if change.F_shared is None:
        return f"not compared: {change.reason}"
    if change.gain is None or change.value_shared is None:
        pairs = zip(combined.tasks, change.F_shared, strict=True)
        return f"F with {change.name} shared: {', '.join(f'{task.name} {number(F)}' for task, F in pairs)}"
    beside = f"{number(change.value_shared)} with {change.name} shared"
    if abs(change.gain) < _NO_GAIN:
        return f"no gain: the {combined.method.value} objective is {beside}"
    return f"{100 * change.gain:+.3g} % of the {combined.method.value} objective: {beside}"
