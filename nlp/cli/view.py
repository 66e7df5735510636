"""Command ``view``."""

from __future__ import annotations

from typing import Annotated

from . import options
from .commandline import Argument, print_line


def view(
    case: Annotated[str, Argument("CASE", "Case file, name of a shipped case or of a robot, or a robot file (.toml).")],
    settings: options.SettingTexts = None,
    out: Annotated[str | None, options.file("--out", "HTML file to write; - is stdout")] = None,
    no_open: Annotated[bool, options.flag("--no-open", "Do not open the page in a browser")] = False,
    starts: options.Starts = None,
    seed: options.Seed = None,
    jobs: options.Jobs = None,
    _time: options.Time = None,
) -> None:
    """Open a page with the robot, its sliders, and the solver.

    The page is one file. It solves again while a slider moves, and needs no network.
    """
    import tempfile
    from dataclasses import replace
    from pathlib import Path

    from ..errors import InputError, one_line
    from ..output.files import check_outputs, write_text
    from ..output.live.page import live_page
    from ..view.source import view_or_drawing
    from .progress import solve_with_progress
    from .viewed import read_viewed

    if out is None and no_open:
        raise InputError("--no-open: the page would be nowhere; give --out FILE, or leave --no-open out")
    (loaded, _, inputs), is_solved = read_viewed(case, options.read_settings(settings))
    loaded = replace(loaded, search=loaded.search.but(starts, seed))
    target = str(Path(tempfile.mkdtemp(prefix="screwsynth.")) / "view.html") if out is None else out
    check_outputs(inputs, {"--out": target})
    remark = ""
    if loaded.over_path is not None:
        from ..output.live.schedule import schedule_page
        from ..words.schedule import no_schedule_line

        solved = solve_with_progress(loaded, jobs).solution
        page = schedule_page(solved, case)
        remark = "" if solved.schedule is not None else no_schedule_line(loaded).words
    else:
        source = view_or_drawing(loaded)
        solution = solve_with_progress(loaded, jobs)[0] if is_solved and not source.subject.nlp.is_fixed else None
        page = live_page(source, solution, case)
    write_text(target, page.text)
    if target != "-":
        words = f"{one_line(target)}: {len(page.text.encode()) / 1000:.0f} kB"
        print_line(f"{words}; the sliders do not work: {page.fault}" if page.fault else words)
        if remark:
            print_line(remark)
    if not no_open and target != "-":
        import webbrowser

        webbrowser.open(Path(target).absolute().as_uri())
