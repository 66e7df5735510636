"""Symmetric hexapods are hexapods whose joints are computed beside them."""

import numpy as np
import pytest

from screwsynth.models import ModelError, hexapod
from screwsynth.nlp import Case, Free, Rotation, Task, evaluate, formulate, solve

TASK = Task.screw("max", axis=[1, 2, 3], point=[2, -1, 20], pitch=1.5)
POSITION, ROTATION = (1.0, -2.0, 33.0), Rotation([1, 2, 0.5], 0.3)
#: For each symmetry: given leg, whether it is reflected, and by how many degrees it is turned, for legs 1 to 6.
LEGS = {
    "none": [(k, False, 0) for k in range(1, 7)],
    "mirror": [(1, False, 0), (1, True, 0), (3, False, 0), (4, False, 0), (4, True, 0), (3, True, 0)],
    "threefold": [(1, False, 0), (2, False, 0), (1, False, 120), (2, False, 120), (1, False, 240), (2, False, 240)],
    "threefold-mirror": [(1, mirrored, turn) for turn in (0, 120, 240) for mirrored in (False, True)],
}


def image(joint: np.ndarray, mirrored: bool, degrees: float) -> list[float]:
    """The image of a joint in cylindrical coordinates."""
    radius, azimuth = np.hypot(joint[0], joint[1]), np.degrees(np.arctan2(joint[1], joint[0]))
    azimuth = np.radians((-azimuth if mirrored else azimuth) + degrees)
    return [float(radius * np.cos(azimuth)), float(radius * np.sin(azimuth)), float(joint[2])]


@pytest.mark.parametrize("symmetry", list(LEGS))
def test_a_symmetric_hexapod_is_the_hexapod_with_its_images(symmetry: str) -> None:
    random = np.random.default_rng(3)
    model = hexapod(symmetry=symmetry)  # type: ignore[arg-type]
    given = {item.name: np.array(item.typical) + random.uniform(-2, 2, 3) for item in model.parameters}
    assert sorted(given) == sorted(
        f"{plate}_{leg}" for plate in ("base", "platform") for leg in {k for k, *_ in LEGS[symmetry]}
    )
    whole = {
        f"{plate}_{number}": image(given[f"{plate}_{leg}"], mirrored, degrees)
        for plate in ("base", "platform")
        for number, (leg, mirrored, degrees) in enumerate(LEGS[symmetry], 1)
    }
    states = [
        evaluate(formulate(Case(robot, values, POSITION, [TASK], ROTATION)), np.zeros(0))
        for robot, values in (
            (model, {name: list(map(float, each)) for name, each in given.items()}),
            (hexapod(), whole),
        )
    ]
    assert np.allclose(states[0].jacobian, states[1].jacobian, rtol=0, atol=1e-12)
    assert [mark.parameter for mark in model.scene.marks] == list(given)


def test_free_numbers_keep_the_symmetry_and_move_every_leg() -> None:
    model = hexapod(symmetry="threefold-mirror")
    parameters = {"base_1": [Free(8, 13), Free(-5, -3), 0.0], "platform_1": [5.5, -5.5, 0.0]}
    case = Case(model, parameters, (0, 0, 30), [Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=3)])
    solution = solve(case, starts=3)
    assert solution.status.is_answer
    # By symmetry the legs of each hand have one rate in a screw about the axis of symmetry.
    assert solution.state is not None
    rates = solution.state.rates
    assert np.allclose(rates[0::2], rates[0], rtol=1e-9)
    assert np.allclose(rates[1::2], rates[1], rtol=1e-9)
    assert solution.nlp.n == 2


def test_a_symmetry_that_does_not_exist() -> None:
    with pytest.raises(ModelError, match="symmetry"):
        hexapod(symmetry="fourfold")  # type: ignore[arg-type]
