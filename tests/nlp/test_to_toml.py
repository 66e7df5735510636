"""Cases as values: written as case files, and handed from process to process."""

import copy
import enum
import math
import multiprocessing
import pickle
import subprocess
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, is_dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import case_from, soaked

import screwsynth.nlp as sn
from screwsynth.models import (
    Dimension,
    Displacement,
    Model,
    Substitution,
    hexapod,
    screw_displacement,
    stewart_gough,
    three_upu,
)
from screwsynth.models.screws import Screw
from screwsynth.nlp.case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed, Deflection
from screwsynth.nlp.case.limits.registry import LIMIT_TYPES
from screwsynth.nlp.case.loads import Load, Loading, Motion

#: One unit in the last place of a number near 1: the rounding of an angle that no number of degrees gives exactly.
ULP = 2.3e-16


def differences(one: Any, two: Any, slack: float, where: str = "case") -> list[str]:  # noqa: ANN401 - any value
    """Where two values differ, by all their parts; numbers by more than a part of their size."""
    if isinstance(one, Model):
        one, two = (one.name, dict(one.options)), (two.name, dict(two.options))
    if is_dataclass(one) and type(one) is type(two):
        found = []
        # The names of its file and folder are no part of the case.
        for item in (item for item in fields(one) if item.name not in ("source", "folder")):
            found += differences(getattr(one, item.name), getattr(two, item.name), slack, f"{where}.{item.name}")
        return found
    if isinstance(one, Mapping):
        pairs = [(one[key], two.get(key), key) for key in one]
        return [each for a, b, key in pairs for each in differences(a, b, slack, f"{where}.{key}")]
    if isinstance(one, np.ndarray | list | tuple):
        if len(one) != len(two):
            return [f"{where}: {len(one)} and {len(two)} entries"]
        pairs = [(a, b, index) for index, (a, b) in enumerate(zip(one, two, strict=True))]
        return [each for a, b, index in pairs for each in differences(a, b, slack, f"{where}[{index}]")]
    if isinstance(one, float | int) and not isinstance(one, bool | enum.Enum):
        return [] if one == two or abs(one - two) <= slack * abs(one) else [f"{where}: {one!r} and {two!r}"]
    return [] if one == two else [f"{where}: {one!r} and {two!r}"]


@pytest.mark.parametrize("name", sn.shipped_cases())
def test_a_shipped_case_is_the_same_to_the_last_bit(name: str) -> None:
    case = sn.load_case(name)
    text = case.to_toml()
    again = case_from(text, case.name)
    assert differences(case, again, 0.0) == []
    # The text is the case's own: writing what was read changes nothing.
    assert again.to_toml() == text


def number(rng: np.random.Generator, dimension: Dimension, units: sn.Units, low: float, high: float) -> float | sn.Free:
    """A fixed or free number, with few digits or with all of them."""
    lower, upper = sorted(rng.uniform(low, high, 2))
    if dimension is Dimension.ANGLE and units.angle == "deg" and rng.random() < 0.5:
        lower, upper = (math.radians(round(math.degrees(each), 2)) for each in (lower, upper))
    elif rng.random() < 0.5:
        lower, upper = round(float(lower), 3), round(float(upper), 3)
    if rng.random() < 0.5 or lower == upper:
        return float(lower)
    return sn.Free(float(lower), float(upper), float(lower + (upper - lower) / 3) if rng.random() < 0.5 else None)


def displacements(rng: np.random.Generator, tasks: list[sn.Task]) -> tuple[Displacement, ...]:
    kind = rng.integers(4)
    if kind == 0:
        return sn.Pose((0, 0, 0)).displacements
    if kind == 1:
        return sn.along_screw(rng.choice(tasks).twist, [float(each) for each in np.linspace(-0.3, 0.4, 4)])
    if kind == 2:
        return sn.over_grid([[-1.0, 0.0, 1.0], [0.0], [float(each) for each in np.linspace(-2, 0.3, 4)]])
    return tuple(screw_displacement(random_screw(rng), float(rng.normal())) for _ in range(3))


def random_screw(rng: np.random.Generator) -> Screw:
    axis = rng.normal(size=3)
    return Screw(axis / np.linalg.norm(axis), rng.normal(size=3), float(rng.normal()), 1.0)


def limits(rng: np.random.Generator, model: Model) -> sn.Limits:
    home = sn.MountingPose((0.0, 1.0, 20.0), (0.0, 1.0, 1.0), 0.3)
    every = [
        sn.LegLength(min=20.5),
        sn.Actuator(stroke_max=20, dead_length=5.25 if rng.random() < 0.5 else None),
        sn.BaseJointAngle(0.9, home if rng.random() < 0.5 else None),
        sn.PlatformJointAngle(0.7, ((0.0, 0.1, 1.0),) * int(rng.choice([1, 6])) if rng.random() < 0.5 else home),
        sn.JointSpacing(1),
        sn.Footprint(platform=15),
        sn.RadiusRatio(min=0.1, max=0.9),
        sn.LegClearance(0.5),
    ]
    # A robot without legs has its measures limited by their own names.
    own = [sn.QuantityLimit(item.name, max=1.25) for item in model.quantities]
    general = [sn.ConditionNumber(500, 20), sn.SmallestSingularValue(1e-3, 20), sn.RateShare(0.9)]
    chosen = [*(every if model.legs else own), *general]
    if "base_radius" in {item.name for item in model.parameters}:
        chosen.append(sn.Relations("base_radius - platform_radius >= 0", "base_radius^2 >= 1"))
    return sn.Limits(*(each for each in chosen if rng.random() < 0.6))


def random_case(seed: int) -> sn.Case:
    rng = np.random.default_rng(seed)
    units = sn.Units(str(rng.choice(["mm", "in", 'a "unit"'])), "deg" if rng.random() < 0.6 else "rad")
    models = [stewart_gough(), stewart_gough(layout="octahedral"), hexapod(), three_upu(), three_upu(axes="snu")]
    model = models[rng.integers(len(models))]
    parameters: dict[str, Any] = {}
    for item in model.parameters:
        low = [max(item.lower, value - 0.4) for value in item.typical]
        high = [min(item.upper, value + 0.4) for value in item.typical]
        values = [number(rng, item.dimension, units, a, b) for a, b in zip(low, high, strict=True)]
        if item.is_direction and rng.random() < 0.7:
            values = [float(each) for each in (rng.normal(size=3) if rng.random() < 0.5 else rng.integers(1, 9, 3))]
        parameters[item.name] = values[0] if len(values) == 1 else values
    names = ["drive", 'a "quoted"\\ name\nwith\x7f and \u202e', "schräg \U0001d6fc"][: int(rng.integers(1, 4))]
    tasks = []
    for name in names:
        twist = rng.normal(size=6) if rng.random() < 0.5 else np.array([0.0, 0, 0, *rng.integers(1, 4, 3)])
        tasks.append(sn.Task(twist, sn.Sense(str(rng.choice(["max", "min"]))), name, float(rng.choice([1.0, 0.3]))))
    poses = []
    for _ in range(int(rng.integers(1, 4))):
        axis = None if rng.random() < 0.4 else [float(each) for each in rng.normal(size=3)]
        angle = number(rng, Dimension.ANGLE, units, 0.1, 1.0)
        position = [number(rng, Dimension.LENGTH, units, -3.0, 30.0) for _ in range(3)]
        rotation = sn.Rotation() if rng.random() < 0.3 else sn.Rotation(axis, angle)
        poses.append(sn.Pose(position, rotation, displacements(rng, tasks)))
    several = sum(len(pose.displacements) for pose in poses) > 1
    return sn.Case(
        model=model,
        parameters=parameters,
        position=poses[0].position,
        rotation=poses[0].rotation,
        displacements=poses[0].displacements,
        further=poses[1:],
        tasks=tasks,
        units=units,
        characteristic_length=float(rng.uniform(1, 2)) if model.has_couples else 1.0,
        limits=limits(rng, model),
        over_poses=sn.OverPoses.MEAN if several else sn.OverPoses.SUM,
        joint_centre_tolerance=0.01 if model.built else None,
        search=sn.Search(starts=int(rng.integers(1, 99)), seed=int(rng.integers(9)), max_iterations=77),
        method=sn.Method.WORST_CASE if len(tasks) > 1 else sn.Method.AVERAGE,
        title=str(rng.choice(["", "Näme = \t#", "[title]"])),
        name="mine",
        expect=sn.Expectation(1.5, 1e-3, singular=True),
        published=(sn.Published("pose.axis", (0.0, 0.5, 1.0), "a book", reproduced=False, because="a misprint"),),
    )


@pytest.mark.parametrize("seed", soaked(range(40), range(16)))
def test_a_case_built_in_python_is_the_same(seed: int) -> None:
    case = random_case(seed)
    again = case_from(case.to_toml(), case.name)
    assert differences(case, again, ULP) == []
    if case.units.angle == "rad":
        assert differences(case, again, 0.0) == []


def test_the_random_cases_differ_where_they_should() -> None:
    # The comparison itself can fail: another number anywhere is a difference.
    case = random_case(3)
    for other in (
        replace(case, title="another"),
        replace(case, position=[1.0, 2.0, 3.0]),
        replace(case, limits=sn.Limits(sn.RateShare(0.5))),
        replace(case, tasks=[replace(case.tasks[0], weight=3.0), *case.tasks[1:]]),
        replace(case, search=sn.Search(starts=100)),
    ):
        assert differences(case, other, ULP)


def test_poses_are_written_as_they_were_stated_and_displacements_are_rotations() -> None:
    case = sn.load_case("paper-4.1-helical")
    text = case.to_toml()

    def with_displacements(line: str) -> sn.Case:
        return case_from(text.replace("rotation = { angle", f"{line}\nrotation = {{ angle"), case.name)

    turned = "[[0, -1, 0], [1, 0, 0], [0, 0, 1]]"
    line = f"displacements = [{{ translation = [0, 0, 1] }}, {{ rotation = {turned}, translation = [0, 0, 0] }}]"
    assert with_displacements(line).pose_count == 2
    for old, new in (("[1, 0, 0]", "[1.1, 0, 0]"), ("[0, 0, 1]]", "[0, 0, -1]]")):
        with pytest.raises(sn.CaseError, match=r"pose.displacements\[1\].rotation: must be a rotation matrix"):
            with_displacements(line.replace(old, new))
    with pytest.raises(sn.CaseError, match=r"pose\.displacements: conflicts with grid; write two"):
        with_displacements(f"{line}\ngrid = {{ x = {{ min = 0, max = 1, count = 2 }} }}")
    text = sn.load_case("paper-4.1-helical").to_toml().replace("[[task]]", '[combine]\nover_poses = "mean"\n\n[[task]]')
    along = "along_task = { first = -15, last = 15, count = 5 }"
    grid = "grid = { x = { min = -1, max = 3, count = 3 } }"
    for stated, written in ((along, along.replace("{ first", '{ task = "drive the screw", first')), (grid, grid)):
        assert written in case_from(text.replace("rotation = { angle", f"{stated}\nrotation = {{ angle")).to_toml()


def test_what_no_case_file_can_state_is_refused() -> None:
    case = sn.load_case("hexapod-machining")
    cone = sn.BaseJointAngle(0.9, sn.MountingPose((0.0, 0.0, 20.0)))
    other = sn.PlatformJointAngle(0.9, sn.MountingPose((0.0, 0.0, 21.0)))
    model = replace(case.model, name="my-own")
    renamed = replace(case.model, **{key: getattr(case.model, key)[::-1] for key in ("wrenches", "legs", "built")})
    for wrong, fault in (
        (replace(case, model=model), "robot.model.*my-own.*cannot be written to a case file: no such robot"),
        (replace(case, model=renamed), "this name with these options gives a different robot"),
        (replace(case, limits=sn.Limits(cone, other)), "limits.home: cannot be written to a case file"),
        (replace(case, units=sn.Units("")), "units.length.*cannot be written to a case file"),
    ):
        with pytest.raises(sn.CaseError, match=fault):
            wrong.to_toml()


def test_a_case_is_made_and_used_without_the_tables_of_files() -> None:
    code = (
        "import sys; from screwsynth.models import stewart_gough; from screwsynth.nlp import Case, Task; "
        "case = Case(stewart_gough(), dict(x1=2, x2=1, x3=0, x4=0.2), [0, 0, 3], [Task([0, 0, 1, 0, 0, 0])]); "
        "repr(case); sys.exit('pydantic' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-P", "-c", code], check=False).returncode == 0


WAYS: dict[str, Callable[[object], object]] = {
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),  # noqa: S301 - our own bytes
    "deepcopy": copy.deepcopy,
}
ways = pytest.mark.parametrize("again", WAYS.values(), ids=WAYS.keys())

#: Every type of limit at once, each with numbers that the machine of the case can have.
EVERY_LIMIT = sn.Limits(
    sn.LegLength(min=20, max=40),
    sn.Actuator(stroke_max=20, dead_length=5),
    sn.BaseJointAngle(0.9, sn.MountingPose((0.0, 0.0, 20.0))),
    sn.PlatformJointAngle(0.9, ((0.0, 0.1, 1.0),)),
    sn.JointSpacing(1),
    sn.Footprint(base=32, platform=15),
    sn.RadiusRatio(min=0.1, max=0.9),
    sn.LegClearance(0.5),
    sn.ConditionNumber(500, 20),
    sn.SmallestSingularValue(1e-3, 20),
    sn.ActuatorRate(100),
    sn.RateShare(0.9),
    ActuatorForce(max=400),
    ActuatorSpeed(max=10),
    ActuatorPower(max=3000),
    Deflection(2),
    sn.Relations("x1 - x2 >= 1"),
)
LOADING = Loading((Load(force=(1, 2, -30), any_force=5.0),), Motion(1.0, 0.5), stiffness={"": 1e3})


@pytest.mark.parametrize("model", [stewart_gough(layout="octahedral"), hexapod(), three_upu()], ids=lambda m: m.name)
@ways
def test_the_rows_of_a_model_are_functions_of_its_symbols(model: Model, again: Callable[[Model], Model]) -> None:
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
def test_a_case_is_solved_alike(again: Callable[[sn.Case], sn.Case]) -> None:
    case = sn.load_case("paper-4.1-helical")
    other = again(case)
    assert other is not case
    assert repr(other) == repr(case)
    with pytest.raises(TypeError):
        other.parameters["x1"] = 1.0  # type: ignore[index]
    assert not np.asarray(other.tasks[0].twist).flags.writeable
    one, two = (sn.json_data(sn.result_of(sn.solve(each, starts=3))) for each in (case, other))
    for each in (one, two):
        del each["seconds"]
    assert one == two


@ways
def test_a_program_with_every_limit_is_the_same_program(again: Callable[[sn.Nlp], sn.Nlp]) -> None:
    case = sn.load_case("hexapod-machining")
    every = replace(case, limits=EVERY_LIMIT, loading=LOADING, joint_centre_tolerance=0.01)
    # Every type but the robot's own measures, which are limited as lengths of legs are, and those of limbs given joint
    # by joint, which test_joint_limits pickles.
    of_legs = {kind for kind in LIMIT_TYPES if not kind.needs_joints}
    assert {type(limit) for limit in every.limits} == of_legs - {sn.QuantityLimit}
    nlp = sn.formulate(every)
    other = again(nlp)
    for item in fields(nlp):
        value = getattr(nlp, item.name)
        if isinstance(value, np.ndarray):
            assert np.array_equal(getattr(other, item.name), value)
            assert not getattr(other, item.name).flags.writeable or value.flags.writeable
    for one, two in zip(nlp.evaluate(nlp.start), other.evaluate(nlp.start), strict=True):
        assert np.array_equal(one, two)
    # Bounds and margins go through the readings of all constraints, which are functions.
    margins = [[vars(row) for row in sn.margins_of(each, nlp.start, optimal=False)] for each in (other, nlp)]
    assert margins[0] == margins[1]


@pytest.mark.parametrize("name", ["paper-4.1-rotation", "paper-4.2", "paper-4.4-snu"])
@ways
def test_a_solution_has_the_same_result(name: str, again: Callable[[sn.Solution], sn.Solution]) -> None:
    solution = sn.solve(sn.load_case(name), starts=2)
    other = again(solution)
    assert sn.json_data(sn.result_of(other)) == sn.json_data(sn.result_of(solution))
    assert np.array_equal(other.x, solution.x)
    assert other.x.flags.writeable == solution.x.flags.writeable
    # One case, one model: parts that were one value are one value again.
    assert other.outcomes[0].own.nlp.case.model is other.case.model


@ways
def test_a_certificate_says_the_same(again: Callable[[sn.Certificate], sn.Certificate]) -> None:
    certified = sn.certify(sn.load_case("paper-4.2-rotation"), starts=2, gap=1e-2)
    certificate = certified.certificate
    other = again(certificate)
    for name in ("statement", "bound", "history"):
        assert getattr(other, name) == getattr(certificate, name)
    assert other.nlp.evaluate(other.nlp.start).F == certificate.nlp.evaluate(certificate.nlp.start).F
    assert again(certified).is_proved  # type: ignore[arg-type, attr-defined]


def test_processes_solve_cases_and_return_solutions() -> None:
    names = ["paper-4.2-rotation", "paper-4.2-translation"]
    cases = [sn.load_case(name) for name in names]
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        solutions = list(pool.map(sn.solve, cases))
    for case, solution in zip(cases, solutions, strict=True):
        here = sn.solve(case)
        assert solution.case.name == case.name
        assert solution.F == here.F
        assert np.array_equal(solution.x, here.x)
