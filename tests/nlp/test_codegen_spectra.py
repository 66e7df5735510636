"""Limits on singular values in generated C: small, exact, and held where the solver ends."""

from __future__ import annotations

import shutil
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from builders import case_from
from generated import COMPILERS, STRICT, assert_only_mathematics_is_needed, made, needs_compiler, written

from screwsynth.nlp import formulate, solve
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.program.sampling import starting_points

Embedded = Any


SPECTRA = """
[robot]
model = "stewart-gough"
layout = "octahedral"
[robot.parameters]
x1 = { min = 20, max = 32 }
x2 = { min = 8, max = 15 }
x3 = { min = 0, max = 20 }
x4 = { min = 0, max = 25 }
[pose]
position = [{ min = -6, max = 6 }, { min = -6, max = 6 }, { min = 16, max = 26 }]
rotation = { angle = { min = -15, max = 15 } }
[[task]]
sense = "max"
axis = [1, 2, 6]
point = [3, 1, 12]
pitch = 0.1
[limits]
leg_length = { min = 24, max = 34 }
condition_number = { max = 6, length = 10 }
smallest_singular_value = { min = 0.2, length = 7 }
[solve]
starts = 4
"""


@needs_compiler
def test_singular_values_without_a_loop_over_legs_compile_without_warnings(tmp_path: Path) -> None:
    tables = tomllib.loads(find_case("paper-4.1-helical").read_text(encoding="utf-8")) | {
        "limits": {"condition_number": {"max": 300, "length": 10}}
    }
    written(case_from(tables, "alone"), tmp_path)
    for compiler in COMPILERS:
        command = [compiler, *STRICT.split(), "-O2", "-fsyntax-only", str(tmp_path / "screwsynth_alone-loops.c")]
        assert subprocess.run(command, capture_output=True, text=True, check=True).stderr == ""


@needs_compiler
def test_limits_on_singular_values_are_small_and_exact(embed: Callable[..., Embedded], tmp_path: Path) -> None:
    case = case_from(SPECTRA, "spectra")
    c, nlp = embed(case), formulate(case)
    where = Path(shutil.copytree(c.folder, tmp_path / "c"))
    assert sum(path.stat().st_size for path in where.glob(f"{c.prefix}*.[ch]*")) <= 400_000
    assert "0 failed" in made(where, f"CFLAGS={STRICT} -O2 -fPIC", "test")
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
    case = case_from(SPECTRA, "spectra")
    solved, wanted = embed(case).solve(), solve(case)
    assert solved.status == 0
    assert abs(solved.F - wanted.F) <= 1e-6 * wanted.F
