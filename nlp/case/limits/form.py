"""Expressions that repeat: one function of a few numbers, called for every leg, pair of legs, joint, task or pose.

A program needs the expressions alone. Generated C also uses that they are calls of one function: it has the function
once, and calls it in a loop.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cached_property

from casadi import SX


@dataclass(frozen=True)
class Form:
    """A function of a vector; two forms are equal where they are the same function with the same numbers.

    Attributes:
        build: function at the top of a module, from a vector (k, 1) and the numbers to the value (r, 1).
        numbers: further arguments of the function, the same in each of its calls.
    """

    build: Callable[..., SX]
    numbers: tuple[Hashable, ...] = ()

    def __call__(self, inputs: SX) -> SX:
        """Return the value (r, 1) at a vector (k, 1)."""
        return self.build(inputs, *self.numbers)


@dataclass(frozen=True, eq=False)
class Call:
    """A call of a form.

    Attributes:
        form: the function.
        inputs: (k, 1) expressions.
    """

    form: Form
    inputs: SX

    @cached_property
    def value(self) -> SX:
        """(r, 1) value."""
        return self.form(self.inputs)
