"""Proofs by limbs that share variables: what the checker accepts, and that it rejects what was tampered with."""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from limb_cases import machine, poses, separated

from screwsynth.nlp import Case, Free, Rotation
from screwsynth.nlp.case.settings import Search
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.program.nlp import Nlp
from screwsynth.nlp.proof.boxes.limbs import shared as sharedsearch
from screwsynth.nlp.proof.boxes.limbs.decomposition import LimbBound, bound_limb, first_largest_of_lists
from screwsynth.nlp.proof.boxes.tree import TreeRecord
from screwsynth.nlp.proof.certificate import branch_and_bound
from screwsynth.nlp.proof.certificate.branch_and_bound import certify_program
from screwsynth.nlp.proof.certificate.certificate import CertificateStatus
from screwsynth.nlp.proof.checker.arithmetic import PolynomialArithmetic
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.polymodels import Tilts, forms_of, polynomial_sum
from screwsynth.nlp.proof.checker.premises import fingerprint
from screwsynth.nlp.proof.checker.proof_file import ProofClaim, ProofError
from screwsynth.nlp.proof.checker.tree import Node, SharedLeaves, leaf_bytes, read_shared
from screwsynth.nlp.proof.statement.standard_form import standard_form
from screwsynth.nlp.solver.multistart import ProgramSolution, solve_program

GAP = 1e-2


def near_home() -> Case:
    """The hexapod with 36 free joint coordinates, and its pose free by a little."""
    case = machine(2.0)
    position: list[object] = [Free(-0.3, 0.3), Free(-0.3, 0.3), Free(19.8, 20.2)]
    rotation = Rotation(axis=None, angle=Free(-0.0175, 0.0175))
    return Case(case.model, case.parameters, position, case.tasks, rotation=rotation)


def proof_of(nlp: Nlp, gap: float, x: np.ndarray | None = None) -> ProofClaim:
    """The proof that a search records, whatever it is worth."""
    recorder = TreeRecord()
    found = certify_program(nlp, x, gap=gap, jobs=1, recorder=recorder)
    assert found.status in (CertificateStatus.PROVED, CertificateStatus.INFEASIBLE)
    bound = None if found.status is CertificateStatus.INFEASIBLE else -nlp.sign * found.bound
    return ProofClaim("limbs", "", "program", bound, fingerprint(nlp), recorder.tree())


@pytest.fixture(scope="module")
def best() -> ProgramSolution:
    return solve_program(formulate(near_home()), Search(starts=1))


@pytest.fixture(scope="module")
def nlp(best: ProgramSolution) -> Nlp:
    return best.nlp


@pytest.fixture(scope="module")
def proof(best: ProgramSolution) -> ProofClaim:
    return proof_of(best.nlp, GAP, best.x)


def middle_leaf(proof: ProofClaim, nlp: Nlp) -> SharedLeaves:
    """The leaf whose box is nearest to home's rotation, in which poses are feasible."""
    _, found = separated(nlp.case)
    (leaves,) = read_shared(proof.tree, found.common.lower, found.common.upper, len(found.limbs))
    leaves = leaves.select(np.isfinite(leaves.bounds).all(axis=0))
    away = np.linalg.norm(np.clip(0.0, leaves.lower[3:], leaves.upper[3:]), axis=0)
    return SharedLeaves(*(each[..., away.argmin()] for each in leaves))


def rejected(proof: ProofClaim, nlp: Nlp) -> str:
    with pytest.raises(ProofError) as caught:
        check_proof(proof, nlp)
    return str(caught.value)


def test_a_proof_by_limbs_that_share_variables_holds(proof: ProofClaim, nlp: Nlp) -> None:
    assert proof.tree[0] == Node.SHARED
    checked = check_proof(proof, nlp)
    assert checked.leaves > 1
    assert checked.bound == proof.bound


def test_boxes_outside_of_the_ball_of_rotations_are_shown_by_it(best: ProgramSolution) -> None:
    """Beyond the ball the sum of the limbs is above the bound, which needs small boxes."""
    proof = proof_of(best.nlp, 5e-4, best.x)
    assert bytes([Node.INFEASIBLE]) in proof.tree
    assert check_proof(proof, best.nlp).bound == proof.bound


def changed(proof: ProofClaim, nlp: Nlp, change: Callable[[np.ndarray, np.ndarray, np.ndarray], object]) -> ProofClaim:
    """The proof with other numbers (K,), (K, m), (K, m, m) in one leaf, which ``change`` writes in place."""
    leaf = middle_leaf(proof, nlp)
    old = leaf_bytes(leaf.bounds, leaf.g, leaf.Q)
    bounds, g, Q = leaf.bounds.copy(), leaf.g.copy(), leaf.Q.copy()
    change(bounds, g, Q)
    assert proof.tree.count(old) == 1
    return replace(proof, tree=proof.tree.replace(old, leaf_bytes(bounds, g, Q)))


def test_what_was_tampered_with_is_rejected(proof: ProofClaim, nlp: Nlp) -> None:
    assert proof.bound is not None
    size = abs(proof.bound)
    for less in (2 * GAP, 0.7 * GAP):
        assert "could not be shown" in rejected(replace(proof, bound=proof.bound - less * size), nlp)
    leaf = middle_leaf(proof, nlp)
    node = leaf_bytes(leaf.bounds, leaf.g, leaf.Q)
    assert "ends before" in rejected(replace(proof, tree=proof.tree.replace(node, b"")), nlp)
    assert "goes on" in rejected(replace(proof, tree=proof.tree + node), nlp)
    assert "does not exist" in rejected(replace(proof, tree=bytes([Node.SHARED, Node.HALF, 6])), nlp)
    assert "a node" in rejected(replace(proof, tree=bytes([Node.SHARED, Node.FACE_UPPER, 0])), nlp)
    nothing = replace(proof, tree=proof.tree.replace(node, bytes([Node.INFEASIBLE])))
    assert "sum of the limbs" in rejected(nothing, nlp)

    def lower(bounds: np.ndarray, *_: np.ndarray) -> None:
        bounds[2] -= 0.02 * size

    def higher(bounds: np.ndarray, *_: np.ndarray) -> None:
        bounds[2] += 0.02 * size

    def tilted(_: np.ndarray, g: np.ndarray, __: np.ndarray) -> None:
        g[1, 0] += 0.05 * size

    def exchanged(*numbers: np.ndarray) -> None:
        for each in numbers:
            each[[0, 3]] = each[[3, 0]]

    def emptied(bounds: np.ndarray, *_: np.ndarray) -> None:
        bounds[:] = np.inf
        bounds[4] = -np.inf

    def unknown(_: np.ndarray, g: np.ndarray, __: np.ndarray) -> None:
        g[0, 0] = np.nan

    assert "limb with base_3" in rejected(changed(proof, nlp, lower), nlp)
    assert "sum of the limbs" in rejected(changed(proof, nlp, higher), nlp)
    for change in (tilted, exchanged, emptied):
        assert "could not be shown" in rejected(changed(proof, nlp, change), nlp)
    assert "no number" in rejected(changed(proof, nlp, unknown), nlp)


def test_proofs_of_several_poses_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    """Limbs with conditions of their own, maximum and minimum, with limits and without."""
    monkeypatch.setattr(branch_and_bound, "_WHOLE_BOX", 0)
    for seed in (0, 7):
        nlp = formulate(poses(seed))
        proof = proof_of(nlp, 1e-2)
        assert proof.tree[0] == Node.SHARED
        check_proof(proof, nlp)


def test_a_limb_without_a_feasible_point_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(branch_and_bound, "_WHOLE_BOX", 0)
    nlp = formulate(poses(2))
    places = [i for i, name in enumerate(standard_form(nlp).names) if i in separated(nlp.case)[1].limbs[0].own]
    # Legs of at most 34 mm do not reach so far.
    far = np.array(nlp.lower)
    far[places] += 100.0
    proof = proof_of(replace(nlp, lower=far, upper=np.array(nlp.upper) + (far - nlp.lower)), 1e-2)
    assert proof.bound is None
    assert check_proof(proof, replace(nlp, lower=far, upper=np.array(nlp.upper) + (far - nlp.lower))).leaves == 1


@pytest.mark.parametrize("part", [0.01, 0.03])
def test_a_fault_in_dropping_own_boxes_is_found(
    monkeypatch: pytest.MonkeyPatch, best: ProgramSolution, part: float
) -> None:
    """Own boxes are dropped for a value at the good point that is too large by a part of itself."""

    def careless(*given: object) -> LimbBound:
        found = bound_limb(*given)  # type: ignore[arg-type]
        own = found.own
        reached = found.reached + part * np.abs(found.reached)
        bounds = np.where(found.bounds < reached[own.of], -np.inf, found.bounds)
        best = np.maximum.reduceat(bounds, own.starts)
        return replace(found, bounds=bounds, best=best, top=first_largest_of_lists(bounds, own))

    monkeypatch.setattr(sharedsearch, "bound_limb", careless)
    wrong = proof_of(best.nlp, GAP, best.x)
    assert "could not be shown" in rejected(wrong, best.nlp)


@pytest.mark.parametrize("kind", ["limb", "minus limb", "zeros", "minus zeros"])
def test_models_of_limbs_minus_tilts_bound_every_point(kind: str) -> None:
    """phi_k - t_k at random points of random pieces of random boxes, for both signs of the squared quotients."""
    _, found = separated(near_home())
    m, limb = len(found.shared), found.limbs[1].form
    function, sign = limb.functions[0] + 3 * limb.x[0], -1.0 if kind.startswith("minus") else 1.0
    if "zeros" in kind:
        # A numerator that is 0 in every box, where the square of its error is most of the quotient.
        e = limb.x - 0.5 * (limb.lower + limb.upper)
        function = (e[6] * e[7] + 0.1 * e[8] + e[9] * e[6]) ** 2 / (9 + e[6] ** 2)
    limb = replace(limb, functions=(sign * function,))
    rng = np.random.default_rng(1)
    L, points = 100, 100
    room = (limb.upper - limb.lower)[:, None]
    # Boxes along few variables, where bounds are sharp, and along all.
    size = room * 10.0 ** rng.uniform(-4, 0, (limb.n, L)) * (rng.random((limb.n, L)) < rng.choice([0.1, 0.3, 1.0], L))
    low = limb.lower[:, None] + (0.5 if "zeros" in kind else rng.random((limb.n, L))) * (room - size)
    high = low + size
    outer = low[:m] - rng.random((m, L)) * room[:m], high[:m] + rng.random((m, L)) * room[:m]
    scale = 10.0 ** rng.uniform(-1, 2, L) * rng.integers(0, 2, L)
    Q = rng.normal(size=(m, m, L)) * scale
    tilts = Tilts.over(*outer, rng.normal(size=(m, L)) * scale, Q + Q.swapaxes(0, 1))
    with np.errstate(all="ignore"):
        (value,) = PolynomialArithmetic(ca.Function("f", [limb.x], [limb.functions[0]]))(low, high)
        assert np.isfinite(value.s).all()
        forms = forms_of([value - tilts.polynomial(low, high)], low, high, limb)
        bound = polynomial_sum(forms, np.ones((1, L))).bound()
    share = np.concatenate([rng.random((limb.n, L, points)), rng.integers(0, 2, (limb.n, L, points))], axis=2)
    x = low[:, :, None] + share * size[:, :, None]
    flat = x.reshape(limb.n, -1)
    value = ca.Function("f", [limb.x], [limb.functions[0]]).map(flat.shape[1])(flat).full().reshape(L, -1)
    t = tilts.select(np.repeat(np.arange(L), 2 * points)).at(flat[:m]).reshape(L, -1)
    excess = (value - t).max(axis=1) - bound
    size = np.abs(value).max(axis=1) + tilts.sizes()
    assert (excess <= 1e-14 * size).all()
    # The bound is no wider than it must be: at small boxes it is reached.
    assert (np.median(-excess) < 0.5 * np.median(size)) or "zeros" in kind
