"""What a user sees of a path: numbers at its samples against statics of ours, panels of the picture, the page."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, case_from, refusal_of, saved, shipped_tables
from path_cases import BASE, PLATFORM, leg_lengths, robot_of, turns_of

from screwsynth.nlp import Case, PathOptions, inverse
from screwsynth.nlp.output.pictures.pathpanels import PathPicture, path_picture
from screwsynth.nlp.output.pictures.paths import path_figure
from screwsynth.nlp.output.report.path import path_page
from screwsynth.nlp.path.poses_csv import read_poses
from screwsynth.nlp.path.sampling import WayKind, spread_points, way_of
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.proof.workspace.path_samples import samples_of
from screwsynth.nlp.results.path import path_result

#: Seconds, positions and angles of a path on which legs of the hexapod become longer than 43 in.
KNOTS = np.array(
    [[0, 0, 0, 20, 0, 0, 0], [1, 2, -1, 22, 8, 0, 5], [4, 16, 0, 22, 8, -4, 0], [6, -18, 1, 19, 0, 0, 0]], dtype=float
)


def pictured(case: Case, knots: Array, name: str = "x,y,z,roll,pitch,yaw", seconds: float = 60) -> PathPicture:
    """The picture of a path through rows of time and pose, or of a pose alone."""
    names = f"t,{name}" if knots.shape[1] > name.count(",") + 1 else name
    rows = "\n".join(",".join(repr(float(each)) for each in row) for row in knots)
    path = read_poses(f"{names}\n{rows}", "poses.csv", case.units, PathOptions())
    judged = judge_path(case, path, gap=0.1, time_limit=seconds)
    return path_picture(judged, samples_of(judged), path_result(judged))


@pytest.fixture(scope="module")
def spindle() -> PathPicture:
    return pictured(case_from(shipped_tables("hexapod-spindle")), KNOTS)


def poses_at(t: Array) -> tuple[Array, Array]:
    p = np.stack([np.interp(t, KNOTS[:, 0], column) for column in KNOTS[:, 1:].T], axis=1)
    return p[:, :3], turns_of(np.radians(p[:, 3:]))


def lengths(t: Array) -> Array:
    return leg_lengths(*poses_at(t))


def spans(t: Array) -> tuple[Array, Array]:
    """Vectors (N, 6, 3) along the legs, and their ends on the platform from its origin."""
    p, R = poses_at(t)
    arms = np.einsum("nij,kj->nki", R, PLATFORM)
    return p[:, None] + arms - BASE, arms


def panel(picture: PathPicture, title: str) -> Array:
    (found,) = (each for each in picture.panels if each.title == title)
    return np.stack([each.values for each in found.curves], axis=1)


def test_curves_are_those_of_the_definitions(spindle: PathPicture) -> None:
    t, (legs, arms) = spindle.at, spans(spindle.at)
    assert spindle.label == "time, s"
    np.testing.assert_allclose(panel(spindle, "leg lengths"), lengths(t), rtol=1e-12)
    # Away from knots, where speeds jump.
    inside = np.abs(t[:, None] - KNOTS[:, 0]).min(axis=1) > 1e-4
    speeds = (lengths(t[inside] + 1e-5) - lengths(t[inside] - 1e-5)) / 2e-5
    np.testing.assert_allclose(panel(spindle, "speeds along the path")[inside], speeds, atol=1e-6)
    # Forces along the legs hold 15 lbf at (0, 0, 2) and 20 lbf in any direction at (0, 0, 5) of the platform.
    R, n = poses_at(t)[1], legs / lengths(t)[:, :, None]
    inverted = np.linalg.inv(np.concatenate([n, np.cross(arms, n)], axis=2).transpose(0, 2, 1))
    weight = np.array([0.0, 0.0, -15.0]) + np.zeros((len(t), 3))
    held = -np.einsum("nij,nj->ni", inverted, np.hstack([weight, np.cross(R @ [0, 0, 2], weight)]))
    x, y, z = (R @ [0, 0, 5]).T
    zero = np.zeros(len(t))
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    spread = 20 * np.linalg.norm(inverted[:, :, :3] + inverted[:, :, 3:] @ cross, axis=2)
    forces = panel(spindle, "forces, load cutting")
    np.testing.assert_allclose(forces, np.hstack([held + spread, held - spread]), atol=1e-9)
    # The smallest of all margins is that of a length, between its limits, a force or a speed.
    own_speeds = np.abs(panel(spindle, "speeds along the path"))
    every = [(43 - lengths(t)) / 26, (lengths(t) - 17) / 26, (40 - np.abs(forces)) / 40, (10 - own_speeds) / 10]
    np.testing.assert_allclose(spindle.margins, 100 * np.hstack(every).min(axis=1), atol=1e-7)
    nearest = [spindle.samples.keys[k].split(".")[0] for k in spindle.samples.nearest]
    own = np.array(["leg_length", "leg_length", "actuator_force", "actuator_speed"])
    chosen = np.argmin([each.min(axis=1) for each in every], axis=0)
    ties = np.sort([each.min(axis=1) for each in every], axis=0)
    assert (own[chosen] == nearest)[ties[1] - ties[0] > 1e-9].all()


def test_faults_are_marked_and_their_segments_are_shaded(spindle: PathPicture) -> None:
    # The first instants at which a leg is longer than 43 in, or faster than 10 in/s.
    t = np.linspace(0, 6, 60001)
    speeds = np.abs(np.diff(lengths(t), axis=0)) / (t[1] - t[0])
    beyond = [*(lengths(t).T > 43), *(speeds.T > 10)]
    first = sorted({float(t[np.argmax(row)]) for row in beyond if row.any()})
    np.testing.assert_allclose([each.at for each in spindle.marks], first, atol=1.1e-4)
    assert [each.line for each in spindle.marks] == [4, 5, 5, 5, 5, 5]
    # A leg is too long at the end of the second segment and at the beginning of the third one.
    assert [(each.start, each.end, each.is_refuted) for each in spindle.bands] == [(1.0, 6.0, True)]
    fast = (np.abs(panel(spindle, "speeds along the path")) > 10 * (1 + 3e-9)).any(axis=1)
    assert spindle.samples.is_violated.tolist() == ((lengths(spindle.at) > 43 * (1 + 3e-9)).any(axis=1) | fast).tolist()


def test_the_first_force_beyond_its_limit_is_found(spindle: PathPicture) -> None:
    """Not the place of the largest force, which the search names."""
    limit = 0.9 * np.abs(panel(spindle, "forces, load cutting")).max()
    tables = shipped_tables("hexapod-spindle") | {"limits": {"actuator_force": {"max": limit}}}
    picture = pictured(case_from(tables), KNOTS)
    beyond = np.abs(panel(picture, "forces, load cutting")) > limit
    (mark, *_), first = picture.marks, int(np.argmax(beyond.any(axis=1)))
    assert 0 < first < len(beyond) - 1
    assert picture.at[first - 1] <= mark.at <= picture.at[first]


def test_the_picture_has_its_panels(spindle: PathPicture) -> None:
    figure = path_figure(spindle)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == [
        "leg lengths, in", "speeds along the path, in/s", "forces, load cutting, lbf", "smallest margin, %",
    ]  # fmt: skip
    for axes, shown in zip(figure.axes, spindle.panels, strict=False):
        drawn = {line.get_gid(): line for line in axes.get_lines()}
        for curve in shown.curves:
            name = f"{'smallest ' * curve.is_other}{shown.title} {curve.name}"
            np.testing.assert_array_equal(drawn[name].get_xydata(), np.stack([spindle.at, curve.values], axis=1))
    limits = [[line.get_ydata()[0] for line in axes.get_lines() if line.get_gid() == "limit"] for axes in figure.axes]
    assert [sorted(each) for each in limits] == [[17, 43], [-10, 10], [-40, 40], [0]]
    for axes in figure.axes:
        assert [line.get_gid() for line in axes.get_lines()].count("fault 5") == 5
        assert [patch.get_gid() for patch in axes.patches] == ["refuted"]
    words = [text.get_text() for text in figure.axes[0].texts]
    # Of faults that are near to each other there is one label.
    assert words[0] == "lines 4, 5"
    assert set(words[1:]) == {"line 5"}
    assert "Sampled for the picture; the verdicts are proved." in figure.legends[0].get_title().get_text()


def test_without_times_the_axis_is_the_length_or_the_segment(spindle: PathPicture) -> None:
    case = case_from(shipped_tables("hexapod-linuxcnc"))
    picture = pictured(case, KNOTS[:, 1:])
    steps = np.linalg.norm(np.diff(KNOTS[:, 1:4], axis=0), axis=1)
    assert picture.label == "length along the path, in"
    np.testing.assert_allclose(picture.way.knots, [0, *np.cumsum(steps)])
    assert [each.title for each in picture.panels] == ["leg lengths"]
    turning = pictured(case, np.array([[0, 0, 20, 0, 0, 0], [0, 0, 20, 5, 0, 0], [0, 0, 21, 5, 0, 0]], dtype=float))
    assert turning.label == "segments"
    assert way_of(spindle.judged.path).kind is WayKind.TIME
    assert not turning.marks
    assert not turning.bands


def test_long_paths_have_few_points_with_the_places_that_are_named() -> None:
    rows = "\n".join(f"{math.sin(k / 99)!r},{math.cos(k / 77)!r},20" for k in range(5001))
    path = read_poses(f"x,y,z\n{rows}", "poses.csv", case_from(shipped_tables("hexapod-linuxcnc")).units, PathOptions())
    points = spread_points(path, 400, [(17, 0.25), (4999, 1.0)])
    assert 400 <= len(points.segments) <= 402
    assert (17, 0.25) in zip(points.segments.tolist(), points.parameters.tolist(), strict=True)
    along = way_of(path).at(points)
    assert along[0] == 0
    assert along[-1] == pytest.approx(path.lengths.sum(), rel=1e-12)
    assert (np.diff(along) > 0).all()
    assert np.diff(along).max() <= path.lengths.sum() / 398


def data_of(page: str) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, flags=re.DOTALL)
    return dict(json.loads(text))


def drawn_lengths(view: dict[str, Any], frame: dict[str, Any]) -> dict[str, list[float]]:
    """Lengths of the lines of each limb."""
    points = np.array(frame["points"])
    found: dict[str, list[float]] = {}
    for link in view["links"]:
        if link["limb"] is not None:
            a, b = link["ends"]
            found.setdefault(link["limb"], []).append(float(np.linalg.norm(points[a] - points[b])))
    return found


def test_the_page_has_the_postures_of_the_path(spindle: PathPicture) -> None:
    page = path_page(spindle, "the text of the case", lambda pose: f"command at {pose.position[0]}")
    assert len(page) < 3_000_000
    view = data_of(page)["view"]
    frames = view["frames"]
    assert 250 <= len(frames) <= 300
    at = np.array([each["at"] for each in frames])
    assert (at[0], at[-1]) == (0, 6)
    assert {each.at for each in spindle.marks} <= set(at.tolist())
    found = inverse(spindle.judged.case, *poses_at(at))
    for frame, p, coordinates in zip(frames, poses_at(at)[0], found.coordinates, strict=True):
        shown = drawn_lengths(view, frame)
        assert list(shown) == list(found.actuators)
        np.testing.assert_allclose([each[0] for each in shown.values()], coordinates, atol=1e-5)
        np.testing.assert_allclose(frame["position"], p, atol=1e-5)
    # The slider begins at the first fault, and says so.
    first = frames[view["first"]]
    assert first["at"] == spindle.marks[0].at
    assert first["words"].startswith("line 4, time ")
    places = np.array([each["position"] for each in view["marks"]])
    np.testing.assert_allclose(places, poses_at(np.array([each.at for each in spindle.marks]))[0], atol=1e-5)
    # Words, tables and charts need no script.
    words = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    for text in ("First fault: line 4", "leg_length limb 1-", "Leg lengths from", "the text of the case", "command at"):
        assert text in words
    assert words.count('class="chart"') == 4
    assert words.count('class="cursor"') == 4
    assert len(re.findall(r'class="bound"', words)) == 6 * 4


def test_a_delta_on_a_page_keeps_its_arms_and_rods() -> None:
    case = robot_of("delta", {"actuator_angle": {"min": -30, "max": 60}}, rb=0.164)
    rows = np.array([[0, 0, -1.1], [0.2, 0.1, -1.2], [0, 0, -1.9], [-0.2, 0.1, -1.0]])
    picture = pictured(case, rows, "x,y,z", 0.1)
    view = data_of(path_page(picture, "", lambda _: ""))["view"]
    positions = np.array([each["position"] for each in view["frames"]])
    # Out of reach, there is no posture; arms and rods are 1.768 m long together.
    assert positions[:, 2].min() < -1.75
    assert positions[:, 2].min() > -1.768 - 0.12
    for frame in view["frames"]:
        for found in drawn_lengths(view, frame).values():
            assert {0.524, 1.244} <= {round(each, 5) for each in found}
    apart = ~picture.samples.joints.closed
    assert apart.any()
    assert np.isnan(picture.margins[apart]).all()
    assert not picture.samples.is_violated[apart].any()
    assert picture.samples.is_apart.tolist() == apart.tolist()
    for at in picture.at[apart]:
        assert any(each.start <= at <= each.end for each in picture.bands)


def test_the_command_writes_picture_and_page(cli: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part = saved(tmp_path / "part.ngc", "G20 G90\nG0 X0 Y0 Z20 A0 B0 C0\nG1 F60 X2 A5\nG2 X2 Y2 I0 J1 B-4\nM2\n")
    files = [tmp_path / name for name in ("path.png", "page.html")]
    command = ("path", "hexapod-linuxcnc", "--along", str(part))
    code, _, err = cli(*command, "--plot", str(files[0]), "--html", str(files[1]))
    assert (code, err) == (0, "")
    assert files[0].read_bytes().startswith(b"\x89PNG")
    assert "Everything is proved at every point." in files[1].read_text(encoding="utf-8")
    refusal_of(cli(*command, "--plot", str(tmp_path / "path.txt")), ".png, .svg or .pdf")
    refusal_of(cli(*command, "--html", str(part)), "the path that is read")
    monkeypatch.setattr("screwsynth.nlp.output.pictures.requirements.find_spec", lambda _: None)
    refusal_of(cli(*command, "--html", str(tmp_path / "other.html")), "pages need")
