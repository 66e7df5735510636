"""Robots given joint by joint: units of starters, cases written and read again, and a parallelogram that is driven."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import EACH_KIND, case_from

import screwsynth.models
from screwsynth.models import Dimension, robot, robot_function
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import Case, Free, JointMotion, Limits, Task, evaluate, formulate
from screwsynth.nlp.case.robotfile import check_form
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.starter.text import starter_case

METRES = {"3-puu", "6-rss", "6-sps", "delta", "delta-parallelogram", "five-bar"}


def test_starters_say_the_unit_of_the_robot_file() -> None:
    files = {name: tables_of(name).get("length_unit", "") for name in gallery_names()}
    assert files == {name: "m" if name in METRES else "" for name in gallery_names()}
    for name, unit in (("delta", "m"), ("3-rps", "unit"), ("stewart-gough", "cm")):
        starter = starter_case(robot_function(name)())
        assert tomllib.loads(starter)["units"]["length"] == unit
        assert f", {unit}\n" in starter  # beside a dimension


def tables_of(name: str) -> dict[str, object]:
    path = Path(screwsynth.models.__file__).parent / "robots" / f"{name}.toml"
    return tomllib.loads(path.read_text(encoding="utf-8"))


def with_tuples(value: object) -> object:
    """The value with tuples in the place of lists, as people write them in Python."""
    if isinstance(value, dict):
        return {key: with_tuples(each) for key, each in value.items()}
    return tuple(with_tuples(each) for each in value) if isinstance(value, list) else value


@pytest.mark.parametrize("name", EACH_KIND)
def test_a_robot_in_python_is_written_and_read_again(name: str) -> None:
    tables = tables_of(name)
    model = robot(**{key: with_tuples(value) for key, value in tables.items()})
    values = {item.name: item.typical[0] for item in model.parameters}
    case = Case(model, values, model.home, [Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]))], name=name)
    text = case.to_toml()
    written = tomllib.loads(text)["robot"]["definition"]
    assert written == tables
    check_form(written)
    if name == "delta":
        again = case_from(text, name)
        assert again.to_toml() == text
        assert again.model.length_unit == "m"


def test_the_default_home_is_written_too() -> None:
    joints = [
        {"type": "U", "at": (1, 0, -1), "axes": ("x", "y")},
        {"type": "P", "at": (1, 0, -1), "axis": "-z", "actuated": True},
        {"type": "S", "at": (1, 0, 0)},
    ]
    model = robot("legs", limb=({"repeat": {"count": 3}, "joints": tuple(joints)},))
    case = Case(model, {}, (0, 0, 0), [Task(np.array([0, 0, 0, 0, 0, 1.0]))], name="legs")
    assert case_from(case.to_toml(), "legs").model.home == (0, 0, 0)


def test_a_driven_limb_that_resists_nothing_is_refused_in_one_sentence() -> None:
    leg = {"points": {"B": (1, 0, 0), "A": (0.5, 0.4, 1)}, "repeat": {"count": 3}}
    leg["joints"] = [
        {"type": "U", "at": "B", "axes": ["x", "y"]},
        {"type": "P", "at": "B", "axis": "A-B", "actuated": True},
        {"type": "S", "at": "A"},
    ]
    idle = {
        "points": {"B": (0, 0, 0), "A": (0, 0, 1)},
        "joints": [
            {"type": "R", "at": "B", "axis": "x", "actuated": True},
            {"type": "U", "at": "B", "axes": ["x", "y"]},
            {"type": "P", "at": "B", "axis": "A-B"},
            {"type": "S", "at": "A"},
        ],
    }
    with pytest.raises(ValueError, match=r"^limb 2: has an actuated joint that drives nothing, .* remove actuated"):
        robot("idle", home=(0, 0, 1), limb=[leg, idle])


def test_a_driven_parallelogram_has_a_way_and_a_rate_in_length() -> None:
    # A platform on one parallelogram that is driven, and two legs that do not matter: it swings on a circle.
    rod = 2.0
    limb = [
        {"joints": [{"type": "Pa", "at": (0, 0, 0), "to": (0, 0, rod), "axis": "y", "actuated": True}]},
    ]
    model = robot("swing", home=(0, 0, rod), limb=limb)
    (quantity,) = model.quantities
    (actuator,) = model.actuators
    assert (quantity.name, quantity.dimension) == ("actuator_length", Dimension.LENGTH)
    assert actuator.dimension is Dimension.LENGTH
    (coordinate,) = model.joints[0].coordinates
    assert coordinate.dimension is Dimension.LENGTH
    angle, step = 0.4, 1e-6
    position = [Free(-2, 2), 0.0, Free(0, 3)]

    def way(turn: float) -> float:
        case = Case(model, {}, position, [Task(np.array([0, 0, 0, math.cos(angle), 0, -math.sin(angle)]))])
        nlp = formulate(replace(case, limits=Limits(JointMotion("1:1", max=rod))))
        x = np.array(nlp.start)
        x[0], x[1], x[2] = rod * math.sin(turn), rod * math.cos(turn), turn
        x = close_equations(nlp, x)
        state = evaluate(nlp, x)
        mobility = mobility_of(nlp, x, state)
        assert mobility is not None
        if turn == angle:  # unit speed along the circle
            assert mobility.actuator_rates["1"] == pytest.approx(1)
        return float(state.quantities["actuator_length"][0])

    assert way(angle) == pytest.approx(rod * angle)
    # The rate of the way is the speed along the circle.
    assert (way(angle + step) - way(angle - step)) / (2 * step * rod) == pytest.approx(1, rel=1e-6)
