"""The graph of a mechanism as names and pairs of names: connected parts, bridges, and a spanning tree."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import NamedTuple, TypeVar

Node = TypeVar("Node", bound=Hashable)
Edge = tuple[Node, Node]


class Classes:
    """Links that move as one: the sets of a partition, by a name that stands for each (union and find).

    Args:
        names: of all links.
        pairs: of those that move as one.
    """

    def __init__(self, names: Iterable[str], pairs: Iterable[tuple[str, str]] = ()) -> None:
        self._parents = {name: name for name in names}
        for pair in pairs:
            self.merge(*pair)

    def find(self, name: str) -> str:
        """Return the name that stands for the set of a name."""
        while self._parents[name] != name:
            self._parents[name] = self._parents[self._parents[name]]
            name = self._parents[name]
        return name

    def merge(self, one: str, other: str) -> None:
        """Make one set of the sets of two names."""
        self._parents[self.find(one)] = self.find(other)


def reached(start: Node, edges: Iterable[Edge[Node]]) -> set[Node]:
    """Return the nodes that edges join to a start, with the start itself."""
    neighbours: dict[Node, list[Node]] = {}
    for one, other in edges:
        neighbours.setdefault(one, []).append(other)
        neighbours.setdefault(other, []).append(one)
    found, waiting = {start}, [start]
    while waiting:
        for node in neighbours.get(waiting.pop(), ()):
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
    bridges = [k for k in path if end not in reached(start, [edge for j, edge in enumerate(edges) if j != k])]
    return Bridges(bridges, is_open=len(bridges) == len(path))


def path_between(start: Node, end: Node, edges: Sequence[Edge[Node]]) -> list[int] | None:
    """Return the indices of the edges of a shortest path, in order; None where there is no path."""
    came: dict[Node, tuple[Node, int] | None] = {start: None}
    layer = [start]
    while layer and end not in came:
        following = []
        for node in layer:
            for k, edge in enumerate(edges):
                if node in edge:
                    other = edge[1] if edge[0] == node else edge[0]
                    if other not in came:
                        came[other] = node, k
                        following.append(other)
        layer = following
    if end not in came:
        return None
    found: list[int] = []
    step = came[end]
    while step is not None:
        found.insert(0, step[1])
        step = came[step[0]]
    return found


def between(edges: Sequence[Edge[Node]], first: Node, last: Node) -> list[int]:
    """Return the indices of the edges that lie on paths from one node to another that pass each node once.

    No single node separates such an edge from one that joins the two nodes: they are in one biconnected component.
    """
    kept = list(range(len(edges)))
    for node in dict.fromkeys(each for edge in [(first, last), *edges] for each in edge):
        rest = [edge for edge in [(first, last), *(edges[k] for k in kept)] if node not in edge]
        beside = reached(last if node == first else first, rest)
        kept = [k for k in kept if beside.intersection({*edges[k]} - {node})]
    return kept


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
    waiting = list(roots)
    while waiting:
        node = waiting.pop(0)
        for k in sorted(chosen):
            if node in edges[k]:
                other = edges[k][1] if edges[k][0] == node else edges[k][0]
                if other not in known:
                    known.add(other)
                    branches.append(Branch(k, node, other))
                    waiting.append(other)
    used = {branch.edge for branch in branches}
    chords = [k for k, edge in enumerate(edges) if k not in used and edge[0] in known]
    return SpanningTree(branches, chords)
