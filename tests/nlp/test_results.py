"""Results as typed values and JSON, their schema, and the versions of all files."""

import json
import math
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
from builders import DOCS, EACH_CASE, FEW_CASES, Run, edited, output_of, refusal_of, saved, soaked, starter_text
from jsonschema import Draft202012Validator

import screwsynth.cases
import screwsynth.models
from screwsynth.models import Dimension, fileversions, robot
from screwsynth.models.fileversions import FileVersions
from screwsynth.models.joints import RobotError
from screwsynth.models.joints.home.mechanisms import mechanism_of
from screwsynth.nlp import InputError, Solution, Status, Units, json_data, load_case, load_result, result_of, solve
from screwsynth.nlp.cli.usage import EARLIER
from screwsynth.nlp.output.checks import markdown
from screwsynth.nlp.output.report.markup import paragraphs
from screwsynth.nlp.output.report.report import report_of
from screwsynth.nlp.output.report.tables import html_table
from screwsynth.nlp.output.report.webpage import page_of
from screwsynth.nlp.results import data, parts
from screwsynth.nlp.results.checks import check_case
from screwsynth.nlp.results.schema import RESULTS, result_from_json, result_schema
from screwsynth.nlp.solver import multistart, starts
from screwsynth.nlp.system.jsonvalues import (
    Absent,
    Hidden,
    Inline,
    JsonObject,
    Key,
    Known,
    Measure,
    Row,
    Slope,
)
from screwsynth.nlp.system.strictjson import WrongValueError, object_of
from screwsynth.nlp.words.summary import case_summary
from screwsynth.nlp.words.text import Line, TextTable, Tone

Json = dict[str, Any]

CASES = Path(screwsynth.cases.__file__).parent
HELICAL = (CASES / "paper-4.1-helical.toml").read_text(encoding="utf-8").partition("[expect]")[0]
MACHINE = (CASES / "hexapod-machining.toml").read_text(encoding="utf-8")
POSITION = "position = [{ min = -10, max = 10 }, { min = -10, max = 10 }, { min = 20, max = 50 }]"
ROTATION = "rotation = { angle = { min = -30, max = 30 } }"
FIXED = edited(HELICAL, (POSITION, "position = [1, 2, 35]"), (ROTATION, ""))
FEW = "\n[solve]\nstarts = 2\n"
PUSH = '\n[[task]]\nname = "push"\nsense = "max"\naxis = [0, 0, 1]\npitch = inf\n'
OVER_POSES = '[pose.along_task]\nfirst = -15\nlast = 15\ncount = 3\n\n[combine]\nover_poses = "mean"\n'


#: Cases of every kind of outcome, by name.
WRITTEN = {
    "nothing-free": FIXED + FEW,
    "infeasible": HELICAL + "[limits]\nleg_length = { min = 500 }\n" + FEW,
    "not-converged": HELICAL + FEW + "max_iterations = 1\n",
    "violated": FIXED + "[limits]\nleg_length = { min = 500 }\n" + FEW,
    "poses": edited(HELICAL, ("[[task]]", f"{OVER_POSES}\n[[task]]")) + "[limits]\nleg_length = { max = 70 }\n" + FEW,
    "tolerance": HELICAL + "[limits]\nleg_length = { max = 55 }\n[tolerance]\njoint_centre = 0.01\n" + FEW,
    "average": HELICAL + PUSH + FEW,
    "weighted-sum": HELICAL + PUSH + '[combine]\nmethod = "weighted-sum"\n' + FEW,
    "worst-case": HELICAL + PUSH + '[combine]\nmethod = "worst-case"\n[limits]\nleg_length = { max = 70 }\n' + FEW,
    "average-infeasible": HELICAL + PUSH + "[limits]\nleg_length = { min = 500 }\n" + FEW,
}


@pytest.fixture(scope="module")
def schema() -> Json:
    return json.loads(json.dumps(result_schema()))


def validator(schema: Json, kind: str) -> Draft202012Validator:
    return Draft202012Validator({"$ref": f"#/$defs/{kind}", "$defs": schema["$defs"]})


def hold(result: Json, schema: Json, kind: str) -> None:
    """Hold a result to the schema: it is of one kind, and no other."""
    validator(schema, kind).validate(result)
    Draft202012Validator(schema).validate(result)
    names = [each.__name__ for each in RESULTS]
    assert [name for name in names if validator(schema, name).is_valid(result)] == [kind]
    again = result_from_json(result, "result.json")
    assert type(again).__name__ == kind
    assert json_data(again) == result


def objects(value: object) -> Iterator[Json]:
    """Every object in a result."""
    if isinstance(value, dict):
        yield value
    for each in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from objects(each)


@pytest.fixture(scope="module")
def case_path(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], str]:
    """Path of a written case, or the name of a shipped one."""
    folder = tmp_path_factory.mktemp("cases")
    for name, text in WRITTEN.items():
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return lambda name: str(folder / f"{name}.toml") if name in WRITTEN else name


def test_the_schema_is_one(cli: Run, schema: Json) -> None:
    assert json.loads(output_of(cli("schema", "--result"))) == schema
    Draft202012Validator.check_schema(schema)
    assert [each["$ref"] for each in schema["anyOf"]] == [f"#/$defs/{kind.__name__}" for kind in RESULTS]
    for name, each in schema["$defs"].items():
        assert each["additionalProperties"] is False, name
        if name != "VersionsData":
            assert all(part.get("description") for part in each["properties"].values()), name


@pytest.mark.parametrize("name", soaked([*EACH_CASE, *WRITTEN], (*FEW_CASES, *WRITTEN)))
def test_answers_keep_to_the_schema(name: str, cli: Run, schema: Json, case_path: Callable[[str], str]) -> None:
    for command in (("solve", case_path(name), "--starts", "2"), ("evaluate", case_path(name))):
        code, out, err = cli(*command, "--json", "-")
        assert (code in (0, 1), err) == (True, "")
        result = json.loads(out)
        solved = "CombinedResult" if "combined" in result else "SolveResult"
        hold(result, schema, solved if command[0] == "solve" else "EvaluationResult")


@pytest.mark.parametrize("name", ["paper-4.1-rotation", "paper-4.2", "worst-case", "infeasible", "nothing-free"])
def test_certificates_keep_to_the_schema(name: str, cli: Run, schema: Json, case_path: Callable[[str], str]) -> None:
    for command in (("certify", "--gap", "0.1", "--time", "5"), ("solve", "--certify")):
        if command[0] == "solve" and name != "paper-4.1-rotation":
            continue
        code, out, err = cli(command[0], case_path(name), *command[1:], "--starts", "2", "--json", "-")
        assert (code in (0, 1), err) == (True, "")
        result = json.loads(out)
        hold(result, schema, "SolveResult" if command[0] == "solve" else "CertifiedResult")
        assert result["certificate"] is not None or name == "paper-4.2"


def test_checks_keep_to_the_schema(cli: Run, schema: Json) -> None:
    out = output_of(cli("check", "paper-4.3-axis-x", "paper-4.2-rotation", "--json", "-"))
    hold(json.loads(out), schema, "ChecksResult")


@pytest.mark.parametrize("name", ["tolerance", "poses", "worst-case", "infeasible"])
def test_the_schema_refuses_more_and_less(name: str, cli: Run, schema: Json, case_path: Callable[[str], str]) -> None:
    _, out, _ = cli("solve", case_path(name), "--json", "-")
    result = json.loads(out)
    kind = "CombinedResult" if "combined" in result else "SolveResult"
    check = validator(schema, kind)
    count = len(list(objects(result)))
    assert count > 10
    for k in range(count):
        more = deepcopy(result)
        list(objects(more))[k]["extra"] = "text"
        assert not check.is_valid(more)
    for key in result.keys() - {"reached", "relaxation", "sensitivity", "tolerance", "task", "rates", "task_is_free"}:
        less = {each: value for each, value in result.items() if each != key}
        assert not check.is_valid(less), key


def test_a_robot_is_there_as_a_whole_or_not_at_all(schema: Json) -> None:
    solution = solve(load_case("paper-4.1-helical"), starts=2)
    whole = json_data(result_of(solution))
    (outcome,) = solution.outcomes
    failed = replace(outcome, own=replace(outcome.own, status=Status.INFEASIBLE, state=None), state=None)
    without = json_data(result_of(replace(solution, status=Status.INFEASIBLE, outcomes=(failed,))))
    hold(json.loads(json.dumps(without)), schema, "SolveResult")
    assert "reached" in without
    robot = whole.keys() - without.keys()
    assert {"parameters", "pose", "task", "jacobian", "rates", "rank", "quantities"} < robot
    assert without["margins"] == without["limits"] == []
    for key in ("parameters", "pose", "jacobian", "rank"):
        assert not validator(schema, "SolveResult").is_valid({**json.loads(json.dumps(without)), key: whole[key]})


def test_a_result_is_read_again_from_its_file(cli: Run, tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    assert cli("solve", "paper-4.3-axis-x", "--starts", "2", "--json", str(file))[0] == 0
    result = load_result(file)
    assert isinstance(result, data.SolveResult)
    assert result.status is Status.OPTIMAL
    assert json.loads(file.read_text(encoding="utf-8"))["F"] == result.F
    assert result.robot is not None
    assert sum(rate**2 for rate in result.robot.rates or ()) == pytest.approx(result.F, rel=1e-12)
    assert isinstance(result.robot.jacobian, tuple)
    with pytest.raises(TypeError):
        result.robot.parameters["x1"] = 1.0  # type: ignore[index]
    # It is shown as the solution itself is.
    case = load_case("paper-4.3-axis-x")
    assert list(case_summary(case, result)) == list(case_summary(case, result_of(solve(case, starts=2))))


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda table: table.pop("schema"), "schema: is missing"),
        (lambda table: table.update(extra=1), "extra: no such key; allowed: schema, case"),
        (lambda table: table.update(titel=""), r"titel: no such key; did you mean 'title'\? allowed: schema"),
        (lambda table: table.update(status="perfect"), "status: must be one of 'optimal'"),
        (lambda table: table.update(F="large"), "F: must be a number"),
        (lambda table: table.update(seed=1.5), "seed: must be an integer"),
        (lambda table: table["pose"].update(axis=[0, 1]), "pose.axis: must have 3 entries, got 2"),
        (lambda table: table["jacobian"][2].append("x"), r"jacobian\[2\]\[6\]: must be a number"),
        (lambda table: table["units"].update(angle="grad"), "units.angle: must be one of 'deg', 'rad'"),
        (lambda table: table["starts"].pop("run"), "starts.run: is missing"),
    ],
)
def test_a_wrong_result_is_refused_with_its_key(change: Callable[[Json], object], fault: str) -> None:
    table = json.loads(json.dumps(json_data(result_of(solve(load_case("paper-4.3-axis-x"), starts=1)))))
    change(table)
    with pytest.raises(InputError, match=rf"^mine: is not a result of screwsynth: {fault}"):
        result_from_json(table, "mine")


def test_a_file_that_is_no_result_is_refused(tmp_path: Path) -> None:
    for content, fault in (
        ("{", "is not valid JSON"),
        ("[1]", r"must contain one JSON object, \{ ... \}"),
        ("{}", "schema: is missing"),
    ):
        with pytest.raises(InputError, match=fault):
            load_result(saved(tmp_path / "result.json", content))
    with pytest.raises(InputError, match="cannot be read"):
        load_result(tmp_path / "none.json")


class Inner(JsonObject):
    """An inner part.

    Attributes:
        b: a number.
    """

    b: float


class Outer(JsonObject):
    """A value with every kind of field."""

    a: int
    inner: Inline[Inner]
    absent: Absent[str]
    null: str | None
    none: Inline[Inner | None]
    status: Status
    numbers: tuple[tuple[float, ...], ...]
    named: Mapping[str, float]


def outer(**changes: object) -> Outer:
    values: dict[str, Any] = {"numbers": ((1.0, 2.0),), "named": {"x": 3.0}, "status": Status.OPTIMAL}
    values |= {"none": None, "null": None, "absent": None, "inner": Inner(b=2.0), "a": 1}
    return Outer(**values | changes)


def test_values_are_frozen_and_whole() -> None:
    value = outer()
    for change in (lambda: setattr(value, "a", 2), lambda: delattr(value, "a")):
        with pytest.raises(AttributeError, match="frozen"):
            change()
    for wrong, words in (
        (lambda: outer(more=1), "more"),
        (Inner, "b"),
        (lambda: json_data(outer(absent=object())), "object"),
        (lambda: type("Text", (JsonObject,), {"__annotations__": {"a": "int"}}), "run time"),
    ):
        with pytest.raises(TypeError, match=words):
            wrong()
    assert "status=<Status.OPTIMAL" in repr(value)
    for module in (parts, data):
        kinds = [each for each in vars(module).values() if isinstance(each, type) and issubclass(each, JsonObject)]
        assert len(kinds) > 5
        assert not any(getattr(kind, "__hash__", None) is None for kind in kinds)
    # JSON has the fields in the order of the type.
    found = json_data(outer())
    assert list(found) == ["a", "b", "null", "status", "numbers", "named"]
    assert found == {"a": 1, "b": 2.0, "null": None, "status": "optimal", "numbers": [[1.0, 2.0]], "named": {"x": 3.0}}
    assert json_data(outer(absent="here", none=None))["absent"] == "here"


class Reading(JsonObject):
    """A value with numbers in units, one that may be none, an array, another key, and a field for computations."""

    name: Annotated[str, Key("label")]
    value: Annotated[Known, Measure.NUMBER]
    cost: Slope[float | None]
    turn: Annotated[tuple[float, ...] | None, Dimension.ANGLE]
    row: Row
    note: Absent[str]
    dimension: Hidden[Dimension] = Dimension.NUMBER


class Readings(JsonObject):
    """Several such values."""

    rows: tuple[Reading, ...]
    last: Reading


def reading(value: float) -> Reading:
    row = np.array([1.0, 2.0])
    turn, dimension = (0.0, math.pi), Dimension.ANGLE
    return Reading(name="a", value=value, cost=2.0, turn=turn, row=row, note="", dimension=dimension)


def test_one_conversion_has_every_number_in_the_units_of_the_case() -> None:
    inner = reading(math.pi / 6)
    (found, none), last = Readings.of(Readings(rows=(inner, reading(math.nan)), last=inner), Units()).rows, inner
    assert (found.value, found.turn, found.note) == (30.0, (0.0, 180.0), None)
    assert found.cost == pytest.approx(2.0 * math.pi / 180)
    assert math.isnan(none.value)
    assert inner.value == math.pi / 6 == last.value, "the value itself stays as it is"
    # Degrees stay degrees where the number is converted again, and radians where the case has them.
    assert (found.dimension, Reading.of(found, Units(), turn=None).value) == (Dimension.NUMBER, 30.0)
    assert Reading.of(inner, Units(angle="rad")).value == math.pi / 6
    (again,) = Reading.of_each([inner])
    assert (again.value, again.dimension) == (inner.value, Dimension.ANGLE)


def test_numbers_that_are_none_and_arrays_are_read_again() -> None:
    for value, written in ((math.nan, None), (math.inf, None), (0.5, 0.5)):
        data = json.loads(json.dumps(json_data(reading(value)), allow_nan=False))
        assert data == {"label": "a", "value": written, "cost": 2.0, "turn": [0, math.pi], "row": [1, 2], "note": ""}
        found = object_of(Reading, data)
        assert isinstance(found, Reading)
        assert json_data(found) == data
        assert (found.name, found.dimension) == ("a", Dimension.NUMBER)
        assert math.isnan(found.value) or found.value == value
        assert found.row.tolist() == [1.0, 2.0]
    with pytest.raises(WrongValueError, match="label: is missing"):
        object_of(Reading, {})
    with pytest.raises(WrongValueError, match="dimension: no such key; allowed: label, value"):
        object_of(Reading, {"dimension": "angle"})


def test_words_need_neither_terminal_nor_page() -> None:
    loaded = "print(*(name for name in ('rich', 'html', 'pydantic') if name in sys.modules))"
    words = "import sys; import screwsynth.nlp.words.summary, screwsynth.nlp.words.checks; " + loaded
    page = "import sys; import screwsynth.nlp.output.report.webpage; " + loaded
    for code, expected in ((words, {"pydantic"}), (page, {"html", "pydantic"})):
        done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
        assert set(done.stdout.split()) <= expected


def test_a_page_solves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    name = "paper-4.3-axis-x"
    solution = solve(load_case(name), starts=2)
    result = result_of(solution)
    check = check_case(name, {name: result})

    def refuse(*_: object, **__: object) -> Solution:
        raise AssertionError("a page must not solve")

    monkeypatch.setattr(starts, "search_from", refuse)
    monkeypatch.setattr(multistart, "search_each", refuse)
    assert "compared" in page_of(report_of("", solution, result, check))
    assert 'id="compared"' not in page_of(report_of("", solution, result))


def test_one_table_for_terminal_markdown_and_page() -> None:
    table = TextTable(("name", "length\ncm"), ((Line("a|b<", tone=Tone.NO_ANSWER), "1.5"), ("c", "no")))
    assert markdown(table) == "| name | length, cm |\n|---|---|\n| a\\|b&lt; | 1.5 |\n| c | no |\n"
    html = html_table(table, "Lengths", id="lengths")
    assert '<th scope="col">length, cm</th>' in html
    assert '<th scope="row">a|b&lt;</th><td class="number">1.5</td>' in html
    assert "<td>no</td>" in html
    line = Line("407", label="F", tone=Tone.ANSWER, before="about ", after=" <N>")
    assert paragraphs([line]) == '<p><span class="label">F:</span> about 407 &lt;N&gt;</p>'


def test_an_answer_is_title_and_objective_then_its_evidence_then_the_design() -> None:
    case = load_case("paper-4.1-helical")
    items = list(case_summary(case, result_of(solve(case, starts=2))))
    answer = [item for item in items if not item.part]
    first, objective, optimality, rank, last = answer[0], *answer[-4:]
    assert isinstance(first, Line)
    assert (first.text, first.tone) == (case.title, Tone.TITLE)
    assert isinstance(objective, Line)
    assert (objective.before, objective.tone) == ("largest F = ", Tone.ANSWER)
    assert isinstance(optimality, Line)
    assert (optimality.label, optimality.text) == ("optimality", "strict local maximum")
    assert isinstance(rank, Line)
    assert (rank.label, rank.text) == ("rank of J", "6")
    assert isinstance(last, TextTable)
    assert last.name == "design"
    design, limbs = (item for item in items if isinstance(item, TextTable))
    assert [row[0] for row in design.rows] == ["p_x", "p_y", "p_z", "axis", "angle", "x1", "x2", "x3", "x4"]
    assert len(limbs.rows) == 6


PAGE = (DOCS / "versions.md").read_text(encoding="utf-8")
KINDS = [each for each in vars(fileversions).values() if isinstance(each, FileVersions)]
SMALL = "paper-4.2-rotation"
DELTA = (Path(screwsynth.models.__file__).parent / "robots" / "delta.toml").read_text(encoding="utf-8")
#: A value of the key as TOML and JSON write it, and words about it.
OTHERS = [
    ("2", "schema = 2: this screwsynth reads {kind} of schema 1; a later version of it reads this one"),
    ("0", "schema = 0: must be a version number, a whole number from 1; this screwsynth reads {kind} of schema 1"),
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


@pytest.mark.parametrize(
    ("kind", "name", "command"),
    [
        ("case files", "case.toml", "evaluate FILE"),
        ("robot files", "robot.toml", "new FILE"),
        ("results", "result.json", f"evaluate {SMALL} --of FILE"),
        ("proofs", "proof.json", "verify-proof FILE"),
    ],
)
def test_a_file_of_another_version_is_refused(kind: str, name: str, command: str, tmp_path: Path, cli: Run) -> None:
    path = tmp_path / name
    if name.endswith("toml"):
        saved(path, f"schema = 1\n{DELTA if kind == 'robot files' else starter_text('3-rps')}")
    elif kind == "results":
        cli("solve", SMALL, "--starts", "2", "--json", str(path))
    else:
        cli("certify", SMALL, "--starts", "2", "--gap", "0.5", "--proof", str(path))
    text, arguments = path.read_text(encoding="utf-8"), command.replace("FILE", str(path)).split()
    (mark,) = re.findall(r'^ *"?schema"?(?:: | = )1\b', text, flags=re.MULTILINE)
    assert cli(*arguments)[::2] == (0, ""), "the version that is written is read"
    for version, sentence in OTHERS:
        saved(path, edited(text, (mark, mark[:-1] + version)))
        refusal_of(cli(*arguments), sentence.format(kind=kind), name, "schema")


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
    with pytest.raises(InputError, match=r"result\.json: is not a result of screwsynth: schema: is missing"):
        load_result(saved(path, json.dumps(content)))


def test_the_page_has_every_kind_of_file_with_its_versions_and_every_earlier_option() -> None:
    rows = re.findall(r"^\| (.+?) \| `schema`.*? \| (\d+) \| (\d+) \|$", PAGE, flags=re.MULTILINE)
    assert [(words, int(newest), int(oldest)) for words, newest, oldest in rows] == [tuple(kind) for kind in KINDS]
    told = re.findall(r"^\| `(\w+) (--[\w-]+)` \| `?(--[\w-]+|nothing)`? \|$", PAGE, flags=re.MULTILINE)
    known = [(command, old, new or "nothing") for command, names in EARLIER.items() for old, new in names.items()]
    assert told == known
