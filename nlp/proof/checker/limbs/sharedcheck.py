"""Check of a proof by limbs that share variables: see ``sharedtree`` for its claims."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...statement.limb_separation import separate
from ...statement.standard_form import StandardForm
from ..proof_file import ProofError
from .limbclaims import LimbChecker, LimbClaims
from .sharedtree import Leaf, read_shared
from .tilts import Tilts, sum_of_tilts, tilts_over

#: Rounding of sums of a few numbers, in parts of their sizes: many times the largest possible.
_SUMS = 1e-13


class SharedCheck(NamedTuple):
    """Number of leaves of a tree that was shown, and of boxes that were evaluated for it."""

    leaves: int
    pieces: int


def check_shared(
    tree: bytes, form: StandardForm, bound: float, progress: Callable[[int, int], None] | None = None
) -> SharedCheck:
    """Check a tree of limbs that share variables.

    Args:
        tree: its bytes.
        form: the whole form.
        bound: the proven bound of its value; -inf where it has no feasible point.
        progress: called with the numbers of claims shown and left.

    Raises:
        ProofError: the bytes are no tree, or a claim could not be shown.
    """
    separation = separate(form)
    if separation is None or separation.common is None:
        raise ProofError("the tree is one of limbs that share variables, which the case does not have")
    common, limbs, m = separation.common, separation.limbs, len(separation.shared)
    leaves = read_shared(tree, common.lower, common.upper, len(limbs))
    claims = [
        _claims_of_limb(k, [each for each in leaves.bounded if each.bounds[k] < np.inf], m) for k in range(len(limbs))
    ]
    whole = [each for each in leaves.bounded if np.isfinite(each.bounds).all()]
    total = _claims_of_sum(whole, leaves.infeasible, bound, m)
    # The sums first: they are quick, and without them the limbs' bounds show nothing.
    every = [(common, total), *zip((limb.form for limb in limbs), claims, strict=True)]
    shown, count = 0, sum(each.bounds.size for _, each in every)

    def done(more: int) -> None:
        nonlocal shown
        shown += more
        if progress is not None:
            progress(shown, count - shown)

    pieces = sum(LimbChecker(part, m).show(each, done) for part, each in every if each.bounds.size)
    return SharedCheck(len(leaves.bounded) + len(leaves.infeasible), pieces)


def _claims_of_limb(k: int, leaves: list[Leaf], m: int) -> LimbClaims:
    """Return the claims about limb number k."""
    lower, upper = _stacked([(each.lower, each.upper) for each in leaves], m)
    return LimbClaims(lower, upper, _tilts(k, leaves, m), np.array([each.bounds[k] for each in leaves]))


def _claims_of_sum(
    leaves: list[Leaf], infeasible: list[tuple[np.ndarray, np.ndarray]], bound: float, m: int
) -> LimbClaims:
    """Return the claims about the part with shared variables alone: minus the limbs' tilts are its own tilts."""
    lower, upper = _stacked([*((each.lower, each.upper) for each in leaves), *infeasible], m)
    K = len(leaves[0].bounds) if leaves else 1
    parts = [_tilts(k, leaves, m) for k in range(K)]
    total = sum_of_tilts(parts)
    bounds = np.array([each.bounds for each in leaves]).reshape(-1, K)
    left = bound - bounds.sum(axis=1)
    # The tilts' sums are rounded, and so is this one.
    left = left - _SUMS * (abs(bound) + np.abs(bounds).sum(axis=1) + np.sum([each.total() for each in parts], axis=0))
    none = np.zeros((m, len(infeasible)))
    tilts = tilts_over(
        lower,
        upper,
        np.concatenate([-total.g, none], axis=1),
        np.concatenate([-total.Q, np.zeros((m, m, len(infeasible)))], axis=2),
    )
    return LimbClaims(lower, upper, tilts, np.concatenate([left, np.full(len(infeasible), -np.inf)]))


def _stacked(boxes: list[tuple[np.ndarray, np.ndarray]], m: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends (m, L) of boxes."""
    lower = np.array([low for low, _ in boxes]).reshape(-1, m).T
    return lower, np.array([high for _, high in boxes]).reshape(-1, m).T


def _tilts(k: int, leaves: list[Leaf], m: int) -> Tilts:
    """Return the tilts of limb number k over the leaves' boxes."""
    lower, upper = _stacked([(each.lower, each.upper) for each in leaves], m)
    g = np.array([each.g[k] for each in leaves]).reshape(-1, m).T
    Q = np.moveaxis(np.array([each.Q[k] for each in leaves]).reshape(-1, m, m), 0, 2)
    return tilts_over(lower, upper, g, Q)
