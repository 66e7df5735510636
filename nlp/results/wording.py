"""Results in words: lines of text, each with a label and a tone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from ..case.case import Case
from ..case.task import Sense
from ..certificate.certificate import CertificateStatus
from ..evidence.optimality import PointKind
from ..solver.status import Status
from ..units import Units
from .text import Line, Tone

if TYPE_CHECKING:
    from .data import CertificateData, CombinedData, CombinedResult, OptimalityData, SolveResult, StartsData
    from .parts import LimitData, MotionData, RelaxationData, RobotData, TaskData, ToleranceData, ViolationData

#: A number below this part of its neighbours or its range is shown as 0; in JSON it stands as it is.
NOISE = 1e-9
#: Largest numbers of violated limits, and of optima, shown.
_VIOLATIONS, _OPTIMA = 8, 5
#: An optimum is a set when its points lie apart by more than this part of the ranges.
SET = 1e-3
#: A pitch below this is that of a rotation.
_NO_PITCH = 1e-9


def number(value: float) -> str:
    """Return a number with seven digits."""
    return f"{value + 0.0:.7g}"


def numbers(values: Iterable[float]) -> str:
    """Return numbers with five digits each."""
    return "  ".join(f"{value + 0.0:.5g}" for value in values)


def title_line(case: Case) -> Line:
    """Return the title of a case."""
    return Line(case.title or case.name, tone=Tone.TITLE)


def task_line(task: TaskData, units: Units) -> Line:
    """Return a task: name, sense and motion."""
    return Line(f"{task.name}, {task.sense.value} F: {motion_words(task.motion, units)}", label="task")


def motion_words(motion: MotionData, units: Units) -> str:
    """Return a motion in words: its axis, point and pitch."""

    def triple(values: Sequence[float]) -> str:
        noise = NOISE * max(1.0, *map(abs, values))
        return f"({', '.join(f'{value if abs(value) > noise else 0:.4g}' for value in values)})"

    if motion.point is None or motion.pitch == "inf":
        return f"translation along {triple(motion.axis)}"
    pitch = "rotation" if abs(motion.pitch) < _NO_PITCH else f"screw of pitch {motion.pitch:.5g} {units.length}"
    return f"{pitch} about {triple(motion.axis)} through {triple(motion.point)}"


def headline(result: SolveResult) -> Line:
    """Return F, or the status of a solve without an answer."""
    robot = result.robot
    if result.F is None:
        return Line(f"{result.status.value}: this is not an optimum", tone=Tone.NO_ANSWER)
    several = None if robot is None else robot.several
    over = "" if several is None else f", {several.over_poses.value} over {len(several.poses)} poses"
    word, status = "fixed point:", result.status.value
    if result.status is Status.OPTIMAL:
        word = "largest" if result.sense is Sense.MAX else "smallest"
        if result.optimality is not None and result.optimality.kind is PointKind.UNDECIDED:
            status = "stationary, not proven optimal"
    if robot is not None and robot.singular:
        status += f", singular: rank {robot.rank}"
    # Where nothing resists the motion, F is rounding error.
    F = 0.0 if robot is not None and robot.task_is_free and several is None else result.F
    return Line(number(F), tone=Tone.ANSWER, before=f"{word} F = ", after=f"   ({status}{over})")


def heading_lines(case: Case, result: SolveResult) -> Iterator[Line]:
    """Yield title, task, and F or the status."""
    yield title_line(case)
    if result.robot is not None and result.robot.task is not None:
        yield task_line(result.robot.task, case.units)
    yield headline(result)


def evidence_lines(result: SolveResult) -> Iterator[Line]:
    """Yield the verdict, the evidence for it, and the limits that a failed solve violates or that must be moved."""
    evidence = result.optimality
    if evidence is not None:
        yield verdict_line(evidence)
        for direction in evidence.flat_directions:
            yield Line(", ".join(f"{name} {rate:+.4g}" for name, rate in direction.items()), label="flat along")
        if evidence.stationarity is not None:
            checks = f"stationarity {evidence.stationarity:.1e}, feasibility {evidence.feasibility:.1e}"
            curvature = evidence.reduced_hessian_eigenvalues
            smallest = f", smallest curvature {min(curvature):.2e}" if curvature else ", no free direction left"
            yield Line(checks + (smallest if result.reached is None else ""), label="evidence")
    yield from violation_lines(() if result.reached is None else result.reached.violated)
    for row in result.relaxation or ():
        yield Line(f"would be {relaxation_words(row)}")


def verdict_line(evidence: OptimalityData) -> Line:
    """Return the verdict about a point."""
    return Line(evidence.kind.value, label="verdict")


def relaxation_words(row: RelaxationData) -> str:
    """Return the movement of a limit that makes an infeasible case feasible."""
    unit = f" {row.unit}" if row.unit else ""
    return f"feasible with {row.key} = {row.needed:.6g}{unit} instead of {row.limit:g}{unit}"


def costliest_words(limits: Sequence[LimitData]) -> str | None:
    """Return a sentence about the active limit with the largest cost per part of its size; None without a cost."""
    costly = [(row, row.cost) for row in limits if row.active and row.cost]
    if not costly:
        return None
    row, cost = max(costly, key=lambda each: abs(each[1] * (each[0].limit or 1.0)))
    unit = row.unit or "unit"
    return f"Per part of its own size, {row.key} costs most: F changes by {cost:+.4g} per {unit}."


def violation_lines(sides: Sequence[ViolationData]) -> Iterator[Line]:
    """Yield the bounds and constraints that a point lies outside of."""
    if len(sides) > _VIOLATIONS:
        yield Line(f"{len(sides)} limits are violated; the first {_VIOLATIONS}:", tone=Tone.FAULT)
    for side in sides[:_VIOLATIONS]:
        wanted = {"min": "at least", "max": "at most", "equal": "exactly"}[side.bound]
        text = f"violated: {side.name} = {side.value:.6g}, must be {wanted} {side.limit:.6g}"
        yield Line(text, tone=Tone.FAULT)


def starts_lines(starts: StartsData) -> Iterator[Line]:
    """Yield counts of starts by outcome, and the distinct optima."""
    if not starts.run:
        return
    yield Line(f"{starts.converged} of {starts.run} converged", label="starts")
    for sentence, count in starts.failed.items():
        yield Line(f"  {count}: {sentence}", tone=Tone.CAUTION)
    for index, found in enumerate(starts.optima[:_OPTIMA]):
        note = f", spread over {100 * found.spread:.0f} % of the ranges" if found.spread > SET else ""
        if index and number(found.F) == number(starts.optima[index - 1].F):
            note += ", at another point"
        yield Line(f"  {found.count} at F = {number(found.F)}{note}")
    if len(starts.optima) > _OPTIMA:
        yield Line(f"  and {len(starts.optima) - _OPTIMA} worse optima")


def singularity_lines(robot: RobotData, units: Units) -> Iterator[Line]:
    """Yield the rank of the Jacobian, and the motions that nothing resists."""
    if robot.task_is_free and robot.task is not None:
        words = motion_words(robot.task.motion, units)
        free = f"singular: F is 0, so the platform can make the task's motion ({words}) with every actuator locked"
        yield Line(free, tone=Tone.CAUTION)
    if not robot.singular:
        yield Line(f"{robot.rank}", label="rank of J")
        return
    several = " combinations of" if len(robot.free_motions) > 1 else ""
    yield Line(f"{robot.rank}: the structure is singular; nothing resists{several}", label="rank of J")
    for motion in robot.free_motions:
        yield Line(f"  {motion_words(motion, units)}")


def tolerance_line(lost: ToleranceData, F: float | None, units: Units) -> Line:
    """Return the loss of F by inexact joint centres."""
    part = f" ({100 * lost.loss / F:.2g} %)" if F else ""
    text = f"{lost.joint_centre:g} {units.length} at every joint centre: F may be worse by {lost.loss:.4g}{part}"
    return Line(text, label="tolerance")


def certificate_lines(certificate: CertificateData | None) -> Iterator[Line]:
    """Yield the proved statement, the gap, and the size of the search."""
    if certificate is None:
        return
    tone = Tone.ANSWER if certificate.status is CertificateStatus.PROVED else Tone.NO_ANSWER
    yield Line(certificate.statement, label="certificate", tone=tone)
    if certificate.gap is not None:
        part = "" if certificate.relative_gap is None else f" ({certificate.relative_gap:.2e} of it)"
        yield Line(f"{certificate.gap:.3g}{part}", label="gap")
    left = f", {certificate.open:,} left" if certificate.open else ""
    boxes = f"{certificate.boxes:,} boxes{left} in {certificate.seconds:.2f} s"
    yield Line(f"{boxes}, engine {certificate.engine}", label="search")


def combined_lines(result: CombinedResult) -> Iterator[Line]:
    """Yield the method of combination, and the limits that the combined point violates."""
    combined, status = result.combined, result.status.value
    yield Line(f"{combined.method.value} ({status})", label="combined by")
    if combined.method_point is None:
        yield Line(f"{status}: this is no answer", tone=Tone.NO_ANSWER)
    for name in combined.violated:
        yield Line(f"violated: {name}", tone=Tone.FAULT)


def combined_value_lines(combined: CombinedData) -> Iterator[Line]:
    """Yield the value of the combined objective and the verdict about the point, where there is a value."""
    if combined.value is None:
        return
    yield Line(number(combined.value), label=combined.method.value)
    if combined.optimality is not None:
        yield verdict_line(combined.optimality)
