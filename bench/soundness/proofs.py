"""Proofs of random certificates and workspaces: accepted as they are; altered, rejected or still a true claim.

    python bench/soundness/proofs.py COUNT FIRST [JOURNAL]

An altered proof that is accepted must say what the proof said, but for bounds, which must be beyond the values that the
search reached. Half of the workspaces have loads and motions: then bounds of numbers of actuators are moved to these
values too, a little less or more.
"""

from __future__ import annotations

import base64
import copy
import hashlib
import json
import re
import tempfile
import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from campaign import Row, campaign, command
from certificates import random_certificate
from gallery import NAMES, limited, random_gallery
from loads import random_loading
from randomcases import limited_legs, random_legs, text_of

Place = tuple[str | int, ...]
ALTERED = 4
#: Seconds of a search with and without loads, and parts of values by which altered bounds of actuators are beyond them.
SECONDS, BEYOND = (60, 3), (-1e-2, -1e-4, -1e-6, 1e-4)
BOUND = re.compile(r"at (most|least) (-?[\d.]+(?:e[-+]?\d+)?)")
#: What may differ: counts of boxes, reasons that are not checked.
FREE = re.compile(r"[\d,]+ leaves, shown on .*\n|(?<=not on paper: ).*")


def places(content: Any, place: Place = ()) -> Iterator[Place]:  # noqa: ANN401 - JSON
    """Yield the places of the values of a file."""
    inner = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    for key, value in inner:
        yield (*place, key)
        yield from places(value, (*place, key))


def altered(content: Any, rng: np.random.Generator) -> tuple[str, Any]:  # noqa: ANN401 - JSON
    """Return a copy of a file with another value in a random field, or another byte in a tree whose digest fits."""
    found = copy.deepcopy(content)
    every = list(places(found))
    trees = [each for each in every if each[-1] == "tree"]
    place = trees[rng.integers(len(trees))] if trees and rng.random() < 0.6 else every[rng.integers(len(every))]
    inner = found
    for key in place[:-1]:
        inner = inner[key]
    value = inner[place[-1]]
    if place[-1] == "tree":
        nodes = bytearray(zlib.decompress(base64.b64decode(value)))
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(nodes) + 1))
            kind = rng.integers(3)
            if kind == 0 and at < len(nodes):
                nodes[at] = int(rng.integers(256)) if rng.random() < 0.3 else int(rng.integers(8))
            elif kind == 1:
                del nodes[at : at + int(rng.integers(1, 12))]
            else:
                nodes[at:at] = bytes(rng.integers(8, size=int(rng.integers(1, 12))).tolist())
        inner["tree"] = base64.b64encode(zlib.compress(bytes(nodes))).decode()
        if "digest" in inner:
            inner["digest"] = hashlib.sha256(bytes(nodes)).hexdigest()
        return f"{place}: nodes", found
    if isinstance(value, bool) or value is None:
        new: Any = not value
    elif isinstance(value, int | float):
        size = abs(value) or 1.0
        new = [value * (1 + 1e-9), value - 1e-3 * size, value + 1e-3 * size, -value, 0, 0.5 * value, 2 * value][
            rng.integers(7)
        ]
    elif isinstance(value, str):
        new = [value[:-1], value + "x", "", value[::-1]][rng.integers(4)]
    elif isinstance(value, list):
        new = [[], value[1:], value[::-1], [*value, *value[:1]]][rng.integers(4)]
    else:
        names = list(value)
        new = {key: value[key] for key in names if key != names[rng.integers(len(names))]} if names else {"x": 1}
    inner[place[-1]] = new
    return f"{place}: {str(value)[:30]!r} -> {str(new)[:30]!r}", found


def moved(content: Any, lines: str, reached: dict[tuple[str, str], float], rng: np.random.Generator) -> tuple[str, Any]:  # noqa: ANN401 - JSON
    """Return a copy of a file with a bound of an actuator near the value reached; as it is where there is none."""
    found, sides = copy.deepcopy(content), {"max": "most", "min": "least"}
    stated = {
        (name.strip(), side): float(value)
        for name, side, value in re.findall(r"(actuator_(?:force|speed|power) .*): at (most|least) (\S+)", lines)
    }
    claims = [(each, (each["name"], sides.get(each["sense"], ""))) for each in found["claims"]]
    claims = [(each, key) for each, key in claims if stated.get(key) and reached.get(key)]
    if not claims:
        return "no actuators", found
    claim, key = claims[rng.integers(len(claims))]
    part, sign = BEYOND[rng.integers(len(BEYOND))], 1.0 if key[1] == "most" else -1.0
    # Bounds of the file are in radians.
    claim["bound"] *= (reached[key] + sign * part * abs(reached[key])) / stated[key]
    return f"{key}: beyond the value by {part:g} of it", found


def untrue(before: str, after: str, reached: dict[tuple[str, str], float]) -> str:
    """Return what an accepted altered proof says that is not known to be true; empty if nothing."""
    lines = [FREE.sub("", each).splitlines() for each in (before, after)]
    old = {BOUND.sub(r"at \1 BOUND", each): each for each in lines[0]}
    for line in lines[1]:
        if (same := old.get(BOUND.sub(r"at \1 BOUND", line))) is None:
            if not re.match(r"\s*(not on paper|why claims)", line) and line.strip():
                return line
            continue
        for (side, first), (_, second) in zip(BOUND.findall(same), BOUND.findall(line), strict=True):
            # Names of joints have colons of their own.
            name = line.strip().rpartition(": at ")[0] or line.strip().partition(":")[0]
            value = reached.get((name, side), float(first))
            sign = 1.0 if side == "most" else -1.0
            if first != second and sign * (float(second) - value) < -1e-9 * abs(value):
                return line
    return ""


def reached_values(result: Any) -> dict[tuple[str, str], float]:  # noqa: ANN401 - JSON
    """Return values that the search reached, by the beginning of the line about them and the side of the bound."""
    side = {"max": "most", "min": "least"}
    if "extremes" in result:
        return {
            (each["name"], side[each["sense"]]): each["reached"]
            for each in result["extremes"]
            if each["reached"] is not None
        }
    value = (result.get("certificate") or {}).get("incumbent")
    return {} if value is None else {("holds", each): value for each in side.values()}


def examine(seed: int) -> Row:
    """Write a proof of a random case, check it, and check it altered."""
    rng, counts, faults = np.random.default_rng(seed), Counter[str](), []
    kind = ("workspace", "certify", "gallery")[seed % 3]
    if kind == "gallery":
        tables = limited(rng, random_gallery(rng, NAMES[(seed // 3) % len(NAMES)]))
    else:
        tables = random_certificate(rng) if kind == "certify" else limited_legs(rng, random_legs(rng))
    name, is_loaded = tables["robot"]["model"], kind != "certify" and rng.random() < 0.5
    if is_loaded:
        unit = 1.0 if tables.get("units", {}).get("angle") == "rad" else np.pi / 180
        size = float(np.linalg.norm(tables["pose"]["position"])) or 1.0
        tables |= random_loading(rng, size, unit)
        kind += " with loads"
    with tempfile.TemporaryDirectory() as folder:
        case, proof, out, other = (
            str(Path(folder) / each) for each in ("case.toml", "proof.json", "result.json", "other.json")
        )
        Path(case).write_text(text_of(tables), encoding="utf-8")
        words = ["--time", str(SECONDS[not is_loaded]), "--jobs", "1", "--json", out, "--proof", proof]
        if kind == "certify":
            code, _, err = command("certify", case, "--gap", "1e-2", "--starts", "2", *words)
        else:
            code, _, err = command("workspace", case, "--gap", "0.3", *words)
        if not Path(proof).exists():
            return {
                "counts": {f"{kind}: no proof, exit status {code}": 1},
                "faults": [err] if "Traceback" in err else [],
            }
        code, before, err = command("verify-proof", proof, case)
        counts[f"{kind}: {name}: {'accepted' if code == 0 else 'rejected'}"] += 1
        if code:
            return {"counts": counts, "faults": [f"a proof is rejected: {err.strip()}"]}
        content = json.loads(Path(proof).read_text(encoding="utf-8"))
        reached = reached_values(json.loads(Path(out).read_text(encoding="utf-8")))
        for k in range((1 + is_loaded) * ALTERED):
            what, changed = altered(content, rng) if k < ALTERED else moved(content, before, reached, rng)
            if k >= ALTERED:
                counts[f"{kind}: {what.rpartition(': ')[2]}"] += 1
            Path(other).write_text(json.dumps(changed), encoding="utf-8")
            code, after, err = command("verify-proof", other, case)
            counts[f"{kind}: altered, exit status {code}"] += 1
            if code == 0 and (line := untrue(before, after, reached)):
                faults.append(f"{what}: accepted: {line}")
            if code and (code > 2 or after or len(err.splitlines()) != 1 or "Traceback" in err):
                faults.append(f"{what}: exit status {code}: {err[-300:]}")
    return {"counts": counts, "faults": faults}


if __name__ == "__main__":
    campaign(examine)
