"""The robots that are given by their rows equal their descriptions joint by joint: F and its gradient."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from screwsynth.models import Model, hexapod, robot, stewart_gough, three_upu
from screwsynth.nlp import Case, Free, Nlp, Rotation, Task, formulate
from screwsynth.nlp.evidence.kkt import close_equations

Array = NDArray[np.float64]
Build = Callable[[], Model]
TWIST = np.array([0.3, -0.5, 0.7, 4.0, 6.0, -2.0])
POINTS = 20


def program(model: Model, rotation: Rotation) -> Nlp:
    """The program in which all dimensions and the pose are free about their typical values and home."""
    parameters = {
        item.name: [Free(value - 5.0, value + 5.0) for value in item.typical]
        if item.dimension.value == "length"
        else Free(item.typical[0] - 0.1, item.typical[0] + 0.1)
        for item in model.parameters
    }
    position = [Free(value - 5.0, value + 5.0) for value in model.home]
    return formulate(Case(model, parameters, position, [Task(TWIST)], rotation, characteristic_length=2.0))


def legs(
    sides: str, dimensions: dict[str, dict[str, object]], points: list[tuple[list[object], list[object]]]
) -> Model:
    """Legs between universal and ball joints at given points of base and platform."""
    return robot(
        sides,
        home=[0, 0, 35],
        dimensions=dimensions,
        limb=[
            {
                "points": {"B": base, "A": [platform[0], platform[1], f"35 + {platform[2]}"]},
                "joints": [
                    {"type": "U", "at": "B", "axes": ["x", "y"]},
                    {"type": "P", "at": "B", "axis": "A - B", "actuated": True},
                    {"type": "S", "at": "A"},
                ],
            }
            for base, platform in points
        ],
    )


def six_six(offset: float, sign: int) -> Model:
    """The 6-6 platform: pairs of joints on two circles, at ``-+x3`` and ``offset -+ sign*x4``."""
    dimensions: dict[str, dict[str, object]] = {
        "x1": {"typical": 12.0},
        "x2": {"typical": 8.0},
        "x3": {"typical": 20.0, "kind": "angle"},
        "x4": {"typical": 8.0, "kind": "angle"},
    }
    points: list[tuple[list[object], list[object]]] = []
    for k in range(3):
        for side in (-1, 1):
            b, a = f"({k}*2*pi/3 + {side}*x3)", f"({k}*2*pi/3 + {side}*({offset!r} + {sign}*x4))"
            points.append(([f"x1*cos{b}", f"x1*sin{b}", 0], [f"x2*cos{a}", f"x2*sin{a}", 0]))
    return legs("6-6", dimensions, points)


def twelve_points() -> Model:
    """Legs between twelve points, with the names of the hexapod's own parameters for their components."""
    given = hexapod()
    dimensions: dict[str, dict[str, object]] = {
        name: {"typical": value}
        for item in given.parameters
        for name, value in zip(item.components, item.typical, strict=True)
    }
    names = [[list(item.components) for item in given.parameters if item.name.startswith(part)] for part in ("b", "p")]
    return legs("12 points", dimensions, [(list(b), list(a)) for b, a in zip(*names, strict=True)])


def upu() -> Model:
    """The 3-UPU with tangential first axes at both ends of each limb."""
    return robot(
        "3-UPU",
        home=[0, 0, 50],
        dimensions={"base_radius": {"typical": 50.0}, "platform_radius": {"typical": 25.0}},
        limb=[
            {
                "repeat": {"count": 3},
                "points": {"B": ["base_radius", 0, 0], "A": ["platform_radius", 0, 50]},
                "joints": [
                    {"type": "U", "at": "B", "axes": ["y", "cross(y, A - B)"]},
                    {"type": "P", "at": "B", "axis": "A - B", "actuated": True},
                    {"type": "U", "at": "A", "axes": ["cross(y, A - B)", "y"]},
                ],
            }
        ],
    )


def gradient(nlp: Nlp, x: Array, count: int) -> Array:
    """Gradient of F by the first numbers, the unknowns behind them keeping the loops closed."""
    found = nlp.program.kernels.derivatives(x, nlp.arguments)
    slope, equal = found.gradient.ravel(), nlp.g_lower == nlp.g_upper
    loops = found.jacobian[equal]
    return slope[:count] - slope[count:] @ np.linalg.lstsq(loops[:, count:], loops[:, :count], rcond=1e-9)[0]


@pytest.mark.parametrize(
    ("by_rows", "by_joints", "rotation"),
    [
        (stewart_gough, lambda: six_six(0.0, 1), Rotation(None, Free(-1.0, 1.0))),
        (lambda: stewart_gough(layout="octahedral"), lambda: six_six(math.pi / 3, -1), Rotation(None, Free(-1.0, 1.0))),
        (hexapod, twelve_points, Rotation(None, Free(-1.0, 1.0))),
        # The rows of the 3-UPU take the lower joints to be parallel to the upper ones: where the platform translates.
        (lambda: three_upu(axes="tsai"), upu, Rotation()),
    ],
    ids=["stewart-gough", "octahedral", "hexapod", "three-upu"],
)
def test_f_and_its_gradient_are_those_of_the_rows(by_rows: Build, by_joints: Build, rotation: Rotation) -> None:
    rows, joints = program(by_rows(), rotation), program(by_joints(), rotation)
    names = [item.name for item in rows.program.variables]
    assert [item.name for item in joints.program.variables][: len(names)] == names
    rng = np.random.default_rng(14)
    for _ in range(POINTS):
        x = rows.centre + rows.scale * rng.uniform(-0.55, 0.55, rows.n)
        closed = close_equations(joints, np.concatenate([x, joints.start[rows.n :]]))
        assert closed[: rows.n] == pytest.approx(x, rel=0, abs=0)
        F = rows.evaluate(x).F
        assert pytest.approx(F, rel=1e-12) == joints.evaluate(closed).F
        expected = rows.program.kernels.derivatives(x, rows.arguments).gradient.ravel()
        assert gradient(joints, closed, rows.n) == pytest.approx(expected, rel=0, abs=1e-11 * max(1, *np.abs(expected)))
