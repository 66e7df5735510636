"""The loop of branch and bound by itself: orders, boxes that are too small, and boxes that are examined again."""

import math

import numpy as np
import pytest

from screwsynth.nlp.proof.boxes.search import (
    SMALL,
    TOO_SMALL,
    WHOLE,
    Boxes,
    Effort,
    Order,
    Rule,
    Search,
    Verdicts,
    bisected,
    joined,
    some,
)


class Peak(Rule[np.ndarray]):
    """The largest value of ``1 - |x - 0.3| - |y - 0.6|``; boxes carry how often they were bisected."""

    top = np.array([0.3, 0.6])
    block = 8

    def __init__(self, gap: float) -> None:
        self.gap, self.seen = gap, list[np.ndarray]()

    def divided(self, boxes: Boxes[np.ndarray]) -> Boxes[np.ndarray]:
        parts = bisected(boxes)
        return parts._replace(more=parts.more + 1)

    def examine(self, boxes: Boxes[np.ndarray]) -> Verdicts[np.ndarray]:
        nearest = np.clip(self.top, boxes.lower, boxes.upper)
        width = boxes.upper - boxes.lower
        bound = 1 - np.abs(nearest - self.top).sum(axis=1) + width.sum(axis=1)
        done = bound <= 1 + self.gap
        self.seen.append(np.hstack([boxes.lower, boxes.upper])[done])
        found = boxes._replace(bound=bound, split=np.argmax(width, axis=1))
        closed = float(bound[done].max(initial=-math.inf))
        return Verdicts(some(found, ~done), closed, len(bound))


def search_of(rule: Peak, order: Order, least: float = 0.0) -> Search[Peak]:
    root = Boxes(np.zeros((1, 2)), np.ones((1, 2)), np.array([math.inf]), np.array([WHOLE]), np.zeros(1))
    return Search(rule, root, whole=np.ones(2), least=(least, least), order=order)


@pytest.mark.parametrize("order", Order)
def test_every_order_closes_the_same_boxes_which_cover_the_whole(order: Order) -> None:
    rule, same = Peak(0.02), Peak(0.02)
    search, other = search_of(rule, order), search_of(same, Order.NEWEST)
    assert Effort().run(search, lambda: None) == Effort().run(other, lambda: None) == ""
    closed, expected = (np.concatenate(each.seen) for each in (rule, same))
    assert {tuple(each) for each in closed.tolist()} == {tuple(each) for each in expected.tolist()}
    assert (closed[:, 2:] - closed[:, :2]).prod(axis=1).sum() == 1.0
    assert search.boxes == 2 * len(closed) - 1
    assert 1.0 <= search.bound <= 1.02
    assert (search.left, search.is_open) == (0, False)


def test_boxes_that_are_too_small_keep_their_bound() -> None:
    search = search_of(Peak(0.0), Order.LARGEST, least=2.0**-6)
    assert Effort().run(search, lambda: None if search.is_open else TOO_SMALL) == TOO_SMALL
    assert search.left
    assert not search.state.waiting
    small = joined(search.state.small)
    assert (small.split == SMALL).all()
    assert small.bound.max() == search.bound > 1.0
    assert ((small.upper - small.lower).max(axis=1) < 2.0**-6).all()
    # Each carries how often it was bisected, which its size tells.
    assert (2.0**-small.more == (small.upper - small.lower).prod(axis=1)).all()


def test_a_search_ends_at_its_largest_number_of_boxes() -> None:
    search = search_of(Peak(1e-9), Order.LARGEST_CHUNK)
    assert Effort(most_boxes=100).run(search, lambda: None) == f"stopped after {search.boxes} boxes"
    left = [each.upper - each.lower for each in search.state.left]
    assert search.bound >= 1.0
    assert sum(float(each.prod(axis=1).sum()) for each in left) < 1.0


class Better(Peak):
    """Finds a better point once, after boxes became too small."""

    found = False

    def examine(self, boxes: Boxes[np.ndarray]) -> Verdicts[np.ndarray]:
        verdicts = super().examine(boxes)
        is_last = not self.found and len(verdicts.left.split) == 1
        self.found |= is_last
        self.gap = 1.0 if self.found else self.gap
        return verdicts._replace(is_better=is_last)


def test_boxes_that_are_too_small_are_examined_again_once_a_better_point_is_known() -> None:
    search = search_of(Better(0.0), Order.NEWEST, least=2.0**-2)
    assert Effort().run(search, lambda: None) == ""
    assert search.rule.found
    assert search.left == 0
