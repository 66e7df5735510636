"""F by limb, actuation and constraints; the dependence of F on the characteristic length and on centres; remarks."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from builders import starter

from screwsynth.models import constraint_rows, robot, robot_function
from screwsynth.nlp import Case, Free, Nlp, Task, evaluate, formulate, report, result_of, solve
from screwsynth.nlp.evidence.conventions import dependence_of
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.evidence.paths import velocities_at
from screwsynth.nlp.results.summary import case_summary, case_tables, table_names
from screwsynth.nlp.results.text import Line, TextTable

GENERAL = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
NAMES = ("3-rps", "6-rus", "3-upu", "delta-parallelogram", "planar-3-rrr", "spherical-3-rrr")


@cache
def at_home(name: str) -> Nlp:
    model = robot_function(name)()
    values = {item.name: item.typical[0] for item in model.parameters}
    length = 0.7 * float(np.linalg.norm(model.home)) or 0.7
    return formulate(Case(model, values, model.home, [Task(GENERAL)], characteristic_length=length))


def with_twist(nlp: Nlp, twist: np.ndarray) -> Nlp:
    arguments = np.array(nlp.arguments)
    arguments[nlp.program.places.twists[0]] = twist
    return replace(nlp, arguments=arguments)


def feasible(nlp: Nlp) -> np.ndarray:
    """The general twist, projected on the twists that the platform can make with free actuators."""
    numbers = nlp.program.kernels.robot_state(nlp.start, nlp.arguments)
    rows = constraint_rows(nlp.program.model, velocities_at(nlp, nlp.start, numbers), numbers.position)
    work = np.hstack([rows[:, 3:], rows[:, :3]])
    return GENERAL - np.linalg.pinv(work, rcond=1e-9) @ (work @ GENERAL)


@pytest.mark.parametrize("name", NAMES)
def test_only_what_constraints_carry_depends_on_conventions(name: str) -> None:
    nlp = at_home(name)
    possible = with_twist(nlp, feasible(nlp))
    general, special = (dependence_of(each, nlp.start) for each in (nlp, possible))
    if name in ("3-rps", "6-rus"):  # forces alone
        assert general is None
        assert special is None
        return
    assert general is not None
    assert special is not None
    if name == "spherical-3-rrr":  # F of a rotation is the length's square times a number
        assert special.length == pytest.approx(2, abs=1e-9)
    else:
        assert special.length == 0
        assert abs(general.length) > 0.01
    slides = name in ("planar-3-rrr", "delta-parallelogram")  # the others have universal joints or hinges that meet
    assert (general.centre is not None) == slides
    if slides:
        assert special.centre == 0
        assert general.centre is not None
        assert general.centre > 0.01


def test_the_derivative_by_the_length_is_that_of_f() -> None:
    nlp = at_home("planar-3-rrr")
    found = dependence_of(nlp, nlp.start)
    values = []
    for part in (0.999, 1.001):
        changed = replace(nlp.case, characteristic_length=part * nlp.case.characteristic_length)
        values.append(formulate(changed).evaluate(nlp.start)[0])
    slope = (values[1] - values[0]) / 0.002 / nlp.evaluate(nlp.start)[0]
    assert found.length == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize("name", [*NAMES, "delta", "tricept", "five-bar"])
def test_actuation_and_constraints_of_limbs_sum_to_f(name: str) -> None:
    nlp = at_home(name)
    for each, is_feasible in ((nlp, False), (with_twist(nlp, feasible(nlp)), True)):
        state = evaluate(each, each.start)
        found = mobility_of(each, each.start, state)
        parts = found.parts
        assert sum(sum(part) for part in parts.values()) == pytest.approx(state.F, rel=1e-9)
        carried = sum(part.constraint for part in parts.values()) / state.F
        assert carried == pytest.approx(found.constrained, abs=1e-12)
        assert (found.constrained == 0) == (is_feasible or name == "6-rus")
        # By limb: the rates of its rows, and the least squares of them by its actuators.
        rows = np.array([row.limb for row in each.program.model.rows])
        for limb, part in parts.items():
            assert sum(part) == pytest.approx(np.sum(state.rates[rows == limb] ** 2), rel=1e-9, abs=1e-12 * state.F)
            if limb not in {actuator.limb for actuator in each.program.model.actuators}:
                assert part.actuation == 0


def test_results_have_f_by_limb_and_name_conventions() -> None:
    case = starter("planar-3-rrr")
    result = result_of(solve(case, starts=1))
    joints = result.robot.joints
    assert joints.feasible is False
    assert sum(each.F for each in joints.limb_parts) == pytest.approx(result.F)
    assert joints.constrained == pytest.approx(sum(each.constraints for each in joints.limb_parts) / result.F)
    shown = list(case_summary(case, result))
    notes = [item.text for item in shown if isinstance(item, Line) and item.label == "note"]
    assert [note[:13] for note in notes if note.startswith("F depends")] == ["F depends on "] * 2
    assert f"1 % more of it changes F by {result.robot.length_dependence:+.2g} %" in " ".join(notes)
    (table,) = [item for item in shown if isinstance(item, TextTable) and item.name == "actuation"]
    assert [row[0] for row in table.rows] == ["1", "2", "3"]
    assert "actuation" in table_names(case, at_point=False)
    assert [item.name for item in case_tables(case, result)].count("actuation") == 1
    # A motion that is possible: the table is a file's only, and no convention is named.
    case = starter("6-ups")
    result = result_of(solve(case, starts=1))
    assert result.robot.joints.feasible is True
    assert not [item for item in case_summary(case, result) if isinstance(item, TextTable) and item.name == "actuation"]
    assert [item.name for item in case_tables(case, result)].count("actuation") == 1


def test_members_of_which_f_says_little_are_named() -> None:
    assert [note for note in robot_function("planar-3-rrr")().remarks if "says little" in note] == []
    (five_bar,) = [note for note in robot_function("five-bar")().remarks if "says little" in note]
    assert five_bar.startswith("member 1 resists with 5 wrenches or more")
    joints = [
        {"type": "R", "at": [0, 0, 0], "axis": "z", "actuated": True},
        {"type": "R", "at": [1, 0, 0], "axis": "y", "actuated": True},
        {"type": "R", "at": [1, 0, 1], "axis": "y"},
        {"type": "S", "at": [2, 0, 1]},
    ]
    (arm,) = [note for note in robot(name="arm", home=(2, 0, 1), limb=[{"joints": joints}]).remarks if "little" in note]
    assert arm.startswith("the robot has one member only")


def test_the_page_shows_notes_and_parts_by_limb() -> None:
    case = starter("five-bar")
    page = report(solve(case, starts=1))
    assert "Note: member 1 resists with 5 wrenches or more" in page
    assert "Actuation and constraints in F, limb by limb" in page


def test_rows_have_the_names_of_their_members() -> None:
    model = robot_function("delta")()
    members = [each.name for each in model.structure]
    assert [row.member for row in model.rows] == members == ["1.1", "1.2", "2.1", "2.2", "3.1", "3.2"]
    case = Case(
        model,
        {item.name: item.typical[0] for item in model.parameters},
        (0, 0, Free(-1.3, -1.2)),
        [Task(np.array([0, 0, 0, 0, 0, 1.0]))],
    )
    result = result_of(solve(case, starts=1))
    assert list(result.robot.members) == members
    assert [name.partition(".")[0] for name in members] == list(result.robot.limbs)
    tables = {item.name: item for item in case_tables(case, result)}
    assert [row[0] for row in tables["limbs"].rows] == members
    assert len({row.member for row in robot_function("3-rps")().rows}) == 3  # one member a limb, with two rows
