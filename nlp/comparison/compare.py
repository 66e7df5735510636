"""Comparison of several robots on one case: scaling, solves, certificates, proofs over the workspace, and order."""

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
from .entry import Entry, generic_degrees_of_freedom, outcome_of, proven_strokes, strokes_over_poses, task_fit
from .robots import Contender, placed, read_robots, size_at, size_at_start, size_of_home

#: Default relative range of a dimension about its typical value, as in starter cases.
RANGE = 0.25
#: Seconds for each certificate and each proof over a workspace.
TIME_LIMIT = 60.0
#: Quantities of actuators and legs with strokes.
_MEASURES = ("actuator_length", "actuator_angle", "leg_length")

#: Parts of a table, in order: robots whose F can be compared, robots that do not satisfy all limits of the case, robots
#: that cannot make a motion, robots without an optimum.
Part: TypeAlias = Literal["ranked", "limits not kept", "no freedom", "no answer"]
_PARTS: tuple[Part, ...] = ("ranked", "limits not kept", "no freedom", "no answer")

#: Function called before each robot with its label, the number of finished robots, and the number of all robots.
CompareProgress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Robots compared on one case.

    Attributes:
        case: case of the comparison.
        size: common size of the robots, length; None without scaling.
        part: relative range of a dimension about its typical value.
        characteristic_length: factor between couples and forces, length.
        entries: ranked robots with the best first; then robots that do not satisfy all limits of the case, robots
            without the degrees of freedom for a task, and robots without an optimum.
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
        """Robots whose F can be compared: with an optimum, all limits, and the degrees of freedom for the tasks."""
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
    """Compare robots on one case: each robot replaces the robot of the case, is scaled to a common size, and solved.

    The size of a robot is the largest distance between two of its points at home. Each robot is placed with its home at
    the starting value of the case's first pose, with axes parallel to those of the world.

    Args:
        case: case with tasks, poses, workspace and limits for every robot.
        robots: names of robots, paths of robot files, models, or ``"case"`` for the robot of the case, unchanged.
        size: common size, length; by default the size of the case's robot at its first starting point.
        scale: If false, do not scale: typical lengths are lengths in the case's unit.
        part: relative range of a dimension about its typical value; 0 fixes the typical dimensions.
        certified: If true, also compute a certificate for each robot.
        time_limit: seconds for the whole call; each robot takes at most an equal part of the remaining time. Without a
            limit, the certificate of a robot ends after 60 s, and its proof over the workspace too.
        starts: number of starting points; by default the number of the case.
        seed: seed that replaces the seed of the case.
        jobs: number of threads; the result does not depend on it.
        progress: function called before each robot.

    Raises:
        InputError: a robot is unknown or given twice, a value is not allowed, or no robot has the degrees of freedom
            for a task.
        CaseError: the case contradicts itself.
        EvaluationError: the case's robot has no size, because it does not exist at its first starting point.
    """
    began = time.perf_counter()
    contenders = read_robots(robots, case)
    if case.limits_over == "path":
        raise CaseError(
            "limits.over", "is not supported in a comparison: compare robots over a workspace", "path", case.source
        )
    check_seconds(time_limit)
    _check_numbers(size, part, scale=scale)
    if certified:
        kernel()  # an error before any solve if it is missing
    common = (size or _size_of_case(case)) if scale else None
    length = case.characteristic_length if case.model.has_couples else (common or _size_of_case(case)) / 2
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
        fault = "no compared robot has the degrees of freedom for the motion"
        raise InputError(f"{case.source or case.name}: task {names}: {fault}")
    return Comparison(case, common, part, length, _in_order(entries), time.perf_counter() - began)


def _check_numbers(size: float | None, part: float, *, scale: bool) -> None:
    """Refuse values of ``size`` and ``part`` that are not allowed.

    Raises:
        InputError: a value is not allowed.
    """
    if size is not None and not (math.isfinite(size) and size > 0):
        raise InputError(f"--size {size:g}: must be positive and finite")
    if size is not None and not scale:
        raise InputError("--size: conflicts with --no-scale; leave out one of them")
    if not 0 <= part < 1:
        raise InputError(f"--part {part:g}: must be at least 0 and below 1")


def _size_of_case(case: Case) -> float:
    """Return the size of the case's robot; errors as for :func:`compare`."""
    try:
        return size_at_start(case)
    except EvaluationError as error:
        source = case.source or case.name
        raise EvaluationError(f"{source}: the robot has no size at the first starting point: {error}") from None


def _solved(
    case: Case,
    contender: Contender,
    common: float | None,
    part: float,
    length: float,
    search: tuple[int | None, int | None, int | None],
) -> Entry:
    """Return a robot with its solution in the place of the case's robot."""
    factor, own = 1.0, size_at_start(case) if contender.is_of_case else size_of_home(contender.model)
    if common is not None and not contender.is_of_case:
        factor = common / own
    entry = Entry(contender, factor, own * factor, freedoms=generic_degrees_of_freedom(contender))
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
    """Return a solved robot with its degrees of freedom, tasks and singularities at the design."""
    contender, solution = entry.contender, entry.solution
    if solution is None:
        return entry
    fits, singularities, degrees_of_freedom = [], [], entry.freedoms
    for outcome in solution.outcomes:
        fit, mobility = task_fit(contender, outcome)
        fits.append(fit)
        if mobility is not None:
            degrees_of_freedom = mobility.freedoms
            singularities += [each.words for each in mobility.singularities]
    state = solution.state
    if state is not None and contender.model.generic is None and state.is_singular:
        singularities.append(f"the rank of J is {state.rank}: the platform can move with every actuator locked")
    nlp = solution.outcomes[0].own.nlp
    return replace(
        entry,
        tasks=tuple(fits),
        freedoms=degrees_of_freedom,
        singularities=tuple(dict.fromkeys(singularities)),
        final_size=size_at(nlp, solution.outcomes[0].at),
        strokes=strokes_over_poses(contender, solution.outcomes[0], _measures(contender)),
    )


def _measures(contender: Contender) -> tuple[str, ...]:
    """Return the names of a robot's quantities with strokes."""
    return tuple(each.name for each in contender.model.quantities if each.name in _MEASURES)


def _proof_seconds() -> float | None:
    """Return the seconds for one proof; None if the whole call has a time limit."""
    return TIME_LIMIT if math.isinf(seconds_left()) else None


def _with_certificate(entry: Entry, jobs: int | None) -> Entry:
    """Return a robot with the certificate of its optimum, or with the reason for the missing certificate."""
    if entry.solution is None or not entry.has_answer:
        return entry
    try:
        found = certify(entry.solution, time_limit=_proof_seconds(), jobs=jobs)
    except (UncoveredError, InputError) as error:
        return replace(entry, certificate_fault=str(error))
    if found.certificate is not None and found.certificate.was_beaten:
        # The global search found a better design.
        entry = _with_fits(replace(entry, solution=found.solution))
    return replace(entry, certified=found)


def _with_judgement(entry: Entry, jobs: int | None) -> Entry:
    """Return a robot with the verdict on its design over the case's workspace, if any."""
    if entry.placed is None or entry.solution is None or entry.placed.case.workspace is None or not entry.has_answer:
        return entry
    outcome, proof = entry.solution.outcomes[0], entry.solution.workspace
    names = _measures(entry.contender)
    # The claims already include the lengths of straight legs.
    asked = [name for name in names if name != "leg_length" or not entry.contender.model.legs]
    judged = None if proof is None else proof.judgement
    if judged is None or asked:
        # The solve with a proof only proves the limits, not the ranges of other quantities.
        try:
            design = design_of(entry.placed.case, outcome.own.nlp, entry.solution.x)
            limit = _proof_seconds()
            judged = judge_workspace(design, quantities=asked, time_limit=limit, jobs=jobs, with_objective=False)
        except ScrewsynthError as error:
            return replace(entry, workspace_fault=str(error))
    return replace(entry, judgement=judged, outcome=outcome_of(judged), strokes=proven_strokes(judged, names))


def part_of(entry: Entry) -> Part:
    """Return the part of the table for a robot."""
    if not entry.has_answer:
        return "no answer"
    if entry.can_move is False:
        return "no freedom"
    # With fewer limits F can be better, and is not comparable.
    return "ranked" if entry.keeps_limits else "limits not kept"


def _in_order(entries: Sequence[Entry]) -> tuple[Entry, ...]:
    """Return robots in the order of a table: by part, by the number of omitted limits, then by F.

    Robots without a common value keep the given order.
    """

    def key(entry: Entry) -> tuple[int, int, float]:
        value = entry.value or 0.0
        left_out = 0 if entry.placed is None else len(entry.placed.left_out)
        return _PARTS.index(part_of(entry)), left_out, -value if entry.sense is Sense.MAX else value

    return tuple(sorted(entries, key=key))
