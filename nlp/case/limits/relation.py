"""Relations between the case's numbers as limits, such as ``x1 - 1.5*x2 >= 0``.

Numbers are in the case's units in a relation. The language is small: numbers, names, ``+ - * / ^``, brackets, the
functions ``sqrt``, ``sin``, ``cos`` and ``abs``, and one relation ``>=``, ``<=`` or ``==``. A name may have a dot in
it, as ``robot.p_x`` has. ``^`` binds tighter than a sign and to the right, as in mathematics. Nothing is ever handed to
Python's own interpreter: a text becomes a tree, and a tree a CasADi expression, as in a robot's own numbers. Python's
parser is not used, because its messages do not name the expected text and its place.
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

#: A text is refused beyond this many characters, and beyond this many brackets, signs and powers in each other.
LONGEST = 400
_DEEPEST = 40

#: Functions of expressions; those of angles, which take the case's unit; operations.
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
    """``left >= right`` and the like."""

    left: ast.expr
    sign: Literal[">=", "<=", "=="]
    right: ast.expr


class _Token(NamedTuple):
    kind: str
    text: str
    place: int


def parse(text: str, names: Collection[str], angle: float = 1.0) -> Relation:
    """Return the relation that a text states.

    Args:
        text: the relation as it is written.
        names: names that may stand in it.
        angle: unit of the angles that ``sin`` and ``cos`` take, radians.

    Raises:
        ExpressionError: the text is no relation; the message has the offending token and its place.
    """
    if len(text) > LONGEST:
        raise ExpressionError(f"is longer than {LONGEST} characters")
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
    """Return a tree as an expression of the values of its names.

    Args:
        tree: the tree.
        values: an expression (1, 1) for each name.
        angle: unit of the angles that ``sin`` and ``cos`` take, radians.
    """
    functions = {name: FUNCTIONS[name] for name in _FUNCTIONS}
    for name in _OF_ANGLES:
        functions[name] = (1, lambda value, of=FUNCTIONS[name][1]: of(value * angle))
    return Language(functions).value(tree, values)


def _constant(tree: ast.expr, angle: float) -> float | None:
    """Return the value of a tree without names; None for a tree with names.

    Raises:
        ExpressionError: a part without names has no finite value, or a constant power is too large.
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
        raise ExpressionError(f"has the power {last:g}, which must be at most {LARGEST_POWER:g} in size")
    if sign == "/" and last == 0:
        raise ExpressionError("divides by zero")
    if None in values:
        return None
    value = float(expression(tree, {}, angle))
    if not math.isfinite(value):
        raise ExpressionError(f"has a constant part, of {sign!r}, without a finite value")
    return value


class _Reader:
    """Recursive descent over the tokens of a text."""

    def __init__(self, text: str, names: Collection[str]) -> None:
        self._text, self._names = text, names
        self._heads = {head for head, dot, _ in (name.partition(".") for name in names) if dot}
        self._tokens = list(self._split())
        self._at = self._depth = 0

    def wrong(self, token: _Token, expected: str) -> ExpressionError:
        """Return the fault at a token, which shows the text with the token marked."""
        found = "the sentence ends" if token.kind == "end" else f"{token.text!r} stands"
        return ExpressionError(f"{expected}, but {found} at position {token.place + 1}: {self._pointed(token.place)}")

    def next(self) -> _Token:
        """Return the next token, and go on; the end stays the next one."""
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
            raise ExpressionError(f"has more than {_DEEPEST} brackets, signs and powers in each other")
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
                raise self.wrong(bracket, f"expected a bracket after {token.text}")
            return ast.Call(ast.Name(token.text), [self._closed(bracket)], [])
        hint = nearest(token.text, [*self._names, *_FUNCTIONS])
        raise ExpressionError(f"{token.text!r} at position {token.place + 1} is no number of this case; {hint}")

    def _closed(self, opened: _Token) -> ast.expr:
        tree = self.sum()
        token = self.next()
        if token.text != ")":
            raise self.wrong(token, f"expected an operator or the bracket that closes position {opened.place + 1}")
        return tree

    def _split(self) -> Iterator[_Token]:
        at = 0
        while at < len(self._text.rstrip()):
            found = _TOKEN.match(self._text, at)
            if found is None:
                at += len(self._text[at:]) - len(self._text[at:].lstrip())
                raise ExpressionError(
                    f"{self._text[at]!r} at position {at + 1} means nothing here: {self._pointed(at)}"
                )
            kind = str(found.lastgroup)
            text, start = found[kind], found.start(kind)
            head = text.partition(".")[0]
            # A dot belongs to a name only behind a word that begins names with a dot.
            text = head if kind == "name" and head not in self._heads else text
            yield _Token(kind, text, start)
            at = start + len(text)
        yield _Token("end", "", len(self._text.rstrip()))

    def _pointed(self, place: int) -> str:
        """Return the text with a place marked."""
        return f"{self._text[:place]}»{self._text[place:]}"


@dataclass(frozen=True, init=False)
class Relations(Limit[list[str]]):
    """Relations between the case's own numbers.

    Attributes:
        texts: each relation as it is written.
    """

    texts: tuple[str, ...]

    key: ClassVar[str] = "custom"
    table: ClassVar[Any] = list[str]
    description: ClassVar[str] = 'relations such as "x1 - 1.5*x2 >= 0"'

    def __init__(self, *texts: str) -> None:
        object.__setattr__(self, "texts", texts)

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return the key of the list, which is empty if left out."""
        return {cls.key: TableField(cls.table, Field(default_factory=empty_list, description=cls.description))}

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the relations that a case file states, if there are any."""
        return (each for each in super().read(limits, model, units) if each.texts)

    @classmethod
    def from_table(cls, written: Written[list[str]]) -> Self:
        """Return the relations that a case file writes."""
        return cls(*written.value)

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:  # noqa: ARG002 - texts have no units
        """Return the keys of ``[limits]`` that state the relations."""
        return {self.key: list(self.texts)}

    def check(self, case: LimitedCase) -> None:
        """Refuse a relation that cannot be understood.

        Raises:
            CaseError: in the words of a case file.
        """
        unit = case.units.to_internal(1.0, Dimension.ANGLE)
        for index, text in enumerate(self.texts):
            try:
                parse(text, case.scalars, unit)
            except ExpressionError as error:
                raise CaseError(f"limits.custom[{index}]", str(error), text) from None

    def of_design(self, design: Design) -> Iterator[BoundedConstraint]:
        """Return left side less right side of each relation."""
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
