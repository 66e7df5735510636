"""The unit beside every number shown, and the poses that a table speaks of."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from builders import Run, case_from, output_of, starter_tables, unbroken

from screwsynth.models import Dimension
from screwsynth.nlp import Solution, load_case, result_of, solve
from screwsynth.nlp.output.pictures.figures import figure_of
from screwsynth.nlp.output.pictures.solutions import drawings_of
from screwsynth.nlp.units import Units, rate_unit, slope_unit


@pytest.fixture(scope="module")
def delta() -> Solution:
    tables = starter_tables("delta")
    tables["solve"]["starts"] = 2
    tables["limits"] = {"actuator_rate": {"max": 4.0}, "rate_share": {"max": 0.9}}
    return solve(case_from(tables, "delta"))


def test_every_rate_of_a_motor_has_the_unit_of_its_coordinate_and_of_the_motion(delta: Solution) -> None:
    text = delta.table(width=120)
    # The motors of a Delta turn: 4 radians per radian is its limit, and no wrench has the rate of a motor.
    assert len(re.findall(r"\d: [-+][\d.]+ rad/rad", text)) == 3
    assert re.search(r"actuator_rate.max +4 +rad/rad +4 .*active +\+[\d.]+ F/\(rad/rad\)", text)
    assert re.search(r"^ +work rate", text, re.MULTILINE)
    (side,) = {each.unit for each in result_of(delta).optimality.active if each.name.startswith("actuator_rate")}  # type: ignore[union-attr]
    assert side == "rad/rad"
    (bar,) = [axes.get_ylabel() for axes in figure_of(drawings_of(delta)).axes if "rate" in axes.get_ylabel()]
    assert bar == "work rate of each limb, m/rad"
    for word in ("F/unit", "per unit"):
        assert word not in text


def test_units_of_rates_and_slopes() -> None:
    turn, way, other = np.eye(6)[2], np.eye(6)[5], 2 * np.eye(6)[2]
    units = Units("mm", "deg")
    found = [
        [rate_unit(twist, units, each) for each in (Dimension.LENGTH, Dimension.ANGLE)] for twist in (turn, way, other)
    ]
    assert found == [["mm/rad", "rad/rad"], ["mm/mm", "rad/mm"], ["mm per unit of time", "rad per unit of time"]]
    assert [slope_unit(each) for each in ("mm", "", None, "rad/rad")] == ["F/mm", "F per 1", "F per 1", "F/(rad/rad)"]


@pytest.mark.slow
def test_tables_over_a_workspace_say_at_which_poses_they_hold(cli: Run) -> None:
    out = unbroken(output_of(cli("solve", "hexapod-workspace", "--starts", "2", "--all")))
    titles = re.findall(r"^(?:tightest )?limits (?:over|at).*", out, re.MULTILINE)
    stated = "limits at the stated pose, and where a pose of the workspace became a constraint of its limit"
    assert len(titles) == 2
    assert titles[0].startswith(stated)
    assert titles[1].startswith("tightest limits over every pose")
    # At the stated pose the joints are mounted straight: that the table says 0 degrees is true of that pose alone.
    assert out.index(titles[0]) < out.index("base_joint_angle.max")


def test_a_point_of_a_case_over_a_workspace_says_that_its_limits_are_of_that_point(cli: Run) -> None:
    _, out, _ = cli("evaluate", "hexapod-workspace")
    assert "limits at the stated pose, not over the workspace" in unbroken(out)
    _, out, _ = cli("evaluate", "hexapod-machining")
    assert "limits at" not in out
    assert load_case("hexapod-machining").workspace is None


def test_rounding_of_wrenches_and_displacements_of_a_load_is_shown_as_zero() -> None:
    """On its axis the platform of a Delta goes straight down, without a turn, and no limb holds a part of its load."""
    tables = starter_tables("delta")
    tables["robot"]["actuator_stiffness"] = 1000.0
    tables["pose"] = {"position": [0, 0, -1]}
    tables["robot"]["parameters"] = {"rb": 0.164, "rp": 0.044, "arm": 0.524, "rod": 1.244, "w": 0.131, "tilt": 20}
    tables["load"] = [{"name": "part", "mass": 1}]
    tables.pop("limits", None)
    found = solve(case_from(tables, "delta"))
    (load,) = result_of(found).robot.loading.loads
    held = np.array([each.wrench for each in load.constraints])
    assert 0 < np.abs(held).max() < 1e-12  # all digits are in JSON
    text = found.table(width=120)
    tables_of = {
        title: text.partition(title)[2].splitlines() for title in ("wrenches of the limbs'", "displacement of")
    }
    rows = [[row.split() for row in lines if row.startswith("part ")] for lines in tables_of.values()]
    assert [row[2:] for row in rows[0][:3]] == [["0"] * 6] * 3
    assert rows[1][0][-3:] == ["0"] * 3


def test_violated_limits_have_units(cli: Run) -> None:
    settings = ("p_x=0", "p_y=0", "p_z=700", "limits.platform_joint_angle.max=10", "limits.actuator_rate.max=0.5")
    arguments = ("evaluate", "drilling-spindle", *(word for each in settings for word in ("--set", each)))
    rows = json.loads(cli(*arguments, "--json", "-")[1])["violated"]
    units = {"joint_spacing": "mm", "leg_length": "mm", "platform_joint_angle": "deg", "actuator_rate": "mm/mm"}
    assert {(row["name"].split()[0], row["unit"]) for row in rows} == set(units.items())
    status, out, _ = cli(*arguments)
    shown = re.findall(r"^violated: (\S+)[^=]* = (.*?), must be at (?:most|least) (.*)$", unbroken(out), re.MULTILINE)
    assert (status, len(shown) > 5) == (1, True)
    for name, *numbers in shown:
        assert all(re.fullmatch(rf"[\d.]+ {units[name]}", each) for each in numbers), name
    # A plain number has none.
    _, out, _ = cli("evaluate", "hexapod-machining", "--set", "limits.radius_ratio.max=0.1")
    assert re.search(r"^violated: radius_ratio = 0\.43\d+, must be at most 0\.1$", out, re.MULTILINE)
