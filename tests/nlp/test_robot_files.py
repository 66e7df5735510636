"""Robot files: cases whose robot is given joint by joint, their faults, solves, results and singularities."""

import copy
import json
import pickle
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Run, case_from, output_of, refusal_of, saved

from screwsynth.models import model_names, robot, robot_function
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import (
    Case,
    CaseError,
    Free,
    Search,
    Status,
    Task,
    evaluate,
    formulate,
    load_case,
    load_result,
    solve,
)
from screwsynth.nlp.case.starter import starter_case
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import Mobility, mobility_of
from screwsynth.nlp.evidence.singularities import SingularityKind
from screwsynth.nlp.evidence.state import loops_are_closed

RPS = """
name = "3-RPS"
home = [0, 0, "h"]
[dimensions]
rb = { typical = 1.0, description = "radius of the base" }
rp = { typical = 0.6 }
h  = { typical = 1.1 }
[[limb]]
repeat = { count = 3, axis = [0, 0, 1], through = [0, 0, 0] }
points = { B = ["rb", 0, 0], A = ["rp", 0, "h"] }
joints = [ { type = "R", at = "B", axis = "y" },
           { type = "P", at = "B", axis = "A - B", actuated = true },
           { type = "S", at = "A" } ]
"""
DELTA = """
name = "delta"
home = [0, 0, "h"]
dimensions = { rb = { typical = 0.4 }, rp = { typical = 0.12 }, arm = { typical = 0.45 }, rod = { typical = 0.9 }, w = { typical = 0.1 }, tilt = { kind = "angle", typical = 23 } }
derived = { out = "rb + arm*cos(tilt)", h = "-arm*sin(tilt) - sqrt(rod^2 - (out - rp)^2)" }
[[limb]]
repeat = { count = 3 }
points = { B = ["rb", 0, 0], E = ["out", 0, "-arm*sin(tilt)"], A = ["rp", 0, "h"] }
joints = [ { type = "R", at = "B", axis = "y", actuated = true } ]
branch = [ { joints = [ { type = "S", at = "E + w/2*y" }, { type = "S", at = "A + w/2*y" } ] },
           { joints = [ { type = "S", at = "E - w/2*y" }, { type = "S", at = "A - w/2*y" } ] } ]
"""  # noqa: E501 - an inline table is on one line
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


def put(folder: Path, robot_text: str, case_text: str) -> str:
    (folder / "robot.toml").write_text(robot_text, encoding="utf-8")
    return str(saved(folder / "case.toml", case_text))


@pytest.mark.parametrize(("robot_text", "case_text", "F"), [(RPS, RPS_CASE, 1.158234), (DELTA, DELTA_CASE, 3.926943)])
def test_a_robot_file_beside_a_case_is_solved(
    tmp_path: Path, cli: Run, robot_text: str, case_text: str, F: float
) -> None:
    name = put(tmp_path, robot_text, case_text)
    result = tmp_path / "result.json"
    out = output_of(cli("solve", name, "--starts", "6", "--json", str(result)))
    assert "freedoms  3 with free actuators" in out
    data = json.loads(result.read_text(encoding="utf-8"))
    assert data["F"] == pytest.approx(F, abs=1e-6)
    assert len(data["joints"]["actuators"]) == 3
    assert load_result(result) is not None
    # Six starts close their loops before the search, so that all converge.
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
    name = put(tmp_path, RPS, RPS_CASE)
    refusal_of(
        cli("solve", name, "--starts", "1", "--json", str(tmp_path / "robot.toml")), "is a file that the case names"
    )
    assert (tmp_path / "robot.toml").read_text(encoding="utf-8") == RPS


def test_a_solution_closes_all_loops_and_survives_pickling(tmp_path: Path) -> None:
    case = load_case(put(tmp_path, DELTA, DELTA_CASE))
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
    case = load_case(put(tmp_path, DELTA, DELTA_CASE.replace("{ min = 0.3, max = 0.5 }", "0.4")))
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
        ('file = "robot.toml"', 'file = "none.toml"', 'case.toml: robot.file = "none.toml": cannot be read'),
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
        load_case(put(tmp_path, RPS, RPS_CASE.replace(old, new, 1)))
    assert fault in str(error.value)


def test_a_robot_that_the_program_cannot_treat_is_refused() -> None:
    definition: dict[str, Any] = tomllib.loads(DELTA)
    passive = copy.deepcopy(definition)
    passive["limb"][0]["joints"][0]["actuated"] = False
    with pytest.raises(ValueError, match=r"limb 1, joint 1 \(R\): is passive and before the branches"):
        robot(**passive)
    floating = {
        "name": "floating",
        "limb": [
            {
                "joints": [
                    {"type": "S", "at": "0*x"},
                    {"type": "C", "at": "z", "axis": "x"},
                    {"type": "P", "at": "z", "axis": "y"},
                ]
            }
        ],
    }
    with pytest.raises(ValueError, match="no limb resists the platform"):
        robot(**floating)


def planar(bend: float) -> Case:
    """Return a planar robot at home, its platform's joints on the radii of the base's; without a bend all is radial."""
    model = robot_function("planar-3-rrr")()
    values = {item.name: item.typical[0] for item in model.parameters} | {"turn": 0.0, "bend": bend}
    pose = (Free(-1, 1), Free(-1, 1), 0.0)
    return Case(model, values, pose, [Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=0)])


def test_kinds_of_singularity_are_told_apart() -> None:
    def kinds(case: Case) -> list[SingularityKind]:
        nlp = formulate(case)
        x = nlp.start
        found = mobility_of(nlp, x, evaluate(nlp, x))
        assert found is not None
        return [each.kind for each in found.singularities]

    # All links radial: every limb is stretched, and the lines of the distal links meet.
    assert kinds(planar(0.0)) == [*[SingularityKind.SERIAL] * 3, SingularityKind.ACTUATION]
    # Park's 3-UPU of Seoul: three constraints of rank one.
    text = tomllib.loads("""
        name = "snu"
        home = [0, 0, 0.7]
        [[limb]]
        repeat = { count = 3 }
        points = { B = [0.57735, 0, 0], A = [0.288675, 0, 0.7] }
        joints = [{ type = "U", at = "B", axes = ["x", "cross(x, A - B)"] },
                  { type = "P", at = "B", axis = "A - B", actuated = true },
                  { type = "U", at = "A", axes = ["cross(x, A - B)", "x"] }]
    """)
    snu = robot(**text)
    turn = [Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=0)]
    assert kinds(Case(snu, {}, (0, 0, 0.7), turn)) == [SingularityKind.CONSTRAINT]


def test_singularities_of_limbs_with_rods_are_found() -> None:
    def limb(first: str) -> list[SingularityKind]:
        """A platform on six legs, of which the first may be at a singularity at home."""
        joints = [
            {"type": "U", "at": "B", "axes": ["x", "y"]},
            {"type": "P", "at": "B", "axis": "A - B", "actuated": True},
            {"type": "S", "at": "A"},
        ]
        legs = [
            {
                "repeat": {"angles": angles},
                "points": {"B": [1, 0, 0], "A": [0.5, offset, 1]},
                "joints": joints,
            }
            for angles, offset in (([120, 240], 0.4), ([20, 140, 260], -0.4))
        ]
        model = robot(name="six", home=[0, 0, 1], limb=[tomllib.loads(first), *legs])
        nlp = formulate(Case(model, {}, (0, 0, 1), [Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=0)]))
        found = mobility_of(nlp, nlp.start, evaluate(nlp, nlp.start))
        assert found is not None
        assert all(each.limb == "1" for each in found.singularities)
        return [each.kind for each in found.singularities]

    leg = """
        points = { B = [1, 0, 0], A = [0.6, 0, 1] }
        joints = [{ type = "U", at = "B", axes = ["FIRST", "y"] },
                  { type = "P", at = "B", axis = "A - B", actuated = true }, { type = "S", at = "A" }]
    """
    assert limb(leg.replace("FIRST", "x")) == []
    # The leg along the first axis of its universal joint.
    assert limb(leg.replace("FIRST", "A - B")) == [SingularityKind.PASSIVE]
    rod = """
        points = { B = [1, 0, 0], A = [0.6, 0, 1], E = "B + PART*(A - B) + OFF*x" }
        joints = [{ type = "R", at = "B", axis = "y", actuated = true },
                  { type = "U", at = "E", axes = ["y", "x"] }, { type = "S", at = "A" }]
    """
    assert limb(rod.replace("PART", "0.4").replace("OFF", "0.2")) == []
    # Crank and rod in line.
    assert limb(rod.replace("PART", "0.4").replace("OFF", "0")) == [SingularityKind.SERIAL]


def test_the_gallery_is_found_by_name_and_each_robot_has_a_starter() -> None:
    assert len(gallery_names()) >= 14
    assert set(gallery_names()) < set(model_names())
    for name in gallery_names():
        model = robot_function(name)()
        assert model.name == name
        assert model.generic is not None
        assert model.generic.jacobian == 6
        # The starter of each is solved in test_tables.py.
        assert f'model = "{name}"' in starter_case(model)
