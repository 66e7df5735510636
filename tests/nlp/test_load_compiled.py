"""Generated C in Python: the numbers and the verdicts of the C, many problems in one call, refusals in a sentence."""

from __future__ import annotations

import json
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from generated import BAD_INPUT, COMPILERS, OK, written

from screwsynth.nlp import CompiledCase, InputError, formulate, load_case, load_compiled
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
            # The solver leaves a result as it was; a row of the batch has no earlier one.
            assert all((np.array(each[k]) == 0).all() for each in found._replace(status=found.F))
            continue
        for name in ("F", "angle", "violation", "residual", "runs", "converged", "iterations"):
            assert getattr(found, name)[k] == getattr(one, name), name
        assert (found.x[k] == one.x).all()
        assert (found.R[k].ravel() == one.R).all()
        assert (found.axis[k] == one.axis).all()
    assert {OK, BAD_INPUT} <= statuses
    assert (found.ok == (found.status == OK)).all()
    names = ("OK", "NOT_CONVERGED", "INFEASIBLE", "BAD_INPUT", "BUDGET", "OTHER_ASSEMBLY", "RANGE_END")
    assert compiled.statuses == names


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
    x0, p = problems(4)
    spoilt = x0.copy()
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
        ({"limits": {"angle.max": [[0.1]]}}, "must be a number or one for each problem"),
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
        ({"deadline_seconds": [[1.0]]}, r"got \(1, 1\)"),
        ({"max_iterations": [1, 2], "deadline_seconds": [1.0]}, "max_iterations has 2, deadline_seconds has 1"),
    ]
    for arguments, match in wrong:
        with pytest.raises(InputError, match=match) as error:
            compiled.solve(**arguments)
        assert "\n" not in str(error.value)


def test_a_pickle_has_the_folder_alone(compiled: CompiledCase, folder: Path) -> None:
    text = pickle.dumps(compiled)
    assert str(folder).encode() in text
    assert len(text) < 500
    again = pickle.loads(text)  # noqa: S301 - made above
    assert (again.solve().x == compiled.solve().x).all()


def test_other_folders_are_refused_in_a_sentence(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    manifest = json.loads((copy / "manifest.json").read_text(encoding="utf-8"))
    (source,) = copy.glob("*-sqp.c")

    def refused(match: str, where: Path = copy) -> None:
        with pytest.raises(InputError, match=match) as error:
            load_compiled(where)
        assert "\n" not in str(error.value)

    refused("is no folder", tmp_path / "nowhere")
    refused("is no folder", tmp_path)
    for text in ("", "[]", "{}", '{"schema": 1}', json.dumps(manifest | {"variables": [1]})):
        (copy / "manifest.json").write_text(text, encoding="utf-8")
        refused("is not as")
    (copy / "manifest.json").write_text(json.dumps(manifest | {"schema": 99}), encoding="utf-8")
    refused("schema = 99: this screwsynth reads folders of generated C of schema 1")
    (copy / "manifest.json").write_text(json.dumps(manifest | {"sources": ["../x.c"]}), encoding="utf-8")
    refused("is not as")
    (copy / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    for compiler in ("no-such-compiler", "false"):
        with monkeypatch.context() as patch:
            patch.setenv("CC", compiler)
            refused("compiler")
    source.rename(copy / "elsewhere")
    refused(r"-sqp\.c cannot be read")


def test_the_manifest_says_what_the_folder_holds(folder: Path) -> None:
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert set(manifest["files"]) == {path.name for path in folder.iterdir()}
    header = (folder / f"{manifest['prefix']}.h").read_text(encoding="utf-8")
    assert all(f"SCREWSYNTH_{each['name']}" in header for each in manifest["statuses"])
    assert [each["code"] for each in manifest["statuses"]] == list(range(len(manifest["statuses"])))
    assert all(each["c_name"] in header for each in manifest["limits"])
    (task,) = manifest["tasks"]
    assert [each["default"] for each in manifest["parameters"]][-6:] == task["twist"]


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
