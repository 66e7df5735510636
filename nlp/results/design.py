"""What a result says about building the design, as plain data: margins and costs, relaxations, sensitivities."""

from __future__ import annotations

from typing import Any

from ...models import FloatArray
from ..evidence.margins import costs_of, margins_as_data, margins_of
from ..evidence.sensitivity import sensitivities
from ..evidence.tolerance import tolerance_loss
from ..program.nlp import Nlp
from ..solve.multistart import ProgramSolution

#: What stands in a result where the robot is not defined.
NO_MARGINS: dict[str, Any] = {"margins": [], "limits": []}


def margins_in(nlp: Nlp, x: FloatArray, *, optimal: bool) -> dict[str, Any]:
    """Margins in every limit of the case, and one row for each number of it."""
    margins = margins_as_data(nlp, margins_of(nlp, x, optimal=optimal))
    return {"margins": margins, "limits": costs_of(margins)}


def relaxation_in(solution: ProgramSolution) -> list[dict[str, Any]]:
    """The numbers of the case that must be moved for it to be feasible, all of these at once."""
    units = solution.nlp.case.units
    return [
        {
            "key": row.key,
            "limit": units.shown(row.limit, row.dimension),
            "needed": units.shown(row.needed, row.dimension),
            "unit": units.label(row.dimension),
        }
        for row in solution.relaxation
    ]


def sensitivity_in(solution: ProgramSolution) -> dict[str, Any]:
    """What F owes to what is fixed, and what inexact joint centres may cost."""
    nlp, case = solution.nlp, solution.nlp.case
    rows = [
        {
            "name": row.name,
            "value": case.units.shown(row.value, row.dimension),
            "unit": case.units.label(row.dimension),
            "derivative": row.derivative * case.units.to_internal(1.0, row.dimension),
        }
        for row in sensitivities(nlp, solution.x)
    ]
    if case.joint_centre_tolerance is None:
        return {"sensitivity": rows}
    lost = tolerance_loss(nlp, solution.x, case.joint_centre_tolerance)
    joints = [
        {"limb": limb, "plate": plate, "gradient": gradient.tolist()}
        for (limb, plate), gradient in zip(lost.joints, lost.gradients, strict=True)
    ]
    tolerance = {"joint_centre": lost.tolerance, "loss": lost.loss, "loss_there": lost.loss_there, "joints": joints}
    return {"sensitivity": rows, "tolerance": tolerance}
