"""Loops of Newton's method in the project's Python, found by the flow of values through each loop.

Such a loop solves linear equations in each turn, at a point that the last solution has moved, and can end early.
Gauss-Newton and Levenberg-Marquardt loops count; loops that hold or call another one do not. Not found are loops in C,
loops that CasADi unrolls, and solves by functions other than ``SOLVES``.
"""

import ast
import builtins
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cache

#: Functions of a ``linalg`` that solve linear equations, or take a matrix apart to do so.
SOLVES = {"lstsq", "solve", "pinv", "inv", "svd", "eigh"}
#: Largest number of the project's functions between a loop and a solve: one for a step, one for least squares.
DEPTH = 2
#: Calls that evaluate no equations: built-in functions, libraries, and methods of arrays.
PLAIN = {*dir(builtins), "np", "ca", "math", "all", "any", "copy", "full", "max", "min", "ravel", "reshape", "sum"}
Loop = ast.For | ast.While


@cache
def walk(node: ast.AST) -> list[ast.AST]:
    """Return all nodes of a tree, itself first."""
    return list(ast.walk(node))


def dotted(node: ast.AST) -> str:
    """Return the names of an expression: ``x.y`` for ``x[k].y(z)``."""
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    if isinstance(node, ast.Call | ast.Subscript | ast.Starred):
        return dotted(node.func if isinstance(node, ast.Call) else node.value)
    return node.id if isinstance(node, ast.Name) else ""


def variables(nodes: Iterable[ast.AST], *, first: bool = False) -> set[str]:
    """Return the variables of expressions, or those that they begin with; an attribute of ``self`` is one."""
    named = [dotted(each) for node in nodes for each in ([node] if first else walk(node))]
    return {".".join(each.split(".")[: 1 + each.startswith("self.")]) for each in named} - {"", "self", "np"}


def called_in(node: ast.AST) -> set[str]:
    return {dotted(each) for each in walk(node) if isinstance(each, ast.Call)}


def is_solve(called: str, helpers: set[str]) -> bool:
    return called.removeprefix("self.") in helpers or (".linalg." in called and called.rpartition(".")[2] in SOLVES)


def is_newton(loop: Loop, helpers: set[str]) -> bool:
    """Return whether a solution changes what the loop solves next, by way of a function that is evaluated there."""
    if isinstance(loop, ast.For) and not any(isinstance(each, ast.Break | ast.Return) for each in walk(loop)):
        return False
    follows, seen, needed = defaultdict(set), set(), set()
    for node in walk(loop):
        if isinstance(node, ast.Assign | ast.AugAssign | ast.AnnAssign) and node.value:
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            changed = [part for each in targets for part in (each.elts if isinstance(each, ast.Tuple) else [each])]
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            changed = [node.value]  # A method without a result changes its object.
        else:
            continue
        calls = [(each, dotted(each)) for each in walk(node.value) if isinstance(each, ast.Call)]
        solved = [each for each, called in calls if is_solve(called, helpers)]
        evaluates = any(each not in solved and not PLAIN & {*called.split(".")} for each, called in calls)
        for name in variables([node.value]):
            follows[name] |= {(each, evaluates) for each in variables(changed, first=True)}
        seen |= {(each, False) for each in variables(changed, first=True) if solved}
        needed |= variables(part for each in solved for part in each.args)
    waiting = set(seen)
    while waiting:
        name, is_evaluated = waiting.pop()
        fresh = {(after, is_evaluated or evaluates) for after, evaluates in follows[name]} - seen
        seen, waiting = seen | fresh, waiting | fresh
    return any((name, True) in seen for name in needed)


def newton_loops(
    functions: list[tuple[str, ast.FunctionDef]], names: dict[str, dict[str, tuple[str, str]]], likely: set[str]
) -> Iterator[tuple[str, str, int]]:
    """Yield module, function and line of each loop of Newton's method.

    Args:
        functions: all functions and methods, each with its module.
        names: of each module's functions and imports, by the name there: the module and the name where it is defined.
        likely: modules that use a ``linalg``.
    """
    helpers: dict[str, set[str]] = defaultdict(set)
    single, found, public = set(), {}, set()

    def calls_another(node: ast.AST) -> bool:
        return any(".linalg." not in each and each.rpartition(".")[2] in public for each in called_in(node))

    for _ in range(DEPTH + 1):
        for module, function in functions:
            own = helpers[module]
            if (module in likely or own) and any(is_solve(each, own) for each in called_in(function)):
                loops = [each for each in walk(function) if isinstance(each, Loop) and is_newton(each, own)]
                inner = [each for each in loops if not any(other in loops for other in walk(each)[1:])]
                found |= {each: (module, function.name, each.lineno) for each in inner}
                (single.discard if loops else single.add)((module, function))
        public = {name for _, name, _ in found.values() if not name.startswith("_")}
        solved = {(module, each.name) for module, each in single if not calls_another(each)}
        helpers |= {module: {here for here, there in own.items() if there in solved} for module, own in names.items()}
    yield from sorted(place for loop, place in found.items() if not calls_another(loop))
