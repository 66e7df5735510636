"""Robots whose platform comes behind a closed loop and driven joints: rates, freedoms, limits, workspaces and words."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from screwsynth.models import Model, robot
from screwsynth.nlp import Case, Free, Limits, Task, evaluate, formulate, solve
from screwsynth.nlp.case.limits.rates import ActuatorRate
from screwsynth.nlp.case.workspace import Workspace
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.evidence.margins import margins_of
from screwsynth.nlp.evidence.mobility import Mobility, mobility_of
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.results.result import result_of
from screwsynth.nlp.results.summary import case_summary

ALONG_X = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)


def hinge(name: str, ends: tuple[str, str], at: Sequence[float], axis: object = "z", *, driven: bool = False) -> Any:  # noqa: ANN401
    table = {"name": name, "type": "R", "between": list(ends), "at": list(at), "axis": axis}
    return table | ({"actuated": True} if driven else {})


def five_bar(wrist: Sequence[object] = ("z",), *, motors: int = 2) -> Model:
    """A five-bar between (-0.4, 0), (-0.8, 0.6), (0, 1), (0.8, 0.6) and (0.4, 0), with driven hinges at (0, 1)."""
    bodies = ["left", *(f"wrist{k}" for k in range(1, len(wrist))), "platform"]
    joints = [
        hinge("m1", ("base", "arm1"), (-0.4, 0, 0), driven=True),
        hinge("m2", ("base", "arm2"), (0.4, 0, 0), driven=motors == 2),
        hinge("e1", ("arm1", "left"), (-0.8, 0.6, 0)),
        hinge("e2", ("arm2", "right"), (0.8, 0.6, 0)),
        hinge("middle", ("left", "right"), (0, 1, 0)),
    ]
    pairs = zip(wrist, bodies, bodies[1:], strict=False)
    joints += [hinge(f"w{k}", (one, other), (0, 1, 0), axis, driven=True) for k, (axis, one, other) in enumerate(pairs)]
    return robot("five-bar", home=(0, 1, 0), links=["base", "arm1", "arm2", "right", *bodies], joint=joints)


def mobility(model: Model, twist: Sequence[float] = ALONG_X) -> Mobility:
    nlp = formulate(Case(model, {}, model.home, [Task(twist)]))
    found = mobility_of(nlp, nlp.start, evaluate(nlp, nlp.start))
    assert found is not None
    return found


def test_a_five_bar_with_a_wrist_has_the_rates_that_are_found_by_hand() -> None:
    """Rod (0.8, 0.4) and arm (-0.4, 0.6): q z x arm has the velocity of (0, 1) along the rod, q (-0.64) = 0.8."""
    found = mobility(five_bar())
    assert found.freedoms == 3
    assert found.constrained == 0
    assert found.actuator_rates == pytest.approx({"m1": -1.25, "m2": -1.25, "w0": 0.625}, abs=1e-13)
    # The wrist alone turns the platform; a motion out of the plane is none of its own.
    about = mobility(five_bar(), (0, 0, 1, 1, 0, 0))
    assert about.actuator_rates == pytest.approx({"m1": 0, "m2": 0, "w0": 1}, abs=1e-13)
    assert mobility(five_bar(), (0, 0, 0, 0, 0, 1)).constrained > 0.1
    # Three wrist axes that meet: five freedoms.
    assert mobility(five_bar(("z", "x", "y"))).freedoms == 5


def test_a_limit_on_rates_is_judged_by_these_rates() -> None:
    for largest, kept in ((1.1, False), (1.3, True)):
        case = Case(five_bar(), {}, (0, 1, 0), [Task(ALONG_X)], limits=Limits(ActuatorRate(largest)))
        nlp = formulate(case)
        margins = margins_of(nlp, nlp.start, optimal=False)
        assert sorted(abs(each.value) for each in margins) == pytest.approx([0.625, 1.25, 1.25], abs=1e-12)
        assert any(each.violated for each in margins) is not kept


def test_solve_shows_the_rates_and_that_the_motion_is_possible() -> None:
    case = Case(five_bar(), {}, (Free(-0.1, 0.1), 1, 0), [Task(ALONG_X)])
    solution = solve(case, starts=2)
    joints = result_of(solution).robot.joints
    assert (joints.freedoms, joints.feasible) == (3, True)
    # At x: the arm's rate q1 by the law of cosines of both halves, from finite differences of the arm's angle.
    x = float(result_of(solution).robot.pose.position[0])
    step = 1e-6
    slopes = [(arm_angle(side, x + step) - arm_angle(side, x - step)) / (2 * step) for side in (-1, 1)]
    assert [each.rate for each in joints.actuators[:2]] == pytest.approx(slopes, abs=1e-8)


def arm_angle(side: int, x: float) -> float:
    """Angle of an arm of length sqrt(0.52) whose rod of length sqrt(0.8) ends at (x, 1)."""
    dx, dy = x - 0.4 * side, 1.0
    reach = math.hypot(dx, dy)
    inner = math.acos((0.52 + reach**2 - 0.8) / (2 * math.sqrt(0.52) * reach))
    return math.atan2(dy, dx) - side * inner


def test_the_constraints_keep_their_rank_over_a_workspace() -> None:
    case = Case(
        five_bar(), {}, (0, 1, 0), [Task(ALONG_X)], workspace=Workspace((Free(-0.01, 0.01), Free(0.99, 1.01), 0))
    )
    judgement = judge_workspace(case, time_limit=30)
    assert judgement.regularity.outcome is Outcome.PROVED
    assert judgement.constraints.outcome is Outcome.PROVED


def overdriven(*, driven: bool) -> Model:
    """A four-bar whose two cranks are driven, with the platform on a hinge of its coupler, driven or not."""
    joints = [
        hinge("m1", ("base", "a"), (0, 0, 0), driven=True),
        hinge("m2", ("base", "b"), (1, 0, 0), driven=True),
        hinge("e1", ("a", "coupler"), (0.1, 0.5, 0)),
        hinge("e2", ("b", "coupler"), (1.3, 0.8, 0)),
        hinge("spin", ("coupler", "platform"), (0.5, 1, 0), "x", driven=driven),
    ]
    return robot("overdriven", home=(0.5, 1, 0), links=["base", "a", "b", "coupler", "platform"], joint=joints)


@pytest.mark.parametrize("driven", [True, False])
def test_more_motors_than_freedoms_have_rates_that_fit(driven: bool) -> None:
    """The coupler turns about the pole, where its cranks meet: a unit turn is (e1 - pole).(e1 - a) / |e1 - a|^2."""
    model = overdriven(driven=driven)
    a, b, c, d = (np.array(each) for each in ((0.0, 0), (1.0, 0), (0.1, 0.5), (1.3, 0.8)))
    s, _ = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)
    pole = a + s * (c - a)
    found = mobility(model, (0, 0, 1, pole[1], -pole[0], 0))
    assert (found.freedoms, found.constrained) == (2, 0)
    rates = [float((end - pole) @ (end - start) / ((end - start) @ (end - start))) for start, end in ((a, c), (b, d))]
    assert list(found.actuator_rates.values()) == pytest.approx([*rates, 0][: 2 + driven], abs=1e-12)
    # Behind a passive hinge the loop demands a relation of the rates, which those of least squares keep too.
    assert model.actuators[0].relations.shape[0] == (not driven)
    values = list(mobility(model).actuator_rates.values())
    if not driven:
        assert values[0] * rates[1] == pytest.approx(values[1] * rates[0], abs=1e-12)
    case = Case(model, {}, model.home, [Task(ALONG_X)], limits=Limits(ActuatorRate(1.0)))
    nlp = formulate(case)
    limited = sorted(abs(each.value) for each in margins_of(nlp, nlp.start, optimal=False))
    assert limited == pytest.approx(sorted(abs(each) for each in values), abs=1e-9)


def test_a_rate_that_the_motion_does_not_determine_is_said_to_be_none() -> None:
    """Two driven hinges about one axis: only the sum of their rates moves the five-bar's platform."""
    model = five_bar(("z", "z"))
    found = mobility(model)
    assert found.freedoms == 3
    assert {name for name, rate in found.actuator_rates.items() if math.isnan(rate)} == {"w0", "w1"}
    assert found.actuator_rates["m1"] == pytest.approx(-1.25, abs=1e-12)
    assert (model.generic.idle, model.generic.undetermined) == (1, ("w0", "w1"))
    case = Case(model, {}, (Free(-0.1, 0.1), 1, 0), [Task(ALONG_X)])
    words = "\n".join(str(each) for each in case_summary(case, result_of(solve(case, starts=1))))
    assert "w0: undetermined" in words
    assert "does not determine the rates of actuators w0, w1: they can move while the platform stands still" in words
    with pytest.raises(CaseError, match=r"actuator_rate.*does not determine the rates of w0, w1"):
        replace(case, limits=Limits(ActuatorRate(1.0)))
