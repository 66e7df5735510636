"""Fingerprint of a program, by which a proof for another one is told at once."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ...program.nlp import Nlp
from ...program.pairs import with_all_pairs
from ..statement.standard_form import standard_form

#: Points at which a fingerprint takes a program's values, and the number of its sums.
_POINTS, _SUMS = 3, 4
#: Difference of the sums of one program in two processes: far more than rounding, far less than any change of a case.
_SAME = 1e-9


def fingerprint(nlp: Nlp) -> str:
    """Return a text that tells programs from each other: sizes, and sums of their values at a few points.

    The same case may give graphs whose constants differ in the last bit, from one process to another, so that no hash
    of the graph would do. A proof does not rest on it: the check shows every claim for the program that it has built.
    """
    nlp = with_all_pairs(nlp)
    program = nlp.program
    function = ca.Function("values", [program.x, program.p], [ca.densify(ca.vertcat(program.objective, program.g))])
    rng = np.random.default_rng(0)
    shares = rng.random((_POINTS, nlp.n))
    points = [nlp.lower + share * (nlp.upper - nlp.lower) for share in shares]
    values = [function(x, nlp.arguments).full().ravel() for x in points]
    size = nlp.n
    if nlp.in_home_mode:
        # Unknowns that follow in closed form are no variables of the tree's boxes.
        form = standard_form(nlp)
        size, function = form.n, ca.Function("form", [form.x], [form.expressions])
        values += [function(form.point_of(x)).full().ravel() for x in points]
    numbers = np.concatenate([*values, nlp.arguments, nlp.lower, nlp.upper, nlp.g_lower, nlp.g_upper])
    # Each number counts by its size and by its sign; one that is not finite by a constant.
    known = np.isfinite(numbers)
    parts = np.where(known, numbers / (1 + np.abs(np.where(known, numbers, 0.0))), np.where(numbers > 0, 2.0, -2.0))
    sums = rng.normal(size=(_SUMS, numbers.size)) @ parts
    return " ".join([str(size), str(len(nlp.g_lower)), str(int(nlp.sign)), *(f"{each:.12e}" for each in sums)])


def is_same_program(one: str, other: str) -> bool:
    """Return whether two fingerprints are of the same program, to rounding."""
    first, second = one.split(), other.split()
    if first[:3] != second[:3] or len(first) != len(second):
        return False
    try:
        return bool(
            np.allclose([float(each) for each in first], [float(each) for each in second], rtol=_SAME, atol=_SAME)
        )
    except ValueError:
        return False
