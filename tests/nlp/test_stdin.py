"""``-`` as CASE is standard input, in every command that takes one."""

import io
import json
import sys
from pathlib import Path

import pytest
from builders import TWO_GOALS, Run, edited, output_of, refusal_of, saved

from screwsynth.models import robot_function
from screwsynth.nlp import load_case
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.cli.app import SUMMARIES, command_of
from screwsynth.nlp.starter.text import starter_case

CASE = find_case("paper-4.1-helical").read_text(encoding="utf-8")
ROBOT = (Path(__file__).parents[2] / "models" / "robots" / "3-rps.toml").read_text(encoding="utf-8")
# What each command with a CASE needs beside it.
COMMANDS = {
    "solve": (), "evaluate": (), "inverse": ("--poses", "poses.csv"), "report": ("--out", "page.html"), "certify": (),
    "workspace": (), "path": (), "verify-proof": (), "tradeoff": ("--over", "x1=1:2:2"),
    "sweep": ("--over", "x1=1:2:2", "--out", "table.csv"), "pareto": ("--goal", "max F", "--goal", "min limits.a.max"),
    "compare": ("case", "delta"), "export": ("--format", "csv", "--out", "robot"), "codegen": ("--out", "c"),
    "check": (),
}  # fmt: skip


def give(text: str | bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put a text into standard input."""
    content = text if isinstance(text, bytes) else text.encode()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content), encoding="utf-8"))


def test_every_command_reads_a_case_from_standard_input(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    saved(tmp_path / "poses.csv", "x,y,z\n0,0,1\n")
    proof = tmp_path / "proof.json"
    output_of(cli("certify", "paper-4.1-rotation", "--starts", "1", "--gap", "0.5", "--proof", str(proof)))
    taking = [name for name in SUMMARIES if any("CASE" in each.name for each in command_of(name).arguments)]
    assert set(taking) == set(COMMANDS)
    for name, options in COMMANDS.items():
        give(edited(CASE, ('"stewart-gough"', '"nothing"')), monkeypatch)
        first = (str(proof),) if name == "verify-proof" else ()
        refusal_of(cli(name, *first, "-", *options), 'stdin: robot.model = "nothing": no such robot')
    assert {each.name for each in tmp_path.iterdir()} == {"poses.csv", "proof.json"}


def test_it_is_read_once_for_all_readings_of_a_command(
    tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    saved(tmp_path / "case.toml", CASE)
    expected = json.loads(output_of(cli("evaluate", "case.toml", "--json", "-")))
    give(CASE, monkeypatch)
    found = json.loads(output_of(cli("evaluate", "-", "--json", "-")))
    assert (found.pop("case"), expected.pop("case")) == ("stdin", "case")
    assert found == expected
    # A trade-off reads the case at each value, and a result is of a case that is read before it.
    give(TWO_GOALS, monkeypatch)
    assert "2 values" in output_of(cli("tradeoff", "-", "--over", "x1=12:13:2"))
    output_of(cli("solve", "case.toml", "--starts", "1", "--json", "result.json"))
    give(CASE, monkeypatch)
    assert cli("evaluate", "-", "--of", "result.json")[1].startswith("Pose of a given 6-6 platform")
    # Files that the case names are in the folder of the command.
    saved(tmp_path / "robot.toml", ROBOT)
    give(starter_case(robot_function("3-rps")(), "robot.toml"), monkeypatch)
    assert load_case("-").model.name == "3-RPS"


def test_what_is_no_case_is_refused(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    for given, words in (
        (b"", "robot: is missing"),
        (b"a = \xff", "it is not UTF-8"),
        (b"x1 = 12 cm", "12 cm has a unit"),
    ):
        give(given, monkeypatch)
        refusal_of(cli("solve", "-"), "screwsynth: stdin: ", words)
    give(b"#" * (4 * 2**20 + 1), monkeypatch)
    refusal_of(cli("solve", "-"), "stdin: cannot be read: it is larger than 4 MB")
    monkeypatch.setattr(sys, "stdin", None)
    refusal_of(cli("solve", "-"), "stdin: cannot be read")
    # A file with this name has a folder before it.
    monkeypatch.chdir(tmp_path)
    saved(tmp_path / "-", CASE)
    assert load_case("./-").name == "-"
