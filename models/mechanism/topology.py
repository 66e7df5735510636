"""The graph of a mechanism as names and pairs of names: connected parts, bridges, and a spanning tree."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Generic, NamedTuple, TypeVar

Node = TypeVar("Node", bound=Hashable)
Edge = tuple[Node, Node]


class Classes(Generic[Node]):
    """Links that move as one: the sets of a partition, by a name that stands for each (union and find).

    Args:
        names: of all links.
        pairs: of those that move as one.
    """

    def __init__(self, names: Iterable[Node], pairs: Iterable[Edge[Node]] = ()) -> None:
        self._parents = {name: name for name in names}
        for pair in pairs:
            self.merge(*pair)

    def find(self, name: Node) -> Node:
        """Return the name that stands for the set of a name."""
        while self._parents[name] != name:
            self._parents[name] = self._parents[self._parents[name]]
            name = self._parents[name]
        return name

    def merge(self, one: Node, other: Node) -> None:
        """Make one set of the sets of two names."""
        self._parents[self.find(one)] = self.find(other)


def incident(edges: Iterable[Edge[Node]]) -> dict[Node, list[tuple[int, Node]]]:
    """Return for each node its edges in their order: the index, and the other end."""
    found: dict[Node, list[tuple[int, Node]]] = {}
    for k, (one, other) in enumerate(edges):
        found.setdefault(one, []).append((k, other))
        if other != one:
            found.setdefault(other, []).append((k, one))
    return found


def reached(start: Node, edges: Iterable[Edge[Node]]) -> set[Node]:
    """Return the nodes that edges join to a start, with the start itself."""
    neighbours = incident(edges)
    found, waiting = {start}, [start]
    while waiting:
        for _, node in neighbours.get(waiting.pop(), ()):
            if node not in found:
                found.add(node)
                waiting.append(node)
    return found


def parts(nodes: Iterable[Node], edges: Sequence[Edge[Node]]) -> list[list[Node]]:
    """Return the connected parts of some nodes, by edges with both ends among them, in the nodes' order."""
    allowed = list(nodes)
    own = set(allowed)
    inner = [edge for edge in edges if edge[0] in own and edge[1] in own]
    found: list[list[Node]] = []
    seen: set[Node] = set()
    for node in allowed:
        if node not in seen:
            part = reached(node, inner)
            found.append([each for each in allowed if each in part])
            seen |= part
    return found


class Bridges(NamedTuple):
    """Edges that every path between two nodes uses.

    Attributes:
        bridges: their indices, in the order of the paths.
        is_open: whether the bridges alone are a path: no loop is between the nodes.
    """

    bridges: list[int]
    is_open: bool


def bridges_between(start: Node, end: Node, edges: Sequence[Edge[Node]]) -> Bridges:
    """Return the edges that every path from one node to another uses."""
    path = path_between(start, end, edges)
    if path is None:
        return Bridges([], is_open=False)
    on_path = set(path)
    places = {start: 0}
    node = start
    for k in path:
        node = edges[k][1] if edges[k][0] == node else edges[k][0]
        places[node] = len(places)
    # Without the path's edges, what still joins two of its nodes is a way around all edges between them.
    classes = Classes([start, *(node for edge in edges for node in edge)])
    for k, edge in enumerate(edges):
        if k not in on_path:
            classes.merge(*edge)
    last = [0] * (len(path) + 1)
    firsts: dict[Node, int] = {}
    for node, place in places.items():
        last[firsts.setdefault(classes.find(node), place)] = place
    bridges, behind = [], 0
    for place, k in enumerate(path):
        behind = max(behind, last[place])
        if behind <= place:
            bridges.append(k)
    return Bridges(bridges, is_open=len(bridges) == len(path))


def path_between(start: Node, end: Node, edges: Sequence[Edge[Node]]) -> list[int] | None:
    """Return the indices of the edges of a shortest path, in order; None where there is no path."""
    neighbours = incident(edges)
    came: dict[Node, tuple[Node, int] | None] = {start: None}
    layer = [start]
    while layer and end not in came:
        following = []
        for node in layer:
            for k, other in neighbours.get(node, ()):
                if other not in came:
                    came[other] = node, k
                    following.append(other)
        layer = following
    if end not in came:
        return None
    found: list[int] = []
    step = came[end]
    while step is not None:
        found.append(step[1])
        step = came[step[0]]
    return found[::-1]


def between(edges: Sequence[Edge[Node]], first: Node, last: Node) -> list[int]:
    """Return the indices of the edges that lie on paths from one node to another that pass each node once.

    No single node separates such an edge from one that joins the two nodes: they are in one biconnected component,
    which a search in depth finds (R. Tarjan, *Depth-first search and linear graph algorithms*, 1972).
    """
    # Edge 0 joins the two nodes.
    neighbours = incident([(first, last), *edges])
    order = {first: 0}
    lowest = {first: 0}
    passed: list[int] = []
    walk = [(first, -1, 0, iter(neighbours[first]))]
    while walk:
        node, came, begin, rest = walk[-1]
        following = next(rest, None)
        if following is None:
            walk.pop()
            if not walk:
                break
            parent = walk[-1][0]
            lowest[parent] = min(lowest[parent], lowest[node])
            if lowest[node] >= order[parent]:
                component = passed[begin:]
                del passed[begin:]
                if 0 in component:
                    return sorted(k - 1 for k in component if k)
            continue
        k, other = following
        if k == came or other == node:
            continue
        if other not in order:
            order[other] = lowest[other] = len(order)
            walk.append((other, k, len(passed), iter(neighbours[other])))
            passed.append(k)
        elif order[other] < order[node]:
            passed.append(k)
            lowest[node] = min(lowest[node], order[other])
    return []


class Branch(NamedTuple):
    """An edge of a spanning tree: its index, and its ends from the root on."""

    edge: int
    parent: str
    child: str


class SpanningTree(NamedTuple):
    """A spanning tree: its edges from the roots on, and the indices of the other edges, each of which closes a loop."""

    branches: list[Branch]
    chords: list[int]


def spanning_tree(
    roots: Sequence[str], edges: Sequence[Edge[str]], reluctance: Callable[[int], float] | None = None
) -> SpanningTree:
    """Return a spanning tree of the nodes that edges join to the roots; the roots count as one node.

    Args:
        roots: nodes whose motion is known.
        edges: pairs of nodes.
        reluctance: of an edge's index: edges with a small number are put into the tree first.
    """
    order = sorted(range(len(edges)), key=lambda k: 0.0 if reluctance is None else reluctance(k))
    classes = Classes({node for edge in edges for node in edge} | set(roots))
    for root in roots[1:]:
        classes.merge(root, roots[0])
    chosen = set()
    for k in order:
        one, other = edges[k]
        if classes.find(one) != classes.find(other):
            classes.merge(one, other)
            chosen.add(k)
    branches: list[Branch] = []
    known = set(roots)
    waiting, neighbours = list(roots), incident(edges)
    for node in waiting:  # which grows
        for k, other in neighbours.get(node, ()):
            if k in chosen and other not in known:
                known.add(other)
                branches.append(Branch(k, node, other))
                waiting.append(other)
    used = {branch.edge for branch in branches}
    chords = [k for k, edge in enumerate(edges) if k not in used and edge[0] in known]
    return SpanningTree(branches, chords)


def nearest_tree(root: str, edges: Sequence[Edge[str]], lengths: Sequence[int]) -> SpanningTree:
    """Return a spanning tree with the shortest path from the root to each node, as E. W. Dijkstra's algorithm finds it.

    Nodes that edges of length 0 join count as one: such edges are in the tree before all others. So a loop that begins
    and ends at such a node has no edge on the path to another node.

    Args:
        root: node where all paths begin.
        edges: pairs of nodes.
        lengths: lengths of the edges, 0 or more.
    """
    classes = Classes({root, *(node for edge in edges for node in edge)})
    for edge, length in zip(edges, lengths, strict=True):
        if not length:
            classes.merge(*edge)
    joined = [(classes.find(one), classes.find(other)) for one, other in edges]
    neighbours = incident(joined)
    found: set[str] = set()
    chosen: set[int] = set()
    waiting = [(0, -1, classes.find(root))]
    while waiting:
        distance, last, node = heapq.heappop(waiting)
        if node in found:
            continue
        found.add(node)
        chosen.add(last)
        for k, other in neighbours.get(node, ()):
            if other not in found:
                heapq.heappush(waiting, (distance + lengths[k], k, other))
    return spanning_tree([root], edges, lambda k: 0.0 if not lengths[k] else 1.0 if k in chosen else 2.0)
