"""Motor requirements over a workspace: stroke, force, speed and power of each actuator as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ...models import Dimension
from ...models.statics import DrivenJoint, driven_joints
from ..case.case import Case
from ..case.forces import dimension_of_force, dimension_of_speed
from ..case.motors import ActuatorQuantity
from ..case.task import Sense
from ..proof.workspace.verdict import Outcome
from .numbers import number
from .text import Line, TextTable, Tone

if TYPE_CHECKING:
    from ..results.workspace import MotorData, MotorEndData

#: Word for each outcome of a claim.
OUTCOME_WORDS = {Outcome.PROVED: "proved", Outcome.REFUTED: "violated", Outcome.OPEN: "undecided"}
#: Tone of each outcome.
TONES = {Outcome.PROVED: Tone.HOLDS, Outcome.REFUTED: Tone.FAULT, Outcome.OPEN: Tone.CAUTION}
#: Outcomes, the worst one first.
_ORDER = (Outcome.REFUTED, Outcome.OPEN, Outcome.PROVED)
_NOTHING = "no bound"
#: Largest magnitude of a bound that is shown as 0: the proved bound of a zero quantity is a tiny number.
_UNDERFLOW = 1e-90


def ends_of_motor(motor: MotorData) -> tuple[MotorEndData, ...]:
    """Return the verdicts on the smallest value of an actuator quantity, if there is one, and on the largest value."""
    return tuple(each for each in (motor.smallest, motor.largest) if each is not None)


def motor_tables(case: Case, motors: Sequence[MotorData]) -> Iterator[TextTable]:
    """Yield two tables of motor requirements with a row for each actuator: linear actuators, then rotary actuators.

    The values are proved bounds over all poses and all load cases.
    """
    joints = driven_joints(case.model)
    for dimension in dict.fromkeys(joint.dimension for joint in joints) if motors else ():
        own = [joint for joint in joints if joint.dimension is dimension]
        turns = dimension is Dimension.ANGLE
        rows = [_row(joint, [each for each in motors if each.actuator == joint.name]) for joint in own]
        units = [dimension, dimension, *[dimension_of_force(own[0])] * 2, dimension_of_speed(own[0]), Dimension.POWER]
        words = ("from", "to", "push", "pull", "speed", "power")
        if turns:
            words = ("from", "to", "torque forwards", "torque backwards", "speed", "power")
        shown = [k for k in range(len(words)) if any(row[1 + k] for row in rows)]
        headers = ["actuator", *(f"{words[k]}\n{case.units.label(units[k])}".rstrip() for k in shown), "outcome"]
        cells = tuple((row[0], *(row[1 + k] for k in shown), row[-1]) for row in rows)
        title = "motor requirements: proved bounds over all poses and loads"
        yield TextTable(tuple(headers), cells, name="motors", title=title)


def _row(joint: DrivenJoint, motors: Sequence[MotorData]) -> tuple[str | Line, ...]:
    """Return the row of an actuator: coordinate from and to, force in both senses, speed, power, outcome."""
    by = {each: [motor for motor in motors if motor.number is each] for each in ActuatorQuantity}
    forces = [abs(end.bound or 0.0) for motor in by[ActuatorQuantity.FORCE] for end in ends_of_motor(motor)]
    size = max(forces, default=0.0) + _UNDERFLOW

    def extreme(what: ActuatorQuantity, sense: Sense, *, flipped: bool = False) -> str:
        ends = [motor.smallest if sense is Sense.MIN else motor.largest for motor in by[what]]
        known = [end.bound for end in ends if end is not None]
        if not known:
            return ""
        values = [value for value in known if value is not None]
        if len(values) < len(known):
            return _NOTHING
        value = min(values) if sense is Sense.MIN else max(values)
        if what is ActuatorQuantity.FORCE:
            value = max(-value if flipped else value, 0.0)
        return number(value, size if what is ActuatorQuantity.FORCE else _UNDERFLOW)

    outcomes = [end.outcome for motor in motors for end in ends_of_motor(motor)]
    worst = next((each for each in _ORDER if each in outcomes), Outcome.OPEN)
    return (
        joint.name,
        extreme(ActuatorQuantity.COORDINATE, Sense.MIN),
        extreme(ActuatorQuantity.COORDINATE, Sense.MAX),
        extreme(ActuatorQuantity.FORCE, Sense.MAX),
        extreme(ActuatorQuantity.FORCE, Sense.MIN, flipped=True),
        extreme(ActuatorQuantity.SPEED, Sense.MAX),
        extreme(ActuatorQuantity.POWER, Sense.MAX),
        Line(OUTCOME_WORDS[worst], tone=TONES[worst]),
    )
