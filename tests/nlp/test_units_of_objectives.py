"""Units of what is optimised: the same case in degrees and in radians has the same numbers in every result."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from builders import Run, case_from, rows_of, saved

from screwsynth.nlp import Case, case_from_tables, certify, json_data, result_of, solve, tradeoff, tradeoff_result
from screwsynth.nlp.front.goals import program_of, read_goals
from screwsynth.nlp.results.evidence import certified_of
from screwsynth.nlp.solver.multistart import solve_program

DEGREES = 180 / math.pi
#: A Delta of which the motors that turn are to be slow, and an end of their range holds it back.
DELTA = """\
[units]
angle = "UNIT"
[robot]
model = "delta"
parameters = { rb = RB, rp = 0.044, arm = { min = 0.3, max = 0.6 }, rod = { min = 0.9, max = 1.2 }, w = 0.131, tilt = TILT }
[[pose]]
position = [0.2, 0, -0.9]
[[pose]]
position = [-0.1, 0.2, -0.9]
[motion]
linear = 5
[limits]
actuator_angle = { min = LOW, max = HIGH }
actuator_speed = { max = FAST }
[objective]
minimise = "actuator_speed"
[solve]
starts = 1
"""  # noqa: E501 - a table of TOML is one line
UNITS = {"deg": 1.0, "rad": math.pi / 180}


def delta(unit: str, high: float = 15.0, base: float = 0.164) -> str:
    """The case in a unit of angles, its numbers given in degrees."""
    numbers = {"TILT": 20.0, "LOW": -60.0, "HIGH": high, "FAST": 2000.0}
    text = DELTA.replace("UNIT", unit).replace("RB", repr(base))
    for name, value in numbers.items():
        text = text.replace(name, repr(value * UNITS[unit]))
    return text


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
    fixed = [case_from(delta("deg").replace("max = 0.6 }", f"max = {0.6 + way * step} }}")) for way in (-1, 1)]
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
        curve = tradeoff(lambda value, unit=unit: case_at(value, unit), steps, name=over)
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
        case, out, data = saved(tmp_path / f"{unit}.toml", delta(unit)), tmp_path / f"{unit}.csv", tmp_path / "data"
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
        assert found[unit]["multipliers"][0] == pytest.approx(
            [side.multiplier for side in single.optimality.active], rel=1e-6, abs=1e-9
        )


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
    tables = {
        "units": {"angle": unit},
        "robot": {"definition": {"name": "pivot", "limb": [{"joints": [joint]}]}},
        "pose": {"position": [0, 0, 0], "rotation": {"axis": [0, 0, 1], "angle": angle}},
        "motion": {"angular": 90 * factor},
        "objective": {"minimise": "actuator_speed"},
    }
    return case_from_tables(tables, name="pivot", source="here")


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
