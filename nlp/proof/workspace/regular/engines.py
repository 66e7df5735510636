"""Engines that examine boxes of poses: the C kernel where it was built, and NumPy, which is always there."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Protocol

import numpy as np

from .....models import FloatArray
from ...enclosure.engine import chosen_kernel
from ...statement.machine import Legs
from ..robot.pose_box import CODES, PoseBox
from .regularity import NumpyRankEngine, RankExamination


class RankEngine(Protocol):
    """Examination of boxes, block by block."""

    @property
    def name(self) -> str:
        """``c`` or ``numpy``."""

    @property
    def block(self) -> int:
        """Number of boxes that it examines at once."""

    def examine(self, lower: FloatArray, upper: FloatArray) -> RankExamination:
        """Examine boxes (B, 6)."""


class KernelRankEngine:
    """The C kernel, with the formulas of :class:`~.regularity.NumpyRankEngine`."""

    name = "c"
    block = 1024

    def __init__(self, legs: Legs, box: PoseBox, module: ModuleType) -> None:
        self._module = module
        self._head = CODES[box.kind], box.ball, legs.tolerance, legs.length
        self._robot = tuple(np.ascontiguousarray(part) for part in (legs.base, legs.platform, box.axis))

    def examine(self, lower: FloatArray, upper: FloatArray) -> RankExamination:
        """Examine boxes (B, 6)."""
        count = len(lower)
        # The kernel contracts the boxes where they are.
        ends = np.array(lower, order="C"), np.array(upper, order="C")
        verdict, split, sign = (np.empty(count, dtype=np.int32) for _ in range(3))
        self._module.examine(*self._head, count, *self._robot, *ends, verdict, split, sign)
        return RankExamination(verdict, split, sign, *ends)


def kernel() -> ModuleType | None:
    """Return the C kernel, or None where it was not built."""
    try:
        return import_module("screwsynth.nlp.proof.workspace._workspace")
    except ImportError:
        return None


def rank_engine(legs: Legs, box: PoseBox, name: str | None = None) -> RankEngine:
    """Return an engine.

    Args:
        legs: joint centres.
        box: the whole box.
        name: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.

    Raises:
        ValueError: there is no engine of that name here.
    """
    module = chosen_kernel(name, kernel)
    return NumpyRankEngine(legs, box) if module is None else KernelRankEngine(legs, box, module)
