"""Assembly of the nonlinear program from a layout, an objective and further constraints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
from casadi import SX

from ...models import frozen_vector, reason_for_zero_row
from ..case.limits.constraint import BoundedConstraint
from ..case.limits.form import Call
from ..case.task import Sense
from ..errors import CaseError
from .layout import Layout
from .nlp import Nlp
from .places import Epigraph
from .program import Program


def assemble(
    layout: Layout,
    objective: SX | Call,
    sense: Sense,
    constraints: Sequence[BoundedConstraint] = (),
    epigraph: Epigraph | None = None,
    weights: tuple[int, ...] = (),
) -> Nlp:
    """Return the program of a layout.

    Args:
        layout: the case as symbols.
        objective: (1, 1) expression in them, or the call whose value it is.
        sense: whether the objective is maximised or minimised.
        constraints: constraints in addition to those of the layout.
        epigraph: places of the epigraph, where the objective is an epigraph variable.
        weights: indices in ``p`` of the tasks' weights; empty for one task.

    Raises:
        CaseError: a limb has zero length at every point of the box.
    """
    case, table = layout.case, layout.table
    bounded = (*layout.constraints, *constraints)
    program = Program(
        variables=tuple(table.variables),
        arguments=tuple(table.arguments),
        x=table.variables_vector,
        p=table.arguments_vector,
        objective=objective.value if isinstance(objective, Call) else objective,
        constraints=tuple(item.constraint for item in bounded),
        robots=layout.robots,
        model=case.model,
        places=replace(layout.places, epigraph=epigraph, weights=weights),
        objective_call=objective if isinstance(objective, Call) else None,
    )
    nlp = Nlp(
        program=program,
        case=case,
        sense=sense,
        arguments=frozen_vector(table.values),
        lower=frozen_vector([bound.lower for bound in table.bounds]),
        upper=frozen_vector([bound.upper for bound in table.bounds]),
        start=frozen_vector([bound.first for bound in table.bounds]),
        g_lower=frozen_vector([item.lower for item in bounded]),
        g_upper=frozen_vector([item.upper for item in bounded]),
        constant_limits=layout.constant_limits,
        families=layout.families,
        implied=layout.implied,
        fixed_families=layout.fixed_families,
    )
    _check_limbs(nlp)
    return nlp


def _check_limbs(nlp: Nlp) -> None:
    """Refuse a limb whose direction is zero at every point of the box.

    Raises:
        CaseError: there is such a limb.
    """
    program = nlp.program
    for robot, kernel in zip(program.robots, program.kernels.robot_states, strict=True):
        values = kernel(nlp.start, nlp.arguments).squares.ravel()
        free = ca.which_depends(robot.squares, program.x, 1, True) if nlp.n else [False] * len(values)
        for row, value, varies in zip(program.model.wrenches, values, free, strict=True):
            if not varies and not value > 0:
                raise CaseError("robot.parameters", reason_for_zero_row(row), source=nlp.case.source)
