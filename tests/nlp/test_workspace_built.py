"""Workspaces of machines as they are built: every claim, for every machine within a tolerance on joint centres."""

import itertools
import math
import tomllib
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, Free
from screwsynth.nlp.case.reader import case_from_tables
from screwsynth.nlp.case.workspace import TurnKind, Turns, Workspace
from screwsynth.nlp.workspace import rows
from screwsynth.nlp.workspace.engines import kernel, rank_engine
from screwsynth.nlp.workspace.extremes import Extreme
from screwsynth.nlp.workspace.judge import Judgement, judge_workspace
from screwsynth.nlp.workspace.machine import Legs, legs_of
from screwsynth.nlp.workspace.posebox import PoseBox, pose_box
from screwsynth.nlp.workspace.regularity import Rank
from screwsynth.nlp.workspace.search import prove_regular
from screwsynth.nlp.workspace.verdict import Outcome

needs_kernel = pytest.mark.skipif(kernel() is None, reason="no C compiler when the package was installed")

#: The machine of LinuxCNC's hexapod kinematics, joints apart, with every limit that errors of joint centres change. The
#: limits are wide: the numbers that are proved are compared.
TEXT = """
[units]
length = "in"
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = 26.5, x2 = 11.543, x3 = 4, x4 = 5 }
[pose]
position = [0, 0, 20]
[tolerance]
joint_centre = 0.02
[[task]]
sense = "max"
axis = [1, 2, 6]
point = [3, 1, 12]
pitch = 0.1
[limits]
leg_length = { min = 10, max = 60 }
actuator = { stroke_max = 30, dead_length = 1 }
base_joint_angle = 80
platform_joint_angle = { max = 60, about = "home" }
home = { position = [0, 0, 20] }
joint_spacing = { min = 1 }
footprint = { base = 40, platform = 20 }
radius_ratio = { min = 0.1, max = 0.9 }
leg_clearance = { min = 0.5 }
smallest_singular_value = { min = 0.1, length = 11.5 }
condition_number = { max = 30, length = 11.5 }
rate_share = { max = 0.9 }
actuator_rate = { max = 60 }
custom = ["x1 - 2*x2 >= 0"]
[workspace]
position = [{ min = -1, max = 1 }, { min = -1, max = 1 }, { min = 19, max = 21 }]
rotation = { angle = { min = -6, max = 6 } }
"""
HOME = np.array([0.0, 0.0, 20.0])
TOLERANCE = 0.02
LENGTH = 11.5


@pytest.fixture(scope="module")
def case() -> Case:
    return case_from_tables(tomllib.loads(TEXT), name="built", source="built.toml")


@pytest.fixture(scope="module")
def judged(case: Case) -> Judgement:
    return judge_workspace(case, gap=1e-3, quantities=["base_joint_angle"])


def legs(case: Case) -> Legs:
    found = legs_of(case)
    assert found is not None
    return found


class Machines:
    """Machines within a tolerance, each at a pose of a box: random ones, and every second with errors at their largest.

    Those have errors along or across the legs, or along axes, and are at faces and corners of the box.
    """

    def __init__(self, robot: Legs, box: PoseBox, count: int, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        points = box.random(count, rng)
        ends = np.where(rng.uniform(size=points.shape) < 0.5, box.upper, box.lower)
        points[::2] = box.clipped(np.where(rng.uniform(size=points.shape) < 0.9, ends, points)[::2])
        form = rows.turn_form(box, points[:, 3:], np.zeros((count, 3))).terms[:, 0]
        self.turn = (form[:, :9] / form[:, 9:]).reshape(-1, 3, 3)
        self.position = points[:, :3]
        span = self.position[:, None] + np.einsum("kij,lj->kli", self.turn, robot.platform) - robot.base
        unit = span / np.linalg.norm(span, axis=2, keepdims=True)
        errors = rng.normal(size=(2, count, 6, 3))
        errors /= np.linalg.norm(errors, axis=3, keepdims=True)
        errors[:, 1::2] *= rng.uniform(size=(2, count // 2, 6, 1)) ** (1 / 3)
        # Opposite errors of both ends, along the leg or across it.
        sign = rng.choice([-1.0, 1.0], (count, 6, 1))
        across = np.cross(unit, errors[0])
        across /= np.linalg.norm(across, axis=2, keepdims=True)
        kind = rng.integers(4, size=(count, 1, 1))
        moved = np.where(kind == 0, sign * unit, np.where(kind == 1, across, errors[0]))
        errors[0, ::2], errors[1, ::2] = -moved[::2], moved[::2]
        errors *= robot.tolerance
        self.base = robot.base + errors[0]
        self.platform = robot.platform + np.einsum("kji,klj->kli", self.turn, errors[1])
        self.arm = np.einsum("kij,klj->kli", self.turn, self.platform)
        self.d = self.position[:, None] + self.arm - self.base
        self.length = np.linalg.norm(self.d, axis=2)
        self.n = self.d / self.length[:, :, None]
        self.J = np.concatenate([self.n, np.cross(self.arm, self.n)], axis=2)

    def rates(self, twist: FloatArray) -> FloatArray:
        """Work rates (K, 6)."""
        return np.asarray(((twist[3:] + np.cross(twist[:3], self.base)) * self.n).sum(axis=2))

    def clearance(self, i: int, j: int) -> FloatArray:
        """Distances (K,) of two legs as segments, the least of those between a point of one and the other's ends and
        of the lines where they cross."""
        p, q, d, e = self.base[:, i], self.base[:, j], self.d[:, i], self.d[:, j]
        found = np.full(len(p), np.inf)
        for a, b, c in ((p, q, e), (p + d, q, e), (q, p, d), (q + e, p, d)):
            t = np.clip(((a - b) * c).sum(axis=1) / (c * c).sum(axis=1), 0, 1)
            found = np.minimum(found, np.linalg.norm(a - b - t[:, None] * c, axis=1))
        normal = np.cross(d, e)
        system = np.stack([d, -e, normal], axis=2)
        s, t, _ = np.linalg.solve(system, (q - p)[:, :, None])[:, :, 0].T
        lines = np.abs((normal * (q - p)).sum(axis=1)) / np.linalg.norm(normal, axis=1)
        inside = (s > 0) & (s < 1) & (t > 0) & (t < 1)
        return np.where(inside, np.minimum(found, lines), found)


def angles(d: FloatArray, axes: FloatArray) -> FloatArray:
    """Angles (K, 6) of vectors (K, 6, 3) to axes (K, 6, 3) or (6, 3)."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(axes, d), axis=2), (axes * d).sum(axis=2)))


def numbers(case: Case, robot: Legs, machines: Machines) -> Iterator[tuple[str, FloatArray]]:
    """Each number that is judged, by the name of its claims, of machines (K,)."""
    names = [leg.name for leg in case.model.legs]
    home = HOME + robot.platform - robot.base
    home /= np.linalg.norm(home, axis=1, keepdims=True)
    twist = np.asarray(case.tasks[0].twist)
    squares = machines.rates(twist) ** 2
    F = squares.sum(axis=1)
    base = angles(machines.d, np.tile([0.0, 0.0, 1.0], (6, 1)))
    platform = angles(machines.d, np.einsum("kij,lj->kli", machines.turn, home))
    for i, name in enumerate(names):
        yield f"leg_length limb {name}", machines.length[:, i]
        yield f"base_joint_angle limb {name}", base[:, i]
        yield f"platform_joint_angle limb {name}", platform[:, i]
        yield f"rate_share limb {name}", squares[:, i] / F
        yield f"actuator_rate actuator {name}", np.sqrt(squares[:, i])
        yield f"footprint base joint {name}", np.linalg.norm(machines.base[:, i, :2], axis=1)
        yield f"footprint platform joint {name}", np.linalg.norm(machines.platform[:, i, :2], axis=1)
    for i, j in itertools.combinations(range(6), 2):
        one, other = names[i], names[j]
        yield f"leg_clearance limbs {one} and {other}", machines.clearance(i, j)
        for plate in ("base", "platform"):
            centres = getattr(machines, plate)
            apart = np.linalg.norm(centres[:, i] - centres[:, j], axis=1)
            yield f"joint_spacing {plate} joints {one} and {other}", apart
    yield "F", F
    ratio = np.linalg.norm(machines.platform[..., :2], axis=(1, 2)) / np.linalg.norm(machines.base[..., :2], axis=(1, 2))
    yield "radius_ratio", ratio


def test_no_machine_within_the_tolerance_is_outside_of_a_proven_bound(case: Case, judged: Judgement) -> None:
    robot, box = legs(case), pose_box(judged.workspace)
    assert judged.is_proved, [(each.name, each.bound, each.reason) for each in judged.extremes if each.reason]
    machines = Machines(robot, box, 100_000)
    sampled = dict(numbers(case, robot, machines))
    determinants = np.linalg.det(machines.J)
    assert (determinants > 0).all() or (determinants < 0).all()
    values = np.linalg.svd(machines.J[:20_000] / [1, 1, 1, LENGTH, LENGTH, LENGTH], compute_uv=False)
    sampled["smallest_singular_value"], sampled["condition_number"] = values[:, -1], values[:, 0] / values[:, -1]
    seen = set()
    for each in judged.extremes:
        if each.name not in sampled:
            assert each.name.startswith(("actuator.", "position error", "rotation error", "custom: ")), each.name
            continue
        seen.add(each.name.partition(" ")[0])
        worst = float(sampled[each.name].max() if each.sense.value == "max" else sampled[each.name].min())
        sign = 1 if each.sense.value == "max" else -1
        assert sign * worst <= sign * each.bound, each.name
        assert sign * each.reached <= sign * each.bound + 1e-12, each.name
        # The errors that come with the result are within the tolerance, and those of the machine that reaches the value.
        assert each.errors is not None, each.name
        assert max(np.linalg.norm(part, axis=1).max() for part in each.errors) <= TOLERANCE
    assert len(seen) == 12
