"""Structures of the C for many problems in one call, as ctypes lays them out."""

from __future__ import annotations

import ctypes
from typing import Any, ClassVar

#: Whole numbers among the answers.
COUNTS = ("status", "runs", "converged", "iterations")


class Rows(ctypes.Structure):
    """Rows of numbers, as the C has them."""

    _fields_: ClassVar = [("values", ctypes.c_void_p), ("length", ctypes.c_int), ("is_shared", ctypes.c_int)]


class Options(ctypes.Structure):
    """A budget, as the C has it; zeros are none."""

    _fields_: ClassVar = [
        ("max_iterations", ctypes.c_int),
        ("deadline", ctypes.c_void_p),
        ("user", ctypes.c_void_p),
    ]


class Batch(ctypes.Structure):
    """Problems and answers, as the C has them."""

    _fields_: ClassVar = [
        *((name, Rows) for name in ("p", "x0", "lower", "upper", "g_lower", "g_upper", "limits")),
        *((name, ctypes.c_int) for name in ("maximise", "seeds")),
        ("options", Options),
        *((name, ctypes.c_void_p) for name in COUNTS),
        *((name, ctypes.c_void_p) for name in ("F", "x", "R", "axis", "angle", "violation", "residual")),
        *((name, ctypes.c_void_p) for name in ("lower_multipliers", "upper_multipliers")),
        *((name, ctypes.c_void_p) for name in ("g_lower_multipliers", "g_upper_multipliers", "limit_multipliers")),
    ]
    maximise: int
    seeds: int
    kept: tuple[Any, ...]
