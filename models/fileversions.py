"""Versions of files by kind: the key ``schema``, the versions that are read, and the words about another one.

A version changes where a key changes its meaning or leaves; a new key that may be left out changes none.
"""

from __future__ import annotations

from typing import Final, NamedTuple

#: Key of a file's version.
VERSION_KEY: Final = "schema"


class FileVersions(NamedTuple):
    """Versions of one kind of file.

    Attributes:
        kind: of file, in the plural.
        newest: the version that is written, and the newest that is read.
        oldest: the oldest version that is read.
    """

    kind: str
    newest: int = 1
    oldest: int = 1

    def fault(self, version: object) -> str | None:
        """Return why a file of a version is not read, as the second half of a sentence; None where it is read."""
        read = f"this screwsynth reads {self.kind} of schema {_range(self.oldest, self.newest)}"
        # True is 1, and so is 1.0, but neither is the number of a version.
        if type(version) is not int or version < 1:
            return f"must be a version, which is a whole number from 1; {read}"
        if self.oldest <= version <= self.newest:
            return None
        return f"{read}; {'a later' if version > self.newest else 'an earlier'} version of it reads this one"


def _range(oldest: int, newest: int) -> str:
    """Return versions in words."""
    if oldest == newest:
        return f"{newest}"
    return f"{oldest} {'and' if newest == oldest + 1 else 'to'} {newest}"


#: Kinds whose key may be left out: a file without it is of version 1.
CASE_FILES = FileVersions("case files")
ROBOT_FILES = FileVersions("robot files")
#: Kinds that the program alone writes, always with the key.
RESULT_FILES = FileVersions("results")
PROOF_FILES = FileVersions("proofs")
GENERATED_C = FileVersions("folders of generated C")
