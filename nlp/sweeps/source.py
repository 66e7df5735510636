"""A case as text, from which other processes and machines read it at each point of a sweep."""

from __future__ import annotations

import tomllib
from typing import NamedTuple

from ..case.case import Case
from ..case.overrides import Settings
from ..case.reader import CaseFile, case_from_tables


class CaseSource(NamedTuple):
    """A case as text that needs no other file.

    Attributes:
        text: TOML.
        name: name of the case in results.
        source: name of its file in messages.
    """

    text: str
    name: str
    source: str

    @classmethod
    def from_file(cls, read: CaseFile) -> CaseSource:
        """Return the source of a case that was read from a file."""
        return cls(read.text, read.case.name, read.case.source or read.case.name)

    def case_at(self, settings: Settings) -> Case:
        """Return the case with numbers replaced by name.

        Raises:
            CaseError: the case has no such number, or a value is not allowed.
        """
        return case_from_tables(tomllib.loads(self.text), name=self.name, source=self.source, settings=settings)
