"""Schema of case files with all their tables: those of limits and of the workspace too."""

from __future__ import annotations

from pydantic import Field

from .limits.registry import LimitsTable
from .schema import Document
from .workspacetable import WorkspaceTable


class WholeDocument(Document):
    """A whole case file."""

    limits: LimitsTable | None = Field(default=None, description="limits that a design must keep to be built")
    workspace: WorkspaceTable | None = Field(default=None, description="poses for which a machine is judged")
