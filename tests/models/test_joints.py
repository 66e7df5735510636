"""Robots given joint by joint against reference numbers of an independent computation, and against published facts."""

import copy
import math
import tomllib
from collections.abc import Mapping
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from builders import Array, turn_about
from casadi import SX
from robot_gallery import CHI, LENGTH, RANKS, REFERENCE, snu, table

from screwsynth.models import (
    Model,
    Substitution,
    Velocities,
    constraint_rows,
    instantiate,
    matrix_from_cayley,
    rank_of_rows,
    reporting_matrix,
    robot,
    robot_function,
)

RPS = """
home = [0, 0, 1.1]
[[limb]]
repeat = { count = 3 }
points = { B = [1, 0, 0], A = [0.6, 0, 1.1] }
joints = [{ type = "R", at = "B", axis = "y" }, { type = "P", at = "B", axis = "A - B", actuated = true },
          { type = "S", at = "A" }]
"""
PLANAR = """
[[limb]]
repeat = { count = 3 }
points = { B = [1, 0, 0], A = ["0.35*cos(0.2)", "0.35*sin(0.2)", 0], E = "(A + B)/2 + 0.35*y" }
joints = [{ type = "R", at = "B", axis = "z", actuated = true }, { type = "R", at = "E", axis = "z" },
          { type = "R", at = "A", axis = "z" }]
"""


def written(text: str) -> Model:
    return robot(**{"name": "test", **tomllib.loads(text)})


def gallery(name: str, dimensions: Mapping[str, float]) -> Model:
    """A robot of the gallery whose typical dimensions are these."""
    tables = copy.deepcopy(table(name))
    for key, value in dimensions.items():
        tables["dimensions"][key]["typical"] = value
    return robot(**tables)


class Numbers(NamedTuple):
    """The robot in numbers: F and work rates of a twist, rows of the instance, actuators' screws, residuals."""

    F: float
    rates: Array
    J: Array
    driven: Array
    relations: Array
    loops: Array
    quantities: Array
    position: Array

    @property
    def velocities(self) -> Velocities:
        return Velocities(self.J, self.driven, self.relations)


class Robot:
    """A model with fixed dimensions; ``pose`` is a Cayley vector, a position, then the unknowns."""

    def __init__(self, model: Model, length: float = LENGTH, parameters: Mapping[str, float] | None = None) -> None:
        self.model = model
        values = {item.name: item.typical[0] for item in model.parameters} | dict(parameters or {})
        self.home = np.concatenate([np.zeros(3), model.home, np.zeros(len(model.unknowns))])
        pose, twist = SX.sym("pose", len(self.home)), SX.sym("twist", 6)
        dimensions = ca.vertcat(SX(0, 1), *[SX(values[item.name]) for item in model.parameters])
        substitution = Substitution(dimensions, pose[6:], matrix_from_cayley(pose[:3]), pose[3:6])
        here = instantiate(model, substitution, SX(length), [twist])
        quantities = ca.vertcat(SX(0, 1), *here.quantities)
        outputs = [here.F, here.rates, here.jacobian, here.driven, here.relations, here.loops, quantities]
        self._numbers = ca.Function("numbers", [pose, twist], [ca.densify(each) for each in outputs])
        loops = ca.vertcat(here.loops, quantities)
        self._loops = ca.Function("loops", [pose], [ca.densify(loops), ca.densify(ca.jacobian(loops, pose))])
        self._count = here.loops.numel()

    def at(self, pose: Array, twist: Array = CHI) -> Numbers:
        F, rates, J, driven, relations, loops, quantities = (each.full() for each in self._numbers(pose, twist))
        return Numbers(
            float(F.item()), rates.ravel(), J, driven, relations, loops.ravel(), quantities.ravel(), pose[3:6]
        )

    def driven(self, target: Array) -> Array:
        """Return the closed pose near home at which the actuators are away from home by so much."""
        pose = self.home
        for _ in range(40):
            residual, slopes = (each.full() for each in self._loops(pose))
            residual = residual.ravel()
            residual[self._count :] -= target
            pose = pose - np.linalg.lstsq(slopes, residual, rcond=1e-9)[0]
        assert np.abs(residual).max() < 1e-9
        return pose

    def reached(self, position: Array) -> Array:
        """Return the closed pose with a position and without rotation."""
        pose = np.concatenate([np.zeros(3), position, np.zeros(len(self.model.unknowns))])
        for _ in range(40):
            residual, slopes = (each.full()[: self._count] for each in self._loops(pose))
            pose[6:] -= np.linalg.lstsq(slopes[:, 6:], residual.ravel(), rcond=1e-9)[0]
        assert np.abs(residual).max() < 1e-9
        return pose


def work(rows: Array) -> Array:
    """Return rows (m, 6) that multiply a twist (omega, v), from force and moment."""
    return np.hstack([rows[:, 3:], rows[:, :3]])


def actuator_rates(model: Model, here: Numbers) -> Array:
    """Return the rates that leave least of what each limb resists, in the order of the actuators."""
    found = []
    for limb in dict.fromkeys(each.limb for each in model.actuators):
        rows = [k for k, row in enumerate(model.frame_rows) if row.limb == limb]
        own = [k for k, each in enumerate(model.actuators) if each.limb == limb]
        found += list(np.linalg.lstsq(here.driven[np.ix_(rows, own)], here.rates[rows], rcond=None)[0])
    return np.array(found)


@pytest.mark.parametrize("name", REFERENCE)
def test_robots_have_the_numbers_of_an_independent_computation(name: str) -> None:
    dimensions, F, F_feasible, rates, F_driven = REFERENCE[name]
    model, ranks = gallery(name, dimensions), RANKS[name]
    here = Robot(model)
    home = here.at(here.home)
    assert pytest.approx(F, abs=1e-10) == home.F
    constraints = constraint_rows(model, home.velocities, home.position)
    _, values, right = np.linalg.svd(work(constraints))
    rank = int(np.count_nonzero(values > 1e-9))
    assert rank == ranks.constraints == rank_of_rows(constraints, np.zeros(3), 1.0)
    feasible = right[rank:].T @ right[rank:] @ CHI
    moved = here.at(here.home, feasible)
    assert pytest.approx(F_feasible, abs=1e-10) == moved.F
    assert actuator_rates(model, moved) == pytest.approx(np.array(rates), abs=1e-6)
    assert tuple(sum(row.limb == limb for row in model.rows) for limb in model.limbs) == (
        ranks.W if name != "delta" else (2, 2, 2)
    )
    driven = here.at(here.driven(np.full(len(model.actuators), 0.05)))
    assert pytest.approx(F_driven, abs=1e-10) == driven.F
    assert np.abs(driven.loops).max(initial=0.0) < 1e-12
    # The rows of results are a basis of the same wrenches: J'J and so F, singular values and rank are the same.
    for each in (home, driven):
        rows = reporting_matrix(model, each.velocities, each.position) @ each.J
        assert len(rows) == sum(ranks.W)
        assert rows.T @ rows == pytest.approx(each.J.T @ each.J, abs=1e-12)
    assert (model.generic.jacobian, model.generic.constraints) == (6, ranks.constraints)


def test_published_facts_of_the_three_upu_hold() -> None:
    tsai, other = (Robot(model, length=1.0) for model in (gallery("3-upu", {}), robot(**snu())))
    about_z = np.array([0, 0, 1.0, 0, 0, 0])
    values = np.linalg.svd(tsai.at(tsai.home).J, compute_uv=False)[:6]
    assert values == pytest.approx(np.repeat([1.601235, 0.896811, 0.243109], 2), abs=1e-6)
    assert pytest.approx(2.563954, abs=1e-6) == tsai.at(tsai.home, about_z).F
    here = other.at(other.home)
    assert rank_of_rows(here.J, np.zeros(3), 1.0) == 4
    # Constraint singularity: the constraints have rank 1 where they have 3 elsewhere.
    assert rank_of_rows(constraint_rows(other.model, here.velocities, here.position), np.zeros(3), 1.0) == 1
    assert other.model.generic.constraints == 3
    assert pytest.approx(3.0, abs=1e-12) == other.at(other.home, about_z).F
    for angle in (0.0, 0.7, 2.0):
        line = np.array([math.cos(angle), math.sin(angle), 0.0])
        assert other.at(other.home, np.hstack([line, np.cross([0, 0, 1.4], line)])).F < 1e-20


@pytest.mark.parametrize("name", ["delta", "delta-parallelogram"])
def test_inverse_kinematics_of_the_delta_are_those_of_williams(name: str) -> None:
    """Williams, The Delta Parallel Robot: ABB FlexPicker IRB 360; his first motor stands at azimuth -90 degrees."""
    sides = {"rb": 0.567 / math.sqrt(12), "rp": 0.076 / math.sqrt(3), "tilt": 0.0}
    here, turn = Robot(gallery(name, sides)), turn_about([0, 0, 1], math.pi / 2)
    for position, expected in (
        ((0.0, 0.0, -0.9), (-20.547, -20.547, -20.547)),
        ((0.3, 0.5, -1.1), (47.504, -11.569, 21.378)),
    ):
        found = here.at(here.reached(turn @ position)).quantities
        assert np.degrees(found) == pytest.approx(np.array(expected), abs=1e-3)


def test_isotropic_robots_are_isotropic() -> None:
    # Agile Eye: the actuators turn as the platform does, and F = l^2 |omega|^2 for a rotation.
    eye = Robot(robot_function("spherical-3-rrr")())
    turning = eye.at(eye.home, np.hstack([CHI[:3], np.zeros(3)]))
    assert pytest.approx(LENGTH**2 * float(CHI[:3] @ CHI[:3]), abs=1e-14) == turning.F
    assert actuator_rates(eye.model, turning) == pytest.approx(CHI[:3], abs=1e-14)
    moving = np.hstack([np.zeros(3), CHI[3:]])
    # Orthoglide: at its centre alone; Tripteron: everywhere.
    for name, place, same in (
        ("orthoglide", np.zeros(3), True),
        ("orthoglide", np.array([0.05, -0.04, 0.03]), False),
        ("tripteron", np.zeros(3), True),
        ("tripteron", np.array([0.05, -0.08, 0.1]), True),
    ):
        here = Robot(robot_function(name)())
        numbers = here.at(here.reached(place), moving)
        assert (pytest.approx(float(CHI[3:] @ CHI[3:]), abs=1e-12) == numbers.F) is same
        assert (actuator_rates(here.model, numbers) == pytest.approx(CHI[3:], abs=1e-12)) is same


def test_other_ways_to_write_a_limb_give_the_same_robot() -> None:
    home = Robot(written(RPS))
    F, J = home.at(home.home).F, home.at(home.home).J
    passive = """
[[limb]]
joints = [{ type = "U", at = "0*x", axes = ["x", "y"] }, { type = "P", at = "0*x", axis = "z" },
          { type = "S", at = [0, 0, 1.1] }]
"""
    wrist = RPS.replace(
        '{ type = "S", at = "A" }',
        '{ type = "R", at = "A", axis = "x" }, { type = "R", at = "A", axis = "y" },'
        '{ type = "R", at = "A + z", axis = "z" }',
    )
    cylinder = RPS.replace('{ type = "R", at = "B", axis = "y" },', '{ type = "H", at = "B", axis = "y", pitch = 0 },')
    for text in (wrist, RPS + passive, cylinder):
        other = Robot(written(text))
        numbers = other.at(other.home)
        assert pytest.approx(F, abs=1e-14) == numbers.F
        assert pytest.approx(J.T @ J, abs=1e-13) == numbers.J.T @ numbers.J
    moved = Robot(written(wrist)).driven(np.full(3, 0.05))
    assert pytest.approx(REFERENCE["3-rps"][4], abs=1e-10) == Robot(written(wrist)).at(moved).F


def test_a_twist_that_rides_along_with_the_whole_robot_has_the_same_f() -> None:
    turned: dict[str, Any] = tomllib.loads(PLANAR)
    here = Robot(written(PLANAR))
    expected = here.at(here.home).F
    shift = np.array([0.4, -0.7, 0.3])
    for limb in turned["limb"]:
        limb["points"] = {
            "B": "1*x + 0.4*x - 0.7*y + 0.3*z",
            "A": "0.35*cos(0.2)*x + 0.35*sin(0.2)*y + 0.4*x - 0.7*y + 0.3*z",
            "E": "(A + B)/2 + 0.35*y",
        }
        limb["repeat"]["through"] = shift.tolist()
    other = Robot(robot(name="moved", home=shift.tolist(), limb=turned["limb"]))
    twist = np.hstack([CHI[:3], CHI[3:] + np.cross(shift, CHI[:3])])
    assert pytest.approx(expected, abs=1e-13) == other.at(other.home, twist).F
