"""Limits and measures with searches of their own: singular values and condition numbers of J, clearance of legs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import Dimension, FloatArray, Model
from ....case.case import Case
from ....case.limits.clearance import LegClearance
from ....case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ....case.task import Sense
from ....errors import UncoveredError
from ...statement.claims import asked_name, asked_spectra
from ...statement.machine import CentreErrors, JointErrors, Legs, has_straight_legs
from ...statement.tolerance import BuiltModel
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError, Problem, build_problem, posed_model
from ..robot.tolerance_model import ToleranceModel
from ..tolerance.leg_errors import along
from ..verdict import Outcome
from .bound_search import OverPoses, smallest_number
from .clearance import Clearance
from .extremes import CLOSE, Extreme, nothing_known, slack_of
from .singular_values import SingularValues

if TYPE_CHECKING:
    from ..proof_writer import PaperRecord

#: Values in parts of which gaps count where the smallest value is near 0, as parts of the limit.
_NEAR_ZERO = 0.1
#: Reason for a measure of which nothing is known of every machine.
_TOO_LARGE = "the errors of joint centres are too large for a bound of the change of J"
#: Number of poses at which the width of a bound over machines is taken, and as many near corners.
_POINTS, _SEED = 64, 0


@dataclass(frozen=True, eq=False)
class Subject:
    """The robot that numbers are about, and all machines that are meant.

    Attributes:
        case: with fixed dimensions.
        model: its robot, without unknowns that follow in closed form.
        box: the poses.
        legs: joint centres of straight legs, with the tolerance; None for a robot without any.
        built: the robot with errors of its joint centres, and the machines within the tolerance; None for the design
            alone.
        unknown: reason why the machines that are meant are not judged; else empty.
        shortest: no leg of any machine is shorter over the workspace.
        design: the design over the workspace, where it is known.
    """

    case: Case
    model: Model
    box: PoseBox
    legs: Legs | None
    built: tuple[BuiltModel, ToleranceModel] | None = None
    unknown: str = ""
    shortest: float = 0.0
    design: Problem | None = None

    @property
    def family(self) -> ToleranceModel | None:
        """The machines within the tolerance; None for the design alone."""
        return None if self.built is None else self.built[1]

    def centres(self, errors: JointErrors | None) -> CentreErrors | None:
        """Return errors of legs by the names of centres; None for six straight legs, which are told by their legs."""
        if errors is None or self.family is None or has_straight_legs(self.case.model):
            return None
        return errors.of_centres(self.family.names)

    @cached_property
    def problem(self) -> Problem:
        """The design over the workspace.

        Raises:
            NotJudgedError: its loops are not closed in the middle, or the machines that are meant are not judged.
        """
        if self.unknown:
            raise NotJudgedError(self.unknown)
        if self.design is not None:
            return self.design
        return build_problem(self.case, self.model, self.box) if self.family is None else self.family.problem

    def spectrum(self, length: float, *, is_condition: bool) -> SingularValues:
        """Return the smallest singular value of J, or minus its condition number."""
        # The change of J by errors of six straight legs has a bound of its own.
        legs, family = (self.legs, None) if has_straight_legs(self.case.model) else (None, self.family)
        return SingularValues(
            self.problem, length, is_condition=is_condition, family=family, legs=legs, shortest=self.shortest
        )

    def clearance(self, places: tuple[int, int]) -> Clearance:
        """Return the distance of two legs."""
        posed = posed_model(self.case, self.model, self.box, z=self.problem.z)
        return Clearance(posed, self.model, places, tolerance=0.0 if self.legs is None else self.legs.tolerance)

    def nearest(self, places: tuple[int, int], y: FloatArray) -> JointErrors | None:
        """Return the errors with which two legs are nearest to each other at a pose (6,); None without legs."""
        if self.legs is None:
            return None
        moved, between = np.zeros_like(self.legs.base), self.clearance(places).between(y[None, list(self.problem.free)])
        moved[list(places)] = np.array([[-1.0], [1.0]]) * between
        errors = along(self.legs, self.box.pose(y).rotation, moved, moved)
        # Legs that the whole errors would move through each other touch with a part of them.
        part = min(1.0, float(np.linalg.norm(between)) / (2 * self.legs.tolerance))
        return JointErrors(part * errors.base, part * errors.platform)


class Question(NamedTuple):
    """A number with a search of its own.

    Attributes:
        name: of the number.
        sense: whether the smallest or the largest value is meant.
        number: returns the number, or minus it.
        dimension: of the number.
        key, limit: of the limit in the case; empty and None without one.
        places: those of two legs, of their distance; None for another number.
    """

    name: str
    sense: Sense
    number: Callable[[], SingularValues | Clearance]
    dimension: Dimension = Dimension.NUMBER
    key: str = ""
    limit: float | None = None
    places: tuple[int, int] | None = None


def searched_limits(subject: Subject, *, gap: float, paper: PaperRecord | None = None) -> Iterator[Extreme]:
    """Yield the extremes of the case's limits that have searches of their own.

    Args:
        subject: the robot.
        gap: allowed distance of a bound from the best value known, as a part of it.
        paper: records the searches for a proof.
    """
    for limit in subject.case.limits:
        for question in questions(subject, limit):
            yield _answer(subject, question, gap, paper)


def asked_spectra_extremes(
    subject: Subject, names: Sequence[str], *, gap: float, paper: PaperRecord | None = None
) -> Iterator[Extreme]:
    """Yield the smallest singular value, or the largest condition number, where the case does not limit them.

    Moments about the platform's origin are divided by the case's characteristic length.

    Args:
        subject: the robot.
        names: measures that are asked for, of which the others are left out.
        gap: allowed distance of a bound from the best value known, as a part of it.
        paper: records the searches for a proof.
    """
    for name in asked_spectra(subject.case, names):
        yield _answer(subject, _spectral(subject, name, subject.case.characteristic_length), gap, paper)


def questions(subject: Subject, limit: object) -> Iterator[Question]:
    """Yield the numbers that a limit is about."""
    if isinstance(limit, SmallestSingularValue):
        question = _spectral(subject, limit.key, limit.length)
        yield question._replace(name=limit.key, key=f"{limit.key}.min", limit=limit.min)
    elif isinstance(limit, ConditionNumber):
        question = _spectral(subject, limit.key, limit.length)
        yield question._replace(name=limit.key, key=f"{limit.key}.max", limit=limit.max)
    elif isinstance(limit, LegClearance):
        for (i, one), (j, other) in itertools.combinations(enumerate(subject.model.legs), 2):
            yield Question(
                f"{limit.key} limbs {one.name} and {other.name}",
                Sense.MIN,
                partial(subject.clearance, (i, j)),
                Dimension.LENGTH,
                f"{limit.key}.min",
                limit.min,
                (i, j),
            )


def _spectral(subject: Subject, key: str, length: float) -> Question:
    """Return the question of a measure of the singular values of J."""
    is_condition = key == ConditionNumber.key
    sense = Sense.MAX if is_condition else Sense.MIN
    return Question(asked_name(subject.case, key), sense, lambda: subject.spectrum(length, is_condition=is_condition))


def _answer(subject: Subject, question: Question, gap: float, paper: PaperRecord | None) -> Extreme:
    """Return the extreme of a number; the search of a limit ends as soon as it is decided."""
    name, sense, _, dimension, key, limit, _ = question
    sign, box = (1.0 if sense is Sense.MIN else -1.0), subject.box
    try:
        number, problem = question.number(), subject.problem
        least, slack = None if limit is None else sign * limit, 0.0 if limit is None else slack_of(limit)
        allowed = gap * max(abs(limit), _NEAR_ZERO) if limit is not None else _asked_gap(subject, number, gap)
        recorder = None if paper is None else paper.own(name)
        found = smallest_number(number, problem, gap=allowed, limit=least, slack=slack, recorder=recorder)
    except (UncoveredError, NotJudgedError) as error:
        return nothing_known(name, sense, dimension, str(error), key=key, limit=limit)
    # A smallest singular value of at least 0, or an infinite condition number, says nothing.
    is_bound = math.isfinite(found.bound) and (sense is Sense.MAX or found.bound > 0)
    outcome, reason = Outcome.OPEN, found.reason
    if least is None:
        reason = reason or ("" if is_bound or not subject.case.joint_centre_tolerance else _TOO_LARGE)
        outcome = Outcome.OPEN if reason else Outcome.PROVED
    elif found.value < least - slack:
        outcome = Outcome.REFUTED
    elif found.bound >= least - slack:
        outcome = Outcome.PROVED
    is_known = math.isfinite(found.value)
    errors = _worst(subject, question, number, found.at) if is_known else None
    return Extreme(
        name=name,
        sense=sense,
        dimension=dimension,
        key=key,
        limit=limit,
        bound=sign * found.bound,
        reached=sign * found.value if is_known else math.nan,
        pose=box.pose(found.at) if is_known else None,
        outcome=outcome,
        boxes=found.boxes,
        seconds=found.seconds,
        reason=(reason or CLOSE) if outcome is Outcome.OPEN else "",
        errors=errors if has_straight_legs(subject.case.model) else None,
        centres=subject.centres(errors),
    )


def _worst(
    subject: Subject, question: Question, number: SingularValues | Clearance, y: FloatArray
) -> JointErrors | None:
    """Return the errors of legs with which a value is reached at a pose (6,); None for the design."""
    if subject.legs is None or not subject.legs.tolerance:
        return None
    if isinstance(number, SingularValues):
        return number.errors(y[list(subject.problem.free)])
    return None if question.places is None else subject.nearest(question.places, y)


def _asked_gap(subject: Subject, number: SingularValues | Clearance, gap: float) -> float:
    """Return the gap of a number without a limit: wider by how far the bound at a pose is from the worst machine there.

    A bound of the change of J is wider than its change in any one machine, and no smaller boxes make it less wide. The
    most at a few poses is taken.
    """
    box, problem = subject.box, subject.problem
    z = problem.start[None] if problem.dependent else (0.5 * (box.lower + box.upper))[None, list(problem.free)]
    allowed = gap * (abs(float(number.values(z)[0])) or 1.0)
    if not subject.case.joint_centre_tolerance or problem.dependent:
        return allowed
    over, rng = OverPoses(number, problem), np.random.default_rng(_SEED)
    points = box.random(_POINTS, rng)
    points = np.concatenate([points, box.clipped(np.where(rng.uniform(size=points.shape) < 0.5, box.lower, box.upper))])
    return allowed + float(np.nanmax(over.values(points) - over.bounds(points, points).lower, initial=0.0))
