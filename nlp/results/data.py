"""A solution as plain data, in the case's own words and units: what ``--json`` writes and the tables show.

Nothing in it is ever NaN or infinite, but an infinite pitch, which is the string ``"inf"``. A solve that failed has no
``F``: what it reached is under ``reached``, and can't be taken for an answer.
"""

from __future__ import annotations

import math
import platform
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from ...models import Dimension, FloatArray, axis_from_screw
from ..case.case import Case
from ..certificate.certificate import Certificate
from ..evidence.kkt import FEASIBLE, linearise
from ..evidence.optimality import Evidence
from ..evidence.principal_motions import analyse_tasks
from ..evidence.state import RobotState, StatedPose, evaluate, stated_poses
from ..program.nlp import Nlp
from ..solve.multistart import ProgramSolution
from ..solve.solution import Solution, TaskOutcome
from ..solve.starts import StartStatus
from ..units import Units
from .design import NO_MARGINS, margins_in, relaxation_in, sensitivity_in

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..solve.certified import Certified

SCHEMA = 1


def result_of(found: Solution | Certified) -> dict[str, Any]:
    """Return the whole result of a solve, with its certificates where there are any, ready for JSON."""
    certified = None if isinstance(found, Solution) else found
    solution = found if isinstance(found, Solution) else found.solution
    certificates = () if certified is None else certified.tasks
    if solution.combination is None:
        return _result_of_task(solution.outcomes[0].own, 0, certificates[0] if certificates else None)
    return _result_of_several(solution, certificates, None if certified is None else certified.combined)


def _result_of_task(solution: ProgramSolution, task: int, certificate: Certificate | None) -> dict[str, Any]:
    """Return the result of the program of a task, by its index in the case."""
    case = solution.nlp.case
    answer = solution.status.is_answer
    state = solution.state
    reached = None if answer else _reached(solution)
    return {
        **_head(case),
        "sense": solution.nlp.sense.value,
        "status": solution.status.value,
        "F": _objective(solution) if answer and state is not None else None,
        **({} if reached is None else {"reached": reached}),
        **({"relaxation": relaxation_in(solution)} if solution.relaxation else {}),
        **(state_of(case, state, task) if state is not None else {}),
        **(poses_of(solution.nlp, solution.x) if state is not None else {}),
        "optimality": None if solution.evidence is None else _optimality(solution.nlp, solution.evidence),
        **(margins_in(solution.nlp, solution.x, optimal=answer) if state is not None else NO_MARGINS),
        **(sensitivity_in(solution) if answer and state is not None else {}),
        "starts": _starts(solution),
        "certificate": None if certificate is None else certificate.as_data(),
        "seed": solution.seed,
        "versions": versions(),
        "seconds": solution.seconds,
    }


def _result_of_several(
    solution: Solution, certificates: Sequence[Certificate], combined_certificate: Certificate | None
) -> dict[str, Any]:
    """Return the result of several tasks, with the certificates of each task and of the combined program."""
    case, outcomes, combination = solution.case, solution.outcomes, solution.combination
    if combination is None:
        raise ValueError("the solution is that of one task")
    state, combined = outcomes[0].state, combination.combined
    robot = {} if state is None else state_of(case, state)
    if state is not None:
        robot |= poses_of(outcomes[0].own.nlp, solution.x)
        # Where one program brought the tasks together, a limit has a cost: of that program's value.
        nlp, x = (outcomes[0].own.nlp, solution.x) if combined is None else (combined.nlp, combined.x)
        robot |= margins_in(nlp, x, optimal=combined is not None and solution.is_made)
    for of_a_task in ("task", "rates", "task_is_free"):
        robot.pop(of_a_task, None)
    if not solution.is_made:
        robot = {"reached": robot}
    return {
        **_head(case),
        "status": solution.status.value,
        "tasks": [
            _result_of_task(outcome.own, j, certificates[j] if certificates else None)
            for j, outcome in enumerate(outcomes)
        ],
        "combined": {
            "method": combination.method.value,
            "value": combination.value,
            **robot,
            "tasks": [_outcome(outcome, answered=solution.is_made) for outcome in outcomes],
            "violated": list(combination.violated),
            "notices": list(combination.notices),
            "optimality": None
            if combined is None or combined.evidence is None
            else _optimality(combined.nlp, combined.evidence),
            "starts": None if combined is None else _starts(combined),
            "certificate": None if combined_certificate is None else combined_certificate.as_data(),
        },
        "versions": versions(),
        "seconds": solution.seconds,
    }


def certified_of(certified: Certified) -> dict[str, Any]:
    """What is proved of a case, ready for JSON: of every task, and of the combined program where there is one."""
    certificate = certified.certificate
    case = certified.tasks[0].nlp.case
    return {
        **_head(case),
        "certificate": None if certificate is None else certificate.as_data(),
        "point": None if certificate is None else _point(certificate),
        "tasks": [
            {"name": task.name, "sense": each.nlp.sense.value, "certificate": each.as_data(), "point": _point(each)}
            for task, each in zip(case.tasks, certified.tasks, strict=True)
        ],
        "versions": versions(),
    }


def _point(certificate: Certificate) -> dict[str, float] | None:
    """The best point known, by the names of the program's variables, in the case's units."""
    nlp = certificate.nlp
    if certificate.x is None:
        return None
    variables = zip(nlp.program.variables, certificate.x, strict=True)
    return {each.name: nlp.case.units.shown(float(value), each.dimension) for each, value in variables}


def evaluation_of(nlps: Sequence[Nlp], x: FloatArray, states: Sequence[RobotState]) -> dict[str, Any]:
    """The robot at one point, ready for JSON: what its first task meets, then every task, and what it resists least.

    Args:
        nlps: the program of each task.
        x: (n,) the point.
        states: the robot there with each task's rates, in order.
    """
    case = nlps[0].case
    analysis = analyse_tasks(states[0].jacobian)
    return {
        **_head(case),
        "F": nlps[0].evaluate(x)[0] if case.pose_count > 1 else states[0].F,
        **state_of(case, states[0]),
        **poses_of(nlps[0], x),
        "tasks": [
            {
                **_task(case, j),
                "F": nlps[j].evaluate(x)[0] if case.pose_count > 1 else state.F,
                "rates": state.rates.tolist(),
                "task_is_free": state.is_zero,
            }
            for j, state in enumerate(states)
        ],
        "violated": violations(nlps[0], x),
        **margins_in(nlps[0], x, optimal=False),
        "principal_motions": {
            "rotations": [{"F": each.F, **motion_of(each.twist)} for each in analysis.rotations],
            "translations": [{"F": each.F, **motion_of(each.twist)} for each in analysis.translations],
        },
        "versions": versions(),
    }


def _objective(solution: ProgramSolution) -> float:
    """F of the solution; over several poses, their sum, mean or worst."""
    state, nlp = solution.state, solution.nlp
    return nlp.evaluate(solution.x)[0] if state is None or len(nlp.program.robots) > 1 else state.F


def poses_of(nlp: Nlp, x: FloatArray) -> dict[str, Any]:
    """The poses that the case states, and the robot at every pose, for cases with several; else nothing.

    F and rates are those of the program's task, of its first where it combines several.
    """
    if len(nlp.program.robots) == 1:
        return {}
    stated = [_pose_of(nlp.case, pose) for pose in stated_poses(nlp, x)]
    states = [evaluate(nlp, x, k) for k in range(len(nlp.program.robots))]
    parts = ("pose", "jacobian", "rates", "rank", "singular", "singular_values", "quantities")
    return {
        "pose": stated[0],
        "stated_poses": stated,
        "over_poses": nlp.case.over_poses.value,
        "poses": [
            {"F": state.F, **{key: value for key, value in state_of(nlp.case, state).items() if key in parts}}
            for state in states
        ],
    }


def _pose_of(case: Case, pose: RobotState | StatedPose) -> dict[str, Any]:
    return {
        "position": pose.position.tolist(),
        "axis": pose.axis.tolist(),
        "angle": case.units.shown(pose.angle, Dimension.ANGLE),
        "rotation_matrix": pose.rotation.tolist(),
    }


def _head(case: Case) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "case": case.name,
        "title": case.title,
        "model": case.model.name,
        "units": {"length": case.units.length, "angle": case.units.angle},
    }


def _task(case: Case, task: int) -> dict[str, Any]:
    chosen = case.tasks[task]
    return {"name": chosen.name, "sense": chosen.sense.value, **motion_of(chosen.twist)}


def _outcome(outcome: TaskOutcome, *, answered: bool) -> dict[str, Any]:
    """What a compromise means for one task; what is no answer has no F, and a task without an optimum no best."""
    best = outcome.own.F if outcome.own.status.is_answer else None
    state = outcome.state if answered else None
    loss = outcome.loss if state is not None and best is not None else math.nan
    return {
        "name": outcome.task.name,
        "sense": outcome.task.sense.value,
        "weight": outcome.task.weight,
        "F": None if state is None else outcome.F,
        "best": best,
        "loss": _finite(loss),
        "relative_loss": _finite(loss / best) if best else None,
        "unique": outcome.unique,
        "verdict": None if outcome.evidence is None else outcome.evidence.kind.value,
        "rates": None if state is None else state.rates.tolist(),
    }


def state_of(case: Case, state: RobotState, task: int = 0) -> dict[str, Any]:
    """The robot at a point: parameters, pose, task, Jacobian, rates and rank."""
    return {
        "parameters": parameters_of(case, state),
        "pose": _pose_of(case, state),
        "task": _task(case, task),
        "limbs": [row.limb for row in case.model.wrenches],
        "jacobian": state.jacobian.tolist(),
        "rates": state.rates.tolist(),
        "rank": state.rank,
        "singular": state.is_singular,
        "singular_values": state.singular_values.tolist(),
        "free_motions": [motion_of(twist) for twist in state.free_twists],
        "task_is_free": state.is_zero,
        "quantities": {
            item.name: {
                owner: case.units.shown(float(value), item.dimension)
                for owner, value in zip(item.owners, state.quantities[item.name], strict=True)
            }
            for item in case.model.quantities
            if np.isfinite(state.quantities[item.name]).all()
        },
        **({"characteristic_length": case.characteristic_length} if case.model.has_couples else {}),
    }


def parameters_of(case: Case, state: RobotState) -> dict[str, Any]:
    """Values of the robot's parameters by name, in the case's units; a list for a point or direction."""
    shown: dict[str, Any] = {}
    for parameter in case.model.parameters:
        values = [case.units.shown(float(value), parameter.dimension) for value in state.parameters[parameter.name]]
        shown[parameter.name] = values[0] if len(values) == 1 else values
    return shown


def motion_of(twist: ArrayLike) -> dict[str, Any]:
    """A twist with its axis, point and pitch; a pure translation has no point."""
    screw = axis_from_screw(twist)
    translation = math.isinf(screw.pitch)
    return {
        "twist": np.asarray(twist, dtype=np.float64).tolist(),
        "axis": screw.axis.tolist(),
        "point": None if translation else screw.point.tolist(),
        "pitch": "inf" if translation else screw.pitch,
    }


def versions() -> dict[str, str]:
    """Versions of what the numbers depend on."""
    return {
        "screwsynth": version("screwsynth"),
        "casadi": ca.CasadiMeta.version(),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }


def _reached(solution: ProgramSolution) -> dict[str, Any]:
    nlp = solution.nlp
    return {"F": _finite(nlp.evaluate(solution.x)[0]), "violated": violations(nlp, solution.x)}


def violations(nlp: Nlp, x: FloatArray) -> list[dict[str, Any]]:
    """Constraints that a point lies outside of: name, value and limit, in the case's words and units.

    Those that are violated a thousand times less than the worst are left out: they only give way to it.
    """
    at, g = linearise(nlp, x), nlp.evaluate(x)[1]
    rows: list[dict[str, Any]] = []
    units = nlp.case.units
    for j, side in enumerate(nlp.sides.sides):
        if at.slack[j] >= -max(FEASIBLE, 1e-3 * at.violation):
            continue
        value = float(x[side.variable]) if side.variable is not None else float(g[side.constraint or 0])
        limit = float(nlp.sides.limit[j])
        if side.constraint is None:
            dimension = nlp.program.variables[side.variable or 0].dimension
        else:
            reading = nlp.program.constraints[side.constraint].reading
            dimension, value, limit = reading.dimension, reading.from_value(value), reading.from_value(limit)
        rows.append(
            {
                "name": side.name,
                "bound": side.bound,
                "value": units.shown(value, dimension),
                "limit": units.shown(limit, dimension),
            }
        )
    return rows


def _optimality(nlp: Nlp, evidence: Evidence) -> dict[str, Any]:
    dimensions = {variable.name: variable.dimension for variable in nlp.program.variables}
    dimensions |= {constraint.name: constraint.reading.dimension for constraint in nlp.program.constraints}
    units = nlp.case.units
    return {
        "kind": evidence.kind.value,
        "stationarity": _finite(evidence.stationarity),
        "feasibility": _finite(evidence.feasibility),
        "complementarity": _finite(evidence.complementarity),
        "licq": evidence.licq,
        "active": [
            {
                "name": side.name,
                "bound": side.bound,
                "value": units.shown(side.value, dimensions[side.name]),
                # F per unit of the limit: the unit's own factor divides.
                "multiplier": side.multiplier * units.to_internal(1.0, dimensions[side.name]),
            }
            for side in evidence.active
        ],
        "reduced_hessian_eigenvalues": evidence.eigenvalues.tolist(),
        "flat_directions": [_flat(direction, dimensions, units) for direction in evidence.flat],
    }


def _flat(direction: Mapping[str, float], dimensions: Mapping[str, Dimension], units: Units) -> dict[str, float]:
    """A flat direction in the case's units, its largest rate 1."""
    rates = {name: units.shown(rate, dimensions[name]) for name, rate in direction.items()}
    largest = max(rates.values(), key=abs)
    return {name: rate / largest for name, rate in rates.items()}


def _starts(solution: ProgramSolution) -> dict[str, Any]:
    ended = Counter(start.status for start in solution.starts)
    return {
        "run": len(solution.starts),
        "converged": ended[StartStatus.CONVERGED],
        "failed": {
            status.value: ended[status]
            for status in StartStatus
            if status is not StartStatus.CONVERGED and ended[status]
        },
        "optima": [{"F": found.F, "count": found.count, "spread": found.spread} for found in solution.optima],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
