"""Draw the pictures of the documentation: run by ``make figures``.

The paper's Figs. 4, 5, 7, 8, 10 and 11 from their cases, the hexapod with limits, the worked design problems, and the
robots with their parameters; slices of a workspace and a path; the gallery of robots given joint by joint on one sheet,
and the Delta of robots.md.
"""

import re
import tomllib
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from screwsynth.models import model_names
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import build_model, case_from_tables, load_case, plot, solve
from screwsynth.nlp.case.robots import model_options
from screwsynth.nlp.output.pictures.drawing import drawing_of_model
from screwsynth.nlp.output.pictures.figures import picture_of
from screwsynth.nlp.output.pictures.painting import Panel
from screwsynth.nlp.output.pictures.pathpanels import path_picture
from screwsynth.nlp.output.pictures.paths import path_figure
from screwsynth.nlp.output.pictures.view import clearest_view
from screwsynth.nlp.output.pictures.workspaces import slices_figure
from screwsynth.nlp.path.gcode import read_program
from screwsynth.nlp.path.options import PathOptions
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.proof.workspace.path_samples import samples_of
from screwsynth.nlp.proof.workspace.slices.slices import slices_of
from screwsynth.nlp.results.path import path_result

FOLDER = Path(__file__).parent / "figures"
#: Columns of the gallery's sheet, and width and height of a robot on it, inches.
COLUMNS, WIDTH, HEIGHT = 4, 5.2, 4.8
#: Cases whose solution is drawn, and those with slices of their workspace; each picture has its case's name.
SOLVED = (
    "paper-4.1-helical",
    "paper-4.1-rotation",
    "paper-4.2",
    "paper-4.3",
    "paper-4.4-snu",
    "paper-4.4-max",
    "hexapod-machining",
    "peg-in-hole",
    "drilling-spindle",
    "camera-mount",
    "free-wrist",
    "haptic-device",
    "flight-simulator",
    "handling-3-upu",
    "reachy-mini",
    "machine-tool",
    "pick-and-place",
    "motion-base",
    "agile-eye",
)
SLICED = ("hexapod-linuxcnc", "reachy-mini-envelope")


def draw_gallery() -> None:
    """Draw all robots that are given joint by joint on one sheet, with their names and without labels."""
    names = gallery_names()
    rows = -(-len(names) // COLUMNS)
    figure = Figure(figsize=(COLUMNS * WIDTH, rows * HEIGHT), facecolor="white")
    FigureCanvasAgg(figure)
    for k, name in enumerate(names):
        left, bottom = k % COLUMNS / COLUMNS, 1 - (k // COLUMNS + 1) / rows
        axes = figure.add_axes((left + 0.01, bottom + 0.005, 0.98 / COLUMNS, 0.9 / rows))
        drawing = drawing_of_model(build_model(name))
        Panel(axes, clearest_view(drawing), drawing).paint()
        figure.text(left + 0.012, bottom + 0.96 / rows, name, fontsize=24, fontweight="bold", va="top")
    figure.savefig(FOLDER / "gallery.png", dpi=60, metadata={"Software": None})


def path_of_page(page: str) -> str:
    """Return the program of G-code that a page of the documentation shows."""
    text = (FOLDER.parent / page).read_text(encoding="utf-8")
    return next(
        block for block in re.findall(r"^```text\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE) if "G94" in block
    )


def case_of_page(page: str, number: int) -> dict[str, object]:
    """Return the tables of one of the case files that a page of the documentation shows."""
    text = (FOLDER.parent / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^```toml\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    return tomllib.loads([block for block in blocks if "[[task]]" in block][number])


FOLDER.mkdir(exist_ok=True)
draw_gallery()
plot(solve(case_from_tables(case_of_page("robots.md", 0), name="delta", source="robots.md")), FOLDER / "delta.png")
for name in SLICED:
    machine = load_case(name)
    (FOLDER / f"{name}.png").write_bytes(picture_of(".png", slices_figure, machine, slices_of(machine)))
for name in SOLVED:
    plot(solve(load_case(name)), FOLDER / f"{name}.png")
machine = load_case("hexapod-linuxcnc")
program = read_program(path_of_page("paths.md").splitlines(), "part.ngc", machine.units, PathOptions())
judged = judge_path(machine, program)
drawn = path_picture(judged, samples_of(judged), path_result(judged))
(FOLDER / "hexapod-linuxcnc-path.png").write_bytes(picture_of(".png", path_figure, drawn))
for model in (name for name in model_names() if name not in gallery_names()):
    choices = next(((option.name, option.choices) for option in model_options(model) if option.choices), None)
    variants = (
        [build_model(model)] if choices is None else [build_model(model, {choices[0]: each}) for each in choices[1]]
    )
    plot(variants, FOLDER / f"model-{model}.png")
