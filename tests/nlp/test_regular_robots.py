"""Regular poses of any robot: closed forms, forms of entries, relations of dependent coordinates, verdicts."""

import json
import math
from collections.abc import Iterator
from pathlib import Path

import casadi as ca
import flint
import numpy as np
import pytest
from builders import case_from, ran, soaked, starter_tables
from hexapods import bounds_of, smallest, values_of
from kernel_enclosures import enclose
from numpy_engine import first_order

from screwsynth.models import Substitution
from screwsynth.models.joints.closedform import closed_form
from screwsynth.nlp import Case, Free, Outcome, Task, TurnKind, Turns, Workspace, build_model, judge_workspace
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.evidence.dependent import with_dependent
from screwsynth.nlp.proof.enclosure.forms import ULP, Encloser, Forms
from screwsynth.nlp.proof.enclosure.tape import compile_tape
from screwsynth.nlp.proof.statement.machine import legs_of
from screwsynth.nlp.proof.workspace.numbers.bound_search import Goal
from screwsynth.nlp.proof.workspace.numbers.jacobian_numbers import SingularValues
from screwsynth.nlp.proof.workspace.ranks import loop_boxes
from screwsynth.nlp.proof.workspace.ranks import rank_rule as rank
from screwsynth.nlp.proof.workspace.ranks.loop_boxes import Examiner, LoopBoxes
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank
from screwsynth.nlp.proof.workspace.ranks.singular_pose import BY_NEWTON
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_model import RankMatrix
from screwsynth.nlp.proof.workspace.robot.posed_robot import Problem, build_problem

balls = pytest.importorskip("balls")

#: A robot of each kind: cranks, slides, members, parasitic motions, parallel rods, a platform in a plane.
ROBOTS = ("6-rus", "6-pus", "delta", "3-rps", "3-upu", "exechon", "tricept", "planar-3-rrr", "4-upu", "spherical-3-rrr")


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
        z[1:, own] = (
            (low + corners * (high - low))[1:, own]
            if len(own) == len(low)
            else low[own] + corners[1:] * (high - low)[own]
        )
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
def test_boxes_are_not_divided_before_the_widths_of_joints_settle(
    name: str, part: float, degrees: float, most: int
) -> None:
    # With three attempts to find these widths there were 511 and 3,029 boxes.
    problem = problem_of(name, part, degrees)
    found = prove_rank(problem, problem.locked)
    assert found.outcome is Outcome.PROVED
    assert found.boxes <= most


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
            e = [(flint.arb(float(x)) - float(c)) / float(r) for x, c, r in zip(point, centre, radius, strict=True)]
            for k, value in enumerate(balls.in_balls(encloser.tape, point)):
                middle = flint.arb(float(forms.c[box, k]))
                middle += sum((flint.arb(float(a)) * b for a, b in zip(forms.a[box, k], e, strict=True)), flint.arb(0))
                assert abs(value - middle) <= flint.arb(float(forms.r[box, k]))
                checks += 1
    assert checks > 500


@pytest.mark.parametrize(
    "name",
    soaked(["6-rss", "6-pus", "delta", "6-rus", "spherical-3-rrr"], ["6-rss", "6-pus", "delta"]),
)
def test_unknowns_in_closed_form_close_their_loops_where_the_limb_reaches(name: str) -> None:
    model = build_model(name)
    closed = closed_form(model)
    assert len(closed.reaches) == len(model.unknowns)
    assert not closed.model.unknowns
    typical = [value for item in model.parameters for value in item.typical]
    own = Substitution.identity(model)
    first = [
        next(e for e in model.closure if ca.depends_on(e.expression, q)).scaled for q in ca.vertsplit(own.unknowns)
    ]
    values = [each.values for each in closed.model.quantities if each.name == "actuator_angle"]
    q = ca.vertcat(*values) if values else closed.model.quantities[0].values
    solved = ca.Function(
        "q", Substitution.identity(closed.model).all, [q, ca.vertcat(*[e.value for e in closed.reaches])]
    )
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
    assert (found.outcome, found.engine, found.open) == (Outcome.PROVED, "c", 0)


def touching_case() -> Case:
    """LinuxCNC's hexapod, pitched so far that it is singular in its plane of symmetry, and free across it."""
    model = build_model("stewart-gough", {"layout": "octahedral"})
    values = {"x1": 26.5, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)}

    def case(pitch: float) -> Case:
        turns = Turns(TurnKind.ROLL_PITCH_YAW, (0.0, pitch, 0.0))
        return Case(
            model,
            values,
            [0, 0, 15],
            [Task([0, 0, 0, 0, 0, 1])],
            workspace=Workspace([0.0, Free(-1.0, 1.0), 15.0], turns),
        )

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
    with pytest.raises(CaseError, match="this robot cannot choose x and y and z"):
        judge_workspace(case_from(tables | {"limits": {}}), time_limit=20)


def test_a_determinant_that_touches_zero_is_refuted_with_the_pose() -> None:
    case = touching_case()
    judged = judge_workspace(case, with_limits=False, time_limit=0.3)
    found = judged.regularity
    assert found.outcome is Outcome.REFUTED
    assert (found.sides, found.reason) == (None, BY_NEWTON)
    assert found.y is not None
    pose = found.box.pose(found.y)
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


DELTA = """
[units]
length = "m"
[robot]
model = "delta"
parameters = {{ rb = 0.164, rp = 0.044, arm = 0.524, rod = 1.244, w = 0.131, tilt = 20 }}
[pose]
position = [0, 0, -1.1]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
actuator_angle = {{ min = -45, max = 60 }}
[workspace]
position = [{{ min = -{r}, max = {r} }}, {{ min = -{r}, max = {r} }}, -1.1]
"""


def test_the_command_proves_and_refutes_reach_constraints_and_angles(tmp_path: Path) -> None:
    file = tmp_path / "delta.toml"
    file.write_text(DELTA.format(r=0.1), encoding="utf-8")
    run = ran("workspace", str(file), "--json", "-")
    result = json.loads(run.out)
    assert run.code == 0
    assert result["proved"]
    assert result["regular"]["outcome"] == result["constraints"]["outcome"] == "proved"
    reach = [each for each in result["extremes"] if each["name"].startswith("reach")]
    assert [each["outcome"] for each in reach] == ["proved"] * 3
    assert len([each for each in result["extremes"] if each["name"].startswith("actuator_angle")]) == 6
    file.write_text(DELTA.format(r=1.5), encoding="utf-8")
    run = ran("workspace", str(file), "--time", "0.05")
    assert run.code == 1
    assert "reach limb 1" in run.output
    assert "refuted" in run.output
