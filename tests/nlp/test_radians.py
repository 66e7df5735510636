"""Angles are radians in Python: one in degrees is refused with its size in both, and one of a file never."""

import re
import tomllib
from collections.abc import Callable
from math import pi, radians
from typing import Any

import pytest
from builders import case_from, starter_tables

from screwsynth.models import robot_function, stewart_gough
from screwsynth.nlp import (
    BaseJointAngle,
    Case,
    CaseError,
    Free,
    JointMotion,
    Limits,
    MountingPose,
    Pose,
    QuantityLimit,
    Rotation,
    Task,
    TurnKind,
    Turns,
    Workspace,
)

TASK = Task.screw("max", axis=(2, 2, 1), point=(2, 3, 6), pitch=1)
OWN = {"x1": 12.0, "x2": 8.0, "x3": radians(30), "x4": radians(8)}


def plain(**changes: Any) -> Case:  # noqa: ANN401 - numbers of a case
    """A case of six legs with something else in it."""
    given: dict[str, Any] = {"parameters": OWN, "position": (0, 0, 30)}
    return Case(model=stewart_gough(), tasks=[TASK], **(given | changes))


def delta(**changes: Any) -> Case:  # noqa: ANN401 - numbers of a case
    """A case of a Delta with another number in it, or with limits."""
    model = robot_function("delta")()
    parameters = {item.name: item.typical[0] for item in model.parameters} | changes.pop("parameters", {})
    return Case(model=model, parameters=parameters, position=model.home, tasks=[TASK], **changes)


@pytest.mark.parametrize(
    ("make", "key", "angle"),
    [
        (lambda: plain(parameters=OWN | {"x3": 30}), "robot.parameters.x3", 30),
        (lambda: plain(parameters=OWN | {"x3": Free(0.1, 30, 20)}), "robot.parameters.x3.max", 30),
        (lambda: plain(rotation=Rotation((0, 0, 1), 30)), "pose.rotation.angle", 30),
        (lambda: plain(rotation=Rotation(None, Free(-30, 30))), "pose.rotation.angle.min", -30),
        (lambda: plain(further=[Pose((0, 0, 9), Rotation((0, 0, 1), 45))]), "pose[1].rotation.angle", 45),
        (lambda: plain(limits=Limits(BaseJointAngle(5))), "limits.base_joint_angle.max", 5),
        (
            lambda: plain(limits=Limits(BaseJointAngle(1, about=MountingPose((0, 0, 20), angle=15)))),
            "limits.home.angle", 15,
        ),
        (
            lambda: plain(workspace=Workspace((0, 0, Free(20, 30)), Turns(TurnKind.ANY_AXIS, (Free(-20, 20),)))),
            "workspace.rotation.angle.min", -20,
        ),
        (
            lambda: plain(
                workspace=Workspace((0, 0, 30), Turns(TurnKind.ROLL_PITCH_YAW, (0.0, Free(0, 0.1), Free(0, 20))))
            ),
            "workspace.rotation.yaw.max", 20,
        ),
        # Of these a file may state any number.
        (lambda: delta(parameters={"tilt": 20}), "robot.parameters.tilt", 20),
        (lambda: delta(limits=Limits(QuantityLimit("actuator_angle", max=45))), "limits.actuator_angle.max", 45),
        (lambda: delta(limits=Limits(JointMotion("1:1", max=40))), "limits.joint.1:1.max", 40),
    ],
)  # fmt: skip
def test_degrees_in_the_place_of_radians_are_refused_in_both(make: Callable[[], Case], key: str, angle: float) -> None:
    words = f"; {angle} rad = {angle * 180 / pi:.1f} deg; angles are radians in Python"
    with pytest.raises(CaseError, match=rf"^{re.escape(key)} = .*{re.escape(words)}$") as found:
        make()
    assert found.value.key == key
    assert found.value.value == pytest.approx(angle * 180 / pi)


def test_numbers_that_are_no_angles_and_angles_up_to_a_turn_are_taken() -> None:
    assert plain(rotation=Rotation((0, 0, 1), 2 * pi)).rotation.angle == 2 * pi
    assert delta(parameters={"tilt": -2 * pi}).parameters["tilt"] == (-2 * pi,)
    with pytest.raises(CaseError) as found:
        plain(parameters=OWN | {"x1": -1.0})
    assert "rad" not in str(found.value)


def test_a_file_has_degrees_and_no_word_of_radians() -> None:
    tables = starter_tables("delta")
    tables["robot"]["parameters"]["tilt"] = 400
    case = case_from(tables, "delta")
    assert case_from(tomllib.loads(case.to_toml())).parameters["tilt"] == case.parameters["tilt"]
    tables["pose"]["rotation"] = {"angle": 400}
    with pytest.raises(CaseError, match=r"must be at most 179 deg in size with the axis free$"):
        case_from(tables, "delta")
