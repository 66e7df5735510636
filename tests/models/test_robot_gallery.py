"""Every robot file of the gallery: dimensions, ranks, F, rates and wrenches as MuJoCo has them, and its drawing."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import robot_gallery
from builders import Array, soaked
from mujoco_robots import Oracle, scaled_twists
from robot_files import every_joint, robot_of
from robot_gallery import FILES, GALLERY, LENGTH, RANKS, model_of, random_displacements, table
from robot_mjcf import elementary

from screwsynth.models import Body, Dimension, JointKind, LinkKind
from screwsynth.nlp import Case, Free, RobotState, Rotation, Task, evaluate, formulate, result_of, solve
from screwsynth.nlp.evidence.kkt import close_equations
from screwsynth.nlp.evidence.mobility import Mobility, mobility_of
from screwsynth.nlp.output.pictures.drawing import Drawing, drawing_of_model
from screwsynth.nlp.output.pictures.figures import figure_of
from screwsynth.nlp.output.pictures.posture import Posture
from screwsynth.nlp.output.report.report import report_of

#: Lengths of links by the name of the dimension that states them: the joints between which, in the first limb.
LINKS: dict[str, dict[str, tuple[int, int]]] = {
    "3-puu": {"rod": (1, 2)}, "3-rrs": {"crank": (0, 1)}, "4-ruu": {"crank": (0, 1)},
    "6-rss": {"horn": (0, 1), "rod": (1, 2)}, "6-rus": {"crank": (0, 1)}, "delta": {"rod": (1, 2)},
    "delta-parallelogram": {"arm": (0, 1), "rod": (1, 3)}, "five-bar": {"arm": (0, 1)}, "orthoglide": {"rod": (1, 3)},
    "ankle": {"crank": (0, 1)}, "five-bar-pen": {"arm": (0, 1)}, "five-bar-plotter": {"arm": (0, 1), "forearm": (1, 2)},
    "linear-delta": {"arm_length": (1, 2)}, "rotary-delta": {"lower_arm_length": (1, 2)},
    "servo-hexapod": {"horn": (0, 1), "rod": (1, 2)},
}  # fmt: skip

KEYS = {
    "robot": {"name", "description", "length_unit", "home", "dimensions", "derived", "limb"},
    "dimension": {"typical", "kind", "description"},
    "limb": {"repeat", "points", "joints", "branch", "centre"},
    "repeat": {"count", "angles", "axis", "through"},
    "joint": {"name", "type", "at", "axis", "axes", "to", "pitch", "actuated"},
}


@cache
def configurations(name: str) -> list[Oracle]:
    """The robot at home, driven, and driven with other dimensions; shared by tests, which drive no further."""
    rng = np.random.default_rng([2026, *name.encode()])
    robot = robot_of(table(name))
    other = robot_of(table(name), robot_gallery.random_dimensions(name, rng))
    found = [Oracle(robot, LENGTH), Oracle(robot, LENGTH), Oracle(other, LENGTH)]
    for oracle in found[1:]:
        oracle.drive(random_displacements(oracle.robot, rng))
    return found


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
    repeats = [limb["repeat"] for limb in robot["limb"] if "repeat" in limb]
    every = {"robot": [robot], "dimension": robot["dimensions"].values(), "limb": robot["limb"]}
    for kind, tables in (every | {"repeat": repeats, "joint": joints}).items():
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
    assert set(FILES) == set(RANKS)
    for oracle in configurations(name):
        assert oracle.closure < oracle.tolerance
        assert oracle.ranks() == RANKS[name]


class Library:
    """A robot file in the package: a program in which all dimensions, the pose and the internal unknowns are free."""

    def __init__(self, name: str) -> None:
        model = model_of(name)
        self.dimensions = list(model.parameters)
        reach = robot_gallery.size_of(robot_of(table(name)))
        typical = [(item.name, item.typical[0]) for item in model.parameters]
        parameters = {name: Free(value - 1.0 - abs(value), value + 1.0 + abs(value)) for name, value in typical}
        place, turn = [Free(value - reach, value + reach) for value in model.home], Rotation(None, Free(-2.0, 2.0))
        self.nlp = formulate(Case(model, parameters, place, [Task(np.ones(6))], turn, characteristic_length=LENGTH))

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
    for dimensions, is_driven in (({}, False), (robot_gallery.random_dimensions(name, rng), True)):
        oracle = Oracle(robot_of(table(name), dimensions), LENGTH)
        values = {key: entry["typical"] for key, entry in table(name)["dimensions"].items()} | dimensions
        if is_driven:
            oracle.drive(random_displacements(oracle.robot, rng))
        ranks, pose = oracle.ranks(), (oracle.rotation, oracle.position)
        general = robot_gallery.random_twist(oracle.robot, rng)
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


#: Robots with every kind of limb; the others are slow tests.
QUICK = "3-rps 3-upu 6-rus delta delta-parallelogram exechon spherical-3-rrr tricept tripteron"
ROBOTS = soaked(GALLERY, QUICK.split())


#: Limbs of one joint between base and platform, which have no link.
JOINTS_ALONE = {"ankle": {"3"}}

#: Bodies whose joints are on one line.
ON_A_LINE = {"five-bar-plotter": {Body.BASE, Body.PLATFORM}, "pentapod": {Body.PLATFORM}}


def drawn_limbs(shown: Drawing) -> set[str]:
    """The names of the limbs that have a link, but for rails."""
    return {link.limb for *_, link in shown.links if link.kind is not LinkKind.RAIL and link.limb is not None}


@cache
def drawing(name: str) -> Drawing:
    return drawing_of_model(model_of(name))


def twist_to(rotation: Array, translation: Array) -> Array:
    """The twist (6,) whose motion for a unit of time is a displacement: its logarithm, for angles below pi."""
    w = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine = float(np.linalg.norm(w)) / 2
    angle = np.arctan2(sine, (np.trace(rotation) - 1) / 2)
    w = w / (2 * sine) * angle if sine > 1e-12 else np.zeros(3)
    K = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    V = np.eye(3)
    if angle > 1e-12:
        V = V + (1 - np.cos(angle)) / angle**2 * K + (angle - np.sin(angle)) / angle**3 * K @ K
    return np.concatenate([w, np.linalg.solve(V, translation)])


def posture_at(name: str, oracle: Oracle) -> Posture:
    """The drawing with the platform where the engine has it; loops are closed from home."""
    shown = drawing(name)
    R = oracle.rotation
    if np.array_equal(R, np.eye(3)) and np.array_equal(oracle.position, shown.posture.position):
        return shown.posture
    found = shown.linkage.posture_after(shown.posture, twist_to(R, oracle.position - R @ shown.posture.position), 1.0)
    assert found is not None
    return found


def engine_joints(name: str, oracle: Oracle) -> dict[str, tuple[str, list[Array], list[Array]]]:
    """Kind, places and axes of every joint by its name in the drawing, from the engine."""
    found: dict[str, tuple[str, list[Array], list[Array]]] = {}
    number = 0
    home = drawing(name).posture.position
    for k, limb in enumerate(oracle.robot.limbs):
        several = len(limb.branches) > 1
        for b, branch in enumerate(limb.branches):
            chain = [*limb.stem, *branch]
            for j, joint in enumerate(chain):
                in_stem = several and j < len(limb.stem)
                label = f"{k + 1}.{b + 1}:{j + 1}" if several and not in_stem else f"{k + 1}:{j + 1}"
                if in_stem and b > 0:
                    continue
                if j == len(chain) - 1 and joint.kind == "S" and limb.centre is None:
                    place = oracle.position + oracle.rotation @ (joint.point - home)
                    found[label] = joint.kind, [place], []
                    continue
                places, axes = [], []
                for kind, _, _ in elementary(joint):
                    number += 1
                    own = oracle.model.joint(f"j{number}").id
                    anchor, axis = np.array(oracle.data.xanchor[own]), np.array(oracle.data.xaxis[own])
                    if kind == "slide":
                        anchor += axis * oracle.data.qpos[oracle.model.jnt_qposadr[own]]
                    places.append(anchor)
                    axes.append(axis)
                found[label] = joint.kind, places, axes if joint.kind != "S" else []
    return found


@pytest.mark.parametrize("name", ROBOTS)
def test_joints_are_drawn_where_the_engine_has_them(name: str) -> None:
    for oracle in configurations(name)[:2]:
        posture = posture_at(name, oracle)
        scene, size = model_of(name).scene, drawing(name).size
        drawn = {each.name: values for each, values in zip(scene.joints, posture.joints, strict=True)}
        kinds = {each.name: each.kind for each in scene.joints}
        expected = engine_joints(name, oracle)
        assert {label.rstrip("abcd") for label in drawn} == set(expected)
        for label, (kind, places, axes) in expected.items():
            if kind == "Pa":
                corners = [drawn[label + letter][0] for letter in "abcd"]
                for middle, place in zip((corners[:2], corners[2:]), places, strict=True):
                    assert np.max(np.abs(np.mean(middle, axis=0) - place)) < 1e-9 * size
                short = [corners[0] - corners[1], corners[2] - corners[3]]
                assert np.max(np.abs(short[0] - short[1])) < 1e-9 * size
                continue
            assert kinds[label] is JointKind(kind)
            place, *directions = drawn[label]
            away = place - places[0]
            if kind == "P":  # anywhere on the slide's line, such as in the middle of a leg
                away = np.cross(away, axes[0])
            assert np.max(np.abs(away)) < 1e-9 * size, label
            assert len(directions) == len(axes)
            for direction, axis in zip(directions, axes, strict=True):
                assert np.max(np.abs(direction - axis)) < 1e-9, label


@pytest.mark.parametrize("name", ROBOTS)
def test_links_keep_their_lengths_while_the_robot_moves(name: str) -> None:
    shown, moved = drawing(name), posture_at(name, configurations(name)[1])
    scene = model_of(name).scene
    slides = {each.name for each in scene.joints if each.kind is JointKind.PRISMATIC}
    names = [point.name for point in scene.points]
    for start, end, _ in shown.links:
        ends = {names[start], names[end]}
        lengths = [np.linalg.norm(each.points[end] - each.points[start]) for each in (shown.posture, moved)]
        assert lengths[0] > 0
        if not ends & slides:
            assert lengths[1] == pytest.approx(lengths[0], abs=1e-9 * shown.size)
    assert drawn_limbs(shown) == set(model_of(name).limbs) - JOINTS_ALONE.get(name, set())
    assert {joint.limb for joint in scene.joints} == set(model_of(name).limbs)
    if len(model_of(name).limbs) > 2:
        assert {body for body, _ in shown.plates} == {Body.BASE, Body.PLATFORM} - ON_A_LINE.get(name, set())
    actuated = [each for limb in configurations(name)[0].robot.limbs for each in every_joint(limb) if each.actuated]
    assert sum(each.is_actuated for each in scene.joints) == len(actuated)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_structure_is_that_of_the_engine(name: str) -> None:
    structure, ranks = model_of(name).structure, RANKS[name]
    assert tuple(each.wrenches for each in structure) == ranks.W
    assert tuple(each.constraints for each in structure) == ranks.C
    generic = model_of(name).generic
    assert (generic.jacobian, 6 - generic.constraints) == (ranks.J, ranks.freedoms)
    assert sum(each.unknowns for each in structure) == len(model_of(name).unknowns)
    assert sum(each.kept for each in structure) == len(model_of(name).closure)
    # Every loop equation that is kept determines an unknown or takes a freedom from the platform.
    assert sum(each.kept for each in structure) == len(model_of(name).unknowns) + 6 - ranks.freedoms


def test_the_pages_slider_moves_every_link_and_keeps_its_length() -> None:
    model = model_of("delta-parallelogram")
    typical = {item.name: item.typical[0] for item in model.parameters}
    solution = solve(Case(model, typical, list(model.home), [Task(np.array([0, 0, 0, 0.2, 0, 1.0]))]), starts=1)
    (view,) = report_of("", solution, result_of(solution)).parts[0].views
    assert len(view["frames"]) == 41
    assert [joint["actuated"] for joint in view["joints"]].count(True) == 3
    places = np.array([frame["points"] for frame in view["frames"]])
    ends = np.array([link["ends"] for link in view["links"]])
    lengths = np.linalg.norm(places[:, ends[:, 1]] - places[:, ends[:, 0]], axis=2)
    assert np.max(np.ptp(lengths, axis=0)) < 1e-9
    assert set(measured := view["measure"]["units"]) == {"deg"}
    # Everything but the base moves, and the actuators turn as the joints on the arms say.
    bodies = np.array([point["body"] for point in view["points"]])
    moved = np.max(np.linalg.norm(places[-1] - places[0], axis=1)[bodies == "base"])
    assert moved < 1e-12 < np.min(np.linalg.norm(places[-1] - places[0], axis=1)[bodies != "base"])
    turned = np.radians([frame["lengths"][0] for frame in view["frames"]])
    names = [point["name"] for point in view["points"]]
    arm = places[:, names.index("1:2")] - places[:, names.index("1:1")]
    cosines = np.sum(arm * arm[view["zero"]], axis=1) / np.sum(arm[0] ** 2)
    np.testing.assert_allclose(np.cos(turned - turned[view["zero"]]), cosines, atol=1e-12)
    assert len(measured) == len(view["rows"])


@pytest.mark.parametrize(
    "name", [each if each == "orthoglide" else pytest.param(each, marks=pytest.mark.slow) for each in GALLERY]
)
def test_words_of_every_robot_are_clear(name: str) -> None:
    """No word covers another one, every limb has one label, and the symbols of joints are explained."""
    shown = drawing(name)
    figure = figure_of([shown])
    figure.canvas.draw()
    words = [text for text in figure.axes[0].texts if text.get_text()]
    boxes = [text.get_window_extent() for text in words]
    for i, one in enumerate(boxes):
        assert not [other for other in boxes[i + 1 :] if one.overlaps(other)]
    labels = [text.get_text().split("\n")[0] for text in words if text.get_text().startswith("limb ")]
    assert sorted(labels) == sorted(f"limb {limb}" for limb in drawn_limbs(shown))
    legend = {text.get_text() for each in figure.legends for text in each.get_texts()}
    assert {f"{joint.kind.words} ({joint.kind.value})" for joint in shown.model.scene.joints} <= legend
    extents = [each.get_window_extent() for each in figure.legends]
    assert not [pair for pair in pairwise(extents) if pair[0].overlaps(pair[1])]
    frame = figure.get_window_extent()
    assert all(frame.x0 <= each.x0 <= each.x1 <= frame.x1 for each in extents)


def test_a_limb_of_three_hinges_that_meet_is_drawn() -> None:
    """Special limbs: hinges that form a ball joint, screws, cylinders, passive limbs."""
    for name in ("3-rprrr", "3-hps", "6-cps", "6-hus", "3-rps-ups", "3-pprs", "planar-loose", "planar-centre"):
        shown = drawing(name)
        assert np.isfinite(shown.posture.points).all()
        assert all(np.isfinite(each).all() for each in shown.posture.joints)
