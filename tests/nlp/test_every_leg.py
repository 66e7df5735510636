"""Every limit holds at every leg, joint, pair and pose, whatever a program keeps: against other formulas."""

from __future__ import annotations

import copy
import math
import tomllib
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from builders import Array, case_from, soaked, turn_about
from casadi import SX
from generated import COMPILERS, written
from measures import circle_joints, leg_measures

from screwsynth.nlp import Case, Nlp, formulate, load_case, load_compiled, sensitivities, solve
from screwsynth.nlp.case.limits.constraint import NUMBER, BoundedConstraint, Constraint
from screwsynth.nlp.evidence.sensitivity import Hindrance
from screwsynth.nlp.program.places import FreeRotation
from screwsynth.nlp.program.repeated import without_repeated
from screwsynth.nlp.program.sampling import starting_points

HOME = np.array([0, 0, 20.0])


def measured(numbers: dict[str, float], R: Array, twist: Array) -> dict[str, float]:
    """What each limit of the hexapod speaks of, over all legs."""
    base, platform = circle_joints(numbers)
    p = np.array([numbers["p_x"], numbers["p_y"], numbers["p_z"]])
    at_home = HOME + platform - base
    u = p + platform @ R.T - base
    u /= np.linalg.norm(u, axis=1)[:, None]
    squares = (u @ twist[3:] + np.cross(base, u) @ twist[:3]) ** 2
    share = {"rate_share.max": float((squares / squares.sum()).max())}
    return leg_measures(base, platform, R, p, at_home, at_home @ R.T) | share


def kept(nlp: Nlp, x: Array, p: Array) -> dict[str, float]:
    """The worst number of each limit in the constraints of a program, at any values of variables and arguments."""
    constraints = nlp.program.constraints
    expressions = [each.expression if each.exact is None else each.exact for each in constraints]
    values = ca.Function("g", [nlp.program.x, nlp.program.p], [ca.vertcat(*expressions)])(x, p).full().ravel()
    found: dict[str, list[float]] = {}
    for each, value in zip(constraints, values, strict=True):
        for key in each.keys:
            if key and (key.endswith(".min") or "max" in key or "footprint" in key):
                number = float(value) if each.exact is not None else each.reading.from_value(float(value))
                found.setdefault(key, []).append(number)
    return {key: min(values) if key.endswith(".min") else max(values) for key, values in found.items()}


@pytest.mark.parametrize("name", ["hexapod-machining", "hexapod-workspace", "free-wrist", "drilling-spindle"])
def test_constraints_judge_every_leg_at_any_numbers(name: str) -> None:
    # The arguments are numbers of the program like the variables: C sets them, and sensitivities vary them.
    nlp = formulate(load_case(name))
    rng, names = np.random.default_rng(3), [each.name for each in nlp.program.arguments]
    rotation = nlp.program.places.rotations[0]
    for x in starting_points(nlp, 40, 5):
        p = nlp.arguments.copy()
        for k, each in enumerate(names):
            if each in ("p_x", "p_y"):
                p[k] += rng.uniform(-3, 3)
        (twist,) = nlp.program.places.twists
        p[twist] += rng.normal(size=6)
        numbers = dict(zip(names, p, strict=True)) | {
            each.name: value for each, value in zip(nlp.program.variables, x, strict=True)
        }
        if isinstance(rotation, FreeRotation):
            q = x[list(rotation.q)]
            size = float(np.linalg.norm(q))
            R = turn_about(q / size, 2 * math.asin(size)) if size else np.eye(3)
        elif "axis_x" in names:
            axis = np.array([numbers[f"axis_{c}"] for c in "xyz"])
            R = turn_about(axis / np.linalg.norm(axis), numbers["angle"])
        else:
            R = np.eye(3)
        exact, own = measured(numbers, R, p[twist]), kept(nlp, x, p)
        for key, value in own.items():
            if key in exact:
                assert value == pytest.approx(exact[key], rel=1e-6, abs=1e-6), key


def test_what_is_one_function_is_one_constraint_and_no_other() -> None:
    program = formulate(load_case("hexapod-machining")).program
    counts = {
        key: sum(key in each.name for each in program.constraints) for key in ("leg_clearance", "spacing", "foot")
    }
    assert counts == {"leg_clearance": 15, "spacing": 8, "foot": 2}

    x, p = SX.sym("x", 3), SX.sym("p", 2)
    a, b, c = ca.vertsplit(x)
    third = 2 * math.pi / 3

    def left(*expressions: SX, key: str = "k.min") -> list[int]:
        items = [
            BoundedConstraint(Constraint(str(k), each, NUMBER, (key, "")), 0.0, math.inf)
            for k, each in enumerate(expressions)
        ]
        return [int(item.constraint.name) for item in without_repeated(items, x, p)]

    def chord(k: int) -> SX:
        return (a * ca.cos(k * third + b) - a * ca.cos(k * third - b)) ** 2 + (
            a * ca.sin(k * third + b) - a * ca.sin(k * third - b)
        ) ** 2

    root = ca.sqrt(1 - c**2)
    assert left(chord(0), chord(1), chord(2), 4 * a**2 * ca.sin(b) ** 2) == [0]
    assert left((root + a) * (root - a), 1 - c * c - a * a) == [0]
    assert left(a * b + p[0], p[0] + b * a, a * b) == [0, 2]
    # Alike at most points of a box, or nearly so everywhere.
    assert left(ca.fmax(a, b - 100), ca.fmax(a, c - 100)) == [0, 1]
    assert left(ca.fmin(a, b), ca.fmin(a, b + 1e-10 * c)) == [0, 1]
    assert left(a + 1e-11 * b, a) == [0, 1]
    assert left(ca.fmax(a * b + b, c), ca.fmax(b * (1 + a), c)) == [0]


TABLES = tomllib.loads(load_case("hexapod-machining").to_toml())


def limited(rng: np.random.Generator) -> Case:
    """The hexapod with joints near each other, and with a random task and random limits."""
    tables = copy.deepcopy(TABLES)
    limits = tables["limits"]
    limits["joint_spacing"]["min"] = 2
    limits["leg_length"] = {"min": rng.uniform(18, 25), "max": rng.uniform(30, 40)}
    limits["leg_clearance"]["min"] = rng.uniform(1.5, 4.5)
    limits["rate_share"]["max"] = rng.uniform(0.4, 0.7)
    for key in ("base_joint_angle", "platform_joint_angle"):
        limits[key]["max"] = rng.uniform(12, 35)
    tables["task"] = [
        {"axis": rng.normal(size=3).tolist(), "point": rng.uniform(-12, 12, 3).tolist(), "pitch": 0.2, "sense": "max"}
    ]
    tables["solve"]["starts"] = 8
    tables.pop("expect", None)
    return case_from(tables, "random")


@pytest.mark.parametrize("count", soaked([2, 12], [2]))
def test_no_solve_with_random_limits_answers_a_wrong_design(count: int) -> None:
    rng, answers = np.random.default_rng(count), 0
    for _ in range(count):
        case = limited(rng)
        solution = solve(case)
        if not solution.status.is_answer:
            continue
        answers += 1
        state = solution.state
        numbers = {name: float(value[0]) for name, value in state.parameters.items()}
        numbers |= dict(zip(("p_x", "p_y", "p_z"), state.position, strict=True))
        twist = np.asarray(case.tasks[0].twist, dtype=np.float64)
        found = measured(numbers, np.asarray(state.rotation), twist)
        for limit in case.limits:
            ends = {f"{limit.key}.{end}": getattr(limit, end, None) for end in ("min", "max")}
            for key, number in ends.items():
                if number is not None and key in found:
                    over = number - found[key] if key.endswith("min") else found[key] - number
                    assert over <= 1e-6, (key, number, found[key])
    assert answers


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hexapod-machining", "free-wrist"])
def test_no_c_with_random_limits_answers_a_wrong_design(name: str, tmp_path: Path) -> None:
    if not COMPILERS:
        pytest.skip("no C compiler is installed")
    case, count = load_case(name), 300
    compiled, nlp, rng = load_compiled(written(case, tmp_path)), formulate(case), np.random.default_rng(8)
    names = [each.name for each in nlp.program.arguments]
    size = nlp.upper[0] / 32
    p = np.tile(nlp.arguments, (count, 1))
    (twist,) = nlp.program.places.twists
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    p[:, twist] = np.hstack([axes, np.cross(rng.uniform(-15, 15, (count, 3)) * size, axes) + 0.3 * size * axes])
    for each in ("p_x", "p_y"):
        if each in names:
            p[:, names.index(each)] = rng.uniform(-4, 4, count) * size
    limits = {
        each.key: each.default * rng.uniform(*((0.5, 1.2) if each.key.endswith("min") else (0.8, 1.6)), count)
        for each in compiled.limits
        if not each.key.startswith("angle")
    }
    limits["leg_length.max"] = np.maximum(limits["leg_length.max"], 1.05 * limits["leg_length.min"])
    found = compiled.solve(p=p, limits=limits, seeds=4)
    assert found.ok.mean() > 0.9
    for k in np.flatnonzero(found.ok):
        numbers = dict(zip(names, p[k], strict=True)) | {
            each.name: value for each, value in zip(nlp.program.variables, found.x[k], strict=True)
        }
        values = measured(numbers, found.R[k].reshape(3, 3), p[k, list(twist)])
        for key, number in limits.items():
            over = number[k] - values[key] if key.endswith("min") else values[key] - number[k]
            assert over <= 1e-6 * max(1.0, number[k]), (key, k)


def test_a_limit_that_binds_on_all_legs_alike_gives_a_corner_and_no_slope() -> None:
    case = load_case("free-wrist")
    own = solve(case)
    rows = {row.name: row for row in sensitivities(own.nlp, own.x)}
    assert {name: row.hindrance for name, row in rows.items()} == dict.fromkeys(rows, Hindrance.CORNER)
    assert all(row.derivative is None for row in rows.values())

    def moved(step: float) -> float:
        position = (step, *case.position[1:])
        return solve(replace(case, position=position)).F

    # The least F grows with a step to either side: the slopes on both sides have one sign.
    slopes = [(moved(step) - own.F) / abs(step) for step in (-0.5, 0.5)]
    assert min(slopes) > 1e-3
