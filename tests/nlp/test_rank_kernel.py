"""The rank of matrices from forms of their entries in the C kernel: boxes, bounds, planted faults.

A copy of the kernel keeps C, the middle of the matrix and the bound B of the last box, so that ``|I - C M(y)| <= B``
can be held against the matrix at points of the box, computed by CasADi.
"""

import ctypes
import importlib.machinery
import importlib.util
import math
import shutil
import subprocess
import sysconfig
from functools import cache
from pathlib import Path
from types import ModuleType

import casadi as ca
import numpy as np
import pytest
from numpy_engine.rank_rule import NumpyRankTest

from screwsynth.models import FloatArray, stewart_gough
from screwsynth.models.joints.closedform import closed_form
from screwsynth.nlp import Case, Free, Outcome, Task, TurnKind, Turns, Workspace, build_model
from screwsynth.nlp.proof.enclosure.forms import Encloser, Forms
from screwsynth.nlp.proof.statement.tolerance import built_model
from screwsynth.nlp.proof.workspace.ranks import rank_rule
from screwsynth.nlp.proof.workspace.ranks.loop_boxes import Examiner, LoopBoxes
from screwsynth.nlp.proof.workspace.ranks.rank_rule import EntryChange, RankTest
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank
from screwsynth.nlp.proof.workspace.ranks.singular_pose import DeterminantSigns, _sign_of_determinant
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_model import RankMatrix
from screwsynth.nlp.proof.workspace.robot.posed_robot import Problem, build_problem, family_of

FOLDER = Path(__file__).parents[2] / "nlp" / "proof" / "enclosure"
COMPILER = shutil.which("gcc") or shutil.which("cc")
CASE = Case(stewart_gough(layout="octahedral"), {"x1": 26.5, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)},
            [0.0, 0.0, 20.0], [Task([0, 0, 0, 0, 0, 1])])  # fmt: skip
ALL_AXES, TURNS = TurnKind.ANY_AXIS, TurnKind.ROLL_PITCH_YAW


def hexapod(kind: TurnKind, degrees: float) -> Problem:
    """LinuxCNC's hexapod, 5 in to each side of z = 20 in."""
    angle = Free(-math.radians(degrees), math.radians(degrees))
    place = (Free(-5.0, 5.0), Free(-5.0, 5.0), Free(15.0, 25.0))
    return build_problem(
        CASE, CASE.model, pose_box(Workspace(place, Turns(kind, (angle,) * (1 if kind is ALL_AXES else 3))))
    )


def gallery(name: str, part: float, degrees: float) -> Problem:
    """A robot of the gallery about its home."""
    model = build_model(name)
    values = {item.name: item.typical[0] for item in model.parameters}
    size = max(abs(each) for each in (*model.home, *values.values()))
    angle = Free(-math.radians(degrees), math.radians(degrees))
    place = [Free(each - part * size, each + part * size) for each in model.home]
    case = Case(model, values, list(model.home), [Task([0, 0, 0, 0, 0, 1])])
    return build_problem(case, closed_form(model).model, pose_box(Workspace(place, Turns(TURNS, (angle,) * 3))))


@pytest.mark.parametrize(("kind", "degrees", "most"), [(ALL_AXES, 20, 79), (ALL_AXES, 30, 571), (TURNS, 20, 103)])
def test_a_hexapod_takes_as_many_boxes_as_its_exact_expansion(kind: TurnKind, degrees: float, most: int) -> None:
    # The expansion of the rows as polynomials takes these numbers of boxes.
    problem = hexapod(kind, degrees)
    found = prove_rank(problem, problem.locked)
    assert found.outcome is Outcome.PROVED
    assert found.boxes <= 1.02 * most


def test_a_search_that_ends_at_once_leaves_the_whole_box_open() -> None:
    problem = hexapod(TURNS, 20)
    found = prove_rank(problem, problem.locked, most_boxes=1)
    assert (found.outcome, found.share) == (Outcome.OPEN, 1.0)


@pytest.mark.parametrize(
    ("name", "part", "degrees", "most"), [("6-rss", 0.02, 5, 103), ("6-rus", 0.05, 10, 87), ("6-ups", 0.1, 20, 39)]
)
def test_other_robots_take_few_boxes_too(name: str, part: float, degrees: float, most: int) -> None:
    problem = gallery(name, part, degrees)
    found = prove_rank(problem, problem.locked)
    assert found.outcome is Outcome.PROVED
    assert found.boxes <= 1.02 * most


@pytest.mark.parametrize("tolerance", [0.0, 0.3])
def test_the_kernel_agrees_with_the_reference_box_by_box(tolerance: float) -> None:
    problem, rng = hexapod(TURNS, 45), np.random.default_rng(1)
    meant = family_of(CASE, built_model(CASE.model), problem, tolerance) if tolerance else problem
    box = problem.box
    lower = box.random(300, rng)
    upper = lower + (box.upper - box.lower) * rng.uniform(0, 0.2, (300, 1))
    cells = LoopBoxes(lower, upper, 0.5 * (lower + upper), np.ones(300, dtype=bool))
    ours, theirs = (
        Examiner(meant, test(meant.locked, meant.z, meant.start)).examine(cells) for test in (RankTest, NumpyRankTest)
    )
    assert (ours.is_regular == theirs.is_regular).mean() > 0.98
    assert (ours.signs == theirs.signs).mean() > 0.98
    assert 0.1 < theirs.is_regular.mean() < 0.9


def test_a_few_steps_find_poses_with_extreme_determinants() -> None:
    problem = hexapod(TURNS, 45)
    signs = DeterminantSigns(problem, problem.locked)
    poses = problem.box.random(5000, np.random.default_rng(0))[:, list(problem.free)]
    found, sampled = (signs.computed(each) for each in (signs.extremes(), problem.exact(poses)))
    # The largest is at the ends of the box, the smallest near its middle.
    assert found.max() > 1.1 * sampled.max() > 0
    assert found.min() < 0.97 * sampled.min() < 0


def test_signs_of_determinants_are_exact() -> None:
    for each in np.random.default_rng(4).integers(-1, 2, (100, 6, 6)).astype(float):
        assert _sign_of_determinant(each) == np.sign(np.round(np.linalg.det(each)))


def test_a_matrix_may_have_many_columns() -> None:
    x = ca.SX.sym("x", 1)
    test = RankTest(RankMatrix(x * ca.SX.eye(100), 0), x, np.ones(1))
    forms = Encloser(x, test.entries)(np.array([[0.5, -0.5]]), np.array([[1.5, 1.5]]))
    assert test.examine(forms, 1, 0).is_regular.tolist() == [True, False]


def test_a_large_entry_beside_a_constant_row_hides_no_singular_matrix() -> None:
    """The spectral radius of ``[[0, 0], [1e9, r]]`` is r, as a positive vector shows and no other may."""
    x = ca.SX.sym("x", 2)
    test = RankTest(RankMatrix(ca.vertcat(ca.SX([[1, 0]]), x.T), 0), x, np.array([0.0, 1.0]))
    rest = np.array([[1e9, 0.5], [1e9, 1.5]])
    found = test.examine(Forms(np.array([[0.0, 1.0]] * 2), np.zeros((2, 2, 1)), rest), 1, 0)
    assert found.is_regular.tolist() == [True, False]


def test_the_errors_of_a_centre_are_a_vector_of_unit_length() -> None:
    x = ca.SX.sym("x", 1)
    test = RankTest(RankMatrix(x, 0), x, np.ones(1))
    # The sums of two vectors' lengths are 0.99 and 1.01; those of their parts would be 1.3 and more.
    parts = np.array([[0.5], [0.52]]) / math.sqrt(3)
    a = np.hstack([np.repeat(parts, 3, axis=1), 0 * parts, 0.49 + 0 * parts, 0 * parts])[:, None]
    found = test.examine(Forms(np.ones((2, 1)), a, np.zeros((2, 1))), 0, 6)
    assert found.is_regular.tolist() == [True, False]


def test_a_sum_that_overflows_shows_nothing() -> None:
    x = ca.SX.sym("x", 1)
    test = RankTest(RankMatrix(x * (ca.SX.eye(2) + 0.5 * ca.SX.ones(2, 2)), 0), x, np.ones(1))
    for rest, is_regular in ((0.1, 1), (1e308, 0)):
        forms = Forms(np.array([[1.0, 0.0, 0.0, 1.0]]), np.zeros((1, 4, 1)), np.full((1, 4), rest))
        assert test.examine(forms, 1, 0).is_regular.tolist() == [is_regular]


#: One wrong rule each: the text of the kernel, and what stands in its place; PLANTED is whether this one is on.
FAULTS = {
    "no fault": ("", ""),
    "terms of first order are dropped": ("int t = 0; t < T;", "int t = PLANTED ? found->coordinates : 0; t < T;"),
    "products are dropped": ("t < T; t++", "t < (PLANTED ? found->coordinates : T); t++"),
    "|C| times the rest is omitted": ("fabs(by[l]) * (rest[l] + ", "fabs(by[l]) * (!(PLANTED) * rest[l] + "),
    "the rest has a fifth of its width": ("rest[l] *= scale", "rest[l] *= (PLANTED ? 0.2 : 1) * scale"),
    "the spectral radius may be above 1": ("if (most < 1 - PRODUCTS)", "if (most < (PLANTED ? 3 : 1 - PRODUCTS))"),
}  # fmt: skip
#: Wrong forms: by how much the term of a square moves the middle, and its factor. The last are those of machines alone.
FORMS = {
    "the half of a square is its own middle": (0.0, 0.0),
    "a square moves about 0": (-1.0, 1.0),
    "errors of joint centres change nothing": None,
}


class Copy:
    """A compiled copy of the kernel with faults, one of which can be switched on, and what it keeps of its last box."""

    def __init__(self, folder: Path) -> None:
        shutil.copytree(FOLDER, folder / "copy", ignore=shutil.ignore_patterns("*.so", "*.py", "__pycache__"))
        header = folder / "copy" / "kernel" / "rank.h"
        text = header.read_text(encoding="utf-8")
        judged = "found->regular[start + l] = judge_lane(m, found, l, parts, found->shares + start + l);"
        planted = [
            (old, new.replace("PLANTED", f"planted == {k}")) for k, (old, new) in enumerate(FAULTS.values()) if k
        ]
        for before, after in ((judged, f"{{ {judged} if (!l) keep_parts(m, parts); }}"), *planted):
            assert text.count(before) == 1, before
            text = text.replace(before, after)
        text, start = text.replace("typedef struct {", "int planted;\ntypedef struct {", 1), "static void rank_all("
        kept = (
            "double kept_C[4096], kept_B[4096];\n"
            "static void keep_parts(const Matrix *m, RankParts x)\n{\n"
            "    for (int k = 0; k < m->columns * m->rows; k++) kept_C[k] = x.C[k][0];\n"
            "    memcpy(kept_B, x.B, (size_t)(m->columns * m->columns) * sizeof(double));\n}\n\n"
        )
        header.write_text(text.replace(start, kept + start), encoding="utf-8")
        target = folder / "_bounds.abi3.so"
        flags = ["-shared", "-fPIC", "-O1", "-ffp-contract=off", f"-I{sysconfig.get_path('include')}"]
        source = folder / "copy" / "_bounds.c"
        subprocess.run([str(COMPILER), *flags, str(source), "-o", str(target), "-lm"], check=True, capture_output=True)
        loader = importlib.machinery.ExtensionFileLoader("_bounds", str(target))
        spec = importlib.util.spec_from_file_location("_bounds", target, loader=loader)
        assert spec is not None
        self.module: ModuleType = importlib.util.module_from_spec(spec)
        loader.exec_module(self.module)
        library = ctypes.CDLL(str(target))
        self.planted = ctypes.c_int.in_dll(library, "planted")
        self._kept = [(ctypes.c_double * 4096).in_dll(library, name) for name in ("kept_C", "kept_B")]

    def kept(self, columns: int) -> tuple[FloatArray, FloatArray]:
        """C and B, (c, c) each."""
        first, second = (np.array(each)[: columns**2].reshape(columns, columns) for each in self._kept)
        return first, second


def is_found(copy: Copy, meant: Problem) -> bool:
    """Whether ``I - C M(y)`` is beyond the kernel's bound at a point, or a box counts with too large a bound."""
    rng, problem = np.random.default_rng(1), meant.problem
    examiner = Examiner(meant, RankTest(meant.locked, meant.z, meant.start))
    M = ca.Function("M", [meant.z], [ca.densify(meant.locked.matrix)])
    n, columns = len(problem.start), meant.locked.matrix.shape[1]
    values = M(meant.start).full()
    scale = 2.0 ** -np.round(np.log2(np.linalg.norm(values, axis=1)))
    for k in range(60):
        free = np.zeros(n, dtype=bool)
        free[rng.choice(n, 1 + k % 3, replace=False)] = True
        half = problem.size * rng.uniform(0.05, 0.5) * free
        centre = problem.start + 0.5 * problem.size * rng.uniform(-1, 1, n)
        lower, upper = (centre - half)[None], (centre + half)[None]
        found = examiner.examine(LoopBoxes(lower, upper, centre[None], np.ones(1, dtype=bool)))
        C, B = copy.kept(columns)
        if found.is_regular[0] and np.abs(np.linalg.eigvals(B)).max() >= 1:
            return True
        if not np.isfinite(B).all():
            continue
        ends = np.where(rng.random((8, n)) < 0.5, lower, upper)
        for y in np.vstack([ends, centre[None], rng.uniform(lower, upper, (4, n))]):
            machine = meant.exact(y)
            machine[n:] = meant.within(machine + rng.normal(size=len(machine)))[n:]
            values = scale[:, None] * M(machine).full()
            if (np.abs(np.eye(columns) - C @ values) > B + 1e-11).any():
                return True
    return False


@cache
def attacked() -> tuple[list[Problem], Problem]:
    """Robots over boxes of poses, and machines like the first one."""
    problems = [hexapod(ALL_AXES, 30), hexapod(TURNS, 25), gallery("6-rus", 0.1, 20)]
    return problems, family_of(CASE, built_model(CASE.model), problems[0], 0.5)


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    if COMPILER is None:
        pytest.skip("no C compiler")
    return Copy(tmp_path_factory.mktemp("kernel"))


@pytest.mark.parametrize("fault", [*FAULTS, *FORMS])
def test_a_planted_fault_is_found(fault: str, copy: Copy, monkeypatch: pytest.MonkeyPatch) -> None:
    copy.planted.value = [*FAULTS].index(fault) if fault in FAULTS else 0
    monkeypatch.setattr(rank_rule, "kernel", lambda: copy.module)
    wrong, second = FORMS.get(fault), Encloser.second
    if wrong is not None:

        def moved(self: Encloser, lower: FloatArray, upper: FloatArray) -> Forms:
            c, a, r = second(self, lower, upper)
            n = len(lower)
            squares = n + np.cumsum([0, *range(n, 1, -1)])
            c = c + wrong[0] * a[:, :, squares].sum(axis=2)
            a[:, :, squares] *= wrong[1]
            return Forms(c, a, r)

        monkeypatch.setattr(Encloser, "second", moved)
    elif fault in FORMS:
        monkeypatch.setattr(EntryChange, "over", lambda *_: np.zeros((1, 1)))
    problems, machines = attacked()
    found = any(is_found(copy, problem) for problem in problems) or is_found(copy, machines)
    assert found == (fault != "no fault")
