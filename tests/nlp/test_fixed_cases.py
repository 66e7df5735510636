"""Robots with loops in cases that leave nothing free, or fewer numbers than equations; working modes of optima."""

import math
from pathlib import Path

import numpy as np
import pytest
from builders import ran, starter

from screwsynth.models import Model, robot_function
from screwsynth.nlp import Case, Free, Rotation, Status, Task, formulate, json_data, result_of, solve
from screwsynth.nlp.evidence.assembly import assembly_over_poses
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.evidence.workingmode import turned_over_poses
from screwsynth.nlp.results.wording import starts_lines

TASK = Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]))


def typical(model: Model) -> dict[str, float]:
    return {item.name: item.typical[0] for item in model.parameters}


@pytest.mark.parametrize("name", ["3-rps", "delta", "3-upu", "planar-3-rrr"])
def test_a_case_that_leaves_nothing_free_is_evaluated_once(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    model = robot_function(name)()
    solution = solve(Case(model, typical(model), model.home, [TASK]))
    assert solution.status is Status.EVALUATED
    assert solution.starts == ()
    assert solution.evidence is None
    assert loops_are_closed(solution.nlp, solution.x)
    np.testing.assert_allclose(solution.x, 0, atol=1e-9)  # all joints are at home
    data = json_data(result_of(solution))
    assert (data["status"], data["optimality"]) == ("evaluated", None)
    # A pose that the robot cannot take: no numbers are left to choose, and no solver is asked.
    if name in ("delta", "3-upu"):
        refused = solve(Case(model, typical(model), model.home, [TASK], Rotation((1, 0, 1), math.radians(5))))
        assert refused.status is Status.INFEASIBLE
        assert refused.starts == ()
    assert capfd.readouterr().err == ""


def test_more_equations_than_variables_need_no_solver(capfd: pytest.CaptureFixture[str]) -> None:
    model = robot_function("delta")()
    values = typical(model) | {"rb": Free(0.12, 0.2)}
    nlp = formulate(Case(model, values, model.home, [TASK], Rotation((1, 0, 1), math.radians(5))))
    assert nlp.is_overdetermined
    assert not nlp.is_fixed
    solution = solve(nlp.case, starts=3)
    assert solution.status is Status.INFEASIBLE
    assert capfd.readouterr().err == ""


def test_the_command_says_evaluated(tmp_path: Path) -> None:
    case = tmp_path / "fixed.toml"
    values = typical(robot_function("3-rps")())
    numbers = "\n".join(f"{name} = {value!r}" for name, value in values.items())
    case.write_text(
        f'[robot]\nmodel = "3-rps"\n[robot.parameters]\n{numbers}\n[pose]\nposition = [0, 0, {values["h"]!r}]\n'
        '[[task]]\nname = "t"\nsense = "max"\naxis = [0, 1, 2]\npoint = [0, 0, 0]\npitch = 2\n'
    )
    result = ran("solve", str(case))
    assert result.code == 0
    assert "fixed point: F = " in result.output
    assert "(evaluated)" in result.output
    assert "converged" not in result.output


def free_case(name: str, reach: float) -> Case:
    model = robot_function(name)()
    position = [Free(value - reach, value + reach) for value in model.home]
    return Case(model, typical(model), position, [TASK], Rotation(None, Free(-0.3, 0.3)))


def test_each_limb_bent_the_other_way_is_another_working_mode() -> None:
    nlp = formulate(free_case("6-rus", 0.2))
    (own,) = nlp.program.places.unknowns
    rng = np.random.default_rng(4)
    for limb in range(6):
        x = np.array(nlp.start)
        x[:3] += rng.uniform(-0.05, 0.05, 3)
        near = close_equations(nlp, x)
        assert turned_over_poses(nlp, near) == ((),)
        far = near.copy()
        far[own[limb]] += math.radians(110)
        far = close_equations(nlp, far)
        assert np.abs(far - near)[own[limb]] > 0.3
        assert turned_over_poses(nlp, far) == ((str(limb + 1),),)
        found = assembly_over_poses(nlp, far)
        assert found.turned == (str(limb + 1),)
        assert found.brief == f"another working mode (limb {limb + 1})"


def test_planar_limbs_bent_the_other_way_are_found_too() -> None:
    # Their wrenches are members without smooth directions, so the sense is that of a determinant of screws.
    model = robot_function("planar-3-rrr")()
    nlp = formulate(Case(model, typical(model), [Free(-0.2, 0.2), Free(-0.2, 0.2), 0.0], [TASK]))
    (own,) = nlp.program.places.unknowns
    closed = close_equations(nlp, nlp.start)
    found = set()
    for k in range(len(own)):
        for way in (-2.0, 2.0):
            x = closed.copy()
            x[own[k]] += way
            x = close_equations(nlp, x)
            if loops_are_closed(nlp, x) and np.abs(x - closed)[list(own)].max() > 0.5:
                (turned,) = turned_over_poses(nlp, x)
                judged = assembly_over_poses(nlp, x)
                assert judged.turned == turned
                found.add(turned)
    assert {("1",), ("2",), ("3",)} <= found


def test_every_distinct_optimum_says_its_working_mode() -> None:
    solution = solve(starter("6-rus"), starts=16)
    own = solution.outcomes[0].own
    brief = [found.assembly.brief for found in own.optima if found.assembly is not None]
    assert len(brief) == len(own.optima) > 1
    assert len({found.x.tobytes() for found in own.optima}) == len(own.optima)
    for found in own.optima:
        assert found.assembly.is_home == (turned_over_poses(own.nlp, found.x) == ((),))
    assert any(words.startswith("another working mode (limb") for words in brief)
    data = result_of(solution).starts
    assert [each.assembly for each in data.optima] == brief
    lines = [line.text for line in starts_lines(data)]
    assert sum("in another working mode (limb" in line for line in lines) == sum(map(bool, brief[:5]))
