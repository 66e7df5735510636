"""Draw the pictures of the documentation: run by ``make figures``.

The paper's Figs. 4, 5, 7, 8, 10 and 11 from their cases, the hexapod with limits, the worked design problems, and the
robots with their parameters.
"""

from pathlib import Path

from screwsynth.models import model_names
from screwsynth.nlp import build_model, load_case, plot, solve
from screwsynth.nlp.case.robots import model_options

FOLDER = Path(__file__).parent / "figures"
CASES = {
    "fig-4-helical": "paper-4.1-helical",
    "fig-5-rotation": "paper-4.1-rotation",
    "fig-7-peg-in-hole": "paper-4.2",
    "fig-8-joint-angle": "paper-4.3",
    "fig-10-two-free-rotations": "paper-4.4-snu",
    "fig-11-resisting": "paper-4.4-max",
    "hexapod-machining": "hexapod-machining",
    "peg-in-hole": "peg-in-hole",
    "drilling-spindle": "drilling-spindle",
    "camera-mount": "camera-mount",
    "free-wrist": "free-wrist",
    "haptic-device": "haptic-device",
    "flight-simulator": "flight-simulator",
}

FOLDER.mkdir(exist_ok=True)
for name, case in CASES.items():
    plot(solve(load_case(case)), FOLDER / f"{name}.png")
for model in model_names():
    choices = next(((option.name, option.choices) for option in model_options(model) if option.choices), None)
    variants = (
        [build_model(model)] if choices is None else [build_model(model, {choices[0]: each}) for each in choices[1]]
    )
    plot(variants, FOLDER / f"model-{model}.png")
