"""Write the paths of the cases ``hexapod-yaw`` and ``hexapod-struts``: run by ``make docs``. A test compares them.

A circle at constant speed, in inches and seconds, with a tool that leans outwards by a constant angle. Of all
orientations with this axis of the tool, each row has the one that is reached from the vertical by a rotation about a
horizontal axis.
"""

import math
from pathlib import Path

import screwsynth.cases

FOLDER = Path(screwsynth.cases.__file__).parent
#: Lean of the tool by the name of the case, degrees.
LEANS = {"hexapod-yaw": 30, "hexapod-struts": 40}
#: Centre and radius of the circle, inches; its speed, inches per second; and number of points.
CENTRE, RADIUS, SPEED, COUNT = (4, 3, 20), 5, 1, 200


def number(value: float) -> str:
    """Return a number with 13 digits, which are the same on every computer; rounding errors of 0 become 0."""
    return f"{value if abs(value) > 1e-12 else 0:.13g}"


def table(lean: float) -> str:
    """Return the table of poses for a lean of the tool, degrees."""
    lines = ["t,x,y,z,qw,qx,qy,qz"]
    c, s = math.cos(math.radians(lean) / 2), math.sin(math.radians(lean) / 2)
    for k in range(COUNT):
        angle = 2 * math.pi * k / (COUNT - 1)
        x, y = math.cos(angle), math.sin(angle)
        position = (CENTRE[0] + RADIUS * x, CENTRE[1] + RADIUS * y, CENTRE[2])
        row = (RADIUS * angle / SPEED, *position, c, -y * s, x * s, 0)
        lines.append(",".join(map(number, row)))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    for name, lean in LEANS.items():
        (FOLDER / f"{name}.csv").write_text(table(lean), encoding="utf-8")
