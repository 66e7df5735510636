"""A robot may call its parameters what it likes: symbols are found by their places, never by their names."""

import math
from dataclasses import replace

import numpy as np
import pytest

from screwsynth.models import Model, stewart_gough
from screwsynth.nlp import Case, Free, Method, OverPoses, Rotation, Task, along_screw, certify_program, formulate, solve
from screwsynth.nlp.embedding.codegen import generate_c
from screwsynth.nlp.evidence.sensitivity import sensitivities
from screwsynth.nlp.program.epigraph import formulate_worst
from screwsynth.nlp.program.formulation import formulate_each, formulate_weighted

PLAIN = ("x1", "x2", "x3", "x4")
HELICAL = Task.screw("max", axis=[2, 2, 1], point=[2, 3, 6], pitch=1, name="helical")
TURN = Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=0, name="turn")

#: Every name that a program or a case gives to something of its own.
INTERNAL = [
    *(f"twist_{i}" for i in range(6)), *(f"twist1_{i}" for i in range(6)), "twist",
    "p_x", "p_y", "p_z", "q_x", "q_y", "q_z", "axis", "axis_x", "axis_y", "axis_z", "angle", "p", "q",
    "level", "ceiling", "weight0", "weight1", "best0", "best1", "near0", "characteristic_length", "cost", "scale",
    "target", "pose1_p_x", "pose1_angle", "pose2_q_x", "at1_p_x", "x", "s", "centre", "weight", "sizes", "t",
    "multipliers", "program.level", "base_error", "R",
]  # fmt: skip


def renamed(names: tuple[str, ...]) -> Model:
    """The platform on two circles with other names for its four parameters."""
    model = stewart_gough()
    new = dict(zip(PLAIN, names, strict=True))
    return replace(
        model,
        parameters=tuple(replace(item, name=new[item.name]) for item in model.parameters),
        scene=replace(model.scene, marks=tuple(replace(m, parameter=new[m.parameter]) for m in model.scene.marks)),
    )


def case_of(names: tuple[str, ...], *, tasks: list[Task], held: bool = False, **rest: object) -> Case:
    x1, x2, x3, x4 = names
    return Case(
        model=renamed(names),
        parameters={x1: 12.0, x2: 8.0, x3: math.radians(30), x4: Free(math.radians(5), math.radians(25))},
        position=[Free(-10, 10), -5.0, Free(20, 50)],
        rotation=Rotation(axis=[0, 0, 1] if held else None, angle=Free(-math.radians(30), math.radians(30))),
        tasks=tasks,
        **rest,  # type: ignore[arg-type]
    )


def groups() -> list[tuple[str, ...]]:
    """The internal names, four to a robot."""
    padded = [*INTERNAL, *(f"extra{i}" for i in range(-len(INTERNAL) % 4))]
    return [tuple(padded[i : i + 4]) for i in range(0, len(padded), 4)]  # type: ignore[misc]


@pytest.mark.parametrize("names", groups(), ids="-".join)
@pytest.mark.parametrize("held", [False, True], ids=["free axis", "held axis"])
def test_internal_names_as_parameter_names_change_nothing(names: tuple[str, ...], held: bool) -> None:
    tasks = [HELICAL, TURN]
    one = case_of(PLAIN, tasks=tasks, held=held)
    other = case_of(names, tasks=tasks, held=held)
    pairs = [
        *zip(formulate_each(one), formulate_each(other), strict=True),
        *((formulate_weighted(c, [1.0, 2.0]), formulate_weighted(d, [1.0, 2.0])) for c, d in [(one, other)]),
        *((formulate_worst(c, [1.0, 1.0], [300.0, 50.0], 400.0), formulate_worst(d, [1.0, 1.0], [300.0, 50.0], 400.0))
          for c, d in [(one, other)]),
    ]  # fmt: skip
    steps = along_screw(HELICAL.twist, [0.0, 0.1, 0.2])
    several = {"displacements": steps, "over_poses": OverPoses.WORST, "tasks": [HELICAL], "held": held}
    pairs.append((formulate(case_of(PLAIN, **several)), formulate(case_of(names, **several))))  # type: ignore[arg-type]
    for first, second in pairs:
        for x in (first.start, first.lower + 0.3 * (first.upper - first.lower)):
            F, g = first.evaluate(x)
            G, h = second.evaluate(x)
            assert F == G
            np.testing.assert_array_equal(g, h)
        assert len({scalar.name for scalar in (*second.program.variables, *second.program.arguments)}) == len(
            second.program.variables
        ) + len(second.program.arguments)
        plain, odd = (sensitivities(nlp, nlp.start) for nlp in (first, second))
        assert [row.derivative for row in plain] == [row.derivative for row in odd]


def test_two_tasks_of_a_robot_with_a_parameter_named_as_a_twist() -> None:
    """Such a robot once gave 30.01 and 33.62, silently."""
    found = []
    for names in (PLAIN, ("twist_0", "level", "weight0", "q_x")):
        case = case_of(names, tasks=[HELICAL, TURN], method=Method.WORST_CASE)
        solution = solve(case, starts=4)
        found.append([outcome.F for outcome in solution.outcomes] + [solution.combination.value])
    assert found[0] == pytest.approx(found[1], rel=1e-12)


def test_answers_proofs_and_c_do_not_depend_on_names() -> None:
    results = []
    for names in (PLAIN, ("angle", "level", "twist_0", "p_x")):
        solution = solve(case_of(names, tasks=[HELICAL]), starts=4)
        proof = certify_program(solution.nlp, solution.x, time_limit=20.0)
        results.append((solution.F, proof.bound, proof.boxes))
        header = next(text for name, text in generate_c(solution.nlp.case, "").items() if name.endswith(".h"))
        assert "robot.p_x" in header if names != PLAIN else "robot." not in header
    assert results[0] == results[1]


def test_a_parameter_with_a_name_of_the_pose_is_written_with_its_robot() -> None:
    case = case_of(("p_x", "angle", "q_x", "free"), tasks=[HELICAL])
    assert list(case.scalars)[:4] == ["robot.p_x", "robot.angle", "q_x", "free"]
