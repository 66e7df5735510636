"""All machines within a tolerance on joint centres: a robot's equations and matrices with the errors as symbols.

The coordinates of the design are kept, with their choice of equations and screws. The errors of each joint centre are
three further coordinates. They are never bisected: an expression's linear part in the error of a centre, a vector,
changes it by at most the vector's length times the tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, frozen_array
from .....models.member import scaled_twists
from ....case.case import Case
from ...statement.machine import INSIDE, CentreErrors
from ...statement.tolerance import BuiltModel
from .closed_loops import Loops
from .motion_matrix import RankMatrix, free_matrix
from .posed_robot import NotJudgedError, PosedModel, Problem, ScaledRows, posed_model

#: Errors at which equations that were left out are tested, as a part of the robot's length, and number of tests.
_OFF, _TESTS = 1e-2, 4
#: Part of the workspace about its middle in which the poses of these tests lie.
_SPREAD = 0.5
#: Largest residual of an equation of order 1 that follows from others.
_CLOSED = 1e-9
#: Singular values below this part of the largest are zero.
_ZERO = 1e-9
_SEED = 0


@dataclass(frozen=True, eq=False)
class ToleranceModel:
    """All machines within a tolerance.

    Attributes:
        problem: the design.
        names: of the m joint centres.
        errors: (3 m, 1) symbols of their errors, length.
        tolerance: largest size of each error, length.
        equations: (k, 1) those of the problem with errors.
        every: (l, 1) all equations of loops with errors.
        signs: (s, 1) numbers that are positive in home's assembly.
        locked, unactuated: matrices of the problem with errors.
        scaled: J with errors, as in the problem.
    """

    problem: Problem
    names: tuple[str, ...]
    errors: SX
    tolerance: float
    equations: SX
    every: SX
    signs: SX
    locked: RankMatrix
    unactuated: RankMatrix | None
    scaled: ScaledRows

    @property
    def coordinates(self) -> SX:
        """Coordinates (n + 3 m, 1) of a machine at a pose: those of the problem, then the errors."""
        return ca.vertcat(self.problem.z, self.errors)

    @property
    def start(self) -> FloatArray:
        """Coordinates (n + 3 m,) of the design at the start of the problem."""
        return self.exact(self.problem.start)

    @property
    def size(self) -> FloatArray:
        """Sizes (n + 3 m,) by which coordinates are comparable."""
        return np.concatenate([self.problem.size, np.full(self.errors.numel(), self.tolerance)])

    def matrix(self, exact: RankMatrix) -> RankMatrix:
        """Return the matrix with errors of one of the two matrices of the problem."""
        if exact is self.problem.locked or self.unactuated is None:
            return self.locked
        return self.unactuated

    def exact(self, z: FloatArray) -> FloatArray:
        """Return coordinates (n + 3 m,) of the design at a point (n,)."""
        return np.concatenate([z, np.zeros(self.errors.numel())])

    def errors_of(self, z: FloatArray) -> CentreErrors:
        """Return the errors of a machine with coordinates (n + 3 m,)."""
        own = z[len(self.problem.start) :].reshape(-1, 3)
        return CentreErrors(self.names, frozen_array(own, own.shape))

    def within(self, z: FloatArray) -> FloatArray:
        """Return coordinates (..., n + 3 m) with errors beyond the tolerance made as large as it."""
        z, n = z.copy(), len(self.problem.start)
        errors = z[..., n:].reshape(*z.shape[:-1], len(self.names), 3)
        sizes = np.linalg.norm(errors, axis=-1, keepdims=True)
        most = INSIDE * self.tolerance
        z[..., n:] = (errors * np.minimum(1.0, most / np.maximum(sizes, most))).reshape(z[..., n:].shape)
        return z

    @property
    def loops(self) -> Loops:
        """Equations as functions of all coordinates."""
        return Loops(self.coordinates, self.equations, self.every, self.signs, self.size)


def steepest(slopes: FloatArray, tolerance: float) -> FloatArray:
    """Return errors (..., 3) as large as a tolerance along derivatives by them; none along derivatives of zero."""
    sizes = np.linalg.norm(slopes, axis=-1, keepdims=True)
    # A sum with zero has no negative zero.
    return np.asarray(INSIDE * tolerance * slopes / np.maximum(sizes, np.finfo(float).tiny) + 0.0)


def family_of(case: Case, built: BuiltModel, problem: Problem, tolerance: float) -> ToleranceModel:
    """Return all machines within a tolerance on joint centres.

    Args:
        case: with fixed dimensions.
        built: its robot with errors.
        problem: its robot over a workspace.
        tolerance: largest error of each joint centre, length.

    Raises:
        NotJudgedError: the machines do not have the freedoms that the design has over the workspace.
    """
    errors = ca.vertcat(*[SX.sym(f"e{k}", 3) for k in range(len(built.names))])
    posed = posed_model(case, built.model, problem.box, z=problem.z, errors=errors)
    limbs = posed.limbs.reduced(problem.columns, problem.rows, problem.length)
    unactuated = None
    if problem.unactuated is not None:
        unactuated = RankMatrix(free_matrix(limbs), problem.unactuated.nullity)
    family = ToleranceModel(
        problem=problem,
        names=built.names,
        errors=errors,
        tolerance=tolerance,
        equations=posed.closure[list(problem.needed)] if problem.needed else SX(0, 1),
        every=posed.every,
        signs=posed.signs,
        locked=posed.locked_rows(problem.columns, problem.rows, problem.length),
        unactuated=unactuated,
        scaled=posed.scaled(problem.length),
    )
    _check_freedoms(family, posed)
    return family


def _check_freedoms(family: ToleranceModel, posed: PosedModel) -> None:
    """Refuse machines in which equations or screws that were left out do not follow from the others.

    Raises:
        NotJudgedError: they do not follow at random errors.
    """
    problem, loops = family.problem, family.loops
    columns = [
        scaled_twists(each.screws, each.centre, SX(problem.length), each.size)
        for each in posed.limbs.members
        if each.rank < each.screws.shape[1]
    ]
    screws = ca.Function("screws", [family.coordinates], [ca.densify(each) for each in columns])
    ranks = [each.rank for each in posed.limbs.members if each.rank < each.screws.shape[1]]
    rng, n = np.random.default_rng(_SEED), len(problem.start)
    every = ca.Function("every", [family.coordinates], [ca.densify(family.every)])
    for _ in range(_TESTS):
        # At home every machine closes, whatever its errors.
        z = family.start
        own = list(problem.independent)
        z[own] += _SPREAD * problem.size[own] * rng.uniform(-1, 1, len(own))
        z[n:] = _OFF * problem.length * rng.uniform(-1, 1, len(z) - n)
        found = loops.closed(z, list(problem.dependent))
        if found is None:
            raise NotJudgedError("the loops do not close with errors of joint centres in the middle of the workspace")
        if family.every.numel() and float(np.abs(every(found).full()).max()) > _CLOSED:
            fault = "with errors of joint centres the robot does not have the poses of the workspace exactly"
            raise NotJudgedError(f"{fault}: state ranges for the numbers of the pose that it has no choice of")
        for rank, values in zip(ranks, screws.call([ca.DM(found)]), strict=True):
            sizes = np.linalg.svd(np.array(values), compute_uv=False)
            if int(np.count_nonzero(sizes > _ZERO * sizes[0])) != rank:
                raise NotJudgedError("errors of joint centres take freedoms from the robot: its limbs change")
