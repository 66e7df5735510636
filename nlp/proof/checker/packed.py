"""Trees in proof files: compressed, in base64, with a digest; unpacked only when their claim is checked.

A few bytes can unpack to thousands of times as many, and a file may have many trees. All trees of a file therefore
share one budget, and only one tree at a time is in memory.
"""

from __future__ import annotations

import base64
import hashlib
import zlib
from dataclasses import dataclass, field

from ...errors import InputError

#: Largest total number of bytes of a file's unpacked trees: a hundred times that of the proofs in docs/certificate.md.
LARGEST_TREES = 2**27


class DamagedProofError(InputError):
    """Error of a proof file with a damaged tree, or with trees that are too large."""


class TreeBudget:
    """Remaining bytes for the unpacked trees of a file; each tree counts once, however often it is unpacked."""

    def __init__(self) -> None:
        self.left = LARGEST_TREES
        self._counted: dict[int, int] = {}

    def most_of(self, number: int) -> int:
        """Return the largest allowed size, in bytes, of the tree with a number in the file."""
        return self._counted.get(number, self.left)

    def count(self, number: int, size: int) -> None:
        """Subtract the size of a tree from the remaining bytes, once for each tree."""
        if number not in self._counted:
            self._counted[number] = size
            self.left -= size


@dataclass(frozen=True)
class PackedTree:
    """A tree as stored in a file.

    Attributes:
        text: compressed bytes in base64.
        digest: SHA-256 of the unpacked bytes, in hexadecimal digits.
        source, claim: file, and claim of the tree, for messages.
        number: number of the tree in its file.
        budget: budget of the file.
    """

    text: str
    digest: str
    source: str = field(compare=False)
    claim: str = field(compare=False)
    number: int = field(compare=False)
    budget: TreeBudget = field(compare=False, repr=False)

    def unpacked(self) -> bytes:
        """Return the unpacked bytes of the tree: its nodes.

        Raises:
            DamagedProofError: the text is no compressed tree, its digest differs, or the trees of the file exceed
                their budget.
        """
        most, reader = self.budget.most_of(self.number), zlib.decompressobj()
        damaged = f"{self.source}: the proof of '{self.claim}' is damaged"
        try:
            # One byte more than allowed reveals a tree that is too large.
            tree = reader.decompress(base64.b64decode(self.text, validate=True), most + 1)
        except (ValueError, zlib.error):
            raise DamagedProofError(f"{damaged}: its tree cannot be unpacked") from None
        if len(tree) > most:
            size = f"{LARGEST_TREES // 2**20} MB, the largest allowed total of a proof file"
            raise DamagedProofError(f"{self.source}: the unpacked trees, up to that of '{self.claim}', exceed {size}")
        if not reader.eof or reader.unused_data:
            raise DamagedProofError(f"{damaged}: its tree is incomplete")
        if self.digest != hashlib.sha256(tree).hexdigest():
            raise DamagedProofError(f"{damaged}: its tree does not match its digest")
        self.budget.count(self.number, len(tree))
        return tree


def packed_text(tree: bytes) -> str:
    """Return the compressed bytes of a tree in base64."""
    return base64.b64encode(zlib.compress(tree, 9)).decode("ascii")


def digest_of(tree: bytes) -> str:
    """Return the digest of the bytes of a tree."""
    return hashlib.sha256(tree).hexdigest()
