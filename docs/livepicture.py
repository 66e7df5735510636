"""Draw docs/figures/view.png, the live page of a case in headless Chromium: run by ``make figures``.

Chromium and its driver are Debian's packages ``chromium`` and ``chromium-driver``. Where they are not installed, or no
compiler for WebAssembly is, the picture stays as it is and a line says so.
"""

import base64
import io
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image
from selenium import webdriver

CASE = "hexapod-machining"
PICTURE = Path(__file__).parent / "figures" / "view.png"
#: Size of the window, pixels, and number of colours of the picture.
WIDTH, HEIGHT, COLOURS = 1200, 714, 160
#: Seconds after which the page has no result.
_LONGEST = 120


def screenshot(page: Path) -> bytes:
    """Return the upper part of a page as PNG, after its first change.

    Raises:
        TimeoutError: the page does not solve.
    """
    options = webdriver.ChromeOptions()
    options.binary_location = str(shutil.which("chromium"))
    for switch in ("headless=new", "no-sandbox", "disable-gpu", "hide-scrollbars", "disable-dev-shm-usage"):
        options.add_argument(f"--{switch}")
    service = webdriver.chrome.service.Service(shutil.which("chromedriver"))
    chrome = webdriver.Chrome(options=options, service=service)
    try:
        size = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False}
        chrome.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        chrome.get(page.as_uri())
        end = time.monotonic() + _LONGEST
        while not chrome.execute_script("return document.querySelectorAll('input[type=range]').length"):
            if time.monotonic() > end:
                message = f"the sliders of {page.name} do not appear"
                raise TimeoutError(message)
            time.sleep(0.1)
        # A slider moves, and the page solves for all other variables.
        chrome.execute_script(
            "const slider = document.querySelectorAll('input[type=range]')[0];"
            "slider.value = Number(slider.min) + 0.35 * (slider.max - slider.min);"
            "slider.dispatchEvent(new Event('input', { bubbles: true }));"
        )
        while chrome.execute_script("return document.getElementById('word').textContent") != "local optimum":
            if time.monotonic() > end:
                message = f"{page.name} does not solve"
                raise TimeoutError(message)
            time.sleep(0.1)
        chrome.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
        return base64.b64decode(chrome.execute_cdp_cmd("Page.captureScreenshot", {"format": "png"})["data"])
    finally:
        chrome.quit()


def main() -> None:
    """Write the picture, or say why it stays as it is."""
    if shutil.which("chromium") is None or shutil.which("chromedriver") is None:
        sys.stdout.write(f"{PICTURE.name} stays as it is: chromium and chromium-driver are not installed\n")
        return
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "view.html"
        command = [sys.executable, "-P", "-m", "screwsynth.nlp", "view", CASE, "--out", str(page), "--no-open"]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout  # noqa: S603 - our own command
        if "the sliders do not work" in said:
            sys.stdout.write(f"{PICTURE.name} stays as it is: {said.strip()}\n")
            return
        with Image.open(io.BytesIO(screenshot(page))) as image:
            few = image.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        few.save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
