"""Measure live pages: values against CasADi, optima against ``solve``, sizes, times, and frames in Chromium.

Run by hand: ``python bench/view.py [CASE ...] [--points N] [--frames] [--json FILE]``; without names, all shipped
cases and all robots of the gallery. Values are relative to the largest of each array. Near a singularity, one unit in
the last place of the variables changes values by more than the aim; there, a multiple of this change is the aim. A case
without C is listed with the reason that its page states.
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

from screwsynth.models import FloatArray, model_names
from screwsynth.nlp import shipped_cases, solve
from screwsynth.nlp.cli.viewed import read_viewed
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.output.live.page import live_page
from screwsynth.nlp.view.data import arrays_of
from screwsynth.nlp.view.source import ViewSource, view_source, view_without_solver
from screwsynth.nlp.view.wasm import compile_module

TESTS = Path(__file__).parent.parent / "tests" / "nlp"
PAGE = Path(__file__).parent.parent / "nlp" / "output" / "live" / "page"
#: Values of the module, and the largest relative differences aimed at.
AIM, AIM_OPTIMUM = 1e-12, 1e-6
#: Multiple of the change by one unit in the last place of the variables that a difference may have.
CHANGES = 4.0
#: Seconds after which the measurement of frames ends.
LONGEST = 300
#: Time from the navigation to the first frame with the robot, which is drawn before the module starts.
FIRST_FRAME = """
new MutationObserver(() => {
  if (globalThis.firstFrame || !document.documentElement?.dataset.drawn) return;
  globalThis.firstFrame = -1;
  requestAnimationFrame(() => setTimeout(() => (globalThis.firstFrame = performance.now())));
}).observe(document, { subtree: true, attributes: true, attributeFilter: ["data-drawn"] });"""
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
  if (turn < 120 && time < begun[0] + 6000) return requestAnimationFrame(frame);
  for (let i = 0; i < 120 && performance.now() < time + 6000; i += 1) {
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


def errors(source: ViewSource, content: bytes, count: int) -> dict[str, float]:
    """Return the largest difference of F, constraints and the robot's values from CasADi, at random points.

    ``error`` is that difference, and ``error_in_aims`` its largest multiple of the aim at the point.
    """
    nlp = source.subject.nlp
    rng = np.random.default_rng(1)
    x = nlp.lower + (nlp.upper - nlp.lower) * rng.random((count, nlp.n))
    points = [{"x": each.tolist(), "p": nlp.arguments.tolist(), "pose": 0} for each in x]
    worst, in_aims = 0.0, 0.0
    for point, found in zip(x, run_module(source, content, points, None)["points"], strict=True):
        expected = reference(source, point)
        near = [reference(source, np.nextafter(point, end)) for end in (nlp.lower, nlp.upper)]
        for k, values in enumerate(([found["F"]], found["g"], found["view"])):
            ours = np.array([np.nan if each is None else each for each in values], dtype=float)
            error = difference(ours, expected[k])
            change = max(difference(each[k], expected[k]) for each in near)
            worst = max(worst, error)
            in_aims = max(in_aims, error / max(AIM, CHANGES * change if np.isfinite(change) else 0.0))
    return {"error": worst, "error_in_aims": in_aims}


def reference(source: ViewSource, x: FloatArray) -> tuple[FloatArray, ...]:
    """Return F, constraints and the robot's values by CasADi."""
    nlp, functions = source.subject.nlp, source.functions
    derivatives = nlp.program.kernels.derivatives(x, nlp.arguments)
    inputs = functions.inputs(x, nlp.arguments).full().ravel()[: functions.view.numel_in(0)]
    values = (derivatives.F, derivatives.g, functions.view(inputs).full())
    return tuple(np.ravel(np.asarray(each, dtype=float)) for each in values)


def difference(values: FloatArray, expected: FloatArray) -> float:
    """Return the largest difference of two arrays relative to the largest value; infinity if one is not finite."""
    finite = np.isfinite(expected)
    if (np.isfinite(values) != finite).any():
        return float("inf")
    size = float(np.abs(expected[finite]).max(initial=0.0)) or 1.0
    return float(np.abs(values[finite] - expected[finite]).max(initial=0.0)) / size


def frames(text: str) -> dict[str, float]:
    """Return milliseconds until the first frame, of a frame while a slider moves, and of the page's work in it.

    The last two are medians.
    """
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
            chrome.set_script_timeout(LONGEST)
            chrome.execute_cdp_cmd("Page.enable", {})
            chrome.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": FIRST_FRAME})
            chrome.get(page.as_uri())
            time.sleep(1.0)
            first = float(chrome.execute_script("return globalThis.firstFrame"))
            if not chrome.execute_script("return Boolean(globalThis.screwsynth)"):
                return {"first_frame_ms": first}
            begun, busy = chrome.execute_async_script(FRAMES)
    finally:
        chrome.quit()
    return {
        "first_frame_ms": first,
        "frame_ms": float(np.median(np.diff(begun))),
        "work_ms": float(np.median(busy)),
    }


def measure(name: str, count: int, *, with_frames: bool) -> dict[str, Any]:
    """Return the measurements of a case or a robot."""
    (case, *_), is_solved = read_viewed(name, {})
    begin = time.perf_counter()
    try:
        source = view_source(case)
    except CaseError as error:
        source = view_without_solver(case, error)
        solution = solve(case) if is_solved and not source.subject.nlp.is_fixed else None
        text = live_page(source, solution, name).text
        found: dict[str, Any] = {"name": name, "refused": source.fault}
        return {**found, "kB": len(text.encode()) / 1000, **(frames(text) if with_frames else {})}
    content = compile_module(source.files)
    compiled = time.perf_counter() - begin
    begin = time.perf_counter()
    source = view_source(case)
    solution = solve(case) if is_solved and not source.subject.nlp.is_fixed else None
    text = live_page(source, solution, name).text
    found = {"name": name, "compiled": compiled, "seconds": time.perf_counter() - begin}
    found |= {"kB": len(text.encode()) / 1000, "module_kB": len(content) / 1000, **errors(source, content, count)}
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
        try:
            row = measure(name, options.points, with_frames=options.frames)
        except Exception as error:
            row = {"name": name, "failed": f"{type(error).__name__}: {error}"}
        rows.append(row)
        shown = {key: value for key, value in row.items() if key != "name"}
        words = "  ".join(f"{key} {value:.3g}" if isinstance(value, float) else value for key, value in shown.items())
        sys.stdout.write(f"{name:24}  {words}\n")
        sys.stdout.flush()
        if options.json:
            Path(options.json).write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")
    missed = [
        row["name"]
        for row in rows
        if "failed" in row or row.get("error_in_aims", 0.0) > 1 or row.get("optimum_error", 0.0) > AIM_OPTIMUM
    ]
    sys.stdout.write(f"aims missed: {', '.join(missed) or 'none'}\n")
    return int(bool(missed))


if __name__ == "__main__":
    raise SystemExit(main())
