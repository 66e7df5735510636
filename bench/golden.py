"""Hold two installations of screwsynth to each other: verdicts, bounds, boxes, proofs, results, generated C, CPU time.

    python -P bench/golden.py OLD/bin/screwsynth NEW/bin/screwsynth [--only TEXT] [--boxes 0.02] [--keep FOLDER]

Each item is one or two commands, run by both programs in turn from the same files, so that it outlives any change
inside. Compared are exit statuses, every number and text of their JSON but additions, and the C: whole numbers named
``boxes``, ``pieces`` or ``leaves`` to the given part, other numbers to 1e-12, all but times and versions. Of searches
that a time limit ends nothing is compared but that they are. The last line has the CPU time of new over old: median,
90 %, largest.

The cases are the shipped ones, all robots of the gallery at home and over small envelopes, the tables of
docs/certificate.md and docs/workspace.md, tool paths, ranges of coordinates, and tables of designs.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from screwsynth.models import Dimension
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import build_model, shipped_cases

#: Words of names of values that may differ: times, and what names the program itself.
_MASKED = ("seconds", "times", "version", "versions", "history")
#: Words of names of counts.
_COUNTS = ("boxes", "pieces", "leaves")
_NEAR = 1e-12

_HEXAPOD = """
[units]
length = "in"
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = {{ x1 = 26.5, x2 = 11.543, x3 = 0, x4 = 5 }}
[pose]
position = [0, 0, 20]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[workspace]
position = [{{ min = -5, max = 5 }}, {{ min = -5, max = 5 }}, {{ min = 15, max = 25 }}]
rotation = {rotation}
{more}
"""


@dataclass
class Item:
    """Commands on one case.

    Attributes:
        name: what it is called.
        case: name of a shipped case, or text of a case file.
        commands: arguments without the program; CASE, JSON, TABLE, PROOF, FOLDER and PATH stand for paths.
        path: name and text of the file PATH of a tool path.
    """

    name: str
    case: str
    commands: list[list[str]]
    path: tuple[str, str] = ("", "")


@dataclass
class Run:
    """What the commands of an item gave: exit statuses, data, and CPU seconds."""

    statuses: list[int] = field(default_factory=list)
    data: list[object] = field(default_factory=list)
    seconds: float = 0.0


def items() -> Iterator[Item]:
    """Yield everything that is compared."""
    yield from solved_items()
    yield from gallery_items()
    yield from workspace_items()
    yield from path_items()
    yield from range_items()
    yield from design_items()


def solved_items() -> Iterator[Item]:
    """Yield solves, certificates and generated C of shipped cases, and start-up."""
    for name in shipped_cases():
        yield Item(f"solve {name}", name, [["solve", "CASE", "--json", "JSON"]])
    for name, gap in (
        ("paper-4.1-helical", "1e-4"), ("paper-4.1-rotation", "1e-4"), ("paper-4.2-rotation", "1e-4"),
        ("paper-4.3", "1e-4"), ("paper-4.4-max", "1e-4"), ("paper-4.4-min", "1e-4"), ("drilling-spindle", "1e-4"),
        ("camera-mount", "1e-2"), ("free-wrist", "1e-4"), ("hexapod-machining", "0.5"),
    ):  # fmt: skip
        search = ["certify", "CASE", "--gap", gap, "--jobs", "1", "--starts", "8", "--json", "JSON", "--proof", "PROOF"]
        yield Item(f"certify {name}", name, [search, ["verify-proof", "PROOF", "CASE"]])
    for name in ("paper-4.1-helical", "camera-mount", "hexapod-machining"):
        yield Item(f"codegen {name}", name, [["codegen", "CASE", "--out", "FOLDER", "--no-measure"]])
    yield Item("start-up", "paper-4.1-helical", [["--help"], ["evaluate", "CASE", "--set", "p_z=30"]])


def gallery_items() -> Iterator[Item]:
    """Yield certificates and workspaces of the robots of the gallery."""
    for name in gallery_names():
        yield Item(f"certify home {name}", _robot(name), [["certify", "CASE", "--starts", "2", "--json", "JSON"]])
        whole = ["workspace", "CASE", "--gap", "0.1", "--proof", "PROOF", "--json", "JSON"]
        yield Item(f"workspace {name}", _robot(name, 0.02, 5), [whole, ["verify-proof", "PROOF", "CASE"]])
    for name, part, degrees in (("6-rus", 0.05, 10), ("6-pus", 0.05, 15), ("6-ups", 0.1, 20)):
        yield Item(
            f"wide {name}", _robot(name, part, degrees), [["workspace", "CASE", "--gap", "0.5", "--json", "JSON"]]
        )


def workspace_items() -> Iterator[Item]:
    """Yield the other tables of the documentation of workspaces."""
    for degrees in (20, 25, 30, 35, 40):
        text = _hexapod(f"{{ angle = {{ min = -{degrees}, max = {degrees} }} }}")
        yield Item(f"any axis {degrees}", text, [["workspace", "CASE", "--gap", "0.5", "--json", "JSON"]])
    for degrees in (20, 25):
        each = f"{{ min = -{degrees}, max = {degrees} }}"
        text = _hexapod(f"{{ roll = {each}, pitch = {each}, yaw = {each} }}")
        yield Item(f"roll pitch yaw {degrees}", text, [["workspace", "CASE", "--gap", "0.5", "--json", "JSON"]])
    turned = "{ angle = { min = -20, max = 20 } }"
    limits = "[limits]\ncondition_number = { max = 8, length = 10 }\n"
    smallest = "[limits]\nsmallest_singular_value = { min = 0.3, length = 10 }\n"
    proof = ["workspace", "CASE", "--proof", "PROOF", "--json", "JSON", "--time", "600", "--jobs", "1"]
    for name, more in (("condition number", limits), ("smallest singular value", smallest)):
        for tolerance in ("", "[tolerance]\njoint_centre = 0.002\n"):
            text = _hexapod(turned, more + tolerance)
            yield Item(f"{name} {tolerance[-6:-1]}", text, [proof, ["verify-proof", "PROOF", "CASE"]])
    errors = _hexapod(turned, "[tolerance]\njoint_centre = 0.002\n")
    yield Item("pose error", errors, [[*proof, "--leg-error", "0.004"]])
    yield Item("scale", _hexapod(turned), [["workspace", "CASE", "--scale", "--json", "JSON"]])
    for name in ("hexapod-linuxcnc", "reachy-mini-envelope"):
        yield Item(f"workspace {name}", name, [proof, ["verify-proof", "PROOF", "CASE"]])


def path_items() -> Iterator[Item]:
    """Yield tool paths: programs and tables, with arcs, turns, times, motors and loops; proved, refuted and open."""
    limits = "[limits]\nleg_length = { min = 15, max = 40 }\ncondition_number = { max = CONDITION, length = 10 }\n"
    turned = "{ angle = { min = -20, max = 20 } }"
    plain, tight = (_hexapod(turned, limits.replace("CONDITION", each)) for each in ("30", "1.75"))
    motors = "[[load]]\nany = { force = 20 }\npoint = [0, 0, 5]\n[motion]\nlinear = 5\n"
    moved = _hexapod(turned, motors + "[limits]\nactuator_force = { max = 40 }\nactuator_speed = { max = 10 }\n")
    straight = "G20 F60\nG1 X-2 Y-1 Z19\nG1 X2 Y1 Z21\nG1 X0 Y2 Z20\nM2\n"
    arcs = "G20 F60\nG1 X2 Y0 Z20\nG2 X-2 Y0 I-2 J0\nG3 X2 Y0 Z21 I2 J0\nG18 G2 X0 Z19 R3\nM2\n"
    angles = "G20 F60\nG1 X0 Y0 Z20 A0 B0 C0\nG1 X1 Y1 Z20 A8 B-5 C10\nG1 X-1 A-8 C-10\nM2\n"
    rows = ((0, 0, 20, 0, 0, 0), (1, -1, 20.5, 5, -3, 8), (-1, 1, 19.5, -5, 4, -8), (0, 0, 20, 0, 0, 10))
    table = "x,y,z,roll,pitch,yaw\n" + "".join(f"{','.join(map(str, row))}\n" for row in rows)
    timed = "x,y,z,roll,pitch,yaw,t\n" + "".join(f"{','.join(map(str, row))},{2 * k}\n" for k, row in enumerate(rows))
    for name, text, path, more in (
        ("lines", plain, ("p.ngc", straight), ["--csv", "TABLE"]),
        ("arcs", plain, ("p.ngc", arcs), ["--csv", "TABLE", "--within", "0.01"]),
        ("angles", plain, ("p.ngc", angles), ["--csv", "TABLE", "--step", "0.5"]),
        ("rotations", plain, ("p.csv", table), []),
        ("one axis a turn", plain, ("p.csv", table), ["--between", "slerp"]),
        ("times", plain, ("p.csv", timed), ["--csv", "TABLE"]),
        ("refuted", tight, ("p.ngc", arcs), []),
        ("motors", moved, ("p.ngc", arcs), []),
        ("motors and times", moved, ("p.csv", timed), []),
        ("rough gap", moved, ("p.csv", table), ["--gap", "0.2"]),
    ):
        yield Item(f"path {name}", text, [["path", "CASE", "--along", "PATH", "--json", "JSON", *more]], path)
    yield Item("path of a case", "hexapod-pocket", [["path", "CASE", "--json", "JSON"]])
    # Coordinates that a robot of fewer freedoms chooses, and their steps in parts of its size or in degrees.
    for name, steps in (
        ("delta", {"x": 1, "y": -1, "z": 1}), ("6-rus", {"x": 1, "y": -1, "z": 1, "roll": 2}),
        ("3-rps", {"z": 1, "roll": 2, "pitch": -2}), ("five-bar", {"x": 1, "y": -1}),
        ("planar-3-rrr", {"x": 1, "y": -1, "yaw": 3}), ("spherical-3-rrr", {"roll": 2, "pitch": -3, "yaw": 1}),
    ):  # fmt: skip
        model = build_model(name)
        size = 0.01 * max(abs(each) for each in (*model.home, *(item.typical[0] for item in model.parameters)))
        home = dict(zip("xyz", map(float, model.home), strict=True)) | dict.fromkeys(("roll", "pitch", "yaw"), 0.0)
        units = {key: size if key in "xyz" else math.radians(1) for key in home}
        rows = ([at + part * units[key] * steps.get(key, 0) for key, at in home.items()] for part in (0, 1, -0.5))
        lines = [",".join(map(repr, [*row, float(k)])) for k, row in enumerate(rows)]
        path = ("p.csv", "\n".join([",".join([*home, "t"]), *lines]) + "\n")
        text, command = _robot(name, 0.02, 5), ["path", "CASE", "--along", "PATH", "--json", "JSON"]
        yield Item(f"path {name}", text, [command], path)
        if name == "3-rps":  # powers of a robot whose coordinates follow from others are left open
            yield Item(
                f"path {name} motors", f"{text}{motors}[limits]\nactuator_power = {{ max = 900 }}\n", [command], path
            )


def range_items() -> Iterator[Item]:
    """Yield ranges of coordinates from a pose: straight legs with and without limits, cranks, loops, fewer freedoms."""
    limits = "[limits]\nleg_length = { min = 15, max = 30 }\n"
    for name, text in (
        ("hexapod", _hexapod("{ angle = { min = -20, max = 20 } }", limits)),
        ("hexapod-linuxcnc", "hexapod-linuxcnc"),
        *((name, _robot(name, 0.02, 5)) for name in ("6-rus", "delta", "3-rps", "planar-3-rpr")),
    ):
        yield Item(f"range {name}", text, [["path", "CASE", "--range", "--json", "JSON", "--time", "600"]])


def design_items() -> Iterator[Item]:
    """Yield tables of designs: sweeps, a trade-off, fronts and a comparison."""
    few = ["--starts", "4", "--json", "JSON"]
    over = ["--over", "x1=10:14:5"]
    yield Item("sweep", "paper-4.1-helical", [["sweep", "CASE", *over, *few, "--engine", "ipopt", "--out", "TABLE"]])
    proved = ["sweep", "CASE", *over, *few, "--certify", "--engine", "ipopt", "--out", "TABLE"]
    yield Item("sweep with proofs", "paper-4.1-helical", [proved])
    along = ["tradeoff", "CASE", "--over", "limits.leg_length.max=32:40:3", *few, "--csv", "TABLE"]
    yield Item("trade-off", "hexapod-machining", [along])
    front = ["pareto", "CASE", "--goal", "max F", "--goal", "min limits.leg_length.max", "--points", "4", *few]
    yield Item("front", "hexapod-machining", [[*front, "--csv", "TABLE"]])
    robots = ["compare", "CASE", "case", "6-ups", "delta", "3-rps", *few, "--csv", "TABLE"]
    yield Item("comparison", "drilling-spindle", [robots])


def _hexapod(rotation: str, more: str = "") -> str:
    """Return LinuxCNC's hexapod with a workspace."""
    return _HEXAPOD.format(rotation=rotation, more=more)


def _robot(name: str, part: float = 0.0, degrees: float = 0.0) -> str:
    """Return a robot of the gallery at home with its first two lengths free, or fixed over an envelope about home."""
    model = build_model(name)
    size = max(abs(each) for each in (*model.home, *(item.typical[0] for item in model.parameters)))
    freed = [item.name for item in model.parameters if item.dimension is Dimension.LENGTH][: 0 if part else 2]
    lines = ["[units]", 'angle = "rad"', "[robot]", f'model = "{name}"', "[robot.parameters]"]
    for item in model.parameters:
        value = item.typical[0]
        ends = sorted((0.95 * value, 1.05 * value))
        text = f"{{ min = {ends[0]!r}, max = {ends[1]!r} }}" if item.name in freed else repr(value)
        lines.append(f"{item.name} = {text}")
    lines += ["[pose]", f"position = {[float(each) for each in model.home]}", "[[task]]", 'name = "task"']
    lines += ['sense = "max"', "twist = [0.3, -0.5, 0.7, 0.4, 0.6, -0.2]"]
    if part:
        place = [f"{{ min = {each - part * size!r}, max = {each + part * size!r} }}" for each in model.home]
        turn = f"{{ min = {-math.radians(degrees)!r}, max = {math.radians(degrees)!r} }}"
        lines += ["[workspace]", f"position = [{', '.join(place)}]"]
        lines += [f"rotation = {{ roll = {turn}, pitch = {turn}, yaw = {turn} }}"]
    return "\n".join(lines) + "\n"


def run(program: Path, item: Item, folder: Path) -> Run:
    """Run an item's commands with one program."""
    paths = {"JSON": folder / "result.json", "PROOF": folder / "proof.json", "FOLDER": folder / "c", "CASE": item.case}
    # Results have the name of a path's file: in the folder it is the same for both.
    paths |= {"TABLE": folder / "table.csv", "PATH": item.path[0]}
    if item.path[0]:
        (folder / item.path[0]).write_text(item.path[1], encoding="utf-8")
    if "\n" in item.case:
        paths["CASE"] = folder / "case.toml"
        (folder / "case.toml").write_text(item.case, encoding="utf-8")
    found = Run()
    for command in item.commands:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([program, *(str(paths.get(word, word)) for word in command)], cwd=folder,
                              capture_output=True, text=True, check=False)  # fmt: skip
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        found.seconds += after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        found.statuses.append(done.returncode)
        if done.returncode > 1:
            print(f"{item.name}: {program} {command[0]}: {done.stderr.strip()[-200:]}")
    if (folder / "result.json").exists():
        found.data.append(json.loads((folder / "result.json").read_text(encoding="utf-8")))
    if (folder / "table.csv").exists():
        with (folder / "table.csv").open(encoding="utf-8", newline="") as file:
            found.data.append([{key: _number(cell) for key, cell in row.items()} for row in csv.DictReader(file)])
    found.data += [path.read_text(encoding="utf-8") for path in sorted((folder / "c").glob("*.[ch]"))]
    return found


def _number(cell: str) -> float | str:
    """Return the number of a cell, or its text."""
    try:
        return float(cell)
    except ValueError:
        return cell


def differences(old: object, new: object, boxes: float, where: str = "") -> Iterator[str]:
    """Yield where two sets of data differ."""
    last = where.rsplit(".", 1)[-1]
    if last in _MASKED:
        return
    if isinstance(old, dict) and isinstance(new, dict):
        if all(str(each.get("reason", "")).startswith("stopped after") for each in (old, new)):
            # What a time limit ends depends on the machine.
            return
        # Keys of the new data alone are additions.
        for key in old:
            yield from differences(old[key], new.get(key), boxes, f"{where}.{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for k, (a, b) in enumerate(zip(old, new, strict=True)):
            yield from differences(a, b, boxes, f"{where}[{k}]")
    elif isinstance(old, int | float) and isinstance(new, int | float) and not isinstance(old, bool):
        part = boxes if last in _COUNTS else _NEAR
        if not (old == new or abs(new - old) <= part * max(abs(old), abs(new))):
            yield f"{where}: {old!r} -> {new!r}"
    elif old != new:
        yield f"{where}: {str(old)[:60]!r} -> {str(new)[:60]!r}"


def main() -> int:
    """Compare two programs; return 1 where something differs."""
    parser = argparse.ArgumentParser()
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--boxes", type=float, default=0.0)
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args()
    ratios, different = [], 0
    for item in items():
        if given.only not in item.name:
            continue
        with tempfile.TemporaryDirectory() as scratch:
            top = (given.keep or Path(scratch)) / item.name.replace(" ", "-")
            runs = []
            for side, program in (("old", given.old), ("new", given.new)):
                (top / side).mkdir(parents=True, exist_ok=True)
                runs.append(run(program.absolute(), item, top.absolute() / side))
        old, new = runs
        lines = list(differences(old.statuses, new.statuses, 0.0, "status"))
        lines += differences(old.data, new.data, given.boxes)
        ratios.append(new.seconds / old.seconds)
        different += bool(lines)
        print(f"{item.name:36} {old.seconds:8.2f} s {ratios[-1]:6.2f} {'same' if not lines else 'DIFFERS'}", flush=True)
        for line in lines[:12]:
            print(f"    {line}", flush=True)
    if not ratios:
        print(f"no item has the name {given.only!r}")
        return 2
    ratios.sort()
    print(f"{different} of {len(ratios)} differ; CPU time of new over old: median {statistics.median(ratios):.2f}, "
          f"90 % {ratios[int(0.9 * (len(ratios) - 1))]:.2f}, largest {ratios[-1]:.2f}")  # fmt: skip
    return int(different > 0)


if __name__ == "__main__":
    sys.exit(main())
