"""Choice of the pose that the page shows, and drawings for browsers without three dimensions."""

from __future__ import annotations

import re

from ..pictures.figures import picture
from .frames import ViewData
from .markup import Markup, join_markup, tag
from .pages import image_source
from .report import Report

#: So many drawings stand in a page at most; the other views have their tables only.
_DRAWINGS = 12
#: Outlines of an SVG picture, and numbers in them with digits that nobody sees.
_OUTLINE, _DIGITS = re.compile(rb' d="[^"]*"'), re.compile(rb"(\.\d\d)\d+")


def _with_fewer_digits(content: bytes) -> bytes:
    """Return an SVG picture with two digits behind the points of its outlines, in units of 1/72 in."""
    return _OUTLINE.sub(lambda found: _DIGITS.sub(rb"\1", found[0].replace(b"\n", b" ")), content)


def pose_controls(views: list[ViewData], poses: int) -> Markup | None:
    """Return a slider over the poses with the worst of them named, or None for a single pose."""
    if poses == 1:
        return None
    first = views[0]
    worst = next((view for view in views if view["task"] == first["task"] and view["is_worst"]), None)
    words = f"{first['pose_words']}, the worst" if first["is_worst"] else first["pose_words"]
    slider = tag("input", type="range", id="pose", min=1, max=poses, step=1, value=first["pose"] + 1)
    shown = tag("output", words, id="posed", for_="pose")
    button = tag("button", "Show the worst", type="button", id="worst", disabled=first["is_worst"])
    controls = tag("p", tag("label", "Pose", for_="pose"), slider, shown, button, class_="controls travel script")
    if worst is None:
        return controls
    task = f" for “{first['name']}”" if any(view["task"] != first["task"] for view in views) else ""
    return join_markup([controls, tag("p", f"The worst{task}: {worst['pose_words']}.", id="worst-words")])


def drawings(report: Report) -> Markup:
    """Return drawings of the views as pictures, of which one is shown where the browser has no 3-D, or no script."""
    found = [
        (index, view, drawing)
        for index, (view, drawing) in enumerate(
            pair for part in report.parts for pair in zip(part.views, part.drawings, strict=True)
        )
    ]
    stills = []
    for index, view, drawing in found[:_DRAWINGS]:
        source = image_source(_with_fewer_digits(picture([drawing], ".svg")))
        words = f"The robot, {view['pose_words']}; the table below has its numbers."
        kind = "still" if index else "still chosen"
        stills.append(tag("img", src=source, alt=words, class_=kind, data_view=index))
    words = "This browser has no WebGL: the robot is drawn flat and does not move, but the numbers follow the sliders."
    return join_markup([tag("p", words, class_="flat-words", role="status"), *stills])
