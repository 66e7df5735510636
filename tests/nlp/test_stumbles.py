"""Small things that users met: each has a test here."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest
from builders import Run, output_of, saved
from matplotlib.backends.backend_agg import FigureCanvasAgg

from screwsynth.nlp import InputError, load_case
from screwsynth.nlp.case.robotfile import model_of_definition, read_definition
from screwsynth.nlp.output.files import check_origin
from screwsynth.nlp.output.pictures.sweeps import sweep_figure, sweep_legend
from screwsynth.nlp.output.sweeptable import TablePoint
from screwsynth.nlp.starter.text import starter_case
from screwsynth.nlp.sweeps.points import grid

HEAD = Path(__file__).parents[2] / "cases" / "robots" / "reachy-mini-head.toml"

#: A platform on six telescoping legs, 40 to 60 m from the middle, without dimensions.
LARGE = """
name = "large"
home = [0, 0, 0]
[[limb]]
repeat = { count = 3, axis = [0, 0, 1], through = [0, 0, 0] }
points = { B = [60, 0, -40], A = [40, 8, 0] }
joints = [ { type = "U", at = "B", axes = ["x", "y"] }, { type = "P", at = "B", axis = "A - B", actuated = true },
           { type = "S", at = "A" } ]
[[limb]]
repeat = { count = 3, axis = [0, 0, 1], through = [0, 0, 0] }
points = { B = [60, 0, -40], A = [40, -8, 0] }
joints = [ { type = "U", at = "B", axes = ["x", "y"] }, { type = "P", at = "B", axis = "A - B", actuated = true },
           { type = "S", at = "A" } ]
"""


def test_a_robot_file_is_described(cli: Run, tmp_path: Path) -> None:
    out = output_of(cli("models", str(HEAD)))
    assert out.startswith("Reachy Mini head\n")
    assert "radius of the motors" in out
    status, _, err = cli("models", str(tmp_path / "none.toml"))
    assert status == 2
    assert "none.toml" in err
    assert err.count("\n") == 1


def test_numbers_that_can_be_set_are_all_named(cli: Run) -> None:
    status, _, err = cli("evaluate", "hexapod-machining", "--set", "y7=1")
    assert status == 2
    for words in ("x1, x2", "such as x1.max", "limits.leg_length.max", "task.pitch"):
        assert words in err
    _, _, err = cli("evaluate", "hexapod-machining", "--set", "p_z.maxx=1")
    assert "did you mean 'p_z.max'?" in err


def test_a_wrong_column_is_that_of_the_file_of_points(cli: Run, tmp_path: Path) -> None:
    points = saved(tmp_path / "points.csv", "x1,nope\n20,3\n")
    status, _, err = cli("sweep", "paper-4.1-helical", "--over", str(points), "--out", str(tmp_path / "out.csv"))
    assert status == 2
    assert err.startswith(f"screwsynth: {points}: column nope: cannot be set")


def test_a_starter_follows_the_size_of_a_robot_without_dimensions(tmp_path: Path) -> None:
    (tmp_path / "large.toml").write_text(LARGE, encoding="utf-8")
    model = model_of_definition(read_definition("large.toml", tmp_path), "large.toml")
    assert not model.parameters
    path = saved(tmp_path / "case.toml", starter_case(model, "large.toml"))
    z = load_case(str(path)).position[2]
    # 0.3 times the distance of the joints on the base from its origin, sqrt(60^2 + 40^2) = 72.1, as a round number.
    assert z.upper == 20  # type: ignore[union-attr]


def test_a_point_shows_F_with_its_unit_and_nothing_at_rounding_level(cli: Run) -> None:  # noqa: N802 - the objective
    _, out, _ = cli("evaluate", "reachy-mini")
    assert "(m/rad)²" in next(line for line in out.splitlines() if line.startswith("F  "))
    assert "e-10" not in out
    # The numbers themselves are in the result.
    _, out, _ = cli("evaluate", "reachy-mini", "--json", "-")
    pitches = [each["pitch"] for each in json.loads(out)["principal_motions"]["rotations"]]
    assert 0 < abs(pitches[0]) < 1e-6
    # Legs upright below equal plates do no work in a turn about the normal: F is the rounding of larger terms.
    upright = ("x1=8", "x2=8", "x3=7.3", "x4=7.3", "p_x=0", "p_y=0", "angle=0")
    settings = [part for each in upright for part in ("--set", each)]
    _, out, _ = cli("evaluate", "paper-4.2", *settings)
    assert [line for line in out.splitlines() if line.startswith("F  ")] == ["F  6 (cm/cm)²", "F  0 (cm/rad)²"]


def test_axes_of_a_sweep_have_units() -> None:
    case = load_case("hexapod-machining")
    points = grid(["limits.leg_length.max=32,34", "task.pitch=0.1,0.2"])
    found = [TablePoint(1.0, "")] * len(points)
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in sweep_figure(case, points, found).axes]
    assert labels[0] == ("limits.leg_length.max, in", "task.pitch, in/rad")
    points = grid(["x3=1,2", "x1=30,31"])
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in sweep_figure(case, points, found).axes]
    assert labels[0] == ("x3, deg", "x1, in")


def test_regions_of_a_sweep_have_numbers_that_a_legend_explains() -> None:
    case = load_case("hexapod-machining")
    points = grid(["x1=26:32:13", "x2=10:13:7"])
    x1, x2 = (each.ravel() for each in np.meshgrid(*points.axes, indexing="ij"))
    # Three regions: a half, a quarter, and a quarter without an answer.
    words = ["leg_length limb 1- max; leg_length limb 1+ max; x3 min" if a < 29 else "x3 min" for a in x1]
    found = [
        TablePoint(math.nan if a >= 29 and b > 11.5 else a + b, word) for a, b, word in zip(x1, x2, words, strict=True)
    ]
    figure = sweep_figure(case, points, found)
    FigureCanvasAgg(figure).draw()
    axes = figure.axes[0]
    numbers = {text.get_text(): text.get_position() for text in axes.texts if text.get_gid() == "number"}
    lines = {line.partition(": ")[0]: line.partition(": ")[2] for line in sweep_legend(found)}
    assert set(numbers) == {"1", "2"}
    assert lines["Active at every number"] == "x3 min"
    assert lines["1"] == "also leg_length max (limb 1-, limb 1+)"
    assert lines["2"] == "no other limit is active"
    assert lines["Lines"].endswith("Empty: no answer.")
    assert numbers["1"][0] < 28.75
    assert numbers["2"][0] > 28.75
    assert numbers["2"][1] < 11.75
    for axis, values in zip((axes.get_xticks(), axes.get_yticks()), points.axes, strict=True):
        assert 5 <= len(axis) <= 9
        assert set(axis) <= set(values)
    drawn = figure.get_supxlabel()
    assert all(line in drawn for line in sweep_legend(found))
    # The legend stands below the axes, and within the picture.
    (legend,) = [text for text in figure.texts if text.get_text() == drawn]
    box = legend.get_window_extent()
    assert min(box.x0, box.y0) >= 0
    assert box.x1 <= figure.bbox.x1
    assert box.y1 <= axes.xaxis.label.get_window_extent().y0


def test_numbers_above_a_curve_do_not_cover_each_other() -> None:
    case = load_case("hexapod-machining")
    points = grid(["x1=26:32:25"])
    found = [TablePoint(float(k), "x2 min" if k % 8 < 2 else "x3 min" if k % 8 < 4 else "") for k in range(25)]
    figure = sweep_figure(case, points, found)
    FigureCanvasAgg(figure).draw()
    boxes = [text.get_bbox_patch().get_window_extent() for text in figure.axes[0].texts]
    assert len(boxes) == 10  # one for each run of equal limits
    assert not [1 for one, other in itertools.combinations(boxes, 2) if one.overlaps(other)]


def test_an_import_writes_over_its_own_files_only(tmp_path: Path) -> None:
    target = tmp_path / "robot.toml"
    beginning = "# Imported by screwsynth from "
    check_origin(str(target), beginning)
    target.write_text(f"{beginning}a.xml\n", encoding="utf-8")
    check_origin(str(target), beginning)
    target.write_text("# my own notes\n", encoding="utf-8")
    check_origin(str(target), beginning, force=True)
    with pytest.raises(InputError, match=r"robot\.toml: exists, and screwsynth did not write it: .* or --force"):
        check_origin(str(target), beginning)
