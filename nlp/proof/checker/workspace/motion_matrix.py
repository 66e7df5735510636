"""Matrices of motion conditions as expressions of the pose. Their null space consists of the unresisted motions.

The matrices are built for the check from the model and the case only. A motion consists of the velocity v of the
platform's origin and its angular velocity, here ``x = (v, length omega)``, and of joint rates. Each row is a condition:

* the force f and moment m of a limb's row, about the platform's origin, do no work: ``f.v + m.omega = 0``;
* the passive joints of a member can follow the motion, ``x - sum_j w_j S_j = 0`` with rates w; for a pinned member only
  the velocity of its centre.

With unlocked actuators, x minus the motion ``sum_k u_k A_k`` of the actuators that move a member replaces x in its
conditions; relations ``B u = 0`` between actuator rates are conditions too. With locked actuators the matrix has full
column rank where J has full rank and the passive screws of each member are independent. With unlocked actuators, the
dimension of the null space is the number of degrees of freedom plus the number of idle rates ``u``. It is larger only
where the constraint wrenches or the passive screws lose rank.

The loops of members with nested loops are solved, with the rank that they have at almost all poses. A separate block
claims that each loop keeps this rank: its columns are independent conditions of the loop.

A rotation is a polynomial matrix over a positive number. Rows of limbs that are linear in the rotation are multiplied
by that number and so become polynomials.
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
from ....case.pose import ends_of
from ....case.workspace import TurnKind
from ...statement.fixed_robot import has_straight_legs
from ..proof_file import ProofError
from .forms import FormArithmetic
from .path_root import PathRoot
from .pose_boxes import PoseRoot

#: Fraction of the largest singular value, at the workspace centre, below which singular values count as zero.
_ZERO = 1e-9
#: Poses of a workspace, or of a path.
Root: TypeAlias = "PoseRoot | PathRoot"


class PosedRobot:
    """A robot with its dimensions over a workspace.

    Args:
        case: case with fixed dimensions, or with ranges of the dimensions that change along a path.
        model: model of the robot, possibly without some unknowns. Components of joint-centre errors may follow the
            parameters of the case.
        root: box of coordinates.

    Attributes:
        z: (n, 1) symbols: varying coordinates of the pose, then unknowns, then errors.
        errors: number of components of errors.
        coordinates: number of coordinates of boxes.
        free: indices of the varying coordinates among the coordinates of boxes.
        dependent: indices of the dependent coordinates in ``free``.
        given: (g, 1) symbols whose values follow from the coordinates of boxes; see :class:`.pose_boxes.PoseSymbols`.
        varying: (v, 1) symbols of the pose, and of the unknowns.
        of_errors: (e, 1) symbols of the joint-centre errors.
        centre: (n,) workspace centre, or first point of a path, with unknowns and errors of 0.
        size: (n,) scales that make coordinates comparable: half ranges, scales of the unknowns, and the tolerance.
        length: characteristic size of the robot, factor of the angular velocities.
        position: (3, 1) origin of the platform frame, length.
        rotation: (3, 3) platform to world coordinates.
        scale: (1, 1) factor, at least 1, of rows that are linear in the rotation.
        rows: rows of limbs, one wrench each, with moments about the platform's origin.
        members, actuators: members and actuators of the robot.
        legs: base joint (3, 1) of each straight leg, and its platform joint a in the world, ``scale R a``.
        nested: (m, k) each, conditions of nested loops on rates of a member's passive joints.
        equations: (k, 1) loop equations, 0 where the loops are closed, scaled to values of about 1.
        loops: (l, 1) further equations of the same loops; other assembly modes violate these.
        signs: (s, 1) expressions that are positive in the home working mode.
    """

    def __init__(self, case: Case, model: Model, root: Root) -> None:
        symbols, self._root = Substitution.identity(model).all, root
        self.coordinates = root.coordinates
        self.free, head, self.given, y, varying = root.symbols()
        self.dependent = [j for j, k in enumerate(self.free) if k in root.dependent]
        unknowns = ca.vertcat(SX(0, 1), *[SX.sym(item.name) for item in model.unknowns])
        values, dimensions = _dimensions_of(case, root, y)
        errors = SX.sym("errors", symbols[0].numel() - len(values))
        turned, self.scale = turned_rotation(root, y[3 : root.of_pose])
        self.model, self.position = model, ca.vertcat(*y[:3])
        self.length = length_of(model, [*values, *[0.0] * errors.numel()])
        self.rotation = turned / self.scale
        self.z, self.errors = ca.vertcat(SX(0, 1), *head, unknowns, errors), errors.numel()
        self.varying, self.of_errors = ca.vertcat(SX(0, 1), *varying, unknowns), errors

        def put(expressions: Iterable[SX], rotation: SX = self.rotation) -> list[SX]:
            """Return expressions of the model with the coordinates in place of its symbols."""
            numbers = [ca.vertcat(SX(0, 1), *dimensions, errors), unknowns, rotation, self.position]
            return list(ca.Function("robot", symbols, list(expressions)).call(numbers))

        def scaled(vectors: Iterable[SX]) -> list[SX]:
            """Return vectors; those that are linear in the rotation are multiplied by the scale."""
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
            """Return expressions of the robot as a column."""
            return ca.vertcat(SX(0, 1), *put(expressions))

        sizes = np.array(ca.evalf(stacked(each.size for each in model.unknowns))).ravel()
        ends = np.full(self.errors, case.joint_centre_tolerance or 0.0)
        self.centre = np.concatenate([root.middle[self.free], np.zeros(len(sizes) + len(ends))])
        self.size = np.concatenate([(0.5 * (root.upper - root.lower))[self.free], sizes, ends])
        arms = scaled(model.pose.rotation @ leg.platform for leg in model.legs)
        self.legs = tuple(zip(put(leg.base for leg in model.legs), arms, strict=True))
        if has_straight_legs(model):
            # The leg's line passes through its platform joint: u x (s (p - b) + u) / s is its moment about the origin.
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
        """Return the values of a matrix of expressions at a point (n,), or side by side at points (n, P)."""
        function = ca.Function("values", [self.z, self.given], [ca.densify(expression)])
        given = self.values_given(z.T.reshape(-1, len(z))).T
        return np.asarray(function(z, given).full())

    def function(self, *outputs: SX) -> Callable[[FloatArray], list[FloatArray]]:
        """Return a function that evaluates matrices of expressions at points (P, n), as (P, rows, columns)."""
        function = ca.Function("values", [self.z, self.given], [ca.densify(each) for each in outputs])
        return lambda z: values_at(function, z, self.values_given(z))

    def forms(self, expressions: SX) -> FormArithmetic:
        """Return the forms of expressions (R, 1) over boxes.

        Raises:
            UncoveredError: an expression has an operation without a rule.
        """
        return FormArithmetic(ca.vertcat(self.z, self.given), expressions, self._root.given)

    def values_given(self, z: FloatArray) -> FloatArray:
        """Return the values (P, g) that follow from points (P, n)."""
        return self._root.values_at(z[:, :1])

    def slopes(self, expressions: SX) -> Callable[[FloatArray], FloatArray]:
        """Return a function for the derivatives (P, k, n) of expressions (k, 1) at points (P, n)."""
        own, through = (ca.jacobian(expressions, each) for each in (self.z, self.given))
        values, root = self.function(own, through), self._root

        def at(z: FloatArray) -> FloatArray:
            found, by_given = values(z)
            if by_given.shape[2]:
                found[:, :, 0] += (by_given @ root.slopes_at(z[:, :1])[:, :, None])[:, :, 0]
            return found

        return at


def _dimensions_of(case: Case, root: Root, y: Sequence[SX]) -> tuple[list[float], list[SX]]:
    """Return the dimensions of a robot as numbers, in the middle of those that change along a path, and as expressions.

    Args:
        case: the case.
        root: box of coordinates, with the names of the dimensions that change.
        y: coordinates of the pose, then these dimensions.
    """
    changing = dict(zip(root.settings, y[root.of_pose :], strict=True))
    stated = [
        (name, sum(ends_of(v)) / 2)
        for item in case.model.parameters
        for name, v in zip(item.components, case.components(item.name), strict=True)
    ]
    return [value for _, value in stated], [changing.get(name, SX(value)) for name, value in stated]


def turned_rotation(root: Root, turn: list[SX]) -> tuple[SX, SX]:
    """Return the rotation (3, 3) times a positive number, and this number, as polynomials of the coordinates.

    Four coordinates are a quaternion of any nonzero norm.
    """

    def of_quaternion(r: SX, w: SX | int = 1) -> tuple[SX, SX]:
        """Return the rotation of the quaternion (w, r), times its squared norm."""
        square = ca.sumsqr(r)
        return (w * w - square) * SX.eye(3) + 2 * r @ r.T + 2 * w * ca.skew(r), w * w + square

    if len(turn) > 3:
        return of_quaternion(ca.vertcat(*turn[1:]), turn[0])
    if root.kind is TurnKind.ROLL_PITCH_YAW:
        single = [of_quaternion(t * SX.eye(3)[:, k]) for k, t in enumerate(turn)]
        return reduce(lambda done, each: (each[0] @ done[0], each[1] * done[1]), single)
    return of_quaternion(ca.vertcat(*turn) if root.kind is TurnKind.ANY_AXIS else turn[0] * SX(root.axis.tolist()))


def motion_matrix(robot: PosedRobot, start: FloatArray, *, is_locked: bool) -> tuple[SX, int]:
    """Return the matrix of motion conditions (m, c), and the claimed dimension of its null space.

    The dimension is the number of degrees of freedom and idle rates.

    With locked actuators the dimension is 0. With unlocked actuators, the matrix of a robot given by rows has only
    couples.

    Args:
        robot: expressions of the robot.
        start: (n,) closed loops at which the independent screws of each member are chosen.
        is_locked: whether the actuators are locked.

    Raises:
        ProofError: the screws or loops of a member are singular at the start, or the robot has no constraint wrenches.
    """
    if is_locked:
        return _whole_matrix(robot, start, ()), 0
    if robot.actuators:
        matrix = _whole_matrix(robot, start, robot.actuators)
    else:
        matrix = ca.vertcat(SX(0, 6), *[_work(robot, row) for row in robot.rows if row.kind is WrenchKind.COUPLE])
    generic = robot.model.generic
    if generic is not None:
        mobility, idle = 6 - generic.constraints, generic.idle
    else:
        # If the loops close at all poses, the rank is the rank at almost all poses.
        away = np.random.default_rng(0).uniform(-0.5, 0.5, (4, len(start))) * robot.size * (not robot.model.unknowns)
        spectra = np.linalg.svd(np.hsplit(robot.at(matrix, (start + away).T), len(away)), compute_uv=False)
        mobility, idle = matrix.shape[1] - max(int(np.count_nonzero(each > _ZERO * each[0])) for each in spectra), 0
    if not 0 < mobility < 6:
        raise ProofError(
            "the proof claims a rank of the constraint wrenches, but this robot has none, or has no degree of freedom"
        )
    return matrix, mobility + idle


def driven_matrices(robot: PosedRobot, start: FloatArray) -> tuple[SX, SX]:
    """Return A (m, c) and D (m, a) with ``A (x, w) = D u`` for motions x and rates of passive joints w and actuators u.

    For a robot without given actuators, the actuators are its legs, with the rates of their rows.
    """
    if robot.actuators:
        whole, count = _motion_rows(robot, start, robot.actuators), len(robot.actuators)
        return whole[:, :-count], -whole[:, -count:]
    sizes = [ca.norm_2(row.force) if row.kind is WrenchKind.FORCE else SX(0) for row in robot.rows]
    legs = [k for k, row in enumerate(robot.rows) if row.kind is WrenchKind.FORCE]
    rows = ca.vertcat(SX(0, 6), *[_work(robot, row) for row in robot.rows])
    return rows, ca.sparsify(ca.diag(ca.vertcat(*sizes))[:, legs])


def _whole_matrix(robot: PosedRobot, start: FloatArray, actuators: Sequence[Actuator]) -> SX:
    """Return the matrix of motion conditions (m, c).

    Its columns belong to the platform, to the passive joints, to the actuators and to the nested loops.
    """
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

    For each member, the number of kept screws is its rank. Where the kept screws are independent, they span all screws.
    """
    # For each limb: the label by which actuators move it, its conditions on the motion, and its passive motions.
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
    """Return the indices of independent rows, as many as the rank; refuse rows of a smaller rank.

    Rows of joints that loops lock are only rounding errors.
    """
    chosen = sorted(independent_rows([rows])) if rank else []
    if len(chosen) != rank:
        raise ProofError(f"{whose} are singular at the workspace centre")
    return chosen


def _work(robot: PosedRobot, row: Wrench) -> SX:
    """Return the work (1, 6) of a limb's row for a unit of each motion component."""
    return ca.horzcat(row.force.T, row.moment.T / robot.length)


def _motions(robot: PosedRobot, screws: SX) -> SX:
    """Return the motions (6, n) of screws: twists with the world origin as reference."""
    omega, v = screws[:3, :], screws[3:, :]
    return ca.vertcat(v - ca.skew(robot.position) @ omega, robot.length * omega)
