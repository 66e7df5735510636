"""The robot files of the gallery, and special ones, with random dimensions, displacements and twists of them.

Files in ``special`` have joints, limbs and keys that no robot of the gallery has.
"""

import copy
import math
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from builders import Array
from mujoco_robots import Ranks
from robot_files import Robot, every_joint

import screwsynth.models
from screwsynth.models import Model, robot

ROBOTS = {path.stem: path for path in sorted((Path(screwsynth.models.__file__).parent / "robots").glob("*.toml"))}
#: Tables of the robots that are given by links and joints; the others have limbs.
NETWORKS = {
    name: tables
    for name, path in ROBOTS.items()
    if "limb" not in (tables := tomllib.loads(path.read_text(encoding="utf-8")))
}
GALLERY = {name: path for name, path in ROBOTS.items() if name not in NETWORKS}
SPECIAL = {path.stem: path for path in sorted((Path(__file__).parent / "special").glob("*.toml"))}
FILES = GALLERY | SPECIAL
LENGTH = 0.7

# dim W_k, dim C_k, rank of J, rank of the constraints, freedoms, rotations among them, freedoms with actuators locked,
# freedoms of the whole mechanism (spins of rods too).
RANKS: dict[str, Ranks] = {
    "3-prs": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-puu": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 0, 0, 3),
    "3-rps": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-rrs": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-spr": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-upu": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 0, 0, 3),
    "4-ruu": Ranks((2,) * 4, (1,) * 4, 6, 2, 4, 1, 0, 4),
    "4-upu": Ranks((2,) * 4, (1,) * 4, 6, 2, 4, 1, 0, 4),
    "6-pus": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "6-rss": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 12),
    "6-rus": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "6-sps": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 12),
    "6-ups": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "ankle": Ranks((1, 1, 4), (0, 0, 4), 6, 4, 2, 2, 0, 4),
    "delta": Ranks((1,) * 6, (0,) * 6, 6, 3, 3, 0, 0, 9),
    "delta-parallelogram": Ranks((3,) * 3, (2,) * 3, 6, 3, 3, 0, 0, 3),
    "exechon": Ranks((3, 3, 2), (2, 2, 1), 6, 3, 3, 2, 0, 3),
    "five-bar": Ranks((5, 4), (4, 3), 6, 4, 2, 1, 0, 2),
    "five-bar-pen": Ranks((5, 4), (4, 3), 6, 4, 2, 1, 0, 2),
    "five-bar-plotter": Ranks((4, 4, 4), (3, 3, 4), 6, 4, 2, 0, 0, 2),
    "linear-delta": Ranks((1,) * 6, (0,) * 6, 6, 3, 3, 0, 0, 9),
    "orthoglide": Ranks((3,) * 3, (2,) * 3, 6, 3, 3, 0, 0, 3),
    "pentapod": Ranks((1,) * 6, (0,) * 5 + (1,), 6, 1, 5, 2, 0, 5),
    "planar-3-prr": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 1, 0, 3),
    "planar-3-rpr": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 1, 0, 3),
    "planar-3-rrr": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 1, 0, 3),
    "rotary-delta": Ranks((1,) * 6, (0,) * 6, 6, 3, 3, 0, 0, 9),
    "servo-hexapod": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 12),
    "spherical-3-rrr": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 3, 0, 3),
    "tricept": Ranks((1, 1, 1, 3), (0, 0, 0, 3), 6, 3, 3, 2, 0, 3),
    "tripteron": Ranks((3,) * 3, (2,) * 3, 6, 3, 3, 0, 0, 3),
    "3-hps": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 3, 0, 3),
    "3-pprs": Ranks((2,) * 3, (0,) * 3, 6, 0, 6, 3, 0, 6),
    "3-rprrr": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-rps-ups": Ranks((2, 2, 2, 0), (1, 1, 1, 0), 6, 3, 3, 2, 0, 3),
    "6-cps": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "6-hus": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "planar-centre": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 1, 0, 3),
    "planar-loose": Ranks((4, 4, 4, 3), (3, 3, 3, 3), 6, 3, 3, 1, 0, 5),
}

#: Values of an earlier, separate computation, printed with ten and six decimals: dimensions where they are not those of
#: the file, F(CHI), F of the feasible part of CHI, its actuator rates, and F(CHI) with every actuator driven by 0.05.
DELTA = {"rb": 0.4, "rp": 0.12, "arm": 0.45, "tilt": math.degrees(0.4)}
DELTA["rod"] = math.hypot(0.28 + 0.45 * math.cos(0.4), 0.85 - 0.45 * math.sin(0.4))
UPS = {"rb": 1, "rp": 0.6, "base_half": math.degrees(0.35), "platform_half": math.degrees(0.75), "h": 1.2}
UPS_RATES = [-0.156067, -0.207255, -0.566661, 0.345771, -0.390167, -0.131767]
DELTA_RATES = [-0.355875, -0.216789, 1.581346]
CHI = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
REFERENCE: dict[str, tuple[dict[str, float], float, float, list[float], float]] = {
    "6-ups": (UPS, 0.6775666447, 0.6775666447, UPS_RATES, 0.6896774965),
    "3-rps": ({}, 0.9536868613, 0.2822638991, [0.051880, -0.095752, -0.520004], 0.9659029686),
    "3-upu": ({}, 0.7811721401, 0.2159301561, [-0.337393, -0.306747, 0.089456], 0.7929893869),
    "tricept": (
        *({"turn": math.degrees(0.3)}, 0.9213889813, 0.3712266112),
        *([0.230770, -0.301242, -0.476681], 0.9286716318),
    ),
    "delta": (DELTA | {"w": 0.1}, 2.5478782427, 0.9190027654, DELTA_RATES, 2.5578274323),
    "delta-parallelogram": (DELTA, 2.2416295709, 0.4595013827, DELTA_RATES, 2.2466369256),
    "planar-3-rrr": (
        *({"turn": math.degrees(0.2)}, 1.5138660321, 0.8315910321),
        *([-1.653630, 0.169939, 0.704750], 1.5472838594),
    ),
    "spherical-3-rrr": ({}, 2.0867, 0.4067, [0.3, -0.5, 0.7], 2.1008863285),
}


@cache
def table(name: str) -> dict[str, Any]:
    return tomllib.loads(FILES[name].read_text(encoding="utf-8"))


@cache
def model_of(name: str) -> Model:
    return robot(**table(name))


def snu() -> dict[str, Any]:
    """The 3-UPU with the first axes of its universal joints along the radius."""
    tables = copy.deepcopy(table("3-upu"))
    for k in (0, 2):
        joint = tables["limb"][0]["joints"][k]
        joint["axes"] = ["x" if axis == "y" else "cross(x, A - B)" for axis in joint["axes"]]
    return tables


def size_of(robot: Robot) -> float:
    points = [joint.point for limb in robot.limbs for joint in every_joint(limb)]
    return float(np.max(np.ptp(points, axis=0)))


#: Largest displacement of a slide in parts of the robot's size, where it is less than 0.05: struts with short arms.
SLIDES = {"pentapod": 0.005}


def random_displacements(robot: Robot, rng: np.random.Generator) -> Array:
    """Displacements of the actuators up to 0.1 rad and up to 5 percent of the robot's size."""
    actuated = [joint for limb in robot.limbs for joint in every_joint(limb) if joint.actuated]
    share = SLIDES.get(robot.name, 0.05)
    largest = [share * size_of(robot) if joint.kind == "P" else 0.1 for joint in actuated]
    return rng.uniform(-1, 1, len(actuated)) * largest


def random_twist(robot: Robot, rng: np.random.Generator) -> Array:
    return rng.normal(size=6) * [1, 1, 1, *[size_of(robot)] * 3]


def random_dimensions(name: str, rng: np.random.Generator) -> dict[str, float]:
    """Typical dimensions changed by up to 4 percent."""
    return {key: entry["typical"] * rng.uniform(0.96, 1.04) for key, entry in table(name)["dimensions"].items()}
