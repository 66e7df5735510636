"""Random graphs of all operations that have a rule, and random boxes."""

import casadi as ca
import numpy as np

UNARY = (
    ca.sin, ca.cos, ca.sqrt, ca.exp, ca.log, ca.atan, ca.tan, ca.asin, ca.acos, ca.sumsqr,
    ca.fabs, ca.sign, lambda x: -x, lambda x: 2 * x, lambda x: 1 / x, lambda x: x**3, lambda x: x**-2, lambda x: x**1.5,
)  # fmt: skip
BINARY = (
    lambda x, y: x + y, lambda x, y: x - y, lambda x, y: x * y, lambda x, y: x / y, ca.atan2, ca.hypot,
    ca.fmin, ca.fmax, lambda x, y: x <= y,
)  # fmt: skip
N = 3


def random_function(seed: int | np.random.Generator, steps: int) -> ca.Function:
    """A graph of random operations on three variables and constants; every value is a result."""
    rng = np.random.default_rng(seed)
    x = ca.SX.sym("x", N)
    values = list(ca.vertsplit(x))
    while len(values) < N + steps:
        one = values[rng.integers(len(values))]
        if rng.random() < 0.45:
            value = UNARY[rng.integers(len(UNARY))](one)
        else:
            other = ca.SX(float(rng.normal())) if rng.random() < 0.3 else values[rng.integers(len(values))]
            value = BINARY[rng.integers(len(BINARY))](*((one, other) if rng.random() < 0.5 else (other, one)))
        # x - x becomes 0.
        if not value.is_constant():
            values.append(value)
    return ca.Function("random", [x], [ca.densify(ca.vertcat(*values[N:]))])


def random_boxes(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Boxes of every size from points to units, some of them with sides of no width."""
    rng = np.random.default_rng(seed)
    centre = rng.normal(size=(N, count)) * rng.choice([0.3, 1.0, 3.0], size=(1, count))
    width = 10.0 ** rng.uniform(-12, 0, size=(N, count)) * (rng.random((N, count)) > 0.15)
    return centre - width, centre + width
