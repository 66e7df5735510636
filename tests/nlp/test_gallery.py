"""Robots given joint by joint: starters, every command, conventions of F."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import EACH_KIND, Run, case_from, case_of, output_of, saved, soaked, starter, starter_tables, starter_text

import screwsynth.nlp as sn
from screwsynth.models import Model, WrenchKind, constraint_rows, model_names, robot, robot_function, three_upu
from screwsynth.nlp.case.robotfile import model_of_definition, read_definition
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.evidence.conventions import dependence_of
from screwsynth.nlp.evidence.mobility import mobility_of
from screwsynth.nlp.evidence.paths import velocities_at
from screwsynth.nlp.evidence.sensitivity import Hindrance
from screwsynth.nlp.evidence.state import loops_are_closed
from screwsynth.nlp.proof.workspace.judge import judge_workspace
from screwsynth.nlp.starter.text import starter_case
from screwsynth.nlp.words.summary import case_summary, case_tables, table_names
from screwsynth.nlp.words.text import Line, TextTable

#: Freedoms of the robots with fewer than six, and what each one's task is called.
TASKS = {
    **dict.fromkeys(("3-prs", "3-rps", "3-rrs", "3-spr", "exechon"), (3, "translation along z")),
    **dict.fromkeys(("3-puu", "3-upu", "three-upu", "orthoglide", "tripteron"), (3, "translation along z")),
    **dict.fromkeys(("delta", "delta-parallelogram", "linear-delta", "rotary-delta"), (3, "translation along z")),
    **dict.fromkeys(("4-ruu", "4-upu"), (4, "translation along z")),
    **dict.fromkeys(("planar-3-prr", "planar-3-rpr", "planar-3-rrr"), (3, "translation along x")),
    **dict.fromkeys(("five-bar", "five-bar-pen"), (2, "rotation about z")),
    "five-bar-plotter": (2, "translation along x"),
    "ankle": (2, "rotation about y"),
    "pentapod": (5, "translation along z"),
    **dict.fromkeys(("spherical-3-rrr", "differential-waist"), (3, "rotation about z")),
    "tricept": (3, "rotation about x"),
}
#: Robots whose platform never turns, or whose task is possible without a rotation alone; and that turn about one axis.
UPRIGHT = {
    "3-puu", "3-upu", "three-upu", "orthoglide", "tripteron", "delta", "delta-parallelogram", "3-spr", "exechon",
    "linear-delta", "rotary-delta", "five-bar-plotter",
}  # fmt: skip
ONE_AXIS = {"4-ruu", "4-upu", "planar-3-prr", "planar-3-rpr", "planar-3-rrr", "five-bar", "five-bar-pen"}


def with_workspace(text: str) -> str:
    """A starter with its workspace as it is once its comment signs are removed."""
    before, table = text.split("# [workspace]")
    table, after = table.split("\n\n")
    return f"{before}[workspace]{table.replace('# position', 'position').replace('# rotation', 'rotation')}\n\n{after}"


def fixed(case: sn.Case) -> sn.Case:
    """A case at the typical dimensions."""
    return replace(case, parameters={item.name: item.starter or item.typical for item in case.model.parameters})


def name_of(robot: str | Model) -> str:
    """The name of a test's robot, with that of its option."""
    return robot if isinstance(robot, str) else f"{robot.name}-{robot.options['axes']}"


def test_a_starter_follows_the_size_of_a_robot_without_dimensions(tmp_path: Path) -> None:
    point, rail = "B = [60, 0, -40]", '{ type = "P", at = "B", axis = "A - B", actuated = true }'
    joints = f'joints = [{{ type = "U", at = "B", axes = ["x", "y"] }}, {rail}, {{ type = "S", at = "A" }}]'
    limbs = [
        f"[[limb]]\nrepeat = {{ count = 3 }}\npoints = {{ {point}, A = [40, {y}, 0] }}\n{joints}\n" for y in (8, -8)
    ]
    saved(tmp_path / "large.toml", 'name = "large"\nhome = [0, 0, 0]\n' + "".join(limbs))
    model = model_of_definition(read_definition("large.toml", tmp_path), "large.toml")
    assert not model.parameters
    z = sn.load_case(str(saved(tmp_path / "case.toml", starter_case(model, "large.toml")))).position[2]
    # Six telescoping legs, 40 to 60 m from the middle, without dimensions.
    # 0.3 times the distance of the joints on the base from its origin, sqrt(60^2 + 40^2) = 72.1, as a round number.
    assert z.upper == 20  # type: ignore[union-attr]


EVERY = [*model_names(), *(three_upu(axes=axes) for axes in ("limb", "snu", "tsai"))]


@pytest.mark.parametrize("given", soaked(EVERY, (*EACH_KIND, "stewart-gough")), ids=name_of)
def test_every_starter_is_solved_to_a_machine_that_makes_its_task(given: str | Model) -> None:
    model = robot_function(given)() if isinstance(given, str) else given
    text = starter_text(given) if isinstance(given, str) else starter_case(model)
    assert f'model = "{model.name}"' in text
    case = case_from(text)
    freedoms, task = TASKS.get(model.name, (6, "screw motion"))
    assert f"which has {freedoms} degree{'s' * (freedoms != 1)} of freedom" in text
    assert case.tasks[0].name == task
    has_turn = isinstance(case.rotation.angle, sn.Free)
    assert has_turn == (model.name not in UPRIGHT)
    assert (has_turn and case.rotation.axis is not None) == (model.name in ONE_AXIS)

    own = sn.solve(case, starts=2).outcomes[0].own
    assert own.status is sn.Status.OPTIMAL
    assert own.state.rank == 6
    assert loops_are_closed(own.nlp, own.x)
    assert len(list(case.limits)) >= 2
    mobility = mobility_of(own.nlp, own.x, own.state)
    if mobility is None:
        # A robot given by its rows: its couples do no work.
        couples = [row.kind is not WrenchKind.FORCE for row in model.wrenches]
        assert np.abs(own.state.rates[couples]).max(initial=0.0) < 1e-9
        assert 6 - sum(couples) == freedoms
    else:
        assert (mobility.freedoms, mobility.constrained, mobility.singularities) == (freedoms, 0.0, ())

    judged = fixed(case_from(with_workspace(text)))
    assert judged.workspace is not None
    assert any(isinstance(value, sn.Free) for value in (*judged.workspace.position, *judged.workspace.turns.angles))
    for value, home in zip(judged.workspace.position, model.home, strict=True):
        lower, upper = (value.lower, value.upper) if isinstance(value, sn.Free) else (value, value)
        assert lower - 1e-9 <= home <= upper + 1e-9


@pytest.mark.parametrize("name", ["stewart-gough", "delta", "exechon"])
def test_the_machine_of_a_starter_is_good_over_its_workspace(name: str) -> None:
    case = fixed(case_from(with_workspace(starter_text(name))))
    assert judge_workspace(case).is_proved


def serial(*joints: dict[str, Any]) -> Model:
    """A robot of one limb."""
    return robot(name="own", home=[0, 0, 3], limb=[{"points": {"B": [2, 0, 0]}, "joints": list(joints)}])


@pytest.mark.parametrize(
    ("joint", "name", "axis", "point", "pitch"),
    [
        ({"type": "P", "axis": [1, 1, 0]}, "translation along an axis", [1, 1, 0], None, math.inf),
        ({"type": "R", "axis": "y"}, "rotation about y", [0, 1, 0], [2, 0, 0], 0),
        ({"type": "H", "axis": "z", "pitch": 0.5}, "screw motion about z", [0, 0, 1], [2, 0, 0], 0.5),
    ],
)
def test_a_robot_of_ones_own_has_the_motion_of_its_joint(
    joint: dict[str, Any], name: str, axis: list[float], point: list[float] | None, pitch: float
) -> None:
    (task,) = tomllib.loads(starter_case(serial({"at": "B", "actuated": True, **joint})))["task"]
    assert (task["name"], task["pitch"]) == (name, pytest.approx(pitch))
    unit = np.array(axis) / np.linalg.norm(axis)
    np.testing.assert_allclose(np.abs(np.dot(task["axis"], unit)), 1, atol=1e-9)
    if point is not None:
        np.testing.assert_allclose(np.cross(np.array(task["point"]) - point, unit), 0, atol=1e-9)


SIX = ("3-rps", "6-rus", "delta", "delta-parallelogram", "3-upu", "planar-3-rrr")


def narrow(case: sn.Case) -> sn.Case:
    """The case with its free numbers in a fifth of their ranges, where every robot stays in its own assembly."""

    def less(value: float | sn.Free) -> float | sn.Free:
        if not isinstance(value, sn.Free):
            return value
        middle, half = (value.lower + value.upper) / 2, (value.upper - value.lower) / 10
        return sn.Free(middle - half, middle + half)

    parameters = {name: [less(value) for value in case.components(name)] for name in case.parameters}
    rotation = replace(case.rotation, angle=less(case.rotation.angle))
    return replace(case, parameters=parameters, position=[less(value) for value in case.position], rotation=rotation)


def test_evaluate_writes_json_and_csv_with_the_values_of_the_program(tmp_path: Path, cli: Run) -> None:
    for name in SIX:
        path = saved(tmp_path / f"{name}.toml", starter_text(name))
        data_file, csv_file = tmp_path / f"{name}.json", tmp_path / f"{name}.csv"
        out = output_of(cli("evaluate", str(path), "--json", str(data_file), "--csv", str(csv_file)))
        data = json.loads(data_file.read_text(encoding="utf-8"))
        nlp = sn.formulate(case_from(starter_text(name)))
        state = sn.evaluate(nlp, closed_start(nlp))
        assert data["F"] == pytest.approx(state.F, rel=1e-12)
        assert len(data["jacobian"]) == len(data["limbs"]) == len(nlp.program.model.rows)
        assert np.sum(np.square(data["rates"])) == pytest.approx(state.F, rel=1e-12)
        assert data["joints"]["assembly"] == []
        assert "rank of J  6" in out
        assert len(csv_file.read_text(encoding="utf-8").splitlines()) > 5


@pytest.mark.parametrize("names", soaked([SIX[:1], SIX[1:]], [SIX[:1]]), ids=["one", "others"])
def test_tasks_poses_and_limits_together(names: tuple[str, ...]) -> None:
    for name in names:
        case = narrow(starter(name))
        quantity, largest = case.model.quantities[0], 3.0
        (own,) = case.tasks
        both = replace(
            case,
            tasks=[own, replace(own, name="second", sense=sn.Sense.MAX, twist=np.array([0, 0, 0, 0, 0, 1.0]))],
            further=[sn.Pose(case.position, case.rotation)],
            over_poses=sn.OverPoses.MEAN,
            method=sn.Method.AVERAGE,
            limits=sn.Limits(sn.RateShare(0.95), sn.QuantityLimit(quantity.name, min=-largest, max=largest)),
            search=sn.Search(starts=2),
        )
        solution = sn.solve(both)
        assert solution.status.is_answer, name
        for outcome in solution.outcomes:
            found = outcome.own
            assert found.status is sn.Status.OPTIMAL, name
            assert loops_are_closed(found.nlp, found.x)
            F = np.mean([sn.evaluate(found.nlp, found.x, pose).F for pose in range(2)])
            assert pytest.approx(F, rel=1e-12) == found.F


@pytest.mark.parametrize("names", soaked([SIX[:1], SIX[1:]], [SIX[:1]]), ids=["one", "others"])
def test_sensitivities_are_those_of_solved_neighbours(names: tuple[str, ...]) -> None:
    for name in names:
        case = replace(narrow(starter(name)), search=sn.Search(starts=1))
        fixed = next(
            item.name for item in case.model.parameters if not isinstance(case.components(item.name)[0], sn.Free)
        )
        value = float(case.components(fixed)[0])
        own = sn.solve(case).outcomes[0].own
        (found,) = [each for each in sn.sensitivities(own.nlp, own.x) if each.name == fixed]
        step = 1e-5 * value

        def best(number: float, case: sn.Case = case, fixed: str = fixed) -> float:
            return sn.solve(replace(case, parameters={**case.parameters, fixed: number})).F

        slope = (best(value + step) - best(value - step)) / (2 * step)
        assert found.derivative == pytest.approx(slope, rel=1e-4, abs=1e-5 * abs(own.F / value)), name


def test_a_number_that_the_robot_has_no_choice_of_has_no_sensitivity() -> None:
    # A Delta does not turn: no sum of changes of the other numbers closes its loops where it is turned.
    # The planar robot has the choice of its rotation.
    for name, angle in (("delta", 0), ("planar-3-rrr", 3)):
        pose = starter_tables(name)["pose"] | {"rotation": {"axis": [0, 0, 1], "angle": angle}}
        solution = sn.solve(case_of(name, pose=pose, solve={"starts": 1}))
        rows = {row.name: row for row in sn.sensitivities(solution.nlp, solution.x)}
        if name == "delta":
            assert {name for name, row in rows.items() if row.derivative is None} == {"angle"}
            assert rows["angle"].hindrance is Hindrance.LOOPS
            assert "fixed: loops close at no other value" in solution.table(width=120)
        else:
            assert rows["angle"].derivative


def test_report_and_check_and_codegen_write_what_they_say(tmp_path: Path, cli: Run) -> None:
    path, page, folder = saved(tmp_path / "delta.toml", starter_text("delta")), tmp_path / "page.html", tmp_path / "c"
    assert cli("report", str(path), "--out", str(page), "--starts", "2")[0] == 0
    text = page.read_text(encoding="utf-8")
    assert "another way" not in text
    # Joint positions that close the loops are no numbers of the case.
    assert "4 variables: rb, p_x, p_y, p_z. All other parameters are fixed." in text
    assert cli("codegen", str(path), "--no-measure", "--out", str(folder))[0] == 0
    assert any(folder.iterdir())


@pytest.mark.slow
# The others compile for a minute.
@pytest.mark.parametrize("name", soaked(["3-rps", "6-rus", "delta", "planar-3-rrr"], ["3-rps", "delta"]))
def test_c_has_the_values_of_the_program(name: str, embed: Callable[[sn.Case], Any]) -> None:
    case = starter(name)
    c, nlp = embed(case, "-O0"), sn.formulate(case)
    p, n, count = np.ascontiguousarray(nlp.arguments), nlp.n, len(nlp.program.constraints)
    k, work = np.zeros(c.macro("K") + 1), np.zeros(c.macro("WORK"))
    F, gradient, g, dg = np.zeros(1), np.zeros(n), np.zeros(count), np.zeros((count, n))
    assert c.call("prepare", p, k, work) == 0
    rng = np.random.default_rng(3)
    for _ in range(100):
        x = nlp.start + 0.2 * nlp.scale * rng.uniform(-1, 1, n)
        assert c.call("F_gradient", x, k, F, gradient, work) == c.call("limits", x, k, g, dg, work) == 0
        value, slope, constraint, constraint_slope = nlp.program.kernels.derivatives(x, p)
        for got, wanted in ((F, value.ravel()), (gradient, slope.ravel()), (g, constraint.ravel())):
            assert np.max(np.abs(got - wanted)) <= 1e-14 * max(1.0, float(np.max(np.abs(wanted)))), name
        assert np.max(np.abs(dg - constraint_slope)) <= 1e-14 * max(1.0, float(np.max(np.abs(constraint_slope))))


def test_a_case_of_the_gallery_is_written_and_read_again() -> None:
    for name in SIX:
        case = starter(name)
        again = case_from(case.to_toml(), name)
        assert again.model.name == name
        one, other = (sn.formulate(each) for each in (case, again))
        assert other.evaluate(other.start).F == one.evaluate(one.start).F


GENERAL = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
NAMES = ("3-rps", "6-rus", "3-upu", "delta-parallelogram", "planar-3-rrr", "spherical-3-rrr")


@cache
def at_home(name: str) -> sn.Nlp:
    model = robot_function(name)()
    values = {item.name: item.typical[0] for item in model.parameters}
    length = 0.7 * float(np.linalg.norm(model.home)) or 0.7
    return sn.formulate(sn.Case(model, values, model.home, [sn.Task(GENERAL)], characteristic_length=length))


def with_twist(nlp: sn.Nlp, twist: np.ndarray) -> sn.Nlp:
    arguments = np.array(nlp.arguments)
    arguments[nlp.program.places.twists[0]] = twist
    return replace(nlp, arguments=arguments)


def feasible(nlp: sn.Nlp) -> np.ndarray:
    """The general twist, projected on the twists that the platform can make with free actuators."""
    numbers = nlp.program.kernels.robot_state(nlp.start, nlp.arguments)
    rows = constraint_rows(nlp.program.model, velocities_at(nlp, nlp.start, numbers), numbers.position)
    work = np.hstack([rows[:, 3:], rows[:, :3]])
    return GENERAL - np.linalg.pinv(work, rcond=1e-9) @ (work @ GENERAL)


@pytest.mark.parametrize("name", NAMES)
def test_only_what_constraints_carry_depends_on_conventions(name: str) -> None:
    nlp = at_home(name)
    possible = with_twist(nlp, feasible(nlp))
    general, special = (dependence_of(each, nlp.start) for each in (nlp, possible))
    if name in ("3-rps", "6-rus"):  # forces alone
        assert (general, special) == (None, None)
        return
    if name == "spherical-3-rrr":  # F of a rotation is the length's square times a number
        assert special.length == pytest.approx(2, abs=1e-9)
    else:
        assert special.length == 0
        assert abs(general.length) > 0.01
    slides = name in ("planar-3-rrr", "delta-parallelogram")  # the others have universal joints or hinges that meet
    assert (general.centre is not None) == slides
    if slides:
        assert special.centre == 0
        assert general.centre > 0.01


def test_the_derivative_by_the_length_is_that_of_f() -> None:
    nlp = at_home("planar-3-rrr")
    found = dependence_of(nlp, nlp.start)
    values = []
    for part in (0.999, 1.001):
        changed = replace(nlp.case, characteristic_length=part * nlp.case.characteristic_length)
        values.append(sn.formulate(changed).evaluate(nlp.start)[0])
    slope = (values[1] - values[0]) / 0.002 / nlp.evaluate(nlp.start)[0]
    assert found.length == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize("name", [*NAMES, "delta", "tricept", "five-bar"])
def test_actuation_and_constraints_of_limbs_sum_to_f(name: str) -> None:
    nlp = at_home(name)
    for each, is_feasible in ((nlp, False), (with_twist(nlp, feasible(nlp)), True)):
        state = sn.evaluate(each, each.start)
        found = mobility_of(each, each.start, state)
        parts = found.parts
        assert sum(part.F for part in parts) == pytest.approx(state.F, rel=1e-9)
        carried = sum(part.constraints for part in parts) / state.F
        assert carried == pytest.approx(found.constrained, abs=1e-12)
        assert (found.constrained == 0) == (is_feasible or name == "6-rus")
        # By limb: the rates of its rows, and the least squares of them by its actuators.
        rows = np.array([row.limb for row in each.program.model.rows])
        for part in parts:
            of_limb = np.sum(state.rates[rows == part.limb] ** 2)
            assert part.F == part.actuation + part.constraints == pytest.approx(of_limb, rel=1e-9, abs=1e-12 * state.F)
            if part.limb not in {actuator.limb for actuator in each.program.model.actuators}:
                assert part.actuation == 0


def test_results_have_f_by_limb_and_name_conventions() -> None:
    case = starter("planar-3-rrr")
    result = sn.result_of(sn.solve(case, starts=1))
    joints = result.robot.joints
    assert joints.feasible is False
    assert sum(each.F for each in joints.limb_parts) == pytest.approx(result.F)
    assert joints.constrained == pytest.approx(sum(each.constraints for each in joints.limb_parts) / result.F)
    shown = list(case_summary(case, result))
    notes = [item.text for item in shown if isinstance(item, Line) and item.label == "note"]
    assert [note[:13] for note in notes if note.startswith("F depends")] == ["F depends on "] * 2
    assert f"1 % more length changes F by {result.robot.length_dependence:+.2g} %" in " ".join(notes)
    (table,) = [item for item in shown if isinstance(item, TextTable) and item.name == "actuation"]
    assert [row[0] for row in table.rows] == ["1", "2", "3"]
    assert "actuation" in table_names(case, at_point=False)
    assert [item.name for item in case_tables(case, result)].count("actuation") == 1
    # A motion that is possible: the table is a file's only, and no convention is named.
    case = starter("6-ups")
    result = sn.result_of(sn.solve(case, starts=1))
    assert result.robot.joints.feasible is True
    assert not [item for item in case_summary(case, result) if isinstance(item, TextTable) and item.name == "actuation"]
    assert [item.name for item in case_tables(case, result)].count("actuation") == 1
    # The page shows notes and parts by limb.
    page = sn.report(sn.solve(starter("five-bar"), starts=1))
    assert "Note: member 1 resists with 5 wrenches or more" in page
    assert "Actuation and constraint parts of F by limb" in page


def test_members_of_which_f_says_little_are_named() -> None:
    assert [note for note in robot_function("planar-3-rrr")().remarks if "not informative" in note] == []
    (five_bar,) = [note for note in robot_function("five-bar")().remarks if "not informative" in note]
    assert five_bar.startswith("member 1 resists with 5 wrenches or more")
    joints = [
        {"type": "R", "at": [0, 0, 0], "axis": "z", "actuated": True},
        {"type": "R", "at": [1, 0, 0], "axis": "y", "actuated": True},
        {"type": "R", "at": [1, 0, 1], "axis": "y"},
        {"type": "S", "at": [2, 0, 1]},
    ]
    (arm,) = [
        note
        for note in robot(name="arm", home=(2, 0, 1), limb=[{"joints": joints}]).remarks
        if "not informative" in note
    ]
    assert arm.startswith("the robot has one member only")


def test_rows_have_the_names_of_their_members() -> None:
    model = robot_function("delta")()
    members = [each.name for each in model.structure]
    assert [row.member for row in model.rows] == members == ["1.1", "1.2", "2.1", "2.2", "3.1", "3.2"]
    values = {item.name: item.typical[0] for item in model.parameters}
    case = sn.Case(model, values, (0, 0, sn.Free(-1.3, -1.2)), [sn.Task(np.array([0, 0, 0, 0, 0, 1.0]))])
    result = sn.result_of(sn.solve(case, starts=1))
    assert list(result.robot.members) == members
    assert [name.partition(".")[0] for name in members] == list(result.robot.limbs)
    tables = {item.name: item for item in case_tables(case, result)}
    assert [row[0] for row in tables["limbs"].rows] == members
    assert len({row.member for row in robot_function("3-rps")().rows}) == 3  # one member a limb, with two rows
