"""Proofs as JSON: the tree of boxes of a search, with the reason for closing each leaf.

A proof holds the case as text, the statement of its program, the proven bound, and the tree in preorder, as bytes
(compressed, in base64). The root is the box of the program's bounds. The nodes are

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

The boxes therefore cover the root by construction, and a tree with too few or too many bytes is no proof. Expressions
are counted from 0, the functions first and then the conditions. ``docs/certificate.md`` explains the reasons and why
they suffice; :mod:`screwsynth.nlp.certificate.paper.proofcheck` checks them.
"""

from __future__ import annotations

import base64
import enum
import hashlib
import json
import zlib
from dataclasses import asdict, dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np

from ...errors import InputError
from ...program.nlp import Nlp
from ...program.pairs import with_all_pairs
from ..standardform import standard_form

_FORMAT = "screwsynth-proof"
_VERSION = 2
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


class ProofError(InputError):
    """A text that is no proof, or a proof that does not hold for the case."""


@dataclass(frozen=True)
class Statement:
    """The program of a case that a proof is about.

    Attributes:
        kind: one task by itself, or the combined program of several.
        task: index of the task.
        minimise: whether the task's sense is set to a minimum, to prove that F is above a value.
        weights, best, ceiling: numbers of the combined program.
        in_home_mode: whether it is about home's working mode alone.
    """

    kind: Literal["task", "weighted-sum", "worst-case"] = "task"
    task: int = 0
    minimise: bool = False
    weights: tuple[float, ...] = ()
    best: tuple[float, ...] = ()
    ceiling: float = 0.0
    in_home_mode: bool = False


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
        packed = zlib.compress(self.tree, 9)
        content = {
            "format": _FORMAT,
            "version": _VERSION,
            "name": self.name,
            "case": self.case,
            "statement": asdict(self.statement),
            "graph": self.graph,
            "bound": self.bound,
            "digest": hashlib.sha256(self.tree).hexdigest(),
            "tree": base64.b64encode(packed).decode("ascii"),
        }
        return json.dumps(content, indent=1, allow_nan=False) + "\n"


def read_proof(text: str, source: str) -> Proof:
    """Read a proof from its JSON text.

    Args:
        text: the JSON text.
        source: its name, for messages.

    Raises:
        ProofError: the text is no proof, or is damaged.
    """
    try:
        content: dict[str, Any] = json.loads(text)
        if content["format"] != _FORMAT or content["version"] != _VERSION:
            raise ProofError(f"{source}: is no proof of this version")
        stated = dict(content["statement"])
        stated["weights"], stated["best"] = tuple(stated["weights"]), tuple(stated["best"])
        statement = Statement(**stated)
        tree = zlib.decompress(base64.b64decode(content["tree"], validate=True))
        digest, bound = content["digest"], None if content["bound"] is None else float(content["bound"])
        proof = Proof(str(content["case"]), str(content["name"]), statement, str(content["graph"]), bound, tree)
    except (ValueError, KeyError, TypeError, zlib.error):
        raise ProofError(f"{source}: is no proof as certify --proof writes it") from None
    if digest != hashlib.sha256(tree).hexdigest():
        raise ProofError(f"{source}: is damaged: its digest is not that of its tree")
    return proof


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
