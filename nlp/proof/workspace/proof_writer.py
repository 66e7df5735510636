"""The proof on paper of a judgement, from the records of its searches."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ....models import FloatArray
from ...case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ..checker.premises import fingerprint
from ..checker.proof_file import ProofClaim, Unproved, WorkspaceProof, workspace_numbers
from ..checker.workspace.statement import (
    ERRORS,
    ExpectedClaim,
    RobotClaims,
    expected_claims,
    legs_numbers,
    robot_claims,
)
from ..statement.claims import REACH, REGULAR, asked_name, one_machine_name
from ..statement.machine import INSIDE, legs_of
from ..statement.tolerance import second_order_name
from .proof_record import PaperRecord
from .singular_sides import singular_sides
from .verdict import Outcome, Regularity

if TYPE_CHECKING:
    from .judge import Judgement
    from .numbers.extremes import Extreme

#: Part by which the bound of an error of first order is moved outwards, so that boxes at the worst pose have room.
_OUTWARDS = 1e-6
#: Reason of claims about machines within a tolerance that are not known.
_AS_BUILT = "the robot cannot be put together with errors of its joint centres"
#: Reason of numbers of machines whose coordinates follow from others, or that have kinks.
_BY_MACHINES = "it is proved by a search of boxes for all machines together, which has no proof on paper"
#: Reason of claims of kinds that the checker does not know.
_NO_RULES = "claims of this kind have no proof on paper"
_NO_BOUND = "its search has no bound"
_ONE_ASSEMBLY = "it is proved in home's assembly of the joints, and proofs on paper are about all assemblies"
#: Reasons of claims about other robots than six straight legs.
_BEYOND = "boxes were left out in which a number of the pose that follows from others leaves its range"
_NO_REACH = "the reach of limbs that it needs has no proof"
_NO_LENGTHS = "the lengths of legs that it needs have no proof"


def paper_of(
    judged: Judgement, record: PaperRecord, text: str, *, quantities: Sequence[str] = (), leg_error: float = 0.0
) -> WorkspaceProof:
    """Return the proof of what is proved, or refuted by two poses, and the claims that have none.

    Args:
        judged: the verdicts.
        record: of the searches that led to them.
        text: the case file's text.
        quantities: measures that were asked for.
        leg_error: largest error of a leg's length.
    """
    legs = legs_of(judged.case)
    robot, is_reached = _robot_claims(judged, record)
    # Of numbers of one name the first counts, and of strokes, which come later, that over all poses.
    keys = [_key(judged, each) for each in judged.extremes]
    last = dict(zip(keys, judged.extremes, strict=True))
    first = dict(zip(reversed(keys), reversed(judged.extremes), strict=True))
    proved: dict[tuple[str, str], ProofClaim] = {}
    unproved = []
    expected = expected_claims(judged.case, robot, quantities, leg_error)
    for each in expected:
        if judged.case.joint_centre_tolerance and robot.machines is None:
            unproved.append(Unproved(each.name, each.sense, _AS_BUILT))
            continue
        is_reach = each.claim is not None and each.claim.key == REACH
        if each.kind == "number" and not (is_reach or is_reached):
            unproved.append(Unproved(each.name, each.sense, _NO_REACH))
            continue
        extremes = first if each.kind == "number" else last
        is_rank = each.kind == "rank"
        found = _rank(each, judged, record, robot) if is_rank else _number(each, extremes, record, proved)
        is_of_lengths = each.kind == "error" or (judged.case.joint_centre_tolerance and each.kind == "singular value")
        if is_of_lengths and not _has_lengths(judged, proved):
            found = _NO_LENGTHS
        if found == _NO_BOUND and judged.case.joint_centre_tolerance and each.key not in record.programs:
            found = _BY_MACHINES
        if isinstance(found, ProofClaim):
            proved[each.key] = found
        else:
            unproved.append(Unproved(each.name, each.sense, found))
    known = {each.key for each in expected}
    unproved += [Unproved(*key, _NO_RULES) for key in keys if key not in known]
    # The whole errors follow from those of first order together, and from the lengths of legs.
    missing = [each for each in ERRORS if (each, "max") not in proved]
    if len(missing) == 1:
        (other,) = [each for each in ERRORS if each not in missing]
        del proved[other, "max"]
        unproved.append(Unproved(other, "max", f"the {missing[0]} has no proof"))
    return WorkspaceProof(
        case=text,
        name=judged.case.name,
        workspace=workspace_numbers(judged.workspace),
        legs=legs_numbers(legs),
        quantities=tuple(quantities),
        leg_error=leg_error,
        claims=tuple(proved.values()),
        unproved=tuple(unproved),
        tolerance=judged.case.joint_centre_tolerance or 0.0,
        lemmas=tuple(_lemmas(record, proved)),
    )


def _key(judged: Judgement, each: Extreme) -> tuple[str, str]:
    """Return the name in proofs, and the sense, of an extreme."""
    spectral = each.name in (SmallestSingularValue.key, ConditionNumber.key) and not each.key
    return asked_name(judged.case, each.name) if spectral else each.name, each.sense.value


def _lemmas(record: PaperRecord, proved: dict[tuple[str, str], ProofClaim]) -> Iterator[ProofClaim]:
    """Yield the claims that those about every machine rest on."""
    machines = [name for (name, _), each in proved.items() if each.reason == "one machine"]
    keys = [(one_machine_name(name), sense) for name in machines for sense in ("min", "max")]
    for key in keys:
        program = record.programs.get(key)
        if program is not None and program.tree is not None:
            yield ProofClaim(*key, "program", program.bound, fingerprint(program.nlp), program.tree)
    for name, sense in [key for key, each in proved.items() if each.reason == "program"] + keys:
        rest = record.rests.get((second_order_name(name), sense))
        if rest is not None:
            yield ProofClaim(second_order_name(name), sense, "second order", rest)


def _has_lengths(judged: Judgement, proved: dict[tuple[str, str], ProofClaim]) -> bool:
    """Return whether the shortest lengths of the legs have proofs."""
    return all((f"leg_length limb {leg.name}", "min") in proved for leg in judged.case.model.legs)


class _Robot(NamedTuple):
    """Claims about a robot, and whether its numbers rest on no claim about reach that is not on paper."""

    claims: RobotClaims
    is_reached: bool


def _robot_claims(judged: Judgement, record: PaperRecord) -> _Robot:
    """Return the claims about the robot of a judgement, with the symbols in which its numbers were bounded."""
    reaches = [each for each in judged.extremes if each.key == REACH]
    proved = {each.name for each in reaches if each.outcome is Outcome.PROVED}
    on_paper = {each for each in proved if (found := record.programs.get((each, "min"))) and found.tree is not None}
    # The search needs the reach of all limbs for the closed forms, and so do the claims on paper.
    return _Robot(robot_claims(judged.case, judged.workspace, proved), len(proved) < len(reaches) or proved == on_paper)


def _rank(each: ExpectedClaim, judged: Judgement, record: PaperRecord, robot: RobotClaims) -> ProofClaim | str:
    """Return the claim that J, or the constraint wrenches, keep their rank, or why it has no proof."""
    found = judged.regularity if each.name == REGULAR else judged.constraints
    if found is None:
        return "it was not judged"
    if found.outcome is Outcome.PROVED:
        own = record.own(each.name)
        return _BEYOND if own.lacks_boxes else ProofClaim(each.name, "", "regular", tree=own.tree(with_open=True))
    if found.outcome is Outcome.REFUTED:
        return _refuted(each, found, judged, robot)
    return f"{found.outcome.value}: {found.reason}" if found.reason else found.outcome.value


def _refuted(each: ExpectedClaim, found: Regularity, judged: Judgement, robot: RobotClaims) -> ProofClaim | str:
    """Return the opposite of a claim about a rank with its proof, or why it has no proof."""
    sides: Iterable[FloatArray] | str = "a computed pose has no proof"
    if found.sides is not None:
        sides = found.sides
    elif found.errors is not None and found.y is not None and robot.machines is not None:
        # The determinant has the other sign for the largest errors in these directions too, and is farther from 0.
        errors = found.errors.of_centres(robot.machines.symbols.built.names).vectors
        errors *= INSIDE * robot.machines.symbols.tolerance / np.linalg.norm(errors, axis=1).max()
        sides = [np.concatenate([found.y, each]) for each in (np.zeros(errors.size), errors.ravel())]
    elif each.name == REGULAR and found.y is not None and robot.legs is None:
        sides = singular_sides(judged.case, robot.model, judged.workspace, found.y)
    if isinstance(sides, str):
        return f"{found.outcome.value}: {found.reason}; {sides}"
    return ProofClaim(each.name, "", "singular", sides=tuple(tuple(side.tolist()) for side in sides))


def _number(
    each: ExpectedClaim,
    extremes: dict[tuple[str, str], Extreme],
    record: PaperRecord,
    proved: dict[tuple[str, str], ProofClaim],
) -> ProofClaim | str:
    """Return the claim about a number with its proof, or why there is none."""
    found = extremes.get(each.key)
    if found is None:
        return "it was not judged"
    if found.outcome is not Outcome.PROVED:
        return f"{found.outcome.value}: {found.reason}" if found.reason else found.outcome.value
    if each.kind == "number":
        return _program(each, record)
    if each.kind == "lengths":
        directions = record.directions.get(one_machine_name(each.name))
        if directions is not None:
            sides = tuple(directions.base.tolist()), tuple(directions.platform.tolist())
            return ProofClaim(each.name, each.sense, "one machine", found.bound, sides=sides)
        leg = each.name.partition(" ")[2].removeprefix("limb ")
        missing = any((f"leg_length limb {leg}", sense) not in proved for sense in ("min", "max"))
        return _NO_LENGTHS if missing else ProofClaim(each.name, each.sense, "lengths", found.bound)
    return _boxes(each, found.bound, record)


def _program(each: ExpectedClaim, record: PaperRecord) -> ProofClaim | str:
    """Return a claim with a tree of the search of ``certify``, or why there is none."""
    program = record.programs.get(each.key)
    if each.key in record.elsewhere:
        return _ONE_ASSEMBLY
    if program is None or program.tree is None:
        return _NO_BOUND
    return ProofClaim(each.name, each.sense, "program", program.bound, fingerprint(program.nlp), program.tree)


def _boxes(each: ExpectedClaim, reached: float, record: PaperRecord) -> ProofClaim | str:
    """Return a claim with a tree of a search of its own, or why there is none."""
    if each.name not in record.boxes:
        return "its search was not recorded"
    if each.kind == "error":
        bound = record.firsts[each.name] * (1 + _OUTWARDS)
    else:
        sign = 1.0 if each.sense == "max" else -1.0
        # A proof of the limit is enough: the bound reached is often just beyond it, and takes longer to check.
        limit = reached + sign * _OUTWARDS * abs(reached) if each.limit is None else each.limit
        bound = sign * max(sign * limit, sign * reached)
        if not math.isfinite(bound) or (each.limit is None and not bound > 0):
            return _NO_BOUND
    return ProofClaim(each.name, each.sense, "boxes", bound, tree=record.boxes[each.name].tree(with_open=True))
