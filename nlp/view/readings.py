"""Values of limits in the case's terms, such as the angle of a bounded cosine, as expressions.

A :class:`~..case.limits.constraint.Reading` converts single numbers. Here each conversion is found among a few
expressions, and compared with the reading at several values.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import SX

from ..case.limits.constraint import BoundedConstraint, Constraint, Reading
from ..program.nlp import Nlp
from ..program.places import FreeRotation

#: Values at which a conversion is compared, and the largest relative difference.
_TRIED = (0.07, 0.31, 0.83, 2.9, -0.27, -0.74)
_SAME = 1e-12


@dataclass(frozen=True, eq=False)
class LimitReadings:
    """Values of limits in the case's terms.

    Attributes:
        rows: constraints of limits with their bounds: those of the program, then those on fixed parameters only.
        known: indices, among the rows, of the constraints with a value in the case's terms, in the order of results.
        function: function ``(x, p)`` to these values; None without any.
    """

    rows: tuple[BoundedConstraint, ...]
    known: tuple[int, ...]
    function: ca.Function | None

    @property
    def functions(self) -> tuple[ca.Function, ...]:
        """The function; none without any value."""
        return () if self.function is None else (self.function,)


def limit_readings(nlp: Nlp, prefix: str) -> LimitReadings:
    """Return the values of a program's limits; the function's name begins with the prefix."""
    program = nlp.program
    balls = {id(each.ball) for each in program.places.rotations if isinstance(each, FreeRotation)}
    bounded = zip(program.constraints, nlp.g_lower.tolist(), nlp.g_upper.tolist(), strict=True)
    every = [*(BoundedConstraint(*each) for each in bounded), *nlp.constant_limits]
    rows = [each for each in every if any(each.constraint.keys) or id(each.constraint) in balls]
    values = [value_of(each.constraint) for each in rows]
    found = {k: value for k, value in enumerate(values) if value is not None}
    known = tuple(found)
    if not known:
        return LimitReadings(tuple(rows), (), None)
    shown = ca.cse(ca.densify(ca.vertcat(*found.values())))
    return LimitReadings(tuple(rows), known, ca.Function(f"{prefix}_readings", [program.x, program.p], [shown]))


def value_of(constraint: Constraint) -> SX | None:
    """Return the limited quantity (1, 1) of a constraint; None where only numerical methods measure it."""
    if constraint.exact is not None:
        return constraint.exact
    if constraint.measure is not None:
        return None
    convert = expression_of(constraint.reading)
    return None if convert is None else convert(constraint.expression)


def expression_of(reading: Reading) -> Callable[[SX], SX] | None:
    """Return the conversion of a reading on expressions; None for an unknown conversion."""
    factor = float(reading.from_value(1.0))
    candidates: Sequence[Callable[[SX], SX]] = (
        lambda value: value,
        _root,
        lambda value: ca.acos(-_clamped(value, -1.0)),
        lambda value: 2 * ca.asin(_clamped(value, -1.0)),
        lambda value: 2 * ca.asin(ca.sqrt(_clamped(value, 0.0))),
        lambda value: factor * value,
        lambda value: ca.fmax(value, 0.0),
    )
    stated = np.array([_stated(reading, value) for value in _TRIED])
    symbol = SX.sym("value")
    for convert in candidates:
        function = ca.Function("reading", [symbol], [convert(symbol)])
        found = np.array([float(function(value)) for value in _TRIED])
        if np.allclose(found, stated, rtol=_SAME, atol=0.0, equal_nan=True):
            return convert
    return None


def _stated(reading: Reading, value: float) -> float:
    """Return the value of a reading; NaN where it has none."""
    try:
        return float(reading.from_value(value))
    except (ValueError, ZeroDivisionError):
        return float("nan")


def _root(value: SX) -> SX:
    return ca.sqrt(ca.fmax(value, 0.0))


def _clamped(value: SX, least: float) -> SX:
    return ca.fmin(ca.fmax(value, least), 1.0)
