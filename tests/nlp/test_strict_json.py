"""Readers of JSON that anybody may have written: each refuses in one sentence, whatever the bytes are."""

import copy
import json
import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pytest
from builders import Run, case_from

from screwsynth.nlp import InputError, certify, load_result
from screwsynth.nlp.embedding.manifest import read_manifest
from screwsynth.nlp.proof.checker.proof_file import Premises, Proof, ProofClaim, Unproved, read_proof
from screwsynth.nlp.solver.certified import proof_of
from screwsynth.nlp.sweeps.journal import Row, line_of, row_of
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
        ('{"a": 1, "a": 2}', "stands twice"),
        ("1e999", "no finite number"),
        ("[-1e999]", "no finite number"),
        ("NaN", "no finite number"),
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


PLATFORM = {
    "robot": {
        "model": "stewart-gough",
        "layout": "aligned",
        "parameters": {"x1": 12, "x2": 8, "x3": 30, "x4": 8},
    },
    "pose": {"position": [0, 0, {"min": 30, "max": 31}]},
    "task": [{"sense": "max", "axis": [0, 0, 1], "pitch": float("inf")}],
    "solve": {"starts": 1},
}
MANIFEST = {
    "schema": 1,
    "name": "n",
    "prefix": "n",
    "variables": [{"name": "p_z", "unit": "m", "lower": 0.0, "upper": 1.0, "start": 0.5}],
    "parameters": [{"name": "x1", "unit": "m", "default": 1.0}],
    "limits": [{"key": "leg_length.max", "unit": "m", "default": 3.0, "above": None, "most": 4.0}],
    "constraints": [{"name": "leg_length", "lower": None, "upper": 1.0}],
    "statuses": [{"code": 0, "name": "OK", "meaning": "done"}],
    "seeds": 4,
    "sources": ["n.c"],
    "headers": [],
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("json")


@pytest.fixture
def readers(folder: Path, cli: Run) -> dict[str, tuple[bytes, Callable[[bytes], object]]]:
    """A content that each reader takes, and the reader."""
    result, file = folder / "result.json", folder / "altered.json"
    if not result.exists():
        assert cli("evaluate", "paper-4.1-helical", "--set", "p_z=30", "--json", str(result))[0] in (0, 1)
        (folder / "n.c").write_text("int x;", encoding="utf-8")
    case = case_from(PLATFORM, "case")
    proof = proof_of(certify(case, gap=1e-2, with_proof=True), "text").as_text().encode()
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
        "row": (line_of(Row(0, "optimal", 1.5, (1.0,), ("p_z max",), (0.1,), "strict", 1e-9)).encode(), row_of),
        "manifest": (json.dumps(MANIFEST).encode(), read_folder),
    }


def refusal(read: Callable[[bytes], object], content: bytes) -> Exception | None:
    """The error with which a content is refused; None for one that is read."""
    try:
        read(content)
    except (InputError, ValueError) as error:
        return error
    return None


def test_any_bytes_are_read_or_refused_in_a_sentence(
    readers: dict[str, tuple[bytes, Callable[[bytes], object]]],
) -> None:
    for name, (content, read) in readers.items():
        assert refusal(read, content) is None
        rng = random.Random(name)  # noqa: S311 - a seeded choice of alterations
        altered = [(bytes_of if k % 2 else values_of)(content, rng) for k in range(120)]
        errors = [error for each in altered if (error := refusal(read, each)) is not None]
        assert len(errors) > 40
        # A row that is none is solved again, and bytes that are no text are refused before.
        allowed = (ValueError,) if name == "row" else (InputError, UnicodeDecodeError)
        assert all(isinstance(error, allowed) for error in errors)
        assert all(len(str(error).encode().splitlines()) == 1 for error in errors)
