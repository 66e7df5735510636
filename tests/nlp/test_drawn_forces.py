"""Arrows of loads and forces in pictures: their places, senses and scale, from the legs and the forces in results."""

from __future__ import annotations

import re

import numpy as np
import pytest
from builders import case_from

from screwsynth.nlp import Case, Rotation, Task, build_model, load_case, solve
from screwsynth.nlp.case.loads import Load, Loading
from screwsynth.nlp.output.pictures.figures import figure_of
from screwsynth.nlp.output.pictures.solutions import drawings_of
from screwsynth.nlp.output.report.report import report_of
from screwsynth.nlp.output.report.sections import sections
from screwsynth.nlp.results.result import result_of

HEXAPOD = """\
[robot]
model = "stewart-gough"
layout = "octahedral"
parameters = { x1 = 26.5, x2 = 11.543, x3 = 0, x4 = 5 }
[pose]
position = [1, 2, 20]
rotation = { axis = [1, 2, 3], angle = 10 }
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
[[load]]
name = "side"
force = [200, 20, -100]
point = [0, 1, 2]
"""

DELTA = """\
[robot]
model = "delta"
parameters = { rb = 0.164, rp = 0.044, arm = 0.524, rod = 1.244, w = 0.131, tilt = 20 }
[pose]
position = [0.1, 0, -1.2]
[[task]]
sense = "max"
axis = [0, 0, 1]
pitch = inf
"""


def test_arrows_push_and_pull_the_platform_along_the_legs_to_one_scale() -> None:
    solution = solve(case_from(HEXAPOD))
    (drawing,) = drawings_of(solution)
    assert drawing.forces is not None
    robot = result_of(solution).robot
    (load,) = robot.loading.loads
    wanted = {each.actuator: each.value for each in load.actuators}
    lengths = {arrow.name: arrow.ends[1] - arrow.ends[0] for arrow in drawing.forces.arrows}
    scale = np.linalg.norm(lengths["side"]) / np.linalg.norm([200, 20, -100])
    assert lengths["side"] == pytest.approx(scale * np.array([200.0, 20.0, -100.0]), rel=1e-9)
    total = np.zeros(3)
    rows = {row.limb: row for row in solution.nlp.program.model.rows}
    for k, name in enumerate(rows):
        arrow = next(each for each in drawing.forces.arrows if each.name == name)
        assert arrow.kind == ("push" if wanted[name] > 0 else "pull")
        along = np.array(robot.jacobian[k][:3])
        assert lengths[name] == pytest.approx(scale * wanted[name] * along, rel=1e-6)
        total += lengths[name]
    # The arrows of legs and load together are no force.
    assert total + lengths["side"] == pytest.approx(np.zeros(3), abs=1e-9 * float(np.linalg.norm(lengths["side"])))
    assert {arrow.kind for arrow in drawing.forces.arrows} == {"load", "push", "pull"}
    assert "load side" in drawing.forces.words


def test_torques_are_told_in_words_and_a_case_without_loads_has_no_arrows() -> None:
    (without,) = drawings_of(solve(case_from(DELTA)))
    assert without.forces is None
    (drawing,) = drawings_of(solve(case_from(DELTA + "[[load]]\nforce = [0, 0, -30]\n")))
    assert drawing.forces is not None
    assert [arrow.kind for arrow in drawing.forces.arrows] == ["load"]
    assert drawing.forces.torques.count("N m") == 3


@pytest.mark.parametrize(
    ("name", "twist"),
    [
        ("3-prs", (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
        ("6-pus", (0.3, -0.5, 0.2, 0.7, 0.4, -0.6)),
        ("planar-3-prr", (0.0, 0.0, 0.8, 0.5, -0.3, 0.0)),
    ],
)
def test_arrows_of_slides_do_the_opposite_work_of_those_of_the_load(name: str, twist: tuple[float, ...]) -> None:
    """In a motion of the platform, with the places of the slides as the drawing has them after it and before it."""
    model = build_model(name)
    values = {item.name: item.typical for item in model.parameters}
    load = Load("cut", (3.0, -2.0, 5.0), (1.0, 2.0, -2.0), (0.1, 0.2, 0.3), in_platform=True)
    case = Case(model, values, model.home, [Task(twist)], Rotation((0, 0, 1), 0.0), loading=Loading((load,)))
    (drawing,) = drawings_of(solve(case))
    assert drawing.forces is not None
    assert drawing.forces.torques == ""
    arrows = {(arrow.kind, arrow.name): arrow.ends for arrow in drawing.forces.arrows}
    held, force, moment = drawing.posture, np.array(load.force), np.array(load.moment)
    point = held.position + held.rotation @ load.point
    lengths = [np.linalg.norm(np.diff(arrows[kind, "cut"], axis=0)) for kind in ("load", "moment")]
    scale, turn = lengths[0] / np.linalg.norm(force), lengths[1] / np.linalg.norm(moment)
    np.testing.assert_allclose(arrows["load", "cut"], [point - scale * force, point], atol=1e-12)
    np.testing.assert_allclose(arrows["moment", "cut"], [point, point + turn * moment], atol=1e-12)
    t = 1e-5
    axes = figure_of([drawing]).axes[0]
    assert {"moment cut", "moment cut second head"} <= {text.get_gid() for text in axes.texts}
    before, after = (drawing.linkage.posture_after(held, np.array(twist), time) for time in (-t, t))
    assert before is not None
    assert after is not None
    work = 0.0
    for k, joint in enumerate(model.scene.joints):
        if joint.is_actuated:
            start, head = arrows["drive", str(joint.limb)]
            np.testing.assert_allclose(start, held.joints[k][0], atol=1e-12)
            work += float((head - start) / scale @ (after.joints[k][0] - before.joints[k][0]) / (2 * t))
    omega, v = np.array(twist[:3]), np.array(twist[3:])
    assert work == pytest.approx(-float(force @ (v + np.cross(omega, point)) + moment @ omega), rel=1e-8)


def test_a_picture_of_an_objective_of_actuators_has_no_rates_of_a_motion() -> None:
    drawing = drawings_of(solve(load_case("handling-3-upu")), 3)[0]
    assert drawing.motion is None
    assert drawing.rows == ()
    assert "smallest F = 7.532144 N (largest over 8 poses). Shown: pose 3" in drawing.headline


def test_a_load_without_forces_has_no_scale_of_arrows() -> None:
    (drawing,) = drawings_of(solve(case_from(DELTA + "[[load]]\nany = { force = 5 }\n")))
    assert drawing.forces is not None
    assert drawing.forces.arrows == ()
    assert "longest arrow" not in drawing.forces.words


def test_an_arrow_has_the_name_of_its_load_and_not_of_the_load_case() -> None:
    """A force of any direction has no arrow, and the weight that acts with it has one."""
    loads = '[[load]]\nname = "tool"\nmass = 2\nalways = true\n[[load]]\nname = "cut"\nany = { force = 5 }\n'
    (drawing,) = drawings_of(solve(case_from(DELTA + loads)))
    assert drawing.forces is not None
    (arrow,) = drawing.forces.arrows
    assert (arrow.kind, arrow.name, arrow.words) == ("load", "tool", "weight of tool: 19.62 N")
    assert drawing.forces.words.startswith("weight of tool, forces under load cut: longest arrow 19.62 N")
    solution = solve(load_case("handling-3-upu"))
    assert drawings_of(solution, 1)[0].forces.words.startswith("load handling: longest arrow")


def test_a_page_has_the_arrows_beside_the_legs_and_the_forces_of_each_pose() -> None:
    solution = solve(load_case("handling-3-upu"))
    report = report_of("", solution, result_of(solution))
    (part,) = report.parts
    forces = [pose.F for pose in result_of(solution).robot.several.poses]
    worst = [round(force, 5) for force in forces].index(round(max(forces), 5))
    assert [view["is_worst"] for view in part.views] == [k == worst for k in range(8)]
    for k, (view, drawing) in enumerate(zip(part.views, part.drawings, strict=True)):
        assert view["pose_words"] == f"pose {k + 1} of 8, F = {forces[k]:.7g} N"
        for shown, arrow in zip(view["forces"], drawing.forces.arrows, strict=True):
            ends, way = np.array(shown["ends"]), arrow.ends[1] - arrow.ends[0]
            assert ends[1] - ends[0] == pytest.approx(way, abs=1e-12)
            aside = ends[0] - arrow.ends[0]
            assert abs(aside @ way) <= 1e-12
            wanted = 0.0 if arrow.kind == "load" else 0.045 * drawing.size
            assert float(np.linalg.norm(aside)) == pytest.approx(wanted, rel=1e-9, abs=1e-15)
    words = re.sub(r"<[^>]*>", "", "".join(str(content) for _, _, content in sections(report)))
    assert "the largest actuator force over all actuators and loads" in words
    assert "translation along" not in words
    assert "Rates at this position" not in words
    assert "longest arrow 10.39 N" in words
