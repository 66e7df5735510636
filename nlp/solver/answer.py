"""Methods of an answer that show it: as text, picture, page or plain data.

They do the work of the package's public functions, which stand in rooms above this one. A method asks the package's
index for its function when it is called, so that this room imports none of these rooms.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from .. import Picture
    from .certified import Certified
    from .solution import Solution


class Answer:
    """An answer to a case that can show itself: a solution, alone or with its certificates."""

    def table(self, width: int = 120) -> str:
        """Return the tables of the answer as text, as ``solve`` prints them.

        Args:
            width: number of columns.
        """
        from .. import text_of  # noqa: PLC0415 - the index finds the function when it is needed

        return text_of(self._found(), width)

    def plot(self, file: str | Path | None = None) -> Picture:
        """Return the drawing of the robot with its tasks, which a notebook shows.

        Args:
            file: file that the drawing is written to, by the name's ending as PNG, SVG or PDF; None for none.

        Raises:
            InputError: the ending is another one, Matplotlib is not installed, or the file cannot be written.
            EvaluationError: the robot does not exist at the point reached.
        """
        from .. import picture_of, plot  # noqa: PLC0415 - the index finds the functions when they are needed

        found = self._found()
        solution = cast("Solution", getattr(found, "solution", found))
        if file is not None:
            plot(solution, file)
        return picture_of(solution)

    def report(self, file: str | Path | None = None) -> str:
        """Return the page about the answer as HTML, which opens without a network.

        Args:
            file: file that the page is written to; None for none.

        Raises:
            InputError: Plotly is not installed, or the file cannot be written.
        """
        from .. import report  # noqa: PLC0415 - the index finds the function when it is needed

        return report(self._found(), file=file)

    def to_dict(self) -> dict[str, object]:
        """Return the result as JSON's own types, as ``--json`` writes it."""
        from .. import json_data, result_of  # noqa: PLC0415 - the index finds the functions when they are needed

        return {**json_data(result_of(self._found()))}

    def _found(self) -> Solution | Certified:
        """Return the answer itself, whose classes are the two kinds of answers."""
        return cast("Solution | Certified", self)
