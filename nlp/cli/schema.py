"""The command ``schema``."""

from __future__ import annotations

import typer


def schema() -> None:
    """Print the JSON Schema of case files, with which editors complete and check."""
    import json

    from ..case.schema import Document

    typer.echo(json.dumps(Document.model_json_schema(), indent=2))
