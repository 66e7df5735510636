"""The header's worst case of a solve: counted over random and adversarial problems, never exceeded."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from builders import starter

from screwsynth.nlp import load_case, shipped_cases
from screwsynth.nlp.embedding import worstcase

Embedded = Any

#: Counts the calls of the program's functions by ``--wrap`` of the linker, over problems that are random in everything:
#: fixed numbers, bounds from none to equal, impossible constraints, senses, seeds, budgets and deadlines.
DRIVER = """#include "ID.h"
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
WRAPPED
static uint64_t state = 12345;
static double uniform(void) {
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return (double)(state >> 11) / 9007199254740992.0;
}
static int left;
static int late(void *user) {
    (void)user;
    return left-- <= 0;
}
static double work[BIG_SOLVERWORK], p[BIG_P], x0[BIG_N + 1], g_lower[BIG_C + 1], g_upper[BIG_C + 1];
static int iwork[BIG_SOLVERIWORK];
static ID_bounds bounds;
static ID_result result;
int main(void) {
    static const double steps[] = {0.0, 1e-6, 1e-2, 0.3, 3.0}, widths[] = {1.0, 1.0, 0.1, 1e-5, 1e-9, 0.0};
    double closest[4] = {0};
    long again = 0;
    int trial, i, seen[7] = {0};
    for (trial = 0; trial < TRIALS; ++trial) {
        ID_problem problem;
        const double step = steps[(int)(5 * uniform())], width = widths[(int)(6 * uniform())];
        const double tight = uniform() < 0.5 ? 0.0 : pow(10.0, 4.0 * uniform() - 3.0);
        int searches, iterations, status, k;
        long most[4];
        ID_defaults(&problem);
        ID_reset(&bounds);
        for (i = 0; i < BIG_P; ++i)
            p[i] = ID_parameter_defaults[i] +
                   step * (2.0 * uniform() - 1.0) * (i < BIG_TWIST ? ID_parameter_defaults[i] : 1.0);
        for (i = 0; i < BIG_N; ++i) {
            const double low = problem.lower[i], high = problem.upper[i], half = 0.5 * (high - low);
            x0[i] = low + 2.0 * half * uniform();
            bounds.lower[i] = fmax(low, x0[i] - width * half);
            bounds.upper[i] = fmin(high, x0[i] + width * half);
        }
        for (i = 0; i < BIG_C; ++i) { /* tight: constraints that contradict each other or cannot be fulfilled */
            const double size = fabs(bounds.g_lower[i]) < 1e300 ? fabs(bounds.g_lower[i]) : fabs(bounds.g_upper[i]);
            const double off = tight * (size + 1e-3) * (2.0 * uniform() - 1.0);
            const double low = bounds.g_lower[i], high = bounds.g_upper[i];
            g_lower[i] = fabs(low) < 1e300 ? low + off : low;
            g_upper[i] = fabs(high) < 1e300 ? fmax(g_lower[i], high + off) : high;
        }
        problem.p = p, problem.x0 = uniform() < 0.8 ? x0 : 0;
        problem.lower = bounds.lower, problem.upper = bounds.upper;
        problem.g_lower = g_lower, problem.g_upper = g_upper;
        problem.maximise = uniform() < 0.5;
        problem.seeds = uniform() < 0.5 ? (problem.x0 == 0) : (problem.x0 == 0) + (int)(16 * uniform());
        problem.options.max_iterations = uniform() < 0.5 ? 0 : 1 + (int)(40 * uniform());
        problem.options.deadline = uniform() < 0.2 ? late : 0;
        left = (int)(60 * uniform());
        searches = problem.seeds + (problem.x0 != 0);
        iterations = BIG_MOST_ITERATIONS(searches);
        if (problem.options.max_iterations && problem.options.max_iterations < iterations)
            iterations = problem.options.max_iterations;
        most[0] = BIG_MOST_DERIVATIVES(searches, iterations);
        most[1] = BIG_MOST_CURVATURES(iterations);
        most[2] = BIG_MOST_MAGNITUDES(searches);
        most[3] = BIG_MOST_PROGRAMS(iterations);
        memset(counts, 0, sizeof counts);
        memset(&result, 0, sizeof result);
        status = (int)ID_solve(&problem, &result, work, iwork);
        ++seen[status];
        if (width > 0.0) again += repeats; /* else all searches begin at one point */
        repeats = 0;
        if (result.iterations > iterations) return printf("%d of %d iterations\\n", result.iterations, iterations), 1;
        for (k = 0; k < 4; ++k) {
            if (counts[k] > most[k]) return printf("count %d: %ld of %ld\\n", k, counts[k], most[k]), 1;
            closest[k] = fmax(closest[k], (double)counts[k] / (double)most[k]);
        }
    }
    printf("%d %d %d %d %d, ", seen[0], seen[1], seen[2], seen[3], seen[4]);
    printf("%g %g %g %g %ld\\n", closest[0], closest[1], closest[2], closest[3], again);
    return 0;
}
"""
#: Functions that are counted, as they are called from another source: with their parameters, and those alone.
_THREE = ("const double **arg, double **res, double *work", "arg, res, work")
_CASADI = ("const double **arg, double **res, int *iw, double *w, int mem", "arg, res, iw, w, mem")
_PROGRAM = ("const void *q, double *d, double *u, double *work, int *iwork", "q, d, u, work, iwork")


#: Counts first derivatives at the point of the call before.
_COMPARED = "    repeats += !memcmp(arg[0], last, sizeof last);\n    memcpy(last, arg[0], sizeof last);\n"


def count(embedded: Embedded, folder: Path, trials: int, iterations: int | None) -> list[float]:
    """Numbers of solves by status, the largest part of each bound that was needed, and first derivatives in vain."""
    name, has_loops = embedded.prefix, (embedded.folder / f"{embedded.prefix}-loops.c").exists()
    program = ("SQP", *_THREE) if has_loops else ("CASADI", *_CASADI)
    counted = [(0, f"{program[0]}_derivatives", *program[1:]), (1, f"{program[0]}_curvature", *program[1:])]
    counted += [(1, "SQP_curvature_again", *_THREE)] if has_loops else []
    counted += [(2, "CASADI_magnitude", *_CASADI), (3, "QP", *_PROGRAM)]
    wrapped = "static long counts[4], repeats;\nstatic double last[BIG_N];\n" + "".join(
        f"int __real_{name}_{function}({types});\nint __wrap_{name}_{function}({types});\n"
        f"int __wrap_{name}_{function}({types}) {{\n    ++counts[{k}];\n{'' if k else _COMPARED}"
        f"    return __real_{name}_{function}({given});\n}}\n"
        for k, function, types, given in counted
    )
    text = DRIVER.replace("WRAPPED", wrapped).replace("TRIALS", str(trials))
    text = text.replace("BIG", name.upper()).replace("ID_", f"{name}_").replace('"ID.h"', f'"{name}.h"')
    (folder / "driver.c").write_text(text, encoding="utf-8")
    changed = [] if iterations is None else [f"-D{name.upper()}_ITERATIONS={iterations}"]
    solver = embedded.folder / f"{name}-solver.c"
    objects = [str(path) for path in sorted(embedded.folder.glob(f"{name}*.o")) if path.stem != solver.stem]
    words = ["-O1", *changed, f"-I{embedded.folder}", "driver.c", str(solver), *objects]
    links = [f"-Wl,--wrap={name}_{function}" for _, function, _, _ in counted]
    subprocess.run(["gcc", *words, *links, "-lm", "-o", "driver"], cwd=folder, check=True)
    done = subprocess.run(["./driver"], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    return [float(each) for each in re.findall(r"[\d.e+-]+", done.stdout)]


@pytest.mark.parametrize(
    ("name", "trials"), [("paper-4.1-helical", 1000), ("camera-mount", 240), ("planar-3-rrr", 240)]
)
def test_no_solve_needs_more_than_the_header_says(
    name: str,
    trials: int,
    tmp_path: Path,
    embedded: Callable[[str], Embedded],
    embed: Callable[..., Embedded],
) -> None:
    c = embedded(name) if name in shipped_cases() else embed(starter(name), "-O1")
    for iterations in (None, 4):
        ok, _, infeasible, _, cut, *closest, repeats = count(
            c, tmp_path, trials if iterations is None else trials // 2, iterations
        )
        # Every kind of end is among them, and with few iterations the bounds of what comes once in a search are near.
        assert min(infeasible, cut) > 0
        assert ok > 0 or iterations is not None
        assert repeats == 0
        assert closest[1] >= 0.3
        assert closest[3] >= 0.5
        assert all(0.0 < part <= 1.0 for part in closest)


def test_a_search_has_no_more_first_derivatives_than_its_share(
    tmp_path: Path, embed: Callable[..., Embedded], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a share so small that searches end by it, what they need comes near to the bound and never exceeds it."""
    monkeypatch.setattr(worstcase, "_DERIVATIVES", 1)
    monkeypatch.setattr(worstcase, "_TRIALS", 3)
    case = replace(load_case("paper-4.1-helical"), name="small-share")
    ok, stopped, _, _, _, *closest, _ = count(embed(case, "-O1"), tmp_path, 1000, None)
    assert min(ok, stopped) > 0
    assert 0.65 <= closest[0] <= 1.0
