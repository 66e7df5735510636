"""Bound of the stack of a solve, from the call graphs that gcc writes with ``-fcallgraph-info=su``.

The frames are those of the compiler. Functions of the C library have no frame there: their stack is not in the bound.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

#: Bytes added for each call: the return address, where a compiler does not count it in the frame.
_RETURN = 8
_NODE = re.compile(r'node: \{ title: "([^"]+)" label: "[^"]*?\\n(\d+) bytes \(([a-z,]+)\)')
_EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
_INDIRECT = "__indirect_call"


def stack_bound(graphs: Mapping[str, str], prefix: str) -> int | None:
    """Return the bytes of the deepest path of calls from the solver.

    Args:
        graphs: call graph of each source by its name without an ending.
        prefix: of the case's names in C.

    Returns:
        The bound; None where a frame has no constant size, a function may call itself, or the solver is missing.
    """
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for unit, text in graphs.items():
        for title, size, kind in _NODE.findall(text):
            if kind not in ("static", "dynamic,bounded"):
                return None
            frames[_name(title, unit)] = int(size)
        for source, target in _EDGE.findall(text):
            calls.setdefault(_name(source, unit), set()).add(_name(target, unit))
    for function, targets in [*calls.items()]:
        if _INDIRECT in targets:
            calls[function] = (targets - {_INDIRECT}) | _called_by_pointer(function, frames, prefix)
    return _deepest(f"{prefix}_solve", frames, calls) if f"{prefix}_solve" in frames else None


def _name(title: str, unit: str) -> str:
    """Return a function's name; that of a static one, which the graph gives with its file, begins with its unit."""
    own = title.rpartition(":")[2]
    return f"{unit}:{own}" if ":" in title else own


def _called_by_pointer(function: str, frames: Mapping[str, int], prefix: str) -> set[str]:
    """Return what a function may call by a pointer.

    A search calls its program so: the scaled one, or that of the search for a feasible point, which calls the scaled
    one. The scaled one calls only the caller's deadline, which is not known here.
    """
    if function.startswith((f"{prefix}_SCALED_", f"{prefix}-scaled:")):
        return set()
    program = {each for each in frames if re.search(r"_SCALED_(values|hessian|visit)$", each)}
    if function.startswith(f"{prefix}-restore:"):
        return program
    return program | {each for each in frames if re.search(r"-restore:(values|hessian|visit)(\.|$)", each)}


def _deepest(function: str, frames: Mapping[str, int], calls: Mapping[str, set[str]]) -> int | None:
    """Return the deepest sum of frames from a function; None where a function may call itself."""
    found: dict[str, int] = {}
    open_calls: set[str] = set()

    def depth(name: str) -> int | None:
        if name in open_calls:
            return None
        if name not in found:
            open_calls.add(name)
            below = [depth(each) for each in sorted(calls.get(name, ()))]
            open_calls.remove(name)
            if any(each is None for each in below):
                return None
            found[name] = frames.get(name, 0) + _RETURN + max((each for each in below if each is not None), default=0)
        return found[name]

    return depth(function)
