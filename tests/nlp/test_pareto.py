"""Fronts of two and three goals, held to fronts in closed form."""

import csv
import io
import math
from pathlib import Path

import numpy as np
import pytest
from builders import Run, output_of, saved

from screwsynth.nlp import load_case, load_result, pareto
from screwsynth.nlp.results.front import FrontResult

# Six legs with one free height. Of unit forces along z, x and y the sums of squares are F of the translations along
# these axes, so that F up + F side + F of the third axis = 6, and the last two are equal by the symmetry of the robot.
CASE = """
[units]
length = "cm"
[robot]
model = "stewart-gough"
layout = "aligned"
parameters = { x1 = 12, x2 = 4, x3 = 30, x4 = 20 }
[pose]
position = [0, 0, { min = 5, max = 40 }]
[limits]
leg_length = { min = 2, max = 60 }
[[task]]
name = "up"
sense = "max"
axis = [0, 0, 1]
pitch = inf
[[task]]
name = "side"
sense = "max"
axis = [1, 0, 0]
pitch = inf
[solve]
starts = 2
"""
#: Rounding of a corrected point: bounds hold to 1e-9 of half a range.
EXACT = 1e-8


@pytest.fixture
def case(tmp_path: Path) -> str:
    return str(saved(tmp_path / "case.toml", CASE))


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_two_objectives_on_a_line(case: str, tmp_path: Path, cli: Run) -> None:
    out, picture = tmp_path / "front.csv", tmp_path / "front.svg"
    goals = ("--goals", "max F:up", "--goals", "max F:side")
    said = output_of(cli("pareto", case, *goals, "--points", "9", "--csv", str(out), "--plot", str(picture)))
    assert said.startswith("9 points on the front of max F:up and max F:side\n")
    rows = table(out.read_text())
    # The terminal has the same points.
    shown = [line.split()[:2] for line in said.splitlines()[-9:]]
    assert shown == [[f"{float(row[name]):.7g}" for name in ("F:up", "F:side")] for row in rows]
    up, side = (np.array([float(row[name]) for row in rows]) for name in ("F:up", "F:side"))
    assert up + 2 * side == pytest.approx(np.full(9, 6.0), abs=EXACT)
    heights = [float(row["p_z"]) for row in (rows[0], rows[-1])]
    assert heights == pytest.approx([5, 40], abs=1e-9)
    # Bisecting the widest gap of a line eight times gives equal steps.
    assert np.diff(up) == pytest.approx(np.full(8, (up[-1] - up[0]) / 8), rel=1e-6)
    assert {row["verdict"] for row in rows} == {"strict local maximum"}
    for row in rows[1:-1]:
        # The multiplier of the bounded goal is the slope of the front.
        expected = 2.0 if row["optimised"] == "F:up" else 0.5
        assert (row["active"].startswith("F of"), float(row["multipliers"])) == (
            True,
            pytest.approx(expected, rel=1e-6),
        )
    assert b"front" in picture.read_bytes()


def test_a_limit_as_a_goal_with_proofs(case: str, cli: Run) -> None:
    goals = ("--goals", "max F:up", "--goals", "min limits.leg_length.max")
    code, out, _ = cli("pareto", case, *goals, "--points", "5", "--certify", "--csv", "-")
    rows = table(out)
    assert (code, len(rows)) == (0, 5)
    length, up = (np.array([float(row[name]) for row in rows]) for name in ("limits.leg_length.max", "F:up"))
    # Each leg has the length L and the horizontal part d: F = 6 (L^2 - d^2) / L^2, and L^2 = h^2 + d^2.
    squared = length[0] ** 2 - 5**2
    assert up == pytest.approx(6 * (1 - squared / length**2), abs=EXACT)
    assert length[-1] == pytest.approx(math.sqrt(40**2 + squared), rel=1e-9)
    assert {row["certificate"] for row in rows} == {"proved"}
    for row in rows:
        value, bound = float(row[row["optimised"]]), float(row["proven_bound"])
        assert abs(bound - value) <= 1e-4 * value


def test_goals_without_conflict_have_one_point(case: str, cli: Run) -> None:
    code, said, _ = cli("pareto", case, "--goals", "max F:up", "--goals", "min F:side")
    assert (code, said.splitlines()[0]) == (0, "1 point on the front of max F:up and min F:side")


# Six parallel legs along the platform's position p: F of the translation along an axis is 6 p_i^2 / |p|^2, and each leg
# has the length |p|. Of the points with given F x and F y, the shortest legs are those with the smallest height, so
# that F x + F y = 6 - 6 * 10^2 / L^2 on the front, and above it is dominated.
PARALLEL = """
[units]
length = "cm"
[robot]
model = "stewart-gough"
layout = "aligned"
parameters = { x1 = 12, x2 = 12, x3 = 20, x4 = 20 }
[pose]
position = [{ min = 0, max = 20 }, { min = 0, max = 20 }, { min = 10, max = 15 }]
[limits]
leg_length = { min = 2, max = 30 }
[[task]]
name = "x"
sense = "max"
axis = [1, 0, 0]
pitch = inf
[[task]]
name = "y"
sense = "max"
axis = [0, 1, 0]
pitch = inf
[solve]
starts = 1
"""
#: The widest hole may be so many times that of points which are chosen with the exact front known, farthest ones first:
#: that choice is itself within a factor of two of the best.
HOLE = 2


def widest_hole(exact: np.ndarray, found: np.ndarray) -> float:
    """The largest distance of a point (k,) of a front to the nearest of those found."""
    return float(np.linalg.norm(exact[:, np.newaxis] - found, axis=2).min(axis=1).max())


def farthest_first(exact: np.ndarray, count: int) -> np.ndarray:
    """Points of a front, each the farthest from those before."""
    chosen = [0]
    for _ in range(count - 1):
        chosen.append(int(np.linalg.norm(exact[:, np.newaxis] - exact[chosen], axis=2).min(axis=1).argmax()))
    return exact[chosen]


def test_three_goals_on_an_exact_front(tmp_path: Path, cli: Run) -> None:
    path, files = tmp_path / "parallel.toml", [tmp_path / f"front.{end}" for end in ("csv", "json", "html")]
    path.write_text(PARALLEL, encoding="utf-8")
    goals = ("--goals", "max F:x", "--goals", "min limits.leg_length.max", "--goals", "max F:y")
    options = [word for file in files for word in (f"--{file.suffix[1:]}", str(file))]
    code, said, err = cli("pareto", str(path), *goals, "--points", "12", *options)
    assert (code, err, said.partition(" points")[0]) == (0, "", "12")
    rows = table(files[0].read_text())
    x, y, length = (np.array([float(row[name]) for row in rows]) for name in ("F:x", "F:y", "limits.leg_length.max"))
    assert x + y == pytest.approx(6 - 600 / length**2, abs=1e-7)
    found = np.stack([x, y, length], axis=1)
    costs = found * [-1, -1, 1]
    dominated = [(np.delete(costs, k, 0) <= cost - 1e-7).all(axis=1).any() for k, cost in enumerate(costs)]
    assert not any(dominated)
    # The exact front: all positions at the smallest height within the largest length.
    sides = np.stack(np.meshgrid(*[np.linspace(0, 20, 30)] * 2), axis=-1).reshape(-1, 2)
    squared = 100 + np.sum(sides**2, axis=1)
    exact = np.column_stack([6 * sides**2 / squared[:, np.newaxis], np.sqrt(squared)])[squared <= 900]
    scale = np.ptp(exact, axis=0)
    assert widest_hole(exact / scale, found / scale) < HOLE * widest_hole(
        exact / scale, farthest_first(exact / scale, 12)
    )
    result = load_result(files[1])
    assert isinstance(result, FrontResult)
    assert [each.goals["F:x"] for each in result.points] == x.tolist()
    assert set(result.points[0].design) == {"p_x", "p_y", "p_z"}
    assert files[2].read_text().count("<tr>") == 13


def test_two_limits_as_goals(tmp_path: Path) -> None:
    path = tmp_path / "limits.toml"
    text = CASE.replace("x1 = 12", "x1 = { min = 8, max = 20 }").replace(
        "}\n[[task", "}\nradius_ratio = { max = 0.5 }\n[[task", 1
    )
    path.write_text(text, encoding="utf-8")
    front = pareto(
        load_case(str(path)), ["min limits.leg_length.max", "min limits.radius_ratio.max"], points=5, starts=1
    )
    length, ratio = np.array([each.values for each in front.points]).T
    # A small ratio needs a large base, and so long legs; the lowest height is the best, at the ends too.
    base = 4 / ratio
    assert length**2 == pytest.approx(25 + base**2 + 16 - 8 * base * math.cos(math.radians(10)), rel=1e-7)
    assert (len(ratio), ratio[0], ratio[-1]) == (5, pytest.approx(0.2), pytest.approx(0.5))


@pytest.mark.parametrize(
    ("goals", "words"),
    [
        (("max F:up",), "a front has 2 to 6 goals, and 1 is given"),
        (("max F:up", "max F:up"), "F:up is given twice"),
        (("max F:upp", "max F:side"), "the case has no such task; did you mean 'up'?"),
        (("up", "max F:side"), "must be 'max F:TASK', 'min F:TASK', 'min limits.KEY' or 'max limits.KEY'"),
        (("max F", "max F:side"), "the case has no such task"),
        (("max F:up", "max F:side", "min F:up"), "F:up is given twice"),
        (("max F:up", "min limits.x"), "a front can move in this sense; allowed: leg_length.max"),
        (("max F:up", "max limits.leg_length.max"), "allowed: leg_length.min"),
    ],
)  # fmt: skip
def test_bad_goals_are_one_sentence(goals: tuple[str, ...], words: str, case: str, cli: Run) -> None:
    code, out, err = cli("pareto", case, *(word for goal in goals for word in ("--goals", goal)))
    assert (code, out, len(err.splitlines())) == (2, "", 1), err
    assert words in err
