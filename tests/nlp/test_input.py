"""Numbers and files of a case beside its text: settings, CSV files, rotations, and angles in Python."""

import json
import math
import re
import tomllib
from collections.abc import Callable
from math import pi, radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import (
    EACH_KIND,
    Run,
    case_from,
    edited,
    output_of,
    refusal_of,
    saved,
    soaked,
    starter_tables,
    starter_text,
    turn_about,
)

import screwsynth.cases
from screwsynth.models import model_names, robot_function, stewart_gough
from screwsynth.nlp import (
    BaseJointAngle,
    Case,
    CaseError,
    Free,
    InputError,
    JointMotion,
    Limits,
    MountingPose,
    Pose,
    QuantityLimit,
    Rotation,
    Task,
    TurnKind,
    Turns,
    Workspace,
    load_case,
    shipped_cases,
)
from screwsynth.nlp.case.reader import read_case
from screwsynth.nlp.case.toml import toml_document

CASES = Path(screwsynth.cases.__file__).parent

HEAD = """
units = { length = "mm" }
robot = { model = "stewart-gough", parameters = { x1 = { min = 10, max = 12 }, x2 = 8, x3 = 20, x4 = 8 } }
"""
POSE = "[pose]\nposition = [1, 2, 30]\nrotation = {}\n"
TASK = '[[task]]\nsense = "max"\naxis = [2, 2, 1]\npoint = [2, 3, 6]\npitch = 1\n'


def written(folder: Path, text: str, name: str = "case.toml") -> str:
    return str(saved(folder / name, text))


def rotated_text(rotation: str) -> str:
    return HEAD + POSE.replace("{}", f"{{ {rotation} }}") + TASK


def rotated(folder: Path, rotation: str) -> str:
    return written(folder, rotated_text(rotation))


def data(cli: Run, *arguments: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(output_of(cli(*arguments, "--json", "-")))
    return found


def test_solve_with_settings_solves_the_edited_case(tmp_path: Path, cli: Run) -> None:
    text = (CASES / "paper-4.1-helical.toml").read_text(encoding="utf-8")
    path = written(tmp_path, text, "original.toml")
    settings = ("--set", "x1=11", "--set", "p_z.max=45", "--set", "limits.leg_length.max=50", "--set", "angle.max=20")
    found = data(cli, "solve", path, "--starts", "3", *settings, "--set", "angle.min=-20")
    edits = [
        ("x1 = 12", "x1 = 11"),
        ("min = 20, max = 50", "min = 20, max = 45"),
        ("min = -30, max = 30", "min = -20, max = 20"),
    ]
    text = edited(text, *edits, ("[[task]]", "[limits]\nleg_length = { max = 50 }\n[[task]]"))
    other = data(cli, "solve", written(tmp_path, text, "edited.toml"), "--starts", "3")
    assert found["F"] == other["F"]
    assert found["pose"] == other["pose"]
    assert found["limits"][0]["limit"] == 50
    assert found["parameters"]["x1"] == 11


def test_a_proof_with_settings_is_of_the_case_with_them(tmp_path: Path, cli: Run) -> None:
    proof = str(tmp_path / "set.proof")
    output_of(cli("certify", "paper-4.1-helical", "--set", "p_z=40", "--starts", "2", "--proof", proof))
    out = output_of(cli("verify-proof", proof))
    best = data(cli, "solve", "paper-4.1-helical", "--set", "p_z=40", "--starts", "4")["F"]
    bound = float(out.split("F is at most ")[1].split(" ")[0])
    assert best <= bound <= best * (1 + 2e-4)
    # The case as the file has it is another one.
    assert cli("verify-proof", proof, "paper-4.1-helical")[0] != 0


def test_pages_and_c_carry_the_case_with_its_settings(tmp_path: Path, cli: Run) -> None:
    case = written(tmp_path, (CASES / "paper-4.1-helical.toml").read_text(encoding="utf-8"))
    folder = tmp_path / "c"
    assert cli("codegen", case, "--no-measure", "--set", "x1=10.5", "--out", str(folder))[0] == 0
    assert tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))["robot"]["parameters"]["x1"] == 10.5
    pytest.importorskip("plotly")
    page = tmp_path / "page.html"
    assert cli("report", case, "--set", "x1=10.5", "--starts", "2", "--out", str(page))[0] == 0
    text = page.read_text(encoding="utf-8")
    assert "x1 = 10.5" in text
    assert "Published and computed" not in text, "the numbers in print are of another case"


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("y=1", "cannot be set"),
        ("x1.min=1", "x1 is fixed"),
        ("limits.leg_lenght.max=1", "limits.leg_lenght"),
        ("limits.leg_length=1", "limits.leg_length"),
        ("limits.leg_length.mx=1", "no such key"),
        ("limits.=1", "cannot be set"),
        ("limits.leg_length.max=-1", "above 0 cm"),
    ],
)
def test_settings_that_every_command_refuses(setting: str, words: str, tmp_path: Path, cli: Run) -> None:
    target = ("--out", str(tmp_path / "out"))
    for command in (("solve",), ("certify",), ("report", *target), ("codegen", *target), ("evaluate",)):
        refusal_of(cli(*command, "paper-4.1-helical", "--set", setting), words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("y1=3", ("y1", "cannot be set", "x1")),
        ("x_1=3", ("x_1", "cannot be set", "did you mean 'x1'?")),
        ("angel=3", ("angel", "cannot be set", "did you mean 'angle'?")),
        ("axs=0,0,1", ("axs", "cannot be set", "did you mean 'axis'?")),
        ("pz=3", ("pz", "cannot be set", "did you mean 'p_z'?")),
        ("seed=3", ("seed", "cannot be set")),
        ("x1", ("--set x1", "NAME=NUMBER")),
        ("=3", ("--set =3", "NAME=NUMBER")),
        ("", ("--set", "NAME=NUMBER")),
        ("x1=abc", ("--set x1=abc", "NAME=NUMBER")),
        ("x1=3,", ("--set x1=3,", "NAME=NUMBER")),
        ("x1==3", ("--set x1==3", "NAME=NUMBER")),
        ("axis=0 0 1", ("--set axis=0 0 1", "axis=X,Y,Z")),
        ("x1=nan", ("robot.parameters.x1", "finite")),
        ("p_x=inf", ("pose.position[0]", "finite")),
        ("x1=1,2", ("--set x1=1,2", "must be NAME=NUMBER", "write 1.2: a decimal number has a point")),
        ("x1=1,2,3", ("robot.parameters.x1", "must be a number")),
        ("x3=40", ("robot.parameters.x3", "between 0 deg and 30 deg")),
        ("p_y=1,2,3", ("pose.position[1]", "must be a number")),
        ("axis=0,0,0", ("pose.rotation.axis", "zero")),
        ("axis=1", ("pose.rotation.axis", "list")),
        ("axis=1,2", ("pose.rotation.axis", "3 entries")),
        ("angle=180", ("pose.rotation.angle", "at most 179 deg")),
        ("angle=1,2,3", ("pose.rotation.angle", "must be a number")),
    ],
)
def test_settings_that_are_not_allowed(setting: str, words: tuple[str, ...], cli: Run) -> None:
    refusal_of(cli("evaluate", "paper-4.1-helical", "--set", setting, "--json", "-"), *words)


def test_a_cone_about_home_keeps_what_it_is_about() -> None:
    case = load_case("hexapod-machining", {"limits.base_joint_angle": 12.0, "limits.platform_joint_angle.max": 13.0})
    limits = {limit.name: limit for limit in case.limits}
    for name, largest in (("base_joint_angle", 12), ("platform_joint_angle", 13)):
        assert limits[name].max == pytest.approx(math.radians(largest))  # type: ignore[attr-defined]
        assert limits[name].about is not None  # type: ignore[attr-defined]


@pytest.mark.parametrize("robots", soaked([EACH_KIND, model_names()], [EACH_KIND]), ids=["kinds", "all"])
def test_the_text_of_tables_reads_as_the_same_tables(robots: tuple[str, ...]) -> None:
    texts = [(CASES / f"{name}.toml").read_text(encoding="utf-8") for name in shipped_cases()]
    texts += map(starter_text, robots)
    odd = 'b = [-inf, "q\\"\\u0007\\u007f", []]\n["odd key"]\nc = { "x y" = [{ d = true }, 1e-300] }\ne = {}\n'
    texts.append(f"a = inf\n{odd}")
    for text in texts:
        tables = tomllib.loads(text)
        assert tomllib.loads(toml_document(tables)) == tables


def test_poses_and_tasks_from_csv_files_are_those_of_tables(tmp_path: Path, cli: Run) -> None:
    (tmp_path / "far").mkdir()
    rows = "x, y, z, roll, pitch, yaw\n1, 2, 30, 0, 0, 5\n\n-1,2,31,3,-4,5\n0,0,29,,,\n"
    written(tmp_path, rows, "far/trajectory.csv")
    columns = "sense;name;axis_x;axis_y;axis_z;point_x;point_y;point_z;pitch;weight"
    written(tmp_path, f"{columns}\nmax;;2;2;1;2;3;6;1;2\nmin;lift;0;0;1;;;;inf;\n", "tasks.csv")
    files = 'poses = "far/trajectory.csv"\ntasks = "tasks.csv"\n'
    found = data(cli, "evaluate", written(tmp_path, files + HEAD))
    poses = "".join(
        f"[[pose]]\nposition = {place}\n{rotation}\n"
        for place, rotation in (
            ([1, 2, 30], "rotation = { axis = [0, 0, 1], angle = 5 }"),
            ([-1, 2, 31], "rotation = { rpy = [3, -4, 5] }"),
            ([0, 0, 29], ""),
        )
    )
    tasks = f'{TASK}weight = 2\n[[task]]\nname = "lift"\nsense = "min"\naxis = [0, 0, 1]\npitch = inf\n'
    other = data(cli, "evaluate", written(tmp_path, HEAD + poses + tasks, "tables.toml"))
    assert len(found["poses"]) == 3
    assert [task["name"] for task in found["tasks"]] == ["task 1", "lift"]
    for result in (found, other):
        del result["case"], result["versions"]
    assert np.allclose(found["F"], other["F"], rtol=1e-14, atol=0)
    for one, two in zip(found["poses"], other["poses"], strict=True):
        assert np.allclose(one["jacobian"], two["jacobian"], rtol=0, atol=1e-14)
        assert np.allclose(one["pose"]["rotation_matrix"], two["pose"]["rotation_matrix"], rtol=0, atol=1e-15)
    # A row's number can be set, and the text that goes with the case needs no other file.
    text = read_case(str(tmp_path / "case.toml"), {"pose2_p_x": 7.0}).text
    alone = load_case(written(tmp_path, text, "alone.toml"))
    assert [pose.position[0] for pose in alone.poses] == [1, 7, 0]
    assert [task.weight for task in alone.tasks] == [2, 1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x,y,z\n1,2,30\n\n1,2,abc\n", ("trajectory.csv: row 4, column z", '"abc"', "must be a number")),
        ("x,y,z\n1,,30\n", ("row 2, column y", "got an empty cell")),
        ("x,y,z\n1,inf,30\n", ("row 2, column y = inf", "finite")),
        ("x,y,z\n1,2,30\n1e40,2,3\n", ("row 3, column x = 1e+40", "at most 1e+30")),
        ("x,y,z,angle\n1,2,30,400\n", ("row 2, column angle = 400", "at most 179 deg")),
        ("x,y,z,qw,qx,qy,qz\n1,2,3,1,0,0,0\n1,2,30,1,1,0,0\n", ("row 3, columns qw, qx, qy, qz", "unit quaternion")),
        ("x,y,z,axis_x,axis_y,axis_z\n1,2,30,0,0,1\n", ("row 2", "angle", "missing")),
        ("x,y,z\n1,2\n", ("row 2", "must have 3 cells, got 2")),
        ("x,y\n1,2\n", ("row 1", "column z is missing")),
        ("x,y,z,rol\n1,2,3,4\n", ("row 1", "no such column", "did you mean 'roll'?")),
        ("x,y,z,z\n1,2,3,4\n", ("row 1", "'z' appears twice")),
        ("x,y,z,angle,roll,pitch,yaw\n1,2,3,4,5,6,7\n", ("row 1", "'angle' conflicts with 'roll'")),
        ("x,y,z\n", ("trajectory.csv", "no rows")),
        ("", ("trajectory.csv", "no rows")),
        ("x,y,z\n" + "1,2,3\n" * 1001, ("trajectory.csv", "at most 1000 rows", "got 1001")),
        ("x,y,z\n" + " " * 4_000_001, ("poses", "larger than 4 MB")),
        ("\0", ("trajectory.csv",)),
    ],
)
def test_faults_of_a_csv_file_name_row_and_column(text: str, words: tuple[str, ...], tmp_path: Path, cli: Run) -> None:
    written(tmp_path, text, "trajectory.csv")
    refusal_of(cli("evaluate", written(tmp_path, 'poses = "trajectory.csv"\n' + HEAD + TASK)), *words)


def test_faults_of_a_task_row(tmp_path: Path) -> None:
    case = written(tmp_path, 'tasks = "tasks.csv"\n' + HEAD + POSE.replace("rotation = {}", ""))
    axis, twist = "sense,axis_x,axis_y,axis_z,pitch", "sense,omega_x,omega_y,omega_z,v_x,v_y,v_z"
    for text, words in (
        (f"{axis}\nmost,0,0,1,inf\n", "row 2, column sense"),
        (f"{axis}\nmax,0,0,1,inf\nmax,0,0,0,inf\n", "row 3, columns axis_x, axis_y, axis_z"),
        (f"{axis}\nmax,0,0,1,2\n", "row 2, point: is missing"),
        (f"{twist}\nmax,0,0,0,0,0,0\n", "row 2, columns omega_x"),
        (f"name,{twist}\na,max,0,0,1,0,0,0\na,max,0,0,0,1,0,0\n", "row 3, column name"),
    ):
        written(tmp_path, text, "tasks.csv")
        with pytest.raises(InputError, match=f"^tasks.csv: {words}"):
            load_case(case)


def test_a_csv_file_that_is_not_there_or_not_alone(tmp_path: Path) -> None:
    head = f'poses = "missing.csv"\n{HEAD}'
    for text, words in ((head, "cannot be read: No such file"), (head + POSE, r"conflicts with \[\[pose\]\]")):
        with pytest.raises(CaseError, match=f'^case.toml: poses = "missing.csv": {words}'):
            load_case(written(tmp_path, text + TASK))
    (tmp_path / "missing.csv").write_bytes(b"x,y,z\n\xff")
    with pytest.raises(CaseError, match=r"^case.toml: poses = .*: cannot be read: it is not UTF-8"):
        load_case(written(tmp_path, head + TASK))


@pytest.mark.parametrize("angles", [(10, 20, 30), (0, 0, 0), (90, 90, 0), (-170, 80, 179), (180, 0, 0), (400, -95, 3)])
def test_forms_of_a_rotation_are_one_rotation(angles: tuple[float, float, float], tmp_path: Path, cli: Run) -> None:
    expected = np.linalg.multi_dot([turn_about(np.eye(3)[k], math.radians(angles[k])) for k in (2, 1, 0)])

    def matrix(rotation: str) -> np.ndarray:
        return np.array(data(cli, "evaluate", rotated(tmp_path, rotation))["pose"]["rotation_matrix"])

    assert np.allclose(matrix(f"rpy = {list(angles)}"), expected, rtol=0, atol=1e-14)
    rows = [[float(f"{part:.8f}") for part in row] for row in expected]
    assert np.allclose(matrix(f"matrix = {rows}"), expected, rtol=0, atol=2e-8)
    # The quaternion of the same rotation, from axis and angle of the JSON result.
    pose = data(cli, "evaluate", rotated(tmp_path, f"rpy = {list(angles)}"))["pose"]
    half = math.radians(pose["angle"]) / 2
    quaternion = [math.cos(half), *(math.sin(half) * part for part in pose["axis"])]
    for sign in (1, -1):
        given = [sign * part for part in quaternion]
        assert np.allclose(matrix(f"quaternion = {given}"), expected, rtol=0, atol=1e-14)


def test_forms_of_a_rotation_in_python() -> None:
    angle = math.radians(40)
    for rotation in (
        Rotation.from_matrix(turn_about([1, 0, 0], angle)),
        Rotation.from_rpy(angle, 0, 0),
        Rotation.from_quaternion([math.cos(angle / 2), math.sin(angle / 2), 0, 0]),
    ):
        assert np.allclose(np.asarray(rotation.axis, dtype=np.float64), [1, 0, 0], rtol=0, atol=1e-15)
        assert rotation.angle == pytest.approx(angle, abs=1e-15)
    with pytest.raises(CaseError, match="orthogonal"):
        Rotation.from_matrix(2 * np.eye(3))


@pytest.mark.parametrize(
    ("rotation", "words"),
    [
        ("matrix = [[1, 0, 0], [0, 1, 0.001], [0, 0, 1]]", ("pose.rotation.matrix", "orthogonal", "0.001")),
        ("matrix = [[1, 0, 0], [0, 0, 1], [0, 1, 0]]", ("pose.rotation.matrix", "reflection")),
        ("matrix = [[1e200, 0, 0], [0, 0, 1], [0, 1, 0]]", ("pose.rotation.matrix", "orthogonal")),
        ("matrix = [[1, 0], [0, 1]]", ("pose.rotation.matrix",)),
        ("matrix = 3", ("pose.rotation.matrix", "3 rows")),
        ("quaternion = [1, 0, 0, 0.01]", ("pose.rotation.quaternion", "unit", "1.00005")),
        ("quaternion = [0, 0, 0, 0]", ("pose.rotation.quaternion", "unit")),
        ("quaternion = [1, 0, 0]", ("pose.rotation.quaternion", "4 entries")),
        ("rpy = [1, 2]", ("pose.rotation.rpy", "3 entries")),
        ("rpy = [1, 2, nan]", ("pose.rotation.rpy[2]", "finite")),
        ("rpy = [1, 2, 3], angle = 3", ("pose.rotation.angle", "conflicts with rpy")),
        ("quaternion = [1, 0, 0, 0], axis = [0, 0, 1]", ("pose.rotation.axis", "conflicts with quaternion")),
        ("rpy = [1, 2, 3], quaternion = [1, 0, 0, 0]", ("pose.rotation.quaternion", "conflicts with rpy")),
        ("axis = [0, 0, 1]", ("pose.rotation.angle", "is missing")),
    ],
)
def test_rotations_that_are_refused(rotation: str, words: tuple[str, ...], tmp_path: Path, cli: Run) -> None:
    refusal_of(cli("evaluate", rotated(tmp_path, rotation)), *words)


def test_the_schema_knows_files_and_forms_of_rotations(cli: Run) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(json.loads(cli("schema")[1]))
    good = [f'poses = "a.csv"\n{HEAD}{TASK}', f'tasks = "a.csv"\n{HEAD}{POSE.replace("rotation = {}", "")}']
    forms = "rpy = [1, 2, 3]", "matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]", "quaternion = [1, 0, 0, 0]"
    good += [rotated_text(form) for form in forms]
    for text in good:
        validator.validate(tomllib.loads(text))
    bad = [HEAD + TASK, f'poses = "a.csv"\n{HEAD}{POSE}{TASK}'.replace("rotation = {}", "")]
    bad += [rotated_text(f"rpy = [1, 2, 3], {more}") for more in ("angle = 1", "axis = [0, 0, 1]")]
    for text in bad:
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(tomllib.loads(text))


SCREW = Task.screw("max", axis=(2, 2, 1), point=(2, 3, 6), pitch=1)
OWN = {"x1": 12.0, "x2": 8.0, "x3": radians(30), "x4": radians(8)}


def plain(**changes: Any) -> Case:  # noqa: ANN401 - numbers of a case
    """A case of six legs with something else in it."""
    given: dict[str, Any] = {"parameters": OWN, "position": (0, 0, 30)}
    return Case(model=stewart_gough(), tasks=[SCREW], **(given | changes))


def turning(kind: TurnKind, *angles: float | Free) -> Case:
    """A case over a workspace with these rotations."""
    return plain(workspace=Workspace((0, 0, Free(20, 30)), Turns(kind, angles)))


def delta(**changes: Any) -> Case:  # noqa: ANN401 - numbers of a case
    """A case of a Delta with another number in it, or with limits."""
    model = robot_function("delta")()
    parameters = {item.name: item.typical[0] for item in model.parameters} | changes.pop("parameters", {})
    return Case(model=model, parameters=parameters, position=model.home, tasks=[SCREW], **changes)


@pytest.mark.parametrize(
    ("make", "key", "angle"),
    [
        (lambda: plain(parameters=OWN | {"x3": 30}), "robot.parameters.x3", 30),
        (lambda: plain(parameters=OWN | {"x3": Free(0.1, 30, 20)}), "robot.parameters.x3.max", 30),
        (lambda: plain(rotation=Rotation((0, 0, 1), 30)), "pose.rotation.angle", 30),
        (lambda: plain(rotation=Rotation(None, Free(-30, 30))), "pose.rotation.angle.min", -30),
        (lambda: plain(further=[Pose((0, 0, 9), Rotation((0, 0, 1), 45))]), "pose[1].rotation.angle", 45),
        (lambda: plain(limits=Limits(BaseJointAngle(5))), "limits.base_joint_angle.max", 5),
        (lambda: plain(limits=Limits(BaseJointAngle(1, MountingPose((0, 0, 20), angle=15)))), "limits.home.angle", 15),
        (lambda: turning(TurnKind.ANY_AXIS, Free(-20, 20)), "workspace.rotation.angle.min", -20),
        (lambda: turning(TurnKind.ROLL_PITCH_YAW, 0.0, Free(0, 0.1), Free(0, 20)), "workspace.rotation.yaw.max", 20),
        # Of these a file may state any number.
        (lambda: delta(parameters={"tilt": 20}), "robot.parameters.tilt", 20),
        (lambda: delta(limits=Limits(QuantityLimit("actuator_angle", max=45))), "limits.actuator_angle.max", 45),
        (lambda: delta(limits=Limits(JointMotion("1:1", max=40))), "limits.joint.1:1.max", 40),
    ],
)  # fmt: skip
def test_degrees_in_the_place_of_radians_are_refused_in_both(make: Callable[[], Case], key: str, angle: float) -> None:
    words = f"; {angle} rad = {angle * 180 / pi:.1f} deg; angles are radians in Python"
    with pytest.raises(CaseError, match=rf"^{re.escape(key)} = .*{re.escape(words)}$") as found:
        make()
    assert found.value.key == key
    assert found.value.value == pytest.approx(angle * 180 / pi)


def test_a_file_has_degrees_and_no_word_of_radians() -> None:
    tables = starter_tables("delta")
    tables["robot"]["parameters"]["tilt"] = 400
    case = case_from(tables, "delta")
    assert case_from(tomllib.loads(case.to_toml())).parameters["tilt"] == case.parameters["tilt"]
    tables["pose"]["rotation"] = {"angle": 400}
    with pytest.raises(CaseError, match=r"must be at most 179 deg in magnitude with a free axis$"):
        case_from(tables, "delta")
    # Numbers that are no angles, and angles up to a turn, are taken.
    assert plain(rotation=Rotation((0, 0, 1), 2 * pi)).rotation.angle == 2 * pi
    assert delta(parameters={"tilt": -2 * pi}).parameters["tilt"] == (-2 * pi,)
    with pytest.raises(CaseError) as found:
        plain(parameters=OWN | {"x1": -1.0})
    assert "rad" not in str(found.value)
