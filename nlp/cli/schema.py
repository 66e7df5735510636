"""Command ``schema``."""

from __future__ import annotations

from typing import Annotated

from . import options
from .commandline import print_line


def schema(
    result: Annotated[
        bool, options.flag("--result", "Print the schema of results instead, which --json writes")
    ] = False,
) -> None:
    """Print the JSON Schema of case files or results.

    Editors complete and check case files with this schema.
    """
    import json

    if result:
        from ..results.schema import result_schema

        found: object = result_schema()
    else:
        from ..case.schema import Document

        found = Document.file_schema()
    print_line(json.dumps(found, indent=2))
