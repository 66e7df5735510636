"""Assemblies and working modes of points and certificates; cases that leave nothing free; poses free one by one."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from builders import (
    EACH_KIND,
    Array,
    Run,
    case_file,
    case_from,
    case_of,
    case_tables,
    output_of,
    ran,
    saved,
    starter,
    turn_about,
    unbroken,
)
from measures import circle_joints

from screwsynth.models import Model, robot_function
from screwsynth.models.linalg import least_squares, nonnegative_least_squares
from screwsynth.nlp import (
    Case,
    CertificateStatus,
    Free,
    Nlp,
    Rotation,
    Search,
    Status,
    Task,
    formulate,
    json_data,
    result_of,
    solve,
)
from screwsynth.nlp.evidence.assembly import NEAR_SINGULAR, assembly_of, assembly_over_poses
from screwsynth.nlp.evidence.closing import closed_in_place, closed_start
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.state import evaluate, loops_are_closed
from screwsynth.nlp.evidence.workingmode import _about, turned_over_poses
from screwsynth.nlp.program.blocks import Blocks
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.proof_file import ProofError
from screwsynth.nlp.proof.statement.standard_form import Kind, is_in_home_mode, standard_form
from screwsynth.nlp.solver.certified import certify, proof_of
from screwsynth.nlp.words.lines import starts_lines

TASK = Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]))


def typical(model: Model) -> dict[str, float]:
    return {item.name: item.typical[0] for item in model.parameters}


def free_pose(name: str, reach: float, turn: float = 2.0) -> Case:
    """The gallery's robot with the pose free about home."""
    model = robot_function(name)()
    position = [Free(value - reach, value + reach) for value in model.home]
    return Case(model, typical(model), position, [TASK], Rotation(None, Free(-turn, turn)))


def test_an_elbow_on_the_other_side_is_another_assembly() -> None:
    nlp = formulate(free_pose("6-rus", 0.3))
    x = closed_start(nlp)
    here = assembly_of(nlp, x, evaluate(nlp, x))
    assert here.is_home
    assert here.nearness == pytest.approx(1)
    assert here.sentences == ()
    state = evaluate(nlp, x)
    away = assembly_of(nlp, x, replace(state, position=state.position + 100))
    assert not away.is_home
    (own,) = nlp.program.places.unknowns
    other = x.copy()
    other[own[2]] += math.radians(110)  # beyond the crank's other position
    other = close_equations(nlp, other)
    assert np.abs(other - x).max() > 0.5
    assert loops_are_closed(nlp, other)
    found = assembly_of(nlp, other, evaluate(nlp, other))
    assert not found.is_home
    assert found.turned == ("3",)
    assert found.nearness > NEAR_SINGULAR
    assert [each.partition(":")[0] for each in found.sentences] == ["another working mode than at home"]


def test_another_mode_of_a_three_upu_is_reached_past_a_singularity() -> None:
    nlp = formulate(free_pose("3-upu", 0.4))
    (rotation,) = nlp.program.places.rotations
    q = list(rotation.q)  # type: ignore[union-attr]
    found = []
    for turn in ((0.5, 0.3, 0.0), (0.0, 0.4, 0.3), (0.3, 0.0, 0.6)):
        x = nlp.start.copy()
        x[q] = turn
        x = close_equations(nlp, x)
        if loops_are_closed(nlp, x) and np.linalg.norm(x[q]) > 0.1:
            found.append(assembly_of(nlp, x, evaluate(nlp, x)))
    assert found  # the platform is turned: its own mode only translates
    for each in found:
        assert each.nearness < NEAR_SINGULAR
        assert each.brief
        assert each.sentences[0].startswith("not reached from home without passing near a singularity")


def test_poses_near_home_are_reached_and_joints_put_in_place_as_on_the_path_from_there() -> None:
    nlp = formulate(free_pose("3-rps", 0.3))
    rng = np.random.default_rng(2)
    (rotation,) = nlp.program.places.rotations
    for _ in range(5):
        x = nlp.start.copy()
        x[2] += rng.uniform(-0.2, 0.2)
        x[list(rotation.q)[:2]] = rng.uniform(-0.1, 0.1, 2)  # type: ignore[union-attr]
        x = close_equations(nlp, x)
        found = assembly_of(nlp, x, evaluate(nlp, x))
        assert found.is_home
        assert found.nearness > 0.5
        assert not found.brief
    nlp, rng, count = formulate(free_pose("6-rus", 0.6)), np.random.default_rng(0), 0
    (rotation,), own = nlp.program.places.rotations, list(range(3))
    for _ in range(12):
        x = nlp.start.copy()
        x[own] = nlp.lower[own] + (nlp.upper - nlp.lower)[own] * rng.random(3)
        x[list(rotation.q)] = rng.uniform(-0.15, 0.15, 3)  # type: ignore[union-attr]
        found = closed_in_place(nlp, x)
        if found is not None:
            assembly = assembly_of(nlp, found, evaluate(nlp, found))
            assert assembly.is_home
            count += 1
    assert count > 1


def test_results_say_that_an_answer_is_in_another_assembly() -> None:
    case = replace(free_pose("6-rus", 0.1, 0.2), search=Search(starts=1))
    solution = solve(case)
    own = solution.outcomes[0].own
    assert result_of(solution).robot.joints.assembly == ()
    nlp, (places,) = own.nlp, own.nlp.program.places.unknowns
    other = own.x.copy()
    other[places[1]] += math.radians(100)
    other = close_equations(nlp, other)
    moved = replace(own, x=other, state=evaluate(nlp, other))
    changed = replace(solution, outcomes=(replace(solution.outcomes[0], own=moved),))
    (sentence,) = result_of(changed).robot.joints.assembly
    assert sentence.startswith("another working mode than at home: limb 2 ")


@pytest.mark.slow
@pytest.mark.parametrize("sense", ["max", "min"])
def test_every_start_of_six_robots_is_solved(sense: str) -> None:
    robots = {"3-rps": ("rb", "rp"), "6-rus": ("rb", "rp", "crank"), "6-pus": ("rb", "rp"), "delta": ("rb", "arm")}
    for name, free in (robots | {"tricept": ("rb", "rp"), "spherical-3-rrr": ()}).items():
        case = free_pose(name, 0.15, 0.35)
        parameters = {
            item.name: Free(0.85 * item.typical[0], 1.15 * item.typical[0]) if item.name in free else item.typical[0]
            for item in case.model.parameters
        }
        task = replace(case.tasks[0], sense=sense)
        own = solve(replace(case, parameters=parameters, tasks=[task]), starts=24).outcomes[0].own
        assert [start.status.name for start in own.starts] == ["CONVERGED"] * 24, name
        assert loops_are_closed(own.nlp, own.x)


DELTA = """
title = "Delta"
units.length = "m"
robot.model = "delta"
pose.position = [0, 0, -1.1]
task = [{ name = "vertical", sense = "max", axis = [0, 1, 2], pitch = inf }]
solve.starts = 2
[robot.parameters]
rb = { min = 0.12, max = 0.2 }
rp = 0.044
arm = { min = 0.4, max = 0.6 }
rod = 1.244
w = 0.131
tilt = 20
"""


def near_home(name: str, part: float) -> Case:
    """A robot of the gallery with the pose free about home, by a part of its size."""
    return free_pose(name, part * (float(np.linalg.norm(robot_function(name)().home)) or 1.0), part)


def moved(nlp: Nlp) -> list[int]:
    """Indices of the pose's numbers."""
    (unknowns,) = nlp.program.places.unknowns
    return [index for index in range(nlp.n) if index not in unknowns]


def in_another_mode(nlp: Nlp, limb: int) -> np.ndarray:
    """A closed point at home's pose with one limb's only unknown at its other solution."""
    x, (own,) = closed_start(nlp), nlp.program.places.unknowns
    for angle in np.linspace(0.3, 3.0, 10):
        for sign in (1, -1):
            other = x.copy()
            other[own[limb]] += sign * angle
            other = close_equations(nlp, other)
            if loops_are_closed(nlp, other) and np.abs(other - x)[list(own)].max() > 0.1:
                return other
    raise AssertionError("the limb has no other mode")


FEW = ("3-rrs", "6-pus", "planar-3-rrr", "spherical-3-rrr")


@pytest.mark.parametrize(
    "names",
    [FEW, pytest.param([each for each in (*EACH_KIND, "6-rss") if each not in FEW], marks=pytest.mark.soak)],
    ids=["few", "others"],
)
def test_signs_are_positive_from_home_on_and_negative_in_other_modes(names: tuple[str, ...]) -> None:
    for name in names:
        nlp = replace(formulate(near_home(name, 0.05)), in_home_mode=True)
        model = nlp.program.model
        assert len({each.name for each in model.signs}) == len(model.signs)
        if not model.unknowns:
            assert model.signs == ()
            continue
        start = closed_start(nlp)
        assert loops_are_closed(nlp, start), name
        assert standard_form(nlp).keeps_signs(start), name
        distances = ca.Function("distances", [nlp.program.x, nlp.program.p], [nlp.program.robots[0].distances])
        away = close_equations(nlp, start + 0.3 * nlp.scale * np.isin(np.arange(nlp.n), moved(nlp)))
        assert loops_are_closed(nlp, away), name
        found = np.array([distances(x, nlp.arguments).full().ravel() for x in (start, away, away + 0.1)])
        assert np.abs(found[:2]).max(initial=0.0) < 1e-9, name
        assert np.abs(found[2]).min(initial=1.0) > 1e-6, name  # where the loops are open
        if name in ("6-rus", "6-pus", "6-rss"):
            assert is_in_home_mode(nlp, in_another_mode(nlp, 2)) is False


def test_screws_are_compared_in_any_unit_of_length() -> None:
    screws, centre = np.random.default_rng(0).normal(size=(6, 5)), np.array([0.2, -0.5, 0.4])
    in_microns = np.vstack([screws[:3], 1e6 * screws[3:]])
    assert _about(in_microns, 1e6 * centre) == pytest.approx(_about(screws, centre), abs=1e-12)


def test_a_hinge_whose_axes_point_against_each_other_is_no_assembly() -> None:
    nlp = formulate(near_home("planar-3-rrr", 0.05))
    form = standard_form(nlp)  # for all modes
    assert sum(each.kind is Kind.ASSEMBLY for each in form.conditions) == 3
    x = closed_start(nlp)
    assert form.keeps_signs(x)
    turned = x.copy()
    turned[list(nlp.program.places.rotations[0].q)] = [0.0, 1.0 - 1e-9, 0.0]  # type: ignore[union-attr]
    assert not form.keeps_signs(turned)


def test_a_certificate_speaks_of_the_modes_that_it_names() -> None:
    case = case_from(DELTA, "delta")
    solution = solve(case)
    own = certify(solution, with_proof=True)
    assert own.certificate.status is CertificateStatus.PROVED
    assert not own.certificate.was_beaten
    assert own.certificate.bound == pytest.approx(solution.F, rel=1.1e-4)
    assert "in the home working mode has F larger than" in own.certificate.statement
    every = certify(solution, all_assemblies=True)
    assert every.certificate.status is CertificateStatus.PROVED
    assert every.certificate.incumbent > 1.1 * solution.F
    assert (
        "better than the given point, in another working mode than the home working mode" in every.certificate.statement
    )
    # A solution in another mode is no incumbent of home's: all modes are covered.
    (outcome,) = solution.outcomes
    elsewhere = replace(outcome.own, x=every.certificate.x)
    again = certify(replace(solution, outcomes=(replace(outcome, own=elsewhere),)))
    assert not again.certificate.nlp.in_home_mode
    assert not again.statement.in_home_mode
    # The proof is about home's mode alone, and fails for all modes.
    (proof,) = proof_of(own, DELTA).claims
    assert own.statement.in_home_mode
    nlp = own.certificate.nlp
    assert check_proof(proof, nlp).leaves > 1
    with pytest.raises(ProofError, match="its expressions or bounds differ"):
        check_proof(proof, replace(nlp, in_home_mode=False))


def test_certify_names_the_limbs_with_unknowns_first(tmp_path: Path, cli: Run) -> None:
    path, proof = saved(tmp_path / "delta.toml", DELTA), tmp_path / "proof.json"
    out = output_of(cli("certify", str(path), "--proof", str(proof)))
    words = "limbs 1, 2, 3: 1 joint coordinate each, from the loop equations; covers home's working mode"
    shown = " ".join(out.split())
    assert shown.startswith("Delta certificate proved")
    assert f"unknowns {words}" in shown
    out = output_of(cli("verify-proof", str(proof)))
    assert "within the limits of case 'delta' in the home working mode" in unbroken(out)
    every = json.loads(output_of(cli("certify", str(path), "--all-assemblies", "--json", "-")))
    assert every["certificate"]["status"] == "proved"
    status, out, _ = cli("certify", str(path), "--all-assemblies", "--time", "1e-9")
    assert status == 1
    assert f"unknowns {words.partition('home')[0]}all assembly modes" in " ".join(out.split())
    assert "unknowns" not in cli("certify", "paper-4.2-rotation", "--starts", "1")[1]


@pytest.mark.parametrize(("name", "proved"), [("3-rps", 10), ("6-pus", 50), ("tricept", 10), ("exechon", 10)])
def test_robots_at_home_are_proved_in_a_few_boxes(name: str, proved: int) -> None:
    model = robot_function(name)()
    parameters: dict[str, float | Free] = dict(typical(model))
    for key in list(parameters)[:2]:
        parameters[key] = Free(0.95 * float(parameters[key]), 1.05 * float(parameters[key]))  # type: ignore[arg-type]
    task = Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]), "max")  # type: ignore[arg-type]
    found = certify(Case(model, parameters, model.home, [task]), starts=2, time_limit=20).certificate
    assert found.status is CertificateStatus.PROVED
    assert found.boxes <= proved


@pytest.mark.parametrize("name", ["3-rps", "delta", "3-upu", "planar-3-rrr"])
def test_a_case_that_leaves_nothing_free_is_evaluated_once(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    model = robot_function(name)()
    solution = solve(Case(model, typical(model), model.home, [TASK]))
    assert solution.status is Status.EVALUATED
    assert solution.starts == ()
    assert solution.evidence is None
    assert loops_are_closed(solution.nlp, solution.x)
    np.testing.assert_allclose(solution.x, 0, atol=1e-9)  # all joints are at home
    data = json_data(result_of(solution))
    assert (data["status"], data["optimality"]) == ("evaluated", None)
    # A pose that the robot cannot take: no numbers are left to choose, and no solver is asked.
    if name in ("delta", "3-upu"):
        refused = solve(Case(model, typical(model), model.home, [TASK], Rotation((1, 0, 1), math.radians(5))))
        assert refused.status is Status.INFEASIBLE
        assert refused.starts == ()
    assert capfd.readouterr().err == ""


def test_more_equations_than_variables_need_no_solver(capfd: pytest.CaptureFixture[str]) -> None:
    model = robot_function("delta")()
    values = typical(model) | {"rb": Free(0.12, 0.2)}
    nlp = formulate(Case(model, values, model.home, [TASK], Rotation((1, 0, 1), math.radians(5))))
    assert nlp.is_overdetermined
    assert not nlp.is_fixed
    solution = solve(nlp.case, starts=3)
    assert solution.status is Status.INFEASIBLE
    assert capfd.readouterr().err == ""


def test_the_command_says_evaluated(tmp_path: Path) -> None:
    values = typical(robot_function("3-rps")())
    task = {"name": "t", "sense": "max", "axis": [0, 1, 2], "point": [0, 0, 0], "pitch": 2}
    robot = {"model": "3-rps", "parameters": values}
    case = case_file(tmp_path, case_tables(robot, pose={"position": [0, 0, values["h"]]}, task=[task]))
    result = ran("solve", str(case))
    assert result.code == 0
    assert "at the given point F = " in result.output
    assert "(evaluated)" in result.output
    assert "converged" not in result.output


def test_each_limb_bent_the_other_way_is_another_working_mode() -> None:
    nlp = formulate(free_pose("6-rus", 0.2, 0.3))
    (own,) = nlp.program.places.unknowns
    rng = np.random.default_rng(4)
    for limb in range(6):
        x = np.array(nlp.start)
        x[:3] += rng.uniform(-0.05, 0.05, 3)
        near = close_equations(nlp, x)
        assert turned_over_poses(nlp, near) == ((),)
        far = near.copy()
        far[own[limb]] += math.radians(110)
        far = close_equations(nlp, far)
        assert np.abs(far - near)[own[limb]] > 0.3
        assert turned_over_poses(nlp, far) == ((str(limb + 1),),)
        found = assembly_over_poses(nlp, far)
        assert found.turned == (str(limb + 1),)
        assert found.brief == f"another working mode (limb {limb + 1})"


def test_planar_limbs_bent_the_other_way_are_found_too() -> None:
    # Their wrenches are members without smooth directions, so the sense is that of a determinant of screws.
    model = robot_function("planar-3-rrr")()
    nlp = formulate(Case(model, typical(model), [Free(-0.2, 0.2), Free(-0.2, 0.2), 0.0], [TASK]))
    (own,) = nlp.program.places.unknowns
    closed = close_equations(nlp, nlp.start)
    found = set()
    for k in range(len(own)):
        for way in (-2.0, 2.0):
            x = closed.copy()
            x[own[k]] += way
            x = close_equations(nlp, x)
            if loops_are_closed(nlp, x) and np.abs(x - closed)[list(own)].max() > 0.5:
                (turned,) = turned_over_poses(nlp, x)
                judged = assembly_over_poses(nlp, x)
                assert judged.turned == turned
                found.add(turned)
    assert {("1",), ("2",), ("3",)} <= found


def test_every_distinct_optimum_says_its_working_mode() -> None:
    solution = solve(starter("6-rus"), starts=16)
    own = solution.outcomes[0].own
    brief = [found.assembly.brief for found in own.optima if found.assembly is not None]
    assert len(brief) == len(own.optima) > 1
    assert len({found.x.tobytes() for found in own.optima}) == len(own.optima)
    for found in own.optima:
        assert found.assembly.is_home == (turned_over_poses(own.nlp, found.x) == ((),))
    assert any(words.startswith("another working mode (limb") for words in brief)
    data = result_of(solution).starts
    assert [each.assembly for each in data.optima] == brief
    lines = [line.text for line in starts_lines(data)]
    assert sum("in another working mode (limb" in line for line in lines) == sum(map(bool, brief[:5]))


SHORTEST, LONGEST = 17.0, 43.0


def displacement(at: float) -> tuple[Array, Array]:
    """A tilt of 30 degrees and a place on a circle, by an angle."""
    tilt = turn_about((-math.sin(at), math.cos(at), 0), math.radians(30))
    return tilt, np.array([4 + 5 * math.cos(at), 3 + 5 * math.sin(at), 20])


def circling(count: int, over_poses: str, starts: int, x1: object = 26.5, **search: object) -> Case:
    """A hexapod that pushes along x at poses on a circle, each of which may turn about the platform's axis."""
    turn, poses = {"axis": [0, 0, 1], "angle": {"min": -75, "max": 75}}, list[dict[str, Any]]()
    for at in np.linspace(0, 2 * math.pi, count):
        tilt, place = displacement(at)
        step = {"rotation": tilt.tolist(), "translation": place.tolist()}
        poses.append({"position": [0, 0, 0], "rotation": turn, "displacements": [step]})
    parameters = {"x1": x1, "x2": 11.543, "x3": 0, "x4": 5}
    return case_of(
        {"model": "stewart-gough", "layout": "octahedral", "parameters": parameters},
        units={"length": "in"},
        pose=poses,
        task=[{"sense": "max", "axis": [1, 0, 0], "pitch": math.inf}],
        combine={"over_poses": over_poses} if count > 1 else None,
        limits={"leg_length": {"min": SHORTEST, "max": LONGEST}},
        solve={"starts": starts, **search},
    )


def values_at(at: float, angles: Array) -> Array:
    """F of a pose at angles; minus infinity where a leg is outside of its limits."""
    base, platform = circle_joints({"x1": 26.5, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)})
    tilt, place = displacement(at)
    turns = np.array([turn_about((0, 0, 1), each) for each in angles])
    legs = place + platform @ np.swapaxes(tilt @ turns, 1, 2) - base
    lengths = np.linalg.norm(legs, axis=2)
    kept = (lengths.min(axis=1) >= SHORTEST) & (lengths.max(axis=1) <= LONGEST)
    return np.asarray(np.where(kept, ((legs[:, :, 0] / lengths) ** 2).sum(axis=1), -np.inf))


@cache
def best_at(at: float) -> float:
    """The largest F of a pose within the limits on the legs, over its angle: on a grid, and on two finer ones in it."""
    angles = np.radians(np.linspace(-75, 75, 601))
    for _ in range(3):
        values = values_at(at, angles)
        best, step = angles[int(values.argmax())], angles[1] - angles[0]
        angles = np.clip(best + step * np.linspace(-1, 1, 101), math.radians(-75), math.radians(75))
    return float(values.max())


@pytest.mark.parametrize(
    ("count", "over_poses", "starts"), [(20, "mean", 32), (80, "mean", 8), (20, "worst", 32), (7, "sum", 16)]
)
def test_many_poses_reach_the_best_of_each_by_itself(count: int, over_poses: str, starts: int) -> None:
    each = np.array([best_at(at) for at in np.linspace(0, 2 * math.pi, count)])
    best = {"mean": each.mean(), "worst": each.min(), "sum": each.sum()}[over_poses]
    found = solve(circling(count, over_poses, starts))
    assert found.status is Status.OPTIMAL
    # The grid is coarse by a little, and never better.
    assert best * (1 - 1e-9) <= found.F <= best * (1 + 1e-5)
    assert found.evidence is not None
    assert found.evidence.feasibility <= 1e-9
    assert found.evidence.stationarity <= 1e-7


def test_blocks_are_the_poses_whose_best_parts_are_put_together() -> None:
    each = np.array([best_at(at) for at in np.linspace(0, 2 * math.pi, 8)])
    found = solve(circling(8, "mean", 12, screen=False))
    assert found.status is Status.OPTIMAL
    assert each.mean() * (1 - 1e-9) <= found.F <= each.mean() * (1 + 1e-5)
    blocks = Blocks(formulate(circling(6, "mean", 2))).blocks
    assert [each.variables for each in blocks] == [(k,) for k in range(6)]
    assert [each.terms for each in blocks] == [(k,) for k in range(6)]
    assert sorted(k for each in blocks for k in each.constraints) == list(range(36))
    levels = Blocks(formulate(circling(6, "worst", 2))).blocks
    assert [each.variables for each in levels] == [(k,) for k in range(6)]
    assert Blocks(formulate(circling(6, "mean", 2, x1={"min": 20, "max": 30}))).blocks == ()
    assert Blocks(formulate(circling(1, "mean", 2))).blocks == ()


def test_least_squares_by_blocks_are_those_of_the_whole() -> None:
    rng = np.random.default_rng(1)
    A = np.zeros((200, 150))
    for k in range(50):
        rows, columns = slice(4 * k, 4 * k + 4), slice(3 * k, 3 * k + 3)
        A[rows, columns] = rng.normal(size=(4, 3)) @ np.diag([1, 1, k % 2])  # of rank 2 and 3
    rows, columns = rng.permutation(200), rng.permutation(150)
    A, b = A[rows][:, columns], rng.normal(size=200)
    np.testing.assert_allclose(least_squares(A, b), np.linalg.lstsq(A, b, rcond=None)[0], atol=1e-10)
    y = nonnegative_least_squares(A, b)
    drive = A.T @ (b - A @ y)
    assert y.min() >= 0
    assert drive.max() <= 1e-9
    assert np.abs(drive * y).max() <= 1e-9
