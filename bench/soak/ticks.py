"""Problems of a soak, tick after tick, and their judgement by formulas that are not the program's."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from formulas import Array, State, delta, planar, platform_of_legs, tripod

from screwsynth.nlp import CompiledSolutions

OK, NOT_CONVERGED, INFEASIBLE, BAD_INPUT, BUDGET, OTHER_ASSEMBLY, RANGE_END = range(7)
WORDS = ("ok", "not converged", "infeasible", "bad input", "budget", "other assembly", "range end")
#: Half widths of narrowed bounds, in half ranges; the box of the first one is a point.
WIDTHS = (0.0, 0.0, 1e-13, 1e-12, 1e-10, 1e-8, 1e-5, 1e-3, 0.1)
ODD = (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e200, 5e-324, -0.0, 0.0)
#: Excess over a limit, in parts of its size, up to which a point keeps it; below the second it surely is feasible.
KEPT, SURE = 1e-7, 1e-11
#: Error of F in parts of its size without cancellation.
CLOSE = 1e-9

octahedral = partial(platform_of_legs, layout="octahedral")
FORMULAS: Mapping[str, Callable[[Mapping[str, Array]], State]] = {
    "paper-4.1-helical": partial(platform_of_legs, layout="aligned", home=None),
    "paper-4.3": partial(platform_of_legs, layout="aligned", home=None),
    "drilling-spindle": partial(octahedral, home=None),
    "hexapod-machining": partial(octahedral, home=np.array([0.0, 0.0, 20.0])),
    "camera-mount": partial(octahedral, home=None),
    "flight-simulator": partial(octahedral, home=None),
    "delta": delta,
    "planar-3-rrr": planar,
    "3-rps": tripod,
}


@dataclass
class Robot:
    """A case in C and its formulas.

    Args:
        compiled: what ``load_compiled`` returns.
        sense: 1 for a maximum, -1 for a minimum.
    """

    compiled: Any
    sense: float

    def __post_init__(self) -> None:
        own = self.compiled
        self.names = [each.name for each in own.variables]
        self.lower, self.upper = (np.array([getattr(v, end) for v in own.variables]) for end in ("lower", "upper"))
        self.defaults = np.array([each.default for each in own.parameters])
        self.twists = [i for i, each in enumerate(own.parameters) if each.name.startswith("twist")]
        self.angles = [i for i, each in enumerate(own.parameters) if each.unit == "rad"]
        self.keys = [each.key for each in own.limits]
        self.limits = np.array([each.default for each in own.limits])
        self.level = self.names.index("level") if "level" in self.names else None
        self.free = np.array([i for i in range(len(self.names)) if i != self.level])
        self.parameter_names = [each.name for each in own.parameters]

    def state(self, x: Array, p: Array) -> State:
        """Return the state at m points."""
        numbers = dict(zip(self.names, x.T, strict=True)) | dict(zip(self.parameter_names, p.T, strict=True))
        with np.errstate(all="ignore"):
            return FORMULAS[self.compiled.name](numbers)

    def values(self, state: State, p: Array) -> Array:
        """Return F (m, k) of each task at each pose, in parts of the tasks' weights."""
        names = [name for name in self.parameter_names if name.startswith("weight")]
        weights = p[:, [self.parameter_names.index(name) for name in names]] if names else 1.0
        with np.errstate(all="ignore"):
            return (state.F / np.asarray(weights).reshape(-1, 1, len(names) or 1)).reshape(len(state.F), -1)

    def objective(self, state: State, p: Array) -> Array:
        """Return F (m,) as the case has it: of its task, or the worst one."""
        values = self.values(state, p)
        return values[:, 0] if values.shape[1] == 1 else (values.min(axis=1) if self.sense > 0 else values.max(axis=1))

    def excess(self, state: State, limits: Array) -> Array:
        """Return the largest excess (m,) over a limit or out of a closed loop, in parts of the limit's size."""
        most = np.zeros(len(limits))
        for column, key in zip(limits.T, self.keys, strict=True):
            values = state.limits[key]
            with np.errstate(all="ignore"):
                off = column[:, None] - values if key.endswith(".min") else values - column[:, None]
            # A limit of the angle is one of its sine, which is kept to 1e-9 of its range however small the limit is.
            least = 0.1 if key == "angle.max" else 1e-3
            size = np.where(np.abs(column) > least, np.abs(column), least)
            with np.errstate(all="ignore"):
                most = np.fmax(most, off.max(axis=1) / size)
            most[np.isnan(off).any(axis=1)] = np.inf
        loops = np.abs(state.equations).max(axis=1, initial=0.0)
        return np.where(np.isnan(loops), np.inf, np.fmax(most, loops))

    def size(self, x: Array, p: Array) -> Array:
        """Return a bound (m,) of F's size without cancellation, for its rounding error."""
        reach = 3 * (np.abs(x[:, self.free]).max(axis=1) + np.abs(p[:, : self.twists[0]]).max(axis=1, initial=0.0))
        twist = p[:, self.twists]
        return 100 * (1 + reach) ** 2 * np.max(twist**2, axis=1)


@dataclass
class Tick:
    """Problems of one tick, a row for each of m tracks."""

    p: Array
    x0: Array
    lower: Array
    upper: Array
    limits: Array
    most: Array
    seeds: int
    odd: Array = field(default_factory=lambda: np.zeros(0))


def next_tick(robot: Robot, x: Array, p: Array, rng: np.random.Generator) -> Tick:
    """Return the problems of a tick from the last answers: tasks, limits, ranges, budgets and odd numbers change."""
    m, n = x.shape
    p = p.copy()
    fresh, small = rng.random(m) < 0.3, rng.random(m) < 0.5
    task = rng.normal(size=(m, len(robot.twists))) * 10 ** rng.uniform(-2, 2, (m, 1))
    p[:, robot.twists] = np.where(
        fresh[:, None], task, p[:, robot.twists] * (1 + 1e-3 * small[:, None] * rng.normal(size=task.shape))
    )
    x0 = x.copy()
    elsewhere = rng.random(m) < 0.1
    span = np.where(robot.upper - robot.lower > 1e299, 0.0, robot.upper - robot.lower)
    x0[elsewhere] = (np.where(span > 0, robot.lower, 0.0) + rng.random((m, n)) * span)[elsewhere]
    # Limits: the case's, some tightened to just above what the start has, some beyond it.
    limits = np.tile(robot.limits, (m, 1))
    state = robot.state(x0, p)
    for j, key in enumerate(robot.keys):
        values, is_least = state.limits[key], key.endswith(".min")
        here = values.min(axis=1) if is_least else values.max(axis=1)
        factor = 1 + (-1 if is_least else 1) * rng.choice([0.0, 1e-9, 1e-3, 0.05, -1e-3, -0.05], m)
        own = robot.compiled.limits[j]
        most = min(own.most, robot.limits[j]) if key == "angle.max" else own.most
        with np.errstate(all="ignore"):
            wanted = np.clip(here * factor, own.above + 1e-3 * abs(robot.limits[j]), most)
        change = (rng.random(m) < 0.15) & np.isfinite(wanted) & (np.abs(wanted) < 10 * np.abs(robot.limits[j]))
        limits[change, j] = wanted[change]
    for low, high in (
        (k, robot.keys.index(f"{key[:-3]}max"))
        for k, key in enumerate(robot.keys)
        if f"{key[:-3]}max" in robot.keys and key.endswith(".min")
    ):
        crossed = limits[:, low] > limits[:, high]
        limits[crossed, low] = robot.limits[low]
        limits[crossed, high] = robot.limits[high]
    # Ranges about the start, in some variables or in all.
    half = 0.5 * span * rng.choice(WIDTHS, m)[:, None]
    narrow = (rng.random((m, n)) < rng.choice([1.0, 0.5], m)[:, None]) & (rng.random(m) < 0.6)[:, None]
    lower = np.where(narrow, np.clip(x0 - half, robot.lower, robot.upper), robot.lower)
    upper = np.where(narrow, np.clip(x0 + half, robot.lower, robot.upper), robot.upper)
    most = np.where(rng.random(m) < 0.2, rng.integers(1, 20, m), 0)
    tick = Tick(p, x0, lower, upper, limits, most, int(rng.choice([0, 0, 0, 1, 4])))
    tick.odd = np.full(m, -1)
    for row in np.flatnonzero(rng.random(m) < 0.03):
        arrays = [each for each in (tick.p, tick.x0, tick.lower, tick.upper, tick.limits) if each.size]
        array = arrays[rng.integers(len(arrays))]
        choice = int(rng.integers(len(ODD)))
        array[row, rng.integers(array.shape[1])] = ODD[choice]
        tick.odd[row] = choice
    return tick


def solved(robot: Robot, tick: Tick) -> CompiledSolutions:
    """Return the answers of the C: numbers go to it as they are, not by the checks of the Python function."""
    own = robot.compiled
    arrays = {"x0": tick.x0, "p": tick.p, "lower": tick.lower, "upper": tick.upper, "limits": tick.limits}
    arrays = {name: np.ascontiguousarray(each) for name, each in arrays.items() if each.size}
    batch, answers = own._batch(len(tick.x0), arrays)
    batch.maximise, batch.seeds = -1, tick.seeds
    own._run(batch, len(tick.x0), 1, {"max_iterations": tick.most.astype(float), "deadline_seconds": None})
    return answers


def judged(robot: Robot, tick: Tick, found: CompiledSolutions) -> dict[str, Array]:
    """Return the rows with each fault."""
    status, x = found.status, found.x
    state, start = robot.state(x, tick.p), robot.state(tick.x0, tick.p)
    is_odd = tick.odd >= 0
    none = np.isin(tick.odd, (0, 1, 2))
    # Sines of huge angles are rounding error, and an arm without length has no side.
    vague = is_odd & np.any(np.abs(tick.p[:, robot.angles]) > 1e15, axis=1)
    inside = np.all((x >= tick.lower) & (x <= tick.upper) | (np.arange(x.shape[1]) == robot.level), axis=1)
    keeps = robot.excess(state, tick.limits) <= KEPT
    closed = np.abs(state.equations).max(axis=1, initial=0.0) <= SURE
    F, own = found.F, robot.objective(state, tick.p)
    with np.errstate(all="ignore"):
        wrong_F = ~(np.abs(F - own) <= CLOSE * robot.size(x, tick.p))
        in_box = np.all(((tick.x0 >= tick.lower) & (tick.x0 <= tick.upper))[:, robot.free], axis=1)
        feasible = in_box & (robot.excess(start, tick.limits) <= SURE) & ~is_odd
        before = robot.objective(start, tick.p)
        point = np.all((tick.lower == tick.upper)[:, robot.free], axis=1)
        worse = robot.sense * (F - before) < -1e-8 * robot.size(x, tick.p)
    good = np.isin(status, (OK, OTHER_ASSEMBLY, RANGE_END))
    answered = good | (status == NOT_CONVERGED)
    found_inside = good | (status == NOT_CONVERGED) | (status == INFEASIBLE) | (status == BUDGET)
    return {
        "outside the bounds": found_inside & ~inside,
        "outside the limits": answered & ~keeps & ~vague,
        # With open loops a limb has no one place, and F is that of the program's own way to open them.
        "wrong F": found_inside & wrong_F & ~is_odd & closed,
        "wrong F with an odd number": good & wrong_F & is_odd & ~vague,
        "false ok: another assembly": (status == OK) & ~state.is_home & ~is_odd,
        "false other assembly": (status == OTHER_ASSEMBLY) & state.is_home & ~is_odd,
        "false infeasible": (status == INFEASIBLE) & feasible,
        "not converged at a point": (status == NOT_CONVERGED) & point & feasible,
        "no ok at a point": ~np.isin(status, (OK, OTHER_ASSEMBLY, RANGE_END, BUDGET)) & point & feasible,
        "false bad input": (status == BAD_INPUT) & ~is_odd,
        "odd number not refused": (status != BAD_INPUT) & none,
        "budget without one": (status == BUDGET) & (tick.most == 0),
        "worse than a feasible start": (good | (status == NOT_CONVERGED) | (status == BUDGET))
        & feasible
        & worse
        & (start.is_home | ~state.is_home),
        "budget left a feasible start": (status == BUDGET) & feasible & ~keeps,
    }


def soak(
    robot: Robot, ticks: int, tracks: int, seed: int
) -> tuple[Counter[str], Counter[str], list[tuple[str, int, int]]]:
    """Run ticks of many tracks. Returns the counts of statuses, those of faults, and where the first faults are."""
    rng = np.random.default_rng(seed)
    first = robot.compiled.solve(threads=1)
    x, p = np.tile(first.x, (tracks, 1)), np.tile(robot.defaults, (tracks, 1))
    statuses, faults, places = Counter[str](), Counter[str](), []
    for k in range(-(-ticks // tracks)):
        tick = next_tick(robot, x, p, rng)
        found = solved(robot, tick)
        statuses.update(WORDS[each] for each in found.status)
        for fault, rows in judged(robot, tick, found).items():
            faults[fault] += int(rows.sum())
            places += [(fault, k, int(row)) for row in np.flatnonzero(rows)[:2]]
        usable = np.isin(found.status, (OK, OTHER_ASSEMBLY, NOT_CONVERGED)) & (tick.odd < 0)
        x = np.where(usable[:, None], found.x, x)
        # A task that is kept stays what it was, without odd numbers.
        p = np.where(usable[:, None], tick.p, np.tile(robot.defaults, (tracks, 1)))
        x[rng.random(tracks) < 0.02] = first.x[0]
    return statuses, Counter({name: count for name, count in faults.items() if count}), places
