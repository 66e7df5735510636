"""Check of a proof about a program, without trust in its author.

The root box of the tree has the bounds of the program, so the leaves cover this box by construction. Every leaf and
every face is a *claim* about one box. The check proves each claim again with the polynomials of
:mod:`screwsynth.nlp.proof.checker.polynomials`, and bisects boxes where their error balls are too large. It uses
neither the arithmetic of the search nor its multipliers; both share the case's expressions and CasADi's derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ...program.nlp import Nlp
from ..statement.form import refuse_jumps
from ..statement.limb_separation import separate
from ..statement.standard_form import StandardForm, standard_form
from .bisection import show
from .optimum import BoundRule, Claims, MonotoneRule, rule_of
from .polymodels import Tilts
from .premises import fingerprint, is_same_program
from .proof_file import ProofClaim, ProofError
from .tree import FACES, Box, Node, SharedLeaves, TreeReader, ahead, read_claims, read_shared

#: Relative rounding of sums of a few numbers: many times the largest possible error.
_SUMS = 1e-13
#: Number of leaves and faces in a block of a tree, and the claims about them.
_Block: TypeAlias = "tuple[int, list[Claims]]"


@dataclass(frozen=True)
class VerifiedProof:
    """Result of the check of a valid proof.

    Attributes:
        leaves: number of final boxes (leaves) and faces of the tree.
        pieces: number of boxes evaluated in the check.
        bound: upper bound of the maximised value over the feasible part of the root box; at most 0 if the value is
            minus a sum of squares, and -inf without a feasible point.
    """

    leaves: int
    pieces: int
    bound: float


def check_proof(claim: ProofClaim, nlp: Nlp) -> VerifiedProof:
    """Check the proof of a claim about a program, by proving each claim of its tree again.

    Args:
        claim: claim with its tree.
        nlp: nonlinear program of the claim, built from the case.

    Raises:
        ProofError: the proof is for another program, its bytes are no tree, or a claim could not be proved.
    """
    if not is_same_program(fingerprint(nlp), claim.graph):
        raise ProofError("the proof is for another case: its expressions or bounds differ from those of this case")
    form = standard_form(nlp)
    refuse_jumps(form.expressions, form.x)
    bound, tree = -np.inf if claim.bound is None else claim.bound, claim.unpacked()
    kinds = {bytes([Node.LIMBS]): _of_limbs, bytes([Node.SHARED]): _of_shared_limbs}
    rules: dict[tuple[int, Node, int], BoundRule | MonotoneRule] = {}
    leaves = pieces = 0
    blocks = kinds.get(tree[:1], _of_tree)(tree, form, bound)
    for count, every in ahead(blocks, lambda block: sum(2 * each.lower.size for each in block[1])):
        leaves += count
        for each in every:
            # All blocks of a tree share one rule for each kind of claims.
            key = id(each.form), each.kind, each.index
            rules[key] = rules[key].about(each) if key in rules else rule_of(each)
            pieces += show(rules[key], each.lower, each.upper)
    return VerifiedProof(leaves, pieces, min(bound, form.ceiling) if bound > 0 else bound)


def _of_tree(tree: bytes, form: StandardForm, bound: float) -> Iterator[_Block]:
    """Yield the claims of the tree of a whole box."""
    reader = TreeReader(tree)
    for claims in read_claims(reader, form):
        yield _claims_of(claims, form, bound)
    reader.finish()


def _of_limbs(tree: bytes, form: StandardForm, bound: float) -> Iterator[_Block]:
    """Yield the claims of the trees of limbs without shared variables.

    A limb with an infinite bound makes no claim.

    Raises:
        ProofError: the bytes are no tree, or the bounds of limbs sum to more than the proven bound.
    """
    separation = separate(form)
    if separation is None or separation.shared:
        raise ProofError(
            "the proof has one tree of boxes for each limb, which is valid only for limbs without common variables; "
            "the limbs of this case share variables or cannot be separated"
        )
    reader, bounds, fault = (
        TreeReader(tree, 1),
        list[float](),
        "the sum of the bounds of all limbs exceeds the bound that the proof states",
    )
    for limb in separation.limbs:
        bounds.append(reader.number())
        if math.isnan(bounds[-1]):
            raise ProofError(fault)
        for claims in read_claims(reader, limb.form):
            count, every = _claims_of(claims, limb.form, bounds[-1])
            yield (0, []) if bounds[-1] == np.inf else (count, every)
    reader.finish()
    if -np.inf not in bounds:
        bounds.append(separation.constant)
        size = sum(map(abs, bounds))
        if not (math.isfinite(size) and math.fsum(bounds) + _SUMS * size <= bound):
            raise ProofError(fault)


def _claims_of(claims: dict[tuple[Node, int], Box], form: StandardForm, bound: float) -> _Block:
    """Return the number of boxes of a tree, and the claims about them.

    Raises:
        ProofError: a box is reduced to a face that is not a face of the form.
    """
    every = []
    for (kind, i), (lower, upper) in claims.items():
        ends, whole = (upper, form.upper) if kind == Node.FACE_UPPER else (lower, form.lower)
        if kind in FACES and (ends[i] != whole[i]).any():
            raise ProofError(
                f"the proof reduces a box to one value of {form.names[i]}, which is neither the smallest nor the "
                f"largest value of {form.names[i]} in the case"
            )
        every.append(Claims(form, kind, i, lower, upper, np.full(lower.shape[1], bound)))
    return sum(each.bounds.size for each in every), every


def _of_shared_limbs(tree: bytes, form: StandardForm, bound: float) -> Iterator[_Block]:
    """Yield the claims of a tree of boxes for a robot whose limbs share variables.

    Raises:
        ProofError: the bytes are no tree.
    """
    separation = separate(form)
    if separation is None or separation.common is None:
        raise ProofError("the proof is for limbs with common variables, but the limbs of this case have none")
    common, limbs = separation.common, [limb.form for limb in separation.limbs]
    for leaves in read_shared(tree, common.lower, common.upper, len(limbs)):
        # The sums come first: they are quick, and the limbs' bounds prove nothing without them.
        every = [_of_sum(leaves.select(leaves.bounds.min(axis=0) > -np.inf), common, bound)]
        for k, limb in enumerate(limbs):
            claimed = leaves.select(leaves.bounds[k] < np.inf)
            count = claimed.bounds.shape[1]
            own = [np.repeat(ends[common.n :, None], count, axis=1) for ends in (limb.lower, limb.upper)]
            lower, upper = np.concatenate([claimed.lower, own[0]]), np.concatenate([claimed.upper, own[1]])
            tilts = Tilts.over(claimed.lower, claimed.upper, claimed.g[k], claimed.Q[k])
            every.append(Claims(limb, Node.BOUNDED, 0, lower, upper, claimed.bounds[k], tilts))
        yield leaves.bounds.shape[1], [each for each in every if each.bounds.size]


def _of_sum(leaves: SharedLeaves, common: StandardForm, bound: float) -> Claims:
    """Return the claims about the common part. Its tilts are minus the sum of the limbs' tilts."""
    lower, upper, bounds, g, Q = leaves
    tilts = Tilts.over(lower, upper, -g.sum(axis=0), -Q.sum(axis=0))
    # The sum of the tilts is rounded, and so is the sum of their bounds.
    parts = [Tilts.over(lower, upper, *each).sizes() for each in zip(g, Q, strict=True)]
    sizes = abs(bound) + np.abs(bounds).sum(axis=0) + np.sum(parts, axis=0)
    left = bound - bounds.sum(axis=0) - _SUMS * sizes
    return Claims(common, Node.BOUNDED, 0, lower, upper, left, tilts)
