"""Cases, models, solutions and certificates as values that processes hand to each other."""

import copy
import multiprocessing
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields

import casadi as ca
import numpy as np
import pytest

from screwsynth.models import Model, Substitution, hexapod, stewart_gough, three_upu
from screwsynth.nlp import (
    Actuator,
    ActuatorRate,
    BaseJointAngle,
    Case,
    Certificate,
    ConditionNumber,
    Footprint,
    JointSpacing,
    LegClearance,
    LegLength,
    Limits,
    MountingPose,
    Nlp,
    PlatformJointAngle,
    QuantityLimit,
    RadiusRatio,
    RateShare,
    Relations,
    SmallestSingularValue,
    Solution,
    certify,
    formulate,
    json_data,
    load_case,
    margins_of,
    result_of,
    solve,
)
from screwsynth.nlp.case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed, Deflection
from screwsynth.nlp.case.limits.registry import LIMIT_TYPES
from screwsynth.nlp.case.loads import Load, Loading, Motion

WAYS: dict[str, Callable[[object], object]] = {
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),  # noqa: S301 - our own bytes
    "deepcopy": copy.deepcopy,
}
ways = pytest.mark.parametrize("again", WAYS.values(), ids=WAYS.keys())

#: Every type of limit at once, each with numbers that the machine of the case can have.
EVERY_LIMIT = Limits(
    LegLength(min=20, max=40),
    Actuator(stroke_max=20, dead_length=5),
    BaseJointAngle(0.9, MountingPose((0.0, 0.0, 20.0))),
    PlatformJointAngle(0.9, ((0.0, 0.1, 1.0),)),
    JointSpacing(1),
    Footprint(base=32, platform=15),
    RadiusRatio(min=0.1, max=0.9),
    LegClearance(0.5),
    ConditionNumber(500, 20),
    SmallestSingularValue(1e-3, 20),
    ActuatorRate(100),
    RateShare(0.9),
    ActuatorForce(max=400),
    ActuatorSpeed(max=10),
    ActuatorPower(max=3000),
    Deflection(2),
    Relations("x1 - x2 >= 1"),
)
LOADING = Loading((Load(force=(1, 2, -30), any_force=5.0),), Motion(1.0, 0.5), stiffness={"": 1e3})


@pytest.mark.parametrize("model", [stewart_gough(layout="octahedral"), hexapod(), three_upu()], ids=lambda m: m.name)
@ways
def test_the_rows_of_a_model_are_the_same_functions_of_its_own_symbols(
    model: Model, again: Callable[[Model], Model]
) -> None:
    other = again(model)
    assert (other.name, dict(other.options), other.limbs) == (model.name, dict(model.options), model.limbs)
    with pytest.raises(TypeError):
        other.options["layout"] = "another"  # type: ignore[index]
    rng = np.random.default_rng(12)
    point = [rng.uniform(1, 2, part.shape) for part in Substitution.identity(model).all]
    values = []
    for each in (model, other):
        rows = [part for row in (*each.wrenches, *each.built) for part in (row.force, row.moment, row.square)]
        outputs = [*rows, *(item.values for item in each.quantities), *(part for _, part in each.scene.expressions)]
        errors = [part for leg in each.legs for part in (leg.base_error, leg.platform_error)]
        # A symbol that a row no longer shares with its parameter, pose or leg would be a free one, which is an error.
        function = ca.Function("rows", [*Substitution.identity(each).all, *errors], outputs)
        values.append(function.call([*point, *(np.full(3, 0.1) for _ in errors)]))
    for one, two in zip(*values, strict=True):
        assert np.array_equal(np.array(one), np.array(two))


@ways
def test_a_case_is_solved_alike(again: Callable[[Case], Case]) -> None:
    case = load_case("paper-4.1-helical")
    other = again(case)
    assert other is not case
    assert repr(other) == repr(case)
    with pytest.raises(TypeError):
        other.parameters["x1"] = 1.0  # type: ignore[index]
    assert not np.asarray(other.tasks[0].twist).flags.writeable
    one, two = (json_data(result_of(solve(each, starts=3))) for each in (case, other))
    for each in (one, two):
        del each["seconds"]
    assert one == two


@ways
def test_a_program_with_every_limit_is_the_same_program(again: Callable[[Nlp], Nlp]) -> None:
    case = load_case("hexapod-machining")
    every = Case(
        model=case.model,
        parameters=case.parameters,
        position=case.position,
        rotation=case.rotation,
        tasks=case.tasks,
        limits=EVERY_LIMIT,
        loading=LOADING,
        joint_centre_tolerance=0.01,
    )
    # Every type but the robot's own measures, which are limited as lengths of legs are, and those of limbs given joint
    # by joint, which test_joint_limits pickles.
    of_legs = {kind for kind in LIMIT_TYPES if not kind.needs_joints}
    assert {type(limit) for limit in every.limits} == of_legs - {QuantityLimit}
    nlp = formulate(every)
    other = again(nlp)
    for item in fields(nlp):
        value = getattr(nlp, item.name)
        if isinstance(value, np.ndarray):
            assert np.array_equal(getattr(other, item.name), value)
            assert not getattr(other, item.name).flags.writeable or value.flags.writeable
    for one, two in zip(nlp.evaluate(nlp.start), other.evaluate(nlp.start), strict=True):
        assert np.array_equal(one, two)
    # Bounds and margins go through the readings of all constraints, which are functions.
    assert margins_of(other, nlp.start, optimal=False) == margins_of(nlp, nlp.start, optimal=False)


@pytest.mark.parametrize("name", ["paper-4.1-rotation", "paper-4.2", "paper-4.4-snu"])
@ways
def test_a_solution_has_the_same_result(name: str, again: Callable[[Solution], Solution]) -> None:
    solution = solve(load_case(name), starts=2)
    other = again(solution)
    assert json_data(result_of(other)) == json_data(result_of(solution))
    assert np.array_equal(other.x, solution.x)
    assert other.x.flags.writeable == solution.x.flags.writeable
    # One case, one model: parts that were one value are one value again.
    assert other.outcomes[0].own.nlp.case.model is other.case.model


@ways
def test_a_certificate_says_the_same(again: Callable[[Certificate], Certificate]) -> None:
    certified = certify(load_case("paper-4.2-rotation"), starts=2, gap=1e-2)
    certificate = certified.certificate
    assert certificate is not None
    other = again(certificate)
    assert (other.statement, other.bound, other.history) == (
        certificate.statement,
        certificate.bound,
        certificate.history,
    )
    assert other.nlp.evaluate(other.nlp.start).F == certificate.nlp.evaluate(certificate.nlp.start).F
    assert again(certified).is_proved  # type: ignore[arg-type, attr-defined]


def test_processes_solve_cases_and_return_solutions() -> None:
    names = ["paper-4.2-rotation", "paper-4.2-translation"]
    cases = [load_case(name) for name in names]
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        solutions = list(pool.map(solve, cases))
    for case, solution in zip(cases, solutions, strict=True):
        here = solve(case)
        assert solution.case.name == case.name
        assert solution.F == here.F
        assert np.array_equal(solution.x, here.x)
