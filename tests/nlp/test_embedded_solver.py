"""Solver in C: the optimum from everywhere, honest statuses, and its use within a controller."""

import ctypes
import math
import os
import re
import subprocess
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import case_from, turn_about
from generated import BAD_INPUT, BUDGET, COMPILERS, INFEASIBLE, OK, written

from screwsynth.nlp import (
    Case,
    Free,
    Nlp,
    Rotation,
    Sense,
    Task,
    build_model,
    formulate,
    generate_c,
    load_case,
    shipped_cases,
)
from screwsynth.nlp.case.settings import Search
from screwsynth.nlp.embedding import worstcase
from screwsynth.nlp.evidence.kkt import linearise, multipliers
from screwsynth.nlp.program.sampling import starting_points
from screwsynth.nlp.solver.multistart import solve_program

FEASIBLE, STATIONARY = 1e-9, 1e-7
#: Random robots of the test below. A thousand take some minutes and were run by hand.
ROBOTS = int(os.environ.get("SCREWSYNTH_ROBOTS", "12"))

Embedded = Any
Embed = Callable[..., Embedded]
EmbeddedCase = Callable[[str], Embedded]
Patch = pytest.MonkeyPatch


def kkt(nlp: Nlp, x: np.ndarray) -> tuple[float, float]:
    """Violation and KKT residual by the route that the Python side takes, which knows nothing of the C."""
    at = linearise(nlp, x)
    return at.violation, multipliers(at, at.active(1e-6))[1]


def check_kkt(nlp: Nlp, x: np.ndarray) -> None:
    violation, residual = kkt(nlp, x)
    assert violation <= FEASIBLE
    assert residual <= STATIONARY


def shipped(embedded: EmbeddedCase, name: str) -> tuple[Embedded, Nlp]:
    """The C of a shipped case, and its program."""
    return embedded(name), formulate(load_case(name))


#: Cases whose C differs from another's in numbers alone, with that other one.
SAME_C = {
    "paper-4.1-rotation": "paper-4.1-helical",
    "paper-4.1-rotation-axis-z": "paper-4.1-helical-axis-z",
    "paper-4.2-rotation": "paper-4.2-translation",
    "paper-4.4-min": "paper-4.4-max",
}


@pytest.mark.parametrize(
    "name", [name for name in shipped_cases() if name.startswith("paper-") and name != "paper-4.2"]
)
def test_random_starts_end_at_the_global_optimum(name: str, embedded: EmbeddedCase) -> None:
    c, case = embedded(SAME_C.get(name, name)), load_case(name)
    nlp = formulate(case)
    given = {"p": nlp.arguments, "lower": nlp.lower, "upper": nlp.upper, "maximise": int(nlp.sense is Sense.MAX)}
    best = solve_program(nlp, case.search).F
    size = abs(best) if abs(best) > 1e-6 * nlp.objective_scale else nlp.objective_scale
    statuses: Counter[int] = Counter()
    for k, x in enumerate(starting_points(nlp, 401, 5)[1:] if nlp.n else [nlp.start] * 3):
        solved = c.solve(x0=x, seeds=0, **given)
        statuses[solved.status] += 1
        if solved.status == OK:
            assert abs(solved.F - best) <= 1e-6 * size
            if k % 5:  # Python's own judgement takes longer than the search
                continue
            check_kkt(nlp, solved.x)
            assert solved.residual <= STATIONARY
    assert statuses[OK] >= 0.995 * statuses.total()


def test_with_limits_each_optimum_is_one_and_the_seeds_reach_the_best(embedded: EmbeddedCase) -> None:
    c, case = embedded("hexapod-machining"), load_case("hexapod-machining")
    nlp = formulate(case)
    best, reached = solve_program(nlp, case.search).F, 0
    for x in starting_points(nlp, 101, 5)[1:]:
        solved = c.solve(x0=x, seeds=0)
        if solved.status == OK:
            check_kkt(nlp, solved.x)
            assert best * (1 + 1e-9) >= solved.F
            reached += best * (1 - 1e-6) <= solved.F
    assert reached >= 50
    assert abs(c.solve().F - best) <= 1e-6 * best


@pytest.mark.parametrize("name", ["paper-4.1-helical", "paper-4.3", "free-wrist"])
def test_the_verdict_is_measured_where_the_point_is(name: str, embedded: EmbeddedCase) -> None:
    c, case = embedded(name), load_case(name)
    nlp, solved = formulate(case), c.solve()
    assert abs(solved.F - solve_program(nlp, case.search).F) <= 1e-6 * solved.F
    state = nlp.program.kernels.robot_state(solved.x, nlp.arguments)
    F, g = nlp.evaluate(solved.x)
    assert solved.status == OK
    assert abs(solved.F - F) <= 1e-13 * abs(F) + 1e-20
    assert np.max(np.abs(solved.R.reshape(3, 3) - state[1])) <= 1e-14
    assert np.all(g <= nlp.g_upper + FEASIBLE)
    assert np.all(g >= nlp.g_lower - FEASIBLE)
    assert np.all((nlp.lower <= solved.x) & (solved.x <= nlp.upper))
    # The axis and the angle make the same matrix: trace, and the axis stays where it is.
    assert np.trace(state[1]) == pytest.approx(1 + 2 * math.cos(solved.angle), abs=1e-12)
    assert state[1] @ solved.axis == pytest.approx(solved.axis, abs=1e-12)


def random_case(model: str, generator: np.random.Generator) -> Case:
    """A random robot and task, free to move in a box and to turn about any axis."""
    if model == "stewart-gough":
        x1, x2 = generator.uniform(6, 20), generator.uniform(4, 12)
        x3, x4 = np.radians(generator.uniform(1, 29, 2))
        parameters = {"x1": x1, "x2": x2, "x3": x3, "x4": x4}
    else:
        names = [f"{plate}_{leg}" for plate in ("base", "platform") for leg in range(1, 7)]
        parameters = {name: tuple(generator.uniform(-12, 12, 3) * (1, 1, 0.2)) for name in names}
    width, height = generator.uniform(3, 15), generator.uniform(15, 40)
    pitch = generator.choice([0.0, generator.uniform(-5, 5), math.inf])
    axis, point = generator.normal(size=3), generator.uniform(-10, 10, 3)
    turn = math.radians(generator.uniform(5, 60))
    return Case(
        model=build_model(model),
        parameters=parameters,
        position=(Free(-width, width), Free(-width, width), Free(height, height + 20)),
        rotation=Rotation(axis=None, angle=Free(-turn, turn)),
        tasks=(Task.screw(str(generator.choice(["max", "min"])), axis=axis, pitch=pitch, point=point),),
        name="random",
    )


@pytest.mark.parametrize("model", ["stewart-gough", "hexapod"])
def test_random_robots_reach_the_best_optimum_known(model: str, embed: Embed) -> None:
    generator = np.random.default_rng(11)
    cases = [random_case(model, generator) for _ in range(ROBOTS)]
    c = embed(cases[0])
    best_reached, ok = 0, 0
    for case in cases:
        nlp = formulate(case)
        bounds = {"lower": nlp.lower, "upper": nlp.upper, "g_lower": nlp.g_lower, "g_upper": nlp.g_upper}
        bounds = {name: np.nan_to_num(each, posinf=1e300, neginf=-1e300) for name, each in bounds.items()}
        solved = c.solve(p=nlp.arguments, **bounds, maximise=int(nlp.sense.value == "max"), seeds=10)
        reference = solve_program(nlp, Search(starts=20))
        known = max([each.F for each in reference.optima], key=lambda F: -nlp.sign * F)
        scale = max(abs(known), 1e-6 * nlp.objective_scale)
        if solved.status == OK:
            ok += 1
            check_kkt(nlp, solved.x)
            # No F is better than the best known one, unless that is not the best.
            best_reached += nlp.sign * (solved.F - known) <= 1e-6 * scale
    assert best_reached >= 0.98 * ROBOTS, f"{best_reached} of {ROBOTS}, {ok} OK"


BAD_NUMBERS = [math.nan, math.inf, -math.inf]


def test_what_is_no_number_no_range_and_no_start_is_refused(embedded: EmbeddedCase) -> None:
    c, nlp = shipped(embedded, "paper-4.1-helical")
    good = {"p": nlp.arguments, "x0": nlp.start, "lower": nlp.lower, "upper": nlp.upper}
    wrong = [(name, index, bad) for name, array in good.items() for index in range(len(array)) for bad in BAD_NUMBERS]
    wrong += [("lower", index, nlp.upper[index] + 1) for index in range(nlp.n)]
    for name, index, bad in wrong:
        spoilt = np.array(good[name])
        spoilt[index] = bad
        assert c.solve(**{name: spoilt}).status == BAD_INPUT, (name, index, bad)
    assert c.solve(g_upper=np.array([math.nan])).status == BAD_INPUT
    assert c.solve(g_lower=np.array([0.05]), g_upper=np.array([0.04])).status == BAD_INPUT
    for seeds in (c.macro("SEEDS") + 1, -1, 0):
        assert c.solve(seeds=seeds).status == BAD_INPUT


def test_a_limb_of_zero_length_is_refused(embedded: EmbeddedCase) -> None:
    c, nlp = shipped(embedded, "paper-4.2-translation")
    p = np.array(nlp.arguments)
    p[[argument.name in ("p_x", "p_y", "p_z") for argument in nlp.program.arguments]] = 0.0
    # Both plates coincide where their circles and angles do: each limb then has its two joints in one place.
    x = np.array(nlp.start)
    free = [variable.name for variable in nlp.program.variables]
    x[free.index("x2")] = x[free.index("x1")]
    x[free.index("x4")] = x[free.index("x3")]
    assert c.solve(p=p, x0=x).status == BAD_INPUT
    # And where no other point is allowed, without a start of the caller's too.
    assert c.solve(p=p, lower=x, upper=x).status == BAD_INPUT


def test_adversarial_input_never_hangs_and_is_never_ok(embedded: EmbeddedCase) -> None:
    c, nlp = shipped(embedded, "paper-4.3")
    generator = np.random.default_rng(3)
    statuses: Counter[int] = Counter()
    for _ in range(2000):
        given = {"p": nlp.arguments, "x0": nlp.start, "lower": nlp.lower, "upper": nlp.upper}
        arrays = {name: np.array(values) for name, values in given.items()}
        name = str(generator.choice(list(arrays)))
        index = int(generator.integers(len(arrays[name])))
        arrays[name][index] = generator.choice([*BAD_NUMBERS, 1e308, -1e308, 1e200, 5e-324])
        solved = c.solve(**arrays, seeds=2)
        statuses[solved.status] += 1
        if solved.status == OK:
            # Only a number that leaves a problem may be answered, and then truly.
            assert np.isfinite(arrays[name]).all()
            assert np.all((arrays["lower"] <= solved.x) & (solved.x <= arrays["upper"]))
            assert solved.violation <= FEASIBLE
            assert np.isfinite(solved.F)
    assert statuses[BAD_INPUT] > 500


def test_limits_and_bounds_may_change_at_run_time(embedded: EmbeddedCase) -> None:
    c, nlp = shipped(embedded, "paper-4.1-helical")
    # |q|^2 of at least 4 has no point in a box of sides below 1.
    solved = c.solve(g_lower=np.array([4.0]), g_upper=np.array([5.0]))
    assert solved.status == INFEASIBLE
    assert solved.violation > 1
    assert np.all((nlp.lower <= solved.x) & (solved.x <= nlp.upper))
    lower, upper = np.array(nlp.lower), np.array(nlp.upper)
    z = [variable.name for variable in nlp.program.variables].index("p_z")
    lower[z] = upper[z] = 33.0
    held = c.solve(lower=lower, upper=upper)
    assert held.status == OK
    assert held.x[z] == 33.0
    still = c.solve(g_upper=np.array([math.sin(math.radians(5) / 2) ** 2]))
    assert still.status == OK
    assert still.angle <= math.radians(5) * (1 + 1e-7)
    assert held.F < still.F < c.solve().F
    # The point may be that of the last result.
    assert c.solve_again().iterations <= 2


def test_the_other_sense_and_another_task(embedded: EmbeddedCase) -> None:
    c, case = embedded("paper-4.1-helical"), load_case("paper-4.1-rotation")
    nlp = formulate(case)
    other = solve_program(nlp, case.search)
    assert abs(c.solve(p=nlp.arguments).F - other.F) <= 1e-9 * other.F
    least = c.solve(p=nlp.arguments, maximise=0)
    assert least.status == OK
    assert least.F < 0.9 * other.F
    # Park's own axes are stationary for 4.4's maximum and no maximum.
    c, nlp = shipped(embedded, "paper-4.4-max")
    violation, residual = kkt(nlp, nlp.start)
    assert residual <= STATIONARY or violation > 0
    solved = c.solve(x0=nlp.start, seeds=0)
    assert (solved.status, solved.F) == (OK, pytest.approx(3.0, rel=1e-6))


def test_a_search_that_is_cut_off_is_no_answer(embed: Embed, embedded: EmbeddedCase, monkeypatch: Patch) -> None:
    monkeypatch.setattr(worstcase, "_ITERATIONS", 4)
    unfinished = 0
    for name in ("paper-4.3", "paper-4.4-max", "paper-4.1-helical"):
        c, nlp = embed(load_case(name), "-O0"), formulate(load_case(name))
        best = embedded(name).solve().F
        for x in starting_points(nlp, 101, 8)[1:]:
            solved = c.solve(x0=x, seeds=0)
            assert solved.iterations <= 4
            if solved.status == OK:
                check_kkt(nlp, solved.x)
                assert abs(solved.F - best) <= 1e-6 * best
            unfinished += solved.status != OK
    assert unfinished > 150


@pytest.mark.parametrize("iterations", [3, 4, 5, 6])
def test_a_search_that_ends_at_a_saddle_is_no_answer(iterations: int, embed: Embed, monkeypatch: Patch) -> None:
    # From Park's own axes the search runs into a saddle, and is cut off before it has left it.
    monkeypatch.setattr(worstcase, "_ITERATIONS", iterations)
    case = load_case("paper-4.4-max")
    solved = embed(case, "-O0").solve(x0=formulate(case).start, seeds=0)
    assert solved.status != OK


def test_a_side_that_only_rounding_holds_does_not_make_an_optimum(embedded: EmbeddedCase) -> None:
    # With this task F is even in several variables: their middles are bounds here, stationary, and saddles.
    c, nlp = shipped(embedded, "paper-4.3")
    at = nlp.program.places.twists[0].start
    p = np.array(nlp.arguments)
    p[at : at + 6] = [0, 0, 0, 0, 1, 0]
    lower = np.array([0, 0, 0, 20, 0, 0, -0.3235238064])
    upper = np.array([nlp.upper[0], 10, 10, 50, 0.3235238064, 0, 0])
    symmetric, half = np.clip([0.3, 0, 0, 30, 0, 0, 0], lower, upper), (upper - lower) / 2
    generator, checked = np.random.default_rng(0), 0
    F = nlp.program.kernels.values
    for _ in range(200):
        x0 = np.where(generator.random(7) < 0.4, generator.uniform(lower, upper), symmetric)
        solved = c.solve(p=p, lower=lower, upper=upper, x0=x0, seeds=0, maximise=0)
        if solved.status != OK:
            continue
        checked += 1
        here = float(F(solved.x, p)[0][0, 0])
        for i in range(7):
            inward = np.eye(7)[i] * half[i] * (0.01 if solved.x[i] - lower[i] < upper[i] - solved.x[i] else -0.01)
            assert float(F(solved.x + inward, p)[0][0, 0]) >= here - 1e-9 * nlp.objective_scale
    assert checked > 100


def test_the_residual_is_in_parts_of_the_size_of_f_where_it_is_found(embedded: EmbeddedCase) -> None:
    c, nlp = shipped(embedded, "paper-4.1-helical")
    lower, upper = np.array(nlp.lower), np.array(nlp.upper)
    lower[:3], upper[:3] = [-1e4, -1e4, 20], [1e4, 1e4, 1e4]
    wide, checked = replace(nlp, lower=lower, upper=upper), 0
    for x0 in starting_points(wide, 301, 4)[1:]:
        solved = c.solve(lower=lower, upper=upper, x0=x0, seeds=0, maximise=0)
        if solved.status == OK:
            # The scale of F is taken at the start: here, where the search ended.
            here = replace(wide, start=solved.x, sense=Sense.MIN)
            assert kkt(replace(here, size=here.objective_size), solved.x)[1] <= STATIONARY
            checked += 1
    assert checked > 20


def test_among_equal_optima_x_stays_where_it_was(embedded: EmbeddedCase) -> None:
    c, nlp = shipped(embedded, "paper-4.2-translation")
    somewhere = c.solve(seeds=16).x
    for x0 in starting_points(nlp, 21, 6)[1:]:
        own = c.solve(x0=x0, seeds=0)
        assert own.status == OK
        again = c.solve(x0=own.x)
        assert np.max(np.abs(again.x - own.x)) <= 1e-6
    assert np.max(np.abs(own.x - somewhere)) > 1e-3


#: Half widths of the bounds around the last answer, in parts of the case's ranges.
WIDTHS = (1e-3, 1e-5, 1e-8, 1e-10, 1e-12, 0.0)


#: A platform whose legs are limited: the constraints in square millimetres are large numbers with large slopes.
SMALL = """
task = [{ sense = "max", axis = [3, 1, 4], point = [30, 10, 200], pitch = 20 }]
limits = { leg_length = { min = 500, max = 720 }, radius_ratio = { max = 0.5 } }
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = { min = 300, max = 450 }, x2 = { min = 120, max = 200 }, x3 = 8, x4 = 12 }
[pose]
position = [{ min = -150, max = 150 }, { min = -150, max = 150 }, { min = 450, max = 700 }]
rotation = { angle = { min = -15, max = 15 } }
"""


@pytest.fixture(scope="module")
def limited(embed: Callable[[Case], Embedded]) -> tuple[Embedded, Nlp]:
    """The C of a case with limits and a free axis, and its program."""
    case = case_from(SMALL, "limited")
    return embed(case), formulate(case)


def turned(nlp: Nlp, angle: float) -> np.ndarray:
    """The case's fixed numbers with the task turned about the z axis of the world."""
    turn = turn_about([0, 0, 1], angle)
    p, at = np.array(nlp.arguments), nlp.program.places.twists[0].start
    p[at : at + 3], p[at + 3 : at + 6] = turn @ p[at : at + 3], turn @ p[at + 3 : at + 6]
    return p


def track(c: Embedded, nlp: Nlp, width: float, ticks: int) -> tuple[Counter[int], float, float]:
    """Statuses while the task turns and the bounds are narrowed around the last answer, x's way, its longest step."""
    best, statuses = c.solve(), Counter[int]()
    assert best.status == OK
    ranges = nlp.upper - nlp.lower
    x, room, longest = best.x, width * ranges, 0.0
    for tick in range(ticks):
        lower, upper = np.maximum(nlp.lower, x - room), np.minimum(nlp.upper, x + room)
        solved = c.solve(p=turned(nlp, 1e-4 * tick), x0=x, seeds=0, lower=lower, upper=upper)
        statuses[solved.status] += 1
        assert np.all((lower <= solved.x) & (solved.x <= upper))
        longest = max(longest, float(np.max(np.abs(solved.x - x) / ranges)))
        x = solved.x
    return statuses, float(np.max(np.abs(x - best.x) / ranges)), longest


@pytest.mark.parametrize("name", ["paper-4.1-helical", "paper-4.3", "limited"])
def test_narrowed_bounds_give_no_false_status(name: str, embedded: EmbeddedCase, limited: tuple[Embedded, Nlp]) -> None:
    c, nlp = limited if name == "limited" else shipped(embedded, name)
    way = track(c, nlp, 1.0, 60)[1]
    for width in WIDTHS:
        statuses, gone, _ = track(c, nlp, width, 60)
        assert statuses == {OK: 60}, f"within {width}: {statuses}"
        # x follows the optimum as fast as the bounds allow.
        assert gone <= 60 * width * (1 + 1e-6) + 1e-15
        assert gone >= 0.3 * min(60 * width, way) - 1e-12


def test_tracking_follows_an_optimum_without_a_jump(embedded: EmbeddedCase) -> None:
    statuses, _, longest = track(embedded("paper-4.3"), formulate(load_case("paper-4.3")), 1.0, 2000)
    assert statuses == {OK: 2000}
    assert longest < 0.005


@pytest.mark.slow
def test_narrowed_bounds_give_no_false_status_with_many_limits(embedded: EmbeddedCase) -> None:
    c, nlp = shipped(embedded, "hexapod-machining")
    for width in WIDTHS:
        assert track(c, nlp, width, 1000)[0] == {OK: 1000}


def test_a_budget_of_iterations_gives_the_best_feasible_point_so_far(limited: tuple[Embedded, Nlp]) -> None:
    c, nlp = limited
    feasible = c.solve(maximise=0).x
    first = float(nlp.evaluate(feasible)[0])
    whole = c.solve(x0=feasible, seeds=0)
    assert whole.status == OK
    last = first
    for budget in range(1, whole.iterations):
        solved = c.solve(x0=feasible, seeds=0, max_iterations=budget)
        assert (solved.status, solved.iterations) == (BUDGET, budget)
        assert solved.violation <= FEASIBLE
        assert last - 1e-9 * abs(last) <= solved.F
        last = solved.F
    assert c.solve(x0=feasible, seeds=0, max_iterations=whole.iterations).status == OK
    # Searches that the budget leaves no time for are searches that were asked for.
    cut = c.solve(x0=feasible, seeds=3, max_iterations=whole.iterations)
    assert (cut.status, cut.converged, cut.F) == (BUDGET, 1, whole.F)
    assert c.solve(x0=feasible, max_iterations=-1).status == BAD_INPUT


def test_a_deadline_ends_the_solve_within_one_evaluation(limited: tuple[Embedded, Nlp]) -> None:
    c, nlp = limited
    feasible = c.solve(maximise=0).x
    asked = 0

    def over() -> bool:
        nonlocal asked
        asked += 1
        return asked > allowed

    last = float(nlp.evaluate(feasible)[0])
    for allowed in (0, 1, 2, 4, 8):
        asked = 0
        solved = c.solve(x0=feasible, seeds=8, deadline=over)
        assert solved.status == BUDGET
        assert asked == allowed + 1
        assert solved.violation <= FEASIBLE
        assert last * (1 - 1e-9) <= solved.F
        last = solved.F
        if allowed == 0:
            assert np.max(np.abs(solved.x - feasible)) <= 1e-12 * np.max(np.abs(feasible))
    assert c.solve(x0=feasible, seeds=0, deadline=lambda: False).status == OK


def test_infeasible_problems_end_as_soon_as_feasible_ones(limited: tuple[Embedded, Nlp]) -> None:
    c, nlp = limited
    lower, upper = (np.nan_to_num(each, neginf=-1e300, posinf=1e300) for each in (nlp.g_lower, nlp.g_upper))
    legs = [j for j, each in enumerate(nlp.program.constraints) if each.name.startswith("leg_length")]
    short, long = upper.copy(), lower.copy()
    short[legs], long[legs] = 300.0**2, 1500.0**2
    impossible = [{"g_lower": np.minimum(lower, short), "g_upper": short}]
    impossible.append({"g_lower": long, "g_upper": np.maximum(upper, long)})
    starts = starting_points(nlp, 61, 3)[1:]
    usual = [c.solve(x0=x, seeds=0) for x in starts]
    assert {each.status for each in usual} == {OK}
    mean = np.mean([each.iterations for each in usual])
    for bounds in impossible:
        ended = [c.solve(x0=x, seeds=0, **bounds) for x in starts]
        assert {each.status for each in ended} == {INFEASIBLE}
        assert np.mean([each.iterations for each in ended]) <= 3 * mean
        # The violations at which the searches end differ by the local minima of the violation only.
        assert min(each.violation for each in ended) > 1e-3


def test_searches_for_the_least_f_end_near_zero_too(embedded: EmbeddedCase) -> None:
    c, nlp = shipped(embedded, "paper-4.3")
    generator, at = np.random.default_rng(8), nlp.program.places.twists[0].start
    statuses: Counter[int] = Counter()
    small = 0
    for x in starting_points(nlp, 2001, 9)[1:]:
        axis, point, p = generator.normal(size=3), generator.uniform(-10, 10, 3), np.array(nlp.arguments)
        axis /= np.linalg.norm(axis)
        p[at : at + 3] = axis
        p[at + 3 : at + 6] = np.cross(point, axis) + generator.choice([0.0, generator.uniform(-5, 5)]) * axis
        solved = c.solve(p=p, x0=x, seeds=0, maximise=0)
        statuses[solved.status] += 1
        small += solved.F < 1e-6
    assert statuses[OK] >= 1999
    assert small > 100


def test_multipliers_say_what_a_bound_costs(limited: tuple[Embedded, Nlp]) -> None:
    c, nlp = limited
    lower, upper = (np.nan_to_num(each, neginf=-1e300, posinf=1e300) for each in (nlp.g_lower, nlp.g_upper))
    sides = {"lower": np.array(nlp.lower), "upper": np.array(nlp.upper), "g_lower": lower, "g_upper": upper}
    for maximise in (0, 1):
        best = c.solve(maximise=maximise)
        assert best.status == OK
        active = 0
        for name, bounds in sides.items():
            multipliers = getattr(best, f"{name}_multipliers")
            assert np.all(multipliers >= 0)
            for index in np.flatnonzero(multipliers):
                moved, step = bounds.copy(), 1e-5 * max(1e-2, abs(bounds[index]))
                moved[index] += step if name.endswith("upper") else -step
                wider = c.solve(maximise=maximise, x0=best.x, seeds=0, **{name: moved})
                gain = (wider.F - best.F) * (1 if maximise else -1) / step
                assert gain == pytest.approx(multipliers[index], rel=2e-2, abs=1e-6 * abs(best.F) / step)
                active += 1
        assert active >= 4
    cut = c.solve(max_iterations=1)
    assert not np.any(cut.g_upper_multipliers)


def test_refused_input_leaves_the_last_answer_and_every_status_has_words(embedded: EmbeddedCase) -> None:
    c, nlp = shipped(embedded, "paper-4.1-helical")
    bad = c.solve(p=np.full(nlp.arguments.size, math.nan))
    assert (bad.status, bad.F) == (BAD_INPUT, -7)
    assert np.all(bad.x == -7)
    words = c._library[f"{c.prefix}_status_text"]
    words.restype = ctypes.c_char_p
    texts = [words(status).decode() for status in range(-1, 8)]
    assert len(set(texts)) == 8
    assert texts[0] == texts[-1]
    assert all(text and not text.endswith(".") for text in texts)


@pytest.mark.skipif(not COMPILERS, reason="no C compiler is installed")
def test_flags_that_break_the_verdict_do_not_compile(tmp_path: Path) -> None:
    (solver,) = (path.name for path in written("paper-4.2-rotation", tmp_path).glob("*-solver.c"))
    for compiler in COMPILERS:
        for flag in ("-ffast-math", "-Ofast", "-ffinite-math-only", "-O2"):
            command = [compiler, flag, "-fsyntax-only", solver]
            done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
            assert (done.returncode == 0) == (flag == "-O2"), (command, done.stderr)
            assert ("needs IEEE arithmetic" in done.stderr) == (flag != "-O2")


def test_no_function_calls_itself_or_a_later_one() -> None:
    files = generate_c(load_case("paper-4.3"), "")
    order = ("-qp.c", "-step.c", "-sqp.c", "-restore.c", "-scaled.c", "-solver.c")
    found: list[str] = []
    for end in order:
        (text,) = (text for name, text in files.items() if name.endswith(end))
        parts = re.split(r"^(?:static )?(?:inline )?(?:const )?\w+ \*?(\w+)\([^;{]*?\) \{$", text, flags=re.MULTILINE)
        bodies = dict(zip(parts[1::2], parts[2::2], strict=True))
        own = list(bodies)
        assert len(own) >= 5
        for place, (name, body) in enumerate(bodies.items()):
            called = set(re.findall(r"(?<![>.\w])(\w+)\(", body.split("\n}")[0]))
            assert not called & set(own[place:]), (end, name)
            # Of the other files, only the earlier ones.
            later = {each for each in called if re.match("screwsynth.*_(S?QP|SCALED)", each)} - set(own) - set(found)
            assert all(
                each.endswith(("_limits", "_derivatives", "_curvature", "_curvature_again")) for each in later
            ), (end, later)
        found += own
