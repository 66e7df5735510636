"""Schedule of a case: the values of its settings at the points of the path, with the best constant beside it."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...models import Dimension, FloatArray
from ...models.rotation import quaternion_from_matrix
from ...models.values import dataclass
from ..case.pose import OverPoses
from ..path.path import Poses
from ..units import Units

if TYPE_CHECKING:
    from ..proof.workspace.judgement import Judgement  # few cases have a proof to load

#: Relative gain over the best constant below which a schedule has no gain.
NO_GAIN = 1e-6
#: Significant digits of written values: all of them, so that rounding exceeds no rate.
_DIGITS = 17


class ConstantSetting(NamedTuple):
    """Best settings that are the same at all points.

    Attributes:
        values: (k,) values in the case's units.
        value: objective.
        design: values of the free dimensions of their design, by name.
    """

    values: FloatArray
    value: float
    design: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Schedule:
    """Values of settings at N points of a path, in the case's units.

    Attributes:
        names: names of the k settings.
        dimensions: physical dimension of each setting.
        units: units of the values.
        values: (N, k) values at the points; linear between them.
        times: (N,) times of the points, seconds; NaN without stated times.
        poses: poses of the path at the points, without a turn about the tool.
        feeds: (N, 3) unit vectors of the feed at the points; 0 where the platform only rotates or rests.
        F: (N,) objective of each point: the sum over the tasks, or the worst value.
        over: combination of F over the points.
        value: objective: the weighted mean, or the worst value.
        constant: best constant settings; None if no constant keeps the limits.
        rates: (k,) largest rates of the case, per second; infinite for no limit.
        design: values of the free dimensions of the design, by name.
        bound: proved bound of the objective of all schedules of this design; None without a proof.
        reason: reason why the gap of the bound was not reached, such as a time limit; empty if it was, or without a
            request.
        sign: 1 for a maximum, -1 for a minimum.
        seconds: wall time.
        judgement: verdicts on ranks and limits along the whole path; None without limits over the path.
        added: number of points that were added because limits were violated there.
        is_home_mode: If true, the bound is one of the home working mode; a robot without loops has no other mode.
    """

    names: tuple[str, ...]
    dimensions: tuple[Dimension, ...]
    units: Units
    values: FloatArray
    times: FloatArray
    poses: Poses
    feeds: FloatArray
    F: FloatArray
    over: OverPoses
    value: float
    constant: ConstantSetting | None
    rates: FloatArray
    design: Mapping[str, float]
    bound: float | None
    sign: float
    seconds: float
    judgement: Judgement | None = None
    added: int = 0
    is_home_mode: bool = False
    reason: str = ""

    @property
    def gain(self) -> float | None:
        """Relative gain over the best constant; None without such a constant."""
        if self.constant is None:
            return None
        gain = self.sign * (self.value - self.constant.value) / (abs(self.constant.value) or 1.0)
        return 0.0 if abs(gain) < NO_GAIN else gain

    @property
    def gap(self) -> float | None:
        """Relative distance of the bound from the objective; None without a bound."""
        return None if self.bound is None else self.sign * (self.bound - self.value) / (abs(self.value) or 1.0)

    @property
    def rates_used(self) -> FloatArray:
        """Largest rate (k,) of each setting between two points, per second; NaN without stated times."""
        return np.asarray(np.abs(np.diff(self.values, axis=0) / np.diff(self.times)[:, None]).max(axis=0))

    @property
    def quaternions(self) -> FloatArray:
        """Unit quaternions (N, 4) of the poses, real part first, each near the one before."""
        return _quaternions(self.poses.rotations)

    @property
    def statement(self) -> str:
        """Bound in words; empty without a proof."""
        if self.bound is None:
            return ""
        stated = ", ".join(f"{name} = {value:.7g}" for name, value in self.design.items())
        what = f"the design with {stated}" if stated else "this robot"
        mode = "in the home working mode " if self.is_home_mode else ""
        side = "more" if self.sign > 0 else "less"
        rounded = Context(7, ROUND_CEILING if self.sign > 0 else ROUND_FLOOR).create_decimal_from_float(self.bound)
        return (
            f"no schedule of {what} {mode}within the limits and rates has {side} than {float(rounded):.7g} "
            "at the points of the path"
        )

    def to_csv(self) -> str:
        """Return the schedule as a table of poses, with a column for each setting, and ``t`` if times are stated."""
        columns = {
            **dict(zip("xyz", self.poses.positions.T, strict=True)),
            **dict(zip(("qw", "qx", "qy", "qz"), self.quaternions.T, strict=True)),
            **dict(zip(self.names, self.values.T, strict=True)),
        }
        if np.isfinite(self.times).all():
            columns["t"] = self.times
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([f"{value:.{_DIGITS}g}" for value in row] for row in zip(*columns.values(), strict=True))
        return text.getvalue()


def _quaternions(rotations: FloatArray) -> FloatArray:
    """Return unit quaternions (N, 4) of rotation matrices (N, 3, 3), each near the one before."""
    found = np.array([quaternion_from_matrix(each) for each in rotations])
    signs = np.where((found[1:] * found[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    found[1:] *= np.cumprod(signs)[:, None]
    return found
