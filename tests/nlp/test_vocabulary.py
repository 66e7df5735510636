"""Words of the command line: one name for one option, and the nearest right word for each slip."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import pytest
from builders import Run, edited, output_of, refusal_of, saved, saved_with_robot, starter_text

from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.cli.app import EXAMPLES, GROUPS, SUMMARIES, command_of
from screwsynth.nlp.cli.commandline import Argument, Option
from screwsynth.nlp.cli.usage import EARLIER
from screwsynth.nlp.system.slips import hint_of, toml_slips

#: What the same word may mean in one command only: the command exists to write it, or it is about another thing.
FORMS = {
    "--set": "NAME=VALUE", "--of": "RESULT", "--starts": "N", "--seed": "N", "--jobs": "N", "--time": "SECONDS",
    "--json": "FILE", "--csv": "FILE", "--html": "FILE", "--plot": "FILE", "--gap": "FRACTION", "--pose": "N",
}  # fmt: skip
#: Words that were, or might be, used for what another word stands for.
BANNED = {
    *("--page", "--picture", "--points-file", "--goals", "--of-quantity", "--measure", "--output", "--figure"),
    "--threads",
}


def options_of(command: str) -> dict[str, Argument | Option]:
    return {name: each.declared for name, each in command_of(command).options.items()}


@pytest.mark.parametrize("command", SUMMARIES)
def test_each_command_has_the_words_of_all(command: str, cli: Run) -> None:
    options = options_of(command)
    for name, form in FORMS.items():
        if name in options:
            assert options[name].metavar == form, name
    assert not BANNED & set(options)
    text = output_of(cli(command, "--help"))
    # Each default is said once: by the row of help, or in words.
    for name in options:
        block = re.search(rf"^  {name}\b.*?(?=^  -|\Z|^\n)", text, re.DOTALL | re.MULTILINE)
        assert block is not None, name
        said = block[0].count("[default:") + len(re.findall(r"if\s+left\s+out", block[0]))
        assert said <= 1 or name == "--time", block[0]
    assert re.sub(r" \\\n +", " ", text).count(EXAMPLES[command]) == 1
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("command", SUMMARIES)
def test_the_example_of_each_command_can_be_read(command: str) -> None:
    program, name, *arguments = shlex.split(EXAMPLES[command].partition(" > ")[0])
    assert (program, name) == ("screwsynth", command)
    assert command_of(command).read(arguments)


def test_one_meaning_has_one_word(cli: Run) -> None:
    helps: dict[str, set[str]] = {}
    for command in SUMMARIES:
        for name, each in options_of(command).items():
            helps.setdefault(each.help.split(";")[0], set()).add(name)
    assert not {words: names for words, names in helps.items() if len(names) > 1}
    # Commands stand in groups.
    text = output_of(cli("--help"))
    places = [text.index(f"{title}:") for title in GROUPS]
    assert places == sorted(places)
    assert [name for group in GROUPS.values() for name in group] == list(SUMMARIES)


@pytest.mark.parametrize(("command", "names"), EARLIER.items())
def test_earlier_names_work_and_stand_in_no_help(command: str, names: dict[str, str], cli: Run) -> None:
    options, text = options_of(command), output_of(cli(command, "--help"))
    for earlier, now in names.items():
        assert earlier not in options or now == "--out"
        assert not now or now in options
        if earlier not in options:
            assert not re.search(rf"{earlier}\b(?!-)", text)


def test_an_earlier_name_does_what_the_new_one_does(tmp_path: Path, cli: Run) -> None:
    for name in ("--page", "--html"):
        target = tmp_path / f"{name[2:]}.html"
        asked = ("paper-4.1-helical", "--over", "x1=11:13:2", "--starts", "2")
        code, _, err = cli("tradeoff", *asked, name, str(target))
        told = "screwsynth: tradeoff --page: is an earlier name of --html, and works until 0.3\n"
        assert (code, err) == (0, told if name == "--page" else "")
    assert len((tmp_path / "page.html").read_text()) == pytest.approx(
        len((tmp_path / "html.html").read_text()), rel=0.01
    )


CASE = find_case("paper-4.1-helical").read_text(encoding="utf-8")
ROBOTS = Path(__file__).parents[2] / "cases" / "robots"
ROBOT = (ROBOTS / "reachy-mini-head.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("solve", "paper-4.2", "--set", "limits.leg_lenght.max=5"), "did you mean 'leg_length'? allowed: leg_length,"),
        (("evaluate", "hexapod-machining", "--set", "p_z.maxx=1"), "did you mean 'p_z.max'?"),
        (("models", "none.toml"), "none.toml"),
        (("solve", "--hlep"), "--hlep: no such option of solve; did you mean '--help'?"),
        (("--hlep",), "--hlep: no such option of screwsynth; did you mean '--help'?"),
        (("solve", "delta"), "delta: is a robot, not a case; screwsynth new delta > my-delta.toml writes a case"),
        (("workspace", "stewart-gough"), "is a robot, not a case"),
        (("models", "paper-4.2"), "no such robot; 'paper-4.2' is a case"),
        (("compare", "paper-4.2", "case", "paper-4.3"), "and no such robot file; this is a case"),
        (("solve", "nowhere.toml"), "nowhere.toml: no such file"),
        (("solve", "paper-4.1-helical.toml"), "did you mean 'paper-4.1-helical'? this case comes with screwsynth"),
        (("compare", "drilling-spindle", "case", "robot.toml"), "robot.toml: no such robot file"),
        (("solve", "paper-4.1-helical", "--json"), "--json: needs a value, FILE"),
        (("certify", "paper-4.1-helical", "--all-assemblies=3"), "--all-assemblies: takes no value"),
        (("help",), "help: no such command; write screwsynth --help"),
        (("help", "solve"), "help: no such command; write screwsynth solve --help"),
        (("version",), "version: no such command; write screwsynth --version"),
        (("my.toml",), "my.toml: no such command; this is a case: write it after a command, as in screwsynth"),
        (("paper-4.2", "--all"), "as in screwsynth solve paper-4.2"),
        (("delta",), "this is a robot: screwsynth models delta shows it, screwsynth new delta prints a case for it"),
        (("slove",), "did you mean 'solve'?"),
        (("solve", "paper-4.2", "--set", "x1=12,5"), "must be NAME=NUMBER, or axis=X,Y,Z; write 12.5: a decimal"),
        (("solve", "paper-4.2", "--set", "x1=12 cm"), "; write 12: a number is written without its unit"),
        (("solve", "paper-4.2", "--time", "10s"), "--time 10s: must be a number; write 10: a number is written"),
    ],
    ids=lambda given: " ".join(given) if isinstance(given, tuple) else "",
)  # fmt: skip
def test_the_nearest_right_thing_is_named(arguments: tuple[str, ...], words: str, cli: Run) -> None:
    refusal_of(cli(*arguments), words)


def test_files_of_another_kind_are_named(tmp_path: Path, cli: Run) -> None:
    named = saved_with_robot(tmp_path, ROBOT, edited(starter_text("6-rus"), ('"6-rus"', '"robot.toml"')))
    words = 'no such robot; for a robot file, write file = "robot.toml" instead of model'
    refusal_of(cli("solve", named), f'robot.model = "robot.toml": {words}')
    robot, case = str(tmp_path / "robot.toml"), str(saved(tmp_path / "mine.toml", CASE))
    refusal_of(cli("solve", robot), 'is a robot file, not a case; write [robot] file = "robot.toml" in a case')
    for arguments in (("models", case), ("new", case), ("compare", "paper-4.2", "case", case)):
        refusal_of(cli(*arguments), "is a case, not a robot file; use it with screwsynth solve")


def test_units_and_decimal_commas_in_toml_are_named_with_their_lines(tmp_path: Path, cli: Run) -> None:
    lines = ["[robot]", 'model = "stewart-gough"', "[robot.parameters]", "x1 = 12 cm   # 3 mm", "x2 = 8,5"]
    path = saved(tmp_path / "case.toml", "\n".join([*lines, "x3 = { min = 3, max = 4deg }"]))
    slips = "line 4: 12 cm has a unit, write 12; line 5: 8,5 has a decimal comma, write 8.5; line 6: 4deg has a unit"
    refusal_of(cli("solve", str(path)), f"case.toml: is not valid TOML: {slips}")
    robot = saved(tmp_path / "robot.toml", edited(ROBOT, ("typical = 0.062000021955292826", "typical = 62 mm")))
    fault = "robot.toml: the file: is not valid TOML: line 19: 62 mm has a unit, write 62"
    refusal_of(cli("models", str(robot)), fault)
    # Another fault is told in the reader's words.
    other = saved(tmp_path / "case.toml", 'a = "x\nx1 = 12 cm\n')
    refusal_of(cli("solve", str(other)), "Illegal character", "(at line 1, column 7)")
    table = saved(tmp_path / "points.csv", "x1\n12\n13 mm\n")
    arguments = ("sweep", "paper-4.2", "--over", str(table), "--out", str(tmp_path / "out.csv"))
    refusal_of(
        cli(*arguments), 'row 3, column x1 = "13 mm": must be a number; write 13: a number is written without its unit'
    )
    table = saved(tmp_path / "poses.csv", 'x,y,z\n1,2,"3,5"\n')
    fault = "must be a number; write 3.5: a decimal number has a point"
    refusal_of(cli("inverse", "hexapod-linuxcnc", "--poses", str(table)), fault)


def test_slips_are_found_where_toml_is_not_valid_and_nowhere_else() -> None:
    for text in (
        "a = 1e5", "b = 0x1f", "d = 1979-05-27T07:32:00Z", "a = {x = 1,2 = 3}", 'a = "12 cm, 1,5"', "a = [1,5, 2,5]",
        "a = -inf", "a = 3 # 12 cm", "a = [1, 2,\n3]",
    ):  # fmt: skip
        assert tomllib.loads(text)
        assert list(toml_slips(text)) == []
    for text in ("-1,25", "30°", "5 m/s", "1.5e3mm", "2 N m", "[1 mm, 2]"):
        with pytest.raises(tomllib.TOMLDecodeError):
            tomllib.loads(f"a = {text}")
        ((line, fault),) = toml_slips(f"\na = {text}")
        assert line == 2
        assert fault.startswith(f"line 2: {'1 mm' if text[0] == '[' else text} has ")
    assert [hint_of(text) for text in ("x", "1e5", "1,2,3", "nan", "", "1;5")] == [""] * 6


def test_a_robot_file_is_described_and_numbers_and_columns_are_named(cli: Run, tmp_path: Path) -> None:
    out = output_of(cli("models", str(ROBOTS / "reachy-mini-head.toml")))
    assert out.startswith("Reachy Mini head\n")
    assert "distance of the motors from the base's centre" in out
    words = ("x1, x2", "such as x1.max", "limits.leg_length.max", "task.pitch")
    refusal_of(cli("evaluate", "hexapod-machining", "--set", "y7=1"), *words)
    points = saved(tmp_path / "points.csv", "x1,nope\n20,3\n")
    arguments = ("sweep", "paper-4.1-helical", "--over", str(points), "--out", str(tmp_path / "out.csv"))
    refusal_of(cli(*arguments), f"screwsynth: {points}: column nope: cannot be set")
