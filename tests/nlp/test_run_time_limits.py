"""Limits of generated C in their own units, on joints too; twists from axes, and macros for indices and versions."""

from __future__ import annotations

import ast
import copy
import ctypes
import math
import re
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import case_from, starter

from screwsynth.models import screw_from_axis
from screwsynth.nlp import Case, CaseError, Limits, LinkClearance, QuantityLimit, __version__, generate_c, solve
from screwsynth.nlp.case.limits.constraint import LENGTH
from screwsynth.nlp.case.limits.joint_motion import JointCone, JointMotion
from screwsynth.nlp.case.limits.limit import Limit
from screwsynth.nlp.case.limits.rates import ActuatorRate, RateShare
from screwsynth.nlp.case.pose import OverPoses, Pose
from screwsynth.nlp.embedding.calls import find_calls
from screwsynth.nlp.embedding.ctext import c_names
from screwsynth.nlp.embedding.loops import find_loops
from screwsynth.nlp.embedding.runtimelimits import RunTimeLimits, run_time_limits
from screwsynth.nlp.evidence.kkt import linearise, multipliers
from screwsynth.nlp.program.formulation import formulate, formulate_weighted, scaled_weights
from screwsynth.nlp.program.layout import lay_out
from screwsynth.nlp.program.pairs import with_all_pairs

Embedded = Any
Embed = Callable[..., Embedded]

ROBOT = """
units = { length = "mm", angle = "rad" }
task = [{ sense = "max", axis = [1, 2, 6], point = [3, 1, 12], pitch = 0.1 }]
[robot]
model = "stewart-gough"
layout = "octahedral"
[robot.parameters]
x1 = { min = 20, max = 32 }
x2 = { min = 8, max = 15 }
x3 = { min = 0, max = 0.35 }
x4 = { min = 0, max = 0.45 }
[pose]
position = [{ min = -6, max = 6 }, { min = -6, max = 6 }, { min = 16, max = 26 }]
rotation = { angle = { min = 0.02, max = 0.25 } }
[limits]
leg_length = { min = 24, max = 34 }
footprint = { base = 31, platform = 14 }
joint_spacing = { min = 1 }
radius_ratio = { min = 0.3, max = 0.6 }
base_joint_angle = 0.6
platform_joint_angle = { max = 0.7, about = [0, 0, 1] }
custom = ["x1 - x2 >= 8", "x3 <= x4 + 0.3"]
"""
FURTHER = """
actuator = { dead_length = 20 }
leg_clearance = { min = 1.5 }
rate_share = { max = 0.6 }
condition_number = { max = 6, length = 10 }
smallest_singular_value = { min = 0.2, length = 7 }
"""
CLEAR = "leg_clearance.min"


def limited_case(tables: dict[str, Any]) -> Case:
    return case_from(tables, "limited")


def changed(tables: dict[str, Any], key: str, value: float) -> dict[str, Any]:
    """The tables with another number at a key of the C."""
    new = copy.deepcopy(tables)
    name, _, side = key.partition(".")
    if name == "angle":
        new["pose"]["rotation"]["angle"][side] = value
    elif isinstance(new["limits"][name], dict):
        new["limits"][name][side] = value
    else:
        new["limits"][name] = value
    return new


def bounds_of(found: RunTimeLimits, values: list[float], case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the constraints as the C derives them."""
    nlp = formulate(case)
    lower, upper = np.array(nlp.g_lower), np.array(nlp.g_upper)
    assert found.function is not None
    converted = found.function(values).full().ravel()
    for side in found.sides:
        (upper if side.is_upper else lower)[side.constraint] = converted[side.converted]
    return lower, upper


def test_every_limit_becomes_the_bounds_that_python_gives_it() -> None:
    tables = tomllib.loads(ROBOT + FURTHER)
    case = limited_case(tables)
    found = run_time_limits(formulate(case), "limited")
    keys = [each.key for each in found.limits]
    assert set(keys) == {
        "angle.min", "angle.max", "footprint.base", "footprint.platform", "joint_spacing.min", "radius_ratio.min",
        "radius_ratio.max", "custom[0]", "custom[1]", "actuator.dead_length", "leg_length.min", "leg_length.max",
        "base_joint_angle.max", "platform_joint_angle.max", "leg_clearance.min", "rate_share.max",
        "condition_number.max", "smallest_singular_value.min",
    }  # fmt: skip
    defaults = [each.default for each in found.limits]
    nlp = formulate(case)
    lower, upper = bounds_of(found, defaults, case)
    np.testing.assert_allclose(lower, nlp.g_lower, rtol=1e-12)
    np.testing.assert_allclose(upper, nlp.g_upper, rtol=1e-12)
    # Every limit moves by another factor: none can be taken for another.
    values = [value * (1.05 + 0.001 * k) for k, value in enumerate(defaults)]
    lower, upper = bounds_of(found, values, case)
    for key, value in zip(keys, values, strict=True):
        tables = tables if key.startswith("custom") else changed(tables, key, value)
    constraints = lay_out(limited_case(tables), case.tasks).constraints
    assert [item.constraint.name for item in constraints] == [each.name for each in nlp.program.constraints]
    # Python makes another function for another clearance: there the C's bound must be the distance again.
    for at, item in enumerate(constraints):
        of = nlp.program.constraints[at].reading if "leg_clearance" in item.constraint.name else None
        ours, theirs = (lower[at], item.lower) if of is None else (of.from_value(lower[at]), values[keys.index(CLEAR)])
        assert ours == pytest.approx(theirs, rel=1e-12), item.constraint.name
        assert upper[at] == pytest.approx(item.upper, rel=1e-12), item.constraint.name


def test_what_is_allowed_is_what_a_case_allows() -> None:
    tables = tomllib.loads(ROBOT + FURTHER)
    for limit in run_time_limits(formulate(limited_case(tables)), "limited").limits:
        if limit.key.startswith(("angle", "custom")):
            continue
        # A sided limit is refused where it crosses, too: the other side goes away.
        alone = copy.deepcopy(tables)
        name = limit.key.partition(".")[0]
        if name in {"leg_length", "radius_ratio"}:
            alone["limits"][name] = {limit.key.partition(".")[2]: limit.default}
        with pytest.raises(CaseError):
            limited_case(changed(alone, limit.key, limit.above))
        limited_case(changed(alone, limit.key, float(np.nextafter(limit.above, math.inf))))
        if math.isfinite(limit.most) and name != "leg_clearance":
            limited_case(changed(alone, limit.key, limit.most))
            with pytest.raises(CaseError):
                limited_case(changed(alone, limit.key, float(np.nextafter(limit.most, math.inf))))


def test_limits_on_fixed_numbers_are_set_where_the_c_judges_by_them() -> None:
    # The base is fixed, so that its joints' spacing is no constraint of the C, which judges answers by it.
    tables = tomllib.loads(ROBOT)
    tables["robot"]["parameters"] |= {"x1": 25, "x3": 0.1}
    del tables["limits"]["custom"]
    nlp = formulate(limited_case(tables))
    of_base = [each for each in nlp.constant_limits if each.constraint.keys[0] == "joint_spacing.min"]
    assert of_base
    (limit,) = [each for each in run_time_limits(nlp, "limited").limits if each.key == "joint_spacing.min"]
    assert limit.most == math.inf
    # Read otherwise than the platform's joints, it shares no bound with them: it cannot be set.
    other = replace(of_base[0], constraint=replace(of_base[0].constraint, reading=LENGTH))
    keys = [each.key for each in run_time_limits(replace(nlp, constant_limits=(other,)), "limited").limits]
    assert "joint_spacing.min" not in keys
    assert "leg_length.min" in keys


class Bounds:
    """The structure of bounds in C: five arrays of doubles, each with one more at its end."""

    def __init__(self, c: Embedded) -> None:
        self.c, self.count = c, c.macro("LIMITS")
        self.ends = np.cumsum([0, self.count + 1, c.n + 1, c.n + 1, c.c + 1, c.c + 1])
        self.memory = np.zeros(self.ends[-1])
        self._library = c._library
        self.call("reset")

    def part(self, index: int) -> np.ndarray:
        return self.memory[self.ends[index] : self.ends[index + 1] - 1]

    def call(self, name: str, *arguments: object) -> int:
        function = getattr(self._library, f"{self.c.prefix}_{name}")
        return int(function(ctypes.c_void_p(self.memory.ctypes.data), *arguments))

    def set(self, limit: int, value: float) -> int:
        return self.call("set_limit", ctypes.c_int(limit), ctypes.c_double(value))

    def get(self, limit: int) -> tuple[int, float]:
        value = ctypes.c_double(-1)
        return self.call("get_limit", ctypes.c_int(limit), ctypes.byref(value)), value.value

    def solve(self) -> Embedded:
        names = ("lower", "upper", "g_lower", "g_upper")
        return self.c.solve(**{name: self.part(1 + k) for k, name in enumerate(names)})


@pytest.fixture(scope="module")
def limited(embed: Embed) -> Embedded:
    return embed(limited_case(few(tomllib.loads(ROBOT))))


def few(tables: dict[str, Any]) -> dict[str, Any]:
    """The tables with fewer limits, so that the C compiles in a second."""
    for key in ("joint_spacing", "platform_joint_angle", "custom"):
        del tables["limits"][key]
    return tables


def numbers(c: Embedded) -> dict[str, int]:
    """Numbers of the limits by the end of their names."""
    found = re.findall(rf"{c.prefix.upper()}_LIMIT_(\w+) = (-?\d+)", c.header)
    return {name: int(value) for name, value in found}


def test_the_solver_keeps_limits_that_were_set(limited: Embedded) -> None:
    tables = few(tomllib.loads(ROBOT))
    names, bounds = numbers(limited), Bounds(limited)
    new = {"LEG_LENGTH_MAX": 32.5, "ANGLE_MAX": 0.4, "BASE_JOINT_ANGLE_MAX": 0.5, "FOOTPRINT_BASE": 28.0}
    keys = ("leg_length.max", "angle.max", "base_joint_angle.max", "footprint.base")
    for (name, value), key in zip(new.items(), keys, strict=True):
        assert bounds.set(names[name], value) == 0
        assert bounds.get(names[name]) == (0, value)
        tables = changed(tables, key, value)
    case = limited_case(tables)
    nlp = formulate(case)
    # The bounds of the free rotation's variables follow from its angle.
    np.testing.assert_allclose(bounds.part(1), nlp.lower, rtol=1e-14)
    np.testing.assert_allclose(bounds.part(2), nlp.upper, rtol=1e-14)
    solved, wanted = bounds.solve(), solve(case, starts=8)
    assert solved.status == 0
    assert abs(solved.F - wanted.F) <= 1e-6 * wanted.F
    assert abs(limited.solve().F - wanted.F) > 1e-3 * wanted.F


def test_units_of_multipliers_are_those_of_a_change_of_the_unit_of_lengths(embed: Embed) -> None:
    plain = few(tomllib.loads(ROBOT))
    doubled = copy.deepcopy(plain)
    for table, keys in (
        (doubled["robot"]["parameters"], ("x1", "x2")), (doubled["pose"], ("position",)),
        (doubled["task"][0], ("point", "pitch")), (doubled["limits"], ("leg_length", "footprint")),
    ):  # fmt: skip
        table |= {key: twice(table[key]) for key in keys}
    found, powers = [], {"mm": 1, "mm²": 2, "(mm/rad)²": 2, "rad": 0, "": 0}
    for tables in (plain, doubled):
        c = embed(limited_case(tables), "-O0")
        solved = c.solve()
        assert solved.status == 0
        found.append(solved.g_lower_multipliers + solved.g_upper_multipliers)
    active, units = found[0] > 0, strings(c, "constraint_multiplier_units")
    assert len(units) == c.c
    assert strings(c, "F_unit") == ["(mm/rad)²"]
    of_active = [unit for unit, is_active in zip(units, active, strict=True) if is_active]
    assert len(set(of_active)) > 1
    for unit, ratio in zip(of_active, found[1][active] / found[0][active], strict=True):
        whole, _, by = unit.partition(")²/")
        power = powers[f"{whole})²" if by else whole] - powers[by]
        assert ratio == pytest.approx(2.0**power, rel=1e-5), unit


def twice(value: object) -> object:
    """Numbers of a case file, times 2."""
    if isinstance(value, dict):
        return {key: twice(each) for key, each in value.items()}
    if isinstance(value, list):
        return [twice(each) for each in value]
    assert isinstance(value, int | float)
    return 2 * value


def strings(c: Embedded, name: str) -> list[str]:
    """Strings of a table of the header."""
    (text,) = re.findall(rf"{c.prefix}_{name}(?:\[\w+ \+ 1\])? = ([^;]*);", c.header)
    words = re.findall(r'"([^"]*)"', text)
    return [ast.literal_eval(f"b'{word}'").decode() for word in words]


def test_limits_hold_at_every_pose_and_for_every_task(embed: Embed) -> None:
    tables = few(tomllib.loads(ROBOT))
    free = tables["pose"]
    tables["pose"] = [free, {"position": [2, 1, 24], "rotation": {"axis": [1, 0, 0], "angle": 0.1}}]
    tables["task"].append({"sense": "max", "axis": [0, 0, 1], "point": [1, 0, 0], "pitch": 3.0, "weight": 0.4})
    tables |= {"combine": {"method": "weighted-sum", "over_poses": "mean"}, "solve": {"starts": 1}}
    tables["limits"] |= {"actuator": {"stroke_max": 9.0, "dead_length": 10.0}, "rate_share": {"max": 0.9}}
    c = embed(limited_case(tables), "-O0")
    names, bounds, before = numbers(c), Bounds(c), c.solve()
    new = {"leg_length.max": 33.0, "actuator.stroke_max": 5.0, "actuator.dead_length": 12.0, "rate_share.max": 0.7}
    for key, value in new.items():
        tables = changed(tables, key, value)
        assert bounds.set(names[key.upper().replace(".", "_")], value) == 0
    case = limited_case(tables)
    nlp = with_all_pairs(formulate_weighted(case, scaled_weights(case)))
    found = [each.name for each in nlp.program.constraints]
    assert sum("poses 2 and 1" in name for name in found) == 12
    assert sum("rate_share" in name for name in found) == 24
    np.testing.assert_allclose(bounds.part(3), np.maximum(nlp.g_lower, -1e300), rtol=1e-12)
    np.testing.assert_allclose(bounds.part(4), np.minimum(nlp.g_upper, 1e300), rtol=1e-12)
    solved = bounds.solve()
    assert before.status == solved.status == 0
    # The program of Python has no better point near the answer, and that keeps the limits.
    at = linearise(nlp, solved.x)
    assert at.violation <= 1e-8
    assert multipliers(at, at.active(1e-6))[1] <= 1e-7
    assert solved.F < (1 - 1e-3) * before.F


def test_a_limit_that_is_refused_changes_nothing(limited: Embedded) -> None:
    names, bounds = numbers(limited), Bounds(limited)
    before = bounds.memory.copy()
    for name, value, code in (
        ("LEG_LENGTH_MAX", 23.9, 2), ("LEG_LENGTH_MIN", 34.1, 2), ("ANGLE_MIN", 0.26, 2), ("RADIUS_RATIO_MAX", 0.2, 2),
        ("LEG_LENGTH_MAX", 0.0, 1), ("LEG_LENGTH_MAX", -34.0, 1), ("LEG_LENGTH_MAX", math.nan, 1),
        ("LEG_LENGTH_MAX", math.inf, 1), ("LEG_LENGTH_MAX", 1e200, 1), ("BASE_JOINT_ANGLE_MAX", 3.2, 1),
        ("ANGLE_MAX", 3.13, 1), ("FOOTPRINT_BASE", -math.inf, 1), ("NONE", 1.0, 1),
    ):  # fmt: skip
        assert bounds.set(names[name], value) == code, (name, value)
        assert (bounds.memory == before).all()
    assert bounds.set(len(names) - 1, 1.0) == 1
    assert bounds.get(-1) == (1, 0.0)
    assert bounds.get(len(names) - 1) == (1, 0.0)
    # All at once, where each after the other would cross.
    values = bounds.part(0).copy()
    values[[names["LEG_LENGTH_MIN"], names["LEG_LENGTH_MAX"]]] = 40, 45
    assert bounds.set(names["LEG_LENGTH_MIN"], 40.0) == 2
    assert bounds.call("set_limit_values", ctypes.c_void_p(values.ctypes.data)) == 0
    assert bounds.get(names["LEG_LENGTH_MIN"]) == (0, 40.0)
    bounds.call("reset")
    assert (bounds.memory == before).all()


def test_twists_from_axes_are_those_of_python(limited: Embedded) -> None:
    function, generator = limited._library[f"{limited.prefix}_twist_from_axis"], np.random.default_rng(2)

    def twist(axis: object, point: object, pitch: float) -> tuple[int, np.ndarray]:
        given = [None if each is None else np.array(each, dtype=float) for each in (axis, point)]
        out = np.full(6, 7.0)
        pointers = [None if each is None else ctypes.c_void_p(each.ctypes.data) for each in given]
        code = function(*pointers, ctypes.c_double(pitch), ctypes.c_void_p(out.ctypes.data))
        return int(code), out

    for _ in range(200):
        axis, point = generator.normal(size=3) * 10 ** generator.uniform(-150, 150), generator.uniform(-50, 50, 3)
        pitch = float(generator.choice([0.0, math.inf, generator.normal() * 10]))
        code, found = twist(axis, None if pitch == math.inf else point, pitch)
        assert code == 0
        np.testing.assert_allclose(found, screw_from_axis(axis, point, pitch), rtol=1e-13, atol=1e-13)
    good = ((0.0, 0.0, 1.0), (1.0, 2.0, 3.0), 0.5)
    for bad in (math.nan, math.inf, -math.inf):
        assert twist((bad, 0, 1), *good[1:])[0] == 1
        assert twist(good[0], (0, bad, 1), 0.5)[0] == 1
        if bad != math.inf:
            assert twist(*good[:2], bad)[0] == 1
    assert twist((0, 0, 0), *good[1:])[0] == 1


def test_macros_for_indices_limits_and_versions() -> None:
    case = limited_case(tomllib.loads(ROBOT))
    header, nlp = generate_c(case, "")["screwsynth_limited.h"], formulate(case)
    for vector, scalars in (("x", nlp.program.variables), ("p", nlp.program.arguments)):
        found = re.findall(rf"#define SCREWSYNTH_LIMITED_{vector}_(\w+) (\d+)", header)
        assert found == [(each.name, str(index)) for index, each in enumerate(scalars)]
    major, minor, patch = (re.findall(rf"_VERSION_{part} (\d+)", header)[0] for part in ("MAJOR", "MINOR", "PATCH"))
    assert __version__.startswith(f"{major}.{minor}.{patch}")
    assert f'#define SCREWSYNTH_LIMITED_VERSION "{__version__}"' in header
    # Folders of different versions cannot share a program: their types may differ.
    number = (int(major) * 1000 + int(minor)) * 1000 + int(patch)
    assert f"#define SCREWSYNTH_VERSION {number}\n#elif SCREWSYNTH_VERSION != {number}\n#error" in header
    for name in ("ITERATIONS", "FEASIBLE", "STATIONARY"):
        assert f"#ifndef SCREWSYNTH_LIMITED_{name}\n#define SCREWSYNTH_LIMITED_{name} " in header
    assert c_names(["a b", "a-b", "größe", "", "*"]) == ["a_b", "a_b_1", "gr_e", "unnamed", "unnamed_4"]
    (line,) = [line for line in header.splitlines() if "_LIMIT_BASE_JOINT_ANGLE_MAX = " in line]
    assert line.endswith("/* base_joint_angle.max: 0.6 rad; above 0, at most 3.14159 */")
    (line,) = [line for line in header.splitlines() if "_LIMIT_LEG_LENGTH_MAX = " in line]
    assert line.endswith("/* leg_length.max: 34 mm; above 0 */")


JOINT_LIMITS = (
    LinkClearance(0.05), ActuatorRate(20.0), JointMotion("1:1", min=-math.pi, max=1.4), JointCone("2:3", 1.0),
    RateShare(0.9), QuantityLimit("actuator_length", min=-3.0, max=3.0),
)  # fmt: skip


def jointed(name: str, *limits: Limit[Any], poses: int = 1) -> Case:
    case = starter(name)
    further = [Pose(case.position, case.rotation)] * (poses - 1)
    return replace(case, limits=Limits(*limits), further=further, over_poses=OverPoses.MEAN)


def test_limits_on_joints_can_be_set_within_their_ranges() -> None:
    nlp = formulate(jointed("3-rps", *JOINT_LIMITS))
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
    motions = (JointMotion("1:1", min=-1, max=1.4), JointMotion("1:2", min=-3.0, max=3.0), JointCone("2:3", 1.0))
    motions += (ActuatorRate(20.0), LinkClearance(0.05))
    second = JointMotion("1:3", part="first", min=-1, max=1.2)
    found = {
        each.name: each
        for nlp in (formulate(jointed("3-rps", *motions)), formulate(jointed("3-upu", second)))
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
    one_sided = run_time_limits(formulate(jointed("3-rps", JointMotion("1:1", max=1.4))), "c").limits
    assert [each.name for each in one_sided if "JOINT" in each.name] == ["JOINT_1_1_MAX"]


def test_links_at_several_poses_are_loops_and_no_value_needs_itself() -> None:
    """A position of an actuated slide is an unknown of the program: an input and a value of one call."""
    program = formulate(jointed("3-rps", *JOINT_LIMITS, poses=2)).program
    calls = find_calls(program)
    named = [program.constraints[each.place].name for each in calls.final if each.place < len(program.constraints)]
    assert {"link_clearance", "rate_share"} <= {name.split()[0] for name in named}
    loops = find_loops(program)
    assert len(loops.all) >= 2
    assert loops.entries.numel() > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "poses"),
    [("3-rps", 2), *(pytest.param(each, 1, marks=pytest.mark.soak) for each in ("3-rps", "planar-3-rrr"))],
)
def test_c_has_the_values_of_the_program_with_limits(name: str, poses: int, embed: Callable[..., Any]) -> None:
    hinges = (RateShare(0.9), JointMotion("1:1", min=-1.4), ActuatorRate(50.0))
    case = jointed(name, *(JOINT_LIMITS if name == "3-rps" else hinges), poses=poses)
    embed(case, "-O0").compare(formulate(case), 30, 1e-13)
