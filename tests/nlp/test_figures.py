"""Pictures: what is drawn stands where the model says, in true proportion, and files come whole or not at all."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from screwsynth.models import Body, model_names
from screwsynth.nlp import Solution, load_case, shipped_cases, solve
from screwsynth.nlp.case.robots import build_model
from screwsynth.nlp.output.pictures.drawing import Drawing, drawing_of_model
from screwsynth.nlp.output.pictures.figures import figure_of, picture
from screwsynth.nlp.output.pictures.solutions import drawings_of
from screwsynth.nlp.output.pictures.view import clearest_view

Run = Callable[..., tuple[int, str, str]]


def drawing(name: str) -> Drawing:
    case = load_case(name)
    case = replace(case, search=case.search.but(4, None))
    return drawings_of(solve(case))[0]


def exponential(twist: np.ndarray, t: float) -> np.ndarray:
    """The displacement (4, 4) of a constant twist, by the power series of its matrix."""
    omega, v = twist[:3], twist[3:]
    M = np.zeros((4, 4))
    M[:3, :3] = [[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]]
    M[:3, 3] = v
    total, term = np.eye(4), np.eye(4)
    for k in range(1, 40):
        term = term @ M * t / k
        total = total + term
    return total


@pytest.mark.parametrize("name", [name for name in shipped_cases() if name != "paper-4.2"])
def test_limbs_are_drawn_between_their_joints_in_the_view(name: str) -> None:
    robot = drawing(name)
    view = clearest_view(robot)
    figure = figure_of([robot], view=view)
    lines = {line.get_gid(): np.asarray(line.get_xydata()) for line in figure.axes[0].lines}
    for first, last, link in robot.links:
        if link.limb is None:
            continue
        ends = view.project(robot.posture.points[[first, last]])
        assert np.max(np.abs(lines[f"limb {link.limb}"][[0, -1]] - ends)) <= 1e-9 * robot.size
    assert robot.motion is not None
    if math.isfinite(robot.motion.pitch):  # a translation has an arrow instead
        assert np.max(np.abs(lines["axis"][[0, -1]] - view.project(robot.motion.line))) <= 1e-9 * robot.size


def test_a_unit_is_as_long_across_as_upwards() -> None:
    axes = figure_of([drawing("paper-4.3")]).axes[0]
    origin, right, up = axes.transData.transform([[0, 0], [1, 0], [0, 1]])
    assert math.dist(origin, right) == pytest.approx(math.dist(origin, up), rel=1e-9)


def test_the_view_is_a_parallel_projection_without_stretch() -> None:
    robot = drawing("paper-4.1-helical")
    view = clearest_view(robot)
    across = np.array([view.project(np.eye(3)[i]) - view.project(np.zeros(3)) for i in range(3)]).T
    # Its two rows are unit vectors at right angles: lengths on paper are true lengths seen from the side.
    assert np.max(np.abs(across @ across.T - np.eye(2))) <= 1e-12


@pytest.mark.parametrize("name", ["paper-4.1-helical", "paper-4.4-max", "hexapod-machining"])
def test_the_platform_moves_along_the_twist_as_the_exponential_says(name: str) -> None:
    robot = drawing(name)
    assert robot.motion is not None
    for t in (-0.2, 1e-3, 0.3):
        moved = robot.linkage.posture_after(robot.posture, robot.motion.twist, t)
        assert moved is not None
        E = exponential(robot.motion.twist, t)
        assert np.max(np.abs(moved.rotation - E[:3, :3] @ robot.posture.rotation)) <= 1e-12
        for index, point in enumerate(robot.model.scene.points):
            before = robot.posture.points[index]
            wanted = E[:3, :3] @ before + E[:3, 3] if point.body is Body.PLATFORM else before
            if point.body is not Body.LIMB:
                assert np.max(np.abs(moved.points[index] - wanted)) <= 1e-10 * robot.size


def test_velocities_are_those_of_the_moving_corners() -> None:
    robot = drawing("paper-4.1-helical")
    assert robot.motion is not None
    h = 1e-6
    ahead, behind = (robot.linkage.posture_after(robot.posture, robot.motion.twist, t) for t in (h, -h))
    assert ahead is not None
    assert behind is not None
    slope = (ahead.points - behind.points)[list(robot.corners)] / (2 * h)
    velocities = robot.velocities_at(robot.posture)
    assert np.max(np.abs(slope - velocities)) <= 1e-6 * np.max(np.abs(velocities))


def test_rates_are_those_of_the_leg_lengths() -> None:
    robot = drawing("paper-4.3")
    assert robot.motion is not None
    h, rates = 1e-6, robot.limb_rates()

    def lengths(t: float) -> np.ndarray:
        moved = robot.linkage.posture_after(robot.posture, robot.motion.twist, t)  # type: ignore[union-attr]
        assert moved is not None
        return np.array([np.linalg.norm(moved.points[b] - moved.points[a]) for a, b, link in robot.links if link.limb])

    limbs = [link.limb for _, _, link in robot.links if link.limb]
    slope = (lengths(h) - lengths(-h)) / (2 * h)
    assert slope == pytest.approx([rates[str(limb)] for limb in limbs], abs=1e-6)


def test_a_helix_has_the_pitch_of_the_task() -> None:
    motion = drawing("paper-4.1-helical").motion
    assert motion is not None
    along = motion.path @ motion.axis
    around = motion.path - np.outer(along, motion.axis)
    centre = motion.line[0] - (motion.line[0] @ motion.axis) * motion.axis
    arms = around - centre
    turns = np.arctan2(np.cross(arms[0], arms[1]) @ motion.axis, arms[0] @ arms[1])
    assert (along[1] - along[0]) / turns == pytest.approx(motion.pitch, rel=1e-9)


@pytest.mark.parametrize("ending", [".png", ".svg", ".pdf"])
def test_the_same_robot_gives_the_same_bytes(ending: str) -> None:
    robot = drawing("paper-4.1-helical-axis-z")
    first, second = picture([robot], ending), picture([robot], ending)
    assert first == second
    assert first[:4] in (b"\x89PNG", b"<?xm", b"%PDF")


@pytest.mark.parametrize("name", model_names())
def test_every_parameter_of_a_robot_is_named_in_its_picture(name: str) -> None:
    model = build_model(name)
    words = {text.get_text() for text in figure_of([drawing_of_model(model)]).axes[0].texts}
    assert {parameter.name for parameter in model.parameters} <= words


def test_words_do_not_cover_each_other() -> None:
    figure = figure_of([drawing("hexapod-machining")])
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts if text.get_text()]
    for i, one in enumerate(boxes):
        assert not [other for other in boxes[i + 1 :] if one.overlaps(other)]


def test_the_command_line_draws(tmp_path: Path, cli: Run) -> None:
    target = tmp_path / "pose.png"
    code, out, err = cli("solve", "paper-4.2", "--starts", "2", "--plot", str(target))
    assert (code, err) == (0, "")
    assert "F" in out
    assert target.read_bytes()[:4] == b"\x89PNG"
    code, _, err = cli("models", "three-upu", "--plot", str(tmp_path / "robot.svg"))
    assert (code, err) == (0, "")
    assert (tmp_path / "robot.svg").stat().st_size > 10_000


def test_a_failed_solve_is_drawn_as_what_it_is() -> None:
    case = load_case("paper-4.1-helical")
    failed = solve(replace(case, search=replace(case.search, starts=2, max_iterations=1)))
    assert isinstance(failed, Solution)
    if failed.status.is_answer:
        pytest.skip("one iteration was enough")
    (robot,) = drawings_of(failed)
    assert not robot.is_answer
    assert "not" in robot.headline


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("solve", "paper-4.1-helical", "--plot", "pose.jpg"), ".png"),
        (("solve", "paper-4.1-helical", "--plot", "/no/such/folder/pose.png"), "cannot be written"),
        (("models", "--plot", "robot.png"), "name of a robot"),
        (("models", "stewart-gough", "--plot", "robot"), ".png"),
    ],
)
def test_what_cannot_be_drawn_is_told_before_the_work(arguments: tuple[str, ...], fault: str, cli: Run) -> None:
    code, out, err = cli(*arguments)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert fault in err
