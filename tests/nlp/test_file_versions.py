"""Versions of files: one rule for cases, robots, results, proofs and generated C, and its page."""

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from builders import DOCS, Run, edited, output_of, refusal_of, saved
from jsonschema import Draft202012Validator

import screwsynth.models
from screwsynth.models import fileversions, robot
from screwsynth.models.fileversions import FileVersions
from screwsynth.models.joints import RobotError
from screwsynth.models.joints.mechanisms import mechanism_of
from screwsynth.nlp import load_case, load_result
from screwsynth.nlp.cli.usage import EARLIER
from screwsynth.nlp.results.schema import RESULTS, result_schema

PAGE = (DOCS / "versions.md").read_text(encoding="utf-8")
KINDS = [each for each in vars(fileversions).values() if isinstance(each, FileVersions)]
SMALL = "paper-4.2-rotation"
DELTA = (Path(screwsynth.models.__file__).parent / "robots" / "delta.toml").read_text(encoding="utf-8")
#: A value of the key as TOML and JSON write it, and words about it.
OTHERS = [
    ("2", "schema = 2: this screwsynth reads {kind} of schema 1; a later version of it reads this one"),
    ("0", "schema = 0: must be a version, which is a whole number from 1; this screwsynth reads {kind} of schema 1"),
    ("true", "schema = true: must be a version"),
    ("1.0", "schema = 1.0: must be a version"),
    ('"1"', 'schema = "1": must be a version'),
]


def test_versions_in_words() -> None:
    kind = FileVersions("cards", 4, 2)
    assert [kind.fault(version) for version in (2, 3, 4)] == [None] * 3
    reads = "this screwsynth reads cards of schema 2 to 4"
    assert kind.fault(5) == f"{reads}; a later version of it reads this one"
    assert kind.fault(1) == f"{reads}; an earlier version of it reads this one"
    assert str(FileVersions("cards", 2).fault(3)).startswith("this screwsynth reads cards of schema 1 and 2; a later")


def case_file(folder: Path, version: str, cli: Run) -> tuple[str, str, tuple[str, ...]]:
    """A case file, as its name, the kind, and the command that reads it."""
    path = str(saved(folder / "case.toml", f"schema = {version}\n{output_of(cli('new', '3-rps'))}"))
    return path, "case files", ("evaluate", path)


def robot_file(folder: Path, version: str, cli: Run) -> tuple[str, str, tuple[str, ...]]:
    """A robot file, which a case beside it names."""
    del cli
    path = str(saved(folder / "robot.toml", f"schema = {version}\n{DELTA}"))
    return path, "robot files", ("new", path)


def result(folder: Path, version: str, cli: Run) -> tuple[str, str, tuple[str, ...]]:
    """A result, by which a command takes its dimensions."""
    path = str(folder / "result.json")
    cli("solve", SMALL, "--starts", "2", "--json", path)
    return altered(path, version), "results", ("evaluate", SMALL, "--of", path)


def proof(folder: Path, version: str, cli: Run) -> tuple[str, str, tuple[str, ...]]:
    """A proof of an optimum."""
    path = str(folder / "proof.json")
    cli("certify", SMALL, "--starts", "2", "--gap", "0.5", "--proof", path)
    return altered(path, version), "proofs", ("verify-proof", path)


def altered(path: str, version: str) -> str:
    """The name of a JSON file, in which the version becomes another."""
    text = Path(path).read_text(encoding="utf-8")
    assert len(re.findall(r'^ *"schema": 1,$', text, flags=re.MULTILINE)) == 1
    saved(Path(path), re.sub('"schema": 1,', f'"schema": {version},', text))
    return path


@pytest.mark.parametrize("kind", [case_file, robot_file, result, proof])
def test_a_file_of_another_version_is_refused_by_name(
    kind: Callable[[Path, str, Run], tuple[str, str, tuple[str, ...]]], tmp_path: Path, cli: Run
) -> None:
    path, words, command = kind(tmp_path, "1", cli)
    assert cli(*command)[::2] == (0, ""), "the version that is written is read"
    for version, sentence in OTHERS:
        kind(tmp_path, version, cli)
        found = refusal_of(cli(*command), sentence.format(kind=words))
        assert Path(path).name in found
        assert "schema" in found


def test_a_robot_of_another_version_is_refused_in_python_and_within_a_case(tmp_path: Path, cli: Run) -> None:
    tables = tomllib.loads(DELTA)
    same = robot(**tables, schema=1)
    assert same.options == robot(**tables).options, "a case that is written again states the robot as before"
    assert repr(mechanism_of({"schema": 1, **tables}).joints) == repr(mechanism_of(tables).joints)
    for call in (lambda: robot(**tables, schema=2), lambda: mechanism_of({"schema": 2, **tables})):
        with pytest.raises(RobotError, match="schema = 2: this screwsynth reads robot files of schema 1"):
            call()
    named = saved(tmp_path / "robot.toml", f"schema = 1\n{DELTA}")
    path = str(saved(tmp_path / "case.toml", output_of(cli("new", str(named)))))
    again = load_case(path).to_toml()
    within = edited(again, ("definition = {", "definition = { schema = 1,"))
    assert load_case(str(saved(tmp_path / "again.toml", within))).to_toml() == again
    path = str(saved(tmp_path / "again.toml", edited(within, ("schema = 1", "schema = 2"))))
    refusal_of(cli("evaluate", path), "again.toml: robot.definition: schema = 2: this screwsynth")


def test_the_schemas_know_the_versions(cli: Run) -> None:
    case = json.loads(output_of(cli("schema")))["properties"]["schema"]
    assert case["const"] == fileversions.CASE_FILES.newest == 1
    definitions: dict[str, Any] = json.loads(json.dumps(result_schema()))["$defs"]
    for kind in RESULTS:
        versions = definitions[kind.__name__]["properties"]["schema"]
        assert versions["enum"] == [fileversions.RESULT_FILES.newest]
        assert "schema" in definitions[kind.__name__]["required"]
        assert not Draft202012Validator(versions).is_valid(2)


def test_a_result_without_its_version_is_none(tmp_path: Path, cli: Run) -> None:
    path = tmp_path / "result.json"
    cli("evaluate", "paper-4.4-min", "--set", "p_z=30", "--json", str(path))
    content = json.loads(path.read_text(encoding="utf-8"))
    del content["schema"]
    saved(path, json.dumps(content))
    with pytest.raises(
        screwsynth.nlp.InputError, match=r"result\.json: is no result of screwsynth: schema: is missing"
    ):
        load_result(path)


def test_the_page_has_every_kind_of_file_and_its_versions() -> None:
    rows = re.findall(r"^\| (.+?) \| `schema`.*? \| (\d+) \| (\d+) \|$", PAGE, flags=re.MULTILINE)
    assert [(words, int(newest), int(oldest)) for words, newest, oldest in rows] == [tuple(kind) for kind in KINDS]


def test_the_page_has_every_earlier_option() -> None:
    told = re.findall(r"^\| `(\w+) (--[\w-]+)` \| `?(--[\w-]+|nothing)`? \|$", PAGE, flags=re.MULTILINE)
    known = [(command, old, new or "nothing") for command, names in EARLIER.items() for old, new in names.items()]
    assert told == known
