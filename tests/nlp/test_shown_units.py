"""Units: numbers of the same case in degrees and radians in every result, and the unit beside every number shown."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Run, case_file, case_from, case_of, case_tables, output_of, rows_of, starter_tables, unbroken

from screwsynth.models import Dimension
from screwsynth.nlp import Case, certify, json_data, load_case, result_of, solve, tradeoff, tradeoff_result
from screwsynth.nlp.front.goals import program_of, read_goals
from screwsynth.nlp.output.pictures.figures import figure_of
from screwsynth.nlp.output.pictures.solutions import drawings_of
from screwsynth.nlp.results.evidence import certified_of
from screwsynth.nlp.solver.multistart import solve_program
from screwsynth.nlp.units import Units, rate_unit, slope_unit

DEGREES = 180 / math.pi
UNITS = {"deg": 1.0, "rad": math.pi / 180}


def delta(unit: str, high: float = 15.0, base: float = 0.164, longest: float = 0.6) -> dict[str, Any]:
    """A Delta whose motors are to be slow, held back by an end of their range; angles given in degrees."""
    f, arm, rod = UNITS[unit], {"min": 0.3, "max": longest}, {"min": 0.9, "max": 1.2}
    return case_tables(
        {
            "model": "delta",
            "parameters": {"rb": base, "rp": 0.044, "arm": arm, "rod": rod, "w": 0.131, "tilt": 20.0 * f},
        },
        units={"angle": unit},
        pose=[{"position": [0.2, 0, -0.9]}, {"position": [-0.1, 0.2, -0.9]}],
        motion={"linear": 5},
        limits={"actuator_angle": {"min": -60.0 * f, "max": high * f}, "actuator_speed": {"max": 2000.0 * f}},
        objective={"minimise": "actuator_speed"},
        solve={"starts": 1},
    )


def ratios(degrees: object, radians: object, name: str = "") -> Iterator[tuple[str, float]]:
    """Yield each number of the case in degrees as a part of that in radians, with the last key that leads to it."""
    assert type(degrees) is type(radians), name
    if isinstance(degrees, dict) and isinstance(radians, dict):
        assert degrees.keys() == radians.keys()
        for key in degrees:
            yield from ratios(degrees[key], radians[key], key)
    elif isinstance(degrees, list) and isinstance(radians, list):
        assert len(degrees) == len(radians), name
        for one, other in zip(degrees, radians, strict=True):
            yield from ratios(one, other, name)
    elif isinstance(degrees, float) and isinstance(radians, float) and min(abs(degrees), abs(radians)) > 1e-8:
        yield name, degrees / radians


def parts_of(found: dict[str, Any], name: str) -> list[float]:
    """The ratios of the numbers with a name in the results of both units."""
    numbers = [ratio for key, ratio in ratios(found["deg"], found["rad"]) if key == name]
    assert numbers, name
    return numbers


def test_every_number_of_a_solve_is_in_the_unit_of_the_case() -> None:
    found = {unit: json.loads(json.dumps(json_data(result_of(solve(case_from(delta(unit))))))) for unit in UNITS}
    assert parts_of(found, "F") == pytest.approx([DEGREES] * 4, rel=1e-6)  # the optimum, that of a start, of two poses
    assert found["deg"]["objective"]["value"] == pytest.approx(found["deg"]["F"])
    # A cost is per degree of an angle, and a slope per metre of a length.
    kinds = {unit: {row["unit"] for row in found[unit]["limits"] if row["active"]} for unit in UNITS}
    assert kinds == {"deg": {"deg"}, "rad": {"rad"}}
    assert parts_of(found, "cost") == pytest.approx([1.0] * 2, rel=1e-6)
    slopes = zip(*(found[unit]["sensitivity"] for unit in UNITS), strict=True)
    for one, other in slopes:
        if "derivative" in one and abs(one["derivative"]) > 1e-6:
            wanted = 1.0 if one.get("unit") == "deg" else DEGREES
            assert one["derivative"] / other["derivative"] == pytest.approx(wanted, rel=1e-6), one["name"]
    (arm,) = (row for row in found["deg"]["optimality"]["active"] if row["name"] == "arm")
    step = 1e-4
    fixed = [case_from(delta("deg", longest=0.6 + way * step)) for way in (-1, 1)]
    low, high = (solve(case).F for case in fixed)
    assert arm["multiplier"] == pytest.approx((low - high) / (2 * step), rel=1e-4)


@pytest.mark.parametrize("over", ["rb", "limits.actuator_angle.max"])
def test_values_and_slopes_of_a_tradeoff_are_in_the_unit_of_the_case(over: str) -> None:
    values = [0.16, 0.162, 0.164] if over == "rb" else [14.9, 15.0, 15.1]

    def case_at(value: float, unit: str) -> Case:
        given = {"base": value} if over == "rb" else {"high": value / UNITS[unit]}
        return case_from(delta(unit, **given))

    found = {}
    for unit, steps in (("deg", values), ("rad", [values[1] * (1.0 if over == "rb" else UNITS["rad"])])):
        curve = tradeoff(lambda value, unit=unit: case_at(value, unit), {over: steps})
        found[unit] = json_data(tradeoff_result(curve))["points"]
    # The slope in the middle is that of the values beside it.
    before, here, after = found["deg"]
    (other,) = found["rad"]
    assert here["F"] / other["F"] == pytest.approx(DEGREES, rel=1e-6)
    assert here["tasks"] == [here["F"]]
    assert here["slope"] / other["slope"] == pytest.approx(DEGREES if over == "rb" else 1.0, rel=1e-6)
    step = (after["F"] - before["F"]) / (values[2] - values[0])
    assert here["slope"] == pytest.approx(step, rel=1e-3)


def test_every_number_of_a_sweep_is_in_the_unit_of_the_case(cli: Run, tmp_path: Path) -> None:
    found, csv = {}, {}
    for unit in UNITS:
        case = case_file(tmp_path, delta(unit), f"{unit}.toml")
        out, data = tmp_path / f"{unit}.csv", tmp_path / "data"
        command = ("sweep", str(case), "--over", "rb=0.16:0.164:2", "--out", str(out), "--json", str(data))
        code, said, _ = cli(*command)
        assert code == 0
        found[unit], csv[unit] = json.loads(data.read_text()), rows_of(out.read_text())
        assert f"F from {float(csv[unit][0]['F']):.7g}" in said
        assert [float(row["F"]) for row in csv[unit]] == found[unit]["F"]
        sides = zip(found[unit]["multipliers"], csv[unit], strict=True)
        assert all([*map(repr, each)] == row["multipliers"].split("; ") for each, row in sides)
    assert parts_of(found, "F") == pytest.approx([DEGREES] * 2, rel=1e-6)
    for unit in UNITS:
        single = result_of(solve(case_from(delta(unit, base=0.16))))
        assert found[unit]["F"][0] == pytest.approx(single.F, rel=1e-9)
        multipliers = pytest.approx([side.multiplier for side in single.optimality.active], rel=1e-6, abs=1e-9)
        assert found[unit]["multipliers"][0] == multipliers


@pytest.mark.parametrize("optimised", [0, 1])
def test_a_limit_on_an_angle_as_a_goal_is_in_the_unit_of_the_case(optimised: int) -> None:
    texts, numbers, sides = ("min limits.actuator_speed.max", "max limits.actuator_angle.min"), [], []
    for unit in UNITS:
        case = case_from(delta(unit))
        program = program_of(case, read_goals(texts, case), optimised, (None, None))
        found = solve_program(program.nlp, case.search)
        dimension = program.readings[optimised][0].dimension
        stated = case.units.shown(float(program.measure(found.x)[optimised]), dimension)
        assert pytest.approx(stated, rel=1e-6) == found.F
        assert found.evidence is not None
        assert found.evidence.kind.is_optimum
        names = [f"{side.name} {side.bound}" for side in found.evidence.active]
        numbers.append(found.F)
        sides.append(dict(zip(names, found.evidence.multipliers_in(case.units), strict=True)))
    assert numbers[0] / numbers[1] == pytest.approx(DEGREES, rel=1e-6)
    # An angle by a length has the unit of the angle.
    assert sides[0]["arm max"] > 1
    assert sides[0]["arm max"] / sides[1]["arm max"] == pytest.approx(DEGREES, rel=1e-4)


def pivot(unit: str) -> Case:
    """One motor whose axis is that of the platform's only rotation, and has the platform's speed of 90 deg/s."""
    joint, factor = {"type": "R", "at": "0*x", "axis": "z", "actuated": True}, UNITS[unit]
    angle = {"min": -30 * factor, "max": 30 * factor}
    return case_of(
        {"definition": {"name": "pivot", "limb": [{"joints": [joint]}]}},
        units={"angle": unit},
        pose={"position": [0, 0, 0], "rotation": {"axis": [0, 0, 1], "angle": angle}},
        motion={"angular": 90 * factor},
        objective={"minimise": "actuator_speed"},
    )


@pytest.mark.parametrize("unit", UNITS)
def test_a_certificate_is_in_the_unit_of_the_case(unit: str) -> None:
    certified = certify(pivot(unit), gap=1e-3)
    data = certified_of(certified)
    speed = 90 * UNITS[unit]
    assert data.certificate is not None
    assert data.objective is not None
    assert certified.is_proved
    for value in (data.certificate.incumbent, data.objective.value):
        assert value == pytest.approx(speed, rel=1e-6)
    for bound in (data.certificate.bound, data.objective.bound):
        assert speed * (1 - 1e-3) <= bound <= speed * (1 + 1e-6)
    assert f"smaller than {data.certificate.bound:.10g}" in data.certificate.statement


def test_every_rate_of_a_motor_has_the_unit_of_its_coordinate_and_of_the_motion() -> None:
    limits = {"actuator_rate": {"max": 4.0}, "rate_share": {"max": 0.9}}
    solution = solve(case_of("delta", solve={"starts": 2}, limits=limits))
    text = solution.table(width=120)
    # The motors of a Delta turn: 4 radians per radian is its limit, and no wrench has the rate of a motor.
    assert len(re.findall(r"\d: [-+][\d.]+ rad/rad", text)) == 3
    assert re.search(r"actuator_rate.max +4 +rad/rad +4 .*active +\+[\d.]+ per rad/rad", text)
    assert re.search(r"^ +work rate", text, re.MULTILINE)
    (side,) = {each.unit for each in result_of(solution).optimality.active if each.name.startswith("actuator_rate")}  # type: ignore[union-attr]
    assert side == "rad/rad"
    (bar,) = [axes.get_ylabel() for axes in figure_of(drawings_of(solution)).axes if "rate" in axes.get_ylabel()]
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
    titles = re.findall(r"^(?:limits with|checked at).*", out, re.MULTILINE)
    stated = "checked at the stated pose and at workspace poses that were added as constraints"
    assert len(titles) == 2
    assert titles[0].startswith(stated)
    assert titles[1].startswith("limits with the smallest margin over all poses")
    # At the stated pose the joints are mounted straight: that the table says 0 degrees is true of that pose alone.
    assert out.index(titles[0]) < out.index("base_joint_angle.max")


def test_a_point_of_a_case_over_a_workspace_says_that_its_limits_are_of_that_point(cli: Run) -> None:
    _, out, _ = cli("evaluate", "hexapod-workspace")
    assert "checked at the stated pose only, not over the workspace" in unbroken(out)
    _, out, _ = cli("evaluate", "hexapod-machining")
    assert "checked at" not in out
    assert load_case("hexapod-machining").workspace is None


def test_rounding_of_wrenches_and_displacements_of_a_load_is_shown_as_zero() -> None:
    """On its axis the platform of a Delta goes straight down, without a turn, and no limb holds a part of its load."""
    tables = starter_tables("delta")
    tables["robot"]["actuator_stiffness"] = 1000.0
    tables["robot"]["parameters"] = {"rb": 0.164, "rp": 0.044, "arm": 0.524, "rod": 1.244, "w": 0.131, "tilt": 20}
    tables |= {"pose": {"position": [0, 0, -1]}, "load": [{"name": "part", "mass": 1}]}
    found = solve(case_from(tables, "delta"))
    (load,) = result_of(found).robot.loading.loads
    held = np.array([each.wrench for each in load.constraints])
    assert 0 < np.abs(held).max() < 1e-12  # all digits are in JSON
    text = found.table(width=120)
    tables_of = {
        title: text.partition(title)[2].splitlines()
        for title in ("constraint wrenches of the limbs", "displacement of")
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
