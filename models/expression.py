"""Expression language for dimensions and points in robot files: ``rb + arm*cos(tilt)``, ``E + w/2*y``.

An expression consists of numbers, names, ``+ - * / ^``, brackets, and the functions of :data:`FUNCTIONS`. Values are
scalars or vectors; ``x``, ``y`` and ``z`` are the unit vectors of the world frame. Python's parser builds the syntax
tree only. Each node type is accepted explicitly and all others are refused, so that a text can neither reach an
attribute nor call other functions. A :class:`Language` with other functions evaluates other kinds of texts.
"""

from __future__ import annotations

import ast
import math
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

import casadi as ca
from casadi import SX

#: Largest length of an expression; expressions written by people have at most a few hundred characters.
_LONGEST = 2000
#: Deepest nesting of an expression, far below Python's recursion limit.
_DEEPEST = 60
#: Largest absolute value of a constant power; larger powers of robot dimensions leave the range of doubles.
LARGEST_POWER = 100.0
#: Allowed characters. Python would read ``#`` as a comment, and accept other letters in names.
_CHARACTERS = re.compile(r"[A-Za-z0-9_+\-*/^(),. ]*")
#: Python's number formats that are not allowed here: 0x10, 1_000, 1j.
_OTHER_NUMBERS = re.compile(r"\b[0-9]+(_|[xXbBoOjJ])")


class ExpressionError(ValueError):
    """Error of a text that is not an expression; the message is a clause about the text."""


class UnknownNameError(ExpressionError):
    """Error of an unknown name in an expression.

    Attributes:
        name: the unknown name.
    """

    def __init__(self, name: str, hint: str) -> None:
        super().__init__(f"has the name {name!r}, which is unknown; {hint}")
        self.name = name


class NoValueError(ExpressionError):
    """Error of an expression that is not finite for the given values of its names.

    Attributes:
        values: values of the names in the failing operation, one or three numbers each.
    """

    def __init__(self, fault: str, values: Mapping[str, tuple[float, ...]]) -> None:
        super().__init__(fault)
        self.values = values


def _only(function: Callable[..., SX], *, scalars: bool, fault: str) -> Callable[..., SX]:
    """Return a function that refuses vectors, or scalars, as its arguments."""

    def checked(*values: SX) -> SX:
        if any(value.is_scalar() is not scalars for value in values):
            raise ExpressionError(fault)
        return function(*values)

    return checked


_of_numbers = partial(_only, scalars=True, fault="needs a number here, not a vector")
_of_vectors = partial(_only, scalars=False, fault="needs a vector here, not a number")

#: Functions by name, with their numbers of arguments.
Functions: TypeAlias = Mapping[str, tuple[int, Callable[..., SX]]]
#: Functions of robot files.
FUNCTIONS: Functions = MappingProxyType(
    {
        "sin": (1, _of_numbers(ca.sin)),
        "cos": (1, _of_numbers(ca.cos)),
        "tan": (1, _of_numbers(ca.tan)),
        "sqrt": (1, _of_numbers(ca.sqrt)),
        "abs": (1, _of_numbers(ca.fabs)),
        "atan2": (2, _of_numbers(ca.atan2, fault="needs numbers in atan2, not vectors")),
        "cross": (2, _of_vectors(ca.cross)),
        "dot": (2, _of_vectors(ca.dot)),
        "norm": (1, _of_vectors(ca.norm_2)),
        "unit": (1, _of_vectors(lambda vector: vector / ca.norm_2(vector))),
    }
)
#: Names with a value in every expression.
CONSTANTS: Mapping[str, SX] = MappingProxyType(
    {"x": SX([1, 0, 0]), "y": SX([0, 1, 0]), "z": SX([0, 0, 1]), "pi": SX(math.pi)}
)


def evaluate(written: str | float, names: Mapping[str, SX]) -> SX:
    """Return the value of an expression, (1, 1) or (3, 1).

    Args:
        written: text of the expression, or a number.
        names: values of the names that the expression may use in addition to :data:`CONSTANTS`.

    Raises:
        ExpressionError: the text is not an expression, or its value is a constant that is not finite.
    """
    if not isinstance(written, str):
        return _number(written)
    tree, known = _tree(written), {**CONSTANTS, **names}
    value = _LANGUAGE.value(tree, known)
    if value.is_constant() and not value.is_regular():
        raise _no_value(tree, known)
    return ca.densify(value)


#: Required arguments of functions that have no finite value for other ones.
_ALLOWED = {"sqrt": "must be at least 0", "unit": "must not be 0"}


def _no_value(tree: ast.expr, names: Mapping[str, SX]) -> NoValueError:
    """Return the error of an expression without a finite value, which names the first failing operation."""
    node = next((each for each in _operations(tree) if not _LANGUAGE.value(each, names).is_regular()), tree)
    parts, fault = [node], f"{_written(node)} is not finite"
    match node:
        case ast.BinOp(op=ast.Div(), right=divisor) if _LANGUAGE.value(divisor, names).is_zero():
            parts, fault = [divisor], f"the divisor {_with_value(divisor, names)} must not be 0"
        case ast.BinOp(op=ast.Pow(), left=base, right=power):
            parts = [base, power]
            fault = f"{_with_value(base, names)} has no power {_with_value(power, names)}"
        case ast.Call(func=ast.Name(id=name), args=[argument]) if name in _ALLOWED:
            parts, fault = [argument], f"the argument of {name}, {_with_value(argument, names)}, {_ALLOWED[name]}"
    used = dict.fromkeys(each.id for part in parts for each in ast.walk(part) if isinstance(each, ast.Name))
    given = [name for name in used if name in names and name not in CONSTANTS]
    values = {name: tuple(ca.DM(names[name]).full().ravel().tolist()) for name in given}
    return NoValueError(f"has no finite value: {fault}", values)


def _operations(node: ast.expr) -> Iterator[ast.expr]:
    """Yield the operations of an expression, each after those of its arguments."""
    for each in ast.iter_child_nodes(node):
        if isinstance(each, ast.expr):
            yield from _operations(each)
    if isinstance(node, ast.BinOp | ast.Call):
        yield node


def _written(node: ast.expr) -> str:
    """Return an expression as a robot file writes it."""
    return ast.unparse(node).replace(" ** ", "^")


def _with_value(node: ast.expr, names: Mapping[str, SX]) -> str:
    """Return an expression with its value, ``rod^2 - dr^2 = -3599.09``."""
    written = _written(node)
    numbers = ", ".join(f"{number:.7g}" for number in ca.DM(_LANGUAGE.value(node, names)).full().ravel())
    value = numbers if "," not in numbers else f"({numbers})"
    return written if written == value else f"{written} = {value}"


def _tree(text: str) -> ast.expr:
    """Return the syntax tree of a text, in which ``^`` is a power."""
    if len(text) > _LONGEST:
        raise ExpressionError(f"is longer than {_LONGEST} letters")
    if "**" in text:
        raise ExpressionError("has '**'; write a power with '^'")
    if not _CHARACTERS.fullmatch(text) or _OTHER_NUMBERS.search(text):
        raise ExpressionError("may have only numbers, names, + - * / ^, brackets and functions")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Python's advice on texts such as 1if: they are refused below
            return ast.parse(text.strip().replace("^", "**"), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExpressionError("is not an expression of numbers, names, + - * / ^ and functions") from None


class Language(NamedTuple):
    """Functions that expressions may call, and the limits of their size.

    Attributes:
        functions: functions by name.
        deepest: largest nesting depth of operations.
        largest_power: largest absolute value of a constant power.
    """

    functions: Functions
    deepest: float = math.inf
    largest_power: float = math.inf

    def value(self, node: ast.expr, names: Mapping[str, SX], depth: int = 0) -> SX:
        """Return the value of a node, (1, 1) or (3, 1).

        Args:
            node: node of a syntax tree.
            names: values of the names that the node may use.
            depth: depth of the node in the tree.

        Raises:
            ExpressionError: the language does not allow the node.
        """
        if depth > self.deepest:
            raise ExpressionError(f"has more than {self.deepest} nested operations")
        match node:
            case ast.Constant(value=value):
                return _number(value)
            case ast.Name(id=name) if name in names:
                return names[name]
            case ast.Name(id=name):
                raise UnknownNameError(name, _hint(name, names))
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.value(operand, names, depth + 1)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -self.value(operand, names, depth + 1)
            case ast.BinOp(left=left, op=operator, right=right):
                first, second = self.value(left, names, depth + 1), self.value(right, names, depth + 1)
                return self._operation(operator, first, second)
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                return self._call(name, [self.value(each, names, depth + 1) for each in arguments])
        raise ExpressionError("may have only numbers, names, + - * / ^, brackets and functions")

    def _operation(self, operator: ast.operator, first: SX, second: SX) -> SX:
        match operator:
            case ast.Add() | ast.Sub():
                if first.shape != second.shape:
                    raise ExpressionError("adds or subtracts a number and a vector")
                return first + second if isinstance(operator, ast.Add) else first - second
            case ast.Mult():
                if not (first.is_scalar() or second.is_scalar()):
                    raise ExpressionError("multiplies two vectors: use dot or cross")
                return first * second
            case ast.Div():
                if not second.is_scalar():
                    raise ExpressionError("divides by a vector")
                return first / second
            case ast.Pow():
                if not (first.is_scalar() and second.is_scalar()):
                    raise ExpressionError("has a vector in a power")
                if second.is_constant() and abs(float(second)) > self.largest_power:
                    raise ExpressionError(f"has a power larger than {self.largest_power:g}")
                return first**second
        raise ExpressionError("may have only the operations + - * / ^")

    def _call(self, name: str, arguments: list[SX]) -> SX:
        if name not in self.functions:
            raise ExpressionError(f"has the function {name!r}, which is unknown; {_hint(name, self.functions)}")
        count, function = self.functions[name]
        if len(arguments) != count:
            raise ExpressionError(f"gives {name} {len(arguments)} arguments instead of {count}")
        return function(*arguments)


#: The language of robot files.
_LANGUAGE = Language(FUNCTIONS, _DEEPEST, LARGEST_POWER)


def _number(value: object) -> SX:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ExpressionError("may have only numbers, names, + - * / ^, brackets and functions")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ExpressionError("has a number that is not finite")
    return SX(number)


def _hint(name: str, known: Mapping[str, object]) -> str:
    """Return a clause about the known names."""
    import difflib  # noqa: PLC0415 - only messages need it

    near = difflib.get_close_matches(name, known, 1)
    return f"did you mean {near[0]!r}?" if near else f"known are {', '.join(sorted(known))}"
