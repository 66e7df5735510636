"""Check of a proof that at every pose of a workspace some value of the settings satisfies all limits.

The proof divides the workspace by cuts, and states one value of each setting for each box. For each box, the checker
builds the robot with these values, and proves its ranks and limits by its own bisection. No result of the search is
used.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....case.case import Case
from ....case.pose import Free, ends_of
from ....case.workspace import TurnKind, Workspace
from ....errors import CaseError
from ...statement.chosen_settings import SETTINGS, part_of, ranges_of_settings, with_settings
from ...statement.claims import Claim, ClaimKind, searched_claims
from ...statement.fixed_robot import workspace_of_case
from ..proof_file import Premises, Proof, ProofClaim, ProofError
from ..tree import Node, TreeReader, wrong_node
from .check import ON_LIMIT, WHOLE, CheckedClaim, VerifiedWorkspace, WorkspaceChecker
from .pose_boxes import POSITION, box_words, pose_root
from .statement import expected_claims, followed_claims, refuse_other_premises


def check_settings_proof(proof: Proof, case: Case) -> VerifiedWorkspace:
    """Check that at every pose of a workspace some value of the settings satisfies all limits, without a singularity.

    Args:
        proof: the proof.
        case: case of the proof.

    Raises:
        ProofError: the proof is for another case, or a limit could not be proved on a box.
        CaseError: a dimension of the case is free.
    """
    premises, ranges = proof.premises, ranges_of_settings(case)
    if not isinstance(premises, Premises):
        raise ProofError("the proof is not about a workspace")
    if [(each.name, each.sense, each.reason) for each in proof.claims] != [(SETTINGS, "", SETTINGS)]:
        raise ProofError("the proof must have one claim: that every pose has settings")
    if premises.settings != tuple(ranges) or premises.quantities or proof.lemmas or proof.unproved:
        raise ProofError("the proof is for other settings than those of this case")
    first = workspace_of_case(with_settings(case, {name: each.first for name, each in ranges.items()}))
    workspace = case.world_workspace or first
    refuse_other_premises(case, workspace, None, 0.0, premises)
    if first.position_set is not None:
        raise ProofError("settings for every pose are proved only for a box of positions")
    if first.dependent:
        raise ProofError("settings are proved only for robots without dependent pose coordinates")
    leaves = pieces = 0
    for part, values in _boxes(proof.claims[0], workspace, ranges):
        leaves, pieces = leaves + 1, pieces + _pieces_of(case, part, values)
    return VerifiedWorkspace((CheckedClaim(SETTINGS, ""),), "", workspace, leaves, pieces)


def _pieces_of(case: Case, workspace: Workspace, values: dict[str, float]) -> int:
    """Prove the ranks and limits of a robot with fixed settings over a box, and return the number of examined boxes.

    Raises:
        ProofError: a rank or a limit could not be proved; the message names it.
    """
    whose = ""
    try:
        checker = BoxChecker(with_settings(case, values), workspace)
        for each in checker.expected:
            whose = f"{' '.join(each.label).strip()}, "
            checker.check(each, checker.given(each))
    except (CaseError, ProofError) as error:
        kinds = {name: item.dimension for item in case.model.parameters for name in item.components}
        numbers = (f"{case.parameter_name(k)} = {case.units.shown(v, kinds[k]):.10g}" for k, v in values.items())
        ends = zip(*map(ends_of, (*workspace.position, *workspace.turns.angles)), strict=True)
        where = f"in the box {box_words(*map(np.array, ends))} with {', '.join(numbers)}"
        raise ProofError(f"{whose}{where}: {error}") from None
    return checker.pieces


def _boxes(
    claim: ProofClaim, workspace: Workspace, ranges: dict[str, Free]
) -> Iterator[tuple[Workspace, dict[str, float]]]:
    """Yield the boxes of a proof, which cover the workspace by construction, with allowed values of the settings.

    Raises:
        ProofError: a box has no allowed values, or the tree is damaged.
    """
    lower, upper = np.array([ends_of(each) for each in (*workspace.position, *workspace.turns.angles)]).T
    reader, sides = TreeReader(claim.unpacked()), iter(claim.sides)
    for kind, _, low, high in reader.walk(lower, upper, frozenset({Node.CUT})):
        if kind != Node.BOUNDED:
            raise wrong_node(kind, (Node.CUT, Node.BOUNDED))
        is_cut = not (
            np.array_equal(low[POSITION:], lower[POSITION:]) and np.array_equal(high[POSITION:], upper[POSITION:])
        )
        if is_cut and workspace.turns.kind is TurnKind.ANY_AXIS:
            raise ProofError("the proof divides rotations about any axis, which are no box")
        values = next(sides, None)
        if values is None or len(values) != len(ranges):
            raise ProofError("the proof must state the value of each setting for each box")
        for name, value in zip(ranges, values, strict=True):
            allowed = ranges[name]
            if not (value in allowed.values if allowed.values else allowed.lower <= value <= allowed.upper):
                raise ProofError(f"the proof states a value of {name} that the case does not allow")
        yield part_of(workspace, (low.tolist(), high.tolist())), dict(zip(ranges, values, strict=True))
    reader.finish()
    if next(sides, None) is not None:
        raise ProofError("the proof states values of the settings for more boxes than it has")


class BoxChecker(WorkspaceChecker):
    """Check of the ranks and limits of a robot with fixed dimensions over a box of poses, by bisection.

    Raises:
        ProofError: the checker has no rule for a limit of the case.
    """

    def __init__(self, case: Case, workspace: Workspace) -> None:
        robot = followed_claims(case, workspace)
        every = expected_claims(case, robot, (), 0.0)
        self.expected: list[Claim] = [each for each in every if each.kind is ClaimKind.RANK or each.limit is not None]
        known = {each.label for each in self.expected}
        for each in (each for each in searched_claims(case) if each.limit is not None and each.label not in known):
            raise ProofError(f"the checker has no rule for {each.name} of this robot")
        claims = tuple(map(self.given, self.expected))
        premises = Premises((), (), (), 0.0)
        self._begin(Proof("", case.name, premises, claims), case, pose_root(workspace), robot, workspace)

    def given(self, each: Claim) -> ProofClaim:
        """Return a claim whose bound is its limit, on one box."""
        if each.kind is ClaimKind.RANK:
            return ProofClaim(*each.label, "regular", tree=WHOLE)
        limit = each.limit or 0.0
        # Rounding at a limit counts as equal.
        return ProofClaim(*each.label, "boxes", limit + each.sense.sign * 0.5 * ON_LIMIT * abs(limit), tree=WHOLE)
