"""Matrices of motions, as expressions of the pose: their null space has the motions that no limb resists.

They are built for the check from the model and the case alone. A motion is the velocity v of the platform's origin and
its angular velocity, here ``x = (v, length omega)``, with rates of joints. Each row is a condition that it keeps:

* the force f and moment m of a limb's row, about the platform's origin, do no work: ``f.v + m.omega = 0``;
* the motion is one of the passive joints of each member, ``x - sum_j w_j S_j = 0`` with rates w; of a pinned member the
  velocity of its centre alone.

With the actuators free, x minus the motion ``sum_k u_k A_k`` of the actuators that move a member stands for x in its
conditions, and relations ``B u = 0`` that loops demand of the actuators alone are conditions too. With locked actuators
the matrix has full column rank where J has full rank, and the passive screws of each member are independent. With free
ones its null space has as many dimensions as the robot has freedoms and rates ``u`` without a motion, and more only
where the constraint wrenches lose their rank, or passive screws theirs.

Screws of members with nested loops have these solved, with the rank that they have at almost all poses. That each loop
keeps its rank is claimed beside: as many of its conditions as its rank are columns of a block of their own.

A rotation is a polynomial matrix over a positive number. Rows of limbs that are linear in the rotation are multiplied
by that number, so that they are polynomials.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import reduce
from typing import TypeAlias

import casadi as ca
import numpy as np
from casadi import SX

from .....models import Actuator, FloatArray, Model, Substitution, Wrench, WrenchKind, rate_relations
from .....models.arrays import values_at
from .....models.instance import length_of
from .....models.member import scaled_twists
from .....models.rows import independent_rows
from ....case.case import Case
from ....case.pose import Free
from ....case.workspace import TurnKind
from ...statement.machine import has_straight_legs
from ..proof_file import ProofError
from .forms import FormArithmetic
from .path_root import PathRoot
from .pose_boxes import PoseRoot

#: Singular values below this part of the largest are zero at the middle of the workspace.
_ZERO = 1e-9
#: The poses of a workspace, or those of a path.
Root: TypeAlias = "PoseRoot | PathRoot"


class PosedRobot:
    """A robot with its dimensions over a workspace.

    Args:
        case: with fixed dimensions.
        model: its robot, some of whose unknowns may have been replaced by expressions; further parameters than the
            case's are components of errors of joint centres, and come last.
        root: the box of coordinates.

    Attributes:
        z: (n, 1) symbols: those of the six coordinates of the pose that vary, then the unknowns, then errors.
        errors: number of components of errors.
        coordinates: number of coordinates of boxes.
        free: indices of the varying coordinates among those of boxes.
        dependent: places among these of the coordinates that follow from the others.
        given: (g, 1) symbols whose values follow from the coordinates of boxes; see :class:`.pose_boxes.PoseSymbols`.
        varying: (v, 1) symbols of the pose, and of the unknowns.
        of_errors: (e, 1) symbols of the errors.
        centre: (n,) the middle of the workspace, or the first point of a path, with unknowns and errors of 0.
        size: (n,) by which coordinates are comparable: half ranges, sizes of the unknowns, and the tolerance.
        length: characteristic size of the robot, factor of the angular velocities.
        position: (3, 1) the platform's origin, length.
        rotation: (3, 3) platform to world coordinates.
        scale: (1, 1) by which rows are multiplied that are linear in the rotation; at least 1.
        rows: rows of limbs, one wrench each, with moments about the platform's origin.
        members, actuators: of the robot.
        legs: base joint (3, 1) of each straight leg, and its platform joint a in the world, ``scale R a``.
        nested: (m, k) each, the conditions of nested loops on rates of a member's passive joints.
        equations: (k, 1) that are 0 where the loops are closed, of order 1.
        loops: (l, 1) further equations of the same loops, which other assemblies of the joints do not fulfil.
        signs: (s, 1) numbers that are positive in home's working mode.
    """

    def __init__(self, case: Case, model: Model, root: Root) -> None:
        symbols, self._root = Substitution.identity(model).all, root
        self.coordinates = root.coordinates
        self.free, head, self.given, y, varying = root.symbols()
        self.dependent = [j for j, k in enumerate(self.free) if k in root.dependent]
        unknowns = ca.vertcat(SX(0, 1), *[SX.sym(item.name) for item in model.unknowns])
        values = [float(v) for name in case.parameters for v in case.components(name) if not isinstance(v, Free)]
        errors = SX.sym("errors", symbols[0].numel() - len(values))
        turned, self.scale = turned_rotation(root, y[3:])
        self.model, self.position = model, ca.vertcat(*y[:3])
        self.length = length_of(model, [*values, *[0.0] * errors.numel()])
        self.rotation = turned / self.scale
        self.z, self.errors = ca.vertcat(SX(0, 1), *head, unknowns, errors), errors.numel()
        self.varying, self.of_errors = ca.vertcat(SX(0, 1), *varying, unknowns), errors

        def put(expressions: Iterable[SX], rotation: SX = self.rotation) -> list[SX]:
            """Return expressions of the model with those of the coordinates in the place of its symbols."""
            numbers = [ca.vertcat(SX(0, 1), *values, errors), unknowns, rotation, self.position]
            return list(ca.Function("robot", symbols, list(expressions)).call(numbers))

        def scaled(vectors: Iterable[SX]) -> list[SX]:
            """Return vectors, those that are linear in the rotation as multiples without the inverse of the scale."""
            inverse = SX.sym("inverse")
            found = put(map(ca.densify, vectors), inverse * turned)
            for k, vector in enumerate(found):
                slope = ca.jacobian(vector, inverse)
                if ca.depends_on(slope, inverse) or not ca.depends_on(vector, inverse):
                    found[k] = ca.substitute(vector, inverse, 1 / self.scale)
                else:
                    found[k] = self.scale * ca.substitute(vector, inverse, 0) + slope
            return found

        def stacked(expressions: Iterable[SX]) -> SX:
            """Return numbers of the robot as a column."""
            return ca.vertcat(SX(0, 1), *put(expressions))

        sizes = np.array(ca.evalf(stacked(each.size for each in model.unknowns))).ravel()
        ends = np.full(self.errors, case.joint_centre_tolerance or 0.0)
        self.centre = np.concatenate([root.middle[self.free], np.zeros(len(sizes) + len(ends))])
        self.size = np.concatenate([(0.5 * (root.upper - root.lower))[self.free], sizes, ends])
        arms = scaled(model.pose.rotation @ leg.platform for leg in model.legs)
        self.legs = tuple(zip(put(leg.base for leg in model.legs), arms, strict=True))
        if has_straight_legs(model):
            # The line of a leg passes its platform joint: u x (s (p - b) + u) / s is its moment about the origin.
            spans = [(self.position - foot, arm) for foot, arm in self.legs]
            rows = [ca.vertcat(self.scale * d + u, ca.cross(u, d)) for d, u in spans]
        else:
            about = [row.moment - ca.cross(model.pose.position, row.force) for row in model.wrenches]
            rows = scaled(ca.vertcat(row.force, moment) for row, moment in zip(model.wrenches, about, strict=True))
        self.rows = [replace(old, force=row[:3], moment=row[3:]) for old, row in zip(model.wrenches, rows, strict=True)]
        parts = iter(put(part for each in model.members for part in (each.centre, each.screws)))
        self.members = [replace(each, centre=next(parts), screws=next(parts), slide=None) for each in model.members]
        parts = iter(put(part for each in model.actuators for part in (each.screws, each.relations)))
        self.actuators = [replace(each, screws=next(parts), relations=next(parts)) for each in model.actuators]
        self.nested = put(each.loops[:, each.passive] for each in model.nested)
        self.equations = stacked(each.scaled for each in model.closure)
        self.loops = stacked(each.scaled for each in model.loops)
        self.signs = stacked(each.value for each in model.signs)

    def at(self, expression: SX, z: FloatArray) -> FloatArray:
        """Return the values of a matrix of expressions at a point (n,); at points (n, P) side by side."""
        function = ca.Function("values", [self.z, self.given], [ca.densify(expression)])
        given = self.values_given(z.T.reshape(-1, len(z))).T
        return np.asarray(function(z, given).full())

    def function(self, *outputs: SX) -> Callable[[FloatArray], list[FloatArray]]:
        """Return a function of points (P, n) with the values (P, rows, columns) of matrices of expressions."""
        function = ca.Function("values", [self.z, self.given], [ca.densify(each) for each in outputs])
        return lambda z: values_at(function, z, self.values_given(z))

    def forms(self, expressions: SX) -> FormArithmetic:
        """Return the forms of expressions (R, 1) over boxes.

        Raises:
            UncoveredError: an expression holds an operation without a rule.
        """
        return FormArithmetic(ca.vertcat(self.z, self.given), expressions, self._root.given)

    def values_given(self, z: FloatArray) -> FloatArray:
        """Return the values (P, g) that follow from points (P, n)."""
        return self._root.values_at(z[:, :1])

    def slopes(self, expressions: SX) -> Callable[[FloatArray], FloatArray]:
        """Return a function of points (P, n) with the derivatives (P, k, n) of expressions (k, 1) by coordinates."""
        own, through = (ca.jacobian(expressions, each) for each in (self.z, self.given))
        values, root = self.function(own, through), self._root

        def at(z: FloatArray) -> FloatArray:
            found, by_given = values(z)
            if by_given.shape[2]:
                found[:, :, 0] += (by_given @ root.slopes_at(z[:, :1])[:, :, None])[:, :, 0]
            return found

        return at


def turned_rotation(root: Root, turn: list[SX]) -> tuple[SX, SX]:
    """Return the rotation (3, 3) with its coordinates times a positive number, and this number: polynomials.

    Four coordinates are those of a quaternion of any size but zero.
    """

    def of_quaternion(r: SX, w: SX | int = 1) -> tuple[SX, SX]:
        """Return the rotation of the quaternion (w, r), times its squared size."""
        square = ca.sumsqr(r)
        return (w * w - square) * SX.eye(3) + 2 * r @ r.T + 2 * w * ca.skew(r), w * w + square

    if len(turn) > 3:
        return of_quaternion(ca.vertcat(*turn[1:]), turn[0])
    if root.kind is TurnKind.ROLL_PITCH_YAW:
        single = [of_quaternion(t * SX.eye(3)[:, k]) for k, t in enumerate(turn)]
        return reduce(lambda done, each: (each[0] @ done[0], each[1] * done[1]), single)
    return of_quaternion(ca.vertcat(*turn) if root.kind is TurnKind.ANY_AXIS else turn[0] * SX(root.axis.tolist()))


def motion_matrix(robot: PosedRobot, start: FloatArray, *, is_locked: bool) -> tuple[SX, int]:
    """Return the matrix (m, c), and the dimensions of its null space claimed to be all: freedoms and idle rates.

    With locked actuators there are none. With free ones the matrix of a robot given by its rows is that of its couples.

    Args:
        robot: the robot.
        start: (n,) closed loops, at which those screws of each member are chosen that are independent.
        is_locked: whether the actuators are locked.

    Raises:
        ProofError: the screws or loops of a member are singular at the start, or all freedoms of a platform are left.
    """
    if is_locked:
        return _whole_matrix(robot, start, ()), 0
    if robot.actuators:
        matrix = _whole_matrix(robot, start, robot.actuators)
    else:
        matrix = ca.vertcat(SX(0, 6), *[_work(robot, row) for row in robot.rows if row.kind is WrenchKind.COUPLE])
    generic = robot.model.generic
    if generic is not None:
        freedoms, idle = 6 - generic.constraints, generic.idle
    else:
        # Where every pose is closed, the rank is that at almost all of them.
        away = np.random.default_rng(0).uniform(-0.5, 0.5, (4, len(start))) * robot.size * (not robot.model.unknowns)
        spectra = np.linalg.svd(np.hsplit(robot.at(matrix, (start + away).T), len(away)), compute_uv=False)
        freedoms, idle = matrix.shape[1] - max(int(np.count_nonzero(each > _ZERO * each[0])) for each in spectra), 0
    if not 0 < freedoms < 6:
        raise ProofError("the robot has no constraint wrenches of which the rank could be claimed")
    return matrix, freedoms + idle


def driven_matrices(robot: PosedRobot, start: FloatArray) -> tuple[SX, SX]:
    """Return A (m, c) and D (m, a) with ``A (x, w) = D u`` for motions x, rates w of passive joints and u of actuators.

    The actuators of a robot without given ones are its legs, whose rates are those of their rows.
    """
    if robot.actuators:
        whole, count = _motion_rows(robot, start, robot.actuators), len(robot.actuators)
        return whole[:, :-count], -whole[:, -count:]
    sizes = [ca.norm_2(row.force) if row.kind is WrenchKind.FORCE else SX(0) for row in robot.rows]
    legs = [k for k, row in enumerate(robot.rows) if row.kind is WrenchKind.FORCE]
    rows = ca.vertcat(SX(0, 6), *[_work(robot, row) for row in robot.rows])
    return rows, ca.sparsify(ca.diag(ca.vertcat(*sizes))[:, legs])


def _whole_matrix(robot: PosedRobot, start: FloatArray, actuators: Sequence[Actuator]) -> SX:
    """Return the matrix (m, c), with columns of the platform, of passive joints, of actuators and of nested loops."""
    relations, loops = rate_relations(actuators), []
    motions = _motion_rows(robot, start, actuators)
    passive = motions.shape[1] - relations.shape[1]
    motions = ca.vertcat(motions, ca.horzcat(SX(relations.shape[0], passive), relations))
    for path, conditions in zip(robot.model.nested, robot.nested, strict=True):
        kept = _independent(robot.at(conditions, start), path.loop_rank, f"the nested loops of limb {path.member}")
        loops += [conditions[kept, :].T] if kept else []
    return ca.sparsify(ca.diagcat(motions, *loops))


def _motion_rows(robot: PosedRobot, start: FloatArray, actuators: Sequence[Actuator]) -> SX:
    """Return the conditions (m, c) of limbs, with columns of the platform, of passive joints and of actuators.

    Of each member as many screws are taken as have its rank: where these are independent, they span all.
    """
    # What limbs see of a motion, by the names of those that actuators move, and the motions of their passive joints.
    limbs = [(row.label.member, _work(robot, row), SX(6, 0)) for row in robot.rows]
    for each in robot.members:
        kept = list(range(each.screws.shape[1]))
        if each.rank < len(kept):
            columns = scaled_twists(each.screws, each.centre, SX(robot.length), each.size)
            kept = _independent(robot.at(columns, start).T, each.rank, f"the passive joints of limb {each.label}")
        # The velocity of a pinned member's centre is v + omega x arm.
        arm = (each.centre - robot.position) / robot.length
        seen = ca.horzcat(SX.eye(3), -ca.skew(arm)) if each.is_pinned else SX.eye(6)
        limbs.append((each.label, seen, _motions(robot, each.screws[:, kept])))
    passive, at, blocks = sum(own.shape[1] for _, _, own in limbs), 0, []
    for label, seen, own in limbs:
        screws = (each.screw_in(label) for each in actuators)
        driven = [SX(6, 1) if screw is None else _motions(robot, screw) for screw in screws]
        after = SX(6, passive - at - own.shape[1])
        blocks.append(seen @ ca.horzcat(SX.eye(6), SX(6, at), -own, after, *(-each for each in driven)))
        at += own.shape[1]
    return ca.sparsify(ca.vertcat(SX(0, 6 + passive + len(actuators)), *blocks))


def _independent(rows: FloatArray, rank: int, whose: str) -> list[int]:
    """Return as many independent rows as their rank; rows that loops hold still are rounding errors."""
    chosen = sorted(independent_rows([rows])) if rank else []
    if len(chosen) != rank:
        raise ProofError(f"{whose} are singular in the middle of the workspace")
    return chosen


def _work(robot: PosedRobot, row: Wrench) -> SX:
    """Return the work (1, 6) of a limb's row in motions."""
    return ca.horzcat(row.force.T, row.moment.T / robot.length)


def _motions(robot: PosedRobot, screws: SX) -> SX:
    """Return the motions (6, n) of screws: twists with the world's origin as reference."""
    omega, v = screws[:3, :], screws[3:, :]
    return ca.vertcat(v - ca.skew(robot.position) @ omega, robot.length * omega)
