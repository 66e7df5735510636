"""What tests of paths share: LinuxCNC's hexapod and a Delta, closed forms of both, and short ways to write a path."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
from builders import Array, case_from, case_of, starter_tables
from measures import circle_joints
from numpy.typing import ArrayLike

from screwsynth.nlp import Case, Judgement, ProgrammedPath, Sense, Verdict
from screwsynth.nlp.path.gcode import read_program
from screwsynth.nlp.path.options import Between, PathOptions
from screwsynth.nlp.path.poses_csv import read_poses

Floats = tuple[float, ...]
#: Joints of LinuxCNC's hexapod in inches, its legs, and its pose.
BASE, PLATFORM = circle_joints({"x1": 26.5, "x2": 11.543, "x3": 0.0, "x4": math.radians(5)})
LEGS = ("1-", "1+", "2-", "2+", "3-", "3+")
HOME = (0, 0, 20, 0, 0, 0)


def hexapod(leg_length: dict[str, float] | None = None, **tables: object) -> Case:
    """LinuxCNC's hexapod, whose legs have these limits."""
    return case_of("hexapod-linuxcnc", **{"limits": {"leg_length": leg_length} if leg_length else {}} | tables)


def robot_of(name: str, limits: dict[str, object] | None = None, **parameters: float) -> Case:
    """The starter of a robot with these limits, and some of its numbers fixed."""
    tables = starter_tables(name)
    tables["robot"]["parameters"] |= parameters
    return case_from(tables | {"limits": limits or {}})


def turns_of(angles: Array) -> Array:
    """Rotations Rz(c) Ry(b) Rx(a) (N, 3, 3) of angles (N, 3), radians."""
    (a, b, c), (d, e, f) = np.cos(angles).T, np.sin(angles).T
    rows = [
        [c * b, c * e * d - f * a, c * e * a + f * d],
        [f * b, f * e * d + c * a, f * e * a - c * d],
        [-e, b * d, b * a],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def leg_lengths(positions: Array, rotations: Array, base: Array = BASE) -> Array:
    """Lengths (N, 6) of the hexapod's legs at poses."""
    spans = positions[:, None] + np.einsum("nij,kj->nki", rotations, PLATFORM) - base
    return np.asarray(np.linalg.norm(spans, axis=2))


def lengths_at(poses: Array) -> Array:
    """Lengths (N, 6) of the hexapod's legs at poses (N, 6) of position, roll, pitch and yaw."""
    return leg_lengths(poses[:, :3], turns_of(poses[:, 3:]))


def delta_angles(p: Array, rb: float = 0.164, rp: float = 0.044, arm: float = 0.524, rod: float = 1.244) -> Array:
    """Angles (N, 3) of a Delta's cranks away from home at positions (N, 3), in home's branch; NaN out of reach.

    From the motor to the joints on the platform, in the limb's frame: |v - arm (cos t, 0, -sin t)| = rod.
    """
    found = []
    for azimuth in (0, 2 * math.pi / 3, 4 * math.pi / 3):
        c, s = math.cos(azimuth), math.sin(azimuth)
        x, y, z = c * p[:, 0] + s * p[:, 1] + rp - rb, c * p[:, 1] - s * p[:, 0], p[:, 2]
        reach, size = (x * x + y * y + z * z + arm**2 - rod**2) / (2 * arm), np.hypot(x, z)
        with np.errstate(invalid="ignore"):
            # The elbow is outside: at home the angle below the horizontal is that of the tilt.
            found.append(np.arctan2(-z, x) - np.arccos(reach / size) - math.radians(20))
    return np.stack(found, axis=1)


def halved(halves: Iterable[bool]) -> tuple[float, float]:
    """The part of 0 to 1 that is left of halves, lower or upper ones."""
    low, high = 0.0, 1.0
    for is_upper in halves:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_upper else (low, middle)
    return low, high


def program(case: Case, text: str, start: Sequence[float] | None = None, angles: str = "rpy") -> ProgrammedPath:
    return read_program(text.split("\n"), "part.ngc", case.units, PathOptions(start=start, angles=angles))


def table(
    case: Case, rows: ArrayLike, seconds: ArrayLike | None = None, between: Between | None = None
) -> ProgrammedPath:
    """A path through rows of x, y, z, roll, pitch, yaw, in degrees, at given times."""
    columns = [np.asarray(rows, dtype=float)] + ([] if seconds is None else [np.asarray(seconds)[:, None]])
    text = "\n".join(",".join(map(repr, row)) for row in np.hstack(columns).tolist())
    names = "x,y,z,roll,pitch,yaw" + ",t" * (seconds is not None)
    return read_poses(f"{names}\n{text}", "poses.csv", case.units, PathOptions(between=between))


def extreme(judged: Judgement, name: str, sense: Sense) -> Verdict:
    (found,) = (each for each in judged.extremes if (each.name, each.sense) == (name, sense))
    return found
