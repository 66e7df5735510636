"""A hexapod given by twelve joint centres, any coordinate of which a case fixes or frees.

Letters: ``base_i`` is the centre of leg i's base joint in the world frame, ``platform_i`` the centre of its platform
joint in the platform frame.
"""

from __future__ import annotations

import math
from dataclasses import replace

from casadi import SX

from .drawing import Mark, MarkKind
from .legs import legged_platform
from .model import Model
from .parts import Dimension, Leg, Parameter, PoseSymbols


def hexapod() -> Model:
    """Return a robot with six legs between twelve joint centres, given by their coordinates."""
    pose = PoseSymbols()
    base, platform, legs = [], [], []
    for i in range(6):
        name = str(i + 1)
        b, a = SX.sym(f"base_{name}", 3), SX.sym(f"platform_{name}", 3)
        base.append(
            Parameter(f"base_{name}", b, Dimension.LENGTH, f"base joint of leg {name}", _typical_joint(i, 12.0, 20))
        )
        platform.append(
            Parameter(
                f"platform_{name}", a, Dimension.LENGTH, f"platform joint of leg {name}", _typical_joint(i, 8.0, 45)
            )
        )
        legs.append(Leg(name, b, a))
    parts = legged_platform(legs, pose)
    joints = zip((*base, *platform), parts.scene.points, strict=False)
    return Model(
        name="hexapod",
        description="six legs between twelve joint centres given by their coordinates",
        parameters=(*base, *platform),
        pose=pose,
        home=(0.0, 0.0, 35.0),
        wrenches=parts.wrenches,
        quantities=parts.quantities,
        scene=replace(
            parts.scene,
            marks=tuple(Mark(item.name, MarkKind.POINT, (joint.position,), joint.body) for item, joint in joints),
        ),
        legs=parts.legs,
        built=parts.built,
    )


def _typical_joint(i: int, radius: float, half_angle: float) -> tuple[float, float, float]:
    """Return a joint of an octahedral arrangement, pairs at 0, 120 and 240 degrees, to a tenth of a length unit.

    Args:
        i: index of the leg.
        radius: of the joints' circle, length.
        half_angle: half of the angle between the joints of a pair, degrees.
    """
    azimuth = math.radians(120 * (i // 2) + half_angle * (1 if i % 2 else -1))
    return round(radius * math.cos(azimuth), 1), round(radius * math.sin(azimuth), 1), 0.0
