"""C for several tasks, several poses and singular values: exact, or refused by name."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Run, case_from, refusal_of, saved, soaked
from generated import COMPILERS, STRICT, assert_only_mathematics_is_needed, made, needs_compiler, written

from screwsynth.nlp import Case, ConditionNumber, Limits, Nlp, RateShare, formulate, load_case, solve
from screwsynth.nlp.embedding.loops import find_loops
from screwsynth.nlp.embedding.subject import find_subject
from screwsynth.nlp.program.sampling import starting_points

Embedded = Any

ROBOT = """
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = { min = 20, max = 32 }, x2 = { min = 8, max = 15 }, x3 = { min = 1, max = 20 }, x4 = 10 }
"""
#: A free rotation, a held one, and none.
POSES = """
[[pose]]
position = [{ min = -6, max = 6 }, 1, 22]
rotation = { angle = { min = -15, max = 15 } }
[[pose]]
position = [3, { min = -4, max = 4 }, 24]
rotation = { axis = [1, 2, 0], angle = { min = -10, max = 12 } }
[[pose]]
position = [0, 0, 20]
"""
TURN = '{ name = "turn", sense = "max", axis = [1, 2, 6], point = [3, 1, 12], pitch = 0.1, weight = 0.5 }'
PUSH = '{ name = "push", sense = "min", axis = [0, 1, 1], point = [0, 1, 2], pitch = 2.0, weight = 1.5 }'
TASKS, ONE = f"task = [{TURN}, {PUSH}]", f"task = [{TURN}]"
MANY = """
[limits]
leg_length = { min = 5, max = 60 }
base_joint_angle = 80
platform_joint_angle = { max = 80, about = "home" }
home = { position = [0, 0, 22], axis = [0, 0, 1], angle = 5 }
joint_spacing = { min = 0.5 }
leg_clearance = { min = 4 }
rate_share = { max = 0.9 }
actuator = { stroke_max = 30, dead_length = 1 }
custom = ["x1 - 1.2*x2 >= 0"]
"""
SPECTRA = """
[limits]
condition_number = { max = 50, length = 10 }
smallest_singular_value = { min = 0.01, length = 7 }
"""
UPU = """
[robot]
model = "three-upu"
axes = "free"
[robot.parameters]
base_radius = { min = 40, max = 60 }
platform_radius = 25
u1_1 = [{ min = -1, max = 1 }, { min = -1, max = 1 }, { min = -1, max = 1 }]
u2_1 = [{ min = -1, max = 1 }, { min = -1, max = 1 }, { min = -1, max = 1 }]
u1_2 = [0, 1, 0]
u2_2 = [1, 0, 0.3]
u1_3 = [0, 1, 0.4]
u2_3 = [1, 0, 0]
[[pose]]
position = [0, 0, 50]
[[pose]]
position = [5, { min = 0, max = 10 }, 55]
[limits]
rate_share = { max = 0.99 }
"""


def table(*texts: str) -> Case:
    return case_from("".join(texts) + "[solve]\nstarts = 1\n", "c")


def combine(method: str, over: str) -> str:
    return f'[combine]\nmethod = "{method}"\nover_poses = "{over}"\n'


CASES = {
    "worst of two senses over a mean, all limits": (TASKS, ROBOT, POSES, combine("worst-case", "mean"), MANY),
    "weighted sum over a sum, singular values": (TASKS, ROBOT, POSES, combine("weighted-sum", "sum"), SPECTRA),
    "worst pose": (ONE, ROBOT, POSES, '[combine]\nover_poses = "worst"\n'),
    "couples": (TASKS, UPU, combine("weighted-sum", "mean")),
}


def curvatures(c: Embedded, nlp: Nlp, close: float) -> None:
    """Compare the Hessian of the Lagrangian with multipliers for every constraint."""
    generator = np.random.default_rng(2)
    k, work = np.zeros(c.macro("K") + 1), np.zeros(c.macro("WORK"))
    assert c.call("prepare", np.ascontiguousarray(nlp.arguments), k, work) == 0
    for point in starting_points(nlp, 21, 3)[1:]:
        multipliers, x = generator.normal(size=len(nlp.program.constraints)), np.ascontiguousarray(point)
        wanted = nlp.program.kernels.hessian(x, nlp.arguments, 0.7, multipliers)
        assert np.max(np.abs(c.curvature(x, k, multipliers, work) - wanted)) <= close * np.max(np.abs(wanted))


@pytest.mark.parametrize("name", soaked(CASES, [name for name in CASES if "sum over" not in name]))
def test_the_c_has_the_programs_values_and_its_optimum(name: str, embed: Callable[..., Embedded]) -> None:
    case = table(*CASES[name])
    subject, c = find_subject(case), embed(case, "-O0")
    close = 1e-10 if "singular" in name else 1e-13
    c.compare(subject.nlp, 50, close)
    curvatures(c, subject.nlp, max(close, 1e-12))
    if subject.optimum is not None:
        solved = c.solve()
        assert solved.status == 0
        better = 1 if subject.nlp.sign < 0 else -1
        assert better * (solved.F - subject.optimum) >= -1e-6 * max(1.0, abs(subject.optimum))


def test_f_is_a_loop_beside_other_loops(embed: Callable[..., Embedded]) -> None:
    """No limit of this case takes F, but its limits are loops, and F is many operations."""
    shipped = load_case("hexapod-machining")
    kept = [limit for limit in shipped.limits if not isinstance(limit, RateShare)]
    case = replace(shipped, name="without-rate-share", limits=Limits(*kept))
    assert len(kept) == len(shipped.limits) - 1
    nlp = formulate(case)
    assert find_loops(nlp.program).has_objective
    c = embed(case, "-O0")
    c.compare(nlp, 20, 1e-13)
    curvatures(c, nlp, 1e-12)


@pytest.mark.parametrize("name", ["camera-mount", "flight-simulator"])
def test_a_worst_case_converges_from_wherever_it_starts(name: str, embedded: Callable[[str], Embedded]) -> None:
    # From a feasible point inside of all constraints the level has no curvature at all.
    c, nlp = embedded(name), find_subject(load_case(name)).nlp
    ends = [c.solve(x0=np.ascontiguousarray(x), seeds=0) for x in starting_points(nlp, 301, 5)[1:]]
    assert [each.status for each in ends] == [0] * 300


def test_weights_senses_and_twists_change_at_run_time(embedded: Callable[[str], Embedded]) -> None:
    c, case = embedded("peg-in-hole"), load_case("peg-in-hole")
    places = find_subject(case).nlp.program.places
    turned = replace(case.tasks[0], sense=case.tasks[1].sense, twist=case.tasks[1].twist, weight=0.3)
    other = replace(case, tasks=(turned, replace(case.tasks[1], sense=case.tasks[0].sense, weight=1.7)))
    wanted = find_subject(other)
    solved = c.solve(p=wanted.nlp.arguments, maximise=int(wanted.nlp.sign < 0))
    assert places.weights == wanted.nlp.program.places.weights
    assert solved.status == 0
    assert wanted.optimum is not None
    assert abs(solved.F - wanted.optimum) <= 1e-6 * max(1.0, abs(wanted.optimum))


@pytest.mark.parametrize("name", ["camera-mount", "haptic-device", "flight-simulator", "peg-in-hole"])
def test_shipped_combinations_are_solved_as_python_solves_them(name: str, embedded: Callable[[str], Embedded]) -> None:
    c, wanted = embedded(name), solve(load_case(name))
    own = wanted.combination.combined if wanted.combination is not None else wanted.outcomes[0].own
    solved = c.solve()
    assert solved.status == 0
    assert abs(solved.F - own.F) <= 1e-6 * max(1.0, abs(own.F))


def test_what_is_not_generated_is_refused_by_name(tmp_path: Path, cli: Run) -> None:
    poses = "".join(f"[[pose]]\nposition = [{k}, 0, 22]\n" for k in range(20))
    for text, sentence in (
        (f'{TASKS}{ROBOT}[pose]\nposition = [0, 0, 20]\n[combine]\nmethod = "average"\n', "combine.method"),
        (f"{ONE}{ROBOT}{poses}{MANY}", "4560 constraints on pairs of poses"),
    ):
        case = saved(tmp_path / "case.toml", text)
        refusal_of(cli("codegen", str(case), "--out", str(tmp_path / "made")), sentence)
        assert not (tmp_path / "made").exists()


SPECTRAL = f"""
task = [{TURN.replace(", weight = 0.5", "")}]
solve = {{ starts = 4 }}
{ROBOT.replace("{ min = 1,", "{ min = 0,").replace("x4 = 10", "x4 = { min = 0, max = 25 }")}
[pose]
position = [{{ min = -6, max = 6 }}, {{ min = -6, max = 6 }}, {{ min = 16, max = 26 }}]
rotation = {{ angle = {{ min = -15, max = 15 }} }}
[limits]
leg_length = {{ min = 24, max = 34 }}
condition_number = {{ max = 6, length = 10 }}
smallest_singular_value = {{ min = 0.2, length = 7 }}
"""


@needs_compiler
def test_singular_values_without_a_loop_over_legs_compile_without_warnings(tmp_path: Path) -> None:
    limits = Limits(ConditionNumber(300, 10))
    written(replace(load_case("paper-4.1-helical"), name="alone", limits=limits), tmp_path)
    for compiler in COMPILERS:
        command = [compiler, *STRICT.split(), "-O2", "-fsyntax-only", str(tmp_path / "screwsynth_alone-loops.c")]
        assert subprocess.run(command, capture_output=True, text=True, check=True).stderr == ""


@needs_compiler
def test_limits_on_singular_values_are_small_and_exact(embed: Callable[..., Embedded], tmp_path: Path) -> None:
    case = case_from(SPECTRAL, "spectra")
    c, nlp = embed(case), formulate(case)
    where = Path(shutil.copytree(c.folder, tmp_path / "c"))
    assert sum(path.stat().st_size for path in where.glob(f"{c.prefix}*.[ch]*")) <= 400_000
    assert "0 failed" in made(where, f"CC={COMPILERS[0]}", f"CFLAGS={STRICT} -O2 -fPIC", "test")
    assert_only_mathematics_is_needed(where, c.prefix)
    limits, p = len(nlp.program.constraints), np.ascontiguousarray(nlp.arguments)
    k, work = np.zeros(c.macro("K") + 1), np.zeros(c.macro("WORK"))
    assert c.call("prepare", p, k, work) == 0
    generator = np.random.default_rng(5)
    singular = [j for j, each in enumerate(nlp.program.constraints) if each.spectral is not None]
    assert len(singular) == 2
    for x in starting_points(nlp, 101, 7)[1:]:
        g, dg = np.zeros(limits), np.zeros((limits, nlp.n))
        assert c.call("limits", x, k, g, dg, work) == 0
        _, _, constraint, slopes = nlp.program.kernels.derivatives(x, p)
        np.testing.assert_allclose(g, constraint.ravel(), rtol=1e-10, atol=1e-12)
        for j in range(limits):
            np.testing.assert_allclose(dg[j], slopes[j], rtol=0, atol=1e-10 * max(1e-3, np.abs(slopes[j]).max()))
        multipliers = generator.normal(size=limits) * (np.arange(limits) >= min(singular))
        second = nlp.program.kernels.hessian(x, p, 0.7, multipliers)
        H = c.curvature(x, k, multipliers, work)
        np.testing.assert_allclose(H, second, rtol=0, atol=1e-10 * np.abs(second).max())


@needs_compiler
def test_limits_on_singular_values_hold_where_the_solver_ends(embed: Callable[..., Embedded]) -> None:
    case = case_from(SPECTRAL, "spectra")
    solved, wanted = embed(case).solve(), solve(case)
    assert solved.status == 0
    assert abs(solved.F - wanted.F) <= 1e-6 * wanted.F
