"""The largest proven workspace as a result."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .workspace import ScaleData, pose_data

if TYPE_CHECKING:
    from ..proof.workspace.scale import Scale
    from ..units import Units


def scale_data(found: Scale, units: Units) -> ScaleData:
    """Return the largest proven workspace in a case's units."""
    return ScaleData.of(
        found,
        refuted=found.failed if found.refuted else None,
        pose=None if found.pose is None else pose_data(found.pose, units),
    )
