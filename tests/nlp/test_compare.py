"""Robots compared on one case: placed, scaled, solved, and told what they lack."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import Run, output_of, refusal_of, rows_of, saved
from jsonschema import Draft202012Validator

import screwsynth.nlp as sn
from screwsynth.models import Displacement
from screwsynth.nlp.comparison.data import comparison_designs, comparison_sentences
from screwsynth.nlp.comparison.robots import placed, read_robots
from screwsynth.nlp.output.pictures.drawing import drawing_of
from screwsynth.nlp.output.pictures.robots import robot_pictures, robots_figure
from screwsynth.nlp.results.schema import result_schema

# The twist is about an axis far from the origin, so that a frame that is moved wrongly shows.
CASE = """
units = { length = "mm" }
robot = { model = "stewart-gough", parameters = { x1 = 120, x2 = 60, x3 = 10, x4 = 10 } }
pose = { position = [30, -20, 150] }
task = [{ name = "tilt", sense = "max", axis = [1, 2, 0], point = [200, 10, 90], pitch = 3 }]
limits = { leg_length = { min = 20, max = 900 } }
"""
#: A sum of six squares, beside one by other operations in another order.
ROUNDING = 1e-9


@pytest.fixture
def path(tmp_path: Path) -> str:
    return str(saved(tmp_path / "case.toml", CASE))


def case() -> sn.Case:
    return sn.Case(
        model=sn.build_model("stewart-gough"),
        parameters={"x1": 120, "x2": 60, "x3": 0.2, "x4": 0.2},
        position=(30, -20, sn.Free(140, 170, 150)),
        rotation=sn.Rotation(),
        tasks=[sn.Task.screw("max", axis=(1, 2, 0), point=(200, 10, 90), pitch=3, name="tilt")],
        limits=sn.Limits(sn.LegLength(min=20, max=900)),
    )


def summed_by_hand(base: np.ndarray, platform: np.ndarray) -> float:
    """F of six legs between points (6, 3) of the world, from the velocities of the upper ends along the legs."""
    omega = np.array([1, 2, 0]) / np.sqrt(5)
    velocity = np.cross(omega, platform - np.array([200, 10, 90])) + 3 * omega
    legs = platform - base
    return float(np.sum((np.sum(velocity * legs, axis=1) / np.linalg.norm(legs, axis=1)) ** 2))


def circle(radius: float, half: float) -> np.ndarray:
    """Six points (6, 3) in pairs on a circle, at half angles in degrees."""
    angles = np.radians([120 * i + sign * half for sign in (-1, 1) for i in range(3)])
    return radius * np.stack([np.cos(angles), np.sin(angles), np.zeros(6)], axis=1)


def test_a_robot_in_the_place_of_another(path: str, tmp_path: Path, cli: Run) -> None:
    files = {name: tmp_path / f"out.{name}" for name in ("json", "csv", "html")}
    options = [word for name, file in files.items() for word in (f"--{name}", str(file))]
    out = output_of(cli("compare", path, "delta", "6-sps", "case", "--part", "0", "--starts", "1", *options))
    result = json.loads(files["json"].read_text())
    Draft202012Validator(result_schema()).validate(result)
    assert type(sn.load_result(files["json"])).__name__ == "ComparisonResult"
    robots = {each["name"]: each for each in result["robots"]}
    assert [each["part"] for each in result["robots"]] == ["ranked", "ranked", "no freedom"]
    # The 6-SPS by hand, at home where the case's pose is.
    k, home = robots["6-sps"]["factor"], np.array([30, -20, 150])
    base, platform = (k * circle(*each) for each in ((0.325, 12), (0.125, 48)))
    base += home - [0, 0, 0.5 * k]
    platform += home
    assert robots["6-sps"]["value"] == pytest.approx(summed_by_hand(base, platform), rel=ROUNDING)
    points = np.vstack([base, platform])
    largest = np.max(np.linalg.norm(points[:, np.newaxis] - points, axis=2))
    assert (robots["6-sps"]["size"], result["size"]) == pytest.approx((largest, largest), rel=ROUNDING)
    # A Delta translates alone: all of F is constraint, in words and not as an error.
    assert (robots["delta"]["freedoms"], robots["delta"]["tasks"][0]["can_move"]) == (3, False)
    assert any("with 3 degrees of freedom cannot follow the motion" in each for each in robots["delta"]["sentences"])
    # The legs of the 6-SPS have lengths, the rods of the Delta have none that could change.
    left_out = {name: [item["key"] for item in each["limits_left_out"]] for name, each in robots.items()}
    assert (left_out["6-sps"], left_out["delta"]) == ([], ["limits.leg_length"])
    rows = rows_of(files["csv"].read_text())
    assert [float(row["value"]) for row in rows] == [each["value"] for each in result["robots"]]
    assert "no freedom" in out
    assert files["html"].read_text().count("<h3>") == 3


def test_pictures_have_units_sizes_and_one_scale(path: str) -> None:
    found = sn.compare(sn.load_case(path), ["6-sps", "case"], part=0, starts=1)
    designs = comparison_designs(found, sn.comparison_result(found))
    figure = robots_figure(designs)
    words = [text.get_text() for text in figure.texts]
    for entry in found.entries:
        assert f"F = {entry.value:.5g} (mm/rad)², size {entry.final_size:.4g} mm" in words
    panels = [axes for axes in figure.axes if any(line.get_gid() == "axis" for line in axes.lines)]
    assert len(panels) == 2
    # A length is as long on paper in both panels, and as long as the bar says.
    (bar,) = [line for line in figure.artists + figure.lines if line.get_gid() == "scale"]
    shown = next(float(text.split(" mm, in all panels")[0]) for text in words if "in all panels" in text)
    long = np.ptp(bar.get_xdata()) * figure.bbox.width
    for axes in panels:
        ends = axes.transData.transform([[0, 0], [shown, 0]])
        assert ends[1, 0] - ends[0, 0] == pytest.approx(long, rel=1e-9)
    # The fastest limb of all has the colour at an end of the scale, and the legend says what is drawn.
    drawings = [drawing_of(each.nlp, each.x, each.state) for each in designs.drawn()]
    rates = np.abs(np.concatenate([[row.rate for row in each.rows] for each in drawings]))
    (scale,) = [axes for axes in figure.axes if axes.get_xlabel() == "rate of each limb, mm/rad"]
    assert scale.get_xlim() == pytest.approx((-rates.max(), rates.max()))
    legend = {text.get_text() for each in figure.legends for text in each.get_texts()}
    assert any(text.startswith("task: tilt (screw of pitch 3 mm") for text in legend)
    assert {"spherical (S)", "filled: actuated"} <= legend
    # On a page each robot has a picture of its own, and the legend one for wide and one for narrow windows.
    assert len(robot_pictures(designs)) == 4


def test_dimensions_ranges_and_certificates() -> None:
    found = sn.compare(case(), ["6-sps", "case"], part=0.1, starts=2, certified=True)
    sps, own = sorted(found.entries, key=lambda each: each.contender.is_of_case)
    assert own.solution is not None
    assert sps.solution is not None
    # Each number but the pose is free by a tenth, around the typical ones that are scaled.
    free = sps.placed.case.components("rb")[0]
    assert isinstance(free, sn.Free)
    assert (free.lower, free.upper) == pytest.approx((0.9 * 0.325 * sps.factor, 1.1 * 0.325 * sps.factor))
    position = sps.placed.case.position[2]
    assert isinstance(position, sn.Free)
    assert position.start == pytest.approx(0.5 * sps.factor)
    assert position.upper - position.lower == pytest.approx(30)
    # The better one is first, and each proof is of its own program.
    values = [each.value for each in found.entries]
    assert values == sorted(values, key=lambda value: -(value or 0.0))
    for each in found.entries:
        assert each.value is not None
        assert each.certificate.bound >= each.value * (1 - 1e-9)
    # With wider ranges the sizes differ; the case's robot keeps its ranges with --part 0 too.
    sentences = comparison_sentences(sn.compare(case(), ["6-sps", "case"], part=0.2, starts=1))
    assert any("--part 0 for a common size, except for the case's robot" in each for each in sentences)


def test_strokes_over_several_poses() -> None:
    moves = tuple(Displacement.by(np.eye(3), (0, 0, z)) for z in (0, 9))
    found = sn.compare(replace(case(), displacements=moves), ["6-sps", "case"], part=0, starts=1)
    for entry in found.entries:
        (stroke,) = entry.strokes.values()
        nlp, x = entry.solution.nlp, entry.solution.x
        first, last = (sn.evaluate(nlp, x, pose) for pose in (0, 1))
        lengths = [state.quantities[next(iter(entry.strokes))] for state in (first, last)]
        assert stroke.value == pytest.approx(np.abs(lengths[1] - lengths[0]).max())
        # Each leg becomes longer by less than the platform moves.
        assert 0 < stroke.value < 9


def test_poses_and_workspaces_stay_where_they_are_in_the_world() -> None:
    robot = read_robots(["6-sps", "delta"], case())[0]
    moves = sn.along_screw((0.2, 0.1, 1, 5, -3, 2), [-0.3, 0.0, 0.4])
    workspace = sn.Workspace((sn.Free(20, 40), -20, sn.Free(140, 170)), has_limits=True)
    found = placed(replace(case(), displacements=moves, workspace=workspace), robot, 300.0, 0.1, 1.0)
    offset, own = found.offset, found.case
    start = np.array([30, -20, 150])
    for world, moved in zip(moves, own.displacements, strict=True):
        expected = world.rotation @ start + world.translation
        assert moved.rotation @ (start - offset) + moved.translation + offset == pytest.approx(expected, abs=1e-10)
        assert np.array_equal(moved.rotation, world.rotation)
    assert own.workspace is not None
    ends = [value.lower if isinstance(value, sn.Free) else value for value in own.workspace.position]
    assert np.array(ends) + offset == pytest.approx([20, -20, 140])
    # Limits hold over the workspace of every robot.
    assert own.workspace.has_limits
    assert ([each.name for each in own.limits], found.left_out) == (["leg_length"], ())


def test_bad_input_is_one_sentence(path: str, tmp_path: Path, cli: Run) -> None:
    robot = saved(tmp_path / "mine.toml", "name = 1\n")
    taken = tmp_path / "no" / "out.json"
    for arguments, words in (
        (("6-ups",), "needs at least two robots, got 1"),
        (("6-ups", "delt"), "compare: delt: no such robot, and no such robot file; did you mean 'delta'?"),
        (("6-ups", "6-ups"), "compare: 6-ups is given twice"),
        (("6-ups", str(robot)), "mine.toml: name"),
        (("6-ups", "delta", "--size", "-1"), "--size -1: must be positive and finite"),
        (("6-ups", "delta", "--size", "100", "--no-scale"), "--size: conflicts with --no-scale"),
        (("6-ups", "delta", "--part", "1"), "--part 1: must be at least 0 and below 1"),
        (("6-ups", "delta", "--time", "0"), "--time 0: must be positive"),
        (("6-ups", "delta", "--json", str(taken)), "is not a folder"),
        (("6-ups", "delta", "--json", "-", "--csv", "-"), "can go to standard output"),
        (("delta", "3-puu", "--part", "0", "--starts", "1"), "task tilt: no compared robot has the degrees"),
    ):
        refusal_of(cli("compare", path, *arguments), words)
    with pytest.raises(sn.InputError, match="is given twice"):
        sn.compare(case(), ["case", sn.build_model("6-ups"), "case"])


def test_robots_that_do_not_keep_every_limit_have_no_rank_and_what_they_lack_is_said(cli: Run, tmp_path: Path) -> None:
    names, page, data = ["6-pus", "delta", "case", "6-ups"], tmp_path / "page.html", tmp_path / "result.json"
    words = ("--starts", "2", "--json", str(data), "--html", str(page))
    output_of(cli("compare", "hexapod-machining", *names, *words))
    result = json.loads(data.read_text())
    kept = {each["name"]: (each["part"], each["limits_kept"], each["value"]) for each in result["robots"]}
    # The six rods on rails resist the motion more, without all limits but one.
    assert kept["6-pus"][2] > kept["case"][2]
    parts = {"case": "ranked", "6-pus": "limits not kept", "delta": "no freedom", "6-ups": "no answer"}
    assert [(each["name"], each["part"]) for each in result["robots"]] == list(parts.items())
    # Legs given joint by joint have the limits of legs too, but cones that are stated by joint.
    assert [kept[name][1] for name in names] == [1, 1, 7, 0]
    sentences = {each["name"]: " ".join(each["sentences"]) for each in result["robots"]}
    for name, measure in (("6-pus", "actuator_length"), ("delta", "actuator_angle")):
        assert "legs between joint centres, and this robot is defined by joints" in sentences[name]
        assert f"its quantities are {measure}" in sentences[name]
        assert "cannot hold" not in sentences[name]
    assert "within the ranges satisfies limits.joint_spacing.min, limits.footprint.platform" in sentences["6-ups"]
    assert "Solved without limits.base_joint_angle, limits.platform_joint_angle" in sentences["6-ups"]
    answered = [each for each in result["robots"] if each["name"] != "6-ups"]
    units = {each["name"]: {rate["unit"] for rate in each["tasks"][0]["rates"]} for each in answered}
    assert units == {"case": {"in/rad"}, "6-pus": {"in/rad"}, "delta": {"rad/rad"}}
    assert any("not ranked: F can be better with fewer limits" in each for each in result["sentences"])
    # The headline names the best of those that keep every limit, and counts those that do not.
    best = f"case has the best value, {kept['case'][2]:.7g} (in/rad)²; 1 of 4 robots can be compared, "
    assert f"{best}1 does not satisfy all limits." in page.read_text()
    # Without a robot that keeps them all, none is ranked.
    status, out, _ = cli("compare", "hexapod-machining", "6-pus", "6-rus", "--starts", "1")
    assert (status, out.count("limits not kept")) == (1, 2)
