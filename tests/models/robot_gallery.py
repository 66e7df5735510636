"""The robot files of the gallery, and special ones, with random dimensions, displacements and twists of them.

Files in ``special`` have joints, limbs and keys that no robot of the gallery has.
"""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from builders import Array
from robot_files import Robot, every_joint

import screwsynth.models

GALLERY = {path.stem: path for path in sorted((Path(screwsynth.models.__file__).parent / "robots").glob("*.toml"))}
SPECIAL = {path.stem: path for path in sorted((Path(__file__).parent / "special").glob("*.toml"))}
FILES = GALLERY | SPECIAL
LENGTH = 0.7


@cache
def table(name: str) -> dict[str, Any]:
    return tomllib.loads(FILES[name].read_text(encoding="utf-8"))


def size_of(robot: Robot) -> float:
    points = [joint.point for limb in robot.limbs for joint in every_joint(limb)]
    return float(np.max(np.ptp(points, axis=0)))


def random_displacements(robot: Robot, rng: np.random.Generator) -> Array:
    """Displacements of the actuators up to 0.1 rad and up to 5 percent of the robot's size."""
    actuated = [joint for limb in robot.limbs for joint in every_joint(limb) if joint.actuated]
    largest = [0.05 * size_of(robot) if joint.kind == "P" else 0.1 for joint in actuated]
    return rng.uniform(-1, 1, len(actuated)) * largest


def random_twist(robot: Robot, rng: np.random.Generator) -> Array:
    return rng.normal(size=6) * [1, 1, 1, *[size_of(robot)] * 3]


def random_dimensions(name: str, rng: np.random.Generator) -> dict[str, float]:
    """Typical dimensions changed by up to 4 percent."""
    return {key: entry["typical"] * rng.uniform(0.96, 1.04) for key, entry in table(name)["dimensions"].items()}
