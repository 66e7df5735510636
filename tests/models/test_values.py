import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field, replace

import pytest

from screwsynth.models.values import dataclass


def _fields() -> dict[str, object]:
    annotations = {"a": float, "b": tuple, "c": list, "d": float}
    defaults = {"b": (1.0,), "c": field(default_factory=list, compare=False), "d": field(default=4.0, repr=False)}
    return {"__annotations__": annotations, "__doc__": "Words.", **defaults}


def _pair(*, eq: bool) -> tuple[type, type]:
    kinds = []
    for decorate in (dataclass, dataclasses.dataclass):
        make: Callable[..., type] = decorate(frozen=True, eq=eq)  # type: ignore[assignment]
        kinds.append(make(type("Kind", (), _fields())))
    return kinds[0], kinds[1]


@pytest.mark.parametrize("eq", [True, False])
def test_values_are_those_of_a_compiled_dataclass(*, eq: bool) -> None:
    shared, compiled = _pair(eq=eq)
    for places, named in (((1.0,), {}), ((1.0, (2.0,)), {"d": 5.0}), ((), {"c": [3.0], "a": 2.0})):
        one, other = shared(*places, **named), compiled(*places, **named)
        assert vars(one) == vars(other)
        assert repr(one) == repr(other)
        assert vars(replace(one, a=7.0)) == vars(replace(other, a=7.0))
        again = shared(*places, **named)
        assert (one == again, hash(one) == hash(again)) == (eq, eq)
        assert one != other
    assert shared(1.0).c is not shared(1.0).c
    assert (shared(1.0) == shared(1.0, c=[1])) == eq
    assert shared(1.0) != shared(2.0)
    assert inspect.signature(shared).parameters.keys() == inspect.signature(compiled).parameters.keys()
    assert (
        str(inspect.signature(shared))
        == "(a: float, b: tuple = (1.0,), c: list = <class 'list'>, d: float = 4.0) -> None"
    )


@pytest.mark.parametrize(
    ("places", "named", "words"),
    [
        ((), {}, "missing a required argument: 'a'"),
        ((1, 2, 3, 4, 5), {}, "too many positional arguments"),
        ((1,), {"e": 2}, "unexpected keyword argument 'e'"),
        ((1,), {"a": 2}, "multiple values for argument 'a'"),
    ],
)
def test_wrong_fields_are_refused(places: tuple[int, ...], named: dict[str, int], words: str) -> None:
    shared, compiled = _pair(eq=True)
    with pytest.raises(TypeError, match=words):
        shared(*places, **named)
    with pytest.raises(TypeError):
        compiled(*places, **named)


def test_a_value_is_frozen() -> None:
    for kind in _pair(eq=True):
        value = kind(1.0)
        with pytest.raises(FrozenInstanceError, match="cannot assign to field 'a'"):
            value.a = 2.0
        with pytest.raises(FrozenInstanceError, match="cannot delete field 'a'"):
            del value.a
        assert value.a == 1.0


@dataclass(frozen=True)
class Checked:
    """A value that checks itself, and has words of its own."""

    size: float = 1.0

    def __post_init__(self) -> None:
        if self.size < 0:
            raise ValueError("negative")

    def __repr__(self) -> str:
        return f"size {self.size}"


def test_methods_of_the_class_stay_and_values_are_pickled() -> None:
    with pytest.raises(ValueError, match="negative"):
        Checked(-1.0)
    assert repr(Checked(2.0)) == "size 2.0"
    assert pickle.loads(pickle.dumps(Checked(2.0))) == Checked(2.0)  # noqa: S301 - its own bytes
