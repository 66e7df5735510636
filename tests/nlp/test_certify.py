"""The search of the whole box: the reference, soundness on random problems, every trap that was met, and its time."""

import json
import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import EACH_KIND, Array, case_from, case_tables, shipped_tables, turn_about
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy_engine import bounding, first_pass, quadratic_models, tangent_bounds
from numpy_engine.bounding import NumpyEngine

from screwsynth.models import Dimension, Model, hexapod, robot_function, stewart_gough
from screwsynth.nlp import Case, Free, Limits, Rotation, Sense, Solution, Task, certify, formulate, load_case, solve
from screwsynth.nlp.case.limits.singular_values import ConditionNumber, SmallestSingularValue
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.kkt import close_equations, linearise
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.interruption import seconds_left
from screwsynth.nlp.program.epigraph import formulate_worst
from screwsynth.nlp.program.nlp import Nlp
from screwsynth.nlp.proof.boxes import optimum
from screwsynth.nlp.proof.boxes.engine import BoxState, Engine, Examination, search_tape
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.statement import standard_form as statement
from screwsynth.nlp.proof.statement.standard_form import Kind, StandardForm, is_in_home_mode, standard_form
from screwsynth.nlp.results.evidence import certificate_data
from screwsynth.nlp.solver import certified
from screwsynth.nlp.solver.certified import proof_of
from screwsynth.nlp.solver.multistart import ProgramSolution, solve_program
from screwsynth.nlp.system.jsonvalues import json_data

AXIS_Z = "paper-4.1-helical-axis-z"


@cache
def solved(name: str, starts: int = 4) -> Solution:
    """The solution of a shipped case, which tests share."""
    return solve(load_case(name), starts=starts)


def upu(sense: str = "max") -> Case:
    """A 3-UPU of the paper with the couple axes of its first limb free."""
    tables = shipped_tables(f"paper-4.4-{sense}")
    for k in (1, 2):
        c, s = math.cos(2 * math.pi * k / 3), math.sin(2 * math.pi * k / 3)
        tables["robot"]["parameters"] |= {f"u1_{k + 1}": [c, s, 0], f"u2_{k + 1}": [-s, c, 0]}
    return case_from(tables, "upu")


def octahedral() -> Case:
    tables = shipped_tables("paper-4.1-helical")
    tables["robot"]["layout"] = "octahedral"
    return case_from(tables, "octahedral")


def random_case(seed: int) -> Case:
    """A random robot, twist, box and sense with 4 to 6 free variables and often an active rotation ball."""
    rng = np.random.default_rng(seed)
    x1, x2 = rng.uniform(6, 15), rng.uniform(4, 10)
    position = [Free(-w, w) for w in rng.uniform(1, 6, 2)] + [Free(25.0, 25 + rng.uniform(3, 15))]
    parameters = {"x1": x1, "x2": x2, "x3": rng.uniform(0.05, 0.5), "x4": rng.uniform(0.05, 0.5)}
    size = rng.uniform(0.05, 0.3)
    kind = rng.integers(3)
    rotation = Rotation(axis=None, angle=Free(-size, size))
    if kind == 0:
        rotation = Rotation(axis=rng.normal(size=3), angle=Free(-size, size))
        parameters["x4"] = Free(0.05, 0.5)
    elif kind == 1:
        position[2] = 30.0
    twist = np.concatenate([rng.normal(size=3), rng.normal(size=3) * rng.choice([1.0, 10.0])])
    task = Task(twist, "max" if rng.random() < 0.5 else "min")  # type: ignore[arg-type]
    layout = "aligned" if rng.random() < 0.5 else "octahedral"
    return Case(stewart_gough(layout=layout), parameters, position, [task], rotation=rotation)  # type: ignore[arg-type]


def random_boxes(nlp: Nlp, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    room = (nlp.upper - nlp.lower)[:, None]
    width = 10.0 ** rng.uniform(-4, 0, size=(nlp.n, count)) * (rng.random((nlp.n, count)) > 0.1)
    low = nlp.lower[:, None] + room * rng.random((nlp.n, count)) * (1 - width)
    return low, np.minimum(low + room * width, nlp.upper[:, None])


@pytest.mark.parametrize(
    "case", [load_case("paper-4.1-helical"), load_case("paper-4.3"), upu()], ids=["4.1", "4.3", "upu"]
)
def test_the_kernel_agrees_with_the_reference_box_by_box(case: Case) -> None:
    nlp = formulate(case)
    form = standard_form(nlp)
    low, high = random_boxes(nlp, 600, 3)
    level = 1.0 if "upu" in case.name else 400.0
    reference, other = (engine.examine(low, high, level) for engine in (NumpyEngine(form), Engine(form, 2)))
    assert (reference.verdict == other.verdict).mean() > 0.995
    same = reference.verdict == other.verdict
    assert np.array_equal(np.isfinite(reference.bound), np.isfinite(other.bound))
    np.testing.assert_allclose(other.bound[same], reference.bound[same], rtol=1e-11, atol=1e-9)
    cuts = (reference.cut_lower == other.cut_lower) & (reference.cut_upper == other.cut_upper)
    agree = same & cuts.all(axis=0)
    assert agree.mean() > 0.99
    opened = agree & (reference.verdict == BoxState.OPEN)
    np.testing.assert_allclose(other.lower[:, opened], reference.lower[:, opened], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.upper[:, opened], reference.upper[:, opened], rtol=1e-9, atol=1e-9)
    assert (reference.split == other.split)[opened].mean() > 0.99


@pytest.mark.parametrize("name", ["paper-4.2-rotation", "paper-4.2-translation"])
def test_one_box_is_enough_for_a_flat_optimum(name: str) -> None:
    solution = solved(name)
    proved = certify_program(solution.nlp, solution.x, claimed=solution.F)
    assert (proved.status, proved.boxes, proved.engine) == (CertificateStatus.PROVED, 1, "c")
    assert proved.gap <= 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "gap", "most"),
    [
        (load_case("paper-4.1-helical"), 1e-6, 60_000),
        (load_case("paper-4.1-rotation"), 1e-4, 60_000),
        (octahedral(), 1e-4, 200_000),
        (load_case("paper-4.3"), 1e-4, 600_000),
        (upu(), 1e-4, 600_000),
        (upu(sense="min"), 1e-4, 60_000),
    ],
    ids=["4.1 finer", "4.1 rotation", "4.1 octahedral", "4.3", "upu", "upu min"],
)
def test_the_kernel_proves(case: Case, gap: float, most: int) -> None:
    solution = solve(case, starts=8)
    proved = certify_program(solution.nlp, solution.x, claimed=solution.F, gap=gap, time_limit=120)
    assert proved.status is CertificateStatus.PROVED
    assert 0 <= proved.gap <= proved.allowed * (1 + 1e-9)
    assert -solution.nlp.sign * (proved.bound - solution.F) >= 0
    assert proved.boxes <= most


@pytest.mark.slow
@given(seed=st.integers(0, 10**6))
@settings(max_examples=12, deadline=None)
def test_no_start_beats_a_certified_bound(seed: int) -> None:
    solution = solve(random_case(seed), starts=48, seed=1)
    proved = certify_program(solution.nlp, solution.x, gap=1e-2, time_limit=60)
    assert proved.status is CertificateStatus.PROVED
    assert -solution.nlp.sign * (proved.bound - solution.F) >= -1e-9 * abs(solution.F)


def forgetful_of_the_ball() -> Callable[..., object]:
    """The reference's monotone rule, for which no row stops a point."""
    whole = NumpyEngine.collapse_monotone

    def careless(self: NumpyEngine, model: object, binding: np.ndarray, *rest: object) -> object:
        return whole(self, model, np.zeros_like(binding), *rest)  # type: ignore[arg-type]

    return careless


def test_a_monotone_rule_that_forgets_the_ball_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trap: dropping a monotone box is sound only where no row stops a point from following."""
    tables = shipped_tables("paper-4.1-helical")
    tables["pose"] = {"position": [0, 0, 30], "rotation": {"angle": {"min": -5, "max": 5}}}
    solution = solve(case_from(tables, "ball"), starts=4)
    (ball,) = [side for side in solution.evidence.active if side.name == "angle"]  # type: ignore[union-attr]
    assert ball.bound == "max"
    monkeypatch.setattr(optimum, "Engine", NumpyEngine)
    sound = certify_program(solution.nlp, None, gap=1e-3)
    assert sound.status is CertificateStatus.PROVED
    assert sound.bound >= solution.F * (1 - 1e-12)

    monkeypatch.setattr(NumpyEngine, "collapse_monotone", forgetful_of_the_ball())
    inside = 0.5 * solution.x
    wrong = certify_program(solution.nlp, inside, gap=1e-9)
    assert wrong.bound < solution.F * (1 - 1e-9) or wrong.status is not CertificateStatus.PROVED


@pytest.mark.slow
def test_the_random_problems_catch_a_monotone_rule_that_forgets_the_ball(monkeypatch: pytest.MonkeyPatch) -> None:
    """The test of the test above: no incumbent is given, so a rule that drops the optimum cannot hide behind it."""

    def is_caught(solution: Solution) -> bool:
        bound = certify_program(solution.nlp, None, gap=1e-2, time_limit=20).bound
        return bool(-solution.nlp.sign * (bound - solution.F) < -1e-6 * abs(solution.F))

    monkeypatch.setattr(optimum, "Engine", NumpyEngine)
    solutions = [solve(random_case(seed), starts=8, seed=1) for seed in range(10)]
    assert not any(map(is_caught, solutions))
    monkeypatch.setattr(NumpyEngine, "collapse_monotone", forgetful_of_the_ball())
    assert any(map(is_caught, solutions))


def test_a_box_without_a_value_is_kept() -> None:
    """Trap: comparing NaN closes a box and proves anything; a limb of zero length must end the search openly."""
    task = Task((0.3, -0.2, 0.5, 1.0, 2.0, -0.5), "max")  # type: ignore[arg-type]
    position = [Free(-2.0, 3.0), Free(-2.0, 2.0), Free(-1.0, 2.0)]
    case = Case(stewart_gough(), {"x1": 5.0, "x2": 5.0, "x3": 0.3, "x4": 0.3}, position, [task])
    found = certify_program(formulate(case), np.array([1.0, 1.0, 1.0]), time_limit=30)
    assert found.status is CertificateStatus.INCOMPLETE
    assert not math.isfinite(found.bound)
    assert "zero length" in found.reason
    data = json_data(certificate_data(found))
    assert data["bound"] is None
    json.dumps(data, allow_nan=False)


def test_nan_in_a_bound_does_not_close_a_box() -> None:
    nlp = formulate(load_case("paper-4.1-helical"))
    form = standard_form(nlp)
    low, high = nlp.lower[:, None].copy(), nlp.upper[:, None].copy()
    low[2], high[2] = np.nan, np.nan
    for engine in (Engine(form), NumpyEngine(form)):
        assert engine.examine(low, high, 1e300).verdict[0] == BoxState.OPEN


def test_nothing_outside_the_box_is_taken_for_a_better_point() -> None:
    """Trap: a solver that widens bounds returns values above the true maximum."""
    solution = solved("paper-4.2-translation")
    assert (solution.x >= solution.nlp.lower).all()
    assert (solution.x <= solution.nlp.upper).all()
    outside = solution.nlp.upper + 1e-6 * solution.nlp.scale
    found = certify_program(solution.nlp, outside)
    assert found.status is CertificateStatus.REFUSED
    assert "violates the limits" in found.statement


def test_an_incumbent_that_is_too_good_is_refused_and_one_that_is_beaten_replaced() -> None:
    solution = solved(AXIS_Z)
    found = certify_program(solution.nlp, solution.x, claimed=solution.F * (1 + 1e-3))
    assert (found.status, found.boxes) == (CertificateStatus.REFUSED, 0)
    assert f"{solution.F:.10g}" in found.statement
    found = certify_program(solution.nlp, solution.nlp.centre)
    assert found.status is CertificateStatus.PROVED
    assert found.was_beaten
    assert "better than the given point" in found.statement
    assert found.incumbent == pytest.approx(solution.F, rel=1e-4)


def test_an_empty_feasible_set_is_a_proof_of_its_own() -> None:
    nlp = formulate(load_case("paper-4.1-helical"))
    impossible = replace(nlp, g_lower=np.array([0.9]), g_upper=np.array([0.95]))
    found = certify_program(impossible)
    assert found.status is CertificateStatus.INFEASIBLE
    assert json_data(certificate_data(found))["bound"] is None


def test_f_is_above_a_value_on_the_whole_box_or_a_point_shows_otherwise() -> None:
    nlp = formulate(load_case(AXIS_Z))
    least = replace(nlp, sense=Sense.MIN)
    found = certify_program(least, above=1.0)
    assert found.status is CertificateStatus.PROVED
    assert found.bound > 1
    found = certify_program(least, above=300.0)
    assert found.status is CertificateStatus.REFUSED
    assert nlp.evaluate(found.x)[0] <= 300
    with pytest.raises(ValueError, match="min"):
        certify_program(nlp, above=0.0)


def test_a_search_that_stops_early_or_is_interrupted_gives_the_bound_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    solution = solved("paper-4.1-helical")
    found = certify_program(solution.nlp, solution.x, gap=1e-9, time_limit=0.15)
    assert found.status is CertificateStatus.INCOMPLETE
    assert found.bound >= solution.F
    assert found.open > 0
    assert "stopped after" in found.statement
    examine, calls = Engine.examine, []

    def interrupted(self: Engine, *arguments: object) -> Examination:
        calls.append(1)
        if len(calls) == 9:
            raise KeyboardInterrupt
        return examine(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Engine, "examine", interrupted)
    found = certify_program(solution.nlp, solution.x, gap=1e-9)
    assert found.status is CertificateStatus.INCOMPLETE
    assert math.isfinite(found.bound)
    assert found.bound >= solution.F
    assert "interrupted" in found.statement


def test_a_case_with_nothing_free_is_its_own_bound_at_several_poses_too() -> None:
    found = certify_program(formulate(load_case("paper-4.4-snu")))
    assert (found.status, found.boxes) == (CertificateStatus.PROVED, 0)
    assert found.bound == found.incumbent
    tables = case_tables("hexapod-linuxcnc", limits=None, workspace=None)
    moved = [{"translation": each} for each in ([0, 0, 0], [0, 0, 1], [1, 0, 1])]
    alone = [solve(case_from(tables | {"pose": tables["pose"] | {"displacements": [each]}})).F for each in moved]
    tables["pose"]["displacements"] = moved
    tables["combine"] = {"over_poses": "worst"}
    certified = certify(case_from(tables), with_proof=True)
    certificate = certified.tasks[0]
    worst = min(alone) if certificate.nlp.sense is Sense.MAX else max(alone)
    assert certified.is_proved
    assert certified.tree is None  # there is no search
    assert (certificate.bound, certificate.gap) == (pytest.approx(worst, rel=1e-12), 0)
    tables["limits"] = {"leg_length": {"max": 1}}
    assert certify(case_from(tables)).tasks[0].status is CertificateStatus.INFEASIBLE


def test_the_worst_case_of_several_tasks_is_bounded_by_the_tasks_themselves() -> None:
    base = load_case(AXIS_Z)
    other = Task((0.1, 0.3, 1.0, 2.0, -1.0, 0.4), "max", "other")  # type: ignore[arg-type]
    case = replace(base, tasks=[base.tasks[0], other])
    nlp = formulate_worst(case, [1.0, 1.0], [400.0, 400.0], 400.0)
    form = standard_form(nlp)
    assert form.nlp.program.places.epigraph is not None
    assert (len(form.functions), form.n, len(form.conditions)) == (2, nlp.n - 1, 0)
    found = certify_program(nlp, gap=1e-3)
    assert found.status is CertificateStatus.PROVED
    rng = np.random.default_rng(0)
    each = [formulate(case, j) for j in range(2)]
    points = each[0].lower + rng.random((2000, each[0].n)) * (each[0].upper - each[0].lower)
    best = max(min(program.evaluate(x)[0] for program in each) for x in points)
    assert best <= found.bound
    assert found.incumbent >= best * (1 - 1e-9)


def test_no_function_has_a_negative_weight() -> None:
    """Trap: the weights of functions sum to 1 up to rounding, and one of -1e-16 takes much from a large function."""
    x, ends, rng = ca.SX.sym("x", 4), np.ones(4), np.random.default_rng(1)
    slopes, constants = rng.normal(size=(4, 4)), np.array([1e25, 0, 0, 0])
    functions = tuple(ca.vertsplit(ca.DM(slopes) @ x + ca.DM(constants)))
    form = StandardForm(formulate(load_case("paper-4.2-rotation")), x, -ends, ends, functions, ())
    centre, radius = rng.uniform(-0.5, 0.5, (4, 500)), rng.uniform(0, 0.5, (4, 500))
    found = Engine(form, 1).examine(centre - radius, centre + radius, -math.inf)
    assert (found.bound >= (slopes @ centre + constants[:, None]).min(axis=0)).all()


def test_progress_and_history_shrink_to_the_gap() -> None:
    solution = solved(AXIS_Z)
    seen: list[tuple[float, float, float, int, int]] = []
    found = certify_program(solution.nlp, solution.x, progress=lambda *row: seen.append(row))
    assert seen
    bounds = [bound for _, bound, _ in found.history]
    assert bounds == sorted(bounds, reverse=True)
    assert found.history[-1][1] == found.bound


def test_rules_use_every_constant_of_the_kernel_alike() -> None:
    """The numbers that the kernel and NumPy must share are written in both."""
    sources = sorted((find_case("paper-4.1-helical").parents[1] / "nlp" / "proof" / "enclosure" / "kernel").glob("*.h"))
    if not sources:
        pytest.skip("an installed package has no source of the kernel")
    text = "".join(each.read_text(encoding="utf-8") for each in sources)
    numbers: dict[str, float] = {
        "WORTH": bounding._WORTH,
        "LINEAR": first_pass.LINEAR,
        "ROOT_SLACK": quadratic_models._ROOT_SLACK,
        "MULTIPLIER_ROUNDS": quadratic_models._MULTIPLIER_ROUNDS,
        "TANGENT_ROUNDS": quadratic_models._TANGENT_ROUNDS,
        "SWEEPS": tangent_bounds._SWEEPS,
    }
    for name, value in numbers.items():
        (line,) = [line for line in text.splitlines() if line.startswith(f"#define {name} ")]
        assert float(line.split()[2]) == value


def test_the_tape_is_the_function() -> None:
    form = standard_form(formulate(load_case("paper-4.3")))
    x = 0.5 * (form.lower + form.upper)
    found = Engine(form).examine(x[:, None], x[:, None], math.inf)
    assert found.bound[0] == pytest.approx(form.value_at(x), rel=1e-11)
    assert len(search_tape(form)) > 100


def test_the_kernel_is_built_without_what_would_break_it() -> None:
    """Trap: -ffast-math drops tests for NaN, and fused operations make the kernel differ from the reference."""
    path = find_case("paper-4.1-helical").parents[1] / "pyproject.toml"
    if not path.exists():
        pytest.skip("an installed package has no build settings")
    extensions = tomllib.loads(path.read_text(encoding="utf-8"))["tool"]["setuptools"]["ext-modules"]
    assert {each["name"].rpartition(".")[2] for each in extensions} == {"_bounds", "_screen"}
    for extension in extensions:
        flags = extension["extra-compile-args"]
        assert "-ffp-contract=off" in flags
        assert not {"-ffast-math", "-Ofast", "-funsafe-math-optimizations", "-ffinite-math-only"} & set(flags)
        assert extension["optional"] is True
    # A header that is not listed would be missing in a source distribution, and the kernel could not be built from it.
    folder = path.parent / "nlp" / "proof" / "enclosure" / "kernel"
    (listed,) = [each["depends"] for each in extensions if each["name"].endswith("._bounds")]
    assert {path.parent / each for each in listed} == set(folder.glob("*.h"))


def test_a_box_that_collapses_to_a_corner_is_examined_there() -> None:
    """Trap: a corner cannot be cut, and was not examined as a corner yet; it must not be left over."""
    tables = shipped_tables("paper-4.1-helical")
    tables["pose"]["rotation"] = {"axis": [0, 0, 1], "angle": -13}
    solution = solve(case_from(tables, "corner"), starts=8)
    assert len(solution.evidence.active) == solution.nlp.n
    proved = certify_program(solution.nlp, solution.x, claimed=solution.F, gap=1e-6)
    assert proved.status is CertificateStatus.PROVED


@pytest.mark.parametrize("limit", [40.0, 3.0])
def test_a_solve_has_half_of_the_time_of_a_certificate(monkeypatch: pytest.MonkeyPatch, limit: float) -> None:
    seen: list[float] = []

    def solve_and_look(*given: Any, **named: Any) -> ProgramSolution:  # noqa: ANN401 - those of the function
        seen.append(seconds_left())
        return solve_program(*given, **named)

    monkeypatch.setattr(certified, "solve_program", solve_and_look)
    found = certify(load_case("paper-4.1-helical"), time_limit=limit, jobs=1)
    assert seen == [pytest.approx(0.5 * limit)]
    assert found.certificates[0].boxes > 0


TWIST = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])


def at_home(model: Model, part: float = 0.05) -> Case:
    """A robot at home with its first two lengths free by a part of theirs."""
    parameters: dict[str, float | Free] = {item.name: item.typical[0] for item in model.parameters}
    for item in [each for each in model.parameters if each.dimension is Dimension.LENGTH][:2]:
        parameters[item.name] = Free((1 - part) * item.typical[0], (1 + part) * item.typical[0])
    return Case(model, parameters, model.home, [Task(TWIST, "max")])  # type: ignore[arg-type]


FEW = ("planar-3-rpr", "6-rus", "five-bar")


@pytest.mark.parametrize(
    "names",
    [FEW, pytest.param([each for each in EACH_KIND if each not in FEW], marks=pytest.mark.soak)],
    ids=["few", "others"],
)
def test_what_replaces_unknowns_closes_the_loops_in_homes_mode(names: tuple[str, ...]) -> None:
    rng = np.random.default_rng(1)
    for name in names:
        nlp = formulate(at_home(robot_function(name)()))
        nlp = replace(nlp, in_home_mode=any(each.is_mode for each in nlp.program.model.signs))
        form = standard_form(nlp)
        if not nlp.in_home_mode:
            assert form.n == nlp.n
            continue
        assert form.n <= 2, name
        for point in rng.uniform(form.lower, form.upper, (4, form.n)):
            x = form.program_variables(point)
            assert loops_are_closed(nlp, x), name
            assert linearise(nlp, x).violation < 1e-12, name
            assert form.keeps_signs(x), name
            assert is_in_home_mode(nlp, x) is True
            assert form.value_at(point) == pytest.approx(nlp.evaluate(x).F, rel=1e-12)
            np.testing.assert_array_equal(form.point_of(x), point)
            x[nlp.program.places.unknowns[0][0]] += 0.01
            assert not form.keeps_signs(x), name


def test_boxes_that_became_too_small_before_a_better_point_was_known_are_searched_again() -> None:
    found = certify_program(replace(formulate(at_home(robot_function("3-spr")())), in_home_mode=True), gap=1e-2)
    assert (found.status, found.open) == (CertificateStatus.PROVED, 0)


def test_bounds_are_those_of_the_search_with_unknowns(monkeypatch: pytest.MonkeyPatch) -> None:
    solution = solve(at_home(robot_function("6-rus")()), starts=2)
    nlp = replace(solution.nlp, in_home_mode=True)
    own = certify_program(nlp, solution.x, claimed=solution.F)
    monkeypatch.setattr(statement, "without_unknowns", lambda form: form)
    every = certify_program(nlp, solution.x, claimed=solution.F)
    assert own.status is every.status is CertificateStatus.PROVED
    assert solution.F <= own.bound <= 1.00011 * solution.F
    assert own.bound == pytest.approx(every.bound, rel=2e-4)
    assert 20 * own.boxes < every.boxes
    np.testing.assert_allclose(own.x, every.x, atol=1e-6)


def test_roots_that_meet_in_the_box_stay_unknowns() -> None:
    nlp = replace(formulate(at_home(robot_function("planar-3-rrr")(), 0.5)), in_home_mode=True)
    form = standard_form(nlp)
    # One unknown of each limb has two solutions; the other follows from it.
    assert form.n == nlp.n - 3
    assert sum(each.is_equation for each in form.conditions) == 3
    start = closed_start(nlp)
    assert form.keeps_signs(start)
    np.testing.assert_allclose(form.program_variables(form.point_of(start)), start, atol=1e-9)
    own = list(nlp.program.places.unknowns[0][:2])
    folded = []
    for turn in np.linspace(-2, 2, 9):
        for other in np.linspace(-3, 3, 7):
            point = start.copy()
            point[own] += [turn, other]
            point = close_equations(nlp, point)
            if loops_are_closed(nlp, point) and np.abs(point - start)[own].min() > 0.1:
                folded.append(form.keeps_signs(point))
    assert folded
    assert not any(folded)


def test_a_proof_without_unknowns_is_checked() -> None:
    case = at_home(robot_function("planar-3-rpr")())
    found = certify(case, starts=2, with_proof=True)
    assert found.certificate.status is CertificateStatus.PROVED
    assert found.certificate.boxes < 100
    (proof,) = proof_of(found, "").claims
    assert check_proof(proof, found.certificate.nlp).leaves > 1


def hexapod_with(limit: SmallestSingularValue | ConditionNumber) -> Case:
    """A hexapod with its pose free by far, and a limit on singular values."""
    parameters = {}
    for k, angle in enumerate(np.radians([-10, 10, 110, 130, 230, 250])):
        for name, radius, turn in (("base", 26.5, angle), ("platform", 11.5, angle + np.radians(50 if k % 2 else -50))):
            parameters[f"{name}_{k + 1}"] = [radius * np.cos(turn), radius * np.sin(turn), 0.0]
    position = [Free(-10.0, 10.0), Free(-10.0, 10.0), Free(12.0, 28.0)]
    rotation = Rotation(axis=None, angle=Free(-0.7, 0.7))
    return Case(hexapod(), parameters, position, [Task(TWIST, "min")], rotation=rotation, limits=Limits(limit))  # type: ignore[arg-type]


def conditions_at(form: StandardForm, points: Array) -> tuple[Array, Array]:
    """Values of all conditions at points, and which of them follow from the limit."""
    values = ca.Function("h", [form.x], [form.expressions]).map(len(points))(points.T).full().T
    return values[:, len(form.functions) :], np.array([each.kind is Kind.FOLLOWS for each in form.conditions])


def test_minors_exclude_wide_boxes_and_nothing_that_keeps_the_limit() -> None:
    limit = SmallestSingularValue(0.8, 10.0)
    form = standard_form(formulate(hexapod_with(limit)))
    points = np.random.default_rng(0).uniform(form.lower, form.upper, (400, 6)) * [1, 1, 1, 0.5, 0.5, 0.5]
    h, follows = conditions_at(form, points)
    assert follows.sum() == 22
    (k,) = [i for i, each in enumerate(form.conditions) if each.name == limit.key]
    kept = h[:, k] <= 0
    assert 20 < kept.sum() < 380
    assert np.all(h[kept][:, follows] <= 0)
    assert np.mean((h[~kept][:, follows] > 0).any(axis=1)) > 0.7
    # Boxes around poses that are far from keeping the limit: the estimate excludes none of them.
    bad = points[np.argsort(-h[:, k])[:4]].T
    half = np.array([[0.3], [0.3], [0.3], [0.015], [0.015], [0.015]])
    alone = [each for each in form.conditions if each.name != limit.key]
    excluded, by_reference = (
        engine(replace(form, conditions=tuple(alone)), 1).examine(bad - half, bad + half, -np.inf).verdict
        for engine in (Engine, NumpyEngine)
    )
    assert (excluded == BoxState.INFEASIBLE).all()
    np.testing.assert_array_equal(by_reference, excluded)
    estimate = tuple(each for each in form.conditions if each.kind is not Kind.FOLLOWS)
    by_estimate = Engine(replace(form, conditions=estimate), 1).examine(bad - half, bad + half, -np.inf).verdict
    assert not (by_estimate == BoxState.INFEASIBLE).any()


def condition_number(case: Case, position: Array, turn: Array, length: float) -> float:
    """The condition number of unit forces along six legs, moments about the platform's origin in parts of a length.

    The turn is the vector part of its quaternion.
    """
    angle = 2 * np.arcsin(np.linalg.norm(turn))
    arms = np.array([case.parameters[f"platform_{k}"] for k in range(1, 7)]) @ turn_about(turn, angle).T
    legs = position + arms - np.array([case.parameters[f"base_{k}"] for k in range(1, 7)])
    forces = legs / np.linalg.norm(legs, axis=1)[:, None]
    return float(np.linalg.cond(np.hstack([forces, np.cross(arms, forces) / length])))


def test_minors_of_condition_numbers_exclude_wide_boxes_and_nothing_that_keeps_the_limit() -> None:
    most, length = 4.0, 10.0
    case = hexapod_with(ConditionNumber(most, length))
    form = standard_form(formulate(case))
    points = np.random.default_rng(0).uniform(form.lower, form.upper, (2000, 6))
    h, follows = conditions_at(form, points)
    h = h[:, follows]
    numbers = np.array([condition_number(case, each[:3], each[3:], length) for each in points])
    kept = numbers <= most
    assert 100 < kept.sum() < 1900
    assert np.all(h[kept] <= 0)
    assert np.mean((h[numbers > 2 * most] > 0).any(axis=1)) > 0.5
