"""Search by limbs, and threads of a search: nothing better is dropped, results do not depend on threads."""

import math
from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from builders import Patch
from limb_cases import machine, poses, separated
from numpy_engine.bounding import NumpyEngine
from numpy_engine.limb_models import NumpyLimbEngine

from screwsynth.nlp import Case, CertificateStatus, certify_program, formulate, load_case, solve
from screwsynth.nlp.proof.boxes.engine import Engine, Threads, pieces
from screwsynth.nlp.proof.boxes.incumbent import Incumbent
from screwsynth.nlp.proof.boxes.limbs import shared as sharedsearch
from screwsynth.nlp.proof.boxes.limbs.decomposition import LimbBound, OwnBoxes, bound_limb
from screwsynth.nlp.proof.boxes.limbs.independent import IndependentSearch
from screwsynth.nlp.proof.boxes.limbs.shared import LeftOwn
from screwsynth.nlp.proof.boxes.search import State
from screwsynth.nlp.proof.boxes.tree import TreeRecord
from screwsynth.nlp.proof.certificate import branch_and_bound
from screwsynth.nlp.proof.checker.check import check_proof
from screwsynth.nlp.proof.checker.premises import fingerprint
from screwsynth.nlp.proof.checker.proof_file import ProofClaim
from screwsynth.nlp.proof.enclosure.forms import QuadraticModel
from screwsynth.nlp.proof.statement.limb_separation import separate
from screwsynth.nlp.proof.statement.standard_form import Condition, StandardForm, standard_form


@pytest.mark.parametrize(
    ("case", "shared", "own"),
    [
        (machine(2.0), 0, [6] * 6),
        (machine(2.0, pose_is_free=True), 6, [6] * 6),
        (load_case("paper-4.4-max"), 0, [6] * 3),
        (poses(0), 1, [3, 3]),
        (poses(7), 1, [2, 2, 2]),
    ],
    ids=["joints", "joints and pose", "axes", "two poses", "three poses"],
)
def test_limbs_are_read_off_the_expressions(case: Case, shared: int, own: list[int]) -> None:
    form, found = separated(case)
    assert len(found.shared) == shared
    assert [len(limb.own) for limb in found.limbs] == own
    every = [*found.shared, *(i for limb in found.limbs for i in limb.own)]
    assert sorted(every) == list(range(form.n))
    count = sum(len(limb.form.conditions) for limb in found.limbs)
    assert count + (0 if found.common is None else len(found.common.conditions)) == len(form.conditions)
    x = form.lower + np.random.default_rng(0).random(form.n) * (form.upper - form.lower)
    parts = [limb.form.value_at(x[[*found.shared, *limb.own]]) for limb in found.limbs]
    rest = found.constant if found.common is None else found.common.value_at(x[list(found.shared)])
    assert sum(parts) + rest == pytest.approx(form.value_at(x), rel=1e-12)
    for limb in found.limbs:
        assert limb.form.names == tuple(form.names[i] for i in (*found.shared, *limb.own))


@pytest.mark.parametrize("name", ["paper-4.1-helical", "hexapod-machining"])
def test_a_form_whose_terms_share_every_variable_has_no_limbs(name: str) -> None:
    assert separate(standard_form(formulate(load_case(name)))) is None


def test_independent_limbs_are_proved_by_themselves() -> None:
    solution = solve(machine(2.0), starts=2)
    found = certify_program(solution.nlp, solution.x, gap=1e-4)
    assert found.status is CertificateStatus.PROVED
    assert found.boxes < 1000
    form = standard_form(solution.nlp)
    rng = np.random.default_rng(0)
    points = form.lower[:, None] + rng.integers(0, 2, (form.n, 2000)) * (form.upper - form.lower)[:, None]
    values = ca.Function("f", [form.x], [form.functions[0]]).map(2000)(points).full()
    assert values.max() <= found.bound
    assert found.bound <= solution.F * (1 + 1.001e-4)
    free = certify_program(formulate(load_case("paper-4.4-min")), gap=1e-4)
    assert free.status is CertificateStatus.PROVED
    assert abs(free.bound) < 1e-5
    # A search that stops has a bound.
    solution = solve(machine(5.0), starts=2)
    found = certify_program(solution.nlp, solution.x, gap=1e-9, time_limit=0.05)
    assert found.status is CertificateStatus.INCOMPLETE
    assert found.bound >= solution.F


def test_a_limb_without_a_feasible_point_makes_the_whole_infeasible() -> None:
    case = load_case("paper-4.4-min")
    nlp = formulate(case)
    # Unit axes whose components are all small do not exist.
    lower, upper = nlp.lower.copy(), nlp.upper.copy()
    lower[:3], upper[:3] = -0.1, 0.1
    nlp = replace(nlp, lower=lower, upper=upper)
    recorder = TreeRecord()
    found = certify_program(nlp, gap=1e-2, recorder=recorder)
    assert found.status is CertificateStatus.INFEASIBLE
    proof = ProofClaim("none", "", "program", None, fingerprint(nlp), recorder.tree())
    assert check_proof(proof, nlp).bound == -math.inf


def test_limbs_that_leave_nothing_of_their_parts_meet_the_target() -> None:
    """Trap: the sum of the limbs' bounds is rounded up, and with it the largest ones were beyond the target."""
    form, found = separated(machine(2.0))
    for values in 10.0 ** np.random.default_rng(0).uniform(-3, 9, (9, len(found.limbs))):
        search = IndependentSearch(found, Incumbent(form), 1, TreeRecord())
        for each, value in zip(search._searches, values.tolist(), strict=True):
            each.rule = SimpleNamespace(incumbent=SimpleNamespace(value=-value))  # type: ignore[assignment]
            each.step = lambda most, each=each: setattr(each, "state", State([], [], most, 1))  # type: ignore[method-assign, misc]
        target = 1e-3 - values.sum()
        while search.is_open:
            search.step(target)
        assert target - 1e-5 * values.sum() <= search.bound <= target


def test_models_of_limbs_are_those_of_the_reference() -> None:
    for case in (machine(2.0, pose_is_free=True), poses(6)):
        form, found = separated(case)
        m, limb = len(found.shared), found.limbs[1].form
        rng = np.random.default_rng(1)
        size = (limb.upper - limb.lower)[:, None] * rng.uniform(0, 0.3, (limb.n, 200))
        low = limb.lower[:, None] + rng.random((limb.n, 200)) * ((limb.upper - limb.lower)[:, None] - size)
        one = Engine(limb, 1, m).limb_models(low, low + size)
        other = NumpyLimbEngine(NumpyEngine(limb, apart=True), m).limb_models(low, low + size)
        for name in ("is_possible", "defined", "holds", "stops_up", "stops_down"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        for name in ("lower", "upper"):
            np.testing.assert_allclose(getattr(one, name)[m:], getattr(other, name)[m:], rtol=1e-9, atol=1e-9)
        for name in ("slope_lo", "slope_hi", "bound", "value"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-9, atol=1e-9)
        for name, values in vars(one.L).items():
            np.testing.assert_allclose(values, getattr(other.L, name), rtol=1e-9, atol=1e-9)
        assert form.n > limb.n
        # Of the same models, with some that no number is known of.
        L = other.L
        with np.errstate(all="ignore"):
            level = np.where(np.arange(200) % 2, L.bound() - 0.1 * (L.bound() - L.middle), -np.inf)
        L.slope_lo[0, :3], L.H[0, 0, 3:6], L.middle[6:9] = np.nan, np.inf, np.nan
        by_kernel = QuadraticModel(**vars(L))
        with np.errstate(all="ignore"):
            bound, ends = L.bound(), L.ends_reaching(level)
        np.testing.assert_allclose(by_kernel.bound()[3:], bound[3:], rtol=1e-12)
        assert (by_kernel.bound()[:3] >= bound[:3] * (1 - 1e-12)).all()
        for mine, reference in zip(by_kernel.ends_reaching(level), ends, strict=True):
            np.testing.assert_allclose(mine, reference, rtol=1e-9, atol=1e-9)
        assert 0 < np.count_nonzero(ends.low > -1) < ends.low.size


def test_the_bounds_of_a_limb_without_its_tilt_hold_at_every_point() -> None:
    """phi_k - t_k at random points of random boxes, for random tilts' boxes; and the value reached is a lower bound."""
    _, found = separated(machine(2.0, pose_is_free=True))
    m, limb = len(found.shared), found.limbs[2].form
    engine = Engine(limb, shared=m)
    rng = np.random.default_rng(2)
    B, each, points = 30, 5, 40
    room = (limb.upper - limb.lower)[:, None]
    size = room * 10.0 ** rng.uniform(-4, -0.3, (limb.n, B))
    low = limb.lower[:, None] + rng.random((limb.n, B)) * (room - size)
    of = np.repeat(np.arange(B), each)
    own_size = size[m:, of] * rng.random((limb.n - m, of.size))
    own_low = low[m:, of] + rng.random(own_size.shape) * (size[m:, of] - own_size)
    own = OwnBoxes(own_low, own_low + own_size, of, int(of[-1]) + 1)
    good = low[m:] + 0.5 * size[m:]
    ends = np.concatenate([low[:m, of], own.lower]), np.concatenate([(low + size)[:m, of], own.upper])
    good_ends = np.concatenate([low[:m], good]), np.concatenate([(low + size)[:m], good])
    models, at_good = engine.limb_models(*ends), engine.limb_models(*good_ends)
    opposite = Engine(replace(limb, functions=(-limb.functions[0],)), shared=m)
    fall = opposite.limb_models(*good_ends).L
    with np.errstate(all="ignore"):
        part = bound_limb(own, good, models, at_good, fall, m)
    assert (part.reached > -np.inf).all()
    value = ca.Function("f", [limb.x], [limb.functions[0]])
    e = rng.uniform(-1, 1, (m, B, points))
    s = low[:m, :, None] + 0.5 * size[:m, :, None] * (1 + e)
    tilt = np.einsum("ib,ibp->bp", part.tilt.g, e) + 0.5 * np.einsum("ijb,ibp,jbp->bp", part.tilt.Q, e, e)
    o = own.lower[:, :, None] + rng.random((limb.n - m, of.size, points)) * own_size[:, :, None]

    def values(shared: np.ndarray, own_part: np.ndarray) -> np.ndarray:
        x = np.concatenate([shared, own_part]).reshape(limb.n, -1)
        return np.asarray(value.map(x.shape[1])(x).full().reshape(shared.shape[1:]))

    slack = 1e-12 * np.abs(part.best).max()
    above = values(s[:, of], o) - tilt[of]
    kept = part.bounds > -np.inf
    assert kept.any()
    assert (above[kept].max(axis=1) <= part.bounds[kept] + slack).all()
    reached = values(s, np.repeat(good[:, :, None], points, axis=2)) - tilt
    assert (reached.min(axis=1) >= part.reached - slack).all()
    # A dropped box is worse than the good point at every shared point.
    assert (above[~kept] <= reached[of][~kept] + slack).all()


def test_the_common_part_with_tilts_is_bounded_and_contracted() -> None:
    """phi_0 + best + t at random points of random boxes; points that are cut off reach less, or keep no condition."""
    _, found = separated(poses(2))
    x, rng, B, points = found.common.x, np.random.default_rng(4), 60, 300
    m, whole = x.numel(), (found.common.upper - found.common.lower)[:, None]
    first = Condition("sum", ca.sum1(x) - float(np.sum(found.common.lower + 0.4 * whole.ravel())), is_equation=False)
    form = replace(found.common, functions=(ca.sin(x[0]) + 0.3 * x[0] * x[m - 1],), conditions=(first,))
    size = whole * 10.0 ** rng.uniform(-3, -0.1, (m, B))
    low = form.lower[:, None] + rng.random((m, B)) * (whole - size)
    g, Q, best = rng.normal(size=(m, B)), rng.normal(size=(m, m, B)), rng.normal(size=B)
    Q = 0.1 * (Q + Q.transpose(1, 0, 2))
    tilts = np.concatenate([[best, np.abs(best), np.zeros(B)], g, Q.reshape(m * m, B)])
    e = rng.uniform(-1, 1, (m, B, points))
    s = low[:, :, None] + 0.5 * size[:, :, None] * (1 + e)
    given = ca.Function("f", [x], [form.functions[0], first.expression]).map(B * points)(s.reshape(m, -1))
    value, condition = (each.full().reshape(B, points) for each in given)
    value += best[:, None] + np.einsum("ib,ibp->bp", g, e) + 0.5 * np.einsum("ijb,ibp,jbp->bp", Q, e, e)
    feasible, level = condition <= 0, float(np.quantile(value, 0.7))
    models = Engine(form, 1, m).limb_models(low, low + size, tilts=tilts, threshold=level)
    bound, best_there = models.L.bound(), np.where(feasible, value, -np.inf).max(axis=1)
    assert (best_there <= bound + 1e-12 * np.abs(value).max()).all()
    inside = ((s >= models.lower[:, :, None]) & (s <= models.upper[:, :, None])).all(axis=0)
    inside &= models.is_possible[:, None]
    assert not (~inside & feasible & (value >= level)).any()
    assert (~inside).any(axis=1).sum() > B // 4
    assert (bound < best_there + 0.2 * np.ptp(value, axis=1)).sum() > B // 4


def both_searches(seed: int) -> tuple[float, float]:
    """Bound by limbs without an incumbent, and the best of some starts, both to be maximised."""
    solution = solve(poses(seed), starts=4)
    found = certify_program(solution.nlp, None, gap=1e-2, time_limit=20)
    sign = -solution.nlp.sign
    # A bound is proved, or there is none because everything was dropped.
    assert found.status in (CertificateStatus.PROVED, CertificateStatus.INFEASIBLE)
    return -math.inf if found.status is CertificateStatus.INFEASIBLE else sign * found.bound, sign * solution.F


def test_no_start_beats_a_bound_by_limbs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(branch_and_bound, "_WHOLE_BOX", 0)
    for seed in range(6):
        bound, best = both_searches(seed)
        assert bound >= best - 1e-9 * abs(best)


def test_a_fault_in_dropping_own_boxes_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """The test of the test above: own boxes are held against the threshold as if the other limbs gave nothing."""
    whole = sharedsearch.cut_own

    def careless(limb: LimbBound, sums: np.ndarray, threshold: float) -> LeftOwn:
        del sums
        return whole(limb, limb.best, threshold)

    monkeypatch.setattr(branch_and_bound, "_WHOLE_BOX", 0)
    monkeypatch.setattr(sharedsearch, "cut_own", careless)
    # No better incumbent is found, so a bound that is too low cannot hide behind it.
    monkeypatch.setattr(sharedsearch.SharedRule, "_improve", lambda *_: None)
    wrong = 0
    for seed in (0, 2, 6):
        bound, best = both_searches(seed)
        wrong += bound < best - 1e-6 * abs(best)
    assert wrong >= 1


def test_limbs_that_share_the_pose_are_bounded_soon() -> None:
    """42 free numbers, proved to 1e-3 in seconds: here to a half, and the bound holds at random corners of the box."""
    nlp = formulate(machine(2.0, pose_is_free=True))
    found = certify_program(nlp, gap=0.5, time_limit=30)
    assert found.status is CertificateStatus.PROVED
    assert found.incumbent <= found.bound <= 1.5 * found.incumbent * (1 + 1e-9)
    form = standard_form(nlp)
    rng = np.random.default_rng(3)
    # Corners of the joints' boxes; poses within the rotation's ball.
    share = rng.integers(0, 2, (form.n, 3000)).astype(float)
    share[-3:] = 0.5 + rng.uniform(-0.28, 0.28, (3, 3000))
    x = form.lower[:, None] + share * (form.upper - form.lower)[:, None]
    values = ca.Function("f", [form.x], [form.functions[0]]).map(3000)(x).full()
    assert values.max() <= found.bound


def test_limbs_that_share_the_pose_take_the_same_boxes_at_any_size_of_the_motion() -> None:
    case = machine(2.0, pose_is_free=True)
    slow = replace(case, tasks=[replace(case.tasks[0], twist=case.tasks[0].twist * 2.0**-10)])
    one, other = (certify_program(formulate(each), gap=3.0) for each in (case, slow))
    assert one.boxes == other.boxes
    assert one.bound == other.bound * 2.0**20


def test_an_inherited_bound_says_nothing_of_single_limbs() -> None:
    """Trap: the bound that a box has from its parent is no sum of limbs, so nothing of a limb follows from it."""
    form, found = separated(poses(0))
    search = sharedsearch.shared_search(form, found, Incumbent(form), 1)
    for _ in found.limbs:
        search.step(-np.inf)  # prepares a limb
    rule = search.rule
    boxes = search.state.left[0]
    for bound in (np.inf, 1.0):
        with np.errstate(all="ignore"):
            sums = rule._sums(boxes._replace(bound=np.array([bound])), -np.inf)
            lists = [sharedsearch.cut_own(limb, sums.sums, 0.9 * sums.sums[0]) for limb in sums.limbs]
        assert sums.bound[0] == min(bound, sums.sums[0])
        assert all(each.own.of.size for each in lists)


def test_the_time_limit_ends_the_preparation_of_limbs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Engines of long limbs take seconds: a search whose time is up builds no further one."""
    built: list[object] = []

    def counted(form: StandardForm, jobs: int, shared: int) -> Engine:
        built.append(form)
        return Engine(form, jobs, shared)

    monkeypatch.setattr(sharedsearch, "Engine", counted)
    nlp = formulate(machine(2.0, pose_is_free=True))
    found = certify_program(nlp, time_limit=1e-9)
    assert (found.status, found.open, built) == (CertificateStatus.INCOMPLETE, 1, [])
    assert found.reason.startswith("stopped after")
    assert certify_program(nlp, gap=0.9, time_limit=60).status is CertificateStatus.PROVED
    assert built


def test_pieces_cover_every_box_once_and_the_last_ones_are_small() -> None:
    for count in (1, 63, 64, 65, 127, 128, 129, 500, 4095, 4096):
        assert list(pieces(count, 1)) == [(0, count)]
        for jobs in (2, 3, 8, 64):
            edges = np.array(pieces(count, jobs))
            assert edges[0, 0] == 0
            assert edges[-1, 1] == count
            np.testing.assert_array_equal(edges[1:, 0], edges[:-1, 1])
            sizes = np.diff(edges).ravel()
            assert (sizes[:-1] >= sizes[-1] // 2).all()
            # The piece that a thread may be waited for.
            assert sizes[-1] < max(2 * 64, count // jobs)
    # Results keep the order of the items, and faults are passed on.
    for jobs in (1, 3):
        threads = Threads(jobs)
        assert threads.map(lambda item: item * item, range(20)) == [item * item for item in range(20)]
        with pytest.raises(ZeroDivisionError):
            threads.map(lambda item: 1 // item, [1, 0])


@pytest.mark.parametrize(
    ("case", "gap", "whole", "least"),
    [
        (load_case("paper-4.1-helical"), 0.1, 12, 1000),
        (load_case("paper-4.4-max"), 0.9, 12, 1000),
        (poses(0), 1e-4, 0, 50),
    ],
    ids=["whole box", "limbs", "limbs with shared variables"],
)
def test_searches_do_not_depend_on_threads(case: Case, gap: float, whole: int, least: int, monkeypatch: Patch) -> None:
    monkeypatch.setattr(branch_and_bound, "_WHOLE_BOX", whole)
    nlp = formulate(case)
    found = [certify_program(nlp, gap=gap, jobs=jobs) for jobs in (1, 2, 3)]
    for each in found[1:]:
        assert (each.boxes, each.bound, each.incumbent) == (found[0].boxes, found[0].bound, found[0].incumbent)
    assert found[0].boxes > least
