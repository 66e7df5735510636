"""The :class:`Model` that a robot function returns, frozen and checked once.

A model is symbolic: it gives the unit wrenches of the limbs as expressions of the parameters, the pose and, for robots
given joint by joint, the unknowns that the closure equations determine. Values, bounds, tasks and solvers come from a
case.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, fields, replace
from types import MappingProxyType

import casadi as ca
import numpy as np
from casadi import SX

from .arrays import FloatArray
from .drawing import Scene
from .limbjoints import LimbJoint, LimbLink
from .member import Member
from .parts import (
    Actuator,
    AssemblySign,
    Closure,
    GenericRanks,
    JointScrews,
    Leg,
    Parameter,
    PathStructure,
    PoseSetting,
    PoseSymbols,
    Quantity,
    Unknown,
)
from .shown import Shown
from .values import dataclass
from .whole import Whole, expressions_of
from .wrench import RowLabel, Wrench, WrenchKind


class ModelError(ValueError):
    """Error of an inconsistent model. The message names the robot and the fault."""


@dataclass(frozen=True, eq=False)
class Model(Whole, Shown):
    """Parallel robot as symbols and expressions.

    Attributes:
        name: name of the robot in case files.
        description: one sentence for people.
        options: options with which the robot function made this model.
        legs: legs between joint centres, for limits on joints, plates and clearances; empty for other limbs.
        built: rows with joint-centre errors of the legs, for manufacturing tolerances; empty for a robot without them.
        parameters: dimensions that a case fixes or frees.
        pose: symbols of the pose.
        home: (3,) platform position for a starter case with the typical parameters, length.
        wrenches: rows of single wrenches, any number of them.
        members: limb members, which resist with a space of wrenches; their rows follow those of ``wrenches``.
        quantities: named quantities for results and limits.
        scene: drawing of the robot.
        unknowns: unknowns of the closure equations; empty for robots whose rows follow from parameters and pose.
        closure: independent equations that determine the unknowns, given the free actuator coordinates.
        loops: all loop equations; empty if ``closure`` contains all of them.
        signs: expressions that are positive in the home assembly mode, where they are known.
        distances: equations that follow from the loop equations and speed up searches over boxes.
        actuators: actuated joints of a robot given joint by joint; empty for a robot given by its rows.
        joint_screws: screws of the limbs' joints, where they are known.
        joints: joints of the limbs, for limits.
        links: links of the limbs, as segments.
        remarks: sentences for the user on possible mistakes in a robot given joint by joint.
        generic: ranks at almost all dimensions and poses; None for a robot given by its rows.
        structure: structure of each chain of joints; empty for a robot given by its rows.
        length_unit: unit of the typical lengths, such as ``m``; empty for proportions in any unit.
        size: (1, 1) characteristic size of the robot, length; None for the norm of the parameters that are lengths.
        settings: parameters that follow the pose, see :mod:`.posesettings`; empty for a robot as its function made it.
        locked: labels of the actuated joints with free coordinates that are parameters, see
            :meth:`with_joints_as_parameters`; empty for a robot as its function made it.

    Raises:
        ModelError: an expression uses a symbol that is not declared, a name or symbol appears twice, a shape is wrong,
            an unknown has no finite bounds, a leg has no row, the built rows do not match the rows, or a drawing
            refers to a point, limb or parameter that does not exist.
    """

    name: str
    description: str
    parameters: tuple[Parameter, ...]
    pose: PoseSymbols
    home: tuple[float, float, float]
    wrenches: tuple[Wrench, ...]
    quantities: tuple[Quantity, ...] = ()
    scene: Scene = field(default_factory=Scene)
    unknowns: tuple[Unknown, ...] = ()
    closure: tuple[Closure, ...] = ()
    options: Mapping[str, object] = field(default_factory=dict)
    legs: tuple[Leg, ...] = ()
    built: tuple[Wrench, ...] = ()
    members: tuple[Member, ...] = ()
    loops: tuple[Closure, ...] = ()
    signs: tuple[AssemblySign, ...] = ()
    distances: tuple[Closure, ...] = ()
    actuators: tuple[Actuator, ...] = ()
    joint_screws: tuple[JointScrews, ...] = ()
    joints: tuple[LimbJoint, ...] = ()
    links: tuple[LimbLink, ...] = ()
    remarks: tuple[str, ...] = ()
    generic: GenericRanks | None = None
    structure: tuple[PathStructure, ...] = ()
    length_unit: str = ""
    size: SX | None = None
    settings: tuple[PoseSetting, ...] = ()
    locked: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))
        _check_names(self)
        _check_shapes(self)
        _check_symbols(self)
        _check_references(self)

    def __repr__(self) -> str:
        options = "".join(f", {key}={value!r}" for key, value in self.options.items() if not isinstance(value, Mapping))
        counts = f"{len(self.parameters)} parameters, {len(self.limbs)} limbs, {len(self.rows)} rows"
        return f"<Model {self.name!r}{options}: {counts}>"

    @property
    def symbols(self) -> SX:
        """Symbols (d, 1) of all components of the parameters."""
        return ca.vertcat(SX(0, 1), *[item.symbol for item in self.parameters])

    @property
    def typical(self) -> FloatArray:
        """Typical values (d,) of all components of the parameters."""
        return np.array([value for item in self.parameters for value in item.typical], dtype=np.float64)

    @property
    def limbs(self) -> tuple[str, ...]:
        """Limb names, each once, in the order of their first row."""
        return tuple(dict.fromkeys([*(row.limb for row in self.wrenches), *(member.limb for member in self.members)]))

    @property
    def rows(self) -> tuple[RowLabel, ...]:
        """Limb and kind of each row of the Jacobian as results state it: for a member, a basis of its wrenches."""
        own = [row.label for row in self.wrenches]
        return (*own, *(RowLabel(each.limb, kind, each.label) for each in self.members for kind in each.kinds))

    @property
    def frame_rows(self) -> tuple[RowLabel, ...]:
        """Limb and kind of each row of a :class:`~.instance.RobotInstance`: for a member, all rows of its projector."""
        own = [row.label for row in self.wrenches]
        return (*own, *(RowLabel(each.limb, each.kind, each.label) for each in self.members for _ in range(each.size)))

    @property
    def nested(self) -> tuple[JointScrews, ...]:
        """Chains of joints with nested loops, in limbs that resist the platform."""
        return tuple(each for each in self.joint_screws if each.is_nested and each.limb in self.limbs)

    @property
    def rank(self) -> int:
        """Rank of J at almost all dimensions and poses; below six, all poses are singular."""
        return min(len(self.rows), 6) if self.generic is None else self.generic.jacobian

    @property
    def free_joints(self) -> tuple[str, ...]:
        """Labels of the actuated joints with free actuator coordinates."""
        return tuple(each.joint for each in self.unknowns if each.is_free)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Labels of the actuated joints that the pose does not determine: unknowns, or parameters for a path."""
        return (*self.locked, *self.free_joints)

    def with_joints_as_parameters(self) -> Model:
        """Return the robot with its free actuator coordinates as parameters, which are 0 at home.

        Loop equations then determine all remaining unknowns from parameters and pose. Wrenches, and so F, are those
        with locked actuators, as before.
        """
        free = [each for each in self.unknowns if each.is_free]
        more = (
            Parameter(
                joint_parameter(each.joint), each.symbol, each.dimension, f"coordinate of joint {each.joint}", (0.0,)
            )
            for each in free
        )
        return replace(
            self,
            parameters=(*self.parameters, *more),
            unknowns=tuple(each for each in self.unknowns if not each.is_free),
            structure=_without_free(self),
            locked=(*self.locked, *(each.joint for each in free)),
        )

    @property
    def has_couples(self) -> bool:
        """True if F depends on the characteristic length, because a row has a couple that does work."""
        return any(row.kind is not WrenchKind.FORCE for row in self.rows)


def joint_parameter(label: str) -> str:
    """Return the name of the parameter or variable of a free actuator coordinate, by the label of its joint."""
    return f"joint.{label}"


def _without_free(model: Model) -> tuple[PathStructure, ...]:
    """Return the chains of a robot, which have its unknowns in order, without the free actuator coordinates."""
    unknowns, found = iter(model.unknowns), list[PathStructure]()
    for each in model.structure:
        own = [next(unknowns) for _ in range(each.unknowns)]
        found.append(replace(each, unknowns=sum(not unknown.is_free for unknown in own)))
    return tuple(found)


def _model_error(model: Model, fault: str) -> ModelError:
    """Return the error of a fault in a model."""
    return ModelError(f"model {model.name!r}: {fault}")


def _check_names(model: Model) -> None:
    """Refuse a model without wrenches, repeated names and unknowns without finite bounds."""
    if not (model.wrenches or model.members):
        raise _model_error(model, "it has no wrenches, so there is no Jacobian")
    names = [name for parameter in model.parameters for name in parameter.components]
    names += [unknown.name for unknown in model.unknowns] + [equation.name for equation in model.closure]
    names += [quantity.name for quantity in model.quantities]
    names += [f"point {point.name}" for point in model.scene.points]
    names += [f"direction {item.name}" for item in model.scene.directions]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise _model_error(model, f"names appear twice: {', '.join(repeated)}")
    for unknown in model.unknowns:
        if not -math.inf < unknown.lower < unknown.upper < math.inf:
            raise _model_error(
                model,
                f"the joint coordinate {unknown.name!r}, for which the loop equations are solved, needs finite bounds, "
                "the lower below the upper",
            )


def _check_shapes(model: Model) -> None:
    """Refuse an expression of a wrong shape."""
    for parameter in model.parameters:
        if len(parameter.typical) not in (1, 3):
            raise _model_error(model, f"parameter {parameter.name!r} should have 1 or 3 components")
        starter, typical = len(parameter.starter or parameter.typical), len(parameter.typical)
        if starter != typical:
            fault = f"the starter value of parameter {parameter.name!r} has a wrong number of components"
            raise _model_error(model, f"{fault}: {starter}; the typical value has {typical}")
    expected: list[tuple[str, SX, tuple[int, int]]] = [
        ("pose rotation", model.pose.rotation, (3, 3)),
        ("pose position", model.pose.position, (3, 1)),
    ]
    for index, row in enumerate(model.wrenches):
        expected += [
            (f"wrench {index} force", row.force, (3, 1)),
            (f"wrench {index} moment", row.moment, (3, 1)),
            (f"wrench {index} square", row.square, (1, 1)),
        ]
    expected += [
        (item.name, item.symbol, (3 if item.is_direction else len(item.typical), 1)) for item in model.parameters
    ]
    for index, member in enumerate(model.members):
        expected += [
            (f"member {index} centre", member.centre, (3, 1)),
            (f"member {index} screws", member.screws, (6, member.screws.shape[1])),
            *([] if member.slide is None else [(f"member {index} slide", member.slide, (3, 1))]),
        ]
    for each in model.actuators:
        relations = model.actuators[0].relations.shape[0]
        expected += [
            (f"actuator {each.name}", each.screws, (6, len(each.members))),
            (f"relations of actuator {each.name}", each.relations, (relations, 1)),
        ]
    expected += [(unknown.name, unknown.symbol, (1, 1)) for unknown in model.unknowns]
    expected += [(each.name, each.expression, (1, 1)) for each in (*model.closure, *model.loops)]
    expected += [(each.name, each.value, (1, 1)) for each in model.signs]
    expected += [(f"size of {each.name}", each.size, (1, 1)) for each in model.closure]
    expected += [(f"size of {unknown.name}", unknown.size, (1, 1)) for unknown in model.unknowns]
    expected += [(quantity.name, quantity.values, (len(quantity.owners), 1)) for quantity in model.quantities]
    expected += [(name, expression, (3, 1)) for name, expression in model.scene.expressions]
    for leg in model.legs:
        expected += [(f"leg {leg.name} base", leg.base, (3, 1)), (f"leg {leg.name} platform", leg.platform, (3, 1))]
    for name, expression, shape in expected:
        if expression.shape != shape:
            raise _model_error(model, f"{name} should have shape {shape}, got {expression.shape}")


def _check_symbols(model: Model) -> None:
    """Refuse undeclared symbols, symbols with two meanings, and expressions in place of symbols."""
    declared = [parameter.symbol for parameter in model.parameters] + [unknown.symbol for unknown in model.unknowns]
    declared += [model.pose.rotation, model.pose.position]
    for symbol in declared:
        if not symbol.is_valid_input():
            raise _model_error(model, f"{symbol} is an expression; a symbol is required")
    scalars = ca.vertcat(*[ca.vec(symbol) for symbol in declared])
    if len({scalars[i].element_hash() for i in range(scalars.numel())}) < scalars.numel():
        raise _model_error(
            model, "two parameters or joint coordinates use the same symbol; each needs a symbol of its own"
        )
    others = [getattr(model, each.name) for each in fields(model) if each.name not in ("legs", "built")]
    used = expressions_of((*others, *((leg.base, leg.platform) for leg in model.legs)))
    known = {scalars[i].element_hash() for i in range(scalars.numel())}
    errors = ca.veccat(SX(0), *[error for leg in model.legs for error in (leg.base_error, leg.platform_error)])
    known_if_built = known | {errors[i].element_hash() for i in range(errors.numel())}
    for expressions, allowed in ((used, known), (expressions_of(model.built), known_if_built)):
        stray = sorted({str(s) for s in ca.symvar(ca.veccat(SX(0), *expressions)) if s.element_hash() not in allowed})
        if stray:
            raise _model_error(
                model, f"expressions contain symbols of no parameter, joint coordinate or pose: {', '.join(stray)}"
            )


def _check_references(model: Model) -> None:
    """Refuse legs, built rows and drawings that do not match the rows of the model."""
    for leg in model.legs:
        if leg.name not in model.limbs:
            raise _model_error(model, f"leg {leg.name!r} needs a wrench of a limb with this name")
    # Where the legs are the actuators, the force rows are those of the legs, in order.
    names = [leg.name for leg in model.legs]
    forces = [row.limb for row in model.wrenches if row.kind is WrenchKind.FORCE and row.limb in names]
    if not model.actuators and forces != names:
        raise _model_error(
            model, f"legs {', '.join(names)} must be in the order of their forces in wrenches, {', '.join(forces)}"
        )
    if model.built and [(row.limb, row.kind) for row in model.built] != [
        (row.limb, row.kind) for row in model.wrenches
    ]:
        raise _model_error(model, "built must have the same limbs and kinds of wrenches as wrenches, in the same order")
    for fault in model.scene.faults(model.limbs, [parameter.name for parameter in model.parameters]):
        raise _model_error(model, fault)
