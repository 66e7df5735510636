"""Robots given joint by joint as MJCF, MuJoCo's text of models, for tests; and the centre of each chain.

At home every body's frame is the world frame, so a body's pose is its displacement. Limbs are trees of hinges, slides
and balls, and the platform is a free body. Connects and welds close the loops. Coupled joints make screws and
parallelograms.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from builders import Array
from robot_files import Joint, Limb, Robot, every_joint

#: Axes that are nearer than this share of the robot's size meet; typed and derived coordinates are good to 1e-15.
MEETING_TOLERANCE = 1e-9


class Centre(NamedTuple):
    """Centre of a chain at home, and the number of the joint on whose platform side it rides."""

    point: Array  # (3,) world, length
    joint: int


class Axis(NamedTuple):
    point: Array
    direction: Array
    joint: int


def meeting_point(axes: Sequence[Axis], size: float) -> Array | None:
    """Point (3,) where all the axes meet, or None; parallel axes meet nowhere."""
    first, second = axes[0], axes[1]
    normal = np.cross(first.direction, second.direction)
    if np.linalg.norm(normal) < MEETING_TOLERANCE:
        return None
    away = second.point - first.point
    along = np.dot(np.cross(away, second.direction), normal) / np.dot(normal, normal)
    point = first.point + along * first.direction
    distances = [np.linalg.norm(np.cross(point - axis.point, axis.direction)) for axis in axes]
    return np.asarray(point) if max(distances) < MEETING_TOLERANCE * size else None


def centre_of(chain: Sequence[Joint], given: Array | None, size: float) -> Centre:
    """Centre by the rules: given; S or three R; two R that meet; last passive joint; each nearest the platform."""
    passive = [i for i, joint in enumerate(chain) if not joint.actuated]
    last = passive[-1] if passive else len(chain) - 1
    if given is not None:
        return Centre(given, last)
    # Runs of consecutive passive revolute axes, U as two of them; any other joint ends a run.
    runs: list[list[Axis]] = [[]]
    for i, joint in enumerate(chain):
        if not joint.actuated and joint.kind in "RU":
            runs[-1].extend(Axis(joint.point, axis, i) for axis in joint.axes)
        else:
            runs.append([])
    found = [Centre(joint.point, i) for i, joint in enumerate(chain) if joint.kind == "S" and not joint.actuated]
    for count in (3, 2):
        for run in runs:
            for k in range(len(run) - count + 1):
                point = meeting_point(run[k : k + count], size)
                if point is not None:
                    found.append(Centre(point, run[k + count - 1].joint))
        if found:
            return max(found, key=lambda centre: centre.joint)
    return Centre(chain[last].point, last)


INERTIA = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


class Loop(NamedTuple):
    """The constraint that closes a chain at the platform, its centre at home, and the body that carries the centre."""

    constraint: str
    centre: Array
    carrier: str
    weld: bool


def text(vector: Array) -> str:
    # repr keeps every bit of a double.
    return " ".join(repr(float(x)) for x in vector)


class Writer:
    """The MJCF text of a robot, and the names of what matters in it."""

    def __init__(self, robot: Robot, length: float) -> None:
        self.equalities: list[str] = []
        self.actuators: list[str] = []
        self.loops: list[Loop] = []
        self.bodies = 0
        points = np.array([joint.point for limb in robot.limbs for joint in every_joint(limb)])
        # A robot whose joints are all in one point has no size; any will do.
        self.size = float(np.max(np.ptp(points, axis=0))) or 1.0
        self.length = length
        trees = "".join(self.limb(limb) for limb in robot.limbs)
        self.mjcf = f"""
            <mujoco>
              <compiler angle="radian"/>
              <option jacobian="dense" gravity="0 0 0"><flag contact="disable"/></option>
              <worldbody>
                <body name="platform"><freejoint name="platform"/>{INERTIA}</body>
                {trees}
              </worldbody>
              <equality>{"".join(self.equalities)}</equality>
            </mujoco>"""

    def limb(self, limb: Limb) -> str:
        opening, end, closing = self.chain(limb.stem, "world")
        inner = ""
        for branch in limb.branches:
            # The last joint of a chain that ends in a passive S is the connect itself.
            chain = limb.stem + branch
            connected = limb.centre is None and chain[-1].kind == "S"
            kept = branch[:-1] if connected else branch
            head, last, tail = self.chain(kept, end[-1])
            self.close(limb, chain, [*end, *last[1:]], connected=connected)
            inner += head + tail
        return opening + inner + closing

    def chain(self, joints: Sequence[Joint], parent: str) -> tuple[str, list[str], str]:
        """Nested bodies, one or more for each joint: opening text, body after 0, 1, ... joints, closing text."""
        opening, after, depth = "", [parent], 0
        for joint in joints:
            names = []
            for kind, point, axis in elementary(joint):
                self.bodies += 1
                names.append(f"j{self.bodies}")
                place = "" if axis is None else f' axis="{text(axis)}"'
                opening += (
                    f'<body name="{names[-1]}"><joint name="{names[-1]}" type="{kind}" pos="{text(point)}"{place}/>'
                )
                opening += INERTIA
                depth += 1
            if joint.kind in {"H", "Pa"}:
                # The second coordinate follows the first: a screw's slide by its pitch, a parallelogram's turn back.
                factor = joint.pitch if joint.kind == "H" else -1.0
                self.equalities.append(
                    f'<joint name="e{len(self.equalities)}" joint1="{names[1]}" joint2="{names[0]}" '
                    f'polycoef="0 {factor!r} 0 0 0"/>'
                )
            if joint.actuated:
                if joint.kind not in {"R", "P", "H"}:
                    message = f"an actuated {joint.kind} is not supported: R, P and H are"
                    raise ValueError(message)
                self.actuators.append(names[0])
            after.append(names[-1])
        return opening, after, "</body>" * depth

    def close(self, limb: Limb, chain: Sequence[Joint], bodies: Sequence[str], *, connected: bool) -> None:
        """Fix the end of a chain to the platform; ``bodies`` are those after 0, 1, ... of its joints."""
        centre = centre_of(chain, limb.centre, self.size)
        name = f"e{len(self.equalities)}"
        after = [*bodies, "platform"] if connected else list(bodies)
        if connected:
            # Anchors are in the first body's frame, which is the world's at home.
            end = "" if bodies[-1] == "world" else f' body2="{bodies[-1]}"'
            self.equalities.append(f'<connect name="{name}" body1="platform"{end} anchor="{text(chain[-1].point)}"/>')
        else:
            self.equalities.append(
                f'<weld name="{name}" body1="{bodies[-1]}" body2="platform" torquescale="{2 * self.length!r}"/>'
            )
        self.loops.append(Loop(name, centre.point, after[centre.joint + 1], not connected))


def elementary(joint: Joint) -> list[tuple[str, Array, Array | None]]:
    """Hinges, slides and balls of a joint from the base: kind, point and axis."""
    p = joint.point
    match joint.kind:
        case "S":
            return [("ball", p, None)]
        case "R":
            return [("hinge", p, joint.axes[0])]
        case "P":
            return [("slide", p, joint.axes[0])]
        case "U":
            return [("hinge", p, joint.axes[0]), ("hinge", p, joint.axes[1])]
        case "H" | "C":
            return [("hinge", p, joint.axes[0]), ("slide", p, joint.axes[0])]
        case "Pa" if joint.to is not None:
            return [("hinge", p, joint.axes[0]), ("hinge", joint.to, joint.axes[0])]
    message = f"{joint.kind!r} is not a joint of a robot file"
    raise ValueError(message)
