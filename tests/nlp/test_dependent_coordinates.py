"""Coordinates of the pose that a robot cannot choose follow from the others, in answers about a workspace.

Samples are closed from home by Newton's method over joint coordinates, and MuJoCo measures each of them: those of
``bench/soundness``, which has many more of both. No coordinate that follows is given to them.
"""

from __future__ import annotations

import importlib
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from builders import PUSH_UP, ends

from screwsynth.nlp import Judgement, Outcome, Verdict

BENCH = Path(__file__).parents[2] / "bench" / "soundness"
SAMPLES = 300


def tilts(half: float) -> dict[str, Any]:
    return {"roll": ends(half), "pitch": ends(half)}


#: Of each robot its home, the position and rotation of a workspace, its independent coordinates, and a limit.
ROBOTS: dict[str, tuple[list[float], list[Any], dict[str, Any], Sequence[str], dict[str, Any]]] = {
    "ankle": ([0, 0, 0.132442], [0, 0, 0.132442], tilts(5), ("roll", "pitch"), {"actuator_angle": ends(12.5)}),
    "3-rps": ([0, 0, 1.1], [0, 0, ends(0.01, 1.1)], tilts(6), ("z", "roll", "pitch"), {"actuator_length": ends(0.12)}),
    "exechon": ([0, 0, 1], [0, 0, ends(0.02, 1)], tilts(4), ("z", "roll", "pitch"), {"actuator_length": ends(0.1)}),
    "five-bar-scara": ([0, 270, 0], [ends(60), ends(40, 270), 0], {}, ("x", "y"), {"actuator_angle": ends(34)}),
}


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    """Workspaces and their samples, of ``bench``, which is no package of the project."""
    sys.path.append(str(BENCH))
    return importlib.import_module("closedcases")


def asked(bench: ModuleType, name: str, *, position: Any = None, limits: Any = None, **rotation: Any) -> Any:
    home, place, turns, chosen, allowed = ROBOTS[name]
    file = f"{name}.toml"
    tables: dict[str, Any] = {
        "robot": ({"model": name} if name in ("3-rps", "exechon") else {"file": file}) | {"parameters": {}},
        "pose": {"position": home},
        "task": [PUSH_UP | {"name": "task"}],
        "limits": allowed if limits is None else limits,
        "workspace": {"position": position or place} | ({"rotation": turns | rotation} if turns | rotation else {}),
    }
    dimensions = bench.tomllib.loads(bench.FILES[name].read_text(encoding="utf-8")).get("dimensions", {})
    tables["robot"]["parameters"] = {key: item["typical"] for key, item in dimensions.items()}
    return bench.asked_of(tables, name, chosen)


def answer_of(bench: ModuleType, own: Any) -> Judgement:
    """The answer about a workspace, without a limit of time, after its samples were found to agree with it."""
    found: Judgement = bench.judged(own, gap=0.05, time_limit=None, with_objective=False)
    attack = bench.Attack(own, found, np.random.default_rng(0), SAMPLES, ascents=0)
    assert attack.faults == []
    assert attack.counts["samples measured by MuJoCo"] == SAMPLES
    return found


def sampled(bench: ModuleType, own: Any) -> dict[str, tuple[float, float]]:
    """Smallest and largest sampled values of each coordinate of the pose."""
    found = own.assembled(bench.samples_of(np.random.default_rng(1), SAMPLES, len(own.chosen)))
    assert found.closed.all()
    return {name: (found.pose[:, k].min(), found.pose[:, k].max()) for k, name in enumerate(own.names)}


def extreme(bench: ModuleType, found: Judgement, name: str, sense: str) -> Verdict:
    """The smallest or largest value of a coordinate; the angle of a rotation about z is its yaw."""
    (own,) = (each for each in found.extremes if bench.name_of(each) == name and each.sense.value == sense)
    return own


@pytest.mark.parametrize("name", ROBOTS)
def test_what_follows_is_proved_about_all_samples(bench: ModuleType, name: str) -> None:
    own = asked(bench, name)
    found, known = answer_of(bench, own), sampled(bench, own)
    assert found.is_proved
    follows = [each for each in own.names if each not in ROBOTS[name][3] and np.ptp(known[each]) > 1e-6]
    assert follows
    for each in follows:
        low, high = (extreme(bench, found, each, sense) for sense in ("min", "max"))
        width = np.ptp(known[each])
        assert low.limit is high.limit is None
        # Bounds hold all samples, and are not much wider than these.
        assert known[each][0] - 0.2 * width < low.bound <= known[each][0] + 1e-9 * width
        assert known[each][1] - 1e-9 * width <= high.bound < known[each][1] + 0.2 * width


@pytest.mark.parametrize(
    ("name", "limits"), [("ankle", {"actuator_angle": ends(8)}), ("3-rps", {"actuator_length": ends(0.06)})]
)
def test_limits_beyond_which_samples_are_known_are_refuted(bench: ModuleType, name: str, limits: Any) -> None:
    # Of the ankle a motor stands at 11.979 degrees at roll 5, pitch 5.
    found = answer_of(bench, asked(bench, name, limits=limits))
    assert found.is_refuted
    assert {each.outcome for each in found.extremes if each.key.startswith("actuator")} == {Outcome.REFUTED}


@pytest.mark.parametrize(
    ("half", "outcome"),
    [(0.0001, Outcome.REFUTED), (0.0015, Outcome.REFUTED), (0.0016, Outcome.PROVED), (0.03, Outcome.PROVED)],
)
def test_a_range_of_what_follows_is_a_limit(bench: ModuleType, half: float, outcome: Outcome) -> None:
    # The ankle's x follows from its pitch, up to 0.00153028.
    own = asked(bench, "ankle", position=[ends(half), 0, ends(0.006, 0.1343)])
    found = answer_of(bench, own)
    x = [extreme(bench, found, "x", sense) for sense in ("min", "max")]
    assert [each.outcome for each in x] == [outcome] * 2
    assert [each.limit for each in x] == [-half, half]
    # Whatever is stated of x, the motors turn as far.
    turns = [each for each in found.extremes if each.name.startswith("actuator_angle") and each.sense.value == "max"]
    assert max(each.bound for each in turns) == pytest.approx(math.radians(11.9791617), rel=0.05)
    assert {each.outcome for each in found.extremes if each.name.startswith("reach")} <= {Outcome.PROVED}


@pytest.mark.parametrize(("half", "outcome"), [(None, None), (10.0, Outcome.REFUTED), (20.0, Outcome.PROVED)])
def test_a_five_bar_reaches_every_place(bench: ModuleType, half: float | None, outcome: Outcome | None) -> None:
    # The angle of the forearm follows, from -12.839 to 13.458 degrees.
    own = asked(bench, "five-bar-scara", **({} if half is None else {"yaw": ends(half)}))
    found = answer_of(bench, own)
    assert found.is_regular
    assert {each.outcome for each in found.extremes if each.name.startswith("reach")} <= {Outcome.PROVED}
    yaw = [extreme(bench, found, "yaw", sense) for sense in ("min", "max")]
    assert [each.bound for each in yaw] == pytest.approx(np.radians([-12.8393505, 13.4575704]), abs=0.02)
    if outcome is not None:
        assert [each.outcome for each in yaw] == [outcome] * 2
