"""Cases in which a bound could be stated as proven and be wrong."""

import math
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from screwsynth.models import Dimension, hexapod
from screwsynth.nlp import Case, Free, Nlp, Sense, Task, load_case
from screwsynth.nlp.case.limits.constraint import BoundedConstraint, Constraint, Reading
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.errors import UncoveredError
from screwsynth.nlp.program.layout import assemble, lay_out
from screwsynth.nlp.proof.boxes.tree import TreeRecord
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.premises import fingerprint
from screwsynth.nlp.proof.checker.proof_file import ProofClaim
from screwsynth.nlp.proof.checker.tree import Node
from screwsynth.nlp.proof.statement.form import without_ties
from screwsynth.nlp.proof.statement.machine import Legs
from screwsynth.nlp.proof.workspace.ranks import ranks
from screwsynth.nlp.proof.workspace.ranks.loop_boxes import Examiner
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box
from screwsynth.nlp.proof.workspace.robot.posed_robot import build_problem
from screwsynth.nlp.proof.workspace.verdict import Outcome

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


def program(objective: Callable[[SX, SX], SX], limit: Callable[[SX, SX], SX] | None = None) -> Nlp:
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
    nlp = program(lambda x, y: -2 * ca.exp(-((50 * (x - 0.737)) ** 2)) + y**2)
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
    nlp = program(
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
    nlp = program(lambda x, y: 10 * jump(x) - x + (x + y) ** 2)
    with pytest.raises(UncoveredError, match="the robot's expressions hold the"):
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
