"""Dimensions with which a robot does not exist: every command names the line of its file, and the argument there."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from builders import Run, case_from, edited, refusal_of, saved, saved_with_robot, starter_tables
from casadi import SX

from screwsynth.models.expression import NoValueError, evaluate
from screwsynth.nlp import CaseError, CertificateStatus, EvaluationError, certify, load_case, solve
from screwsynth.nlp.errors import NoRobotError
from screwsynth.nlp.solver.status import Status

#: Three vertical slides, rods and a platform that does not turn.
ROBOT = """
name = "linear delta"
home = [0, 0, 0]
[dimensions]
dr = { typical = 234.8 }
rod = { typical = 471 }
lean = { kind = "angle", typical = 0 }
w = { typical = 60 }
[derived]
short = "dr*cos(lean)"
h = "sqrt(rod^2 - short^2)"
[[limb]]
repeat = { count = 3 }
points = { C = ["dr", 0, "h"], A = [0, 0, 0] }
joints = [{ type = "P", at = "C", axis = "z", actuated = true }]
branch = [
    { joints = [{ type = "S", at = "C + w/2*y" }, { type = "S", at = "A + w/2*y" }] },
    { joints = [{ type = "S", at = "C - w/2*y" }, { type = "S", at = "A - w/2*y" }] },
]
"""
CASE = """
[units]
length = "mm"
[robot]
file = "robot.toml"
parameters = { dr = 120, rod = 100, lean = 0, w = 50 }
[pose]
position = [0, 0, 0]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
condition_number = { max = 20, length = 50 }
[workspace]
position = [{ min = -6, max = 6 }, { min = -6, max = 6 }, { min = 0, max = 10 }]
"""
FIXED = "rod = 100"
WORDS = ("derived, h is 'sqrt(rod^2 - short^2)'", "the argument of sqrt, rod^2 - short^2 = -4400, must be at least 0")
VALUES = "here rod = 100 mm, short = 120"


def changed(folder: Path, rod: str) -> str:
    return saved_with_robot(folder, ROBOT, edited(CASE, (FIXED, f"rod = {rod}")))


def test_every_command_names_the_line_and_its_values(tmp_path: Path, cli: Run) -> None:
    path = saved_with_robot(tmp_path, ROBOT, CASE)
    points = saved(tmp_path / "points.csv", "x,y,z\n0,0,1\n5,0,1\n")
    program = saved(tmp_path / "p.gcode", "G21 G90\nG1 X0 Y0 Z0 F1200\nG1 X5\nM2\n")
    out = str(tmp_path / "out.csv")
    for command in (
        ("evaluate", path), ("solve", path), ("workspace", path), ("certify", path), ("report", path, "--out", out),
        ("path", path, "--along", str(program)), ("inverse", path, "--poses", str(points)), ("check", path),
        ("sweep", path, "--over", "dr=80:90:2", "--out", out), ("tradeoff", path, "--over", "w=50,60"),
        ("codegen", path, "--out", out), ("export", path, "--out", out, "--format", "mjcf"),
        ("workspace", path, "--scale"),
    ):  # fmt: skip
        refusal_of(cli(*command), "case.toml: robot.parameters", *WORDS, VALUES)
    assert not Path(out).exists()


def test_a_robot_file_is_read_at_its_typical_dimensions(tmp_path: Path, cli: Run) -> None:
    robot = saved(tmp_path / "robot.toml", edited(ROBOT, ("typical = 471", "typical = 200")))
    for command in ("new", "models"):
        refusal_of(cli(command, str(robot)), "derived, h: is", "rod^2 - short^2 = -15131.04, must be at least 0")


@pytest.mark.parametrize(("robot", "dimension"), [("6-rss", "rod"), ("3-puu", "rod"), ("delta", "rod")])
def test_robots_of_the_gallery_name_their_line_too(robot: str, dimension: str) -> None:
    tables = starter_tables(robot)
    for name, value in tables["robot"]["parameters"].items():
        tables["robot"]["parameters"][name] = value if not isinstance(value, dict) else value["min"]
    tables["robot"]["parameters"][dimension] = 1e-3
    with pytest.raises(
        NoRobotError, match=rf"derived, \w+ is '.*sqrt\(.*must be at least 0; here .*{dimension} = "
    ) as error:
        case_from(tables)
    assert isinstance(error.value, CaseError)


def test_free_dimensions_have_the_robot_where_it_exists(tmp_path: Path) -> None:
    # The middle of the range is no robot, and the starting points that are one are enough.
    found = solve(load_case(changed(tmp_path, "{ min = 60, max = 150 }")), starts=16)
    assert found.status is Status.OPTIMAL
    # The rates of vertical slides in a vertical translation are 1, and each limb has two rods: F = 6 (h / rod)^2.
    assert abs(found.F - 6 * (1 - (120 / 150) ** 2)) <= 1e-9
    with pytest.raises(
        EvaluationError, match="rod\\^2 - short\\^2 = -5375, must be at least 0; here rod = 95 mm, short = 120"
    ):
        solve(load_case(changed(tmp_path, "{ min = 90, max = 100 }")), starts=4)


@pytest.mark.parametrize("values", [[90, 100, 150, 140], [*range(40, 160, 5), 150.5]])
def test_a_catalogue_leaves_out_what_does_not_exist(values: list[float], tmp_path: Path) -> None:
    case, best = load_case(changed(tmp_path, f"{{ values = {values} }}")), max(values)
    found = solve(case, starts=2)
    assert found.status.is_answer
    assert abs(found.F - 6 * (1 - (120 / best) ** 2)) <= 1e-9
    if len(values) < 5:
        proved = certify(found)
        assert proved.certificate.status is CertificateStatus.PROVED
        assert proved.certificate.bound == pytest.approx(found.F, rel=1e-3)


def test_a_catalogue_of_nothing_that_exists_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NoRobotError, match="here rod = 90 mm"):
        solve(load_case(changed(tmp_path, "{ values = [90, 100] }")), starts=2)


def test_points_of_a_sweep_without_a_robot_are_refused_rows(tmp_path: Path, cli: Run) -> None:
    path, out = changed(tmp_path, "{ min = 130, max = 150 }"), tmp_path / "out.csv"
    for engine in ((), ("--engine", "ipopt")):
        status, _, _ = cli(
            "sweep", path, "--over", "dr=90,120,160,170", "--starts", "2", "--jobs", "1", "--out", str(out), *engine
        )
        assert status == 0
        rows = list(csv.DictReader(out.read_text(encoding="utf-8").splitlines()))
        assert [each["status"] for each in rows] == ["optimal", "optimal", "refused", "refused"]
        assert "rod^2 - short^2 = -6000, must be at least 0; here rod = 140 mm, short = 160" in rows[2]["note"]
        for row in rows[:2]:
            assert float(row["F"]) == pytest.approx(6 * (1 - (float(row["dr"]) / 150) ** 2), rel=1e-8)
        out.unlink()


@pytest.mark.parametrize(
    ("text", "fault", "names"),
    [
        ("1/(a - b)", "the divisor a - b = 0 must not be 0", {"a", "b"}),
        ("unit(A - A)", "the argument of unit, A - A = (0, 0, 0), must not be 0", {"A"}),
        ("(a - 3)^(1/2)", "a - 3 = -1 has no power 1 / 2 = 0.5", {"a"}),
        ("2 + a*sqrt(sqrt(b - a) - b)*7", "the argument of sqrt, sqrt(b - a) - b = -2, must be at least 0", {"a", "b"}),
        ("1e300*1e300*a", "1e+300 * 1e+300 is not finite", set()),
    ],
)
def test_the_first_operation_without_a_value_is_named(text: str, fault: str, names: set[str]) -> None:
    with pytest.raises(NoValueError) as error:
        evaluate(text, {"a": SX(2), "b": SX(2), "A": SX([1, 2, 3])})
    assert str(error.value) == f"has no finite value: {fault}"
    assert set(error.value.values) == names
    # Other numbers, for which every operation has a value, are not refused.
    if names:
        value = evaluate("sqrt(a)*unit(A) + A/b", {"a": SX(4), "b": SX(2), "A": SX([3, 0, 4])})
        assert np.allclose(np.array(value.nz[:].elements(), dtype=float), [2.7, 0, 3.6])
    assert math.isfinite(float(evaluate("a/b", {"a": SX(1), "b": SX(2)})))
