"""The comparison with other methods: its judgement catches wrong answers, and every installed peer finds an optimum."""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

BENCH = Path(__file__).parents[1] / "bench"
CASE = "paper-4.2-rotation"
HELICAL = "paper-4.1-helical"
#: Optima by case, solved once.
KNOWN: dict[str, Any] = {}


@pytest.fixture(scope="module")
def bench() -> SimpleNamespace:
    """Modules of ``bench``, which is no package of the project."""
    sys.path.append(str(BENCH))
    names = ("attempts", "judging", "problems", "summary", "growth", "page", "race")
    places = {"peers": "peers", "interface": "peers.interface"} | {name: f"comparison.{name}" for name in names}
    return SimpleNamespace(**{name: importlib.import_module(place) for name, place in places.items()})


def optimum(problem: Any) -> Any:
    from screwsynth.nlp import solve  # noqa: PLC0415 - as a peer does

    if problem.case.name not in KNOWN:
        KNOWN[problem.case.name] = solve(problem.case, starts=2, jobs=1).x
    return (KNOWN[problem.case.name] - problem.nlp.centre) / problem.nlp.scale


def turned_too_far(problem: Any) -> Any:
    # The corner of the rotation's box is outside of its ball, and has a larger F.
    return np.where(np.arange(problem.n) < 3, optimum(problem), np.sign(optimum(problem)))


def slightly_worse(problem: Any) -> Any:
    return optimum(problem) * (1 - 1e-3)


def not_a_number(problem: Any) -> Any:
    return np.full(problem.n, np.nan)


def fault(problem: Any) -> Any:
    raise ValueError(f"no answer for {problem.n} variables")


def endless(problem: Any) -> Any:
    random = np.random.default_rng(1)
    while True:
        problem.f(random.uniform(-1, 1, problem.n))


def idle(problem: Any) -> Any:
    while True:
        problem.n  # noqa: B018 - work without evaluations


def death(problem: Any) -> Any:
    os._exit(problem.n)


def test_only_feasible_optima_count(bench: SimpleNamespace) -> None:
    subject = bench.problems.subject_of(HELICAL)
    budget = bench.interface.Budget(300, 0.2)
    case = {"F": 407.2106717529294, "is_proved": True, "sign": -1.0, "scale": subject.nlp.objective_scale}
    counts = {}
    for search in (optimum, turned_too_far, slightly_worse, not_a_number, fault, endless, idle):
        peer = bench.interface.Peer(search.__name__, "screwsynth" if search is optimum else "numpy", search)
        found = bench.race._attempt_data(bench.attempts.attempt(peer, subject, 0, budget))
        pair = {"peer": peer.name, "note": "", "losses": 0, "attempts": [found]}
        best = bench.summary.best_of(case, [pair])
        assert case["F"] == best.reference.F, "an answer that is not feasible became the best known"
        counts[search.__name__] = bench.summary.score_of(pair, best.reference, is_global=False)
    assert [(name, score.correct) for name, score in counts.items() if score.correct] == [("optimum", 1)]
    assert "no answer for 6 variables" in counts["fault"].note
    assert counts["endless"].evaluations == 300
    assert counts["endless"].spent == counts["idle"].spent == 1


def test_feasible_is_on_the_right_side_of_a_bound(bench: SimpleNamespace) -> None:
    nlp = bench.problems.subject_of(HELICAL).nlp
    radius = np.sqrt(nlp.g_upper[0])
    for factor, is_feasible in ((1 - 1e-7, True), (1 + 1e-7, False)):
        x = nlp.centre.copy()
        x[3] = factor * radius
        verdict = bench.judging.judge(nlp, x)
        assert verdict.is_feasible is is_feasible, verdict


def test_a_better_answer_becomes_the_best_known(bench: SimpleNamespace) -> None:
    case = {"F": 10.0, "is_proved": True, "sign": -1.0, "scale": 10.0}
    verdict = {"F": 10.1, "violation": 0.0, "closed": True, "in_home_mode": True}
    elsewhere = {**verdict, "F": 10.2, "in_home_mode": False}
    pairs = [{"peer": "other", "attempts": [{"verdict": each, "polished": None} for each in (verdict, elsewhere)]}]
    best = bench.summary.best_of(case, pairs)
    assert (best.reference.F, best.finder, best.contradicts_proof) == (10.1, "other", True)
    assert bench.summary.elsewhere(case, pairs) == (1, 10.2)


def test_scaled_problem_is_the_program(bench: SimpleNamespace) -> None:
    """Derivatives of the peers' problem agree with central differences of its functions."""
    for name in (HELICAL, "3-rps"):
        subject = bench.problems.subject_of(name)
        problem = bench.interface.Problem(subject.case, subject.nlp, 3, bench.interface.Budget(10_000, 60.0))
        s, step = 0.9 * problem.start, 1e-6
        rows = [np.vstack([problem.f_gradient(s), problem.h_jacobian(s), problem.e_jacobian(s)])]
        columns = []
        for unit in np.eye(problem.n):
            ahead, behind = (
                np.concatenate([[problem.f(each)], problem.h(each), problem.e(each)])
                for each in (s + step * unit, s - step * unit)
            )
            columns.append((ahead - behind) / (2 * step))
        np.testing.assert_allclose(rows[0], np.array(columns).T, atol=1e-7)
        assert problem.evaluations == 2 * problem.n, "values at one point are evaluated once"
        assert (problem.gradients, len(problem.h(s)), len(problem.e(s))) == (1, problem.inequalities, problem.equations)


def test_exponents_and_factors(bench: SimpleNamespace) -> None:
    sizes = (1, 2, 4, 8)
    assert bench.growth.slope(sizes, [3 * size**1.7 for size in sizes], is_exponential=False) == pytest.approx(1.7)
    assert bench.growth.slope(sizes, [3 * 2.5**size for size in sizes], is_exponential=True) == pytest.approx(2.5)
    assert bench.growth.slope((4,), [1.0], is_exponential=False) is None


def test_page_has_a_place_for_every_section(bench: SimpleNamespace) -> None:
    """A broken run leaves a page that says which sections were not measured."""
    text = (BENCH.parent / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    machine = dict.fromkeys(("date", "processor", "system", "python", "compiler", "revision"), "x")
    data = {"run": "quick", "machine": {**machine, "load": 0.1, "cores": 2, "packages": {}}, "sections": {}}
    assert bench.page.rendered(text, data).count("Not measured in this run.") == 4


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_every_installed_peer_finds_an_optimum(bench: SimpleNamespace) -> None:
    """One attempt of each on the smallest case; a process that dies is a row that says so."""
    dying = bench.interface.Peer("dying", "numpy", death)
    missing = bench.interface.Peer("missing", "no_such_package", optimum)
    peers = (*bench.peers.all_peers(), dying, missing)
    plan = bench.race.Plan((CASE,), 1, bench.interface.Budget(20_000, 3.0), 30.0, 120.0, 4, 5.0)
    kept: list[dict[str, Any]] = []
    bench.race.run(plan, kept.append, peers)
    found = kept[-1]
    best = bench.summary.best_of(found["cases"][CASE], found["pairs"]).reference
    assert best.is_proved
    for pair, peer in zip(found["pairs"], peers, strict=True):
        score = bench.summary.score_of(pair, best, is_global=peer.kind == "global")
        if peer is dying:
            assert score.note == "the process died with exit status 4"
        elif peer is missing or not bench.race.loads(peer.package):
            assert score.note == f"{peer.package} is not installed, or does not load"
        else:
            assert (score.correct if score.polished is None else score.polished) == 1, (peer.name, score)
        assert peer.lines > 0
