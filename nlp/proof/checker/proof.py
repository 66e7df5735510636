"""Proofs as JSON: the tree of boxes of a search, with the reason for closing each leaf.

A proof holds the case as text, which of the case's programs it is about, the proven bound, and the tree in preorder, as
bytes (compressed, in base64). What it claims is shown for the program that the check builds from the case. The root is
the box of the program's bounds. The nodes are

    half i             bisection of variable i at 0.5 lower + 0.5 upper: the lower half's tree, then the upper half's
    above i v, below i v    cut of variable i at v: the part above (below) v is a leaf, whose reason follows; then the
                       tree of the other part
    face i, face' i    variable i is monotone: the tree of the box's upper (lower) face, which must lie on the root's
    bounded            no feasible point of the box has a value above the bound
    infeasible k       condition k holds nowhere in the box
    monotone i         no maximum lies in the box, because every function rises along variable i

Where the limbs of a form share no variable, the tree may begin with the byte ``LIMBS``. For each limb then follow its
bound and its tree, over its own variables, and the sum of the bounds must not exceed the proven one. A limb with the
bound minus infinity has no feasible point, and then the trees of the others are bare leaves without a bound.

Where the limbs share variables, the tree may begin with the byte ``SHARED``: then it is one of boxes of these, as
:mod:`screwsynth.nlp.proof.checker.limbs.sharedtree` states it.

The boxes therefore cover the root by construction, and a tree with too few or too many bytes is no proof. Expressions
are counted from 0, the functions first and then the conditions. ``docs/certificate.md`` explains the reasons and why
they suffice; :mod:`screwsynth.nlp.proof.checker.proofcheck` checks them.
"""

from __future__ import annotations

import base64
import enum
import hashlib
import json
import zlib
from dataclasses import asdict, dataclass
from typing import TypeVar

import casadi as ca
import numpy as np

from ...errors import InputError
from ...program.nlp import Nlp
from ...program.pairs import with_all_pairs
from ...system.strictjson import json_tree, object_of
from ..statement.standard_form import standard_form

File = TypeVar("File")
_FORMAT = "screwsynth-proof"
_VERSION = 3
#: Largest tree in bytes: the proofs of docs/certificate.md have a few million.
_LARGEST_TREE = 2**28
#: Points at which a fingerprint takes a program's values, and the number of its sums.
_POINTS, _SUMS = 3, 4
#: Difference of the sums of one program in two processes: far more than rounding, far less than any change of a case.
_SAME = 1e-9


class Node(enum.IntEnum):
    """Kinds of node, as in this module's docstring: the first byte, which their indices and numbers follow."""

    HALF = 1
    ABOVE = 2
    BELOW = 3
    FACE_UPPER = 4
    FACE_LOWER = 5
    BOUNDED = 6
    INFEASIBLE = 7
    MONOTONE = 8
    LIMBS = 9
    SHARED = 10


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
class Proof:
    """A proof.

    Attributes:
        case: the case file's text.
        name: the case's name.
        statement: the program of the case that it is about.
        graph: fingerprint of the program's expressions and bounds.
        bound: upper bound of the maximised value (minus F for a minimum) over the feasible part of the root; None
            where there is no feasible point.
        tree: the nodes' bytes.
    """

    case: str
    name: str
    statement: Statement
    graph: str
    bound: float | None
    tree: bytes

    def as_text(self) -> str:
        """Return the JSON text."""
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "name": self.name,
            "case": self.case,
            "statement": asdict(self.statement),
            "graph": self.graph,
            "bound": self.bound,
            **packed(self.tree),
        }
        return json.dumps(content, indent=1, allow_nan=False) + "\n"


@dataclass(frozen=True)
class _File:
    """A proof as its file has it."""

    format: str
    version: int
    name: str
    case: str
    statement: Statement
    graph: str
    bound: float | None
    digest: str
    tree: str


def read_proof(text: str, source: str) -> Proof:
    """Read a proof from its JSON text.

    Args:
        text: the JSON text.
        source: its name, for messages.

    Raises:
        ProofError: the text is no proof, or is damaged.
    """
    found = read_document(_File, text, source, (_FORMAT, _VERSION), "certify --proof")
    tree = unpacked(found.tree, found.digest, f"{source}: is damaged")
    return Proof(found.case, found.name, found.statement, found.graph, found.bound, tree)


def read_document(kind: type[File], text: str, source: str, form: tuple[str, int], writer: str) -> File:
    """Read a data class from a file of proofs.

    Args:
        kind: the data class, with the file's keys.
        text: the JSON text.
        source: its name, for messages.
        form: name and version of the format.
        writer: the command that writes such files.

    Raises:
        ProofError: the text is none of this version, or a value is not allowed.
    """
    try:
        table = json_tree(text)
        if isinstance(table, dict) and table.get("format") == form[0] and table.get("version") != form[1]:
            raise ProofError(f"{source}: is no proof of this version, {form[1]}: write it again")
        return object_of(kind, table)
    except ValueError as error:
        raise ProofError(f"{source}: is no proof as {writer} writes it: {error}") from None


def packed(tree: bytes) -> dict[str, str]:
    """Return the nodes of a tree as texts for JSON, with their digest."""
    text = base64.b64encode(zlib.compress(tree, 9)).decode("ascii")
    return {"digest": hashlib.sha256(tree).hexdigest(), "tree": text}


def unpacked(text: str, digest: str, fault: str) -> bytes:
    """Return the nodes of a tree from their text.

    Args:
        text: the compressed nodes in base64.
        digest: of the nodes.
        fault: first half of the message about a wrong text.

    Raises:
        ProofError: the text is no such tree, or the digest is another.
    """
    try:
        reader = zlib.decompressobj()
        tree = reader.decompress(base64.b64decode(text, validate=True), _LARGEST_TREE)
    except (ValueError, zlib.error):
        raise ProofError(f"{fault}: its tree cannot be unpacked") from None
    if not reader.eof or reader.unused_data:
        raise ProofError(f"{fault}: its tree is incomplete, or larger than {_LARGEST_TREE // 2**20} MB")
    if digest != hashlib.sha256(tree).hexdigest():
        raise ProofError(f"{fault}: its digest is not that of its tree")
    return tree


def fingerprint(nlp: Nlp) -> str:
    """Return a text that tells programs from each other: sizes, and sums of their values at a few points.

    The same case may give graphs whose constants differ in the last bit, from one process to another, so that no hash
    of the graph would do. A proof does not rest on it: the check shows every claim for the program that it has built.
    """
    nlp = with_all_pairs(nlp)
    program = nlp.program
    function = ca.Function("values", [program.x, program.p], [ca.densify(ca.vertcat(program.objective, program.g))])
    rng = np.random.default_rng(0)
    shares = rng.random((_POINTS, nlp.n))
    points = [nlp.lower + share * (nlp.upper - nlp.lower) for share in shares]
    values = [function(x, nlp.arguments).full().ravel() for x in points]
    size = nlp.n
    if nlp.in_home_mode:
        # Unknowns that follow in closed form are no variables of the tree's boxes.
        form = standard_form(nlp)
        size, function = form.n, ca.Function("form", [form.x], [form.expressions])
        values += [function(form.point_of(x)).full().ravel() for x in points]
    numbers = np.concatenate([*values, nlp.arguments, nlp.lower, nlp.upper, nlp.g_lower, nlp.g_upper])
    # Each number counts by its size and by its sign; one that is not finite by a constant.
    known = np.isfinite(numbers)
    parts = np.where(known, numbers / (1 + np.abs(np.where(known, numbers, 0.0))), np.where(numbers > 0, 2.0, -2.0))
    sums = rng.normal(size=(_SUMS, numbers.size)) @ parts
    return " ".join([str(size), str(len(nlp.g_lower)), str(int(nlp.sign)), *(f"{each:.12e}" for each in sums)])


def is_same_program(one: str, other: str) -> bool:
    """Return whether two fingerprints are of the same program, to rounding."""
    first, second = one.split(), other.split()
    if first[:3] != second[:3] or len(first) != len(second):
        return False
    try:
        return bool(
            np.allclose([float(each) for each in first], [float(each) for each in second], rtol=_SAME, atol=_SAME)
        )
    except ValueError:
        return False
