"""Loads, motions, gravity and limits on actuators as text: what is read again is the same case."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import case_from, starter
from hypothesis import given, settings
from hypothesis import strategies as st

from screwsynth.nlp import Case, Limits, Units
from screwsynth.nlp.case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed
from screwsynth.nlp.case.loads import Load, Loading, Motion

#: Of an angle that is written in degrees.
ULP = 3e-16
SIX, TURNING = starter("stewart-gough"), starter("delta")

NUMBER = st.floats(-1e30, 1e30) | st.integers(-1000, 1000).map(float) | st.sampled_from([0.0, -0.0, 5e-324, 1e-7, 0.1])
SIZE = st.floats(0, 1e30) | st.sampled_from([0.0, 1.0, 12.5])
POSITIVE = st.floats(1e-300, 1e30) | st.sampled_from([1.0, 2.5])
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER) | st.just((0.0, 0.0, 0.0))
#: No half of a pair of surrogates, which no text file has.
NAME = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12) | st.sampled_from(["cut", "a b", '"'])


@st.composite
def loads(draw: st.DrawFn, name: str) -> Load:
    always = draw(st.booleans())
    if draw(st.booleans()):
        return Load(name, point=draw(VECTOR), mass=draw(POSITIVE), always=always)
    force, moment, size, turn = draw(VECTOR), draw(VECTOR), draw(SIZE), draw(SIZE)
    if not (any(force) or any(moment) or size or turn):
        force = (0.0, 0.0, -1.0)
    is_fixed = any(force) or any(moment)
    both = is_fixed and draw(st.booleans())
    return Load(name, force, moment, draw(VECTOR), draw(st.booleans()), both, size, turn, always=always)


@st.composite
def loadings(draw: st.DrawFn) -> Loading:
    names = draw(st.lists(NAME.filter(lambda name: "reversed" not in name), max_size=4, unique=True))
    own = tuple(draw(loads(name)) for name in names)
    motion = Motion(*draw(st.tuples(SIZE, st.floats(0, 1e28)))) if draw(st.booleans()) else None
    if motion is not None and not (motion.linear or motion.angular):
        motion = Motion(1.0)
    gravity = draw(st.none() | VECTOR.filter(any))
    return Loading(own, motion, gravity)


def same_but_for_degrees(one: Loading, two: Loading) -> bool:
    turns = [None if each.motion is None else each.motion.angular for each in (one, two)]
    left = [replace(each.motion, angular=0.0) if each.motion else None for each in (one, two)]
    rows = [[vars(load) for load in each.loads] for each in (one, two)]
    gravities = [None if each.gravity is None else tuple(each.gravity) for each in (one, two)]
    close = turns[0] == turns[1] or abs(turns[0] - turns[1]) <= ULP * abs(turns[0])
    return rows[0] == rows[1] and left[0] == left[1] and gravities[0] == gravities[1] and close


@given(loadings(), st.sampled_from([("m", "N"), ("mm", "N"), ("in", "lbf")]), st.sampled_from(["deg", "rad"]))
@settings(max_examples=60, deadline=None)
def test_random_loads_are_the_same_when_they_are_read_again(
    loading: Loading, units: tuple[str, str], angle: str
) -> None:
    if loading.gravity is None and units != ("m", "N"):
        loading = loading._replace(gravity=(0.0, 0.0, -1.0))
    own = Units(units[0], angle, units[1])
    case = replace(SIX, units=own, loading=loading)
    text = case.to_toml()
    again = case_from(text, case.name)
    assert same_but_for_degrees(case.loading, again.loading)
    assert again.units == own
    assert [each.name for each in again.loading.cases] == [each.name for each in loading.cases]
    if angle == "rad" or loading.motion is None:
        assert again.to_toml() == text


@given(st.data())
@settings(max_examples=40, deadline=None)
def test_random_limits_on_actuators_are_the_same_when_they_are_read_again(data: st.DataObject) -> None:
    case, names = data.draw(st.sampled_from([(SIX, ("1-", "2+", "3+")), (TURNING, ("1", "2", "3"))]))
    every = data.draw(st.booleans())
    actuators = [""] if every else data.draw(st.lists(st.sampled_from(names), min_size=1, unique=True))
    limits: list[ActuatorForce | ActuatorSpeed | ActuatorPower] = []
    for actuator in actuators:
        low = data.draw(st.none() | st.floats(-1e6, 1e6))
        high = data.draw(st.floats(1e-3, 1e3)) + (0.0 if low is None else max(low, 0.0))
        limits.append(
            ActuatorForce(
                actuator, min=low, max=data.draw(st.just(high) | (st.none() if low is not None else st.just(high)))
            )
        )
        limits.append(ActuatorSpeed(actuator, max=data.draw(POSITIVE)))
    limits.append(ActuatorPower("", max=data.draw(POSITIVE)))
    loading = Loading((Load("tool", (1.0, 2.0, 3.0)),), Motion(1.0))
    made = replace(case, loading=loading, limits=Limits(*limits))
    again = case_from(made.to_toml(), made.name)
    assert len(again.limits.items) == len(limits)
    for limit in limits:
        (other,) = [each for each in again.limits if (type(each), each.name) == (type(limit), limit.name)]
        for key in ("min", "max"):
            one, two = (getattr(each, key, None) for each in (limit, other))
            assert one == two or abs(one - two) <= ULP * abs(one)


def test_numbers_of_arrays_are_written_as_numbers() -> None:
    load = Load("tool", np.array([1.0, 2.0, 3.0]), np.zeros(3), np.array([0.1, 0.2, 0.3]), any_force=np.float64(2.0))
    loading = Loading((load, Load("payload", mass=np.float64(3.0))), Motion(np.float64(0.5)), np.array([0.0, 0, -9.81]))
    case = replace(SIX, loading=loading)
    again = case_from(case.to_toml(), case.name)
    assert same_but_for_degrees(loading, again.loading)


def test_a_case_without_loads_has_no_word_of_them() -> None:
    text = SIX.to_toml()
    for word in ("load", "motion", "gravity", "force"):
        assert word not in text


@pytest.mark.parametrize("angle", ["deg", "rad"])
def test_speeds_of_actuators_that_turn_have_the_unit_of_angles(angle: str) -> None:
    tables = """
[motion]
linear = 0.5
angular = 30
[limits]
actuator_speed = { max = 90 }
"""
    own = Units("m", angle)
    base = replace(TURNING, units=own).to_toml()
    factor = np.pi / 180 if angle == "deg" else 1.0
    case = case_from(base + tables)
    assert case.loading.motion == Motion(0.5, 30 * factor)
    assert case.limits == Limits(ActuatorSpeed(max=90 * factor))
    # Legs that slide have a speed of length, whatever the unit of angles.
    six: Case = case_from(replace(SIX, units=own).to_toml() + tables)
    assert six.limits == Limits(ActuatorSpeed(max=90.0))
