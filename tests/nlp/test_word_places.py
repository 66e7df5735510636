"""Places for words in pictures: lines and boxes on paper, all pairs at once, and the choice of the cheapest place."""

import numpy as np
import pytest
from builders import Array
from test_figures import cross, crosses_box, distance

from screwsynth.nlp import build_model
from screwsynth.nlp.output.pictures import places
from screwsynth.nlp.output.pictures.drawing import drawing_of_model
from screwsynth.nlp.output.pictures.figures import figure_of
from screwsynth.nlp.output.pictures.segments import distances_to_segments, segments_cross, segments_in_boxes


@pytest.fixture
def segments() -> Array:
    """Lines (k, 4): askew, level, upright, and points."""
    found = np.random.default_rng(1).uniform(0.0, 100.0, (60, 4))
    found[10:20, 3] = found[10:20, 1]
    found[20:30, 2] = found[20:30, 0]
    found[30:35, 2:] = found[30:35, :2]
    return found


def test_a_line_is_within_a_box_where_cutting_by_each_side_leaves_a_part(segments: Array) -> None:
    corners = np.random.default_rng(2).uniform(0.0, 100.0, (50, 2, 2))
    boxes = np.hstack([corners.min(axis=1), corners.max(axis=1)])
    expected = [[crosses_box(line[:2], line[2:], tuple(box)) for line in segments] for box in boxes]
    assert np.array_equal(segments_in_boxes(segments, boxes), expected)
    assert 0 < np.count_nonzero(expected) < np.size(expected)


def test_a_line_that_ends_at_a_side_is_within_the_box_and_a_line_just_beside_it_is_not() -> None:
    box = np.array([[10.0, 10.0, 20.0, 20.0]])
    ends = np.array([[0.0, 15, 10, 15], [0, 15, 9.999, 15], [0, 20, 30, 20], [0, 20.001, 30, 20.001], [12, 12, 13, 14]])
    assert segments_in_boxes(ends, box).tolist() == [[True, False, True, False, True]]
    assert segments_in_boxes(np.zeros((0, 4)), box).shape == (1, 0)


def test_lines_cross_where_they_have_a_point_in_common(segments: Array) -> None:
    askew, lines = segments[:10], segments[35:]
    expected = [[cross(line.reshape(2, 2), each.reshape(2, 2)) for each in askew] for line in lines]
    assert np.array_equal(segments_cross(askew, lines), expected)
    assert 0 < np.count_nonzero(expected) < np.size(expected)


def test_a_point_is_as_far_from_a_line_as_from_its_nearest_point(segments: Array) -> None:
    points, lines = segments[:30, :2], segments[35:]
    for line, row in zip(lines, distances_to_segments(points, lines), strict=True):
        a, b = line[:2], line[2:]
        for point, found in zip(points, row, strict=True):
            is_beside = 0 <= (point - a) @ (b - a) <= (b - a) @ (b - a)
            ends = min(np.linalg.norm(point - a), np.linalg.norm(point - b))
            assert found == pytest.approx(distance(point, a, b) if is_beside else ends, abs=1e-9)


def test_words_stand_at_the_cheapest_of_all_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search ends early, and no place that it leaves out is better: all places at once give the same picture."""
    drawing = drawing_of_model(build_model("6-ups"))
    found = []
    for count in (5, 160, 100_000):
        monkeypatch.setattr(places, "_AT_ONCE", count)
        found.append([text.get_position() for text in figure_of([drawing]).axes[0].texts])
    assert found[0] == found[1] == found[2]
