"""Assemblies and modes of operation: which one a point is in, and how near the path to it comes to a singularity."""

import math
from dataclasses import replace

import numpy as np
import pytest

from screwsynth.models import robot_function
from screwsynth.nlp import Case, Free, Rotation, Search, Task, evaluate, formulate, result_of, solve
from screwsynth.nlp.evidence.assembly import NEAR_SINGULAR, assembly_of
from screwsynth.nlp.evidence.closing import closed_in_place, closed_start
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.state import loops_are_closed


def free_pose(name: str, reach: float) -> Case:
    """The gallery's robot with the pose free about home."""
    model = robot_function(name)()
    position = [Free(value - reach, value + reach) for value in model.home]
    parameters = {item.name: item.typical[0] for item in model.parameters}
    return Case(
        model, parameters, position, [Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]))], Rotation(None, Free(-2, 2))
    )


def test_an_elbow_on_the_other_side_is_another_assembly() -> None:
    nlp = formulate(free_pose("6-rus", 0.3))
    x = closed_start(nlp)
    here = assembly_of(nlp, x, evaluate(nlp, x))
    assert here.is_home
    assert here.nearness == pytest.approx(1)
    assert here.sentences == ()
    state = evaluate(nlp, x)
    away = assembly_of(nlp, x, replace(state, position=state.position + 100))
    assert not away.is_home
    (own,) = nlp.program.places.unknowns
    other = x.copy()
    other[own[2]] += math.radians(110)  # beyond the crank's other position
    other = close_equations(nlp, other)
    assert np.abs(other - x).max() > 0.5
    assert loops_are_closed(nlp, other)
    found = assembly_of(nlp, other, evaluate(nlp, other))
    assert not found.is_home
    assert found.turned == ("3",)
    assert found.nearness > NEAR_SINGULAR
    assert [each.partition(":")[0] for each in found.sentences] == ["another working mode than at home"]


def test_another_mode_of_a_three_upu_is_reached_past_a_singularity() -> None:
    nlp = formulate(free_pose("3-upu", 0.4))
    (rotation,) = nlp.program.places.rotations
    q = list(rotation.q)  # type: ignore[union-attr]
    found = []
    for turn in ((0.5, 0.3, 0.0), (0.0, 0.4, 0.3), (0.3, 0.0, 0.6)):
        x = nlp.start.copy()
        x[q] = turn
        x = close_equations(nlp, x)
        if loops_are_closed(nlp, x) and np.linalg.norm(x[q]) > 0.1:
            found.append(assembly_of(nlp, x, evaluate(nlp, x)))
    assert found  # the platform is turned: its own mode only translates
    for each in found:
        assert each.nearness < NEAR_SINGULAR
        assert each.brief
        assert each.sentences[0].startswith("not reached from home without passing near a singularity")


def test_poses_near_home_are_reached_from_there() -> None:
    nlp = formulate(free_pose("3-rps", 0.3))
    rng = np.random.default_rng(2)
    (rotation,) = nlp.program.places.rotations
    for _ in range(5):
        x = nlp.start.copy()
        x[2] += rng.uniform(-0.2, 0.2)
        x[list(rotation.q)[:2]] = rng.uniform(-0.1, 0.1, 2)  # type: ignore[union-attr]
        x = close_equations(nlp, x)
        found = assembly_of(nlp, x, evaluate(nlp, x))
        assert found.is_home
        assert found.nearness > 0.5
        assert not found.brief


def test_joints_are_put_in_place_as_on_the_path_from_home() -> None:
    nlp, rng, count = formulate(free_pose("6-rus", 0.6)), np.random.default_rng(0), 0
    (rotation,), own = nlp.program.places.rotations, list(range(3))
    for _ in range(12):
        x = nlp.start.copy()
        x[own] = nlp.lower[own] + (nlp.upper - nlp.lower)[own] * rng.random(3)
        x[list(rotation.q)] = rng.uniform(-0.15, 0.15, 3)  # type: ignore[union-attr]
        found = closed_in_place(nlp, x)
        if found is not None:
            assembly = assembly_of(nlp, found, evaluate(nlp, found))
            assert assembly.is_home
            count += 1
    assert count > 1


def test_results_say_that_an_answer_is_in_another_assembly() -> None:
    case = replace(free_pose("6-rus", 0.1), search=Search(starts=1), rotation=Rotation(None, Free(-0.2, 0.2)))
    solution = solve(case)
    own = solution.outcomes[0].own
    assert result_of(solution).robot.joints.assembly == ()
    nlp, (places,) = own.nlp, own.nlp.program.places.unknowns
    other = own.x.copy()
    other[places[1]] += math.radians(100)
    other = close_equations(nlp, other)
    moved = replace(own, x=other, state=evaluate(nlp, other))
    changed = replace(solution, outcomes=(replace(solution.outcomes[0], own=moved),))
    (sentence,) = result_of(changed).robot.joints.assembly
    assert sentence.startswith("another working mode than at home: limb 2 ")


@pytest.mark.slow
@pytest.mark.parametrize("sense", ["max", "min"])
def test_every_start_of_six_robots_is_solved(sense: str) -> None:
    for name, free in {
        "3-rps": ("rb", "rp"),
        "6-rus": ("rb", "rp", "crank"),
        "6-pus": ("rb", "rp"),
        "delta": ("rb", "arm"),
        "tricept": ("rb", "rp"),
        "spherical-3-rrr": (),
    }.items():
        case = free_pose(name, 0.15)
        parameters = {
            item.name: Free(0.85 * item.typical[0], 1.15 * item.typical[0]) if item.name in free else item.typical[0]
            for item in case.model.parameters
        }
        task = replace(case.tasks[0], sense=sense)
        own = (
            solve(
                replace(case, parameters=parameters, tasks=[task], rotation=Rotation(None, Free(-0.35, 0.35))),
                starts=24,
            )
            .outcomes[0]
            .own
        )
        assert [start.status.name for start in own.starts] == ["CONVERGED"] * 24, name
        assert loops_are_closed(own.nlp, own.x)
