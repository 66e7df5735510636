"""Loops over calls of one function, with tables of the inputs of each call.

Inputs are *slots*. The first slots are *entries*, expressions of the program's variables: joint centres, spans of legs,
rotations. The others are values of inner calls. Generated C has the function of a loop once, with derivatives with
respect to its inputs; the chain rule gives those with respect to the variables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ..case.limits.constraint import Call, Spectral
from ..program.program import Program
from .calls import Calls, by_form, find_calls


@dataclass(frozen=True, eq=False)
class Loop:
    """Loop over calls of one function.

    Attributes:
        inputs: (k, 1) symbols of the inputs that depend on variables.
        constants: (q, 1) symbols of the inputs that do not.
        values: (r, 1) expressions of inputs and constants.
        slots: k slots of each call.
        constant_places: q indices of each call among the constants.
        outputs: targets of the r values of each call: slots; in final loops, the index of a constraint, or for the
            objective the number of constraints.
    """

    inputs: SX
    constants: SX
    values: SX
    slots: tuple[tuple[int, ...], ...]
    constant_places: tuple[tuple[int, ...], ...]
    outputs: tuple[tuple[int, ...], ...]


class SpectralCall(NamedTuple):
    """Constraint on singular values: index, estimate, and slots of J's entries, row by row."""

    place: int
    spectral: Spectral
    slots: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Loops:
    """Loops of a program.

    Attributes:
        entries: (e, 1) expressions of the first slots.
        constants: (q, 1) expressions of arguments only that calls take.
        slot_count: number of all slots.
        inner: loops with values that are slots, in order of computation.
        final: loops with values that are constraints or the objective.
        spectra: constraints on singular values.
        plain: indices of the constraints outside loops.
        has_objective: True if a loop computes the objective.
    """

    entries: SX
    constants: SX
    slot_count: int
    inner: tuple[Loop, ...]
    final: tuple[Loop, ...]
    spectra: tuple[SpectralCall, ...]
    plain: tuple[int, ...]
    has_objective: bool

    @property
    def all(self) -> tuple[Loop, ...]:
        """All loops, the inner ones first."""
        return (*self.inner, *self.final)

    def __bool__(self) -> bool:
        return bool(self.final or self.spectra)


def find_loops(program: Program) -> Loops:
    """Return the loops of a program."""
    return _Tables(program, find_calls(program)).loops()


class _Group(NamedTuple):
    """Calls of one form, with the indices of the used values and their targets.

    For inner calls ``targets`` are their indices among all inner calls; for final calls the places of their values.
    """

    calls: list[Call]
    wanted: list[int]
    targets: list[int]


class _Value(NamedTuple):
    """Value of an inner call: index of the call, and index in its values."""

    call: int
    place: int


class _Tables:
    """Numbering of slots and constants of a program and its calls."""

    def __init__(self, program: Program, calls: Calls) -> None:
        self._program, self._calls = program, calls
        self._values: dict[int, _Value] = {}
        for k, item in enumerate(calls.inner):
            for key, place in item.computed.items():
                self._values.setdefault(key, _Value(k, place))
        self._spectral = [
            (place, each.spectral, calls.matrices[each.pose])
            for place, each in enumerate(program.constraints)
            if each.spectral is not None
        ]
        self._same = _canonical(
            [*calls.matrices, *(each.call.inputs for each in calls.inner), *(each.call.inputs for each in calls.final)]
        )
        self._entries: dict[int, SX] = {}
        self._constants: dict[int, SX] = {}
        self._slots: dict[_Value, int] = {}

    def loops(self) -> Loops:
        final = [
            _Group([each.call for each in members], [0], [each.place for each in members])
            for members in by_form(self._calls.final)
        ]
        inner = self._inner_groups(final)
        groups = [(group, self._kinds(group.calls)) for group in (*inner, *final)]
        for group, kind in groups:
            for call in group.calls:
                for each, is_constant in zip(ca.vertsplit(call.inputs), kind, strict=True):
                    if is_constant is None:
                        self._add_entry(each)
        for _, _, matrix in self._spectral:
            for each in ca.vertsplit(matrix):
                self._add_entry(each)
        for group in inner:
            for index in group.targets:
                for i in group.wanted:
                    self._slots[_Value(index, i)] = len(self._entries) + len(self._slots)
        made = [self._loop(group, kind, k < len(inner)) for k, (group, kind) in enumerate(groups)]
        places = {item.place for item in self._calls.final} | {place for place, _, _ in self._spectral}
        count = len(self._program.constraints)
        return Loops(
            entries=ca.vertcat(SX(0, 1), *self._entries.values()),
            constants=ca.vertcat(SX(0, 1), *self._constants.values()),
            slot_count=len(self._entries) + len(self._slots),
            inner=tuple(made[: len(inner)]),
            final=tuple(made[len(inner) :]),
            spectra=tuple(
                SpectralCall(place, spectral, tuple(self._slot(each) for each in ca.vertsplit(matrix)))
                for place, spectral, matrix in self._spectral
            ),
            plain=tuple(place for place in range(count) if place not in places),
            has_objective=count in places,
        )

    def _inner_groups(self, final: Sequence[_Group]) -> list[_Group]:
        """Return the required inner calls, ordered so that inputs come first."""
        wanted: dict[int, set[int]] = {}
        inputs = [call.inputs for group in final for call in group.calls] + [matrix for _, _, matrix in self._spectral]
        while inputs:
            for each in ca.vertsplit(inputs.pop()):
                value = self._values.get(each.element_hash())
                if value is not None:
                    if value.call not in wanted:
                        inputs.append(self._calls.inner[value.call].call.inputs)
                    wanted.setdefault(value.call, set()).add(value.place)
        groups: dict[tuple[int, object], _Group] = {}
        for index in sorted(wanted):
            call = self._calls.inner[index].call
            group = groups.setdefault((self._depth(call), call.form), _Group([], [], []))
            group.calls.append(call)
            group.targets.append(index)
            group.wanted.extend(i for i in sorted(wanted[index]) if i not in group.wanted)
        return [groups[key] for key in sorted(groups, key=lambda key: key[0])]

    def _depth(self, call: Call) -> int:
        """Return the number of inner calls below the deepest input of a call."""
        found = (self._values.get(each.element_hash()) for each in ca.vertsplit(call.inputs))
        below = {value.call for value in found if value is not None}
        return max((1 + self._depth(self._calls.inner[k].call) for k in below), default=0)

    def _kinds(self, calls: Sequence[Call]) -> list[float | bool | None]:
        """Return for each input: a number if constant or unused in all calls, True if independent of x, or None."""
        x, form = self._program.x, calls[0].form
        u = SX.sym("u", calls[0].inputs.numel())
        used = ca.which_depends(form(u), u, 1, False)
        kinds: list[float | bool | None] = []
        for i, row in enumerate(zip(*(ca.vertsplit(call.inputs) for call in calls), strict=True)):
            if not used[i]:
                kinds.append(0.0)
            elif all(each.is_constant() for each in row) and len({float(each) for each in row}) == 1:
                kinds.append(float(row[0]))
            elif any(each.element_hash() in self._values for each in row):
                kinds.append(None)
            else:
                varies = bool(x.numel()) and any(ca.which_depends(ca.vertcat(*row), x, 1, True))
                kinds.append(None if varies else True)
        return kinds

    def _add_entry(self, element: SX) -> None:
        """Add an expression (1, 1) to the entries unless it is the value of an inner call."""
        if element.element_hash() not in self._values:
            same = self._same.get(element.element_hash(), element)
            self._entries.setdefault(same.element_hash(), same)

    def _slot(self, element: SX) -> int:
        """Return the slot of an expression (1, 1)."""
        value = self._values.get(element.element_hash())
        if value is not None:
            return self._slots[value]
        return list(self._entries).index(self._same.get(element.element_hash(), element).element_hash())

    def _constant_place(self, element: SX) -> int:
        """Return the index of an expression (1, 1) among the constants, added if new."""
        self._constants.setdefault(element.element_hash(), element)
        return list(self._constants).index(element.element_hash())

    def _loop(self, group: _Group, kinds: Sequence[float | bool | None], is_inner: bool) -> Loop:
        """Return the loop statement of C that evaluates the calls of a group."""
        symbols = [SX(kind) if isinstance(kind, float) else SX.sym("u") for kind in kinds]
        varying = [i for i, kind in enumerate(kinds) if kind is None]
        constant = [i for i, kind in enumerate(kinds) if kind is True]
        values = group.calls[0].form(ca.vertcat(*symbols))
        outputs = [
            tuple(self._slots[_Value(target, i)] for i in group.wanted) if is_inner else (target,)
            for target in group.targets
        ]
        return Loop(
            inputs=ca.vertcat(SX(0, 1), *[symbols[i] for i in varying]),
            constants=ca.vertcat(SX(0, 1), *[symbols[i] for i in constant]),
            values=ca.vertcat(*[values[i] for i in group.wanted]),
            slots=tuple(tuple(map(self._slot, _parts(call, varying))) for call in group.calls),
            constant_places=tuple(tuple(map(self._constant_place, _parts(call, constant))) for call in group.calls),
            outputs=tuple(outputs),
        )


def _parts(call: Call, indices: Sequence[int]) -> list[SX]:
    return [call.inputs[i] for i in indices]


def _canonical(expressions: Sequence[SX]) -> dict[int, SX]:
    """Return one representative (1, 1) of equal expressions, by the hash of each."""
    joined = ca.vertcat(SX(0, 1), *expressions)
    both = zip(ca.vertsplit(joined), ca.vertsplit(ca.cse(joined)), strict=True)
    return {each.element_hash(): same for each, same in both}
