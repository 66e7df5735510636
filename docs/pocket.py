"""Write the program of the case ``hexapod-pocket``: run by ``make docs``. A test compares them.

A pocket with rounded corners and walls that lean outwards, in millimetres from the middle of the part's top: a helix
into the part and contours from inside out at each level, then the walls with the side of the tilted tool.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import screwsynth.cases

TARGET = Path(screwsynth.cases.__file__).parent / "hexapod-pocket.ngc"

#: Half sizes of the pocket at the top, radius of its corners there, depth.
HALF, CORNER, DEPTH = (70.0, 45.0), 20.0, 24.0
#: Radius of the tool, distance of contours and of levels in roughing, what it leaves on the walls.
TOOL, STEP, LEVEL, LEFT = 6.0, 5.0, 2.0, 0.5
#: Tilt of the walls and of the tool along them, distance of finishing levels, degrees of a part of a corner.
TILT, FINE, PART = math.radians(8), 1.0, 6
#: Radius and pitch of the helix, heights of rapid motions and of the beginning of a cut.
HELIX, PITCH, CLEAR, NEAR = 4.0, 1.0, 15.0, 1.0
#: Quarters of the corners: signs of the middle, and degrees at which the corner begins.
QUARTERS = ((1, 1, 0), (-1, 1, 90), (-1, -1, 180), (1, -1, 270))


def word(letter: str, value: float) -> str:
    """Return a word with four decimals at most."""
    return f"{letter}{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")


def words(**values: float) -> str:
    """Return words in order."""
    return " ".join(word(letter, value) for letter, value in values.items())


def angles_of(direction: float) -> dict[str, float]:
    """Return A and B by which the tool, up from its tip, leans by the tilt towards a direction (degrees)."""
    phi = math.radians(direction)
    x, y, z = math.sin(TILT) * math.cos(phi), math.sin(TILT) * math.sin(phi), math.cos(TILT)
    return {"A": -math.degrees(math.asin(y)), "B": math.degrees(math.atan2(x, z))}


def contour(a: float, b: float, corner: float) -> Iterator[str]:
    """Yield the motions around a rectangle with half sizes and rounded corners, from the end of its first one on."""
    for sx, sy, begin in (*QUARTERS[1:], QUARTERS[0]):
        middle = (sx * (a - corner), sy * (b - corner))
        first, last = (math.radians(begin + turn) for turn in (0, 90))
        start = [middle[0] + corner * math.cos(first), middle[1] + corner * math.sin(first)]
        end = [middle[0] + corner * math.cos(last), middle[1] + corner * math.sin(last)]
        yield f"G1 {words(X=start[0], Y=start[1])}"
        yield f"G3 {words(X=end[0], Y=end[1], I=middle[0] - start[0], J=middle[1] - start[1])}"


def roughing() -> Iterator[str]:
    """Yield the levels, each with a helix from the one above."""
    for level in range(1, round(DEPTH / LEVEL) + 1):
        depth = level * LEVEL
        inset = depth * math.tan(TILT) + TOOL + LEFT
        yield f"(level {level})"
        yield f"G0 {words(X=HELIX, Y=0)}"
        yield f"G0 {words(Z=NEAR - depth + LEVEL)}"
        for turn in range(1, round((LEVEL + NEAR) / PITCH) + 1):
            yield f"G3 {words(X=HELIX, Y=0, Z=NEAR - depth + LEVEL - turn * PITCH, I=-HELIX, J=0)} F300"
        yield f"G3 {words(X=HELIX, Y=0, I=-HELIX, J=0)} F600"
        rings = int((min(HALF) - inset - TOOL) / STEP)
        for ring in range(rings, -1, -1):
            a, b = (half - inset - ring * STEP for half in HALF)
            corner = max(CORNER - inset - ring * STEP, 2.0)
            yield f"G1 {words(X=a - corner, Y=b)}"
            yield from contour(a, b, corner)
        yield f"G0 {words(Z=NEAR - depth + LEVEL)}"


def finishing() -> Iterator[str]:
    """Yield the rounds of the tilted tool along the walls, from the top down."""
    yield f"G1 {words(X=0, Y=0, Z=CLEAR)} F1500"
    for level in range(1, round(DEPTH / FINE) + 1):
        depth = level * FINE
        inset = depth * math.tan(TILT) + TOOL / math.cos(TILT)
        (a, b), corner = (half - inset for half in HALF), CORNER - inset
        corner = max(corner, 2.0)
        yield f"(round {level})"
        if level == 1:
            yield f"G1 {words(X=0, Y=b - 10, **angles_of(90))}"
        yield f"G1 {words(X=0, Y=b, Z=-depth)} F300"
        yield "F800"
        for sx, sy, begin in (*QUARTERS[1:], QUARTERS[0]):
            for direction in range(begin, begin + 91, PART):
                phi = math.radians(direction)
                x, y = sx * (a - corner) + corner * math.cos(phi), sy * (b - corner) + corner * math.sin(phi)
                yield f"G1 {words(X=x, Y=y, **angles_of(direction))}"
        yield f"G1 {words(X=0, Y=b)}"
    yield f"G1 {words(X=0, Y=0, Z=CLEAR, A=0, B=0)} F1500"


def program() -> str:
    """Return the program."""
    head = [
        "(A pocket with walls that lean by 8 degrees, written by docs/pocket.py)",
        "G21 G17 G90 G94 G40 G49 G80 G54",
        "T1 M6 S9000 M3",
        f"G0 {words(X=0, Y=0, Z=CLEAR, A=0, B=0, C=0)}",
        f"G0 {words(Z=NEAR)}",
        "F600",
    ]
    body = [*roughing(), f"G0 {words(Z=CLEAR)}", *finishing()]
    return "\n".join([*head, *body, "M5", "M2", ""])


if __name__ == "__main__":
    TARGET.write_text(program(), encoding="utf-8")
