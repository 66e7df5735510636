"""Parts of searches and proofs: branch and bound, symmetries, signs, rules that must hold, a missing kernel."""

import json
import math
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from builders import Run, edited, output_of, refusal_of, saved, unbroken
from casadi import SX
from limb_cases import machine

from screwsynth.models import Dimension, hexapod
from screwsynth.nlp import Case, Free, Nlp, Sense, Task, formulate, judge_workspace, largest_scale, load_case
from screwsynth.nlp.case.limits.constraint import BoundedConstraint, Constraint, Reading
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.errors import InputError, UncoveredError
from screwsynth.nlp.program.layout import assemble, lay_out
from screwsynth.nlp.proof.boxes import search as boxes_search
from screwsynth.nlp.proof.boxes.engine import Engine
from screwsynth.nlp.proof.boxes.search import TOO_SMALL, WHOLE, Boxes, BoxResults, Effort, Order, Rule, Search, some
from screwsynth.nlp.proof.boxes.symmetry import grouped, halved, mirrors
from screwsynth.nlp.proof.boxes.tree import TreeRecord
from screwsynth.nlp.proof.certificate import branch_and_bound
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.premises import fingerprint
from screwsynth.nlp.proof.checker.proof_file import ProofClaim
from screwsynth.nlp.proof.checker.tree import Node
from screwsynth.nlp.proof.statement.fixed_robot import Legs
from screwsynth.nlp.proof.statement.form import without_ties
from screwsynth.nlp.proof.statement.limb_separation import separate
from screwsynth.nlp.proof.statement.signs import is_nowhere_positive
from screwsynth.nlp.proof.statement.standard_form import Condition, StandardForm, standard_form
from screwsynth.nlp.proof.workspace.ranks import ranks
from screwsynth.nlp.proof.workspace.ranks.loop_boxes import Examiner
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import build_problem
from screwsynth.nlp.proof.workspace.slices.slices import slices_of
from screwsynth.nlp.proof.workspace.verdict import Outcome
from screwsynth.nlp.solver.certified import certify, proof_of


class Peak(Rule[np.ndarray]):
    """The largest value of ``1 - |x - 0.3| - |y - 0.6|``; boxes carry how often they were bisected."""

    top = np.array([0.3, 0.6])
    block = 8

    def __init__(self, gap: float) -> None:
        self.gap, self.seen = gap, list[np.ndarray]()

    def divided(self, boxes: Boxes[np.ndarray]) -> Boxes[np.ndarray]:
        parts = boxes_search.bisected(boxes)
        return parts._replace(more=parts.more + 1)

    def examine(self, boxes: Boxes[np.ndarray]) -> BoxResults[np.ndarray]:
        nearest = np.clip(self.top, boxes.lower, boxes.upper)
        width = boxes.upper - boxes.lower
        bound = 1 - np.abs(nearest - self.top).sum(axis=1) + width.sum(axis=1)
        done = bound <= 1 + self.gap
        self.seen.append(np.hstack([boxes.lower, boxes.upper])[done])
        found = boxes._replace(bound=bound, split=np.argmax(width, axis=1))
        closed = float(bound[done].max(initial=-math.inf))
        return BoxResults(some(found, ~done), closed, len(bound))


def search_of(rule: Peak, order: Order, least: float = 0.0) -> Search[Peak]:
    root = Boxes(np.zeros((1, 2)), np.ones((1, 2)), np.array([math.inf]), np.array([WHOLE]), np.zeros(1))
    return Search(rule, root, whole=np.ones(2), least=(least, least), order=order)


@pytest.mark.parametrize("order", Order)
def test_every_order_closes_the_same_boxes_which_cover_the_whole(order: Order) -> None:
    rule, same = Peak(0.02), Peak(0.02)
    search, other = search_of(rule, order), search_of(same, Order.NEWEST)
    assert Effort().run(search, lambda: None) == Effort().run(other, lambda: None) == ""
    closed, expected = (np.concatenate(each.seen) for each in (rule, same))
    assert {tuple(each) for each in closed.tolist()} == {tuple(each) for each in expected.tolist()}
    assert (closed[:, 2:] - closed[:, :2]).prod(axis=1).sum() == 1.0
    assert search.boxes == 2 * len(closed) - 1
    assert 1.0 <= search.bound <= 1.02
    assert (search.left, search.is_open) == (0, False)


def test_boxes_that_are_too_small_and_those_of_a_search_that_ends_keep_their_bound() -> None:
    search = search_of(Peak(1e-9), Order.LARGEST_CHUNK)
    assert Effort(most_boxes=100).run(search, lambda: None) == f"stopped after {search.boxes} boxes"
    left = [each.upper - each.lower for each in search.state.left]
    assert search.bound >= 1.0
    assert sum(float(each.prod(axis=1).sum()) for each in left) < 1.0
    search = search_of(Peak(0.0), Order.LARGEST, least=2.0**-6)
    assert Effort().run(search, lambda: None if search.is_open else TOO_SMALL) == TOO_SMALL
    assert search.left
    assert not search.state.waiting
    small = boxes_search.joined(search.state.small)
    assert (small.split == boxes_search.SMALL).all()
    assert small.bound.max() == search.bound > 1.0
    assert ((small.upper - small.lower).max(axis=1) < 2.0**-6).all()
    # Each carries how often it was bisected, which its size tells.
    assert (2.0**-small.more == (small.upper - small.lower).prod(axis=1)).all()


class Better(Peak):
    """Finds a better point once, after boxes became too small."""

    found = False

    def examine(self, boxes: Boxes[np.ndarray]) -> BoxResults[np.ndarray]:
        verdicts = super().examine(boxes)
        is_last = not self.found and len(verdicts.left.split) == 1
        self.found |= is_last
        self.gap = 1.0 if self.found else self.gap
        return verdicts._replace(is_better=is_last)


def test_boxes_that_are_too_small_are_examined_again_once_a_better_point_is_known() -> None:
    search = search_of(Better(0.0), Order.NEWEST, least=2.0**-2)
    assert Effort().run(search, lambda: None) == ""
    assert search.rule.found
    assert search.left == 0


@cache
def base_form() -> StandardForm:
    return standard_form(formulate(load_case("paper-4.1-helical")))


def form_of(
    function: Callable[[SX], SX], limit: Callable[[SX], SX] | None = None, equation: Callable[[SX], SX] | None = None
) -> StandardForm:
    """A form of three variables between -1 and 1."""
    x = SX.sym("x", 3)
    pairs = (("limit", limit, False), ("equation", equation, True))
    conditions = tuple(Condition(name, each(x), exact) for name, each, exact in pairs if each is not None)
    ends = np.full(3, -1.0), np.full(3, 1.0)
    stated = {"functions": (function(x),), "conditions": conditions}
    return replace(base_form(), x=x, lower=ends[0], upper=ends[1], **stated)


@pytest.mark.parametrize(
    ("function", "limit", "equation", "found"),
    [
        (lambda x: x[0] ** 2 + ca.cos(x[1]) * x[2], None, None, [(0,), (1,)]),
        (lambda x: (x[0] * x[1]) ** 2 + x[2], None, None, [(0,), (1,)]),
        (lambda x: x[0] * x[1] + ca.sin(x[2]) * x[0], None, None, [(0, 1, 2)]),
        (lambda x: ca.atan(x[0]) / x[1] + x[2] ** 2, lambda x: x[2], None, [(0, 1)]),
        (lambda x: x[0] ** 2 + x[1] ** 2 + x[2] ** 2, None, lambda x: x[0] + x[1], [(0, 1), (2,)]),
        (lambda x: x[0] ** 2 + x[1] ** 2 + x[2] ** 2, None, lambda x: x[0] + x[1] - 0.5, [(2,)]),
        (lambda x: (x[0] + 0.1) ** 2 + ca.exp(x[1]) + ca.sqrt(x[2] + 2), None, None, []),
        (lambda x: ca.fmax(x[0], 0) + x[1] ** 3, None, None, [(2,)]),
    ],
)
def test_mirrors_are_those_of_a_graph(
    function: Callable[[SX], SX],
    limit: Callable[[SX], SX] | None,
    equation: Callable[[SX], SX] | None,
    found: list[tuple[int, ...]],
) -> None:
    form = form_of(function, limit, equation)
    assert mirrors(form) == found
    half = halved(form)
    assert [i for i in range(3) if half.lower[i] == 0] == [each[0] for each in found]
    # A variable whose bounds are not opposite numbers changes no sign.
    uneven = replace(form, upper=np.array([2.0, 1.0, 1.0]))
    assert all(0 not in each for each in mirrors(uneven))


def random_graph(rng: np.random.Generator, x: SX) -> SX:
    """A random expression, in which mirrors are frequent and others than those of single variables occur."""
    values = [x[i] for i in range(x.numel())]
    unary = [ca.sin, ca.cos, ca.atan, lambda v: v * v, lambda v: -2 * v, ca.exp, ca.fabs, lambda v: v + 0.5]
    for _ in range(int(rng.integers(2, 9))):
        a, b = (values[int(rng.integers(len(values)))] for _ in range(2))
        kind = int(rng.integers(12))
        new = a * b if kind < 3 else a + b if kind == 3 else a / b if kind == 4 else unary[int(rng.integers(8))](a)
        values.append(new)
    return values[-1]


def test_a_mirror_changes_no_value_and_its_half_reaches_every_point() -> None:
    rng, kinds = np.random.default_rng(0), set()
    for _ in range(150):
        seed = int(rng.integers(2**31))
        form = form_of(*(lambda x, s=seed + k: random_graph(np.random.default_rng(s), x) for k in range(3)))
        found = mirrors(form)
        kinds |= {len(each) for each in found}
        values = ca.Function("f", [form.x], [form.functions[0], *(each.expression for each in form.conditions)]).map(20)
        points = rng.uniform(-1, 1, (3, 20))
        before = [each.full() for each in values(points)]
        half, moved = halved(form), points.copy()
        for each in found:
            # The first variable of each is in no other one, so the others do not undo it.
            moved[np.array(each)[:, None], moved[each[0]] < 0] *= -1
        after = [each.full() for each in values(moved)]
        assert (moved >= half.lower[:, None]).all()
        for name, one, other in zip(("F", "limit", "equation"), before, after, strict=True):
            sizes = (np.abs(one), np.abs(other)) if name == "equation" else (one, other)
            np.testing.assert_allclose(*sizes, rtol=1e-12)
    assert kinds == {1, 2, 3}


def test_copies_have_the_same_maximum_and_others_are_no_copies() -> None:
    form = standard_form(formulate(load_case("paper-4.4-max")))
    found = separate(form)
    forms = [each.form for each in found.limbs]
    assert grouped(forms) == [[0, 1, 2]]
    x = np.random.default_rng(0).uniform(-1, 1, 6)
    assert len({each.value_at(x) for each in forms}) == 1
    narrow = replace(forms[1], upper=0.5 * forms[1].upper)
    other = replace(forms[2], functions=(1.5 * forms[2].functions[0],))
    loose = replace(forms[0], conditions=forms[0].conditions[1:])
    assert grouped([forms[0], narrow, forms[1], other, loose]) == [[0, 2], [1], [3], [4]]
    legs = separate(standard_form(formulate(machine(2.0))))
    assert all(len(each) == 1 for each in grouped([each.form for each in legs.limbs]))


def test_symmetries_leave_the_bound_of_the_paper(monkeypatch: pytest.MonkeyPatch) -> None:
    """Section 4.4: three mirrors of each limb, and three limbs that are copies: at least a tenth of the boxes."""
    nlp = formulate(load_case("paper-4.4-min"))
    found = certify_program(nlp, gap=1e-4)
    assert found.status is CertificateStatus.PROVED
    # The optimum is in another half too, which a point of the box shows that is no point of the half.
    form = standard_form(nlp)
    assert len(mirrors(form)) == 9
    flipped = found.x.copy()
    for each in mirrors(form):
        flipped[list(each)] *= -1
    assert form.value_at(flipped) == pytest.approx(form.value_at(found.x), abs=1e-12)
    again = certify_program(nlp, flipped, gap=1e-4)
    assert again.status is CertificateStatus.PROVED
    monkeypatch.setattr(branch_and_bound, "halved", lambda form: form)
    whole = certify_program(nlp, gap=1e-2)
    assert abs(whole.bound - found.bound) < 1e-6
    assert whole.boxes > 3 * found.boxes


# Legs in the plane of the platform at z = 0 do not resist the motion along z: F is 0 there, and positive elsewhere.
UP = """
units.length = "cm"
robot = { model = "stewart-gough", layout = "aligned", parameters = { x1 = 12, x2 = 4, x3 = 30, x4 = 20 } }
pose.position = [0, 0, 10]
task = [{ name = "up", sense = "min", axis = [0, 0, 1], pitch = inf }]
workspace.position = [{ min = -1, max = 1 }, 0, { min = -3, max = 3 }]
"""


def test_signs_of_expressions_hold_at_random_points() -> None:
    rng = np.random.default_rng(5)
    points, known = rng.normal(size=(3, 2000)), 0
    unary = (ca.fabs, ca.sqrt, ca.exp, lambda a: a * a, lambda a: a**2, lambda a: -a, ca.sin, lambda a: 1 / a)
    plain = (lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / b)
    binary = (*plain, ca.fmax, ca.fmin)
    for _ in range(400):
        x = SX.sym("x", 3)
        terms = [*ca.vertsplit(x), SX(float(rng.normal())), SX(0)]
        for _ in range(6):
            a, b = (terms[k] for k in rng.integers(len(terms), size=2))
            terms.append(unary[rng.integers(len(unary))](a))
            terms.append(binary[rng.integers(len(binary))](terms[-1], b))
        if is_nowhere_positive(terms[-1], x):
            known += 1
            with np.errstate(all="ignore"):
                values = ca.Function("f", [x], [ca.densify(terms[-1])])(points).full()
            assert not (values > 0).any(), terms[-1]
    assert known > 40


def test_a_proven_bound_of_a_sum_of_squares_is_not_below_zero(tmp_path: Path, cli: Run) -> None:
    case, proof, result = saved(tmp_path / "case.toml", UP), tmp_path / "p.json", tmp_path / "r.json"
    status, out, _ = cli("workspace", str(case), "--json", str(result), "--proof", str(proof))
    assert status == 1  # J is singular where F is 0
    assert "F  0 .. 0.7338" in out
    extremes = json.loads(result.read_text())["extremes"]
    (least,) = (each for each in extremes if (each["name"], each["sense"]) == ("F", "min"))
    assert (str(least["bound"]), least["reached"], least["outcome"], least["unit"]) == ("0.0", 0, "proved", "(cm/cm)²")
    words = output_of(cli("verify-proof", str(proof), str(case)))
    assert "F: at least 0 (cm/cm)²" in words
    assert "F: at most 0.7338" in words
    # The file claims what the boxes show, which is below 0.
    assert any(each["name"] == "F" and each["bound"] > 0 for each in json.loads(proof.read_text())["claims"])
    case = saved(tmp_path / "free.toml", edited(UP, ("[0, 0, 10]", "[0, 0, { min = -3, max = 5 }]")))
    out = output_of(cli("certify", str(case), "--json", str(result), "--proof", str(proof)))
    assert "has F smaller than 0;" in unbroken(out)
    assert str(json.loads(result.read_text())["certificate"]["bound"]) == "0.0"
    words = unbroken(output_of(cli("verify-proof", str(proof), str(case))))
    assert "F is at least 0 (cm/cm)² within the limits" in words


NUMBER = Reading(Dimension.NUMBER)


def test_derivatives_with_kinks_are_those_of_casadi_off_the_kinks() -> None:
    """A node of CasADi's that nothing holds gives its address to another, which must not pass for a comparison."""
    rng = np.random.default_rng(0)
    x = SX.sym("x", 4)
    errors = []
    for _ in range(150):

        def term() -> SX:
            i, j = (int(k) for k in rng.integers(4, size=2))
            return (x[i] * x[j], ca.fmax(x[i] * x[j], 0.3), ca.fmin(x[i], 0.1), ca.fmax(x[i], -0.2))[rng.integers(4)]

        slopes = ca.jacobian(ca.vertcat(*[term() * term() + term() + term() + term() for _ in range(2)]), x)
        errors.append(ca.sumsqr(slopes - without_ties(slopes, x)))
    points = np.random.default_rng(5).uniform(-1, 1, (4, 20))
    found = ca.Function("errors", [x], [ca.vertcat(*errors)]).map(20)(points).full()
    assert found.max() < 1e-20


def two_numbers(objective: Callable[[SX, SX], SX], limit: Callable[[SX, SX], SX] | None = None) -> Nlp:
    """Return the minimisation of an objective of two numbers from -3 to 3, with another number of at least a half."""
    rng = np.random.default_rng(0)
    points = {f"{end}_{leg + 1}": rng.normal(size=3).tolist() for end in ("base", "platform") for leg in range(6)}
    task = load_case("hexapod-machining").tasks[0]
    layout = lay_out(Case(hexapod(), points, [Free(-3.0, 3.0), Free(-3.0, 3.0), 20.0], [task]), [task])
    x, y = ca.vertsplit(layout.table.variables_vector)
    limits = [] if limit is None else [BoundedConstraint(Constraint("limit", limit(x, y), NUMBER), 0.5, math.inf)]
    return assemble(layout, objective(x, y), Sense.MIN, limits)


def test_parts_of_a_claim_by_limbs_add_up() -> None:
    """The first limb is closed while the second is far from its best: together they need more than the claim has."""
    nlp = two_numbers(lambda x, y: -2 * ca.exp(-((50 * (x - 0.737)) ** 2)) + y**2)
    start = np.array([2.5, 3.0])
    found = certify_program(nlp, start, above=-1.0)
    assert found.status is CertificateStatus.REFUSED
    recorder = TreeRecord()
    found = certify_program(nlp, start, above=-2.1, recorder=recorder)
    assert found.status is CertificateStatus.PROVED
    assert -2.1 < found.bound <= -2
    proof = ProofClaim("none", "", "program", -found.bound, fingerprint(nlp), recorder.tree())
    assert check_proof(proof, nlp).bound == -found.bound


def test_boxes_closed_by_a_claim_say_nothing_of_limits() -> None:
    """No start reaches the one place that keeps the limit, and every box has F above the claim all the same."""
    nlp = two_numbers(
        lambda x, y: (x + y) ** 2 + x * y + 20,
        lambda x, y: ca.exp(-((200 * (x - 0.737)) ** 2)) * ca.exp(-((200 * (y - 0.211)) ** 2)),
    )
    found = certify_program(nlp, above=0.0)
    assert found.x is None
    assert found.status is CertificateStatus.PROVED
    assert found.statement.startswith("proved: F is above 0 on the whole box within the limits")


@pytest.mark.parametrize("jump", [lambda x: x >= 0, ca.sign], ids=["comparison", "sign"])
def test_a_value_that_jumps_has_no_rule(jump: Callable[[SX], SX]) -> None:
    """Its derivative is written as 0, and so a search along rising values would step over the place of the optimum."""
    nlp = two_numbers(lambda x, y: 10 * jump(x) - x + (x + y) ** 2)
    with pytest.raises(UncoveredError, match="the robot's expressions contain the"):
        certify_program(nlp, np.array([2.9, -1.0]))
    with pytest.raises(UncoveredError):
        check_proof(ProofClaim("none", "", "program", 0.0, fingerprint(nlp), bytes([Node.BOUNDED])), nlp)


@pytest.mark.parametrize("place", ["examine", "branch"])
def test_an_interrupt_of_python_proves_no_regular_poses(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rng, model = np.random.default_rng(0), hexapod()
    legs = Legs(rng.normal(size=(6, 3)), rng.normal(size=(6, 3)))
    given = {f"{plate}_{i + 1}": getattr(legs, plate)[i].tolist() for plate in ("base", "platform") for i in range(6)}
    case = Case(model, given, [0.0, 0.0, 0.0], [Task([0, 0, 0, 0, 0, 1])])
    turns = Turns(TurnKind.ANY_AXIS, (Free(0.0, 0.5),))
    box = pose_box(Workspace((Free(-1.0, 1.0), Free(-1.0, 1.0), Free(3.0, 4.0)), turns))

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    target, name = (ranks.RankRule, "divided") if place == "branch" else (Examiner, "examine")
    monkeypatch.setattr(target, name, interrupt)
    # The poses of opposite signs that are known before a box is bisected would refute the claim, as they should.
    problem = build_problem(case, model, box)
    found = ranks.prove_rank(problem, problem.locked, look=lambda *_: None)
    assert found.outcome is Outcome.OPEN
    assert found.reason == "interrupted"


SENTENCE = "proofs are not available: the C kernel was not built when the package was installed; install a C compiler"
HELICAL = "paper-4.1-helical-axis-z"
GOALS = ("--goal", "max F:push along the normal", "--goal", "min F:turn about the normal")


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
        ("pareto", "paper-4.2", *GOALS, "--certify", "--csv", "out.csv"),
        ("compare", HELICAL, "case", "hexapod", "--certify", "--json", "out.json"),
    ],
    ids=lambda command: " ".join(command[:3]),
)
def test_what_proves_something_says_what_is_missing(command: tuple[str, ...], without_kernel: Path, cli: Run) -> None:
    refusal_of(cli(*command), SENTENCE, "pip install")
    assert not os.listdir(without_kernel)


@pytest.mark.usefixtures("without_kernel")
def test_functions_that_prove_something_raise_an_input_error() -> None:
    case, machine = load_case(HELICAL), load_case("hexapod-linuxcnc")
    nlp = formulate(case)
    proving: tuple[Callable[[], object], ...] = (
        lambda: certify(case), lambda: certify_program(nlp), lambda: judge_workspace(machine),
        lambda: largest_scale(machine), lambda: slices_of(machine),
        lambda: slices_of(load_case("reachy-mini-envelope")),
    )  # fmt: skip
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
