"""Klipper kinematics for robots of three translations: a C callback, a Python class, and the lines that add them."""

from __future__ import annotations

from ....models import Dimension
from ...case.case import Case
from ...errors import CaseError
from ..ctext import identifier
from ..kinematics import Kinematics
from ..templates import fill_template
from .configuration import printed
from .kinds import TOLERANCE
from .klipper import UNCHECKED
from .library import library_of
from .samples import samples_of
from .texts import frame_words, readme, zero_words

TARGET = "klipper-patch"
#: Largest distance between checked points of a move, as a part of the robot's size.
_CHECKED = 0.02


def write(case: Case) -> dict[str, str]:
    """Return the callback, the class and a description of the patch.

    Raises:
        CaseError: the robot does not have three translations.
        InputError: an actuator coordinate is not known.
    """
    fault = _fault(Kinematics(case))
    if fault:
        raise CaseError("--target", fault, TARGET, case.source)
    library = library_of(case, length="mm", angle="rad")
    robot, names = library.robot, library.names
    name = identifier(case.name)
    texts = {
        **names,
        "name": name,
        "library": library.whole,
        "turns": str([each.dimension is Dimension.ANGLE for each in robot.drives]),
        "letters": "abc",
        "state": f"    double u[{names['KIN']}_STATE];\n    {names['kin']}_start(u);\n" if robot.unknowns else "",
        "distance": printed(float(f"{_CHECKED * robot.size:.2g}")),
    }
    return {
        f"kin_{name}.c": fill_template("targets/klipper.c.in", texts),
        f"{name}.py": fill_template("targets/klipper.py.in", texts),
        "chelper.patch.md": _patch(name),
        "README.md": _readme(library.case, robot, name),
    }


def _fault(robot: Kinematics) -> str:
    """Return why Klipper cannot move a robot, as a sentence; empty if Klipper can move the robot."""
    units, count = robot.case.units, len(robot.drives)
    if robot.freedoms != 3 or count != 3:
        own = f"this one has {robot.freedoms} degrees of freedom and {count} motors"
        return f"Klipper moves robots of 3 translations by 3 motors: {own}"
    turned = samples_of(robot).turned
    if robot.coordinates != (0, 1, 2) or turned > TOLERANCE:
        angle = units.text(turned, Dimension.ANGLE)
        return f"Klipper moves robots of 3 translations: this platform turns by {angle} between positions near home"
    if robot.forward is None:
        return "Klipper needs forward kinematics, and the actuators of this robot do not determine the pose"
    return ""


def _patch(name: str) -> str:
    return f"""# Lines to add to klippy/chelper/\\_\\_init\\_\\_.py

1. To the list `SOURCE_FILES`: `'kin_{name}.c',`
2. Before `defs_all`:

```python
defs_kin_{name} = \"\"\"
    struct stepper_kinematics *{name}_stepper_alloc(int motor);
    int {name}_motors(double x, double y, double z, double *q);
    int {name}_forward(double *q, double *position);
\"\"\"
```

3. To the list `defs_all`: `defs_kin_{name},`
"""


def _readme(case: Case, robot: Kinematics, name: str) -> str:
    kinds = ["rad" if each.dimension is Dimension.ANGLE else "mm" for each in robot.drives]
    steppers = "\n".join(
        f"[stepper_{letter}]\n# actuator {drive.name}, {kind}\n"
        "position_endstop: ...\nposition_min: ...\nposition_max: ...\n"
        for letter, drive, kind in zip("abc", robot.drives, kinds, strict=True)
    )
    words = {
        "frame": frame_words(robot),
        "zero": zero_words(robot, range(len(robot.drives))),
        "units": "lengths in mm, angles of motors in rad.",
        "unchecked": UNCHECKED + f" `{name}.py` therefore refuses a move if one of up to 50 points on it is out\n"
        "  of reach.",
    }
    what = (
        f"A patch for Klipper: copy `kin_{name}.c` into `klippy/chelper` and `{name}.py` into `klippy/kinematics`, and "
        "add the lines of `chelper.patch.md`. Klipper compiles the file at its next start."
    )
    slow = (
        "Each motor computes passive joints by Newton's method, starting from its previous call. A call takes "
        "about 2 us on a desktop computer: keep the rate below 20,000 steps a second.\n\n"
    )
    more = (slow if robot.unknowns else "") + (
        "`homing_start` is a position from which every endstop is reached. Angles are within half a turn of home.\n\n"
        f"```ini\n[printer]\nkinematics: {name}\nhoming_start: x, y, z\n"
        "position_min: x, y, z\nposition_max: x, y, z\n\n"
        f"{steppers}```"
    )
    return readme(case, what, words, more)
