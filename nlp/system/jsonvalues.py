"""Frozen values that JSON writes as objects: base class, declarations of fields, and conversion.

A subclass of :class:`JsonObject` declares its fields like a dataclass, and type checkers treat it as one. An annotation
also states the needs of JSON, its schema and its reader: whether a field may be absent, its key, and the dimension of a
value that results show in the case's unit.

It is not a dataclass, because ``dataclass`` compiles methods for each class, which takes 0.4 ms: forty classes would
slow a short command by a thirtieth.
"""

import enum
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING
from types import NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    NamedTuple,
    TypeAlias,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from ...models import Dimension, FloatArray, frozen_vector
from ..units import Units
from .strictjson import Entry, Made, Size

if TYPE_CHECKING:
    from typing import Self

_T = TypeVar("_T")
JsonValue: TypeAlias = "bool | int | float | str | list[JsonValue] | dict[str, JsonValue] | None"


class Mark(enum.Enum):
    """Treatment of a field that is written only sometimes, or under another key."""

    ABSENT = "left out if it is None"
    INLINE = "replaced by its fields, or left out if it is None"
    HIDDEN = "for computations: never written, and set to its default by the reader"


class Key(NamedTuple):
    """Key of a field in JSON, if it differs from the attribute."""

    name: str


class Measure(enum.Enum):
    """Relation of a value to ``dimension``, a hidden field of the same object."""

    NUMBER = "a value of that dimension"
    SLOPE = "a derivative with respect to such a value"


#: Field that is left out if its value is None; an empty text becomes None when it is copied.
Absent: TypeAlias = Annotated[_T | None, Mark.ABSENT]
#: Field that is replaced by its own fields.
Inline: TypeAlias = Annotated[_T, Mark.INLINE]
#: Value of the object's dimension, and derivative with respect to such a value.
Shown: TypeAlias = Annotated[float, Measure.NUMBER]
Slope: TypeAlias = Annotated[_T, Measure.SLOPE]
#: Field that JSON never contains.
Hidden: TypeAlias = Annotated[_T, Mark.HIDDEN]

Vector: TypeAlias = tuple[float, ...]
Vector3: TypeAlias = Annotated[tuple[float, ...], Size(3)]
Vector6: TypeAlias = Annotated[tuple[float, ...], Size(6)]
Matrix: TypeAlias = tuple[tuple[float, ...], ...]

if TYPE_CHECKING:
    #: Number that may be undefined: null in JSON if it is not finite, and NaN when it is read.
    Known: TypeAlias = float
    #: Array (n,).
    Row: TypeAlias = FloatArray
else:
    Known = Annotated[float | None, Made(lambda value: math.nan if value is None else value)]
    Row = Annotated[tuple[float, ...], Made(frozen_vector)]


class Field(NamedTuple):
    """Declaration of a field.

    Attributes:
        key: key in JSON.
        mark: treatment; None for a field that is always written.
        measure: dimension of the value, or its relation to the object's dimension; None for a value without conversion.
        made: True if the attribute's value differs from JSON's: see :data:`Known` and :data:`Row`.
    """

    key: str
    mark: Mark | None
    measure: Dimension | Measure | None
    made: bool


@dataclass_transform(eq_default=False, frozen_default=True, kw_only_default=True)
class JsonObject:
    """Frozen value with named fields, which JSON writes in the order of their declaration.

    Attributes:
        fields: declarations of the fields by name, in order.
    """

    fields: ClassVar[Mapping[str, Field]] = {}

    def __init_subclass__(cls) -> None:
        kinds = cls.__annotations__
        if any(isinstance(kind, str) for kind in kinds.values()):
            raise TypeError(f"{cls.__name__}: its annotations are read at run time, and must not be text")
        # A subclass has the fields of its base first.
        cls.fields = {**cls.fields, **{name: _field(name, kind) for name, kind in kinds.items()}}

    def __init__(self, **values: object) -> None:
        # A default is an attribute of the class.
        if values.keys() != self.fields.keys():
            wrong = [each for each in self.fields.keys() ^ values.keys() if each in values or not hasattr(self, each)]
            if wrong:
                raise TypeError(f"{type(self).__name__}: missing or unknown fields: {', '.join(sorted(wrong))}")
        self.__dict__.update(values)

    @classmethod
    def of(cls, row: object, units: Units | None = None, /, **given: object) -> "Self":
        """Return an object with fields from the attributes of the same names of another value.

        Args:
            row: other value, or object of this class; its arrays become tuples for fields that are tuples, and its
                numbers that are not finite None.
            units: units of the case, to convert values with a dimension; None for values already in these units.
            given: fields that are missing in the other value, or replace its attributes.
        """
        measured = None if units is None else getattr(row, "dimension", Dimension.NUMBER)
        copied = {
            name: _copied(getattr(row, name), each, units, measured)
            for name, each in cls.fields.items()
            if name not in given and (each.mark is not Mark.HIDDEN or hasattr(row, name))
        }
        if units is not None and "dimension" in copied:
            copied["dimension"] = Dimension.NUMBER
        return cls(**copied, **given)

    @classmethod
    def of_each(cls, rows: Iterable[object], units: Units | None = None) -> "tuple[Self, ...]":
        """Return an object for each of several values; arguments are those of :meth:`of`."""
        return tuple(cls.of(row, units) for row in rows)

    @classmethod
    def entries(cls) -> tuple[Entry, ...]:
        """Return the fields that JSON has, for :func:`.entries_of`.

        A type whose module few commands need stands in an annotation as text, such as ``Absent["ProofData"]``. Code
        that reads such a value, or makes its schema, must have imported that module.
        """
        objects = {each.__name__: each for each in _subclasses(JsonObject)}
        kinds = get_type_hints(cls, localns=objects, include_extras=True)
        return tuple(
            _entry(name, each, kinds[name]) for name, each in cls.fields.items() if each.mark is not Mark.HIDDEN
        )

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} is frozen: {name} cannot be set")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{type(self).__name__} is frozen: {name} cannot be deleted")

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={getattr(self, name)!r}' for name in self.fields)})"


def _field(name: str, kind: object) -> Field:
    """Return the declaration of a field from its annotation."""
    key, mark, measure, made = name, None, None, False
    for each in getattr(kind, "__metadata__", ()) if get_origin(kind) is Annotated else ():
        if isinstance(each, Key):
            key = each.name
        elif isinstance(each, Mark):
            mark = each
        elif isinstance(each, Dimension | Measure):
            measure = each
        made = made or isinstance(each, Made)
    return Field(key, mark, measure, made)


def _entry(name: str, field: Field, kind: object) -> Entry:
    """Return the declaration of a JSON field from its annotation.

    Raises:
        TypeError: a part that is no object stands inline.
    """
    if field.mark is None:
        return Entry(name, field.key, kind)
    inner = without_none(kind)
    if field.mark is Mark.ABSENT:
        return Entry(name, field.key, kind, None)
    if not (isinstance(inner, type) and issubclass(inner, JsonObject)):
        raise TypeError(f"field {name}: an inline field must be a JsonObject, got {inner!r}")
    return Entry(name, field.key, kind, MISSING if inner is get_args(kind)[0] else None, inner)


def _copied(value: Any, field: Field, units: Units | None, dimension: Dimension | None) -> object:  # noqa: ANN401 - of any field
    """Return a value for a field of another object, with dimensional values in the case's units if requested."""
    if isinstance(value, np.ndarray) and not field.made:
        value = vector(value) if value.ndim == 1 else matrix(value)
    if units is not None and dimension is not None:
        if field.measure is Measure.SLOPE:
            value = None if value is None else units.per_unit(value, dimension)
        elif field.measure is not None:
            value = _shown(value, units, dimension if field.measure is Measure.NUMBER else field.measure)
        elif isinstance(value, JsonObject):
            value = type(value).of(value, units)
        elif isinstance(value, tuple):
            value = tuple(type(each).of(each, units) if isinstance(each, JsonObject) else each for each in value)
    if isinstance(value, float) and not field.made:
        return finite_or_none(value)
    return None if field.mark is Mark.ABSENT and isinstance(value, str) and not value else value


def _shown(value: Any, units: Units, dimension: Dimension) -> object:  # noqa: ANN401 - a number or several
    """Return a number, or each number of several, in the case's unit of a dimension."""
    if isinstance(value, tuple):
        return tuple(_shown(each, units, dimension) for each in value)
    return None if value is None else units.shown(value, dimension)


def without_none(kind: object) -> Any:  # noqa: ANN401 - another annotation
    """Return an annotation without its mark, and without None."""
    inner = get_args(kind)[0]
    if get_origin(inner) not in (Union, UnionType):
        return inner
    kinds = [part for part in get_args(inner) if part is not NoneType]
    return kinds[0] if len(kinds) == 1 else Union[tuple(kinds)]  # noqa: UP007 - the types are known at run time only


def _subclasses(kind: type[JsonObject]) -> Iterator[type[JsonObject]]:
    """Yield the direct and indirect subclasses of a type."""
    for each in kind.__subclasses__():
        yield each
        yield from _subclasses(each)


def json_data(value: JsonObject) -> dict[str, JsonValue]:
    """Return a value as JSON's own types.

    Raises:
        TypeError: JSON has no type for the value of a field.
    """
    found: dict[str, JsonValue] = {}
    for name, each in value.fields.items():
        part = getattr(value, name)
        if each.mark is Mark.INLINE:
            found |= {} if part is None else json_data(part)
        elif each.mark is None or (each.mark is Mark.ABSENT and part is not None):
            found[each.key] = _json_value(finite_or_none(part) if each.made and isinstance(part, float) else part)
    return found


def _json_value(value: object) -> JsonValue:
    """Return a field's value as JSON's own types."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, JsonObject):
        return json_data(value)
    if isinstance(value, np.ndarray):
        return value.tolist()  # type: ignore[no-any-return]
    if isinstance(value, tuple | list):
        return [_json_value(each) for each in value]
    if isinstance(value, Mapping):
        return {str(key): _json_value(each) for key, each in value.items()}
    if isinstance(value, enum.Enum):
        return _json_value(value.value)
    raise TypeError(f"JSON has no type for {value!r}")


def finite_or_none(value: float) -> float | None:
    """Return a number; None if it is not finite."""
    return float(value) if math.isfinite(value) else None


def vector(values: FloatArray) -> Vector:
    """Return an array (n,) as a tuple."""
    return tuple(np.asarray(values, dtype=np.float64).tolist())


def matrix(values: FloatArray) -> Matrix:
    """Return an array (m, n) as a tuple of rows."""
    return tuple(tuple(row) for row in np.asarray(values, dtype=np.float64).tolist())
