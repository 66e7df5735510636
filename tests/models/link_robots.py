"""A robot file with links and joints, and a case of it."""

#: Planar: two driven cranks, and a rocker that couples them to the platform by a nested four-bar.
ROBOT = """name = "links"
home = [0, 1, 0]
links = ["base", "crank", "coupler", "rocker", "rod", "bar", "platform"]
points = { A = [0, 0, 0], B = [-0.2, "0.5*s", 0], C = [0.5, 0.6, 0], D = [0.6, 0, 0], E = [0.3, 1, 0] }
[dimensions]
s = { typical = 1.0 }
[[joint]]
name = "motor"
type = "R"
between = ["base", "crank"]
at = "A"
axis = "z"
actuated = true
[[joint]]
name = "knee"
type = "R"
between = ["crank", "coupler"]
at = "B"
axis = "z"
[[joint]]
name = "wrist"
type = "R"
between = ["coupler", "rocker"]
at = "C"
axis = "z"
[[joint]]
name = "pivot"
type = "R"
between = ["base", "rocker"]
at = "D"
axis = "z"
[[joint]]
name = "hand"
type = "R"
between = ["rocker", "platform"]
at = "E"
axis = "z"
[[joint]]
name = "slide"
type = "P"
between = ["base", "rod"]
at = [-1, 1.3, 0]
axis = "x"
actuated = true
[[joint]]
name = "tip"
type = "R"
between = ["rod", "bar"]
at = [-0.6, 1.3, 0]
axis = "z"
[[joint]]
name = "toe"
type = "R"
between = ["bar", "platform"]
at = [-0.3, 1, 0]
axis = "z"
"""
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
