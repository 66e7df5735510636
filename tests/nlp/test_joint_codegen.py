"""Generated C of robots given joint by joint: with limits on joints, with members, and at several poses."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from builders import case_from, starter_tables

from screwsynth.nlp import (
    ActuatorRate,
    Case,
    JointCone,
    JointMotion,
    Limits,
    LinkClearance,
    OverPoses,
    Pose,
    QuantityLimit,
    RateShare,
    formulate,
)
from screwsynth.nlp.case.limits.limit import Limit
from screwsynth.nlp.embedding.calls import find_calls
from screwsynth.nlp.embedding.loops import find_loops
from screwsynth.nlp.embedding.runtimelimits import run_time_limits

LIMITS = (
    LinkClearance(0.05),
    ActuatorRate(20.0),
    JointMotion("1:1", min=-math.pi, max=1.4),
    JointCone("2:3", 1.0),
    RateShare(0.9),
    QuantityLimit("actuator_length", min=-3.0, max=3.0),
)


def starter(name: str, *limits: Limit[Any], poses: int = 1) -> Case:
    case = case_from(starter_tables(name), name)
    further = [Pose(case.position, case.rotation)] * (poses - 1)
    return replace(case, limits=Limits(*limits), further=further, over_poses=OverPoses.MEAN)


def test_limits_on_joints_can_be_set_within_their_ranges() -> None:
    nlp = formulate(starter("3-rps", *LIMITS))
    found = {each.key: each for each in run_time_limits(nlp, "c").limits}
    assert len({each.name for each in found.values()}) == len(found)
    for each in found.values():
        assert each.above < each.default <= each.most, each
    hinge = found["joint.1:1.max"]
    assert (hinge.default, hinge.above, hinge.most) == (1.4, -math.pi, math.pi)
    # A range that the case begins at its own end is allowed, though no smaller one is.
    assert found["joint.1:1.min"].default == -math.pi
    assert (found["joint.2:3.cone"].above, found["joint.2:3.cone"].most) == (0.0, math.pi)
    assert found["actuator_rate.max"].above == 0.0


def test_the_page_of_limits_names_what_can_be_set() -> None:
    page = (Path(__file__).parents[2] / "docs" / "limits.md").read_text(encoding="utf-8")
    table = page.split("| allowed at run time |")[1].split("Not covered:")[0]
    rows = [line.split("|")[1:4] for line in table.splitlines() if line.startswith("| `")]
    stated = {name: allowed.strip() for _, names, allowed in rows for name in re.findall(r"`([A-Z_0-9]+)`", names)}
    motions = (
        JointMotion("1:1", min=-1, max=1.4),
        JointMotion("1:2", min=-3.0, max=3.0),
        JointCone("2:3", 1.0),
        ActuatorRate(20.0),
        LinkClearance(0.05),
    )
    second = JointMotion("1:3", part="first", min=-1, max=1.2)
    found = {
        each.name: each
        for nlp in (formulate(starter("3-rps", *motions)), formulate(starter("3-upu", second)))
        for each in run_time_limits(nlp, "c").limits
    }
    ranges = {
        "within half a turn to either side": (-math.pi, math.pi),
        "any": (-math.inf, math.inf),
        "above 0, up to half a turn": (0.0, math.pi),
        "above 0": (0.0, math.inf),
        "above 0, up to 1.8 times the case's own": (0.0, 1.8 * 0.05),
    }
    assert len(stated) == 8
    for name, allowed in stated.items():
        assert (found[name].above, found[name].most) == pytest.approx(ranges[allowed]), name
    # A side that the case does not state is not there.
    one_sided = run_time_limits(formulate(starter("3-rps", JointMotion("1:1", max=1.4))), "c").limits
    assert [each.name for each in one_sided if "JOINT" in each.name] == ["JOINT_1_1_MAX"]


def test_links_at_several_poses_are_loops_and_no_value_needs_itself() -> None:
    """A position of an actuated slide is an unknown of the program: an input and a value of one call."""
    program = formulate(starter("3-rps", *LIMITS, poses=2)).program
    calls = find_calls(program)
    assert {"link_clearance", "rate_share"} <= {
        program.constraints[each.place].name.split()[0] for each in calls.final if each.place < len(program.constraints)
    }
    loops = find_loops(program)
    assert len(loops.all) >= 2
    assert loops.entries.numel() > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "poses"),
    [
        ("3-rps", 2),
        pytest.param("3-rps", 1, marks=pytest.mark.soak),
        pytest.param("planar-3-rrr", 1, marks=pytest.mark.soak),
    ],
)
def test_c_has_the_values_of_the_program_with_limits(name: str, poses: int, embed: Callable[..., Any]) -> None:
    hinges = (RateShare(0.9), JointMotion("1:1", min=-1.4), ActuatorRate(50.0))
    case = starter(name, *(LIMITS if name == "3-rps" else hinges), poses=poses)
    embed(case, "-O0").compare(formulate(case), 30, 1e-13)
