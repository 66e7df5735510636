"""Base of all tables in case files: only known keys, strict types, and messages in the words of the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Annotated, Any, ClassVar

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    FiniteFloat,
    GetCoreSchemaHandler,
    StringConstraints,
    Tag,
    model_validator,
)
from pydantic_core import CoreSchema, ErrorDetails, PydanticCustomError, core_schema

from ..errors import CaseError, nearest

FileName = Annotated[str, StringConstraints(min_length=1)]
Vector = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]


def empty_list() -> list[Any]:
    """Return an empty list, as the default of a key; pydantic inspects ``list`` itself 2 ms slower."""
    return []


class Table(BaseModel):
    """Table of a case file, with only known keys."""

    # Validators are built when a document is first read, once for the whole tree of tables.
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, defer_build=True)

    @classmethod
    def allowed_keys(cls) -> tuple[str, ...]:
        """Return the allowed keys of the table."""
        return tuple(field.alias or name for name, field in cls.model_fields.items())

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, table: object) -> object:
        """Refuse the first unknown key of a table."""
        if isinstance(table, dict) and cls.model_config.get("extra") == "forbid":
            for key in table:
                if key not in cls.allowed_keys():
                    allowed = nearest(str(key), cls.allowed_keys())
                    raise PydanticCustomError(
                        "unknown_key", "{fault}", {"key": key, "fault": f"no such key; {allowed}"}
                    )
        return table


class Range(Table):
    """Free variable between two bounds."""

    min: FiniteFloat = Field(description="lower bound of the variable")
    max: FiniteFloat = Field(description="upper bound of the variable, above min")
    start: FiniteFloat | None = Field(
        default=None, description="value at the first starting point; the middle of the range if left out"
    )


def tag_of_number(value: object) -> str:
    """Return the branch of a union for a number or a range."""
    return "<range>" if isinstance(value, dict | Range) else "<number>"


Value = Annotated[
    Annotated[FiniteFloat, Tag("<number>")] | Annotated[Range, Tag("<range>")], Discriminator(tag_of_number)
]


class Later:
    """Type of a table with a late import: the class is imported when a document contains the table.

    Args:
        module: module of this package.
        name: name of the class.

    Attributes:
        is_over: If true, types that are built from now on import the class at once, as a JSON Schema needs.
    """

    is_over: ClassVar[bool] = False

    def __init__(self, module: str, name: str) -> None:
        self._module, self._name = module, name

    def __get_pydantic_core_schema__(self, _source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        if self.is_over:
            return handler.generate_schema(self._table())
        return core_schema.no_info_plain_validator_function(lambda value: self._table().model_validate(value))

    def _table(self) -> type[Table]:
        kind: type[Table] = getattr(import_module(f".{self._module}", __package__), self._name)
        return kind


#: Similarity from which a key is taken for a misspelled one: "rotation" is no misspelled "position".
_TYPO = 0.8
#: Parts of a pydantic location that are branches of a union, or mark a key of a table, and not keys of the file.
_TAGS = (
    "<number>",
    "<range>",
    "<values>",
    "<tasks>",
    "<list>",
    "<pose>",
    "<poses>",
    "<word>",
    "<lists>",
    "<set>",
    "[key]",
)


def fault_of(key: str, fault: str) -> PydanticCustomError:
    """Return the error of a validator about a key of its table; an empty key stands for the whole table."""
    return PydanticCustomError("reason", "{fault}", {"fault": fault, **({"key": key} if key else {})})


def case_error(fault: ErrorDetails) -> CaseError:
    """Return an error of pydantic as an error with a dotted key and a sentence."""
    context = fault.get("ctx", {})
    location = [*fault["loc"], *([context["key"]] if "key" in context else [])]
    value = fault["input"]
    shown = value if isinstance(value, str | int | float | bool) and "key" not in context else None
    return CaseError(dotted_key(location), _sentence(fault, context), shown)


def dotted_key(location: list[int | str]) -> str:
    """Return a location in the document as a dotted key, such as ``robot.parameters.x4.min``, ``pose.position[0]``."""

    def parts() -> Iterator[str]:
        for part in location:
            if isinstance(part, int):
                yield f"[{part}]"
            elif part not in _TAGS:
                yield f".{part}"

    return "".join(parts()).lstrip(".") or "the file"


#: Sentences by pydantic's kind of error, for any key.
_KINDS = {
    "model_type": "must be a table",
    "dict_type": "must be a table",
    "list_type": "must be a list",
    "string_type": "must be text in quotes",
    "bool_type": "must be true or false",
    "int_type": "must be a whole number",
    "float_type": "must be a number",
    "finite_number": "must be finite",
    "string_too_short": "must not be empty",
}
#: Sentences for keys for which "must be a list" would say too little.
_FORMS = {
    **dict.fromkeys(("axis", "point", "force", "moment", "centre", "acceleration"), "must be a list of 3 numbers"),
    "rpy": "must be a list of 3 numbers: roll, pitch, yaw",
    "matrix": "must be a list of 3 rows of 3 numbers",
    "quaternion": "must be a list of 4 numbers: w, x, y, z",
    "twist": "must be a list of 6 numbers",
    "position": "must be a list of 3, each a number or { min, max }",
    "values": "must be a list of numbers",
    "task": "must be a list of tables: write [[task]], with two brackets",
    "load": "must be a list of tables: write [[load]], with two brackets",
    "limb": "must be a list of tables: write [[limb]], with two brackets",
    "published": "must be a list of tables: write [[published]], with two brackets",
}
#: Advice for missing keys of case files.
_MISSING = {
    **dict.fromkeys(("min", "max", "first", "last", "value", "joint_centre"), "give a number"),
    **dict.fromkeys(("quantity", "source"), "give text in quotes"),
    **dict.fromkeys(("translation", "acceleration"), "give a list of 3 numbers"),
    "count": "give a whole number",
    "length": "give a length by which moments are divided, such as the radius of the platform",
    "position": "give a list of 3, each a number or { min, max }",
    "reproduced": "give true or false",
    "robot": "add a table [robot]",
    "sense": "give 'max' or 'min'",
    "within": "give the largest allowed difference",
}
#: Keys with the name of a file, and keys of the tables that its rows become.
_FILES = {"poses": "pose", "tasks": "task"}


def _sentence(fault: ErrorDetails, context: Mapping[str, Any]) -> str:
    """Return the message of an error without its key.

    Args:
        fault: error of pydantic.
        context: context of the error, as pydantic returns it.
    """
    key = str(fault["loc"][-1]) if fault["loc"] else ""
    match fault["type"]:
        case "unknown_key" | "reason":
            sentence = str(context["fault"])
        case "literal_error":
            one_of = "one of " * ("," in context["expected"] or " or " in context["expected"])
            sentence = f"must be {one_of}{context['expected']}"
        case "string_type" if key in _FILES:
            sentence = f"must be the name of a CSV file; for tables, write [[{_FILES[key]}]]"
        case "list_type" if key in _FORMS:
            sentence = _FORMS[key]
        case "float_type":
            sentence = _sentence_of_number(fault)
        case "missing":
            sentence = _sentence_of_missing_key(key, fault["input"])
        case "too_short" | "too_long" as kind:
            limit = context["min_length"] if kind == "too_short" else context["max_length"]
            few = "at least " if kind == "too_short" and limit == 1 else ""
            sentence = f"must have {few}{limit} {'entry' if limit == 1 else 'entries'}, got {context['actual_length']}"
        case kind:
            sentence = _KINDS.get(kind, fault["msg"].replace("Input should be", "must be"))
    return sentence


def _sentence_of_missing_key(key: str, table: object) -> str:
    """Return the message about a missing key, with an unknown key of the table that is similar."""
    import difflib  # noqa: PLC0415 - only messages need it

    close = difflib.get_close_matches(key, table if isinstance(table, dict) else (), n=1, cutoff=_TYPO)
    if close:
        return f"is missing; rename {close[0]!r}?"
    return f"is missing: {_MISSING[key]}" if key in _MISSING else "is missing"


def _sentence_of_number(fault: ErrorDetails) -> str:
    """Return the message about a value that is not a number."""
    location, text = fault["loc"], fault["input"]
    if location[-1] == "pitch":
        return "must be a number, or inf without quotes"
    allowed = "must be a number"
    if location[-1] == "<number>":
        allowed += " or a list of numbers" if location[0] == "published" else " or { min, max }"
    return f"{allowed}{_hint_of_number(text)}" if isinstance(text, str) else allowed


def _hint_of_number(text: str) -> str:
    """Return a hint for a text instead of a number: remove quotes, or the unit; empty without a hint."""
    from ..system.slips import hint_of  # noqa: PLC0415 - only messages need it

    try:
        float(text)
    except ValueError:
        return hint_of(text)
    return f"; write {text.strip()} without quotes"
