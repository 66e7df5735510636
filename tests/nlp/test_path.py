"""Files of paths: poses worked out by hand, geometry against closed forms, and one sentence for each fault."""

import math
import re
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from builders import Array
from hypothesis import given, settings
from hypothesis import strategies as st
from measures import exponential

from screwsynth.nlp import InputError, Units, read_path
from screwsynth.nlp.path.gcode import read_program
from screwsynth.nlp.path.options import Between, PathOptions
from screwsynth.nlp.path.path import Kind, ProgrammedPath
from screwsynth.nlp.path.poses_csv import read_poses

MM = Units("mm")
#: Begins where all axes are 0, so that each line makes a segment.
AT_ZERO = PathOptions(start=(0,) * 6)


def program(text: str, options: PathOptions = AT_ZERO, units: Units = MM) -> ProgrammedPath:
    return read_program(text.split("\n"), "part.ngc", units, options)


def motion(line: str, before: str = "G94 F600", options: PathOptions = AT_ZERO, units: Units = MM) -> ProgrammedPath:
    """The path of one line, after another one and before the end."""
    return program(f"{before}\n{line}\nM2", options, units)


EVERY_WORD = """\
%
(A program with every word) ; and two comments
N10 G21 G90 G94 G17 G40 G49 G80 G61 G91.1 G97 G98 S1000 T3 M6 F600
G0 X10 Y0 Z5
g1 x 2 0 a3 b+4. c00 M3 M8
A0 B0
G4 P1.5
G91 G00 Z-5
G90 G3 X0 Y20 I-20
G2 X20 Y0 R-20
G3 Z6 I-20 P2 C-90
G18 G2 X0 Z26 I-20
G19 G90.1 G3 Y-20 J-10 K26
G17 G91.1 G20 G1 X1 Y0 Z0 C0
G21 G93 X35.4 F2
G94 F1200
G10 L2 P2 X100 Y10
G55 X0 Y0
G92 X5 Z1
X10 Z0
G53 X0 Z0
G92.1
X0
G10 L20 P0 X-1
X0
G59.3 G64 P0.05 Q0.01 X1
/X500
G4 P0
M5 M9 M48 M60 G80
M30
X999
%
"""
PI = math.pi
#: Worked out by hand: line, end in machine coordinates, length and seconds.
EXPECTED = [
    (5, (20, 0, 5, 3, 4, 0), 10, 1),
    (6, (20, 0, 5, 0, 0, 0), 0, 0.5),
    (7, (20, 0, 5, 0, 0, 0), 0, 1.5),
    (8, (20, 0, 0, 0, 0, 0), 5, None),
    (9, (0, 20, 0, 0, 0, 0), 10 * PI, PI),
    (10, (20, 0, 0, 0, 0, 0), 30 * PI, 3 * PI),
    (11, (20, 0, 6, 0, 0, -90), math.hypot(80 * PI, 6), math.hypot(80 * PI, 6) / 10),
    (12, (0, 0, 26, 0, 0, -90), 10 * PI, PI),
    (13, (0, -20, 26, 0, 0, -90), 10 * PI, PI),
    (14, (25.4, 0, 0, 0, 0, 0), math.sqrt(1721.16), math.sqrt(1721.16) / 10),
    (15, (35.4, 0, 0, 0, 0, 0), 10, 30),
    (18, (100, 10, 0, 0, 0, 0), math.hypot(64.6, 10), math.hypot(64.6, 10) / 20),
    (20, (105, 10, -1, 0, 0, 0), math.hypot(5, 1), math.hypot(5, 1) / 20),
    (21, (0, 10, 0, 0, 0, 0), math.hypot(105, 1), math.hypot(105, 1) / 20),
    (23, (100, 10, 0, 0, 0, 0), 100, 5),
    (25, (101, 10, 0, 0, 0, 0), 1, 0.05),
    (26, (1, 10, 0, 0, 0, 0), 100, 5),
]
#: Positions in the middle of the arcs of some lines.
HALVES = {
    9: (20 / math.sqrt(2), 20 / math.sqrt(2), 0),
    10: (20 + 20 / math.sqrt(2), 20 + 20 / math.sqrt(2), 0),
    11: (20, 0, 3),
    12: (20 / math.sqrt(2), 0, 6 + 20 / math.sqrt(2)),
    13: (0, -10, 36),
}


def test_a_program_with_every_word_has_the_poses_worked_out_by_hand() -> None:
    path = program(EVERY_WORD, PathOptions())
    np.testing.assert_allclose(path.knots[0], (10, 0, 5, 0, 0, 0))
    assert path.lines.tolist() == [line for line, *_ in EXPECTED]
    for segment, (line, end, length, seconds) in zip(path, EXPECTED, strict=True):
        np.testing.assert_allclose(segment.end, [*end[:3], *np.radians(end[3:])], atol=1e-12, err_msg=f"line {line}")
        np.testing.assert_allclose(segment.pose_at(1).positions, end[:3], atol=1e-12, err_msg=f"line {line}")
        assert segment.length == pytest.approx(length, rel=1e-12), line
        assert segment.duration == (seconds and pytest.approx(seconds, rel=1e-12)), line
        if line in HALVES:
            assert segment.kind is Kind.ARC
            np.testing.assert_allclose(segment.pose_at(0.5).positions, HALVES[line], atol=1e-12, err_msg=f"line {line}")
    assert path[2].kind is Kind.DWELL
    assert [(idle.line, idle.word) for idle in path.idle] == [
        (3, "G61"), (3, "M6"), (3, "S1000"), (3, "T3"), (4, "motion before the path"), (5, "M3"), (5, "M8"),
        (26, "G64 P0.05 Q0.01"), (27, "/"), (29, "M48"), (29, "M5"), (29, "M60"), (29, "M9"), (30, "M30"),
    ]  # fmt: skip


def about(axis: Array, angle: float) -> Array:
    return exponential(np.array([*axis, 0, 0, 0]), angle)[:3, :3]


def elementary(axis: int, degrees: float) -> Array:
    return about(np.eye(3)[axis], math.radians(degrees))


def test_angles_are_those_of_the_convention() -> None:
    # Of A, B, C = 30, 45, 60 degrees by the formulas of LinuxCNC's kinematics of hexapods, row by row.
    cg, sg, cb, sb, ca_, sa = math.sqrt(3) / 2, 0.5, math.sqrt(0.5), math.sqrt(0.5), 0.5, math.sqrt(3) / 2
    hexapod = [
        [ca_ * cb, ca_ * sb * sg - sa * cg, ca_ * sb * cg + sa * sg],
        [sa * cb, sa * sb * sg + ca_ * cg, sa * sb * cg - ca_ * sg],
        [-sb, cb * sg, cb * cg],
    ]
    line = "G0 A30 B45 C60"
    np.testing.assert_allclose(motion(line)[0].pose_at(1).rotations, hexapod, atol=1e-15)
    x, y, z = elementary(0, 30), elementary(1, 45), elementary(2, 60)
    for name, product in {"zyx": z @ y @ x, "xyz": x @ y @ z, "yxz": y @ x @ z}.items():
        path = motion(line, options=PathOptions(start=(0,) * 6, angles=name))
        np.testing.assert_allclose(path[0].pose_at(1).rotations, product, atol=1e-15)


def test_slerp_is_one_turn_about_an_axis_and_angles_are_linear() -> None:
    for between in Between:
        options = PathOptions(start=(0, 0, 0, 20, 0, 0), between=between)
        pose = motion("G1 X4 A-10 B40 C170", options=options)[0].pose_at(0.25)
        first, last = elementary(0, 20), elementary(2, 170) @ elementary(1, 40) @ elementary(0, -10)
        expected = elementary(2, 42.5) @ elementary(1, 10) @ elementary(0, 12.5)
        if between is Between.SLERP:
            turn = last @ first.T
            angle = math.acos((np.trace(turn) - 1) / 2)
            axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
            expected = about(axis / np.linalg.norm(axis), angle / 4) @ first
        np.testing.assert_allclose(pose.positions, (1, 0, 0))
        np.testing.assert_allclose(pose.rotations, expected, atol=1e-14)


#: A mean radius of 5 about (1, 2), which grows by 0.004: the ends of a program with three decimals.
SPIRAL = "G3 X1 Y7.002 I-4.998 J0.0 Z3 A9"


@pytest.mark.parametrize("plane", [17, 18, 19])
@pytest.mark.parametrize("between", list(Between))
def test_expressions_are_the_numbers(plane: int, between: Between) -> None:
    names = {17: "XYZIJ", 18: "ZXYKI", 19: "YZXJK"}[plane]
    line = SPIRAL.translate({ord(old): new for old, new in zip("XYZIJ", names, strict=True)})
    start = [0.0] * 6
    start["XYZ".index(names[0])], start["XYZ".index(names[1])] = 5.998, 2
    path = motion(
        line + "\nG1 A-20 B30 X1", f"G94 F600 G{plane}", PathOptions(start=start, between=between, angles="xyz")
    )
    s = ca.SX.sym("s")
    assert sum(len(segments) for segments in path.shapes().values()) == len(path) == 2
    for segment in path:
        assert segment.shape in path.shapes()
        assert segment.numbers.shape == (segment.shape.size,)
        numbers = ca.SX.sym("numbers", segment.shape.size)
        once = ca.Function("once", [numbers, s], list(segment.shape.pose(numbers, s)))
        own = ca.Function("own", [s], list(segment.expressions(s)))
        for value in (0.0, 0.3, 1.0):
            pose = segment.pose_at(value)
            for found in (own(value), once(segment.numbers, value)):
                np.testing.assert_allclose(np.array(found[0])[:, 0], pose.positions, atol=1e-14)
                np.testing.assert_allclose(np.array(found[1]), pose.rotations, atol=1e-14)
            again = path.poses_at([segment.index] * 2, [value, value])
            np.testing.assert_array_equal(again.rotations[1], pose.rotations)


def test_a_radius_grows_linearly_between_ends_that_differ_by_rounding() -> None:
    segment = motion(SPIRAL, options=PathOptions(start=(5.998, 2, 0, 0, 0, 0)))[0]
    s = np.linspace(0, 1, 4001)
    points = segment.path.poses_at([0] * len(s), s).positions
    radii = np.hypot(*(points[:, :2] - [1, 2]).T)
    np.testing.assert_allclose(radii, 4.998 + 0.004 * s, rtol=1e-13)
    np.testing.assert_allclose(points[[0, -1]], [(5.998, 2, 0), (1, 7.002, 3)], atol=1e-13)
    ways = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert segment.length == pytest.approx(ways.sum(), rel=1e-7)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(-50, 50).map(lambda x: round(x, 3))] * 3),
    st.floats(1, 40),
    st.floats(-math.pi, math.pi),
    st.floats(0.01, 2 * math.pi - 0.01),
    st.booleans(),
    st.integers(1, 3),
)
def test_arcs_are_on_their_circles(
    centre: tuple[float, ...], radius: float, angle: float, sweep: float, is_clockwise: bool, turns: int
) -> None:
    x, y, z = centre
    turned = -sweep if is_clockwise else sweep
    first = (x + radius * math.cos(angle), y + radius * math.sin(angle))
    last = (x + radius * math.cos(angle + turned), y + radius * math.sin(angle + turned))
    options = PathOptions(start=(*first, z, 0, 0, 0))
    code = f"G{2 if is_clockwise else 3} X{last[0]:.15f} Y{last[1]:.15f} Z{z + 7:.15f} P{turns}"
    by_centre = motion(f"{code} I{x - first[0]:.15f} J{y - first[1]:.15f}", options=options)[0]
    by_radius = motion(f"{code} R{radius if sweep < math.pi else -radius:.15f}", options=options)[0]
    total = turned + math.copysign(2 * math.pi * (turns - 1), turned)
    for segment, error in ((by_centre, 1e-11), (by_radius, 1e-4)):
        assert segment.length == pytest.approx(math.hypot(radius * total, 7), rel=error)
        for s in (0.25, 0.5, 1):
            expected = (x + radius * math.cos(angle + s * total), y + radius * math.sin(angle + s * total), z + 7 * s)
            np.testing.assert_allclose(segment.pose_at(s).positions, expected, atol=100 * error)


NUMBER = st.decimals(-1000, 1000, places=3).map(str)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(*[NUMBER] * 6), min_size=2, max_size=8, unique=True), st.randoms(use_true_random=False))
def test_points_are_read_however_they_are_written(points: list[tuple[str, ...]], random: object) -> None:
    lines = []
    for number, point in enumerate(points):
        words = [f"{letter}{text}" for letter, text in zip("XYZABC", point, strict=True)]
        random.shuffle(words)  # type: ignore[attr-defined]
        text = random.choice(["", " ", "\t"]).join([random.choice(["G0", "g00", "G0.0"]), *words])  # type: ignore[attr-defined]
        lines.append(random.choice([text, text.lower(), f"N{number} {text}", f"{text} (X1)", f"{text};G1"]))  # type: ignore[attr-defined]
    path = program("\n".join([*lines, "M2"]), PathOptions())
    numbers = np.array([[float(text) for text in point] for point in points])
    np.testing.assert_array_equal(path.knots[:, :3], numbers[:, :3])
    np.testing.assert_array_equal(path.knots[:, 3:], np.radians(numbers[:, 3:]))


@pytest.mark.parametrize(
    ("unit", "line", "before", "x"),
    [
        ("m", "G0 X3", "G21", 0.003),
        ("in", "G0 X0.1", "G20", 0.1),
        ("in", "G0 X0.1", "F1", 0.1),
        ("cm", "G0 X1", "G20", 2.54),
        ("ft", "G0 X6", "G20", 0.5),
        ("mm", "G0 X1", "F1", 1),
    ],
)
def test_lengths_are_in_the_unit_of_the_case(unit: str, line: str, before: str, x: float) -> None:
    assert motion(line, before, units=Units(unit))[0].end[0] == x


def test_options_of_programs() -> None:
    inch = motion("G1 X1 F60", "G90", PathOptions(start=(0,) * 6, unit="in"))
    assert inch[0].end[0] == 25.4
    assert inch[0].duration == pytest.approx(1)
    moved = motion("G0 X1 B5", "G55", PathOptions(start=(0,) * 6, offsets={"G55": (10, 20, 30, 1, 2, 3)}))
    # A letter that is not on the line stays where it is.
    np.testing.assert_allclose(moved[0].end, [11, 0, 0, 0, math.radians(7), 0])
    assert len(motion("/G0 X1\nG0 X2", options=PathOptions(start=(0,) * 6, skips_deleted=False))) == 2
    for options, words in (
        ({"angles": "rpyy"}, "no such convention; did you mean 'rpy'"),
        ({"unit": "cm"}, "must be mm or in"),
        ({"offsets": {"G53": (0,) * 6}}, "no such coordinate system"),
        ({"start": (0, 0, math.nan, 0, 0, 0)}, "six finite numbers"),
    ):
        with pytest.raises(InputError, match=words):
            PathOptions(**options)  # type: ignore[arg-type]


#: A line that is refused, its word, and words of the sentence.
REFUSED = [
    ("X1", "X1", "active motion mode"),
    ("G1 X1", "G1", "needs a feed"),
    ("G94 F5\nG94\nG1 X1", "G1", "needs a feed"),
    ("F5 G93", "F5", "G93"),
    ("G93 G1 X1 F2\nX2", "G1", "an F on the same line"),
    ("G93 G0 X1 F2", "F2", "no G1, G2 or G3"),
    ("G95 F0.1", "G95", "spindle speed"),
    ("G1 X1 F-5", "F-5", "negative"),
    ("G0 X1 X2", "X2", "twice"),
    ("G0 G1 X1", "G1", "exclude each other"),
    ("G90 G91", "G91", "exclude each other"),
    ("M3 M4", "M4", "exclude each other"),
    ("G0 X1 G92", "G92", "conflicts with G0"),
    ("G92", "G92", "axis words"),
    ("G52 X1", "G52", "G92 and G92.1"),
    ("G92.3", "G92.3", "G92 and G92.1"),
    ("G10 L2 P10 X1", "G10", "1 to 9"),
    ("G10 L2 P1.5 X1", "G10", "1 to 9"),
    ("G10 L1 P1 X1", "G10", "L2 and L20"),
    ("G10 L2 P1", "G10", "axis words"),
    ("G10 L2 P1 X1 R5", "R5", "is not used by any code of the line"),
    ("G91 G53 G0 X1", "G53", "G90"),
    ("G53 G2 X1 R1 F1", "G53", "G0 or G1"),
    ("G53", "G53", "G0 or G1"),
    ("G80 X1", "G80", "axis words"),
    ("G0 X1\nG80 G92 X0\nX2", "X2", "active motion mode"),
    ("G4", "G4", "time"),
    ("G4 P-1", "G4", "time"),
    ("G1 F1 X1 P3", "P3", "is not used by any code of the line"),
    ("G0 X1 I3", "I3", "is not used by any code of the line"),
    ("G4 P1 G64", "P1", "two codes"),
    ("F1 G2 X1", "G2", "not both"),
    ("F1 G2 X1 I1 R1", "G2", "not both"),
    ("F1 G2 X1 K1", "K1", "plane of G17"),
    ("F1 G18 G2 X1 J1", "J1", "plane of G18"),
    ("F1 G90.1 G2 X1 I1", "G90.1", "both I and J"),
    ("F1 G2 X1 Y0 I0.4", "G2", "start and end of the arc are 0.4 and 0.6 from its centre"),
    ("F1 G3 X201 Y0 I100", "G3", "100 and 101 from its centre; these distances may differ by at most 0.101"),
    ("F1 G2 X1 I0", "G2", "centre of the arc coincides with its start or end"),
    ("F1 G2 X0 Y0 R1", "G2", "give I, J, K instead"),
    ("F1 G2 X2.1 Y0 R1", "G2", "2.1 apart, more than two radii of 1"),
    ("F1 G2 I1 P0", "P0", "number of turns"),
    ("F1 G2 I1 P1.5", "P1.5", "number of turns"),
    ("G20\nG21 F10", "G21", "changes the unit of F"),
    ("G41 D1", "G41", "cutter compensation"),
    ("G43 H1", "G43", "tool length"),
    ("G81 X1 Z-1 R1", "G81", "canned cycles"),
    ("G28", "G28", "stored positions"),
    ("G38.2 Z-1", "G38.2", "probing"),
    ("G5 X1 P1", "G5", "splines"),
    ("G12", "G12", "not supported"),
    ("M98 P100", "M98", "subroutines"),
    ("M66 P1", "M66", "not supported"),
    ("O100 sub", "O", "subroutines"),
    ("o<part> call", "O<PART>CALL", "subroutines"),
    ("G0 X[1+2]", "X[1+2]", "expressions"),
    ("#1=5", "#1=5", "variables"),
    ("G0 X#1", "X#1", "variables"),
    ("G0 X1.2.3", "X1.2.3", "is not a number"),
    ("G0 X--1", "X--1", "is not a number"),
    ("G0 X1e5", "E5", "exponents"),
    ("G0 X", "X", "has no number"),
    ("G0 U1", "U1", "axes U, V and W"),
    ("G0 X1 N5", "N", "beginning"),
    ("G0 (part", "(PART", "comment has no end"),
    ("G0 (a (b) c)", "(AC)", "comment has no end"),
    ("G0 @5 ^30", "@5^30", "polar"),
    ("%", "%", "only allowed alone on a line"),
    ("G0 /X1", "/", "beginning of a line"),
    ("\x00", "\\\\x00", "not a word of G-code"),
]


@pytest.mark.parametrize(("lines", "word", "words"), REFUSED)
def test_what_is_not_read_is_refused_with_its_line_and_word(lines: str, word: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        program(f"(part)\n{lines}\nM2")
    number = 2 + lines.count("\n")
    assert str(error.value).startswith(f"part.ngc: line {number}, {word.encode().decode('unicode_escape')}: ")
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "words", "options", "unit"),
    [
        ("G0 X1", "line 1: the program does not end with M2, M30 or %", AT_ZERO, "mm"),
        ("%\nG0 X1\n", "line 3: the program does not end with M2, M30 or %", AT_ZERO, "mm"),
        ("M2", "there is no path: the program makes no motion", AT_ZERO, "mm"),
        ("G0 X0\nX0 Y0\nM2", "there is no path: the start of Z is not known", PathOptions(), "mm"),
        ("G91 G0 X1\nM2", "line 1, G91: needs the present X", PathOptions(), "mm"),
        ("G92 Z1\nM2", "line 1, G92: needs the present Z", PathOptions(), "mm"),
        ("F1 G2 I1\nM2", "line 1, G2: needs the present X", PathOptions(), "mm"),
        ("G0 X1\nM2", "line 1: the unit of length is not known", AT_ZERO, "m"),
        ("G21 G0 X1\nM2", "unit of lengths, 'furlong', has no known length", AT_ZERO, "furlong"),
        (f"G0 Y1\nX{'9' * 40}\nM2", "line 2: must be finite and at most 1e+30 in magnitude", AT_ZERO, "mm"),
    ],
)
def test_programs_without_a_path_are_refused(text: str, words: str, options: PathOptions, unit: str) -> None:
    with pytest.raises(InputError, match=rf"^part.ngc: .*{re.escape(words)}"):
        program(text, options, Units(unit))


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.one_of(
            st.sampled_from(
                ["G0", "G1", "G2", "G3", "G4", "G10", "G53", "G91", "G92", "G93", "F9", "L2", "R", "\n", "M2"]
            ),
            st.tuples(st.sampled_from("XYZABCIJKRPFGMN"), st.integers(-3, 99)).map(lambda word: f"{word[0]}{word[1]}"),
            st.text(st.characters(max_codepoint=300), max_size=3),
        ),
        max_size=25,
    )
)
def test_any_text_is_a_path_or_one_sentence(words: list[str]) -> None:
    path, sentence = None, "part.ngc: no fault"
    try:
        path = program(" ".join(["G94 F5", *words, "\nM2"]))
    except InputError as error:
        sentence = str(error)
    assert re.fullmatch(r"part\.ngc: .+", sentence)
    if path is not None:
        assert np.isfinite(path.poses_at(range(len(path)), 0.5).positions).all()
        assert np.isfinite(path.lengths).all()


def table(text: str, options: PathOptions | None = None, units: Units = MM) -> ProgrammedPath:
    return read_poses(text, "way.csv", units, options or PathOptions())


def test_tables_of_poses_are_paths() -> None:
    path = table("yaw;x;y;z;roll;pitch;t\n0;0;0;0;0;0;1\n\n90;3;4;0;0;0;3\n90;3;4;0;0;0;3.5\n;3;4;1;;;4\n")
    np.testing.assert_allclose(path.knots[:, 5], np.radians([0, 90, 90, 0]))
    assert path.lines.tolist() == [4, 5, 6]
    assert path.kinds.tolist() == [Kind.LINE, Kind.DWELL, Kind.LINE]
    assert path.durations.tolist() == [2, 0.5, 0.5]
    # Degrees per second where the position stays.
    path = table("x,y,z,roll,pitch,yaw,feed\n0,0,0,0,0,0,1\n3,4,0,0,0,90,2\n3,4,0,0,0,90,2\n3,4,0,30,0,50,10\n")
    assert path.lines.tolist() == [3, 5]
    np.testing.assert_allclose(path.durations, [2.5, 5])
    assert table("x,y,z\n0,0,0\n1,0,0\n")[0].duration is None


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(*[st.sampled_from([-180, -90, -30, 0, 45, 90, 123.4])] * 3), min_size=2, max_size=5, unique=True)
)
def test_quaternions_and_axes_are_the_rotations_of_their_angles(angles: list[tuple[float, ...]]) -> None:
    rotations = [elementary(2, c) @ elementary(1, b) @ elementary(0, a) for a, b, c in angles]
    kinds = {"roll,pitch,yaw": angles, "qw,qx,qy,qz": [], "axis_x,axis_y,axis_z,angle": []}
    for roll, pitch, yaw in angles:
        q = ca.DM([1, 0, 0, 0])
        for axis, angle in ((0, roll), (1, pitch), (2, yaw)):
            half = math.radians(angle) / 2
            factor = np.cos(half), math.sin(half) * np.eye(3)[axis]
            q = ca.vertcat(
                factor[0] * q[0] - ca.dot(factor[1], q[1:]),
                factor[0] * q[1:] + q[0] * factor[1] + ca.cross(factor[1], q[1:]),
            )
        w, *v = np.array(q)[:, 0]
        kinds["qw,qx,qy,qz"].append((w, *v))
        axis = v if np.linalg.norm(v) > 0 else [0, 0, 1]
        kinds["axis_x,axis_y,axis_z,angle"].append((*axis, math.degrees(2 * math.atan2(np.linalg.norm(v), w))))
    for columns, rows in kinds.items():
        text = "\n".join(f"{k},0,0,{','.join(f'{number:.17g}' for number in row)}" for k, row in enumerate(rows))
        path = table(f"x,y,z,{columns}\n{text}\n")
        assert path.between is (Between.ANGLES if columns == "roll,pitch,yaw" else Between.SLERP)
        poses = path.poses_at([0, *range(len(path))], [0] + [1] * len(path))
        np.testing.assert_allclose(poses.rotations, rotations, atol=1e-14)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no rows"),
        ("x,y,t\n", "row 1: column z is missing"),
        ("x,y,z\n1,2,3\n", "fewer than two points"),
        ("x,y,z\n1,2,3\n1,2,3\n", "all points are the same pose"),
        ("x,y,z,a\n", "row 1: no such column, 'a'"),
        ("x,y,z,t,feed\n", "row 1: column 'feed' conflicts with 't'"),
        ("x,y,z,t\n1,2,3,0\n1,2,4,0\n", "row 3, column t = 0.0: must be later"),
        ("x,y,z,feed\n1,2,3,1\n1,2,4,0\n", "row 3, column feed = 0.0: must be positive"),
        ("x,y,z\n1,2,3\n1,2,nan\n", "row 3, column z = nan: must be finite"),
        ("x,y,z\n1,2,3\n1,2\n", "row 3: must have 3 cells, got 2"),
        ("x,y,z\n1,2,3\n1,,3\n", "row 3, column y: must be a number, got an empty cell"),
        ("x,y,z,qw,qx,qy,qz\n1,2,3,1,0,0,0\n1,2,3,1,1,0,0\n", "row 3, columns qw, qx, qy, qz: must be a unit"),
        ("x,y,z,axis_x,axis_y,axis_z,angle\n1,2,3,0,0,1,5\n1,2,3,0,0,0,5\n", "row 3, columns axis_x, axis_y, axis_z"),
    ],
)
def test_faults_of_tables_are_told_with_row_and_column(text: str, words: str) -> None:
    with pytest.raises(InputError, match=rf"^way.csv: {re.escape(words)}|^way.csv: there is no path: {words}"):
        table(text)


def test_files_are_read_by_their_names(tmp_path: Path) -> None:
    (tmp_path / "way.CSV").write_text("\ufeffx,y,z,angle\n0,0,0,0\n1,0,0,180\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"way.CSV: line 3: rotates by half a turn"):
        read_path(tmp_path / "way.CSV", MM)
    with pytest.raises(InputError, match='between = "angles" needs the columns roll, pitch and yaw'):
        read_path(tmp_path / "way.CSV", MM, PathOptions(between=Between.ANGLES))
    (tmp_path / "part.ngc").write_bytes("\ufeffG0 X1 Y1 Z1 (M\u00e4rz)\r\nX2 ;\u00b5\rM30\r\n".encode())
    assert read_path(tmp_path / "part.ngc", MM).lines.tolist() == [2]
    (tmp_path / "part.ngc").write_bytes(b"G0 X1 Y1 Z1\nX2 (\xff)\nM2")
    assert len(read_path(str(tmp_path / "part.ngc"), MM)) == 1
    with pytest.raises(InputError, match=r"none.ngc: cannot be read: No such file"):
        read_path(tmp_path / "none.ngc", MM)
