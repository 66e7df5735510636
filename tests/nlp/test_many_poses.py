"""The limits of an actuator over many poses: few pairs become constraints, and every pair holds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import Array, case_from

from screwsynth.nlp import Case, Solution, Status, certify, examine, formulate, json_data, result_of, solve
from screwsynth.nlp.evidence.kkt import linearise
from screwsynth.nlp.program import limits as program_limits
from screwsynth.nlp.program.pairs import with_all_pairs, with_pairs_at
from screwsynth.nlp.proof.statement.standard_form import standard_form
from screwsynth.nlp.solver.status import Phase


def case_of(
    count: int, stroke: float, *, over: str = "mean", starts: int = 4, free_legs: int = 6, sense: str = "max"
) -> Case:
    """Return a hexapod of twelve irregular joints, twelve coordinates of which are free, at several random poses."""
    numbers = np.random.default_rng(7)
    lines = ['[robot]\nmodel = "hexapod"\n[robot.parameters]']
    for i in range(6):
        for plate, radius, half in (("base", 12.0, 20), ("platform", 8.0, 45)):
            a = math.radians(120 * (i // 2) + half * (1 if i % 2 else -1))
            x, y = (radius * each + numbers.uniform(-0.5, 0.5) for each in (math.cos(a), math.sin(a)))
            free = (
                [f"{{ min = {each - 2}, max = {each + 2} }}" for each in (x, y)]
                if plate == "base" and i < free_legs
                else [x, y]
            )
            lines.append(f"{plate}_{i + 1} = [{free[0]}, {free[1]}, 0]")
    for _ in range(count):
        position = [*numbers.uniform(-6, 6, 2).tolist(), numbers.uniform(19, 21)]
        axis = [numbers.normal() for _ in range(3)]
        lines.append(
            f"[[pose]]\nposition = {position}\nrotation = {{ axis = {axis}, angle = {numbers.uniform(0, 12)} }}"
        )
    lines.append(f'[combine]\nover_poses = "{over}"\n[solve]\nstarts = {starts}')
    lines.append(f'[[task]]\nname = "drive"\nsense = "{sense}"\naxis = [2, 2, 1]\npoint = [2, 3, 6]\npitch = 1')
    lines.append(f"[limits]\nactuator = {{ dead_length = 6, stroke_max = {stroke} }}")
    return case_from("\n".join(lines), "many")


def lengths_of(solution: Solution) -> Array:
    """Return the lengths (poses, legs), from the joints and poses of a result alone."""
    result = json_data(result_of(solution))
    base, platform = (
        np.array([result["parameters"][f"{plate}_{i}"] for i in range(1, 7)]) for plate in ("base", "platform")
    )
    rows = []
    for pose in result["poses"]:
        R, p = np.array(pose["pose"]["rotation_matrix"]), np.array(pose["pose"]["position"])
        rows.append(np.linalg.norm(p + platform @ R.T - base, axis=1))
    return np.array(rows)


@pytest.mark.parametrize("over", ["mean", "worst"])
def test_few_pairs_give_the_answer_of_all_pairs(over: str, monkeypatch: pytest.MonkeyPatch) -> None:
    case = case_of(7, 4.1, over=over)
    few = solve(case)
    assert few.status is Status.OPTIMAL
    monkeypatch.setattr(program_limits, "_ALL_PAIRS", 7)
    every = solve(case)
    assert len(every.nlp.program.constraints) >= 7 * 6 * 6 * 2 > 4 * len(few.nlp.program.constraints)
    assert pytest.approx(every.F, rel=1e-9) == few.F
    np.testing.assert_allclose(few.x, every.x, atol=1e-6)
    assert few.evidence.kind is every.evidence.kind
    # The limit binds, and costs the same.
    rows = [
        next(r for r in json_data(result_of(s))["limits"] if r["key"] == "actuator.stroke_max") for s in (few, every)
    ]
    assert rows[0]["active"]
    assert rows[1]["active"]
    assert rows[0]["cost"] == pytest.approx(rows[1]["cost"], rel=1e-6)


def test_every_pair_of_25_poses_holds() -> None:
    stroke = 5.2
    solution = solve(case_of(25, stroke))
    assert solution.status is Status.OPTIMAL
    lengths = lengths_of(solution)
    strokes = np.ptp(lengths, axis=0)
    assert strokes.max() == pytest.approx(stroke, abs=1e-8)
    assert (lengths.min(axis=0) - strokes).min() >= 6 - 1e-8
    # One row for the limit tells the largest stroke, and each leg has a margin, bound or not.
    result = json_data(result_of(solution))
    row = next(each for each in result["limits"] if each["key"] == "actuator.stroke_max")
    assert row["value"] == pytest.approx(strokes.max(), rel=1e-9)
    margins = [each for each in result["margins"] if each["key"] == "actuator.stroke_max"]
    for i in range(6):
        own = [each["value"] for each in margins if f"limb {i + 1} " in each["name"]]
        assert max(own) == pytest.approx(strokes[i], rel=1e-9)
    # Few of the 2 * 6 * 25 * 24 constraints were needed.
    assert len(solution.nlp.program.constraints) < 25 * 12


def test_a_point_outside_of_a_pair_that_is_no_constraint_is_judged_infeasible() -> None:
    nlp = formulate(case_of(9, 3.0))
    assert not nlp.program.constraints
    assert linearise(nlp, nlp.start).violation == 0
    evidence = examine(nlp, nlp.start)
    assert evidence.feasibility > 1e-3
    assert any(name.startswith("actuator.stroke_max limb") for name in evidence.violated)
    whole = with_all_pairs(nlp)
    assert linearise(whole, nlp.start).violation >= evidence.feasibility
    limbs = [{name.partition(" poses")[0] for name in each.violated} for each in (evidence, examine(whole, nlp.start))]
    assert limbs[0] == limbs[1]


def test_an_impossible_stroke_is_relaxed_by_what_all_poses_need() -> None:
    solution = solve(case_of(12, 3.0, starts=2))
    assert solution.status is Status.INFEASIBLE
    (needed,) = (each for each in solution.relaxation if each.key == "actuator.stroke_max")
    enough = solve(case_of(12, needed.needed * (1 + 1e-6), starts=4))
    assert enough.status is Status.OPTIMAL
    assert solve(case_of(12, needed.needed * (1 - 1e-3), starts=2)).status is Status.INFEASIBLE


def test_a_certificate_states_every_pair() -> None:
    nlp = formulate(case_of(5, 4.0))
    from_few, from_start = (standard_form(each) for each in (with_pairs_at(nlp, [nlp.lower]), nlp))
    assert len(from_few.conditions) == len(from_start.conditions) == 2 * 6 * 5 * 4
    assert [each.name for each in from_few.conditions] == [each.name for each in from_start.conditions]


def test_the_box_of_a_case_with_pairs_is_proved() -> None:
    case = case_of(5, 3.5, free_legs=1)
    certified = certify(case, gap=1e-3)
    assert certified.is_proved
    assert certified.certificate.bound >= certified.solution.F


def test_the_program_over_many_poses_grows_linearly() -> None:
    counts = (10, 40)
    sizes = [len(solve(case_of(count, 5.3, starts=2)).nlp.program.constraints) for count in counts]
    assert sizes[1] <= 12 * 12


@pytest.mark.slow
def test_a_hundred_poses_are_solved() -> None:
    solution = solve(case_of(100, 5.3))
    assert solution.status is Status.OPTIMAL
    assert np.ptp(lengths_of(solution), axis=0).max() <= 5.3 + 1e-8


def test_a_solve_says_which_phase_it_is_in() -> None:
    seen: list[tuple[Phase, int, int]] = []
    solve(case_of(5, 1.0, starts=2), phase=lambda *row: seen.append(row))
    phases = list(dict.fromkeys(phase for phase, _, _ in seen))
    assert phases == [Phase.FORMULATING, Phase.STARTS, Phase.RELAXATION]
    assert all(0 <= done <= total for _, done, total in seen)
    assert any(done == total > 0 for phase, done, total in seen if phase is Phase.RELAXATION)
    seen.clear()
    solve(case_of(5, 12.0, starts=2), phase=lambda *row: seen.append(row))
    assert [phase for phase, _, _ in seen][-1] is Phase.EVIDENCE


def test_a_worst_case_is_not_held_back_by_the_estimate_of_its_level() -> None:
    # F of random points is far below F of joints in the corners of their ranges.
    lines = ['[robot]\nmodel = "hexapod"\n[robot.parameters]']
    free = "{ min = -100, max = 100 }"
    lines += [f"{plate}_{i} = [{free}, {free}, 0]" for plate in ("base", "platform") for i in range(1, 7)]
    lines += ["[[pose]]\nposition = [0, 0, 10]\n[[pose]]\nposition = [0, 1, 10]\n[combine]\nover_poses = 'worst'"]
    lines += ["[[task]]\nsense = 'max'\naxis = [0, 0, 1]\npoint = [0, 0, 0]\npitch = 0\n[solve]\nstarts = 2"]
    solution = solve(case_from("\n".join(lines), "wide"))
    assert solution.status is Status.OPTIMAL
    assert "level" not in [side.name for side in solution.evidence.active]

    # The worst pose by hand, of the answer and of joints in two corners of their squares.
    def worst(base: Array, platform: Array) -> float:
        values = []
        for p in ((0, 0, 10), (0, 1, 10)):
            span = np.array(p) + platform - base
            moments = np.cross(base, span / np.linalg.norm(span, axis=1)[:, None])
            values.append(float((moments[:, 2] ** 2).sum()))
        return min(values)

    state = solution.state
    assert state is not None
    plates = [np.array([state.parameters[f"{each}_{i}"] for i in range(1, 7)]) for each in ("base", "platform")]
    assert pytest.approx(worst(*plates), rel=1e-9) == solution.F
    corner = np.tile([100.0, 100, 0], (6, 1))
    assert solution.F >= worst(corner, np.tile([100.0, -100, 0], (6, 1))) > 59_000
