"""Graphs of mechanisms against their definitions on small random ones, and in a number of steps that grows linearly."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

from screwsynth.models.mechanism.topology import between, bridges_between, path_between, reached, spanning_tree

Edge = tuple[str, str]


def simple_paths(edges: list[Edge], node: str, end: str, passed: tuple[str, ...] = ()) -> Iterator[frozenset[int]]:
    """The edges of each path that passes each node once."""
    if node == end:
        yield frozenset()
        return
    for k, edge in enumerate(edges):
        if node in edge and edge[0] != edge[1]:
            other = edge[1] if edge[0] == node else edge[0]
            if other not in (*passed, node):
                for path in simple_paths(edges, other, end, (*passed, node)):
                    yield path | {k}


def test_small_graphs_against_all_their_paths() -> None:
    rng, loops = np.random.default_rng(8), 0
    for _ in range(600):
        n = int(rng.integers(2, 7))
        edges = [(str(one), str(other)) for one, other in rng.integers(n, size=(rng.integers(10), 2))]
        first, last = map(str, rng.permutation(n)[:2])
        paths = list(simple_paths(edges, first, last))
        loops += len(paths) > 1
        assert between(edges, first, last) == sorted(frozenset().union(*paths))
        found, shortest = bridges_between(first, last, edges), path_between(first, last, edges)
        if not paths:
            assert (shortest, found.bridges, found.is_open) == (None, [], False)
            assert last not in reached(first, edges)
            continue
        assert shortest is not None
        assert frozenset(shortest) in paths
        assert len(shortest) == min(map(len, paths))
        every = frozenset.intersection(*paths)
        assert found.bridges == [k for k in shortest if k in every]
        assert found.is_open == (len(paths) == 1 and len(found.bridges) == len(shortest))
    assert loops > 100


class Counted:
    """A node that counts how often it is looked at."""

    looks = 0

    def __init__(self, number: int) -> None:
        self.number = number

    def __hash__(self) -> int:
        Counted.looks += 1
        return hash(self.number)

    def __eq__(self, other: object) -> bool:
        Counted.looks += 1
        return isinstance(other, Counted) and self.number == other.number


def looks_at(count: int, *, is_ring: bool) -> int:
    """How often the nodes of a chain or of a ring are looked at by all searches together."""
    nodes = [Counted(k) for k in range(count)]
    edges = list(pairwise(nodes)) + ([(nodes[-1], nodes[0])] if is_ring else [])
    Counted.looks = 0
    assert len(between(edges, nodes[0], nodes[-1])) == len(edges)
    assert bridges_between(nodes[0], nodes[-1], edges).is_open != is_ring
    assert len(spanning_tree([nodes[0]], edges).branches) == count - 1  # type: ignore[list-item, arg-type]
    return Counted.looks


@pytest.mark.parametrize("is_ring", [False, True])
def test_searches_take_a_number_of_steps_that_grows_linearly(is_ring: bool) -> None:
    assert looks_at(2000, is_ring=is_ring) < 2.2 * looks_at(1000, is_ring=is_ring)
