"""Driven joints that the pose does not determine: rails of a planar robot, and of limbs beside struts."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from builders import Run
from path_cases import BASE, PLATFORM

from screwsynth.nlp import load_case, solve

_DATA = Path(__file__).resolve().parent / "data"
_PLANAR = _DATA / "rails-3-prrr-case.toml"


def _with_rails(folder: Path, half: float, sense: str = "max") -> Path:
    """Return a copy of the planar case with rails of a half width."""
    text = _PLANAR.read_text().replace("-0.2", f"{-half!r}").replace("0.2 }", f"{half!r} }}")
    (folder / "rails-3-prrr.toml").write_bytes((_DATA / "rails-3-prrr.toml").read_bytes())
    file = folder / "case.toml"
    file.write_text(text.replace('"max"', f'"{sense}"'))
    return file


@pytest.mark.parametrize(("sense", "F"), [("max", 1.716123), ("min", 1.249318)])
def test_rails_are_variables(tmp_path: Path, sense: str, F: float) -> None:
    solution = solve(load_case(str(_with_rails(tmp_path, 0.2, sense))))
    assert solution.status.value == "optimal"
    assert pytest.approx(F, abs=1e-6) == solution.F


def test_rails_that_hardly_move_equal_home(tmp_path: Path) -> None:
    solution = solve(load_case(str(_with_rails(tmp_path, 1e-6))))
    assert solution.status.value != "infeasible"
    assert pytest.approx(1.487434, abs=2e-6) == solution.F


def test_limbs_with_rails_are_evaluated(cli: Run) -> None:
    code, out, _ = cli("evaluate", str(_DATA / "rails-of-limbs-case.toml"))
    assert code == 0
    assert "joint.1:1" in out


def test_twenty_independent_turns_reach_the_mean_of_their_optima() -> None:
    # Each pose has its own turn, so the optimum is that of every pose alone: sampled here, with own kinematics.
    tables = tomllib.loads((_DATA / "twenty-turns.toml").read_text())
    push, limits = np.array(tables["task"][0]["axis"]), tables["limits"]["leg_length"]
    optima = []
    for pose in tables["pose"]:
        (placed,) = pose["displacements"]
        low, high = -75.0, 75.0
        for _ in range(3):
            turns = np.radians(np.linspace(low, high, 20_001))
            c, s, zero = np.cos(turns), np.sin(turns), np.zeros_like(turns)
            spun = np.moveaxis(np.array([[c, -s, zero], [s, c, zero], [zero, zero, zero + 1]]), 2, 0)
            struts = placed["translation"] + PLATFORM @ np.swapaxes(placed["rotation"] @ spun, 1, 2) - BASE
            lengths = np.linalg.norm(struts, axis=2)
            F = np.sum((struts @ push / lengths) ** 2, axis=1)
            F[~((lengths >= limits["min"]) & (lengths <= limits["max"])).all(axis=1)] = -np.inf
            best, step = np.degrees(turns[F.argmax()]), (high - low) / 20_000
            low, high = max(best - 2 * step, -75.0), min(best + 2 * step, 75.0)
        optima.append(F.max())
    found = solve(load_case(str(_DATA / "twenty-turns.toml"))).F
    assert np.mean(optima) == pytest.approx(1.867195, abs=1e-6)
    assert found == pytest.approx(np.mean(optima), abs=1e-8)


def test_another_radius_is_no_other_assembly(cli: Run) -> None:
    """Points besides those of the dimension keep their places, so the robot is not a larger one of the same shape."""
    code, out, _ = cli("evaluate", str(_PLANAR), "--set", "r=2.1")
    assert code == 0
    assert "assembly" not in out
