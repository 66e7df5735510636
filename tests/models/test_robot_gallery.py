"""Every robot file of the gallery, in MuJoCo and in the package: dimensions, ranks, F, rates, wrenches and places."""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from builders import turn_about
from mujoco_robots import Oracle, Ranks, scaled_twists
from robot_files import every_joint, robot_of
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


#: Values of an earlier, separate computation, printed with ten and six decimals: dimensions where they are not those of
#: the file, F(CHI), F of the feasible part of CHI, its actuator rates, and F(CHI) with every actuator driven by 0.05.
DELTA = {"rb": 0.4, "rp": 0.12, "arm": 0.45, "tilt": math.degrees(0.4)}
DELTA["rod"] = math.hypot(0.28 + 0.45 * math.cos(0.4), 0.85 - 0.45 * math.sin(0.4))
UPS = {"rb": 1, "rp": 0.6, "base_half": math.degrees(0.35), "platform_half": math.degrees(0.75), "h": 1.2}
UPS_RATES = [-0.156067, -0.207255, -0.566661, 0.345771, -0.390167, -0.131767]
DELTA_RATES = [-0.355875, -0.216789, 1.581346]
CHI = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
REFERENCE: dict[str, tuple[dict[str, float], float, float, list[float], float]] = {
    "6-ups": (UPS, 0.6775666447, 0.6775666447, UPS_RATES, 0.6896774965),
    "3-rps": ({}, 0.9536868613, 0.2822638991, [0.051880, -0.095752, -0.520004], 0.9659029686),
    "3-upu": ({}, 0.7811721401, 0.2159301561, [-0.337393, -0.306747, 0.089456], 0.7929893869),
    "tricept": (
        *({"turn": math.degrees(0.3)}, 0.9213889813, 0.3712266112),
        *([0.230770, -0.301242, -0.476681], 0.9286716318),
    ),
    "delta": (DELTA | {"w": 0.1}, 2.5478782427, 0.9190027654, DELTA_RATES, 2.5578274323),
    "delta-parallelogram": (DELTA, 2.2416295709, 0.4595013827, DELTA_RATES, 2.2466369256),
    "planar-3-rrr": (
        *({"turn": math.degrees(0.2)}, 1.5138660321, 0.8315910321),
        *([-1.653630, 0.169939, 0.704750], 1.5472838594),
    ),
    "spherical-3-rrr": ({}, 2.0867, 0.4067, [0.3, -0.5, 0.7], 2.1008863285),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_reference_numbers_at_home_and_driven_away_from_it(name: str) -> None:
    dimensions, F, F_feasible, rates, F_driven = REFERENCE[name]
    oracle = Oracle(robot_of(table(name), dimensions), LENGTH)
    feasible = oracle.feasible(CHI)
    found = [oracle.objective(CHI), oracle.objective(feasible)]
    np.testing.assert_allclose(oracle.rates(feasible), rates, rtol=0, atol=6e-7)
    oracle.drive([0.05] * oracle.robot.actuators)
    np.testing.assert_allclose([*found, oracle.objective(CHI)], [F, F_feasible, F_driven], rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", ["delta", "delta-parallelogram"])
def test_motor_angles_of_the_irb_360_are_the_published_ones(name: str) -> None:
    # R. L. Williams II, "The Delta Parallel Robot", prints tenths of a degree; the digits beyond are those of closed
    # loops. His first motor stands at azimuth -90 degrees, so everything is turned.
    sides = {"rb": 0.567 / math.sqrt(12), "rp": 0.076 / math.sqrt(3), "tilt": 0.0}
    turn = turn_about([0, 0, 1], math.pi / 2)
    for degrees, position in (([-20.547] * 3, [0, 0, -0.9]), ([47.504, -11.569, 21.378], [0.3, 0.5, -1.1])):
        oracle = Oracle(robot_of(table(name), sides), LENGTH)
        oracle.drive(np.deg2rad(degrees))
        # A motor's thousandth of a degree moves a platform by about 1e-5 of an arm.
        np.testing.assert_allclose(oracle.position, turn @ position, rtol=0, atol=3e-5)
        np.testing.assert_allclose(oracle.rotation, np.eye(3), rtol=0, atol=1e-12)


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
