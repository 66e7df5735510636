"""Section 4 of the paper: the optimisers and the values that its formulation gives, all starts agreeing."""

import math

import numpy as np
import pytest

from screwsynth.nlp import PointKind, Solution, Status, load_case, solve

STARTS = 64

# case, F and its tolerance (the last digit given), F's source: a brute-force study of the formulation.
UNIQUE = [
    ("paper-4.1-helical", 407.2107),
    ("paper-4.1-helical-axis-z", 407.1170),
    ("paper-4.1-rotation", 406.0650),
    ("paper-4.1-rotation-axis-z", 405.8652),
    ("paper-4.3", 408.8031),
    ("paper-4.3-axis-x", 407.0562),
]


@pytest.fixture(scope="module")
def solved() -> dict[str, Solution]:
    names = [name for name, _ in UNIQUE] + ["paper-4.2-translation", "paper-4.2-rotation"]
    return {name: solve(load_case(name), starts=STARTS) for name in names}


@pytest.mark.parametrize(("name", "F"), UNIQUE)
def test_every_start_finds_the_one_optimum(solved: dict[str, Solution], name: str, F: float) -> None:
    solution = solved[name]
    assert solution.status is Status.OPTIMAL
    assert pytest.approx(F, abs=5e-5) == solution.F
    assert [optimum.count for optimum in solution.optima] == [STARTS]
    assert solution.evidence.kind is PointKind.STRICT_MAXIMUM
    assert solution.evidence.stationarity < 1e-12
    assert solution.evidence.feasibility == 0
    np.testing.assert_array_equal(solution.state.position, [-10, -10, 50])
    assert solution.state.rank == 6


@pytest.mark.parametrize(
    ("name", "degrees", "tolerance"),
    [
        ("paper-4.1-helical-axis-z", -13.35, 0.005),
        ("paper-4.1-rotation-axis-z", -6.19, 0.005),
        ("paper-4.3-axis-x", 4.294, 0.0005),
    ],
)
def test_angle_about_the_held_axis(solved: dict[str, Solution], name: str, degrees: float, tolerance: float) -> None:
    state = solved[name].state
    assert math.degrees(state.angle) == pytest.approx(degrees, abs=tolerance)


@pytest.mark.parametrize(
    ("name", "degrees", "tolerance"), [("paper-4.3", 19.96, 0.005), ("paper-4.3-axis-x", 21.121, 0.0005)]
)
def test_platform_joint_angle_of_section_4_3(
    solved: dict[str, Solution], name: str, degrees: float, tolerance: float
) -> None:
    state = solved[name].state
    assert math.degrees(state.parameters["x4"][0]) == pytest.approx(degrees, abs=tolerance)


def test_rotation_vector_of_the_free_helical_optimum(solved: dict[str, Solution]) -> None:
    state = solved["paper-4.1-helical"].state
    np.testing.assert_allclose(state.angle * state.axis, [0.2684, -0.2101, -0.2278], atol=5e-5)


def test_translation_of_section_4_2_has_f_6_on_equal_plates(solved: dict[str, Solution]) -> None:
    solution = solved["paper-4.2-translation"]
    state = solution.state
    assert state is not None
    assert pytest.approx(6, abs=1e-12) == solution.F
    x1, x2, x3, x4 = (state.parameters[name][0] for name in ("x1", "x2", "x3", "x4"))
    assert x1 == pytest.approx(x2, abs=1e-9)
    assert x3 == pytest.approx(x4, abs=1e-9)
    assert state.rank == 3
    assert sum(optimum.count for optimum in solution.optima) == STARTS


def test_rotation_of_section_4_2_has_f_0_on_equal_angles(solved: dict[str, Solution]) -> None:
    solution = solved["paper-4.2-rotation"]
    state = solution.state
    assert pytest.approx(0, abs=1e-20) == solution.F
    assert state.parameters["x3"][0] == pytest.approx(state.parameters["x4"][0], abs=1e-9)
    assert state.rank == 3
    assert state.is_zero
    assert len(solution.optima) == 1
    assert solution.optima[0].count == STARTS


@pytest.mark.parametrize(
    ("name", "flat"),
    [
        ("paper-4.2-translation", [{"x1", "x2"}, {"x3", "x4"}]),
        # F vanishes wherever the half angles are equal, whatever the radii.
        ("paper-4.2-rotation", [{"x1"}, {"x2"}, {"x3", "x4"}]),
    ],
)
def test_flat_directions_of_section_4_2_are_named(solved: dict[str, Solution], name: str, flat: list[set[str]]) -> None:
    evidence = solved[name].evidence
    assert evidence.kind is PointKind.NOT_ISOLATED
    assert sorted(map(sorted, evidence.flat)) == sorted(map(sorted, flat))


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_the_result_does_not_depend_on_the_number_of_threads(jobs: int) -> None:
    one = solve(load_case("paper-4.3"), starts=8, jobs=1)
    other = solve(load_case("paper-4.3"), starts=8, jobs=jobs)
    assert [start.F for start in one.starts] == [start.F for start in other.starts]
    np.testing.assert_array_equal(one.x, other.x)
