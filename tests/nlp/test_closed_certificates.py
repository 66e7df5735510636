"""Certificates without unknowns that follow in closed form, and boxes that limits on singular values exclude."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from builders import EACH_KIND, Array, turn_about
from numpy_engine.bounding import NumpyEngine

from screwsynth.models import Dimension, Model, hexapod, robot_function
from screwsynth.nlp import Case, Free, Limits, Rotation, Task, certify, formulate, solve
from screwsynth.nlp.case.limits.singular_values import ConditionNumber, SmallestSingularValue
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.kkt import close_equations, linearise
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.proof.boxes.engine import Engine, Verdict
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.statement import standard_form as statement
from screwsynth.nlp.proof.statement.form import StandardForm
from screwsynth.nlp.proof.statement.standard_form import Kind, is_in_home_mode, standard_form
from screwsynth.nlp.solver.certified import proof_of

TWIST = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])


def at_home(model: Model, part: float = 0.05) -> Case:
    """A robot at home with its first two lengths free by a part of theirs."""
    parameters: dict[str, float | Free] = {item.name: item.typical[0] for item in model.parameters}
    for item in [each for each in model.parameters if each.dimension is Dimension.LENGTH][:2]:
        parameters[item.name] = Free((1 - part) * item.typical[0], (1 + part) * item.typical[0])
    return Case(model, parameters, model.home, [Task(TWIST, "max")])  # type: ignore[arg-type]


def with_unknowns(form: StandardForm) -> StandardForm:
    """The form as it is."""
    return form


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
    nlp = replace(formulate(at_home(robot_function("3-spr")())), in_home_mode=True)
    found = certify_program(nlp, gap=1e-2)
    assert found.status is CertificateStatus.PROVED
    assert found.open == 0


def test_bounds_are_those_of_the_search_with_unknowns(monkeypatch: pytest.MonkeyPatch) -> None:
    solution = solve(at_home(robot_function("6-rus")()), starts=2)
    nlp = replace(solution.nlp, in_home_mode=True)
    own = certify_program(nlp, solution.x, claimed=solution.F)
    monkeypatch.setattr(statement, "without_unknowns", with_unknowns)
    every = certify_program(nlp, solution.x, claimed=solution.F)
    assert own.status is every.status is CertificateStatus.PROVED
    assert solution.F <= own.bound <= 1.00011 * solution.F
    assert own.bound == pytest.approx(every.bound, rel=2e-4)
    assert 20 * own.boxes < every.boxes
    assert own.x is not None
    assert every.x is not None
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
    angles = np.radians([-10, 10, 110, 130, 230, 250])
    parameters = {}
    for k, angle in enumerate(angles):
        turned = angle + np.radians(50 if k % 2 else -50)
        parameters[f"base_{k + 1}"] = (26.5 * np.array([np.cos(angle), np.sin(angle), 0.0])).tolist()
        parameters[f"platform_{k + 1}"] = (11.5 * np.array([np.cos(turned), np.sin(turned), 0.0])).tolist()
    position = [Free(-10.0, 10.0), Free(-10.0, 10.0), Free(12.0, 28.0)]
    rotation = Rotation(axis=None, angle=Free(-0.7, 0.7))
    return Case(hexapod(), parameters, position, [Task(TWIST, "min")], rotation=rotation, limits=Limits(limit))  # type: ignore[arg-type]


def test_minors_exclude_wide_boxes_and_nothing_that_keeps_the_limit() -> None:
    limit = SmallestSingularValue(0.8, 10.0)
    form = standard_form(formulate(hexapod_with(limit)))
    follows = np.array([each.kind is Kind.FOLLOWS for each in form.conditions])
    assert follows.sum() == 22
    rng = np.random.default_rng(0)
    points = rng.uniform(form.lower, form.upper, (400, 6)) * [1, 1, 1, 0.5, 0.5, 0.5]
    values = ca.Function("h", [form.x], [form.expressions])
    h = np.array([values(each).full().ravel()[len(form.functions) :] for each in points])
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
    assert (excluded == Verdict.INFEASIBLE).all()
    np.testing.assert_array_equal(by_reference, excluded)
    estimate = tuple(each for each in form.conditions if each.kind is not Kind.FOLLOWS)
    by_estimate = Engine(replace(form, conditions=estimate), 1).examine(bad - half, bad + half, -np.inf).verdict
    assert not (by_estimate == Verdict.INFEASIBLE).any()


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
    follows = np.array([each.kind is Kind.FOLLOWS for each in form.conditions])
    rng = np.random.default_rng(0)
    points = rng.uniform(form.lower, form.upper, (2000, 6))
    values = ca.Function("h", [form.x], [form.expressions])
    h = np.array([values(each).full().ravel()[len(form.functions) :] for each in points])[:, follows]
    numbers = np.array([condition_number(case, each[:3], each[3:], length) for each in points])
    kept = numbers <= most
    assert 100 < kept.sum() < 1900
    assert np.all(h[kept] <= 0)
    assert np.mean((h[numbers > 2 * most] > 0).any(axis=1)) > 0.5
