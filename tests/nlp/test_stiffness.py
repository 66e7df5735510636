"""Deflection of platforms whose actuators give way: against a stiffness matrix computed here, and as a limit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from builders import Run, case_from, output_of, saved

from screwsynth.nlp import CaseError, solve
from screwsynth.nlp.case.limits.forces import Deflection
from screwsynth.nlp.evidence.margins import margins_of

K = [2000.0, 2500.0, 3000.0, 3500.0, 4000.0, 4500.0]
NAMES = ["1-", "1+", "2-", "2+", "3-", "3+"]
HEXAPOD = """\
[units]
length = "in"
[robot]
model = "stewart-gough"
layout = "octahedral"
actuator_stiffness = STIFFNESS
parameters = { x1 = 26.5, x2 = X2, x3 = 0, x4 = 5 }
[pose]
position = [1, 2, 20]
rotation = { axis = [1, 2, 3], angle = 10 }
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[[load]]
name = "cutting"
force = [20, 20, -100]
point = [0, 0, 2]
"""
EACH = "{ " + ", ".join(f'"{name}" = {k}' for name, k in zip(NAMES, K, strict=True)) + " }"
FIXED = HEXAPOD.replace("STIFFNESS", EACH).replace("X2", "11.543")


def test_the_platform_moves_as_six_springs_let_it(cli: Run, tmp_path: Path) -> None:
    out = output_of(cli("evaluate", str(saved(tmp_path / "case.toml", FIXED)), "--json", "-"))
    data = json.loads(out)
    position, turn = np.array(data["pose"]["position"]), np.array(data["pose"]["rotation_matrix"])
    J = np.array(data["jacobian"])
    force, moment = J[:, :3], J[:, 3:] - np.cross(position, J[:, :3])
    rows = np.hstack([force, moment])  # rate of each leg by the platform's velocity and its angular velocity
    stiffness = rows.T @ np.diag(K) @ rows
    compliance = np.array(data["compliance"])
    assert compliance @ stiffness == pytest.approx(np.eye(6), abs=1e-10)
    load = np.array([20.0, 20.0, -100.0])
    moved = np.linalg.solve(stiffness, np.concatenate([load, np.cross(turn @ [0, 0, 2], load)]))
    (found,) = (each["deflection"] for each in data["loads"])
    assert found["translation"] == pytest.approx(moved[:3], rel=1e-10)
    assert found["rotation"] == pytest.approx(np.degrees(moved[3:]), rel=1e-10)
    assert found["largest"] == pytest.approx(np.linalg.norm(moved[:3]), rel=1e-10)
    # The legs are shorter by their forces over their stiffness.
    forces = np.array([each["value"] for each in data["loads"][0]["actuators"]])
    assert rows @ moved == pytest.approx(-forces / K, rel=1e-9, abs=1e-12)


def test_a_load_of_any_direction_moves_it_no_farther_than_said(cli: Run, tmp_path: Path) -> None:
    text = FIXED + "any = { force = 30, moment = 10 }\n"
    data = json.loads(output_of(cli("evaluate", str(saved(tmp_path / "case.toml", text)), "--json", "-")))
    (found,) = (each["deflection"] for each in data["loads"])
    compliance, turn = np.array(data["compliance"]), np.array(data["pose"]["rotation_matrix"])
    rng = np.random.default_rng(0)
    worst = 0.0
    for _ in range(2000):
        more, twist = rng.normal(size=(2, 3))
        load = np.array([20.0, 20.0, -100.0]) + 30 * more / np.linalg.norm(more)
        moment = np.cross(turn @ [0, 0, 2], load) + 10 * twist / np.linalg.norm(twist)
        worst = max(worst, float(np.linalg.norm((compliance @ np.concatenate([load, moment]))[:3])))
    assert worst <= found["largest"] <= 2 * worst


def test_a_limit_on_the_deflection_holds_a_design() -> None:
    text = HEXAPOD.replace("STIFFNESS", "4000").replace("X2", "{ min = 8, max = 14 }")
    text = text.replace('sense = "max"', 'sense = "min"') + "[limits]\ndeflection = "
    loose = solve(case_from(text + "{ max = 9 }\n"))
    ends = [margins_of(loose.nlp, np.array([x]), optimal=False)[0].value for x in (8.0, 14.0)]
    (at_best,) = margins_of(loose.nlp, loose.x, optimal=True)
    assert at_best.cost == 0
    # Half of the way from the best end of the free number to the other one, the limit holds the design.
    other = min(ends)
    assert other < at_best.value
    most = 0.5 * (at_best.value + other)
    held = solve(case_from(text + f"{{ max = {most!r} }}\n"))
    (margin,) = margins_of(held.nlp, held.x, optimal=True)
    assert margin.active
    assert margin.value == pytest.approx(most, rel=1e-8)
    more = solve(case_from(text + f"{{ max = {most * 1.001!r} }}\n"))
    assert margin.cost == pytest.approx((more.F - held.F) / (most * 0.001), rel=1e-2)


def test_the_deflection_of_a_translating_robot_has_no_turn(cli: Run, tmp_path: Path) -> None:
    text = """\
[robot]
model = "three-upu"
axes = "tsai"
actuator_stiffness = 1000
parameters = { base_radius = 0.5, platform_radius = 0.12 }
[pose]
position = [0.1, -0.1, 0.4]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[[load]]
force = [2, 2, -10]
"""
    data = json.loads(output_of(cli("evaluate", str(saved(tmp_path / "case.toml", text)), "--json", "-")))
    units = np.array(data["jacobian"])[:3, :3]
    moved = np.linalg.solve(1000 * units.T @ units, [2.0, 2.0, -10.0])
    (found,) = (each["deflection"] for each in data["loads"])
    assert found["translation"] == pytest.approx(moved, rel=1e-10)
    assert found["rotation"] == pytest.approx([0, 0, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("STIFFNESS", "0"), "robot.actuator_stiffness = 0.0: must be above 0"),
        (("STIFFNESS", "-3"), "must be above 0 and finite"),
        (("STIFFNESS", '{ "1-" = 3 }'), "has none for actuator 1+"),
        (("STIFFNESS", EACH.replace('"3+"', '"4"')), "robot.actuator_stiffness.4: is no actuator of the robot"),
        (("STIFFNESS", "4000\n#"), ""),
    ],
    ids=["zero", "negative", "missing", "unknown", "good"],
)
def test_stiffness_that_means_nothing_is_refused(change: tuple[str, str], sentence: str) -> None:
    text = HEXAPOD.replace(*change).replace("X2", "11.543")
    if not sentence:
        assert case_from(text).loading.stiffness == {"": 4000.0}
        return
    with pytest.raises(CaseError) as error:
        case_from(text)
    assert sentence in str(error.value)


def test_a_limit_on_the_deflection_needs_loads_and_stiffness() -> None:
    text = HEXAPOD.replace("X2", "11.543") + "[limits]\ndeflection = { max = 1 }\n"
    with pytest.raises(CaseError, match=r"deflection: needs robot.actuator_stiffness"):
        case_from(text.replace("actuator_stiffness = STIFFNESS\n", ""))
    without = text[: text.index("[[load]]")] + text[text.index("[limits]") :]
    with pytest.raises(CaseError, match=r"deflection: means nothing without \[\[load\]\]"):
        case_from(without.replace("STIFFNESS", "4000"))
    case = case_from(text.replace("STIFFNESS", EACH))
    assert case_from(case.to_toml()).to_toml() == case.to_toml()
    assert [each for each in case.limits if isinstance(each, Deflection)] == [Deflection(1.0)]
