"""Closure of a mechanism's loops at a pose of its platform, at actuator coordinates, or at both.

From the stated configuration, pose and actuators move along a straight line to the requested pose and actuator
coordinates. At each step, Newton's method with damped least-norm steps and a line search closes the loops. Steps are
halved if it does not converge, or if a joint moves too far.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import FloatArray
from ..newton import newton
from .descent import CLOSED, Descent
from .graph import Mechanism, MechanismError, MechanismJoint, MechanismLink
from .motions import Coordinates, Equations, Motions, Placed, moved, rotation_matrix, rotation_vector

#: First and shortest step of the path, relative to its length.
_FIRST = 1 / 8
_SHORTEST = 1 / 1024
#: Largest number of Newton steps at each point of the path, and the step lengths of the line search.
_STEPS = 40
_PARTS = [0.5**k for k in range(12)]
#: Ratio of successive residuals above which the iteration stops, because no solution is near.
_STUCK = 0.999
#: Residual below which Newton's method stops; it also stops when the residual no longer falls.
_EXACT = 2e-16
#: Relative size below which singular values of the derivatives are zero: those of dependent loops, and of rods that
#: spin freely, are rounding errors.
_ZERO = 1e-9
#: Largest change of a scaled coordinate in a step; a larger change may be a jump to another assembly mode.
_LARGE = 0.6


@dataclass(frozen=True, eq=False)
class ClosedMechanism:
    """Mechanism with closed loops.

    Attributes:
        mechanism: mechanism at the closed configuration, in which positions, axes and ranges of its joints are stated.
        coordinates: coordinate of each joint R, P and H from the start configuration, radians or length.
        residual: largest error of a loop, radians or relative to the mechanism's size.
        nearness: smallest singular value of the loops' derivatives along the path, relative to its value at the start.
            Values that are zero everywhere do not count. If nearness is close to 0, the path comes close to a
            singularity of the joints.
        points: number of closed configurations on the path.
    """

    mechanism: Mechanism
    coordinates: Mapping[str, float]
    residual: float
    nearness: float
    points: int


def close(
    mechanism: Mechanism,
    *,
    position: FloatArray | None = None,
    rotation: FloatArray | None = None,
    actuators: Mapping[str, float] | None = None,
) -> ClosedMechanism:
    """Return a mechanism with closed loops, followed from the stated configuration.

    Args:
        mechanism: the mechanism.
        position: (3,) origin of the platform frame in the world frame, length; None for a free pose.
        rotation: (3, 3) rotation of the platform frame in the world frame; None for the stated rotation.
        actuators: joint coordinates by name, radians or length from the stated configuration. Other joints move as the
            loops require; without a pose, other actuators stay at rest.

    Raises:
        MechanismError: a name is unknown, or the loops do not close at the requested pose and coordinates.
    """
    motions = Motions(mechanism)
    wanted = dict(actuators or {})
    _check_wanted(mechanism, wanted)
    if position is None and rotation is None:
        wanted = {joint.name: 0.0 for joint in mechanism.joints if joint.actuated} | wanted
    held = {motions.column(name): value / motions.units[motions.column(name)] for name, value in wanted.items()}
    pose = None if position is None and rotation is None else _pose_path(mechanism, position, rotation)
    path = _Path(motions, held, pose)
    at, values = path.closed(motions.stated, 0.0)
    if at is None:
        fault = f"its loops are open by {values[0]:.3g} at the stated configuration"
        raise MechanismError("", f"{fault}, and no closed configuration was found nearby")
    spectra = [values]
    done, step = 0.0, 1.0 if pose is None and not any(held.values()) else _FIRST
    while done < 1.0:
        part = min(1.0, done + step)
        found, values = path.closed(at, part)
        change = np.inf if found is None else float(np.abs(found.values - at.values).max(initial=0.0))
        if change > _LARGE and part - done > _SHORTEST:
            step = (part - done) / 2
            continue
        if found is None:
            after = f"after {100 * done:.0f} % of the motion"
            fault = f"its loops do not close at the requested pose or actuator coordinates: {after}"
            raise MechanismError("", f"{fault} the loops stay open by {values[0]:.3g}")
        at, done, step = found, part, 2 * step
        spectra.append(values)
    return _closed(path, at, _nearness(spectra), len(spectra))


def closed_near(
    mechanism: Mechanism,
    coordinates: Mapping[str, float],
    position: FloatArray,
    rotation: FloatArray,
) -> ClosedMechanism | None:
    """Return a mechanism with loops closed near joint coordinates and a platform pose; None if they do not close.

    The pose is kept if the loops allow this pose; otherwise it changes as little as possible.

    Args:
        mechanism: the mechanism.
        coordinates: known joint coordinates by name, radians or length from the stated configuration.
        position: (3,) origin of the platform frame in the world frame, length.
        rotation: (3, 3) rotation of the platform frame in the world frame.
    """
    motions = Motions(mechanism)
    values = np.zeros(motions.count)
    for name, value in coordinates.items():
        column = motions.column(name)
        values[column] = value / motions.units[column]
    posed = _Path(motions, {}, _pose_path(mechanism, position, rotation))
    near, _, _ = posed.reduced(Coordinates(values, motions.stated.balls), 1.0)
    return closed_nearby(motions, near)


def closed_nearby(motions: Motions, near: Coordinates) -> ClosedMechanism | None:
    """Close the loops near coordinates at which they are open, and return the mechanism; None if they do not close."""
    path = _Path(motions, {}, None)
    at, _ = path.closed(near, 1.0)
    return None if at is None else _closed(path, at, 1.0, 1)


class _Path:
    """Equations along a path of the mechanism: loops, couplings, and the platform's pose.

    Args:
        motions: kinematics of the mechanism.
        held: prescribed scaled coordinates at the end of the path, by column.
        pose: platform pose as a function of the fraction of the path; None for a free pose.
    """

    def __init__(self, motions: Motions, held: Mapping[int, float], pose: _Pose | None) -> None:
        self.motions, self._held, self._pose = motions, dict(held), pose
        self._free = np.array([k for k in range(motions.count) if k not in held], dtype=np.intp)
        couplings = motions.mechanism.couplings
        self._couplings = np.zeros((len(couplings), motions.count))
        for row, coupling in enumerate(couplings):
            for name, factor in coupling.factors:
                column = motions.column(name)
                self._couplings[row, column] = factor * motions.units[column]
            self._couplings[row] /= np.abs(self._couplings[row]).max()

    def equations(self, at: Coordinates, placed: Placed, part: float) -> Equations:
        """Return the equations at a fraction of the path."""
        residual, slopes = self.motions.loops(placed)
        rows, derivatives = [residual, self._couplings @ at.values], [slopes, self._couplings]
        if self._pose is not None:
            own = self.motions.towards(placed, self.motions.mechanism.platform, self._pose.at(part))
            rows.append(own[0])
            derivatives.append(own[1])
        return Equations(np.concatenate(rows), np.vstack(derivatives))

    def closed(self, at: Coordinates, part: float) -> tuple[Coordinates | None, FloatArray]:
        """Return the coordinates near given coordinates at which the loops are closed.

        Returns:
            Coordinates, with the singular values of the derivatives; or None, with the remaining residual.
        """
        values = at.values.copy()
        for column, value in self._held.items():
            values[column] = part * value
        found, residual, slopes = self.reduced(Coordinates(values, at.balls), part)
        if part < 1.0 and self._pose is not None and not _is_closed(residual):
            # A robot with fewer than six degrees of freedom leaves the straight path: then only the loops are closed
            # near it.
            found, residual, slopes = _Path(self.motions, self._held, None).reduced(found, part)
        if not _is_closed(residual):
            return None, np.array([float(np.abs(residual).max())])
        count = 6 * len(self.motions.tree.chords) + len(self._couplings)
        singular = np.linalg.svd(slopes[:count, self._free], compute_uv=False)
        return found, np.asarray(singular, dtype=np.float64)

    def reduced(self, at: Coordinates, part: float) -> tuple[Coordinates, FloatArray, FloatArray]:
        """Return the coordinates of least residual near given coordinates, with the residual and its derivatives."""
        descent = Descent(
            self.motions, lambda there, placed: self.equations(there, placed, part), self._free, _EXACT, stuck=_STUCK
        )
        found = newton(descent, descent.at(at), steps=_STEPS, zeros=[_ZERO], parts=_PARTS)
        return found.at, found.residual, found.slopes


def _is_closed(residual: FloatArray) -> bool:
    """Return True if equations are satisfied."""
    return float(np.abs(residual).max(initial=0.0)) <= CLOSED


@dataclass(frozen=True, eq=False)
class _Pose:
    """Straight path of the platform: displacement (4, 4) from the stated configuration, by the fraction of the path."""

    start: FloatArray
    shift: FloatArray
    turn: FloatArray

    def at(self, part: float) -> FloatArray:
        found = np.eye(4)
        found[:3, :3] = rotation_matrix(part * self.turn)
        found[:3, 3] = self.start + part * self.shift - found[:3, :3] @ self.start
        return found


def _pose_path(mechanism: Mechanism, position: FloatArray | None, rotation: FloatArray | None) -> _Pose:
    """Return the platform path from the stated pose to a requested one."""
    link = mechanism.link(mechanism.platform)
    shift = np.zeros(3) if position is None else np.asarray(position, dtype=np.float64) - link.position
    turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64) @ link.rotation.T
    return _Pose(link.position, shift, rotation_vector(turn))


def _check_wanted(mechanism: Mechanism, wanted: Mapping[str, float]) -> None:
    """Refuse coordinates of unknown joints, and of joints without a coordinate."""
    kinds = {joint.name: joint.kind for joint in mechanism.joints}
    for name in wanted:
        if kinds.get(name) not in ("R", "P", "H"):
            known = ", ".join(joint.name for joint in mechanism.joints if joint.actuated)
            raise MechanismError(f"joint {name}", f"is unknown or has no coordinate; actuated joints are {known}")


def _closed(path: _Path, at: Coordinates, nearness: float, points: int) -> ClosedMechanism:
    """Return a mechanism with closed loops at the end of a path."""
    motions = path.motions
    placed, values = motions.placed(at), at.values * motions.units
    coordinates = {
        joint.name: float(values[motions.columns[k]][0])
        for k, joint in enumerate(motions.mechanism.joints)
        if joint.kind in ("R", "P", "H")
    }
    residual, _ = path.equations(at, placed, 1.0)
    largest = float(np.abs(residual).max(initial=0.0))
    return ClosedMechanism(_placed(motions.mechanism, placed, coordinates), coordinates, largest, nearness, points)


def _placed(mechanism: Mechanism, placed: Placed, coordinates: Mapping[str, float]) -> Mechanism:
    """Return the mechanism stated at the configuration with the given joint coordinates."""

    def link(each: MechanismLink) -> MechanismLink:
        there = placed.displacements[each.name]
        return replace(each, position=moved(there, each.position), rotation=there[:3, :3] @ each.rotation)

    def joint(each: MechanismJoint) -> MechanismJoint:
        # The point of a slide or screw moves with the outer link, on the platform side of limbs.
        there = placed.displacements[each.outer]
        limits = each.range
        if limits is not None:
            limits = limits[0] - coordinates.get(each.name, 0.0), limits[1] - coordinates.get(each.name, 0.0)
        outer = each.point if each.outer_point is None else each.outer_point
        point, axis = moved(there, outer), there[:3, :3] @ each.axis
        return replace(each, point=point, axis=axis, range=limits, outer_point=None)

    return replace(
        mechanism,
        links=tuple(link(each) for each in mechanism.links),
        joints=tuple(joint(each) for each in mechanism.joints),
    )


def _nearness(spectra: list[FloatArray]) -> float:
    """Return the smallest nonzero singular value along a path, relative to its start."""
    if not spectra[0].size:
        return 1.0
    rank = max(int(np.count_nonzero(each > _ZERO * each[0])) for each in spectra)
    if rank == 0:
        return 1.0
    smallest = [float(each[rank - 1]) for each in spectra]
    return min(smallest) / smallest[0] if smallest[0] > _ZERO * spectra[0][0] else 0.0
