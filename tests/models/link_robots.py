"""A robot file with links and joints, and a case of it."""

#: Planar: two driven cranks, and a rocker that couples them to the platform by a nested four-bar.
ROBOT = """name = "links"
home = [0, 1, 0]
links = ["base", "crank", "coupler", "rocker", "rod", "bar", "platform"]
points = { A = [0, 0, 0], B = [-0.2, "0.5*s", 0], C = [0.5, 0.6, 0], D = [0.6, 0, 0], E = [0.3, 1, 0] }
[dimensions]
s = { typical = 1.0 }
"""
#: Name, type, links, place and axis of each joint, and whether it is driven.
_JOINTS = (
    ("motor", "R", ("base", "crank"), '"A"', "z", True),
    ("knee", "R", ("crank", "coupler"), '"B"', "z", False),
    ("wrist", "R", ("coupler", "rocker"), '"C"', "z", False),
    ("pivot", "R", ("base", "rocker"), '"D"', "z", False),
    ("hand", "R", ("rocker", "platform"), '"E"', "z", False),
    ("slide", "P", ("base", "rod"), "[-1, 1.3, 0]", "x", True),
    ("tip", "R", ("rod", "bar"), "[-0.6, 1.3, 0]", "z", False),
    ("toe", "R", ("bar", "platform"), "[-0.3, 1, 0]", "z", False),
)
ROBOT += "".join(
    f'[[joint]]\nname = "{name}"\ntype = "{kind}"\nbetween = ["{inner}", "{outer}"]\nat = {at}\naxis = "{axis}"\n'
    + "actuated = true\n" * driven
    for name, kind, (inner, outer), at, axis, driven in _JOINTS
)
CASE = """[robot]
file = "robot.toml"
parameters = { s = { min = 0.9, max = 1.1 } }
[pose]
position = [0, 1, 0]
[[task]]
sense = "max"
axis = [1, 0, 0]
pitch = inf
"""
COUPLING = '[[coupling]]\nfactors = { motor = 1, pivot = "-s" }\n'
