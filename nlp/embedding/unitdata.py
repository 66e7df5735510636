"""Units of the numbers in C: of F, of twists and rates, of fixed numbers, and of multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..program.nlp import Nlp
from ..units import Units, objective_unit, rate_unit, twist_units
from .runtimelimits import RunTimeLimit


@dataclass(frozen=True)
class UnitData:
    """Units of a program's numbers in C, for the case's own tasks; empty for a plain number."""

    nlp: Nlp

    @cached_property
    def of_case(self) -> Units:
        """Units of lengths and angles: angles are radians in C."""
        return replace(self.nlp.case.units, angle="rad")

    @property
    def _twists(self) -> list[list[float]]:
        return [np.asarray(task.twist, dtype=np.float64).tolist() for task in self.nlp.case.tasks]

    @property
    def F(self) -> str:  # noqa: N802 - as everywhere
        """Unit of F; empty where the tasks do not agree in it."""
        return objective_unit(self._twists, self.of_case)

    @property
    def rates(self) -> tuple[str, ...]:
        """Unit of the rates of each task."""
        return tuple(rate_unit(twist, self.of_case) for twist in self._twists)

    @property
    def variables(self) -> tuple[str, ...]:
        """Unit of each variable; that of a level is F's."""
        program = self.nlp.program
        found = [self.of_case.label(each.dimension) for each in program.variables]
        if program.places.epigraph is not None:
            found[program.places.epigraph.level] = self.F
        return tuple(found)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Unit of each fixed number."""
        program = self.nlp.program
        found = [self.of_case.label(each.dimension) for each in program.arguments]
        for twist, places in zip(self._twists, program.places.twists, strict=False):
            found[places.start : places.stop] = twist_units(twist, self.of_case)
        epigraph = program.places.epigraph
        for index in () if epigraph is None else (epigraph.ceiling, *epigraph.best):
            found[index] = self.F
        return tuple(found)

    @property
    def variable_multipliers(self) -> tuple[str, ...]:
        """Unit of the multipliers of each variable's bounds."""
        return tuple(self._multiplier(unit) for unit in self.variables)

    @property
    def constraint_multipliers(self) -> tuple[str, ...]:
        """Unit of the multipliers of each constraint's bounds."""
        readings = [each.reading for each in self.nlp.program.constraints]
        units = [self.of_case.label(each.dimension) if each.power else "" for each in readings]
        squares = [f"{unit}²" if unit and each.power == 2 else unit for unit, each in zip(units, readings, strict=True)]
        return tuple(map(self._multiplier, squares))

    def limit_multipliers(self, limits: Sequence[RunTimeLimit]) -> tuple[str, ...]:
        """Return the unit of each limit's multiplier."""
        return tuple(self._multiplier(self.of_case.label(each.dimension)) for each in limits)

    def _multiplier(self, unit: str) -> str:
        """Return the unit of F over another one; empty where F has none."""
        if unit == self.F:
            return ""
        return f"{self.F}/{unit}" if self.F and unit else self.F
