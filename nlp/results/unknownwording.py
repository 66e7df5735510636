"""Joint positions that a certificate covers as further variables, limb by limb, in words."""

from __future__ import annotations

from collections.abc import Iterator

from ...models import Model
from .text import Line


def unknown_lines(model: Model, *, all_assemblies: bool) -> Iterator[Line]:
    """Yield the limbs whose joint positions are unknowns of the program; nothing for a robot without unknowns.

    Args:
        model: the robot.
        all_assemblies: whether all working modes are covered, and not home's alone.
    """
    counts: dict[str, int] = {}
    for each in model.structure:
        counts[each.limb] = counts.get(each.limb, 0) + each.unknowns
    modes = set() if all_assemblies else {each.limb for each in model.signs if each.is_mode}
    groups: dict[tuple[int, bool], list[str]] = {}
    for limb, count in counts.items():
        if count:
            groups.setdefault((count, limb in modes), []).append(limb)
    for (count, in_mode), limbs in groups.items():
        who = f"limb {limbs[0]} needs" if len(limbs) == 1 else f"limbs {', '.join(limbs)} need"
        what = f"{count} joint position{'s' * (count > 1)}{' each' * (len(limbs) > 1)}"
        where = "in home's working mode" if in_mode else "in every assembly"
        yield Line(f"{who} {what} and the loop equations, {where}", label="unknowns")
