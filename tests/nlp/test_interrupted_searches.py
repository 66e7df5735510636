"""Interrupts inside searches, at any instruction of Python: what is claimed then is never better than what is true."""

import math
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from builders import PUSH_UP, case_of, ends
from hexapods import HEXAPOD, case_of_legs, smallest
from limb_cases import machine, poses
from workspace_cases import problem_of

import screwsynth.nlp
from screwsynth.models import FloatArray
from screwsynth.models.joints.model.closedform import closed_form
from screwsynth.nlp import Case, Free, Limits, Nlp, build_model, certify, formulate, load_case, solve, sweep
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.interruption import STOPPED, is_requested, one_call
from screwsynth.nlp.proof.boxes.optimum import OptimumRule
from screwsynth.nlp.proof.certificate import branch_and_bound
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.enclosure.forms import Forms
from screwsynth.nlp.proof.statement.fixed_robot import Legs
from screwsynth.nlp.proof.workspace import scale
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.numbers.bound_search import Bounds, Goal, Number, smallest_values
from screwsynth.nlp.proof.workspace.numbers.expressions import Expressions
from screwsynth.nlp.proof.workspace.numbers.extremes import goal_of
from screwsynth.nlp.proof.workspace.numbers.within_tolerance import RobotsWithinTolerance
from screwsynth.nlp.proof.workspace.ranks import ranks
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import Problem, build_problem
from screwsynth.nlp.proof.workspace.scale import largest_scale
from screwsynth.nlp.proof.workspace.verdict import Outcome, Verdict

ROOT = Path(screwsynth.nlp.__file__).parent
#: The code whose instructions are counted: all of the searches, or their loops alone, where most mistakes would be.
WATCHED = tuple(str(ROOT / name) for name in ("proof", "interruption.py"))
LOOPS = (
    str(ROOT / "interruption.py"),
    str(ROOT / "proof" / "certificate" / "branch_and_bound.py"),
    *(str(ROOT / "proof" / "boxes" / name) for name in ("incumbent.py", "search.py", "optimum.py")),
    *(str(ROOT / "proof" / "boxes" / "limbs" / name) for name in ("independent.py", "shared.py")),
    *(str(ROOT / "proof" / "workspace" / name) for name in ("judge.py", "scale.py")),
    str(ROOT / "proof" / "workspace" / "ranks" / "ranks.py"),
    *(str(ROOT / "proof" / "workspace" / "numbers" / name) for name in ("expressions.py", "bound_search.py")),
)
assert all(Path(each).exists() for each in (*WATCHED, *LOOPS))


class Claim(NamedTuple):
    """What a search says: whether it proves, how good its bound is (the larger the better), and whether it stopped."""

    is_proved: bool
    quality: float
    is_stopped: bool


Search = Callable[[], Claim]
Tracer = Callable[[FrameType, str, Any], Any]


@contextmanager
def at_instruction(n: int, error: type[BaseException], watched: tuple[str, ...]) -> Iterator[list[int]]:
    """Raise an error before the n-th instruction of the watched code; gives the number of those that ran."""
    count = [0]

    def local(_: FrameType, event: str, __: object) -> Tracer:
        if event == "opcode":
            count[0] += 1
            if count[0] == n:
                raise error
        return local

    def every(frame: FrameType, _: str, __: object) -> Tracer | None:
        if not frame.f_code.co_filename.startswith(watched):
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        return local

    before = sys.gettrace()
    sys.settrace(every)
    try:
        yield count
    finally:
        sys.settrace(before)


def from_regularity(found: Verdict) -> Claim:
    assert found.outcome is not Outcome.PROVED or (found.open, found.share) == (0, 0.0)
    return Claim(found.outcome is Outcome.PROVED, -found.share, found.reason == STOPPED)


@cache
def six_legs_problem() -> Problem:
    """Six legs that are singular in a small part of the workspace, without change of sign: a touching determinant."""
    rng = np.random.default_rng(0)
    box = pose_box(Workspace((Free(-1, 1), Free(-1, 1), Free(3, 4)), Turns(TurnKind.ANY_AXIS, (Free(0.0, 0.5),))))
    return build_problem(case_of_legs(Legs(rng.normal(size=(6, 3)), rng.normal(size=(6, 3)))), HEXAPOD, box)


def regular(*, most_boxes: int | None = None, progress: Callable[..., None] | None = None) -> Verdict:
    problem = six_legs_problem()
    return prove_rank(problem, problem.locked, most_boxes=most_boxes, progress=progress)


def six_legs() -> Claim:
    return from_regularity(regular(most_boxes=300))


@cache
def any_robot() -> Problem:
    return problem_of(workspace_case("6-rss", width=0.5, turn=30))


def any_rank() -> Claim:
    problem = any_robot()
    return from_regularity(prove_rank(problem, problem.locked, most_boxes=130))


def workspace_case(name: str, width: float, turn: float, tolerance: float | None = None, **limits: object) -> Case:
    model = build_model(name)
    home, numbers = model.home, {item.name: item.typical[0] for item in model.parameters}
    task = PUSH_UP | {"point": [0, 0, 0], "pitch": 0.1}
    robot, pose = {"model": name, "parameters": numbers}, {"position": list(home)}
    case = case_of(robot, pose=pose, task=[task], limits=limits or None)
    size, is_planar, angle = max(abs(each) for each in home) or 1.0, name.startswith("planar"), math.radians(turn)
    half = (width * size, width * size, 0.0 if is_planar else width * size)
    place = tuple(Free(at - by, at + by) if by else at for at, by in zip(home, half, strict=True))
    angles = tuple(Free(-angle, angle) if angle and (k == 2 or not is_planar) else 0.0 for k in range(3))
    turns = Turns(TurnKind.ROLL_PITCH_YAW, angles)
    return replace(case, workspace=Workspace(place, turns), joint_centre_tolerance=tolerance)


def every_machine(case: Case) -> RobotsWithinTolerance:
    return RobotsWithinTolerance(case, closed_form(case.model), problem_of(case))


class Bowl(Number):
    """A function of the pose with a smallest value of -1, in the shape of a bowl, and bounds that are not sharp."""

    middle = np.array([0.3, 0.1, 3.6, 0.02, 0.01, -0.03])

    def values(self, z: FloatArray) -> FloatArray:
        return np.asarray(((z - self.middle) ** 2).sum(axis=1, keepdims=True) - 1.0)

    def over(self, forms: Forms, count: int) -> Bounds:
        half = np.abs(forms.a[:, :, :count]).sum(axis=2)
        nearest = np.clip(self.middle, forms.c - half, forms.c + half)
        return Bounds(self.values(nearest) - 0.2 * half.sum(axis=1, keepdims=True), 2 * half[:, None])


def bowl() -> Claim:
    problem = six_legs_problem()
    number = Bowl(problem, problem.z)
    found = smallest(number, Goal(0.2))
    assert found.bound <= -1.0 <= found.value == number.values(found.at[None])[0, 0]
    return Claim(not found.reason, found.bound, found.reason == STOPPED)


@cache
def planar() -> Case:
    return workspace_case("planar-3-rpr", 0.05, 5, actuator_length={"min": -0.5, "max": 0.01})


def loops() -> Claim:
    alone = every_machine(planar())
    claims = [each for each in alone.symbols.claims(())[1] if each.key.endswith("max")]
    numbers = Expressions(alone.family, ca.vertcat(*map(alone.number, claims)))
    found = smallest_values(numbers, [goal_of(each, part=0.2) for each in claims])
    assert found
    assert all(each.bound <= each.value for each in found)
    return Claim(
        any(each.bound >= -(claim.limit or 0.0) for claim, each in zip(claims, found, strict=True)),
        min(each.bound for each in found),
        any(each.reason == STOPPED for each in found),
    )


@cache
def family() -> Problem:
    return every_machine(workspace_case("6-rus", 0.02, 2, tolerance=1e-3)).family


def machines() -> Claim:
    built = family()
    number = Expressions(built, ca.sumsqr(built.z) + built.z[0])
    found = smallest(number, Goal(part=0.2))
    assert not found.value < found.bound
    return Claim(not found.reason, found.bound, found.reason == STOPPED)


@cache
def program(name: str) -> tuple[Nlp, float]:
    """A program, and the best value of its objective that is known."""
    nlp = formulate(machine(2.0) if name == "limbs" else poses(7))
    return nlp, certify_program(nlp, gap=0.2).incumbent


def certified(name: str) -> Claim:
    """The claim of a certificate; its bound may be sharper before the end than then, but never beyond the optimum."""
    nlp, best = program(name)
    found = certify_program(nlp, gap=0.2, jobs=1)
    assert nlp.sign * found.bound <= nlp.sign * best
    if found.x is not None:
        assert pytest.approx(found.incumbent, rel=1e-12) == nlp.evaluate(found.x).F
    return Claim(found.status is CertificateStatus.PROVED, 0.0, found.reason == STOPPED)


def whole_box() -> Claim:
    return certified("poses")


def limbs() -> Claim:
    return certified("limbs")


def shared() -> Claim:
    """The limbs of a program that is small enough for a search of the whole box."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(branch_and_bound, "_WHOLE_BOX", 0)
        return certified("poses")


QUICK: tuple[Search, ...] = (six_legs, bowl, machines)
SEARCHES = (*QUICK, any_rank, loops, whole_box, limbs, shared)


@cache
def complete(search: Search, watched: tuple[str, ...]) -> tuple[Claim, int]:
    """The claim of a search that nothing interrupts, and the number of its instructions."""
    found = search()
    with at_instruction(-1, KeyboardInterrupt, watched) as count:
        search()
    return found, count[0]


def interrupted(search: Search, error: type[BaseException], watched: tuple[str, ...], moments: int, seed: int) -> int:
    """Interrupt a search at random instructions, and return how often it answered with a claim of its own."""
    whole, instructions = complete(search, watched)
    answers = 0
    for n in np.random.default_rng(seed).integers(1, instructions + 1, moments).tolist():
        try:
            with at_instruction(n, error, watched):
                found = one_call(search)()
        except error:
            continue
        if found == whole:  # the number of instructions depends on the clock by a few
            continue
        answers += 1
        assert error is KeyboardInterrupt
        assert found.is_stopped, n
        assert not found.is_proved, n
        assert found.quality <= whole.quality, n
    return answers


each_search = pytest.mark.parametrize("search", SEARCHES, ids=lambda each: each.__name__)


@each_search
def test_an_interrupted_search_claims_no_more_than_a_complete_one(search: Search) -> None:
    assert interrupted(search, KeyboardInterrupt, LOOPS, 32 if search in QUICK else 3, 0) > 0
    assert interrupted(search, MemoryError, LOOPS, 1, 1) == 0


@pytest.mark.soak
@each_search
@pytest.mark.parametrize("watched", [LOOPS, WATCHED], ids=["loops", "all"])
def test_searches_are_interrupted_at_many_instructions(search: Search, watched: tuple[str, ...]) -> None:
    moments = 64 if search in QUICK else 16
    assert interrupted(search, KeyboardInterrupt, watched, moments, 2) >= (2 if watched == LOOPS else 0)
    assert interrupted(search, MemoryError, watched, 3, 3) == 0


def interrupting(calls: int, real: Callable[..., Any]) -> Callable[..., Any]:
    """A function that is interrupted at a call of it, and works before and after."""
    count = 0

    def function(*arguments: object, **more: object) -> Any:  # noqa: ANN401 - what the real one returns
        nonlocal count
        count += 1
        if count == calls:
            raise KeyboardInterrupt
        return real(*arguments, **more)

    return function


def octahedral(x1: object = 12, longest: float = 31, **limits: object) -> Case:
    """Six legs that are regular, and whose longest length is too large, over a small workspace."""
    task = {"sense": "max", "axis": [2, 2, 1], "point": [2, 3, 6], "pitch": 1}
    limits |= {"leg_length": {"min": 20, "max": longest}}
    robot, place = {"x1": x1, "x2": 8, "x3": 4, "x4": 9}, {"position": [ends(2), ends(2), ends(2, 30)]}
    given = {"pose": {"position": [0, 0, 30]}, "task": [task], "limits": limits, "workspace": place}
    return case_of({"model": "stewart-gough", "parameters": robot}, **given)


def test_a_judgement_keeps_what_is_proved_before_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    case = octahedral()
    whole = judge_workspace(case, gap=0.2)
    monkeypatch.setattr(OptimumRule, "examine", interrupting(3, OptimumRule.examine))
    found = judge_workspace(case, gap=0.2)
    assert found.regularity.outcome is whole.regularity.outcome
    assert [each.name for each in found.extremes] == [each.name for each in whole.extremes]
    stopped = [each.reason == STOPPED for each in found.extremes]
    assert True in stopped
    assert all(stopped[stopped.index(True) :])
    assert not found.is_proved
    for before, each in zip(whole.extremes, found.extremes, strict=True):
        assert each.outcome in (before.outcome, Outcome.OPEN)
    assert not is_requested()


def test_certificates_of_several_tasks_end_with_the_one_that_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OptimumRule, "examine", interrupting(1, OptimumRule.examine))
    found = certify(load_case("paper-4.2"), starts=2, jobs=1)
    assert [each.reason for each in found.tasks] == [STOPPED] * len(found.tasks)
    assert not found.is_proved
    assert not is_requested()


def test_an_interrupted_scale_is_no_larger(monkeypatch: pytest.MonkeyPatch) -> None:
    case = replace(octahedral(), limits=Limits())
    monkeypatch.setattr(scale, "ACCURACY", 0.5)
    whole = largest_scale(case, time_limit=None)
    assert whole.factor >= 1
    monkeypatch.setattr(ranks.RankRule, "divided", interrupting(1, ranks.RankRule.divided))
    found = largest_scale(case, time_limit=None)
    assert found.factor <= whole.factor
    assert found.failed >= whole.failed


def test_an_interrupted_exchange_of_poses_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    case = octahedral(ends(1, 12), 40, over="workspace")
    whole = solve(case, starts=1)
    assert whole.workspace.is_proved
    monkeypatch.setattr(OptimumRule, "examine", interrupting(2, OptimumRule.examine))
    found = solve(case, starts=1)
    assert not found.workspace.is_proved
    assert STOPPED in {each.reason for each in found.workspace.judgement.extremes}
    assert len(found.workspace.history) <= len(whole.workspace.history)


def test_an_interrupted_sweep_keeps_no_row_of_the_point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(OptimumRule, "examine", interrupting(2, OptimumRule.examine))
    out = tmp_path / "out.csv"
    over = {"over": {"x2": [7.0, 8.0]}, "out": out, "starts": 1, "jobs": 1, "certified": True}
    with pytest.raises(KeyboardInterrupt):
        sweep(load_case("paper-4.1-helical"), **over)
    assert not out.exists()
    assert not Path(f"{out}.journal").exists()


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError, ValueError])
def test_an_error_of_a_callback_proves_nothing(error: type[BaseException]) -> None:
    def fail(*_: object) -> None:
        raise error

    problem = any_robot()
    nlp = program("poses")[0]
    searches: tuple[Callable[[], Any], ...] = (
        lambda: regular(progress=fail).outcome is Outcome.OPEN,
        lambda: prove_rank(problem, problem.locked, progress=fail).outcome is Outcome.OPEN,
        lambda: certify_program(nlp, progress=fail).status is CertificateStatus.INCOMPLETE,
    )
    for search in searches:
        if error is KeyboardInterrupt:
            assert search()
        else:
            with pytest.raises(error):
                search()


SCRIPT = """
import os, signal, sys, threading
sys.path[:0] = {path!r}
import test_interrupted_searches as own
from screwsynth.nlp.proof.workspace import scale
from screwsynth.nlp.proof.workspace.scale import largest_scale
from screwsynth.nlp.proof.workspace.verdict import Outcome
problem = own.any_robot()
for k in range(12):
    timer = threading.Timer(0.004 * (k + 1), os.kill, (os.getpid(), signal.SIGINT))
    try:
        timer.start()
        found = own.prove_rank(problem, problem.locked)
        print("claim", found.outcome.value, found.reason, found.share)
    except KeyboardInterrupt:
        print("raised")
    try:
        timer.join()
    except KeyboardInterrupt:
        pass
"""


@pytest.mark.slow
def test_signals_in_python_prove_nothing() -> None:
    """6-rss over a workspace with singular poses: each search is ended by a signal."""
    script = SCRIPT.format(path=[str(Path(__file__).parent), *(str(each) for each in sys.path)])
    done = subprocess.run([sys.executable, "-P", "-c", script], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert len(lines) == 12
    assert set(lines) <= {"raised", f"claim open {STOPPED} 1.0"}
