"""Pictures of a workspace: the robot at a pose, and slices."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, PathPatch, Rectangle
from matplotlib.path import Path
from numpy.typing import NDArray

from ....models import Dimension, FloatArray
from ...case.case import Case
from ...case.pose import Rotation
from ...errors import CaseError, EvaluationError
from ...evidence.closing import closed_start
from ...evidence.state import evaluate
from ...program.formulation import formulate_each
from ...proof.statement.posed_layout import at_one_pose
from ...proof.workspace.slices.slice_limits import KEPT, UNDECIDED
from ...proof.workspace.slices.slices import Region, Slice
from ...proof.workspace.verdict import Outcome
from ...results.claims import PosedClaim
from ...words.claims import claim_words
from ...words.numbers import key_words, number
from ...words.poses import pose_words
from .canvas import INK, draw_edges
from .drawing import Drawing, drawing_of
from .figures import picture_of
from .fonts import legible

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def drawing_at(case: Case, claim: PosedClaim) -> Drawing:
    """Return the drawing of the robot at the pose of a claim, with the case's first task.

    Args:
        case: case with fixed dimensions.
        claim: claim with its pose, in the case's units.

    Raises:
        EvaluationError: the robot does not exist at the pose, or it is a pose of another robot within the tolerance.
    """
    pose = claim.pose
    angle = case.units.to_internal(pose.angle, Dimension.ANGLE)
    posed = at_one_pose(case, tuple(pose.position), Rotation(tuple(pose.axis), angle))
    try:
        nlp = formulate_each(posed)[0]
    except CaseError:
        if case.joint_centre_tolerance is None:
            raise
        # Dependent coordinates of the pose belong to the other robot: the nominal robot's loops do not close there.
        raise EvaluationError(
            "the worst pose was found for joint centres displaced within the tolerance, and the "
            "nominal robot does not reach this pose"
        ) from None
    x = closed_start(nlp)
    headline = f"{claim.outcome.value}: {claim_words(claim)}; at {pose_words(case, pose)}"
    return drawing_of(nlp, x, evaluate(nlp, x), headline=headline, is_answer=claim.outcome is not Outcome.REFUTED)


#: Width and height of one slice, and height of a line of the legend, inches.
_SIZE, _LINE = (3.2, 3.02), 0.185
_COLUMNS = 3
#: Width and height of a single slice, inches.
_ALONE = 4.2
#: Left, bottom, width and height of its axes, as fractions of the slice.
_PLACE = (0.16, 0.13, 0.82, 0.82)
_GREEN, _PALE, _ORANGE, _BAND = "#b7dcbc", "#f4efe2", "#f3cdb0", "#2f3b46"
#: Colours of unreachable poses, and of poses without a proof of closed loops.
_FAR, _EDGE = "#7d8790", "#aab2b9"
#: Colours of violated limits in order, distinct from the green and from each other with any colour blindness.
_LIMITS = (
    *("#9ecae1", "#fdd49e", "#c8b3d9", "#f7b6c2", "#d9d9d9", "#8fb8b0"),
    *("#e6d96c", "#bf9b7a", "#c3dd7a", "#e08f8f", "#7f93cf", "#d98fcb"),
)
#: Number of points on each side of a box that is drawn curved.
_CURVED = 2


class Kind(NamedTuple):
    """Kind of boxes: text in the legend and ``gid`` of its boxes, colour, and hatch."""

    words: str
    colour: str
    hatch: str = ""


def slices_figure(case: Case, slices: Sequence[Slice]) -> Figure:
    """Return the slices as a Matplotlib figure; the ``gid`` of a box is the text of its verdict."""
    columns = min(_COLUMNS, len(slices))
    rows = -(-len(slices) // columns)
    entries, notes = slices_legend(case, slices), slices_notes(slices)
    across = min(2, columns)
    lines = -(-(len(entries) + 1) // across) + len(notes)
    size = _SIZE[0] * columns, _SIZE[1] * rows + 0.6 + _LINE * lines
    figure = Figure(figsize=size, facecolor="white", layout="constrained")
    kinds = _kinds(case, slices)
    for k, each in enumerate(slices):
        _paint(figure.add_subplot(rows, columns, k + 1), case, each, kinds)
    title = textwrap.wrap(legible(case.title or case.name), 30 * columns, max_lines=2, placeholder=" …")
    whose = " for the nominal robot, without the tolerance" if case.joint_centre_tolerance else ""
    words = [*title, f"slices through the centre of the workspace{whose}"]
    figure.suptitle("\n".join(words), fontsize=10, color=INK, parse_math=False)
    handles = [
        Patch(facecolor=kind.colour, edgecolor=INK, linewidth=0.4, hatch=kind.hatch, label=legible(kind.words))
        for kind in entries
    ]
    handles.append(Patch(facecolor="none", edgecolor=INK, linewidth=1.6, label="workspace"))
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=across,
        frameon=False,
        fontsize=8,
        labelcolor=INK,
        title="\n".join(map(legible, notes)) or None,
        title_fontproperties={"size": 8},
        alignment="left",
    )
    return figure


def slice_images(case: Case, slices: Sequence[Slice]) -> list[bytes]:
    """Return a PNG picture of each slice without title and legend, for pages."""

    def alone(each: Slice) -> Figure:
        figure = Figure(figsize=(_ALONE, _ALONE), facecolor="white")
        # The same position in each picture, so that slices side by side are aligned.
        _paint(figure.add_axes(_PLACE), case, each, _kinds(case, slices))
        return figure

    return [picture_of(".png", alone, each) for each in slices]


def slices_legend(case: Case, slices: Sequence[Slice]) -> list[Kind]:
    """Return the kinds of boxes of slices, in painting order."""
    kinds = _kinds(case, slices)
    members = [[layer.members.any() for layer in _layers(each, kinds)] for each in slices]
    shown = {layer.kind for row in members for layer, used in zip(_layers(slices[0], kinds), row, strict=True) if used}
    return [kind for kind in kinds if kind in shown]


def slices_notes(slices: Sequence[Slice]) -> list[str]:
    """Return notes on limits that the slices do not show, and on the colour of boxes with several violated limits."""
    left_out = dict.fromkeys(key for each in slices for key in each.left_out)
    notes = [f"not shown: {', '.join(key_words(f'limits.{each}') for each in left_out)}"] if left_out else []
    if len(slices[0].limits) > 1:
        notes.append(
            "if several limits are violated, the colour is that of the first one on the straight line from the centre"
        )
    return notes


def _paint(axes: Axes, case: Case, each: Slice, kinds: Sequence[Kind]) -> None:
    """Paint the boxes of a slice, the outline of the workspace, and the names of the axes."""
    axes.set_box_aspect(1)
    for kind, members, is_filled in _layers(each, kinds):
        if members.any():
            style: dict[str, Any] = {"facecolor": kind.colour, "edgecolor": kind.colour, "linewidth": 0.3}
            if not is_filled:
                style = {"facecolor": "none", "edgecolor": INK, "linewidth": 0.0, "hatch": kind.hatch}
            axes.add_artist(PathPatch(_path(_outlines(case, each, each.boxes[members])), gid=kind.words, **style))
    _frame(axes, case, each)


def _kinds(case: Case, slices: Sequence[Slice]) -> list[Kind]:
    """Return the kinds of boxes in painting order, with one kind for each limit."""
    limits = slices[0].limits
    # Violated limits have the first colours, so that few of them share a colour.
    used = np.unique(np.concatenate([each.binding for each in slices])).tolist()
    order = sorted(range(len(limits)), key=lambda k: (k not in used, k))
    colours = {k: _LIMITS[place % len(_LIMITS)] for place, k in enumerate(order)}
    kept = "proved: no singularity, all limits satisfied" if limits else Region.REGULAR.value
    kinds = [Kind(kept, _GREEN)]
    for k, limit in enumerate(limits):
        value = f"{number(case.units.shown(limit.limit, limit.dimension))} {case.units.label(limit.dimension)}".rstrip()
        how = "" if limit.is_enclosed else " at samples"
        words = limit.key if limit.key.startswith("custom[") else key_words(f"limits.{limit.key}")
        kinds.append(Kind(f"violated{how}: {words} = {value}", colours[k]))
    if limits:
        kinds.append(Kind("limits undecided", _PALE))
    return [
        *kinds,
        Kind(Region.BEYOND.value, _ORANGE, "////"),
        Kind(Region.OTHER_SIGN.value, _ORANGE, "////"),
        Kind(Region.SINGULAR.value, _BAND),
        Kind(Region.OPEN.value, _BAND),
        Kind(Region.UNREACHED.value, _FAR),
        Kind(Region.UNKNOWN.value, _EDGE),
    ]


class _Layer(NamedTuple):
    """Boxes (B,) of a slice with one colour and hatch."""

    kind: Kind
    members: NDArray[np.bool_]
    is_filled: bool = True


def _layers(each: Slice, kinds: Sequence[Kind]) -> list[_Layer]:
    """Return the layers of a slice, the lowest first; a box may be in two layers."""
    regions = np.array([region.value for region in each.regions])
    is_judged = (regions != Region.UNREACHED.value) & (regions != Region.UNKNOWN.value)
    is_beyond = {region: regions == region.value for region in (Region.BEYOND, Region.OTHER_SIGN)}
    is_here = ~np.any(list(is_beyond.values()), axis=0)
    kept, *limits = kinds[: 1 + len(each.limits)]
    *opened, beyond, other, singular, band, far, edge = kinds[1 + len(each.limits) :]
    hatched = [(beyond, is_beyond[Region.BEYOND]), (other, is_beyond[Region.OTHER_SIGN])]
    return [
        _Layer(kept, (each.binding == KEPT) & is_here),
        *(_Layer(kind, each.binding == k) for k, kind in enumerate(limits)),
        *(_Layer(kind, (each.binding == UNDECIDED) & is_judged) for kind in opened),
        *(_Layer(kind, (each.binding == KEPT) & members) for kind, members in hatched),
        *(_Layer(kind, members, is_filled=False) for kind, members in hatched),
        _Layer(singular, regions == Region.SINGULAR.value),
        _Layer(band, regions == Region.OPEN.value),
        _Layer(far, regions == Region.UNREACHED.value),
        _Layer(edge, regions == Region.UNKNOWN.value),
    ]


def _frame(axes: Axes, case: Case, each: Slice) -> None:
    """Draw the outline of the workspace, and name the axes of a slice."""
    inner, outer = (_shown(case, each, end) for end in each.workspace)
    outline: dict[str, Any] = {"fill": False, "edgecolor": INK, "linewidth": 1.6, "gid": "workspace"}
    if each.outside is not None:
        low, high = (_shown(case, each, end) for end in each.whole)
        x, y = (np.linspace(*ends, len(each.outside)) for ends in zip(low, high, strict=True))
        drawn = axes.contour(x, y, each.outside.T, [0.0], colors=[INK], linewidths=1.6)
        drawn.set_gid("workspace")
    elif each.ball is None:
        low, high = (_shown(case, each, end) for end in each.whole)
        axes.add_patch(Rectangle((inner[0], inner[1]), *(outer - inner), **outline))
    else:
        # The corners of the slice are nearest to its centre.
        corner = np.abs(_shown(case, each, each.whole[1]))
        low, high = -corner, corner
        axes.add_patch(Circle((0.0, 0.0), case.units.shown(each.ball, Dimension.ANGLE), **outline))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    dimensions = [Dimension.ANGLE if is_angle else Dimension.LENGTH for is_angle in each.are_angles]
    labels = [f"{name}, {case.units.label(part)}" for name, part in zip(each.names, dimensions, strict=True)]
    axes.set_xlabel(legible(labels[0]), color=INK, fontsize=9, parse_math=False)
    axes.set_ylabel(legible(labels[1]), color=INK, fontsize=9, parse_math=False)
    draw_edges(axes, 8)


def _shown(case: Case, each: Slice, points: FloatArray) -> FloatArray:
    """Return points (..., 2) of a slice in the case's units; rotations about any axis as rotation vectors."""
    points = np.array(points)
    if each.ball is not None:
        cayley = np.tan(points / 2)
        size = np.linalg.norm(cayley, axis=-1, keepdims=True)
        points = np.where(size > 0, 2 * np.arctan(size) / np.where(size > 0, size, 1.0), 2.0) * cayley
    scale = [case.units.shown(1.0, Dimension.ANGLE if is_angle else Dimension.LENGTH) for is_angle in each.are_angles]
    return np.asarray(points * np.array(scale))


def _path(outlines: FloatArray) -> Path:
    """Return outlines (B, k, 2) as one path, which needs a tenth of the file size of separate polygons."""
    count, points, _ = outlines.shape
    closed = np.concatenate([outlines, outlines[:, :1]], axis=1).reshape(-1, 2)
    codes = np.tile([Path.MOVETO, *[Path.LINETO] * (points - 1), Path.CLOSEPOLY], count)
    return Path(closed, codes)


def _outlines(case: Case, each: Slice, boxes: FloatArray) -> FloatArray:
    """Return outlines (B, k, 2) of boxes (B, 4) in the case's units."""
    a, b, c, d = boxes.T
    corners = [(a, b), (c, b), (c, d), (a, d), (a, b)]
    count = 1 if each.ball is None else _CURVED
    points = []
    for (x, y), (u, v) in itertools.pairwise(corners):
        points += [np.column_stack([x + part * (u - x), y + part * (v - y)]) for part in np.arange(count) / count]
    return _shown(case, each, np.stack(points, axis=1))
