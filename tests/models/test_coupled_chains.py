"""Loops that couplings alone close: a chain of joints, each turned by several motors on the base."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from engine_comparison import compare
from mechanism_robots import Engine
from random_mechanisms import unit
from robot_gallery import NETWORKS

from screwsynth.models import robot
from screwsynth.models.joints import RobotError
from screwsynth.models.mechanism import mechanism_of
from screwsynth.models.mechanism.limbs import links_of


def coupled_chain(seed: int, *, spare: int = 0) -> dict[str, Any]:
    """An open chain of two to four joints with as many motors, less some; couplings have random factors."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 5))
    links = ["base", *(f"link{k}" for k in range(1, count)), "platform"]
    joints: list[dict[str, Any]] = []
    for k in range(count):
        kind = "P" if rng.random() < 0.3 else "R"
        ends = [links[k], links[k + 1]]
        place, axis = rng.normal(size=3).tolist(), unit(rng).tolist()
        joints.append({"name": f"j{k}", "type": kind, "between": ends, "at": place, "axis": axis})
    couplings = []
    for k in range(count - spare):
        links.append(f"rotor{k}")
        ends, place = ["base", links[-1]], rng.normal(size=3).tolist()
        motor = {"name": f"m{k}", "type": "R", "between": ends, "at": place, "axis": unit(rng).tolist()}
        joints.append({**motor, "actuated": True})
        others = {f"j{i}": float(rng.normal()) for i in range(count)}
        couplings.append({"factors": {f"m{k}": float(rng.uniform(0.5, 2)), **others}})
    return {"name": "chain", "home": [0.2, 0.1, 0.4], "links": links, "joint": joints, "coupling": couplings}


@pytest.mark.parametrize(
    "tables", [*map(coupled_chain, range(6)), *(links_of(mechanism_of(each)) for each in NETWORKS.values())]
)
def test_a_coupled_chain_has_the_numbers_of_the_engine(tables: dict[str, Any]) -> None:
    """F, rates and spaces of twists are those of the null space of the engine's rows."""
    found = compare(tables)
    assert found.configurations >= 2
    assert found.F < 1e-9
    assert found.rates < 1e-8
    assert found.spaces < 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_as_many_motors_as_joints_hold_the_platform(seed: int) -> None:
    for spare in (0, 1):
        tables = coupled_chain(seed, spare=spare)
        count = sum(name.startswith("rotor") for name in tables["links"]) + spare
        engine = Engine(mechanism_of(tables))
        assert engine.platform_twists(locked=False).shape[1] == count
        assert engine.platform_twists(locked=True).shape[1] == spare
        model = robot(**tables)
        assert model.generic is not None
        assert 6 - model.generic.constraints == count
        assert model.rank == 6 - spare


def test_a_chain_whose_joints_no_coupling_ties_stays_open() -> None:
    tables = coupled_chain(3)
    with pytest.raises(RobotError, match="at the end of an open chain"):
        robot(**{key: value for key, value in tables.items() if key != "coupling"})
