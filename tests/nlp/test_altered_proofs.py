"""Proofs with one field of their files altered, by a little and by much: rejected, or a claim that is true and whole.

Every field of each kind of proof is altered in turn. A proof that is accepted all the same must print what it printed
before, but for bounds, which must still be on the true side of a value that the robot reaches.
"""

import base64
import contextlib
import copy
import json
import re
import tomllib
import zlib
from collections.abc import Iterator
from functools import reduce
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from builders import Run, case_file, case_from, edited, ends, output_of, refusal_of, saved, soaked
from hexapods import hexapod_text
from workspace_cases import TRIPOD

from screwsynth.nlp import InputError
from screwsynth.nlp.program.formulation import formulate_each
from screwsynth.nlp.proof.checker.packed import digest_of, packed_text
from screwsynth.nlp.proof.checker.premises import fingerprint, program_of
from screwsynth.nlp.proof.checker.proof_file import Premises, Proof, ProofClaim, Statement

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
HEXAPOD = edited(hexapod_text(1, 5), ("[[task]]", '[[task]]\nname = "push"'))
LIMITS = "[limits]\nleg_length = { min = 17, max = 44 }\nactuator = { stroke_max = 30 }\n"
SPECTRAL = """smallest_singular_value = { min = 0.25, length = 11.5 }
condition_number = { max = 8, length = 11.5 }
leg_clearance = { min = 0.5 }
"""
BOX = """[workspace]
position = [{ min = -0.5, max = 0.5 }, 0.5, 20]
rotation = { axis = [0, 0, 1], angle = { min = -1, max = 1 } }
"""
ROUND = """[workspace]
position = { ring = { radius = 1, inner_radius = 0.4, angle = { min = -40, max = 200 }, z = [20, 20.5] } }
"""
MACHINE = HEXAPOD + LIMITS + BOX
SINGULAR = """[workspace]
position = [{ min = -5, max = 5 }, { min = -5, max = 5 }, { min = 15, max = 25 }]
rotation = { angle = { min = -40, max = 40 } }
"""
ALONG = """[path]
file = "poses.csv"
place = { yaw = 10 }
between = "slerp"
[[load]]
name = "push"
force = [1, 2, -10]
"""
POSES = "x,y,z,roll,pitch,yaw,t\n0,0,20,0,0,0,0\n1,0.5,20.5,2,0,3,2\n0.5,1,21,2,4,3,3\n"
CRANKS = """
[robot]
model = "6-rus"
parameters = { rb = 1, rp = 0.6, base_half = 20, platform_half = 43, crank = 0.35, lift = 35, h = 1.2 }
[pose]
position = [0, 0, 1.2]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[workspace]
position = [0, 0, { min = 1.2, max = 1.201 }]
rotation = { axis = [0, 0, 1], angle = 0 }
"""


class Kind(NamedTuple):
    """A kind of proof: its case, the words of the command that writes it, and those that check it."""

    case: str
    writes: tuple[str, ...]
    checks: tuple[str, ...] = ()


def combined(sense: str, method: str) -> str:
    motion = "axis = [0, 1, 1]\npoint = [1, 0, 3]\npitch = 2\nweight = 3"
    return f'[[task]]\nname = "other"\nsense = "{sense}"\n{motion}\n[combine]\nmethod = "{method}"\n'


ERROR = ("--leg-error", "0.01")
KINDS = {
    "task": Kind(PLATFORM, ("certify", "--gap", "1e-2")),
    "above": Kind(PLATFORM, ("certify", "--above", "1"), ("--above", "1")),
    "weighted sum": Kind(PLATFORM + combined("max", "weighted-sum"), ("certify",)),
    "worst case": Kind(PLATFORM + combined("max", "worst-case"), ("certify",)),
    "worst loss": Kind(PLATFORM + combined("min", "worst-case"), ("certify",)),
    "no point": Kind(PLATFORM + "[limits]\nleg_length = { max = 3 }\n", ("certify",)),
    "home's mode": Kind(DELTA, ("certify",)),
    "workspace": Kind(HEXAPOD + LIMITS + SPECTRAL + BOX, ("workspace", "--gap", "0.1", *ERROR), ERROR),
    "round workspace": Kind(HEXAPOD + LIMITS + ROUND, ("workspace", "--gap", "0.1", *ERROR), ERROR),
    "loops": Kind(TRIPOD, ("workspace", "--gap", "0.5", "--time", "0.2")),
    "cranks": Kind(CRANKS, ("workspace", "--gap", "0.5")),
    "singular": Kind(HEXAPOD + SINGULAR, ("workspace", "--gap", "0.9", "--time", "0.2")),
    "path": Kind(HEXAPOD + LIMITS + SPECTRAL + ALONG, ("path", "--gap", "0.1")),
    "machines": Kind(f"{MACHINE}[tolerance]\njoint_centre = 0.01\n", ("workspace", "--gap", "0.1", *ERROR), ERROR),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("proofs")


def written(cli: Run, folder: Path, name: str) -> dict[str, Any]:
    """The content of a proof's file, which is written when it is asked for first."""
    case, target = folder / f"{name}.toml", folder / f"{name}.json"
    if not target.exists():
        saved(case, KINDS[name].case)
        saved(folder / "poses.csv", POSES)
        command, *options = KINDS[name].writes
        cli(command, str(case), *options, "--proof", str(target), "--json", str(folder / f"{name}.result"))
        assert target.exists()
    content: dict[str, Any] = json.loads(target.read_text(encoding="utf-8"))
    return content


@pytest.fixture(autouse=True)
def _lines_are_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Outputs are compared line by line, and so a line is not broken."""
    monkeypatch.setattr("screwsynth.nlp.output.terminal.PLAIN_WIDTH", 10_000)


def checked(cli: Run, folder: Path, name: str, content: object) -> tuple[int, str, str]:
    file = saved(folder / "altered.json", json.dumps(content))
    return cli("verify-proof", str(file), str(folder / f"{name}.toml"), *KINDS[name].checks, "--all")


def places(content: object, place: Place = ()) -> Iterator[Place]:
    """The places of all values in a file; of a list those of the last entry alone."""
    yield place
    if isinstance(content, dict):
        for key, value in content.items():
            yield from places(value, (*place, key))
    elif isinstance(content, list):
        for value in content[-1:]:
            yield from places(value, (*place, len(content) - 1))


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


def at_place(content: Any, place: Place) -> Any:  # noqa: ANN401 - any JSON
    return reduce(lambda inner, key: inner[key], place, content)


def with_value(content: object, place: Place, value: object) -> Any:  # noqa: ANN401 - any JSON
    if not place:
        return value
    found = copy.deepcopy(content)
    at_place(found, place[:-1])[place[-1]] = value
    return found


def trees(content: dict[str, Any], rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    """Copies of a file with other nodes in its trees, with digests to match."""
    for place in [each for each in places(content) if each[-1:] == ("tree",)]:
        nodes = zlib.decompress(base64.b64decode(at_place(content, place)))
        several = [nodes[:-1], nodes + b"\x06", b"", b"\x06", b"\x02", b"\x03", b"\x07\x00"]
        for _ in range(3 if nodes else 0):
            one = bytearray(nodes)
            one[rng.integers(len(one))] = rng.integers(256)
            several.append(bytes(one))
        for each in several:
            found = with_value(content, place, packed_text(each))
            yield with_value(found, (*place[:-1], "digest"), digest_of(each))


def alterations(content: dict[str, Any], rng: np.random.Generator, per_field: int | None) -> Iterator[tuple[str, Any]]:
    """Names of altered fields, with the altered contents of the file: all, or a few of each field."""

    def some(values: list[Any], count: int) -> list[Any]:
        few = rng.choice(len(values), min(count, len(values)), replace=False)
        return values if per_field is None else [values[k] for k in few]

    for place in places(content):
        value = at_place(content, place)
        name = ".".join(map(str, place))
        for other in some(others_of(value, rng), per_field or 0):
            yield f"{name}: {str(value)[:40]!r} -> {str(other)[:40]!r}", with_value(content, place, other)
        if per_field is None and place and isinstance(place[-1], str):
            found = copy.deepcopy(content)
            del at_place(found, place[:-1])[place[-1]]
            yield f"{name}: taken out", found
    for each in some(list(trees(content, rng)), 4):
        yield "another tree", each


BOUND = re.compile(r"at (most|least) ([^\s,]+)")
BOXES = re.compile(r"[\d,]+ leaves of the proof trees?, checked on .*\n")
REASONS = re.compile(r"(?<=^no proof: ).*?: .*|(?<= claims); .*", re.MULTILINE)
LOSSES = re.compile(r"F being the largest of (\S+) \((\S+) - F\('one'\)\) and (\S+) \(F\('other'\) - (\S+)\)")


def least_loss(weight: float, best: float, other_weight: float, other_best: float) -> float:
    """The worst of two losses, the least of it on a grid of the box; F is summed over the rows of J."""
    case = case_from(KINDS["worst loss"].case, "grid")
    nlps = formulate_each(case)
    points = np.stack(np.meshgrid(*np.linspace(nlps[0].lower, nlps[0].upper, 21).T), axis=-1).reshape(-1, nlps[0].n)
    first, second = (np.array([nlp.evaluate(x).F for x in points]) for nlp in nlps)
    return float(np.maximum(weight * (best - first), other_weight * (second - other_best)).min())


def is_true(before: str, after: str, reached: dict[tuple[str, str], float]) -> bool:
    """Whether an output says what another one said, but for bounds that are still beyond values that are reached."""
    before, after = (REASONS.sub("", BOXES.sub("", each)) for each in (before, after))
    if before.startswith("PROOF VALID: there is no feasible point"):
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
    side = {"max": "most", "min": "least"}
    if result.get("path"):
        found = (each for each in result["path"]["claims"] if "sense" in each)
        return {(each["name"], side[each["sense"]]): each.get("reached", np.nan) for each in found}
    if "extremes" in result:
        return {(each["name"], side[each["sense"]]): each["reached"] for each in result["extremes"]}
    value = (result["certificate"] or {}).get("incumbent")
    return {} if value is None else {("holds", side): value for side in ("most", "least")}


def faults_of(cli: Run, folder: Path, name: str, per_field: int | None) -> tuple[list[str], int, int]:
    """Altered fields that are accepted with a false claim, or refused in a wrong way; numbers of tries and accepted."""
    content, rng = written(cli, folder, name), np.random.default_rng(0)
    code, before, err = checked(cli, folder, name, content)
    assert (code, err) == (0, ""), err
    reached = reached_values(folder, name)
    faults, tries, accepted = [], 0, 0
    for what, altered in alterations(content, rng, per_field):
        tries += 1
        code, out, err = checked(cli, folder, name, altered)
        accepted += code == 0
        if code == 0 and not is_true(before, out, reached):
            faults.append(f"{what}: {out}")
        if code and (code not in (1, 2) or out or len(err.splitlines()) != 1 or "Traceback" in err):
            faults.append(f"{what}: exit {code}: {err}")
    return faults, tries, accepted


SLOW = ("machines", "path", "loops", "cranks", "singular", "weighted sum", "worst case")
#: Certificates of the platform with points that keep the limits.
PLATFORMS = ("task", "above", "weighted sum", "worst case", "worst loss")


@pytest.mark.parametrize("name", soaked(KINDS, [each for each in KINDS if each not in SLOW]))
def test_an_altered_field_is_rejected_or_changes_nothing_but_a_true_bound(cli: Run, folder: Path, name: str) -> None:
    faults, tries, _ = faults_of(cli, folder, name, 1)
    assert not faults
    assert tries > (15 if KINDS[name].writes[0] == "certify" else 25)


def test_errors_of_legs_are_those_of_the_command(cli: Run, folder: Path) -> None:
    content = written(cli, folder, "machines")
    for other in (-0.019999999999, 0.0, 0.0099999999, 0.02):
        code, out, err = checked(cli, folder, "machines", with_value(content, ("premises", "leg_error"), other))
        assert (code, out) == (1, "")
        assert "but --leg-error is 0.01" in err
    case, proof = str(folder / "machines.toml"), str(folder / "machines.json")
    code, out, err = cli("verify-proof", proof, case)
    assert (code, out) == (1, "")
    assert "leg-length errors of at most 0.01 in, but --leg-error is 0" in err
    assert cli("verify-proof", proof, case, "--leg-error", "-0.019999999999")[0] == 2
    out = output_of(cli("verify-proof", proof, case, "--leg-error", "0.01", "--all"))
    assert "for every robot whose joint centres are off by at most 0.01 in" in out
    errors = re.findall(r"(position|rotation) error: at most (\S+) (?:in|deg), for leg lengths that are (.*)", out)
    assert [(each[0], each[2]) for each in errors] == [
        ("position", "off by at most 0.01 in"),
        ("rotation", "off by at most 0.01 in"),
    ]
    reached = reached_values(folder, "machines")
    assert all(float(bound) >= reached[f"{name} error", "most"] for name, bound, _ in errors)


@pytest.mark.parametrize("proof", ["task", "weighted sum", "worst case", "worst loss"])
def test_a_proof_is_no_proof_of_another_case(cli: Run, folder: Path, proof: str) -> None:
    """The objective of the claim is the case's, whatever the file's, and its bound holds."""
    content = written(cli, folder, proof)
    for case in PLATFORMS:
        if case == proof:
            continue
        own = checked(cli, folder, case, written(cli, folder, case))[1]
        other = case_from(KINDS[case].case, "other")
        statement = Statement(**{**content["premises"], "best": tuple(content["premises"]["best"])})
        own_graph = content["claims"][0]["graph"]
        graphs = [own_graph]
        with contextlib.suppress(InputError):
            graphs.append(fingerprint(program_of(other, statement)))
        for graph in graphs:
            code, out, err = checked(cli, folder, case, with_value(content, ("claims", 0, "graph"), graph))
            assert (code == 0) == (err == "")
            assert code or (graph != own_graph and is_true(own, out, reached_values(folder, case)))


def test_nothing_rests_on_the_fingerprint(cli: Run, folder: Path) -> None:
    content, other = written(cli, folder, "task"), edited(PLATFORM, ("x1 = 12", "x1 = 13"))
    case, proof = str(saved(folder / "other.toml", other)), folder / "other.json"
    assert "its expressions or bounds differ" in cli("verify-proof", str(saved(proof, json.dumps(content))), case)[2]
    nlp = program_of(case_from(other, "other"), Statement())
    best = max(nlp.evaluate(x).F for x in np.random.default_rng(0).uniform(nlp.lower, nlp.upper, (50, nlp.n)))
    for bound, status in ((content["claims"][0]["bound"], 1), (0.99 * best, 1), (2 * best, 0)):
        claim = {**content["claims"][0], "graph": fingerprint(nlp), "bound": bound}
        assert bound < best or status == 0
        assert cli("verify-proof", str(saved(proof, json.dumps({**content, "claims": [claim]}))), case)[0] == status


MALFORMED = [
    "[" * 200_000,
    '{"format": ' * 100_000,
    "{" + '"a": {' * 70 + "}" * 71,
    '{"format": "screwsynth-proof", "format": "screwsynth-proof"}',
    "9" * 401,
    '"\\ud800"',
    "\ufeff{}",
    "NaN",
]
EDITS = [
    *(("bound", text) for text in ("1e999", "-1e999", "1" * 401, "NaN", '"1"', "true")),
    *(("premises", text) for text in ('{"kind": 3}', '{"best": ["a", "b"]}', "[]")),
    *(("schema", text) for text in ("2", "1" * 5000)),
    ("name", '"\\ud800"'),
    *(("tree", text) for text in ('"eA=="', '"\u00e9"')),
]


@pytest.mark.parametrize("text", [*MALFORMED, *EDITS], ids=range(len(MALFORMED) + len(EDITS)))
def test_a_malformed_proof_is_refused_in_a_sentence(
    cli: Run, folder: Path, tmp_path: Path, text: str | tuple[str, str]
) -> None:
    if isinstance(text, tuple):
        content = written(cli, folder, "task")
        (claim,) = content["claims"]
        content["claims"] = ["CLAIM"]
        whole, one = (
            {key: json.dumps(value) for key, value in table.items()} | {k: v for k, v in [text] if k in table}
            for table in (content, claim)
        )
        words = ["{" + ", ".join(f'"{key}": {value}' for key, value in each.items()) + "}" for each in (whole, one)]
        text = words[0].replace('"CLAIM"', words[1])
    file = str(saved(tmp_path / "proof.json", text))
    refusal_of(cli("verify-proof", file), file)


def test_proofs_of_machines_with_settings_or_of_a_result(cli: Run, tmp_path: Path) -> None:
    fixed, proof, result = str(saved(tmp_path / "fixed.toml", MACHINE)), *(str(tmp_path / each) for each in ("p", "r"))
    free = str(saved(tmp_path / "free.toml", edited(MACHINE, ("x2 = 11.543", "x2 = { min = 8, max = 15 }"))))
    assert cli("evaluate", fixed, "--json", result)[0] in (0, 1)
    code, _, err = cli("workspace", free, "--gap", "0.1", "--of", result, "--proof", proof)
    assert (code, err) == (0, f"--of {result}: gives the dimensions of the case 'fixed'\n")
    for command in (("verify-proof", proof, free), ("workspace", free)):
        assert "robot.parameters.x2: is free" in cli(*command)[2]
    for options in (("--of", result), ("--set", "x2=11.543")):
        code, out, err = cli("verify-proof", proof, free, *options)
        assert code == 0, err
        assert "F: of the task 'push'" in out
        refusal_of(cli("verify-proof", proof, *options), "needs the argument CASE")
    code, _, err = cli("verify-proof", proof, free, "--set", "x2=11.6")
    assert (code, err) == (1, "rejected: the proof is for other joint centres than those of this case\n")
    for option in (("--above", "1"), ("--all-assemblies",)):
        refusal_of(cli("verify-proof", proof, *option), "does not apply to this kind of proof")


def test_a_result_in_other_units_or_of_another_robot_is_refused(cli: Run, tmp_path: Path) -> None:
    result = str(tmp_path / "result.json")
    cli("evaluate", str(saved(tmp_path / "inches.toml", MACHINE)), "--json", result)
    units = "has the units 'in' and 'deg', but the case has "
    radians = edited(MACHINE, ('"in"', '"in"\nangle = "rad"'), ("x3 = 1, x4 = 5", "x3 = 0.1, x4 = 0.1"))
    for text, words in (
        (edited(MACHINE, ('"in"', '"mm"')), f"{units}'mm' and 'deg'"),
        (radians, f"{units}'in' and 'rad'"),
        (TRIPOD, "with the robot 'stewart-gough', not of 'other' with '3-rps'"),
    ):
        refusal_of(cli("workspace", str(saved(tmp_path / "other.toml", text)), "--of", result), words)


def test_errors_of_legs_are_refused_for_a_robot_without_six_legs(cli: Run, folder: Path) -> None:
    case, claim = str(saved(folder / "legless.toml", CRANKS)), ProofClaim("regular", "", "regular", tree=b"\x02")
    proof = Proof("", "legless", Premises((), (), (), 0.01), (claim,)).as_text()
    for command in (("workspace", case), ("verify-proof", str(saved(folder / "legless.json", proof)), case)):
        refusal_of(
            cli(*command, *ERROR), "--leg-error 0.01: needs a robot with six straight legs, which '6-rus' is not"
        )


def test_the_smallest_f_at_the_worst_of_several_poses_is_refused(cli: Run, tmp_path: Path) -> None:
    """The least of several values is no smooth minimum; without its refusal the search began at a wrong level."""
    poses = [{"position": [0, 0, ends(0.5, z)]} for z in (30.5, 40.5)]
    tables = tomllib.loads(PLATFORM) | {"pose": poses, "combine": {"over_poses": "worst"}}
    case, proof = str(case_file(tmp_path, tables)), str(tmp_path / "proof.json")
    refusal_of(
        cli("certify", case, "--above", "1"), "--above: cannot be used if the smallest F of several poses is maximised"
    )
    assert cli("certify", case, "--proof", proof)[0] == 0
    assert "F being that of task 'one', at the worst of 2 poses" in cli("verify-proof", proof)[1]
    refusal_of(cli("verify-proof", proof, "--above", "1"))
