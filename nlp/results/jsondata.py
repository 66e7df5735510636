"""Frozen values that JSON writes as objects: their base class, the marks of their fields, and the conversion.

A subclass of :class:`JsonObject` declares its fields as a dataclass does, and type checkers treat it as a dataclass. It
is no dataclass, because ``dataclass`` compiles methods for each class, which takes 0.4 ms: forty classes would make a
short command a thirtieth slower.
"""

import enum
import math
from collections.abc import Iterator, Mapping
from typing import (
    TYPE_CHECKING,
    Annotated,
    ClassVar,
    TypeAlias,
    TypeVar,
    dataclass_transform,
    get_origin,
    get_type_hints,
)

import numpy as np

from ...models import FloatArray
from ..system.strictjson import Size

if TYPE_CHECKING:
    from typing import Self

_T = TypeVar("_T")
JsonValue: TypeAlias = "bool | int | float | str | list[JsonValue] | dict[str, JsonValue] | None"


class Mark(enum.Enum):
    """Treatment of a field that is not always written, or not under its own name."""

    ABSENT = "left out where it is None"
    INLINE = "its own fields stand in its place; none of them where it is None"


#: A field that is absent from the object where the value is None.
Absent: TypeAlias = Annotated[_T | None, Mark.ABSENT]
#: A field whose own fields are written in its place.
Inline: TypeAlias = Annotated[_T, Mark.INLINE]

Vector: TypeAlias = tuple[float, ...]
Vector3: TypeAlias = Annotated[tuple[float, ...], Size(3)]
Vector6: TypeAlias = Annotated[tuple[float, ...], Size(6)]
Matrix: TypeAlias = tuple[tuple[float, ...], ...]


@dataclass_transform(eq_default=False, frozen_default=True, kw_only_default=True)
class JsonObject:
    """A frozen value with named fields, which JSON writes in the order of their declaration.

    Attributes:
        marks: the fields' marks by name, in order.
    """

    marks: ClassVar[Mapping[str, Mark | None]] = {}

    def __init_subclass__(cls) -> None:
        kinds = cls.__annotations__
        if any(isinstance(kind, str) for kind in kinds.values()):
            raise TypeError(f"{cls.__name__}: its annotations are read at run time, and must not be text")
        # A subclass has the fields of its base first.
        cls.marks = {**cls.marks, **{name: _mark_of(kind) for name, kind in kinds.items()}}

    def __init__(self, **values: object) -> None:
        if values.keys() != self.marks.keys():
            wrong = ", ".join(sorted(values.keys() ^ self.marks.keys()))
            raise TypeError(f"{type(self).__name__}: missing or unknown fields: {wrong}")
        self.__dict__.update(values)

    @classmethod
    def of(cls, row: object, **given: object) -> "Self":
        """Return an object whose fields are the attributes of the same names of another value.

        Args:
            row: the other value; its arrays become tuples, and its numbers that are not finite None.
            given: fields that it has not, or not as they are.
        """
        copied = {name: _plain(getattr(row, name)) for name in cls.marks if name not in given}
        return cls(**copied, **given)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} is frozen: {name} cannot be set")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{type(self).__name__} is frozen: {name} cannot be deleted")

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={getattr(self, name)!r}' for name in self.marks)})"


def kinds_of(kind: type[JsonObject]) -> dict[str, object]:
    """Return the annotations of an object's fields by name.

    A type whose module few commands need stands in an annotation as text, such as ``Absent["ProofData"]``. Who calls
    this has imported that module.
    """
    objects = {each.__name__: each for each in _subclasses(JsonObject)}
    found = get_type_hints(kind, localns=objects, include_extras=True)
    return {name: found[name] for name in kind.marks}


def _subclasses(kind: type[JsonObject]) -> Iterator[type[JsonObject]]:
    """Yield the subclasses of a type, and theirs."""
    for each in kind.__subclasses__():
        yield each
        yield from _subclasses(each)


def _mark_of(kind: object) -> Mark | None:
    """Return the mark of a field's annotation; None without one."""
    marks = getattr(kind, "__metadata__", ()) if get_origin(kind) is Annotated else ()
    return next((mark for mark in marks if isinstance(mark, Mark)), None)


def json_data(value: JsonObject) -> dict[str, JsonValue]:
    """Return a value as JSON's own types.

    Raises:
        TypeError: a field holds a value that JSON has no type for.
    """
    found: dict[str, JsonValue] = {}
    for name, mark in value.marks.items():
        part = getattr(value, name)
        if mark is None:
            found[name] = _json_value(part)
        elif part is not None and mark is Mark.INLINE:
            found |= json_data(part)
        elif part is not None:
            found[name] = _json_value(part)
    return found


def _json_value(value: object) -> JsonValue:
    """Return a field's value as JSON's own types."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, JsonObject):
        return json_data(value)
    if isinstance(value, tuple | list):
        return [_json_value(each) for each in value]
    if isinstance(value, Mapping):
        return {str(key): _json_value(each) for key, each in value.items()}
    if isinstance(value, enum.Enum):
        return _json_value(value.value)
    raise TypeError(f"JSON has no type for {value!r}")


def _plain(value: object) -> object:
    """Return an array as a tuple, a number that JSON cannot hold as None, and anything else as it is."""
    if isinstance(value, np.ndarray):
        return vector(value) if value.ndim == 1 else matrix(value)
    return finite_or_none(value) if isinstance(value, float) else value


def finite_or_none(value: float) -> float | None:
    """Return a number, or None for one that JSON cannot hold."""
    return float(value) if math.isfinite(value) else None


def vector(values: FloatArray) -> Vector:
    """Return an array (n,) as a tuple."""
    return tuple(np.asarray(values, dtype=np.float64).tolist())


def matrix(values: FloatArray) -> Matrix:
    """Return an array (m, n) as a tuple of rows."""
    return tuple(tuple(row) for row in np.asarray(values, dtype=np.float64).tolist())
