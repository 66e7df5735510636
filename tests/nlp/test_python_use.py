"""The package as a notebook meets it: one import, numbers by name, and sentences for slips."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from math import cos, radians, sin

import numpy as np
import pytest
from builders import Run

import screwsynth as ss

DIMENSIONS = {"x1": 12, "x2": 8, "x3": radians(30), "x4": radians(8)}
SCREW = ss.Task.screw("max", axis=[2, 2, 1], point=[2, 3, 6], pitch=1)


def hexapod(limits: ss.Limits | None = None, tasks: tuple[ss.Task, ...] = (SCREW,)) -> ss.Case:
    """A platform of fixed size whose place is free."""
    position = [ss.Free(-10, 10), ss.Free(-10, 10), ss.Free(20, 50)]
    rotation = ss.Rotation(axis=None, angle=ss.Free(-radians(30), radians(30)))
    limits = limits or ss.Limits(leg_length=(None, 60))
    units = ss.Units("cm", "deg")
    return ss.Case(ss.stewart_gough(), DIMENSIONS, position, tasks, rotation, limits=limits, units=units)


@pytest.fixture(scope="module")
def solution() -> ss.Solution:
    return ss.solve(hexapod(), starts=8)


def leg_rates(position: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """J (6, 6) of the octahedral platform without rotation, and its rates: written here by plain vectors."""
    rows = []
    for corner in range(3):
        for side in (1, -1):
            base, top = (2 * math.pi * corner / 3 + side * DIMENSIONS[angle] for angle in ("x3", "x4"))
            rows.append((12 * np.array([cos(base), sin(base), 0]), 8 * np.array([cos(top), sin(top), 0])))
    spans = [np.array(position) + top - base for base, top in rows]
    units = [span / np.linalg.norm(span) for span in spans]
    J = np.array([[*unit, *np.cross(base, unit)] for unit, (base, _) in zip(units, rows, strict=True)])
    omega = np.array([2, 2, 1]) / 3
    v = np.cross([2, 3, 6], omega) + omega
    return J, J[:, :3] @ v + J[:, 3:] @ omega


# evaluate(case)


@pytest.mark.parametrize(
    "name", ["paper-4.1-helical", "hexapod-machining", "flight-simulator", "pick-and-place", "paper-4.2"]
)
def test_a_case_is_evaluated_as_the_command_does(name: str, cli: Run) -> None:
    state = ss.evaluate(ss.load_case(name))
    _, out, _ = cli("evaluate", name, "--json", "-")
    shown = json.loads(out)
    first = shown["poses"][0] if "poses" in shown else shown
    assert state.position.tolist() == first["pose"]["position"]
    assert (state.F, state.rank) == (first["F"], shown["rank"])
    assert (state.rates.tolist(), state.jacobian.tolist()) == (shown["rates"], shown["jacobian"])


def test_f_of_a_case_is_that_of_its_legs_at_the_middle_of_the_ranges() -> None:
    state = ss.evaluate(hexapod())
    J, rates = leg_rates((0, 0, 35))
    assert state.position == pytest.approx((0, 0, 35))
    order = [int(np.argmin([np.linalg.norm(row - one) for one in J])) for row in state.jacobian]
    assert sorted(order) == list(range(6))
    assert state.jacobian == pytest.approx(J[order], abs=1e-12)
    assert state.rates == pytest.approx(rates[order], abs=1e-12)
    assert pytest.approx(float(rates @ rates), rel=1e-12) == state.F


def test_a_program_is_evaluated_at_a_point_and_a_pose_as_before(solution: ss.Solution) -> None:
    assert solution.state is not None
    assert pytest.approx(solution.F, rel=1e-12) == ss.evaluate(solution.nlp, solution.x).F
    assert pytest.approx(solution.F, rel=1e-12) == ss.evaluate(solution.case, solution.x).F
    assert ss.evaluate(solution.nlp).F == ss.evaluate(solution.case).F
    with pytest.warns(DeprecationWarning, match=r"^evaluate\(nlp=\.\.\.\): deprecated; use case=\.\.\.$") as warned:
        assert ss.evaluate(nlp=solution.nlp, x=solution.x).F == solution.F  # type: ignore[call-arg]
    assert warned[0].filename == __file__
    several = ss.load_case("flight-simulator")
    assert [ss.evaluate(several, pose=k).position.tolist() for k in (0, 1)] == [
        [float(value) for value in several.poses[k].position] for k in (0, 1)
    ]


def test_a_case_with_limits_on_a_path_is_evaluated_without_their_motion() -> None:
    case = hexapod(ss.Limits(leg_length=(None, 60), actuator_speed={"max": 3.0}))
    assert ss.evaluate(case).F == ss.evaluate(hexapod()).F


# case.replace


def test_numbers_are_replaced_in_the_units_of_the_case() -> None:
    case = hexapod()
    other = case.replace({"limits.leg_length.max": 50, "p_z.max": 40, "task.pitch": 2}, x2=7, x3=20)
    assert dict(other.parameters) == {"x1": (12.0,), "x2": (7.0,), "x3": (radians(20),), "x4": case.parameters["x4"]}
    assert other.position == (ss.Free(-10, 10), ss.Free(-10, 10), ss.Free(20, 40))
    assert other.limits == ss.Limits(ss.LegLength(max=50))
    omega = np.array([2, 2, 1]) / 3
    assert other.tasks[0].twist == pytest.approx([*omega, *(np.cross([2, 3, 6], omega) + 2 * omega)])
    assert case.parameters["x2"] == (8.0,)
    assert (other.model, other.units, other.name, other.source) == (case.model, case.units, "case", None)
    assert case.replace(x1=np.float64(11), x2=np.int64(7)).parameters["x2"] == (7.0,)
    assert case.replace().parameters == case.parameters
    turned = case.replace(axis=np.array([0, 3, 4]), angle=10)
    assert (turned.rotation.axis, turned.rotation.angle) == (pytest.approx((0, 0.6, 0.8)), radians(10))


def test_what_no_case_file_can_state_stays() -> None:
    """A robot without a name, a rotation's form, and compiled search."""
    model = replace(ss.stewart_gough(), name="made in Python", options={})
    rotation = ss.Rotation.from_rpy(0.1, 0.2, 0.3)
    search = ss.Search(starts=3, compiled=True)
    case = ss.Case(model, DIMENSIONS, (0, 0, 30), [SCREW], rotation, search=search)
    with pytest.raises(ss.CaseError, match="no such robot"):
        case.to_toml()
    other = case.replace(x2=7)
    assert (other.model, other.search) == (model, search)
    assert other.rotation.form is rotation.form
    assert other.replace(angle=5).rotation.form is not rotation.form
    path = ss.PathFile("part.ngc", folder="elsewhere")
    moved = replace(case, path=path).replace({"path.place.x": 4})
    assert moved.path == replace(path, place=(4.0, 0.0, 0.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("name", ["hexapod-machining", "flight-simulator", "pick-and-place", "handling-3-upu"])
def test_replacing_is_what_reading_the_file_with_settings_is(name: str) -> None:
    case = ss.load_case(name)
    first = next(iter(case.parameters))
    settings = {f"limits.{'leg_length.max' if case.model.legs else 'condition_number.length'}": 33.0}
    settings = settings if name != "handling-3-upu" else {}
    value = 1.01 * float(getattr(case.components(first)[0], "first", case.components(first)[0]))
    settings[first] = value
    if name == "pick-and-place":
        settings = {first: value}
    assert case.replace(settings).to_toml() == ss.load_case(name, settings).to_toml()
    assert case.replace(settings).source == case.source


BAD = [
    ({"x9": 1}, "x9: cannot be set; allowed: x1, x2, x3, x4, p_x"),
    ({"p_w": 1}, "p_w: cannot be set; did you mean 'p_z'?"),
    (
        {"limits.leg_lenght.max": 4},
        "limits.leg_lenght: no such limit for the robot 'stewart-gough'; did you mean 'leg_length'?",
    ),
    ({"p_z.max": 10}, "pose.position[2].min = 20.0: must be below max = 10 cm"),
    ({"x2.max": 10}, "x2.max: cannot be set: x2 is fixed"),
    ({"x2": -1}, "robot.parameters.x2 = -1.0: must be at least 0 cm"),
    ({"axis": [0, 0]}, "pose.rotation.axis: must have 3 entries, got 2"),
    ({"x2": math.nan}, "robot.parameters.x2 = nan: must be finite"),
    ({"path.place.x": 1}, "path.place.x: cannot be set: the case has no table [path]"),
]


@pytest.mark.parametrize(("settings", "sentence"), BAD)
def test_a_wrong_number_is_refused_in_the_sentence_of_the_shell(settings: dict[str, float], sentence: str) -> None:
    with pytest.raises(ss.CaseError) as refused:
        hexapod().replace(settings)
    assert str(refused.value).startswith(sentence)
    shipped = ss.load_case("paper-4.1-helical")
    with pytest.raises(ss.CaseError) as in_python:
        shipped.replace(settings)
    with pytest.raises(ss.CaseError) as in_the_shell:
        ss.load_case("paper-4.1-helical", settings)
    assert str(in_python.value) == str(in_the_shell.value)


@pytest.mark.parametrize(("value", "kind"), [("7", "str"), (None, "NoneType"), (True, "bool"), (ss.Free(3, 4), "Free")])
def test_what_is_no_number_is_refused(value: object, kind: str) -> None:
    with pytest.raises(ss.CaseError, match=rf"^x2: must be a number, got {kind} "):
        hexapod().replace(x2=value)  # type: ignore[arg-type]


# solution["x1"]


def test_a_solution_has_its_numbers_by_name_in_the_units_of_the_case(solution: ss.Solution) -> None:
    state = solution.state
    assert state is not None
    assert (solution["x1"], solution["x2"]) == (12, 8)
    assert (solution["x3"], solution["x4"]) == (30, 8)
    assert solution.parameters == {"x1": 12, "x2": 8, "x3": 30, "x4": 8}
    assert [solution[f"p_{axis}"] for axis in "xyz"] == state.position.tolist()
    assert solution["angle"] == pytest.approx(math.degrees(state.angle), rel=1e-13)
    assert solution["axis"] == tuple(state.axis.tolist())
    assert solution.jacobian is state.jacobian
    again = solution.case.replace({"angle": solution["angle"], "axis": solution["axis"]}, p_x=solution["p_x"])
    again = again.replace(p_y=solution["p_y"], p_z=solution["p_z"])
    assert pytest.approx(solution.F, rel=1e-12) == ss.evaluate(again).F


def test_components_poses_and_directions_have_names_too() -> None:
    points = ss.solve(ss.load_case("paper-4.4-min"), starts=2)
    shown = points.parameters["u1_1"]
    assert isinstance(shown, tuple)
    assert [points[f"u1_1_{axis}"] for axis in "xyz"] == list(shown) == list(points["u1_1"])  # type: ignore[arg-type]
    assert math.hypot(*shown) == pytest.approx(1)
    several = ss.solve(ss.load_case("flight-simulator"), starts=1)
    assert several["pose2_p_x"] == several.case.poses[1].position[0]
    with pytest.raises(ss.InputError, match=r"^p_x: no such value; allowed: x1, x2, x3, x4, pose1_p_x, pose1_p_y"):
        _ = several["p_x"]


def test_a_name_that_a_solution_does_not_have_is_refused(solution: ss.Solution) -> None:
    with pytest.raises(
        ss.InputError, match=r"^x9: no such value; allowed: x1, x2, x3, x4, p_x, p_y, p_z, angle, axis$"
    ):
        _ = solution["x9"]
    with pytest.raises(TypeError, match="not iterable"):
        list(solution)  # type: ignore[call-overload]
    outcome = replace(solution.outcomes[0], state=None)
    nowhere = replace(solution, outcomes=(outcome,))
    for read in (lambda: nowhere["x1"], lambda: nowhere.parameters, lambda: nowhere.jacobian):
        with pytest.raises(ss.EvaluationError, match="the robot does not exist at the point of this solution"):
            read()


# Task.rotation, Task.translation


def test_rotations_and_translations_are_screws_of_pitch_0_and_infinity() -> None:
    turn = ss.Task.rotation([0, 0, 2], through=[1, 2, 3])
    assert turn.twist == pytest.approx([0, 0, 1, 2, -1, 0])
    assert (turn.sense, turn.name, turn.weight) == (ss.Sense.MAX, "task", 1.0)
    push = ss.Task.translation((0, 3, 4), sense="min", name="push", weight=2)
    assert push.twist == pytest.approx([0, 0, 0, 0, 0.6, 0.8])
    assert (push.sense, push.name, push.weight, push.point) == (ss.Sense.MIN, "push", 2, None)
    case = hexapod(tasks=(ss.Task.rotation([0, 0, 1], [1, 2, 3], name="turn"), push))
    assert "pitch = 0" in case.to_toml()
    assert "pitch = inf" in case.to_toml()


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ss.Task.translation([0, 0, 0]), "task.direction = [0.0, 0.0, 0.0]: must not be zero"),
        (lambda: ss.Task.translation([0, 1]), "task.direction = [0.0, 1.0]: must be three finite numbers"),
        (lambda: ss.Task.rotation([0, 0, 0], [1, 2, 3]), "task.axis = [0.0, 0.0, 0.0]: must not be zero"),
        (lambda: ss.Task.rotation([0, 0, 1], [1, 2]), "task.through = [1.0, 2.0]: must be three finite numbers"),
        (
            lambda: ss.Task.rotation([0, 0, 1], [1, 2, math.inf]),
            "task.through = [1.0, 2.0, inf]: must be three finite numbers",
        ),
        (lambda: ss.Task.rotation([0, 0, 1], [1, 2, 3], sense="most"), "task.sense = \"most\": must be 'max' or 'min'"),
    ],
)
def test_a_wrong_motion_is_refused(make: Callable[[], ss.Task], sentence: str) -> None:
    with pytest.raises(ss.CaseError) as refused:
        make()
    assert str(refused.value).startswith(sentence)


# sweep and tradeoff


def test_a_sweep_and_a_trade_off_curve_take_the_same_range() -> None:
    case, over = hexapod(), {"limits.leg_length.max": np.linspace(50, 60, 3)}
    curve = ss.tradeoff(case, over, starts=4)
    table = ss.sweep(case, over, starts=4, engine="ipopt", jobs=1)
    assert curve.name == "limits.leg_length.max"
    assert [point.value for point in curve.points] == [50, 55, 60]
    assert [point.solution.F for point in curve.points] == pytest.approx(list(table.F), rel=1e-6)
    assert pytest.approx(407.2107, abs=5e-5) == curve.points[2].solution.F
    by_function = ss.tradeoff(lambda value: hexapod(ss.Limits(leg_length=(None, value))), over, starts=4)
    assert [point.solution.F for point in by_function.points] == pytest.approx(list(table.F), rel=1e-6)


def test_the_arguments_of_the_first_version_still_work() -> None:
    def at(value: float) -> ss.Case:
        return hexapod().replace({"limits.leg_length.max": value})

    arguments = {"name": "limits.leg_length.max", "starts": 2}
    with pytest.warns(DeprecationWarning, match=r"deprecated; use tradeoff\(case, \{name: values\}\)") as warned:
        first = ss.tradeoff(at, [50, 60], **arguments)  # type: ignore[arg-type]
    assert warned[0].filename == __file__
    with pytest.warns(DeprecationWarning, match="tradeoff"):
        second = ss.tradeoff(at, values=[50, 60], **arguments)  # type: ignore[call-arg]
    with pytest.warns(DeprecationWarning, match="tradeoff"):
        third = ss.tradeoff(case_at=at, values=[50, 60], **arguments)  # type: ignore[call-arg]
    now = ss.tradeoff(at, {"limits.leg_length.max": [50, 60]}, starts=2)
    expected = [point.solution.F for point in now.points]
    for found in (first, second, third):
        assert found.name == now.name
        assert [point.solution.F for point in found.points] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("over", "sentence"),
    [
        ({}, "over: must name exactly one parameter, bound or limit, got none"),
        (
            {"x1": [1, 2], "x2": [1]},
            "over: must name exactly one parameter, bound or limit, got x1, x2; use sweep for several",
        ),
        ([1, 2], "over: must be a mapping from names to values, such as {'x1': [10, 12, 14]}, got list"),
        ({"x1": []}, "x1: has no values"),
        ({"x1": 12}, "over x1: must be a list of numbers, got int 12"),
        ({"x1": "10:14:3"}, "over x1: must be a list of numbers, got str '10:14:3'"),
        ({"x1": [12, 12]}, "over x1: contains a value twice; the values must be different"),
        ({"x1": [12, math.inf]}, "x1 = inf: must be a finite number"),
        ({"x9": [12, 13]}, "x9: cannot be set; allowed: x1, x2, x3, x4, p_x"),
    ],
)
def test_a_wrong_range_is_refused(over: dict[str, list[float]], sentence: str) -> None:
    with pytest.raises(ss.InputError) as refused:
        ss.tradeoff(hexapod(), over)
    assert str(refused.value).startswith(sentence)
    if over and len(over) < 2 and "x9" not in over:
        with pytest.raises(ss.InputError) as refused:
            ss.sweep(hexapod(), over)
        assert str(refused.value).startswith(sentence)


# inverse


def test_inverse_takes_roll_pitch_and_yaw(tmp_path: pytest.TempPathFactory) -> None:
    case = ss.load_case("hexapod-linuxcnc")
    angles = np.array([[0, 0, 0], [8, 0, 0], [0, -6, 0], [5, 4, -9]], dtype=float)
    positions = [(0, 0, 20), (1, 0, 20), (0, 1, 21), (0.5, -1, 19)]

    def turn(axis: int, angle: float) -> np.ndarray:
        c, s = cos(radians(angle)), sin(radians(angle))
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        R = np.eye(3)
        R[i, i] = R[j, j] = c
        R[j, i], R[i, j] = s, -s
        return R

    matrices = [turn(2, yaw) @ turn(1, pitch) @ turn(0, roll) for roll, pitch, yaw in angles]
    found = ss.inverse(case, positions, rpy=np.radians(angles))
    assert found.closed.all()
    assert found.rotations == pytest.approx(np.array(matrices), abs=1e-15)
    assert found.coordinates == pytest.approx(ss.inverse(case, positions, matrices).coordinates, rel=1e-13)
    # As the shell reads the same rows from a file.
    rows = [[*p, *a] for p, a in zip(positions, angles.tolist(), strict=True)]
    file = tmp_path / "poses.csv"  # type: ignore[operator]
    text = "\n".join(["x,y,z,roll,pitch,yaw", *(",".join(map(str, row)) for row in rows)])
    file.write_text(text, encoding="utf-8")
    read = ss.read_poses(str(file), case.units)
    assert found.rotations == pytest.approx(read.rotations, abs=1e-15)
    lost = ss.inverse(case, positions[:1], rpy=[[0, math.nan, 0]])
    assert not lost.closed.any()
    assert ss.inverse(case, np.zeros((0, 3)), rpy=np.zeros((0, 3))).coordinates.shape == (0, 6)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            {"rpy": [[0, 0, 0]], "rotations": [np.eye(3)]},
            "rpy: conflicts with rotations; give only one of them",
        ),
        ({"rpy": [0, 0, 0]}, "rpy: must be an array (N, 3) of roll, pitch and yaw for N = 1 poses, got (3,)"),
        ({"rpy": [[0, 0, 0]] * 2}, "rpy: must be an array (N, 3) of roll, pitch and yaw for N = 1 poses, got (2, 3)"),
        (
            {"rpy": [[0, 0, 45]]},
            "rpy[0][2] = 45: must be at most 2 pi in magnitude; 45 rad = 2578.3 deg; angles are radians",
        ),
        (
            {"rotations": [[0, 0, 0.1]]},
            "poses: expected arrays (N, 3) and (N, 3, 3), got (1, 3) and (1, 3); rows of roll",
        ),
    ],
)
def test_wrong_rotations_of_poses_are_refused(arguments: dict[str, object], sentence: str) -> None:
    with pytest.raises(ss.InputError) as refused:
        ss.inverse(ss.load_case("hexapod-linuxcnc"), [(0, 0, 20)], **arguments)  # type: ignore[arg-type]
    assert str(refused.value).startswith(sentence)


# Limits


def test_limits_are_stated_by_their_keys() -> None:
    by_key = ss.Limits(
        leg_length=(20, 60),
        leg_clearance=(2, None),
        actuator={"stroke_max": 12},
        base_joint_angle=0.4,
        platform_joint_angle=(None, 0.5),
        custom=["x1 - x2 >= 0"],
        actuator_force={"max": 100.0},
        radius_ratio=[None, 0.9],
    )
    by_type = ss.Limits(
        ss.LegLength(min=20, max=60),
        ss.LegClearance(2),
        ss.Actuator(stroke_max=12),
        ss.BaseJointAngle(0.4),
        ss.PlatformJointAngle(0.5),
        ss.Relations("x1 - x2 >= 0"),
        ss.ActuatorForce(max=100.0),
        ss.RadiusRatio(max=0.9),
    )
    assert by_key == by_type
    assert ss.Limits(ss.LegLength(min=20), leg_clearance=(2, None)) == ss.Limits(
        ss.LegClearance(2), ss.LegLength(min=20)
    )
    assert ss.Limits(condition_number={"max": 5, "length": 10}) == ss.Limits(ss.ConditionNumber(5, 10))
    # A quantity of the robot itself.
    assert ss.Limits(actuator_angle=(-1, 1)) == ss.Limits(ss.QuantityLimit("actuator_angle", min=-1, max=1))


@pytest.mark.parametrize(
    ("stated", "sentence"),
    [
        (
            {"leg_length": 5},
            "limits.leg_length: must be (min, max), with None for no limit, or a mapping with min, max",
        ),
        ({"leg_length": (1, 2, 3)}, "limits.leg_length: must be (min, max), with None for no limit, or a mapping"),
        ({"leg_length": {"most": 3}}, "limits.leg_length.most: no such key; allowed: min, max"),
        ({"leg_length": (60, 20)}, "limits.leg_length.min = 60.0: must be below max = 20 cm"),
        ({"leg_length": (None, None)}, "limits.leg_length: is empty: it must have min, max, or both"),
        ({"leg_length": ("a", 3)}, "limits.leg_length.min: must be a number, got str 'a'"),
        (
            {"leg_lenght": (20, 60)},
            "limits.leg_lenght: no such limit for the robot 'stewart-gough'; did you mean 'leg_length'?",
        ),
        (
            {"leg_clearance": 4},
            "limits.leg_clearance: must be (min, None), with None for no limit, or a mapping with min",
        ),
        ({"leg_clearance": (2, 3)}, "limits.leg_clearance.max: no such key; allowed: min"),
        ({"leg_clearance": (None, None)}, "limits.leg_clearance.min: is missing"),
        ({"actuator": (1, 2)}, "limits.actuator: must be a mapping with stroke_max, dead_length, got tuple (1, 2)"),
        ({"actuator": {"stroke": 3}}, "limits.actuator.stroke: no such key; did you mean 'stroke_max'?"),
        ({"joint": (1, 2)}, "limits.joint: must be stated as JointMotion or JointCone"),
        ({"custom": 4}, 'limits.custom: must be a list of relations such as "x1 - 1.5*x2 >= 0", got int 4'),
        ({"base_joint_angle": 45}, "limits.base_joint_angle.max = 2578.3100780887: must be above 0 deg"),
    ],
)
def test_wrong_limits_are_refused(stated: dict[str, tuple[float, float]], sentence: str) -> None:
    with pytest.raises(ss.CaseError) as refused:
        hexapod(ss.Limits(**stated))
    assert str(refused.value).startswith(sentence)


def test_what_is_no_limit_and_a_limit_given_twice_are_refused() -> None:
    with pytest.raises(ss.CaseError, match=r"limits: must be limits such as LegLength\(min=28\), or keys"):
        ss.Limits((20, 60))  # type: ignore[arg-type]
    with pytest.raises(ss.CaseError, match=r"limits\.leg_length: must be given once, got 2 limits"):
        ss.Limits(ss.LegLength(min=1), leg_length=(2, 3))
