"""A robot of links and joints against MuJoCo's constrained Jacobian: F, ranks, null spaces, freedoms and rates."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from builders import Array
from mechanism_robots import Engine, projector
from mujoco_robots import column_space, null_space
from robot_gallery import CHI, LENGTH

from screwsynth.models import Model, Substitution, axis_angle_from_matrix, constraint_rows, robot
from screwsynth.models.mechanism import Mechanism, mechanism_of, wrenches_of
from screwsynth.models.mechanism.singularities import closed_configurations
from screwsynth.nlp import Case, Nlp, Rotation, Task, evaluate, formulate
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.evidence.paths import velocities_at

#: Singular values of regular configurations are above this part of the largest: nearer to a singularity more digits
#: are lost than the comparison allows.
REGULAR = 1e-4


class Differences(NamedTuple):
    """Largest differences over configurations: of F, of rates, of projectors on spaces of twists; and their number."""

    F: float
    rates: float
    spaces: float
    configurations: int


def onto(columns: Array) -> Array:
    """Projector on the span of columns (6, n)."""
    basis = column_space(columns, 1.0) if columns.size else np.zeros((6, 0))
    return np.asarray(basis @ basis.T)


def work(rows: Array) -> Array:
    return np.hstack([rows[:, 3:], rows[:, :3]])


def is_regular(engine: Engine, regular: float) -> bool:
    """Whether no singular value of the engine's constraints, or of the platform in their null space, is near 0."""
    for locked in (False, True):
        rows = engine.rows(locked=locked)
        values = np.linalg.svd(rows, compute_uv=False)
        if np.any((values > 1e-11 * values[0]) & (values < regular * values[0])):
            return False
        motions = null_space(rows)[: engine.model.nv]
        values = np.linalg.svd(engine.motion(engine.mechanism.platform, np.zeros(3)) @ motions, compute_uv=False)
        if np.any((values > 1e-11) & (values < regular)):
            return False
    return True


def coordinate(home: Mechanism, there: Mechanism, name: str) -> float:
    """A hinge's angle or a slide's way from home, from the frames of its links."""
    joint = next(each for each in home.joints if each.name == name)
    moved = []
    for link in (joint.inner, joint.outer):
        one, other = (next(each for each in m.links if each.name == link) for m in (home, there))
        R = other.rotation @ one.rotation.T
        moved.append((R, other.position - R @ one.position))
    (R1, t1), (R2, t2) = moved
    R, t = R1.T @ R2, R1.T @ (t2 - t1)
    if joint.kind == "P":
        return float(joint.axis @ (R @ joint.point + t - joint.point))
    vee = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    return float(np.arctan2(joint.axis @ vee, (np.trace(R) - 1) / 2))


def unknowns_at(model: Model, home: Mechanism, there: Mechanism) -> Array:
    """The model's unknowns at a configuration, from the coordinates of all joints and its loop equations."""
    (plate,) = (each for each in there.links if each.name == there.platform)
    symbols = Substitution.identity(model)
    names = {each.name for each in home.joints if each.kind in ("R", "P", "H")}
    rows, wanted = [each.expression for each in model.closure], [0.0] * len(model.closure)
    for each in model.joints:
        for k, own in enumerate(each.coordinates):
            # The mechanism has the axes of universal and cylindrical joints one by one.
            name = each.name if len(each.coordinates) == 1 else f"{each.name}.{k + 1}"
            if name in names and own.cosine is None:
                rows.append(own.value)
                wanted.append(coordinate(home, there, name))
    residual = ca.vertcat(SX0, *rows) - ca.DM(wanted)
    outputs = [ca.densify(each) for each in (residual, ca.jacobian(residual, symbols.unknowns))]
    function = ca.Function("at", symbols.all, outputs)
    found = np.zeros(len(model.unknowns))
    for _ in range(100):
        values, slopes = (each.full() for each in function([], found, plate.rotation, plate.position))
        if np.abs(values).max(initial=0.0) < 1e-14:
            break
        step = np.linalg.lstsq(slopes, values.ravel(), rcond=1e-9)[0]
        found = found - step * min(1.0, 0.2 / float(np.abs(step).max()))
    assert np.abs(values).max(initial=0.0) < 1e-10
    return found


SX0 = ca.SX(0, 1)


def program_at(model: Model, home: Mechanism, there: Mechanism) -> tuple[Nlp, Array]:
    """A program at a configuration, and the point of it, for the twist ``CHI``."""
    (plate,) = (each for each in there.links if each.name == there.platform)
    axis, angle = axis_angle_from_matrix(plate.rotation)
    case = Case(model, {}, plate.position, [Task(CHI)], Rotation(axis, angle), characteristic_length=LENGTH)
    return formulate(case), unknowns_at(model, home, there)


def with_twist(nlp: Nlp, twist: Array) -> Nlp:
    arguments = np.array(nlp.arguments)
    arguments[nlp.program.places.twists[0]] = twist
    return replace(nlp, arguments=arguments)


def objective(mechanism: Mechanism, centres: dict[tuple[str, ...], Array], chi: Array) -> float:
    """F: of each part that is left of the locked mechanism, the engine's twists give the projector.

    The centres of members, by the names of their joints, are a convention that the engine does not know.
    """
    names = {each.name for each in mechanism.joints if each.kind == "weld" or each.actuated}
    while True:  # a coupling all of whose joints but one stand still holds that one
        left = [{name for name, _ in each.factors} - names for each in mechanism.couplings]
        held = {name for each in left if len(each) == 1 for name in each}
        if not held:
            break
        names |= held
    still = {each.name for each in mechanism.joints if each.kind == "weld"}
    if not are_joined(mechanism, names):
        still = names
    # Where locked actuators alone join base and platform, each limb is one member.
    body = {link: number for number, links in enumerate(bodies_of(mechanism, still)) for link in links}
    ends = {body[mechanism.base], body[mechanism.platform]}
    moving = [each for each in mechanism.joints if each.name not in still and body[each.inner] != body[each.outer]]
    groups = [{each.name} for each in moving]
    for number in set(body.values()) - ends:
        groups = joined(groups, [{each.name for each in moving if number in (body[each.inner], body[each.outer])}])
    groups = joined(groups, [{name for name, _ in each.factors} - still for each in mechanism.couplings])
    members = []
    for group in groups:
        touched = {body[link] for each in mechanism.joints if each.name in group for link in (each.inner, each.outer)}
        if ends <= touched:
            members.append([each.name for each in mechanism.joints if each.name in group])
    total = 0.0
    assert len(members) == len(centres)
    for own in members:
        (centre,) = (centre for names, centre in centres.items() if set(names) <= set(own))
        kept = still | set(own)
        joints = tuple(each for each in mechanism.joints if each.name in kept)
        couplings = tuple(each for each in mechanism.couplings if {name for name, _ in each.factors} <= kept)
        used = {mechanism.base, mechanism.platform, *(link for each in joints for link in (each.inner, each.outer))}
        links = tuple(each for each in mechanism.links if each.name in used)
        engine = Engine(replace(mechanism, links=links, joints=joints, couplings=couplings))
        P = projector(engine.platform_twists(locked=True), centre, LENGTH)
        total += float(np.sum((P @ np.concatenate([chi[3:] + np.cross(chi[:3], centre), LENGTH * chi[:3]])) ** 2))
    return total


def bodies_of(mechanism: Mechanism, names: set[str]) -> list[set[str]]:
    """Links in sets that joints of these names join."""
    ends = [{each.inner, each.outer} for each in mechanism.joints if each.name in names]
    return joined([{each.name} for each in mechanism.links], ends)


def are_joined(mechanism: Mechanism, names: set[str]) -> bool:
    """Whether joints of these names alone join base and platform."""
    return any({mechanism.base, mechanism.platform} <= each for each in bodies_of(mechanism, names))


def joined(sets: list[set[str]], more: list[set[str]]) -> list[set[str]]:
    """Sets, those that others overlap made one."""
    for each in more:
        touched = [other for other in sets if other & each]
        sets = [other for other in sets if not other & each]
        sets += [set().union(*touched)] if touched else []
    return sets


def compare(tables: dict[str, Any], driven: int = 3, regular: float = REGULAR) -> Differences:
    """Compare a robot's model, and its numbers as a mechanism, with the engine at home and at random configurations."""
    model, home = robot(**tables), mechanism_of(tables)
    worst, count = np.zeros(3), 0
    for there in (home, *closed_configurations(home, count=driven)):
        engine = Engine(there)
        if not is_regular(engine, regular):
            continue
        count += 1
        free, locked = (engine.platform_twists(locked=each) for each in (False, True))
        chi = free @ (free.T @ CHI) if free.shape[1] else CHI
        nlp, x = program_at(model, home, there)
        of_F = nlp.evaluate(x)[0]
        nlp = with_twist(nlp, chi)
        state = evaluate(nlp, x)
        mobility = mobility_of(nlp, x, state)
        velocities = velocities_at(nlp, x, nlp.program.kernels.robot_state(x, nlp.arguments))
        constraints = constraint_rows(model, velocities, state.position)
        assert mobility.freedoms == free.shape[1], (mobility.freedoms, free.shape[1])
        assert state.rank == 6 - locked.shape[1], (state.rank, locked.shape[1])
        spaces = [np.eye(6) - onto(work(constraints).T) - onto(free), onto(state.free_twists.T) - onto(locked)]
        numbers = wrenches_of(there, LENGTH)
        assert (numbers.ranks.freedoms, numbers.ranks.locked) == (free.shape[1], locked.shape[1])
        centres = {each.joints or each.actuators: each.centre for each in numbers.members}
        F = objective(there, centres, CHI)
        of_F = abs(of_F - F) / max(1.0, abs(F))
        worst = np.maximum(worst, [of_F, 0.0, max(np.abs(each).max(initial=0.0) for each in spaces)])
        assert (mobility.constrained == 0.0) == bool(free.shape[1])
        if not free.shape[1]:
            continue
        expected = engine.rates(chi)
        names = [each.name for each in there.joints if each.actuated]
        found = np.array(list(mobility.actuator_rates.values()))
        expected = expected[[names.index(each.name) for each in model.joints if each.name in names]]
        assert np.array_equal(np.isfinite(found), np.isfinite(expected)), (found, expected)
        known = np.isfinite(expected)
        # The numbers of the mechanism, which import goes by, are those of the model.
        by_name = numbers.rates(chi)
        again = np.array([by_name[each.name] for each in model.joints if each.name in names])
        assert np.array_equal(np.isfinite(again), known)
        size = max(1.0, np.abs(expected[known]).max(initial=0.0))
        off = [np.abs(each - expected)[known].max(initial=0.0) / size for each in (found, again)]
        worst[1] = max(worst[1], *off)
    return Differences(*map(float, worst), count)
