"""Pages on a narrow screen: all panels below each other, and nothing beyond the edge."""

from pathlib import Path
from typing import Any

import pytest
from builders import Run, saved

CASE = """
[units]
length = "cm"
force = "N"
[robot]
model = "stewart-gough"
layout = "aligned"
parameters = { x1 = { min = 10, max = 13 }, x2 = { min = 3, max = 5 }, x3 = 30, x4 = 20 }
[pose]
position = [0, 0, 20]
[[task]]
name = "up"
sense = "max"
axis = [0, 0, 1]
pitch = inf
[limits]
leg_length = { min = 2, max = 60 }
[solve]
starts = 2
"""
WORKSPACE = """
[workspace]
position = [{ min = -1, max = 1 }, { min = -1, max = 1 }, { min = 19, max = 21 }]
"""
FIXED = ("--set", "x1=12", "--set", "x2=4")
PATH = "x,y,z\n0,0,20\n1,0,20\n1,1,21\n"
#: Number of a page's pictures, those of them that stand side by side, the window's width, and the page's.
LAYOUT = """
const isPart = (each) => each.closest(".main-svg") || each.parentElement.closest(".view, .map");
const shown = [...document.querySelectorAll("figure, img, svg, .view, .map")].filter(
  (each) => !isPart(each) && each.checkVisibility() && each.getBoundingClientRect().width > 0);
const beside = [];
shown.forEach((one, k) => shown.slice(k + 1).forEach((other) => {
  const a = one.getBoundingClientRect(), b = other.getBoundingClientRect();
  const isInside = one.contains(other) || other.contains(one);
  if (!isInside && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 2) beside.push(one.outerHTML.slice(0, 60));
}));
return [shown.length, beside, innerWidth, document.documentElement.scrollWidth];"""
NARROW = {"width": 420, "height": 900, "deviceScaleFactor": 1, "mobile": False}


@pytest.mark.browser
@pytest.mark.slow  # seven commands, and a browser
def test_panels_stand_below_each_other_on_a_narrow_screen(browser: Any, cli: Run, tmp_path: Path) -> None:
    case = str(saved(tmp_path / "case.toml", CASE))
    judged = str(saved(tmp_path / "judged.toml", CASE + WORKSPACE))
    along = str(saved(tmp_path / "path.csv", PATH))
    # Without a C compiler, a sweep whose engine is not stated says that it takes this one.
    points = ("--over", "x3=20:30:3", "--engine", "ipopt")
    commands = {
        "report": ("report", case, "--out"),
        "workspace": ("workspace", judged, *FIXED, "--html"),
        "path": ("path", judged, *FIXED, "--along", along, "--html"),
        "sweep": ("sweep", case, *points, "--out", str(tmp_path / "sweep.csv"), "--html"),
        "tradeoff": ("tradeoff", case, "--over", "limits.leg_length.max=30:34:3", "--html"),
        "pareto": ("pareto", case, "--goal", "max F", "--goal", "min limits.leg_length.max", "--points", "3", "--html"),
        "compare": ("compare", case, "case", "6-ups", "--html"),
    }
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", NARROW)
    try:
        for name, command in commands.items():
            page = tmp_path / f"{name}.html"
            # A robot of a comparison without an answer gives another status.
            assert cli(*command, str(page))[2] == ""
            browser.get(page.as_uri())
            shown, beside, window, width = browser.execute_script(LAYOUT)
            assert window == 420, name
            assert width <= 420, name
            assert shown, name
            assert beside == [], name
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
