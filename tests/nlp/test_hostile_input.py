"""Input of any kind: JSON, streams, files and values that go wrong are a sentence and a status, never a traceback."""

import copy
import io
import json
import os
import random
import shlex
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from builders import TWO_GOALS, Run, case_from, edited, output_of, refusal_of, saved, soaked

from screwsynth.models import robot_function, stewart_gough
from screwsynth.nlp import (
    Case,
    CaseError,
    Free,
    InputError,
    LegLength,
    Limits,
    Rotation,
    Search,
    Task,
    certify,
    load_case,
    load_result,
)
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.cli.app import SUMMARIES, command_of
from screwsynth.nlp.embedding.manifest import read_manifest
from screwsynth.nlp.proof.checker.proof_file import Premises, Proof, ProofClaim, Unproved, read_proof
from screwsynth.nlp.solver.certified import proof_of
from screwsynth.nlp.starter.text import starter_case
from screwsynth.nlp.sweeps.journal import Row
from screwsynth.nlp.system.journal import line_of, row_of
from screwsynth.nlp.system.strictjson import WrongValueError, json_tree, object_of, value_of

#: What is put into files byte by byte.
PIECES = [
    *(b"[", b"]", b"{", b"}", b",", b":", b'"', b"null", b"1e999", b"-1e999", b"NaN", b"Infinity", b"\\ud800"),
    *(b"9" * 401, b"-" + b"9" * 5000, b"[" * 200_000, b'{"a":' * 5000, b"\xff", b"\x00", b'"x"', b"1.5", b"\\u0000"),
]
#: What is put in the place of values.
NUMBERS: list[Any] = [None, True, 0, -1, 1.5, 1e300, -1e300, 2**53, 2**70]
VALUES: list[Any] = [*NUMBERS, "", "x", "\x00", "\ud800", [], {}, [[]], ["x"], {"a": 1}]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("[" * 200_000, "too deeply"),
        ("[" * 65 + "]" * 65, "too deeply"),
        ('{"a": 1, "a": 2}', "occurs twice"),
        ("1e999", "is not a finite number"),
        ("[-1e999]", "is not a finite number"),
        ("NaN", "is not a finite number"),
        ("9" * 401, "too large"),
        ("9" * 5000, "too large"),
        (str(2**53 + 1), "too large"),
        ('"\\ud800"', "half of a character"),
        ('{"\\udfff": 1}', "half of a character"),
        ("", "Expecting value"),
        (b"\xff", "codec"),
    ],
)
def test_what_is_refused(text: str | bytes, fault: str) -> None:
    with pytest.raises(ValueError, match=fault) as error:
        json_tree(text)
    assert len(str(error.value)) < 200


def test_what_is_read() -> None:
    deep: object = 1
    for _ in range(63):
        deep = [deep]
    tree = {"a": [1, -2.5, True, None, "\U0001f527\\ud"], "b": deep, "c": {}, "d": 2**53, "e": -(2**53)}
    assert json_tree(json.dumps(tree)) == tree
    assert json_tree(b"\xef\xbb\xbf" + json.dumps(tree, ensure_ascii=False).encode()) == tree


@dataclass(frozen=True)
class Inner:
    name: str
    sizes: tuple[float, ...]


@dataclass(frozen=True)
class Outer:
    kind: Literal["a", 2]
    inner: tuple[Inner, ...]
    end: float | None = None


def test_values_have_the_types_of_a_data_class() -> None:
    table = {"kind": "a", "inner": [{"name": "n", "sizes": [1, 2.5]}]}
    assert object_of(Outer, table) == Outer("a", (Inner("n", (1.0, 2.5)),))
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"kind": True}, "kind: must be one of"),
        ({"kind": "b"}, "kind: must be one of"),
        ({"inner": [{"name": "n", "sizes": [True]}]}, r"inner\[0\].sizes\[0\]: must be a number"),
        ({"inner": [{"name": 1, "sizes": []}]}, r"inner\[0\].name: must be a text"),
        ({"inner": [{"name": "n"}]}, r"inner\[0\].sizes: is missing"),
        ({"inner": {}}, "inner: must be a list"),
        ({"end": "1"}, "end: must be"),
        ({"end": float("inf")}, "end: must be"),
        ({"more": 1}, "more: no such key"),
    ]
    for change, fault in wrong:
        with pytest.raises(WrongValueError, match=fault):
            object_of(Outer, {**table, **change})
    with pytest.raises(WrongValueError, match="a number"):
        value_of(float, 2**53 + 1)


def bytes_of(content: bytes, rng: random.Random) -> bytes:
    """A content with other bytes."""
    found = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 5])):
        at, what = rng.randrange(len(found) + 1), rng.random()
        if what < 0.3:
            found[at : at + 1] = bytes([rng.randrange(256)])
        elif what < 0.7:
            found[at:at] = rng.choice(PIECES)
        else:
            del found[at : at + rng.choice([1, 1, 10, 100])]
    return bytes(found)


def values_of(content: bytes, rng: random.Random) -> bytes:
    """A content with another value, or without a key."""
    tree = json.loads(content)
    holders: list[tuple[Any, Any]] = []

    def walk(value: Any) -> None:  # noqa: ANN401 - any JSON
        for key in value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
            holders.append((value, key))
            walk(value[key])

    walk(tree)
    holder, key = rng.choice(holders)
    if rng.random() < 0.25:
        del holder[key]
    else:
        holder[key] = copy.deepcopy(rng.choice(VALUES))
    return json.dumps(tree).encode()


PLATFORM = """
robot = { model = "stewart-gough", layout = "aligned", parameters = { x1 = 12, x2 = 8, x3 = 30, x4 = 8 } }
pose = { position = [0, 0, { min = 30, max = 31 }] }
task = [{ sense = "max", axis = [0, 0, 1], pitch = inf }]
solve = { starts = 1 }
"""
MANIFEST = {
    "variables": [{"name": "p_z", "unit": "m", "lower": 0.0, "upper": 1.0, "start": 0.5}],
    "parameters": [{"name": "x1", "unit": "m", "default": 1.0}],
    "limits": [{"key": "leg_length.max", "unit": "m", "default": 3.0, "above": None, "most": 4.0}],
    "constraints": [{"name": "leg_length", "lower": None, "upper": 1.0}],
    "statuses": [{"code": 0, "name": "OK", "meaning": "done"}],
} | {"schema": 1, "name": "n", "prefix": "n", "seeds": 4, "sources": ["n.c"], "headers": []}


def readers_in(folder: Path, cli: Run) -> dict[str, tuple[bytes, Callable[[bytes], object]]]:
    """A content that each reader takes, and the reader."""
    result, file = folder / "result.json", folder / "altered.json"
    assert cli("evaluate", "paper-4.1-helical", "--set", "p_z=30", "--json", str(result))[0] in (0, 1)
    (folder / "n.c").write_text("int x;", encoding="utf-8")
    proof = proof_of(certify(case_from(PLATFORM), gap=1e-2, with_proof=True), "text").as_text().encode()
    claim = ProofClaim("F", "max", "program", 2.5, "graph", b"\x06", ((0.0, 1.0),))
    poses = (((0.0, 1.0),) * 3, "axis", ((0.0, 1.0),), (0.0, 0.0, 1.0))
    unproved = (Unproved("G", "min", "open"),)
    premises = Premises(poses, ((0.0,) * 3,), ("q",), 0.1, 0.2)
    paper = Proof("text", "name", premises, (claim,), (claim,), unproved)

    def read_file(content: bytes) -> object:
        file.write_bytes(content)
        return load_result(file)

    def read_folder(content: bytes) -> object:
        (folder / "manifest.json").write_bytes(content)
        return read_manifest(folder)

    return {
        "proof": (proof, lambda content: read_proof(content.decode(), "file")),
        "workspace": (paper.as_text().encode(), lambda content: read_proof(content.decode(), "file")),
        "result": (result.read_bytes(), read_file),
        "row": (
            line_of(Row(0, "optimal", 1.5, (1.0,), ("p_z max",), (0.1,), "strict", 1e-9)).encode(),
            partial(row_of, Row),
        ),
        "manifest": (json.dumps(MANIFEST).encode(), read_folder),
    }


def refusal(read: Callable[[bytes], object], content: bytes) -> Exception | None:
    """The error with which a content is refused; None for one that is read."""
    try:
        read(content)
    except (InputError, ValueError) as error:
        return error
    return None


def test_any_bytes_are_read_or_refused_in_a_sentence(tmp_path: Path, cli: Run) -> None:
    for name, (content, read) in readers_in(tmp_path, cli).items():
        assert refusal(read, content) is None
        rng = random.Random(name)  # noqa: S311 - a seeded choice of alterations
        altered = [(bytes_of if k % 2 else values_of)(content, rng) for k in range(120)]
        errors = [error for each in altered if (error := refusal(read, each)) is not None]
        assert len(errors) > 40
        # A row that is none is solved again, and bytes that are no text are refused before.
        allowed = (ValueError,) if name == "row" else (InputError, UnicodeDecodeError)
        assert all(isinstance(error, allowed) for error in errors)
        assert all(len(str(error).encode().splitlines()) == 1 for error in errors)


TEXT = find_case("paper-4.1-helical").read_text(encoding="utf-8")
PROGRAM = f"{sys.executable} -P -m screwsynth.nlp"


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "arguments",
    soaked(
        [
            *("models >/dev/full", "evaluate paper-4.2 >&-", "evaluate paper-4.2 --json - >/dev/full"),
            *("evaluate paper-4.2 --json - >&-", "--help >&-", "schema >/dev/full"),
        ],
        ("evaluate paper-4.2 --json - >/dev/full", "--help >&-"),
    ),
)
def test_standard_output_that_takes_nothing(arguments: str, tmp_path: Path) -> None:
    ended = shell(f"{PROGRAM} {arguments}", tmp_path)
    assert (ended.returncode, ended.stdout) == (2, ""), ended
    assert len(ended.stderr.splitlines()) == 1
    assert ended.stderr.startswith("screwsynth: standard output: cannot be written: ")


@pytest.mark.parametrize(
    "arguments",
    soaked(
        [
            *("models 2>/dev/full", "models 2>&- <&-", "evaluate nothing 2>&-"),
            *("solve --no-such-option 2>/dev/full", "check nothing 2>&- <&-"),
        ],
        ("models 2>/dev/full", "check nothing 2>&- <&-"),
    ),
)
def test_standard_error_that_takes_nothing(arguments: str, tmp_path: Path) -> None:
    ended = shell(f"{PROGRAM} {arguments}", tmp_path)
    assert ended.returncode == (0 if arguments.startswith("models") else 2), ended
    assert (ended.stdout == "") == (ended.returncode != 0)


@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        ("models", 0),
        pytest.param("--help", 0, marks=pytest.mark.soak),
        ("evaluate drilling-spindle --set x1=300 --json result.json", 1),
        ("codegen paper-4.1-helical --no-measure --out folder", 0),
    ],
)
def test_standard_output_that_nobody_reads_any_more(arguments: str, status: int, tmp_path: Path) -> None:
    # The reader has ended before the first word; the command writes its files, and has its own exit status.
    begin, end = os.pipe()
    os.close(begin)
    command = [*shlex.split(PROGRAM), *arguments.split()]
    ended = subprocess.run(command, cwd=tmp_path, stdout=end, stderr=subprocess.PIPE, text=True, check=False)
    os.close(end)
    assert (ended.returncode, ended.stderr) == (status, "")
    expected = [word for word in arguments.split() if word in ("result.json", "folder")]
    assert [each.name for each in tmp_path.iterdir()] == expected


def test_no_standard_stream_at_all(tmp_path: Path) -> None:
    # The result must not end up in a file that took the place of a stream.
    assert shell(f"{PROGRAM} evaluate paper-4.2 --json result.json >&- 2>&- <&-", tmp_path).returncode == 2
    text = (tmp_path / "result.json").read_text(encoding="utf-8")
    assert (text[0], text[-2:]) == ("{", "}\n")
    # The status of a process is the command's.
    assert shell(f"{PROGRAM} models {os.devnull}", tmp_path).returncode == 2


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs a device without an end")
@pytest.mark.parametrize("command", ["solve", "report --out page.html", "certify", "check", "verify-proof"])
def test_input_without_an_end(command: str, tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    verb, *options = command.split()
    refusal_of(cli(verb, "/dev/zero", *options), "is larger than")
    assert list(tmp_path.iterdir()) == []


def test_a_byte_order_mark_and_the_largest_case_file(tmp_path: Path, cli: Run) -> None:
    path = tmp_path / "paper-4.1-helical.toml"
    path.write_bytes(b"\xef\xbb\xbf" + TEXT.replace("\n", "\r\n").encode())
    assert cli("evaluate", str(path)) == cli("evaluate", "paper-4.1-helical")
    page = tmp_path / "page.html"
    assert cli("report", str(path), "--starts", "1", "--out", str(page))[0] == 0
    assert "\ufeff" not in page.read_text(encoding="utf-8")
    path = tmp_path / "case.toml"
    for size, status in ((4 * 2**20, 0), (4 * 2**20 + 1, 2)):
        path.write_bytes(TEXT.encode() + b"#" * (size - len(TEXT.encode())))
        assert cli("evaluate", str(path))[0] == status


@pytest.mark.parametrize(
    ("relation", "words"),
    [
        ("1/0 >= x1", "divides by zero"),
        ("x1/(2-2) >= 1", "divides by zero"),
        ("x1/(p_x-p_x) >= 1", "no finite value"),
        ("x1^x1^x1^99999 >= 0", "99999"),
        ("x1^-101 >= 0", "-101"),
        ("1e200*1e200 >= x1", "gives no finite value"),
        ("sqrt(0-1) <= x1", "gives no finite value"),
        ("(0-8)^0.5 <= x1", "gives no finite value"),
        ("10^99*10^99*10^99*10^99 >= x1", "gives no finite value"),
    ],
)
def test_constants_without_a_value(relation: str, words: str, tmp_path: Path, cli: Run) -> None:
    path = str(saved(tmp_path / "case.toml", with_relation(relation)))
    for command in ("evaluate", "solve", "certify"):
        refusal_of(cli(command, path), "case.toml: limits.custom[0]", words)


def with_relation(relation: str) -> str:
    return edited(TEXT, ("[[task]]", f'[limits]\ncustom = ["{relation}"]\n[[task]]'))


def case_with(**changed: Any) -> Case:  # noqa: ANN401 - wrong values of any type
    screw = {"axis": [2, 2, 1], "point": [2, 3, 6], "pitch": 1, **changed.pop("screw", {})}
    numbers = {"x1": 12, "x2": 8, "x3": 0.5, "x4": 0.1, **changed.pop("numbers", {})}
    position = changed.pop("position", [0, 0, 40])
    tasks = changed.pop("tasks", None) or [Task.screw("max", **screw)]
    return Case(stewart_gough(), numbers, position, tasks, **changed)


@pytest.mark.parametrize(
    "wrong", [None, True, "3", b"3", 1 + 2j, [1.0, 2.0], object()], ids=lambda wrong: type(wrong).__name__
)
@pytest.mark.parametrize(
    ("key", "make"),
    [
        ("robot.parameters.x1", lambda wrong: case_with(numbers={"x1": None if isinstance(wrong, list) else wrong})),
        ("robot.parameters.x1", lambda wrong: case_with(numbers={"x1": Free(wrong, 14)})),
        ("robot.parameters.x1", lambda wrong: case_with(numbers={"x1": Free(1, wrong)})),
        ("pose.position[1]", lambda wrong: case_with(position=[0, wrong, 40])),
        ("pose.rotation.angle", lambda wrong: case_with(rotation=Rotation(angle=wrong))),
        ("pose.rotation.axis", lambda wrong: case_with(rotation=Rotation(axis=[0, 0, wrong]))),
        ("task.axis", lambda wrong: case_with(screw={"axis": [0, wrong, 1]})),
        ("task.point", lambda wrong: case_with(screw={"point": [0, wrong, 1]})),
        ("task.pitch", lambda wrong: case_with(screw={"pitch": wrong})),
        ("task[0].twist", lambda wrong: case_with(tasks=[Task([0, 0, wrong, 1, 0, 0])])),
        ("task[0].weight", lambda wrong: case_with(tasks=[Task([0, 0, 1, 1, 0, 0], weight=wrong)])),
        ("robot.characteristic_length", lambda wrong: case_with(characteristic_length=wrong)),
        ("limits.leg_length", lambda wrong: case_with(limits=Limits(LegLength(min=wrong)))),
        ("solve.starts", lambda wrong: Search(starts=wrong)),
        ("solve.seed", lambda wrong: Search(seed=wrong)),
    ],
)
def test_what_is_no_number_in_python(key: str, make: Callable[[object], object], wrong: object) -> None:
    with pytest.raises(CaseError) as caught:
        make(wrong)
    assert str(caught.value).startswith(key)
    assert "\n" not in str(caught.value)


def test_numbers_and_powers_that_are_taken(tmp_path: Path) -> None:
    for number in (np.float32(12), np.int64(12), np.array(12.0), 12):
        assert case_with(numbers={"x1": number}).parameters["x1"] == (12.0,)
    for relation in ("x1^100 >= 0", "x1^0.5 >= 1", "2^x1 >= 0.5", "x1^(3-1)/(4/2) >= -1e3", "-cos(30) <= x1"):
        assert load_case(str(saved(tmp_path / "case.toml", with_relation(relation)))).limits


ROBOT = (Path(__file__).parents[2] / "models" / "robots" / "3-rps.toml").read_text(encoding="utf-8")
# What each command with a CASE needs beside it.
COMMANDS = {
    "solve": (), "evaluate": (), "inverse": ("--poses", "poses.csv"), "report": ("--out", "page.html"), "certify": (),
    "workspace": (), "path": (), "verify-proof": (), "tradeoff": ("--over", "x1=1:2:2"),
    "sweep": ("--over", "x1=1:2:2", "--out", "table.csv"), "pareto": ("--goal", "max F", "--goal", "min limits.a.max"),
    "compare": ("case", "delta"), "export": ("--format", "csv", "--out", "robot"), "codegen": ("--out", "c"),
    "check": (), "view": ("--out", "page.html", "--no-open"),
}  # fmt: skip


def give(content: str | bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put a content into standard input."""
    given = io.BytesIO(content if isinstance(content, bytes) else content.encode())
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(given, encoding="utf-8"))


def test_every_command_reads_standard_input(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    saved(tmp_path / "poses.csv", "x,y,z\n0,0,1\n")
    proof = tmp_path / "proof.json"
    output_of(cli("certify", "paper-4.1-rotation", "--starts", "1", "--gap", "0.5", "--proof", str(proof)))
    taking = [name for name in SUMMARIES if any("CASE" in each.name for each in command_of(name).arguments)]
    assert set(taking) == set(COMMANDS)
    for name, options in COMMANDS.items():
        give(edited(TEXT, ('"stewart-gough"', '"nothing"')), monkeypatch)
        first = (str(proof),) if name == "verify-proof" else ()
        refusal_of(cli(name, *first, "-", *options), 'stdin: robot.model = "nothing": no such robot')
    assert {each.name for each in tmp_path.iterdir()} == {"poses.csv", "proof.json"}


def test_it_is_read_once_for_all_readings(tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    saved(tmp_path / "case.toml", TEXT)
    expected = json.loads(output_of(cli("evaluate", "case.toml", "--json", "-")))
    give(TEXT, monkeypatch)
    found = json.loads(output_of(cli("evaluate", "-", "--json", "-")))
    assert (found.pop("case"), expected.pop("case")) == ("stdin", "case")
    assert found == expected
    # A trade-off reads the case at each value, and a result is of a case that is read before it.
    give(TWO_GOALS, monkeypatch)
    assert "2 values" in output_of(cli("tradeoff", "-", "--over", "x1=12:13:2"))
    output_of(cli("solve", "case.toml", "--starts", "1", "--json", "result.json"))
    give(TEXT, monkeypatch)
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
        (b"#" * (4 * 2**20 + 1), "cannot be read: it is larger than 4 MB"),
    ):
        give(given, monkeypatch)
        refusal_of(cli("solve", "-"), "screwsynth: stdin: ", words)
    monkeypatch.setattr(sys, "stdin", None)
    refusal_of(cli("solve", "-"), "stdin: cannot be read")
    # A file with this name has a folder before it.
    monkeypatch.chdir(tmp_path)
    saved(tmp_path / "-", TEXT)
    assert load_case("./-").name == "-"
