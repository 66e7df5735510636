"""Points of a sweep solved many at a time by the compiled program, each winner judged by the program's own evidence.

A point whose search did not converge, or whose winner the evidence does not call an optimum, is given to Ipopt.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...models import Dimension, FloatArray
from ..case.task import Sense
from ..embedding.codegen import generate_c
from ..embedding.library import CompiledCase, CompiledSolutions, load_compiled
from ..errors import CaseError
from ..evidence.many import Verdicts, judge_many
from ..evidence.optimality import PointKind, examine
from ..solver.status import Status
from .interpreted import solve_point
from .places import Block, NotPlacedError, Places, place
from .points import Points
from .rows import Row, finite, with_evidence
from .source import CaseSource

#: Number of starting points in the table of the generated C.
MOST_STARTS = 16


class Solved(NamedTuple):
    """Points as the compiled solver left them.

    Attributes:
        indices: of the points.
        values: (N, m) numbers of the sweep there.
        block: numbers of the program there.
        found: answers of the solver in C.
        seconds: wall time.
    """

    indices: Sequence[int]
    values: FloatArray
    block: Block
    found: CompiledSolutions
    seconds: float


class CompiledEngine:
    """Engine that solves a block of points by compiled C, and gives Ipopt what the evidence does not accept.

    Args:
        source: the case.
        chosen: points of the sweep at which its program is compared with those of cases read anew.
        starts: number of searches at each point, at most ``MOST_STARTS``.
        seed: of Ipopt's starting points instead of the case's.
        threads: number of threads; as many as there are processors where None.

    Raises:
        NotPlacedError: one program does not serve all points, or no compiler does.
        CaseError: the case has no number of a name, or does not allow a value.
        InputError: there is no C compiler, or it fails.
    """

    def __init__(
        self, source: CaseSource, chosen: Points, starts: int, seed: int | None, threads: int | None = None
    ) -> None:
        if starts > MOST_STARTS:
            raise NotPlacedError(f"compiled C has {MOST_STARTS} starting points, and {starts} are wanted")
        self.source, self.names, self.starts, self.seed, self.threads = source, chosen.names, starts, seed, threads
        self.places: Places = place(source, chosen)
        self.library = _compile(self.places)
        sides = self.places.nlp.sides.sides
        self._side_names = [f"{side.name} {side.bound}" for side in sides]
        workspace = self.places.nlp.case.workspace
        # All points are solved in one way, those that Ipopt solves too.
        self._note = "" if workspace is None else workspace.stated_pose_notice
        self._slopes: dict[tuple[int, float], float] = {}

    def solve(self, indices: Sequence[int], values: FloatArray) -> Solved:
        """Solve points with values (N, m) by compiled C."""
        began = time.perf_counter()
        block = self.places.block(values)
        numbers = block.numbers
        bounded = self.places.has_bounds
        found = self.library.solve(
            p=numbers.arguments,
            lower=numbers.lower if bounded else None,
            upper=numbers.upper if bounded else None,
            limits=block.limits,
            seeds=self.starts,
            threads=self.threads,
        )
        return Solved(indices, values, block, found, time.perf_counter() - began)

    def rows(self, solved: Solved) -> list[Row]:
        """Return the rows of solved points."""
        began = time.perf_counter()
        found, block = solved.found, solved.block
        verdicts = judge_many(self.places.nlp, found.x, block.numbers)
        is_good = found.ok & block.is_placed
        nlp, unit = self.places.nlp, self.places.nlp.case.units
        shown = found.x.copy()
        for j, each in enumerate(nlp.program.variables):
            if each.dimension is Dimension.ANGLE and unit.angle == "deg":
                shown[:, j] = np.degrees(shown[:, j])
        strict = PointKind.STRICT_MAXIMUM if nlp.sense is Sense.MAX else PointKind.STRICT_MINIMUM
        share = (solved.seconds + time.perf_counter() - began) / len(solved.indices)
        rows: list[Row] = []
        for k, index in enumerate(solved.indices):
            row = Row(
                index,
                Status.OPTIMAL.value,
                float(verdicts.F[k]),
                x=tuple(shown[k].tolist()),
                starts=int(found.runs[k]),
                converged=int(found.converged[k]),
                engine="compiled",
                seconds=share,
                note=self._note,
            )
            if is_good[k] and verdicts.is_strict[k]:
                rows.append(self._with_verdict(row, verdicts, block, k, strict))
                continue
            examined = self._with_evidence(row, block, found.x[k], k) if is_good[k] else None
            if examined is None:
                settings = dict(zip(self.names, solved.values[k].tolist(), strict=True))
                examined = solve_point(
                    self.source, settings, index, self.starts, self.seed, at_stated_pose=bool(self._note)
                )
                examined = examined._replace(note=examined.note or self._note)
            rows.append(examined)
        return rows

    def _with_verdict(self, row: Row, verdicts: Verdicts, block: Block, k: int, kind: PointKind) -> Row:
        """Return a row with the evidence of a strict optimum."""
        sides = np.flatnonzero(verdicts.active[k])
        return row._replace(
            active=tuple(self._side_names[j] for j in sides),
            multipliers=tuple(self._multiplier(verdicts, block, k, int(j)) for j in sides),
            verdict=kind.value,
            stationarity=finite(verdicts.stationarity[k]),
            feasibility=finite(verdicts.feasibility[k]),
            curvature=finite(verdicts.curvature[k]),
        )

    def _with_evidence(self, row: Row, block: Block, x: FloatArray, k: int) -> Row | None:
        """Return a row with evidence that is computed for its point alone; None where that is no optimum."""
        evidence = examine(block.numbers.put_into(self.places.nlp, k), x)
        return with_evidence(row, evidence) if evidence.kind.is_optimum else None

    def _multiplier(self, verdicts: Verdicts, block: Block, k: int, j: int) -> float:
        """Return the multiplier of side j at point k in F per unit of its limit."""
        value = float(verdicts.multipliers[k, j] * verdicts.weights[k, j])
        side = self.places.nlp.sides.sides[j]
        if side.constraint is None:
            return value
        bounds = block.numbers.g_lower if side.bound == "min" else block.numbers.g_upper
        limit = float(bounds[k, side.constraint])
        key = (side.constraint, limit)
        if key not in self._slopes:
            self._slopes[key] = self.places.nlp.program.constraints[side.constraint].reading.slope(limit)
        return value * self._slopes[key]


def _compile(places: Places) -> CompiledCase:
    """Return the solver in C of the places' program.

    Raises:
        NotPlacedError: C is not generated for the case, or has other variables or numbers than the program.
        InputError: there is no C compiler, or it fails.
    """
    with tempfile.TemporaryDirectory(prefix="screwsynth.") as folder:
        try:
            files = generate_c(places.nlp.case)
        except CaseError as error:
            raise NotPlacedError(f"C is not generated for this case: {error}") from None
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        library = load_compiled(folder)
    program = places.nlp.program
    wanted = [each.name for each in program.variables], [each.name for each in program.arguments]
    if wanted != ([each.name for each in library.variables], [each.name for each in library.parameters]):
        raise NotPlacedError("the generated C has other numbers than the program")
    return library
