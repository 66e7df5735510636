"""An installation without the C kernel: what proves something says so in one sentence, and the rest works."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from builders import Run, refusal_of

from screwsynth.nlp import InputError, certify, certify_program, formulate, judge_workspace, largest_scale, load_case
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.proof.boxes.engine import Engine
from screwsynth.nlp.proof.workspace.slices.slices import slices_of
from screwsynth.nlp.solver.certified import proof_of

SENTENCE = "nothing can be proved here: the C kernel was not built when the package was installed; install a C compiler"
HELICAL = "paper-4.1-helical-axis-z"
PUSH, TURN = "push along the normal", "turn about the normal"


@pytest.fixture
def without_kernel(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """An empty folder to work in, with a kernel that cannot be imported."""
    monkeypatch.setitem(sys.modules, "screwsynth.nlp.proof.enclosure._bounds", None)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "command",
    [
        ("certify", HELICAL, "--json", "out.json", "--proof", "out.proof"),
        ("solve", HELICAL, "--certify", "--json", "out.json"),
        ("solve", "hexapod-workspace", "--json", "out.json"),
        ("report", HELICAL, "--certify", "--out", "out.html"),
        ("workspace", "hexapod-linuxcnc", "--json", "out.json", "--html", "out.html", "--proof", "out.proof"),
        ("workspace", "reachy-mini-envelope", "--plot", "out.png"),
        ("workspace", "hexapod-linuxcnc", "--scale"),
        ("sweep", HELICAL, "--over", "task.pitch=1,2", "--certify", "--out", "out.csv"),
        ("sweep", "hexapod-workspace", "--over", "task.pitch=1,2", "--engine", "ipopt", "--out", "out.csv"),
        (
            "pareto",
            "paper-4.2",
            "--goal",
            f"max F:{PUSH}",
            "--goal",
            f"min F:{TURN}",
            "--certify",
            "--csv",
            "out.csv",
        ),
        ("compare", HELICAL, "case", "hexapod", "--certify", "--json", "out.json"),
    ],
    ids=lambda command: " ".join(command[:3]),
)
def test_what_proves_something_says_what_is_missing(command: tuple[str, ...], without_kernel: Path, cli: Run) -> None:
    err = refusal_of(cli(*command), SENTENCE, "pip install")
    assert len(err.strip().splitlines()) == 1
    assert not os.listdir(without_kernel)


@pytest.mark.usefixtures("without_kernel")
def test_functions_that_prove_something_raise_an_input_error() -> None:
    case, machine = load_case(HELICAL), load_case("hexapod-linuxcnc")
    nlp = formulate(case)
    proving: list[Callable[[], object]] = [
        lambda: certify(case),
        lambda: certify_program(nlp),
        lambda: judge_workspace(machine),
        lambda: largest_scale(machine),
        lambda: slices_of(machine),
        lambda: slices_of(load_case("reachy-mini-envelope")),
    ]
    for prove in proving:
        with pytest.raises(InputError, match="the C kernel was not built"):
            prove()


def test_everything_else_works(without_kernel: Path, cli: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    for command in (
        ("solve", HELICAL, "--starts", "2", "--json", "solved.json"),
        ("evaluate", HELICAL),
        ("codegen", HELICAL, "--out", "code", "--no-measure"),
        ("certify", "paper-4.4-snu"),  # nothing is free, so that nothing has to be searched
    ):
        assert cli(*command)[0] == 0
    assert {"solved.json", "code"} == set(os.listdir(without_kernel))
    # The checker takes nothing of the search.
    monkeypatch.undo()
    text = find_case(HELICAL).read_text(encoding="utf-8")
    proof = proof_of(certify(load_case(HELICAL), gap=1e-2, starts=2, with_proof=True), text)
    (without_kernel / "out.proof").write_text(proof.as_text(), encoding="utf-8")
    monkeypatch.setitem(sys.modules, "screwsynth.nlp.proof.enclosure._bounds", None)
    with pytest.raises(InputError):
        Engine(None)  # type: ignore[arg-type]
    assert cli("verify-proof", str(without_kernel / "out.proof"))[0] == 0
