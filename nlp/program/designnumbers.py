"""The numbers of a program that make a design: its variables without internal unknowns of the robot."""

from __future__ import annotations

from .program import Program


def design_indices(program: Program) -> tuple[int, ...]:
    """Return the indices in ``x`` of dimensions and poses: of all variables but joints, and an epigraph's level."""
    places = program.places
    others = set(places.inner)
    if places.epigraph is not None:
        others.add(places.epigraph.level)
    return tuple(k for k in range(len(program.variables)) if k not in others)


def design_names(program: Program) -> frozenset[str]:
    """Return the names of the variables of a design, with those of its limits: all but joints and closed loops."""
    model = program.model
    inner = {program.variables[index].name for index in program.places.inner}
    names = {each.name for each in program.variables} | {each.name for each in program.constraints}
    closed = tuple(equation.name for equation in (*model.closure, *model.loops))
    return frozenset(name for name in names - inner if name.split(" at ")[0] not in closed)
