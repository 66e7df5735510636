"""Pictures: drawn where the model says, in true proportion, with words in clear places."""

import itertools
import math
import re
import struct
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from builders import EACH_CASE, EACH_KIND, FEW_CASES, Array, Run, case_from, output_of, refusal_of, saved, soaked
from casadi import SX
from matplotlib.figure import Figure
from measures import exponential

from screwsynth.models import Body, Link, Model, Point, PoseSymbols, Scene, force_along, model_names
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import Case, InputError, Solution, Task, build_model, evaluate, load_case, plot, result_of, solve
from screwsynth.nlp.case.robots import model_options
from screwsynth.nlp.output.pictures import fonts, places
from screwsynth.nlp.output.pictures.drawing import Drawing, drawing_of_model
from screwsynth.nlp.output.pictures.figures import figure_of, picture
from screwsynth.nlp.output.pictures.segments import distances_to_segments, segments_cross, segments_in_boxes
from screwsynth.nlp.output.pictures.solutions import drawings_of
from screwsynth.nlp.output.pictures.view import clearest_view
from screwsynth.nlp.words.robot import robot_table

#: Robots whose functions say where their parameters are in a picture; a robot file does not.
DRAWN_BY_HAND = [name for name in model_names() if name not in gallery_names()]
#: Shipped cases with an axis to draw; hexapod-workspace has the robot of hexapod-machining, and takes long to solve.
PICTURED = [name for name in EACH_CASE if name not in {"paper-4.2", "hexapod-workspace"}]


@cache
def drawing(name: str) -> Drawing:
    return drawings_of(solve(load_case(name), starts=4))[0]


def test_the_view_is_a_parallel_projection_without_stretch() -> None:
    axes = figure_of([drawing("paper-4.3")]).axes[0]
    origin, right, up = axes.transData.transform([[0, 0], [1, 0], [0, 1]])
    assert math.dist(origin, right) == pytest.approx(math.dist(origin, up), rel=1e-9)
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
    slope = (ahead.points - behind.points)[list(robot.corners)] / (2 * h)
    velocities = robot.velocities_at(robot.posture)
    assert np.max(np.abs(slope - velocities)) <= 1e-6 * np.max(np.abs(velocities))


def test_a_helix_has_the_pitch_of_the_task() -> None:
    motion = drawing("paper-4.1-helical").motion
    along = motion.path @ motion.axis
    around = motion.path - np.outer(along, motion.axis)
    centre = motion.line[0] - (motion.line[0] @ motion.axis) * motion.axis
    arms = around - centre
    turns = np.arctan2(np.cross(arms[0], arms[1]) @ motion.axis, arms[0] @ arms[1])
    assert (along[1] - along[0]) / turns == pytest.approx(motion.pitch, rel=1e-9)


def test_the_same_robot_gives_the_same_bytes() -> None:
    robot = drawing("paper-4.1-helical-axis-z")
    for ending, head in ((".png", b"\x89PNG"), (".svg", b"<?xm"), (".pdf", b"%PDF")):
        first, second = picture([robot], ending), picture([robot], ending)
        assert first == second
        assert first.startswith(head)


def test_words_name_parameters_and_do_not_cover_each_other() -> None:
    figure = figure_of([drawing("hexapod-machining")])
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts if text.get_text()]
    assert not [1 for one, other in itertools.combinations(boxes, 2) if one.overlaps(other)]
    for model in map(build_model, DRAWN_BY_HAND):
        words = {text.get_text() for text in figure_of([drawing_of_model(model)]).axes[0].texts}
        assert {parameter.name for parameter in model.parameters} <= words


def crosses_box(a: np.ndarray, b: np.ndarray, box: tuple[float, float, float, float]) -> bool:
    """Whether a line has a point within a box: the box is cut off the line, side by side (Sutherland and Hodgman)."""
    low, high = 0.0, 1.0
    for axis, sign, side in ((0, 1, box[0]), (0, -1, box[2]), (1, 1, box[1]), (1, -1, box[3])):
        start, way = sign * (a[axis] - side), sign * (b[axis] - a[axis])
        if way > 0:
            low = max(low, -start / way)
        elif way < 0:
            high = min(high, -start / way)
        elif start < 0:
            return False
    return low <= high


def distance(point: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    """Distance of a point from the straight line through two others, in the plane."""
    (x, y), (u, v) = b - a, point - a
    return float(abs(x * v - y * u) / np.hypot(x, y))


def cross(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two straight lines have a point in common, by Cramer's rule."""
    (a, b), (c, d) = one, other
    matrix = np.column_stack([b - a, c - d])
    determinant = np.linalg.det(matrix)
    parts = np.linalg.solve(matrix, c - a) if determinant else np.array([2.0, 2.0])
    return bool((parts >= 0).all() and (parts <= 1).all())


def assert_labels_are_clear(robots: list[Drawing]) -> Figure:
    """Every limb has one label, on no other limb and within the picture, with a line that ends on its own limb."""
    figure = figure_of(robots)
    figure.canvas.draw()
    per_point = figure.dpi / 72
    for axes, robot in zip([axes for axes in figure.axes if axes.texts], robots, strict=True):
        limbs: dict[str, list[np.ndarray]] = {}
        for line in axes.lines:
            gid = str(line.get_gid())
            if gid.startswith("limb ") and not gid.startswith(("limb edge", "limb light")):
                limbs.setdefault(gid.removeprefix("limb "), []).append(axes.transData.transform(line.get_xydata()))
        assert set(limbs) == {link.limb for _, _, link in robot.links if link.limb}
        leaders = {str(line.get_gid()): axes.transData.transform(line.get_xydata()) for line in axes.lines}
        drawn = [line for name, line in leaders.items() if re.match(r"leader (?!edge$|dot$)", name)]
        # No leader line crosses another one, or goes through a word that is not its own.
        for one, other in itertools.combinations(drawn, 2):
            assert not cross(one, other)
        boxes = [text.get_window_extent().extents for text in axes.texts if text.get_text()]
        for a, b in drawn:
            hit = [box for box in boxes if crosses_box(a, b, tuple(box))]
            assert all(crosses_box(b, b, tuple(box + 4 * np.array([-1, -1, 1, 1]))) for box in hit)
        for one, other in itertools.combinations(boxes, 2):
            assert (np.minimum(one[2:], other[2:]) <= np.maximum(one[:2], other[:2])).any()
        # A line that passes the dot of another one might name either place.
        for k, (dot, _) in enumerate(drawn):
            near = (*(dot - 3 * per_point), *(dot + 3 * per_point))
            assert not [j for j, (a, b) in enumerate(drawn) if j != k and crosses_box(a, b, near)]
        for name, own in limbs.items():
            (text,) = [each for each in axes.texts if each.get_text().split("\n")[0] == f"limb {name}"]
            extent = text.get_window_extent()
            room = 3.5 * per_point  # half of a limb's width
            box = (extent.x0 - room, extent.y0 - room, extent.x1 + room, extent.y1 + room)
            others = [part for other, parts in limbs.items() if other != name for part in parts]
            assert not [part for part in others if crosses_box(*part, box)]
            frame = axes.get_window_extent()
            assert frame.x0 <= extent.x0 <= extent.x1 <= frame.x1
            assert frame.y0 <= extent.y0 <= extent.y1 <= frame.y1
            if f"leader {name}" in leaders:
                start, end = leaders[f"leader {name}"]
                away = min(distance(start, a, b) for a, b in own)
                assert away <= 0.1
                assert extent.x0 - 4 <= end[0] <= extent.x1 + 4
                assert extent.y0 - 4 <= end[1] <= extent.y1 + 4
            else:  # the label touches its own limb, or nearly
                near = tuple(np.array(box) + 6 * per_point * np.array([-1, -1, 1, 1]))
                assert any(crosses_box(a, b, near) for a, b in own)
    return figure


@pytest.mark.parametrize("name", soaked(PICTURED, FEW_CASES))
def test_limbs_are_drawn_between_their_joints_in_the_view_with_clear_labels(name: str) -> None:
    robot = drawing(name)
    view, figure = clearest_view(robot), assert_labels_are_clear([robot])
    lines = [(line.get_gid(), np.asarray(line.get_xydata())) for line in figure.axes[0].lines]
    for first, last, link in robot.links:
        if link.limb is None:
            continue
        ends = view.project(robot.posture.points[[first, last]])
        # A limb of several links has a line for each.
        apart = [np.max(np.abs(line[[0, -1]] - ends)) for gid, line in lines if gid == f"limb {link.limb}"]
        assert min(apart) <= 1e-9 * robot.size
    # A case with an objective other than F may state no task.
    assert (robot.motion is None) == bool(robot.case.tasks[0].measure)
    if robot.motion is not None and math.isfinite(robot.motion.pitch):  # a translation has an arrow instead
        assert np.max(np.abs(dict(lines)["axis"][[0, -1]] - view.project(robot.motion.line))) <= 1e-9 * robot.size


@pytest.mark.parametrize("name", soaked(model_names(), EACH_KIND))
def test_labels_of_robots_stand_on_no_other_limb(name: str) -> None:
    options = [each for each in model_options(name) if each.choices]
    variants = [{option.name: choice} for option in options for choice in option.choices or ()] or [{}]
    robots = [drawing_of_model(build_model(name, variant)) for variant in variants]
    figure = assert_labels_are_clear(robots)
    for axes, robot in zip([axes for axes in figure.axes if axes.texts], robots, strict=True):
        names = {mark.parameter for mark in robot.model.scene.marks}
        edges = [axes.transData.transform(np.asarray(patch.get_xy())) for patch in axes.patches if patch.get_gid()]
        for text in axes.texts:
            if text.get_text() in names:
                box = text.get_window_extent().extents
                assert not [k for loop in edges for k in range(len(loop) - 1) if crosses_box(loop[k], loop[k + 1], box)]


@pytest.mark.parametrize("name", soaked(PICTURED, FEW_CASES))
def test_no_motion_is_seen_from_its_end_and_no_path_from_its_edge(name: str) -> None:
    robot = drawing(name)
    axes = figure_of([robot]).axes[0]
    for motion in (robot.motion, *robot.free):
        if motion is not None:
            view = clearest_view(robot)
            assert np.linalg.norm(view.project(motion.axis)) >= 0.5
    # A circle would be a line from its edge; the turns of a helix are seen from everywhere else.
    is_circle = robot.motion is not None and robot.motion.pitch == 0
    for line in (line for line in axes.lines if line.get_gid() == "path" and is_circle):
        flat = np.asarray(line.get_xydata())
        spread = np.linalg.svd(flat - flat.mean(axis=0), compute_uv=False)
        assert spread[1] >= 0.2 * spread[0]


@pytest.mark.parametrize("name", ["five-bar", "planar-3-prr", "planar-3-rpr", "planar-3-rrr"])
def test_a_planar_robot_is_seen_from_above(name: str) -> None:
    robot = drawing_of_model(build_model(name))
    np.testing.assert_allclose(clearest_view(robot).project(np.eye(3)), [[1, 0], [0, 1], [0, 0]], atol=1e-12)
    # The same robot in an upright plane: x to the right, z up.
    turned = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    joints = tuple(each @ turned.T for each in robot.posture.joints)
    upright = replace(robot, posture=replace(robot.posture, joints=joints))
    np.testing.assert_allclose(clearest_view(upright).project(np.eye(3)), [[1, 0], [0, 0], [0, 1]], atol=1e-12)
    # The axis that points to the eye is a circle with a dot.
    marks = {line.get_gid() for line in figure_of([robot]).axes[0].lines}
    assert {"frame O z", "frame O z head"} <= marks
    assert "frame O x" not in marks


@pytest.mark.parametrize("name", ["delta", "orthoglide", "3-prs", "spherical-3-rrr"])
def test_a_robot_that_moves_in_space_is_not_seen_from_above(name: str) -> None:
    assert clearest_view(drawing_of_model(build_model(name))).elevation < 50


@pytest.mark.parametrize("name", ["paper-4.1-helical", "paper-4.4-max", "hexapod-machining"])
def test_numbers_in_a_picture_are_those_of_the_table_with_units(name: str) -> None:
    case = load_case(name)
    solution = solve(case, starts=4)
    words = [text.get_text() for text in figure_of(drawings_of(solution)).axes[0].texts]
    table = robot_table(case, result_of(solution).robot)  # type: ignore[union-attr, arg-type]
    rate = [header.split("\n")[0] for header in table.headers].index("rate")
    unit = f"{case.units.length}/rad"
    for row in table.rows:
        cells = [str(cell) for cell in row]
        kind = "couple of limb" if "couple" in cells else "limb"
        (label,) = [each for each in words if each.split("\n")[0] == f"{kind} {cells[0]}"]
        number, found = label.split("\n")[1].split(" ")
        assert found == unit
        if number != "0":
            assert number.replace("\N{MINUS SIGN}", "-") == cells[rate]
        assert ":" not in label, "a name that ends in a sign must not stand before a number in one line"


def test_a_limb_of_several_links_has_one_label() -> None:
    """A limb of two links, and five limbs of one."""
    pose = PoseSymbols()
    p, points, links, rows = pose.position, [], [], []
    for k in range(6):
        angle = k * math.pi / 3
        head = SX([4 * math.cos(angle + 0.3), 4 * math.sin(angle), 0])
        base, end = SX([10 * math.cos(angle), 10 * math.sin(angle), 0]), p + pose.rotation @ head
        points += [Point(f"B{k}", base, Body.BASE), Point(f"A{k}", end, Body.PLATFORM)]
        rows.append(force_along(str(k), base, end - base))
        if k:
            links.append(Link(f"B{k}", f"A{k}", Body.LIMB, limb=str(k)))
    points.append(Point("K", SX([16, 0, 10]), Body.LIMB))
    links += [Link("B0", "K", Body.LIMB, limb="0"), Link("K", "A0", Body.LIMB, limb="0")]
    scene = Scene(tuple(points), tuple(links))
    model = Model("two-links", "a limb of two links", (), pose, (0.0, 0.0, 20.0), tuple(rows), scene=scene)
    case = Case(model=model, parameters={}, position=[0, 0, 20], tasks=[Task([0, 0, 1, 1, 2, 3])])
    assert_labels_are_clear(drawings_of(solve(case)))


def test_letters_that_no_font_has_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fonts, "families", lambda: (fonts.FONT,))
    assert fonts.legible("Größe, мм, Ω") == "Größe, мм, Ω"
    assert fonts.legible("回転 about z") == "[2 letters, CJK] about z"
    case = replace(load_case("paper-4.3"), title="机器人 3")
    drawings = drawings_of(solve(case, starts=2))
    # A letter without a glyph is a warning, and warnings are errors here.
    assert picture(drawings, ".png")
    words = [text.get_text() for text in figure_of(drawings).texts]
    assert "[3 letters, CJK] 3" in words


def test_a_font_that_has_the_letters_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    # Any font beside the first one stands for an installed one with Chinese letters.
    monkeypatch.setattr(fonts, "families", lambda: (fonts.FONT, "STIXGeneral"))
    fonts._has.cache_clear()
    letters = map(chr, range(0x2000, 0x30000))
    letter = next(each for each in letters if fonts._has("STIXGeneral", each) and not fonts._has(fonts.FONT, each))
    assert fonts.legible(f"a{letter}") == f"a{letter}"
    assert fonts.needs_other_font(f"a{letter}")


def test_both_layouts_of_a_robot_are_drawn(tmp_path: Path, cli: Run) -> None:
    output_of(cli("models", "stewart-gough", "--plot", str(tmp_path / "robot.svg")))
    text = (tmp_path / "robot.svg").read_text(encoding="utf-8")
    assert "layout = aligned" in text
    assert "layout = octahedral" in text
    output_of(cli("models", "stewart-gough", "--plot", str(tmp_path / "robot.png")))
    wide, high = struct.unpack(">II", (tmp_path / "robot.png").read_bytes()[16:24])
    assert wide > 1.5 * high


def test_any_pose_is_drawn_and_the_worst_is_named(tmp_path: Path, cli: Run, three_poses: Callable[[str], str]) -> None:
    case = case_from(three_poses("max"), "poses")
    solution = solve(case)
    values = [evaluate(solution.nlp, solution.x, k).F for k in range(3)]
    drawn = [drawings_of(solution, k + 1)[0] for k in range(3)]
    for k, robot in enumerate(drawn):
        np.testing.assert_allclose(robot.posture.position, [[0, 0, 30], [6, 0, 33], [0, 5, 24]][k], atol=1e-12)
        assert sum(row.rate**2 for row in robot.rows) == pytest.approx(values[k], rel=1e-9)
        assert f"pose {k + 1}, F = {values[k]:.7g}" in robot.headline
        assert ("worst pose" in robot.headline) == (values[k] == min(values))
    file = saved(tmp_path / "poses.toml", three_poses("max"))
    output_of(cli("solve", str(file), "--plot", str(tmp_path / "pose.png"), "--pose", "3"))
    assert "F" in output_of(cli("solve", "paper-4.2", "--starts", "2", "--plot", str(tmp_path / "tasks.png")))
    assert (tmp_path / "pose.png").read_bytes()[:4] == (tmp_path / "tasks.png").read_bytes()[:4] == b"\x89PNG"
    refusal_of(cli("solve", str(file), "--plot", str(tmp_path / "pose.png"), "--pose", "4"), "--pose 4", "3 poses")
    with pytest.raises(InputError, match="pose 4 does not exist"):
        plot(solution, tmp_path / "pose.png", pose=4)


def test_a_failed_solve_is_drawn_as_what_it_is() -> None:
    case = load_case("paper-4.1-helical")
    failed = solve(replace(case, search=replace(case.search, starts=2, max_iterations=1)))
    assert isinstance(failed, Solution)
    if failed.status.is_answer:
        pytest.skip("one iteration was enough")
    (robot,) = drawings_of(failed)
    assert not robot.is_answer
    assert "not" in robot.headline


def test_what_cannot_be_drawn_is_told_before_the_work(cli: Run) -> None:
    for arguments, fault in (
        ("solve paper-4.1-helical --plot pose.jpg", ".png"),
        ("solve paper-4.1-helical --plot /no/such/folder/pose.png", "cannot be written"),
        ("models --plot robot.png", "name of a robot"),
        ("models stewart-gough --plot robot", ".png"),
    ):
        refusal_of(cli(*arguments.split()), fault)


@pytest.fixture
def segments() -> Array:
    """Lines (k, 4): askew, level, upright, and points."""
    found = np.random.default_rng(1).uniform(0.0, 100.0, (60, 4))
    found[10:20, 3] = found[10:20, 1]
    found[20:30, 2] = found[20:30, 0]
    found[30:35, 2:] = found[30:35, :2]
    return found


def test_a_line_is_within_a_box_where_cutting_by_each_side_leaves_a_part(segments: Array) -> None:
    corners = np.random.default_rng(2).uniform(0.0, 100.0, (50, 2, 2))
    boxes = np.hstack([corners.min(axis=1), corners.max(axis=1)])
    expected = [[crosses_box(line[:2], line[2:], tuple(box)) for line in segments] for box in boxes]
    assert np.array_equal(segments_in_boxes(segments, boxes), expected)
    assert 0 < np.count_nonzero(expected) < np.size(expected)
    # A line that ends at a side is within the box, and one just beside it is not.
    box = np.array([[10.0, 10.0, 20.0, 20.0]])
    ends = np.array([[0.0, 15, 10, 15], [0, 15, 9.999, 15], [0, 20, 30, 20], [0, 20.001, 30, 20.001], [12, 12, 13, 14]])
    assert segments_in_boxes(ends, box).tolist() == [[True, False, True, False, True]]
    assert segments_in_boxes(np.zeros((0, 4)), box).shape == (1, 0)


def test_lines_cross_and_points_are_as_far_as_from_the_nearest_point(segments: Array) -> None:
    askew, lines = segments[:10], segments[35:]
    expected = [[cross(line.reshape(2, 2), each.reshape(2, 2)) for each in askew] for line in lines]
    assert np.array_equal(segments_cross(askew, lines), expected)
    assert 0 < np.count_nonzero(expected) < np.size(expected)
    points, lines = segments[:30, :2], segments[35:]
    for line, row in zip(lines, distances_to_segments(points, lines), strict=True):
        a, b = line[:2], line[2:]
        for point, found in zip(points, row, strict=True):
            is_beside = 0 <= (point - a) @ (b - a) <= (b - a) @ (b - a)
            ends = min(np.linalg.norm(point - a), np.linalg.norm(point - b))
            assert found == pytest.approx(distance(point, a, b) if is_beside else ends, abs=1e-9)


def test_words_stand_at_the_cheapest_of_all_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search ends early, and no place that it leaves out is better: all places at once give the same picture."""
    drawing = drawing_of_model(build_model("6-ups"))
    found = []
    for count in (5, 160, 100_000):
        monkeypatch.setattr(places, "_AT_ONCE", count)
        found.append([text.get_position() for text in figure_of([drawing]).axes[0].texts])
    assert found[0] == found[1] == found[2]
