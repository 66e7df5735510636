"""Proofs as files: JSON of one format for all claims.

A file holds the case as text, the premises as the proof states them, and its claims. A claim has a name, a reason, and
the data of the reason: a bound, a tree of boxes (compressed, in base64, with its digest), or single points. The check
takes all premises from the case and from its own arguments; those in the file tell a proof for other ones at once.

A proof of a program's optimum has one claim. A claim is proved by one of

    program     a tree of :mod:`.tree` for a program, whose value is at most the bound wherever it is feasible
    regular     a tree of boxes of poses, each regular or outside of the workspace
    singular    the opposite: two poses, or a pose of each of two machines, with determinants of opposite signs
    boxes       a tree of boxes on each of which a number is not below (above) its bound
    lengths     the bounds of the lengths of a leg, from which a limit on its stroke follows

and, where it is about every machine within a tolerance on joint centres, also by

    one machine         two directions, and two lemmas: lengths of a leg of one machine at two poses

Lemmas are further claims on which others rest: lengths of ``one machine``, each proved by a tree for a program, and

    second order        a bound of the terms of second order in the errors, by which a number of all machines is bounded
"""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from dataclasses import asdict, dataclass
from typing import Final, Literal

from ....models.fileversions import PROOF_FILES
from ...case.pose import ends_of
from ...case.workspace import Workspace
from ...errors import CaseError, InputError
from ...system.reading import check_version
from ...system.strictjson import json_tree, object_of

_FORMAT: Final = "screwsynth-proof"
#: Largest tree in bytes: the proofs of docs/certificate.md have a few million.
_LARGEST_TREE = 2**28
#: Name of the only claim of a proof about a program.
OPTIMUM = "optimum"
#: Poses of a workspace: ranges of the position, kind, ranges of the angles, axis.
Poses = tuple[str | tuple[float | tuple[float, ...], ...], ...]


class ProofError(InputError):
    """A text that is no proof, or a proof that does not hold for the case."""


@dataclass(frozen=True)
class Statement:
    """Which of a case's programs a proof is about; everything else follows from the case.

    Attributes:
        is_minimum: whether the smallest F of a task that the case maximises is bounded.
        in_home_mode: whether home's working mode alone is covered.
        best: of tasks of both senses in their worst case, the value of F of each from which its loss is measured.
    """

    is_minimum: bool = False
    in_home_mode: bool = False
    best: tuple[float, ...] = ()


@dataclass(frozen=True)
class ProofClaim:
    """A claim that is proved.

    Attributes:
        name: in the words of the command.
        sense: ``min`` or ``max`` for a number over a workspace, else empty.
        reason: how it is proved, in the words of this module's docstring.
        bound: bound of the number in the unit of its search: of the maximised value of a program (minus F for a
            minimum), of a distance, of a singular value or a condition number, or, for errors of a pose, of their part
            of first order for legs that are one unit of length off; None without a number, and for a program without a
            feasible point.
        graph: fingerprint of the program; empty for other reasons.
        tree: nodes in bytes; empty for a claim without a tree.
        sides: two poses (6,) with determinants of opposite signs, after each those of a machine's m joint centres'
            errors (3 m,) where these are not 0; two directions (3,) of a leg, in the world frame and in the platform
            frame; empty for other reasons.
    """

    name: str
    sense: str
    reason: str
    bound: float | None = None
    graph: str = ""
    tree: bytes = b""
    sides: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class Unproved:
    """A claim without a proof, and the reason."""

    name: str
    sense: str
    reason: str


@dataclass(frozen=True)
class Premises:
    """What a proof about a workspace says of its premises; everything else follows from the case.

    Attributes:
        workspace: the poses, from :func:`workspace_numbers`.
        legs: (12, 3) joint centres of six straight legs, base before platform; empty for another robot.
        quantities: measures that were asked for.
        leg_error: largest error of a leg's length.
        joint_centre: largest error of each joint centre in the machines that the claims are about; 0 for the exact one.
    """

    workspace: Poses
    legs: tuple[tuple[float, ...], ...]
    quantities: tuple[str, ...]
    leg_error: float
    joint_centre: float = 0.0


@dataclass(frozen=True)
class Proof:
    """Proofs of claims about a case.

    Attributes:
        case: the case file's text.
        name: the case's name.
        premises: the program of the case that the one claim is about, or what claims about a workspace rest on.
        claims: the claims that are proved.
        lemmas: claims that others rest on.
        unproved: claims without a proof.
    """

    case: str
    name: str
    premises: Statement | Premises
    claims: tuple[ProofClaim, ...]
    lemmas: tuple[ProofClaim, ...] = ()
    unproved: tuple[Unproved, ...] = ()

    def as_text(self) -> str:
        """Return the JSON text."""
        about: Literal["program", "workspace"] = "program" if isinstance(self.premises, Statement) else "workspace"
        claims, lemmas = (tuple(map(_table_of, some)) for some in (self.claims, self.lemmas))
        file = _File(
            _FORMAT, PROOF_FILES.newest, self.name, self.case, about, self.premises, claims, lemmas, self.unproved
        )
        return json.dumps(asdict(file), indent=1, allow_nan=False) + "\n"


def workspace_numbers(workspace: Workspace) -> Poses:
    """Return a workspace as texts and numbers: ranges of the position, kind, ranges of the angles, axis."""
    position, angles = (tuple(map(ends_of, values)) for values in (workspace.position, workspace.turns.angles))
    return position, workspace.turns.kind.value, angles, tuple(workspace.turns.axis)


@dataclass(frozen=True)
class _ClaimTable:
    """A claim as the file has it."""

    name: str
    sense: str
    reason: Literal["program", "regular", "singular", "boxes", "lengths", "one machine", "second order"]
    bound: float | None
    graph: str
    tree: str
    sides: tuple[tuple[float, ...], ...]
    digest: str


@dataclass(frozen=True)
class _File:
    """A proof as its file has it."""

    format: Literal["screwsynth-proof"]
    schema: int
    name: str
    case: str
    about: Literal["program", "workspace"]
    premises: object
    claims: tuple[_ClaimTable, ...]
    lemmas: tuple[_ClaimTable, ...]
    not_on_paper: tuple[Unproved, ...]


def _table_of(claim: ProofClaim) -> _ClaimTable:
    """Return a claim with its tree packed."""
    text = base64.b64encode(zlib.compress(claim.tree, 9)).decode("ascii")
    return _ClaimTable(**{**vars(claim), "tree": text}, digest=hashlib.sha256(claim.tree).hexdigest())


def read_proof(text: str, source: str) -> Proof:
    """Read a proof from its JSON text.

    Args:
        text: the JSON text.
        source: its name, for messages.

    Raises:
        ProofError: the text is no proof of a version that is read, a value is not allowed, or a tree is damaged.
    """
    try:
        table = json_tree(text)
        if isinstance(table, dict) and table.get("format") == _FORMAT:
            check_version(PROOF_FILES, table, source)
        found = object_of(_File, table)
        is_program = found.about == "program"
        kind: type[Statement] | type[Premises] = Statement if is_program else Premises
        premises = object_of(kind, found.premises, "premises")
        reasons = [each.reason for each in found.claims]
        if is_program and (reasons != ["program"] or found.lemmas or found.not_on_paper):
            raise ValueError("a proof about a program has one claim")
    except CaseError as error:
        raise ProofError(str(error)) from None
    except ValueError as error:
        raise ProofError(f"{source}: is no proof as certify and workspace write it: {error}") from None
    claims, lemmas = (tuple(_claim_of(each, source) for each in some) for some in (found.claims, found.lemmas))
    return Proof(found.case, found.name, premises, claims, lemmas, found.not_on_paper)


def _claim_of(table: _ClaimTable, source: str) -> ProofClaim:
    """Return a claim with its tree unpacked.

    Raises:
        ProofError: the text is no such tree, or the digest is another.
    """
    fault = f"{source}: is damaged at '{table.name}'"
    try:
        reader = zlib.decompressobj()
        tree = reader.decompress(base64.b64decode(table.tree, validate=True), _LARGEST_TREE)
    except (ValueError, zlib.error):
        raise ProofError(f"{fault}: its tree cannot be unpacked") from None
    if not reader.eof or reader.unused_data:
        raise ProofError(f"{fault}: its tree is incomplete, or larger than {_LARGEST_TREE // 2**20} MB")
    if table.digest != hashlib.sha256(tree).hexdigest():
        raise ProofError(f"{fault}: its digest is not that of its tree")
    return ProofClaim(table.name, table.sense, table.reason, table.bound, table.graph, tree, table.sides)
