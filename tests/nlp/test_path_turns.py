"""Rotations of paths, of which ranges are held against exact ones, in 40 digits, and machines against dense samples."""

import itertools
import json
import math
from dataclasses import replace
from decimal import Decimal, localcontext
from pathlib import Path

import numpy as np
import pytest
from builders import Array, Run, commands_in, output_of, refusal_of, saved, soaked, turn_about
from hypothesis import example, given, settings
from hypothesis import strategies as st
from path_cases import Floats, hexapod, leg_lengths, program, robot_of, table

from screwsynth.nlp import Case, InputError, Load, Loading, Outcome, ProgrammedPath, TurnKind
from screwsynth.nlp.path.frame import PathFrame
from screwsynth.nlp.path.options import Between, PathOptions
from screwsynth.nlp.path.orientation import ORDERS
from screwsynth.nlp.path.poses_csv import read_poses
from screwsynth.nlp.proof.workspace import path_domain
from screwsynth.nlp.proof.workspace.judgement import Judgement
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.proof.workspace.robot.long_turns import LongTurns, turns_of_path
from screwsynth.nlp.proof.workspace.robot.path_turns import LinearAngles, PathTurns, Tangents
from screwsynth.nlp.proof.workspace.robot.pose_box import UNTURNED

Quaternion = list[Decimal]
SAMPLES = np.linspace(0, 1, 2001)


def cosine_sine(angle: Decimal) -> tuple[Decimal, Decimal]:
    """Cosine and sine by their power series."""
    found, term = [Decimal(0), Decimal(0)], Decimal(1)
    for k in range(60):
        found[k % 2] += term * (1, 1, -1, -1)[k % 4]
        term *= angle / (k + 1)
    return found[0], found[1]


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    return [
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ]


def of_angles(angles: list[Decimal], order: str) -> Quaternion:
    """The quaternion of three angles about x, y and z, the factors from left to right."""
    found = [Decimal(1), Decimal(0), Decimal(0), Decimal(0)]
    for axis in order:
        factor = [Decimal(0)] * 4
        factor[0], factor["xyz".index(axis) + 1] = cosine_sine(angles["xyz".index(axis)] / 2)
        found = product(found, factor)
    return found


def middle(p: Quaternion, q: Quaternion) -> Quaternion:
    """The rotation half way between two, by the smaller turn."""
    sign = 1 if sum(a * b for a, b in zip(p, q, strict=True)) > 0 else -1
    both = [a + sign * b for a, b in zip(p, q, strict=True)]
    size = sum(a * a for a in both).sqrt()
    return [a / size for a in both]


def vector(q: Quaternion, turns: PathTurns, divisor: int | None) -> Quaternion:
    """The Cayley vector of a rotation relative to the reference, or its quaternion with one component 1."""
    if divisor is not None:
        return [a / q[divisor] for a in q]
    w, x, y, z = map(Decimal, turns.reference)
    relative = product(q, [w, -x, -y, -z])
    return [a / relative[0] for a in relative[1:]]


def path_of(knots: Array, order: str = "rpy", between: Between = Between.ANGLES, place: Floats = ()) -> ProgrammedPath:
    """A path that turns through angles (n, 3), radians, in a frame turned by roll, pitch and yaw."""
    count = len(knots) - 1
    moved = np.hstack([np.arange(count + 1.0)[:, None], np.zeros((count + 1, 2)), knots])
    numbers = np.arange(count, dtype=np.int32), np.zeros(count, dtype=np.uint8), np.full(count, np.nan)
    arcs = np.empty((0, 6)), np.empty(0, dtype=np.uint8)
    frame = PathFrame(np.zeros(3), np.array(place)) if place else None
    return ProgrammedPath("way", moved, *numbers, *arcs, ORDERS[order], between, frame=frame)


CLOSE = st.tuples(*[st.floats(-2.0, 2.0)] * 3) | st.tuples(*[st.floats(-20.0, 20.0)] * 3)


@settings(deadline=None)
@given(
    CLOSE,
    CLOSE,
    st.sampled_from(["slerp", "xyz", "xzy", "yxz", "yzx", "zxy", "rpy"]),
    st.just(()) | st.tuples(*[st.just(0.0) | st.floats(-2.5, 2.5)] * 3),
    st.integers(0, 50),
    st.data(),
)
@example((-0.05, 0.8, -0.05), (0.05, 0.8, 0.06), "xyz", (), 0, None)
@example((0.0, 0.0, 3.0), (0.0, 0.0, 5.5), "rpy", (), 3, None)
@example((0.0, 0.0, 3.0), (0.0, 0.0, 35.0), "rpy", (), 7, None)
@example((0.0, 0.3, 3.0), (19.0, -0.2, 7.0), "rpy", (), 9, None)
@example((0.0, 0.3, 3.0), (19.0, -0.2, 7.0), "slerp", (), 1, None)
@example((1.0, 0.5, -0.3), (1.0, 0.5, -0.3), "slerp", (), 2, None)
@example((1.0, 0.5, -0.3), (1.0 + 1e-9, 0.5, -0.3), "slerp", (), 40, None)
@example((0.1, 0.5, -0.3), (0.2, -0.4, 0.3), "rpy", (0.3, -0.7, 1.2), 50, None)
@example((0.1, 0.5, -0.3), (0.2, -0.4, 0.3), "slerp", (0.3, -0.7, 1.2), 50, None)
@example((0.4, 0.0, 0.0), (-0.3, 0.0, 0.0), "rpy", (0.9, 0.0, 0.0), 3, None)
@example((0.0, 0.3, 3.0), (19.0, -0.2, 7.0), "rpy", (0.0, 0.5, 0.0), 9, None)
def test_ranges_hold_exact_rotations(
    start: Floats,
    end: Floats,
    how: str,
    place: Floats,
    halvings: int,
    data: st.DataObject | None,
) -> None:
    if place and start == end:  # another rule; see test_placed_paths
        return
    between, order = (Between.SLERP, "rpy") if how == "slerp" else (Between.ANGLES, how)
    turns = turns_of_path(path_of(np.array([start, end]), order, between, place))
    halves = data.draw(st.lists(st.booleans(), min_size=halvings, max_size=halvings)) if data else [True] * halvings
    names = "zyx" if order == "rpy" else order
    with localcontext() as context:
        context.prec = 40
        ends = [[Decimal(a) for a in angles] for angles in (start, end)]
        frame = of_angles([Decimal(a) for a in place or (0.0, 0.0, 0.0)], "zyx")
        first, last = (product(frame, of_angles(each, names)) for each in ends)
        at, up = [0.0, 1.0], [first, last]
        for is_upper in halves:
            half = 0.5 * (at[0] + at[1])
            turned = middle(*up)
            at, up = ([half, at[1]], [turned, up[1]]) if is_upper else ([at[0], half], [up[0], turned])
        width = float(np.abs(np.subtract(end, start)).sum()) * (at[1] - at[0])
        points = np.linspace(*at, 1 + 2 * math.ceil(max(width / 0.25, 1))).tolist()
        lower, upper = (each[0] for each in turns.boxes(np.array([0]), np.array([at])))
        divisor = None if turns.counts is None else int(np.argmax((lower == 1) & (upper == 1)))
        count = 1 if turns.counts is None else int(turns.counts[0])
        has_parts = math.floor(at[0] * count) < math.ceil(at[1] * count) - 1
        if not np.isfinite(upper - lower).all():
            # No divisor is far from 0 in a range of several parts.
            assert has_parts
            return
        if between is Between.SLERP:
            exact = [vector(q, turns, divisor) for q in (up[0], middle(*up), up[1])]
        else:
            angles = [[a + Decimal(s) * (b - a) for a, b in zip(*ends, strict=True)] for s in points]
            exact = [vector(product(frame, of_angles(each, names)), turns, divisor) for each in angles]
            if turns.kind is TurnKind.ROLL_PITCH_YAW:
                pairs = [[cosine_sine(a / 2) for a in each] for each in angles]
                exact = [[sine / cosine for cosine, sine in each] for each in pairs]
        for each in exact:
            for a, r, b in zip(lower.tolist(), each, upper.tolist(), strict=True):
                assert Decimal(a) <= r <= Decimal(b)
        if has_parts:
            return
        # No range is much wider than the way between its points, but for a chord's error and rounding.
        spread = [max(column) - min(column) for column in zip(*exact, strict=True)]
        size = 1 + float(max(abs(a) for each in exact for a in each))
        room = size**3 * (4e-12 + 0.32 * min(width, 0.25) ** 2)
        assert (upper - lower <= np.array(spread, dtype=float) + room).all()
        assert between is Between.ANGLES or (upper - lower <= np.array(spread, dtype=float) + 1e-11 * size**2).all()


@pytest.mark.parametrize("between", Between)
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("is_placed", [False, True])
def test_a_turn_about_one_axis_leaves_others_exactly_zero(between: Between, axis: int, *, is_placed: bool) -> None:
    knots = np.zeros((4, 3))
    knots[:, axis] = 0.1, 0.7, -0.4, 1.2
    place = tuple(0.5 * (k == axis) for k in range(3)) if is_placed else ()
    turns = turns_of_path(path_of(knots, "xyz", between, place))
    for each in turns.boxes(np.arange(3), np.array([[0, 0.3], [0.1, 1], [0, 1]])):
        assert (np.delete(each, axis, axis=1) == 0).all()
        assert (each[:, axis] != 0).all()


def test_one_reference_is_near_all_rotations_of_a_path() -> None:
    def reference(knots: list[Floats], **how: object) -> tuple[int, ...]:
        return turns_of_path(path_of(np.radians(knots), **how)).reference

    assert isinstance(turns_of_path(path_of(np.radians([(0, 0, 0), (140, -140, 140)]))), Tangents)
    assert reference([(0, 0, 60), (0, 80, 0)], order="xyz") == UNTURNED
    # Upside down, a half turn about x; and all but a whole turn, of which the middle is half a turn about z.
    assert reference([(180, 0, 0), (181, 3, -2)]) in {(0, 1, 0, 0), (0, -1, 0, 0)}
    w, *xy, z = reference([(0, 0, 40), (0, 0, 320)])
    assert xy == [0, 0]
    assert 2 * math.degrees(math.atan2(z, w)) == pytest.approx(180, abs=10)
    # The smaller turn goes the other way round.
    assert reference([(0, 0, 40), (0, 0, 320)], between=Between.SLERP) == UNTURNED
    # On from one triple of angles to the next, to 270 degrees.
    w, *xy, z = reference([(0, 0, 0), (0, 0, 120), (0, 0, -120), (0, 0, -90)], between=Between.SLERP)
    assert 2 * math.degrees(math.atan2(z, w)) % 360 == pytest.approx(135, abs=10)
    # By a third of a turn each time: three of them turn too far, two do not.
    third = [(0, 0, 0), (0, 0, 120), (0, 0, 240), (0, 0, 360)]
    assert reference(third[:3], between=Between.SLERP) != UNTURNED
    for between in Between:
        turns = turns_of_path(path_of(np.radians(third), between=between))
        assert isinstance(turns, LongTurns)
        # Roll and pitch stay 0: the quaternion is (1, 0, 0, z), or (w, 0, 0, 1).
        assert set(turns.divisors) == {0, 3}
        for each in turns.boxes(np.arange(3), np.tile([0.1, 0.2], (3, 1))):
            assert (each[:, 1:3] == 0).all()
            assert (each == 1).any(axis=1).all()
    with pytest.raises(InputError, match=r"line 0: angles change by 1e\+08 degrees in total, mostly on this line"):
        reference([(0, 0, 0), (0, 0, 1e8)])


@pytest.mark.parametrize("place", [(), (0.5, -0.8, 2.0), (0.0, 1.1, 0.0)])
@pytest.mark.parametrize("between", Between)
@pytest.mark.parametrize("order", ["rpy", "xzy"])
def test_velocities_hold_those_of_small_turns(between: Between, order: str, place: Floats) -> None:
    rng = np.random.default_rng(3)
    near = rng.uniform(-0.8, 0.8, (40, 3))
    for knots in (near, near + np.arange(40)[:, None] * [0.0, 0.3, 1.9]):
        path = path_of(knots, order, between, place)
        turns = turns_of_path(path)
        assert isinstance(turns, LongTurns) == (knots is not near)
        if isinstance(turns, Tangents):
            continue
        k, low, step = rng.integers(0, 39, 4000), rng.uniform(0, 0.9, 4000), 1e-4
        ends = np.stack([low, low + rng.uniform(step, 0.1, 4000)], axis=1)
        slow, fast = turns.derivatives(k, ends)
        at = ends[:, 0] + rng.random(4000) * (ends[:, 1] - ends[:, 0] - step)
        first, last = (path.poses_at(k, each).rotations for each in (at, at + step))
        turn = last @ first.transpose(0, 2, 1)
        mean = np.stack([turn[:, i, j] - turn[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1) / (2 * step)
        assert ((slow - 1e-5 <= mean) & (mean <= fast + 1e-5)).all()
        assert np.median((fast - slow) / np.abs(mean).max(axis=1, keepdims=True)) < 0.2


def about(axis: Array, angles: Array) -> Array:
    return np.array([turn_about(axis, angle) for angle in angles])


def angled(start: Array, end: Array, order: str) -> tuple[Array, Array]:
    """Positions and rotations at the samples between two rows of x, y, z and three angles that change linearly."""
    points = start + SAMPLES[:, None] * (end - start)
    A, B, C = (about(np.eye(3)[k], points[:, 3 + k]) for k in map("xyz".index, order))
    return points[:, :3], A @ B @ C


def turned(start: Array, end: Array) -> tuple[Array, Array]:
    """Positions and rotations at the samples between two rows of x, y, z and a turn from the first to the second."""
    first, last = (angled(each, each, "zyx")[1][0] for each in (start, end))
    turn = last @ first.T
    angle = math.acos((np.trace(turn) - 1) / 2)
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (2 * math.sin(angle))
    return start[:3] + SAMPLES[:, None] * (end - start)[:3], about(axis, SAMPLES * angle) @ first


WAY = np.array([(0, 0, 20, 0, 0, 0), (2, 1, 21, 12, -8, 20), (-1, 2, 19, -15, 10, -25.0)])
#: The same about half a turn about x of the platform, with the plates inside out.
OVER = WAY + np.array([0, 0, 0, 170, 0, 0])


@pytest.mark.parametrize(("how", "rows"), [("slerp", WAY), ("xyz", WAY), ("yzx", WAY), ("rpy", OVER), ("slerp", OVER)])
def test_legs_are_those_of_dense_samples(how: str, rows: Array) -> None:
    case = hexapod()
    path = table(case, rows, between=Between.SLERP) if how == "slerp" else lines(case, rows, how)
    judged = judge_path(case, path)
    radians = np.hstack([rows[:, :3], np.radians(rows[:, 3:])])
    pairs = list(itertools.pairwise(radians))
    order = "zyx" if how == "rpy" else how
    sampled = np.concatenate(
        [leg_lengths(*(turned(*each) if how == "slerp" else angled(*each, order))) for each in pairs]
    )
    found = [each for each in judged.extremes if each.name.startswith("leg_length limb")]
    assert len(found) == 12
    for k, each in enumerate(found):
        end = each.sense.sign * (each.sense.sign * sampled[:, k // 2]).max()
        assert each.sense.sign * (each.bound - end) > -1e-9
        assert each.bound == pytest.approx(end, rel=2e-3)
        here = leg_lengths(each.pose.position[None], each.pose.rotation[None])[0, k // 2]
        assert here == pytest.approx(each.reached, rel=1e-12)
        s = each.place.parameter
        near = sampled[each.place.segment * len(SAMPLES) + round(s * 2000), k // 2]
        assert near == pytest.approx(each.reached, abs=0.05)


def lines(case: Case, rows: Array, order: str) -> ProgrammedPath:
    words = [" ".join(f"{x}{value!r}" for x, value in zip("XYZABC", row, strict=True)) for row in rows.tolist()]
    return program(case, "\n".join(["F60", *(f"G1 {each}" for each in words), "M2"]), angles=order)


def outcomes(judged: Judgement) -> list[tuple[str, Outcome]]:
    return [(each.name, each.outcome) for each in (*judged.ranks, *judged.extremes)]


@pytest.mark.parametrize("longest", soaked([33.0, 36.0], [33.0]))
def test_both_rules_of_roll_pitch_and_yaw_agree(longest: float, monkeypatch: pytest.MonkeyPatch) -> None:
    case = replace(hexapod({"min": 17, "max": longest}), loading=Loading((Load("cut", (3.0, 1.0, -9.0)),)))
    path = replace(table(case, WAY), durations=np.array([4.0, 3.0]))
    own = judge_path(case, path)
    general = LinearAngles(path.knots[:, 3:], path.order, UNTURNED)
    monkeypatch.setattr(path_domain, "turns_of_path", lambda _: general)
    other = judge_path(case, path)
    assert outcomes(own) == outcomes(other)
    assert own.is_proved == (longest == 36.0)
    for claim, fault in own.faults.items():
        same = other.faults[claim]
        assert same.place.segment == fault.place.segment
        assert same.place.parameter == pytest.approx(fault.place.parameter, abs=1e-9)
    assert len(own.extremes) == 12 + 6 * (1 + 2 + 2)
    for one, also in zip(own.extremes, other.extremes, strict=True):
        assert one.reached == pytest.approx(also.reached, rel=2e-3, abs=1e-3)


def test_every_number_is_the_same_in_all_coordinates(monkeypatch: pytest.MonkeyPatch) -> None:
    limits = {"base_joint_angle": {"max": 60}, "platform_joint_angle": {"max": 80}}
    case = hexapod(limits=limits, load=[{"name": "push", "force": [1, 2, -10]}])
    # Where yaw alone varies, both motions are the same.
    path = table(case, np.array([(0, 0, 20, 0, 0, -20), (1, 1, 21, 0, 0, 25.0)]))
    judged = []
    for turns in (
        turns_of_path(path),
        turns_of_path(replace(path, between=Between.SLERP)),
        LinearAngles(path.knots[:, 3:], path.order, (8, 1, -2, 3)),
    ):
        monkeypatch.setattr(path_domain, "turns_of_path", lambda _, turns=turns: turns)
        judged.append(judge_path(case, path))
    own, *others = judged
    assert len(own.extremes) == 36
    for other in others:
        assert outcomes(own) == outcomes(other)
        reached, bounds = (
            [[getattr(each, name) for each in found.extremes] for found in (own, other)]
            for name in ("reached", "bound")
        )
        np.testing.assert_allclose(*reached, rtol=5e-3)
        # Bounds within limits are as wide as boxes are.
        is_free = np.array([each.limit is None for each in own.extremes])
        np.testing.assert_allclose(*np.array(bounds)[:, is_free], rtol=2e-2)


@pytest.mark.parametrize("between", Between)
def test_a_singular_pose_is_crossed_or_touched_by_turns(between: Between) -> None:
    # The octahedral platform is singular where it is turned by a right angle.
    case = hexapod()
    crossed, touched = (
        judge_path(case, table(case, [(0, 0, 20, 0, 0, yaw) for yaw in yaws], between=between)).ranks[0]
        for yaws in ((70, 110), (60, 90, 80))
    )
    assert crossed.outcome is touched.outcome is Outcome.REFUTED
    assert crossed.place.parameter == pytest.approx(0.5, abs=1e-9)
    assert math.degrees(touched.pose.angle) == pytest.approx(90, abs=1e-5)


def test_a_planar_robot_turns_by_slerp() -> None:
    case = robot_of("planar-3-rpr", rb=1.0)
    text = "x,y,z,qw,qx,qy,qz\n0,0,0,1,0,0,0\n0.1,0.05,0,0.96,0,0,0.28\n0,0.1,0,0.8,0,0,0.6"
    path = read_poses(text, "q.csv", case.units, PathOptions())
    assert path.between is Between.SLERP
    judged = judge_path(case, path)
    assert {each.outcome for each in judged.ranks} == {Outcome.PROVED}


def test_the_command_takes_motions_and_conventions(cli: Run, tmp_path: Path) -> None:
    rows = tmp_path / "poses.csv"
    saved(rows, "x,y,z,qw,qx,qy,qz\n0,0,20,1,0,0,0\n1,0,21,0.96,0.28,0,0\n0,1,20,0.96,0.168,0.224,0\n")
    out = tmp_path / "path.json"
    command = ["path", "hexapod-linuxcnc", "--along", str(rows), "--json", str(out)]
    output_of(cli(*command))
    assert json.loads(out.read_text())["proved"]
    # The pose that refutes a limit is beyond it where it is evaluated.
    code, shown, _ = cli(*command, "--set", "limits.leg_length.max=33")
    assert code == 1
    (words,) = commands_in(shown, "see it with")
    assert words[0] == "evaluate"
    assert "violated: leg_length limb" in cli(*words)[1]
    part = tmp_path / "part.ngc"
    saved(part, "G1 F10 X0 Y0 Z20 A0 B0 C0\nG1 A20 B20 C20\nM2\n")
    command[3] = str(part)
    longest = {}
    for options in ((), ("--angles", "zyx"), ("--angles", "xyz"), ("--between", "slerp")):
        output_of(cli(*command, *options))
        claims = json.loads(out.read_text())["path"]["claims"]
        longest[options] = max(each["reached"] for each in claims if each.get("sense") == "max")
    assert longest[()] == longest["--angles", "zyx"]
    assert len(set(longest.values())) == 3
    refusal_of(cli(*command, "--between", "lines"), "--between lines: must be angles or slerp")
    refusal_of(cli(*command, "--angles", "xyx"), "angles = 'xyx'")
    command[3] = str(rows)
    refusal_of(cli(*command, "--angles", "xyz"), "poses.csv: angles = 'xyz': is only for G-code")
