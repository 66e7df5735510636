"""Limits on joints, links and actuators of robots given joint by joint, held to forward kinematics in numpy."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from screwsynth.models import Model, Substitution, robot

Array = NDArray[np.float64]
Place = tuple[Array, Array]

B, E, A, M = [1.0, 0.1, 0.0], [1.1, -0.2, 0.5], [0.6, 0.2, 1.1], [0.8, 0.3, 0.6]


def joint(kind: str, at: list[float], *axes: list[float], **others: Any) -> dict[str, Any]:
    own: dict[str, Any] = {"axis": axes[0]} if len(axes) == 1 else {"axes": list(axes)} if axes else {}
    return {"type": kind, "at": at, **own, **others}


DRIVEN = {"actuated": True}
U1, U2 = joint("U", B, [1, 0.1, 0], [0, 1, 0.2]), joint("U", A, [0.2, 1, 0], [1, 0, 0.3])
#: Limbs of every form of opening: with the joint at which the path is opened, rods, and joints that are taken as one.
LIMBS = {
    "spherical at the end": [joint("R", B, [0, 1, 0]), joint("P", B, [-0.4, 0.1, 1.1], **DRIVEN), joint("S", A)],
    "driven rod": [U1, joint("P", B, [-0.4, 0.1, 1.1], **DRIVEN), joint("S", A)],
    "driven rod, slide aside": [U1, joint("P", M, [0.1, 0.2, 1], **DRIVEN), joint("S", A)],
    "driven rod, slide against": [U1, joint("P", M, [0.1, 0.2, -1], **DRIVEN), joint("S", A)],
    "rod from the platform": [joint("S", B), joint("P", M, [0.1, 0.2, 1], **DRIVEN), U2],
    "crank and rod": [joint("R", B, [0, 1, 0], **DRIVEN), joint("U", E, [1, 0, 0.2], [0.1, 1, 0]), joint("S", A)],
    "rod before a hinge": [joint("U", E, [1, 0, 0.2], [0, 1, 0]), joint("S", A), joint("R", [0.4, 0, 0.6], [0, 1, 0.3], **DRIVEN)],
    "universal": [U1, joint("P", M, [-0.4, 0.1, 1.1], **DRIVEN), U2],
    "hinge": [joint("R", B, [0, 1, 0.1], **DRIVEN), joint("R", E, [0, 1, 0]), joint("R", A, [0.1, 1, 0])],
    "helical": [joint("H", B, [0, 0.2, 1], pitch=0.1), joint("P", B, [0, 1, 0], **DRIVEN), joint("R", E, [1, 0, 0]), joint("U", A, [1, 0.1, 0], [0, 1, 0])],
    "cylindrical": [joint("C", B, [0, 0.2, 1]), joint("R", E, [1, 0, 0], **DRIVEN), joint("U", A, [1, 0.1, 0], [0, 1, 0])],
    "two hinges as one": [joint("R", B, [1, 0, 0]), joint("R", B, [0, 1, 0.4]), joint("P", M, [-0.4, 0.1, 1.1], **DRIVEN), U2],
    "three hinges as one": [joint("R", B, [0, 1, 0], **DRIVEN), joint("R", E, [0, 1, 0.2]), joint("R", A, [1, 0, 0]), joint("R", A, [0.3, 1, 0]), joint("R", A, [0, 0.2, 1])],
    "hinge and universal as one": [joint("R", B, [0, 1, 0], **DRIVEN), joint("R", E, [0, 1, 0.2]), joint("R", A, [1, 0, 0]), joint("U", A, [0.3, 1, 0], [0, 0.2, 1])],
    "parallelogram": [joint("R", B, [0, 1, 0], **DRIVEN), joint("R", E, [0, 1, 0]), joint("Pa", E, [1, 0, 0.3], to=A), joint("R", A, [0, 1, 0.1])],
}  # fmt: skip


def turn_about(axis: list[float], angle: float) -> Array:
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K)


def moved(each: dict[str, Any], q: Array) -> Place:
    """Displacement of a joint's far side by finite coordinates: R and t of ``x -> R x + t``."""
    p, kind = np.array(each["at"]), each["type"]
    if kind == "P":
        return np.eye(3), q[0] * np.array(each["axis"]) / np.linalg.norm(each["axis"])
    if kind == "Pa":
        rod = np.array(each["to"]) - p
        return np.eye(3), turn_about(each["axis"], q[0]) @ rod - rod
    if kind == "S":
        R = turn_about(list(q), float(np.linalg.norm(q)))
    elif kind == "U":
        R = turn_about(each["axes"][0], q[0]) @ turn_about(each["axes"][1], q[1])
    else:
        R = turn_about(each["axis"], q[0])
    along = q[1] if kind == "C" else q[0] * each.get("pitch", 0.0)
    step = along * np.array(each.get("axis", [0, 0, 0])) / np.linalg.norm(each.get("axis", [1]))
    return R, p - R @ p + step


def forward(limb: list[dict[str, Any]], coordinates: list[Array]) -> list[Place]:
    """Displacement of every body from the base on, the platform last."""
    places: list[Place] = [(np.eye(3), np.zeros(3))]
    for each, q in zip(limb, coordinates, strict=True):
        R, t = places[-1]
        own, step = moved(each, q)
        places.append((R @ own, R @ step + t))
    return places


def unknowns_at(model: Model, platform: Place) -> Array:
    """Unknowns that close the loops with the platform at a place, from home."""
    own = Substitution.identity(model)
    loops, closure = (
        ca.vertcat(ca.SX(0, 1), *[each.expression for each in part]) for part in (model.loops, model.closure)
    )
    slopes = ca.jacobian(closure, own.unknowns)
    function = ca.Function("loops", own.all, [ca.densify(each) for each in (closure, slopes, loops)])
    z = np.zeros(len(model.unknowns))
    for _ in range(30):
        residual, J, every = (each.full() for each in function(np.zeros(0), z, *platform))
        z = z - np.linalg.lstsq(J, residual.ravel(), rcond=1e-10)[0] if len(z) else z
    assert np.abs(every).max(initial=0.0) < 1e-11
    return z


def measured(model: Model, platform: Place) -> dict[str, Array]:
    """Coordinates of the model's joints by label, with the platform at a place."""
    outputs = [ca.vertcat(ca.SX(0, 1), *[one.measured for one in each.coordinates]) for each in model.joints]
    function = ca.Function("joints", Substitution.identity(model).all, [ca.densify(each) for each in outputs])
    values = function.call([np.zeros(0), unknowns_at(model, platform), *platform])
    return {each.label: np.array(value).ravel() for each, value in zip(model.joints, values, strict=True)}


SIZES = {"U": 2, "C": 2, "S": 3}


def coordinates_of(limb: list[dict[str, Any]], seed: int) -> list[Array]:
    rng = np.random.default_rng(seed)
    reach = {"P": 0.15}
    return [rng.uniform(-1, 1, SIZES.get(each["type"], 1)) * reach.get(each["type"], 0.5) for each in limb]


@pytest.mark.parametrize("name", LIMBS)
def test_coordinates_of_joints_are_those_of_forward_kinematics(name: str) -> None:
    limb = LIMBS[name]
    model = robot(name="limb", limb=[{"joints": limb}])
    for seed in range(3):
        given = coordinates_of(limb, seed)
        found = measured(model, forward(limb, given)[-1])
        for k, (each, q) in enumerate(zip(limb, given, strict=True)):
            expected = [] if each["type"] == "S" else q
            assert found[f"1:{k + 1}"] == pytest.approx(expected, abs=1e-8)
