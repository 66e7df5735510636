"""Refusals of cases and tables along a path: one sentence with file, key, value and what is allowed, and no output."""

from __future__ import annotations

from pathlib import Path

import pytest
from builders import Run
from test_schedules import _PER_PATH, _written

_RADIUS = ("x1 = 26.5", 'x1 = { min = 18, max = 34, per = "path", rate = 0.5 }')
_OUTPUTS = ("--json", "r.json", "--csv", "r.csv", "--plot", "p.png", "--schedule", "s.csv")
_HOME = (
    "[limits]\nleg_length = { min = 17, max = 43 }",
    '[limits]\nbase_joint_angle = { max = 60, about = "home" }\nhome = { position = [0, 0, 20] }',
)
_TURN = "turn = { min = -75, max = 75, rate = 5 }"


def _turn(text: str) -> list[tuple[str, str]]:
    return [(_TURN, f"turn = {{ {text} }}")]


#: Changes of the case, and words of the refusal.
_CASES: list[tuple[list[tuple[str, str]], str]] = [
    ([_HOME, _PER_PATH],
     'case.toml: limits.base_joint_angle.about = "home": home has no x3, which changes along the path'),
    (_turn("min = 75, max = -75, rate = 5"), "path.tool.turn.min = 75.0: must be below max = -75 deg"),
    (_turn("min = 75, max = 75, rate = 5"), "path.tool.turn.min = 75.0: must be below max = 75 deg"),
    (_turn("min = nan, max = 75, rate = 5"), "path.tool.turn.min = nan: must be finite"),
    (_turn("min = -75, max = inf, rate = 5"), "path.tool.turn.max = inf: must be finite"),
    (_turn("min = -75, max = 75, rate = -inf"), "path.tool.turn.rate = -inf: must be positive, or inf for no limit"),
    (_turn("min = -75, max = 75, rate = 5, start = 90"), "path.tool.turn.start = 90.0: must be between -75 deg and 75"),
    ([("x3 = 0", 'x3 = { min = 9, max = 2, per = "path", rate = 1 }')],
     "robot.parameters.x3.min = 9.0: must be below max = 2 deg"),
    ([("x3 = 0", 'x3 = { min = 0, max = 9, per = "path", rate = 0 }')],
     "robot.parameters.x3.rate = 0.0: must be positive, or inf for no limit"),
    ([("x3 = 0", 'x3 = { min = 0, max = 9, per = "way", rate = 1 }')],
     "robot.parameters.x3.per = \"way\": must be one of 'task', 'path' or 'pose'"),
    ([("[limits]", "[limits]\nactuator = { stroke_max = -3 }")], "limits.actuator.stroke_max = -3.0: must be above 0"),
    ([("[limits]", "[limits]\nactuator = { stroke_max = nan }")], "limits.actuator.stroke_max = nan: must be finite"),
]  # fmt: skip


def _is_refused(cli: Run, *arguments: str) -> str:
    """Return the message of a command that is refused and leaves no file."""
    before = {*Path().iterdir()}
    code, out, err = cli(*arguments)
    assert (code, out) == (2, "")
    assert "Traceback" not in err
    assert {*Path().iterdir()} == before
    return " ".join(err.split())


@pytest.mark.parametrize(("changes", "words"), _CASES, ids=[words[:50] for _, words in _CASES])
def test_cases_are_refused_without_output(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch, changes: list[tuple[str, str]], words: str
) -> None:
    _written(tmp_path, *changes)
    monkeypatch.chdir(tmp_path)
    message = _is_refused(cli, "solve", "case.toml", *_OUTPUTS)
    assert message.startswith("screwsynth: case.toml: ")
    assert words in message


def test_three_settings_are_refused_without_output(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    _written(tmp_path, _PER_PATH, _RADIUS)
    monkeypatch.chdir(tmp_path)
    words = "certify: bounds schedules of at most two changing numbers; this case has 3: x1, x3, turn; fix one of them"
    assert f"case.toml: {words}" in _is_refused(cli, "solve", "case.toml", "--certify", *_OUTPUTS)
    words = "path: codegen has tables for one value that changes along the path; this case has 3: x1, x3, turn"
    assert f"case.toml: {words}" in _is_refused(cli, "codegen", "case.toml", "--out", "build")
    goals = ("--goal", "max F", "--goal", "min limits.leg_length.max")
    words = 'objective.as = "mean": x1 changes along the path, but this command takes one robot; use solve'
    assert words in _is_refused(cli, "pareto", "case.toml", *goals, "--csv", "front.csv")


#: Tables of the path of a case, and words of the refusal.
_TABLES = {
    "": "hexapod-yaw.csv: has no rows: expected a first row with the names of the columns, then rows of values",
    "t,x,y,z\n": "hexapod-yaw.csv: there is no path: fewer than two points",
    "t,x,y,z\n0,9,3,20\n": "hexapod-yaw.csv: there is no path: fewer than two points",
    "t,x,y,z,yy\n0,9,3,20,1\n1,8,3,20,1\n": "hexapod-yaw.csv: row 1: no such column, 'yy'; did you mean 'y'?",
    "t,x,y,z\n1,9,3,20\n0,8,3,20\n": "hexapod-yaw.csv: row 3, column t = 0.0: must be later than that of the",
    "t,x,y,z\n1,9,3,20\n1,8,3,20\n": "hexapod-yaw.csv: row 3, column t = 1.0: must be later than that of the",
    "t,x,y,z\nnan,9,3,20\n1,8,3,20\n": "hexapod-yaw.csv: row 2, column t = nan: must be finite",
    "t,x,y,z\n0,9,3,inf\n1,8,3,20\n": "hexapod-yaw.csv: row 2, column z = inf: must be finite",
    "t,x,y,z\n0,9,3,\n1,8,3,20\n": "hexapod-yaw.csv: row 2, column z: must be a number, got an empty cell",
}


@pytest.mark.parametrize("table", _TABLES)
def test_paths_are_refused_without_output(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch, table: str
) -> None:
    _written(tmp_path)
    (tmp_path / "hexapod-yaw.csv").write_text(table)
    monkeypatch.chdir(tmp_path)
    assert _TABLES[table] in _is_refused(cli, "solve", "case.toml", *_OUTPUTS)


#: Rows of x1, turn and time of a schedule, and words of the refusal.
_SCHEDULES = {
    ("26,0,0", "35,0,30"): "part.csv: row 3, column x1: 35 is above its max 34",
    ("26,-76,0", "26,0,30"): "part.csv: row 2, column turn: -76 is below its min -75",
    ("26,0,0", "26.9,0,0.1"): "part.csv: row 3: x1 changes by 0.9 in 0.1 s, more than its rate 0.5",
    ("26,0,0", "nan,0,10"): "part.csv: row 3, column x1 = nan: must be finite and at most 1e+30 in magnitude",
    ("26,0,0", "inf,0,10"): "part.csv: row 3, column x1 = inf: must be finite and at most 1e+30 in magnitude",
    ("26,0,5", "26,0,5"): "part.csv: row 3, column t = 5.0: must be later than that of the",
    ("26,0,0", "26,,60"): "part.csv: row 3, column turn: must be a number, got an empty cell",
    ("26,0,0", "26,0"): "part.csv: row 3: must have 10 cells, got 9",
    ("26,0,0",): "part.csv: there is no path: fewer than two points",
}


@pytest.mark.parametrize("rows", _SCHEDULES, ids=" ".join)
def test_schedules_are_refused_without_output(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch, rows: tuple[str, ...]
) -> None:
    _written(tmp_path, _RADIUS)
    monkeypatch.chdir(tmp_path)
    lines = [f"{9 - k},3,20,1,0,0,0,{row}" for k, row in enumerate(rows)]
    Path("part.csv").write_text("\n".join(["x,y,z,qw,qx,qy,qz,x1,turn,t", *lines]) + "\n")
    refusal = _is_refused(cli, "path", "case.toml", "--along", "part.csv", "--json", "r.json")
    assert _SCHEDULES[rows] in refusal
