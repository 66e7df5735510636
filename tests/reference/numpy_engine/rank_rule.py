"""The rank of matrices without loops, from forms of second order of their entries, without the kernel's reflection."""

from __future__ import annotations

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp.proof.enclosure.forms import Encloser, Enclosures, Forms, forms_of, halve_squares
from screwsynth.nlp.proof.workspace.ranks.krawczyk import ROUNDING
from screwsynth.nlp.proof.workspace.ranks.rank_rule import RankTest, Tested

from .second_order import enclose_second


class NumpyRankTest(RankTest):
    """The test of a matrix in NumPy."""

    def examine_second(
        self, encloser: Encloser, lower: FloatArray, upper: FloatArray, change: FloatArray | None = None
    ) -> Tested:
        """Return the verdict on boxes; the arguments are those of :meth:`.RankTest.examine_second`."""
        n, found = len(lower), enclose_second(encloser.tape, lower, upper)
        every = np.concatenate([found.a, found.Q], axis=1)
        forms = forms_of(Enclosures(found.c, every, found.p, found.q, found.s, found.lo, found.hi))
        (middle, terms, r), off = halve_squares(forms, n), 0.0 if change is None else change.T
        rest = (r + off) * (1 + ROUNDING) + ROUNDING * (np.abs(middle) + np.abs(forms.a).sum(axis=2))
        tested = self.examine(Forms(middle, terms, rest), terms.shape[2])
        return tested._replace(shares=tested.shares[:, :n])
