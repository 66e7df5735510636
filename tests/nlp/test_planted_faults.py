"""Faults planted into the C kernel of workspaces: what holds it to be sound must find each of them.

A copy of ``_workspace.c`` with one wrong rule is compiled. It keeps C and the bound B of the last box, so that
``|I - C J(y)| <= B`` can be held against the rows at points of the box in fractions. What the copy calls regular, or
outside of the workspace, is held against the checker of proofs on paper. The kernel itself must pass both.
"""

import ctypes
import importlib.machinery
import importlib.util
import math
import shutil
import subprocess
import sysconfig
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from screwsynth.models import FloatArray
from screwsynth.nlp import Free
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.proof.checker.fractions import exact_rows
from screwsynth.nlp.proof.checker.proof_file import ProofError
from screwsynth.nlp.proof.checker.workspace.ballrows import Joints
from screwsynth.nlp.proof.checker.workspace.pieces import show
from screwsynth.nlp.proof.checker.workspace.poseroot import pose_root
from screwsynth.nlp.proof.checker.workspace.rankclaim import RankClaim
from screwsynth.nlp.proof.checker.workspace.tree import Leaves
from screwsynth.nlp.proof.statement.machine import Legs
from screwsynth.nlp.proof.workspace.regular.engines import KernelRankEngine
from screwsynth.nlp.proof.workspace.regular.regularity import Rank
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseBox, pose_box

SOURCE = Path(__file__).parents[2] / "nlp" / "proof" / "workspace" / "_workspace.c"
COMPILER = shutil.which("gcc") or shutil.which("cc")
#: Compiling a copy takes a second.
pytestmark = [pytest.mark.slow, pytest.mark.skipif(COMPILER is None, reason="no C compiler")]

_TEST = "    if (is_contraction((const double(*)[N])B, robot->length, v)) {\n"
_KEPT = "double kept_C[N][N], kept_B[N][N];\nWIDE static void examine_box("
#: Text of the kernel that is replaced so that a copy keeps C and B.
PROBE = {
    _TEST: "    memcpy(kept_C, C, sizeof kept_C), memcpy(kept_B, B, sizeof kept_B);\n" + _TEST,
    "WIDE static void examine_box(": _KEPT,
}
_MOMENT = "row[4] = u[2] * arm[0] - u[0] * arm[2]"
_HALF = "h[k] = larger(upper[k] - c[k], c[k] - lower[k]) * (1 + ULP);"
#: One wrong rule each: the text of the kernel, what stands in its place, and what must find it.
FAULTS = {
    "no fault": ("", "", ""),
    "terms of second order are dropped": (
        "t = 1; t < TERMS; t++)\n                sum",
        "t = 1; t < 7; t++)\n                sum",
        "rows",
    ),
    "|C| times the rest is omitted": ("(sum + extra) * (1", "(sum + 0 * extra) * (1", "rows"),
    "rounding of rows is 1e-19": ("#define ROUNDING 1e-13", "#define ROUNDING 1e-19", "rows"),
    "terms of third order are halved": ("thirds * h[j] +", "0.5 * thirds * h[j] +", "rows"),
    "half widths are a tenth too small": (_HALF, f"{_HALF} h[k] *= 0.9;", "rows"),
    "the ball is too small": ("if (sum > robot->ball + slack)", "if (sum > 0.9 * robot->ball)", "paper"),
    "the spectral radius may be above 1": ("if (most < 1 - 64 * ULP)", "if (most < 8)", "paper"),
    "a moment has a wrong sign": (_MOMENT, _MOMENT.replace("-", "+"), "rows paper"),
}


class Kernel:
    """A compiled copy of the kernel."""

    def __init__(self, folder: Path, old: str, new: str) -> None:
        text = SOURCE.read_text(encoding="utf-8")
        for before, after in [*PROBE.items(), *([(old, new)] if old else [])]:
            assert text.count(before) == 1, before
            text = text.replace(before, after)
        source, target = folder / "copy.c", folder / "_workspace.abi3.so"
        source.write_text(text, encoding="utf-8")
        flags = ["-shared", "-fPIC", "-O1", "-ffp-contract=off", f"-I{sysconfig.get_path('include')}"]
        subprocess.run([str(COMPILER), *flags, str(source), "-o", str(target), "-lm"], check=True, capture_output=True)
        loader = importlib.machinery.ExtensionFileLoader("_workspace", str(target))
        spec = importlib.util.spec_from_file_location("_workspace", target, loader=loader)
        assert spec is not None
        self.module = importlib.util.module_from_spec(spec)
        loader.exec_module(self.module)
        library = ctypes.CDLL(str(target))
        self._kept = [(ctypes.c_double * 36).in_dll(library, name) for name in ("kept_C", "kept_B")]

    def kept(self) -> tuple[FloatArray, FloatArray]:
        """C and B of the last box, (6, 6) each."""
        return tuple(np.array(each).reshape(6, 6).copy() for each in self._kept)  # type: ignore[return-value]


def machine(kind: TurnKind, rng: np.random.Generator) -> tuple[Legs, Workspace, PoseBox]:
    legs = Legs(
        np.column_stack([rng.uniform(-10, 10, (6, 2)), rng.uniform(-1, 1, 6)]),
        np.column_stack([rng.uniform(-6, 6, (6, 2)), rng.uniform(-1, 1, 6)]),
    )
    turns = (Free(-0.9, 0.9),) * (3 if kind is TurnKind.ROLL_PITCH_YAW else 1)
    place = (Free(-4.0, 4.0), Free(-4.0, 4.0), Free(8.0, 16.0))
    workspace = Workspace(place, Turns(kind, turns, (0.6, 0.0, 0.8)))
    return legs, workspace, pose_box(workspace)


def finds_in_rows(kernel: Kernel) -> bool:
    """Whether a point of a box has a matrix ``I - C J(y)`` beyond the kernel's bound."""
    rng = np.random.default_rng(1)
    for k in range(45):
        kind = list(TurnKind)[k % 3]
        legs, _, box = machine(kind, rng)
        # Single poses show rounding. Boxes in one or two coordinates have bounds that are met at their ends.
        free = np.zeros(6, dtype=bool)
        free[rng.choice(4 if kind is TurnKind.AXIS else 6, k // 3 % 3, replace=False)] = True
        half = 0.3 * (box.upper - box.lower) * free
        centre = 0.6 * box.random(1, rng)[0] + 0.2 * (box.lower + box.upper)
        lower, upper = centre - half, centre + half
        examined = KernelRankEngine(legs, box, kernel.module).examine(lower[None], upper[None])
        C, B = kernel.kept()
        lower, upper = examined.lower[0], examined.upper[0]
        if examined.verdict[0] == Rank.OUTSIDE or not np.isfinite(B).all():
            continue
        for _ in range(6):
            y = np.where(rng.random(6) < 0.5, lower, upper).tolist()
            rows = exact_rows(kind, box.axis.tolist(), legs.base.tolist(), legs.platform.tolist(), y)
            for i, j in np.ndindex(6, 6):
                entry = Fraction(int(i == j)) - sum(Fraction(float(C[i, m])) * rows[m][j] for m in range(6))
                if abs(entry) > Fraction(float(B[i, j])):
                    return True
    return False


def finds_on_paper(kernel: Kernel) -> bool:
    """Whether the checker rejects a box that the kernel calls regular, or outside of the workspace."""
    rng = np.random.default_rng(2)
    for k in range(6):
        legs, workspace, box = machine(list(TurnKind)[k % 3], rng)
        lower = box.random(60, rng)
        upper = np.minimum(lower + (box.upper - box.lower) * rng.uniform(0, 0.6, (60, 6)), box.upper)
        found = KernelRankEngine(legs, box, kernel.module).examine(lower, upper)
        closed = found.verdict != Rank.OPEN
        leaves = Leaves(lower[closed], upper[closed], found.verdict[closed] == Rank.OUTSIDE)
        root = pose_root(workspace)
        for i in range(int(closed.sum())):
            try:
                show(RankClaim(root, Joints(*legs[:2])), root, Leaves(*(part[i : i + 1] for part in leaves)))
            except ProofError:
                return True
    return False


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_found(fault: str, tmp_path: Path) -> None:
    old, new, by = FAULTS[fault]
    kernel = Kernel(tmp_path, old, new)
    assert math.isfinite(kernel.kept()[1].sum())
    if not by:
        assert not finds_in_rows(kernel)
        assert not finds_on_paper(kernel)
    if "rows" in by:
        assert finds_in_rows(kernel)
    if "paper" in by:
        assert finds_on_paper(kernel)
