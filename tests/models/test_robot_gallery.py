"""Every robot file of the gallery, in MuJoCo and in the package: dimensions, ranks, F, rates, wrenches and places."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from mujoco_robots import Oracle, scaled_twists
from robot_files import every_joint, robot_of
from robot_gallery import (
    FILES,
    GALLERY,
    LENGTH,
    RANKS,
    Array,
    random_dimensions,
    random_displacements,
    random_twist,
    size_of,
    table,
)

from screwsynth.models import Dimension, robot
from screwsynth.nlp import Case, Free, RobotState, Rotation, Task, evaluate, formulate
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import Mobility, mobility_of

#: Lengths of links by the name of the dimension that states them: the joints between which, in the first limb.
LINKS: dict[str, dict[str, tuple[int, int]]] = {
    "3-puu": {"rod": (1, 2)},
    "3-rrs": {"crank": (0, 1)},
    "4-ruu": {"crank": (0, 1)},
    "6-rss": {"horn": (0, 1), "rod": (1, 2)},
    "6-rus": {"crank": (0, 1)},
    "delta": {"rod": (1, 2)},
    "delta-parallelogram": {"arm": (0, 1), "rod": (1, 3)},
    "five-bar": {"arm": (0, 1)},
    "orthoglide": {"rod": (1, 3)},
}

KEYS = {
    "robot": {"name", "description", "length_unit", "home", "dimensions", "derived", "limb"},
    "dimension": {"typical", "kind", "description"},
    "limb": {"repeat", "points", "joints", "branch", "centre"},
    "repeat": {"count", "angles", "axis", "through"},
    "joint": {"type", "at", "axis", "axes", "to", "pitch", "actuated"},
}


@cache
def configurations(name: str) -> list[Oracle]:
    """The robot at home, driven, and driven with other dimensions; shared by tests, which drive no further."""
    rng = np.random.default_rng([2026, *name.encode()])
    robot = robot_of(table(name))
    other = robot_of(table(name), random_dimensions(name, rng))
    found = [Oracle(robot, LENGTH), Oracle(robot, LENGTH), Oracle(other, LENGTH)]
    for oracle in found[1:]:
        oracle.drive(random_displacements(oracle.robot, rng))
    return found


def test_every_file_of_the_gallery_is_in_the_table() -> None:
    assert set(FILES) == set(RANKS)


@pytest.mark.parametrize("name", GALLERY)
def test_a_file_says_what_it_is_and_has_the_keys_of_a_robot_file_only(name: str) -> None:
    lines = FILES[name].read_text(encoding="utf-8").splitlines()
    heading = lines[: next(k for k, text in enumerate(lines) if not text.startswith("#"))]
    assert heading[0].startswith("# ")
    assert any(text.startswith("# Source: ") for text in heading[1:])
    assert max(map(len, lines)) <= 120
    robot = table(name)
    joints = [joint for limb in robot["limb"] for joint in limb["joints"]]
    joints += [joint for limb in robot["limb"] for branch in limb.get("branch", []) for joint in branch["joints"]]
    for kind, tables in {
        "robot": [robot],
        "dimension": robot["dimensions"].values(),
        "limb": robot["limb"],
        "repeat": [limb["repeat"] for limb in robot["limb"] if "repeat" in limb],
        "joint": joints,
    }.items():
        assert set().union(*tables) <= KEYS[kind]
    assert all(entry["description"] for entry in robot["dimensions"].values())


@pytest.mark.parametrize("name", GALLERY)
def test_links_at_home_have_the_lengths_that_the_file_states(name: str) -> None:
    robot = robot_of(table(name))
    for limb in robot.limbs:
        for joint in every_joint(limb):
            if joint.kind == "U":
                assert abs(joint.axes[0] @ joint.axes[1]) < 1e-15
    joints = every_joint(robot.limbs[0])
    for dimension, (first, second) in LINKS.get(name, {}).items():
        stated = table(name)["dimensions"][dimension]["typical"]
        assert np.linalg.norm(joints[second].point - joints[first].point) == pytest.approx(stated, rel=4e-15, abs=0)


@pytest.mark.parametrize("name", FILES)
def test_dimensions_and_ranks_at_home_and_away_from_it_and_for_other_dimensions(name: str) -> None:
    for oracle in configurations(name):
        assert oracle.closure < oracle.tolerance
        assert oracle.ranks() == RANKS[name]


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

    def at(
        self, dimensions: dict[str, float], pose: tuple[Array, Array], twist: Array
    ) -> tuple[RobotState, Mobility, float]:
        """State, mobility and largest residual of a loop, with unknowns from home, closed at the pose.

        ``dimensions`` have degrees for angles, ``twist`` is the task.
        """
        places = self.nlp.program.places
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
        state = evaluate(nlp, closed)
        mobility = mobility_of(nlp, closed, state)
        assert mobility is not None
        return state, mobility, float(np.abs(numbers.loops).max(initial=0.0))


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
            state, mobility, closure = library.at(values, pose, twist)
            # F in parts of its size without cancellation: the feasible part of a twist may move no actuator.
            size = sum(float(np.abs(twist) @ np.abs(form) @ np.abs(twist)) for form in limb_forms(oracle))
            assert pytest.approx(oracle.objective(twist), rel=1e-9, abs=1e-12 * size) == state.F
        assert closure < 1e-12
        assert mobility.constrained < 1e-9
        assert not mobility.singularities
        assert (state.rank, mobility.constraint_rank, mobility.freedoms) == (ranks.J, ranks.constraints, ranks.freedoms)
        rates = list(mobility.actuator_rates.values())
        np.testing.assert_allclose(rates, oracle.rates(feasible), rtol=1e-8, atol=1e-8)
        limbs = np.array([row.limb for row in library.nlp.program.model.rows])
        wrenches = state.jacobian[:, [3, 4, 5, 0, 1, 2]]
        by_limb = [wrenches[limbs == str(k + 1)] for k in range(len(oracle.robot.limbs))]
        for rows, form in zip(by_limb, limb_forms(oracle), strict=True):
            np.testing.assert_allclose(rows.T @ rows, form, rtol=0, atol=1e-9 * max(1.0, np.abs(form).max()))
        assert sum(map(len, by_limb)) == sum(ranks.W)
