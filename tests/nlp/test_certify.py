"""The search of the whole box: the reference, soundness on random problems, and every trap that was met."""

import json
import math
import tomllib
from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from builders import case_from, shipped_tables
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy_engine import bounding, first_pass, quadratic_models, tangent_bounds
from numpy_engine.bounding import NumpyEngine

from screwsynth.models import stewart_gough
from screwsynth.nlp import Case, Free, Rotation, Sense, Solution, Task, certify, formulate, load_case, solve
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.program.epigraph import formulate_worst
from screwsynth.nlp.program.nlp import Nlp
from screwsynth.nlp.proof.boxes import optimum
from screwsynth.nlp.proof.boxes.engine import Engine, Examination, Verdict, search_tape
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.statement.standard_form import StandardForm, standard_form
from screwsynth.nlp.results.evidence import certificate_data
from screwsynth.nlp.results.jsondata import json_data


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
    opened = agree & (reference.verdict == Verdict.OPEN)
    np.testing.assert_allclose(other.lower[:, opened], reference.lower[:, opened], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.upper[:, opened], reference.upper[:, opened], rtol=1e-9, atol=1e-9)
    assert (reference.split == other.split)[opened].mean() > 0.99


@pytest.mark.parametrize("name", ["paper-4.2-rotation", "paper-4.2-translation"])
def test_one_box_is_enough_for_a_flat_optimum(name: str) -> None:
    solution = solve(load_case(name), starts=2)
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
        assert engine.examine(low, high, 1e300).verdict[0] == Verdict.OPEN


def test_nothing_outside_the_box_is_taken_for_a_better_point() -> None:
    """Trap: a solver that widens bounds returns values above the true maximum."""
    solution = solve(load_case("paper-4.2-translation"), starts=4)
    assert (solution.x >= solution.nlp.lower).all()
    assert (solution.x <= solution.nlp.upper).all()
    outside = solution.nlp.upper + 1e-6 * solution.nlp.scale
    found = certify_program(solution.nlp, outside)
    assert found.status is CertificateStatus.REFUSED
    assert "outside of the limits" in found.statement


def test_an_incumbent_that_is_too_good_is_refused() -> None:
    solution = solve(load_case("paper-4.1-helical-axis-z"), starts=4)
    found = certify_program(solution.nlp, solution.x, claimed=solution.F * (1 + 1e-3))
    assert found.status is CertificateStatus.REFUSED
    assert f"{solution.F:.10g}" in found.statement
    assert found.boxes == 0


def test_an_incumbent_that_is_beaten_is_replaced() -> None:
    solution = solve(load_case("paper-4.1-helical-axis-z"), starts=4)
    found = certify_program(solution.nlp, solution.nlp.centre)
    assert found.status is CertificateStatus.PROVED
    assert found.was_beaten
    assert "better than the one given" in found.statement
    assert found.incumbent == pytest.approx(solution.F, rel=1e-4)


def test_an_empty_feasible_set_is_a_proof_of_its_own() -> None:
    nlp = formulate(load_case("paper-4.1-helical"))
    impossible = replace(nlp, g_lower=np.array([0.9]), g_upper=np.array([0.95]))
    found = certify_program(impossible)
    assert found.status is CertificateStatus.INFEASIBLE
    assert json_data(certificate_data(found))["bound"] is None


@pytest.mark.parametrize(("value", "status"), [(1.0, CertificateStatus.PROVED), (300.0, CertificateStatus.REFUSED)])
def test_f_is_above_a_value_on_the_whole_box_or_a_point_shows_otherwise(
    value: float, status: CertificateStatus
) -> None:
    nlp = formulate(load_case("paper-4.1-helical-axis-z"))
    least = replace(nlp, sense=type(nlp.sense)("min"))
    found = certify_program(least, above=value)
    assert found.status is status
    if status is CertificateStatus.PROVED:
        assert found.bound > value
    else:
        assert found.x is not None
        assert nlp.evaluate(found.x)[0] <= value


def test_above_needs_a_minimisation() -> None:
    with pytest.raises(ValueError, match="min"):
        certify_program(formulate(load_case("paper-4.1-helical")), above=0.0)


def test_stopping_early_still_gives_a_bound_that_holds() -> None:
    solution = solve(load_case("paper-4.1-helical"), starts=4)
    found = certify_program(solution.nlp, solution.x, gap=1e-9, time_limit=0.15)
    assert found.status is CertificateStatus.INCOMPLETE
    assert found.bound >= solution.F
    assert found.open > 0
    assert "stopped after" in found.statement


def test_an_interrupt_gives_the_bound_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    solution = solve(load_case("paper-4.1-helical"), starts=4)
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


def test_a_case_with_nothing_free_is_its_own_bound() -> None:
    nlp = formulate(load_case("paper-4.4-snu"))
    found = certify_program(nlp)
    assert found.status is CertificateStatus.PROVED
    assert found.boxes == 0
    assert found.bound == found.incumbent


def test_the_worst_of_several_poses_of_a_case_with_nothing_free_is_its_own_bound() -> None:
    tables = shipped_tables("hexapod-linuxcnc")
    for table in ("limits", "workspace", "tolerance"):
        tables.pop(table, None)
    moved = [[0, 0, 0], [0, 0, 1], [1, 0, 1]]
    alone = []
    for translation in moved:
        tables["pose"]["displacements"] = [{"translation": translation}]
        alone.append(solve(case_from(tables)).F)
    tables["pose"]["displacements"] = [{"translation": translation} for translation in moved]
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
    base = load_case("paper-4.1-helical-axis-z")
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
    solution = solve(load_case("paper-4.1-helical-axis-z"), starts=4)
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
