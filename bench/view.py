"""Measure live pages: values against CasADi, optima against ``solve``, sizes, times, and frames in Chromium.

Run by hand: ``python bench/view.py [CASE ...] [--points N] [--frames] [--json FILE]``; without names, all shipped cases
and all robots of the gallery. Values are relative to the largest of each array. A case without C is listed with its
reason.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from screwsynth.models import model_names
from screwsynth.nlp import shipped_cases, solve
from screwsynth.nlp.cli.viewed import read_viewed
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.output.live.page import live_page
from screwsynth.nlp.view.data import arrays_of
from screwsynth.nlp.view.source import ViewSource, view_source
from screwsynth.nlp.view.wasm import compile_module

TESTS = Path(__file__).parent.parent / "tests" / "nlp"
PAGE = Path(__file__).parent.parent / "nlp" / "output" / "live" / "page"
#: Values of the module, and the largest relative differences aimed at.
AIM, AIM_OPTIMUM = 1e-12, 1e-6
#: Moves a slider to and fro; the times of frames, and the time of each change with its solve and its drawing.
FRAMES = """
const done = arguments[0], { state, show } = screwsynth;
const k = Math.max(0, state.sliders.findIndex((each) => each.group === "pose" && each.vector === "x"));
const slider = state.sliders[k], range = document.getElementById(`slider-${k}`), [low, high] = state.ends(slider);
const begun = [], busy = [], now = state.read(slider), at = (turn) => now + 0.05 * (high - low) * Math.sin(turn / 10);
let turn = 0;
const frame = (time) => {
  begun.push(time);
  range.value = String(at(turn));
  range.dispatchEvent(new Event("input"));
  turn += 1;
  if (turn < 120) return requestAnimationFrame(frame);
  for (let i = 0; i < 120; i += 1) {
    const begin = performance.now();
    state.move(slider, at(i));
    show();
    busy.push(performance.now() - begin);
  }
  done([begun, busy]);
};
requestAnimationFrame(frame);"""


def run_module(source: ViewSource, content: bytes, points: list[dict[str, Any]], seeds: int | None) -> dict[str, Any]:
    """Return what Node computes with a module."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        shutil.copy(PAGE / "module.js", folder / "module.mjs")
        (folder / "view.wasm").write_bytes(content)
        arrays = arrays_of(source.subject.nlp, source.functions)
        given = {"arrays": arrays, "points": points, "from_x": False, "seeds": seeds}
        (folder / "given.json").write_text(json.dumps(given))
        command = ["node", str(TESTS / "view_values.mjs"), str(folder)]
        return dict(json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout))


def largest_error(source: ViewSource, content: bytes, count: int) -> float:
    """Return the largest difference of F, constraints and the robot's values from CasADi, at random points."""
    nlp = source.subject.nlp
    rng = np.random.default_rng(1)
    x = nlp.lower + (nlp.upper - nlp.lower) * rng.random((count, nlp.n))
    points = [{"x": each.tolist(), "p": nlp.arguments.tolist(), "pose": 0} for each in x]
    worst = 0.0
    for point, found in zip(x, run_module(source, content, points, None)["points"], strict=True):
        derivatives = nlp.program.kernels.derivatives(point, nlp.arguments)
        inputs = source.functions.inputs(point, nlp.arguments).full().ravel()[: source.functions.view.numel_in(0)]
        pairs = [
            ([found["F"]], derivatives.F),
            (found["g"], derivatives.g),
            (found["view"], source.functions.view(inputs).full()),
        ]
        for values, expected in pairs:
            ours = np.array([np.nan if each is None else each for each in values], dtype=float)
            theirs = np.ravel(np.asarray(expected, dtype=float))
            finite = np.isfinite(theirs)
            if (np.isfinite(ours) != finite).any():
                return float("inf")
            size = float(np.abs(theirs[finite]).max(initial=0.0)) or 1.0
            worst = max(worst, float(np.abs(ours[finite] - theirs[finite]).max(initial=0.0)) / size)
    return worst


def frames(text: str) -> dict[str, float]:
    """Return the median time of a frame while a slider moves, and of the page's work in it, in milliseconds."""
    from selenium import webdriver  # noqa: PLC0415 - only for --frames
    from selenium.webdriver.chrome.options import Options  # noqa: PLC0415
    from selenium.webdriver.chrome.service import Service  # noqa: PLC0415

    options = Options()
    options.binary_location = str(shutil.which("chromium"))
    for each in ("--headless=new", "--no-sandbox", "--disable-gpu"):
        options.add_argument(each)
    chrome = webdriver.Chrome(options=options, service=Service(str(shutil.which("chromedriver"))))
    try:
        with tempfile.TemporaryDirectory() as temporary:
            page = Path(temporary) / "page.html"
            page.write_text(text, encoding="utf-8")
            size = {"width": 1000, "height": 900, "deviceScaleFactor": 1, "mobile": False}
            chrome.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            chrome.get(page.as_uri())
            time.sleep(1.0)
            begun, busy = chrome.execute_async_script(FRAMES)
    finally:
        chrome.quit()
    return {"frame_ms": float(np.median(np.diff(begun))), "work_ms": float(np.median(busy))}


def measure(name: str, count: int, *, with_frames: bool) -> dict[str, Any]:
    """Return the measurements of a case or a robot."""
    (case, *_), is_solved = read_viewed(name, {})
    try:
        source = view_source(case)
    except CaseError as error:
        return {"name": name, "refused": str(error)}
    content = compile_module(source.files)
    begin = time.perf_counter()
    source = view_source(case)
    solution = solve(case) if is_solved and not source.subject.nlp.is_fixed else None
    text = live_page(source, solution, name).text
    found = {"name": name, "seconds": time.perf_counter() - begin, "kB": len(text.encode()) / 1000}
    found["module_kB"] = len(content) / 1000
    found["error"] = largest_error(source, content, count)
    own = solve(replace(case.at_stated_poses(), search=case.search))
    combination = own.combination
    outcome = own.outcomes[0].own if combination is None else combination.combined
    if own.status.is_answer and outcome is not None:
        answer = run_module(source, content, [], 16)["solved"]
        size = max(abs(outcome.F), 1e-6 * source.subject.nlp.objective_size)
        found["optimum_error"] = abs(answer["F"] - outcome.F) / size
    if with_frames:
        found |= frames(text)
    return found


def main() -> int:
    """Measure, print a table, and return 1 if an aim is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="cases or robots; all without any")
    parser.add_argument("--points", type=int, default=100, help="random points of each case")
    parser.add_argument("--frames", action="store_true", help="also measure frames in Chromium")
    parser.add_argument("--json", help="file for the measurements")
    options = parser.parse_args()
    rows = []
    for name in options.names or [*shipped_cases(), *model_names()]:
        row = measure(name, options.points, with_frames=options.frames)
        rows.append(row)
        shown = {key: value for key, value in row.items() if key != "name"}
        words = "  ".join(f"{key} {value:.3g}" if isinstance(value, float) else value for key, value in shown.items())
        sys.stdout.write(f"{name:24}  {words}\n")
        sys.stdout.flush()
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")
    missed = [row["name"] for row in rows if row.get("error", 0.0) > AIM or row.get("optimum_error", 0.0) > AIM_OPTIMUM]
    sys.stdout.write(f"aims missed: {', '.join(missed) or 'none'}\n")
    return int(bool(missed))


if __name__ == "__main__":
    raise SystemExit(main())
