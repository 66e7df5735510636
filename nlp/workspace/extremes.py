"""Proven smallest and largest values over a workspace, each with the pose at which it is met.

Every claim is a program over the numbers of the pose, which :mod:`screwsynth.nlp.certificate` bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...models import Dimension, FloatArray, axis_angle_from_matrix, frozen_array
from ..case.task import Sense
from ..certificate.branchandbound import certify_program
from ..certificate.certificate import Certificate, CertificateStatus
from ..certificate.proofwriter import ProofWriter
from ..errors import UncoveredError
from ..program.layout import Layout
from ..program.nlp import Nlp
from .claims import Claim
from .posebox import PoseNumbers
from .posed import extreme_program, varies
from .verdict import Outcome

if TYPE_CHECKING:
    from .paper.record import PaperRecord

#: Gap of a bound as a part of the value, where none is asked for.
GAP = 1e-3
#: Gap that is tried once more where a limit lies between a bound and the best value known.
_FINE = 1e-7
#: Part of a limit by which a value may be beyond it and still count as on it: rounding.
_ON_LIMIT = 1e-9


@dataclass(frozen=True, eq=False)
class Extreme:
    """The smallest or the largest value of a number over a workspace.

    Attributes:
        name: of the number, in the words of a case.
        sense: whether the smallest or the largest value is meant.
        dimension: of the number.
        key: dotted key, below ``limits``, of the limit in the case; empty without one.
        limit: the limit, radians for angles; None without one.
        bound: proven: no pose has a smaller, or a larger, value; radians for angles; infinite where nothing is proved.
        reached: the smallest or largest value known; NaN without one.
        pose: the pose at which it is reached; None without one.
        outcome: of the limit, or, without one, of the gap asked for.
        boxes: number of boxes examined.
        seconds: wall time.
        reason: for an open outcome; else empty.
    """

    name: str
    sense: Sense
    dimension: Dimension
    key: str
    limit: float | None
    bound: float
    reached: float
    pose: PoseNumbers | None
    outcome: Outcome
    boxes: int
    seconds: float
    reason: str


def prove_extreme(
    layout: Layout,
    claim: Claim,
    *,
    gap: float = GAP,
    time_limit: float | None = None,
    jobs: int | None = None,
    interrupted: Callable[[], bool] = lambda: False,
    paper: PaperRecord | None = None,
) -> Extreme:
    """Prove the smallest or the largest value of a number over a workspace.

    Args:
        layout: the case as symbols of the pose.
        claim: the number.
        gap: allowed distance of the bound from the best value known, as a part of it.
        time_limit: seconds after which the search stops with the bound reached.
        jobs: threads.
        interrupted: whether the work is requested to stop.
        paper: records the search for a proof.
    """
    if interrupted():
        return _extreme(claim, math.inf, math.nan, None, 0, 0.0, "interrupted", gap_met=False)
    nlp = extreme_program(layout, claim.expression, claim.sense)
    if not varies(layout, [claim.expression])[0]:
        value = nlp.evaluate(nlp.start).F
        if paper is not None:
            paper.constant(claim, nlp, value)
        return _extreme(claim, value, value, _pose(nlp, nlp.start), 0, 0.0, "", gap_met=True)
    # A program of a claim has one function, and its search is that of certify with or without a record.
    writer = None if paper is None else ProofWriter(1)
    try:
        found = certify_program(nlp, gap=gap, time_limit=time_limit, jobs=jobs, recorder=writer)
        if _is_between(claim, found) and not interrupted():
            writer = None if paper is None else ProofWriter(1)
            found = certify_program(nlp, found.x, gap=_FINE, time_limit=time_limit, jobs=jobs, recorder=writer)
    except UncoveredError as error:
        return _extreme(claim, math.inf, math.nan, None, 0, 0.0, str(error), gap_met=False)
    if found.status is CertificateStatus.INFEASIBLE:
        return _extreme(
            claim, math.inf, math.nan, None, found.boxes, found.seconds, "the robot has no pose there", gap_met=False
        )
    if paper is not None and writer is not None:
        paper.program(claim, found, writer)
    # A search that ends early has a bound too, which may be as good as asked for.
    met = found.status is CertificateStatus.PROVED or found.gap <= found.allowed
    pose = None if found.x is None else _pose(nlp, found.x)
    return _extreme(claim, found.bound, found.incumbent, pose, found.boxes, found.seconds, found.reason, gap_met=met)


def _is_between(claim: Claim, found: Certificate) -> bool:
    """Return whether a limit is beyond the best value known, and not beyond the bound."""
    if claim.limit is None or found.status is not CertificateStatus.PROVED:
        return False
    sign = 1.0 if claim.sense is Sense.MAX else -1.0
    return sign * found.incumbent <= sign * claim.limit < sign * found.bound


def _extreme(
    claim: Claim,
    bound: float,
    reached: float,
    pose: PoseNumbers | None,
    boxes: int,
    seconds: float,
    reason: str,
    *,
    gap_met: bool,
) -> Extreme:
    """Return the extreme of a claim from numbers of its expression; the gap asked for is met or not."""
    outcome = Outcome.PROVED if gap_met else Outcome.OPEN
    sign = 1.0 if claim.sense is Sense.MAX else -1.0
    if claim.limit is not None:
        slack = _ON_LIMIT * max(abs(claim.limit), abs(reached) if math.isfinite(reached) else 0.0)
        if sign * (reached - claim.limit) > slack:
            outcome = Outcome.REFUTED
        else:
            outcome = Outcome.PROVED if sign * (bound - claim.limit) <= slack and math.isfinite(bound) else Outcome.OPEN
            reason = reason or (
                "the limit is closer than the gap: a smaller --gap may decide" if outcome is Outcome.OPEN else ""
            )
    read = claim.reading.from_value
    return Extreme(
        name=claim.name,
        sense=claim.sense,
        dimension=claim.reading.dimension,
        key=claim.key,
        limit=None if claim.limit is None else read(claim.limit),
        bound=read(bound) if math.isfinite(bound) else sign * math.inf,
        reached=read(reached) if math.isfinite(reached) else math.nan,
        pose=pose,
        outcome=outcome,
        boxes=boxes,
        seconds=seconds,
        reason="" if outcome is not Outcome.OPEN else reason,
    )


def _pose(nlp: Nlp, x: FloatArray) -> PoseNumbers:
    """Return the pose at a point (n,) of a program."""
    state = nlp.program.kernels.robot_state(x, nlp.arguments)
    axis, angle = axis_angle_from_matrix(np.array(state.rotation))
    return PoseNumbers(frozen_array(np.array(state.position).ravel(), (3,)), np.array(state.rotation), axis, angle)
