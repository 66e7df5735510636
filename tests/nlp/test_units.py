"""Results are the same in every unit of length: each number up to its power of the unit, and each word."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator
from decimal import Decimal
from importlib.resources import files
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import EACH_KIND, Run, case_file, case_from, case_tables, output_of, saved, soaked, starter_tables
from measures import scaled
from numpy_engine.first_order import enclose
from numpy_engine.quadratic_models import multipliers
from numpy_engine.second_order import enclose_second

from screwsynth.models import Dimension, Model, robot, robot_function
from screwsynth.models.catalog import SHIPPED
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, Outcome, certify, json_data, judge_workspace, pareto, result_of, solve
from screwsynth.nlp.case.reader import load_case, read_case
from screwsynth.nlp.case.toml import toml_document
from screwsynth.nlp.evidence import state
from screwsynth.nlp.evidence.assembly import assembly_at, unknowns_from_home
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.workingmode import Posture
from screwsynth.nlp.front.goals import program_of, read_goals
from screwsynth.nlp.output.report.designs import designs_page
from screwsynth.nlp.path.reader import read_path
from screwsynth.nlp.program.formulation import formulate_each
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.enclosure.tape import compile_tape
from screwsynth.nlp.proof.statement.standard_form import standard_form
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.results.evaluation import evaluation_of
from screwsynth.nlp.results.rounding import ordered
from screwsynth.nlp.results.workspace import WorkspaceResult, workspace_of
from screwsynth.nlp.sweeps.columns import sweep_designs
from screwsynth.nlp.sweeps.journal import Row
from screwsynth.nlp.sweeps.points import CaseSource, Points
from screwsynth.nlp.sweeps.sweep import Sweep
from screwsynth.nlp.words.numbers import residual
from screwsynth.nlp.words.summary import case_summary, evaluation_summary
from screwsynth.nlp.words.text import Line, TextTable
from screwsynth.nlp.words.workspace import workspace_summary

Tables = dict[str, Any]
Make = Callable[[Case], tuple[object, Iterable[Line | TextTable]]]

#: Lengths of each unit in a metre.
UNITS = {"m": 1.0, "mm": 1e3, "inch": 1 / 0.0254, "um": 1e6}
ROBOTS = (*SHIPPED, *EACH_KIND)
#: Robots whose platform does not turn.
TRANSLATIONS = ("3-puu", "3-upu", "delta", "delta-parallelogram")
#: Numbers that time changes, and words of this machine.
EFFORT = re.compile(r"(^|\.)seconds$|\.(case|screwsynth|versions)\.?")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:,\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?(?!\w|\.\d)")


def tables_of(model: Model, unit: str) -> Tables:
    """The starter of a robot, whose lengths are metres, in another unit."""
    tables, f = starter_tables(model), UNITS[unit]
    tables["units"]["length"] = unit
    tables["solve"]["starts"] = 4
    for item in model.parameters:
        if item.dimension is Dimension.LENGTH:
            tables["robot"]["parameters"][item.name] = scaled(tables["robot"]["parameters"][item.name], f)
    if model.has_couples:
        tables["robot"]["characteristic_length"] *= f
    tables["pose"]["position"] = scaled(tables["pose"]["position"], f)
    for task in tables["task"]:
        task["point"], task["pitch"] = scaled(task["point"], f), scaled(task["pitch"], f)
    return tables


def leaves(value: object, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict | list | tuple):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, each in items:
            yield from leaves(each, f"{path}.{key}")
    elif not EFFORT.search(path):
        yield path, value


def words(text: str, unit: str) -> str:
    """A text without its numbers and its unit of length."""
    text = re.sub(rf"(?<![A-Za-z]){unit}(?![A-Za-z_])", "LENGTH", text)
    return " ".join(NUMBER.sub("#", text).split())


def lines(items: Iterable[Line | TextTable]) -> list[str]:
    found = []
    for item in items:
        if isinstance(item, Line):
            found.append(f"{item.label}: {item.words}")
            continue
        rows = [item.headers, *item.rows]
        found += [" | ".join(each.words if isinstance(each, Line) else str(each) for each in row) for row in rows]
        found.append(f"{item.title} {item.folded}")
    return [re.sub(r"in [\d.]+ s\b", "in a time", each) for each in found]


def numbers(text: str, unit: str) -> list[str]:
    return [each.replace(",", "") for each in NUMBER.findall(re.sub(rf"(?<![A-Za-z]){unit}(?![A-Za-z_])", "", text))]


def last_place(text: str, digits: int) -> float:
    """One unit in the last of so many significant digits."""
    return 10.0 ** (math.floor(math.log10(abs(float(text)))) - digits + 1)


def is_same(one: str, other: str, f: float) -> bool:
    """Whether printed numbers agree, to one unit in the last place of the longer one, up to a power of the unit."""
    a, b = float(one), float(other)
    if a * b <= 0:
        return a == b == 0
    power = round(math.log(b / a) / math.log(f))
    digits = max(len(Decimal(each).as_tuple().digits) for each in (one, other))
    off = max(last_place(one, digits) * f**power, last_place(other, digits))
    return abs(power) <= 4 and abs(b - a * f**power) <= 1.01 * off


def units_of(name: str) -> tuple[str, ...]:
    """Metres and another unit, in turn, so that all robots together have every unit."""
    return "m", [*UNITS][1 + ROBOTS.index(name) % (len(UNITS) - 1)]


def check(model: Model, make: Make, units: Iterable[str] = tuple(UNITS), within: float = 1e-6) -> None:
    """Hold the data and the text of a robot in each unit to those in metres."""
    found = {}
    for unit in units:
        case = case_from(tables_of(model, unit), model.name)
        data, text = make(case)
        found[unit] = dict(leaves(data)), lines(text)
    for unit in [each for each in found if each != "m"]:
        (first, text), (other, other_text), f = found["m"], found[unit], UNITS[unit]
        assert [words(each, unit) for each in other_text] == [words(each, "m") for each in text]
        for one, each in zip(text, other_text, strict=True):
            pairs = zip(numbers(one, "m"), numbers(each, unit), strict=True)
            assert all(is_same(a, b, f) for a, b in pairs), (unit, one, each)
        assert other.keys() == first.keys()
        for key, a in first.items():
            b = other[key]
            if isinstance(a, str) and isinstance(b, str):
                assert words(b, unit) == words(a, "m"), key
            elif a is None or isinstance(a, bool) or isinstance(b, str):
                assert a == b, key
            elif not (abs(a) < 1e-8 and abs(b) < 1e-8 * f**2):
                assert a * b > 0, key
                power = round(math.log(b / a) / math.log(f))
                assert b == pytest.approx(a * f**power, rel=within), key
                assert abs(power) <= 4, key


def evaluated(case: Case) -> tuple[object, Iterable[Line | TextTable]]:
    programs = formulate_each(case)
    x = closed_start(programs[0])
    found = evaluation_of(programs, x, [state.evaluate(each, x) for each in programs])
    return json_data(found), evaluation_summary(case, found)


def solved(case: Case) -> tuple[object, Iterable[Line | TextTable]]:
    found = result_of(solve(case))
    return json_data(found), case_summary(case, found)


def some(*names: str, robots: Iterable[str] = ROBOTS) -> object:
    """Names of robots of which only these are fast."""
    return pytest.mark.parametrize("name", soaked([*names, *(each for each in robots if each not in names)], names))


@pytest.mark.parametrize("name", ROBOTS)
def test_a_point_is_the_same_in_every_unit(name: str) -> None:
    check(robot_function(name)(), evaluated)


@some("hexapod", "3-rps", "3-puu")
def test_a_solve_is_the_same_in_every_unit(name: str) -> None:
    check(robot_function(name)(), solved, units_of(name))


def fixed_over_box(model: Model, unit: str, part: float, degrees: float) -> Tables:
    """A robot with fixed dimensions over poses about its home: a part of its size, and angles up to this."""
    tables, f = tables_of(model, unit), UNITS[unit]
    sizes = [abs(each) for item in model.parameters if item.dimension is Dimension.LENGTH for each in item.typical]
    half = part * max(*map(abs, model.home), *sizes) * f
    for key, value in tables["robot"]["parameters"].items():
        several = value if isinstance(value, list) else [value]
        fixed = [(each["min"] + each["max"]) / 2 if isinstance(each, dict) else each for each in several]
        tables["robot"]["parameters"][key] = fixed if isinstance(value, list) else fixed[0]
    middle = scaled(list(model.home), f)
    tables["pose"] = {"position": middle}
    tables["workspace"] = {"position": [{"min": each - half, "max": each + half} for each in middle]}
    if model.name not in TRANSLATIONS:
        tables["workspace"]["rotation"] = {key: {"min": -degrees, "max": degrees} for key in ("roll", "pitch", "yaw")}
    return tables


@some("stewart-gough", "3-rps")
def test_a_workspace_is_the_same_in_every_unit(name: str) -> None:
    model = robot_function(name)()

    def judged(case: Case) -> tuple[object, Iterable[Line | TextTable]]:
        tables, f = fixed_over_box(model, case.units.length, 0.01, 1.0), UNITS[case.units.length]
        if model.legs:
            tables["limits"] = {"leg_length": {"min": 10 * f, "max": 90 * f}}
        if model.legs and name not in ("4-upu", "6-ups"):
            # Legs of these cross, or have a joint in common: of their distance rounding is left.
            tables["limits"] |= {"leg_clearance": {"min": 0.1 * f}}
        held = case_from(tables, name)
        found = workspace_of(judge_workspace(held))
        assert found.regular.outcome.name == "PROVED"
        # What follows is reached at symmetric poses alike, or is 0 but for rounding.
        kept = tuple(each for each in found.extremes if each.name not in (found.dependent or ()))
        found = WorkspaceResult.of(found, extremes=kept, dependent=None, poses=None)
        return json_data(found), workspace_summary(held, found)

    check(model, judged, units_of(name))


@pytest.mark.parametrize("name", ["stewart-gough", "hexapod"])
def test_the_search_for_singular_poses_takes_the_same_boxes_in_every_unit(name: str) -> None:
    model, counts = robot_function(name)(), set()
    for unit in UNITS:
        case = case_from(fixed_over_box(model, unit, 0.2, 25.0), name)
        found = judge_workspace(case, with_limits=False).regularity
        counts.add((found.outcome, found.boxes, found.open))
    assert len(counts) == 1


@some("3-rps", "five-bar", robots=(*SHIPPED, "6-rus", "delta", "exechon", "spherical-3-rrr", "tricept"))
def test_a_certificate_takes_the_same_boxes_in_every_unit(name: str) -> None:
    model = robot_function(name)()

    def less(value: Any) -> Any:  # noqa: ANN401 - a part of a table
        if isinstance(value, list):
            return [less(each) for each in value]
        if not isinstance(value, dict):
            return value
        middle, half = (value["max"] + value["min"]) / 2, (value["max"] - value["min"]) / 40
        return {"min": middle - half, "max": middle + half}

    counts, bounds = set(), []
    for unit in units_of(name):
        tables, f = tables_of(model, unit), UNITS[unit]
        tables["pose"] = {"position": less(tables["pose"]["position"])}
        if name not in TRANSLATIONS:
            tables["pose"]["rotation"] = {"angle": {"min": -1, "max": 1}}
        tables["robot"]["parameters"] = {key: less(value) for key, value in tables["robot"]["parameters"].items()}
        case = case_from(tables, name)
        found = certify(case, gap=0.02, starts=2).tasks[0]
        assert found.status is CertificateStatus.PROVED, unit
        counts.add((standard_form(found.nlp).names, found.boxes))
        best = found.incumbent / f**2
        assert best <= found.bound / f**2 <= 1.02 * best
        bounds.append(found.bound / f**2)
    assert len(counts) == 1
    assert bounds == pytest.approx([bounds[0]] * len(bounds), rel=1e-9)


@pytest.mark.parametrize("length", [ca.norm_2, lambda x: ca.fmax(x[0] - x[1], 0)])
def test_the_rounding_of_a_length_grows_with_its_unit(length: Callable[[ca.SX], ca.SX]) -> None:
    """Errors that are parts of a length are 2^20 times as many units where the unit is so much smaller."""
    x = ca.SX.sym("x", 2)
    tape = compile_tape(ca.Function("length", [x], [length(x)]))
    low, high = np.array([[0.7], [0.9]]), np.array([[1.1], [1.0]])
    for forms in (enclose, enclose_second):
        first, other = forms(tape, low, high), forms(tape, 2.0**20 * low, 2.0**20 * high)
        assert other.s == pytest.approx(2.0**20 * first.s, rel=1e-6)


def test_a_condition_whose_gradient_is_rounding_has_no_weight() -> None:
    gradients = np.array([[[1.0], [0.5]], [[1e-18], [2e-18]], [[0.5], [0.25]]])
    rounding = np.full((3, 2, 1), 1e-15)
    high, equation = np.ones((3, 1)), np.array([False, True, True])
    assert multipliers(gradients, rounding, high, equation, 1).ravel().tolist() == [1.0, 0.0, -2.0]


def test_rounding_has_no_digits_and_decides_on_no_order_or_optimum() -> None:
    assert residual(4.6e-17) == residual(0.0) == "below 1e-12"
    assert residual(2.34e-9) == "2.3e-09"
    assert ordered(0.8339443) == ordered(0.8339443 * (1 + 1e-12))
    assert ordered(0.8339443) < ordered(0.83395)
    # Optima with the same F are named in the order of the starts.
    case = case_from(tables_of(robot_function("tripteron")(), "m"), "t")
    solution = solve(case)
    best = solution.optima[0]
    first = next(each for each in solution.starts if abs(each.F - best.F) <= 1e-9 * best.F)
    assert np.array_equal(best.x, first.x)
    points = Points(("x4",), np.array([[5.0]]))
    sweep = Sweep.of(CaseSource.from_file(read_case("paper-4.1-helical")), points)
    row = Row(0, "optimal", 1.0, x=tuple(1.234e-17 for _ in sweep.variables))
    assert "1.234e-17" not in designs_page(sweep_designs(sweep, [row]))


def with_other_task(model: Model, unit: str) -> Case:
    tables = tables_of(model, unit)
    task = tables["task"][0] | {"name": "task"}
    tables["task"] = [task, task | {"name": "other", "axis": [1, 0, 0]}]
    return case_from(tables, model.name)


def test_a_bound_of_F_on_a_front_is_of_the_same_size_in_every_unit() -> None:  # noqa: N802 - the objective's name
    sizes = []
    for unit, f in UNITS.items():
        case = with_other_task(robot_function("hexapod")(), unit)
        nlp = program_of(case, read_goals(["max F:task", "min F:other"], case), 0, (None, 178 * f**2)).nlp
        assert nlp.program.constraints[-1].reading.from_value(nlp.g_upper[-1]) == pytest.approx(178 * f**2)
        sizes.append(nlp.row_sizes[-1])
    assert sizes == pytest.approx([sizes[0]] * len(UNITS))
    assert 0.1 < sizes[0] < 10


@pytest.mark.slow
@pytest.mark.parametrize("name", soaked(["hexapod", "3-puu", "five-bar"], ["five-bar"]))
def test_a_front_is_the_same_in_every_unit(name: str) -> None:
    fronts = []
    for unit, f in ((unit, UNITS[unit]) for unit in units_of(name)):
        found = pareto(with_other_task(robot_function(name)(), unit), ["max F:task", "min F:other"], points=3, starts=4)
        fronts.append([point.values / f**2 for point in found.points])
    assert all(np.allclose(fronts[0], front, rtol=1e-6) for front in fronts)


#: A linear Delta, mm: radius of the rails, half width of a parallelogram, radius of the platform, height of the rods.
RAIL, HALF, RADIUS, HEIGHT = 234.8, 30.0, 0.0, 408.301310309
#: Lengths of one unit, in millimetres.
LENGTHS = {"um": 1e-3, "mm": 1.0, "in": 25.4, "m": 1e3, "km": 1e6}


def point_at(azimuth: float, out: float, across: float, height: float, unit: float) -> list[float]:
    c, s = math.cos(azimuth), math.sin(azimuth)
    return [(c * out - s * across) / unit, (s * out + c * across) / unit, height / unit]


def case_of_robot(
    folder: Path, limbs: list[dict[str, Any]], home: list[float], box: list[tuple[float, float]], **tables: object
) -> Case:
    """The case of a robot file over a box of positions."""
    saved(folder / "robot.toml", toml_document({"name": "literal", "home": home, "limb": limbs}))
    tables |= {"pose": {"position": home}, "task": [{"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}]}
    tables |= {"workspace": {"position": [{"min": low, "max": high} if low < high else low for low, high in box]}}
    return load_case(str(case_file(folder, case_tables({"file": "robot.toml", "parameters": {}}, **tables))))


def linear_delta(folder: Path, unit: float) -> Case:
    """The case of the robot in a unit, with a workspace and limits of the same sizes."""
    limbs = []
    for k in range(3):
        azimuth = 2 * math.pi * k / 3
        ends = [
            [point_at(azimuth, out, side, height, unit) for out, height in ((RAIL, HEIGHT), (RADIUS, 0))]
            for side in (HALF, -HALF)
        ]
        rods = [{"joints": [{"type": "S", "at": end} for end in rod]} for rod in ends]
        slide = {"type": "P", "at": point_at(azimuth, RAIL, 0, HEIGHT, unit), "axis": "z", "actuated": True}
        limbs.append({"joints": [slide], "branch": rods})
    limits = {"actuator_length": {"min": -90 / unit, "max": 90 / unit}}
    box = [(-half / unit, half / unit) for half in (50, 50, 20)]
    return case_of_robot(folder, limbs, [0, 0, 0], box, units={"length": "any"}, limits=limits)


@pytest.mark.parametrize("units", [("um", "mm", "km"), pytest.param(tuple(LENGTHS), marks=pytest.mark.soak)])
def test_a_robot_of_literal_numbers_has_the_same_verdicts_in_every_unit(units: tuple[str, ...], tmp_path: Path) -> None:
    found = [judge_workspace(linear_delta(tmp_path, LENGTHS[unit]), jobs=1) for unit in units]
    ends = []
    for judged in found:
        assert judged.is_proved
        assert {each.outcome for each in judged.extremes} == {Outcome.PROVED}
        ends.append([each.bound for each in judged.extremes if each.name == "F"])
    # F of a translation does not depend on the unit; its bounds are found to 1e-3.
    assert len(ends[0]) == 2
    np.testing.assert_allclose(ends, [ends[1]] * len(units), rtol=2e-3)


def test_a_structure_with_fewer_than_six_rows_is_singular_at_every_pose(tmp_path: Path) -> None:
    feet = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1)]
    ends = [(x, y, 0.4 * y - 0.5 * x, -0.5 * y + 0.1) for x, y in feet]
    limbs = [
        {"joints": [
            {"type": "S", "at": [x, y, 0]},
            {"type": "P", "at": [x, y, 0], "axis": [a, b, 1], "actuated": True},
            {"type": "S", "at": [x + a, y + b, 1]},
        ]}
        for x, y, a, b in ends
    ]  # fmt: skip
    for count in (5, 3):
        case = case_of_robot(tmp_path, limbs[:count], [0, 0, 1], [(-0.1, 0.1), (-0.1, 0.1), (0.9, 1.1)])
        judged = judge_workspace(case, time_limit=5)
        assert judged.regularity.outcome is Outcome.REFUTED
        assert "below six at all dimensions and poses" in judged.regularity.reason


def test_the_condition_number_of_a_planar_robot_on_a_path_is_proved_in_each_unit(tmp_path: Path) -> None:
    """Where an inverse of J is zero, rounding decides nothing: in metres all was proved, in micrometres not."""
    found = []
    for unit in (LENGTHS["um"], LENGTHS["in"], LENGTHS["m"]):
        rail, at = [1000 / unit, -300 / unit, 0], [175 / unit, 303.1088913245535 / unit, 0]
        slide = {"type": "P", "at": rail, "axis": "y", "actuated": True}
        limb = {
            "repeat": {"count": 3},
            "joints": [slide, *({"type": "R", "at": each, "axis": "z"} for each in (rail, at))],
        }
        robot = {"file": "robot.toml", "parameters": {}, "characteristic_length": 350 / unit}
        limits = {"condition_number": {"max": 2.6, "length": 350 / unit}}
        box = [*[(-60 / unit, 60 / unit)] * 2, (0.0, 0.0)]
        case = case_of_robot(tmp_path, [limb], [0, 0, 0], box, units={"length": "any"}, limits=limits, robot=robot)
        points = [[0, 0], [24, 12], [-18, 30], [6, -24]]
        rows = "".join(f"{x / unit!r},{y / unit!r},0,{t}\n" for t, (x, y) in enumerate(points))
        judged = judge_path(case, read_path(saved(tmp_path / "path.csv", "x,y,z,t\n" + rows), case.units))
        (number,) = [each for each in judged.extremes if each.name == "condition_number"]
        assert number.outcome is Outcome.PROVED
        found.append(number.bound)
    np.testing.assert_allclose(found, found[0], rtol=1e-9)


def test_the_assembly_of_a_robot_whose_home_is_the_origin_is_the_same_in_every_unit(tmp_path: Path) -> None:
    found = []
    for unit in LENGTHS.values():
        limbs = []
        for k in range(3):
            axis, other = np.roll([1.0, 0, 0], k), np.roll([0, 1.0, 0], k)
            ends = [[side * 30 * other + far * axis for far in (240, 0)] for side in (1, -1)]
            rods = [{"joints": [{"type": "S", "at": (end / unit).tolist()} for end in rod]} for rod in ends]
            at, along = (240 * axis / unit).tolist(), axis.tolist()
            slide = {"type": "P", "at": at, "axis": along, "actuated": True}
            limbs.append({"joints": [slide], "branch": rods})
        model = case_of_robot(tmp_path, limbs, [0, 0, 0], [(-1 / unit, 1 / unit)] * 3, units={"length": "any"}).model
        at = np.array([-60.0, 60.0, 60.0]) / unit
        unknowns = unknowns_from_home(model, np.zeros(0), np.concatenate([np.zeros(3), at]))
        assembly = assembly_at(model, Posture(np.zeros(0), unknowns, np.eye(3), at))
        assert assembly.is_home
        found.append(assembly.nearness)
    assert 0.1 < found[0] <= 1
    np.testing.assert_allclose(found, found[0], rtol=1e-6)


def test_the_force_that_a_limit_bounds_is_that_of_the_load_in_every_unit(cli: Run, tmp_path: Path) -> None:
    """Minors of six rows are ninth powers of a length: beside them nothing is small by itself."""
    found, out = [], tmp_path / "out.json"
    for unit in LENGTHS.values():
        tables = case_tables(
            {"model": "stewart-gough", "layout": "octahedral"}
            | {"parameters": {"x1": 300 / unit, "x2": 120 / unit, "x3": 0, "x4": 5}},
            units={"length": "any", "force": "N"},
            pose={"position": [10 / unit, 20 / unit, 220 / unit]},
            task=[{"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
            load=[{"any": {"force": 20, "moment": 300 / unit}, "point": [0, 0, 50 / unit]}],
            motion={"linear": 50 / unit, "angular": 20},
            limits={"actuator_force": {"max": 400}, "actuator_speed": {"max": 1e3 / unit}},
        )
        output_of(cli("evaluate", str(case_file(tmp_path, tables)), "--json", str(out)))
        data = json.loads(out.read_text(encoding="utf-8"))
        force, speed = (row["value"] for row in data["limits"])
        assert force == pytest.approx(max(each["largest"] for each in data["loads"][0]["actuators"]), rel=1e-9)
        assert speed == pytest.approx(max(each["value"] for each in data["speeds"]), rel=1e-9)
        found.append([force, speed * unit])
    np.testing.assert_allclose(found, [found[0]] * len(LENGTHS), rtol=1e-9)


@pytest.mark.parametrize("name", ["6-pus", "3-puu", "6-ups"])
def test_slides_follow_in_closed_form_in_every_unit(name: str) -> None:
    """The coefficient of a squared slide is the inverse of a squared length: small in small units."""
    text = (files("screwsynth.models") / "robots" / f"{name}.toml").read_text(encoding="utf-8")
    found = []
    for unit in UNITS.values():
        definition = tomllib.loads(text)
        for item in definition["dimensions"].values():
            item["typical"] *= 1.0 if item.get("kind") == "angle" else unit
        found.append([each.name for each in closed_form(robot(**definition)).model.unknowns])
    assert found == [found[0]] * len(UNITS)
