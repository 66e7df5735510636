"""Claims of a proof about a program: its tree as statements about boxes that cover the whole box by construction.

Where the limbs of a form share no variable, the tree may begin with the byte ``LIMBS``. For each limb then follow its
bound and its tree, over its own variables, and the sum of the bounds must not exceed the proven one. A limb with the
bound minus infinity has no feasible point, and then the trees of the others are bare leaves without a bound.

Where the limbs share variables, the tree may begin with the byte ``SHARED``: see :mod:`.limbs.sharedtree`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..statement.limb_separation import separate
from ..statement.standard_form import StandardForm
from .proof_file import ProofError
from .tree import FACES, Node, TreeReader

if TYPE_CHECKING:
    from ....models import FloatArray

#: Rounding of a sum of a few bounds, in parts of their sizes: many times the largest possible.
_SUM = 1e-14
#: Nodes with children.
_INNER = frozenset({Node.HALF, Node.ABOVE, Node.BELOW, *FACES})


@dataclass(frozen=True, eq=False)
class Claim:
    """The claim of a leaf or of a face about its box.

    Attributes:
        kind: kind of the node.
        index: of the condition or variable; 0 where the kind has none.
        lower, upper: (n,) ends of the box.
    """

    kind: Node
    index: int
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class Part:
    """Claims about the box of one form: of the whole one, or of a limb.

    Attributes:
        form: the form.
        bound: the bound of the form's value that the claims prove; -inf where there is no feasible point.
        claims: the claims.
    """

    form: StandardForm
    bound: float
    claims: list[Claim]


def read_parts(tree: bytes, form: StandardForm, bound: float) -> list[Part]:
    """Read the parts of a tree, which together prove a bound of a form's value.

    Raises:
        ProofError: the bytes are no tree, or the bounds of limbs do not add up.
    """
    if tree[:1] != bytes([Node.LIMBS]):
        reader = TreeReader(tree)
        parts = [Part(form, bound, read_claims(reader, form))]
        reader.finish()
        return parts
    separation = separate(form)
    if separation is None or separation.shared:
        raise ProofError("the tree is one of limbs without shared variables, which the case does not have")
    reader = TreeReader(tree, 1)
    parts = [Part(limb.form, reader.number(), read_claims(reader, limb.form)) for limb in separation.limbs]
    reader.finish()
    empty = [part for part in parts if part.bound == -np.inf]
    if empty:
        return empty
    bounds = [*(part.bound for part in parts), separation.constant]
    size = sum(map(abs, bounds))
    if not (math.isfinite(size) and math.fsum(bounds) + _SUM * size <= bound):
        raise ProofError("the bounds of the limbs are more than the proven one together")
    return parts


def read_claims(reader: TreeReader, form: StandardForm) -> list[Claim]:
    """Read the claims of a tree; their boxes cover the form's.

    Raises:
        ProofError: the bytes are no tree.
    """
    claims: list[Claim] = []
    conditions = range(len(form.functions), len(form.functions) + len(form.conditions))

    def leaf(kind: int, i: int, lower: FloatArray, upper: FloatArray) -> None:
        index = max(i, 0)
        if kind == Node.INFEASIBLE:
            index = reader.index(conditions, "row")
        elif kind == Node.MONOTONE:
            index = reader.index(range(form.n), "variable")
        elif kind not in (Node.BOUNDED, *FACES) or (kind in FACES) != (i >= 0):
            raise ProofError(f"the tree holds {kind} where a reason must stand")
        claims.append(Claim(Node(kind), index, lower, upper))

    reader.walk(form.lower, form.upper, leaf, _INNER)
    return claims
