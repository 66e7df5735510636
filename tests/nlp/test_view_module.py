"""The module of a live page, run by Node: its values are those of the program, and its optimum is that of ``solve``."""

import json
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from builders import EACH_KIND, Array, assert_words, soaked
from numpy.typing import ArrayLike
from test_changes import SECTION_4_3, pushed, read, turned

from screwsynth.models import model_names
from screwsynth.nlp import Case, Nlp, load_case, shipped_cases, solve
from screwsynth.nlp.cli.viewed import read_viewed
from screwsynth.nlp.errors import CaseError, EvaluationError, InputError
from screwsynth.nlp.evidence.evaluation import starting_point
from screwsynth.nlp.evidence.loads import loads_at
from screwsynth.nlp.evidence.state import evaluate
from screwsynth.nlp.output import live
from screwsynth.nlp.output.pictures.posture import Linkage
from screwsynth.nlp.view import wasm
from screwsynth.nlp.view.data import arrays_of
from screwsynth.nlp.view.source import ViewSource, view_source
from screwsynth.nlp.view.wasm import compile_module, find_compiler

HARNESS = Path(__file__).parent / "view_values.mjs"
MODULE = Path(live.__file__).parent / "page" / "module.js"
FEW = ("fixture-pins", "hexapod-machining", "paper-4.1-helical", "hexapod-spindle", "flight-simulator")
LIVE = ["pose for each task", *shipped_cases(), *(f"new {name}" for name in model_names())]
needs = [
    pytest.mark.skipif(shutil.which("node") is None, reason="Node is not installed"),
    pytest.mark.skipif(find_compiler() is None, reason="no compiler for WebAssembly is installed"),
]
pytestmark = needs


class Made(NamedTuple):
    """The C of a case's live page, compiled."""

    source: ViewSource
    content: bytes

    @property
    def nlp(self) -> Nlp:
        return self.source.subject.nlp


@cache
def made(name: str) -> Made:
    try:
        source = view_source(case_of(name))
    except CaseError as error:
        pytest.skip(f"no C: {error}")
    return Made(source, compile_module(source.files))


def case_of(name: str) -> Case:
    if name == "pose for each task":
        return read(SECTION_4_3)
    return read_viewed(name[4:], {}).file.case if name.startswith("new ") else load_case(name)


def run(
    folder: Path, given: Made, points: list[dict[str, Any]], *, from_x: bool = False, seeds: int | None = None
) -> dict[str, Any]:
    """What Node computes with the module."""
    shutil.copy(MODULE, folder / "module.mjs")
    (folder / "view.wasm").write_bytes(given.content)
    arrays = arrays_of(given.nlp, given.source.functions)
    told = {"arrays": arrays, "points": points, "from_x": from_x, "seeds": seeds}
    (folder / "given.json").write_text(json.dumps(told))
    node = shutil.which("node")
    assert node is not None
    done = subprocess.run([node, str(HARNESS), str(folder)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


def close(found: list[float | None], expected: ArrayLike, error: float = 1e-12, least: float = 0.0) -> None:
    """Check values against the largest of them, or a least size; what is not finite is so in both."""
    want = np.asarray(expected, dtype=np.float64).ravel()
    values = np.array([np.nan if each is None else each for each in found])
    want = np.where(np.isfinite(want), want, np.nan)
    size = max(float(np.nanmax(np.abs(want), initial=0.0)), least) or 1.0
    np.testing.assert_allclose(values, want, rtol=0, atol=error * size)


def block(found: dict[str, Any], source: ViewSource, name: str) -> list[float | None]:
    first, size = source.functions.blocks[name]
    return list(found["view"][first : first + size])


def check_values(found: dict[str, Any], given: Made, x: Array, p: Array, pose: int) -> None:
    """Check the values of a point with the program's functions, which the C does not come from."""
    nlp = replace(given.nlp, arguments=p)
    kernels, functions = nlp.program.kernels, given.source.functions
    values = kernels.derivatives(x, p)
    close([found["F"]], values.F)
    close(found["g"], values.g) if len(found["g"]) else None
    state = kernels.robot_states[pose](x, p)
    close(block(found, given.source, "rates"), state.rates)
    close(block(found, given.source, "F"), state.F)
    close(block(found, given.source, "rotation"), state.rotation)
    close(block(found, given.source, "position"), state.position)
    start = 0
    for quantity in state.quantities:
        size = quantity.size
        close(block(found, given.source, "quantities")[start : start + size], quantity)
        start += size
    if not functions.closure and not functions.levels and functions.slopes is not None:
        close(found["gradient"], values.gradient)
        natural = nlp.objective_size / max(1.0, float(np.abs(p).max()))
        close(found["slopes"], kernels.argument_derivatives(x, p).gradient, least=natural)
    try:
        here = evaluate(nlp, x, pose)
    except EvaluationError:
        return
    unknowns = x[list(nlp.program.places.unknowns[pose])]
    posture = Linkage(nlp.case.model, state.parameters.ravel(), nlp.case.characteristic_length).posture_at(
        here.rotation, here.position, unknowns
    )
    close(block(found, given.source, "points"), posture.points)
    assert found["rank"] == here.rank
    close(found["singular_values"][: len(here.singular_values)], here.singular_values)
    if "largest" in functions.blocks and not here.is_singular:
        loads = loads_at(nlp, x, here, pose)
        error = 1e-12 / (here.singular_values[-1] / here.singular_values[0]) ** 2
        for end in ("largest", "smallest"):
            forces = [getattr(each, end) for load in loads.loads for each in load.actuators]
            close(block(found, given.source, end), forces, error)
        close(block(found, given.source, "speeds"), [each.value for each in loads.speeds], error)


@pytest.mark.parametrize("name", soaked(LIVE, [*FEW, "pose for each task", "new 6-ups"]))
def test_values_are_those_of_the_program(name: str, tmp_path: Path) -> None:
    given = made(name)
    nlp, count = given.nlp, 100
    rng = np.random.default_rng(1)
    x = nlp.lower + (nlp.upper - nlp.lower) * rng.random((count, nlp.n))
    p = nlp.arguments * (1 + 1e-3 * rng.standard_normal((count, len(nlp.arguments))))
    poses = rng.integers(0, len(nlp.program.robots), count)
    points = [{"x": a.tolist(), "p": b.tolist(), "pose": int(k)} for a, b, k in zip(x, p, poses, strict=True)]
    found = run(tmp_path, given, points)["points"]
    for k, each in enumerate(found):
        check_values(each, given, x[k], p[k], int(poses[k]))


def test_every_task_has_its_robot(tmp_path: Path) -> None:
    """The robot of each task depends on the setting of this task only: closed forms."""
    given = made("fixture-pins")
    nlp = given.nlp
    assert given.source.functions.blocks["F"][1] == 1
    names = [each.name for each in nlp.program.variables]
    x = np.array(nlp.start)
    x[names.index("x1.task1")], x[names.index("x1.task2")] = 6.5, 11.0
    points = [{"x": x.tolist(), "p": nlp.arguments.tolist(), "pose": pose} for pose in (0, 1)]
    found = [block(each, given.source, "F") for each in run(tmp_path, given, points)["points"]]
    (push,), (turn,) = found
    assert push == pytest.approx(float(pushed(6.5)), rel=1e-12)
    assert turn == pytest.approx(float(turned(11.0)), rel=1e-12)


def test_legs_are_inside_cones_by_the_angles_of_the_limits(tmp_path: Path) -> None:
    given = made("hexapod-machining")
    nlp = given.nlp
    x = nlp.lower + (nlp.upper - nlp.lower) * np.random.default_rng(2).random(nlp.n)
    point = {"x": x.tolist(), "p": nlp.arguments.tolist(), "pose": 0}
    found = run(tmp_path, given, [point])["points"][0]
    base, platform = np.array(block(found, given.source, "cones"), dtype=float).reshape(2, 6, 6)
    span = platform[:, :3] - base[:, :3]
    span /= np.linalg.norm(span, axis=1, keepdims=True)
    angles = np.arccos([*(span * base[:, 3:]).sum(axis=1), *(-span * platform[:, 3:]).sum(axis=1)])
    readings = given.source.functions.readings
    names = [readings.rows[k].constraint.name for k in readings.known]
    stated = [value for name, value in zip(names, found["readings"], strict=True) if "_joint_angle" in name]
    close(stated, angles, 1e-7)


@pytest.mark.parametrize("name", soaked(LIVE, [*FEW, "pose for each task"]))
def test_optimum_is_that_of_solve(name: str, tmp_path: Path) -> None:
    given = made(name)
    # C has the limits over a workspace or along a path only at the stated poses.
    solution = solve(given.nlp.case.at_stated_poses())
    if not solution.status.is_answer:
        pytest.skip(f"solve ends without an optimum: {solution.status.value}")
    answer = run(tmp_path, given, [], seeds=16)["solved"]
    combination = solution.combination
    own = solution.outcomes[0].own if combination is None else combination.combined
    assert own is not None
    assert answer["F"] == pytest.approx(own.F, rel=1e-6, abs=1e-6 * given.nlp.objective_size)


def closed(nlp: Nlp, x: Array, p: Array, rows: list[int], free: list[int]) -> Array:
    """The point with closed loops: the smallest change of the free variables, each relative to its range."""
    values, x = nlp.program.kernels.derivatives, np.array(x)
    ranges = (nlp.upper - nlp.lower)[free]
    for _ in range(20):
        found = values(x, p)
        g, slopes = np.asarray(found.g).ravel()[rows], np.asarray(found.jacobian)[np.ix_(rows, free)]
        if np.abs(g).max(initial=0.0) < 1e-14:
            break
        x[free] -= ranges * (np.linalg.pinv(slopes * ranges, rcond=1e-9) @ g)
    return x


def worst(nlp: Nlp, x: Array, p: Array) -> float:
    """The objective; for a worst case, the best level that its constraints allow."""
    epigraph = nlp.program.places.epigraph
    if epigraph is None:
        return np.asarray(nlp.program.kernels.derivatives(x, p).F).item()
    # A constraint is its level at x and its slack, in units of the ceiling.
    rows = nlp.program.kernels.derivatives(x, p)
    own = [k for k, each in enumerate(nlp.program.constraints) if any(each is level for level in epigraph.constraints)]
    slack = np.asarray(rows.g).ravel()[own]
    return float(x[epigraph.level] - slack.min() / np.asarray(rows.jacobian)[own[int(slack.argmin())], epigraph.level])


FOLLOWED = ["new delta", "new 3-rps", "new five-bar", "haptic-device"]


@pytest.mark.parametrize(
    "name", soaked([*dict.fromkeys([*(f"new {each}" for each in EACH_KIND), *FOLLOWED])], FOLLOWED)
)
def test_derivatives_follow_closed_loops_and_levels(name: str, tmp_path: Path) -> None:
    """Central differences with the loops closed again, and the level found again, at each point."""
    given = made(name)
    nlp, functions = given.nlp, given.source.functions
    if not (functions.closure or functions.levels):
        pytest.skip("no closed loops, and no level")
    assert functions.slopes is not None
    x, p = starting_point(nlp), np.array(nlp.arguments)
    inner, poses = list(nlp.program.places.inner), list(functions.followers)
    rows = list(functions.closure)
    level = nlp.program.places.epigraph
    if level is None:
        x = closed(nlp, x, p, rows, [*inner, *poses])
    else:
        x = nlp.lower + (nlp.upper - nlp.lower) * np.random.default_rng(3).uniform(0.3, 0.7, nlp.n)
        x[level.level] = worst(nlp, x, p)
    found = run(tmp_path, given, [{"x": x.tolist(), "p": p.tolist(), "pose": 0}])["points"][0]
    followed = {*inner, *([] if level is None else [level.level])}
    largest = max(abs(each) for each in found["gradient"] if each is not None)
    slopes = np.asarray(nlp.program.kernels.derivatives(x, p).jacobian)[rows]
    for i in [k for k in range(nlp.n) if k not in followed]:
        step = 1e-5 * (nlp.upper[i] - nlp.lower[i]) * np.eye(nlp.n)[i]
        free = [*inner, *(each for each in poses if each != i)]
        if found["gradient"][i] is None:  # the loops do not let it move
            ranks = [np.linalg.matrix_rank(slopes[:, own], rtol=1e-9) for own in (free, [*free, i])]
            assert ranks[0] < ranks[1]
            continue
        ends = [worst(nlp, closed(nlp, x + sign * step, p, rows, free), p) for sign in (1, -1)]
        assert found["gradient"][i] == pytest.approx((ends[0] - ends[1]) / (2 * step[i]), rel=1e-4, abs=1e-6 * largest)
    for place in [each for each in nlp.program.places.numbers if each.vector == "p"][:3]:
        i = place.index
        step = 1e-5 * max(1e-2, abs(p[i])) * np.eye(len(p))[i]
        pairs = [(x, p + sign * step) for sign in (1, -1)]
        ends = [worst(nlp, closed(nlp, a, b, rows, [*inner, *poses]), b) for a, b in pairs]
        own = (ends[0] - ends[1]) / (2 * step[i])
        assert found["slopes"][i] == pytest.approx(own, rel=1e-4, abs=1e-6 * max(largest, abs(own)))


def test_modules_are_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = made("paper-4.1-helical")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = compile_module(given.source.files)
    (target,) = (tmp_path / "screwsynth").glob("*.wasm")
    target.write_bytes(b"kept")
    assert compile_module(given.source.files) == b"kept"
    assert first[:4] == b"\0asm"


def test_a_faulty_source_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(InputError) as caught:
        compile_module({"a.c": "int f(void) { return x; }\n"})
    assert_words(str(caught.value), "the compiler for WebAssembly failed", "a.c")
    assert not list((tmp_path / "screwsynth").glob("*"))


def test_without_a_compiler_a_sentence_says_how_to_get_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wasm, "find_compiler", lambda: None)
    with pytest.raises(InputError) as caught:
        compile_module({})
    assert_words(str(caught.value), "screwsynth[view]", "clang", "lld")
