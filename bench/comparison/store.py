"""Results of a run as JSON, written anew after each measurement, so that an interrupted run leaves what it has."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .machine import machine


class Store:
    """The file of a run's results.

    Attributes:
        path: of the file.
        data: machine, name of the run, and the sections measured so far.
    """

    def __init__(self, path: Path, data: dict[str, Any]) -> None:
        self.path, self.data = path, data

    @classmethod
    def begin(cls, path: Path, run: str) -> Store:
        """Return the store of a new run."""
        return cls(path, {"run": run, "machine": machine(), "sections": {}})

    @classmethod
    def read(cls, path: Path) -> Store:
        """Return the store of an earlier run."""
        return cls(path, json.loads(path.read_text(encoding="utf-8")))

    def keeper(self, section: str) -> Callable[[object], None]:
        """Return the function that takes a section's results so far."""

        def keep(found: object) -> None:
            self.data["sections"][section] = found
            self.write()

        return keep

    def write(self) -> None:
        """Write the file whole, in the place of the earlier one."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        fresh = self.path.with_suffix(".part")
        fresh.write_text(json.dumps(self.data, indent=1) + "\n", encoding="utf-8")
        fresh.replace(self.path)
