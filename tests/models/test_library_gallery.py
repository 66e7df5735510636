"""Every robot file of the gallery in the package equals MuJoCo: F, ranks, rates and wrenches."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from mujoco_robots import Oracle, scaled_twists
from robot_files import robot_of
from robot_gallery import FILES, LENGTH, Array, random_dimensions, random_displacements, random_twist, size_of, table

from screwsynth.models import Dimension, robot
from screwsynth.nlp import Case, Free, Rotation, Task, evaluate, formulate
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import mobility_of


@dataclass(frozen=True)
class LibraryValues:
    """Values of the package for one robot at one pose.

    Attributes:
        F: objective.
        wrenches: rows (d, 6) of each limb, force then moment about the world origin, couples times the length.
        rank: of the Jacobian.
        constraints: rank of all constraints together.
        freedoms: of the platform with free actuators.
        rates: (actuators,) in the order of the file.
        closure: largest residual of a loop equation, of order 1.
        singularities: kinds of those that were found.
        constrained: part of F that constraints carry.
    """

    F: float
    wrenches: list[Array]
    rank: int
    constraints: int
    freedoms: int
    rates: Array
    closure: float
    singularities: list[str]
    constrained: float


class Library:
    """A robot file in the package: a program in which all dimensions, the pose and the internal unknowns are free."""

    def __init__(self, name: str) -> None:
        model = robot(**table(name))
        self.dimensions = list(model.parameters)
        reach = size_of(robot_of(table(name)))
        case = Case(
            model,
            {item.name: Free(item.typical[0] - 1.0, item.typical[0] + 1.0) for item in model.parameters},
            [Free(value - reach, value + reach) for value in model.home],
            [Task(np.ones(6))],
            Rotation(None, Free(-2.0, 2.0)),
            characteristic_length=LENGTH,
        )
        self.nlp = formulate(case)
        self.limbs = range(len(robot_of(table(name)).limbs))

    def at(self, dimensions: dict[str, float], pose: tuple[Array, Array], twist: Array) -> LibraryValues:
        """Values with these dimensions (degrees for angles), pose and task; unknowns from home, closed at the pose."""
        model, places = self.nlp.program.model, self.nlp.program.places
        arguments = np.array(self.nlp.arguments)
        arguments[places.twists[0]] = twist
        nlp = replace(self.nlp, arguments=arguments)
        x = np.array(nlp.start)
        for k, item in enumerate(self.dimensions):
            value = dimensions[item.name]
            x[k] = np.deg2rad(value) if item.dimension is Dimension.ANGLE else value
        count, (free,) = len(self.dimensions), places.rotations
        R, p = pose
        half = np.sqrt(1 + np.trace(R)) / 2
        x[count : count + 3] = p
        x[list(free.q)] = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * half)
        closed = close_equations(nlp, x)
        np.testing.assert_array_equal(closed[: count + 6], x[: count + 6])  # the unknowns alone close the loops
        numbers = nlp.program.kernels.robot_state(closed, nlp.arguments)
        state, mobility = evaluate(nlp, closed), mobility_of(nlp, closed, evaluate(nlp, closed))
        names = [str(k + 1) for k in self.limbs]
        wrenches = [state.jacobian[[row.limb == name for row in model.rows]] for name in names]
        assert mobility is not None
        return LibraryValues(
            F=state.F,
            wrenches=wrenches,
            rank=state.rank,
            constraints=mobility.constraint_rank,
            freedoms=mobility.freedoms,
            rates=np.array(list(mobility.actuator_rates.values())),
            closure=float(np.abs(numbers.loops).max(initial=0.0)),
            singularities=[each.kind.name for each in mobility.singularities],
            constrained=mobility.constrained,
        )


def limb_forms(oracle: Oracle) -> list[Array]:
    """Symmetric matrix (6, 6) of each limb's part of F, by twists ``(omega, v)``, from its members' projectors."""
    members = iter(oracle.members())
    forms = []
    for limb in oracle.robot.limbs:
        own = [next(members) for _ in limb.branches]
        to_scaled = [scaled_twists(member.centre, LENGTH) for member in own]
        forms.append(sum(S.T @ member.projector @ S for member, S in zip(own, to_scaled, strict=True)))
    return forms


@pytest.mark.parametrize("name", FILES)
def test_library_equals_mujoco(name: str) -> None:
    rng = np.random.default_rng(8)
    library = Library(name)
    for dimensions, is_driven in (({}, False), (random_dimensions(name, rng), True)):
        oracle = Oracle(robot_of(table(name), dimensions), LENGTH)
        values = {key: entry["typical"] for key, entry in table(name)["dimensions"].items()} | dimensions
        if is_driven:
            oracle.drive(random_displacements(oracle.robot, rng))
        ranks, pose = oracle.ranks(), (oracle.rotation, oracle.position)
        general = random_twist(oracle.robot, rng)
        feasible = oracle.feasible(general)
        for twist in (general, feasible):
            found = library.at(values, pose, twist)
            # F in parts of its size without cancellation: the feasible part of a twist may move no actuator.
            size = sum(float(np.abs(twist) @ np.abs(form) @ np.abs(twist)) for form in limb_forms(oracle))
            assert pytest.approx(oracle.objective(twist), rel=1e-9, abs=1e-12 * size) == found.F
        assert found.closure < 1e-12
        assert found.constrained < 1e-9
        assert not found.singularities
        assert (found.rank, found.constraints, found.freedoms) == (ranks.J, ranks.constraints, ranks.freedoms)
        np.testing.assert_allclose(found.rates, oracle.rates(feasible), rtol=1e-8, atol=1e-8)
        turned = [rows[:, [3, 4, 5, 0, 1, 2]] for rows in found.wrenches]
        for rows, form in zip(turned, limb_forms(oracle), strict=True):
            np.testing.assert_allclose(rows.T @ rows, form, rtol=0, atol=1e-9 * max(1.0, np.abs(form).max()))
        assert sum(map(len, turned)) == sum(ranks.W)
