"""The interface of a peer: an optimum of a problem from one random start or seed, within a budget.

Every peer gets the same smooth problem: scaled variables ``s`` (n,) from -1 to 1, ``f`` to be minimised, inequalities
``h <= 0`` and equations ``e = 0``, each divided by the length of its gradient, and their exact derivatives. Functions
are those of this program through CasADi, so that what differs is the method, and evaluations are counted here.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Literal, NamedTuple

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, Nlp
from screwsynth.nlp.program.sampling import starting_points

#: Weight of the constraints in the penalised objective: larger than their multipliers, as an exact penalty needs.
WEIGHT = 10.0
#: Value of f where the robot's equations have none. Values are of order 1.
UNDEFINED = 1e6


class BudgetSpentError(Exception):
    """The budget of a search is spent: it ends inside of the evaluation."""


class Budget(NamedTuple):
    """Largest number of evaluations of an attempt, with those of derivatives, and of its CPU seconds."""

    evaluations: int
    seconds: float


class _Values(NamedTuple):
    """f, h (m,) and e (k,) at a point."""

    f: float
    h: FloatArray
    e: FloatArray


class _Derivatives(NamedTuple):
    """Derivatives of f (n,), h (m, n) and e (k, n) at a point."""

    f: FloatArray
    h: FloatArray
    e: FloatArray


class Problem:
    """A program in scaled variables, with a budget.

    Attributes:
        case: the case, for this program's own searches.
        nlp: its program with all its constraints.
        seed: of the start and of the method's own random numbers.
        evaluations: points at which f, h and e were evaluated so far.
        gradients: points at which derivatives were evaluated so far.
        iterations: what this program's searches report instead; None for peers.
        best: the point with the least penalised objective so far, or None.
    """

    def __init__(self, case: Case, nlp: Nlp, seed: int, budget: Budget) -> None:
        self.case, self.nlp, self.seed = case, nlp, seed
        self.evaluations = self.gradients = 0
        self.iterations: int | None = None
        self.best: FloatArray | None = None
        self._budget, self._began, self._least = budget, time.process_time(), np.inf
        self._point, self._last = b"", _Values(np.inf, np.zeros(0), np.zeros(0))
        self._slope_point, self._slopes = b"", _Derivatives(np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)))
        sides, n = nlp.sides, nlp.n
        rows = np.where(nlp.row_sizes > 0, nlp.row_sizes, 1.0)
        self._place = sides.place[sides.place >= n] - n
        self._sign = sides.sign[sides.place >= n]
        self._limit = sides.limit[sides.place >= n]
        self._is_equation = sides.equal[sides.place >= n]
        self._factor = (self._sign / rows[self._place])[:, None]
        self._weight = nlp.sign / _size(nlp)

    @property
    def n(self) -> int:
        """Number of variables, all from -1 to 1."""
        return self.nlp.n

    @property
    def inequalities(self) -> int:
        """Number of inequalities."""
        return int(np.count_nonzero(~self._is_equation))

    @property
    def equations(self) -> int:
        """Number of equations."""
        return int(np.count_nonzero(self._is_equation))

    @cached_property
    def start(self) -> FloatArray:
        """(n,) random start: the point that this program's own sampling has for the seed."""
        point = starting_points(self.nlp, 2, self.seed)[1]
        return np.asarray((point - self.nlp.centre) / self.nlp.scale)

    def x(self, s: FloatArray) -> FloatArray:
        """Return a point in the units of the program, inside the bounds."""
        return np.clip(self.nlp.centre + self.nlp.scale * np.asarray(s), self.nlp.lower, self.nlp.upper)

    def f(self, s: FloatArray) -> float:
        """Return the objective, to be minimised."""
        return self._values(s).f

    def h(self, s: FloatArray) -> FloatArray:
        """Return the inequalities' left sides (m,): feasible where none is positive."""
        return self._values(s).h

    def e(self, s: FloatArray) -> FloatArray:
        """Return the equations' left sides (k,)."""
        return self._values(s).e

    def f_gradient(self, s: FloatArray) -> FloatArray:
        """Return the gradient of f (n,)."""
        return self._derivatives(s).f

    def h_jacobian(self, s: FloatArray) -> FloatArray:
        """Return the Jacobian of h (m, n)."""
        return self._derivatives(s).h

    def e_jacobian(self, s: FloatArray) -> FloatArray:
        """Return the Jacobian of e (k, n)."""
        return self._derivatives(s).e

    def penalised(self, s: FloatArray) -> float:
        """Return f and the sum of all violations times a weight, for methods without constraints."""
        return _penalised(self._values(s))

    def _values(self, s: FloatArray) -> _Values:
        """Return f, h and e; those of the last point are kept, because methods ask for them one by one."""
        s = np.asarray(s, dtype=np.float64)
        if s.tobytes() != self._point:
            self._count()
            self.evaluations += 1
            F, g = self.nlp.program.kernels.values(self.nlp.centre + self.nlp.scale * s, self.nlp.arguments)
            rows = (g.ravel()[self._place] - self._limit) * self._factor.ravel()
            f = self._weight * float(F[0, 0])
            rows = np.where(np.isfinite(rows), rows, UNDEFINED)
            self._point = s.tobytes()
            self._last = _Values(f if np.isfinite(f) else UNDEFINED, rows[~self._is_equation], rows[self._is_equation])
            merit = _penalised(self._last)
            if merit < self._least and np.max(np.abs(s)) <= 1 + 1e-9:
                self._least, self.best = merit, s.copy()
        return self._last

    def _derivatives(self, s: FloatArray) -> _Derivatives:
        """Return the derivatives of f, h and e; those of the last point are kept."""
        s = np.asarray(s, dtype=np.float64)
        if s.tobytes() != self._slope_point:
            self._count()
            self.gradients += 1
            found = self.nlp.program.kernels.derivatives(self.nlp.centre + self.nlp.scale * s, self.nlp.arguments)
            rows = np.nan_to_num(found.jacobian[self._place] * self.nlp.scale * self._factor)
            gradient = np.nan_to_num(self._weight * found.gradient.ravel() * self.nlp.scale)
            self._slope_point = s.tobytes()
            self._slopes = _Derivatives(gradient, rows[~self._is_equation], rows[self._is_equation])
        return self._slopes

    def _count(self) -> None:
        """End the search where its budget is spent."""
        spent = time.process_time() - self._began
        if self.evaluations + self.gradients >= self._budget.evaluations or spent > self._budget.seconds:
            raise BudgetSpentError


def _penalised(at: _Values) -> float:
    return at.f + WEIGHT * float(np.maximum(at.h, 0.0).sum() + np.abs(at.e).sum())


def _size(nlp: Nlp) -> float:
    """Return the size by which F is divided: its value at the case's start, or its scale where that is next to 0."""
    F = abs(nlp.evaluate(nlp.start).F)
    return F if np.isfinite(F) and F / nlp.objective_scale > 1e-6 else nlp.objective_scale


#: A search: the answer in scaled variables (n,).
Search = Callable[[Problem], FloatArray]


@dataclass(frozen=True)
class Peer:
    """A method by which a user might search.

    Attributes:
        name: in tables.
        package: name of the package that must be installed.
        search: one attempt.
        derivatives: ``exact``, ``differences`` or ``none``.
        constraints: ``own`` where the method has them, else ``penalty``.
        kind: ``local`` from one start, ``many starts``, or ``global``, whose answers are also judged after a polish.
        has_equations: whether its constraints may be equations.
        is_random: whether its answer depends on the seed.
    """

    name: str
    package: str
    search: Search
    derivatives: str = "none"
    constraints: str = "own"
    kind: Literal["local", "many starts", "global"] = "local"
    has_equations: bool = True
    is_random: bool = True

    @property
    def _function(self) -> Callable[..., FloatArray]:
        return self.search.func if isinstance(self.search, partial) else self.search

    @property
    def module(self) -> str:
        """Name of the module with the search."""
        return self._function.__module__.rpartition(".")[2]

    @property
    def lines(self) -> int:
        """Number of lines of the search, with its imports and without its docstring, comments and empty lines."""
        source = textwrap.dedent(inspect.getsource(self._function))
        (defined,) = ast.parse(source).body
        if not isinstance(defined, ast.FunctionDef):
            raise TypeError(f"{self.name}: the search is no plain function")
        body = defined.body[1:] if ast.get_docstring(defined) is not None else defined.body
        lines = source.splitlines()[body[0].lineno - 1 : body[-1].end_lineno]
        return sum(bool(line.strip()) and not line.strip().startswith("#") for line in lines)
