"""Workspaces about the pose of a case: the box in world coordinates, solves in which it moves, and refusals."""

import copy
import itertools
import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from builders import PUSH_UP, Array, Run, case_file, case_from, ends, output_of, refusal_of, turn_about, unbroken
from measures import circle_joints
from path_cases import turns_of

from screwsynth.nlp import Case, CaseError, Solution, case_text, compare, judge_workspace, solve
from screwsynth.nlp.proof.statement.fixed_robot import workspace_of_case
from screwsynth.nlp.proof.workspace.robot.pose_box import PoseNumbers, pose_box
from screwsynth.nlp.solver.frames import pose_of

LEGS = (0.7, 1.2)
BASE: dict[str, Any] = {
    "units": {"length": "m"},
    "robot": {
        "model": "stewart-gough", "layout": "octahedral",
        "parameters": {"x1": {"min": 0.4, "max": 0.9}, "x2": 0.4, "x3": 15, "x4": 25},
    },
    "pose": {"position": [0, 0, {"min": 0.5, "max": 1.4}]},
    "task": [{"sense": "max", "axis": [1, 0, 0], "pitch": math.inf}],
    "limits": {"leg_length": {"min": 0.7, "max": 1.2}, "over": "workspace"},
    "workspace": {"about": "pose", "position": [ends(0.1)] * 3, "rotation": {"roll": ends(10), "pitch": ends(10)}},
    "solve": {"starts": 4},
}  # fmt: skip
#: Ten corners of the box: two signs of z for four of x and y, and a turn with each; then turns alone.
CORNERS = [
    *((x, y, z, math.copysign(10, x * z), 0.0) for x, y, z in itertools.product((-0.1, 0.1), repeat=3)),
    *((0.0, 0.0, 0.0, 0.0, pitch) for pitch in (-10.0, 10.0)),
]


def tables(*, about: str | None = "pose", **changes: object) -> dict[str, Any]:
    """Tables of the motion base, with others in the place of some, and the workspace about the pose or the world."""
    found = copy.deepcopy(BASE) | changes
    if about is None:
        del found["workspace"]["about"]
    return found


def lengths_at(design: Case, excursions: list[tuple[float, ...]]) -> Array:
    """Lengths (N, 6) of the legs of a design at excursions about its pose: a position, roll and pitch in degrees."""
    base, platform = circle_joints({name: float(design.components(name)[0]) for name in ("x1", "x2", "x3", "x4")})
    at = np.array(excursions)
    turns = turns_of(np.radians(np.pad(at[:, 3:], ((0, 0), (0, 1)))))
    spans = (
        (at[:, :3] + np.array(design.position, dtype=float))[:, None] + np.einsum("nij,kj->nki", turns, platform) - base
    )
    return np.asarray(np.linalg.norm(spans, axis=2))


def design_of(solution: Solution) -> Case:
    assert solution.workspace.is_proved
    return solution.workspace.judgement.case


def numbers_of(solution: Solution) -> dict[str, float]:
    own = solution.outcomes[0].own
    return dict(zip((each.name for each in own.nlp.program.variables), own.x.tolist(), strict=True))


def test_the_workspace_moves_with_a_free_pose() -> None:
    solution = solve(case_from(tables()))
    design = design_of(solution)
    rng = np.random.default_rng(0)
    inside = rng.uniform([-0.1, -0.1, -0.1, -10, -10], [0.1, 0.1, 0.1, 10, 10], (20_000, 5))
    corners = itertools.product((-0.1, 0.1), (-0.1, 0.1), (-0.1, 0.1), (-10, 10), (-10, 10))
    lengths = lengths_at(design, [*map(tuple, inside.tolist()), *corners])
    assert LEGS[0] <= lengths.min() <= LEGS[0] * (1 + 2e-3)
    assert lengths.max() <= LEGS[1]
    # The proof is about the box at the pose of the solution, and so are poses of the exchange.
    height = float(design.position[2])
    assert height == numbers_of(solution)["p_z"]
    proof = solution.workspace
    heights = proof.judgement.workspace.position[2]
    assert (heights.lower, heights.upper) == pytest.approx((height - 0.1, height + 0.1), rel=1e-12)
    box = pose_box(proof.judgement.workspace)
    for binding in proof.poses:
        assert np.abs(binding.pose.position - [0, 0, height]).max() <= 0.1 + 1e-9
        y = box.coordinates(binding.pose)
        assert y == pytest.approx(np.clip(y, box.lower, box.upper))
    # In world coordinates no height of a few gives a better design, and the nearest ones give nearly as good ones.
    best = []
    for z in (height - 0.02, height, height + 0.02):
        fixed = tables(about=None, pose={"position": [0, 0, z]})
        fixed["workspace"]["position"] = [ends(0.1, middle) for middle in (0, 0, z)]
        found = solve(case_from(fixed))
        best.append(found.F if found.status.is_answer else -math.inf)
    assert max(best) <= solution.F * (1 + 1e-4)
    assert best[1] == pytest.approx(solution.F, rel=1e-4)


def test_the_workspace_says_as_much_as_ten_of_its_poses_tied_by_hand_and_more() -> None:
    """Without such workspaces a case states ten poses, and a relation for each."""
    solution = solve(case_from(tables(objective={"over": "workspace"})))
    design = design_of(solution)
    poses, relations = [{"position": [0, 0, {"min": 0.5, "max": 1.4}]}], []
    for k, (x, y, z, roll, pitch) in enumerate(CORNERS):
        poses.append({"position": [x, y, {"min": 0.4, "max": 1.5}], "rotation": {"rpy": [roll, pitch, 0]}})
        relations.append(f"pose{k + 2}_p_z == pose1_p_z + {z}")
    limits = {"leg_length": {"min": LEGS[0], "max": LEGS[1]}, "custom": relations}
    tied = tables(pose=poses, limits=limits, combine={"over_poses": "worst"})
    del tied["workspace"]
    ten = solve(case_from(tied))
    lengths = lengths_at(design, [(0.0,) * 5, *CORNERS])
    assert LEGS[0] <= lengths.min()
    assert lengths.max() <= LEGS[1]
    assert 0.9 * ten.F < solution.F <= ten.F
    # Ten poses leave out the one at which their design breaks a limit.
    numbers = numbers_of(ten)
    held = tables(pose={"position": [0, 0, numbers["pose1_p_z"]]})
    held["robot"]["parameters"]["x1"] = numbers["x1"]
    judged = judge_workspace(case_from(held), with_objective=False)
    assert judged.is_refuted
    assert lengths_at(case_from(held), CORNERS).min() >= LEGS[0] * (1 - 1e-6)


def test_a_robot_whose_loops_decide_numbers_of_the_pose() -> None:
    """Of a 3-RPS x, y and yaw follow from height, roll and pitch: in the exchange they are further variables."""
    turns = {name: ends(10) for name in ("roll", "pitch", "yaw")}
    given = tables(
        robot={"model": "3-rps", "parameters": {"rb": ends(0.2, 1), "rp": 0.6, "h": 1.1}}, task=[PUSH_UP],
        pose={"position": [0, 0, {"min": 0.9, "max": 1.4}]}, limits={"leg_length": ends(0.2, 1.2), "over": "workspace"},
        workspace={"about": "pose", "position": [ends(0.04), ends(0.04), ends(0.05)], "rotation": turns},
    )  # fmt: skip
    solution = solve(case_from(given))
    position = list(design_of(solution).position)
    assert len(position) == 3
    assert len(solution.workspace.history) > 1
    place = [ends(0.04), ends(0.04), ends(0.05, position[2])]
    fixed = given | {"pose": {"position": position}, "workspace": {"position": place, "rotation": turns}}
    assert pytest.approx(solution.F, rel=1e-3) == solve(case_from(fixed)).F


@pytest.mark.parametrize(
    ("rotation", "turned"),
    [
        (None, {"rpy": [0, 0, 0]}),
        (None, {"axis": [1, 2, 2], "angle": 40}),
        ({"axis": [1, 2, 2], "angle": {"min": -10, "max": 25}}, {"axis": [1, 2, 2], "angle": 40}),
        ({"axis": [1, 2, 2], "angle": {"min": -10, "max": 25}}, {"axis": [-1, -2, -2], "angle": 40}),
        ({"angle": {"min": -20, "max": 20}}, {"axis": [0, 0, 1], "angle": 0}),
        ({"roll": {"min": -9, "max": 12}, "pitch": {"min": -9, "max": 5}, "yaw": 7}, {"axis": [1, 0, 0], "angle": 30}),
        ({"pitch": {"min": -9, "max": 5}, "yaw": {"min": 2, "max": 7}}, {"axis": [0, -1, 0], "angle": 30}),
        ({"yaw": {"min": 2, "max": 7}}, {"axis": [0, 0, 1], "angle": -130}),
    ],
)
def test_the_box_in_world_coordinates_is_that_of_all_excursions(
    rotation: dict[str, Any] | None, turned: dict[str, Any]
) -> None:
    given = tables(pose={"position": [0.3, -0.2, 0.9], "rotation": turned})
    given["robot"]["parameters"]["x1"] = 0.7
    given["workspace"]["position"] = [{"min": -0.1, "max": 0.3}, 0.05, {"min": -0.2, "max": 0.1}]
    given["workspace"].pop("rotation")
    if rotation is not None:
        given["workspace"]["rotation"] = rotation
    case = case_from(given)
    box, rng = pose_box(workspace_of_case(case)), np.random.default_rng(1)
    assert box.lower[:3] == pytest.approx([0.2, -0.15, 0.7], rel=1e-15)
    assert box.upper[:3] == pytest.approx([0.6, -0.15, 1.0], rel=1e-15)
    stated = PoseNumbers(np.array([0.3, -0.2, 0.9]), *_stated(case))
    for _ in range(200):
        at = stated.position + np.array([rng.uniform(-0.1, 0.3), 0.05, rng.uniform(-0.2, 0.1)])
        E = _random_turn(rotation or {}, rng)
        pose = pose_of(at, E @ stated.rotation)
        y = box.coordinates(pose)
        assert (box.lower - 1e-12 <= y).all()
        assert (y <= box.upper + 1e-12).all()
        assert np.abs(box.rotations(y[None])[0] - pose.rotation).max() < 1e-12
    # Ends of ranges are those of the excursions, turned along.
    for end in (box.lower, box.upper):
        E = box.rotations(end[None])[0] @ stated.rotation.T
        assert _is_end(E, rotation or {})


def _stated(case: Case) -> tuple[Array, Array, float]:
    axis, angle = np.array(case.rotation.axis, dtype=float), float(case.rotation.angle)
    return turn_about(axis, angle), axis, angle


def _names(rotation: dict[str, Any]) -> tuple[str, ...]:
    return ("angle",) if "angle" in rotation else ("roll", "pitch", "yaw")


def _ends(rotation: dict[str, Any], name: str) -> tuple[float, float]:
    stated = rotation.get(name, 0.0)
    low, high = (stated["min"], stated["max"]) if isinstance(stated, dict) else (stated, stated)
    return math.radians(low), math.radians(high)


def _turn(rotation: dict[str, Any], angles: list[float], axis: Array) -> Array:
    if len(angles) == 3:
        return turns_of(np.array([angles]))[0]
    return turn_about(rotation.get("axis", axis), angles[0])


def _random_turn(rotation: dict[str, Any], rng: np.random.Generator) -> Array:
    if not rotation:
        return np.eye(3)
    return _turn(rotation, [rng.uniform(*_ends(rotation, name)) for name in _names(rotation)], rng.normal(size=3))


def _is_end(E: Array, rotation: dict[str, Any]) -> bool:
    """Whether a rotation is that at the ends of all ranges; of turns about any axis at a corner of their box."""
    if not rotation:
        return bool(np.abs(E - np.eye(3)).max() < 1e-12)
    if "axis" not in rotation and "angle" in rotation:
        return True
    both = zip(*(_ends(rotation, name) for name in _names(rotation)), strict=True)
    found = [_turn(rotation, list(each), np.zeros(3)) for each in both]
    # A pose that is turned about the opposite axis turns the ends round.
    return any(np.abs(E - each).max() < 1e-12 for each in found)


def test_a_case_is_written_as_it_is_stated() -> None:
    case = case_from(tables())
    text = case_text(case)
    assert 'about = "pose"' in text
    again = case_from(text)
    assert again.workspace == case.workspace
    assert case_text(again) == text
    assert "about" not in case_text(case_from(tables(workspace={"position": [0, 0, {"min": 0.5, "max": 1}]})))


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        (
            {"pose": [{"position": [0, 0, 1]}, {"position": [0, 0, 0.9]}]},
            """workspace.about = "pose": must be 'world' for a case with several poses or with displacements""",
        ),
        (
            {"pose": {"position": [0, 0, 1], "displacements": [{"translation": [0, 0, 0.1]}]}},
            "must be 'world' for a case with several poses or with displacements",
        ),
        (
            {"pose": {"position": [0, 0, 1], "rotation": {"axis": [0, 1, 0], "angle": 10}}},
            "workspace.rotation: must be left out, or rotate about the axis of the pose's rotation: with about",
        ),
        (
            {"pose": {"position": [0, 0, 1], "rotation": {"angle": {"min": -10, "max": 10}}}},
            "workspace.rotation: must be left out, or rotate about the axis of the pose's rotation",
        ),
        (
            {"pose": {"position": [0, 0, 1], "rotation": {"axis": [1, 0, 0], "angle": {"min": 0, "max": 145}}}},
            "workspace.rotation.roll: must be at most 150 deg when added to the rotation angle",
        ),
    ],
)
def test_what_is_no_box_in_world_coordinates_is_refused(changes: dict[str, Any], fault: str) -> None:
    with pytest.raises(CaseError) as caught:
        case_from(tables(**changes))
    assert fault in str(caught.value)


def test_a_free_pose_is_refused_where_one_machine_is_judged(tmp_path: Path, cli: Run) -> None:
    words = "pose.position[2]: must be fixed, as the workspace is relative to the pose: use --set p_z=... or --of"
    command = ("workspace", str(case_file(tmp_path, BASE)), "--set", "x1=0.8")
    refusal_of(cli(*command), words)
    code, out, err = cli(*command, "--set", "p_z=0.8", "--time", "5")
    assert (code, err, "violated" in out) == (1, "", True)
    turned = tables(pose={"position": [0, 0, 1], "rotation": {"angle": ends(10)}})
    del turned["workspace"]["rotation"]
    case_file(tmp_path, turned)
    refusal_of(cli(*command), "pose.rotation.angle: must be fixed")


def test_all_commands_take_the_workspace_at_the_pose_of_a_result(tmp_path: Path, cli: Run) -> None:
    file, result, proof = case_file(tmp_path, BASE, "base.toml"), str(tmp_path / "result"), str(tmp_path / "proof")
    assert cli("solve", str(file), "--json", result)[::2] == (0, "")
    height = json.loads(Path(result).read_text(encoding="utf-8"))["pose"]["position"][2]
    pictures = [str(tmp_path / name) for name in ("slices.svg", "pose.svg", "page.html")]
    drawn = [word for pair in zip(("--plot", "--plot-pose", "--html"), pictures, strict=True) for word in pair]
    words = ("--of", result, "--proof", proof, *drawn, "--quantity", "condition_number")
    out = output_of(cli("workspace", str(file), *words))
    assert "PROVED at every pose" in unbroken(out)
    assert f"workspace relative to  the stated pose (0, 0, {height:.5g})" in unbroken(out)
    assert all(Path(each).stat().st_size > 1000 for each in pictures)
    out = unbroken(output_of(cli("verify-proof", proof, str(file), "--of", result, "--all")))
    low, high = (float(each) for each in out.partition(", z ")[2].partition(" m;")[0].split(" to "))
    assert (low, high) == pytest.approx((height - 0.1, height + 0.1), rel=1e-12)
    # Outwards, so that every excursion is one of the box.
    assert low <= height - 0.1
    assert high >= height + 0.1
    code, _, err = cli("verify-proof", proof, str(file), "--of", result, "--set", "p_z=0.8")
    assert (code, err) == (1, "rejected: the proof is for another workspace than that of this case\n")
    assert "largest proved box  1 times the workspace" in output_of(
        cli("workspace", str(file), "--of", result, "--scale", "--time", "8")
    )
    assert cli("path", str(file), "--range", "--of", result, "--time", "3")[::2] in ((0, ""), (1, ""))
    output_of(cli("codegen", str(file), "--out", str(tmp_path / "c"), "--no-measure"))
    assert cli("evaluate", str(file), "--of", result)[0] == 0
    other = case_file(tmp_path, BASE, "other.toml")
    code, out, err = cli("workspace", str(other), "--of", result)
    assert (code, err) == (0, f"--of {result}: gives the dimensions and the pose of the case 'base'\n")


def test_robots_are_compared_over_workspaces_about_their_own_poses() -> None:
    found = compare(case_from(tables(limits={"leg_length": {"min": 0.5, "max": 1.5}})), ["case", "6-pus"], jobs=1)
    for entry in found.entries:
        assert entry.judgement is not None, entry.workspace_fault
        heights = entry.judgement.workspace.position[2]
        assert (heights.lower + heights.upper) / 2 == pytest.approx(float(entry.judgement.case.position[2]))


def test_the_schema_has_the_origin(cli: Run) -> None:
    schema = json.loads(cli("schema")[1])
    jsonschema.validate(tables(), schema)
    wrong = tables()
    wrong["workspace"]["about"] = "robot"
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(wrong, schema)
    with pytest.raises(CaseError, match=r"workspace\.about"):
        case_from(wrong)


HELD = {
    "z is -0.1 to 0.1 m there and 0.5 to 1.4 m at the pose": {},
    "x is -0.1 to 0.1 m there and 0.3 m at the pose": {"pose": {"position": [0.3, 0, {"min": -0.3, "max": 0}]}},
    "roll is -10 to 10 deg there and 20 deg at the pose": {
        "pose": {"position": [0, 0, 0], "rotation": {"axis": [1, 0, 0], "angle": 20}}
    },
    "yaw is 0 deg there and 19.": {"pose": {"position": [0, 0, 0], "rotation": {"rpy": [5, 0, 19.5]}}},
    "": {"pose": {"position": [0.1, -0.1, {"min": 0.1, "max": 1.4}], "rotation": {"rpy": [10, -10, 0]}}},
}


def notice_of(given: dict[str, Any]) -> str:
    """The sentence about a workspace that holds no pose; empty for another."""
    found = case_from(given).outside_workspace
    assert found is None or len(found.sentence) < 200
    return "" if found is None else found.sentence


@pytest.mark.parametrize("words", HELD)
def test_a_workspace_that_does_not_hold_the_pose_is_said_before_the_search(words: str) -> None:
    given = tables(about=None, **HELD[words])
    notice = notice_of(given)
    offer = '; write about = "pose" in [workspace] if its values are excursions from the pose'
    assert notice.startswith("the workspace does not contain the pose: " + words if words else "")
    assert notice.endswith(offer if words else "")
    if "rotation" not in HELD[words].get("pose", {}):
        given["workspace"]["about"] = "pose"
        assert not notice_of(given)


def test_of_several_poses_one_in_the_workspace_is_enough() -> None:
    given = tables(about=None, pose=[{"position": [0, 0, 0]}, {"position": [0, 0, 2]}])
    assert not notice_of(given)
    given["pose"][0]["position"][2] = 1
    notice = "the workspace does not contain the poses: z is -0.1 to 0.1 m there and 1 m at the pose"
    assert notice_of(given) == notice


def test_a_workspace_elsewhere_is_no_mistake_of_excursions(tmp_path: Path, cli: Run) -> None:
    given = tables(about=None, pose={"position": [0, 0, 1.2]})
    given["workspace"]["position"][2], given["robot"]["parameters"]["x1"] = {"min": 0.7, "max": 0.8}, 0.8
    notice = "the workspace does not contain the pose: z is 0.7 to 0.8 m there and 1.2 m at the pose"
    assert notice_of(given) == notice
    del given["limits"]["over"]
    assert cli("workspace", str(case_file(tmp_path, given)), "--time", "1")[2] == ""


def test_the_commands_say_it_and_nothing_else_on_standard_error(tmp_path: Path, cli: Run) -> None:
    """A point without a finite value gave a warning of NumPy, and the evidence of a stationary point."""
    limits = {"leg_length": {"min": 0.75, "max": 1.2}, "over": "workspace"}
    file = case_file(tmp_path, tables(about=None, solve={"starts": 1}, limits=limits))
    said = "the workspace does not contain the pose: z is -0.1 to 0.1 m there and 0.5 to 1.4 m at the pose; write about"
    for command in (("solve",), ("workspace", "--set", "x1=0.7", "--time", "2")):
        code, out, err = cli(command[0], str(file), *command[1:])
        assert code == 1
        assert err.startswith(said)
        assert len(err.splitlines()) == 1
        assert command[0] != "solve" or f"note  {said}" in unbroken(out)
