"""Check of a proof about a program, without trust in who made it.

The boxes of the tree start from the program's own bounds, so that the leaves cover them by construction. Every leaf
and every face is a *claim* about one box, and the check shows each claim again with the polynomials of
:mod:`screwsynth.nlp.proof.checker.polynomials`; it bisects the box where their balls are too large. It uses neither
the arithmetic of the search nor its multipliers. Search and check share the case's expressions, and CasADi's
derivatives of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...program.nlp import Nlp
from ..statement.form import refuse_jumps
from ..statement.limb_separation import separate
from ..statement.standard_form import StandardForm, standard_form
from .bisection import show
from .optimum import Claims, rule_of
from .polymodels import Tilts
from .premises import fingerprint, is_same_program
from .proof_file import ProofClaim, ProofError
from .tree import FACES, Box, Node, SharedLeaves, TreeReader, read_claims, read_shared

#: Rounding of sums of a few numbers, in parts of their sizes: many times the largest possible.
_SUMS = 1e-13


@dataclass(frozen=True)
class VerifiedProof:
    """A proof that holds.

    Attributes:
        leaves: number of leaves and faces of the tree.
        pieces: number of boxes that were evaluated to show them.
        bound: upper bound of the maximised value over the feasible part of the root, 0 at most where that is minus a
            sum of squares; -inf without a feasible point.
    """

    leaves: int
    pieces: int
    bound: float


def check_proof(claim: ProofClaim, nlp: Nlp) -> VerifiedProof:
    """Check the proof of a claim about a program, by showing each claim of its tree again.

    Args:
        claim: the claim, with its tree.
        nlp: the program that it is about, built from the case.

    Raises:
        ProofError: the proof is for another program, its bytes are no tree, or a claim could not be shown.
    """
    if not is_same_program(fingerprint(nlp), claim.graph):
        raise ProofError("the proof is for other expressions or bounds than this case's")
    form = standard_form(nlp)
    refuse_jumps(form.expressions, form.x)
    bound = -np.inf if claim.bound is None else claim.bound
    kinds = {bytes([Node.LIMBS]): _of_limbs, bytes([Node.SHARED]): _of_shared_limbs}
    leaves, every = kinds.get(claim.tree[:1], _of_tree)(claim.tree, form, bound)
    pieces = sum(show(rule_of(each), each.lower, each.upper) for each in every)
    return VerifiedProof(leaves, pieces, min(bound, form.ceiling) if bound > 0 else bound)


def _of_tree(tree: bytes, form: StandardForm, bound: float) -> tuple[int, list[Claims]]:
    """Return the number of claims of a tree of a whole box, and the claims."""
    reader = TreeReader(tree)
    claims = read_claims(reader, form)
    reader.finish()
    return _claims_of(claims, form, bound)


def _of_limbs(tree: bytes, form: StandardForm, bound: float) -> tuple[int, list[Claims]]:
    """Return the number of claims of the trees of limbs that share no variable, and the claims.

    Raises:
        ProofError: the bytes are no tree, or the bounds of limbs do not add up.
    """
    separation = separate(form)
    if separation is None or separation.shared:
        raise ProofError("the tree is one of limbs without shared variables, which the case does not have")
    reader = TreeReader(tree, 1)
    parts = [(limb.form, reader.number(), read_claims(reader, limb.form)) for limb in separation.limbs]
    reader.finish()
    empty = [part for part in parts if part[1] == -np.inf]
    if not empty:
        bounds = [*(each for _, each, _ in parts), separation.constant]
        size = sum(map(abs, bounds))
        if not (math.isfinite(size) and math.fsum(bounds) + _SUMS * size <= bound):
            raise ProofError("the bounds of the limbs are more than the proven one together")
    read = [_claims_of(claims, limb, least) for limb, least, claims in empty or parts]
    return sum(leaves for leaves, _ in read), [each for _, some in read for each in some]


def _claims_of(claims: dict[tuple[Node, int], Box], form: StandardForm, bound: float) -> tuple[int, list[Claims]]:
    """Return the number of the boxes of a tree, and the claims about them.

    Raises:
        ProofError: a box collapses on a face that is not the form's.
    """
    every = []
    for (kind, i), (lower, upper) in claims.items():
        ends, whole = (upper, form.upper) if kind == Node.FACE_UPPER else (lower, form.lower)
        if kind in FACES and (ends[i] != whole[i]).any():
            raise ProofError(f"a box is collapsed on a face of {form.names[i]} that is not the case's")
        every.append(Claims(form, kind, i, lower, upper, np.full(lower.shape[1], bound)))
    return sum(each.bounds.size for each in every), every


def _of_shared_limbs(tree: bytes, form: StandardForm, bound: float) -> tuple[int, list[Claims]]:
    """Return the number of leaves of a tree of limbs that share variables, and its claims.

    Raises:
        ProofError: the bytes are no tree.
    """
    separation = separate(form)
    if separation is None or separation.common is None:
        raise ProofError("the tree is one of limbs that share variables, which the case does not have")
    common, limbs = separation.common, [limb.form for limb in separation.limbs]
    leaves = read_shared(tree, common.lower, common.upper, len(limbs))
    # The sums first: they are quick, and without them the limbs' bounds show nothing.
    every = [_of_sum(leaves.select(leaves.bounds.min(axis=0) > -np.inf), common, bound)]
    for k, limb in enumerate(limbs):
        claimed = leaves.select(leaves.bounds[k] < np.inf)
        own = [np.repeat(ends[common.n :, None], claimed.bounds.shape[1], axis=1) for ends in (limb.lower, limb.upper)]
        lower, upper = np.concatenate([claimed.lower, own[0]]), np.concatenate([claimed.upper, own[1]])
        tilts = Tilts.over(claimed.lower, claimed.upper, claimed.g[k], claimed.Q[k])
        every.append(Claims(limb, Node.BOUNDED, 0, lower, upper, claimed.bounds[k], tilts))
    return leaves.bounds.shape[1], [each for each in every if each.bounds.size]


def _of_sum(leaves: SharedLeaves, common: StandardForm, bound: float) -> Claims:
    """Return the claims about the part with shared variables alone: minus the limbs' tilts are its own tilts."""
    lower, upper, bounds, g, Q = leaves
    tilts = Tilts.over(lower, upper, -g.sum(axis=0), -Q.sum(axis=0))
    # The tilts' sums are rounded, and so is this one.
    parts = [Tilts.over(lower, upper, *each).sizes() for each in zip(g, Q, strict=True)]
    sizes = abs(bound) + np.abs(bounds).sum(axis=0) + np.sum(parts, axis=0)
    left = bound - bounds.sum(axis=0) - _SUMS * sizes
    return Claims(common, Node.BOUNDED, 0, lower, upper, left, tilts)
