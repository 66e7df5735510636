"""Generated C in Python: numbers and verdicts of the C, many problems in one call, refusals, worst-case counts."""

from __future__ import annotations

import json
import pickle
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import saved, starter
from generated import BAD_INPUT, COMPILERS, OK, written

from screwsynth.nlp import CompiledCase, InputError, formulate, load_case, load_compiled, shipped_cases
from screwsynth.nlp.embedding import codegen, worstcase
from screwsynth.nlp.program.sampling import starting_points

NAME = "paper-4.1-helical"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not COMPILERS:
        pytest.skip("no C compiler is installed")
    return written(NAME, tmp_path_factory.mktemp("helical"))


@pytest.fixture(scope="module")
def compiled(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> CompiledCase:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        found = load_compiled(folder)
        # The second time no compiler is run, and none is needed but for its version.
        (library,) = (Path(tmp_path_factory.getbasetemp()) / "cache0" / "screwsynth").glob("*.so")
        made_at = library.stat().st_mtime_ns
        load_compiled(str(folder))
        assert library.stat().st_mtime_ns == made_at
    return found


def problems(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Starts, and fixed numbers with other twists."""
    nlp, generator = formulate(load_case(NAME)), np.random.default_rng(4)
    p = np.tile(nlp.arguments, (count, 1))
    (twist,) = nlp.program.places.twists
    p[:, twist] += 0.3 * generator.normal(size=(count, 6))
    return np.array(starting_points(nlp, count, 3)), p


def test_answers_are_those_of_the_c(compiled: CompiledCase, embedded: Callable[[str], Any]) -> None:
    c, (x0, p) = embedded(NAME), problems(40)
    x0[7] = 1e308
    p[9] = 1e200
    found = compiled.solve(x0, p, seeds=1, threads=3)
    statuses = set()
    for k in range(40):
        one = c.solve(x0=x0[k], p=p[k], seeds=1)
        statuses.add(one.status)
        assert found.status[k] == one.status
        if one.status == BAD_INPUT:
            assert all((np.array(each[k]) == 0).all() for each in found._replace(status=found.F))
            continue
        for name in ("F", "angle", "violation", "residual", "runs", "converged", "iterations"):
            assert getattr(found, name)[k] == getattr(one, name), name
        assert (found.x[k] == one.x).all()
        assert (found.R[k].ravel() == one.R).all()
        assert (found.axis[k] == one.axis).all()
    assert {OK, BAD_INPUT} <= statuses
    assert (found.ok == (found.status == OK)).all()
    names = "OK NOT_CONVERGED INFEASIBLE BAD_INPUT BUDGET OTHER_ASSEMBLY RANGE_END"
    assert compiled.statuses == tuple(names.split())


def test_rows_do_not_depend_on_threads_or_company(compiled: CompiledCase) -> None:
    x0, p = problems(150)
    alone, together = (compiled.solve(x0, p, seeds=0, threads=threads) for threads in (1, 4))
    for one, other in zip(alone, together, strict=True):
        assert (one == other).all()
    part = compiled.solve(x0[100:103], p[100:103], seeds=0)
    assert (part.x == alone.x[100:103]).all()
    shared = compiled.solve(x0[:5], p[3], seeds=0)
    assert shared.F[3] == alone.F[3]
    assert compiled.solve(np.zeros((0, 6)), seeds=0).x.shape == (0, 6)


def test_the_case_is_what_nothing_else_is_said_of(compiled: CompiledCase) -> None:
    nlp = formulate(load_case(NAME))
    assert [each.name for each in compiled.variables] == [each.name for each in nlp.program.variables]
    assert [each.default for each in compiled.parameters] == nlp.arguments.tolist()
    assert [each.lower for each in compiled.variables] == nlp.lower.tolist()
    assert (compiled.name, compiled.limits[0].key, compiled.limits[0].unit) == (NAME, "angle.max", "rad")
    found = compiled.solve()
    assert found.status.tolist() == [OK]
    assert found.F[0] == pytest.approx(407.2106717, rel=1e-9)
    assert found.x.shape == (1, 6)
    assert compiled.solve(sense="min").F[0] < found.F[0]


def test_limits_are_in_their_own_units(compiled: CompiledCase) -> None:
    angles = np.array([0.1, 0.2, 0.3])
    found = compiled.solve(limits={"angle.max": angles})
    assert found.ok.all()
    assert (np.diff(found.F) > 0).all()
    assert found.angle == pytest.approx(angles, abs=1e-7)
    assert compiled.solve(limits={"angle.max": 0.1}).F[0] == found.F[0]
    lower, upper = (np.array([getattr(each, side) for each in compiled.variables]) for side in ("lower", "upper"))
    lower[2] = upper[2] = 33.0
    held = compiled.solve(lower=lower, upper=upper)
    assert held.x[0, 2] == 33.0
    lower[2] = 34.0
    assert compiled.solve(lower=lower, upper=upper).status.tolist() == [BAD_INPUT]


def test_wrong_arguments_are_refused_in_a_sentence(compiled: CompiledCase) -> None:
    (x0, p), (spoilt, _) = problems(4), problems(4)
    spoilt[2, 1] = np.nan
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"x0": x0[:, :5]}, r"x0: must have the shape \(6,\) or \(n, 6\), got \(4, 5\)"),
        ({"x0": x0[None]}, r"got \(1, 4, 6\)"),
        ({"p": 3.0}, r"p: must have the shape \(11,\)"),
        ({"x0": spoilt}, r"x0\[2, 1\] = nan: must be finite"),
        ({"lower": np.full(6, -np.inf)}, r"lower\[0\] = -inf"),
        ({"x0": [["a"] * 6]}, "x0: must be an array of numbers"),
        ({"x0": [["1"] * 6]}, "x0: must be an array of numbers"),
        ({"x0": np.array([1, 2, 3, 4, 5, "6"], dtype=object)}, "x0: must be an array of numbers"),
        ({"p": np.full(11, 1 + 0j)}, "p: must be an array of numbers"),
        ({"limits": {"angle.max": "0.1"}}, "must be an array of numbers"),
        ({"max_iterations": 3 + 0j}, "must be an array of numbers"),
        ({"x0": x0, "p": p[:3]}, "x0 has 4, p has 3"),
        ({"x0": x0, "limits": {"angle.max": [0.1, 0.2]}}, "x0 has 4, limits has 2"),
        ({"limits": {"angel.max": 0.1}}, "did you mean 'angle.max'"),
        ({"limits": {"angle.max": -0.1}}, r"limits\['angle.max'\] = -0.1 rad: must be above 0 and at most 3.12"),
        ({"limits": {"angle.max": np.nan}}, "must be finite"),
        ({"limits": {"angle.max": [[0.1]]}}, "must be one number, or one for each problem"),
        ({"seeds": 17}, "from 0 to 16"),
        ({"seeds": True}, "whole number"),
        ({"seeds": 0}, "without x0"),
        ({"threads": 0}, "threads = 0"),
        ({"sense": "most"}, "'max' or 'min'"),
        ({"max_iterations": 0}, "max_iterations = 0: must be a whole number from 1 to 2147483647"),
        ({"max_iterations": 2.5}, "max_iterations = 2.5: must be a whole number"),
        ({"max_iterations": 1e300}, "must be a whole number"),
        ({"deadline_seconds": -1}, "deadline_seconds = -1: must be above 0"),
        ({"deadline_seconds": np.nan}, "deadline_seconds = nan: must be finite"),
        ({"deadline_seconds": [[1.0]]}, r"got shape \(1, 1\)"),
        ({"max_iterations": [1, 2], "deadline_seconds": [1.0]}, "max_iterations has 2, deadline_seconds has 1"),
    ]
    for arguments, match in wrong:
        with pytest.raises(InputError, match=match) as error:
            compiled.solve(**arguments)
        assert "\n" not in str(error.value)


def test_a_pickle_has_the_folder_alone_and_the_manifest_what_it_holds(compiled: CompiledCase, folder: Path) -> None:
    text = pickle.dumps(compiled)
    assert str(folder).encode() in text
    assert len(text) < 500
    again = pickle.loads(text)  # noqa: S301 - made above
    assert (again.solve().x == compiled.solve().x).all()
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert set(manifest["files"]) == {path.name for path in folder.iterdir()}
    header = (folder / f"{manifest['prefix']}.h").read_text(encoding="utf-8")
    assert all(f"SCREWSYNTH_{each['name']}" in header for each in manifest["statuses"])
    assert [each["code"] for each in manifest["statuses"]] == list(range(len(manifest["statuses"])))
    assert all(each["c_name"] in header for each in manifest["limits"])
    (task,) = manifest["tasks"]
    assert [each["default"] for each in manifest["parameters"]][-6:] == task["twist"]


def test_other_folders_are_refused_in_a_sentence(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    manifest = json.loads((copy / "manifest.json").read_text(encoding="utf-8"))
    (source,) = copy.glob("*-sqp.c")

    def refused(match: str, where: Path = copy) -> None:
        with pytest.raises(InputError, match=match) as error:
            load_compiled(where)
        assert "\n" not in str(error.value)

    refused("is not a folder written by", tmp_path / "nowhere")
    refused("is not a folder written by", tmp_path)
    changes: tuple[dict[str, Any], ...] = ({"variables": [1]}, {"sources": ["../x.c"]})
    for text in ("", "[]", "{}", '{"schema": 1}', *(json.dumps(manifest | change) for change in changes)):
        saved(copy / "manifest.json", text)
        refused("does not have the form")
    saved(copy / "manifest.json", json.dumps(manifest | {"schema": 99}))
    refused("schema = 99: this screwsynth reads folders of generated C of schema 1")
    saved(copy / "manifest.json", json.dumps(manifest))
    for compiler in ("no-such-compiler", "false"):
        with monkeypatch.context() as patch:
            patch.setenv("CC", compiler)
            refused("compiler")
    source.rename(copy / "elsewhere")
    refused(r"-sqp\.c cannot be read")


def test_a_budget_ends_each_problem_by_itself(compiled: CompiledCase) -> None:
    x0, p = problems(60)
    whole = compiled.solve(x0, p, seeds=2)
    most = np.where(np.arange(60) % 2, 3, 10_000)
    cut = compiled.solve(x0, p, seeds=2, max_iterations=most, threads=2)
    odd = most == 3
    assert (cut.iterations[odd] == 3).all()
    assert (cut.status[odd] == compiled.statuses.index("BUDGET")).all()
    for name in ("F", "status", "iterations"):
        assert (getattr(cut, name)[~odd] == getattr(whole, name)[~odd]).all()
    assert (compiled.solve(x0, p, seeds=2, max_iterations=3).iterations == 3).all()
    # A nanosecond is over before the second evaluation; a year is not.
    late = compiled.solve(x0, p, seeds=2, deadline_seconds=np.where(odd, 1e-9, 3e7))
    assert (late.status[odd] == compiled.statuses.index("BUDGET")).all()
    assert (late.F[~odd] == whole.F[~odd]).all()
    assert (late.iterations[odd] <= 2).all()
    assert compiled.status_texts[compiled.statuses.index("BUDGET")].startswith("the budget ended the solve")
    assert len(set(compiled.status_texts)) == len(compiled.statuses)


def test_multipliers_are_slopes_of_the_optimum(compiled: CompiledCase, embedded: Callable[[str], Any]) -> None:
    angle, step = 0.3, 1e-4
    found = compiled.solve(limits={"angle.max": angle + step * np.array([-1.0, 0.0, 1.0])})
    (key,) = [each.key for each in compiled.limits]
    assert key == "angle.max"
    assert found.limit_multipliers.shape == (3, 1)
    slope = (found.F[2] - found.F[0]) / (2 * step)
    assert found.limit_multipliers[1, 0] == pytest.approx(slope, rel=1e-5)
    assert slope > 0.1
    c = embedded(NAME).solve()
    own = compiled.solve()
    for name in ("lower", "upper", "g_lower", "g_upper"):
        given = getattr(own, f"{name}_multipliers")[0]
        assert (given == getattr(c, f"{name}_multipliers")).all()
        assert (given >= 0).all()
    assert len(compiled.constraints) == own.g_lower_multipliers.shape[1]
    # Where the point is no optimum, there are none.
    assert not compiled.solve(max_iterations=1).limit_multipliers.any()


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
    name: str, trials: int, tmp_path: Path, embedded: Callable[[str], Embedded], embed: Callable[..., Embedded]
) -> None:
    c = embedded(name) if name in shipped_cases() else embed(starter(name), "-O1")
    for iterations, tried in ((None, trials), (4, trials // 2)):
        ok, _, infeasible, _, cut, *closest, repeats = count(c, tmp_path, tried, iterations)
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
    core = codegen._core_text
    monkeypatch.setattr(
        codegen, "_core_text", lambda *arguments: core(*arguments).replace("#define TRIALS 30", "#define TRIALS 3")
    )
    case = replace(load_case("paper-4.1-helical"), name="small-share")
    ok, stopped, _, _, _, *closest, _ = count(embed(case, "-O1"), tmp_path, 1000, None)
    assert min(ok, stopped) > 0
    assert 0.65 <= closest[0] <= 1.0
