"""Run docs/tour.ipynb and keep what it shows: run by ``make docs``. A test runs the notebook too."""

import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).with_name("tour.ipynb")


def run(file: Path = NOTEBOOK) -> nbformat.NotebookNode:
    """Return a notebook after a run of all its cells in a new kernel of this environment.

    Raises:
        CellExecutionError: a cell raises an error.
    """
    notebook = nbformat.read(file, as_version=4)
    NotebookClient(notebook, timeout=300, kernel_name="python3", record_timing=False, coalesce_streams=True).execute()
    # The number of a run, and which Python ran it, mean nothing to a reader.
    notebook.metadata.pop("language_info", None)
    return notebook


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else NOTEBOOK
    nbformat.write(run(), target)
