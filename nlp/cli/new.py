"""Command ``new``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from . import options
from .commandline import Argument, print_line


def new(
    model: Annotated[str, Argument("MODEL", "Name of a robot, or a robot file (.toml).")],
    per: Annotated[
        str,
        options.text("--per", "CHANGE", "Robot that changes: task (a dimension per task), or path (turn of the tool)"),
    ] = "",
    out: Annotated[
        str, options.file("--out", "Case file to write instead of standard output; --per path adds its path, a .csv")
    ] = "",
    force: Annotated[bool, options.flag("--force", "Overwrite files that exist")] = False,
) -> None:
    """Print a commented starter case.

    A case for a robot file names the file without its folder: save the case in the folder of the robot file.
    """
    from ..case.robots import build_model
    from ..errors import InputError, nearest, one_line
    from ..output.files import check_outputs, write_text
    from ..starter.changing import path_starter, task_starter
    from ..starter.text import starter_case

    if per not in ("", "task", "path"):
        raise InputError(f"--per {per}: no such change; {nearest(per, ['task', 'path'])}")
    target = Path(out)
    if per == "path" and target.suffix != ".toml":
        fault = f"--out {out}: must name" if out else "--out: is missing: name"
        raise InputError(f"{fault} a .toml file; --per path writes the path beside it")
    is_file = model.endswith(".toml")
    robot, name = (options.read_robot(model), Path(model).name) if is_file else (build_model(model), None)
    texts = {out or "-": ""}
    if per == "path":
        path = target.with_suffix(".csv")
        texts[out], texts[str(path)] = path_starter(robot, path.name, name)
    else:
        texts[out or "-"] = task_starter(robot, name) if per == "task" else starter_case(robot, name)
    check_outputs({Path(model): "the robot file"} if is_file else {}, {f"--out {each}": each for each in texts})
    for each in texts:
        if each != "-" and Path(each).exists() and not force:
            raise InputError(f"{each}: exists: choose another name, or --force")
    for each, text in texts.items():
        write_text(each, text)
    if out and out != "-":
        print_line(f"{one_line(' and '.join(texts))}: written; next: screwsynth solve {one_line(out)}")
