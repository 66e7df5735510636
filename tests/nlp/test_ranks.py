"""Ranks: boxes, bounds and planted faults of the kernel; closed forms, dependent coordinates and verdicts of robots."""

import ctypes
import importlib.machinery
import importlib.util
import json
import math
import shutil
import subprocess
import sysconfig
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import ModuleType

import casadi as ca
import numpy as np
import pytest
from builders import case_file, case_from, case_tables, ran, soaked, starter_tables
from hexapods import bounds_of, smallest, values_of
from kernel_enclosures import enclose
from numpy_engine import first_order
from numpy_engine.rank_rule import NumpyRankTest

from screwsynth.models import FloatArray, Substitution, stewart_gough
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, Free, Outcome, Task, TurnKind, Turns, Workspace, build_model, judge_workspace
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.evidence.dependent import with_dependent
from screwsynth.nlp.proof.enclosure.forms import ULP, Encloser, Forms
from screwsynth.nlp.proof.enclosure.tape import compile_tape
from screwsynth.nlp.proof.statement.fixed_robot import legs_of
from screwsynth.nlp.proof.statement.tolerance import built_model
from screwsynth.nlp.proof.workspace.numbers.bound_search import Goal
from screwsynth.nlp.proof.workspace.numbers.jacobian_numbers import SingularValues
from screwsynth.nlp.proof.workspace.ranks import loop_boxes, rank_rule
from screwsynth.nlp.proof.workspace.ranks import rank_rule as rank
from screwsynth.nlp.proof.workspace.ranks.loop_boxes import Examiner, LoopBoxes
from screwsynth.nlp.proof.workspace.ranks.rank_rule import EntryChange, RankTest
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank
from screwsynth.nlp.proof.workspace.ranks.singular_pose import BY_NEWTON, DeterminantSigns, _sign_of_determinant
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
    turns = Turns(kind, (angle,) * (1 if kind is ALL_AXES else 3))
    return build_problem(CASE, CASE.model, pose_box(Workspace(place, turns)))


def problem_of(name: str, part: float, degrees: float) -> Problem:
    """A robot of the gallery about its home: positions within a part of its size, and rotations by each angle."""
    model = build_model(name)
    values = {item.name: item.typical[0] for item in model.parameters}
    size = max(abs(each) for each in (*model.home, *values.values()))
    angle = math.radians(degrees)
    place = [Free(each - part * size, each + part * size) for each in model.home]
    workspace = Workspace(place, Turns(TurnKind.ROLL_PITCH_YAW, (Free(-angle, angle),) * 3))
    case = Case(model, values, list(model.home), [Task([0, 0, 0, 0, 0, 1])])
    return build_problem(case, closed_form(model).model, pose_box(with_dependent(case, workspace)))


def boxes_of(problem: Problem) -> int:
    """The number of boxes of a search that proves full rank."""
    found = prove_rank(problem, problem.locked)
    assert found.outcome is Outcome.PROVED
    return found.boxes


@pytest.mark.parametrize(("kind", "degrees", "most"), [(ALL_AXES, 20, 79), (ALL_AXES, 30, 571), (TURNS, 20, 103)])
def test_a_hexapod_takes_as_many_boxes_as_its_exact_expansion(kind: TurnKind, degrees: float, most: int) -> None:
    # The expansion of the rows as polynomials takes these numbers of boxes.
    assert boxes_of(hexapod(kind, degrees)) <= 1.02 * most


def test_a_search_that_ends_at_once_leaves_the_whole_box_open() -> None:
    problem = hexapod(TURNS, 20)
    found = prove_rank(problem, problem.locked, most_boxes=1)
    assert (found.outcome, found.share) == (Outcome.OPEN, 1.0)


@pytest.mark.parametrize(
    ("name", "part", "degrees", "most"), [("6-rss", 0.02, 5, 103), ("6-rus", 0.05, 10, 87), ("6-ups", 0.1, 20, 39)]
)
def test_other_robots_take_few_boxes_too(name: str, part: float, degrees: float, most: int) -> None:
    assert boxes_of(problem_of(name, part, degrees)) <= 1.02 * most


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


def test_a_few_steps_find_extreme_determinants_and_their_signs_are_exact() -> None:
    problem = hexapod(TURNS, 45)
    signs = DeterminantSigns(problem, problem.locked)
    poses = problem.box.random(5000, np.random.default_rng(0))[:, list(problem.free)]
    found, sampled = (signs.computed(each) for each in (signs.extremes(), problem.exact(poses)))
    # The largest is at the ends of the box, the smallest near its middle.
    assert found.max() > 1.1 * sampled.max() > 0
    assert found.min() < 0.97 * sampled.min() < 0
    for each in np.random.default_rng(4).integers(-1, 2, (100, 6, 6)).astype(float):
        assert _sign_of_determinant(each) == np.sign(np.round(np.linalg.det(each)))


def test_matrices_known_by_hand_are_regular_or_not() -> None:
    x = ca.SX.sym("x", 1)
    test = RankTest(RankMatrix(x * ca.SX.eye(100), 0), x, np.ones(1))
    forms = Encloser(x, test.entries)(np.array([[0.5, -0.5]]), np.array([[1.5, 1.5]]))
    assert test.examine(forms, 1, 0).is_regular.tolist() == [True, False]
    # The spectral radius of ``[[0, 0], [1e9, r]]`` is r, as a positive vector shows and no other may.
    x = ca.SX.sym("x", 2)
    test = RankTest(RankMatrix(ca.vertcat(ca.SX([[1, 0]]), x.T), 0), x, np.array([0.0, 1.0]))
    rest = np.array([[1e9, 0.5], [1e9, 1.5]])
    found = test.examine(Forms(np.array([[0.0, 1.0]] * 2), np.zeros((2, 2, 1)), rest), 1, 0)
    assert found.is_regular.tolist() == [True, False]
    x = ca.SX.sym("x", 1)
    test = RankTest(RankMatrix(x, 0), x, np.ones(1))
    # The sums of two vectors' lengths are 0.99 and 1.01; those of their parts would be 1.3 and more.
    parts = np.array([[0.5], [0.52]]) / math.sqrt(3)
    a = np.hstack([np.repeat(parts, 3, axis=1), 0 * parts, 0.49 + 0 * parts, 0 * parts])[:, None]
    found = test.examine(Forms(np.ones((2, 1)), a, np.zeros((2, 1))), 0, 6)
    assert found.is_regular.tolist() == [True, False]
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
    """A compiled copy of the kernel with faults, one of which can be switched on.

    It keeps C, the inverse of the matrix's middle, and the bound B of its last box, so that ``|I - C M(y)| <= B`` can
    be held against the matrix at points of the box, computed by CasADi.
    """

    def __init__(self, folder: Path) -> None:
        shutil.copytree(FOLDER, folder / "copy", ignore=shutil.ignore_patterns("*.so", "*.py", "__pycache__"))
        header = folder / "copy" / "kernel" / "rank.h"
        text = header.read_text(encoding="utf-8")
        judged = "found->regular[start + l] = judge_lane(m, found, l, parts, found->shares + start + l);"
        numbered = [(k, *each) for k, each in enumerate(FAULTS.values()) if k]
        planted = [(old, new.replace("PLANTED", f"planted == {k}")) for k, old, new in numbered]
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
    problems = [hexapod(ALL_AXES, 30), hexapod(TURNS, 25), problem_of("6-rus", 0.1, 20)]
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


balls = pytest.importorskip("balls")

#: A robot of each kind: cranks, slides, members, parasitic motions, parallel rods, a platform in a plane.
ROBOTS = ("6-rus", "6-pus", "delta", "3-rps", "3-upu", "exechon", "tricept", "planar-3-rrr", "4-upu", "spherical-3-rrr")


def random_cells(problem: Problem, count: int, width: float, rng: np.random.Generator) -> LoopBoxes:
    """Boxes of independent coordinates with random places and widths, within the whole box."""
    n, own = len(problem.start), list(problem.independent)
    lower, upper = np.full((count, n), np.nan), np.full((count, n), np.nan)
    size = problem.size[own]
    half = width * size * rng.uniform(0.2, 1.0, (count, len(own)))
    middle = problem.start[own] + (size - half) * rng.uniform(-1, 1, half.shape)
    lower[:, own], upper[:, own] = middle - half, middle + half
    near = np.broadcast_to(problem.start, (count, n)).copy()
    return LoopBoxes(lower, upper, near, np.full(count, not problem.dependent))


def wrong_boxes(problem: Problem, matrix: RankMatrix, width: float, seed: int) -> tuple[int, int]:
    """Count boxes said to be regular, and those of them in which a random closed point says otherwise.

    With C a pseudo-inverse of the matrix at the middle, the determinant of C M is positive in a box that is regular for
    the reason of the search.
    """
    rng = np.random.default_rng(seed)
    examiner = Examiner(problem, rank.RankTest(matrix, problem.z, problem.start))
    found = examiner.examine(random_cells(problem, 64, width, rng))
    own, dependent = list(problem.independent), list(problem.dependent)
    function = ca.Function("M", [problem.z], [ca.densify(matrix.matrix)])
    wrong = 0
    for k in np.flatnonzero(found.is_regular):
        low, high = found.boxes.lower[k], found.boxes.upper[k]
        z = np.broadcast_to(0.5 * low + 0.5 * high, (12, len(low))).copy()
        corners = rng.choice([0.0, 1.0], (12, len(own)))
        z[1:, own] = low[own] + corners[1:] * (high - low)[own]
        if dependent:
            z = examiner.loops.all_closed(z.T, dependent).T
            inside = (z[:, dependent] >= low[dependent]) & (z[:, dependent] <= high[dependent])
            wrong += int(not inside.all())
        values = [function(each).full() for each in z]
        extra = np.linalg.svd(values[0])[2][matrix.matrix.shape[1] - matrix.nullity :]
        C = np.linalg.pinv(np.vstack([values[0], extra]))
        wrong += int(any(np.linalg.det(C @ np.vstack([each, extra])) <= 0 for each in values))
    return int(found.is_regular.sum()), wrong


def matrices(problem: Problem) -> Iterator[RankMatrix]:
    yield problem.locked
    if problem.unactuated is not None:
        yield problem.unactuated


@pytest.mark.parametrize("name", soaked(ROBOTS, ROBOTS[:4]))
def test_no_box_is_regular_in_which_a_closed_point_is_not(name: str) -> None:
    problem = problem_of(name, 0.1, 20)
    for matrix in matrices(problem):
        counted = [wrong_boxes(problem, matrix, width, seed) for seed, width in enumerate((0.05, 0.4))]
        assert sum(regular for regular, _ in counted) > 10
        assert not any(wrong for _, wrong in counted)


@pytest.mark.parametrize(("name", "part", "degrees", "most"), [("3-rrs", 0.02, 5, 123), ("delta", 0.1, 10, 3300)])
def test_boxes_are_divided_once_the_widths_of_joints_settle(name: str, part: float, degrees: float, most: int) -> None:
    # With three attempts to find these widths there were 511 and 3,029 boxes.
    assert boxes_of(problem_of(name, part, degrees)) <= most


def test_a_rule_without_linear_parts_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    examine = rank.RankTest.examine

    def without(self: rank.RankTest, forms: Forms, f: int, errors: int) -> rank.Tested:
        rest = np.where(np.isfinite(forms.r), 0.0, forms.r)
        return examine(self, Forms(forms.c, np.zeros_like(forms.a), rest), f, errors)

    monkeypatch.setattr(loop_boxes, "_MOST_SECOND", 0)  # forms of first order, as robots with loops have them
    problem = problem_of("6-ups", 0.5, 80)
    assert not wrong_boxes(problem, problem.locked, 1.0, 1)[1]
    monkeypatch.setattr(rank.RankTest, "examine", without)
    assert wrong_boxes(problem, problem.locked, 1.0, 1)[1]


def test_the_kernel_has_the_forms_of_the_reference_and_is_undefined_where_they_are() -> None:
    x = ca.SX.sym("x", 3)
    values = [f(x[0] * x[1] + 0.3 * x[2]) for f in (ca.sqrt, ca.log, ca.atan, ca.sin, ca.fabs, lambda v: 1 / v)]
    expressions = ca.vertcat(*values, ca.sqrt(x[0] - x[1]) * x[2])
    rng = np.random.default_rng(4)
    centre, half = rng.uniform(-2, 2, (3, 400)), 10.0 ** rng.uniform(-3, 0.3, (3, 400))
    tape = compile_tape(ca.Function("values", [x], [expressions]))
    c, numpy = (each(tape, centre - half, centre + half) for each in (enclose, first_order.enclose))
    assert (np.isfinite(c.s) == np.isfinite(numpy.s)).all()
    known = np.isfinite(c.s)
    assert 0.1 < known.mean() < 0.9
    for name, values in vars(c).items():
        ours, theirs = (each.swapaxes(1, -1)[known] for each in (values, getattr(numpy, name)))
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12)
    assert np.isinf(c.hi[~known]).all()
    forms = Encloser(x, expressions)(centre - half, centre + half)
    middle, spread = 0.5 * (c.p + c.q), 0.5 * (c.q - c.p)
    rest = spread + c.s + 4 * ULP * (spread + np.abs(c.c) + np.abs(middle))
    for ours, theirs in zip(forms, (c.c + middle, c.a.swapaxes(0, 1), rest), strict=True):
        np.testing.assert_array_equal(ours, theirs.T)


def test_forms_hold_against_balls_of_200_bits() -> None:
    problem = problem_of("6-rus", 0.1, 20)
    entries = rank.RankTest(problem.locked, problem.z, problem.start).entries
    encloser = Encloser(problem.z, entries)
    rng = np.random.default_rng(3)
    half = problem.size * 10.0 ** rng.uniform(-9, -0.5, (8, 6))
    lower, upper = (problem.start - half).T, (problem.start + half).T
    forms: Forms = encloser(lower, upper)
    checks = 0
    for box in range(8):
        centre = 0.5 * lower[:, box] + 0.5 * upper[:, box]
        radius = np.maximum(upper[:, box] - centre, centre - lower[:, box]) * (1 + 2.0**-51)
        for end in rng.choice([-1.0, 0.3, 1.0], (3, 6)):
            point = np.clip(centre + end * (upper[:, box] - centre), lower[:, box], upper[:, box])
            exact, e = balls.in_balls(encloser.tape, point), balls.steps(point, centre, radius)
            for k, value in enumerate(exact):
                middle = balls.linear(forms.c[box, k], forms.a[box, k], e)
                assert abs(value - middle) <= balls.arb(forms.r[box, k])
                checks += 1
    assert checks > 500


@pytest.mark.parametrize("name", soaked([*(few := ("6-rss", "6-pus", "delta")), "6-rus", "spherical-3-rrr"], few))
def test_unknowns_in_closed_form_close_their_loops_where_the_limb_reaches(name: str) -> None:
    model = build_model(name)
    closed = closed_form(model)
    assert len(closed.reaches) == len(model.unknowns)
    assert not closed.model.unknowns
    typical = [value for item in model.parameters for value in item.typical]
    own = Substitution.identity(model)
    unknowns = ca.vertsplit(own.unknowns)
    first = [next(e for e in model.closure if ca.depends_on(e.expression, q)).scaled for q in unknowns]
    values = [each.values for each in closed.model.quantities if each.name == "actuator_angle"]
    q = ca.vertcat(*values) if values else closed.model.quantities[0].values
    reaches = ca.vertcat(*[each.value for each in closed.reaches])
    solved = ca.Function("q", Substitution.identity(closed.model).all, [q, reaches])
    signs = ca.vertcat(ca.SX(0, 1), *[each.value for each in model.signs if each.is_mode])
    equation = ca.Function("g", own.all, [ca.vertcat(*first), signs])
    rng, seen = np.random.default_rng(1), set()
    for _ in range(40):
        place = np.array(model.home) + rng.uniform(-1.5, 1.5, 3) * max(0.1, *map(abs, model.home))
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn = turn * np.linalg.det(turn) if name == "spherical-3-rrr" else np.eye(3)
        q, reach = (each.full().ravel() for each in solved(typical, [], turn, place))
        # Many values of each unknown: where the limb does not reach, its equation has one sign at all of them.
        tried = np.linspace(-math.pi, math.pi, 721) if values else np.linspace(-9, 9, 721)
        count = len(reach)
        residual, sign = equation(typical, np.where(reach > 0, q, 0.0), turn, place)
        many = equation(np.array(typical), np.tile(tried, (count, 1)), np.tile(turn, 721), np.tile(place[:, None], 721))
        changes = np.ptp(np.sign(many[0].full()), axis=1) > 0
        for k in range(count):
            seen.add(bool(reach[k] > 0))
            if reach[k] > 0:
                assert abs(residual.full()[k, 0]) <= 1e-9
                assert sign.full()[k, 0] > 0
            elif reach[k] < -1e-3:
                assert not changes[k]
            assert changes[k] or not reach[k] > 1e-3
    assert True in seen


@pytest.mark.parametrize("name", ["6-pus", "3-rps", "planar-3-rrr"])
def test_a_small_envelope_is_proved(name: str) -> None:
    problem = problem_of(name, 0.02, 4)
    found = prove_rank(problem, problem.locked)
    assert (found.outcome, found.open) == (Outcome.PROVED, 0)


def touching_case() -> Case:
    """LinuxCNC's hexapod, pitched so far that it is singular in its plane of symmetry, and free across it."""
    model = build_model("stewart-gough", {"layout": "octahedral"})
    values = {"x1": 26.5, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)}

    def case(pitch: float) -> Case:
        place = Workspace([0.0, Free(-1.0, 1.0), 15.0], Turns(TurnKind.ROLL_PITCH_YAW, (0.0, pitch, 0.0)))
        return Case(model, values, [0, 0, 15], [Task([0, 0, 0, 0, 0, 1])], workspace=place)

    def determinant(pitch: float) -> float:
        own = case(pitch)
        assert own.workspace is not None
        problem = build_problem(own, model, pose_box(own.workspace))
        return float(np.linalg.det(ca.Function("M", [problem.z], [ca.densify(problem.locked.matrix)])(0).full()))

    low, high = 0.2, 2.0
    sign = determinant(low)
    assert sign * determinant(high) < 0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sign * determinant(middle) > 0 else (low, middle)
    return case(low)


def test_a_wrist_does_not_translate() -> None:
    tables = starter_tables("spherical-3-rrr")
    tables["robot"]["parameters"]["radius"] = 0.1
    tables["workspace"] = {"position": [{"min": -0.02, "max": 0.02}] * 3}
    with pytest.raises(CaseError, match="this robot cannot control x and y and z"):
        judge_workspace(case_from(tables | {"limits": {}}), time_limit=20)


def test_a_determinant_that_touches_zero_is_refuted_with_the_pose() -> None:
    case = touching_case()
    judged = judge_workspace(case, with_limits=False, time_limit=0.3)
    found = judged.regularity
    assert found.outcome is Outcome.REFUTED
    assert (found.sides, found.reason) == (None, BY_NEWTON)
    pose = found.pose
    assert pose is not None
    legs = legs_of(case)
    arm = legs.platform @ pose.rotation.T
    span = pose.position + arm - legs.base
    values = np.linalg.svd(np.hstack([span, np.cross(arm, span) / 11.5]), compute_uv=False)
    assert values[-1] <= 1e-10 * values[0]
    assert judged.is_refuted


def test_singular_values_of_a_delta_are_bounded() -> None:
    model = build_model("delta")
    values = {item.name: item.typical[0] for item in model.parameters}
    case = Case(model, values, list(model.home), [Task([0, 0, 0, 0, 0, 1])])
    place = [Free(each - 0.02, each + 0.02) for each in model.home]
    box = pose_box(Workspace(place, Turns()))
    problem = build_problem(case, closed_form(model).model, box)
    points = box.random(500, np.random.default_rng(0))
    for is_condition in (False, True):
        spectrum = SingularValues(problem, 1.0, is_condition=is_condition)
        values_there = values_of(spectrum, points)
        found = smallest(spectrum, Goal(0.05 * abs(float(values_there[0]))))
        assert not found.reason
        assert found.bound <= values_there.min() + 1e-12
        assert found.value <= values_there.min() + 0.05 * abs(float(values_there[0]))
        # Small boxes about points, whose bounds hold at their corners.
        lower, upper = points - 1e-3, points + 1e-3
        bounds = bounds_of(spectrum, lower, upper)
        assert (bounds <= np.minimum(values_of(spectrum, lower), values_of(spectrum, upper))).all()


def test_the_command_proves_and_refutes_reach_constraints_and_angles(tmp_path: Path) -> None:
    def file_of(r: float) -> str:
        parameters = {"rb": 0.164, "rp": 0.044, "arm": 0.524, "rod": 1.244, "w": 0.131, "tilt": 20}
        tables = case_tables(
            {"model": "delta", "parameters": parameters},
            units={"length": "m"},
            pose={"position": [0, 0, -1.1]},
            task=[{"sense": "max", "axis": [0, 0, 1], "pitch": math.inf}],
            limits={"actuator_angle": {"min": -45, "max": 60}},
            workspace={"position": [{"min": -r, "max": r}, {"min": -r, "max": r}, -1.1]},
        )
        return str(case_file(tmp_path, tables))

    file = file_of(0.1)
    run = ran("workspace", file, "--json", "-")
    result = json.loads(run.output)
    assert run.code == 0
    assert result["proved"]
    assert result["regular"]["outcome"] == result["constraints"]["outcome"] == "proved"
    reach = [each for each in result["extremes"] if each["name"].startswith("reach")]
    assert [each["outcome"] for each in reach] == ["proved"] * 3
    assert len([each for each in result["extremes"] if each["name"].startswith("actuator_angle")]) == 6
    run = ran("workspace", file_of(1.5), "--time", "0.05")
    assert run.code == 1
    assert "reach limb 1" in run.output
    assert "NOT PROVED: a singularity" in run.output
