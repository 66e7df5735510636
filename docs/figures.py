"""Draw the pictures of the documentation: run by ``make figures``.

The paper's Figs. 4, 5, 7, 8, 10 and 11 from their cases, the hexapod with limits, the worked design problems, and the
robots with their parameters; slices of workspaces, a path, and a schedule along a path; the gallery of robots given
joint by joint on one sheet, the Delta of robots.md, the optimum of README.md, and the leg, wrench and task of the
method in formulation.md.
"""

import re
import tomllib
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from screwsynth.models import model_names
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import Status, build_model, case_from_tables, certify, evaluate, load_case, plot, solve, tradeoff
from screwsynth.nlp.case.robots import model_options
from screwsynth.nlp.output.pictures.drawing import drawing_of_model
from screwsynth.nlp.output.pictures.figures import picture_of
from screwsynth.nlp.output.pictures.painting import Panel
from screwsynth.nlp.output.pictures.pathpanels import path_picture
from screwsynth.nlp.output.pictures.paths import path_figure
from screwsynth.nlp.output.pictures.schedules import schedule_figure
from screwsynth.nlp.output.pictures.solutions import drawings_of
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
    "fixture-pins",
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


def draw_optimum() -> None:
    """Draw the robot of a case at its start and at its optimum, and beside it F over one dimension with both marked."""
    name, radii = "drilling-spindle", [*range(300, 320, 4), *range(320, 451, 5)]
    best = solve(load_case(name))
    (drawing,) = drawings_of(best, 1)
    certificate = certify(best).certificate
    assert certificate is not None  # noqa: S101 - a script of the documentation
    start = evaluate(best.nlp, best.nlp.start)
    top, radius = certificate.bound, float(np.ravel(evaluate(best.nlp, best.x).parameters["x1"])[0])
    curve = tradeoff(load_case(name), {"x1": [*radii, radius + 1e-3]}).points
    kept = sorted((point.value, point.solution.F) for point in curve if point.solution.status is Status.OPTIMAL)
    figure = Figure(figsize=(11.0, 5.2), facecolor="white")
    FigureCanvasAgg(figure)
    robot, chart = figure.add_axes((0.0, 0.02, 0.5, 0.86)), figure.add_axes((0.57, 0.13, 0.41, 0.72))
    Panel(robot, clearest_view(drawing), drawing).paint()
    figure.text(0.02, 0.88, "black arrow: the drill; purple: velocities of the joints", fontsize=10, color="#5a6670")
    figure.text(0.02, 0.93, "Start (grey) and best design (orange)", fontsize=13, fontweight="bold")
    figure.text(0.57, 0.93, "Stiffness along the drill", fontsize=13, fontweight="bold")
    figure.text(0.57, 0.88, "best F for each base radius; legs of stiffness k give k F", fontsize=10, color="#5a6670")
    chart.axvspan(300, radius, color="#e6eaee")
    chart.text(310.5, 4.8, "no design keeps\nall limits", ha="center", va="center", rotation=90, color="#5a6670")
    chart.axhline(top, color="#6d2a8c", linestyle="--", linewidth=1.4)
    chart.text(449, top + 0.03, f"proved: no design has F above {top:.4f}", ha="right", color="#6d2a8c")
    chart.plot(*zip(*kept, strict=True), color="#0b4f9c", linewidth=2.4)
    chart.plot([radius], [best.F], "o", color="#b34700", markersize=10)
    chart.annotate(f"optimum: F = {best.F:.3f}\nat {radius:.1f} mm", (radius, best.F), (327, 4.99), color="#b34700")
    first = float(np.ravel(start.parameters["x1"])[0])
    chart.plot([first], [start.F], "o", color="#8a949d", markersize=10)
    chart.text(first, start.F + 0.07, f"start: F = {start.F:.3f}\n(joints too close)", ha="center", color="#5a6670")
    chart.set(xlim=(300, 450), ylim=(4.0, 5.7), xlabel="radius of the base joints, mm", ylabel="F, (mm/mm)²")
    chart.spines[["top", "right"]].set_visible(False)
    figure.savefig(FOLDER / "optimum.png", dpi=110, metadata={"Software": None})


def draw_method() -> None:
    """Draw a platform on three legs, the unit wrench of one leg, the task, and the projection that is the work rate."""
    # Leg 1 and the task are those of the example in formulation.md: x to the right, y into the page, z up.
    base, top = np.array([[5, 0, 0], [-4, 3.5, 0], [-4, -3.5, 0]]), np.array([[2, 0, 4], [-1, 1.8, 4], [-1, -1.8, 4]])
    turn, tilt = np.radians(-24), np.radians(16)
    right = np.array([np.cos(turn), -np.sin(turn), 0])
    up = np.array([np.sin(turn) * np.sin(tilt), np.cos(turn) * np.sin(tilt), np.cos(tilt)])
    figure = Figure(figsize=(9, 5.1), facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set_aspect("equal")

    def seen(points: object) -> tuple[np.ndarray, np.ndarray]:
        return np.asarray(points, dtype=float) @ right, np.asarray(points, dtype=float) @ up

    def arrow(tail: np.ndarray, tip: np.ndarray, colour: str) -> None:
        ends = [tuple(float(each) for each in seen(point)) for point in (tail, tip)]
        axes.annotate("", ends[1], ends[0], arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2.6}, zorder=6)

    def label(point: object, text: str, shift: tuple[float, float], colour: str = "black") -> None:
        x, y = seen(point)
        axes.text(x + shift[0], y + shift[1], text, fontsize=13, color=colour, ha="left", va="center", zorder=7)

    grey, wrench, task, rate = "0.55", "#0b6e6e", "#b5361c", "#5b3fa0"
    for corners, face in ((base, "0.93"), (top, "0.85")):
        axes.fill(*seen(corners), facecolor=face, edgecolor=grey, lw=1.5, alpha=0.9)
    for foot, head in zip(base[1:], top[1:], strict=True):
        axes.plot(*seen([foot, head]), color=grey, lw=3)
    axes.plot(*seen([base[0], top[0]]), color="0.25", lw=4, zorder=4)
    axes.plot(*seen([base[0], top[0]]), "o", color="0.25", ms=8, zorder=5)
    origin, middle, unit = np.zeros(3), np.array([0, 0, 4.0]), np.array([-0.6, 0, 0.8])
    along_y, below = np.array([0, 1.0, 0]), top[0] - np.array([0, 0, 2.0])
    for along, name in ((np.array([1.2, 0, 0]), "x"), (np.array([0, 1.2, 0]), "y"), (np.array([0, 0, 1.2]), "z")):
        axes.plot(*seen([origin, along]), color="black", lw=1.2)
        label(1.18 * along, name, (-0.05, 0.0))
    # The task: a rotation about an axis along y through the middle of the platform, and the velocity of the joint.
    axes.plot(*seen([middle - 3.6 * along_y, middle + 3.6 * along_y]), color=task, lw=1.6, ls=(0, (6, 3)), zorder=3)
    angles = np.linspace(-0.6, np.pi * 0.95, 60)
    circle = middle - 2.9 * along_y + 0.55 * np.array([np.cos(angles), 0 * angles, -np.sin(angles)]).T
    axes.plot(*seen(circle), color=task, lw=2.2)
    arrow(circle[-4], circle[-1], task)
    arrow(top[0], top[0] + 2.1 * unit, wrench)
    arrow(top[0], below, rate)
    foot = top[0] - 1.6 * unit
    axes.plot(*seen([below, foot]), color=rate, lw=1.2, ls=":")
    axes.plot(*seen([top[0], foot]), color=rate, lw=6, alpha=0.5, zorder=5, solid_capstyle="butt")
    label(base[0], "base joint $B_1$", (0.2, -0.05))
    label(top[0], "platform joint $P_1$", (0.25, 0.12))
    label(top[0] + 2.1 * unit, "unit wrench $L_1 = (f_1, m_1)$\nof leg 1: force along the leg", (0.25, 0.2), wrench)
    label(
        middle - 3.6 * along_y,
        "task twist $\\chi = (\\omega, v)$,\nhere a rotation\nabout the axis $s$",
        (-3.5, 1.2),
        task,
    )
    label(below, "velocity of $P_1$", (-2.3, 0.25), rate)
    label(foot, "its component along the leg:\nwork rate $L_1 \\wedge \\chi$", (0.3, 0.1), rate)
    axes.set_xlim(-6.4, 8.6)
    axes.set_ylim(-1.6, 6.9)
    figure.savefig(FOLDER / "method.png", dpi=100, metadata={"Software": None})


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
draw_optimum()
draw_method()
plot(solve(case_from_tables(case_of_page("robots.md", 0), name="delta", source="robots.md")), FOLDER / "delta.png")
for name in SLICED:
    machine = load_case(name)
    (FOLDER / f"{name}.png").write_bytes(picture_of(".png", slices_figure, machine, slices_of(machine)))
for name in SOLVED:
    plot(solve(load_case(name)), FOLDER / f"{name}.png")
machine = load_case("hexapod-base-slides")
policy = solve(machine)
machine = machine.replace({"x1": policy["x1"], "x1_slope": [policy[f"x1_slope_{axis}"] for axis in "xyz"]})
(FOLDER / "hexapod-base-slides.png").write_bytes(picture_of(".png", slices_figure, machine, slices_of(machine)))
machine = load_case("hexapod-yaw")
(FOLDER / "hexapod-yaw.png").write_bytes(picture_of(".png", schedule_figure, machine, solve(machine)))
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
