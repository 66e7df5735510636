"""Streams, files and values that go wrong in ways of their own: a sentence and a status, never a traceback."""

import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from builders import Run, refusal_of, saved

from screwsynth.models import stewart_gough
from screwsynth.nlp import Case, CaseError, Free, LegLength, Limits, Rotation, Search, Task, load_case
from screwsynth.nlp.case.source import find_case

TEXT = find_case("paper-4.1-helical").read_text(encoding="utf-8")
PROGRAM = f"{sys.executable} -P -m screwsynth.nlp"


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("arguments", "stream"),
    [
        ("models", ">/dev/full"),
        ("evaluate paper-4.2", ">&-"),
        ("evaluate paper-4.2 --json -", ">/dev/full"),
        ("evaluate paper-4.2 --json -", ">&-"),
        ("--help", ">&-"),
        ("schema", ">/dev/full"),
    ],
)
def test_standard_output_that_takes_nothing(arguments: str, stream: str, tmp_path: Path) -> None:
    ended = shell(f"{PROGRAM} {arguments} {stream}", tmp_path)
    assert (ended.returncode, ended.stdout) == (2, ""), ended
    assert len(ended.stderr.splitlines()) == 1
    assert ended.stderr.startswith("screwsynth: standard output: cannot be written: ")


@pytest.mark.parametrize(
    ("arguments", "status", "stream"),
    [
        ("models", 0, "2>/dev/full"),
        ("models", 0, "2>&- <&-"),
        ("evaluate nothing", 2, "2>&-"),
        ("solve --no-such-option", 2, "2>/dev/full"),
        ("check nothing", 2, "2>&- <&-"),
    ],
)
def test_standard_error_that_takes_nothing(arguments: str, status: int, stream: str, tmp_path: Path) -> None:
    ended = shell(f"{PROGRAM} {arguments} {stream}", tmp_path)
    assert ended.returncode == status, ended
    assert (ended.stdout == "") == (status != 0)


@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        ("models", 0),
        ("--help", 0),
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
    ended = shell(f"{PROGRAM} evaluate paper-4.2 --json result.json >&- 2>&- <&-", tmp_path)
    assert ended.returncode == 2
    assert (tmp_path / "result.json").read_text(encoding="utf-8").startswith("{")
    assert (tmp_path / "result.json").read_text(encoding="utf-8").endswith("}\n")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs a device without an end")
@pytest.mark.parametrize("command", ["solve", "report --out page.html", "certify", "check", "verify-proof"])
def test_input_without_an_end(command: str, tmp_path: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    verb, *options = command.split()
    refusal_of(cli(verb, "/dev/zero", *options), "is larger than")
    assert list(tmp_path.iterdir()) == []


def test_the_largest_case_file(tmp_path: Path, cli: Run) -> None:
    path = tmp_path / "case.toml"
    for size, status in ((4 * 2**20, 0), (4 * 2**20 + 1, 2)):
        path.write_bytes(TEXT.encode() + b"#" * (size - len(TEXT.encode())))
        assert cli("evaluate", str(path))[0] == status


def test_a_byte_order_mark(tmp_path: Path, cli: Run) -> None:
    path = tmp_path / "paper-4.1-helical.toml"
    path.write_bytes(b"\xef\xbb\xbf" + TEXT.replace("\n", "\r\n").encode())
    assert cli("evaluate", str(path)) == cli("evaluate", "paper-4.1-helical")
    page = tmp_path / "page.html"
    assert cli("report", str(path), "--starts", "1", "--out", str(page))[0] == 0
    assert "\ufeff" not in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("relation", "words"),
    [
        ("1/0 >= x1", "divides by zero"),
        ("x1/(2-2) >= 1", "divides by zero"),
        ("x1/(p_x-p_x) >= 1", "no finite value"),
        ("x1^x1^x1^99999 >= 0", "99999"),
        ("x1^-101 >= 0", "-101"),
        ("1e200*1e200 >= x1", "without a finite value"),
        ("sqrt(0-1) <= x1", "without a finite value"),
        ("(0-8)^0.5 <= x1", "without a finite value"),
        ("10^99*10^99*10^99*10^99 >= x1", "without a finite value"),
    ],
)
@pytest.mark.parametrize("command", ["evaluate", "solve", "certify"])
def test_constants_without_a_value(relation: str, words: str, command: str, tmp_path: Path, cli: Run) -> None:
    path = saved(tmp_path / "case.toml", TEXT.replace("[[task]]", f'[limits]\ncustom = ["{relation}"]\n[[task]]', 1))
    refusal_of(cli(command, str(path)), "case.toml: limits.custom[0]", words)


def test_powers_that_stay(tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    for relation in ("x1^100 >= 0", "x1^0.5 >= 1", "2^x1 >= 0.5", "x1^(3-1)/(4/2) >= -1e3", "-cos(30) <= x1"):
        path.write_text(TEXT.replace("[[task]]", f'[limits]\ncustom = ["{relation}"]\n[[task]]', 1), encoding="utf-8")
        assert load_case(str(path)).limits


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
        (
            "robot.parameters.x1",
            lambda wrong: case_with(numbers={"x1": wrong if not isinstance(wrong, list) else None}),
        ),
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


def test_what_is_a_number_in_python() -> None:
    import numpy as np  # noqa: PLC0415 - one test needs it

    for number in (np.float32(12), np.int64(12), np.array(12.0), 12):
        assert case_with(numbers={"x1": number}).parameters["x1"] == (12.0,)


def test_the_status_of_a_process_is_its_own(tmp_path: Path) -> None:
    assert shell(f"{PROGRAM} models {os.devnull}", tmp_path).returncode == 2
