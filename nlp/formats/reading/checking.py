"""The text of a robot file read again: it states the robot that was imported."""

from __future__ import annotations

import tomllib

import numpy as np

from ....models.arrays import FloatArray
from ....models.joints import RobotError
from ....models.mechanism import Mechanism, MechanismError, mechanism_of, wrenches_of
from ...case.robotfile import check_form, model_of_definition
from ...errors import CaseError, InputError

#: Largest difference of the work rates of two equal robots, in parts of the largest: numbers are written with all
#: their digits, and rounding of closed loops of six-digit models is 1e-12.
SAME_ROBOT = 1e-9
#: Robots with more joints than this are not built symbolically when their file is checked: with 60 joints it takes 2 s.
_MOST_BUILT = 40


def check_text(text: str, mechanism: Mechanism, size: float, allowed: float = SAME_ROBOT) -> float:
    """Read the text of a robot file, and return the difference of its work rates from those of a mechanism.

    The difference is that of ``J'J``, from which F of every motion follows, and of ``Q'Q``, with ``Q`` the actuators'
    rates for six motions, in parts of their largest entries.

    Args:
        text: of the robot file.
        mechanism: the robot that it must state.
        size: of the robot, as characteristic length.
        allowed: largest difference.

    Raises:
        InputError: the text is no robot file, or states a robot with other work rates.
    """
    tables = tomllib.loads(text)
    try:
        check_form(tables)
        if len(mechanism.joints) <= _MOST_BUILT:
            model_of_definition(tables, "robot file")
        again = mechanism_of(tables)
    except (CaseError, RobotError, MechanismError) as error:
        raise InputError(f"the robot file would not be read: {error}") from None
    pairs = zip(_measures(again, size), _measures(mechanism, size), strict=True)
    difference = max(float(np.abs(found - expected).max() / np.abs(expected).max()) for found, expected in pairs)
    if not difference <= allowed:
        fault = "the robot file, read again, differs from the model: its work rates are off by"
        advice = "--snap makes axes meet that nearly do"
        raise InputError(f"{fault} {difference:.2g} of the largest, and {allowed:.2g} is allowed; {advice}")
    return difference


def _measures(mechanism: Mechanism, size: float) -> tuple[FloatArray, FloatArray]:
    """Return ``J'J`` and ``Q'Q`` (6, 6), with twists about the platform's origin and lengths in parts of the size.

    Neither depends on the order of members and actuators. An actuator that cannot drive the platform has no rate.
    """
    (platform,) = (link for link in mechanism.links if link.name == mechanism.platform)
    wrenches = wrenches_of(mechanism, size)
    forces, moments = wrenches.jacobian[:, :3], wrenches.jacobian[:, 3:]
    rows = np.hstack([forces, (moments - np.cross(platform.position, forces)) / size])
    rates = []
    for w, v in ((each[:3] / size, each[3:]) for each in np.eye(6)):
        found = wrenches.rates(np.concatenate([w, v + np.cross(platform.position, w)]))
        rates.append([value if np.isfinite(value) else 0.0 for value in found.values()])
    Q = np.array(rates)
    return np.asarray(rows.T @ rows), np.asarray(Q @ Q.T)
