"""Singularities of a robot defined by joints: kind, gained motions, and locking wrenches.

Ranks at the point are compared with those at almost all dimensions and closed configurations:

* passive: the passive screws of a limb lose rank, so that its wrenches ``W`` gain a dimension and F jumps; or nested
  loops leave more motions with locked actuators, so that the wrenches lose one;
* serial: all screws of a limb lose rank, so that an actuator does no work in any wrench of the limb, and the platform
  loses a degree of freedom; or its members keep their ranks, but its actuators can move while the platform rests;
* constraint: the constraint wrenches, which do no work in the actuated joints, lose rank;
* actuation: all wrenches lose rank, so that the platform moves with every actuator locked.

Where the screws of a limb become dependent, it has more wrenches than at almost all nearby points. The wrenches there
follow to first order. With rates ``n`` for which ``sum n_j s_j = 0``, a wrench ``w`` persists at a nearby point if it
does no work in ``sum n_j ds_j``, where ``ds_j = sum_(i<j) [s_i, s_j] dq_i`` for motions ``dq_i`` of the preceding
joints. The additional wrenches do work in such changes. For nested loops the changes are not known, so their joints
and wrenches are not reported.
"""

import enum
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...models import FloatArray, JointScrews, frozen_array
from ...models.linalg import echelon_basis
from ..program.nlp import Nlp
from ..program.program import RobotNumbers
from ..system.jsonvalues import Absent, JsonObject
from .paths import paths_at
from .screwvalues import ScrewMotion, ScrewWrench, motion_of, wrench_of
from .state import RobotState

#: Screws of unit size are dependent if a singular value is below this fraction of the largest, as for the rank of J.
DEPENDENT = 1e-7
#: Relative size below which motions that nested loops leave are rounding errors, and must not be scaled up.
_NEGLIGIBLE = 1e-9
#: Rates of dependent joints below this fraction of the largest are zero: such a joint is not among the dependent ones.
_TAKES_PART = 1e-6


class SingularityKind(enum.Enum):
    """Kind of a singularity."""

    PASSIVE = "passive"
    SERIAL = "serial"
    CONSTRAINT = "constraint"
    ACTUATION = "actuation"
    ARCHITECTURE = "architecture"

    @property
    def clause(self) -> str:
        """Short description of the kind, as a clause."""
        return _CLAUSES[self]


_CLAUSES = {
    SingularityKind.PASSIVE: "passive joints are dependent: F jumps here, and the point is not an optimum to build",
    SingularityKind.SERIAL: "joints are dependent: its actuator cannot drive the platform, "
    "which loses a degree of freedom",
    SingularityKind.CONSTRAINT: "the constraints are dependent: the platform gains a degree of freedom "
    "even with unlocked actuators",
    SingularityKind.ACTUATION: "the platform can move with every actuator locked",
    SingularityKind.ARCHITECTURE: "the rank is below six at all dimensions and poses: the platform can always move",
}


class Singularity(JsonObject):
    """A singularity.

    Attributes:
        kind: kind of the singularity.
        limb: name of the limb; absent for a singularity of the whole robot.
        joints: labels of the dependent joints of the limb, empty for nested loops; absent for the whole robot.
        words: description of the singularity, as a clause.
        gained: basis of the motions that the platform gains; absent for a singularity of a limb. For a constraint
            singularity with an ambiguous gain, all motions that no constraint resists.
        locking: additional wrenches of the limb, so that the platform loses the motions in which they do work; absent
            for the whole robot. Several such wrenches may depend on the path to the point.
    """

    kind: SingularityKind
    limb: Absent[str]
    joints: Absent[tuple[str, ...]]
    words: str
    gained: Absent[tuple[ScrewMotion, ...]]
    locking: Absent[tuple[ScrewWrench, ...]]


def singularity(
    kind: SingularityKind,
    limb: str | None = None,
    joints: tuple[str, ...] = (),
    gained: "FloatArray | None" = None,
    locking: Sequence[ScrewWrench] | None = None,
) -> Singularity:
    """Return a singularity of a limb, or of the whole robot with the twists (k, 6) that its platform gains."""
    words = kind.clause
    if limb is not None:
        named = f" {', '.join(joints)}" if joints else ""
        first, _, rest = words.partition(" are dependent")
        words = f"limb {limb}: its {first}{named} are dependent{rest}"
    return Singularity(
        kind=kind,
        limb=limb,
        joints=None if limb is None else joints,
        words=words,
        gained=None if gained is None else tuple(motion_of(row) for row in gained),
        locking=None if locking is None else tuple(locking),
    )


def limb_singularities(nlp: Nlp, x: FloatArray, state: RobotState, pose: int = 0) -> list[Singularity]:
    """Return the singularities of limbs: joint screws with a lower rank than at almost all other points.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        state: state of the robot at the point.
        pose: index of the pose.
    """
    model = nlp.program.model
    if not model.joint_screws:
        return []
    rows = [row.limb for row in model.rows]
    found: list[Singularity] = []
    for each in _motions_at(nlp, x, nlp.program.kernels.robot_states[pose](x, nlp.arguments), pose):
        own = state.jacobian[[k for k, limb in enumerate(rows) if limb == each.path.limb]]
        singular = _singularity_of(each, own, state.position)
        same = next((k for k, other in enumerate(found) if _are_alike(singular, other)), None)
        if singular is not None and same is None:
            found.append(singular)
        elif singular is not None and same is not None:
            found[same] = _together(found[same], singular)
    return found


def is_passive_singular(nlp: Nlp, x: FloatArray, pose: int = 0) -> bool:
    """Return whether passive joints of a limb are dependent at one of the poses of a point (n,), so that F jumps."""
    if not nlp.program.model.joint_screws:
        return False
    numbers = nlp.program.kernels.robot_states[pose](x, nlp.arguments)
    for each in _motions_at(nlp, x, numbers, pose):
        passive = each.screws[:, each.passive]
        if not np.isfinite(passive).all():
            return True
        if _rank(_unit_columns(passive, numbers.position.ravel())[0]) != each.path.passive_rank:
            return True
    return False


def platform_singularities(
    state: RobotState, constraints: FloatArray, ranks: tuple[int, int], generic: tuple[int, int]
) -> list[Singularity]:
    """Return the constraint and actuation singularities at a point.

    Most constraint singularities are actuation singularities with the same motions: they are listed only once.

    Args:
        state: state of the robot at the point.
        constraints: (k, 6) constraint wrenches, which do no work in the actuated joints.
        ranks: ranks of the constraints and of J at the point.
        generic: the same ranks at almost all points.
    """
    found = []
    lost = generic[0] - ranks[0]
    if lost > 0:
        has_same_motions = len(state.free_twists) == lost
        gained = state.free_twists if has_same_motions else _null_twists(constraints, state.position)
        found.append(singularity(SingularityKind.CONSTRAINT, gained=gained))
        if has_same_motions:
            return found
    if ranks[1] < generic[1]:
        found.append(singularity(SingularityKind.ACTUATION, gained=state.free_twists))
    return found


class _Motions(NamedTuple):
    """Screws (6, k) of a chain of joints; for nested loops, the motions that the loops allow, passive joints first."""

    path: JointScrews
    screws: FloatArray
    passive: list[int]


def _motions_at(nlp: Nlp, x: FloatArray, numbers: RobotNumbers, pose: int) -> list[_Motions]:
    """Return the screws of each chain of joints at a point."""
    found = []
    for each in paths_at(nlp, x, numbers, pose):
        screws, passive = each.screws, each.path.passive
        if each.path.is_nested:
            locked = screws[:, passive] @ _null_space(each.loops[:, passive])
            screws = np.hstack([locked, screws @ _null_space(each.loops)])
            screws, passive = _without_rounding(screws, np.ravel(numbers.position)), list(range(locked.shape[1]))
        found.append(_Motions(each.path, screws, passive))
    return found


def _null_space(loops: FloatArray) -> FloatArray:
    """Return an orthonormal basis (k, n) of the rates that close loops (m, k)."""
    return np.asarray(np.linalg.svd(loops)[2][_rank(loops) :].T)


def _without_rounding(screws: FloatArray, centre: FloatArray) -> FloatArray:
    """Return motions (6, k); motions within the rounding error of the largest motion are 0."""
    lengths = np.linalg.norm(_homogeneous(screws, centre, _reach(screws, centre)), axis=0)
    return np.asarray(np.where(lengths <= _NEGLIGIBLE * lengths.max(initial=0.0), 0.0, screws))


def _singularity_of(motions: _Motions, own: FloatArray, centre: FloatArray) -> Singularity | None:
    """Return the singularity of one chain of joints; None if the chain is not singular.

    Args:
        motions: screws of the chain; not finite for a joint whose axis has no direction at the point.
        own: (m, 6) rows of the chain's limb in J.
        centre: (3,) the platform's origin, length.
    """
    each, screws, passive = motions
    every = list(range(screws.shape[1]))
    for kind, columns, generic in (
        (SingularityKind.PASSIVE, passive, each.passive_rank),
        (SingularityKind.SERIAL, every, each.all_rank),
    ):
        known = [k for k in columns if np.isfinite(screws[:, k]).all()]
        unit, reach = _unit_columns(screws[:, known], centre)
        rank = _rank(unit)
        if len(known) == len(columns) and (rank == generic or (rank > generic and kind is SingularityKind.SERIAL)):
            continue
        if each.is_nested:
            return singularity(kind, each.limb)
        before = [k for k in every if np.isfinite(screws[:, k]).all()]
        changes, kernel = _changes(screws, before, known, unit, reach, centre)
        cokernel = np.linalg.svd(unit)[0][:, rank:]
        wrenches = _span_of(cokernel @ (cokernel.T @ changes))
        if not wrenches.shape[1]:
            resisted = _dual(own, centre, reach)
            wrenches = _span_of(cokernel - resisted @ (resisted.T @ cokernel))
        taking_part = np.abs(kernel).max(axis=1, initial=0.0)
        part = [known[k] for k in np.flatnonzero(taking_part > _TAKES_PART * taking_part.max(initial=0.0))]
        part += [k for k in columns if k not in known]
        joints = tuple(dict.fromkeys(each.joints[k] for k in sorted(part)))
        return singularity(kind, each.limb, joints, locking=_unit_wrenches(wrenches.T, centre, reach))
    return None


def _changes(
    screws: FloatArray,
    before: Sequence[int],
    columns: Sequence[int],
    unit: FloatArray,
    reach: float,
    centre: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return changes (6, c) of dependent screw combinations as the joints ``before`` move, and the joint rates (n, k).

    Rates whose combination has no change are left out if other combinations change. An example is the spin of a rod
    between two ball joints, whose combination is also zero nearby.
    """
    rank = _rank(unit)
    kernel = np.linalg.svd(unit)[2][rank:].T
    lengths = np.linalg.norm(_homogeneous(screws[:, list(columns)], centre, reach), axis=0)
    by_rate = np.zeros((0, kernel.shape[1]))
    changes = [np.zeros((6, 0))]
    for i in before:
        moved = np.zeros((6, len(columns)))
        for k, j in enumerate(columns):
            if i < j and lengths[k] > 0:
                bracket = _bracket(screws[:, i], screws[:, j])[:, None]
                moved[:, k] = _homogeneous(bracket, centre, reach)[:, 0] / lengths[k]
        moved = moved @ kernel
        left = np.linalg.svd(unit)[0][:, rank:].T @ moved
        by_rate = np.vstack([by_rate, left])
        changes.append(moved)
    directions = np.linalg.svd(by_rate)[2][: _rank(by_rate)].T if by_rate.size else np.zeros((kernel.shape[1], 0))
    return np.hstack(changes), kernel @ directions if directions.shape[1] else kernel


def _bracket(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the change of a twist (6,) for unit motion along another twist (6,): their Lie bracket."""
    (w, v), (omega, velocity) = np.split(first, 2), np.split(second, 2)
    return np.concatenate([np.cross(w, omega), np.cross(w, velocity) + np.cross(v, omega)])


def _homogeneous(screws: FloatArray, centre: FloatArray, reach: float) -> FloatArray:
    """Return twists (6, n) with velocities of a centre (3,), divided by a length."""
    return np.vstack([screws[:3], (screws[3:] + np.cross(screws[:3].T, centre).T) / reach])


def _unit_columns(screws: FloatArray, centre: FloatArray) -> tuple[FloatArray, float]:
    """Return unit twists (6, n) about a centre, with velocities divided by the largest; and the largest velocity."""
    reach = _reach(screws, centre)
    scaled = _homogeneous(screws, centre, reach)
    lengths = np.linalg.norm(scaled, axis=0)
    return scaled / np.where(lengths > 0, lengths, 1.0), reach


def _reach(screws: FloatArray, centre: FloatArray) -> float:
    """Return the largest velocity of a centre (3,) over twists (6, n) with a rotation; 1 without such a twist."""
    velocities = _homogeneous(screws, centre, 1.0)[3:]
    turning = np.linalg.norm(screws[:3], axis=0) > 0
    return float(np.linalg.norm(velocities[:, turning], axis=0).max(initial=0.0)) or 1.0


def _rank(columns: FloatArray) -> int:
    """Return the rank of columns with norms of at most 1."""
    if not columns.size:
        return 0
    values = np.linalg.svd(columns, compute_uv=False)
    return int(np.count_nonzero(values > DEPENDENT * values.max(initial=1.0)))


def _span_of(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis (6, r) of the span of columns (6, n) of magnitude about 1."""
    left, values, _ = np.linalg.svd(columns)
    return np.asarray(left[:, : int(np.count_nonzero(values > _TAKES_PART * values.max(initial=1.0)))])


def _dual(wrenches: FloatArray, centre: FloatArray, reach: float) -> FloatArray:
    """Return an orthonormal basis (6, r) of wrenches (m, 6): moments divided by a length, then forces."""
    moments = wrenches[:, 3:] - np.cross(centre, wrenches[:, :3])
    rows = np.hstack([moments / reach, wrenches[:, :3]])
    return _span_of(rows.T) if len(rows) else np.zeros((6, 0))


def _unit_wrenches(duals: FloatArray, centre: FloatArray, reach: float) -> list[ScrewWrench]:
    """Return wrenches of unit force, or unit couples, from a basis (k, 6) of :func:`_dual`."""
    if not len(duals):
        return []
    rows = echelon_basis(duals)
    forces = rows[:, 3:]
    wrenches = np.hstack([forces, rows[:, :3] * reach + np.cross(centre, forces)])
    sizes = np.linalg.norm(forces, axis=1)
    couples = np.linalg.norm(wrenches[:, 3:], axis=1)
    return [wrench_of(row) for row in wrenches / np.where(sizes > 0, sizes, couples)[:, None]]


def _null_twists(wrenches: FloatArray, centre: FloatArray) -> FloatArray:
    """Return a basis (k, 6) of the twists in which wrenches (m, 6) do no work, in reduced echelon form."""
    moments = wrenches[:, 3:] - np.cross(centre, wrenches[:, :3])
    reach = float(np.abs(moments).max(initial=0.0)) or 1.0
    rows = np.hstack([moments / reach, wrenches[:, :3]])
    null = np.linalg.svd(rows)[2][_rank(rows) :] * np.array([1 / reach] * 3 + [1.0] * 3)
    null[:, 3:] -= np.cross(null[:, :3], centre)
    found = echelon_basis(null)
    return frozen_array(found, found.shape)


def _are_alike(one: Singularity | None, other: Singularity) -> bool:
    return one is not None and (one.kind, one.limb) == (other.kind, other.limb)


def _together(one: Singularity, other: Singularity) -> Singularity:
    """Return one singularity of a limb from the singularities of two chains of joints."""
    joints = tuple(dict.fromkeys([*(one.joints or ()), *(other.joints or ())]))
    return singularity(one.kind, one.limb, joints, locking=(*(one.locking or ()), *(other.locking or ())))
