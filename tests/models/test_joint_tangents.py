"""Screws against equations: motions that keep all loops closed are those in which the constraints do no work.

The loop equations know nothing of the screws that F and the actuator rates are made of, so that each checks the other.
"""

import tomllib

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from screwsynth.models import (
    Model,
    Substitution,
    Velocities,
    constraint_rows,
    instantiate,
    matrix_from_cayley,
    rank_of_rows,
    robot,
    robot_function,
)

THREE = "repeat = { count = 3 }\n"
SIX = "repeat = { angles = [0, 60, 110, 170, 240, 300] }\n"
CUBE = "repeat = { count = 3, axis = [1, 1, 1] }\n"
R, S = '{ type = "R", at = "B", axis = "y" }', '{ type = "S", at = "A" }'
P = '{ type = "P", at = "B", axis = "A - B", actuated = true }'
SLIDE = '{ type = "P", at = "E", axis = "z + 0.2*x", actuated = true }'


def joint(kind: str, at: str, rest: str) -> str:
    return f'{{ type = "{kind}", at = "{at}", {rest} }}'


#: Repetition, joints, and the freedoms that the robot has.
LIMBS: dict[str, tuple[str, list[str], int]] = {
    "SPR": (THREE, [joint("S", "B", "").replace(",  }", " }"), P, joint("R", "A", 'axis = "y"')], 3),
    "RUU": (
        THREE,
        [
            joint("R", "B", 'axis = "y", actuated = true'),
            joint("U", "E", 'axes = ["y", "x"]'),
            joint("U", "A", 'axes = ["x", "y"]'),
        ],
        3,
    ),
    "PCU": (
        THREE,
        [
            joint("P", "B", 'axis = "z", actuated = true'),
            joint("C", "B", 'axis = "y"'),
            joint("U", "A", 'axes = ["x", "y"]'),
        ],
        3,
    ),
    "RHS": (THREE, [joint("R", "B", 'axis = "y", actuated = true'), joint("H", "E", 'axis = "y", pitch = 0.3'), S], 3),
    "two actuators": (THREE, [R.replace(" }", ", actuated = true }"), P, S], 3),
    "six hinges": (
        THREE,
        [
            joint("R", "B", 'axis = "x", actuated = true'),
            joint("R", "B", 'axis = "y"'),
            joint("R", "E", 'axis = "y"'),
            joint("R", "E + 0.2*z", 'axis = "x + 0.3*z"'),
            joint("R", "A", 'axis = "z"'),
            joint("R", "A + 0.1*x", 'axis = "x"'),
        ],
        6,
    ),
    "slide beside its rod": (SIX, [joint("U", "B", 'axes = ["x", "y"]'), SLIDE, S], 6),
    "slide beside its line": (THREE, [R, SLIDE, S], 3),
    "rod to the base": (
        THREE,
        [S.replace('"A"', '"B"'), joint("U", "E", 'axes = ["x", "y"]'), joint("R", "A", 'axis = "y", actuated = true')],
        6,
    ),
    "slides alone": (
        CUBE,
        [
            joint("P", "B", 'axis = "x", actuated = true'),
            joint("P", "B", 'axis = "y"'),
            joint("P", "B", 'axis = "z"'),
        ],
        3,
    ),
}


def check_tangents(model: Model, freedoms: int) -> None:
    """Check the tangents of all loop equations at a closed configuration away from home."""
    rng = np.random.default_rng(0)
    c, p, u = SX.sym("c", 3), SX.sym("p", 3), SX.sym("u", len(model.unknowns))
    omega, v = SX.sym("omega", 3), SX.sym("v", 3)
    R, position = (SX.eye(3) + ca.skew(omega)) @ matrix_from_cayley(c), p + v + ca.cross(omega, p)
    typical = np.array([item.typical[0] for item in model.parameters])
    dimensions = SX(typical) if typical.size else SX(0, 1)
    here = instantiate(model, Substitution(dimensions, u, R, position), SX(0.7), [SX.zeros(6)])
    quantities = ca.vertcat(SX(0, 1), *here.quantities)
    moving = ca.vertcat(omega, v, u)
    outputs = [here.loops, ca.jacobian(here.loops, moving), here.jacobian, here.driven, here.relations]
    outputs += [ca.jacobian(quantities, moving)]
    at = ca.vertcat(c, p, u)
    function = ca.Function("here", [at, omega, v], [ca.densify(each) for each in outputs])
    loops = here.loops
    still = ca.substitute(loops, ca.vertcat(omega, v), SX.zeros(6))
    closing = ca.Function("closing", [at], [ca.densify(still), ca.densify(ca.jacobian(still, at))])
    size = max(1.0, float(np.abs(model.home).max()))
    x = np.hstack([np.zeros(3), model.home, np.zeros(len(model.unknowns))])
    assert np.abs(closing(x)[0].full()).max(initial=0.0) < 1e-12  # home is closed
    x = x + 0.05 * np.hstack([rng.normal(size=3), size * rng.normal(size=3), rng.normal(size=len(model.unknowns))])
    for _ in range(40):
        residual, slopes = (each.full() for each in closing(x))
        x = x - np.linalg.lstsq(slopes, residual.ravel(), rcond=1e-9)[0]
    found = function(x, np.zeros(3), np.zeros(3))
    residual, slopes, J, driven, relations, quantity_slopes = (each.full() for each in found)
    assert np.abs(residual).max(initial=0.0) < 1e-12
    values, right = np.linalg.svd(slopes)[1:] if slopes.size else (np.zeros(0), np.eye(moving.numel()))
    tangents = right[int(np.count_nonzero(values > 1e-8 * values.max(initial=1e-300))) :]
    constraints = constraint_rows(model, Velocities(J, driven, relations), x[3:6])
    work = np.hstack([constraints[:, 3:], constraints[:, :3]])
    assert np.abs(work @ tangents[:, :6].T).max(initial=0.0) < 1e-12
    rank = rank_of_rows(constraints, x[3:6], size)
    assert np.linalg.matrix_rank(tangents[:, :6], tol=1e-7) == 6 - rank == freedoms
    assert model.generic is not None
    assert 6 - model.generic.constraints == freedoms
    owners = [owner for quantity in model.quantities for owner in quantity.owners]
    for limb in dict.fromkeys(each.limb for each in model.actuators):
        rows = [k for k, row in enumerate(model.frame_rows) if row.limb == limb]
        own = [k for k, each in enumerate(model.actuators) if each.limb == limb]
        resisted = J[rows] @ np.hstack([tangents[:, 3:6], tangents[:, :3]]).T
        rates = np.linalg.lstsq(driven[np.ix_(rows, own)], resisted, rcond=None)[0]
        expected = quantity_slopes[[owners.index(model.actuators[k].name) for k in own]] @ tangents.T
        assert rates == pytest.approx(expected, abs=1e-10 * size)


@pytest.mark.parametrize("name", LIMBS)
def test_limbs_of_many_kinds(name: str) -> None:
    repeat, joints, freedoms = LIMBS[name]
    points = "points = { B = [1, 0, 0], A = [0.6, 0, 1.1], E = [1.2, 0.1, 0.5] }\n"
    text = f"[[limb]]\n{repeat}{points}joints = [{', '.join(joints)}]\n"
    home = (0, 0, 0) if repeat == CUBE else (0, 0, 1.1)
    check_tangents(robot(name=name, home=home, **tomllib.loads(text)), freedoms)


@pytest.mark.parametrize("name", ["3-upu", "6-rus", "delta", "delta-parallelogram", "planar-3-rrr", "spherical-3-rrr"])
def test_robots_of_the_gallery(name: str) -> None:
    check_tangents(robot_function(name)(), 6 if name == "6-rus" else 3)
