"""Every robot file of the gallery, in MuJoCo and in the package: dimensions, ranks, F, rates, wrenches and places."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from mujoco_robots import Oracle, Ranks, scaled_twists
from robot_files import every_joint, robot_of, rotation
from robot_gallery import (
    FILES,
    GALLERY,
    LENGTH,
    Array,
    random_dimensions,
    random_displacements,
    random_twist,
    size_of,
    table,
)

from screwsynth.models import Dimension, robot
from screwsynth.nlp import Case, Free, Rotation, Task, evaluate, formulate
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import mobility_of

# dim W_k, dim C_k, rank of J, rank of the constraints, freedoms, rotations among them, freedoms with actuators locked,
# freedoms of the whole mechanism (spins of rods too).
RANKS: dict[str, Ranks] = {
    "3-prs": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-puu": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 0, 0, 3),
    "3-rps": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-rrs": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-spr": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-upu": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 0, 0, 3),
    "4-ruu": Ranks((2,) * 4, (1,) * 4, 6, 2, 4, 1, 0, 4),
    "4-upu": Ranks((2,) * 4, (1,) * 4, 6, 2, 4, 1, 0, 4),
    "6-pus": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "6-rss": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 12),
    "6-rus": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "6-sps": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 12),
    "6-ups": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "delta": Ranks((1,) * 6, (0,) * 6, 6, 3, 3, 0, 0, 9),
    "delta-parallelogram": Ranks((3,) * 3, (2,) * 3, 6, 3, 3, 0, 0, 3),
    "exechon": Ranks((3, 3, 2), (2, 2, 1), 6, 3, 3, 2, 0, 3),
    "five-bar": Ranks((5, 4), (4, 3), 6, 4, 2, 1, 0, 2),
    "orthoglide": Ranks((3,) * 3, (2,) * 3, 6, 3, 3, 0, 0, 3),
    "planar-3-prr": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 1, 0, 3),
    "planar-3-rpr": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 1, 0, 3),
    "planar-3-rrr": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 1, 0, 3),
    "spherical-3-rrr": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 3, 0, 3),
    "tricept": Ranks((1, 1, 1, 3), (0, 0, 0, 3), 6, 3, 3, 2, 0, 3),
    "tripteron": Ranks((3,) * 3, (2,) * 3, 6, 3, 3, 0, 0, 3),
    "3-hps": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 3, 0, 3),
    "3-pprs": Ranks((2,) * 3, (0,) * 3, 6, 0, 6, 3, 0, 6),
    "3-rprrr": Ranks((2,) * 3, (1,) * 3, 6, 3, 3, 2, 0, 3),
    "3-rps-ups": Ranks((2, 2, 2, 0), (1, 1, 1, 0), 6, 3, 3, 2, 0, 3),
    "6-cps": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "6-hus": Ranks((1,) * 6, (0,) * 6, 6, 0, 6, 3, 0, 6),
    "planar-centre": Ranks((4,) * 3, (3,) * 3, 6, 3, 3, 1, 0, 3),
    "planar-loose": Ranks((4, 4, 4, 3), (3, 3, 3, 3), 6, 3, 3, 1, 0, 5),
}

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


def displacement(rng: np.random.Generator) -> tuple[Array, Array]:
    return rotation(rng.normal(size=3), rng.uniform(0.5, 2.5)), rng.uniform(-1, 1, 3)


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


@pytest.mark.parametrize("name", FILES)
def test_two_ways_to_the_objective_agree(name: str) -> None:
    rng = np.random.default_rng(5)
    for oracle in configurations(name):
        for twist in (random_twist(oracle.robot, rng), oracle.feasible(random_twist(oracle.robot, rng))):
            assert oracle.objective(twist) == pytest.approx(oracle.objective_by_least_squares(twist), rel=1e-12)


@pytest.mark.parametrize("name", FILES)
def test_a_robot_somewhere_else_in_the_world_is_the_same_robot(name: str) -> None:
    rng = np.random.default_rng(6)
    here = Oracle(robot_of(table(name)), LENGTH)
    R, t = displacement(rng)
    there = Oracle(here.robot.moved(R, t * size_of(here.robot)), LENGTH)
    steps = random_displacements(here.robot, rng)
    here.drive(steps)
    there.drive(steps)
    assert here.ranks() == there.ranks()
    for twist in (random_twist(here.robot, rng), here.feasible(random_twist(here.robot, rng))):
        w = R @ twist[:3]
        moved = np.concatenate([w, R @ twist[3:] + np.cross(t * size_of(here.robot), w)])
        np.testing.assert_allclose(
            there.member_objectives(moved), here.member_objectives(twist), rtol=0, atol=1e-12 * here.objective(twist)
        )
    # The last twist is feasible. Cranks of 0.05 turn fast: rates are up to 60 times the platform's velocity.
    np.testing.assert_allclose(there.rates(moved), here.rates(twist), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("name", FILES)
def test_rates_move_the_platform_along_the_twist(name: str) -> None:
    rng = np.random.default_rng(7)
    oracle = Oracle(robot_of(table(name)), LENGTH)
    oracle.drive(random_displacements(oracle.robot, rng))
    twist = oracle.feasible(random_twist(oracle.robot, rng))
    rates = oracle.rates(twist)
    R, p, step = oracle.rotation, oracle.position, 1e-5
    oracle.drive(step * rates)
    forward, ahead = oracle.rotation, oracle.position
    oracle.drive(-2 * step * rates)
    S = (forward - oracle.rotation) @ R.T / (2 * step)
    w, v = np.array([S[2, 1], S[0, 2], S[1, 0]]), (ahead - oracle.position) / (2 * step)
    # Central differences: an error of step^2 times third derivatives, and rounding errors of 1e-15 over the step.
    np.testing.assert_allclose([*w, *(v - np.cross(w, p))], twist, rtol=0, atol=2e-8 * np.linalg.norm(twist))


def test_equal_robots_written_in_different_ways() -> None:
    rng = np.random.default_rng(9)
    names = ("3-rps", "3-rprrr", "3-rps-ups", "6-pus", "6-hus", "planar-3-rpr", "planar-centre")
    half = {"base_half": np.rad2deg(0.35), "platform_half": np.rad2deg(0.75)}
    robots = {name: Oracle(robot_of(table(name), half if name == "6-pus" else {}), LENGTH) for name in names}
    for _ in range(3):
        chi = rng.normal(size=6)
        F = {name: robot.objective(chi) for name, robot in robots.items()}
        np.testing.assert_allclose([F["3-rprrr"], F["3-rps-ups"]], F["3-rps"], rtol=1e-13)
        # A screw of 0.4 a radian lifts its nut as a slide does.
        assert F["6-hus"] == pytest.approx(F["6-pus"], rel=1e-13)
        np.testing.assert_allclose(0.4 * robots["6-hus"].rates(chi), robots["6-pus"].rates(chi), rtol=0, atol=1e-12)
        # The centre matters for what the robot cannot do, and not for what it can.
        assert abs(F["planar-centre"] - F["planar-3-rpr"]) > 1e-3
        planar = robots["planar-centre"].feasible(chi)
        assert robots["planar-centre"].objective(planar) == pytest.approx(
            robots["planar-3-rpr"].objective(planar), rel=1e-13
        )


# --- the package against all this


# Every robot file of the gallery in the package equals MuJoCo: F, ranks, rates and wrenches.


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
