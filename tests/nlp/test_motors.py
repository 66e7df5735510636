"""Forces, speeds and powers of actuators over a workspace, held to statics of six legs in NumPy alone, and to poses."""

import json
import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import Array, commands_in, ran, rows_of, saved, soaked, turn_about
from hexapods import case_of_legs
from workspace_cases import gallery_case as at_home

from screwsynth.models import three_upu
from screwsynth.nlp import Case, Free, Rotation, Task, load_case
from screwsynth.nlp.case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed
from screwsynth.nlp.case.limits.limits import Limits
from screwsynth.nlp.case.loads import Load, Loading, Motion
from screwsynth.nlp.case.motors import Motor
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.case.task import Sense
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.loads import HeldLoad, loads_at
from screwsynth.nlp.evidence.state import evaluate
from screwsynth.nlp.program.formulation import formulate
from screwsynth.nlp.proof.statement.fixed_robot import Legs
from screwsynth.nlp.proof.statement.motors import motor_claims
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.proof.workspace.numbers.searched import Subject, motor_extremes
from screwsynth.nlp.proof.workspace.slices.slice_limits import KEPT, UNDECIDED
from screwsynth.nlp.proof.workspace.slices.slices import slices_of
from screwsynth.nlp.proof.workspace.verdict import Outcome, Verdict
from screwsynth.nlp.results.workspace import workspace_of
from screwsynth.nlp.words.motors import motor_tables
from screwsynth.nlp.words.workspace import verdict_words

#: Key of a number: what, of which actuator, under which load, and the sense.
Numbers = dict[tuple[str, int, str, Sense], Verdict]


def motors_of(case: Case, **options: float) -> Numbers:
    """The extremes of the numbers of actuators."""
    found = judge_workspace(case, jobs=1, **options)
    every = [(each.motor, each) for each in found.extremes if each.motor is not None]
    return {(_word(motor), motor.place, motor.load, each.sense): each for motor, each in every}


def _word(motor: Motor) -> str:
    return "braking" if motor.is_backwards else motor.number.value


def columns_at(robot: Legs, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Rows (6, 6) of legs, direction, then moment about the platform's origin; and their inverse."""
    arms = robot.platform @ rotation.T
    spans = position + arms - robot.base
    n = spans / np.linalg.norm(spans, axis=1, keepdims=True)
    rows = np.hstack([n, np.cross(arms, n)])
    return rows, np.linalg.inv(rows)


def numbers_at(
    robot: Legs, loading: Loading, position: Array, rotation: Array
) -> dict[tuple[str, int, str, Sense], float]:
    """The numbers of six legs at a pose: each leg's largest force in both senses, speed and power."""
    rows, inverse = columns_at(robot, position, rotation)
    found, motion = dict[tuple[str, int, str, Sense], float](), loading.motion
    assert motion is not None
    speeds = motion.linear + motion.angular * np.linalg.norm(rows[:, 3:], axis=1)
    for load in loading.loads:
        arm = rotation @ np.array(load.point)
        force, moment = np.array(load.force), np.array(load.moment)
        held = -inverse.T @ np.concatenate([force, moment + np.cross(arm, force)])
        moved = inverse[:3] + np.cross(inverse[3:], arm, axisa=0).T
        spread = load.any_force * np.linalg.norm(moved, axis=0) + load.any_moment * np.linalg.norm(inverse[3:], axis=0)
        for k in range(6):
            low, high = held[k] - spread[k], held[k] + spread[k]
            found["force", k, load.name, Sense.MIN], found["force", k, load.name, Sense.MAX] = low, high
            found["power", k, load.name, Sense.MAX] = max(high, 0.0) * speeds[k]
            found["braking", k, load.name, Sense.MAX] = max(-low, 0.0) * speeds[k]
    for k in range(6):
        found["speed", k, "", Sense.MAX] = speeds[k]
    return found


LOADING = Loading(
    (
        Load("tool", (1.0, -2.0, -9.0), (0.1, 0.0, 0.3), point=(0.1, 0.0, 0.2), any_force=2.0, any_moment=0.2),
        Load("any", any_force=3.0),
    ),
    Motion(0.4, 0.7),
)
_TURNS = (
    Turns(TurnKind.ANY_AXIS, (Free(-0.25, 0.25),)),
    Turns(TurnKind.ROLL_PITCH_YAW, (Free(-0.2, 0.2), Free(-0.1, 0.2), 0.1)),
    Turns(TurnKind.AXIS, (Free(-0.4, 0.3),), (0.6, 0.0, 0.8)),
)


def ring() -> Array:
    angles = np.radians([-5, 5, 115, 125, 235, 245])
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(6)], axis=1)


def twisted() -> Array:
    """Joints of a platform of half the size, each beside the base's joint of another leg."""
    return np.asarray(0.5 * np.roll(ring(), 1, axis=0) @ turn_about([0, 0, 1], math.radians(-60)).T)


def six_legs(rng: np.random.Generator) -> Legs:
    """A hexapod that is not quite regular."""
    return Legs(ring() + rng.normal(0, 0.05, (6, 3)), twisted() + rng.normal(0, 0.05, (6, 3)))


def size_of(found: Numbers, key: tuple[str, int, str, Sense]) -> float:
    """The size of a number: the largest bound of its kind of the same actuator and load."""
    if key[0] in ("power", "braking"):
        return max(found[word, *key[1:]].bound for word in ("power", "braking"))
    return max(abs(found[*key[:3], sense].bound) for sense in Sense if (*key[:3], sense) in found)


@pytest.mark.parametrize("seed", soaked([1, 2], [1]))
def test_no_pose_of_six_legs_has_a_larger_number_than_its_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = six_legs(rng)
    place = [Free(-0.15, 0.15), Free(-0.15, 0.1), Free(0.9, 1.1)]
    turns = _TURNS[seed]
    case = replace(case_of_legs(robot), loading=LOADING, workspace=Workspace(place, turns))
    found = motors_of(case)
    assert len(found) == 6 * (2 * 4 + 1)
    assert all(each.outcome is Outcome.PROVED for each in found.values())

    def rotation_at(turn: Array) -> Array:
        if turns.kind is TurnKind.ANY_AXIS:
            angle = float(np.linalg.norm(turn))
            return turn_about(turn if angle else [0, 0, 1], angle)
        if turns.kind is TurnKind.AXIS:
            return turn_about(turns.axis, float(turn[0]))
        x, y, z = (turn_about(axis, float(each)) for axis, each in zip(np.eye(3), turn, strict=True))
        return np.asarray(z @ y @ x)

    ends = [(each.lower, each.upper) if isinstance(each, Free) else (each, each) for each in (*place, *turns.angles)]
    if turns.kind is TurnKind.ANY_AXIS:
        ends += ends[-1:] * 2
    lower, upper = np.array(ends).T

    def moved(y: Array, step: float) -> Array:
        new = np.clip(y + step * (upper - lower) * rng.normal(size=y.shape), lower, upper)
        if turns.kind is TurnKind.ANY_AXIS:
            new[3:] *= min(1.0, 0.25 / max(float(np.linalg.norm(new[3:])), 1e-9))
        return np.asarray(new)

    samples = [moved(rng.uniform(lower, upper), 0.0) for _ in range(200)]
    values = [numbers_at(robot, LOADING, y[:3], rotation_at(y[3:])) for y in samples]
    for key, each in found.items():
        sign = each.sense.sign
        best = max(range(len(samples)), key=lambda k: sign * values[k][key])
        y, value, step = samples[best], values[best][key], 0.3
        for _ in range(60):  # ascent
            other = moved(y, step)
            new = numbers_at(robot, LOADING, other[:3], rotation_at(other[3:]))[key]
            y, value, step = (other, new, step) if sign * new > sign * value else (y, value, 0.9 * step)
        assert sign * value <= sign * each.bound, key
        assert each.pose is not None
        at = numbers_at(robot, LOADING, np.asarray(each.pose.position), np.asarray(each.pose.rotation))[key]
        assert at == pytest.approx(each.reached, rel=1e-9)
        size = size_of(found, key)
        assert sign * (each.bound - each.reached) <= 0.0101 * size
        assert sign * (value - each.reached) <= 0.0101 * size


def held_at(case: Case, position: list[float], rotation: Rotation) -> tuple[HeldLoad, Array]:
    """Forces under the only load at a pose, and speeds."""
    nlp = formulate(replace(case, position=position, rotation=rotation, workspace=None))
    x = closed_start(nlp)
    (one,), speeds, _ = loads_at(nlp, x, evaluate(nlp, x))
    return one, np.array([each.value for each in speeds])


@pytest.mark.parametrize("name", soaked(["6-pus", "delta", "tricept"], ["6-pus"]))
def test_numbers_of_robots_with_passive_joints_are_those_that_a_pose_shows(name: str) -> None:
    """With six freedoms or fewer, with loops in closed form and others: forces and torques from J at single poses."""
    load = Load("push", (1.0, 2.0, -10.0), point=(0.0, 0.1, 0.1), any_force=2.0)
    case = replace(at_home(name, part=0.005, degrees=1.5), loading=Loading((load,), Motion(1.0, 0.5)))
    found = motors_of(case)
    assert all(each.outcome is Outcome.PROVED for each in found.values())

    def at(position: list[float], rotation: Rotation) -> dict[tuple[str, int, str, Sense], float]:
        one, speeds = held_at(case, position, rotation)
        numbers = dict[tuple[str, int, str, Sense], float]()
        ends = [np.array([each.smallest, each.largest], dtype=np.float64).tolist() for each in one.actuators]
        for k, ((low, high), speed) in enumerate(zip(ends, speeds, strict=True)):
            numbers["force", k, "push", Sense.MIN], numbers["force", k, "push", Sense.MAX] = low, high
            numbers["speed", k, "", Sense.MAX], numbers["power", k, "push", Sense.MAX] = speed, max(0.0, high) * speed
            numbers["braking", k, "push", Sense.MAX] = max(0.0, -low) * speed
        return numbers

    assert case.workspace is not None
    rng = np.random.default_rng(1)
    for _ in range(6):
        place = [rng.uniform(each.lower, each.upper) for each in case.workspace.position if isinstance(each, Free)]
        shown = at(place, Rotation((0, 0, 1), 0.0))
        assert set(shown) == set(found)
        for key, each in found.items():
            assert each.sense.sign * shown[key] <= each.sense.sign * each.bound, key
    for key, each in found.items():
        assert each.pose is not None
        axis = [float(part) for part in each.pose.axis]
        shown = at([float(part) for part in each.pose.position], Rotation(axis, float(each.pose.angle)))
        assert shown[key] == pytest.approx(each.reached, rel=1e-7)
        assert each.sense.sign * (each.bound - each.reached) <= 0.011 * size_of(found, key)


def tripod(load: Load, radius: float, platform: float, height: float) -> Case:
    """A 3-UPU robot that translates, over a box of 0.2 m by 0.2 m by 0.1 m."""
    place = [Free(-0.1, 0.1), Free(-0.1, 0.1), Free(height - 0.05, height + 0.05)]
    workspace = Workspace(place, Turns(TurnKind.AXIS, (0.0,), (0, 0, 1)))
    numbers = {"base_radius": radius, "platform_radius": platform}
    case = Case(three_upu(axes="tsai"), numbers, [0, 0, height], [Task([0, 0, 0, 0, 0, 1])], workspace=workspace)
    return replace(case, loading=Loading((load,)))


def test_a_translating_tripod_has_the_published_largest_force() -> None:
    """Prause and others: 8.08803 N is the largest of this robot, at a corner of the box."""
    robot = tripod(Load("load", (2.0, 2.0, -10.0)), 0.5, 0.12, 0.45)
    found = motors_of(robot)
    largest = max(abs(each.reached) for each in found.values())
    bound = max(abs(each.bound) for each in found.values())
    assert largest == pytest.approx(8.08803, abs=1e-5)
    assert largest <= bound <= 1.0101 * largest
    d, w = 0.38, np.array([2.0, 2.0, -10.0])
    grid = np.stack(np.meshgrid(*[np.linspace(-0.1, 0.1, 9)] * 2, np.linspace(0.4, 0.5, 9)), axis=-1).reshape(-1, 3)
    for k in range(3):
        e = np.array([math.cos(2 * math.pi * k / 3), math.sin(2 * math.pi * k / 3), 0.0])
        bracket = 2 * (w[2] * (grid @ e) - grid[:, 2] * (w @ e)) / d + w[2]
        forces = -np.linalg.norm(grid - d * e, axis=1) * bracket / (3 * grid[:, 2])
        low, high = (found["force", k, "load", sense] for sense in (Sense.MIN, Sense.MAX))
        assert low.bound <= forces.min()
        assert forces.max() <= high.bound
        for each, extreme in ((low, forces.min()), (high, forces.max())):
            assert abs(each.bound - extreme) <= 0.02 * largest
    for number, outcome in ((8.09, Outcome.PROVED), (8.08, Outcome.REFUTED)):
        claims = judge_workspace(replace(robot, limits=Limits(ActuatorForce(max=number))), jobs=1).extremes
        (worst,) = [each for each in claims if each.name == "actuator_force actuator 1 load load"]
        assert worst.outcome is outcome
        assert worst.reached == pytest.approx(8.08803, abs=5e-6)
        assert worst.bound >= 8.08803 - 5e-6
        assert worst.bound <= 8.09 or outcome is Outcome.REFUTED  # where a pose decides
        assert worst.pose is not None
        x, y, z = worst.pose.position
        assert (x, abs(y), z) == pytest.approx((0.1, 0.1, 0.4), abs=1e-6)


def test_numbers_that_are_zero_at_every_pose_are_bounded_in_few_boxes() -> None:
    """A platform that cannot turn holds a moment without its actuators, whose rates do not depend on a turn."""
    moment = Load("couple", moment=(1.0, 2.0, 3.0))
    judged = judge_workspace(tripod(moment, 0.5, 0.12, 0.45), jobs=1)
    assert all(each.outcome is Outcome.PROVED and each.boxes == 1 for each in judged.extremes if each.motor)
    (table,) = motor_tables(judged.case, workspace_of(judged).motors or ())
    assert [str(cell) for cell in table.rows[0][3:5]] == ["0", "0"]
    case = at_home("tripteron", part=0.005)
    workspace = replace(case.workspace, turns=Turns()) if case.workspace else None
    push = Load("push", force=(3.0, 0.0, 0.0))
    found = motors_of(replace(case, workspace=workspace, loading=Loading((push,), Motion(angular=1.0))))
    assert all(each.outcome is Outcome.PROVED for each in found.values())
    # One slide holds a push along it, the two others none of it, and a platform that cannot turn takes no speed.
    held = [(name, each) for name, each in found.items() if abs(each.reached) > 2.9]
    assert {(number, load) for (number, _, load, _), _ in held} == {("force", "push")}
    assert len({k for (_, k, _, _), _ in held}) == 1
    rest = [each for each in found.values() if abs(each.reached) <= 2.9]
    assert len(rest) >= 4
    assert all(abs(each.bound) <= 3e-3 and abs(each.reached) <= 3e-9 for each in rest)


def test_actuators_share_the_time_and_a_power_is_at_most_force_times_speed() -> None:
    """Where the time ends all searches, the last actuator has bounds as the first one has."""
    case = at_home("3-upu", part=0.02)
    workspace = replace(case.workspace, turns=Turns()) if case.workspace else None
    load = Load("push", (1.0, 2.0, -10.0), any_force=1.0)
    case = replace(case, workspace=workspace, loading=Loading((load,), Motion(1.0, 0.2)))
    found = motors_of(case, gap=0.5, time_limit=1.0)
    assert any(each.outcome is Outcome.OPEN for each in found.values())
    assert all(each.boxes > 0 and math.isfinite(each.bound) for each in found.values())
    for (number, k, load_name, _), each in found.items():
        if number in ("power", "braking"):
            sense, sign = (Sense.MAX, 1.0) if number == "power" else (Sense.MIN, -1.0)
            force, speed = found["force", k, load_name, sense], found["speed", k, "", Sense.MAX]
            assert each.bound <= max(sign * force.bound, 0.0) * speed.bound * (1 + 1e-12)


def test_nothing_is_proved_where_a_force_has_no_bound() -> None:
    """A robot whose base and platform have one radius is singular at every pose; another at some poses."""
    found = motors_of(tripod(Load("load", (2.0, 2.0, -10.0)), 0.3, 0.3, 0.45), time_limit=2.0)
    assert all(each.outcome is Outcome.OPEN and math.isinf(each.bound) for each in found.values())
    turns = Turns(TurnKind.AXIS, (Free(-2.0, 2.0),), (0, 0, 1))
    case = case_of_legs(Legs(ring(), 0.5 * ring()))
    workspace = Workspace([0.0, 0.0, 1.0], turns)  # singular with plates turned to each other by 90 degrees
    case = replace(case, loading=Loading((Load("turn", moment=(0.0, 0.0, 1.0)),)), workspace=workspace)
    found = motors_of(case, time_limit=3.0)
    assert not any(each.outcome is Outcome.PROVED for each in found.values())


_CASE = """
load = [{ name = "push", point = [0, 0, 2], any = { force = 100 } }]
motion = { linear = 10, angular = 0.5 }
"""


def loaded(folder: Path, limits: str) -> Path:
    """LinuxCNC's hexapod over a smaller box with a load, a motion and limits."""
    text = find_case("hexapod-linuxcnc").read_text(encoding="utf-8")
    text = re.sub(r"\[limits\]\n.*\n", f"[limits]\n{limits}\n", text)
    text = text.replace("min = -5, max = 5", "min = -1, max = 1").replace("min = -20, max = 20", "min = -4, max = 4")
    return saved(folder / "loaded.toml", _CASE + text)


def test_limits_on_actuators_are_proved_refuted_by_a_pose_that_evaluate_shows_and_left_open(tmp_path: Path) -> None:
    plain = motors_of(load_case(str(loaded(tmp_path, ""))))
    force = max(each.reached for (number, *_), each in plain.items() if number == "force")
    wide = "actuator_force = {{ max = {0} }}\nactuator_speed = {{ max = 11 }}\nactuator_power.2- = {{ max = 2000 }}"
    path = loaded(tmp_path, wide.format(1.003 * force))
    found = judge_workspace(load_case(str(path)), jobs=1)
    limited = [each for each in found.extremes if each.key]
    assert found.is_proved
    counts = {"actuator_force.max": 12, "actuator_speed.max": 6, "actuator_power.2-.max": 2}
    assert Counter(each.key for each in limited) == counts
    assert not any(each.key for each in found.extremes if each.name.startswith("actuator_power actuator 1"))
    # The gap of the numbers alone would leave a limit this near undecided.
    assert max(abs(each.bound) for each in limited if each.key == "actuator_force.max") <= 1.003 * force * (1 + 1e-9)

    tight = loaded(tmp_path, f"actuator_force = {{ min = -{2 * force}, max = {0.999 * force} }}")
    result = tmp_path / "result.json"
    ended = ran("workspace", str(tight), "--json", str(result))
    assert ended.code == 1
    words = commands_in(ended.out, "see it with")[0]
    refuted = [each for each in json.loads(result.read_text())["extremes"] if each["outcome"] == "refuted"]
    worst = max(refuted, key=lambda each: each["reached"])
    shown = json.loads(ran(*words, "--json", "-").out)
    (load,) = shown["loads"]
    largest = max(load["actuators"], key=lambda each: each["largest"])
    assert worst["name"].startswith(f"actuator_force actuator {largest['actuator']} ")
    # The command has a pose with as few digits as still show the fault.
    assert largest["largest"] == pytest.approx(worst["reached"], rel=1e-6)
    assert largest["largest"] > 0.999 * force

    found = motors_of(load_case(str(loaded(tmp_path, wide.format(1.003 * force)))), time_limit=1e-4)
    assert {each.outcome for each in found.values() if each.key} == {Outcome.OPEN}


def test_the_motor_sheet_is_in_all_outputs(tmp_path: Path) -> None:
    path = loaded(tmp_path, "actuator_force = { min = -200, max = 100 }")
    files = {option: tmp_path / f"out.{option}" for option in ("json", "csv", "html")}
    asked = [word for option, file in files.items() for word in (f"--{option}", str(file))]
    ended = ran("workspace", str(path), *asked)
    assert ended.code == 0
    result = json.loads(files["json"].read_text(encoding="utf-8"))
    motors = result["motors"]
    kinds = [("coordinate", None), ("force", "push"), ("speed", None), ("power", "push")]
    assert Counter((each["number"], each.get("load")) for each in motors) == dict.fromkeys(kinds, 6)
    by = {(each["actuator"], each["number"]): each for each in motors}
    assert by["1-", "force"]["smallest"]["limit"] == -200
    assert "smallest" not in by["1-", "speed"]
    assert "limit" not in by["1-", "power"]["largest"]
    # What has a limit is among the limits too, and nothing else of the motors.
    names = [each["name"] for each in result["extremes"] if each["name"].startswith("actuator_")]
    assert len(names) == 12
    assert all(name.startswith("actuator_force actuator") for name in names)
    lengths = {each["sense"]: each for each in result["extremes"] if each["name"] == "leg_length limb 1-"}
    assert by["1-", "coordinate"]["smallest"]["bound"] == lengths["min"]["bound"]
    rows = rows_of(files["csv"].read_text(encoding="utf-8").split("motors\n")[1].split("\n\n")[0])
    assert [row["actuator"] for row in rows] == ["1-", "1+", "2-", "2+", "3-", "3+"]
    for row in rows:
        least, most = (
            [by[row["actuator"], what].get(end, {}).get("bound") for what in ("coordinate", "force", "speed", "power")]
            for end in ("smallest", "largest")
        )
        keys = ("from, in", "to, in", "push, N", "pull, N", "speed, in/s", "power, N in/s")
        wanted = [least[0], most[0], most[1], -least[1], *most[2:]]
        assert [float(row[key]) for key in keys] == pytest.approx(wanted, rel=1e-15)
        assert row["outcome"] == "proved"
        assert most[3] <= max(most[1], -least[1]) * most[2]
    page = files["html"].read_text(encoding="utf-8")
    assert 'id="workspace-motors"' in page
    assert f"{by['2-', 'force']['largest']['bound']:.7g}" in page
    assert "motor requirements: proved bounds" in ended.out
    plain = json.loads(ran("workspace", "hexapod-linuxcnc", "--json", "-").out)
    assert "motors" not in plain


def test_bounds_that_are_missing_are_said_in_the_sheet_or_open_with_the_reason() -> None:
    found = judge_workspace(replace(at_home("3-rrs"), loading=Loading((Load("w", (0.0, 0.0, -1.0)),))), time_limit=1e-4)
    (table,) = motor_tables(found.case, workspace_of(found).motors or ())
    assert [header.partition("\n")[0] for header in table.headers][3:5] == ["torque forwards", "torque backwards"]
    assert {str(row[3]) for row in table.rows} == {"no bound"}
    assert "without a limit undecided" in verdict_words(workspace_of(found))
    case = replace(at_home("exechon"), loading=Loading((Load("push", (0.0, 0.0, -10.0)),)))
    found = list(motor_extremes(Subject(case, case.model, None, "errors take freedoms from the robot")))
    assert len(found) == 6
    for each in found:
        assert each.outcome is Outcome.OPEN
        assert math.isinf(each.bound)
        assert each.reason == "errors take freedoms from the robot"


def test_with_a_tolerance_every_machine_keeps_the_bounds() -> None:
    t, turns = 2e-3, Turns(TurnKind.AXIS, (Free(-0.1, 0.1),), (0.0, 0.6, 0.8))
    robot = Legs(ring(), twisted(), t)
    place = [Free(-0.05, 0.05), 0.02, Free(0.95, 1.05)]
    case = replace(case_of_legs(robot), loading=LOADING, workspace=Workspace(place, turns))
    found = motors_of(case)
    exact = motors_of(replace(case, joint_centre_tolerance=None))
    assert all(each.outcome is Outcome.PROVED for each in found.values())
    rng, worst = np.random.default_rng(5), dict.fromkeys(found, -math.inf)
    for k in range(1500):
        ends = rng.uniform([-0.05, 0.95, -0.1], [0.05, 1.05, 0.1]) if k % 2 else rng.choice([0.05, -0.05], 3)
        x, z, turn = ends if k % 2 else (ends[0], 1 + ends[1], 2 * ends[2])
        errors = rng.normal(size=(2, 6, 3))
        errors *= t / np.linalg.norm(errors, axis=2, keepdims=True)
        machine = Legs(robot.base + errors[0], robot.platform + errors[1])
        shown = numbers_at(machine, LOADING, np.array([x, 0.02, z]), turn_about(turns.axis, float(turn)))
        for key, value in shown.items():
            worst[key] = max(worst[key], key[3].sign * value)
    for key, each in found.items():
        sign, design = each.sense.sign, exact[key]
        assert worst[key] <= sign * each.bound, key
        # The design is one of the machines, and the change by errors of all centres is of first order.
        assert sign * design.reached <= sign * each.bound
    forces = [key for key in found if key[0] == "force"]
    # Some machine that was sampled is worse than any pose of the design.
    assert any(worst[key] > key[3].sign * exact[key].bound for key in forces)
    changes = [key[3].sign * (found[key].bound - exact[key].reached) for key in forces]
    assert max(changes) <= 0.08 * max(abs(found[key].bound) for key in forces)


def test_slices_show_where_limits_on_actuators_hold() -> None:
    """A random pose of each box against numbers in NumPy alone."""
    rng = np.random.default_rng(3)
    robot = six_legs(rng)
    limits = Limits(ActuatorForce(max=13.0, min=-6.0), ActuatorSpeed(max=0.7585), ActuatorPower("1", max=5.0))
    turns = Turns(TurnKind.ROLL_PITCH_YAW, (0.0, 0.0, 0.0))
    workspace = Workspace((Free(-0.2, 0.2), 0.1, Free(0.9, 1.2)), turns)
    case = replace(case_of_legs(robot), loading=LOADING, limits=limits, workspace=workspace)
    (found,) = slices_of(case)
    assert found.left_out == ()
    keys = {"actuator_force.max": 13.0, "actuator_force.min": -6.0, "actuator_speed.max": 0.7585}
    assert {each.key: each.limit for each in found.limits} == keys | {"actuator_power.1.max": 5.0}
    low, high = found.boxes[:, :2], found.boxes[:, 2:]
    points = low + rng.uniform(size=low.shape) * (high - low)
    over = np.zeros((len(points), len(found.limits)))
    for row, (x, z) in zip(over, points.tolist(), strict=True):
        values = numbers_at(robot, LOADING, np.array([x, 0.1, z]), np.eye(3))
        for k, each in enumerate(found.limits):
            _, what, *own, end = re.split("[_.]", each.key)
            sense = Sense(end)
            row[k] = max(
                sense.sign * (value - each.limit)
                for (word, leg, _, side), value in values.items()
                if side is sense
                and word in (("power", "braking") if what == "power" else (what,))
                and (not own or leg == int(own[0]) - 1)
            )
    is_large = (high - low).min(axis=1) > 2 * (high - low).min()
    assert (over[found.binding == KEPT] <= 0).all()
    for k in range(len(found.limits)):
        own = over[(found.binding == k) & is_large, k]
        assert len(own) > 10
        assert (own > 0).all()
    size = np.prod(high - low, axis=1)
    assert size[found.binding == KEPT].sum() > 0.1 * size.sum()
    assert size[found.binding == UNDECIDED].sum() < 0.05 * size.sum()


def test_slices_show_limits_on_actuators_where_loops_are_followed() -> None:
    """A random pose of some boxes of a Delta, whose rotation follows from its position, against single poses."""
    case, rng = at_home("delta", part=0.05), np.random.default_rng(4)
    assert case.workspace is not None
    place = [case.workspace.position[0], 0.0, case.workspace.position[2]]
    load = Loading((Load("w", (3.0, 2.0, -1.0), any_force=2.0),))
    case = replace(case, workspace=replace(case.workspace, position=place), loading=load)
    limit = 1.01 * float(np.abs(held_at(case, case.position, Rotation())[0].forces).max())  # type: ignore[arg-type]
    (found,) = slices_of(replace(case, limits=Limits(ActuatorForce(max=limit))))
    assert found.left_out == ()
    size = np.prod(found.boxes[:, 2:] - found.boxes[:, :2], axis=1)
    of_force = [each.key for each in found.limits].index("actuator_force.max")
    for state in (KEPT, of_force):
        own = np.flatnonzero(found.binding == state)
        assert size[own].sum() > 0.1 * size.sum()
        for low, high in found.boxes[own[np.argsort(size[own])[-16:]]].reshape(-1, 2, 2):
            x, z = low + rng.uniform(size=2) * (high - low)
            largest = float(np.abs(held_at(case, [x, 0.0, z], Rotation())[0].forces).max())
            assert (largest <= limit) == (state == KEPT)


def test_the_tighter_of_a_limit_for_all_actuators_and_one_of_its_own_is_a_claim() -> None:
    """No two claims have one name and sense: a checker would hold the number to one of their limits alone."""
    every, loading = [ActuatorForce(max=3.0), ActuatorSpeed(max=5.0)], Loading((Load("w", (0, 0, -1)),), Motion(1))
    own = [ActuatorForce("1", min=-9.0, max=2.0), ActuatorForce("2", max=4.0), ActuatorForce("3", min=-1.0)]
    for limits in ([*every, *own], [*reversed(own), *reversed(every)]):
        claims = list(motor_claims(replace(at_home("delta"), loading=loading, limits=Limits(*limits))))
        assert len({each.label for each in claims}) == len(claims)
        assert {(each.name, each.key): each.limit for each in claims if each.limit is not None} == {
            **{(f"actuator_speed actuator {k}", "actuator_speed.max"): 5.0 for k in (1, 2, 3)},
            **{(f"actuator_force actuator {k} backwards load w", "actuator_force.max"): -3.0 for k in (1, 2, 3)},
            ("actuator_force actuator 1 load w", "actuator_force.1.max"): 2.0,
            ("actuator_force actuator 2 load w", "actuator_force.max"): 3.0,
            ("actuator_force actuator 3 load w", "actuator_force.max"): 3.0,
            ("actuator_force actuator 1 smallest load w", "actuator_force.1.min"): -9.0,
            ("actuator_force actuator 3 smallest load w", "actuator_force.3.min"): -1.0,
        }
