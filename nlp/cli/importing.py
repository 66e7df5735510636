"""The command ``import``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from . import options
from .commandline import Argument, print_line


def with_repeated_options(words: list[str]) -> list[str]:
    """Return the words of a command line with ``--actuated`` or ``--free`` before each of its values.

    These options also take every value up to the next option.
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
    file: Annotated[str, Argument("FILE", "A model in MJCF (.xml) or URDF.")],
    platform: Annotated[str, options.text("--platform", "BODY", "Body, link or site that is the platform")],
    base: Annotated[str, options.text("--base", "BODY", "Body that is the base; the fixed root if left out")] = "",
    actuated: Annotated[
        list[str] | None, options.several("--actuated", "JOINT", "Driven joint, instead of those of the model")
    ] = None,
    out: Annotated[str | None, options.file("--out", "Robot file to write; - is stdout")] = None,
    close: Annotated[
        bool, options.flag("--close", "Close open loops by Newton's method, if need be from other starts")
    ] = False,
    keyframe: Annotated[
        str, options.text("--keyframe", "NAME", "Configuration of an MJCF file: one of its keyframes")
    ] = "",
    snap: Annotated[
        float, options.number("--snap", "LENGTH", "Move axes by up to this, so that they meet or are parallel")
    ] = 0.0,
    loops: Annotated[
        str | None, options.file("--loops", "Loops of a URDF, instead of the .yaml file beside it")
    ] = None,
    free: Annotated[
        list[str] | None,
        options.several("--free", "NAME", "Make a joint's place, JOINT.axis, or a suggestion a dimension"),
    ] = None,
    suggest: Annotated[bool, options.flag("--suggest", "List circles and symmetries, for --free")] = False,
    force: options.Force = False,
) -> None:
    """Read a robot with closed loops from MJCF or URDF.

    The robot file has the model's numbers; its joints have the model's names. FILE stands before --actuated and --free.
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
        raise InputError("--out: is missing: name the robot file to write, or ask for --suggest")
    inputs = {Path(file): "the model that is read", **({} if loops is None else {Path(loops): "its file of loops"})}
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
            print_line(f'{one_line(out)} has the robot: [robot] file = "{one_line(Path(out).name)}" in a case reads it')
