"""Schedule problem: F and limits at each point of a path, as one function of design, settings and the point.

    maximise  sum_i w_i sum_j F_j(d, s_i, point_i)   or   min_ij F_j(d, s_i, point_i)

over the design d and the settings s_i at N points, within limits at each point and ``|s_(i+1) - s_i| <= rate dt_i``. F
is negative for a minimum. A quantity of the legs or actuators has the largest one as value of a point: ``min_j`` takes
the place of the sum. The function is mapped over the points, so its expressions do not grow with the path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, FloatArray
from ....models.values import dataclass
from ...case.case import Case
from ...case.limits.constraint import Extent
from ...case.pose import OverPoses
from ...path.waypoints import Waypoints

#: Number of mapped functions that are kept: their construction takes longer than a call with few points.
_MAPS = 4
#: Part by which steps between points are smaller than the rates allow, so that written values keep the rates too.
INSIDE = 1e-9
#: Rounding of a difference of two settings, relative to the largest setting.
ROUNDING = 2.0**-50
#: Largest residual of closed loops, which have magnitudes of about 1. At the edge of the reach it is as large as the
#: excess over a limit that counts as rounding.
CLOSED = 1e-6


class Variable(NamedTuple):
    """Free value of a schedule problem: a dimension of the design, or a setting.

    Attributes:
        name: name in the case, or ``turn``.
        dimension: physical dimension.
        lower, upper, first: bounds, and value at the first starting point.
        rate: largest change per second of a setting; None for the design.
    """

    name: str
    dimension: Dimension
    lower: float
    upper: float
    first: float
    rate: float | None = None


class Values(NamedTuple):
    """Values at points of the path.

    Attributes:
        objective: (N, T) signed F of each task, or negative quantities of legs or actuators.
        excess: (N, c) amounts by which limits are exceeded, relative to their sizes; negative within a limit.
    """

    objective: FloatArray
    excess: FloatArray


@dataclass(frozen=True, eq=False)
class ScheduleProblem:
    """Design and schedule of a case along its path.

    Attributes:
        case: the case.
        points: points of the path.
        design, settings: free values of the design, and settings.
        weights: (T,) weight of each objective at a point.
        symbols: symbols ``d``, ``s`` and of the numbers of a point.
        objective: (T, 1) signed objectives.
        limits: (c, 1) limits as expressions that must be at most 0.
        of_design: (b, 1) limits of the design alone, at most 0.
        loops: (e, 1) left sides of the loop equations, scaled to values of about 1; 0 at poses that the robot can take.
        names: names of the limits.
        lengths: (l, 1) values at a point of which a limit compares the smallest with the largest one, such as a stroke.
        extents: limits on each of these values.
        are_exact: (c,) whether each limit is on the quantity of the case; false for a limit on a stricter estimate.
        matrix: (m, 6) homogenised J, if its smallest singular value is the objective; otherwise None.
        margins: (N,) margins by which limits are tighter at the points, relative to their sizes; 0 if left out.
        extent_margin: margin by which limits that compare points are tighter, relative to their sizes.
    """

    case: Case
    points: Waypoints
    design: tuple[Variable, ...]
    settings: tuple[Variable, ...]
    weights: FloatArray
    symbols: tuple[SX, SX, SX]
    objective: SX
    limits: SX
    of_design: SX
    loops: SX
    names: tuple[str, ...]
    lengths: SX
    extents: tuple[tuple[Extent, ...], ...]
    are_exact: tuple[bool, ...]
    matrix: SX | None = None
    margins: FloatArray | None = None
    extent_margin: float = 0.0

    @property
    def sign(self) -> float:
        """1 for a maximum, -1 for a minimum."""
        return self.case.tasks[0].sense.sign

    @property
    def is_worst(self) -> bool:
        """True if the worst value over the points is optimised, false for the mean."""
        return self.case.over_path is OverPoses.WORST

    @property
    def has_levels(self) -> bool:
        """True if the value of a point is the worst of its objectives: quantities of legs or actuators."""
        return bool(self.case.tasks[0].measure) and self.matrix is None

    @property
    def is_periodic(self) -> bool:
        """True if settings are equal at the first and the last point."""
        return self.case.path is not None and self.case.path.periodic

    @cached_property
    def numbers(self) -> FloatArray:
        """Numbers (m, N) of the points."""
        points = self.points
        rotations = points.rotations.transpose(0, 2, 1).reshape(len(points), 9)
        margins = np.zeros(len(points)) if self.margins is None else self.margins
        return np.ascontiguousarray(np.hstack([points.positions, rotations, points.feeds, margins[:, None]]).T)

    @cached_property
    def steps(self) -> FloatArray:
        """Largest change (N - 1, k) of each setting from each point to the next; infinite without a rate."""
        rates = np.array([each.rate for each in self.settings], dtype=np.float64)
        found = np.full((len(self.points) - 1, len(rates)), math.inf)
        for k, rate in enumerate(rates):
            if math.isfinite(rate):
                found[:, k] = rate * self.points.seconds
        return found

    @cached_property
    def function(self) -> ca.Function:
        """Function of design, settings and the numbers of a point, with objectives and limits."""
        return ca.Function("point", list(self.symbols), [ca.densify(self.objective), ca.densify(self.limits)])

    @cached_property
    def _mapped(self) -> Callable[[int], ca.Function]:
        """The function mapped over a number of points; the last maps are kept."""
        return lru_cache(_MAPS)(self.function.map)

    @cached_property
    def matrix_function(self) -> ca.Function | None:
        """Function of design, settings and the numbers of a point, with the homogenised J (m, 6); None without it."""
        if self.matrix is None:
            return None
        return ca.Function("matrix", list(self.symbols), [ca.densify(self.matrix)])

    def matrices(self, d: FloatArray, s: FloatArray, numbers: FloatArray) -> FloatArray | None:
        """Return the homogenised J (N, m, 6) for a design (n,) and settings (N, k) at points with numbers (16, N)."""
        if self.matrix_function is None or self.matrix is None:
            return None
        count = numbers.shape[1]
        design = np.repeat(np.reshape(d, (-1, 1)), count, axis=1)
        rows, columns = self.matrix.shape
        found = self.matrix_function.map(count)(design, np.reshape(s, (count, -1)).T, numbers).full()
        return np.asarray(found.reshape(rows, count, columns).transpose(1, 0, 2))

    @cached_property
    def lengths_function(self) -> ca.Function:
        """Function of design, settings and the numbers of a point, with the lengths that limits compare."""
        return ca.Function("lengths", list(self.symbols), [ca.densify(self.lengths)])

    def compared(self, d: FloatArray, s: FloatArray) -> FloatArray:
        """Return the lengths (N, l) that limits compare, for a design (n,) and settings (N, k)."""
        count = len(self.points)
        design = np.repeat(np.reshape(d, (-1, 1)), count, axis=1)
        return np.asarray(self.lengths_function.map(count)(design, s.T, self.numbers).full().T)

    def extent_excess(self, d: FloatArray, s: FloatArray) -> float:
        """Return the largest relative excess over a limit that compares two points; minus infinity without any."""
        if not self.extents:
            return -math.inf
        lengths = self.compared(d, s)
        excess = [
            (largest - each.ratio * smallest - each.most) / abs(each.most) + self.extent_margin
            for own, smallest, largest in zip(
                self.extents, lengths.min(axis=0).tolist(), lengths.max(axis=0).tolist(), strict=True
            )
            for each in own
        ]
        return float(max(excess))

    def at(
        self, d: FloatArray, s: FloatArray, which: Sequence[int] | None = None, *, estimated: bool = False
    ) -> Values:
        """Return the values for a design (n,) and settings (N, k) at the points, or at some of the points.

        Args:
            d: (n,) design.
            s: (N, k) settings.
            which: indices of the points; all if left out.
            estimated: If true, the smallest singular value is the smooth estimate of the program, not above it.
        """
        numbers = self.numbers if which is None else self.numbers[:, list(which)]
        count = numbers.shape[1]
        design = np.repeat(np.reshape(d, (-1, 1)), count, axis=1)
        objective, limits = self._mapped(count)(design, np.reshape(s, (count, -1)).T, numbers)
        values, matrices = objective.full().T, None if estimated else self.matrices(d, s, numbers)
        if matrices is not None:
            regular = np.isfinite(matrices).all(axis=(1, 2))
            values = np.full((count, 1), math.nan)
            values[regular] = np.linalg.svd(matrices[regular], compute_uv=False)[:, -1:]
        return Values(values, limits.full().T)

    def gaps(self, d: FloatArray, s: FloatArray) -> FloatArray:
        """Return the largest residual (N,) of the loop equations at the points, for a design (n,) and settings."""
        function = ca.Function("loops", list(self.symbols), [ca.densify(self.loops)])
        count = len(self.points)
        design = np.repeat(np.reshape(d, (-1, 1)), count, axis=1)
        found = function.map(count)(design, np.reshape(s, (count, -1)).T, self.numbers)
        return np.asarray(np.abs(found.full()).max(axis=0, initial=0.0))

    def combined(self, objective: FloatArray) -> FloatArray:
        """Return the value of each point from its objectives (..., T): their sum, or the worst."""
        weighted = objective * self.weights
        is_worst = self.is_worst or self.has_levels
        return np.asarray(weighted.min(axis=-1) if is_worst else weighted.sum(axis=-1))

    def value(self, d: FloatArray, s: FloatArray, *, estimated: bool = False) -> float:
        """Return the signed objective of a design (n,) and a schedule (N, k); see :meth:`at`."""
        per_point = self.combined(self.at(d, s, estimated=estimated).objective)
        return float(per_point.min()) if self.is_worst else math.fsum((self.points.weights * per_point).tolist())

    def is_feasible(self, d: FloatArray, s: FloatArray, slack: float = 1e-7) -> bool:
        """Return whether a schedule keeps all limits, its ranges and its rates, up to a relative slack."""
        values = self.at(d, s)
        low, high, _ = ends(self.settings)
        # Differences of settings carry the rounding of the settings.
        rounding = ROUNDING * np.maximum(np.abs(low), np.abs(high))
        steps = np.abs(np.diff(s, axis=0)) - self.steps * (1 + slack)
        closing = np.abs(s[-1] - s[0]) if self.is_periodic else np.zeros(s.shape[1])
        own = ca.Function("own", [self.symbols[0]], [self.of_design])(d).full()
        return bool(
            np.isfinite(values.objective).all()
            and (values.excess <= slack).all()
            and (self.gaps(d, s) <= CLOSED).all()
            and (own <= slack).all()
            and self.extent_excess(d, s) <= slack
            and (s >= low - rounding).all()
            and (s <= high + rounding).all()
            and (steps <= rounding).all()
            and (closing <= slack * (high - low)).all()
        )


def ends(variables: Sequence[Variable]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return lower bounds, upper bounds and first values (n,) of variables."""
    rows = [(each.lower, each.upper, each.first) for each in variables]
    low, high, first = np.array(rows, dtype=np.float64).reshape(-1, 3).T
    return low, high, first
