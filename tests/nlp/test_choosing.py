"""What F means to a designer: stiffness, resolution, force, speed, play, units; and the six worked problems.

Everything here is computed from the joint centres alone, in NumPy, without the package's rows, rates or J.
"""

from __future__ import annotations

import itertools
import math
import re
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from builders import Array, case_from, turn_about
from measures import circle_joints, exponential, scaled

from screwsynth.nlp import Case, RobotState, Solution, evaluate, formulate, load_case, solve
from screwsynth.nlp.case.source import find_case

PAGE = (Path(__file__).parents[2] / "docs" / "worked-designs.md").read_text(encoding="utf-8")
PROBLEMS = ("peg-in-hole", "drilling-spindle", "camera-mount", "free-wrist", "haptic-device", "flight-simulator")


class Legs(NamedTuple):
    """Joint centres in the world frame, each (6, 3), length."""

    base: Array
    platform: Array


class Posed(NamedTuple):
    """A robot at one pose, a task and the F that the package gives for it."""

    legs: Legs
    twist: Array
    F: float


@cache
def solved(name: str) -> Solution:
    return solve(load_case(name))


def placed(case: Case, state: RobotState) -> Legs:
    x = {name: float(np.ravel(value)[0]) for name, value in state.parameters.items()}
    return legs_of(x, str(case.model.options["layout"]), np.array(state.rotation), np.array(state.position))


@cache
def answers(name: str) -> list[Posed]:
    """The answer of a problem, for every task at every pose."""
    solution = solved(name)
    found = []
    for outcome in solution.outcomes:
        twist = np.array(outcome.task.twist)
        for k in range(solution.case.pose_count):
            state = evaluate(solution.nlp, solution.x, k) if solution.case.pose_count > 1 else outcome.state
            found.append(Posed(placed(solution.case, state), twist, state.F))
    return found


def legs_of(x: dict[str, float], layout: str, R: Array, p: Array) -> Legs:
    base, platform = circle_joints(x, layout)
    return Legs(base, p + platform @ R.T)


def lengths(legs: Legs, twist: Array, t: float) -> Array:
    E = exponential(twist, t)
    after: Array = np.linalg.norm(legs.platform @ E[:3, :3].T + E[:3, 3] - legs.base, axis=1)
    return after


def step(legs: Legs, twist: Array) -> float:
    """A time in which the platform's joints move by 1e-4 of the legs: differences are exact to about 1e-8."""
    speed = np.max(np.linalg.norm(np.cross(twist[:3], legs.platform) + twist[3:], axis=1))
    return float(1e-4 * np.min(np.linalg.norm(legs.platform - legs.base, axis=1)) / speed)


def rates(legs: Legs, twist: Array) -> Array:
    """Rates of the legs' lengths, by finite differences."""
    t = step(legs, twist)
    return (lengths(legs, twist, t) - lengths(legs, twist, -t)) / (2 * t)


def stiffness(legs: Legs, k: float = 1.0) -> Array:
    """Stiffness matrix (6, 6) of six springs between the joints, for twists (omega, v) at the world's origin."""
    u = legs.platform - legs.base
    u = u / np.linalg.norm(u, axis=1)[:, None]
    rows = np.hstack([np.cross(legs.platform, u), u])
    K: Array = k * rows.T @ rows
    return K


def translation(*axis: float) -> Array:
    return np.array([0, 0, 0, *axis], dtype=np.float64)


def turn(axis: Array, point: Array) -> Array:
    return np.concatenate([axis, np.cross(point, axis)]).astype(np.float64)


ALL = pytest.mark.parametrize("name", PROBLEMS)


@ALL
def test_k_f_is_the_stiffness_of_six_springs_along_the_task(name: str) -> None:
    k = 3.7
    for legs, twist, F in answers(name):
        rest, t = lengths(legs, twist, 0.0), step(legs, twist)
        energy = [0.5 * k * float(np.sum((lengths(legs, twist, s) - rest) ** 2)) for s in (-t, t, -2 * t, 2 * t)]
        curvature = [sum(energy[:2]) / t**2, sum(energy[2:]) / (2 * t) ** 2]
        # Richardson: the quartic part of the energy is four times as large at twice the step.
        assert (4 * curvature[0] - curvature[1]) / 3 == pytest.approx(k * F, rel=1e-7)
        assert twist @ stiffness(legs, k) @ twist == pytest.approx(k * F, rel=1e-9)


@ALL
def test_a_load_meets_at_most_this_stiffness(name: str) -> None:
    # A platform that may give way in other motions too is softer, except for the load that drives the task alone.
    for legs, twist, F in answers(name):
        K = stiffness(legs)
        soft = np.linalg.inv(K)
        for load in np.random.default_rng(1).normal(size=(50, 6)):
            met = (load @ twist) ** 2 / (load @ soft @ load)
            assert met <= F * (1 + 1e-9)
        load = K @ twist
        assert (load @ twist) ** 2 / (load @ soft @ load) == pytest.approx(F, rel=1e-8)


@ALL
def test_resolution_along_the_task_is_that_of_the_legs_over_the_root_of_f(name: str) -> None:
    sigma, rng = 0.01, np.random.default_rng(2)
    for legs, twist, F in answers(name)[:2]:
        q = rates(legs, twist)
        # How far the platform went along its task, by least squares from six lengths with errors of their own.
        seen = [float(np.linalg.lstsq(q[:, None], e, rcond=None)[0][0]) for e in rng.normal(size=(4000, 6)) * sigma]
        assert np.std(seen) == pytest.approx(sigma / math.sqrt(F), rel=0.05)  # 4,000 samples: 1.1 % one sigma
        # The leg that moves most moves by no more than sqrt(F) and no less than sqrt(F / 6).
        assert math.sqrt(F / 6) * (1 - 1e-6) <= np.max(np.abs(q)) <= math.sqrt(F) * (1 + 1e-6)


@ALL
def test_work_rate_of_the_legs_is_at_most_the_root_of_f(name: str) -> None:
    for legs, twist, F in answers(name):
        u = legs.platform - legs.base
        u = u / np.linalg.norm(u, axis=1)[:, None]
        wrenches = np.hstack([u, np.cross(legs.platform, u)])

        def power(forces: Array, wrenches: Array = wrenches, twist: Array = twist) -> float:
            load = forces @ wrenches
            return float(load[:3] @ twist[3:] + load[3:] @ twist[:3])

        for forces in np.random.default_rng(3).normal(size=(100, 6)):
            assert abs(power(forces)) <= math.sqrt(F) * np.linalg.norm(forces) * (1 + 1e-9)
        q = rates(legs, twist)
        assert power(q) == pytest.approx(math.sqrt(F) * np.linalg.norm(q), rel=1e-6)
        # Six legs of one largest force: the best signs of all 64 give sum |rate|, between sqrt(F) and sqrt(6 F).
        best = max(power(np.array(signs)) for signs in itertools.product((-1.0, 1.0), repeat=6))
        assert best == pytest.approx(np.sum(np.abs(q)), rel=1e-6)
        assert math.sqrt(F) * (1 - 1e-6) <= best <= math.sqrt(6 * F) * (1 + 1e-6)


@ALL
def test_masses_that_move_with_the_legs_are_felt_times_f(name: str) -> None:
    m, speed = 0.05, 0.8
    for legs, twist, F in answers(name):
        t = step(legs, twist)
        ways = lengths(legs, twist, t * speed) - lengths(legs, twist, -t * speed)
        assert 0.5 * m * np.sum((ways / (2 * t)) ** 2) == pytest.approx(0.5 * (m * F) * speed**2, rel=1e-6)


@ALL
def test_f_of_three_directions_sums_to_the_number_of_legs(name: str) -> None:
    for legs, _, _ in answers(name):
        turned = turn_about([1, 2, 3], 0.7)
        assert sum(np.sum(rates(legs, translation(*axis)) ** 2) for axis in turned) == pytest.approx(6, rel=1e-6)


def tables_of(name: str) -> dict[str, Any]:
    return tomllib.loads(find_case(name).read_text(encoding="utf-8"))


def test_f_with_other_units_and_speeds() -> None:
    for name, power in (("drilling-spindle", 0), ("free-wrist", 2)):
        tables = tables_of(name)
        tables["units"]["length"] = "m"
        for key in ("x1", "x2"):
            tables["robot"]["parameters"][key] = scaled(tables["robot"]["parameters"][key], 1e-3)
        tables["pose"]["position"] = scaled(tables["pose"]["position"], 1e-3)
        for key in ("leg_length", "joint_spacing", "footprint"):
            if key in tables["limits"]:
                tables["limits"][key] = scaled(tables["limits"][key], 1e-3)
        assert "point" not in tables["task"][0] or not any(tables["task"][0]["point"])
        found = solve(case_from(tables, name))
        assert pytest.approx(solved(name).F * 1e-3**power, rel=1e-7) == found.F
    for per, factor in ((2.0, 4.0), (math.radians(1), math.radians(1) ** 2)):
        tables = tables_of("free-wrist")
        tables["task"][0] = {"sense": "min", "twist": [0, 0, per, 0, 0, 0]}
        found = solve(case_from(tables, "wrist"))
        assert pytest.approx(solved("free-wrist").F * factor, rel=1e-7) == found.F


def test_the_characteristic_length_is_the_root_of_the_ratio_of_stiffnesses() -> None:
    # Legs of stiffness k along them, and joints of stiffness c about the normals of their axes.
    k, c, height, base, platform = 150.0, 6.0e4, 60.0, 50.0, 25.0
    tables = {
        "robot": {
            "model": "three-upu",
            "axes": "tsai",
            "characteristic_length": math.sqrt(c / k),
            "parameters": {"base_radius": base, "platform_radius": platform},
        },
        "pose": {"position": [0, 0, height]},
        "task": [{"sense": "max", "axis": [1, 2, 3], "point": [4, -3, 20], "pitch": 5}],
    }
    case = case_from(tables, "upu")
    F, twist = solve(case).F, np.array(case.tasks[0].twist)
    azimuths = np.radians([0, 120, 240])
    radial = np.column_stack([np.cos(azimuths), np.sin(azimuths), np.zeros(3)])
    tangential = np.column_stack([-np.sin(azimuths), np.cos(azimuths), np.zeros(3)])
    legs = Legs(base * radial, platform * radial + np.array([0, 0, height]))
    along = legs.platform - legs.base
    normals = np.cross(tangential, np.cross(tangential, along))
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    energy_rate = k * np.sum(rates(legs, twist) ** 2) + c * np.sum((normals @ twist[:3]) ** 2)
    assert energy_rate == pytest.approx(k * F, rel=1e-6)


def started(name: str) -> Legs:
    """The robot of a case's starting values."""
    nlp = formulate(load_case(name))
    return placed(nlp.case, evaluate(nlp, nlp.start))


def objective(legs: Legs, twist: Array) -> float:
    return float(np.sum(rates(legs, twist) ** 2))


@ALL
def test_the_characteristic_length_has_no_effect_on_robots_with_legs_only(name: str) -> None:
    case = load_case(name)
    assert case.characteristic_length == 1
    longer, nlp = formulate(replace(case, characteristic_length=7.5)), formulate(case)
    for k in range(case.pose_count):
        assert evaluate(longer, longer.start, k).F == evaluate(nlp, nlp.start, k).F


def numbers_of_the_peg() -> Iterator[tuple[str, str]]:
    (legs, push, F), (_, tilt, F_tilt) = answers("peg-in-hole")
    before, k = started("peg-in-hole"), 200.0
    yield "F of pushing, at the start and at the answer", f"{objective(before, push):.3f} and {F:.3f}"
    yield "F of tilting, at the start and at the answer, mm²", f"{objective(before, tilt):.1f} and {F_tilt:.2f}"
    yield "stiffness along the peg, legs of 200 N/mm", f"{k * F:.0f} N/mm"
    yield "stiffness against tilting about the tip", f"{k * F_tilt / 1000:.1f} N m/rad"
    K = stiffness(legs, k)
    soft = np.linalg.inv(K)
    # A force along x at height z turns the platform about y by C[4, :] load; the height at which it does not.
    load = [np.concatenate([np.cross([0, 0, z], [1, 0, 0]), [1, 0, 0]]) for z in (0.0, 1.0)]
    at = [float(soft[1] @ each) for each in load]
    yield "height of the centre of compliance", f"{-at[0] / (at[1] - at[0]):.1f} mm"
    yield "F of turning about the peg, mm²", f"{objective(legs, turn(np.array([0, 0, 1.0]), np.zeros(3))):.1f}"


def numbers_of_the_drill() -> Iterator[tuple[str, str]]:
    ((legs, drill, F),) = answers("drilling-spindle")
    before, k = started("drilling-spindle"), 100.0
    yield "F of drilling, at the start and at the answer", f"{objective(before, drill):.3f} and {F:.3f}"
    yield "stiffness along the drill, legs of 100 N/µm", f"{k * F:.0f} N/µm"
    yield "F of all directions across the drill together", f"{6 - F:.3f}"
    across = np.linalg.eigvalsh(stiffness(legs)[3:, 3:])[:2]
    yield "F of the two directions across the drill", f"{across[0]:.3f} and {across[1]:.3f}"


def numbers_of_the_camera() -> Iterator[tuple[str, str]]:
    (legs, below, F), (_, above, F_above) = answers("camera-mount")
    before, k, mass, gyration = started("camera-mount"), 1e6, 5.0, 0.23
    centre = np.array([0, 0, 0.45])
    swings = np.array([turn(np.array([0, 1.0, 0]), centre), translation(1, 0, 0)])
    kinetic = np.diag([mass * gyration**2, mass])

    def hertz(legs: Legs) -> Array:
        squares = np.linalg.eigvals(np.linalg.solve(kinetic, swings @ stiffness(legs, k) @ swings.T)).real
        return np.sort(np.sqrt(squares)) / (2 * math.pi)

    first, now = hertz(before), hertz(legs)
    yield "F of the two swings at the start, m²", f"{objective(before, below):.4f} and {objective(before, above):.4f}"
    yield "F of the two swings at the answer, m²", f"{F:.5f} and {F_above:.5f}"
    yield "natural frequencies at the start, legs of 1 N/µm, 5 kg", f"{first[0]:.1f} and {first[1]:.1f} Hz"
    yield "natural frequencies at the answer", f"{now[0]:.1f} and {now[1]:.1f} Hz"
    alone = [each @ stiffness(legs, k) @ each / part for each, part in zip(swings, np.diag(kinetic), strict=True)]
    tilt, sway = (math.sqrt(square) / (2 * math.pi) for square in alone)
    yield "the same for tilt and for sway separately, at the answer", f"{tilt:.1f} and {sway:.1f} Hz"
    azimuths = np.radians([20.0, 55.0, 130.0])
    others = [objective(legs, turn(np.array([math.cos(a), math.sin(a), 0]), np.array([0, 0, 0.22]))) for a in azimuths]
    yield "F of the lower swing for winds from 20, 55 and 130 degrees", ", ".join(f"{each:.5f}" for each in others)


def numbers_of_the_wrist() -> Iterator[tuple[str, str]]:
    ((legs, twist, F),) = answers("free-wrist")
    tables = tables_of("free-wrist")
    tables["task"][0]["sense"] = "max"
    stiffest = solve(case_from(tables, "wrist")).F
    q = np.abs(rates(legs, twist))
    yield "smallest and largest F within the same limits, mm²", f"{F:.1f} and {stiffest:.0f}"
    yield "travel of each leg for one degree", f"{math.radians(1) * max(q) * 1000:.1f} µm"
    yield "speed of the tool, legs of 50 mm/s", f"{50 / max(q):.1f} rad/s"
    yield "torque about the tool, legs of 100 N", f"{100 * sum(q) / 1000:.2f} N m"
    yield "play of the tool, legs with a play of 0.01 mm", f"{math.degrees(0.01 / max(q)):.2f} deg"
    mean = math.sqrt(stiffest / 6)
    speed, force, play = 50 / mean, 600 * mean / 1000, 0.01 / mean
    yield "the same three for the largest F", f"{speed:.1f} rad/s, {force:.2f} N m, {math.degrees(play):.2f} deg"


def numbers_of_the_haptic_device() -> Iterator[tuple[str, str]]:
    (legs, _, F), (_, _, F_up) = answers("haptic-device")
    before, m = started("haptic-device"), 50.0
    first = [objective(before, translation(*axis)) for axis in np.eye(3)]
    now = [objective(legs, translation(*axis)) for axis in np.eye(3)]
    yield "F along x, y, z at the start", ", ".join(f"{each:.2f}" for each in first)
    yield "F along x, y, z at the answer", ", ".join(f"{each:.2f}" for each in now)
    yield "apparent mass at the start, legs with 50 g in motion", f"{m * min(first):.0f} to {m * max(first):.0f} g"
    yield "apparent mass at the answer", f"{m * F:.0f} to {m * F_up:.0f} g"


def numbers_of_the_simulator() -> Iterator[tuple[str, str]]:
    found = answers("flight-simulator")
    F = [each.F for each in found]
    legs, twist, worst = found[int(np.argmin(F))]
    wide = [objective(placed_with(each, x1=2.0), twist) for each in states("flight-simulator")]
    neutral = [found[0].legs, placed_with(states("flight-simulator")[0], x1=2.0)]
    surge = [objective(each, translation(1, 0, 0)) for each in neutral]
    q = np.abs(rates(legs, twist))
    yield "F in the eight poses, m²", ", ".join(f"{each:.2f}" for each in F)
    yield "worst pose", str(int(np.argmin(F)) + 1)
    yield "the worst F with a base of 2 m, m²", f"{min(wide):.2f}"
    yield "F of surge in the first pose, for this design and with a base of 2 m", f"{surge[0]:.2f} and {surge[1]:.2f}"
    yield "torque about the roll axis in the worst pose, legs of 40 kN", f"{40 * sum(q):.0f} kN m"
    yield "roll speed in the worst pose, legs of 1 m/s", f"{math.degrees(1 / max(q)):.0f} deg/s"
    yield (
        "roll resolution in the worst pose, leg lengths known to 0.1 mm",
        f"{math.degrees(1e-4 / math.sqrt(worst)) * 1000:.1f} mdeg",
    )


def states(name: str) -> list[RobotState]:
    solution = solved(name)
    return [evaluate(solution.nlp, solution.x, k) for k in range(solution.case.pose_count)]


def placed_with(state: RobotState, **values: float) -> Legs:
    case = load_case("flight-simulator")
    x = {name: np.array([values.get(name, float(np.ravel(each)[0]))]) for name, each in state.parameters.items()}
    return placed(case, replace(state, parameters=x))


NUMBERS: dict[str, Callable[[], Iterator[tuple[str, str]]]] = {
    "peg-in-hole": numbers_of_the_peg,
    "drilling-spindle": numbers_of_the_drill,
    "camera-mount": numbers_of_the_camera,
    "free-wrist": numbers_of_the_wrist,
    "haptic-device": numbers_of_the_haptic_device,
    "flight-simulator": numbers_of_the_simulator,
}


@ALL
def test_the_numbers_of_the_page_are_those_of_the_springs(name: str) -> None:
    (section,) = re.findall(rf"\n## [^\n]*\n\n[^\n]*cases/{name}\.toml.*?(?=\n## |\Z)", PAGE, flags=re.DOTALL)
    rows = [tuple(line.strip("| ").split(" | ")) for line in section.splitlines() if line.startswith("| ")]
    assert rows[1:] == list(NUMBERS[name]())
    assert f"figures/{name}.png" in section
    assert (Path(__file__).parents[2] / "docs" / "figures" / f"{name}.png").is_file()
