"""The 3-UPU against a construction of its own in plain NumPy, and against what is known of two machines."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from builders import Array, turn_about

from screwsynth.models import WrenchKind, three_upu
from screwsynth.nlp import Case, CaseError, Free, Rotation, StartStatus, Status, Task, formulate, load_case, solve
from screwsynth.nlp.evidence.optimality import PointKind, examine
from screwsynth.nlp.evidence.state import RobotState, evaluate

Axes = Literal["free", "limb", "snu", "tsai"]
AZIMUTHS = [2 * math.pi * k / 3 for k in range(3)]
SYMMETRIC = {"base_radius": 0.57735, "platform_radius": 0.288675}
ABOUT_Z = Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=0)


def on_circle(radius: float) -> Array:
    return np.array([[radius * math.cos(t), radius * math.sin(t), 0.0] for t in AZIMUTHS])


def radial() -> Array:
    return on_circle(1.0)


def tangential() -> Array:
    return np.array([[-math.sin(t), math.cos(t), 0.0] for t in AZIMUTHS])


def unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


class Drawn:
    """A random robot and pose, with what can be worked out of them by hand."""

    def __init__(self, seed: int) -> None:
        generator = np.random.default_rng(seed)
        self.base, self.platform = (float(r) for r in generator.uniform(5, 60, 2))
        self.p: Array = generator.uniform([-30, -30, 40], [30, 30, 100])
        self.axis: Array = generator.normal(size=3)
        self.angle = float(generator.uniform(-1.2, 1.2))
        self.u1 = unit(generator.normal(size=(3, 3)))
        second = generator.normal(size=(3, 3))
        self.u2 = unit(second - self.u1 * np.sum(self.u1 * second, axis=1, keepdims=True))
        self.twist: Array = generator.normal(size=6) * [1, 1, 1, 20, 20, 20]
        self.length = float(generator.uniform(0.1, 40))

    @property
    def R(self) -> Array:  # noqa: N802 - the matrix's name
        return turn_about(self.axis, self.angle)

    def case(self, axes: Axes) -> Case:
        given: dict[str, float | list[float]] = {"base_radius": self.base, "platform_radius": self.platform}
        for k in range(3):
            if axes in ("free", "limb"):
                given[f"u1_{k + 1}"] = self.u1[k].tolist()
            if axes == "free":
                given[f"u2_{k + 1}"] = self.u2[k].tolist()
        turn = Rotation(self.axis, self.angle)
        model, task = three_upu(axes=axes), Task(self.twist)
        return Case(model, given, self.p.tolist(), [task], turn, characteristic_length=self.length)

    def force_rows(self) -> Array:
        b = on_circle(self.base)
        s = unit(self.p + on_circle(self.platform) @ self.R.T - b)
        return np.hstack([s, np.cross(b, s)])


def state(case: Case) -> RobotState:
    nlp = formulate(case)
    return evaluate(nlp, nlp.start)


def symmetric(axes: Axes, task: Task = ABOUT_Z, height: float = 0.7, platform_radius: float = 0.288675) -> RobotState:
    parameters = {**SYMMETRIC, "platform_radius": platform_radius}
    return state(Case(model=three_upu(axes=axes), parameters=parameters, position=[0, 0, height], tasks=[task]))


def test_tsais_robot_at_home_has_known_singular_values_and_f() -> None:
    found = symmetric("tsai")
    assert found.rank == 6
    assert found.free_twists.shape == (0, 6)
    # The values are known to three decimals.
    values = np.linalg.svd(found.jacobian, compute_uv=False)
    np.testing.assert_allclose(values, [1.601, 1.601, 0.897, 0.897, 0.243, 0.243], atol=5e-4)
    # Three-fold symmetry makes them pairs, as exactly as the radius 0.57735 allows: exactly, since it is any radius.
    np.testing.assert_allclose(values[::2], values[1::2], rtol=1e-12)
    found = symmetric("tsai", height=1.0, platform_radius=0.57735)
    assert found.rank == 4
    np.testing.assert_allclose(found.singular_values[4:], 0, atol=1e-15)
    # Vertical couples and limbs that meet the axis: exactly 3.
    assert pytest.approx(3.0, rel=1e-14) == symmetric("snu").F
    assert pytest.approx(2.564, abs=5e-4) == symmetric("tsai").F
    # The part of a unit limb vector perpendicular to the tangent is the limb itself: its couple is s, F = 3 s_z^2.
    rise = 0.7 / math.hypot(0.7, 0.57735 - 0.288675)
    assert pytest.approx(3 * rise**2, rel=1e-14) == symmetric("tsai").F


@pytest.mark.parametrize("seed", range(8))
def test_the_snu_robot_at_home_turns_freely_about_horizontal_lines_through_the_limbs_meeting_point(seed: int) -> None:
    azimuth = float(np.random.default_rng(seed).uniform(0, 2 * math.pi))
    task = Task.screw("min", axis=[math.cos(azimuth), math.sin(azimuth), 0], point=[0, 0, 1.4], pitch=0)
    found = symmetric("snu", task)
    assert found.rank == 4
    assert found.is_zero
    assert found.F < 1e-28  # rates of 1e-16 each: rounding alone
    # The free twists span these rotations: this one is a combination of them.
    parts = np.linalg.lstsq(found.free_twists.T, np.asarray(task.twist), rcond=None)[0]
    assert np.max(np.abs(task.twist - found.free_twists.T @ parts)) < 1e-12


@pytest.mark.parametrize("changed", [{"pitch": 0.1}, {"point": [0, 0, 1.3]}, {"axis": [1, 0, 0.1]}])
def test_the_snu_robot_resists_every_neighbour_of_those_motions(changed: dict[str, object]) -> None:
    given: dict[str, object] = {"axis": [1, 0, 0], "point": [0, 0, 1.4], "pitch": 0} | changed
    found = symmetric("snu", Task.screw("min", **given))  # type: ignore[arg-type]
    assert found.F > 1e-3
    assert not found.is_zero


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("axes", ["free", "limb", "snu", "tsai"])
def test_rows_are_those_made_by_hand(axes: Axes, seed: int) -> None:
    drawn = Drawn(seed)
    found = state(drawn.case(axes))
    J = found.jacobian
    np.testing.assert_allclose(found.rates, J @ np.roll(drawn.twist, 3), rtol=1e-12, atol=1e-12)
    assert pytest.approx(float(found.rates @ found.rates), rel=1e-12) == found.F
    forces = drawn.force_rows()
    scale = np.linalg.norm(forces, axis=1, keepdims=True)
    np.testing.assert_allclose(J[:3] / scale, forces / scale, atol=1e-14)
    first = {"snu": radial(), "tsai": tangential()}.get(axes, drawn.u1) @ drawn.R.T
    if axes == "free":
        u = np.cross(first, drawn.u2 @ drawn.R.T)
    else:
        # The second axis is perpendicular to the first and to the limb; the normal points along the limb.
        u = np.cross(unit(np.cross(first, forces[:, :3])), first)
        assert np.all(np.sum(u * forces[:, :3], axis=1) > 0)
    assert not J[3:, :3].any()
    # The part of s perpendicular to u1 is short where u1 is nearly along the limb: that costs its direction digits.
    lengths = np.linalg.norm(np.cross(first, forces[:, :3]), axis=1, keepdims=True) if axes != "free" else 1.0
    np.testing.assert_allclose((J[3:, 3:] / drawn.length - u) * lengths, 0, atol=2e-15)
    np.testing.assert_allclose(np.linalg.norm(J[3:, 3:], axis=1), drawn.length, rtol=1e-14)
    # A couple row's two axes are perpendicular to it, in the world, with the limb's own order of rows.
    np.testing.assert_allclose(np.sum(J[3:, 3:] * first, axis=1) / drawn.length * np.ravel(lengths), 0, atol=2e-15)


def test_rows_come_force_by_force_and_an_unknown_choice_of_axes_is_refused() -> None:
    rows = three_upu().wrenches
    assert [row.limb for row in rows] == ["1", "2", "3"] * 2
    assert [row.kind for row in rows] == [WrenchKind.FORCE] * 3 + [WrenchKind.COUPLE] * 3
    with pytest.raises(ValueError, match="axes must be"):
        three_upu(axes="park")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["paper-4.4-min", "paper-4.4-max"])
def test_free_directions_have_no_poles(name: str) -> None:
    many, maximum = solve(load_case(name), starts=64), name == "paper-4.4-max"
    assert many.status is Status.OPTIMAL
    assert len(many.starts) == 64
    goal = 3.0 if maximum else 0.0
    converged = [start for start in many.starts if start.status is StartStatus.CONVERGED]
    assert len(converged) >= (60 if maximum else 64)
    # Every one that is called converged is at the optimum, none at a saddle.
    assert all(abs(start.F - goal) < 1e-12 for start in converged)
    assert len(many.optima) == 1
    verdicts = {examine(many.nlp, start.x).kind for start in converged}
    assert verdicts <= {PointKind.NOT_ISOLATED, PointKind.UNDECIDED}
    for start in many.starts:
        if start.status is StartStatus.SADDLE:
            assert examine(many.nlp, start.x).kind is PointKind.SADDLE
            assert goal - 1e-6 > start.F

    # Directions end as unit and orthogonal, and the largest couples are along the axis.
    omega = np.asarray(many.nlp.case.tasks[0].twist)[:3]
    for start in converged:
        state = evaluate(many.nlp, start.x)
        for k in "123":
            first, second = state.parameters[f"u1_{k}"], state.parameters[f"u2_{k}"]
            assert abs(np.linalg.norm(first) - 1) < 1e-12
            assert abs(np.linalg.norm(second) - 1) < 1e-12
            assert abs(float(first @ second)) < 1e-12
        # F is flat there, of second order at the maximum, where 1e-12 in F is 1e-12 in cosines.
        cosines = np.abs(state.jacobian[3:, 3:] @ omega)
        np.testing.assert_allclose(cosines, float(maximum), atol=1e-12 if maximum else 1e-6)


@pytest.mark.parametrize("length", [1e-20, 1e-3, 0.2, 0.999999, 1.0, 7.0, 1e20])
def test_a_fixed_direction_of_any_length_is_a_unit_vector(length: float) -> None:
    drawn = Drawn(400)
    expected = state(drawn.case("free"))
    drawn.u1, drawn.u2 = length * drawn.u1, drawn.u2 / length
    found = state(drawn.case("free"))
    np.testing.assert_allclose(found.jacobian, expected.jacobian, rtol=1e-13, atol=1e-13)
    assert np.linalg.norm(found.parameters["u1_2"]) == pytest.approx(1, rel=1e-15)


def one_axis_given(u1: Sequence[float], axes: Axes = "free") -> Case:
    drawn = Drawn(401)
    case = drawn.case(axes)
    return replace(case, parameters={**case.parameters, "u1_1": list(u1)})


def test_a_direction_that_is_zero_or_no_number_is_refused() -> None:
    with pytest.raises(CaseError, match=r"robot\.parameters\.u1_1.*must not be zero"):
        one_axis_given([0, 0, 0], "limb")
    for bad in (math.nan, math.inf):
        with pytest.raises(CaseError, match=r"u1_1.*finite"):
            one_axis_given([bad, 0, 1], "limb")


def test_fixed_axes_are_orthogonal_to_eleven_digits_or_refused() -> None:
    drawn = Drawn(401)
    tilted = turn_about(np.cross(drawn.u1[0], drawn.u2[0]), math.radians(80)) @ drawn.u2[0]
    case = one_axis_given(tilted.tolist())
    with pytest.raises(CaseError) as refused:
        formulate(case)
    said = str(refused.value)
    assert "u1_1 . u2_1" in said
    assert f"{math.cos(math.radians(80)):.6g}" in said
    assert "must be 0" in said
    drawn = Drawn(402)
    drawn.u1, drawn.u2 = drawn.u1.round(11), drawn.u2.round(11)
    assert np.max(np.abs(np.sum(drawn.u1 * drawn.u2, axis=1))) > 1e-13
    assert state(drawn.case("free")).rank == 6


def test_a_free_direction_with_a_held_component_keeps_it() -> None:
    drawn = Drawn(403)
    case = drawn.case("limb")
    circle = [Free(-1, 1), Free(-1, 1), 0.6]
    solution = solve(replace(case, parameters={**case.parameters, "u1_1": circle}), starts=4)
    found = solution.state.parameters["u1_1"]
    assert found[2] == 0.6
    assert abs(np.linalg.norm(found) - 1) < 1e-12
    # One variable is left: its angle about z. Sample it, by hand, every tenth of a degree.
    s, best = drawn.force_rows()[0, :3], 0.0
    for angle in np.radians(np.arange(0, 360, 0.1)):
        u1 = drawn.R @ np.array([0.8 * math.cos(angle), 0.8 * math.sin(angle), 0.6])
        best = max(best, float(unit(s - u1 * float(u1 @ s)) @ drawn.twist[:3]) ** 2)
    reached = (solution.state.rates[3] / drawn.length) ** 2
    # Half a step from its top a parabola of this height has lost at most about (pi / 3600)^2 times a small number.
    assert best * (1 - 1e-12) <= reached <= best * (1 + 1e-5)
