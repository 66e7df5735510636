"""Fronts of two goals, held to fronts in closed form."""

import csv
import io
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

Run = Callable[..., tuple[int, str, str]]

# Six legs with one free height. Of unit forces along z, x and y the sums of squares are F of the translations along
# these axes, so that F up + F side + F of the third axis = 6, and the last two are equal by the symmetry of the robot.
CASE = """
[units]
length = "cm"
[robot]
model = "stewart-gough"
layout = "aligned"
[robot.parameters]
x1 = 12
x2 = 4
x3 = 30
x4 = 20
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
    path = tmp_path / "case.toml"
    path.write_text(CASE, encoding="utf-8")
    return str(path)


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_two_objectives_on_a_line(case: str, tmp_path: Path, cli: Run) -> None:
    out, picture = tmp_path / "front.csv", tmp_path / "front.svg"
    goals = ("--goals", "max F:up", "--goals", "max F:side")
    code, said, err = cli("pareto", case, *goals, "--points", "9", "--csv", str(out), "--plot", str(picture))
    assert (code, err) == (0, "")
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


@pytest.mark.parametrize(
    ("goals", "words"),
    [
        (("max F:up",), "a front has two goals, and 1 are given"),
        (("max F:up", "max F:up"), "F:up is given twice"),
        (("max F:upp", "max F:side"), "the case has no such task; did you mean 'up'?"),
        (("up", "max F:side"), "must be 'max F:TASK', 'min F:TASK', 'min limits.KEY' or 'max limits.KEY'"),
        (("max F", "max F:side"), "the case has no such task"),
        (("min limits.leg_length.max", "max limits.leg_length.min"), "one of them must be F of a task"),
        (("max F:up", "min limits.x"), "a front can move in this sense; allowed: leg_length.max"),
        (("max F:up", "max limits.leg_length.max"), "allowed: leg_length.min"),
    ],
)  # fmt: skip
def test_bad_goals_are_one_sentence(goals: tuple[str, ...], words: str, case: str, cli: Run) -> None:
    code, out, err = cli("pareto", case, *(word for goal in goals for word in ("--goals", goal)))
    assert (code, out, len(err.splitlines())) == (2, "", 1), err
    assert words in err
