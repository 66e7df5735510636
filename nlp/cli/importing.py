"""Command ``import``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from . import options
from .commandline import Argument, print_line


def with_repeated_options(words: list[str]) -> list[str]:
    """Return the words of a command line with ``--actuated`` or ``--free`` before each of their values.

    These options also take all values up to the next option.
    """
    written: list[str] = []
    option, is_first = "", False
    for word in words:
        if word.startswith("-") and word != "-":
            option, is_first = (word, True) if word in ("--actuated", "--free") else ("", False)
            written.append(word)
        elif option and not is_first:
            written += [option, word]
        else:
            written.append(word)
            is_first = False
    return written


def import_(
    file: Annotated[str, Argument("FILE", "Model in MJCF (.xml) or URDF.")],
    platform: Annotated[str, options.text("--platform", "BODY", "Platform: a body, link or site of the model")],
    base: Annotated[str, options.text("--base", "BODY", "Base: a body of the model; the fixed root if left out")] = "",
    actuated: Annotated[
        list[str] | None,
        options.several("--actuated", "JOINT", "Actuated joint, instead of the actuators of the model"),
    ] = None,
    out: Annotated[str | None, options.file("--out", "Robot file to write; - is stdout")] = None,
    close: Annotated[
        bool, options.flag("--close", "Close open loops of the model, by Newton's method from several starts")
    ] = False,
    keyframe: Annotated[
        str, options.text("--keyframe", "NAME", "Home configuration: a keyframe of the MJCF file")
    ] = "",
    snap: Annotated[
        float,
        options.number("--snap", "LENGTH", "Move axes by up to this length, so that axes meet or become parallel"),
    ] = 0.0,
    loops: Annotated[
        str | None, options.file("--loops", "File of the loops of a URDF model, instead of the .yaml file next to it")
    ] = None,
    free: Annotated[
        list[str] | None,
        options.several("--free", "NAME", "Make a dimension of a joint's position, of JOINT.axis, or of a suggestion"),
    ] = None,
    suggest: Annotated[
        bool, options.flag("--suggest", "List circles and symmetries of the joints as suggestions for --free")
    ] = False,
    force: options.Force = False,
) -> None:
    """Convert a closed-loop MJCF or URDF model to a robot file.

    The joints keep the names of the model. FILE must come before --actuated and --free.
    """
    from ..errors import InputError, one_line
    from ..formats.reading.importing import Request, import_robot
    from ..formats.reading.reduction import Ends
    from ..formats.reading.robotfile import BEGINNING, robot_file
    from ..formats.reading.symmetry import offers_of
    from ..formats.reading.words import offer_lines, summary_lines
    from ..output.files import check_origin, check_outputs, write_text
    from ..output.terminal import show
    from ..words.text import Line, Tone

    if not platform:
        raise InputError("--platform: needs a value, BODY")
    if out is None and not suggest:
        raise InputError("--out: is missing: name the robot file to write, or give --suggest")
    inputs = {Path(file): "the model that is read", **({} if loops is None else {Path(loops): "the file of its loops"})}
    check_outputs(inputs, {"--out": out})
    if out is not None:
        check_origin(out, BEGINNING, force=force)
    ends = Ends(platform, base, tuple(actuated or ()))
    if not 0 <= snap < float("inf"):
        raise InputError(f"--snap {snap:g}: must be finite and not negative")
    found = import_robot(Request(Path(file), ends, close, None if loops is None else Path(loops), keyframe, snap))
    lines = list(summary_lines(found))
    offers = offers_of(found.tables, found.size) if suggest or free else None
    if suggest and offers is not None:
        lines += offer_lines(offers, found.size)
    if out is not None:
        text, more = robot_file(found, Path(file).name, free or [], offers)
        lines += more
        write_text(out, text)
    if out != "-":
        title = Line(found.mechanism.name, tone=Tone.TITLE)
        show(options.console(), [title, *(Line(text, label=label) for label, text in lines)])
        if out is not None:
            print_line(f'{one_line(out)} is written; use it in a case with [robot] file = "{one_line(Path(out).name)}"')
