"""Relations between quantities of a case as limits, such as ``x1 - 1.5*x2 >= 0``.

Values are in the case's units. The language has numbers, names (with dots, as in ``robot.p_x``), ``+ - * / ^``,
brackets, ``sqrt``, ``sin``, ``cos``, ``abs``, and one of ``>=``, ``<=``, ``==``. ``^`` binds tighter than a sign and
to the right. The parser is not Python's, so that no text is executed and messages show what was expected and where.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, Self

from casadi import SX
from pydantic import Field

from ....models import Dimension, Model
from ....models.expression import FUNCTIONS, LARGEST_POWER, ExpressionError, Language
from ...errors import CaseError, nearest
from ...units import Units
from ..table import Table, empty_list
from ..toml import TomlValue
from .constraint import NUMBER, BoundedConstraint, Constraint
from .limit import Design, Limit, LimitedCase, TableField, Written

#: Largest number of characters of a relation, and of nested brackets, signs and powers.
LONGEST = 400
_DEEPEST = 40

#: Functions; functions of an angle in the case's unit; operators.
_FUNCTIONS = ("sqrt", "sin", "cos", "abs")
_OF_ANGLES = ("sin", "cos")
_OPERATIONS: dict[str, type[ast.operator]] = {
    "+": ast.Add,
    "-": ast.Sub,
    "*": ast.Mult,
    "/": ast.Div,
    "^": ast.Pow,
}
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[^\W\d]\w*(?:\.[^\W\d]\w*)*)|(?P<sign>>=|<=|==|[-+*/^()]))"
)


class Relation(NamedTuple):
    """Relation between two expressions, such as ``left >= right``."""

    left: ast.expr
    sign: Literal[">=", "<=", "=="]
    right: ast.expr


class _Token(NamedTuple):
    kind: str
    text: str
    place: int


def parse(text: str, names: Collection[str], angle: float = 1.0) -> Relation:
    """Return the relation of a text.

    Args:
        text: text of the relation.
        names: allowed names.
        angle: unit of the arguments of ``sin`` and ``cos``, radians.

    Raises:
        ExpressionError: the text is not a relation; the message shows the wrong token and its position.
    """
    if len(text) > LONGEST:
        raise ExpressionError(f"must have at most {LONGEST} characters, got {len(text)}")
    reader = _Reader(text, names)
    left = reader.sum()
    token = reader.next()
    if token.text not in (">=", "<=", "=="):
        raise reader.wrong(token, "expected an operator or one of >=, <=, ==")
    right = reader.sum()
    last = reader.next()
    if last.kind != "end":
        raise reader.wrong(last, "expected an operator or the end")
    for side in (left, right):
        _constant(side, angle)
    sign: Literal[">=", "<=", "=="] = ">=" if token.text == ">=" else "<=" if token.text == "<=" else "=="
    return Relation(left, sign, right)


def expression(tree: ast.expr, values: Mapping[str, SX], angle: float = 1.0) -> SX:
    """Return the CasADi expression of a syntax tree.

    Args:
        tree: syntax tree of one side of a relation.
        values: expression (1, 1) of each name.
        angle: unit of the arguments of ``sin`` and ``cos``, radians.
    """
    functions = {name: FUNCTIONS[name] for name in _FUNCTIONS}
    for name in _OF_ANGLES:
        functions[name] = (1, lambda value, of=FUNCTIONS[name][1]: of(value * angle))
    return Language(functions).value(tree, values)


def _constant(tree: ast.expr, angle: float) -> float | None:
    """Return the value of a syntax tree without names; None for a tree with names.

    Raises:
        ExpressionError: a part without names has no finite value, or a constant exponent is too large.
    """
    sign = ""
    parts: list[ast.expr] = []
    match tree:
        case ast.Name():
            return None
        case ast.UnaryOp(operand=operand):
            sign, parts = "-", [operand]
        case ast.Call(func=ast.Name(id=sign), args=parts):
            pass
        case ast.BinOp(left=left, op=operation, right=right):
            sign = next(each for each, kind in _OPERATIONS.items() if isinstance(operation, kind))
            parts = [left, right]
    values = [_constant(each, angle) for each in parts]
    last = values[-1] if values else None
    if sign == "^" and last is not None and abs(last) > LARGEST_POWER:
        raise ExpressionError(f"must have exponents of at most {LARGEST_POWER:g} in magnitude, got {last:g}")
    if sign == "/" and last == 0:
        raise ExpressionError("divides by zero, which is not allowed")
    if None in values:
        return None
    value = float(expression(tree, {}, angle))
    if not math.isfinite(value):
        raise ExpressionError(f"has constants for which {sign!r} gives no finite value")
    return value


class _Reader:
    """Recursive-descent parser of the text of a relation."""

    def __init__(self, text: str, names: Collection[str]) -> None:
        self._text, self._names = text, names
        self._heads = {head for head, dot, _ in (name.partition(".") for name in names) if dot}
        self._tokens = list(self._split())
        self._at = self._depth = 0

    def wrong(self, token: _Token, expected: str) -> ExpressionError:
        """Return the error at a token; its message shows the text with the token marked."""
        read = "the end" if token.kind == "end" else repr(token.text)
        return ExpressionError(f"{expected}, got {read} at position {token.place + 1}: {self._pointed(token.place)}")

    def next(self) -> _Token:
        """Return the next token and advance; at the end, return the end token again and again."""
        token = self._tokens[self._at]
        self._at = min(self._at + 1, len(self._tokens) - 1)
        return token

    def sum(self) -> ast.expr:
        """Read ``product (+|- product)*``."""
        tree = self._product()
        while self._tokens[self._at].text in ("+", "-"):
            tree = ast.BinOp(tree, _OPERATIONS[self.next().text](), self._product())
        return tree

    def _product(self) -> ast.expr:
        """Read ``signed (*|/ signed)*``."""
        tree = self._signed()
        while self._tokens[self._at].text in ("*", "/"):
            tree = ast.BinOp(tree, _OPERATIONS[self.next().text](), self._signed())
        return tree

    def _signed(self) -> ast.expr:
        """Read ``(+|-)* power``."""
        self._depth += 1
        if self._depth > _DEEPEST:
            raise ExpressionError(f"must have at most {_DEEPEST} nested brackets, signs and powers")
        if self._tokens[self._at].text in ("+", "-"):
            sign = self.next().text
            tree = self._signed()
            tree = ast.UnaryOp(ast.USub(), tree) if sign == "-" else tree
        else:
            tree = self._power()
        self._depth -= 1
        return tree

    def _power(self) -> ast.expr:
        """Read ``atom (^ signed)?``."""
        base = self._atom()
        if self._tokens[self._at].text != "^":
            return base
        self.next()
        return ast.BinOp(base, ast.Pow(), self._signed())

    def _atom(self) -> ast.expr:
        """Read a number, a name, a function with its argument, or a sum in brackets."""
        token = self.next()
        if token.kind == "number":
            value = float(token.text)
            if math.isinf(value):
                raise self.wrong(token, "expected a finite number")
            return ast.Constant(value)
        if token.text == "(":
            return self._closed(token)
        if token.kind != "name":
            raise self.wrong(token, "expected a number, a name or a bracket")
        if token.text in self._names:
            return ast.Name(token.text)
        if token.text in _FUNCTIONS:
            bracket = self.next()
            if bracket.text != "(":
                raise self.wrong(bracket, f'expected "(" after {token.text}')
            return ast.Call(ast.Name(token.text), [self._closed(bracket)], [])
        hint = nearest(token.text, [*self._names, *_FUNCTIONS])
        raise ExpressionError(f"{token.text!r} at position {token.place + 1} is not a quantity of this case; {hint}")

    def _closed(self, opened: _Token) -> ast.expr:
        tree = self.sum()
        token = self.next()
        if token.text != ")":
            raise self.wrong(
                token, f"expected an operator or the bracket that closes the one at position {opened.place + 1}"
            )
        return tree

    def _split(self) -> Iterator[_Token]:
        at = 0
        while at < len(self._text.rstrip()):
            found = _TOKEN.match(self._text, at)
            if found is None:
                at += len(self._text[at:]) - len(self._text[at:].lstrip())
                fault = f"{self._text[at]!r} at position {at + 1} is not allowed: {self._pointed(at)}"
                raise ExpressionError(f"{fault}; allowed are numbers, names, + - * / ^ ( ) and one of >=, <=, ==")
            kind = str(found.lastgroup)
            text, start = found[kind], found.start(kind)
            head = text.partition(".")[0]
            # A dot belongs to a name only after the first part of a name with a dot.
            text = head if kind == "name" and head not in self._heads else text
            yield _Token(kind, text, start)
            at = start + len(text)
        yield _Token("end", "", len(self._text.rstrip()))

    def _pointed(self, place: int) -> str:
        """Return the text with a position marked."""
        return f"{self._text[:place]}»{self._text[place:]}"


@dataclass(frozen=True, init=False)
class Relations(Limit[list[str]]):
    """Relations between quantities of the case.

    Attributes:
        texts: relations, such as ``"x1 - 1.5*x2 >= 0"``, with values in the case's units.
    """

    texts: tuple[str, ...]

    key: ClassVar[str] = "custom"
    table: ClassVar[Any] = list[str]
    description: ClassVar[str] = 'relations between dimensions and pose coordinates, such as "x1 - 1.5*x2 >= 0"'

    def __init__(self, *texts: str) -> None:
        object.__setattr__(self, "texts", texts)

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return the key of the list of relations, which is empty by default."""
        return {cls.key: TableField(cls.table, Field(default_factory=empty_list, description=cls.description))}

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the relations of a case file, if there are any."""
        return (each for each in super().read(limits, model, units) if each.texts)

    @classmethod
    def from_table(cls, written: Written[list[str]]) -> Self:
        """Return the relations of a case file."""
        return cls(*written.value)

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:  # noqa: ARG002 - texts have no units
        """Return the keys of ``[limits]`` that state the relations."""
        return {self.key: list(self.texts)}

    def check(self, case: LimitedCase) -> None:
        """Check that each text is a relation between quantities of the case.

        Raises:
            CaseError: a text is not a relation, or has an unknown name.
        """
        unit = case.units.to_internal(1.0, Dimension.ANGLE)
        for index, text in enumerate(self.texts):
            try:
                parse(text, case.scalars, unit)
            except ExpressionError as error:
                raise CaseError(f"limits.custom[{index}]", str(error), text) from None

    def of_design(self, design: Design) -> Iterator[BoundedConstraint]:
        """Return the constraint on left side minus right side of each relation."""
        dimensions = design.case.scalars
        unit = design.case.units.to_internal(1.0, Dimension.ANGLE)
        shown = {
            name: design.numbers[name] / (unit if dimension is Dimension.ANGLE else 1.0)
            for name, dimension in dimensions.items()
        }
        for k, text in enumerate(self.texts):
            relation = parse(text, dimensions, unit)
            difference = expression(relation.left, shown, unit) - expression(relation.right, shown, unit)
            lower = -math.inf if relation.sign == "<=" else 0.0
            upper = math.inf if relation.sign == ">=" else 0.0
            key = f"custom[{k}]"
            keys = ("" if relation.sign == "<=" else key, "" if relation.sign == ">=" else key)
            yield BoundedConstraint(Constraint(f"custom: {text.strip()}", difference, NUMBER, keys), lower, upper)
