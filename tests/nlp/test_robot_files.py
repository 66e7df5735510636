"""Robot files: cases whose robot is given joint by joint, their faults, solves, results and singularities."""

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import Run, case_from, output_of, refusal_of, saved, saved_with_robot

import screwsynth.models
from screwsynth.models import model_names, robot, robot_function
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import CaseError, Search, Status, evaluate, formulate, load_case, load_result, solve
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import Mobility, mobility_of
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.starter.text import starter_case

SHIPPED = Path(screwsynth.models.__file__).parent / "robots"
RPS, DELTA = ((SHIPPED / f"{name}.toml").read_text(encoding="utf-8") for name in ("3-rps", "delta"))
RPS_CASE = """
[units]
length = "m"
[robot]
file = "robot.toml"
parameters = { rb = { min = 0.8, max = 1.2 }, rp = { min = 0.4, max = 0.7 }, h = 1.1 }
[pose]
position = [{ min = -0.3, max = 0.3 }, { min = -0.3, max = 0.3 }, { min = 0.9, max = 1.3 }]
rotation = { angle = { min = -30, max = 30 } }
[[task]]
sense = "max"
axis = [1, 0.3, 0]
point = [0, 0, 1.1]
pitch = 0.2
"""
DELTA_CASE = """
[units]
length = "m"
[robot]
file = "robot.toml"
[robot.parameters]
rb = { min = 0.3, max = 0.5 }
rp = 0.12
arm = { min = 0.35, max = 0.55 }
rod = 0.9
w = 0.1
tilt = 23
[pose]
position = [0.1, 0.05, -0.8]
rotation = { angle = { min = -30, max = 30 } }
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
"""


@pytest.mark.parametrize(("robot_text", "case_text", "F"), [(RPS, RPS_CASE, 1.158234), (DELTA, DELTA_CASE, 3.926943)])
def test_a_robot_file_beside_a_case_is_solved(
    tmp_path: Path, cli: Run, robot_text: str, case_text: str, F: float
) -> None:
    name = saved_with_robot(tmp_path, robot_text, case_text)
    result = tmp_path / "result.json"
    out = output_of(cli("solve", name, "--starts", "6", "--json", str(result)))
    assert "freedoms  3 with free actuators" in out
    data = json.loads(result.read_text(encoding="utf-8"))
    assert data["F"] == pytest.approx(F, abs=1e-6)
    assert len(data["joints"]["actuators"]) == 3
    assert load_result(result) is not None
    # The starts close their loops before the search, so that all converge.
    assert "6 of 6 converged" in out
    case = load_case(name)
    again = case_from(case.to_toml(), "case")
    assert again.model.options["definition"] == case.model.options["definition"]


def test_a_new_case_of_a_robot_file_is_read_beside_it(tmp_path: Path, cli: Run) -> None:
    (tmp_path / "robot.toml").write_text(RPS, encoding="utf-8")
    text = output_of(cli("new", str(tmp_path / "robot.toml")))
    case = saved(tmp_path / "case.toml", text)
    assert cli("evaluate", str(case))[0] == 0
    assert cli("new", str(case))[0] == 2


def test_an_output_never_takes_the_place_of_the_robot_file(tmp_path: Path, cli: Run) -> None:
    name = saved_with_robot(tmp_path, RPS, RPS_CASE)
    refusal_of(
        cli("solve", name, "--starts", "1", "--json", str(tmp_path / "robot.toml")), "is a file that the case names"
    )
    assert (tmp_path / "robot.toml").read_text(encoding="utf-8") == RPS


def test_a_solution_closes_all_loops_and_survives_pickling(tmp_path: Path) -> None:
    case = load_case(saved_with_robot(tmp_path, DELTA, DELTA_CASE))
    solution = solve(replace(case, search=Search(starts=4)))
    own = pickle.loads(pickle.dumps(solution)).outcomes[0].own  # noqa: S301 - its own pickle
    assert own.status is Status.OPTIMAL
    assert loops_are_closed(own.nlp, own.x)
    opened = own.x.copy()
    opened[own.nlp.program.places.unknowns[0][0]] += 0.5
    assert not loops_are_closed(own.nlp, opened)
    state = evaluate(own.nlp, own.x)
    # A translation: the platform keeps its orientation, and the rates of the two rods of an arm are equal.
    assert state.angle == pytest.approx(0, abs=1e-7)
    assert state.rates[::2] == pytest.approx(state.rates[1::2], abs=1e-9)


def test_actuator_rates_are_those_of_finite_differences(tmp_path: Path) -> None:
    case = load_case(saved_with_robot(tmp_path, DELTA, DELTA_CASE.replace("{ min = 0.3, max = 0.5 }", "0.4")))
    step = 1e-5

    def angles(z: float) -> tuple[np.ndarray, Mobility]:
        nlp = formulate(replace(case, position=(0.1, 0.05, z)))
        x = close_equations(nlp, nlp.start)
        state = evaluate(nlp, x)
        found = mobility_of(nlp, x, state)
        assert found is not None
        return state.quantities["actuator_angle"], found

    here = angles(-0.8)[1]
    slopes = (angles(-0.8 + step)[0] - angles(-0.8 - step)[0]) / (2 * step)
    assert list(here.actuator_rates.values()) == pytest.approx(slopes, rel=1e-8)
    assert here.constrained == 0
    assert (here.freedoms, here.singularities) == (3, ())


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('file = "robot.toml"', "file = 3", "case.toml: robot.file: must be the name of a robot file"),
        ('file = "robot.toml"', 'file = "robot.toml"\nmodel = "hexapod"', "robot.model: cannot stand beside file"),
        ('file = "robot.toml"', 'file = "robot.toml"\naxes = "free"', "case.toml: robot.axes: no such key"),
        ('file = "robot.toml"', "", "case.toml: robot.model: is missing"),
        ('file = "robot.toml"', 'model = "3-rpz"', "did you mean '3-rps'?"),
        ('file = "robot.toml"', 'model = "../robots/3-rps"', "no such robot"),
        ("h = 1.1", "height = 1.1", "case.toml: robot.parameters.height: no such parameter"),
    ],
)
def test_faults_of_a_case_with_a_robot_file_are_sentences(tmp_path: Path, old: str, new: str, fault: str) -> None:
    assert old in RPS_CASE
    with pytest.raises(CaseError) as error:
        load_case(saved_with_robot(tmp_path, RPS, RPS_CASE.replace(old, new, 1)))
    assert fault in str(error.value)


def test_a_robot_that_the_program_cannot_treat_is_refused() -> None:
    hinges = [{"type": "C", "at": "z", "axis": "x"}, {"type": "P", "at": "z", "axis": "y"}]
    with pytest.raises(ValueError, match="no limb resists the platform"):
        robot(name="floating", limb=[{"joints": [{"type": "S", "at": "0*x"}, *hinges]}])


def test_the_gallery_is_found_by_name_and_each_robot_has_a_starter() -> None:
    assert len(gallery_names()) >= 14
    assert set(gallery_names()) < set(model_names())
    for name in gallery_names():
        model = robot_function(name)()
        assert model.name == name
        assert model.generic.jacobian == 6
        # The starter of each is solved in test_starters.py.
        assert f'model = "{name}"' in starter_case(model)
