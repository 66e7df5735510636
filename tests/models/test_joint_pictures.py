"""Drawings of robots given joint by joint: joints stand where MuJoCo has them, and labels are clear."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from builders import Array, soaked
from mujoco_robots import Oracle
from robot_files import every_joint
from robot_gallery import GALLERY, RANKS, table
from robot_mjcf import elementary
from test_robot_gallery import configurations

from screwsynth.models import Body, JointKind, LinkKind, Model, robot
from screwsynth.nlp import Case, Task, result_of, solve
from screwsynth.nlp.output.pictures.drawing import Drawing, drawing_of_model
from screwsynth.nlp.output.pictures.figures import figure_of
from screwsynth.nlp.output.pictures.posture import Posture
from screwsynth.nlp.output.report.report import report_of

#: Robots with every kind of limb; the others are slow tests.
QUICK = (
    "3-rps", "3-upu", "6-rus", "delta", "delta-parallelogram", "exechon", "spherical-3-rrr", "tricept", "tripteron",
)  # fmt: skip
ROBOTS = soaked(GALLERY, QUICK)


@cache
def model_of(name: str) -> Model:
    return robot(**table(name))


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
    assert {link.limb for *_, link in shown.links if link.kind is not LinkKind.RAIL} - {None} == set(
        model_of(name).limbs
    )
    assert {joint.limb for joint in scene.joints} == set(model_of(name).limbs)
    if len(model_of(name).limbs) > 2:
        assert {body for body, _ in shown.plates} == {Body.BASE, Body.PLATFORM}
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


def assert_words_are_clear(shown: Drawing) -> None:
    """No word covers another one, every limb has one label, and the symbols of joints are explained."""
    figure = figure_of([shown])
    figure.canvas.draw()
    words = [text for text in figure.axes[0].texts if text.get_text()]
    boxes = [text.get_window_extent() for text in words]
    for i, one in enumerate(boxes):
        assert not [other for other in boxes[i + 1 :] if one.overlaps(other)]
    labels = [text.get_text().split("\n")[0] for text in words if text.get_text().startswith("limb ")]
    assert sorted(labels) == sorted(f"limb {limb}" for limb in shown.model.limbs)
    legend = {text.get_text() for each in figure.legends for text in each.get_texts()}
    assert {f"{joint.kind.words} ({joint.kind.value})" for joint in shown.model.scene.joints} <= legend
    extents = [each.get_window_extent() for each in figure.legends]
    assert not [pair for pair in pairwise(extents) if pair[0].overlaps(pair[1])]
    frame = figure.get_window_extent()
    assert all(frame.x0 <= each.x0 <= each.x1 <= frame.x1 for each in extents)


def test_words_of_a_robot_with_parallelograms_are_clear() -> None:
    assert_words_are_clear(drawing("orthoglide"))


@pytest.mark.slow
@pytest.mark.parametrize("name", GALLERY)
def test_words_of_every_robot_are_clear(name: str) -> None:
    assert_words_are_clear(drawing(name))


def test_a_limb_of_three_hinges_that_meet_is_drawn() -> None:
    """Special limbs: hinges that form a ball joint, screws, cylinders, passive limbs."""
    for name in ("3-rprrr", "3-hps", "6-cps", "6-hus", "3-rps-ups", "3-pprs", "planar-loose", "planar-centre"):
        shown = drawing(name)
        assert np.isfinite(shown.posture.points).all()
        assert all(np.isfinite(each).all() for each in shown.posture.joints)
