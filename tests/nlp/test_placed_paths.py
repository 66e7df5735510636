"""Paths whose frame is turned in the world: arcs in tilted planes, and angles that change linearly in the frame."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from decimal import Decimal, localcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, Run, case_file, case_from, output_of, saved, shipped_tables, starter_tables
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from measures import circle_joints
from path_cases import BASE, LEGS, PLATFORM, Floats, delta_angles, extreme, halved, hexapod, turns_of

from screwsynth.nlp import Case, Outcome, Sense, TurnKind, load_case
from screwsynth.nlp.path.options import Between
from screwsynth.nlp.path.orientation import ORDERS
from screwsynth.nlp.path.path import Kind, ProgrammedPath
from screwsynth.nlp.path.placing import placed
from screwsynth.nlp.path.reader import path_of_case
from screwsynth.nlp.proof.workspace.judgement import Judgement
from screwsynth.nlp.proof.workspace.path_domain import covered
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.proof.workspace.robot.long_turns import turns_of_path

Matrix = list[list[Decimal]]
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}
#: A quarter of a circle and a helix in tilted planes, a line with a turn, in inches; all motions have times.
PROGRAM = "G20\nG94 F60\nG1 X3 Y0 Z0\nG3 X0 Y3 I-3 Z1 B2\nG18 G2 X2 Z-1 R4 A-4 C10\nG1 X-2 Y1 A3 B-6\nM2\n"
#: The same without turns.
PLAIN = "G20\nG94 F60\nG1 X3 Y0 Z0\nG3 X0 Y3 I-3 Z1\nG18 G2 X2 Z-1 R4\nG1 X-2 Y1\nM2\n"
#: Rounding of 45 digits.
TINY = Decimal("1e-35")
ANGLES = st.just(0.0) | st.floats(-3, 3)


def about(axis: int, angle: Decimal) -> Matrix:
    """Rotation matrix about an axis, by power series."""
    found, term = [Decimal(0), Decimal(0)], Decimal(1)
    for k in range(150):
        found[k % 2] += term * (1, 1, -1, -1)[k % 4]
        term *= angle / (k + 1)
    R = [[Decimal(int(i == j)) for j in range(3)] for i in range(3)]
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[i][i], R[i][j], R[j][i], R[j][j] = found[0], -found[1], found[1], found[0]
    return R


def product(A: Matrix, B: Matrix) -> Matrix:
    return [[sum((A[i][k] * B[k][j] for k in range(3)), Decimal(0)) for j in range(3)] for i in range(3)]


def turned(angles: Sequence[float]) -> Matrix:
    roll, pitch, yaw = map(Decimal, angles)
    return product(product(about(2, yaw), about(1, pitch)), about(0, roll))


def moved(place: Sequence[float], point: Sequence[Decimal]) -> list[Decimal]:
    R = turned(place[3:])
    return [
        Decimal(t) + sum((a * b for a, b in zip(row, point, strict=True)), Decimal(0))
        for t, row in zip(place, R, strict=False)
    ]


def arc_of(numbers: Sequence[float], plane: int, heights: tuple[float, float], angles: Array) -> ProgrammedPath:
    """A path of one arc, that ends where its numbers say, and turns through angles (2, 3)."""
    first, second, radius, growth, angle, sweep = numbers
    knots = np.zeros((2, 6))
    for s in (0, 1):
        r, a = radius + s * growth, angle + s * sweep
        knots[s, list(PLANES[plane])] = first + r * math.cos(a), second + r * math.sin(a), heights[s]
    knots[:, 3:] = angles
    columns = np.array([3], dtype=np.int32), np.array([Kind.ARC], dtype=np.uint8), np.array([2.0])
    arcs = np.array([numbers]), np.array([plane], dtype=np.uint8)
    return ProgrammedPath("arc", knots, *columns, *arcs, ORDERS["rpy"], Between.ANGLES)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow], max_examples=60)
@given(
    st.tuples(*[st.just(0.0) | st.floats(-50, 50)] * 3, *[ANGLES] * 3),
    st.tuples(*[st.floats(-9, 9)] * 2, st.floats(0.1, 9), st.floats(-0.01, 0.01), st.floats(-3, 3), st.floats(-12, 12)),
    st.sampled_from(list(PLANES)),
    st.tuples(st.floats(-9, 9), st.floats(-9, 9)),
    st.lists(st.booleans(), max_size=50),
)
def test_boxes_hold_exact_positions_of_arcs_in_tilted_planes(
    place: Floats, arc: Floats, plane: int, heights: tuple[float, float], halves: list[bool]
) -> None:
    """Positions of 40 digits are in the boxes; these are no wider than the way, and rounding."""
    path = placed(arc_of(arc, plane, heights, np.zeros((2, 3))), place)
    cover = covered(path, 1.0)[0]
    low, high = halved(halves)
    lower, upper = (each[0].tolist() for each in cover.boxes(np.array([[0, low, high]])))
    slow, fast = (each[0].tolist() for each in cover.derivatives(np.array([[0, low, high]])))
    first, second, radius, growth, angle, sweep = map(Decimal, path.arcs[0].tolist())
    frame = [float(each) for each in place] if path.frame is not None else [0.0] * 6
    # A path without a frame has knots in the world.
    start, end = (path.knots[k, PLANES[plane][2]] for k in (0, 1))
    with localcontext() as context:
        context.prec = 45
        for part in (0.0, 0.3, 0.5, 0.9, 1.0):
            s = Decimal(low) + Decimal(part) * (Decimal(high) - Decimal(low))
            turn = about(2, angle + s * sweep)
            point, rate = [Decimal(0)] * 3, [Decimal(0)] * 3
            r = radius + s * growth
            own = first + r * turn[0][0], second + r * turn[1][0], Decimal(start) + s * (Decimal(end) - Decimal(start))
            speeds = (
                growth * turn[0][0] - r * sweep * turn[1][0],
                growth * turn[1][0] + r * sweep * turn[0][0],
                Decimal(end) - Decimal(start),
            )
            for axis, value, speed in zip(PLANES[plane], own, speeds, strict=True):
                point[axis], rate[axis] = value, speed
            exact, exact_rate = moved(frame, point), moved([0.0, 0.0, 0.0, *frame[3:]], rate)
            for i in range(3):
                assert Decimal(lower[i]) - TINY <= exact[i] <= Decimal(upper[i]) + TINY
                assert Decimal(slow[i]) - TINY <= exact_rate[i] <= Decimal(fast[i]) + TINY
    way = (high - low) * (abs(arc[5]) * (arc[2] + 0.01) + 0.01 + abs(heights[1] - heights[0]))
    assert max(b - a for a, b in zip(lower[:3], upper[:3], strict=True)) <= 2 * way + 1e-11


@settings(deadline=None, max_examples=60)
@given(
    st.tuples(*[st.just(0.0) | st.floats(-50, 50)] * 3, *[ANGLES] * 3),
    st.tuples(*[st.just(0.0) | st.floats(-9, 9)] * 6),
    st.lists(st.booleans(), max_size=50),
)
def test_boxes_hold_exact_positions_of_lines_with_turns(place: Floats, ends: Floats, halves: list[bool]) -> None:
    knots = np.array([[*ends[:3], 0, 0, 0], [*ends[3:], 0.4, -0.3, 0.2]])
    columns = np.array([3], dtype=np.int32), np.array([Kind.LINE], dtype=np.uint8), np.array([2.0])
    own = ProgrammedPath(
        "line", knots, *columns, np.empty((0, 6)), np.empty(0, np.uint8), ORDERS["rpy"], Between.ANGLES
    )
    path = placed(own, place)
    if path.frame is None:
        return
    low, high = halved(halves)
    cover = covered(path, 1.0)[0]
    lower, upper = (each[0].tolist() for each in cover.boxes(np.array([[0, low, high]])))
    slow, fast = (each[0].tolist() for each in cover.derivatives(np.array([[0, low, high]])))
    with localcontext() as context:
        context.prec = 45
        pairs = [(Decimal(a), Decimal(b)) for a, b in zip(ends[:3], ends[3:], strict=True)]
        rate = moved([0.0, 0.0, 0.0, *place[3:]], [b - a for a, b in pairs])
        for s in (low, high):
            exact = moved(place, [a + Decimal(s) * (b - a) for a, b in pairs])
            for i in range(3):
                assert Decimal(lower[i]) - TINY <= exact[i] <= Decimal(upper[i]) + TINY
                assert Decimal(slow[i]) - TINY <= rate[i] <= Decimal(fast[i]) + TINY


@settings(deadline=None, max_examples=60)
@given(st.tuples(*[ANGLES] * 3), st.tuples(*[ANGLES] * 3))
def test_a_path_that_does_not_turn_has_its_exact_roll_pitch_and_yaw(place: Floats, angles: Floats) -> None:
    """Tangents of half of roll, pitch and yaw, from the exact rotation matrix."""
    path = placed(arc_of((0.0, 0.0, 2.0, 0.0, 0.0, 1.0), 18, (0.0, 1.0), np.array([angles, angles])), (1, 2, 3, *place))
    turns = turns_of_path(path)
    if turns.kind is not TurnKind.ROLL_PITCH_YAW or path.frame is None:
        return
    lower, upper = (each[0].tolist() for each in turns.boxes(np.array([0]), np.array([[0.2, 0.6]])))
    with localcontext() as context:
        context.prec = 45
        if any(angles):
            R = product(turned(place), turned(angles))
            size = (R[2][1] ** 2 + R[2][2] ** 2).sqrt()
            exact = [R[2][1] / (size + R[2][2]), -R[2][0] / (1 + size), R[1][0] / (size + R[0][0])]
        else:
            halves = [about(0, Decimal(each) / 2) for each in place]
            exact = [each[2][1] / each[1][1] for each in halves]
        for low, r, high in zip(lower, exact, upper, strict=True):
            assert Decimal(low) - TINY <= r <= Decimal(high) + TINY
            assert high - low < 1e-9 * (1 + float(abs(r))) ** 2


def matrix(place: Sequence[float]) -> Array:
    return np.asarray(turns_of(np.array([place[3:]]))[0])


def case_at(folder: Path, text: str, place: Sequence[float], **keys: object) -> Case:
    """LinuxCNC's hexapod with a program in a place, angles in degrees."""
    saved(folder / "part.ngc", text)
    names = ("x", "y", "z", "roll", "pitch", "yaw")
    table = {"file": str(folder / "part.ngc"), "place": dict(zip(names, place, strict=True))}
    return hexapod(**keys, path=table)


def legs(own: ProgrammedPath, place: Sequence[float], count: int = 401) -> Array:
    """Lengths (N, 6) of the legs of LinuxCNC's hexapod at points of a path in its frame, from the joints alone."""
    k, s = np.repeat(np.arange(len(own)), count), np.tile(np.linspace(0, 1, count), len(own))
    poses, R = own.poses_at(k, s), matrix(place)
    tips = poses.positions[:, None] + np.einsum("nij,kj->nki", poses.rotations, PLATFORM)
    return np.asarray(np.linalg.norm(tips @ R.T + np.array(place[:3]) - BASE, axis=2))


def range_of(judged: Judgement, name: str) -> tuple[float, float]:
    low, high = (extreme(judged, name, sense).bound for sense in (Sense.MIN, Sense.MAX))
    return low, high


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (PROGRAM, (1.0, -2, 19, 12, 0, 0)),
        (PROGRAM, (0.5, 1, 20, 8, -15, 25)),
        (PROGRAM, (0.5, 1, 20, 0, 0, 110)),
        (
            PROGRAM.replace("A", "(").replace(" B2", "").replace(" (-4 C10", "").replace(" (3 B-6", ""),
            (0.0, 1, 19, 8, -15, 0),
        ),
    ],
)
def test_legs_along_a_placed_path_are_those_of_dense_samples(tmp_path: Path, text: str, place: Floats) -> None:
    case = case_at(tmp_path, text, place)
    path, own = path_of_case(case), path_of_case(case_at(tmp_path, text, (0.0,) * 6))
    assert path.frame is not None
    radians = (*place[:3], *np.radians(place[3:]))
    found = legs(own, radians)
    judged = judge_path(case, path)
    assert judged.ranks[0].outcome is Outcome.PROVED
    for k, name in enumerate(LEGS):
        low, high = range_of(judged, f"leg_length limb {name}")
        assert found[:, k].min() * (1 - 2e-3) <= low <= found[:, k].min() + 1e-9
        assert found[:, k].max() * (1 + 2e-3) >= high >= found[:, k].max() - 1e-9
    # Speeds are those of differences of lengths between samples; each segment has a time.
    sampled = np.abs(np.diff(found.reshape(len(own), -1, 6), axis=1)) / (own.durations[:, None, None] / 400)
    for k, name in enumerate(LEGS):
        speed = extreme(judged, f"actuator_speed actuator {name}", Sense.MAX).bound
        assert sampled[:, :, k].max() * (1 - 1e-6) <= speed <= sampled[:, :, k].max() * 1.01


def test_a_delta_follows_an_arc_in_a_tilted_plane(tmp_path: Path) -> None:
    """Cranks from the closed form of a Delta, whose platform does not turn: the program turns it back in its frame."""
    R = matrix((0, 0, 0, *np.radians([15, -10, 30]))).T
    back = np.degrees([math.atan2(R[2, 1], R[2, 2]), -math.asin(R[2, 0]), math.atan2(R[1, 0], R[0, 0])])
    words = " ".join(f"{letter}{angle:.12f}" for letter, angle in zip("ABC", back, strict=True))
    saved(tmp_path / "arc.ngc", f"G21\nG94 F60000\nG1 X200 Y0 Z0 {words}\nG3 X-200 Y0 Z50 I-200\nM2\n")
    tables = starter_tables("delta")
    tables["robot"]["parameters"]["rb"] = 0.164
    place = {"x": 0.02, "y": -0.03, "z": -1.1, "roll": 15, "pitch": -10, "yaw": 30}
    case = case_from(tables | {"limits": {}, "path": {"file": str(tmp_path / "arc.ngc"), "place": place}})
    path = path_of_case(case)
    assert path.frame is not None
    judged = judge_path(case, path)
    assert judged.is_proved, judged.ranks
    turn = np.linspace(0, math.pi, 4001)
    own = np.stack([0.2 * np.cos(turn), 0.2 * np.sin(turn), 0.05 * turn / math.pi], axis=1)
    p = own @ R + [0.02, -0.03, -1.1]
    for k, angles in enumerate(delta_angles(p).T):
        low, high = range_of(judged, f"actuator_angle limb {k + 1}")
        assert angles.min() - 2e-3 <= low <= angles.min() + 1e-9
        assert angles.max() + 2e-3 >= high >= angles.max() - 1e-9


def test_rolls_and_pitches_of_a_path_and_the_design_are_the_best_of_a_grid(cli: Run, tmp_path: Path) -> None:
    """The narrowest base has the largest F; roll and pitch of the path decide which base keeps the limits."""
    text = "G20\nG94 F60\nG1 X5 Y0 Z0\nG3 X0 Y5 Z1 I-5 B2\nG1 X-3 Y2 A3\nM2\n"
    free = {"min": -12.0, "max": 12.0, "start": 3.0}
    tables = shipped_tables("hexapod-linuxcnc")
    tables["robot"]["parameters"]["x1"] = {"min": 15, "max": 35}
    place = {"x": 1.0, "y": 1.0, "z": 19.0, "roll": free, "pitch": free}
    tables |= {"limits": {"over": "path", "leg_length": {"min": 21, "max": 30}}, "solve": {"starts": 3}}
    tables["path"] = {"file": str(saved(tmp_path / "part.ngc", text)), "place": place}
    case, out = case_file(tmp_path, tables), tmp_path / "out.json"
    output_of(cli("solve", str(case), "--json", str(out)))
    result = json.loads(out.read_text())
    assert result["path"]["proved"]
    own = path_of_case(load_case(str(case), {f"path.place.{name}": 0.0 for name in ("x", "y", "z", "roll", "pitch")}))
    radius, grid = np.linspace(15, 35, 161), np.linspace(-12, 12, 49)
    k, s = np.repeat(np.arange(len(own)), 41), np.tile(np.linspace(0, 1, 41), len(own))
    poses = own.poses_at(k, s)
    bases = [circle_joints({"x1": each, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)})[0] for each in radius]

    def kept(roll: float, pitch: float) -> Array:
        R = matrix((0, 0, 0, *np.radians([roll, pitch, 0])))
        tips = (poses.positions[:, None] + np.einsum("nij,kj->nki", poses.rotations, PLATFORM)) @ R.T + [1, 1, 19]
        lengths = np.linalg.norm(tips[None] - np.array(bases)[:, None], axis=3)
        return np.asarray((lengths.min(axis=(1, 2)) >= 21) & (lengths.max(axis=(1, 2)) <= 30))

    every = np.array([[kept(roll, pitch) for pitch in grid] for roll in grid])
    home = np.array([0, 0, 20]) + PLATFORM
    at_home = np.array([np.linalg.norm(home - base, axis=1)[0] for base in bases])
    every &= (at_home >= 21) & (at_home <= 30)
    best = int(np.argmax(every.any(axis=(0, 1))))
    untilted = int(np.argmax(every[24, 24])) if every[24, 24].any() else len(radius)
    assert best < untilted
    # The grid has steps of half a degree, and the solve none.
    assert radius[best] * (1 - 2e-2) < result["parameters"]["x1"] < radius[best] * (1 + 5e-3)
    assert kept_design(result, poses.positions, poses.rotations)
    output_of(cli("path", str(case), "--of", str(out)))


def kept_design(result: dict[str, Any], positions: Array, rotations: Array) -> bool:
    """Return whether the design of a result keeps its limits at the samples, in the place of the result."""
    base, _ = circle_joints({"x1": result["parameters"]["x1"], "x2": 11.543, "x3": 0.0, "x4": math.radians(5)})
    place = result["path"]["place"]
    R = matrix((0, 0, 0, *np.radians([place["roll"], place["pitch"], 0])))
    tips = (positions[:, None] + np.einsum("nij,kj->nki", rotations, PLATFORM)) @ R.T + [1, 1, 19]
    lengths = np.linalg.norm(tips - base, axis=2)
    return bool(lengths.min() >= 21 - 1e-6 and lengths.max() <= 30 + 1e-6)


def test_rows_of_actuators_have_poses_in_the_world(cli: Run, tmp_path: Path) -> None:
    """A table with a proved distance along arcs in tilted planes; its poses are those of the frame's motion."""
    place = (0.0, 1.0, 19.0, 8.0, -15.0, 5.0)
    table = dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), place, strict=True))
    tables = shipped_tables("hexapod-linuxcnc") | {"limits": {}}
    for text, is_proved in ((PLAIN, True), (PROGRAM, False)):
        saved(tmp_path / "part.ngc", text)
        tables["path"] = {"file": str(tmp_path / "part.ngc"), "place": table}
        case, rows = case_file(tmp_path, tables), tmp_path / "rows.csv"
        code, shown, error = cli("path", str(case), "--csv", str(rows), "--within", "0.02")
        assert (code == 0) == is_proved, (shown, error)
        head, *lines = rows.read_text().splitlines()
        values = np.array([[float(each or "nan") for each in line.split(",")] for line in lines])
        names = head.split(",")
        k, s = values[:, names.index("segment")].astype(int), values[:, names.index("parameter")]
        own = path_of_case(load_case(str(case), {f"path.place.{name}": 0.0 for name in table}))
        poses, R = own.poses_at(k, s), matrix((0, 0, 0, *np.radians(place[3:])))
        first = names.index("x")
        assert values[:, first : first + 3] == pytest.approx(poses.positions @ R.T + place[:3], abs=1e-9)
        for row, rotation in zip(values[::7], poses.rotations[::7], strict=True):
            assert matrix((0, 0, 0, *np.radians(row[first + 3 : first + 6]))) == pytest.approx(R @ rotation, abs=1e-9)


def test_a_limit_is_refuted_on_a_placed_arc_at_the_first_line_beyond_it(tmp_path: Path) -> None:
    place = (0.5, 1, 20, 8, -15, 25)
    own = path_of_case(case_at(tmp_path, PROGRAM, (0.0,) * 6))
    found = legs(own, (*place[:3], *np.radians(place[3:])), 4001).max(axis=1).reshape(len(own), -1)
    most = 0.5 * (found.max() + found[1, 0])
    segment = int(np.argmax((found > most).any(axis=1)))
    parameter = float(np.argmax(found[segment] > most)) / 4000
    case = case_at(tmp_path, PROGRAM, place, limits={"leg_length": {"max": float(most)}})
    judged = judge_path(case, path_of_case(case))
    faults = [each.place for each in judged.faults.values()]
    faults += [each.place for each in judged.extremes if each.outcome is Outcome.REFUTED and each.place is not None]
    assert min(faults) == pytest.approx((segment, parameter), abs=1e-3)
