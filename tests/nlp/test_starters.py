"""Starters: every robot's is a case of its own freedoms, which solves to a machine, and has a workspace."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders import EACH_KIND, case_from, soaked, starter_text

from screwsynth.models import Model, WrenchKind, model_names, robot_function, three_upu
from screwsynth.models.joints.robot import robot
from screwsynth.nlp import Case, Status, solve
from screwsynth.nlp.case.pose import Free
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.starter.text import starter_case

#: Freedoms of the robots with fewer than six, and what each one's task is called.
TASKS = {
    **dict.fromkeys(("3-prs", "3-rps", "3-rrs", "3-spr", "exechon"), (3, "translation along z")),
    **dict.fromkeys(("3-puu", "3-upu", "three-upu", "orthoglide", "tripteron"), (3, "translation along z")),
    **dict.fromkeys(("delta", "delta-parallelogram"), (3, "translation along z")),
    **dict.fromkeys(("4-ruu", "4-upu"), (4, "translation along z")),
    **dict.fromkeys(("planar-3-prr", "planar-3-rpr", "planar-3-rrr"), (3, "translation along x")),
    "five-bar": (2, "rotation about z"),
    "spherical-3-rrr": (3, "rotation about z"),
    "tricept": (3, "rotation about x"),
}
#: Robots whose platform never turns, or whose task is possible without a rotation alone; and that turn about one axis.
UPRIGHT = {
    "3-puu", "3-upu", "three-upu", "orthoglide", "tripteron", "delta", "delta-parallelogram", "3-spr", "exechon",
}  # fmt: skip
ONE_AXIS = {"4-ruu", "4-upu", "planar-3-prr", "planar-3-rpr", "planar-3-rrr", "five-bar"}


def with_workspace(text: str) -> str:
    """A starter with its workspace as it is once its comment signs are removed."""
    before, table = text.split("# [workspace]")
    table, after = table.split("\n\n")
    return f"{before}[workspace]{table.replace('# position', 'position').replace('# rotation', 'rotation')}\n\n{after}"


def fixed(case: Case) -> Case:
    """A case at the typical dimensions."""
    return replace(case, parameters={item.name: item.starter or item.typical for item in case.model.parameters})


def name_of(robot: str | Model) -> str:
    """The name of a test's robot, with that of its option."""
    return robot if isinstance(robot, str) else f"{robot.name}-{robot.options['axes']}"


@pytest.mark.parametrize(
    "given",
    soaked(
        [*model_names(), *(three_upu(axes=axes) for axes in ("limb", "snu", "tsai"))], (*EACH_KIND, "stewart-gough")
    ),
    ids=name_of,
)
def test_every_starter_is_solved_to_a_machine_that_makes_its_task(given: str | Model) -> None:
    model = robot_function(given)() if isinstance(given, str) else given
    text = starter_case(model)
    case = case_from(text)
    freedoms, task = TASKS.get(model.name, (6, "screw motion"))
    assert f"this robot has {freedoms} freedoms" in text
    assert case.tasks[0].name == task
    has_turn = isinstance(case.rotation.angle, Free)
    assert has_turn == (model.name not in UPRIGHT)
    assert (has_turn and case.rotation.axis is not None) == (model.name in ONE_AXIS)

    own = solve(case, starts=2).outcomes[0].own
    assert own.status is Status.OPTIMAL
    assert own.state.rank == 6
    assert loops_are_closed(own.nlp, own.x)
    assert len(list(case.limits)) >= 2
    mobility = mobility_of(own.nlp, own.x, own.state)
    if mobility is None:
        # A robot given by its rows: its couples do no work.
        couples = [row.kind is not WrenchKind.FORCE for row in model.wrenches]
        assert np.abs(own.state.rates[couples]).max(initial=0.0) < 1e-9
        assert 6 - sum(couples) == freedoms
    else:
        assert (mobility.freedoms, mobility.constrained, mobility.singularities) == (freedoms, 0.0, ())

    judged = fixed(case_from(with_workspace(text)))
    assert judged.workspace is not None
    assert any(isinstance(value, Free) for value in (*judged.workspace.position, *judged.workspace.turns.angles))
    for value, home in zip(judged.workspace.position, model.home, strict=True):
        lower, upper = (value.lower, value.upper) if isinstance(value, Free) else (value, value)
        assert lower - 1e-9 <= home <= upper + 1e-9


@pytest.mark.parametrize("name", ["stewart-gough", "delta", "exechon"])
def test_the_machine_of_a_starter_is_good_over_its_workspace(name: str) -> None:
    case = fixed(case_from(with_workspace(starter_text(name))))
    assert judge_workspace(case).is_proved


def serial(*joints: dict[str, Any]) -> Model:
    """A robot of one limb."""
    return robot(name="own", home=[0, 0, 3], limb=[{"points": {"B": [2, 0, 0]}, "joints": list(joints)}])


@pytest.mark.parametrize(
    ("joint", "name", "axis", "point", "pitch"),
    [
        ({"type": "P", "axis": [1, 1, 0]}, "translation along an axis", [1, 1, 0], None, math.inf),
        ({"type": "R", "axis": "y"}, "rotation about y", [0, 1, 0], [2, 0, 0], 0),
        ({"type": "H", "axis": "z", "pitch": 0.5}, "screw motion about z", [0, 0, 1], [2, 0, 0], 0.5),
    ],
)
def test_a_robot_of_ones_own_has_the_motion_of_its_joint(
    joint: dict[str, Any], name: str, axis: list[float], point: list[float] | None, pitch: float
) -> None:
    (task,) = tomllib.loads(starter_case(serial({"at": "B", "actuated": True, **joint})))["task"]
    assert (task["name"], task["pitch"]) == (name, pytest.approx(pitch))
    unit = np.array(axis) / np.linalg.norm(axis)
    np.testing.assert_allclose(np.abs(np.dot(task["axis"], unit)), 1, atol=1e-9)
    if point is not None:
        np.testing.assert_allclose(np.cross(np.array(task["point"]) - point, unit), 0, atol=1e-9)
