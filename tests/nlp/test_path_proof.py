"""Proofs along paths: enclosures of poses beside exact ones, what the checker accepts, and that it rejects the rest."""

import math
from collections.abc import Sequence
from dataclasses import replace
from decimal import Decimal, localcontext
from functools import cache, reduce
from pathlib import Path

import numpy as np
import pytest
from builders import Run, case_from, edited, output_of, refusal_of, saved, starter_tables
from path_cases import extreme, hexapod, leg_lengths, program, robot_of, table

from screwsynth.nlp import Case, Outcome, ProgrammedPath, Sense
from screwsynth.nlp.path.arcs import PLANES
from screwsynth.nlp.path.options import Between, PathOptions
from screwsynth.nlp.path.orientation import ORDERS
from screwsynth.nlp.path.path import Kind
from screwsynth.nlp.path.placing import placed
from screwsynth.nlp.path.reader import path_of_text
from screwsynth.nlp.proof.checker.check import fingerprint
from screwsynth.nlp.proof.checker.polynomials import middles
from screwsynth.nlp.proof.checker.proof_file import Proof, ProofClaim, ProofError, Unproved, read_proof
from screwsynth.nlp.proof.checker.tree import Node, node_bytes
from screwsynth.nlp.proof.checker.workspace.check import VerifiedWorkspace, check_path_proof
from screwsynth.nlp.proof.checker.workspace.closed_loops import ClosedBoxes
from screwsynth.nlp.proof.checker.workspace.loop_claims import posed_loops
from screwsynth.nlp.proof.checker.workspace.path_poses import PathPoses
from screwsynth.nlp.proof.checker.workspace.path_premises import carried_path, premises_of
from screwsynth.nlp.proof.checker.workspace.path_root import PathRoot
from screwsynth.nlp.proof.checker.workspace.statement import expected_along_path, robot_along_path
from screwsynth.nlp.proof.statement.posed_layout import extreme_program
from screwsynth.nlp.proof.workspace.judgement import Judgement
from screwsynth.nlp.proof.workspace.path_judge import judge_path
from screwsynth.nlp.proof.workspace.path_proof_writer import path_proof_of
from screwsynth.nlp.proof.workspace.proof_record import ProofRecord

Numbers = list[Decimal]
#: Arcs in all three planes, a spiral, a helix with whole turns, a dwell, a rapid motion and turns.
PROGRAM = (
    "G20 G90 G94\nF100\nG0 X0 Y0 Z20 A0 B0 C0\nG1 X1 Y0 Z20 A5 C3\nG2 X3 Y0 Z20 I1.0005 J0\n"
    "G3 X3 Y1 Z22 I0 J.5 P2 A20 B10 C30\nG4 P1\nG18 G2 X5 Y1 Z22 I1 K0\nG19 G3 X5 Y2 Z21 J0 K-1 A-3\nG1 X4 B-5\nM2"
)
ROWS = [(1, 2, 20, 0, 0, 0), (2, 2, 21, 10, 5, 0), (2, 3, 21, 100, 5, 130), (2, 3, 21, 100, 5, 130)]
FRAME = [1.0, -2.0, 0.5, 0.3, -0.2, 0.5]
PATHS: dict[str, ProgrammedPath] = {
    "tangents": program(hexapod(), PROGRAM),
    "angles": program(hexapod(), PROGRAM, angles="yxz"),
    "turns": table(hexapod(), ROWS[:3], between=Between.SLERP),
    "stands": table(hexapod(), ROWS, [0, 1, 2, 3], between=Between.SLERP),
    "framed angles": placed(program(hexapod(), PROGRAM, angles="xyz"), FRAME),
    "framed turns": placed(replace(program(hexapod(), PROGRAM), between=Between.SLERP), FRAME),
}


def sine(x: Decimal) -> Decimal:
    term, total, k = x, x, 1
    while abs(term) > Decimal("1e-45"):
        term *= -x * x / ((k + 1) * (k + 2))
        total, k = total + term, k + 2
    return total


def cosine(x: Decimal) -> Decimal:
    return 1 - 2 * sine(x / 2) ** 2


def product(left: Sequence[Decimal], right: Sequence[Decimal]) -> Numbers:
    (a, b, c, d), (e, f, g, h) = left, right
    return [
        a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
    ]  # fmt: skip


def quaternion(angles: Sequence[Decimal], order: Sequence[int]) -> Numbers:
    every = []
    for axis in order:
        each = [cosine(angles[axis] / 2), Decimal(0), Decimal(0), Decimal(0)]
        each[1 + axis] = sine(angles[axis] / 2)
        every.append(each)
    return reduce(product, every)


def exactly(values: Sequence[float] | np.ndarray) -> Numbers:
    return [Decimal(float(each)) for each in values]


def exact_pose(path: ProgrammedPath, k: int, s: Decimal, *, is_tangents: bool) -> Numbers:
    """The coordinates of a pose as the checker has them, with 50 digits."""
    start, end = exactly(path.knots[k]), exactly(path.knots[k + 1])
    point = [a + s * (b - a) for a, b in zip(start, end, strict=True)]
    if path.kinds[k] == Kind.ARC:
        arc, plane = path.arc_of(k)
        first, second, radius, growth, angle, sweep = exactly(arc)
        one, other, _ = PLANES[plane]
        size, turned = radius + s * growth, angle + s * sweep
        point[one], point[other] = first + size * cosine(turned), second + size * sine(turned)
    if is_tangents:
        return point[:3] + [sine(each / 2) / cosine(each / 2) for each in point[3:]]
    turn = quaternion(point[3:], path.order)
    if path.between is Between.SLERP:
        q_0, q_1 = quaternion(start[3:], path.order), quaternion(end[3:], path.order)
        dot = sum(a * b for a, b in zip(q_0, q_1, strict=True))
        q_1, dot = ([-each for each in q_1], -dot) if dot < 0 else (q_1, dot)
        half = Decimal(math.acos(min(float(dot), 1.0))) + Decimal("1e-12")
        for _ in range(60 if q_0 != q_1 else 0):
            half += (cosine(half) - dot) / sine(half)
        parts = ((1 - s) * half, s * half)
        weights = [sine(each) / half for each in parts] if q_0 != q_1 else [1 - s, s]
        turn = [weights[0] * a + weights[1] * b for a, b in zip(q_0, q_1, strict=True)]
    if path.frame is not None:
        place = quaternion(exactly(path.frame.angles), ORDERS["rpy"])
        back = [place[0], *(-each for each in place[1:])]
        moved = product(product(place, [Decimal(0), *point[:3]]), back)[1:]
        point[:3] = [a + b for a, b in zip(moved, exactly(path.frame.origin), strict=True)]
        turn = product(place, turn)
    return [*point[:3], *turn]


@pytest.mark.parametrize("name", PATHS)
def test_every_pose_of_a_piece_is_in_its_enclosure(name: str) -> None:
    """Beside exact poses, and slopes beside their differences; at the ends of arcs the knots are in it too."""
    path = PATHS[name]
    poses, rng, count = PathPoses(path), np.random.default_rng(1), 24
    k = rng.integers(0, len(path), count)
    s = np.sort(rng.uniform(0, 1, (count, 2)), axis=1)
    s[:, 1] = s[:, 0] + (s[:, 1] - s[:, 0]) * rng.uniform(0, 1, count) ** 4
    s[:4], s[4] = (0, 1), s[4, 0]
    lower, upper = k + s[:, 0], k + s[:, 1]
    values, slopes = poses.over(lower, upper)
    centre, radius = middles(lower - k, upper - k)
    step = Decimal("1e-20")
    with localcontext(prec=50):
        for j in range(count):
            for part in (-1.0, -0.3, 1.0):
                at = Decimal(float(np.clip(centre[j] + part * radius[j], lower[j] - k[j], upper[j] - k[j])))
                e = (at - Decimal(centre[j])) / Decimal(radius[j]) if radius[j] else Decimal(0)
                here, after = (
                    exact_pose(path, int(k[j]), each, is_tangents=poses.is_tangents) for each in (at, at + step)
                )
                for index, value, slope in zip(poses.varying, values, slopes, strict=True):
                    rate = (after[index] - here[index]) / step
                    for number, exact, room in ((value, here[index], 0), (slope, rate, 1e-15)):
                        a, b, c = exactly(number.P[:, j])
                        off = abs(exact - (a + b * e + c * e * e))
                        assert off <= Decimal(number.s[j] + room * (1 + abs(float(exact))))
                        assert number.V[0, j] - room <= exact <= number.V[1, j] + room
                fixed = set(range(len(here))) - set(poses.varying)
                assert all(abs(here[index] - Decimal(poses.constant[index])) < Decimal("1e-40") for index in fixed)
    small = upper - lower < 1e-3
    assert small.any()
    assert max(float(each.s[small].max()) for each in values) < 1e-2 * 1e-3
    for row in np.flatnonzero(path.kinds == Kind.ARC) if path.frame is None else ():
        ends = [poses.over(row + np.array([a]), row + np.array([b])) for a, b in ((0.0, 1e-9), (1 - 1e-9, 1.0))]
        for knot, (found, _) in zip(path.knots[row : row + 2], ends, strict=True):
            for index, each in zip(poses.varying[:3], found, strict=False):
                assert each.V[0, 0] <= knot[index] <= each.V[1, 0]


def test_a_piece_is_of_one_segment() -> None:
    values, _ = PathPoses(PATHS["tangents"]).over(np.array([0.5, 1.0]), np.array([1.5, 2.0]))
    assert [bool(np.isnan(each)) for each in values[0].s] == [True, False]


TIMED = "x,y,z,roll,pitch,yaw,t\n0,0,20,0,0,0,0\n1,0.5,20.5,2,0,3,2\n0.5,1,21,2,4,3,3\n0.5,1,21,2,4,3,4\n"
LIMITS = {
    "leg_length": {"min": 17, "max": 43}, "actuator": {"stroke_max": 12, "dead_length": 10},
    "base_joint_angle": {"max": 60}, "actuator_speed": {"max": 2.5}, "leg_clearance": {"min": 0.05},
    "smallest_singular_value": {"min": 0.1, "length": 11.5}, "condition_number": {"max": 12, "length": 11.5},
}  # fmt: skip
LOAD = [{"name": "push", "force": [1, 2, -10]}]


def written(
    case: Case, text: str = TIMED, file: str = "part.csv", options: PathOptions | None = None, gap: float = 0.02
) -> tuple[Judgement, Proof]:
    """The judgement of a case along a path, and its proof."""
    record, options = ProofRecord(), options or PathOptions()
    path = path_of_text(text, file, case.units, options)
    judged = judge_path(case, path, gap=gap, record=record)
    premises = premises_of(case, file, text, options, of_case=False)
    return judged, path_proof_of(case, judged, record, "", premises)


def verified(proof: Proof, case: Case) -> VerifiedWorkspace:
    return check_path_proof(proof, case, carried_path(case, proof.premises))  # type: ignore[arg-type]


def rejected(proof: Proof, case: Case) -> str:
    with pytest.raises(ProofError) as error:
        verified(proof, case)
    return str(error.value)


@cache
def machine() -> Case:
    return hexapod(limits=LIMITS, load=LOAD)


@pytest.fixture(scope="module")
def both() -> tuple[Judgement, Proof]:
    return written(machine())


@pytest.fixture(scope="module")
def proof(both: tuple[Judgement, Proof]) -> Proof:
    return both[1]


def test_a_proof_along_a_timed_path_holds(both: tuple[Judgement, Proof]) -> None:
    judged, proof = both
    # Legs meet in pairs at the base.
    assert [each.reason for each in proof.unproved if each.name.startswith("leg_clearance")] == ["refuted"] * 3
    assert len(proof.unproved) == 3
    again = read_proof(proof.as_text(), "again")
    checked = verified(again, machine())
    assert len(checked.claims) == len(proof.claims)
    bounds = {(each.name, each.sense): each for each in checked.claims}
    kinds = {name.split()[0].partition(".")[0] for name, _ in bounds}
    assert kinds >= {*LIMITS, "regular", "actuator_force", "actuator_power"}
    for each in judged.extremes:
        found = bounds.get((each.name, each.sense.value))
        if found is not None and found.bound is not None:
            assert each.sense.sign * (found.bound - each.reached) >= -1e-9 * abs(each.reached)
            assert found.limit == each.limit
    assert checked.leaves <= checked.pieces


def with_claim(proof: Proof, name: str, sense: str, **changes: object) -> Proof:
    """The proof with another tree, bound, sides or reason of one claim."""
    assert any((each.name, each.sense) == (name, sense) for each in proof.claims)
    return replace(
        proof,
        claims=tuple(
            replace(each, **changes) if (each.name, each.sense) == (name, sense) else each  # type: ignore[arg-type]
            for each in proof.claims
        ),
    )


def alone(proof: Proof, name: str, sense: str) -> Proof:
    """The proof with one claim alone; the others are said to have none."""
    rest = [Unproved(each.name, each.sense, "") for each in proof.claims if (each.name, each.sense) != (name, sense)]
    kept = tuple(each for each in proof.claims if (each.name, each.sense) == (name, sense))
    assert kept
    return replace(proof, claims=kept, unproved=(*proof.unproved, *rest))


#: Claims of several kinds, with the power of the number that a proof bounds.
SHARPER = [
    ("leg_length limb 1-", "max", 2), ("leg_length limb 2+", "min", 2), ("leg_clearance limbs 1- and 2+", "min", 1),
    ("smallest_singular_value", "min", 1), ("condition_number", "max", 1), ("actuator_speed actuator 2-", "max", 1),
    ("actuator_force actuator 1- load push", "max", 1), ("actuator_power actuator 1+ load push", "max", 1),
]  # fmt: skip


@pytest.mark.parametrize(("name", "sense", "power"), SHARPER)
def test_a_bound_beyond_a_value_on_the_path_is_rejected(
    both: tuple[Judgement, Proof], name: str, sense: str, power: int
) -> None:
    """It is 0.1 % beyond a value that the search reached."""
    judged, proof = both
    value = extreme(judged, name, Sense(sense)).reached ** power
    bound = value - Sense(sense).sign * 1e-3 * abs(value)
    given, least = alone(proof, name, sense), bytes([Node.BOUNDED] * 3)
    moved = with_claim(given, name, sense, bound=bound, tree=least, packed=None)
    assert "could not be proved on segment" in rejected(moved, machine())


def test_bounds_of_lengths_are_as_sharp_as_dense_samples(proof: Proof) -> None:
    """Without the tree of a search: 1e-6 beyond the samples they hold, and 1e-6 on this side they are rejected."""
    path, s = carried_path(machine(), proof.premises), np.linspace(0, 1, 20_001)  # type: ignore[arg-type]
    lengths = np.concatenate([leg_lengths(*path.poses_at([k] * len(s), s)) for k in range(len(path))])
    for sense, value in ((Sense.MAX, lengths[:, 0].max()), (Sense.MIN, lengths[:, 0].min())):
        given = alone(proof, "leg_length limb 1-", sense.value)
        bounds = [(value * (1 + sense.sign * part)) ** 2 for part in (1e-6, -1e-6)]
        wider, sharper = (
            with_claim(given, "leg_length limb 1-", sense.value, bound=each, tree=bytes([6] * 3), packed=None)
            for each in bounds
        )
        assert verified(wider, machine()).claims
        assert "could not be proved" in rejected(sharper, machine())


def test_a_bound_beyond_the_limit_is_rejected(proof: Proof) -> None:
    given = with_claim(alone(proof, "leg_length limb 1-", "max"), "leg_length limb 1-", "max", bound=44.0**2)
    assert "of the proof does not satisfy the limit" in rejected(given, machine())


@pytest.mark.parametrize(
    ("tree", "words"),
    [
        (b"", "ends before every box"),
        (bytes([Node.BOUNDED] * 2), "ends before every box"),
        (bytes([Node.BOUNDED] * 4), "additional data after its last box"),
        (bytes([Node.BOUNDED] * 2 + [Node.OUTSIDE]), "a node OUTSIDE where only HALF, CUT or BOUNDED is allowed"),
        (node_bytes(Node.HALF, 1) + bytes([Node.BOUNDED] * 4), "variable 1, which does not exist"),
        (node_bytes(Node.CUT, 0, value=1.5) + bytes([Node.BOUNDED] * 4), "cuts a box at 1.5, a value outside this box"),
        (node_bytes(Node.CUT, 0, value=math.nan) + bytes([Node.BOUNDED] * 4), "cuts a box at nan"),
    ],
)
def test_other_trees_are_rejected(proof: Proof, tree: bytes, words: str) -> None:
    """There are three segments; a tree of less, or with other nodes, is none."""
    given = alone(proof, "regular", "")
    assert words in rejected(with_claim(given, "regular", "", tree=tree, packed=None), machine())
    verified(with_claim(given, "regular", "", tree=bytes([Node.BOUNDED] * 3), packed=None), machine())


def test_other_paths_are_rejected(proof: Proof) -> None:
    """What the file carries is what is shown: a longer way, a faster one, fewer segments, and other joint centres."""
    premises = proof.premises
    speeds, lengths = (alone(proof, f"{each} 3+", "max") for each in ("actuator_speed actuator", "leg_length limb"))

    def carrying(given: Proof, **changes: object) -> Proof:
        return replace(given, premises=replace(premises, **changes))  # type: ignore[type-var, arg-type]

    assert "on segment 3, for parameters" in rejected(
        carrying(lengths, text=edited(TIMED, ("4,3,4", "4,30,4"))), machine()
    )
    assert "on segment 2, for parameters" in rejected(
        carrying(speeds, text=edited(TIMED, ("4,3,3", "4,3,2.02"))), machine()
    )
    rows = TIMED.splitlines()
    swapped = "\n".join([*rows[:2], rows[3].replace(",3,3", ",3,0.1"), rows[2], rows[4]])
    assert "on segment 1, for parameters" in rejected(carrying(speeds, text=swapped), machine())
    assert "additional data after its last box" in rejected(carrying(lengths, text="\n".join(rows[:-1])), machine())
    assert "other joint centres" in rejected(carrying(lengths, legs=()), machine())
    assert "another joint-centre tolerance" in rejected(carrying(lengths, joint_centre=0.1), machine())
    assert "cannot be read" in rejected(carrying(lengths, text="x,y\n1,2"), machine())
    assert "this case has no table [path]" in rejected(carrying(lengths, of_case=True), machine())
    slower = edited(TIMED, ("3,2\n", "3,1.5\n"))
    assert verified(carrying(lengths, text=slower), machine()).claims


def test_claims_of_another_case_or_left_out_are_rejected(proof: Proof) -> None:
    fewer = hexapod(limits=LIMITS | {"leg_length": {"max": 43}}, load=LOAD)
    assert "does not satisfy" in rejected(proof, hexapod(limits=LIMITS | {"leg_length": {"max": 30}}, load=LOAD))
    assert "each claim of its case exactly once" in rejected(proof, hexapod(limits=LIMITS))
    assert "each claim of its case exactly once" in rejected(replace(proof, unproved=proof.unproved[1:]), machine())
    assert verified(alone(proof, "leg_length limb 1-", "max"), fewer).claims
    assert "the proof has no claims" in rejected(replace(proof, claims=()), machine())


#: A circle by eight turns, whose eighths all end at one point.
EIGHT_TURNS = "G90 G94\nF60\nG0 X4 Y0 Z20 A0 B0 C0\nG3 X4 Y0 I-4 J0 P8\nM2"


def test_a_tree_of_a_program_proves_nothing_of_a_path() -> None:
    """Its box holds places of the path and not all poses: legs are longer elsewhere on this circle."""
    case, label = hexapod({"max": 32}), ("leg_length limb 1-", "max")
    path = path_of_text(EIGHT_TURNS, "part.ngc", case.units, PathOptions(unit="in"))
    robot = robot_along_path(case, PathRoot(case, path), with_angles=True)
    expected = {each.label: each for each in expected_along_path(case, robot, is_timed=True)}
    nlp = extreme_program(robot.layout, expected.pop(label).expression, Sense.MAX)
    claim = ProofClaim(*label, "program", 32.0**2, fingerprint(nlp), bytes([Node.BOUNDED]))
    premises = premises_of(case, "part.ngc", EIGHT_TURNS, PathOptions(unit="in"), of_case=False)
    others = tuple(Unproved(*each, "") for each in expected)
    proof = Proof("", case.name, premises, (claim,), (), others)
    assert leg_lengths(*path.poses_at([0] * 99, np.linspace(0, 1, 99))).max() > 32.8
    assert "a claim of this kind cannot be proved by the reason 'program' along a tool path" in rejected(proof, case)


@pytest.mark.parametrize("turns", [1, 8, 16, 41])
def test_whole_turns_that_the_robot_cannot_make_are_rejected(turns: int) -> None:
    """x and y follow from the others, although the circle begins and ends where they are meant to be."""
    tables = starter_tables("3-rps") | {"limits": {}, "units": {"length": "m"}}
    tables["robot"]["parameters"] |= {"rb": 1.0}
    case = case_from(tables)
    text = f"G0 Z1080 A2 B-3\nG1 Z1100 A0 B-1\nG3 X0 Y0 I-50 J0 P{turns}\nG1 Z1120 A-2 B1\nM2"
    path = path_of_text(f"G90 G94 F600 G21\nG0 X0 Y0 C0\n{text}", "part.ngc", case.units, PathOptions())
    with pytest.raises(ProofError, match="the path changes x and y, but this robot cannot choose"):
        PathRoot(case, path)


def test_a_singular_pose_of_a_path_is_proved_by_two_places() -> None:
    """A turn about z by more than a right angle."""
    text = "x,y,z,roll,pitch,yaw\n0,0,20,0,0,10\n1,0.5,20,0,0,110\n1,0,20,0,0,115\n"
    case = hexapod()
    judged, proof = written(case, text)
    assert judged.ranks[0].outcome is Outcome.REFUTED
    assert judged.ranks[0].place is not None
    given = alone(proof, "regular", "")
    assert verified(given, case).claims[0].is_refuted
    (low,), (high,) = given.claims[0].sides
    assert low < judged.ranks[0].place.parameter < high
    for sides, words in (
        (((0.0,), (0.1,)), "opposite signs"),
        (((low,), (2.5,)), "a pose that the proof states is outside the workspace"),
        (((low,),), "must state two poses"),
        (((low,), (high, 0.0)), "for robots within a joint-centre tolerance, but the case has no tolerance"),
        (((low,), (1.5,)), "changes continuously"),
    ):
        assert words in rejected(with_claim(given, "regular", "", sides=sides), case)
    tree = bytes([Node.BOUNDED] * 2)
    assert "could not be proved" in rejected(with_claim(given, "regular", "", reason="regular", tree=tree), case)


#: Robots whose loops are followed, with few and with all coordinates, and a path; seconds make speeds claims too.
FOLLOWED = {
    "crank": (
        "planar-3-rrr",
        "x,y,yaw,t",
        [(0.0, 0.0, 0, 0), (0.06, -0.05, 4, 1)],
        "actuator_angle limb 2",
        {"rb": 1.0},
    ),
    "dependent": (
        "3-rps",
        "z,roll,pitch,t",
        [(1.08, 2, -3, 0), (1.12, -2, 1, 1)],
        "actuator_length limb 1",
        {"rb": 1.0},
    ),
}


@pytest.mark.parametrize("name", FOLLOWED)
def test_a_proof_of_a_robot_with_loops_holds(name: str) -> None:
    robot, header, rows, number, fixed = FOLLOWED[name]
    case = robot_of(robot, {}, **fixed)
    columns = header.split(",")
    names = ("x", "y", "z", "roll", "pitch", "yaw", "t")
    cells = [[row[columns.index(each)] if each in columns else 0 for each in names] for row in rows]
    text = "\n".join(",".join(map(str, row)) for row in [names, *cells])
    judged, proof = written(case, text, gap=0.05)
    assert judged.is_proved
    assert not proof.unproved
    checked = verified(proof, case)
    assert {each.name for each in checked.claims} >= {"regular", "constraints regular", "actuator_speed actuator 1"}
    speed = alone(proof, "actuator_speed actuator 1", "max")
    (claim,) = speed.claims
    assert claim.bound is not None
    moved = with_claim(speed, claim.name, claim.sense, bound=0.8 * claim.bound)
    assert "could not be proved" in rejected(moved, case)
    assert number in {each.name for each in checked.claims}


def test_a_way_out_of_reach_is_rejected() -> None:
    """The loops do not close at its second point."""
    case, text = robot_of("planar-3-rrr", {}, rb=1.0), "x,y,z\n0,0,0\n0.6,0,0\n0,0,0\n"
    options, names = PathOptions(), ("regular", "constraints regular")
    path = path_of_text(text, "part.csv", case.units, options)
    robot = robot_along_path(case, PathRoot(case, path), with_angles=True)
    others = tuple(
        Unproved(*each.label, "") for each in expected_along_path(case, robot, is_timed=False) if each.name not in names
    )
    claims = tuple(ProofClaim(each, "", "regular", tree=bytes([Node.BOUNDED] * 2)) for each in names)
    premises = premises_of(case, "part.csv", text, options, of_case=False)
    assert "could not be proved" in rejected(Proof("", case.name, premises, claims, (), others), case)


def test_pieces_of_other_assemblies_are_rejected() -> None:
    case = robot_of("planar-3-rrr", {}, rb=1.0)
    path = table(case, [(0, 0, 0, 0, 0, 0), (0.06, -0.05, 0, 0, 0, 4), (0, 0.05, 0, 0, 0, 0)])
    root = PathRoot(case, path)
    loops = posed_loops(case, case.model, root)
    ends = np.linspace(0, 2, 65)
    closed = loops.assembly.enclosed(ends[:-1, None], ends[1:, None])
    assert closed.is_known.all()
    boxes = closed.boxes(closed.is_known)
    loops.assembly.refuse_apart(boxes)
    for row in (0, 20, 64 - 1):
        lower, upper = boxes.lower.copy(), boxes.upper.copy()
        lower[row, 1:] += 0.5
        upper[row, 1:] += 0.5
        with pytest.raises(ProofError, match="one assembly"):
            loops.assembly.refuse_apart(ClosedBoxes(lower, upper, boxes.near))
    keep = np.arange(64) != 30
    with pytest.raises(ProofError, match="one assembly"):
        loops.assembly.refuse_apart(ClosedBoxes(*(each[keep] for each in boxes)))


def test_the_commands_write_and_verify(cli: Run, tmp_path: Path) -> None:
    part, out = (
        saved(tmp_path / "part.ngc", "G90 G94\nF60\nG1 X0 Y0 Z20 A0 B0 C0\nG0 X1\nG2 X2 Y1 I1\nM2"),
        tmp_path / "proof.json",
    )
    words = ["path", "hexapod-linuxcnc", "--along", str(part), "--unit", "in", "--gap", "0.05", "--proof", str(out)]
    output_of(cli(*words))
    shown = output_of(cli("verify-proof", str(out)))
    assert "PROOF VALID: 19 of 19 claims about the path" in shown
    assert "case and path read from the proof file" in " ".join(shown.split())
    untimed = "1 of 2 segments has no time: speeds and powers there count as 0"
    assert untimed in " ".join(shown.split())
    own = ["verify-proof", str(out), "hexapod-linuxcnc", "--along", str(part)]
    shown = output_of(cli(*own, "--unit", "in", "--all"))
    assert "from the proof file" not in shown
    assert "2 segments, 1 of them arc" in " ".join(shown.split())
    assert " ".join(shown.split()).count(untimed) == 1
    assert "path read from the proof file" in " ".join(output_of(cli(*own[:3])).split())
    code, _, said = cli(*own)
    assert (code, "another value of --unit" in said) == (1, True)
    saved(part, "G90 G94\nF60\nG1 X0 Y0 Z20 A0 B0 C0\nX1.1\nM2")
    code, _, said = cli(*own, "--unit", "in")
    assert (code, "another tool path than that in" in said) == (1, True)
    refusal_of(cli("verify-proof", str(out), "--unit", "in"), "--along: is missing")
    refusal_of(
        cli("verify-proof", str(out), "--leg-error", "0.1"), "--leg-error", "does not apply to this kind of proof"
    )
    refusal_of(cli("path", "hexapod-linuxcnc", "--range", "--proof", str(out)), "--proof", "conflicts with --range")


def test_a_path_of_a_case_is_held_to_its_file(cli: Run, tmp_path: Path) -> None:
    text = 'robot.model = "stewart-gough"\nrobot.layout = "octahedral"\n'
    text += "robot.parameters = { x1 = 26.5, x2 = 11.5, x3 = 1, x4 = 5 }\n"
    text += '[units]\nlength = "in"\n[pose]\nposition = [0, 0, 20]\n'
    text += '[[task]]\nname = "up"\nsense = "max"\naxis = [0, 0, 1]\npitch = inf\n'
    text += '[path]\nfile = "poses.csv"\nplace = { yaw = 20, x = 0.5 }\n'
    case, poses = saved(tmp_path / "case.toml", text), saved(tmp_path / "poses.csv", "x,y,z\n0,0,20\n1,0,21\n")
    out = tmp_path / "proof.json"
    output_of(cli("path", str(case), "--proof", str(out), "--gap", "0.05"))
    shown = output_of(cli("verify-proof", str(out), str(case), "--all"))
    assert "placed as in the case" in " ".join(shown.split())
    assert "from the proof file" not in shown
    assert "speeds" not in shown
    output_of(cli("verify-proof", str(out)))
    code, _, said = cli("verify-proof", str(out), str(case), "--along", str(poses))
    assert (code, "--along" in said) == (1, True)
    saved(poses, "x,y,z\n0,0,20\n1,0,22\n")
    code, _, said = cli("verify-proof", str(out), str(case))
    assert (code, "another tool path" in said) == (1, True)


def test_a_clearance_of_legs_that_meet_is_rejected(proof: Proof) -> None:
    """The vector between the nearest points is 0 there: it separates nothing."""
    given = next(each for each in proof.claims if each.name.startswith("leg_clearance"))
    for own in (each for each in proof.unproved if each.name.startswith("leg_clearance")):
        forged = replace(given, name=own.name, sense=own.sense, bound=0.05, tree=bytes([Node.BOUNDED] * 3), packed=None)
        left = tuple(each for each in proof.unproved if each is not own)
        message = rejected(replace(proof, claims=(*proof.claims, forged), unproved=left), machine())
        assert message.startswith(own.name)
