"""The solver in C inside a controller: narrow bounds, budgets, infeasible problems, multipliers, and refused flags."""

import ctypes
import math
import re
import subprocess
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import case_from, turn_about
from generated import BAD_INPUT, BUDGET, COMPILERS, INFEASIBLE, OK, written

from screwsynth.nlp import Case, Nlp, formulate, generate_c, load_case
from screwsynth.nlp.program.sampling import starting_points

FEASIBLE = 1e-9
#: Half widths of the bounds around the last answer, in parts of the case's ranges.
WIDTHS = (1e-3, 1e-5, 1e-8, 1e-10, 1e-12, 0.0)

Embedded = Any
EmbeddedCase = Callable[[str], Embedded]

#: A platform whose legs are limited: the constraints in square millimetres are large numbers with large slopes.
SMALL = """
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = { min = 300, max = 450 }, x2 = { min = 120, max = 200 }, x3 = 8, x4 = 12 }
[pose]
position = [{ min = -150, max = 150 }, { min = -150, max = 150 }, { min = 450, max = 700 }]
rotation = { angle = { min = -15, max = 15 } }
[[task]]
sense = "max"
axis = [3, 1, 4]
point = [30, 10, 200]
pitch = 20
[limits]
leg_length = { min = 500, max = 720 }
radius_ratio = { max = 0.5 }
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
    c, nlp = limited if name == "limited" else (embedded(name), formulate(load_case(name)))
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
    c, nlp = embedded("hexapod-machining"), formulate(load_case("hexapod-machining"))
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
    c, nlp = embedded("paper-4.3"), formulate(load_case("paper-4.3"))
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
    c, nlp = embedded("paper-4.1-helical"), formulate(load_case("paper-4.1-helical"))
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
