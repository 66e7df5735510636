"""Graph algorithms on names and pairs of names: connected parts, bridges, and spanning trees."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Generic, NamedTuple, TypeVar

Node = TypeVar("Node", bound=Hashable)
Edge = tuple[Node, Node]


class Classes(Generic[Node]):
    """Partition of links into rigid bodies, each with a representative name (union-find).

    Args:
        names: names of all links.
        pairs: pairs of rigidly connected links.
    """

    def __init__(self, names: Iterable[Node], pairs: Iterable[Edge[Node]] = ()) -> None:
        self._parents = {name: name for name in names}
        for pair in pairs:
            self.merge(*pair)

    def find(self, name: Node) -> Node:
        """Return the representative name of the set that contains a name."""
        while self._parents[name] != name:
            self._parents[name] = self._parents[self._parents[name]]
            name = self._parents[name]
        return name

    def merge(self, one: Node, other: Node) -> None:
        """Merge the sets of two names."""
        self._parents[self.find(one)] = self.find(other)


def incident(edges: Iterable[Edge[Node]]) -> dict[Node, list[tuple[int, Node]]]:
    """Return the edges of each node in order: index and other end."""
    found: dict[Node, list[tuple[int, Node]]] = {}
    for k, (one, other) in enumerate(edges):
        found.setdefault(one, []).append((k, other))
        if other != one:
            found.setdefault(other, []).append((k, one))
    return found


def reached(start: Node, edges: Iterable[Edge[Node]]) -> set[Node]:
    """Return the start node and all nodes connected to it."""
    neighbours = incident(edges)
    found, waiting = {start}, [start]
    while waiting:
        for _, node in neighbours.get(waiting.pop(), ()):
            if node not in found:
                found.add(node)
                waiting.append(node)
    return found


def parts(nodes: Iterable[Node], edges: Sequence[Edge[Node]]) -> list[list[Node]]:
    """Return the connected parts of a set of nodes, in the order of the nodes; only edges inside the set count."""
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
    """Edges common to all paths between two nodes.

    Attributes:
        bridges: indices of these edges, in the order of the paths.
        is_open: True if the bridges form a path, without a loop between the nodes.
    """

    bridges: list[int]
    is_open: bool


def bridges_between(start: Node, end: Node, edges: Sequence[Edge[Node]]) -> Bridges:
    """Return the edges common to all paths from one node to another."""
    path = path_between(start, end, edges)
    if path is None:
        return Bridges([], is_open=False)
    on_path = set(path)
    places = {start: 0}
    node = start
    for k in path:
        node = edges[k][1] if edges[k][0] == node else edges[k][0]
        places[node] = len(places)
    # A connection of two path nodes by other edges bypasses all path edges between them.
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
    """Return the indices of the edges of a shortest path, in order; None if there is no path."""
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
    """Return the indices of the edges on simple paths from one node to another.

    Such an edge is in the same biconnected component as an edge between the two nodes, which a depth-first search finds
    (R. Tarjan, *Depth-first search and linear graph algorithms*, 1972).
    """
    # Edge 0 connects the two nodes.
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
    """Edge of a spanning tree: index, and ends from the root on."""

    edge: int
    parent: str
    child: str


class SpanningTree(NamedTuple):
    """Spanning tree: edges from the roots on, and indices of the chords, each of which closes a loop."""

    branches: list[Branch]
    chords: list[int]


def spanning_tree(
    roots: Sequence[str], edges: Sequence[Edge[str]], reluctance: Callable[[int], float] | None = None
) -> SpanningTree:
    """Return a spanning tree of the nodes connected to the roots; the roots count as one node.

    Args:
        roots: nodes with known motion.
        edges: pairs of nodes.
        reluctance: function of an edge's index; edges with small values enter the tree first.
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
    for node in waiting:  # grows in the loop
        for k, other in neighbours.get(node, ()):
            if k in chosen and other not in known:
                known.add(other)
                branches.append(Branch(k, node, other))
                waiting.append(other)
    used = {branch.edge for branch in branches}
    chords = [k for k, edge in enumerate(edges) if k not in used and edge[0] in known]
    return SpanningTree(branches, chords)


def nearest_tree(root: str, edges: Sequence[Edge[str]], lengths: Sequence[int]) -> SpanningTree:
    """Return a spanning tree of shortest paths from the root, by Dijkstra's algorithm.

    Nodes connected by edges of length 0 count as one: such edges enter the tree before all others. A loop that begins
    and ends at such a node then has no edge on the path to another node.

    Args:
        root: start node of all paths.
        edges: pairs of nodes.
        lengths: lengths of the edges, at least 0.
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
