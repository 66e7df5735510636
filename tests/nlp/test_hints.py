"""Slips of people, each of which is answered by the nearest right thing."""

import tomllib
from pathlib import Path

import pytest
from builders import Run, edited, refusal_of, saved, saved_with_robot, starter_text

from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.system.slips import hint_of, toml_slips

CASE = find_case("paper-4.1-helical").read_text(encoding="utf-8")
ROBOT = (Path(__file__).parents[2] / "cases" / "robots" / "reachy-mini-head.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("solve", "paper-4.2", "--set", "limits.leg_lenght.max=5"), "did you mean 'leg_length'? it has leg_length,"),
        (("solve", "--hlep"), "--hlep: no such option of solve; did you mean '--help'?"),
        (("--hlep",), "--hlep: no such option of screwsynth; did you mean '--help'?"),
        (("solve", "delta"), "delta: is a robot, not a case; screwsynth new delta > my-delta.toml writes a case of it"),
        (("workspace", "stewart-gough"), "is a robot, not a case"),
        (("models", "paper-4.2"), 'robot.model = "paper-4.2": no such robot; this is a case'),
        (("compare", "paper-4.2", "case", "paper-4.3"), "and no such robot file; this is a case"),
        (("help",), "help: no such command; write screwsynth --help"),
        (("help", "solve"), "help: no such command; write screwsynth solve --help"),
        (("version",), "version: no such command; write screwsynth --version"),
        (("my.toml",), "my.toml: no such command; a case stands behind a command, as in screwsynth solve my.toml"),
        (("paper-4.2", "--all"), "as in screwsynth solve paper-4.2"),
        (("delta",), "this is a robot: screwsynth models delta shows it, screwsynth new delta writes a case of it"),
        (("slove",), "did you mean 'solve'?"),
        (("solve", "paper-4.2", "--set", "x1=12,5"), "must be NAME=NUMBER, or axis=X,Y,Z; write 12.5: a decimal"),
        (("solve", "paper-4.2", "--set", "x1=12 cm"), "; write 12: a number stands without its unit"),
        (("solve", "paper-4.2", "--time", "10s"), "--time 10s: must be a number; write 10: a number stands"),
    ],
    ids=lambda given: " ".join(given) if isinstance(given, tuple) else "",
)  # fmt: skip
def test_the_nearest_right_thing_is_named(arguments: tuple[str, ...], words: str, cli: Run) -> None:
    refusal_of(cli(*arguments), words)


def test_files_of_another_kind_are_named(tmp_path: Path, cli: Run) -> None:
    named = saved_with_robot(tmp_path, ROBOT, edited(starter_text("6-rus"), ('"6-rus"', '"robot.toml"')))
    words = (
        'robot.model = "robot.toml": no such robot; a robot file is named by file = "robot.toml", in the place of model'
    )
    refusal_of(cli("solve", named), words)
    robot, case = str(tmp_path / "robot.toml"), str(saved(tmp_path / "mine.toml", CASE))
    refusal_of(cli("solve", robot), 'is a robot file, and not a case; [robot] file = "robot.toml" in a case reads it')
    for arguments in (("models", case), ("new", case), ("compare", "paper-4.2", "case", case)):
        refusal_of(cli(*arguments), "is a case, and not a robot file; screwsynth solve takes it")


def test_units_and_decimal_commas_in_toml_are_named_with_their_lines(tmp_path: Path, cli: Run) -> None:
    lines = ["[robot]", 'model = "stewart-gough"', "[robot.parameters]", "x1 = 12 cm   # 3 mm", "x2 = 8,5"]
    path = saved(tmp_path / "case.toml", "\n".join([*lines, "x3 = { min = 3, max = 4deg }"]))
    slips = (
        "line 4: 12 cm has a unit, write 12",
        "line 5: 8,5 has a decimal comma, write 8.5",
        "line 6: 4deg has a unit",
    )
    refusal_of(cli("solve", str(path)), f"case.toml: is not valid TOML: {'; '.join(slips)}")
    robot = saved(tmp_path / "robot.toml", edited(ROBOT, ("typical = 0.062000021955292826", "typical = 62 mm")))
    refusal_of(
        cli("models", str(robot)), "robot.toml: the file: is not valid TOML: line 19: 62 mm has a unit, write 62"
    )
    # Another fault is told in the reader's words.
    other = saved(tmp_path / "case.toml", 'a = "x\nx1 = 12 cm\n')
    refusal_of(cli("solve", str(other)), "Illegal character", "(at line 1, column 7)")
    table = saved(tmp_path / "points.csv", "x1\n12\n13 mm\n")
    arguments = ("sweep", "paper-4.2", "--over", str(table), "--out", str(tmp_path / "out.csv"))
    refusal_of(cli(*arguments), "'13 mm': must be a finite number; write 13: a number stands without its unit")
    table = saved(tmp_path / "poses.csv", 'x,y,z\n1,2,"3,5"\n')
    refusal_of(
        cli("inverse", "hexapod-linuxcnc", "--poses", str(table)),
        "must be a number; write 3.5: a decimal number has a point",
    )


@pytest.mark.parametrize(
    "text",
    [
        "a = 1e5", "b = 0x1f", "d = 1979-05-27T07:32:00Z", "a = {x = 1,2 = 3}", 'a = "12 cm, 1,5"', "a = [1,5, 2,5]",
        "a = -inf", "a = 3 # 12 cm", "a = [1, 2,\n3]",
    ],
)  # fmt: skip
def test_what_is_valid_holds_no_slip(text: str) -> None:
    assert tomllib.loads(text)
    assert list(toml_slips(text)) == []


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = -1,25", "-1,25"), ("a = 30°", "30°"), ("a = 5 m/s", "5 m/s"), ("a = 1.5e3mm", "1.5e3mm"),
        ("a = 2 N m", "2 N m"), ("a = [1 mm, 2]", "1 mm"),
    ],
)  # fmt: skip
def test_slips(text: str, words: str) -> None:
    with pytest.raises(tomllib.TOMLDecodeError):
        tomllib.loads(text)
    ((line, fault),) = toml_slips(f"\n{text}")
    assert line == 2
    assert fault.startswith(f"line 2: {words} has ")


@pytest.mark.parametrize("text", ["x", "1e5", "1,2,3", "nan", "", "1;5"])
def test_a_text_that_is_no_slip_has_no_hint(text: str) -> None:
    assert hint_of(text) == ""
