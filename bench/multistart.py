"""Time of a solve in process from the case's starts: screened, with Ipopt from each start, and SciPy's SLSQP.

All have the same starting points, on one thread, in turn, in one process; the table has medians of processor time,
because the machine may be shared. A solve includes the
functions' derivatives, the screening, Ipopt, the corrections and the evidence; formulating the program is not included
and has a column of its own. SLSQP searches in scaled variables, with the program's compiled functions as objective and
constraints: once with finite differences, and once with the program's gradients. Its points are not judged; a column
says how many of its starts end within 1e-6 of the best F known.

Run by hand: ``OPENBLAS_NUM_THREADS=1 .venv/bin/python -P bench/multistart.py [rounds] [cases ...]``. It needs SciPy.
"""

import statistics
import sys
import time
import tomllib
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import minimize

from screwsynth.models.catalog import robot_function
from screwsynth.nlp import Case, Nlp, load_case
from screwsynth.nlp.case.reader import case_from_tables
from screwsynth.nlp.evidence.closing import close_near, closed_start
from screwsynth.nlp.program.formulation import formulate_each
from screwsynth.nlp.program.pairs import with_all_pairs
from screwsynth.nlp.program.sampling import starting_points
from screwsynth.nlp.solver.solve import solve_programs
from screwsynth.nlp.starter.text import starter_case

CASES = (
    *("paper-4.1-helical", "paper-4.2", "paper-4.3", "paper-4.4-max", "paper-4.4-min", "hexapod-machining"),
    *("delta", "3-rps"),
)
SMALL = 1e-9
CLOSE = 1e-6


def case_of(name: str) -> Case:
    if name not in ("delta", "3-rps"):
        return load_case(name)
    return case_from_tables(tomllib.loads(starter_case(robot_function(name)())), name=name, source=name)


def starts_of(nlp: Nlp) -> np.ndarray:
    points = starting_points(nlp, nlp.case.search.starts, nlp.case.search.seed)
    if not nlp.program.model.unknowns:
        return points
    home = closed_start(nlp)
    return np.array([close_near(nlp, home, x) for x in points])


def slsqp(nlp: Nlp, points: np.ndarray, with_gradients: bool) -> list[float]:
    """Search from each point, and return the feasible values of F."""
    weight, centre, scale = nlp.sign / nlp.objective_scale, nlp.centre, nlp.scale
    equal = nlp.g_lower == nlp.g_upper
    below, above = np.isfinite(nlp.g_lower) & ~equal, np.isfinite(nlp.g_upper) & ~equal

    def split(g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (g - nlp.g_lower)[equal], np.concatenate([(g - nlp.g_lower)[below], (nlp.g_upper - g)[above]])

    def slopes(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows = nlp.program.kernels.derivatives(centre + scale * s, nlp.arguments).jacobian * scale
        return rows[equal], np.concatenate([rows[below], -rows[above]])

    constraints = []
    for kind, place, count in (("eq", 0, equal.sum()), ("ineq", 1, below.sum() + above.sum())):
        if count:
            own = {"type": kind, "fun": lambda s, i=place: split(nlp.evaluate(centre + scale * s).g)[i]}
            constraints.append(own | ({"jac": lambda s, i=place: slopes(s)[i]} if with_gradients else {}))

    def gradient(s: np.ndarray) -> np.ndarray:
        return weight * nlp.program.kernels.derivatives(centre + scale * s, nlp.arguments).gradient.ravel() * scale

    found = []
    for point in points:
        result = minimize(
            lambda s: weight * nlp.evaluate(centre + scale * s).F,
            (point - centre) / scale,
            method="SLSQP",
            jac=gradient if with_gradients else None,
            bounds=[(-1.0, 1.0)] * nlp.n,
            constraints=constraints,
            options={"maxiter": 500, "ftol": SMALL},
        )
        at = nlp.evaluate(centre + scale * result.x)
        off = np.maximum(nlp.g_lower - at.g, at.g - nlp.g_upper).max(initial=0.0)
        found.append(at.F if off <= CLOSE * max(1.0, float(np.abs(at.g).max(initial=0.0))) else np.nan)
    return found


class Race:
    """Times and answers of one case, by label."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.seconds: dict[str, list[float]] = {}
        self.answers: dict[str, object] = {}
        # Of limits on many pairs a solve has those that matter; SLSQP gets all.
        self.programs = [with_all_pairs(nlp) for nlp in formulate_each(case)]

    def time(self, label: str, work: Callable[[], object]) -> None:
        began = time.process_time()
        self.answers[label] = work()
        self.seconds.setdefault(label, []).append(1e3 * (time.process_time() - began))

    def run(self) -> None:
        self.time("formulating", lambda: formulate_each(self.case))
        for label, is_screened in (("screened", True), ("Ipopt", False)):
            fresh, search = formulate_each(self.case), replace(self.case.search, screen=is_screened)
            self.time(label, partial(solve_programs, self.case, fresh, search, jobs=1))
        for label, is_given in (("SLSQP", False), ("SLSQP with gradients", True)):
            self.time(label, partial(self.slsqp, is_given))

    def slsqp(self, with_gradients: bool) -> list[list[float]]:
        return [slsqp(nlp, starts_of(nlp), with_gradients) for nlp in self.programs]


def main(rounds: int, names: list[str]) -> None:
    print("medians of", rounds, "rounds in ms of processor time; ratios: SLSQP with finite differences to each")
    for name in names:
        race = Race(case_of(name))
        for _ in range(rounds):
            race.run()
        median = {label: statistics.median(each) for label, each in race.seconds.items()}
        print(f"\n{name}: {race.case.search.starts} starts")
        for label, middle in median.items():
            ratio = "" if label == "formulating" else f"  x {median['SLSQP'] / middle:6.1f}"
            print(f"  {label:22} {middle:9.1f} ms{ratio}  {words(label, race.answers, race.programs)}")


def words(label: str, answers: dict[str, object], programs: list[Nlp]) -> str:
    """Return what was found, of the first task where there are several."""
    own = [answers[each].outcomes[0].own for each in ("screened", "Ipopt")]
    sign, size = programs[0].sign, programs[0].objective_scale
    best = sign * min(sign * each.optima[0].F for each in own)
    if label in ("screened", "Ipopt"):
        solution = own[label == "Ipopt"]
        hits = sum(o.count for o in solution.optima if abs(o.F - best) <= CLOSE * size)
        return f"F = {solution.optima[0].F:.9g}, {len(solution.optima)} optima, best from {hits} starts"
    if label == "formulating":
        return ""
    F = np.array(answers[label][0])
    return f"F = {sign * np.nanmin(sign * F):.9g}, best from {np.sum(np.abs(F - best) <= CLOSE * size)} starts"


if __name__ == "__main__":
    warnings.simplefilter("ignore", RuntimeWarning)  # SLSQP's steps leave the domain of some robots
    numbers = [each for each in sys.argv[1:] if each.isdigit()]
    main(int(numbers[0]) if numbers else 5, [each for each in sys.argv[1:] if not each.isdigit()] or list(CASES))
