"""Files that the command ``workspace`` writes: JSON, slices, the robot at its worst pose, a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from .options import check_picture, write_json

if TYPE_CHECKING:
    from ..case.case import Case
    from ..proof.workspace.slices.slices import Slice
    from ..results.workspace import WorkspacePose, WorkspaceResult


class WorkspaceFiles(NamedTuple):
    """Files to write; None for one that is not asked for, ``-`` for standard output.

    Attributes:
        json: the result.
        plot: picture of the slices.
        picture: of the robot at its worst pose.
        page: of HTML.
        proof: of what is proved.
    """

    json: str | None
    plot: str | None
    picture: str | None
    page: str | None
    proof: str | None = None

    @property
    def is_piped(self) -> bool:
        """Whether a file is standard output."""
        return "-" in (self.json, self.page, self.proof)

    def check(self, inputs: Mapping[Path, str]) -> None:
        """Refuse files that cannot be written, before the work begins.

        Args:
            inputs: files that are read, and the words for each in messages.

        Raises:
            InputError: a file is refused.
        """
        from ..errors import InputError
        from ..output.files import check_outputs

        check_picture(self.plot)
        check_picture(self.picture)
        if self.page is not None:
            from ..output.pictures.requirements import check_library

            check_library("matplotlib", "pages")
        if [self.json, self.page, self.proof].count("-") > 1:
            raise InputError("standard output can take one of --json -, --html - and --proof - only")
        outputs = {
            "--json": self.json,
            "--plot": self.plot,
            "--picture": self.picture,
            "--html": self.page,
            "--proof": self.proof,
        }
        check_outputs(inputs, outputs)

    def slices(self, case: Case) -> tuple[Slice, ...]:
        """Return the slices that the files show; a page has none of a robot without slices.

        Raises:
            CaseError: a picture of slices is asked for, of a robot that has none.
        """
        from ..errors import CaseError
        from ..proof.workspace.slices.slices import slices_of

        if self.plot is None and self.page is None:
            return ()
        try:
            return slices_of(case)
        except CaseError:
            if self.plot is not None:
                raise
            return ()

    def write(
        self,
        case: Case,
        text: str,
        result: WorkspaceResult,
        slices: tuple[Slice, ...],
        command: Callable[[WorkspacePose], str],
    ) -> None:
        """Write the files.

        Args:
            case: the case.
            text: of its file.
            result: the verdicts.
            slices: of the workspace.
            command: returns the command that shows a pose.

        Raises:
            InputError: a file cannot be written, or no pose is known to be drawn.
        """
        from ..output.files import write_bytes, write_text

        if self.json is not None:
            write_json(self.json, result)
        if self.plot is not None:
            from ..output.pictures.requirements import ending_of
            from ..output.pictures.workspaceslices import slices_picture

            write_bytes(self.plot, slices_picture(case, slices, ending_of(self.plot)))
        if self.picture is not None:
            write_bytes(self.picture, _worst(case, result, self.picture))
        if self.page is not None:
            from ..output.report.workspace import WorkspaceReport, workspace_page

            write_text(self.page, workspace_page(WorkspaceReport(case, text, result, slices, command)))


def _worst(case: Case, result: WorkspaceResult, target: str) -> bytes:
    """Return a picture of the robot at its worst pose.

    Raises:
        InputError: no pose is known.
    """
    from ..errors import InputError
    from ..output.pictures.figures import picture
    from ..output.pictures.requirements import ending_of
    from ..output.pictures.workspacepose import drawing_at
    from ..results.workspaceposes import worst_claim

    worst = worst_claim(result, case.tasks[0].sense)
    if worst is None:
        raise InputError(f"--picture {target}: no pose of the workspace is known at which a number is reached")
    return picture([drawing_at(case, worst)], ending_of(target))
