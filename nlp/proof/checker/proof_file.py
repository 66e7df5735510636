"""Proof files: one JSON format for all claims.

A file has the case as text, the premises of the proof, and its claims. A claim has a name, a reason, and the data of
the reason: a bound, a tree of boxes (compressed, in base64, with its digest), or single points. The check takes all
premises from the case and from its own arguments; premises in the file only serve to refuse at once a proof with other
premises. Reading a file unpacks no tree: see :mod:`.packed`.

A proof of a program's optimum has one claim. A claim is proved by one of

    program     a tree of :mod:`.tree` for a program, whose value is at most the bound wherever it is feasible
    regular     a tree of boxes of poses, each regular or outside of the workspace
    singular    the opposite: two poses, or a pose of each of two robots within the tolerance, with determinants of
                opposite signs
    boxes       a tree of boxes; on each of them a quantity is not below (above) its bound
    settings    a tree of boxes of poses, with values of the settings for each of its leaves
    lengths     the bounds of the lengths of a leg, from which a limit on its stroke follows

and, for a claim about every robot within a joint-centre tolerance, also by

    one machine         two directions, and two lemmas: lengths of a leg of one robot at two poses

Lemmas are further claims on which others depend: lengths of ``one machine``, each proved by a tree for a program, and

    second order        a bound of the terms of second order in the errors, for a quantity of all robots within the
                        tolerance
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Final, Literal

from ....models.fileversions import PROOF_FILES
from ...case.pose import ends_of
from ...case.workspace import Workspace
from ...errors import CaseError, InputError
from ...system.reading import check_version
from ...system.strictjson import json_tree, object_of
from .packed import LARGEST_TREES, PackedTree, TreeBudget, digest_of, packed_text

_FORMAT: Final = "screwsynth-proof"
#: Largest size of a proof file in bytes, and of the text of its case, which may contain the files that the case names.
LARGEST_PROOF, LARGEST_CASE = 2**26, 2**23
#: Largest number of characters of a name, a claim's reason, and a fingerprint; and largest number of claims of a kind.
_LONGEST, _MOST_CLAIMS = 4_000, 20_000
#: Name of the only claim of a proof about a program.
OPTIMUM = "optimum"
#: Poses of a workspace: ranges of the position, kind of rotation, ranges of the angles, axis.
Poses = tuple[str | tuple[float | tuple[float, ...], ...], ...]


class ProofError(InputError):
    """A text that is no proof, or a proof that is not valid for the case."""


@dataclass(frozen=True)
class Statement:
    """Nonlinear program of a case that a proof is about; everything else follows from the case.

    Attributes:
        is_minimum: whether the proof bounds the smallest F of a task that the case maximises.
        in_home_mode: whether the proof covers only the home working mode.
        best: reference F of each task for its loss, if the case combines maximised and minimised tasks by their worst
            case.
    """

    is_minimum: bool = False
    in_home_mode: bool = False
    best: tuple[float, ...] = ()


@dataclass(frozen=True)
class ProofClaim:
    """A proved claim.

    Attributes:
        name: name of the claim, in the words of the command.
        sense: ``min`` or ``max`` for a quantity over a workspace, otherwise empty.
        reason: kind of the proof, in the words of this module's docstring.
        bound: bound of the quantity in the unit of its search. The quantity is the maximised value of a nonlinear
            program (minus F for a minimum), a distance, a singular value or a condition number. For a pose error it is
            the first-order part for leg-length errors of one unit. None without a quantity, and for a nonlinear
            program without a feasible point.
        graph: fingerprint of the program; empty for other reasons.
        tree: bytes of the tree of boxes; empty for a claim without a tree, or with a packed tree.
        sides: two poses (6,) with determinants of opposite signs. Each pose is followed by the m joint-centre errors
            (3 m,) of its robot if these are not 0. For a leg length of one robot: two directions (3,) of the leg, in
            the world frame and in the platform frame. For settings: the value of each setting on each leaf of the
            tree. Empty for other reasons.
        packed: compressed tree from a proof file, unpacked when the claim is checked; None for a claim that was not
            read from a file.
    """

    name: str
    sense: str
    reason: str
    bound: float | None = None
    graph: str = ""
    tree: bytes = b""
    sides: tuple[tuple[float, ...], ...] = ()
    packed: PackedTree | None = None

    def unpacked(self) -> bytes:
        """Return the unpacked bytes of the claim's tree: its nodes.

        Raises:
            DamagedProofError: the nodes of a file cannot be unpacked.
        """
        return self.tree if self.packed is None or self.tree else self.packed.unpacked()

    def has_tree_of(self, other: ProofClaim) -> bool:
        """Return whether another claim has the same tree."""
        return (self.tree, self.packed) == (other.tree, other.packed)


@dataclass(frozen=True)
class Unproved:
    """A claim without a proof, with the reason."""

    name: str
    sense: str
    reason: str


@dataclass(frozen=True)
class Premises:
    """Premises of a proof about a workspace, as stated in its file; everything else follows from the case.

    Attributes:
        workspace: poses of the workspace, from :func:`workspace_premise`.
        legs: (12, 3) joint centres of six straight legs, base before platform; empty for other robots.
        quantities: names of the requested quantities.
        leg_error: largest error of a leg's length.
        joint_centre: largest error of each joint centre in the claims; 0 for the nominal robot.
        position_set: set of positions, from :func:`set_premise`; empty for all positions of the box.
        settings: names of the settings of which any value may do at a pose; empty for other claims.
    """

    workspace: Poses
    legs: tuple[tuple[float, ...], ...]
    quantities: tuple[str, ...]
    leg_error: float
    joint_centre: float = 0.0
    position_set: Poses = ()
    settings: tuple[str, ...] = ()


@dataclass(frozen=True)
class PathPremises:
    """Premises of a proof about a path, as stated in its file; everything else follows from the case.

    Attributes:
        file: name of the path's file; its ending distinguishes tables from G-code programs.
        text: text of the file.
        of_case: If true, the path is that of the case; otherwise it was given separately.
        between, angles, unit, start, offsets, flavour, end_of_file, part, macros: options for reading the path, which
            its file leaves open, see :class:`~screwsynth.nlp.path.options.PathOptions`; ``between`` by its value.
        legs, joint_centre: joint centres and their largest error, see :class:`Premises`.
        with_angles: If true, closed forms replace joint angles. This is not a premise, but a help for the check.
    """

    file: str
    text: str
    of_case: bool
    between: str | None
    angles: str
    unit: str | None
    start: tuple[float, ...] | None
    offsets: Mapping[str, tuple[float, ...]]
    legs: tuple[tuple[float, ...], ...]
    joint_centre: float
    with_angles: bool
    flavour: str = "linuxcnc"
    end_of_file: bool = False
    part: int | None = None
    macros: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        # The mapping of read offsets cannot be copied.
        object.__setattr__(self, "offsets", dict(self.offsets))


#: Premises of the claims, by the word in the file.
_PREMISES: dict[Literal["program", "workspace", "path"], type[Statement] | type[Premises] | type[PathPremises]] = {
    "program": Statement,
    "workspace": Premises,
    "path": PathPremises,
}


@dataclass(frozen=True)
class Proof:
    """Proofs of claims about a case.

    Attributes:
        case: text of the case file.
        name: name of the case.
        premises: program of the case for its only claim, or premises of claims about a workspace or a path.
        claims: proved claims.
        lemmas: claims on which other claims depend.
        unproved: claims without a proof.
    """

    case: str
    name: str
    premises: Statement | Premises | PathPremises
    claims: tuple[ProofClaim, ...]
    lemmas: tuple[ProofClaim, ...] = ()
    unproved: tuple[Unproved, ...] = ()

    def as_text(self) -> str:
        """Return the JSON text.

        Raises:
            ProofError: the proof is larger than a checker accepts.
        """
        # Claims of one search share a tree, which is unpacked once.
        size = sum(map(len, {each.tree for each in (*self.claims, *self.lemmas)}))
        if size > LARGEST_TREES:
            raise ProofError(
                f"the trees of boxes in the proof have {size // 2**20} MB; "
                f"at most {LARGEST_TREES // 2**20} MB are allowed in a proof file"
            )
        about = next(word for word, kind in _PREMISES.items() if isinstance(self.premises, kind))
        claims, lemmas = (tuple(map(_table_of, some)) for some in (self.claims, self.lemmas))
        file = _File(
            _FORMAT, PROOF_FILES.newest, self.name, self.case, about, self.premises, claims, lemmas, self.unproved
        )
        return json.dumps(asdict(file), indent=1, allow_nan=False) + "\n"


def workspace_premise(workspace: Workspace) -> Poses:
    """Return a workspace as stored in proof files: ranges of the position, kind, ranges of the angles, axis."""
    position, angles = (tuple(map(ends_of, values)) for values in (workspace.position, workspace.turns.angles))
    return position, workspace.turns.kind.value, angles, tuple(workspace.turns.axis)


def set_premise(workspace: Workspace) -> Poses:
    """Return the set of positions of a workspace as text and numbers; empty for all positions of the box.

    These are shape, radii, points, directions and displacement, then normal and point of each half space.
    """
    given = workspace.position_set
    if given is None:
        return ()
    sizes = given.radius, given.inner
    halves = ((*each.normal, *each.point) for each in given.half_spaces)
    return (given.kind.value, sizes, given.centre, given.end, given.angles, given.shift, *halves)


@dataclass(frozen=True)
class _ClaimTable:
    """A claim as stored in the file."""

    name: str
    sense: str
    reason: Literal["program", "regular", "singular", "boxes", "settings", "lengths", "one machine", "second order"]
    bound: float | None
    graph: str
    tree: str
    sides: tuple[tuple[float, ...], ...]
    digest: str


@dataclass(frozen=True)
class _File:
    """A proof as stored in a file."""

    format: Literal["screwsynth-proof"]
    schema: int
    name: str
    case: str
    about: Literal["program", "workspace", "path"]
    premises: object
    claims: tuple[_ClaimTable, ...]
    lemmas: tuple[_ClaimTable, ...]
    not_on_paper: tuple[Unproved, ...]


def _table_of(claim: ProofClaim) -> _ClaimTable:
    """Return the entry of a claim in a proof file, with its tree in packed form."""
    tree = claim.unpacked()
    own = {each.name: getattr(claim, each.name) for each in fields(claim) if each.name != "packed"}
    return _ClaimTable(**{**own, "tree": packed_text(tree)}, digest=digest_of(tree))


def read_proof(text: str | bytes, source: str) -> Proof:
    """Read a proof from its JSON text; its trees stay packed.

    Args:
        text: JSON text or its bytes.
        source: name of the text, for messages.

    Raises:
        ProofError: the text is no proof of a supported version, or a value is not allowed.
    """
    try:
        table = json_tree(text)
        if isinstance(table, dict) and table.get("format") == _FORMAT:
            check_version(PROOF_FILES, table, source)
        found = object_of(_File, table)
        is_program, kind = found.about == "program", _PREMISES[found.about]
        premises = object_of(kind, found.premises, "premises")
        _check_texts(found, premises.quantities if isinstance(premises, Premises) else ())
        if isinstance(premises, PathPremises) and len(premises.text) > LARGEST_CASE:
            raise ValueError(f"premises.text: has {len(premises.text)} characters, and at most {LARGEST_CASE} are read")
        kinds = [(each.name, each.reason) for each in found.claims]
        if is_program and (kinds != [(OPTIMUM, "program")] or found.lemmas or found.not_on_paper):
            raise ValueError(f"claims: expected one claim, {OPTIMUM}, in a proof about a nonlinear program")
    except CaseError as error:
        raise ProofError(str(error)) from None
    except ValueError as error:
        raise ProofError(f"{source}: is not a proof file of certify, workspace or path: {error}") from None
    budget, tables = TreeBudget(), (*found.claims, *found.lemmas)
    every = tuple(_claim_of(each, source, number, budget) for number, each in enumerate(tables))
    count = len(found.claims)
    return Proof(found.case, found.name, premises, every[:count], every[count:], found.not_on_paper)


def _check_texts(found: _File, quantities: tuple[str, ...]) -> None:
    """Refuse a proof file with overlong texts or with names that occur twice.

    Texts are overlong if no proof written by this package has texts of this length.

    Raises:
        ValueError: there is such a text or name.
    """
    if len(found.case) > LARGEST_CASE:
        raise ValueError(f"case: has {len(found.case)} characters, and at most {LARGEST_CASE} are read")
    texts = {"name": found.name, **{f"premises.quantities[{k}]": each for k, each in enumerate(quantities)}}
    if len(set(quantities)) < len(quantities):
        raise ValueError("premises.quantities: contains a name twice")
    for key in ("claims", "lemmas", "not_on_paper"):
        tables: tuple[_ClaimTable | Unproved, ...] = getattr(found, key)
        if len(tables) > _MOST_CLAIMS:
            raise ValueError(f"{key}: has {len(tables)} entries, and at most {_MOST_CLAIMS} are read")
        named = set[tuple[str, str]]()
        for k, each in enumerate(tables):
            if (each.name, each.sense) in named:
                raise ValueError(f"{key}[{k}]: has the name and sense of another entry")
            named.add((each.name, each.sense))
            parts = ("name", "sense", "reason", *(("graph",) if isinstance(each, _ClaimTable) else ()))
            texts.update({f"{key}[{k}].{part}": getattr(each, part) for part in parts})
    for key, text in texts.items():
        if len(text) > _LONGEST:
            raise ValueError(f"{key}: has {len(text)} characters, and at most {_LONGEST} are read")


def _claim_of(table: _ClaimTable, source: str, number: int, budget: TreeBudget) -> ProofClaim:
    """Return a claim of a proof file; its tree stays in packed form until it is needed."""
    packed = PackedTree(table.tree, table.digest, source, f"{table.name} {table.sense}".rstrip(), number, budget)
    return ProofClaim(table.name, table.sense, table.reason, table.bound, table.graph, b"", table.sides, packed)
