"""Proofs on paper: what the checker accepts, that it rejects what was altered, and that no file exhausts it."""

import json
import re
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import Run, case_file, case_from, ends, output_of, refusal_of, saved, shipped_tables, unbroken, unpacked
from hexapods import hexapod_text
from workspace_cases import TRIPOD
from workspace_cases import written as paper_proof

from screwsynth.nlp import Case, certify, load_case
from screwsynth.nlp.case.reader import read_case
from screwsynth.nlp.proof.checker import packed, proof_file, tree
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.packed import PackedTree, digest_of, packed_text
from screwsynth.nlp.proof.checker.premises import fingerprint, is_same_program, program_of
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofClaim, ProofError, Statement, read_proof
from screwsynth.nlp.proof.checker.tree import Leaf, Node, TreeReader, read_claims
from screwsynth.nlp.proof.checker.workspace import loop_claims
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.statement.standard_form import StandardForm, standard_form
from screwsynth.nlp.solver.certified import proof_of

NAME = "paper-4.1-helical-axis-z"


@pytest.fixture(scope="module")
def written() -> Proof:
    """Axis held: four variables, no row, faces and contraction."""
    file = read_case(NAME)
    return proof_of(certify(file.case, gap=1e-4, starts=4, with_proof=True), file.text)


@pytest.fixture(scope="module")
def proof(written: Proof) -> ProofClaim:
    return written.claims[0]


def ball_case() -> Case:
    """A small box with an active rotation ball: rows, infeasible leaves and multipliers."""
    tables = shipped_tables("paper-4.1-helical")
    tables["pose"]["position"] = [0, 0, 30]
    tables["pose"]["rotation"]["angle"] = ends(5)
    return case_from(tables, "ball")


@pytest.fixture(scope="module")
def ball() -> ProofClaim:
    return proof_of(certify(ball_case(), gap=1e-5, starts=4, with_proof=True), "").claims[0]


def test_a_proof_holds_and_survives_writing_and_reading(written: Proof) -> None:
    again = read_proof(written.as_text(), "again")
    assert unpacked(again) == written
    assert isinstance(again.premises, Statement)
    checked = check_proof(again.claims[0], program_of(load_case(NAME), again.premises))
    assert checked.leaves > 10
    assert checked.bound == written.claims[0].bound


def test_a_proof_with_rows_holds(ball: ProofClaim) -> None:
    nlp = program_of(ball_case(), Statement())
    (claims,) = read_claims(TreeReader(ball.tree), standard_form(nlp))
    assert {kind for kind, _ in claims} >= {Node.BOUNDED, Node.INFEASIBLE}
    check_proof(ball, nlp)


def is_feasible(form: StandardForm, point: np.ndarray) -> bool:
    """Whether every condition holds at a point, as computed; one without a value does not."""
    values = np.array(ca.Function("values", [form.x], [form.expressions])(point)).ravel()[len(form.functions) :]
    sizes = [abs(value) if each.is_equation else value for value, each in zip(values, form.conditions, strict=True)]
    return all(size <= 0 for size in sizes)


class Places(TreeReader):
    """Notes where in the tree each closing reason stands, how long it is, and the middle of its box."""

    def walk(self, lower: np.ndarray, upper: np.ndarray, inner: Set[Node]) -> Iterator[Leaf]:
        self.places: list[tuple[int, int, np.ndarray]] = []
        for kind, i, low, high in super().walk(lower, upper, inner):
            start = self.at - 1
            yield kind, i, low, high
            if i < 0:
                self.places.append((start, self.at - start, 0.5 * (low + high)))


def nodes(proof: ProofClaim, case: Case) -> list[tuple[int, int, bool]]:
    """Start and length of every closing reason in a tree, and whether the middle of its box is feasible."""
    form = standard_form(program_of(case, Statement()))
    reader = Places(proof.tree)
    assert list(read_claims(reader, form))
    reader.finish()
    return [(start, length, is_feasible(form, middle)) for start, length, middle in reader.places]


def rejected(proof: ProofClaim, case: Case, **values: object) -> str:
    """The reason for which the check rejects a claim, with other values in it."""
    with pytest.raises(ProofError) as caught:
        check_proof(replace(proof, **values), program_of(case, Statement()))
    return str(caught.value)


def test_trees_with_a_leaf_less_or_more_are_rejected(proof: ProofClaim) -> None:
    places = nodes(proof, load_case(NAME))
    for at, length, _ in (places[0], places[len(places) // 2], places[-1]):
        assert rejected(proof, load_case(NAME), tree=proof.tree[:at] + proof.tree[at + length :])
    assert "additional data after its last box" in rejected(
        proof, load_case(NAME), tree=proof.tree + bytes([Node.BOUNDED])
    )


def test_altered_bounds_cuts_and_reasons_are_rejected(proof: ProofClaim, ball: ProofClaim) -> None:
    for each, case in ((proof, load_case(NAME)), (ball, ball_case())):
        assert "could not be proved for the box" in rejected(each, case, bound=each.bound * (1 - 3e-4))
    at = ball.tree.index(Node.HALF)
    assert rejected(ball, ball_case(), tree=ball.tree[:at] + ball.tree[at + 2 :])
    places = nodes(ball, ball_case())
    row = len(standard_form(program_of(ball_case(), Statement())).functions)
    bounded = [at for at, _, feasible in places if ball.tree[at] == Node.BOUNDED and feasible]
    for at in (bounded[0], bounded[-1]):
        for kind, index, words in (
            (Node.INFEASIBLE, row, "excludes every point"),
            (Node.MONOTONE, 0, "is monotone in"),
        ):
            tree = ball.tree[:at] + bytes([kind, index]) + ball.tree[at + 1 :]
            assert words in rejected(ball, ball_case(), tree=tree)


@pytest.mark.parametrize(
    "tree", [b"", b"\xff", bytes([Node.HALF]), bytes([Node.HALF, 200]), bytes([Node.INFEASIBLE, 9])]
)
def test_what_is_no_tree_is_rejected(proof: ProofClaim, tree: bytes) -> None:
    assert rejected(proof, load_case(NAME), tree=tree)


def test_a_face_that_is_not_the_cases_is_rejected(proof: ProofClaim) -> None:
    # Of the lower half the upper face, of the upper half the lower one; the trees are whole otherwise.
    for halves in ((Node.FACE_UPPER, 0, Node.BOUNDED, Node.BOUNDED), (Node.BOUNDED, Node.FACE_LOWER, 0, Node.BOUNDED)):
        assert "which is neither the smallest nor the largest" in rejected(
            proof, load_case(NAME), tree=bytes([Node.HALF, 0, *halves])
        )


def test_a_proof_is_for_its_case_only(proof: ProofClaim) -> None:
    other = load_case(NAME, {"x1": 12.5})
    assert "its expressions or bounds differ" in rejected(proof, other)
    assert fingerprint(program_of(load_case(NAME), Statement())) == proof.graph


def test_the_command_line_writes_and_checks_proofs(cli: Run, tmp_path: Path) -> None:
    target = tmp_path / "proof.json"
    code, out, _ = cli("certify", NAME, "--gap", "1e-3", "--starts", "4", "--proof", str(target))
    assert (code, "proved" in out) == (0, True)
    for arguments in ((str(target),), (str(target), NAME)):
        code, out, _ = cli("verify-proof", *arguments)
        assert (code, "PROOF VALID: F is at most" in out) == (0, True), out
    code, _, err = cli("verify-proof", str(target), "paper-4.1-rotation-axis-z")
    assert (code, "its expressions or bounds differ" in err) == (1, True)
    # Of a search that ends before, there is none.
    target = tmp_path / "none.json"
    code, _, err = cli("certify", "paper-4.3", "--starts", "1", "--time", "0.01", "--proof", str(target))
    assert (code, err) == (1, f"--proof {target}: not written, as there is no complete proof\n")
    assert not target.exists()


def test_the_command_line_rejects_what_is_damaged_or_altered(cli: Run, tmp_path: Path, written: Proof) -> None:
    target, content = tmp_path / "proof.json", json.loads(written.as_text())
    claim, tree = content["claims"][0], written.claims[0].tree[:-1]
    claim["tree"] = packed_text(tree)
    refusal_of(cli("verify-proof", str(saved(target, json.dumps(content)))), "damaged")
    claim["digest"] = digest_of(tree)
    code, _, err = cli("verify-proof", str(saved(target, json.dumps(content))))
    assert (code, "rejected" in err) == (1, True)
    refusal_of(cli("verify-proof", str(tmp_path / "none.json")), "cannot be read")


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("--gap", "0"), "--gap"),
        (("--gap", "nan"), "--gap"),
        (("--time", "0"), "--time"),
        (("--above", "inf"), "--above"),
        (("--proof", "-", "--json", "-"), "standard output"),
        (("--proof", "/nowhere/p.json"), "is not a folder"),
    ],
)
def test_wrong_input_to_certify_is_one_sentence(cli: Run, arguments: tuple[str, ...], fault: str) -> None:
    refusal_of(cli("certify", NAME, *arguments), fault)


def test_the_certificate_in_the_result(cli: Run) -> None:
    result = json.loads(output_of(cli("solve", NAME, "--starts", "4", "--certify", "--json", "-")))
    certificate = result["certificate"]
    assert certificate["status"] == "proved"
    assert certificate["engine"] == "c"
    assert certificate["bound"] >= result["F"] == pytest.approx(certificate["incumbent"])
    assert certificate["gap"] == pytest.approx(certificate["bound"] - certificate["incumbent"])
    assert certificate["relative_gap"] <= 1e-4
    assert certificate["open"] == 0
    assert all(len(row) == 3 for row in certificate["history"])
    assert json.loads(output_of(cli("solve", NAME, "--starts", "4", "--json", "-")))["certificate"] is None


def test_several_tasks_are_certified_one_by_one(cli: Run) -> None:
    result = json.loads(output_of(cli("certify", "paper-4.2", "--json", "-")))
    assert [task["certificate"]["status"] for task in result["tasks"]] == ["proved", "proved"]
    assert result["certificate"] is None
    refusal_of(cli("certify", "paper-4.2", "--proof", "p.json"), "averaged")


def test_above_on_the_command_line(cli: Run) -> None:
    assert "F is above 1 on the whole box" in output_of(cli("certify", NAME, "--above", "1"))
    code, out, _ = cli("certify", NAME, "--above", "300")
    assert (code, "not above 300" in out) == (1, True)
    assert load_case(NAME).tasks[0].sense.value == "max"


@pytest.mark.parametrize(("method", "sense"), [("weighted-sum", "max"), ("worst-case", "max"), ("worst-case", "min")])
def test_combined_programs_are_proved_and_checked(cli: Run, tmp_path: Path, method: str, sense: str) -> None:
    tables, target = shipped_tables(NAME) | {"combine": {"method": method}}, str(tmp_path / "proof.json")
    tables["task"] += [{"name": "other", "sense": sense, "axis": [0, 1, 1], "point": [1, 0, 3], "pitch": 2}]
    case = case_file(tmp_path, tables)
    result = json.loads(output_of(cli("certify", str(case), "--gap", "1e-3", "--proof", target, "--json", "-")))
    assert result["certificate"]["status"] == "proved"
    assert len(result["tasks"]) == 2
    bound, out = result["certificate"]["bound"], unbroken(output_of(cli("verify-proof", target)))
    stated = float(out.split(f"F is at {'most' if sense == 'max' else 'least'} ")[1].split(" ")[0])
    first, second = ("F('drive the screw')", "F('other')")
    best = [f"{each['certificate']['incumbent']:.6f}" for each in result["tasks"]]
    words, outwards = {
        ("weighted-sum", "max"): (f"F being 1 {first} + 1 {second}\n", 1),
        ("worst-case", "max"): (f"F being the least of {first} / 1 and {second} / 1\n", 1),
        # The worst loss: how far each task is from its own optimum.
        ("worst-case", "min"): (f"F being the largest of 1 ({best[0]} - {first}) and 1 ({second} - {best[1]})\n", -1),
    }[method, sense]
    assert words in re.sub(r"\d+\.\d{9,}", lambda found: f"{float(found[0]):.6f}", out)
    assert 0 <= outwards * (stated - bound) <= 1e-9 * bound
    solved = tmp_path / "solved.json"
    out = output_of(cli("solve", str(case), "--certify", "--starts", "4", "--json", str(solved)))
    assert out.count("proved:") == 3
    combined = json.loads(solved.read_text(encoding="utf-8"))["combined"]
    assert outwards * (combined["certificate"]["bound"] - combined["value"]) >= 0


def test_a_fingerprint_forgives_rounding_and_nothing_else(proof: ProofClaim) -> None:
    nlp = program_of(load_case(NAME), Statement())
    rounded = replace(nlp, arguments=np.nextafter(nlp.arguments, np.inf), upper=np.nextafter(nlp.upper, 0.0))
    assert is_same_program(fingerprint(rounded), proof.graph)
    for other in (
        replace(nlp, upper=nlp.upper * (1 + 1e-5)),
        program_of(load_case(NAME, {"x2": 8.0001}), Statement()),
        program_of(load_case("paper-4.1-rotation-axis-z"), Statement()),
    ):
        assert not is_same_program(fingerprint(other), proof.graph)
    for text in ("", "x y z", proof.graph + " 1", proof.graph[:-3] + "zzz"):
        assert not is_same_program(text, proof.graph)


def test_a_proof_by_limbs_holds_and_its_bounds_must_add_up() -> None:
    joints: dict[str, object] = {}
    for k in range(6):
        for name, radius, turn in (("base", 12.0, 0.2), ("platform", 6.0, -0.3)):
            angle = np.pi / 3 * k + (-1) ** k * turn
            joints[f"{name}_{k + 1}"] = [float(radius * np.cos(angle)), float(radius * np.sin(angle)), 0.0]
    # Two legs with free joint coordinates.
    for name in ("base_1", "platform_1", "base_4"):
        x, y, z = joints[name]  # type: ignore[misc]
        joints[name] = [{"min": x - 2, "max": x + 2}, {"min": y - 2, "max": y + 2}, z]
    tables = {
        "robot": {"model": "hexapod", "parameters": joints},
        "pose": {"position": [0, 0, 15]},
        "task": [{"name": "t", "sense": "max", "axis": [1, 2, 3], "point": [1, 0, 2], "pitch": 1}],
    }
    case = case_from(tables, "two legs")
    (proof,) = proof_of(certify(case, gap=1e-3, starts=2, with_proof=True), "").claims
    assert proof.tree[0] == Node.LIMBS
    nlp = program_of(case, Statement())
    assert check_proof(proof, nlp).bound == proof.bound
    assert "the sum of the bounds of all limbs exceeds" in rejected(proof, case, bound=proof.bound * (1 - 1e-3))
    (first,) = struct.unpack("<d", proof.tree[1:9])
    lower = proof.tree[:1] + struct.pack("<d", first * (1 - 0.01)) + proof.tree[9:]
    assert "could not be proved" in rejected(proof, case, tree=lower)
    assert "ends" in rejected(proof, case, tree=proof.tree[:-1])
    assert "additional data after its last box" in rejected(proof, case, tree=proof.tree + bytes([Node.BOUNDED]))
    # Bounds whose sum is no number.
    for huge in (np.finfo(float).max, np.inf, np.nan):
        limb = struct.pack("<d", huge) + bytes([Node.BOUNDED])
        assert "the sum of the bounds of all limbs exceeds" in rejected(
            proof, case, tree=bytes([Node.LIMBS]) + 2 * limb
        )
    # Bounds that cancel: their rounding is far more than the proven bound.
    cancelling = b"".join(struct.pack("<d", each) + bytes([Node.BOUNDED]) for each in (1e16, -1e16))
    assert "the sum of the bounds of all limbs exceeds" in rejected(proof, case, tree=bytes([Node.LIMBS]) + cancelling)


def test_leg_clearance_is_covered_and_its_proof_holds() -> None:
    tables = shipped_tables("hexapod-machining")
    tables["limits"] = {"leg_clearance": {"min": 3}}
    tables["robot"]["parameters"].update({"x1": 26.5, "x2": 11.543, "x3": 4})
    tables["pose"]["position"] = [{"min": -6, "max": 6, "start": 0}, 0, 20]
    tables["pose"]["rotation"] = {"axis": [0, 0, 1], "angle": {"min": -15, "max": 15}}
    case = case_from(tables, "legs")
    certified = certify(case, gap=1e-3, starts=4, with_proof=True)
    evidence = certified.solution.evidence
    assert any(side.name.startswith("leg_clearance") for side in evidence.active)
    (proof,) = proof_of(certified, "").claims
    nlp = program_of(case, Statement())
    check_proof(proof, nlp)
    form = standard_form(nlp)
    x = form.lower[:, None] + np.random.default_rng(0).random((form.n, 3000)) * (form.upper - form.lower)[:, None]
    values = ca.Function("values", [form.x], [form.expressions]).map(3000)(x).full()
    feasible = (values[1:] <= 0).all(axis=0)
    assert 0 < feasible.sum() < 3000
    # Points that do not keep the limit are better: it matters.
    assert values[0][feasible].max() <= proof.bound < values[0].max()
    assert "could not be proved for the box" in rejected(proof, case, bound=proof.bound * (1 - 3e-3))


#: A case with its proof.
Proved = tuple[Case, Proof]
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
def optimum() -> Proved:
    file = read_case(ROTATION)
    return file.case, proof_of(certify(file.case, gap=1e-4, with_proof=True), file.text)


@pytest.fixture(scope="module")
def workspace() -> Proved:
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


def test_memory_is_bounded(tmp_path: Path, optimum: Proved, workspace: Proved) -> None:
    """Twelve claims whose trees unpack to 128 MB each; a tree that is nothing but deep; one with a million leaves."""
    status, honest, err = checked(tmp_path / "honest.json", json.loads(workspace[1].as_text()))
    assert (status, err) == (0, "")
    assert sum(bool(each.tree) for each in workspace[1].claims) >= 12
    attacks: list[tuple[dict[str, Any], int, str]] = [
        (with_trees(workspace[1], bytes(2**27 + 1)), 2, "exceed 128 MB"),
        (with_trees(optimum[1], bytes([Node.HALF, 0]) * 2**23), 1, "more than 10000 nested bisections"),
        (with_trees(optimum[1], nodes_of_depth(21), bound=0.0), 1, "could not be proved"),
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


def test_all_trees_of_a_file_have_one_budget(workspace: Proved, monkeypatch: pytest.MonkeyPatch) -> None:
    case, proof = workspace
    text, size = proof.as_text(), sum(len(each.tree) for each in proof.claims)
    monkeypatch.setattr(packed, "LARGEST_TREES", size)
    given = read_proof(text, "proof.json")
    # A tree counts once, however often its claim is checked.
    assert check_workspace_proof(given, case) == check_workspace_proof(given, case)
    monkeypatch.setattr(packed, "LARGEST_TREES", size - 1)
    with pytest.raises(packed.DamagedProofError, match=r"proof\.json: the unpacked trees, up to that of '.*', exceed"):
        check_workspace_proof(read_proof(text, "proof.json"), case)


def test_no_proof_is_written_that_is_too_large_to_be_read(optimum: Proved, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proof_file, "LARGEST_TREES", len(optimum[1].claims[0].tree) - 1)
    with pytest.raises(ProofError, match="the trees of boxes in the proof have"):
        optimum[1].as_text()


def test_a_tree_that_is_read_in_blocks_shows_the_same(
    optimum: Proved, workspace: Proved, monkeypatch: pytest.MonkeyPatch
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
        with pytest.raises(ProofError, match=r"is incomplete|additional data"):
            check_proof(replace(claim, tree=short), nlp)


def test_boxes_with_closed_loops_are_not_kept_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    case = case_from(TRIPOD, "3-rps")
    proof = paper_proof(case, with_limits=False)[1]
    check_workspace_proof(proof, case)
    monkeypatch.setattr(loop_claims, "_MOST_KEPT", 10)
    with pytest.raises(ProofError, match="more than 0 boxes with closed loops"):
        check_workspace_proof(proof, case)


def test_what_a_case_does_not_claim_is_refused_packed(workspace: Proved, monkeypatch: pytest.MonkeyPatch) -> None:
    def unpacked(_: PackedTree) -> bytes:
        raise AssertionError

    monkeypatch.setattr(PackedTree, "unpacked", unpacked)
    case, proof = workspace
    given = read_proof(proof.as_text(), "proof.json")
    with pytest.raises(AssertionError):
        check_workspace_proof(given, case)
    other = replace(given.claims[0], name="other")
    with pytest.raises(ProofError, match="the proof has the additional claim other; a proof must have each claim"):
        check_workspace_proof(replace(given, claims=(*given.claims, other)), case)
    with pytest.raises(ProofError, match="the proof has a lemma that no claim of this case uses: other"):
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
        (
            lambda content: content["premises"].update(quantities=["F", "F"]),
            "premises.quantities: contains a name twice",
        ),
        (lambda content: content["premises"].update(quantities=["F" * 2**22]), "premises.quantities[0]: has 4194304"),
    ],
)
def test_lists_and_texts_without_end_are_refused(
    cli: Run, tmp_path: Path, workspace: Proved, change: Callable[[dict[str, Any]], None], fault: str
) -> None:
    content = json.loads(workspace[1].as_text())
    change(content)
    file = str(saved(tmp_path / "proof.json", json.dumps(content)))
    refusal_of(cli("verify-proof", file), file, fault)
