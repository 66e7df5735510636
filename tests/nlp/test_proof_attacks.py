"""Proof files that are made to exhaust the memory or the time of who checks them: each is refused in a sentence."""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from builders import Run, case_from, refusal_of, saved
from hexapods import hexapod_text
from workspace_cases import TRIPOD
from workspace_cases import written as paper_proof

from screwsynth.nlp import Case, certify
from screwsynth.nlp.case.reader import read_case
from screwsynth.nlp.proof.checker import packed, proof_file, tree
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.packed import PackedTree, digest_of, packed_text
from screwsynth.nlp.proof.checker.premises import program_of
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofError, Statement, read_proof
from screwsynth.nlp.proof.checker.tree import Node
from screwsynth.nlp.proof.checker.workspace import loop_claims
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.solver.certified import proof_of

#: Largest memory beyond that of the check of an honest proof, MB: the budget of trees, the file, and blocks of boxes.
ROOM = 450
UNPROVED = {"name": "n", "sense": "", "reason": "open"}
ROTATION = "paper-4.1-rotation-axis-z"
MACHINE = (
    hexapod_text(1, 5, "")
    + """[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
leg_length = { min = 17, max = 44 }
[workspace]
position = [{ min = -4, max = 4 }, 0.5, { min = 18, max = 22 }]
rotation = { axis = [0, 0, 1], angle = { min = -9, max = 9 } }
"""
)
#: Checks a proof, and prints the largest memory that this took, MB.
MEASURE = """import resource, subprocess, sys
ended = subprocess.run(sys.argv[1:], capture_output=True, text=True)
sys.stdout.write(ended.stdout)
sys.stderr.write(ended.stderr)
print(ended.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024)
"""


@pytest.fixture(scope="module")
def optimum() -> tuple[Case, Proof]:
    file = read_case(ROTATION)
    return file.case, proof_of(certify(file.case, gap=1e-4, with_proof=True), file.text)


@pytest.fixture(scope="module")
def workspace() -> tuple[Case, Proof]:
    case = case_from(MACHINE, "machine")
    return case, paper_proof(case, MACHINE, gap=0.1)[1]


def checked(file: Path, content: dict[str, Any]) -> tuple[int, int, str]:
    """Status, largest memory in MB, and the words on standard error of a check in a process of its own."""
    python, given = [sys.executable, "-P"], str(saved(file, json.dumps(content)))
    words = [*python, "-c", MEASURE, *python, "-m", "screwsynth.nlp", "verify-proof", given]
    ended = subprocess.run(words, capture_output=True, text=True, check=True)
    status, memory = map(int, ended.stdout.splitlines()[-1].split())
    return status, memory, ended.stderr


def nodes_of_depth(depth: int) -> bytes:
    """A tree whose leaves are all as deep, cut along its first two variables in turn."""
    nodes = bytes([Node.BOUNDED])
    for k in range(depth):
        nodes = bytes([Node.HALF, k % 2]) + 2 * nodes
    return nodes


def with_trees(proof: Proof, nodes: bytes, **others: object) -> dict[str, Any]:
    """The content of a proof's file with one tree in the place of each."""
    content: dict[str, Any] = json.loads(proof.as_text())
    table = {"tree": packed_text(nodes), "digest": digest_of(nodes), **others}
    for each in content["claims"]:
        each.update({key: value for key, value in table.items() if each["tree"]})
    return content


def test_memory_is_bounded(tmp_path: Path, optimum: tuple[Case, Proof], workspace: tuple[Case, Proof]) -> None:
    """Twelve claims whose trees unpack to 128 MB each; a tree that is nothing but deep; one with a million leaves."""
    status, honest, err = checked(tmp_path / "honest.json", json.loads(workspace[1].as_text()))
    assert (status, err) == (0, "")
    assert sum(bool(each.tree) for each in workspace[1].claims) >= 12
    attacks: list[tuple[dict[str, Any], int, str]] = [
        (with_trees(workspace[1], bytes(2**27 + 1)), 2, "unpack to more than 128 MB"),
        (with_trees(optimum[1], bytes([Node.HALF, 0]) * 2**23), 1, "deeper than 10000 bisections"),
        (with_trees(optimum[1], nodes_of_depth(21), bound=0.0), 1, "could not be shown"),
    ]
    for content, expected, fault in attacks:
        status, memory, err = checked(tmp_path / "attack.json", content)
        assert (status, fault in err) == (expected, True), err
        assert len(err.splitlines()) == 1
        assert memory < honest + ROOM, fault


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('{"claims": [' + "[]," * 2**20 + "[]]}", "commas and brackets"),
        (" " * (2**26 + 1), "larger than 64 MB"),
        *((text, "proof.json") for text in ("", "{}", "[]", '{"format": 1}', "\x00")),
    ],
    ids=range(7),
)
def test_a_file_that_is_no_proof_or_has_no_end_is_refused(cli: Run, tmp_path: Path, text: str, fault: str) -> None:
    file = str(saved(tmp_path / "proof.json", text))
    refusal_of(cli("verify-proof", file), file, fault)


def test_all_trees_of_a_file_have_one_budget(workspace: tuple[Case, Proof], monkeypatch: pytest.MonkeyPatch) -> None:
    case, proof = workspace
    text, size = proof.as_text(), sum(len(each.tree) for each in proof.claims)
    monkeypatch.setattr(packed, "LARGEST_TREES", size)
    given = read_proof(text, "proof.json")
    # A tree counts once, however often its claim is checked.
    assert check_workspace_proof(given, case) == check_workspace_proof(given, case)
    monkeypatch.setattr(packed, "LARGEST_TREES", size - 1)
    with pytest.raises(packed.DamagedProofError, match=r"proof\.json: the trees up to that of '.*' unpack to more"):
        check_workspace_proof(read_proof(text, "proof.json"), case)


def test_no_proof_is_written_that_is_too_large_to_be_read(
    optimum: tuple[Case, Proof], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proof_file, "LARGEST_TREES", len(optimum[1].claims[0].tree) - 1)
    with pytest.raises(ProofError, match="the trees of the proof have"):
        optimum[1].as_text()


def test_a_tree_that_is_read_in_blocks_shows_the_same(
    optimum: tuple[Case, Proof], workspace: tuple[Case, Proof], monkeypatch: pytest.MonkeyPatch
) -> None:
    (claim,), nlp = optimum[1].claims, program_of(optimum[0], Statement())
    whole, poses = check_proof(claim, nlp), check_workspace_proof(workspace[1], workspace[0])
    assert whole.leaves > 100
    assert poses.leaves > 20
    for name, value in (("_BLOCK", 1), ("_FEWEST", 3), ("_AHEAD", 0)):
        monkeypatch.setattr(tree, name, value)
    assert check_proof(claim, nlp) == whole
    assert check_workspace_proof(workspace[1], workspace[0]) == poses
    for short in (claim.tree[:-1], claim.tree + bytes([Node.BOUNDED])):
        with pytest.raises(ProofError, match=r"the tree (ends|goes on)"):
            check_proof(replace(claim, tree=short), nlp)


def test_boxes_with_closed_loops_are_not_kept_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    case = case_from(TRIPOD, "3-rps")
    proof = paper_proof(case, with_limits=False)[1]
    check_workspace_proof(proof, case)
    monkeypatch.setattr(loop_claims, "_MOST_KEPT", 10)
    with pytest.raises(ProofError, match="more than 0 boxes with closed loops"):
        check_workspace_proof(proof, case)


def test_what_a_case_does_not_claim_is_refused_packed(
    workspace: tuple[Case, Proof], monkeypatch: pytest.MonkeyPatch
) -> None:
    def unpacked(_: PackedTree) -> bytes:
        raise AssertionError

    monkeypatch.setattr(PackedTree, "unpacked", unpacked)
    case, proof = workspace
    given = read_proof(proof.as_text(), "proof.json")
    with pytest.raises(AssertionError):
        check_workspace_proof(given, case)
    other = replace(given.claims[0], name="other")
    with pytest.raises(ProofError, match="the claims are not those of the case, each once: see other"):
        check_workspace_proof(replace(given, claims=(*given.claims, other)), case)
    with pytest.raises(ProofError, match="no claim rests on the lemma other"):
        check_workspace_proof(replace(given, lemmas=(other,)), case)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda content: content["claims"].append(content["claims"][0]), "has the name and sense of another entry"),
        (lambda content: content["not_on_paper"].extend([UNPROVED] * 2), "has the name and sense of another entry"),
        (lambda content: content["not_on_paper"].extend(UNPROVED | {"name": f"{k}"} for k in range(20_001)), "entries"),
        (lambda content: content["claims"][0].update(name="x" * 2**24), "claims[0].name: has 16777216 characters"),
        (lambda content: content["claims"][0].update(graph="1 " * 2**23), "claims[0].graph: has 16777216 characters"),
        (lambda content: content.update(name="x" * 2**24), "name: has 16777216 characters"),
        (lambda content: content.update({"x" * 2**24: 1}), "no such key"),
        (lambda content: content.update(case="x" * 2**24), "case: has 16777216 characters"),
        (lambda content: content["premises"].update(quantities=["F", "F"]), "premises.quantities: has a name twice"),
        (lambda content: content["premises"].update(quantities=["F" * 2**22]), "premises.quantities[0]: has 4194304"),
    ],
)
def test_lists_and_texts_without_end_are_refused(
    cli: Run, tmp_path: Path, workspace: tuple[Case, Proof], change: Callable[[dict[str, Any]], None], fault: str
) -> None:
    content = json.loads(workspace[1].as_text())
    change(content)
    file = str(saved(tmp_path / "proof.json", json.dumps(content)))
    refusal_of(cli("verify-proof", file), file, fault)
