"""A first case of one's own, a hexapod press: what the program says where its author may hesitate."""

import json
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from builders import Patch, Run, case_from, edited, output_of, refusal_of, saved, starter_text, unbroken

import screwsynth.nlp as sn
from screwsynth.models import Leg, Model, PoseSymbols, homogenised, legged_platform
from screwsynth.nlp.case.limits.singular_values import SmallestSingularValue
from screwsynth.nlp.case.robots import ModelOption, build_model, model_options
from screwsynth.nlp.evidence.state import evaluate
from screwsynth.nlp.solver import semi_infinite
from screwsynth.nlp.words.models import model_words
from screwsynth.nlp.words.summary import case_summary
from screwsynth.nlp.words.text import Line, TextTable

PRESS = """
[robot]
model = "stewart-gough"
layout = "octahedral"
[robot.parameters]
x1 = 0.18
x2 = 0.11
x3 = { min = 0, max = 30 }
x4 = { min = 0, max = 30 }
[pose]
position = [{ min = -0.03, max = 0.03 }, { min = -0.03, max = 0.03 }, 0.25]
[[task]]
sense = "max"
axis = [0, 0, -1]
pitch = inf
[limits]
leg_length = { min = 0.22, max = 0.32 }
"""
LEG_LIMIT = "leg_length = { min = 0.22, max = 0.32 }"
SMALLEST = "smallest_singular_value = { min = 0.2, length = 0.11 }"
#: Limits of the press over its workspace, at a fixed position of the pose.
OVER = (
    ("position = [{ min = -0.03, max = 0.03 }, { min = -0.03, max = 0.03 }, 0.25]", "position = [0, 0, 0.25]"),
    (LEG_LIMIT, f'over = "workspace"\n{LEG_LIMIT}\n{SMALLEST}'),
)
WORKSPACE = "[workspace]\nposition = [{ min = -0.03, max = 0.03 }, { min = -0.03, max = 0.03 }, 0.25]\n"
#: Advice below the rank of a singular answer.
ADVICE = "add smallest_singular_value = { min = ..., length = ... } to [limits] to exclude singular designs"


def solved(tmp_path: Path, cli: Run, text: str, *options: str) -> str:
    """The output of a solve of a case."""
    return unbroken(cli("solve", str(saved(tmp_path / "press.toml", text)), *options)[1])


def test_a_singular_optimum_says_so_first_and_names_the_limit_against_it(tmp_path: Path, cli: Run) -> None:
    out = solved(tmp_path, cli, PRESS)
    assert "(SINGULAR: rank 3, " in out
    assert ADVICE in out
    assert out.index("singular; with all actuators locked") < out.index(ADVICE)
    # The limit that the advice names excludes the design, and ends the advice.
    limited = solved(tmp_path, cli, edited(PRESS, (LEG_LIMIT, f"{LEG_LIMIT}\n{SMALLEST}")))
    assert "singular" not in limited.replace("smallest_singular_value", "").lower()
    # So does the statement that a singular answer is expected.
    assert ADVICE not in solved(tmp_path, cli, f"{PRESS}[expect]\nsingular = true\n")


def test_a_robot_that_is_singular_everywhere_gets_no_advice() -> None:
    pose = PoseSymbols()
    corners = [np.array([np.cos(angle), np.sin(angle), 0]) for angle in np.radians([0, 120, 240])]
    legs = [Leg(str(k + 1), ca.SX(2 * corner), ca.SX(corner)) for k, corner in enumerate(corners)]
    parts = legged_platform(legs, pose)
    tripod = Model("tripod", "three legs", parameters=(), pose=pose, home=(0, 0, 3), wrenches=parts.wrenches)
    case = sn.Case(tripod, {}, (0, 0, sn.Free(2, 4)), [sn.Task.screw("max", axis=(0, 0, 1), pitch=np.inf)])
    solution = sn.solve(case, starts=2)
    lines = [
        str(each.before + each.text) for each in case_summary(case, sn.result_of(solution)) if isinstance(each, Line)
    ]
    assert any("singular; with all actuators locked" in each for each in lines)
    assert not any("smallest_singular_value" in each for each in lines)


def test_a_flat_direction_is_a_sentence(tmp_path: Path, cli: Run) -> None:
    out = solved(tmp_path, cli, edited(PRESS, (LEG_LIMIT, f"{LEG_LIMIT}\n{SMALLEST}")), "--all")
    assert "flat direction  changing x3 by +1 and x4 by -1 keeps F: other designs are equally good" in out


def test_an_unproved_claim_is_named_and_its_design_can_be_set(tmp_path: Path, cli: Run, monkeypatch: Patch) -> None:
    monkeypatch.setattr(semi_infinite, "MOST_EXCHANGES", 1)
    path, target = (
        saved(tmp_path / "press.toml", edited(PRESS, *OVER) + WORKSPACE + "[solve]\nstarts = 2\n"),
        tmp_path / "press.json",
    )
    status, out, _ = cli("solve", str(path), "--json", str(target))
    assert status == 1
    result = json.loads(target.read_text(encoding="utf-8"))
    (claim,) = [each for each in result["workspace"]["extremes"] if each["outcome"] != "proved"]
    word = {"open": "undecided", "refuted": "violated"}[claim["outcome"]]
    named = f"proved bound {claim['bound']:.7g}, reached {claim['reached']:.7g}"
    sentence = f"not proved: 1 claim violated or undecided: smallest_singular_value >= 0.2 ({word}, {named})"
    assert sentence in unbroken(out)
    error = refusal_of(cli("workspace", str(path), "--of", str(target)), "contains no answer: the solve failed")
    assert "; its reached design: --set x3=" in error
    # The options of the message are those of the command.
    options = error.split("its reached design: ")[1].split()
    assert [each.partition("=")[0] for each in options if each != "--set"] == ["x3", "x4"]
    reached = tmp_path / "reached.json"
    cli("evaluate", str(path), *options, "--json", str(reached))
    parameters = json.loads(reached.read_text(encoding="utf-8"))["parameters"]
    assert parameters == pytest.approx(result["parameters"], rel=1e-6)


@pytest.mark.parametrize(
    ("limit", "sentence"),
    [
        ("condition_number = 12", "condition_number = 12: must be a table, such as { max = 12, length = ... }"),
        ("condition_number = true", "condition_number = true: must be a table, such as { max = ..., length = ... }"),
        ("joint_spacing = [2]", "joint_spacing: must be a table, such as { min = ... }"),
        ("leg_length = 0.3", "leg_length = 0.3: must be a table, such as { min = ..., max = ... }"),
        ("footprint = 2", "footprint = 2: must be a table, such as { base = ..., platform = ... }"),
        ("actuator = 2", "actuator = 2: must be a table, such as { stroke_max = ..., dead_length = ... }"),
        ("actuator_force = 80", "actuator_force = 80: must be a table, such as { min = ..., max = ... }"),
        (
            "condition_number = { max = 12 }",
            "length: is missing: give a length by which moments are divided, such as the radius of the platform",
        ),
    ],
)
def test_a_limit_that_is_no_table_gets_an_example(tmp_path: Path, cli: Run, limit: str, sentence: str) -> None:
    path = saved(tmp_path / "press.toml", edited(PRESS, (LEG_LIMIT, limit)))
    refusal_of(cli("solve", str(path)), sentence)


def test_the_starter_of_a_hexapod_explains_layout_pose_and_singular_values() -> None:
    text = starter_text("stewart-gough")
    comments = text.replace("\n# ", " ")
    for words in (
        '"octahedral": platform pairs turned by 60 deg, as in most hexapods',
        "the search chooses ONE pose. For a robot that works at ALL poses of a box, use [workspace] below",
        "fixed height: write 35 in place of { min = 25, max = 45 }",
        "half angle of a base pair (0: triangle, 30 deg: hexagon), deg",
    ):
        assert words in comments, words
    # The limit of the comment is satisfied at home.
    case = case_from(text.replace("# smallest_singular_value", "smallest_singular_value"))
    limit = case.limits.of(SmallestSingularValue)
    assert limit is not None
    assert limit.length == 8
    home = evaluate(nlp := sn.formulate(case), nlp.start)
    values = np.linalg.svd(np.array(homogenised(home.jacobian, home.position, limit.length)), compute_uv=False)
    assert limit.min < values[-1] < 2 * limit.min
    # The comment on the height gives a case.
    fixed = case_from(edited(text, ("{ min = 25, max = 45 }]", "35]")))
    assert fixed.position[2] == 35


def test_the_octahedral_layout_turns_the_platform_pairs_by_60_degrees() -> None:
    azimuths = {}
    for layout in ("aligned", "octahedral"):
        model = build_model("stewart-gough", {"layout": layout})
        centres = ca.Function("centres", [model.symbols], [ca.horzcat(*[leg.platform for leg in model.legs])])
        x, y, _ = centres([12, 8, np.radians(20), np.radians(8)]).full()
        azimuths[layout] = np.sort(np.degrees(np.arctan2(y, x)) % 360)
    assert azimuths["aligned"] == pytest.approx([8, 112, 128, 232, 248, 352])
    assert azimuths["octahedral"] == pytest.approx([52, 68, 172, 188, 292, 308])


def test_models_shows_the_meaning_of_options_that_have_one(cli: Run) -> None:
    for name in ("stewart-gough", "hexapod", "three-upu"):
        assert all(option.meaning for option in model_options(name))
    assert "meaning" in output_of(cli("models", "stewart-gough")).split("parameter")[0]
    (table,) = [
        each for each in model_words("robot", None, [ModelOption("turn", "number", "0")]) if isinstance(each, TextTable)
    ]
    assert table.headers == ("option", "allowed", "default")
