"""The part of a graph that lies on paths between two of its nodes, each node passed once."""

from __future__ import annotations

from collections.abc import Sequence


def between(edges: Sequence[tuple[str, str]], first: str, last: str) -> list[int]:
    """Return the numbers of the edges that lie on simple paths from one node to another.

    They are those of the biconnected component that an edge between the two nodes would be in (Tarjan's algorithm,
    without recursion).

    Args:
        edges: pairs of nodes; several edges may join the same two.
        first: a node.
        last: another node.
    """
    joined = [*edges, (first, last)]
    neighbours: dict[str, list[tuple[str, int]]] = {}
    for number, (one, other) in enumerate(joined):
        neighbours.setdefault(one, []).append((other, number))
        neighbours.setdefault(other, []).append((one, number))
    order, low = {first: 0}, {first: 0}
    trail: list[int] = []
    waiting = [(first, -1, iter(neighbours[first]))]
    while waiting:
        node, entered, rest = waiting[-1]
        step = next(rest, None)
        if step is None:
            waiting.pop()
            if not waiting:
                continue
            above = waiting[-1][0]
            low[above] = min(low[above], low[node])
            if low[node] >= order[above]:
                cut = trail.index(entered)
                component, trail = trail[cut:], trail[:cut]
                if len(edges) in component:
                    return sorted(set(component) - {len(edges)})
            continue
        other, number = step
        if number == entered:
            continue
        if other not in order:
            trail.append(number)
            order[other] = low[other] = len(order)
            waiting.append((other, number, iter(neighbours[other])))
        elif order[other] < order[node]:
            trail.append(number)
            low[node] = min(low[node], order[other])
    return []
