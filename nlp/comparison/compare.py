"""Several robots solved for one case."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

from ...models import Model
from ..case.case import Case
from ..case.task import Sense
from ..errors import CaseError, EvaluationError, InputError, ScrewsynthError, UncoveredError, check_seconds, listing
from ..interruption import Milestone, is_requested, one_call, reached, seconds_left, within
from ..proof.enclosure.engine import kernel
from ..proof.workspace.judge import judge_workspace
from ..solver.certified import certify
from ..solver.semi_infinite import design_of
from ..solver.solve import solve
from .entry import Entry, generic_freedoms, outcome_of, proven_strokes, strokes_over_poses, task_fit
from .robots import Contender, placed, read_robots, size_at, size_at_start, size_of_home

#: Part of a typical dimension by which a design may differ from it, as for a starter's free numbers.
RANGE = 0.25
#: Seconds for each search of a proof, of a certificate or over a workspace.
TIME_LIMIT = 60.0
#: Measures of actuators and of legs whose strokes are told.
_MEASURES = ("actuator_length", "actuator_angle", "leg_length")

#: Parts of a table, in order: robots whose F can be compared, those that do not keep every limit of the case, those
#: that cannot make a motion, those without an answer.
Part: TypeAlias = Literal["ranked", "limits not kept", "no freedom", "no answer"]
_PARTS: tuple[Part, ...] = ("ranked", "limits not kept", "no freedom", "no answer")

#: Called before each robot with its label, the number of robots done, and of all.
CompareProgress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Robots compared on one case.

    Attributes:
        case: the case.
        size: to which the robots are scaled, length; None where they are not scaled.
        part: of a typical dimension by which a design may differ from it.
        characteristic_length: by which couples count beside forces, length.
        entries: the ranked ones first, the best first; then those that do not keep every limit of the case, then those
            without the freedom, then those without an answer.
        seconds: wall time.
    """

    case: Case
    size: float | None
    part: float
    characteristic_length: float
    entries: tuple[Entry, ...]
    seconds: float

    def __repr__(self) -> str:
        names = ", ".join(each.contender.label for each in self.entries)
        return f"<Comparison on {self.case.name!r}: {names}>"

    @property
    def ranked(self) -> tuple[Entry, ...]:
        """The robots whose F can be compared: with an answer, every limit, and not without the freedom for a task."""
        return tuple(each for each in self.entries if part_of(each) == "ranked")


@one_call
def compare(
    case: Case,
    robots: Sequence[str | Path | Model],
    *,
    size: float | None = None,
    scale: bool = True,
    part: float = RANGE,
    certified: bool = False,
    time_limit: float | None = None,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    progress: CompareProgress | None = None,
) -> Comparison:
    """Compare robots on one case: each takes the place of the case's robot, scaled to one size, and is solved.

    The size of a robot is the largest distance between two of its points at home. Each robot is at home, axes parallel
    to those of the world, at the start of the case's first pose.

    Args:
        case: the case: its tasks, poses, workspace and limits hold for every robot.
        robots: names of robots, paths of robot files, models, or ``"case"`` for the case's own robot as it is stated.
        size: common size, length; left out, that of the case's robot where its first search begins.
        scale: whether robots are scaled at all; typical lengths are otherwise lengths in the case's unit.
        part: of a typical dimension by which a design may differ from it; 0 holds typical dimensions fixed.
        certified: whether each optimum is proved too.
        time_limit: seconds for the whole call, of whose rest each robot takes an equal part at most. Without it
            the certificate of a robot ends after 60 s, and its judgement over the workspace too.
        starts: number of starting points instead of the case's.
        seed: seed instead of the case's.
        jobs: number of threads; the result does not depend on it.
        progress: called before each robot.

    Raises:
        InputError: a robot is not found or given twice, a number is not allowed, or no robot has the freedom that a
            task needs.
        CaseError: the case contradicts itself.
        EvaluationError: the case's robot does not exist where its first search begins, so that it has no size.
    """
    began = time.perf_counter()
    contenders = read_robots(robots, case)
    if case.limits_over == "path":
        raise CaseError("limits.over", "is for one robot: robots are not compared along a path", "path", case.source)
    check_seconds(time_limit)
    _check_numbers(size, part, scale=scale)
    if certified:
        kernel()  # before any solve where it is missing
    common = (size or _own_size(case)) if scale else None
    length = case.characteristic_length if case.model.has_couples else (common or _own_size(case)) / 2
    entries = []
    with within(time_limit):
        for done, contender in enumerate(contenders):
            if is_requested():
                break
            if progress is not None:
                progress(contender.label, done, len(contenders))
            with within(seconds_left() / (len(contenders) - done)):
                started = time.perf_counter()
                entry = _solved(case, contender, common, part, length, (starts, seed, jobs))
                if certified:
                    entry = _with_certificate(entry, jobs)
                entry = _with_judgement(entry, jobs)
                entries.append(replace(entry, seconds=time.perf_counter() - started))
            reached(Milestone.ROBOT)
        is_stopped = is_requested()
    answers = [each for each in entries if each.has_answer]
    if answers and not is_stopped and all(each.can_move is False for each in answers):
        names = listing(dict.fromkeys(task.name for each in answers for task in each.tasks if task.can_move is False))
        fault = "no robot of the comparison has the freedom for its motion"
        raise InputError(f"{case.source or case.name}: task {names}: {fault}")
    return Comparison(case, common, part, length, _in_order(entries), time.perf_counter() - began)


def _check_numbers(size: float | None, part: float, *, scale: bool) -> None:
    """Refuse numbers that are not allowed.

    Raises:
        InputError: one is not.
    """
    if size is not None and not (math.isfinite(size) and size > 0):
        raise InputError(f"--size {size:g}: must be positive and finite")
    if size is not None and not scale:
        raise InputError("--size: cannot stand beside --no-scale")
    if not 0 <= part < 1:
        raise InputError(f"--part {part:g}: must be at least 0 and below 1")


def _own_size(case: Case) -> float:
    """Return the size of the case's robot; the errors are those of :func:`compare`."""
    try:
        return size_at_start(case)
    except EvaluationError as error:
        source = case.source or case.name
        raise EvaluationError(f"{source}: its robot has no size where the first search begins: {error}") from None


def _solved(
    case: Case,
    contender: Contender,
    common: float | None,
    part: float,
    length: float,
    search: tuple[int | None, int | None, int | None],
) -> Entry:
    """Return a robot solved in the place of the case's own."""
    factor, own = 1.0, size_at_start(case) if contender.is_own else size_of_home(contender.model)
    if common is not None and not contender.is_own:
        factor = common / own
    entry = Entry(contender, factor, own * factor, freedoms=generic_freedoms(contender))
    starts, seed, jobs = search
    try:
        place = placed(case, contender, factor, part, length)
        solution = solve(place.case, starts=starts, seed=seed, jobs=jobs)
    except ScrewsynthError as error:
        fault = f"{error.key}: {error.fault}" if isinstance(error, CaseError) else str(error)
        return replace(entry, fault=fault)
    entry = replace(entry, placed=place, solution=solution)
    return _with_fits(entry) if entry.has_answer else entry


def _with_fits(entry: Entry) -> Entry:
    """Return a robot with an answer with its freedoms, its tasks and its singularities at the design."""
    contender, solution = entry.contender, entry.solution
    if solution is None:
        return entry
    fits, singularities, freedoms = [], [], entry.freedoms
    for outcome in solution.outcomes:
        fit, mobility = task_fit(contender, outcome)
        fits.append(fit)
        if mobility is not None:
            freedoms = mobility.freedoms
            singularities += [each.words for each in mobility.singularities]
    state = solution.state
    if state is not None and contender.model.generic is None and state.is_singular:
        singularities.append(f"the rank of J is {state.rank}: the platform can move with every actuator locked")
    nlp = solution.outcomes[0].own.nlp
    return replace(
        entry,
        tasks=tuple(fits),
        freedoms=freedoms,
        singularities=tuple(dict.fromkeys(singularities)),
        final_size=size_at(nlp, solution.outcomes[0].x),
        strokes=strokes_over_poses(contender, solution.outcomes[0], _measures(contender)),
    )


def _measures(contender: Contender) -> tuple[str, ...]:
    """Return the names of a robot's measures whose strokes are told."""
    return tuple(each.name for each in contender.model.quantities if each.name in _MEASURES)


def _proof_seconds() -> float | None:
    """Return the seconds for one proof: no limit but the time left where there is one."""
    return TIME_LIMIT if math.isinf(seconds_left()) else None


def _with_certificate(entry: Entry, jobs: int | None) -> Entry:
    """Return a robot with the certificate of its answer, or the reason why it has none."""
    if entry.solution is None or not entry.has_answer:
        return entry
    try:
        found = certify(entry.solution, time_limit=_proof_seconds(), jobs=jobs)
    except (UncoveredError, InputError) as error:
        return replace(entry, certificate_fault=str(error))
    if found.certificate is not None and found.certificate.was_beaten:
        # The search of the whole box found a better design.
        entry = _with_fits(replace(entry, solution=found.solution))
    return replace(entry, certified=found)


def _with_judgement(entry: Entry, jobs: int | None) -> Entry:
    """Return a robot with the verdict on its design over the case's workspace, where the case has one."""
    if entry.placed is None or entry.solution is None or entry.placed.case.workspace is None or not entry.has_answer:
        return entry
    outcome, proof = entry.solution.outcomes[0], entry.solution.workspace
    names = _measures(entry.contender)
    # Lengths of straight legs are among the claims already.
    asked = [name for name in names if name != "leg_length" or not entry.contender.model.legs]
    judged = None if proof is None else proof.judgement
    if judged is None or asked:
        # An exchange proves the limits alone, and no range of another measure.
        try:
            design = design_of(entry.placed.case, outcome.own.nlp, entry.solution.x)
            limit = _proof_seconds()
            judged = judge_workspace(design, quantities=asked, time_limit=limit, jobs=jobs, with_objective=False)
        except ScrewsynthError as error:
            return replace(entry, workspace_fault=str(error))
    return replace(entry, judgement=judged, outcome=outcome_of(judged), strokes=proven_strokes(judged, names))


def part_of(entry: Entry) -> Part:
    """Return the part of the table that a robot stands in."""
    if not entry.has_answer:
        return "no answer"
    if entry.can_move is False:
        return "no freedom"
    # Without a limit F can be better, and is no answer to the case.
    return "ranked" if entry.keeps_limits else "limits not kept"


def _in_order(entries: Sequence[Entry]) -> tuple[Entry, ...]:
    """Return robots in the order of a table: by part, with fewer limits left out first, then by F.

    Robots without a common value stay in the order in which they are given.
    """

    def key(entry: Entry) -> tuple[int, int, float]:
        value = entry.value or 0.0
        left_out = 0 if entry.placed is None else len(entry.placed.left_out)
        return _PARTS.index(part_of(entry)), left_out, -value if entry.sense is Sense.MAX else value

    return tuple(sorted(entries, key=key))
