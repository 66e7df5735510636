"""Driven joints that the pose does not determine: rails of a planar robot, and of limbs beside struts."""

from __future__ import annotations

from pathlib import Path

import pytest
from builders import Run

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


@pytest.mark.soak
def test_twenty_independent_turns_reach_the_sum_of_their_optima() -> None:
    # Each pose has its own turn, so the optimum is that of every pose alone.
    assert pytest.approx(1.867166, abs=1e-6) == solve(load_case(str(_DATA / "twenty-turns.toml"))).F
