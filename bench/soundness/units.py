"""Every robot of the gallery with literal numbers, in five units of length: equal verdicts, searches and numbers.

    python bench/soundness/units.py COUNT FIRST [JOURNAL]

Seeds from 0 to 119 are all robots in all units. A case is stated in metres with the robot's parameters, and with a
robot file of numbers alone in the unit. Each command answers both: words and verdicts are the same, boxes of a search
differ by 2 % at most, and each number of the answer is the same but for a whole power of the unit, to 1e-9.
"""

from __future__ import annotations

import itertools
import json
import re
import subprocess
import tomllib
from collections import Counter
from collections.abc import Iterator, Set
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from campaign import Row, campaign, command
from randomcases import text_of
from robots import FOLDER, evaluated

Tables = dict[str, Any]
#: Units in a metre. Programs of G-code are read for all but km.
UNITS = {"m": 1.0, "um": 1e6, "mm": 1e3, "in": 1 / 0.0254, "km": 1e-3}
NAMES = sorted(each.stem for each in FOLDER.glob("*.toml"))
#: Largest relative difference of numbers, of those of a local search, and of boxes; size of numbers that are rounding.
SAME, NEAR, BOXES, NOISE = 1e-9, 1e-6, 0.02, 1e-9
#: Powers of a length that numbers have: F of a rotation is a squared length, and a row of J in it one.
POWERS = (0, 1, -1, 2, -2)
#: Keys of JSON that depend on the computer, those of one of several equal places, and those of numbers of boxes.
SKIPPED = {"seconds", "version", "source", "units", "case", "model", "parameters", "history", "file"} | {
    "pose",
    "machine",
}
COUNTED = {"boxes", "open"}
#: Number of boxes that makes no difference: a choice among equal boxes.
FEW = 8
#: Numbers at which a search ends, within its gap beyond the best value known; the gap; by how much two ends may differ.
SEARCHED, GAP, APART = {"bound", "reached"}, 0.1, 0.2
#: Keys of numbers that depend on the scale of variables and loops, which is the robot's size.
SCALED = frozenset({"multiplier", "eigenvalues", "stationarity", "feasibility", "boxes", "open", "iterations"})
#: Limits that are lengths, in starter cases.
LENGTHS = {"leg_length", "actuator_length", "leg_clearance", "link_clearance", "joint_spacing", "footprint", "actuator"}
POINTS = ((0.0, 0.0, 0.0), (0.4, 0.2, 0.3), (-0.3, 0.5, -0.2), (0.1, -0.4, 0.1))


class Answer(NamedTuple):
    """What a command answers: exit status, JSON or text, and messages."""

    status: int
    result: Any
    words: str


def count_steps() -> None:
    """Let a second be a hundred looks of searches at the clock, so that two of one case end at the same step."""
    looks = [0]

    def look() -> float:
        looks[0] += 1
        return looks[0] / 100

    for name, clock in (("proof.boxes.search", look), ("interruption", lambda: looks[0] / 100)):
        import_module(f"screwsynth.nlp.{name}").time = SimpleNamespace(perf_counter=clock)  # type: ignore[attr-defined]


def literal_robot(name: str, scale: float) -> str:
    """Return a robot file with numbers in the place of parameters, expressions and names."""
    tables = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    names: Tables = {}
    for key, item in tables.pop("dimensions").items():
        names[key] = np.radians(item["typical"]) if item.get("kind") == "angle" else item["typical"] * scale
    for key, text in tables.pop("derived", {}).items():
        names[key] = evaluated(text, names)

    def joint(item: Tables, own: Tables) -> Tables:
        found = dict(item)
        for key in ("at", "to"):
            if key in item:
                found[key] = np.asarray(evaluated(item[key], own)).tolist()
        if "axis" in item:
            found["axis"] = np.asarray(evaluated(item["axis"], own)).tolist()
        if "axes" in item:
            found["axes"] = [np.asarray(evaluated(each, own)).tolist() for each in item["axes"]]
        return found

    limbs = []
    for limb in tables.pop("limb"):
        own = names | {key: evaluated(each, names) for key, each in limb.pop("points", {}).items()}
        for part in (limb, *limb.get("branch", ())):
            part["joints"] = [joint(each, own) for each in part["joints"]]
        limbs.append(limb)
    tables["home"] = np.asarray(evaluated(tables["home"], names)).tolist()
    tables.pop("length_unit", None)
    head = "".join(f"{key} = {json.dumps(each)}\n" for key, each in tables.items())
    return head + text_of({"limb": limbs})


@cache
def starter_of(name: str) -> str:
    """Return the starter case of a robot."""
    return command("new", name)[1]


def case_of(name: str, unit: str, scale: float, *, parameters: bool, kind: str) -> Tables:
    """Return a case in a unit: the starter's, with its pose fixed or free, in its workspace.

    Args:
        name: of the robot.
        unit: label of the unit.
        scale: units in a metre.
        parameters: whether the robot is that of the gallery, with its parameters in metres.
        kind: ``pose``, or ``free`` for one with free numbers.
    """
    text = starter_of(name)
    tables = tomllib.loads(text)
    # The workspace is commented out, from its heading on.
    commented = re.sub(r"^# ", "", text[text.index("# [workspace]") :], flags=re.MULTILINE).partition("\n[solve]")[0]
    tables |= tomllib.loads(re.sub(r"#.*", "", commented))
    typical = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))["dimensions"]
    robot = tables["robot"]
    if parameters:
        robot["parameters"] = {key: item["typical"] for key, item in typical.items()}
    else:
        del robot["model"], robot["parameters"]
        robot["file"] = "robot.toml"
    tables["units"]["length"] = unit
    tables["solve"] = {"starts": 4, "seed": 0}
    centred = [middle(each) for each in tables["workspace"]["position"]]
    if kind == "pose":
        tables["pose"] = {"position": centred}
    else:
        tables["pose"]["position"] = list(tables["workspace"]["position"])
        if not any(isinstance(each, dict) for each in tables["pose"]["position"]):
            tables["pose"]["rotation"] = tables["workspace"]["rotation"]
    tables["title"] = "units"
    title = {"title": tables.pop("title")}
    return {"": title} | scaled(tables, scale)


def middle(value: Any) -> float:  # noqa: ANN401 - a number or its range
    """Return the middle of a range."""
    return 0.5 * (value["min"] + value["max"]) if isinstance(value, dict) else float(value)


def scaled(tables: Tables, scale: float) -> Tables:
    """Return the tables of a case with all lengths in another unit."""
    found = json.loads(json.dumps(tables))

    def lengths(value: Any) -> Any:  # noqa: ANN401 - numbers of a case
        if isinstance(value, dict):
            return {key: lengths(each) for key, each in value.items()}
        return [lengths(each) for each in value] if isinstance(value, list) else value * scale

    for key in ("pose", "workspace"):
        found[key]["position"] = lengths(found[key]["position"])
    for task in found["task"]:
        for key in ("point", "pitch"):
            if key in task:
                task[key] = lengths(task[key])
    if "characteristic_length" in found["robot"]:
        found["robot"]["characteristic_length"] *= scale
    for key, limit in found.get("limits", {}).items():
        if key in LENGTHS:
            found["limits"][key] = lengths(limit)
        elif isinstance(limit, dict) and "length" in limit:
            limit["length"] *= scale
    return found


def quoted(value: Any) -> Any:  # noqa: ANN401 - tables
    """Return tables with names in quotes where TOML needs them."""
    if isinstance(value, dict):
        return {key if re.fullmatch(r"[\w-]+", key) else json.dumps(key): quoted(each) for key, each in value.items()}
    return [quoted(each) for each in value] if isinstance(value, list) else value


def written(tables: Tables) -> str:
    """Return the text of a case."""
    head = "".join(f"{key} = {json.dumps(each)}\n" for key, each in tables[""].items())
    return head + text_of(quoted({key: each for key, each in tables.items() if key}))


def answers(name: str, unit: str, *, parameters: bool) -> dict[str, Answer]:
    """Return what each command answers about a robot in a unit, by the command."""
    scale = UNITS[unit]
    found: dict[str, Answer] = {}
    with TemporaryDirectory() as word:
        folder = Path(word)
        (folder / "robot.toml").write_text(literal_robot(name, scale), encoding="utf-8")
        cases = {kind: folder / f"{kind}.toml" for kind in ("pose", "free", "tolerance")}
        tables = {kind: case_of(name, unit, scale, parameters=parameters, kind=kind) for kind in ("pose", "free")}
        half = [each for each in tables["pose"]["workspace"]["position"] if isinstance(each, dict)]
        size = max([abs(each["max"] - each["min"]) for each in half], default=0.1 * scale)
        tables["tolerance"] = tables["pose"] | {"tolerance": {"joint_centre": 1e-4 * size}, "limits": {}}
        for kind, path in cases.items():
            path.write_text(written(tables[kind]), encoding="utf-8")
        poses = csv_of(tables["pose"], folder / "poses.csv", timed=False)
        path = csv_of(tables["pose"], folder / "path.csv", timed=True)

        def ask(key: str, *words: str) -> None:
            out = folder / "out.json"
            out.unlink(missing_ok=True)
            status, text, err = command(*words, "--json", str(out))
            result = json.loads(out.read_text(encoding="utf-8")) if out.exists() else text
            found[key] = Answer(status, result, err)

        ask("evaluate", "evaluate", str(cases["pose"]))
        ask("solve", "solve", str(cases["free"]))
        ask("certify", "certify", str(cases["free"]), "--gap", str(GAP), "--time", "2")
        proof = folder / "proof.zip"
        ask("workspace", "workspace", str(cases["pose"]), "--gap", str(GAP), "--time", "2", "--proof", str(proof))
        if proof.exists():
            status, text, err = command("verify-proof", str(proof), "--all")
            found["verify-proof"] = Answer(status, text, err)
        ask("tolerance", "workspace", str(cases["tolerance"]), "--gap", str(GAP), "--time", "2")
        ask("path", "path", str(cases["pose"]), "--along", str(path), "--time", "5")
        if unit != "km":
            program = gcode_of(tables["pose"], folder / "program.ngc", scale)
            ask("gcode", "path", str(cases["pose"]), "--along", str(program), "--unit", "mm", "--time", "5")
        ask_text(found, "inverse", "inverse", str(cases["pose"]), "--poses", str(poses), "--csv", "-", "--derivatives")
        ask_import(found, folder, cases["pose"])
        out = folder / "c"
        status, text, err = command("codegen", str(cases["free"]), "--out", str(out), "--no-measure")
        if not status:
            made = subprocess.run(["make", "-C", str(out), "test"], capture_output=True, text=True, check=False)
            status, text, err = made.returncode, "", made.stdout[-2000:] + made.stderr[-2000:]
        found["codegen"] = Answer(status, {}, err)
    return found


def ask_text(found: dict[str, Answer], key: str, *words: str) -> None:
    """Add what a command writes as CSV."""
    status, text, err = command(*words)
    rows = [line.split(",") for line in text.splitlines()]
    cells = [[number_or_word(cell) for cell in row] for row in rows]
    found[key] = Answer(status, cells, err)


def number_or_word(cell: str) -> float | str:
    """Return the number of a cell, or its words."""
    try:
        return float(cell)
    except ValueError:
        return cell


def ask_import(found: dict[str, Answer], folder: Path, case: Path) -> None:
    """Add what is read of the robot as MJCF, with all its lengths in the unit of the case."""
    model = folder / "model"
    status, _, err = command("export", str(case), "--format", "mjcf", "--out", str(model))
    if status:
        found["export"] = Answer(status, "", err)
        return
    xml = model / "robot.xml"
    out = folder / "imported.toml"
    status, _, err = command("import", str(xml), "--platform", "platform", "--out", str(out), "--force")
    read = tomllib.loads(out.read_text(encoding="utf-8")) if out.exists() else {}
    found["import"] = Answer(status, read, err)


def csv_of(tables: Tables, file: Path, *, timed: bool) -> Path:
    """Write poses of the workspace as a table, and return the file."""
    rows = enumerate(path_poses(tables))
    lines = ["x,y,z,roll,pitch,yaw" + ",t" * timed]
    lines += [",".join(repr(each) for each in [*at, *[float(k)] * timed]) for k, at in rows]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def path_poses(tables: Tables) -> Iterator[list[float]]:
    """Yield poses of the workspace: positions, and angles in degrees."""
    workspace = tables["workspace"]
    turns = workspace.get("rotation", {})
    for place in POINTS:
        position = [at_part(value, part) for value, part in zip(workspace["position"], place, strict=True)]
        angles = [
            at_part(turns.get(key, 0.0), 0.5 * part) for key, part in zip(("roll", "pitch", "yaw"), place, strict=True)
        ]
        yield [*position, *angles]


def at_part(value: Any, part: float) -> float:  # noqa: ANN401 - a number or its range
    """Return the number at a part of half a range from its middle."""
    if not isinstance(value, dict):
        return float(value)
    return middle(value) + part * 0.5 * (value["max"] - value["min"])


def gcode_of(tables: Tables, file: Path, scale: float) -> Path:
    """Write the same path as a program in millimetres, and return the file."""
    lines = ["G21 G90 F500"]
    for at in path_poses(tables):
        values = [each * 1000 / scale for each in at[:3]] + at[3:]
        words = [f"{axis}{value:.9f}" for axis, value in zip("XYZABC", values, strict=True)]
        lines.append(" ".join(["G1", *words]))
    file.write_text("\n".join([*lines, "M2"]) + "\n", encoding="utf-8")
    return file


@cache
def known_answers(name: str, *, parameters: bool) -> dict[str, Answer]:
    """Return the answers about a robot in metres."""
    return answers(name, "m", parameters=parameters)


def differences(one: Any, other: Any, scale: float, same: float, skipped: Set[str], path: str = "") -> Iterator[str]:  # noqa: ANN401 - JSON
    """Yield the places at which two answers differ by more than a power of the unit."""
    if isinstance(one, dict) and isinstance(other, dict):
        keys = [key for key in {**one, **other} if key not in SKIPPED | skipped]
        for key in keys:
            if (key in one) != (key in other):
                yield f"{path}.{key}: in one alone"
            elif key in COUNTED:
                if abs(one[key] - other[key]) > max(BOXES * max(one[key], other[key]), FEW):
                    yield f"{path}.{key}: {one[key]} and {other[key]}"
            else:
                near = APART if key in SEARCHED else same
                yield from differences(one[key], other[key], scale, near, skipped, f"{path}.{key}")
    elif isinstance(one, list) and isinstance(other, list):
        if len(one) != len(other):
            yield f"{path}: {len(one)} and {len(other)} items"
            return
        if one and all(is_number(each) for each in (*one, *other)):
            if not are_same(np.array(one), np.array(other), scale, same):
                yield f"{path}: {one} and {other}"
            return
        for k, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from differences(a, b, scale, same, skipped, f"{path}[{k}]")
    elif is_number(one) and is_number(other):
        if not are_same(np.array([one]), np.array([other]), scale, same):
            yield f"{path}: {one!r} and {other!r}"
    elif isinstance(one, str) and isinstance(other, str):
        if plain(one) != plain(other):
            yield f"{path}: {one!r} and {other!r}"
    elif one != other:
        yield f"{path}: {one!r} and {other!r}"


def is_number(value: object) -> bool:
    """Return whether a value of JSON is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def are_same(one: Any, other: Any, scale: float, same: float) -> bool:  # noqa: ANN401 - arrays
    """Return whether two arrays are the same but for powers of the unit.

    A vector may hold lengths and angles: then each number is compared by itself.
    """
    size = float(np.abs(one).max(initial=0.0))
    for power in POWERS:
        if np.abs(one * scale**power - other).max() <= same * size * scale**power:
            return True
    pairs = zip(one.ravel().tolist(), other.ravel().tolist(), strict=True)
    return all(
        any(
            abs(a * scale**power - b) <= (same * abs(a) + NOISE * max(size, 1.0) * (abs(a) < 1e-7)) * scale**power
            for power in POWERS
        )
        for a, b in pairs
    )


def plain(text: str) -> str:
    """Return words without numbers and units of length."""
    text = re.sub(r"[-+]?\d+(?:,\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?", "#", text)
    return " ".join(re.sub(r"\b(um|mm|in|km|m|unit)\b", "m", text).lower().split())


def examine(seed: int) -> Row:
    """Compare a robot of literal numbers in a unit with that in metres, and this one with that of parameters."""
    name, unit = NAMES[seed // len(UNITS) % len(NAMES)], list(UNITS)[seed % len(UNITS)]
    counts, faults = Counter[str](), []
    known = known_answers(name, parameters=unit == "m")
    found = known_answers(name, parameters=False) if unit == "m" else answers(name, unit, parameters=False)
    # The size of a robot of parameters is another one: searches with all loops are scaled by it.
    skipped = SCALED if unit == "m" else frozenset[str]()
    for key, each in found.items():
        before = known.get(key)
        if before is None:
            faults.append(f"{name} in {unit}: {key}: not in metres")
            continue
        counts[f"{key} {each.status}"] += 1
        own = []
        if before.status != each.status:
            own.append(f"status {before.status} and {each.status}: {each.words.strip()[-300:]}")
        same = NEAR if key in ("solve", "certify") else SAME
        own += list(itertools.islice(differences(before.result, each.result, UNITS[unit], same, skipped), 5))
        if plain(before.words) != plain(each.words) and key != "codegen":
            own.append(f"{before.words[-200:]!r} and {each.words[-200:]!r}")
        faults += [f"{name} in {unit}: {key}: {fault}" for fault in own]
    return {"counts": counts, "faults": faults}


if __name__ == "__main__":
    count_steps()
    campaign(examine)
