"""Threads of a search: pieces cover every box once, and results are the same bit for bit for any number of threads."""

import numpy as np
import pytest
from limb_cases import poses

from screwsynth.nlp import Case, certify_program, formulate, load_case
from screwsynth.nlp.proof.boxes.engine import Threads, pieces
from screwsynth.nlp.proof.certificate import branch_and_bound


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


def test_results_keep_the_order_of_the_items_and_faults_are_passed_on() -> None:
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
def test_boxes_and_bounds_do_not_depend_on_the_number_of_threads(
    case: Case, gap: float, whole: int, least: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(branch_and_bound, "_WHOLE_BOX", whole)
    nlp = formulate(case)
    found = [certify_program(nlp, gap=gap, jobs=jobs) for jobs in (1, 2, 3)]
    for each in found[1:]:
        assert (each.boxes, each.bound, each.incumbent) == (found[0].boxes, found[0].bound, found[0].incumbent)
    assert found[0].boxes > least
