"""Equal shares of a section's time for its parts."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")


def shared(seconds: float, parts: Sequence[T]) -> Iterator[tuple[T, float]]:
    """Yield each part with the end of its time, a value of ``time.monotonic``: what parts leave, later ones share."""
    end = time.monotonic() + seconds
    for k, part in enumerate(parts):
        now = time.monotonic()
        yield part, now + (end - now) / (len(parts) - k)
