"""The proof of a workspace as JSON: one file with the case, the workspace, and a tree of boxes for each claim.

A claim is proved by one of

    regular     a tree of boxes, each regular or outside of the workspace
    singular    the opposite: two poses at which the determinant of the rows has opposite signs
    program     a tree of ``certify`` for one number, with its bound
    boxes       a tree of boxes on each of which a number is not below (above) its bound
    lengths     the bounds of the lengths of a leg, from which a limit on its stroke follows

and, where it is about every machine within a tolerance on joint centres, also by

    one machine         two directions, and two lemmas: lengths of a leg of one machine at two poses
    singular machine    the opposite: a pose, and a machine at which the determinant has another sign there

Lemmas are claims of their own that others rest on: the shortest lengths of the exact machine's legs, and those of
``one machine``. Each is proved by a tree of ``certify``.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Literal

from ....case.pose import Free
from ....case.workspace import Workspace
from ....system.strictjson import json_tree
from ..proof import packed, read_document, unpacked

FORMAT = "screwsynth-workspace-proof"
_VERSION = 2
#: Number of coordinates of a pose.
COORDINATES = 6


@dataclass(frozen=True)
class PaperClaim:
    """A claim that is proved.

    Attributes:
        name: in the words of the command.
        sense: ``min`` or ``max`` for a number, else empty.
        reason: how it is proved, in the words of this module's docstring.
        bound: bound of the number in the unit of its search: of a program's objective, of a distance, of a singular
            value or a condition number, or, for errors of a pose, of their part of first order for legs that are one
            unit of length off; None without a number.
        graph: fingerprint of the program; empty for other reasons.
        tree: nodes in bytes; empty for a claim without a tree.
        sides: two poses (6,) with determinants of opposite signs; two directions (3,) of a leg, in the world frame and
            in the platform frame; a pose (6,) and joint centres (12, 3); empty for other reasons.
    """

    name: str
    sense: str
    reason: str
    bound: float | None = None
    graph: str = ""
    tree: bytes = b""
    sides: tuple[tuple[float, ...], ...] = ()

    def as_data(self) -> dict[str, object]:
        """Return the JSON object."""
        return {
            "name": self.name,
            "sense": self.sense,
            "reason": self.reason,
            "bound": self.bound,
            "graph": self.graph,
            "sides": self.sides,
            **packed(self.tree),
        }


@dataclass(frozen=True)
class Unproved:
    """A claim without a proof, and the reason."""

    name: str
    sense: str
    reason: str


@dataclass(frozen=True)
class PaperProof:
    """Proofs of claims about a workspace.

    The check derives all premises from the case and from its own arguments. Those in the file, ``workspace``, ``legs``,
    ``leg_error`` and ``tolerance``, tell a proof for other ones at once.

    Attributes:
        case: the case file's text.
        name: the case's name.
        workspace: the poses, from :func:`workspace_numbers`.
        legs: (12, 3) joint centres of six straight legs, base before platform; empty for another robot.
        quantities: measures that were asked for.
        leg_error: largest error of a leg's length.
        claims: the claims that are proved.
        unproved: the others.
        tolerance: largest error of each joint centre in the machines that the claims are about; 0 for the exact one.
        lemmas: claims that others rest on.
    """

    case: str
    name: str
    workspace: object
    legs: tuple[tuple[float, ...], ...]
    quantities: tuple[str, ...]
    leg_error: float
    claims: tuple[PaperClaim, ...]
    unproved: tuple[Unproved, ...]
    tolerance: float = 0.0
    lemmas: tuple[PaperClaim, ...] = ()

    def as_text(self) -> str:
        """Return the JSON text."""
        content = {
            "format": FORMAT,
            "version": _VERSION,
            "name": self.name,
            "case": self.case,
            "workspace": self.workspace,
            "legs": self.legs,
            "quantities": self.quantities,
            "leg_error": self.leg_error,
            "joint_centre": self.tolerance,
            "claims": [each.as_data() for each in self.claims],
            "lemmas": [each.as_data() for each in self.lemmas],
            "not_on_paper": [vars(each) for each in self.unproved],
        }
        return json.dumps(content, indent=1, allow_nan=False) + "\n"


def workspace_numbers(workspace: Workspace) -> object:
    """Return a workspace as texts and numbers: ranges of the position, kind, ranges of the angles, axis."""
    position, angles = (
        tuple((each.lower, each.upper) if isinstance(each, Free) else (each, each) for each in values)
        for values in (workspace.position, workspace.turns.angles)
    )
    return position, workspace.turns.kind.value, angles, tuple(workspace.turns.axis)


@dataclass(frozen=True)
class _ClaimTable:
    """A claim as the file has it."""

    name: str
    sense: str
    reason: Literal["regular", "singular", "program", "boxes", "lengths", "one machine", "singular machine"]
    bound: float | None
    graph: str
    sides: tuple[tuple[float, ...], ...]
    digest: str
    tree: str

    def claim(self, source: str) -> PaperClaim:
        """Return the claim.

        Raises:
            ProofError: its tree is not the one of its digest.
        """
        tree = unpacked(self.tree, self.digest, f"{source}: is damaged at '{self.name}'")
        return PaperClaim(self.name, self.sense, self.reason, self.bound, self.graph, tree, self.sides)


@dataclass(frozen=True)
class _File:
    """A proof as its file has it."""

    format: str
    version: int
    name: str
    case: str
    workspace: object
    legs: tuple[tuple[float, ...], ...]
    quantities: tuple[str, ...]
    leg_error: float
    joint_centre: float
    claims: tuple[_ClaimTable, ...]
    lemmas: tuple[_ClaimTable, ...]
    not_on_paper: tuple[Unproved, ...]


def is_paper(text: str) -> bool:
    """Return whether a text is a proof of a workspace, and not one of ``certify``."""
    try:
        content = json_tree(text)
    except ValueError:
        return False
    return isinstance(content, dict) and content.get("format") == FORMAT


def read_paper(text: str, source: str) -> PaperProof:
    """Read a proof from its JSON text.

    Args:
        text: the JSON text.
        source: its name, for messages.

    Raises:
        ProofError: the text is no proof, or is damaged.
    """
    found = read_document(_File, text, source, (FORMAT, _VERSION), "workspace --proof")
    return PaperProof(
        case=found.case,
        name=found.name,
        workspace=_tuples(found.workspace),
        legs=found.legs,
        quantities=found.quantities,
        leg_error=found.leg_error,
        claims=tuple(each.claim(source) for each in found.claims),
        tolerance=found.joint_centre,
        lemmas=tuple(each.claim(source) for each in found.lemmas),
        unproved=found.not_on_paper,
    )


def _tuples(value: object) -> object:
    """Return lists within lists as tuples."""
    return tuple(_tuples(each) for each in value) if isinstance(value, list) else value
