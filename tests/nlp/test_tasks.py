"""Several tasks at once, against brute force over few variables, and against Eq. 15 by hand."""

import itertools
import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np
import pytest
from builders import Array, Run, output_of

from screwsynth.models import stewart_gough, three_upu
from screwsynth.nlp import Case, Combination, Method, PointKind, Solution, Status, Task, load_case, solve
from screwsynth.nlp.case.pose import Free, Rotation, Value
from screwsynth.nlp.errors import CaseError, EvaluationError

Objective = Callable[[Array], Array]
Word = Literal["max", "min"]

HALF = math.radians(30)
FIXED = {"x1": 12.0, "x2": 8.0, "x3": 0.4, "x4": 0.15, "p_x": 1.0, "p_y": -2.0, "p_z": 30.0, "angle": 0.1}
RANGES: dict[str, tuple[float, float]] = {"x2": (4.0, 12.0), "x4": (0.0, HALF), "p_x": (-15.0, 10.0)}
RANGES |= {"p_y": (-10.0, 15.0), "p_z": (15.0, 50.0), "angle": (-0.7, 0.5)}
NAMES = tuple(FIXED)


def values_of(x: Array, free: Sequence[str]) -> dict[str, Array]:
    return {name: x[:, free.index(name)] if name in free else np.full(len(x), FIXED[name]) for name in NAMES}


def objective_by_hand(x: Array, free: Sequence[str], twist: Array) -> Array:
    """F of the aligned 6-6 platform turned about z, for points (N, n): its leg rates written out, no screws."""
    at = values_of(x, free)
    centre = np.stack([at["p_x"], at["p_y"], at["p_z"]], axis=1)
    omega, v = twist[:3], twist[3:]
    F = np.zeros(len(x))
    for k, sign in itertools.product(range(3), (-1, 1)):
        b, a = (2 * math.pi * k / 3 + sign * at[half] for half in ("x3", "x4"))
        a = a + at["angle"]
        none = np.zeros(len(x))
        B = at["x1"][:, None] * np.stack([np.cos(b), np.sin(b), none], axis=1)
        A = centre + at["x2"][:, None] * np.stack([np.cos(a), np.sin(a), none], axis=1)
        # d|A - B| / dt while A moves with the platform.
        F += np.sum((A - B) * (v + np.cross(omega, A)), axis=1) ** 2 / np.sum((A - B) ** 2, axis=1)
    return F


def brute_force(objective: Objective, free: Sequence[str]) -> float:
    """Largest value over the box: a grid, then random points in shrinking boxes about the best places of it."""
    lower, upper = (np.array([RANGES[name][end] for name in free]) for end in (0, 1))
    count = {2: 61, 3: 21}[len(free)]
    axes = [np.linspace(*RANGES[name], count) for name in free]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(free))
    order = np.argsort(-objective(points))
    seeds: list[Array] = []
    for x in points[order[:2000]]:
        if all(np.max(np.abs(x - seed) / (upper - lower)) > 0.15 for seed in seeds):
            seeds.append(x)
        if len(seeds) == 3:
            break
    centres = np.array(seeds)
    best = objective(centres)
    generator, reach = np.random.default_rng(0), 0.1
    for _ in range(90):
        steps = reach * (upper - lower) * generator.uniform(-1, 1, (len(centres), 80, len(free)))
        tried = np.clip(centres[:, None] + steps, lower, upper)
        values = objective(tried.reshape(-1, len(free))).reshape(len(centres), 80)
        which = np.argmax(values, axis=1)
        rows = np.arange(len(centres))
        better = values[rows, which] > best
        centres[better], best = tried[rows, which][better], np.maximum(best, values[rows, which])
        reach *= 0.86
    return float(best.max())


def case_of(free: Sequence[str], tasks: Sequence[Task], method: Method = Method.AVERAGE) -> Case:
    values: dict[str, Value] = {name: Free(*RANGES[name]) if name in free else FIXED[name] for name in NAMES}
    return Case(
        model=stewart_gough(),
        parameters={name: values[name] for name in ("x1", "x2", "x3", "x4")},
        position=[values[name] for name in ("p_x", "p_y", "p_z")],
        rotation=Rotation([0, 0, 1], values["angle"]),
        tasks=list(tasks),
        method=method,
    )


def random_tasks(seed: int, senses: Sequence[Word], weights: Sequence[float]) -> list[Task]:
    generator = np.random.default_rng(seed)
    return [
        Task.screw(
            sense, axis=generator.normal(size=3), point=8 * generator.normal(size=3),
            pitch=4 * generator.normal(), name=f"task {j}", weight=weight,
        )
        for j, (sense, weight) in enumerate(zip(senses, weights, strict=True))
    ]  # fmt: skip


@dataclass(frozen=True)
class Setting:
    """One combination of variables, senses and weights."""

    free: tuple[str, ...]
    senses: tuple[Word, ...]
    weights: tuple[float, ...]
    seed: int

    def tasks(self) -> list[Task]:
        return random_tasks(self.seed, self.senses, self.weights)

    def scaled(self) -> Array:
        return np.array(self.weights) * len(self.weights) / sum(self.weights)

    @cached_property
    def twists(self) -> list[Array]:
        return [np.asarray(task.twist) for task in self.tasks()]

    def F(self, x: Array) -> Array:  # noqa: N802 - the objective's name
        return np.array([objective_by_hand(x, self.free, twist) for twist in self.twists])

    @cached_property
    def own(self) -> Array:
        signs = [1.0 if sense == "max" else -1.0 for sense in self.senses]
        signed = [partial(self._signed, sign, twist) for sign, twist in zip(signs, self.twists, strict=True)]
        return np.array([sign * brute_force(each, self.free) for sign, each in zip(signs, signed, strict=True)])

    def _signed(self, sign: float, twist: Array, x: Array) -> Array:
        return sign * objective_by_hand(x, self.free, twist)


SETTINGS = [
    Setting(("p_x", "p_y"), ("max", "max"), (1, 1), 1), Setting(("p_x", "p_y"), ("min", "min"), (1, 1), 2),
    Setting(("p_x", "p_y"), ("max", "min"), (1, 1), 3), Setting(("x2", "x4"), ("max", "max", "max"), (1, 3, 2), 4),
    Setting(("x2", "x4", "p_z"), ("min", "min"), (0.5, 1.5), 5),
    Setting(("p_x", "p_y", "angle"), ("max", "max"), (1, 2), 6),
    Setting(("p_x", "p_y", "angle"), ("min", "max", "min"), (2, 1, 3), 7),
    Setting(("p_y", "p_z", "angle"), ("min", "min", "min"), (5, 1, 1), 8),
]  # fmt: skip


def solved(setting: Setting, method: Method) -> Solution:
    return solve(case_of(setting.free, setting.tasks(), method), starts=8, jobs=1)


def combination(found: Solution) -> Combination:
    assert found.combination is not None
    return found.combination


def check_outcomes(found: Solution, setting: Setting, own: Array) -> Array:
    """Every task's F, rates, weight and loss at the combined point; returns the F by hand."""
    F = setting.F(found.x[None])[:, 0]
    for j, outcome in enumerate(found.outcomes):
        assert pytest.approx(F[j], rel=1e-11) == outcome.state.F
        assert float(outcome.state.rates @ outcome.state.rates) == pytest.approx(F[j], rel=1e-11)
        assert outcome.task.weight == pytest.approx(setting.scaled()[j], rel=1e-15)
        sign = 1 if setting.senses[j] == "max" else -1
        size = outcome.own.nlp.objective_scale
        # Brute force comes near to a task's own optimum from below; the loss is against the optimum itself.
        assert -1e-9 * size <= sign * (outcome.own.F - own[j]) <= 1e-5 * abs(own[j]) + 1e-9 * size
        assert outcome.loss == pytest.approx(sign * (outcome.own.F - F[j]), abs=1e-12 * size)
        assert outcome.loss >= -1e-9 * size
    return F


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_the_weighted_sum_is_the_best_there_is(setting: Setting) -> None:
    found = solved(setting, Method.WEIGHTED_SUM)
    assert found.status is Status.OPTIMAL
    own = setting.own
    F = check_outcomes(found, setting, own)
    mixed = len(set(setting.senses)) > 1
    counted = np.array([-1.0 if sense == "min" and mixed else 1.0 for sense in setting.senses]) * setting.scaled()
    better = -1.0 if setting.senses[0] == "min" and not mixed else 1.0
    best = better * brute_force(lambda x: better * (counted @ setting.F(x)), setting.free)
    assert combination(found).value == pytest.approx(float(counted @ F), rel=1e-11)
    assert combination(found).value is not None
    size = float(np.abs(counted) @ F)
    assert -1e-9 * size <= better * (combination(found).value - best) <= 1e-5 * size


@pytest.mark.parametrize("setting", SETTINGS, ids=str)
def test_the_worst_task_is_as_good_as_it_can_be(setting: Setting) -> None:
    found = solved(setting, Method.WORST_CASE)
    assert found.status is Status.OPTIMAL
    own = setting.own
    F = check_outcomes(found, setting, own)
    best_own = np.array([outcome.own.F for outcome in found.outcomes])
    w = setting.scaled()[:, None]

    def level(values: Array) -> Array:
        """What is to be as large as possible, from F (tasks, N)."""
        if set(setting.senses) == {"max"}:
            return np.asarray(np.min(values / w, axis=0))
        if set(setting.senses) == {"min"}:
            return np.asarray(-np.max(w * values, axis=0))
        signs = np.array([1.0 if sense == "max" else -1.0 for sense in setting.senses])[:, None]
        return np.asarray(-np.max(w * signs * (best_own[:, None] - values), axis=0))

    best = brute_force(lambda x: level(setting.F(x)), setting.free)
    sign = 1.0 if set(setting.senses) == {"max"} else -1.0
    reached = float(level(F[:, None])[0])
    assert combination(found).value is not None
    size = max(abs(best), 1e-3 * max(outcome.own.nlp.objective_scale for outcome in found.outcomes))
    assert sign * combination(found).value == pytest.approx(reached, abs=1e-8 * size)
    assert -1e-8 * size <= reached - best <= 1e-5 * size


def test_averages_of_lengths_and_of_an_angle_about_a_held_axis_are_those_of_equation_15() -> None:
    free = ("p_x", "p_y", "angle")
    tasks = random_tasks(21, ("max", "min", "max"), (1.0, 0.5, 1.5))
    alone = [solve(case_of(free, [task]), starts=12, jobs=1) for task in tasks]
    found = solve(case_of(free, tasks), starts=12, jobs=1)
    assert found.status is Status.AVERAGED
    assert combination(found).value is None
    assert combination(found).notices == ()
    assert all(outcome.unique for outcome in found.outcomes)
    by_hand = (1.0 * alone[0].x + 0.5 * alone[1].x + 1.5 * alone[2].x) / 3
    np.testing.assert_allclose(found.x, by_hand, atol=1e-12)
    assert np.max(np.abs(alone[0].x - alone[1].x)) > 0.1  # or the average would be any of them
    state = found.outcomes[0].state
    np.testing.assert_allclose([*state.position[:2], state.angle], by_hand, atol=1e-12)
    for outcome, task, solution in zip(found.outcomes, tasks, alone, strict=True):
        F = float(objective_by_hand(by_hand[None], free, np.asarray(task.twist))[0])
        assert pytest.approx(F, rel=1e-11) == outcome.state.F
        loss = solution.F - F if task.sense.value == "max" else F - solution.F
        assert outcome.loss == pytest.approx(loss, abs=1e-12 * outcome.own.nlp.objective_scale)


@pytest.mark.parametrize("method", list(Method))
@pytest.mark.parametrize("factor", [1e-9, 0.1, 1e9])
def test_only_the_proportions_of_weights_count_and_a_notice_says_so(method: Method, factor: float) -> None:
    free = ("p_x", "p_y")
    tasks = random_tasks(22, ("max", "max"), (0.5, 1.5))
    plain = solve(case_of(free, tasks, method), starts=4, jobs=1)
    scaled = [replace(task, weight=factor * task.weight) for task in tasks]
    found = solve(case_of(free, scaled, method), starts=4, jobs=1)
    assert combination(plain).notices == ()
    assert len(combination(found).notices) == 1
    assert "scaled to sum to 2, the number of tasks: 0.5, 1.5" in combination(found).notices[0]
    assert f"sum to {2 * factor:g}" in combination(found).notices[0]
    np.testing.assert_allclose(found.x, plain.x, atol=1e-9)
    assert [outcome.task.weight for outcome in found.outcomes] == pytest.approx([0.5, 1.5], rel=1e-15)


def free_axis(tasks: Sequence[Task], angle: Free) -> Case:
    return replace(case_of((), tasks), rotation=Rotation(None, angle))


@pytest.mark.parametrize("weights", [(1.0, 1.0), (0.2, 1.8), (0.5, 1.0, 1.5)], ids=str)
@pytest.mark.parametrize("largest", [0.4, 1.5])
def test_free_orientations_average_on_so3(weights: tuple[float, ...], largest: float) -> None:
    tasks = random_tasks(23, (["max", "min", "max"])[: len(weights)], weights)  # type: ignore[arg-type]
    case = free_axis(tasks, Free(-largest, largest))
    found = solve(case, starts=6, jobs=1)
    rotations = [solve(replace(case, tasks=[task]), starts=6, jobs=1).state.rotation for task in tasks]
    assert all(outcome.unique for outcome in found.outcomes)
    # The rotation nearest to the weighted mean of the matrices, by its singular values.
    mean = sum(w * R for w, R in zip(weights, rotations, strict=True))
    U, _, Vt = np.linalg.svd(mean)
    nearest = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
    state = found.outcomes[0].state
    np.testing.assert_allclose(state.rotation, nearest, atol=1e-12)
    # It is not what averaging quaternion vectors or rotation vectors would give.
    assert np.max(np.abs(rotations[0] - rotations[1])) > 0.05
    assert found.status is Status.AVERAGED
    assert combination(found).violated == ()


def test_an_average_that_turns_too_little_is_reported() -> None:
    # Rotations of at least 0.3 about any axis are no convex set: about opposite axes they average to nothing.
    tasks = random_tasks(24, ("max", "min"), (1.0, 1.0))
    found = solve(free_axis(tasks, Free(0.3, 0.5)), starts=6, jobs=1)
    state = found.outcomes[0].state
    assert state.angle < 0.3 - 1e-3
    assert found.status is Status.INFEASIBLE
    assert combination(found).violated == ("angle",)
    assert all(outcome.evidence.kind is PointKind.INFEASIBLE for outcome in found.outcomes)


COS = math.sqrt(0.75)
PARK: dict[str, Any] = {
    "base_radius": 50.0, "platform_radius": 25.0, "u1_2": [-0.5, COS, 0.0], "u1_3": [-0.5, -COS, 0.0],
}  # fmt: skip
PARK |= {"u2_2": [COS, 0.5, 0.0], "u2_3": [-COS, 0.5, 0.0]}


def couple_case(seed: int, count: int, method: Method = Method.AVERAGE) -> Case:
    """A 3-UPU with the axes of its first limb free, and turns about one point."""
    generator, direction = np.random.default_rng(seed), [Free(-1, 1)] * 3
    screw = partial(Task.screw, "max", point=[0, 0, 100], pitch=0)
    tasks = [screw(axis=generator.normal(size=3), name=f"turn {j}") for j in range(count)]
    parameters = {**PARK, "u1_1": direction, "u2_1": direction}
    return Case(three_upu(axes="free"), parameters, [0, 0, 50], tasks, method=method)


def test_averaging_breaks_orthogonality_and_that_is_reported() -> None:
    found = solve(couple_case(3, 3), starts=4, jobs=1)
    assert found.status is Status.INFEASIBLE
    assert not found.status.is_answer
    assert combination(found).violated == ("u1_1 . u2_1",)
    first, second = found.x[:3], found.x[3:]
    assert abs(float(first @ second)) > 1e-3
    # The directions themselves are unit vectors, along the mean of the tasks' own.
    for own, mean in ((slice(0, 3), first), (slice(3, 6), second)):
        total = np.sum([outcome.x[own] for outcome in found.outcomes], axis=0)
        np.testing.assert_allclose(mean, total / np.linalg.norm(total), atol=1e-14)
    for outcome in found.outcomes:
        assert outcome.evidence.kind is PointKind.INFEASIBLE
        assert outcome.state is not None
        assert math.isfinite(outcome.loss)


@pytest.mark.parametrize("method", [Method.WEIGHTED_SUM, Method.WORST_CASE])
def test_one_program_for_all_tasks_keeps_what_averaging_breaks(method: Method) -> None:
    case = couple_case(3, 2, method)
    found = solve(case, starts=4, jobs=1)
    assert found.status is Status.OPTIMAL
    assert combination(found).violated == ()
    first, second = found.x[:3], found.x[3:]
    assert abs(float(first @ second)) < 1e-12
    # One couple u and two tasks; the fixed rest of F is the same for all u. Scan the sphere.
    u = np.cross(first, second)
    omegas = np.array([np.asarray(task.twist)[:3] for task in case.tasks])
    rest = np.array([outcome.F for outcome in found.outcomes]) - (omegas @ u) ** 2
    z, t = np.meshgrid(np.linspace(-1, 1, 401), np.linspace(0, 2 * math.pi, 801))
    sphere = np.stack([np.sqrt(1 - z**2) * np.cos(t), np.sqrt(1 - z**2) * np.sin(t), z], axis=-1).reshape(-1, 3)
    values = rest + (sphere @ omegas.T) ** 2
    combined = values.sum(axis=1) if method is Method.WEIGHTED_SUM else values.min(axis=1)
    assert combination(found).value is not None
    assert combination(found).value >= combined.max() - 1e-9
    # The grid's steps are 1/200 and 1/127; a kink loses a step's length times a slope of at most 2.
    assert combination(found).value <= combined.max() + (1e-3 if method is Method.WEIGHTED_SUM else 2e-2)


@pytest.mark.parametrize("method", list(Method))
def test_the_peg_in_hole_robot_serves_both_of_its_tasks_in_full(method: Method) -> None:
    found = solve(replace(load_case("paper-4.2"), method=method), starts=8, jobs=1)
    assert found.status is (Status.AVERAGED if method is Method.AVERAGE else Status.OPTIMAL)
    x1, x2, x3, x4 = found.x
    # F of the push falls by the square of these differences over the height of 40: 6e-9 of 6 is some 1e-4 of x1 - x2.
    assert x1 == pytest.approx(x2, abs=1e-4)
    assert x3 == pytest.approx(x4, abs=1e-6)
    push, turn = found.outcomes
    assert pytest.approx(6, rel=1e-11) == push.state.F
    assert turn.state.F < 1e-10
    assert not push.unique
    assert not turn.unique
    assert sum("is not unique" in notice and "nearest" in notice for notice in combination(found).notices) == 2
    # The member that was used is one and the same, on both optimal sets.
    np.testing.assert_allclose(push.x, turn.x, atol=1e-7)
    assert turn.x[2] == pytest.approx(turn.x[3], abs=1e-9)
    assert push.x[0] == pytest.approx(push.x[1], abs=1e-6)


TURN = Task.screw("min", axis=[0, 0, 1], point=[0, 0, 0], pitch=0, name="turn")


def peg(parameters: dict[str, Any], tasks: Sequence[Task]) -> Case:
    return replace(load_case("paper-4.2"), parameters=parameters, tasks=list(tasks), method=Method.AVERAGE)


#: Half angles of unequal ranges, so that half ranges are no multiple of radians.
ANGLES: dict[str, Any] = {"x3": Free(0, HALF), "x4": Free(0, HALF / 2)}


@pytest.mark.parametrize(
    "radii",
    [{"x1": 6.0, "x2": 5.0}, {"x1": Free(5, 6), "x2": 5.0}, {"x1": Free(2, 6), "x2": Free(3, 9)}],
    ids=["angles only", "one radius", "both radii"],
)
def test_the_member_nearest_to_the_others_is_the_orthogonal_projection(radii: dict[str, Any]) -> None:
    # The turn about z meets no resistance wherever x3 = x4, whatever the radii: its moment arms are
    # x1 x2 sin(x4 - x3) / length. The other task has one optimum.
    skew = Task.screw("min", axis=[1, 2, 3], point=[3, -2, 5], pitch=2, name="skew")
    found = solve(peg({**radii, **ANGLES}, [TURN, skew]), starts=8, jobs=1)
    turn, other = found.outcomes
    assert other.unique
    assert not turn.unique
    assert abs(float(other.x[-1] - other.x[-2])) > 0.05
    # Half ranges: 15 and 7.5 degrees. Nearest t to (x3, x4): minimise (t - x3)^2 / 15^2 + (t - x4)^2 / 7.5^2.
    t = (other.x[-2] + 4 * other.x[-1]) / 5
    assert 0 <= t <= HALF / 2
    expected = [*other.x[:-2], t, t]
    scale = np.asarray(turn.own.nlp.scale)
    np.testing.assert_allclose(turn.x / scale, expected / scale, atol=1e-5)
    np.testing.assert_allclose(found.x, (turn.x + other.x) / 2, atol=1e-14)
    assert [notice for notice in combination(found).notices if "not unique" in notice] == [
        "the optimum of 'turn' is not unique: the optimum nearest to the other tasks' optima was used"
    ]


def same_but_for_order(case: Case, orders: Iterable[Sequence[Task]], starts: int, atol: float) -> None:
    points = []
    for order in orders:
        found = solve(replace(case, tasks=list(order)), starts=starts, jobs=1)
        assert [outcome.task.name for outcome in found.outcomes] == [task.name for task in order]
        points.append(found.x)
    scale = found.outcomes[0].own.nlp.scale
    for x in points[1:]:
        np.testing.assert_allclose(x / scale, points[0] / scale, atol=atol)


@pytest.mark.parametrize("method", list(Method))
def test_the_order_of_tasks_does_not_matter(method: Method) -> None:
    tasks = random_tasks(25, ("max", "min", "max"), (1.0, 2.0, 0.5))
    # F is flat at an optimum: a scaled stationarity of 1e-7 leaves 1e-6 or so of the point.
    same_but_for_order(case_of(("p_x", "p_y", "angle"), tasks, method), itertools.permutations(tasks), 4, 1e-6)


def test_the_order_of_tasks_does_not_matter_to_an_average_of_optimal_sets() -> None:
    # Three tasks, none with one optimum: x1 = x2 and x3 = x4, or x3 = x4 alone.
    side = Task.screw("min", axis=[1, 0, 0], pitch=math.inf, name="side")
    tasks = [load_case("paper-4.2").tasks[0], TURN, side]
    same_but_for_order(peg({"x1": Free(2, 6), "x2": Free(3, 9), **ANGLES}, tasks), [tasks, tasks[::-1]], 6, 1e-5)


def test_one_task_alone_has_one_outcome_and_no_combination() -> None:
    found = solve(case_of(("p_x",), random_tasks(26, ("max",), (1.0,))), starts=4)
    assert found.combination is None
    (outcome,) = found.outcomes
    assert (outcome.loss, outcome.unique) == (0.0, True)
    assert outcome.F == found.F == outcome.own.F
    for name in ("state", "evidence", "starts", "optima", "nlp"):
        assert getattr(found, name) is getattr(outcome.own, name)
    assert found.decided_by is outcome.own


@pytest.mark.parametrize("method", list(Method))
def test_the_answer_to_several_tasks_has_no_single_objective(method: Method) -> None:
    found = solve(case_of(("p_x",), random_tasks(26, ("max", "min"), (1.0, 1.0)), method), starts=4)
    with pytest.raises(EvaluationError, match="several tasks"):
        _ = found.F
    assert found.state is found.outcomes[0].state
    assert found.decided_by is combination(found).combined
    if method is Method.AVERAGE:
        assert found.evidence is None
        for name in ("nlp", "starts", "optima", "relaxation"):
            with pytest.raises(EvaluationError, match="no combined program"):
                getattr(found, name)
    else:
        assert found.evidence is found.decided_by.evidence
        assert found.starts == found.decided_by.starts


@pytest.mark.parametrize("method", list(Method))
def test_nothing_free_is_refused(method: Method) -> None:
    with pytest.raises(CaseError, match="no free variable"):
        solve(case_of((), random_tasks(26, ("max", "min"), (1.0, 1.0)), method))


@pytest.mark.parametrize("weight", [0.0, -1.0, math.nan, math.inf])
def test_a_weight_that_is_not_positive_is_refused(weight: float) -> None:
    with pytest.raises(CaseError, match=r"task\[1\]\.weight.*positive"):
        case_of(("p_x",), random_tasks(26, ("max", "min"), (1.0, weight)))


def test_the_command_line_writes_tasks_and_their_combination_as_strict_json(cli: Run) -> None:
    result = json.loads(output_of(cli("solve", "paper-4.2", "--json", "-", "--starts", "4")))
    json.dumps(result, allow_nan=False)
    assert result["status"] == "averaged"
    assert [task["status"] for task in result["tasks"]] == ["optimal", "optimal"]
    assert [task["F"] for task in result["tasks"]] == pytest.approx([6, 0], abs=1e-11)
    assert [task["task"]["name"] for task in result["tasks"]] == ["push along the normal", "turn about the normal"]
    assert result["tasks"][0]["task"]["pitch"] == "inf"
    combined = result["combined"]
    assert (combined["method"], combined["value"], combined["violated"]) == ("average", None, [])
    assert (len(combined["notices"]), combined["rank"]) == (2, 3)
    assert [task["F"] for task in combined["tasks"]] == pytest.approx([6, 0], abs=1e-11)
    assert [task["unique"] for task in combined["tasks"]] == [False, False]
    assert combined["parameters"]["x3"] == pytest.approx(15, abs=1e-6)
    assert combined["parameters"]["x1"] == pytest.approx(combined["parameters"]["x2"], abs=1e-6)
