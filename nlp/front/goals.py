"""Goals of a front as they are written: ``max F:NAME``, ``min F:NAME``, ``min limits.KEY`` and ``max limits.KEY``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..case.case import Case
from ..case.task import Sense
from ..errors import InputError, listing, nearest

_TASK, _LIMIT = "F:", "limits."
#: Largest number of goals: the boxes of the space of goals become too many, and nobody reads such a front.
MOST = 6


@dataclass(frozen=True)
class Goal:
    """A goal: F of a task, or the number of a limit.

    Attributes:
        sense: whether it is maximised or minimised.
        label: as it is written, without the sense.
        task: index of the task; None for a limit.
        key: dotted key below ``limits``; empty for a task.
    """

    sense: Sense
    label: str
    task: int | None = None
    key: str = ""

    @property
    def sign(self) -> float:
        """Factor that turns the goal into one to be minimised."""
        return -self.sense.sign


def read_goals(texts: Sequence[str], case: Case) -> tuple[Goal, ...]:
    """Return the goals of a case; F alone stands for that of the only task.

    Raises:
        InputError: a text is no goal of the case, or there are fewer than two different ones or more than ``MOST``.
    """
    goals = tuple(_read_goal(text, case) for text in texts)
    if not 2 <= len(goals) <= MOST:
        verb = "is" if len(goals) == 1 else "are"
        raise InputError(f"--goals: a front has 2 to {MOST} goals, and {len(goals)} {verb} given")
    labels = [goal.label for goal in goals]
    twice = next((label for k, label in enumerate(labels) if label in labels[:k]), None)
    if twice is not None:
        raise InputError(f"--goals: {twice} is given twice")
    return goals


def _read_goal(text: str, case: Case) -> Goal:
    """Return one goal; the errors are those of :func:`read_goals`."""
    word, _, rest = text.strip().partition(" ")
    label = rest.strip()
    if word not in ("max", "min") or not (label == "F" or label.startswith((_TASK, _LIMIT))):
        raise InputError(f"--goals {text!r}: must be 'max F:TASK', 'min F:TASK', 'min limits.KEY' or 'max limits.KEY'")
    sense = Sense(word)
    if label.startswith(_LIMIT):
        return Goal(sense, label, key=label.removeprefix(_LIMIT))
    names = [task.name for task in case.tasks]
    name = label.removeprefix(_TASK) if label != "F" else (names[0] if len(names) == 1 else "")
    if name not in names:
        raise InputError(f"--goals {text!r}: the case has no such task; {nearest(name, names)}")
    if names.count(name) > 1:
        raise InputError(f"--goals {text!r}: several tasks have this name; tasks: {listing(names)}")
    return Goal(sense, f"{_TASK}{name}", task=names.index(name))
