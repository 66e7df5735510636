"""A sum of squares is at least 0: in certificates, over a workspace, in proof files, and in their checker's words."""

import json
from pathlib import Path

import casadi as ca
import numpy as np
from builders import Run, output_of, saved, unbroken
from casadi import SX

from screwsynth.nlp.proof.statement.signs import is_nowhere_positive

# Legs in the plane of the platform at z = 0 do not resist the motion along z: F is 0 there, and positive elsewhere.
CASE = """
[units]
length = "cm"
[robot]
model = "stewart-gough"
layout = "aligned"
parameters = { x1 = 12, x2 = 4, x3 = 30, x4 = 20 }
[pose]
position = [0, 0, 10]
[[task]]
name = "up"
sense = "min"
axis = [0, 0, 1]
pitch = inf
[workspace]
position = [{ min = -1, max = 1 }, 0, { min = -3, max = 3 }]
"""


def test_signs_of_expressions_hold_at_random_points() -> None:
    rng = np.random.default_rng(5)
    points, known = rng.normal(size=(3, 2000)), 0
    unary = (ca.fabs, ca.sqrt, ca.exp, lambda a: a * a, lambda a: a**2, lambda a: -a, ca.sin, lambda a: 1 / a)
    binary = (
        lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / b, ca.fmax, ca.fmin,
    )  # fmt: skip
    for _ in range(400):
        x = SX.sym("x", 3)
        terms = [*ca.vertsplit(x), SX(float(rng.normal())), SX(0)]
        for _ in range(6):
            a, b = (terms[k] for k in rng.integers(len(terms), size=2))
            terms.append(unary[rng.integers(len(unary))](a))
            terms.append(binary[rng.integers(len(binary))](terms[-1], b))
        if is_nowhere_positive(terms[-1], x):
            known += 1
            with np.errstate(all="ignore"):
                values = ca.Function("f", [x], [ca.densify(terms[-1])])(points).full()
            assert not (values > 0).any(), terms[-1]
    assert known > 40


def test_a_proven_bound_of_a_sum_of_squares_is_not_below_zero(tmp_path: Path, cli: Run) -> None:
    case, proof, result = saved(tmp_path / "case.toml", CASE), tmp_path / "p.json", tmp_path / "r.json"
    status, out, _ = cli("workspace", str(case), "--json", str(result), "--proof", str(proof))
    assert status == 1  # J is singular where F is 0
    assert "F  0 to 0.7338" in out
    (least,) = (
        each for each in json.loads(result.read_text())["extremes"] if (each["name"], each["sense"]) == ("F", "min")
    )
    assert (str(least["bound"]), least["reached"], least["outcome"], least["unit"]) == ("0.0", 0, "proved", "(cm/cm)²")
    words = output_of(cli("verify-proof", str(proof), str(case)))
    assert "F: at least 0 (cm/cm)²" in words
    assert "F: at most 0.7338" in words
    # The file claims what the boxes show, which is below 0.
    assert any(each["name"] == "F" and each["bound"] > 0 for each in json.loads(proof.read_text())["claims"])
    text = CASE.replace("[0, 0, 10]", "[0, 0, { min = -3, max = 5 }]")
    case, out = (
        saved(tmp_path / "free.toml", text),
        output_of(cli("certify", str(saved(case, text)), "--json", str(result), "--proof", str(proof))),
    )
    assert "has F smaller than 0;" in unbroken(out)
    assert str(json.loads(result.read_text())["certificate"]["bound"]) == "0.0"
    words = unbroken(output_of(cli("verify-proof", str(proof), str(case))))
    assert "F is at least 0 (cm/cm)² within the limits" in words
