"""Check of the tree of a limb that shares no variable: its bounds are shown by models of squared quotients."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from ...statement.standard_form import StandardForm
from ..proof_file import ProofError
from ..tree import Node
from .limbclaims import LimbChecker, LimbClaims
from .squares import squares_of
from .tilts import tilts_over

if TYPE_CHECKING:
    from ..parts import Claim


def is_one_square(form: StandardForm) -> bool:
    """Return whether a form's only function has exactly one squared quotient, as that of a single limb mostly has."""
    return len(form.functions) == 1 and len(squares_of(form.functions[0])[1]) == 1


class ClaimChecker(Protocol):
    """A check of claims about boxes of one form."""

    def show(self, kind: Node, index: int, claims: list[Claim]) -> int:
        """Show claims of one kind, and return the number of boxes evaluated."""


class LimbPartChecker:
    """A check of claims about boxes of one limb.

    Args:
        form: the limb.
        bound: the proven bound of its value.
        others: shows claims of other kinds, and bounds for which the models of squared quotients do not suffice.
    """

    def __init__(self, form: StandardForm, bound: float, others: ClaimChecker) -> None:
        self._bound, self._others, self._n = bound, others, form.n
        # All variables count as shared: a tree has faces of its own.
        self._bounds = LimbChecker(form, form.n)

    def show(self, kind: Node, index: int, claims: list[Claim]) -> int:
        """Show claims of one kind, and return the number of boxes evaluated.

        Raises:
            ProofError: a claim could not be shown.
        """
        if kind != Node.BOUNDED:
            return self._others.show(kind, index, claims)
        lower = np.stack([claim.lower for claim in claims], axis=1)
        upper = np.stack([claim.upper for claim in claims], axis=1)
        flat = tilts_over(lower, upper, np.zeros_like(lower), np.zeros((self._n, *lower.shape)))
        try:
            return self._bounds.show(LimbClaims(lower, upper, flat, np.full(len(claims), self._bound)))
        except ProofError:
            return self._others.show(kind, index, claims)
