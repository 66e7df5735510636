"""Command ``codegen``."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from . import options
from .commandline import print_line

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..case.case import Case


def codegen(
    case: options.CaseName,
    out: options.Folder,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    no_measure: Annotated[
        bool, options.flag("--no-measure", "Do not compile the code to measure its flash and stack size")
    ] = False,
    kinematics: Annotated[
        bool, options.flag("--kinematics", "Write only the kinematics: motors, rates, torques and forward kinematics")
    ] = False,
    single: Annotated[
        bool, options.flag("--single", "With --kinematics: positions, rates and torques in single precision")
    ] = False,
    coordinates: Annotated[
        str,
        options.text(
            "--coordinates", "NAME", "With --kinematics: pose, or a limb whose joint coordinates are used too"
        ),
    ] = "pose",
    target: Annotated[
        str,
        options.text(
            "--target",
            "NAME",
            "With --kinematics: form of a controller: c, linuxcnc, linuxcnc-module, klipper, klipper-patch, marlin, "
            "reprapfirmware, ros2, arduino",
        ),
    ] = "c",
    force: options.Force = False,
) -> None:
    """Write F and its derivatives, or the kinematics alone, as C code for controllers."""
    from ..errors import InputError

    if kinematics and no_measure:
        raise InputError("--no-measure: kinematics are never measured; leave it out, or leave --kinematics out")
    if kinematics:
        _write_kinematics(case, out, settings, of, target, single=single, coordinates=coordinates, force=force)
        return
    for option, given in (
        ("--single", single),
        ("--coordinates", coordinates != "pose"),
        ("--target", target != "c"),
    ):
        if given:
            raise InputError(f"{option}: is only for --kinematics; add --kinematics, or leave {option} out")
    from ..embedding.codegen import generate_c, size_words
    from ..embedding.ctext import identifier
    from ..errors import one_line
    from ..output.files import check_folder, check_outputs, write_folder

    if not force:
        check_folder(out)
    loaded, text, inputs = options.read_changed_case(case, settings, of).file
    if loaded.over_path is not None and loaded.settings:
        _write_steps(loaded, text, out, inputs, force=force)
        return
    files = generate_c(loaded, text)
    for name in files if Path(out).is_dir() else ():
        check_outputs(inputs, {"--out": str(Path(out) / name)})
    print_line(size_words(loaded, files))
    if loaded.limits_over:
        print_line(loaded.stated_pose_notice)
    if not no_measure:
        files = _measured(files, identifier(loaded.name))
    write_folder(out, files, force=force)
    command = f"make -C {shlex.quote(one_line(out))} test"
    print_line(f"{len(files)} files in {one_line(out)}; {command} compiles and tests them")


def _write_steps(case: Case, text: str, out: str, inputs: Mapping[Path, str], *, force: bool) -> None:
    """Write the C of the next step along the path of a case."""
    from ..embedding.schedulec import schedule_c
    from ..errors import one_line
    from ..output.files import check_outputs, write_folder

    files = schedule_c(case, text)
    for name in files if Path(out).is_dir() else ():
        check_outputs(inputs, {"--out": str(Path(out) / name)})
    size = sum(len(each.encode()) for name, each in files.items() if name.endswith((".c", ".h")))
    print_line(f"{size / 1000:.0f} kB of C")
    write_folder(out, files, force=force)
    command = f"make -C {shlex.quote(one_line(out))} test"
    print_line(f"{len(files)} files in {one_line(out)}; {command} compiles and tests them")


def _write_kinematics(
    name: str,
    out: str,
    settings: list[str] | None,
    of: str | None,
    target: str,
    *,
    single: bool,
    coordinates: str,
    force: bool,
) -> None:
    """Write the kinematics of a robot in the form of a controller."""
    from ..case.robotcase import read_robot_case
    from ..embedding.targets import Request, export_kinematics
    from ..errors import one_line
    from ..output.files import check_folder, check_outputs, write_folder

    if not force:
        check_folder(out)
    if of is None:
        loaded, text, inputs = read_robot_case(name, options.read_settings(settings))
    else:
        loaded, text, inputs = options.read_changed_case(name, settings, of).file
    files = export_kinematics(loaded, text, target, Request(single, coordinates))
    for each in (path for path in (Path(out) / name for name in files) if path.exists()):
        check_outputs(inputs, {"--out": str(each)})
    size = sum(len(text.encode()) for each, text in files.items() if each.endswith((".c", ".h")))
    if size:
        print_line(f"{size / 1000:.0f} kB of C")
    write_folder(out, files, force=force)
    command = f"make -C {shlex.quote(one_line(out))} test"
    advice = f"{command} compiles and tests them" if target == "c" else "README.md describes them"
    print_line(f"{len(files)} files in {one_line(out)}; {advice}")


def _measured(files: dict[str, str], prefix: str) -> dict[str, str]:
    """Return the files with the measured sizes of flash and stack, which are printed; a terminal shows the progress."""
    from ..embedding.measure import figure_words, measure, with_figures

    if sys.stderr.isatty():
        from rich.console import Console

        with Console(stderr=True).status("compiling to measure flash and stack; --no-measure skips this"):
            figures = measure(files, prefix)
    else:
        figures = measure(files, prefix)
    for each in figures:
        print_line(figure_words(each))
    return with_figures(files, prefix, figures)
