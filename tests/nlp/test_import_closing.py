"""Loops that Newton's method leaves open where a model stands: other starts, and loops that cannot close at all."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import Array, saved

from screwsynth.nlp import InputError
from screwsynth.nlp.exchange.reading.importing import Request, import_robot
from screwsynth.nlp.exchange.reading.reduction import Ends


def model(end: str) -> str:
    """Two chains along x from the base: the end of the one, at (2, 0, 0), is joined to a place of the other's plate."""

    def link(name: str, place: str, joint: str, inner: str) -> str:
        hinge = f'<joint name="{joint}" axis="0 0 1"/><geom size="1"/>'
        return f'<body name="{name}" pos="{place}">{hinge}{inner}</body>'

    one = link("a1", "0 0 0", "a_root", link("a2", "1 0 0", "a_knee", '<site name="a_end" pos="1 0 0"/>'))
    plate = link("plate", "1 0 0", "c_end", f'<site name="p" pos="{end}"/>')
    other = link("c1", "-0.5 0 0", "c_root", plate)
    equality = '<equality><connect name="shut" site1="a_end" site2="p"/></equality>'
    motor = '<actuator><motor joint="c_root"/></actuator>'
    return f"<mujoco><worldbody>{one}{other}</worldbody>{equality}{motor}</mujoco>"


def imported(folder: Path, text: str) -> Any:  # noqa: ANN401 - tables of a robot
    path = saved(folder / "loop.xml", text)
    return import_robot(Request(path, Ends("plate"), closes=True))


def test_a_straight_chain_is_closed_from_another_start(tmp_path: Path) -> None:
    """Every joint moves the ends across x, along which they are apart: Newton's step is zero."""
    found = imported(tmp_path, model("1 0 0"))
    place = {joint["name"]: np.array(joint["at"]) for limb in found.tables["limb"] for joint in limb["joints"]}
    chain: list[Array] = [place["a_root"], place["a_knee"]]
    for one, other in pairwise(chain):
        assert np.linalg.norm(other - one) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(place["c_end"] - place["c_root"]) == pytest.approx(1.0, abs=1e-12)
    assert any("Newton's method" in note for note in found.notes)


def test_a_loop_that_cannot_close_is_named_with_its_least_gap(tmp_path: Path) -> None:
    """All hinges are parallel to z, in which the ends differ by 0.25: no motion of any joint changes that."""
    with pytest.raises(InputError, match="Newton's method, which came no closer") as fault:
        imported(tmp_path, model("1 0.3 0.25"))
    words = str(fault.value)
    assert "a loop stays open by parts of the size: shut by" in words
    size = float(words.partition("robot's size ")[2].split()[0])
    assert float(words.partition("shut by ")[2].split(";")[0]) * size == pytest.approx(0.25, rel=0.02)
    assert "correct the frames" in words
