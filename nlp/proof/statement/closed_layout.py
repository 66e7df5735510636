"""A robot some of whose unknowns follow in closed form: its reach, and the case without these unknowns."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, Model, Substitution
from ....models.joints.closedform import ClosedForm
from ...case.case import Case
from ...case.limits.constraint import Reading
from ...case.limits.limits import Limits
from ...case.task import Sense
from ...case.workspace import Workspace
from ...program.layout import Layout
from ...program.sampling import starting_points
from .claims import REACH, Claim
from .posed_layout import extreme_program, posed_layout

#: Poses at which an equation is tested, and its largest residual, of order 1, where it holds by itself.
_TESTS, _IDENTITY = 32, 1e-11
_SEED = 0


@dataclass(frozen=True, eq=False)
class ReachClaims:
    """Claims that limbs reach every pose.

    Attributes:
        layout: the case as symbols of the pose, without loops, signs and limits: where a limb does not reach, its loop
            has no value.
        claims: one for each unknown in closed form.
    """

    layout: Layout
    claims: tuple[Claim, ...]


def reach_claims(case: Case, closed: ClosedForm, workspace: Workspace) -> ReachClaims:
    """Return the claims that limbs reach every pose.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        workspace: the poses.
    """
    layout = _bare_layout(case, closed.model, workspace)
    values = _on(layout, [each.value for each in closed.reaches])
    reading = Reading(Dimension.NUMBER)
    claims = tuple(
        Claim(f"reach limb {each.limb}", Sense.MIN, value, reading, REACH, 0.0)
        for each, value in zip(closed.reaches, values, strict=True)
    )
    return ReachClaims(layout, claims)


def closed_layout(case: Case, closed: ClosedForm, workspace: Workspace) -> Layout:
    """Return a case as symbols of the pose, with unknowns in closed form: all of its limbs reach every pose.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        workspace: the poses.
    """
    model = _without_identities(case, closed.model, workspace)
    return posed_layout(replace(case, model=model), workspace)


def _without_identities(case: Case, model: Model, workspace: Workspace) -> Model:
    """Return a robot without the loop equations that hold at every pose by themselves; with unknowns all are kept.

    A Delta that is held without rotation is such a robot: the second rod of a limb closes with the first. A bound for a
    robot without an equation holds for the robot with it, too: it is one over more poses.
    """
    if model.unknowns or not model.closure:
        return model
    layout = _bare_layout(case, model, workspace)
    nlp = extreme_program(layout, SX(0), Sense.MIN)
    scaled = _on(layout, [ca.vertcat(*[each.scaled for each in model.closure])])
    function = ca.Function("closure", [nlp.program.x, nlp.program.p], [ca.densify(each) for each in scaled])
    found = [function(x, nlp.arguments).full().ravel() for x in starting_points(nlp, _TESTS, _SEED)]
    # A limb that does not reach a pose has no value there.
    largest = np.nanmax(np.abs(found), axis=0, initial=0.0)
    known = np.isfinite(found).sum(axis=0) >= _TESTS // 2
    holds = known & (largest <= _IDENTITY)
    return replace(
        model, closure=tuple(each for each, is_identity in zip(model.closure, holds, strict=True) if not is_identity)
    )


def _bare_layout(case: Case, model: Model, workspace: Workspace) -> Layout:
    """Return a case as symbols of the pose, without conditions on it."""
    bare = replace(model, closure=(), loops=(), distances=(), signs=())
    return posed_layout(replace(case, model=bare, limits=Limits()), workspace)


def _on(layout: Layout, expressions: list[SX]) -> list[SX]:
    """Return expressions of a model's symbols as those of a layout."""
    robot, own = layout.robots[0], Substitution.identity(layout.case.model)
    unknowns = ca.vertcat(
        SX(0, 1), *[layout.table.variables_vector[k] for at_pose in layout.places.unknowns for k in at_pose]
    )
    given = Substitution(robot.parameters, unknowns, robot.rotation, robot.position)
    return list(ca.Function("values", own.all, expressions).call(given.all))
