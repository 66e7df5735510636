"""The little language of custom limits: what it means, what it refuses and where, and that nothing else can happen."""

from __future__ import annotations

import math
import string

import casadi as ca
import pytest
from casadi import SX
from hypothesis import given, settings
from hypothesis import strategies as st

from screwsynth.models.expression import ExpressionError
from screwsynth.nlp.case.limits.relation import expression, parse

NAMES = {"x1": 3.0, "x2": 2.0, "base_1_x": -1.5, "angle": 30.0}


def difference(text: str, angle: float = 1.0) -> float:
    """Left side less right side at :data:`NAMES`."""
    relation = parse(text, NAMES, angle)
    values = {name: SX(value) for name, value in NAMES.items()}
    return float(expression(relation.left, values, angle) - expression(relation.right, values, angle))


MEANINGS = {
    "x1 - 1.5*x2 >= 0": 0.0,
    "x1 <= 2": 1.0,
    "2 == x2": 0.0,
    "-x1^2 >= 0": -9.0,
    "(-x1)^2 >= 0": 9.0,
    "2^3^2 >= 0": 512.0,
    "2^-1 >= 0": 0.5,
    "10 - 4 - 3 >= 0": 3.0,
    "12 / 3 / 2 >= 0": 2.0,
    "2 + 3 * x2 >= 1": 7.0,
    "(2 + 3) * x2 >= 1": 9.0,
    "sqrt(x1^2 + 16) >= abs(base_1_x)": 3.5,
    "--x1 >= +-x2": 5.0,
    "1e2*.5 >= 5.": 45.0,
    "x1^0.5 >= 0": math.sqrt(3),
    "  x1>=x2  ": 1.0,
}


@pytest.mark.parametrize("text", MEANINGS)
def test_sentences_mean_what_they_mean_in_mathematics(text: str) -> None:
    assert difference(text) == pytest.approx(MEANINGS[text], abs=1e-15)


def test_sine_and_cosine_take_the_angles_of_the_case() -> None:
    assert difference("sin(angle) >= cos(60)", math.radians(1)) == pytest.approx(0, abs=1e-15)
    assert difference("x1 >= sqrt(sin(150))", math.radians(1)) == pytest.approx(3 - math.sqrt(0.5), abs=1e-15)
    with pytest.raises(ExpressionError, match="without a finite value"):
        parse("x1 >= sqrt(sin(190))", NAMES, math.radians(1))


def test_a_name_may_have_a_dot_where_the_case_has_such_a_name() -> None:
    names = ("p_x", "robot.p_x")
    relation = parse("robot.p_x - 2.5*p_x >= .5", names)
    assert float(expression(relation.left, {"p_x": SX(2), "robot.p_x": SX(7)})) == 2.0
    with pytest.raises(ExpressionError, match=r"'robot.p_y' at position 1 is no number of this case; did you mean"):
        parse("robot.p_y >= 0", names)
    for text in ("p_x.real >= 0", "robot. p_x >= 0", "robot.2 >= 0"):
        with pytest.raises(ExpressionError):
            parse(text, names)


REFUSED = {
    "": ("the sentence ends at position 1",),
    "x1": (">=", "the sentence ends at position 3"),
    "x1 > 0": ("'>' at position 4", "x1 »> 0"),
    "x1 => 0": ("'=' at position 4",),
    "x1 = 0": ("'=' at position 4",),
    "x1 - 1.5*y2 >= 0": ("'y2' at position 10 is no number of this case", "allowed: x1, x2"),
    "x1 +* x2 >= 0": ("'*' stands at position 5", "x1 +»* x2"),
    "x1 x2 >= 0": ("expected an operator", "'x2' stands at position 4"),
    "(x1 - x2 >= 0": ("closes position 1", "'>=' stands at position 10"),
    "x1) >= 0": ("')' stands at position 3",),
    "0 <= x1 <= 3": ("expected an operator or the end", "'<=' stands at position 9"),
    "sqrt x1 >= 0": ("expected a bracket after sqrt",),
    "__import__('os') >= 0": ('"\'" at position 12 means nothing here',),
    "__import__(x1) >= 0": ("'__import__' at position 1", "allowed:"),
    "x1.real >= 0": ("'.' at position 3",),
    "x1[0] >= 0": ("'[' at position 3",),
    "exp(x1) >= 0": ("'exp' at position 1", "allowed:"),
    "1e999 >= x1": ("finite number",),
    "x1 >= 0; x2 >= 0": ("';' at position 8",),
    "(" * 300 + "x1": ("more than 40 brackets",),
    "-" * 300 + "x1 >= 0": ("more than 40 brackets",),
    "1+" * 300 + "x1 >= 0": ("longer than 400 characters",),
}


@pytest.mark.parametrize("text", REFUSED)
def test_a_wrong_sentence_is_refused_at_its_token(text: str) -> None:
    with pytest.raises(ExpressionError) as refused:
        parse(text, NAMES)
    for part in REFUSED[text]:
        assert part in str(refused.value)


letters = st.text(alphabet="x12 ()+-*/^<>=.esqrtin_§²½" + string.digits, max_size=40)
pieces = st.lists(
    st.sampled_from(["x1", "x2", "3", "1.5", "(", ")", "+", "-", "*", "/", "^", ">=", "<=", "==", "sqrt", "abs(", " "]),
    max_size=25,
).map("".join)


@settings(max_examples=400, deadline=None)
@given(st.one_of(letters, pieces, st.text(max_size=30)))
def test_whatever_is_written_is_a_relation_or_is_refused(text: str) -> None:
    try:
        relation = parse(text, NAMES)
    except ExpressionError:
        return
    values = {name: SX.sym(name) for name in NAMES}
    whole = expression(relation.left, values) - expression(relation.right, values)
    assert whole.shape == (1, 1)
    assert {symbol.name() for symbol in ca.symvar(whole)} <= set(NAMES)


numbers = st.integers(1, 9).map(str)
sums = st.recursive(
    st.one_of(numbers, st.sampled_from(["x1", "x2"])),
    lambda inner: st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
    max_leaves=12,
)


@settings(max_examples=200, deadline=None)
@given(sums, sums)
def test_bracketed_sums_and_products_have_the_value_that_arithmetic_gives(left: str, right: str) -> None:
    expected = eval(left, {}, dict(NAMES)) - eval(right, {}, dict(NAMES))  # noqa: S307 - made above from digits
    assert difference(f"{left} >= {right}") == pytest.approx(expected, rel=1e-12, abs=1e-9)
