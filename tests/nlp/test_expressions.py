"""Expressions in custom limits and robot files: values, refusals, and dimensions for which a robot does not exist."""

from __future__ import annotations

import math
import string
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from builders import Run, case_from, edited, refusal_of, rows_of, saved, saved_with_robot, starter_tables
from casadi import SX
from hypothesis import given, settings
from hypothesis import strategies as st

from screwsynth.models.expression import ExpressionError, NoValueError, evaluate
from screwsynth.nlp import CaseError, CertificateStatus, EvaluationError, certify, load_case, solve
from screwsynth.nlp.case.limits.relation import expression, parse
from screwsynth.nlp.errors import NoRobotError
from screwsynth.nlp.solver.status import Status

NAMES = {"x1": 3.0, "x2": 2.0, "base_1_x": -1.5, "angle": 30.0}


def difference(text: str, angle: float = 1.0) -> float:
    """Left side less right side at :data:`NAMES`."""
    relation, values = parse(text, NAMES, angle), {name: SX(value) for name, value in NAMES.items()}
    return float(expression(relation.left, values, angle) - expression(relation.right, values, angle))


MEANINGS = {
    "x1 - 1.5*x2 >= 0": 0.0,
    "x1 <= 2": 1.0,
    "2 == x2": 0.0,
    "-x1^2 >= 0": -9.0,
    "(-x1)^2 >= 0": 9.0,
    "2^3^2 >= 0": 512.0,
    "2^-1 >= 0": 0.5,
    "10 - 4 - 3 >= 0": 3.0,
    "12 / 3 / 2 >= 0": 2.0,
    "2 + 3 * x2 >= 1": 7.0,
    "(2 + 3) * x2 >= 1": 9.0,
    "sqrt(x1^2 + 16) >= abs(base_1_x)": 3.5,
    "--x1 >= +-x2": 5.0,
    "1e2*.5 >= 5.": 45.0,
    "x1^0.5 >= 0": math.sqrt(3),
    "  x1>=x2  ": 1.0,
}


def test_sentences_mean_what_they_mean_in_mathematics() -> None:
    assert {text: difference(text) for text in MEANINGS} == pytest.approx(MEANINGS, abs=1e-15)
    # Sine and cosine take the angles of the case.
    assert difference("sin(angle) >= cos(60)", math.radians(1)) == pytest.approx(0, abs=1e-15)
    assert difference("x1 >= sqrt(sin(150))", math.radians(1)) == pytest.approx(3 - math.sqrt(0.5), abs=1e-15)
    with pytest.raises(ExpressionError, match="gives no finite value"):
        parse("x1 >= sqrt(sin(190))", NAMES, math.radians(1))


def test_a_name_may_have_a_dot_where_the_case_has_such_a_name() -> None:
    names = ("p_x", "robot.p_x")
    relation = parse("robot.p_x - 2.5*p_x >= .5", names)
    assert float(expression(relation.left, {"p_x": SX(2), "robot.p_x": SX(7)})) == 2.0
    with pytest.raises(
        ExpressionError, match=r"'robot.p_y' at position 1 is not a quantity of this case; did you mean"
    ):
        parse("robot.p_y >= 0", names)
    for text in ("p_x.real >= 0", "robot. p_x >= 0", "robot.2 >= 0"):
        with pytest.raises(ExpressionError):
            parse(text, names)


REFUSED = {
    "": ("got the end at position 1",),
    "x1": (">=", "got the end at position 3"),
    "x1 > 0": ("'>' at position 4", "x1 »> 0"),
    "x1 => 0": ("'=' at position 4",),
    "x1 = 0": ("'=' at position 4",),
    "x1 - 1.5*y2 >= 0": ("'y2' at position 10 is not a quantity of this case", "allowed: x1, x2"),
    "x1 +* x2 >= 0": ("got '*' at position 5", "x1 +»* x2"),
    "x1 x2 >= 0": ("expected an operator", "got 'x2' at position 4"),
    "(x1 - x2 >= 0": ("closes the one at position 1", "got '>=' at position 10"),
    "x1) >= 0": ("got ')' at position 3",),
    "0 <= x1 <= 3": ("expected an operator or the end", "got '<=' at position 9"),
    "sqrt x1 >= 0": ('expected "(" after sqrt',),
    "__import__('os') >= 0": ('"\'" at position 12 is not allowed',),
    "__import__(x1) >= 0": ("'__import__' at position 1", "allowed:"),
    "x1.real >= 0": ("'.' at position 3",),
    "x1[0] >= 0": ("'[' at position 3",),
    "exp(x1) >= 0": ("'exp' at position 1", "allowed:"),
    "1e999 >= x1": ("finite number",),
    "x1 >= 0; x2 >= 0": ("';' at position 8",),
    "(" * 300 + "x1": ("at most 40 nested brackets",),
    "-" * 300 + "x1 >= 0": ("at most 40 nested brackets",),
    "1+" * 300 + "x1 >= 0": ("at most 400 characters",),
}


def test_a_wrong_sentence_is_refused_at_its_token() -> None:
    for text, parts in REFUSED.items():
        with pytest.raises(ExpressionError) as refused:
            parse(text, NAMES)
        assert all(part in str(refused.value) for part in parts), text


letters = st.text(alphabet="x12 ()+-*/^<>=.esqrtin_§²½" + string.digits, max_size=40)
pieces = st.lists(
    st.sampled_from(["x1", "x2", "3", "1.5", "(", ")", "+", "-", "*", "/", "^", ">=", "<=", "==", "sqrt", "abs(", " "]),
    max_size=25,
).map("".join)


@settings(max_examples=400, deadline=None)
@given(st.one_of(letters, pieces, st.text(max_size=30)))
def test_whatever_is_written_is_a_relation_or_is_refused(text: str) -> None:
    try:
        relation = parse(text, NAMES)
    except ExpressionError:
        return
    values = {name: SX.sym(name) for name in NAMES}
    whole = expression(relation.left, values) - expression(relation.right, values)
    assert whole.shape == (1, 1)
    assert {symbol.name() for symbol in ca.symvar(whole)} <= set(NAMES)


numbers = st.integers(1, 9).map(str)
sums = st.recursive(
    st.one_of(numbers, st.sampled_from(["x1", "x2"])),
    lambda inner: st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
    max_leaves=12,
)


@settings(max_examples=200, deadline=None)
@given(sums, sums)
def test_bracketed_sums_and_products_have_the_value_that_arithmetic_gives(left: str, right: str) -> None:
    expected = eval(left, {}, dict(NAMES)) - eval(right, {}, dict(NAMES))  # noqa: S307 - made above from digits
    assert difference(f"{left} >= {right}") == pytest.approx(expected, rel=1e-12, abs=1e-9)


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
units = { length = "mm" }
robot = { file = "robot.toml", parameters = { dr = 120, rod = 100, lean = 0, w = 50 } }
pose = { position = [0, 0, 0] }
task = [{ sense = "max", axis = [0, 0, 1], pitch = inf }]
limits = { condition_number = { max = 20, length = 50 } }
workspace = { position = [{ min = -6, max = 6 }, { min = -6, max = 6 }, { min = 0, max = 10 }] }
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


@pytest.mark.parametrize("robot", ["6-rss", "3-puu", "delta"])
def test_robots_of_the_gallery_name_their_line_too(robot: str) -> None:
    tables = starter_tables(robot)
    own = tables["robot"]["parameters"]
    own |= {name: value["min"] for name, value in own.items() if isinstance(value, dict)} | {"rod": 1e-3}
    words = r"derived, \w+ is '.*sqrt\(.*must be at least 0; here .*rod = "
    with pytest.raises(NoRobotError, match=words) as error:
        case_from(tables)
    assert isinstance(error.value, CaseError)


def test_free_dimensions_have_the_robot_where_it_exists(tmp_path: Path) -> None:
    # The middle of the range is no robot, and the starting points that are one are enough.
    found = solve(load_case(changed(tmp_path, "{ min = 60, max = 150 }")), starts=16)
    assert found.status is Status.OPTIMAL
    # The rates of vertical slides in a vertical translation are 1, and each limb has two rods: F = 6 (h / rod)^2.
    assert abs(found.F - 6 * (1 - (120 / 150) ** 2)) <= 1e-9
    words = r"rod\^2 - short\^2 = -5375, must be at least 0; here rod = 95 mm, short = 120"
    with pytest.raises(EvaluationError, match=words):
        solve(load_case(changed(tmp_path, "{ min = 90, max = 100 }")), starts=4)
    with pytest.raises(NoRobotError, match="here rod = 90 mm"):
        solve(load_case(changed(tmp_path, "{ values = [90, 100] }")), starts=2)


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


def test_points_of_a_sweep_without_a_robot_are_refused_rows(tmp_path: Path, cli: Run) -> None:
    path, out = changed(tmp_path, "{ min = 130, max = 150 }"), tmp_path / "out.csv"
    for engine in ((), ("--engine", "ipopt")):
        options = ("--over", "dr=90,120,160,170", "--starts", "2", "--jobs", "1", "--out", str(out), *engine)
        assert cli("sweep", path, *options)[0] == 0
        rows = rows_of(out.read_text(encoding="utf-8"))
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


def test_operations_with_a_value_are_not_refused() -> None:
    value = evaluate("sqrt(a)*unit(A) + A/b", {"a": SX(4), "b": SX(2), "A": SX([3, 0, 4])})
    assert np.allclose(np.array(value.nz[:].elements(), dtype=float), [2.7, 0, 3.6])
    assert float(evaluate("a/b", {"a": SX(1), "b": SX(2)})) == 0.5
