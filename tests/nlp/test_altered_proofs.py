"""Proofs with one field of their files altered, by a little and by much: rejected, or a claim that is true and whole.

Every field of each kind of proof is altered in turn. A proof that is accepted all the same must print what it printed
before, but for bounds, which must still be on the true side of a value that the robot reaches.
"""

import base64
import copy
import hashlib
import json
import re
import tomllib
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from screwsynth.nlp import case_from_tables
from screwsynth.nlp.program.formulation import formulate_each

Run = Callable[..., tuple[int, str, str]]
Place = tuple[str | int, ...]

PLATFORM = """
[units]
length = "cm"
[robot]
model = "stewart-gough"
layout = "aligned"
parameters = { x1 = 12, x2 = 8, x3 = 30, x4 = 8 }
[pose]
position = [0, 0, { min = 30, max = 31 }]
rotation = { axis = [0, 0, 1], angle = { min = -1, max = 1 } }
[solve]
starts = 2
[[task]]
name = "one"
sense = "max"
axis = [2, 2, 1]
point = [2, 3, 6]
pitch = 1
"""
OTHER = """
[[task]]
name = "other"
sense = "SENSE"
axis = [0, 1, 1]
point = [1, 0, 3]
pitch = 2
weight = 3
[combine]
method = "METHOD"
"""
DELTA = """
[robot]
model = "delta"
parameters = { rb = { min = 0.12, max = 0.14 }, rp = 0.044, arm = 0.5, rod = 1.244, w = 0.131, tilt = 20 }
[pose]
position = [0, 0, -1.1]
[[task]]
sense = "max"
axis = [0, 1, 2]
pitch = inf
[solve]
starts = 2
"""
MACHINE = """
[units]
length = "in"
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = 26.5, x2 = 11.543, x3 = 1, x4 = 5 }
[pose]
position = [0, 0, 20]
[[task]]
name = "push"
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
leg_length = { min = 17, max = 44 }
actuator = { stroke_max = 30 }
[workspace]
position = [{ min = -0.5, max = 0.5 }, 0.5, 20]
rotation = { axis = [0, 0, 1], angle = { min = -1, max = 1 } }
"""
SPECTRAL = """smallest_singular_value = { min = 0.25, length = 11.5 }
condition_number = { max = 8, length = 11.5 }
leg_clearance = { min = 0.5 }
"""


class Kind(NamedTuple):
    """A kind of proof: its case, the words of the command that writes it, and those that check it."""

    case: str
    writes: tuple[str, ...]
    checks: tuple[str, ...] = ()


def combined(sense: str, method: str) -> str:
    """The second task, and how both are combined."""
    return OTHER.replace("SENSE", sense).replace("METHOD", method)


LIMITED = MACHINE.replace("[workspace]", SPECTRAL + "[workspace]")
TOLERANCE = "[tolerance]\njoint_centre = 0.01\n"
KINDS = {
    "task": Kind(PLATFORM, ("certify", "--gap", "1e-2")),
    "above": Kind(PLATFORM, ("certify", "--above", "1"), ("--above", "1")),
    "weighted sum": Kind(PLATFORM + combined("max", "weighted-sum"), ("certify",)),
    "worst case": Kind(PLATFORM + combined("max", "worst-case"), ("certify",)),
    "worst loss": Kind(PLATFORM + combined("min", "worst-case"), ("certify",)),
    "no point": Kind(PLATFORM + "[limits]\nleg_length = { max = 3 }\n", ("certify",)),
    "home's mode": Kind(DELTA, ("certify",)),
    "workspace": Kind(LIMITED, ("workspace", "--gap", "0.1", "--leg-error", "0.01"), ("--leg-error", "0.01")),
    "machines": Kind(
        MACHINE.replace("[workspace]", TOLERANCE + "[workspace]"),
        ("workspace", "--gap", "0.1", "--leg-error", "0.01"),
        ("--leg-error", "0.01"),
    ),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of cases and proofs."""
    return tmp_path_factory.mktemp("proofs")


def written(cli: Run, folder: Path, name: str) -> dict[str, Any]:
    """The content of a proof's file, which is written when it is asked for first."""
    case, target = folder / f"{name}.toml", folder / f"{name}.json"
    if not target.exists():
        case.write_text(KINDS[name].case, encoding="utf-8")
        command, *options = KINDS[name].writes
        cli(command, str(case), *options, "--proof", str(target), "--json", str(folder / f"{name}.result"))
        assert target.exists()
    content: dict[str, Any] = json.loads(target.read_text(encoding="utf-8"))
    return content


def checked(cli: Run, folder: Path, name: str, content: object) -> tuple[int, str, str]:
    """The check of a content of a proof's file."""
    file = folder / "altered.json"
    file.write_text(json.dumps(content), encoding="utf-8")
    return cli("verify-proof", str(file), str(folder / f"{name}.toml"), *KINDS[name].checks)


def places(content: object, place: Place = ()) -> Iterator[Place]:
    """The places of all values in a file; of lists that are longer than two those of the first and the last entry."""
    yield place
    if isinstance(content, dict):
        for key, value in content.items():
            yield from places(value, (*place, key))
    elif isinstance(content, list):
        for index in sorted({0, len(content) - 1}) if content else ():
            yield from places(content[index], (*place, index))


def others_of(value: object, rng: np.random.Generator) -> list[object]:
    """Other values in the place of one: near ones, far ones, and ones of other types."""
    if isinstance(value, bool):
        return [not value, 1, None, "true"]
    if isinstance(value, int | float):
        small = [value * (1 + 1e-12), value * (1 - 1e-6), value + 1e-9, value - 0.019999999999]
        return [*small, -value, 0, value * 1.5, value * 0.5, 1e300, -1e300, None, True, str(value), [value]]
    if isinstance(value, str):
        flipped = value[: len(value) // 2] + chr(33 + rng.integers(90)) + value[len(value) // 2 + 1 :]
        return ["", flipped, value + " ", value[:-1], None, 0, ["x"]]
    if isinstance(value, list):
        return [[], value[1:], value[::-1], [*value, *value[:1]], None, {}, 0, "x"]
    return [{}, {**value, "more": 1}, [], None, 0, "x"] if isinstance(value, dict) else [0.0, 1.0, -1e9, "x", []]


def with_value(content: object, place: Place, value: object) -> Any:  # noqa: ANN401 - any JSON
    """A copy of a file's content with another value at a place."""
    if not place:
        return value
    found = copy.deepcopy(content)
    inner: Any = found
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return found


def trees(content: dict[str, Any], rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    """Copies of a file with other nodes in its trees, with digests to match."""
    for place in [each for each in places(content) if each[-1:] == ("tree",)]:
        inner: Any = content
        for key in place:
            inner = inner[key]
        nodes = zlib.decompress(base64.b64decode(inner))
        several = [nodes[:-1], nodes + b"\x06", b"", b"\x06", b"\x02", b"\x03", b"\x07\x00"]
        for _ in range(3 if nodes else 0):
            one = bytearray(nodes)
            one[rng.integers(len(one))] = rng.integers(256)
            several.append(bytes(one))
        for each in several:
            text = base64.b64encode(zlib.compress(each)).decode()
            found = with_value(content, place, text)
            yield with_value(found, (*place[:-1], "digest"), hashlib.sha256(each).hexdigest())


def alterations(content: dict[str, Any], rng: np.random.Generator) -> Iterator[tuple[str, Any]]:
    """Names of altered fields, with the altered contents of the file."""
    for place in places(content):
        value: Any = content
        for key in place:
            value = value[key]
        name = ".".join(map(str, place))
        for other in others_of(value, rng):
            yield f"{name}: {str(value)[:40]!r} -> {str(other)[:40]!r}", with_value(content, place, other)
        if place and isinstance(place[-1], str):
            found = copy.deepcopy(content)
            inner: Any = found
            for key in place[:-1]:
                inner = inner[key]
            del inner[place[-1]]
            yield f"{name}: taken out", found
    for each in trees(content, rng):
        yield "another tree", each


BOUND = re.compile(r"at (most|least) ([^\s,]+)")
BOXES = re.compile(r"[\d,]+ leaves, shown on .*\n")
LOSSES = re.compile(r"F being the largest of (\S+) \((\S+) - F\('one'\)\) and (\S+) \(F\('other'\) - (\S+)\)")


def least_loss(weight: float, best: float, other_weight: float, other_best: float) -> float:
    """The worst of two losses, the least of it on a grid of the box; F is summed over the rows of J."""
    case = case_from_tables(tomllib.loads(KINDS["worst loss"].case), name="grid", source="grid")
    nlps = formulate_each(case)
    points = np.stack(np.meshgrid(*np.linspace(nlps[0].lower, nlps[0].upper, 21).T), axis=-1).reshape(-1, nlps[0].n)
    first, second = (np.array([nlp.evaluate(x).F for x in points]) for nlp in nlps)
    return float(np.maximum(weight * (best - first), other_weight * (second - other_best)).min())


def is_true(before: str, after: str, reached: dict[tuple[str, str], float]) -> bool:
    """Whether an output says what another one said, but for bounds that are still beyond values that are reached."""
    before, after = (BOXES.sub("", each) for each in (before, after))
    if before.startswith("holds: there is no feasible point"):
        # Every claim about the points of an empty set is true.
        return before.partition(" within ")[2] in after or ", F being that of task 'one'" in after
    if (found := LOSSES.search(after)) and after[found.start() :] != before[found.start() :]:
        return least_loss(*map(float, found.groups())) >= float(BOUND.findall(after)[0][1])
    if BOUND.sub("BOUND", before) != BOUND.sub("BOUND", after):
        return False
    for old, line in zip(before.splitlines(), after.splitlines(), strict=True):
        for (side, first), (_, second) in zip(BOUND.findall(old), BOUND.findall(line), strict=True):
            value = reached.get((line.strip().partition(":")[0], side), float(first))
            # A value that no search has reached may lie between it and the bound.
            sign = 1.0 if side == "most" else -1.0
            if first != second and not sign * (float(second) - value) >= -1e-9 * abs(value):
                return False
    return True


def reached_values(folder: Path, name: str) -> dict[tuple[str, str], float]:
    """Values that a search has found, by the beginning of the line about them and the side of the bound."""
    result = json.loads((folder / f"{name}.result").read_text(encoding="utf-8"))
    if "extremes" in result:
        side = {"max": "most", "min": "least"}
        return {(each["name"], side[each["sense"]]): each["reached"] for each in result["extremes"]}
    value = (result["certificate"] or {}).get("incumbent")
    return {} if value is None else {("holds", side): value for side in ("most", "least")}


def faults_of(cli: Run, folder: Path, name: str, part: float, seed: int = 0) -> tuple[list[str], int, int]:
    """Altered fields that are accepted with a false claim, or refused in a wrong way; numbers of tries and accepted."""
    content, rng = written(cli, folder, name), np.random.default_rng(seed)
    code, before, err = checked(cli, folder, name, content)
    assert (code, err) == (0, ""), err
    reached = reached_values(folder, name)
    faults, tries, accepted = [], 0, 0
    for what, altered in alterations(content, rng):
        if rng.random() > part:
            continue
        tries += 1
        code, out, err = checked(cli, folder, name, altered)
        accepted += code == 0
        if code == 0 and not is_true(before, out, reached):
            faults.append(f"{what}: {out}")
        if code and (code not in (1, 2) or out or len(err.splitlines()) != 1 or "Traceback" in err):
            faults.append(f"{what}: exit {code}: {err}")
    return faults, tries, accepted


@pytest.mark.parametrize("name", list(KINDS))
def test_an_altered_field_is_rejected_or_changes_nothing_but_a_true_bound(cli: Run, folder: Path, name: str) -> None:
    faults, tries, _ = faults_of(cli, folder, name, 0.03 if name in ("workspace", "machines") else 0.1)
    assert not faults
    assert tries > 10
