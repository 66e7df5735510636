"""One rule for refutations: a pose refutes a claim where ``evaluate`` shows the fault, with the joints as at home."""

import math

import numpy as np
import pytest
from builders import EACH_KIND, case_from, soaked
from workspace_cases import box_of, on_paper, problem_of, root_of

from screwsynth.models import Dimension
from screwsynth.models.joints.closedform import closed_form
from screwsynth.nlp import Case, Judgement, Outcome, RobotState, Rotation, build_model, formulate, judge_workspace
from screwsynth.nlp.evidence import state
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.interruption import within
from screwsynth.nlp.proof.checker.proof_file import ProofError
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.checker.workspace.closed_loops import start_of
from screwsynth.nlp.proof.checker.workspace.motion_matrix import PosedRobot, motion_matrix
from screwsynth.nlp.proof.statement.posed_layout import at_one_pose
from screwsynth.nlp.proof.workspace.home_poses import Homes
from screwsynth.nlp.proof.workspace.ranks.ranks import prove_rank, prove_ranks
from screwsynth.nlp.proof.workspace.ranks.singular_pose import SingularSearch
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseNumbers
from screwsynth.nlp.proof.workspace.robot.posed_robot import NotJudgedError

#: Robots whose platform does not turn.
TRANSLATIONS = ("3-puu", "3-upu", "delta", "delta-parallelogram", "orthoglide", "tripteron")


def size_of(name: str) -> float:
    model = build_model(name)
    return max(abs(each) for each in (*model.home, *(item.typical[0] for item in model.parameters)))


def spans(*ends: tuple[float, float]) -> str:
    """Positions of a workspace; two equal ends are a fixed one."""
    parts = [repr(low) if low == high else f"{{ min = {low!r}, max = {high!r} }}" for low, high in ends]
    return f"[{', '.join(parts)}]"


def turns(*ends: tuple[float, float]) -> str:
    parts = [f"{key} = {{ min = {a}, max = {b} }}" for key, (a, b) in zip(("roll", "pitch", "yaw"), ends, strict=True)]
    return f"rotation = {{ {', '.join(parts)} }}"


def case_over(
    name: str, position: str, rotation: str = "", limit: float = 0.0, spread: float = 0.0, seed: int = 0
) -> Case:
    """A robot of the gallery over a workspace, with dimensions off by a part, and a limit on its actuators.

    The limit is in parts of the robot's size for slides, and 100 degrees times as much for cranks.
    """
    model, rng, size = build_model(name), np.random.default_rng(seed), size_of(name)
    lines = ["[units]", 'length = "m"', "[robot]", f'model = "{name}"', "[robot.parameters]"]
    for item in model.parameters:
        value = item.typical[0] * (1 + rng.uniform(-spread, spread))
        lines.append(f"{item.name} = {math.degrees(value) if item.dimension is Dimension.ANGLE else value!r}")
    lines += ["[pose]", f"position = {list(model.home)}", "[[task]]", 'name = "lift"', 'sense = "max"']
    lines += ["axis = [0, 0, 1]", "pitch = inf"]
    if limit:
        quantity = model.quantities[0]
        most = 100 * limit if quantity.dimension is Dimension.ANGLE else limit * size
        lines += ["[limits]", f"{quantity.name} = {{ min = {-most}, max = {most} }}"]
    lines += ["[workspace]", f"position = {position}", rotation]
    return case_from("\n".join(lines), "mine")


def about_home(name: str, part: float, degrees: float, limit: float = 0.0) -> Case:
    away = part * size_of(name)
    position = spans(*((each - away, each + away) for each in build_model(name).home))
    return case_over(name, position, "" if name in TRANSLATIONS else turns(*[(-degrees, degrees)] * 3), limit)


def shown(case: Case, pose: PoseNumbers) -> tuple[RobotState, int]:
    """The robot and its freedoms as the command that is printed shows them, its loops closed from home."""
    x, y, z = pose.axis.tolist()
    one = at_one_pose(case, tuple(pose.position.tolist()), Rotation((x, y, z), pose.angle))
    nlp = formulate(one)
    point = closed_start(nlp)
    assert state.loops_are_closed(nlp, point)
    found = state.evaluate(nlp, point)
    mobility = mobility_of(nlp, point, found)
    return found, 6 if mobility is None else mobility.freedoms


def check_shown(case: Case, judged: Judgement) -> int:
    """Check what refutes by what ``evaluate`` shows there; return the number of refutations."""
    count = 0
    for rank, is_of_constraints in zip(judged.ranks, (False, True), strict=False):
        if rank.outcome is Outcome.REFUTED and rank.y is not None:
            found, freedoms = shown(case, rank.box.pose(rank.y))
            assert freedoms > 6 - case.model.generic.constraints if is_of_constraints else found.is_singular
            count += 1
    for each in judged.extremes:
        name, _, limb = each.name.partition(" limb ")
        if each.outcome is not Outcome.REFUTED or each.key == "reach":
            continue
        assert each.pose is not None
        if each.key.startswith("workspace."):
            continue
        (quantity,) = (item for item in case.model.quantities if item.name == name)
        value = shown(case, each.pose)[0].quantities[name][quantity.owners.index(limb)]
        assert math.isclose(value, each.reached, rel_tol=1e-6, abs_tol=1e-9)
        count += 1
    return count


def verdicts(judged: Judgement) -> list[tuple[str, str, Outcome]]:
    ranks = [(f"rank {k}", "", each.outcome) for k, each in enumerate(judged.ranks)]
    return [*ranks, *((each.name, each.sense.value, each.outcome) for each in judged.extremes)]


def check_agreement(name: str, part: float, degrees: float, limit: float) -> int:
    """Check that verdicts are the same with a proof on paper and without, and refutations those that are shown."""
    case = about_home(name, part, degrees, limit)
    judged = judge_workspace(case, with_objective=False, jobs=1)
    again, _ = on_paper(case, with_objective=False, jobs=1)
    assert verdicts(judged) == verdicts(again)
    assert {each.outcome for each in judged.extremes if each.limit} <= {Outcome.PROVED, Outcome.REFUTED}
    count = check_shown(case, judged)
    assert check_shown(case, again) == count
    return count


@pytest.mark.parametrize("name", soaked(["3-prs", *EACH_KIND], ["3-prs"]))
def test_limits_are_judged_alike_with_a_proof_and_without(name: str) -> None:
    count, sides = check_agreement(name, 0.02, 5, 0.01), 2 * len(build_model(name).quantities[0].owners)
    assert count == sides if name in ("3-prs", "five-bar") else count >= sides


def test_limits_that_only_another_assembly_passes_are_proved_and_not_refuted() -> None:
    """The arms of a five-bar linkage by the law of cosines, elbows outside; one inside is beyond the limit."""
    case = about_home("five-bar", 0.02, 5, 0.4)
    judged, proof = on_paper(case, with_objective=False, jobs=1)
    limits = [each for each in judged.extremes if each.limit is not None and not each.key.startswith("workspace.")]
    assert [each.outcome for each in limits] == [Outcome.PROVED] * 4
    box = box_of(case)
    base, link, reach = 0.3, 0.25, 0.4
    points = np.vstack([[0, reach], np.random.default_rng(0).uniform(box.lower[:2], box.upper[:2], (20_000, 2))])
    for limb, side in (("1", -1.0), ("2", 1.0)):
        x, y = points[:, 0] - side * base / 2, points[:, 1]
        angles = np.arctan2(y, x) - side * np.arccos(np.hypot(x, y) / (2 * link))
        angles = angles[1:] - angles[0]
        own = [each for each in limits if each.name == f"actuator_angle limb {limb}"]
        low, high = (next(each for each in own if each.sense.value == sense) for sense in ("min", "max"))
        assert low.bound <= angles.min() < angles.max() <= high.bound
        assert low.reached <= angles.min() + 1e-3
        assert high.reached >= angles.max() - 1e-3
    # A bound over all assemblies is not within the limit; the proof follows the loops in that of home.
    assert not [each for each in proof.unproved if each.name.startswith("actuator_angle")]
    checked = {each.name for each in check_workspace_proof(proof, case).claims}
    assert checked >= {"regular", "yaw", "actuator_angle limb 1", "actuator_angle limb 2"}


def planar(part: float, degrees: float, seed: int) -> Case:
    """A planar 3-RRR in its plane, with dimensions off by up to 5 %."""
    away = part * size_of("planar-3-rrr")
    rotation = f"rotation = {{ axis = [0, 0, 1], angle = {{ min = {-degrees}, max = {degrees} }} }}"
    return case_over("planar-3-rrr", spans((-away, away), (-away, away), (0.0, 0.0)), rotation, 0.0, 0.05, seed)


def test_a_singular_pose_of_another_working_mode_refutes_nothing() -> None:
    case = planar(0.44809968, 21.472688, 9)
    box = box_of(case)
    problem, homes = problem_of(case), Homes(case, box, (), None)
    # Newton's method alone finds a pose that is singular with an arm bent the other way.
    other = prove_rank(problem, problem.locked, most_boxes=4000)
    assert other.outcome is Outcome.REFUTED
    assert not shown(case, box.pose(other.y))[0].is_singular
    assert not homes.is_singular(other.y, None, constraints=False)
    search = SingularSearch(problem, problem.locked, lambda at: homes.is_singular(at.y, at.errors, constraints=False))
    found = prove_rank(problem, problem.locked, most_boxes=4000, look=search.look)
    assert found.outcome is Outcome.REFUTED
    assert shown(case, box.pose(found.y))[0].is_singular


def test_ranks_are_refuted_by_what_is_shown_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    case = planar(0.13426, 19.47242, 3)
    problem, homes = problem_of(case), Homes(case, box_of(case), (), None)
    found = prove_ranks(problem, homes.is_singular)
    judged = Judgement(case, case.workspace, found.regular, (), found.constraints)
    assert check_shown(case, judged) == 1
    assert [homes.is_singular(found.regular.y, None, constraints=each) for each in (False, True)] == [True, False]
    monkeypatch.setattr(Homes, "is_singular", lambda *_, **__: False)
    with within(0.2):
        assert prove_ranks(problem, homes.is_singular).regular.outcome is Outcome.OPEN


@pytest.mark.parametrize(
    ("name", "away", "seed"),
    [("delta", (0.0, 0.0, 0.0), 1), ("delta", (0.0, 0.0, 0.0), 2), ("delta", (0.03, 0.01, -0.02), 3),
     ("delta", (0.1, -0.05, 0.1), 4), ("tripteron", (0.1, -0.05, 0.1), 5), ("3-puu", (0.0, 0.03, -0.03), 6)],
)  # fmt: skip
def test_proofs_about_robots_that_do_not_turn_are_accepted(name: str, away: tuple[float, ...], seed: int) -> None:
    """Dimensions are off by up to 3 %, positions about a point away from home."""
    size, home = size_of(name), build_model(name).home
    middle = [each + part * size for each, part in zip(home, away, strict=True)]
    position = spans(*((each - 0.02 * size, each + 0.02 * size) for each in middle))
    case = case_over(name, position, spread=0.03, seed=seed)
    judged, proof = on_paper(case, with_limits=False, with_objective=False, jobs=1)
    assert judged.is_regular
    assert [each.name for each in check_workspace_proof(proof, case).claims] == ["regular", "constraints regular"]


def test_a_proof_over_a_narrow_range_of_poses_is_accepted() -> None:
    """The yaw of a 3-RPS follows from the rest, and is not within the narrow range stated: the claim is about more."""
    size = size_of("3-rps")
    position = spans((-0.1 * size, 0.1 * size), (-0.1 * size, 0.1 * size), (1.13, 1.13 + 2e-6 * size))
    case = case_over("3-rps", position, turns((0.05, 0.0502), (-1.15, -1.1498), (0.3, 0.3002)), spread=0.03)
    judged, proof = on_paper(case, with_limits=False, with_objective=False, jobs=1)
    assert judged.is_regular
    assert len(check_workspace_proof(proof, case).claims) == 2


def test_a_proof_of_loops_that_are_closed_box_by_box_is_accepted() -> None:
    case = about_home("3-rps", 0.1, 20)
    judged, proof = on_paper(case, with_limits=False, with_objective=False, jobs=1)
    assert judged.ranks[0].boxes > 10
    assert len(check_workspace_proof(proof, case).claims) == 2


@pytest.mark.parametrize(("name", "arm"), [("3-rps", 0.0), ("tricept", 1.0)])
def test_freedoms_in_the_check_are_those_that_are_known(name: str, arm: float) -> None:
    """At home the platform rises, and turns about horizontal lines: through its origin, or an arm below it."""
    case = about_home(name, 0.05, 10)
    robot = PosedRobot(case, case.model, root_of(case))
    start = start_of(robot)
    matrix, freedoms = motion_matrix(robot, start, is_locked=False)
    motions = np.linalg.svd(robot.at(matrix, start))[2][-freedoms:, :6]
    # Velocities of the origin, then rotations times the length.
    turn = robot.length
    known = np.array([[0, 0, 1, 0, 0, 0], [0, -arm, 0, turn, 0, 0], [arm, 0, 0, 0, turn, 0]])
    assert np.linalg.matrix_rank(motions) == 3
    assert motions == pytest.approx(motions @ np.linalg.pinv(known) @ known, abs=1e-9)


def test_the_check_begins_in_the_working_mode_of_home() -> None:
    """Far from home the loops of a 4-RUU close with a limb bent the other way alone."""
    size = size_of("4-ruu")
    tried = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        middle = np.array(build_model("4-ruu").home) + rng.uniform(-0.5, 0.5, 3) * size
        position = spans(*((each - 0.01 * size, each + 0.01 * size) for each in middle.tolist()))
        case = case_over("4-ruu", position, turns((-1, 1), (-1, 1), (-1, 1)))
        robot = PosedRobot(case, closed_form(case.model).model, root_of(case))
        try:
            problem_of(case)
        except NotJudgedError:
            with pytest.raises(ProofError, match="in the assembly of home"):
                start_of(robot)
            tried += 1
        else:
            start_of(robot)
    assert 0 < tried < 6
