"""Robots that people build: actuators by closed forms of their controllers, rates by differences, boxes proved."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from builders import Array, case_from, starter_text

from screwsynth.models import robot, robot_function
from screwsynth.models.catalog import gallery_tables
from screwsynth.nlp import Case, InversePoses, Task, inverse, result_of, solve
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.units import Units

UP = Task(np.array([0.0, 0, 0, 0, 0, 1]))
#: Random poses of a robot, and largest difference of an angle (radians) or of a length in parts of the robot's.
SEED, COUNT, SAME = 49, 60, 1e-11
Dimensions = dict[str, float]


def built(name: str, **dimensions: float) -> tuple[Case, Dimensions]:
    """A robot at its typical dimensions but for some, and all dimensions; angles in radians."""
    model = robot_function(name)()
    values = {item.name: item.typical[0] for item in model.parameters} | dimensions
    return Case(model, values, model.home, [UP], units=Units(angle="rad")), values


def around(centre: list[float] | tuple[float, ...], half: list[float]) -> tuple[Array, Array]:
    """Random poses: positions (N, 3) about a centre, and roll, pitch and yaw (N, 3); half ranges, the last degrees."""
    steps = np.random.default_rng(SEED).uniform(-1, 1, (COUNT, 6)) * half
    return np.array(centre) + steps[:, :3], np.radians(steps[:, 3:])


def closed(case: Case, p: Array, rpy: Array | None = None) -> InversePoses:
    found = inverse(case, p, rpy=np.zeros_like(p) if rpy is None else rpy)
    assert found.closed.all()
    assert not found.singular.any()
    return found


def rotation(rpy: Array) -> Array:
    """Rotation (3, 3) by roll, pitch and yaw: Rz Ry Rx."""
    (a, b, c), E = rpy, np.eye(3)

    def about(k: int, angle: float) -> Array:
        one, other = (k + 1) % 3, (k + 2) % 3
        R = E.copy()
        R[one, one] = R[other, other] = math.cos(angle)
        R[other, one], R[one, other] = math.sin(angle), -math.sin(angle)
        return R

    return about(2, c) @ about(1, b) @ about(0, a)


def elbow(shoulder: complex, tip: complex, arm: float, forearm: float, side: float) -> float:
    """Angle of an arm in a plane whose elbow is on one side (1: to the left of the way to the tip)."""
    way = tip - shoulder
    cosine = (arm**2 + abs(way) ** 2 - forearm**2) / (2 * arm * abs(way))
    return float(np.angle(way)) + side * math.acos(cosine)


def wrapped(angles: Array) -> Array:
    return np.asarray((angles + math.pi) % (2 * math.pi) - math.pi)


def lineardelta(radius: float, length: float, x: float, y: float, z: float) -> Array:
    """Heights of three carriages at azimuths 0, 120 and 240 degrees over the joint circle of the effector."""
    azimuths = np.radians([0, 120, 240])
    away = (x - radius * np.cos(azimuths)) ** 2 + (y - radius * np.sin(azimuths)) ** 2
    return np.asarray(z + np.sqrt(length**2 - away))


def rotarydelta(radius: float, arm: float, rod: float, place: Array) -> Array:
    """Angles of three arms below the horizontal; the place is that of the effector from the shoulders' plane."""
    found = []
    for azimuth in np.radians([0, 120, 240]):
        x = place[0] * math.cos(azimuth) + place[1] * math.sin(azimuth)
        y = place[1] * math.cos(azimuth) - place[0] * math.sin(azimuth)
        reach = math.sqrt(rod**2 - y**2)  # of the rod, seen along the shoulder's axis
        found.append(-elbow(complex(radius), complex(x, place[2]), arm, reach, 1.0))
    return np.array(found)


def test_a_linear_delta_has_the_carriages_of_linuxcnc_and_of_the_closed_form() -> None:
    radius, length = 130.25, 269.0
    case, _ = built("linear-delta", delta_radius=radius, arm_length=length)
    # LinuxCNC's x is y here, and its y is -x.
    p = np.array([[0.0, 0, 0], [20.0, -10, 5]])
    heights = closed(case, p).coordinates + math.sqrt(length**2 - radius**2)
    stated = [[235.363415806280] * 3, [250.165122927385, 228.684915278482, 238.552849858139]]
    np.testing.assert_allclose(heights, stated, rtol=0, atol=length * SAME)
    case, values = built("linear-delta")
    radius, length = values["delta_radius"], values["arm_length"]
    p, _ = around(case.model.home, [80, 80, 200, 0, 0, 0])
    zero = math.sqrt(length**2 - radius**2)
    expected = [lineardelta(radius, length, *each) - zero for each in p]
    np.testing.assert_allclose(closed(case, p).coordinates, expected, rtol=0, atol=length * SAME)


def test_a_rotary_delta_has_the_arms_of_linuxcnc_and_of_the_closed_form() -> None:
    tilt = math.radians(20)
    case, _ = built(
        "rotary-delta", shoulder_radius=4, shoulder_height=0, upper_arm_length=10, lower_arm_length=14,
        effector_radius=6, tilt=tilt,
    )  # fmt: skip
    # Here its x is y, and its y is -x: the poses (0, 0, -10) and (1, 0, -10) of the module.
    angles = np.degrees(closed(case, np.array([[0.0, 0, -10], [0.0, 1, -10]])).coordinates + tilt)
    stated = [[27.128862228231] * 3, [27.396064246355, 21.250539432715, 33.161020614388]]
    np.testing.assert_allclose(angles, stated, rtol=0, atol=1e-11)
    case, values = built("rotary-delta")
    p, _ = around(case.model.home, [60, 60, 60, 0, 0, 0])
    lengths = values["shoulder_radius"], values["upper_arm_length"], values["lower_arm_length"]
    places = p - [0, 0, values["shoulder_height"]]
    expected = np.array([rotarydelta(*lengths, each) for each in places]) - values["tilt"]
    np.testing.assert_allclose(closed(case, p).coordinates, expected, rtol=0, atol=SAME)


@pytest.mark.parametrize("name", ["five-bar-plotter", "five-bar-pen"])
def test_a_plotter_has_the_arms_of_two_triangles(name: str) -> None:
    case, d = built(name)
    forearms = [d.get("forearm", d.get(key, 0.0)) for key in ("left_forearm", "right_forearm")]
    size = d["arm"]
    p, rpy = around(case.model.home, [0.2 * size, 0.2 * size, 0, 0, 0, 0])

    def arms(x: float, y: float) -> list[float]:
        sides = zip((-d["base"] / 2, d["base"] / 2), forearms, (1.0, -1.0), strict=True)
        return [elbow(complex(at), complex(x, y), d["arm"], forearm, side) for at, forearm, side in sides]

    def direction(x: float, y: float) -> float:
        """Direction of the left forearm, which has the pen."""
        left = arms(x, y)[0]
        return float(np.angle(complex(x, y) - (-d["base"] / 2 + d["arm"] * np.exp(1j * left))))

    home = case.model.home
    if name == "five-bar-pen":
        rpy[:, 2] = [direction(x, y) - direction(*home[:2]) for x, y, _ in p]
    expected = np.array([arms(x, y) for x, y, _ in p]) - arms(*home[:2])
    np.testing.assert_allclose(closed(case, p, rpy).coordinates, expected, rtol=0, atol=SAME)


def test_an_ankle_has_the_motors_of_two_cranks() -> None:
    case, d = built("ankle")
    p, rpy = around((0, 0, 0), [0, 0, 0, 12, 25, 0])

    def motors(angles: Array) -> list[float]:
        found = []
        for height, side in ((d["upper"], d["side"]), (d["lower"], -d["side"])):
            foot = np.array([-d["lever"], side, d["lift"]])
            rise, crank = d["rise"], d["crank"]
            ends = np.array([-crank * math.cos(rise), side, height + crank * math.sin(rise)]), foot
            rod = float(np.linalg.norm(ends[1] - ends[0]))
            x, y, z = rotation(angles) @ foot
            reach = math.sqrt(rod**2 - (y - side) ** 2)
            # In the plane x, z the elbow is to the right of the way from the motor down to the foot; angles about y.
            angle = elbow(complex(0, height), complex(x, z), crank, reach, -1.0)
            found.append(-(angle - (math.pi - rise)))
        return found

    expected = wrapped(np.array([motors(each) for each in rpy]))
    np.testing.assert_allclose(closed(case, p, rpy).coordinates, expected, rtol=0, atol=SAME)


def test_a_servo_hexapod_by_its_sides_has_the_horns_of_its_corners() -> None:
    case, d = built("servo-hexapod", base_long=500.0, base_short=300.0, mounting=math.radians(75), horn=150.0)
    half = 0.5 * d["base_short"]
    inner = math.sqrt(3) / 6 * (2 * d["base_long"] + d["base_short"])
    corners = [inner - 1j * half, inner + 1j * half]
    corners = [each * np.exp(2j * math.pi * k / 3) for each in corners for k in range(3)]
    lengths = sorted(abs(one - other) for k, one in enumerate(corners) for other in corners[:k])
    # The sides of the base: three short ones and three long ones are the shortest distances.
    np.testing.assert_allclose(lengths[:6], [300.0] * 3 + [500.0] * 3, rtol=1e-12)
    inner = math.sqrt(3) / 6 * (2 * d["platform_long"] + d["platform_short"])
    tops = [(inner + 0.5j * s * d["platform_short"]) * np.exp(-1j * s * math.pi / 3) for s in (1, -1)]
    tops = [each * np.exp(2j * math.pi * k / 3) for each in tops for k in range(3)]
    horns = [np.exp(1j * (s * d["mounting"] + 2 * math.pi * k / 3)) for s in (-1, 1) for k in range(3)]
    rise = math.sqrt(d["rod"] ** 2 - abs(corners[0] + d["horn"] * horns[0] - tops[0]) ** 2)
    p, rpy = around((0, 0, rise), [60, 60, 60, 8, 8, 8])

    def angles(place: Array, turn: Array) -> list[float]:
        found = []
        for corner, top, horn in zip(corners, tops, horns, strict=True):
            joint = place + rotation(turn) @ [top.real, top.imag, 0]
            along = (complex(joint[0], joint[1]) - corner) * horn.conjugate()
            reach = math.sqrt(d["rod"] ** 2 - along.imag**2)
            found.append(elbow(0, complex(along.real, joint[2]), d["horn"], reach, -1.0))
        return found

    expected = np.array([angles(*each) for each in zip(p, rpy, strict=True)])
    np.testing.assert_allclose(closed(case, p, rpy).coordinates, expected, rtol=0, atol=SAME)


def pentapod_struts(d: Dimensions, place: Array, turn: Array) -> list[float]:
    """Lengths of the struts by the base joints in cylindrical coordinates about the spindle."""
    found = []
    for k in range(5):
        base = np.array([d[f"base_{k}_x"], d[f"base_{k}_y"], d["base_z"]])
        x, y, z = rotation(turn).T @ (base - place)
        collar = d[f"effector_{k}_z"] + d["tool_offset"]
        found.append(math.hypot(math.hypot(x, y) - d["effector_r"], z - collar))
    return found


def test_a_pentapod_has_the_struts_of_its_collars() -> None:
    case, d = built("pentapod")
    home = np.array(case.model.home)
    p, rpy = around(case.model.home, [40, 40, 40, 6, 6, 0])
    expected = np.array([pentapod_struts(d, *each) for each in zip(p, rpy, strict=True)])
    expected -= pentapod_struts(d, home, np.zeros(3))
    np.testing.assert_allclose(closed(case, p, rpy).coordinates, expected, rtol=0, atol=d["base_z"] * SAME)


def test_a_pentapod_has_rank_five_without_the_limb_that_takes_out_the_turn_about_the_spindle() -> None:
    case, d = built("pentapod")
    p, rpy = around(case.model.home, [40, 40, 40, 6, 6, 0])
    found = closed(case, p, rpy)
    struts = found.jacobian[:, :5]
    values = np.linalg.svd(struts / [1, 1, 1, *[d["base_z"]] * 3], compute_uv=False)
    assert (values[:, 4] > 1e-3).all()
    spindle = found.rotations[:, :, 2]
    spin = np.concatenate([np.cross(p, spindle), spindle], axis=1)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", struts, spin), 0, atol=1e-9 * d["base_z"])
    # The passive limb allows no other turn about the vertical.
    turned = inverse(case, p, rpy=np.add(rpy, [0, 0, 0.1]))
    assert not turned.closed.any()


def test_a_differential_waist_has_the_motors_of_its_couplings() -> None:
    case, d = built("differential-waist", ratio=0.8)
    _, angles = around((0, 0, 0), [0, 0, 0, 30, 30, 30])
    axes = np.eye(3)
    turns = np.array([rotation(p * axes[1]) @ rotation(r * axes[0]) @ rotation(y * axes[2]) for r, p, y in angles])
    found = inverse(case, np.zeros((COUNT, 3)), turns)
    assert found.closed.all()
    roll, pitch, yaw = angles.T
    expected = np.column_stack([roll - pitch, roll + pitch, yaw / d["ratio"] - roll])
    np.testing.assert_allclose(found.coordinates, expected, rtol=0, atol=SAME)


#: Motions that each robot can make at home, about the platform's origin: angular velocity, velocity.
MOTIONS: dict[str, Array] = {
    "linear-delta": np.eye(6)[3:],
    "rotary-delta": np.eye(6)[3:],
    "five-bar-plotter": np.eye(6)[3:5],
    "ankle": np.eye(6)[:2],
    "differential-waist": np.eye(6)[:3],
    "servo-hexapod": np.eye(6),
    "pentapod": np.eye(6)[[0, 1, 3, 4, 5]],
}


@pytest.mark.parametrize("name", MOTIONS)
def test_rates_are_differences_of_positions(name: str) -> None:
    case, values = built(name)
    home, size = np.array(case.model.home), max(abs(each) for each in values.values())
    found = closed(case, home[None])
    for motion in MOTIONS[name]:
        steps = np.array([[-1e-5], [1e-5]]) * motion * np.repeat([1.0, size], 3)
        near = closed(case, home + steps[:, 3:], steps[:, :3])
        slope = (near.coordinates[1] - near.coordinates[0]) / 2e-5
        rates = found.rates[0] @ (motion * np.repeat([1.0, size], 3))
        np.testing.assert_allclose(rates, slope, rtol=0, atol=1e-7 * max(1.0, float(np.abs(rates).max())))


@pytest.mark.parametrize(
    "name",
    ["five-bar-pen", *(pytest.param(each, marks=pytest.mark.soak) if each == "pentapod" else each for each in MOTIONS)],
)
def test_the_box_of_a_starter_is_proved(name: str) -> None:
    before, table = starter_text(name).split("# [workspace]")
    table, after = table.split("\n\n", 1)
    table = table.replace("# position", "position").replace("# rotation", "rotation")
    case = case_from(f"{before}[workspace]{table}\n\n{after}")
    case = replace(case, parameters={item.name: item.typical for item in case.model.parameters})
    assert judge_workspace(case).is_proved


def with_torques(text: str) -> str:
    """A starter whose objective is what its comments offer for motors with cranks."""
    first = "# F is about "
    before, offer = text.replace('sense = "max" ', 'sense = "min" ').split(first)
    offer, after = offer.split("\n\n", 1)
    sentence, *lines = offer.split("\n")
    return f"{before}{first}{sentence}\n" + "\n".join(line.removeprefix("# ") for line in lines) + f"\n\n{after}"


#: Robots with cranks and rods, and with other limbs behind their motors.
CRANKS = {
    **dict.fromkeys(("6-rss", "delta", "rotary-delta", "ankle", "servo-hexapod"), "the forces of the rods"),
    **dict.fromkeys(
        ("five-bar-plotter", "spherical-3-rrr", "differential-waist"), "the limbs with their motors locked"
    ),
}


@pytest.mark.parametrize("name", CRANKS)
def test_a_starter_of_cranks_says_what_f_is_about_and_offers_torques(name: str) -> None:
    text = starter_text(name)
    assert f"# F is about {CRANKS[name]}. The torque of a motor also depends on its crank" in text
    solution = solve(case_from(with_torques(text)), starts=1)
    assert solution.status.is_answer
    (load,) = result_of(solution).robot.loading.loads
    assert float(np.abs(load.forces).max()) == pytest.approx(solution.F, rel=1e-6)


@pytest.mark.parametrize("name", ["linear-delta", "6-ups", "pentapod", "hexapod"])
def test_a_starter_of_slides_has_no_torques(name: str) -> None:
    assert "[objective]" not in starter_text(name)


@pytest.mark.parametrize(
    ("name", "angles"), [("ankle", "roll pitch"), ("pentapod", "roll pitch"), ("3-rps", "roll pitch yaw")]
)
def test_a_starters_workspace_has_the_angles_that_the_robot_changes(name: str, angles: str) -> None:
    (line,) = [each for each in starter_text(name).splitlines() if each.startswith("# rotation = { roll")]
    assert [name for name in ("roll", "pitch", "yaw") if f"{name} = {{" in line] == angles.split()


def test_a_robot_of_rank_five_is_told_of_the_passive_limb() -> None:
    tables = gallery_tables("pentapod")
    tables["limb"] = tables["limb"][:5]
    model = robot(**tables)
    assert model.rank == 5
    (note,) = model.remarks
    assert note.startswith("J has rank 5 at all poses: with all actuators locked, the platform still moves")
    assert note.endswith("add a passive limb that allows all other motions, as in the robot pentapod")
    assert robot(**gallery_tables("pentapod")).remarks == ()
