"""The words of the command line: one option has one name, one form and one default in every command."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from builders import Run, output_of, refusal_of

from screwsynth.nlp.cli.app import EXAMPLES, GROUPS, SUMMARIES, command_of
from screwsynth.nlp.cli.commandline import Argument, Option
from screwsynth.nlp.cli.usage import EARLIER

#: What the same word may mean in one command only: the command exists to write it, or it is about another thing.
FORMS = {
    "--set": "NAME=VALUE", "--of": "RESULT", "--starts": "N", "--seed": "N", "--jobs": "N", "--time": "SECONDS",
    "--json": "FILE", "--csv": "FILE", "--html": "FILE", "--plot": "FILE", "--gap": "PART", "--pose": "N",
}  # fmt: skip
#: Words that were, or might be, used for what another word stands for.
BANNED = {
    "--page",
    "--picture",
    "--points-file",
    "--goals",
    "--of-quantity",
    "--measure",
    "--output",
    "--figure",
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


def test_one_meaning_has_one_word() -> None:
    helps: dict[str, set[str]] = {}
    for command in SUMMARIES:
        for name, each in options_of(command).items():
            helps.setdefault(each.help.split(";")[0], set()).add(name)
    assert not {words: names for words, names in helps.items() if len(names) > 1}


def test_commands_stand_in_groups(cli: Run) -> None:
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


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("solve", "nowhere.toml"), "nowhere.toml: no such file"),
        (("solve", "paper-4.1-helical.toml"), "did you mean 'paper-4.1-helical'? this case comes with screwsynth"),
        (("compare", "drilling-spindle", "case", "robot.toml"), "robot.toml: no such robot file"),
        (("sweep", "paper-4.1-helical", "--over", "x1=1,2"), "--out: is missing: FILE"),
        (("solve", "paper-4.1-helical", "--json"), "--json: needs a value, FILE"),
        (("certify", "paper-4.1-helical", "--all-assemblies=3"), "--all-assemblies: takes no value"),
    ],
)
def test_what_is_missing_is_said_in_one_sentence(arguments: tuple[str, ...], words: str, cli: Run) -> None:
    refusal_of(cli(*arguments), words)
