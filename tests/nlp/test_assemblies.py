"""Assemblies, modes of operation and working modes: which one a point is in, and certificates that keep to them."""

import json
import math
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from builders import EACH_KIND, Run, case_from, output_of, saved, unbroken

from screwsynth.models import robot_function
from screwsynth.nlp import Case, CertificateStatus, Free, Nlp, Rotation, Search, Task, formulate, result_of, solve
from screwsynth.nlp.evidence.assembly import NEAR_SINGULAR, assembly_of
from screwsynth.nlp.evidence.closing import closed_in_place, closed_start
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.state import evaluate, loops_are_closed
from screwsynth.nlp.evidence.workingmode import _about
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.proof_file import ProofError
from screwsynth.nlp.proof.statement.standard_form import Kind, is_in_home_mode, standard_form
from screwsynth.nlp.solver.certified import certify, proof_of


def free_pose(name: str, reach: float, turn: float = 2.0) -> Case:
    """The gallery's robot with the pose free about home."""
    model = robot_function(name)()
    position = [Free(value - reach, value + reach) for value in model.home]
    parameters = {item.name: item.typical[0] for item in model.parameters}
    task = Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]))
    return Case(model, parameters, position, [task], Rotation(None, Free(-turn, turn)))


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
    assert "in home's working mode has F larger than" in own.certificate.statement
    every = certify(solution, all_assemblies=True)
    assert every.certificate.status is CertificateStatus.PROVED
    assert every.certificate.incumbent > 1.1 * solution.F
    assert "better than the one given, in another working mode than home's" in every.certificate.statement
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
    with pytest.raises(ProofError, match="for other expressions or bounds"):
        check_proof(proof, replace(nlp, in_home_mode=False))


def test_certify_names_the_limbs_with_unknowns_first(tmp_path: Path, cli: Run) -> None:
    path, proof = saved(tmp_path / "delta.toml", DELTA), tmp_path / "proof.json"
    out = output_of(cli("certify", str(path), "--proof", str(proof)))
    words = "limbs 1, 2, 3 need 1 joint position each and the loop equations, in"
    assert " ".join(out.split()).startswith(f"unknowns {words} home's working mode Delta certificate proved")
    out = output_of(cli("verify-proof", str(proof)))
    assert "within the limits of delta in home's working mode" in unbroken(out)
    every = json.loads(output_of(cli("certify", str(path), "--all-assemblies", "--json", "-")))
    assert every["certificate"]["status"] == "proved"
    status, out, _ = cli("certify", str(path), "--all-assemblies", "--time", "1e-9")
    assert status == 1
    assert " ".join(out.split()).startswith(f"unknowns {words} every assembly Delta")
    assert "unknowns" not in cli("certify", "paper-4.2-rotation", "--starts", "1")[1]


@pytest.mark.parametrize(("name", "proved"), [("3-rps", 10), ("6-pus", 50), ("tricept", 10), ("exechon", 10)])
def test_robots_at_home_are_proved_in_a_few_boxes(name: str, proved: int) -> None:
    model = robot_function(name)()
    parameters: dict[str, float | Free] = {item.name: item.typical[0] for item in model.parameters}
    for key in list(parameters)[:2]:
        parameters[key] = Free(0.95 * float(parameters[key]), 1.05 * float(parameters[key]))  # type: ignore[arg-type]
    task = Task(np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2]), "max")  # type: ignore[arg-type]
    found = certify(Case(model, parameters, model.home, [task]), starts=2, time_limit=20).certificate
    assert found.status is CertificateStatus.PROVED
    assert found.boxes <= proved
