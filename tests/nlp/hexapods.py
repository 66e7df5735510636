"""Cases about the machine of LinuxCNC's hexapod kinematics, in inches; see cases/hexapod-machining.toml."""

_MACHINE = """
[units]
length = "in"
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = {{ x1 = 26.5, x2 = 11.543, x3 = {x3}, x4 = {x4} }}
[pose]
position = [0, 0, 20]
"""
PUSH = """[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
"""


def hexapod_text(x3: float, x4: float, task: str = PUSH) -> str:
    """The tables of the robot, of its pose and of a task, a push upwards if left out."""
    return _MACHINE.format(x3=x3, x4=x4) + task


#: Over a small workspace; limits follow.
SMALL = (
    hexapod_text(5, 9)
    + "[workspace]\nposition = [{ min = -0.2, max = 0.2 }, 0, { min = 19.8, max = 20.2 }]\n[limits]\n"
)
