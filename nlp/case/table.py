"""Base class of the tables of a case file: known keys only, and pydantic's strict types."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator
from pydantic_core import PydanticCustomError

from ..errors import nearest

Vector = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]


class Table(BaseModel):
    """A table of a case file, with its known keys only."""

    # Validators are built when a document is first read, once for the whole tree of tables.
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, table: object) -> object:
        """Return the table unchanged, or refuse its first unknown key."""
        if isinstance(table, dict) and cls.model_config.get("extra") == "forbid":
            for key in table:
                if key not in cls.model_fields:
                    allowed = nearest(str(key), cls.model_fields)
                    raise PydanticCustomError(
                        "unknown_key", "{fault}", {"key": key, "fault": f"no such key; {allowed}"}
                    )
        return table
