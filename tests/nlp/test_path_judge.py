"""Verdicts on programmed paths: hulls of pieces, and machines against kinematics of ours at dense samples."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from builders import Array, Run, case_from, output_of, refusal_of, saved, shipped_tables, starter_tables
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from path_cases import (
    HOME,
    Floats,
    delta_angles,
    extreme,
    halved,
    hexapod,
    lengths_at,
    program,
    robot_of,
    table,
    turns_of,
)

from screwsynth.nlp import Outcome, PathOptions, ProgrammedPath, Sense, Units, interruption, judge_workspace
from screwsynth.nlp.path.gcode import read_program
from screwsynth.nlp.proof.workspace.path_domain import covered
from screwsynth.nlp.proof.workspace.path_judge import judge_path

#: Points of each segment at which machines are measured.
SAMPLES = np.linspace(0, 1, 4001)
#: A line with turns, a helix of two turns, an arc in each other plane and a dwell; about (0, 0, 20) in.
TOUR = (
    "G94 F60\nG1 X3 Y0 Z21 A2 C-3\nG3 X3 Y0 Z22 I-3 J0 P2 A0\nG18 G2 X0 Z25 K3 I0\nG4 P1\nG19 G3 Y3 Z22 J0 K-3 B4\nM2"
)


def points_of(path: ProgrammedPath, k: int, s: Array) -> Array:
    """Positions and angles (N, 6) on a segment, from its arc's numbers alone."""
    found = path.knots[k] + s[:, None] * (path.knots[k + 1] - path.knots[k])
    if k in path.arc_segments:
        arc, plane = path.arc_of(k)
        first, second = {17: (0, 1), 18: (2, 0), 19: (1, 2)}[plane]
        angle, radius = arc.angle + s * arc.sweep, arc.radius + s * arc.growth
        found[:, first], found[:, second] = arc[0] + radius * np.cos(angle), arc[1] + radius * np.sin(angle)
    return found


def sampled_lengths(path: ProgrammedPath) -> Array:
    return np.concatenate([lengths_at(points_of(path, k, SAMPLES)) for k in range(len(path))])


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.tuples(*[st.floats(-9, 9)] * 6, *[st.floats(-140, 140)] * 6),
    st.sampled_from([(17, "IJ"), (18, "KI"), (19, "JK")]),
    st.tuples(st.floats(0.1, 9), st.floats(-math.pi, math.pi), st.floats(0.01, 6), st.integers(1, 4)),
    st.lists(st.booleans(), max_size=60),
    st.floats(0, 1),
)
def test_boxes_of_pieces_hold_their_points(
    ends: Floats, plane: tuple[int, str], arc: Floats, halves: list[bool], part: float
) -> None:
    (code, letters), (radius, angle, sweep, turns) = plane, arc
    first, second = {17: "XY", 18: "ZX", 19: "YZ"}[code]
    place = dict(zip("XYZ", ends[:3], strict=True))
    centre = [place[first] - radius * math.cos(angle), place[second] - radius * math.sin(angle)]
    end = {first: centre[0] + radius * math.cos(angle + sweep), second: centre[1] + radius * math.sin(angle + sweep)}
    words = [f"{x}{end[x]:.12f}" for x in end]
    words += [f"{x}{c - place[y]:.12f}" for x, c, y in zip(letters, centre, (first, second), strict=True)]
    words += [f"{x}{value:.12f}" for x, value in zip("ABC", ends[9:], strict=True)]
    text = f"G21 G94 F60\nG{code} G3 {' '.join(words)} P{turns}\nG1 X{ends[3]:.9f} A{ends[6]:.9f}\nM2"
    start = (*ends[:3], *ends[6:9])
    path = read_program(text.split("\n"), "part.ngc", Units("mm"), PathOptions(start=start))
    cover = covered(path, 1.0)[0]
    low, high = halved(halves)
    for k in range(len(path)):
        lower, upper = cover.boxes(np.array([[k, low, high]]))
        s = np.array([low, high, min(max(low + part * (high - low), low), high)])
        y = points_of(path, k, s)
        y[:, 3:] = np.tan(0.5 * y[:, 3:])
        assert (np.minimum(y - lower, upper - y) >= 0).all()
        assert (upper - lower <= 200 * turns * (high - low) * (1 + upper[:, 3:].max() ** 2) + 1e-9).any()
    if len(path) == 1:  # a line that moves nothing
        return
    # Segments meet in a pose, so that loops can be followed from one to the next.
    one, other = cover.boxes(np.array([[0, low, 1.0], [1, 0, high]]))
    assert (one.max(axis=0) <= other.min(axis=0)).all()


def test_legs_of_a_hexapod_on_lines_arcs_and_helices_are_those_of_dense_samples() -> None:
    case = hexapod()
    path = program(case, TOUR, HOME)
    judged = judge_path(case, path, gap=1e-3)
    assert judged.is_proved
    sampled = sampled_lengths(path)
    names = [each.name for each in judged.extremes if each.sense is Sense.MIN]
    assert len(names) == 6
    for k, name in enumerate(names):
        shortest, longest = (extreme(judged, name, sense) for sense in (Sense.MIN, Sense.MAX))
        for found, end, sign in ((shortest, sampled[:, k].min(), -1), (longest, sampled[:, k].max(), 1)):
            assert sign * (found.bound - end) > -1e-9
            assert sign * (found.bound - end) < 2e-3 * end
            at = points_of(path, found.place.segment, np.array([found.place.parameter]))
            assert lengths_at(at)[0, k] == pytest.approx(found.reached, rel=1e-12)


def test_a_limit_is_refuted_in_the_first_line_that_leaves_it() -> None:
    case = hexapod({"min": 17, "max": 33.5})
    path = program(case, TOUR, HOME)
    judged = judge_path(case, path)
    beyond = [lengths_at(points_of(path, k, SAMPLES)).max(axis=1) > 33.5 for k in range(len(path))]
    segment = next(k for k, each in enumerate(beyond) if each.any())
    first = min(each.place for each in judged.faults.values())
    assert first.segment == segment
    assert first.parameter == pytest.approx(SAMPLES[np.argmax(beyond[segment])], abs=SAMPLES[1])
    lengths_alone = [each for each in judged.extremes if each.name.startswith("leg_length")]
    of_longest = [each for each in lengths_alone if each.sense is Sense.MAX]
    sampled = sampled_lengths(path)
    assert [each.outcome is Outcome.REFUTED for each in of_longest] == (sampled.max(axis=0) > 33.5).tolist()
    stopped = judge_path(hexapod({"max": 50}), path, time_limit=0)
    assert {each.outcome for each in (*stopped.ranks, *stopped.extremes)} == {Outcome.OPEN}
    assert not stopped.is_proved


def test_an_interrupted_judgement_keeps_what_is_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    requested = Event()
    monkeypatch.setattr(interruption, "_requested", requested)
    case = hexapod({"min": 17, "max": 43})
    path = program(case, TOUR, HOME)
    judged = judge_path(case, path, progress=lambda step: requested.set() if step == "limits" else None)
    assert [each.outcome for each in judged.ranks] == [Outcome.PROVED]
    assert {(each.outcome, each.reason) for each in judged.extremes} == {(Outcome.OPEN, interruption.STOPPED)}
    assert not judged.is_proved


@pytest.mark.parametrize(("part", "outcome"), [(1.0001, Outcome.PROVED), (0.9999, Outcome.REFUTED)])
def test_a_stroke_is_the_longest_length_less_the_shortest_at_any_two_points(part: float, outcome: Outcome) -> None:
    case = hexapod()
    path = program(case, TOUR, HOME)
    sampled = sampled_lengths(path)
    most = float(np.ptp(sampled, axis=0).max())
    limits = {"leg_length": {"min": 17, "max": 43}, "actuator": {"stroke_max": part * most}}
    judged = judge_path(hexapod(limits=limits), path)
    strokes = [each for each in judged.extremes if each.name.startswith("actuator.stroke_max")]
    assert strokes[int(np.argmax(np.ptp(sampled, axis=0)))].outcome is outcome
    assert judged.is_proved == (part > 1)
    assert all(each.place is not None for each in strokes)


@pytest.mark.parametrize("text", ["G1 Z22", "G4 P1", "G1 X1"])
@pytest.mark.parametrize("yaw", [0.0, 30.0])
def test_a_path_along_one_coordinate_or_none(text: str, yaw: float) -> None:
    case = hexapod({"min": 17, "max": 43})
    path = program(case, f"G94 F60\n{text}\nM2", (0, 0, 20, 0, 0, yaw))
    judged = judge_path(case, path)
    assert judged.is_proved
    sampled = lengths_at(points_of(path, 0, SAMPLES))
    for k, found in enumerate(each for each in judged.extremes if each.sense is Sense.MIN):
        assert 17 <= found.bound <= sampled[:, k].min() + 1e-9


def test_a_singular_pose_is_crossed_and_all_of_a_line_is_singular() -> None:
    # The octahedral platform is singular where it is turned by a right angle.
    case = hexapod()
    crossed = judge_path(case, table(case, [(0, 0, 20, 0, 0, 50), (0, 0, 20, 0, 0, 60), (1, 0, 21, 0, 0, 110)])).ranks[
        0
    ]
    assert crossed.outcome is Outcome.REFUTED
    assert crossed.place.segment == 1
    assert crossed.place.parameter == pytest.approx(0.6, abs=1e-9)
    whole = judge_path(case, table(case, [(0, 0, 20, 0, 0, 90), (1, 0, 21, 0, 0, 90)])).ranks[0]
    assert whole.outcome is Outcome.REFUTED


def bisected(low: float, high: float, is_low: Callable[[float], bool]) -> tuple[float, float]:
    """Two numbers next to each other, the first of which is low and the second not."""
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_low(middle) else (low, middle)
    return low, high


def triangle(radius: float, azimuth: float) -> Array:
    angles = np.radians(azimuth) + 2 * np.pi / 3 * np.arange(3)
    return radius * np.stack([np.cos(angles), np.sin(angles)], 1)


def rpr_determinant(x: float, y: Array) -> Array:
    """Determinants (N,) of the legs of a planar 3-RPR robot that is not turned, as vectors of any length."""
    base, d = triangle(1.0, 0), np.stack(np.broadcast_arrays(x, y), 1)[:, None] + triangle(0.35, 60) - triangle(1.0, 0)
    moments = base[:, 0] * d[:, :, 1] - base[:, 1] * d[:, :, 0]
    return np.asarray(np.linalg.det(np.concatenate([d, moments[:, :, None]], 2)))


def test_a_singular_pose_is_touched_between_samples_without_a_change_of_sign() -> None:
    case = robot_of("planar-3-rpr", rb=1.0)

    def extreme_at(x: float) -> tuple[float, float]:
        """The y at which the determinant, a quadratic along a line, is extreme, and its value there."""
        a, b, c = np.polyfit([-1.0, 0.0, 1.0], rpr_determinant(x, np.array([-1.0, 0.0, 1.0])), 2)
        return -b / (2 * a), c - b * b / (4 * a)

    # Singular poses without a turn lie on a circle, and this line is a tangent far from legs without length.
    low, high = 0.0, -3.0
    assert extreme_at(low)[1] * extreme_at(high)[1] < 0
    low = bisected(low, high, lambda x: extreme_at(x)[1] * extreme_at(0.0)[1] > 0)[0]
    y, _ = extreme_at(low)
    values = rpr_determinant(low, np.linspace(y - 0.1234, y + 0.2, 324))
    assert (values > 0).all() or (values < 0).all()

    # A line near by crosses twice within 0.4 mm, between two of the samples at each millimetre.
    def roots(x: float) -> Array:
        return np.sort(np.roots(np.polyfit([-1.0, 0.0, 1.0], rpr_determinant(x, np.array([-1.0, 0.0, 1.0])), 2)))

    far = low + 1e-3 if np.isreal(roots(low + 1e-3)).all() else low - 1e-3
    far = bisected(low, far, lambda x: not np.isreal(roots(x)).all() or np.ptp(roots(x)) <= 4e-4)[1]
    one, other = roots(far)
    assert other - one == pytest.approx(4e-4, rel=1e-3)
    begin = 0.5 * (one + other) - 0.1235
    values = rpr_determinant(far, begin + 1e-3 * np.arange(324))
    assert (values > 0).all() or (values < 0).all()
    twice = judge_path(case, table(case, [(far, begin, 0, 0, 0, 0), (far, begin + 0.323, 0, 0, 0, 0)])).ranks[0]
    assert twice.outcome is Outcome.REFUTED
    assert np.abs(roots(far) - twice.pose.position[1]).min() < 1e-8
    judged = [
        judge_path(case, table(case, [(x, y - 0.1234, 0, 0, 0, 0), (x, y + 0.2, 0, 0, 0, 0)]))
        for x in (low, low + 1e-4, low - 1e-4)
    ]
    touched, *beside = (each.ranks[0] for each in judged)
    assert touched.outcome is Outcome.REFUTED
    assert touched.pose.position[1] == pytest.approx(y, abs=1e-6)
    # On one side the determinant changes its sign twice, on the other nowhere.
    assert {each.outcome for each in beside} == {Outcome.PROVED, Outcome.REFUTED}


def test_cranks_of_a_delta_are_those_of_its_closed_form() -> None:
    case = robot_of("delta", {"actuator_angle": {"max": 60}}, rb=0.164)
    rows = [(0, 0, -1.2), (0.1, 0.05, -1.1), (-0.2, 0.1, -1.0), (-0.2, 0.1, -1.0005)]
    path = table(case, [(*row, 0, 0, 0) for row in rows])
    judged = judge_path(case, path)
    assert judged.is_proved
    p = np.concatenate([points_of(path, k, SAMPLES) for k in range(3)])[:, :3]
    for k, angles in enumerate(delta_angles(p).T):
        for sense, end in ((Sense.MIN, angles.min()), (Sense.MAX, angles.max())):
            found = extreme(judged, f"actuator_angle limb {k + 1}", sense)
            assert sense.sign * (found.bound - end) > -1e-9
            assert found.reached == pytest.approx(end, abs=2e-3)


@pytest.mark.parametrize(("turn", "far"), [(0, (0.1, 0.01)), (12, (0.1, 0.01)), (12, (0.1, 0)), (12, (0.1, 0.1))])
def test_a_delta_does_not_turn_along_a_path(turn: float, far: tuple[float, float]) -> None:
    case = robot_of("delta", {"actuator_angle": {"min": -60, "max": 60}}, rb=0.164, arm=0.2, rod=0.9)
    judged = judge_path(case, table(case, [(0, 0, -0.95, 0, 0, turn), (*far, -0.95, 0, 0, turn)]))
    assert judged.is_proved == (turn == 0)


def test_a_path_out_of_reach_is_refuted_and_no_rank_is() -> None:
    case = robot_of("delta", rb=0.164)
    # Arms and rods are 1.768 long together.
    judged = judge_path(case, table(case, [(0, 0, -1.1, 0, 0, 0), (0, 0, -1.2, 0, 0, 0), (0, 0, -3, 0, 0, 0)]))
    reaches = [each for each in judged.extremes if each.name.startswith("reach")]
    assert {each.outcome for each in reaches} == {Outcome.REFUTED}
    assert {each.place.segment for each in reaches} == {1}
    assert Outcome.PROVED not in {each.outcome for each in judged.ranks[:1]}


def test_slides_of_a_robot_with_loops_are_followed_along_its_path() -> None:
    case = robot_of("planar-3-prr", {"actuator_length": {"min": -0.3, "max": 0.3}}, rb=1.0)
    path = table(case, [(0, 0, 0, 0, 0, 0), (0.1, 0.05, 0, 0, 0, 5), (0.1, 0.1, 0, 0, 0, -5)])
    judged = judge_path(case, path)
    assert judged.is_proved
    points = np.concatenate([points_of(path, k, SAMPLES) for k in range(2)])
    hinges = points[:, None, :2] + np.einsum("nij,kj->nki", turns_of(points[:, 3:])[:, :2, :2], triangle(0.35, 60))
    for k in range(3):
        c, s = math.cos(2 * math.pi / 3 * k), math.sin(2 * math.pi / 3 * k)
        a, b = c * hinges[:, k, 0] + s * hinges[:, k, 1], c * hinges[:, k, 1] - s * hinges[:, k, 0]
        # The first point is home, where the slide is at -0.3 of its rail.
        slides = b - np.sqrt((a[0] - 1) ** 2 + (b[0] + 0.3) ** 2 - (a - 1) ** 2) + 0.3
        assert slides[0] == pytest.approx(0, abs=1e-12)
        for sense, end in ((Sense.MIN, slides.min()), (Sense.MAX, slides.max())):
            found = extreme(judged, f"actuator_length limb {k + 1}", sense)
            assert sense.sign * (found.bound - end) > -1e-9
            assert sense.sign * (end - found.reached) > -1e-9
    # The third slide is beyond this limit long before its largest value: the first point is found there too.
    assert slides.max() > 0.25
    short = robot_of("planar-3-prr", {"actuator_length": {"max": 0.1}}, rb=1.0)
    back = table(case, [(0, 0, 0, 0, 0, 0), (0.1, 0.05, 0, 0, 0, 5), (0.1, 0.1, 0, 0, 0, -5), (0, 0, 0, 0, 0, 0)])
    faults = judge_path(short, back).faults
    ((name, _), fault), first = *faults.items(), int(np.argmax(slides > 0.1))
    assert name == "actuator_length limb 3"
    assert fault.place.segment == first // len(SAMPLES)
    assert fault.place.parameter == pytest.approx(SAMPLES[first % len(SAMPLES)], abs=SAMPLES[1])
    assert fault.value == pytest.approx(0.1, abs=1e-6)


@pytest.mark.parametrize("tolerance", [None, 1e-3])
def test_every_limit_of_a_case_is_a_claim(tolerance: float | None) -> None:
    tables = shipped_tables("hexapod-linuxcnc")
    tables["limits"] = {
        "leg_length": {"min": 17, "max": 43}, "actuator": {"stroke_max": 12, "dead_length": 10},
        "base_joint_angle": {"max": 60}, "platform_joint_angle": {"max": 80}, "rate_share": {"max": 0.9},
        "actuator_rate": {"max": 3}, "leg_clearance": {"min": 0.1}, "condition_number": {"max": 50, "length": 10},
        "smallest_singular_value": {"min": 0.01, "length": 10}, "footprint": {"base": 27, "platform": 12},
        "joint_spacing": {"min": 0.5}, "radius_ratio": {"min": 0.1, "max": 0.9}, "custom": ["p_x^2 + p_y*p_z <= 90"],
    }  # fmt: skip
    if tolerance:
        tables["tolerance"] = {"joint_centre": tolerance}
    judged = judge_path(case_from(tables), table(hexapod(), [HOME, (0.5, 0, 20.5, 0, 2, 0)]))
    expected = judge_workspace(judged.case, workspace=judged.case.workspace, time_limit=0, with_objective=False)
    limited = {(each.name, each.sense, each.limit) for each in expected.extremes if each.limit is not None}
    assert limited == {(each.name, each.sense, each.limit) for each in judged.extremes if each.limit is not None}
    assert {each[0].split()[0].partition(".")[0] for each in limited} >= {"leg_clearance", "actuator", "footprint"}


def test_the_command_writes_a_result_and_says_how_it_ended(cli: Run, tmp_path: Path) -> None:
    part, out = tmp_path / "part.ngc", tmp_path / "path.json"
    saved(part, f"G90 G0 X0 Y0 Z20 A0 B0 C0\n{TOUR}\n")
    shown = output_of(cli("path", "hexapod-linuxcnc", "--along", str(part), "--json", str(out)))
    assert "PROVED at every point" in shown
    result = json.loads(out.read_text())
    assert result["proved"]
    assert len(result["path"]["claims"]) == 19
    code, shown, _ = cli(
        "path", "hexapod-linuxcnc", "--along", str(part), "--set", "limits.leg_length.max=31.5", "--json", str(out)
    )
    assert code == 1
    assert "first violation line 3" in " ".join(shown.split())
    refuted = [each for each in json.loads(out.read_text())["path"]["claims"] if each["outcome"] == "refuted"]
    assert min(each["fault"]["line"] for each in refuted) == 3
    refusal_of(cli("path", "hexapod-linuxcnc", "--along", str(tmp_path / "none.ngc")), "none.ngc")
    saved(part, "F10 G1 X0 Y0 Z20 C0\nC100000000\nM2\n")
    refusal_of(
        cli("path", "hexapod-linuxcnc", "--along", str(part)), "part.ngc: line 2: angles change by 1e+08 degrees"
    )


@pytest.mark.parametrize("turn", [1e-8, 1e-6])
def test_a_turn_that_is_too_small_for_ranks_is_one_all_the_same(turn: float) -> None:
    """A Delta cannot turn, however little: a path that turns it stays open, and over a workspace its angle is 0."""
    tables = starter_tables("delta") | {"limits": {}}
    tables["robot"]["parameters"] |= {"rb": 0.164, "arm": 0.2, "rod": 0.9}
    case = case_from(tables)
    judged = judge_path(case, table(case, [(0, 0, -0.95, 0, 0, 0), (0.1, 0.01, -0.95, 0, 0, turn)]))
    assert not judged.is_proved
    position = [{"min": -0.05, "max": 0.05}, 0, {"min": -0.96, "max": -0.94}]
    for most in (turn, 0.1):
        turns = {"axis": [0, 0, 1], "angle": {"min": -most, "max": most}}
        case = case_from(tables | {"workspace": {"position": position, "rotation": turns}})
        found = judge_workspace(case, time_limit=1 if most == turn else 60, with_objective=False)
        # Bounds tell nothing as small as rounding.
        assert not found.is_refuted
        assert found.is_proved == (most == 0.1)
    for sense in Sense:
        assert 0 <= sense.sign * extreme(found, "angle", sense).bound <= math.radians(0.1)
