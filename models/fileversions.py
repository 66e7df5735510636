"""Versions of file formats: the key ``schema``, the supported versions, and the message about other versions.

A version changes when a key changes its meaning or is removed; a new optional key needs no new version.
"""

from __future__ import annotations

from typing import Final, NamedTuple

#: Key of the version in a file.
VERSION_KEY: Final = "schema"


class FileVersions(NamedTuple):
    """Versions of one kind of file.

    Attributes:
        kind: kind of file, in the plural.
        newest: version of written files; also the newest version that can be read.
        oldest: oldest version that can be read.
    """

    kind: str
    newest: int = 1
    oldest: int = 1

    def fault(self, version: object) -> str | None:
        """Return the reason why a version is not supported, as the second half of a sentence.

        None if it is supported.
        """
        read = f"this screwsynth reads {self.kind} of schema {_range(self.oldest, self.newest)}"
        # True and 1.0 equal 1 in Python, but neither is a version number.
        if type(version) is not int or version < 1:
            return f"must be a version number, a whole number from 1; {read}"
        if self.oldest <= version <= self.newest:
            return None
        return f"{read}; {'a later' if version > self.newest else 'an earlier'} version of it reads this one"


def _range(oldest: int, newest: int) -> str:
    if oldest == newest:
        return f"{newest}"
    return f"{oldest} {'and' if newest == oldest + 1 else 'to'} {newest}"


#: Kinds with an optional key: a file without it has version 1.
CASE_FILES = FileVersions("case files")
ROBOT_FILES = FileVersions("robot files")
#: Kinds that only this program writes, always with the key.
RESULT_FILES = FileVersions("results")
PROOF_FILES = FileVersions("proofs")
GENERATED_C = FileVersions("folders of generated C")
