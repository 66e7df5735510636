"""What the commands print, write and return."""

import json
import math
import os
import re
import stat
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from builders import EACH_KIND, Run, assert_words, edited, output_of, refusal_of, saved, soaked, starter_text, unbroken

import screwsynth.cases
from screwsynth.models import model_names
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp import shipped_cases
from screwsynth.nlp.cli.app import SUMMARIES, command_of

CASES = Path(screwsynth.cases.__file__).parent
HELICAL = (CASES / "paper-4.1-helical.toml").read_text(encoding="utf-8")
POSITION = "position = [{ min = -10, max = 10 }, { min = -10, max = 10 }, { min = 20, max = 50 }]"
ROTATION = "rotation = { angle = { min = -30, max = 30 } }"
#: Edits by which the joints of every leg coincide in the middle of x1, where the first search begins.
COINCIDING = (
    ("x1 = 12", "x1 = { min = 4, max = 12 }"),
    ("x3 = 30", "x3 = 8"),
    (POSITION, "position = [0, 0, 0]"),
    (ROTATION, ""),
)
MOTION = "axis = [2, 2, 1]\npoint = [2, 3, 6]\npitch = 1\n"


#: The process of a solve, and the result that it wrote.
Solved = tuple[subprocess.CompletedProcess[str], Path]


def process(*arguments: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "screwsynth.nlp", *arguments]
    env = {**os.environ, **environment}
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=False)


def case_file(folder: Path, *edits: tuple[str, str], search: str = "starts = 3") -> str:
    return str(saved(folder / "case.toml", edited(HELICAL, *edits) + f"\n[solve]\n{search}\n"))


def strict(text: str) -> dict[str, Any]:
    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        keys = [key for key, _ in pairs]
        assert len(set(keys)) == len(keys)
        return dict(pairs)

    found = json.loads(text, object_pairs_hook=once)
    assert isinstance(found, dict)
    # NaN is no JSON, and 1e999 reads as infinity: neither can be written again.
    json.dumps(found, allow_nan=False)
    return found


def check_state(result: dict[str, Any], *, rows: int = 6, length: float = 1.0) -> None:
    """The parts that solve and evaluate share."""
    assert result["schema"] == 1
    assert set(result["units"]) == {"length", "angle"}
    pose, task = result["pose"], result["task"]
    assert {"position", "axis", "angle", "rotation_matrix"} <= set(pose)
    assert {"twist", "axis", "point", "pitch"} <= set(task)
    J, twist, rates = np.array(result["jacobian"]), np.array(task["twist"]), np.array(result["rates"])
    assert (J.shape, twist.shape) == ((rows, 6), (6,))
    # Rows are force then moment, a twist is angular velocity then velocity.
    np.testing.assert_allclose(rates, J[:, :3] @ twist[3:] + J[:, 3:] @ twist[:3], rtol=1e-9, atol=1e-9)
    forces = np.linalg.norm(J[:, :3], axis=1) > 0
    units = np.where(forces[:, None], J[:, :3], J[:, 3:] / length)
    np.testing.assert_allclose(np.linalg.norm(units, axis=1), 1, rtol=1e-12)
    R, axis = np.array(pose["rotation_matrix"]), np.array(pose["axis"])
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(R @ axis, axis, atol=1e-9)
    angle = math.radians(pose["angle"]) if result["units"]["angle"] == "deg" else pose["angle"]
    assert np.trace(R) == pytest.approx(1 + 2 * math.cos(angle), abs=1e-9)
    assert result["rank"] in range(1, 7)
    # Moments about the platform's origin in parts of the longest: plain numbers.
    moments = J[:, 3:] - np.cross(pose["position"], J[:, :3])
    plain = np.hstack([J[:, :3], moments / np.linalg.norm(moments, axis=1).max()])
    values = np.linalg.svd(plain, compute_uv=False)
    np.testing.assert_allclose(result["singular_values"], values, rtol=1e-9, atol=1e-9)
    assert set(result["versions"]) >= {"screwsynth", "casadi", "numpy", "python"}
    if result["F"] is not None:
        assert float(np.sum(rates**2)) == pytest.approx(result["F"], rel=1e-12, abs=1e-12)


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Solved:
    folder = tmp_path_factory.mktemp("solved")
    ended = process("solve", "paper-4.1-helical", "--starts", "4", "--json", "result.json", folder=folder)
    return ended, folder / "result.json"


@pytest.mark.parametrize("name", SUMMARIES)
def test_help_lists_each_command_by_the_first_line_of_its_own_help(name: str) -> None:
    command = command_of(name)
    assert command.name == name
    assert command.help.split("\n\n")[1].split() == SUMMARIES[name].split()


def test_a_solve_as_a_process_prints_only_its_table(solved: Solved) -> None:
    ended, _ = solved
    assert (ended.returncode, ended.stderr) == (0, "")
    title, task, axis, found, *_ = unbroken(ended.stdout).splitlines()
    assert title == "Pose of a given 6-6 platform for a screw motion of pitch 1"
    assert task.startswith("task  drive the screw, max F: screw, pitch 1 cm, axis (0.6667, 0.6667, 0.3333), through")
    assert task.endswith("through (2, 3, 6)")
    assert axis == "task axis  nearest to the origin at (-1.556, -0.5556, 4.222)"
    assert found.startswith("largest F = 407.2107")
    assert "4 of 4 converged" in ended.stdout
    assert not re.search(r"Ipopt|IPOPT|EXIT:|CasADi|Eclipse|coin-or|nlp_f|solver|\*\*\*\*|\x1b", ended.stdout)


def test_the_result_has_the_documented_keys(solved: Solved) -> None:
    result = strict(solved[1].read_text(encoding="utf-8"))
    check_state(result)
    assert result["title"] == "Pose of a given 6-6 platform for a screw motion of pitch 1"
    assert (result["case"], result["units"]) == ("paper-4.1-helical", {"length": "cm", "angle": "deg"})
    assert (result["sense"], result["status"], result["certificate"], result["seed"]) == ("max", "optimal", None, 0)
    assert result["F"] == pytest.approx(407.2107, rel=1e-6)
    assert result["parameters"] == {"x1": 12, "x2": 8, "x3": 30, "x4": 8}
    assert result["pose"]["position"] == pytest.approx([-10, -10, 50], abs=1e-6)
    assert abs(result["pose"]["angle"]) <= 30 + 1e-9
    assert [*result["task"]["axis"], result["task"]["pitch"]] == pytest.approx([2 / 3, 2 / 3, 1 / 3, 1])
    evidence = result["optimality"]
    assert evidence["kind"] == "strict local maximum"
    assert max(evidence[key] for key in ("stationarity", "feasibility", "complementarity")) < 1e-6
    sides = [(side["name"], side["bound"]) for side in evidence["active"]]
    assert sides == [("p_x", "min"), ("p_y", "min"), ("p_z", "max")]
    assert all(set(side) == {"name", "bound", "value", "unit", "multiplier"} for side in evidence["active"])
    assert all(isinstance(number, float) for number in evidence["reduced_hessian_eigenvalues"])
    starts = result["starts"]
    assert (starts["run"], starts["converged"]) == (4, 4)
    assert sum(found["count"] for found in starts["optima"]) == 4
    assert starts["optima"][0]["F"] == pytest.approx(result["F"], rel=1e-9)
    assert result["seconds"] > 0


def test_json_to_standard_output_is_alone_there(tmp_path: Path, cli: Run, solved: Solved) -> None:
    options = ("--starts", "4", "--seed", "0", "--jobs", "1", "--json", "-")
    here = strict(output_of(cli("solve", "paper-4.1-helical", *options)))
    there = strict(solved[1].read_text(encoding="utf-8"))
    del here["seconds"], there["seconds"]
    # The number of threads changes nothing, nor does the process.
    assert here == there
    ended = process("evaluate", "paper-4.1-helical", "--json", "-", folder=tmp_path)
    assert (ended.returncode, ended.stderr) == (0, "")
    check_state(strict(ended.stdout))
    assert list(tmp_path.iterdir()) == []


def test_seed_starts_and_radians_are_those_of_the_case_or_the_options(tmp_path: Path, cli: Run) -> None:
    path = case_file(tmp_path, search="starts = 7\nseed = 5")
    for options, seed, starts in ((("--starts", "2", "--seed", "11"), 11, 2), (("--starts", "1"), 5, 1)):
        result = strict(output_of(cli("solve", path, "--json", "-", *options)))
        assert (result["seed"], result["starts"]["run"]) == (seed, starts)
    path = case_file(
        tmp_path,
        ('length = "cm"', 'length = "mm"\nangle = "rad"'),
        ("x3 = 30", f"x3 = {math.radians(30)!r}"),
        ("x4 = 8", f"x4 = {math.radians(8)!r}"),
        (ROTATION, f"rotation = {{ angle = {{ min = {-math.radians(30)!r}, max = {math.radians(30)!r} }} }}"),
    )
    result = strict(output_of(cli("solve", path, "--json", "-")))
    check_state(result)
    assert result["units"] == {"length": "mm", "angle": "rad"}
    assert result["F"] == pytest.approx(407.2107, rel=1e-6)
    assert result["parameters"]["x4"] == pytest.approx(math.radians(8), rel=1e-15)
    assert abs(result["pose"]["angle"]) <= math.radians(30) + 1e-12


def test_an_infinite_pitch_is_a_string(tmp_path: Path, cli: Run) -> None:
    path = case_file(tmp_path, (MOTION, "axis = [0, 0, 5]\npitch = inf\n"))
    for command in ("solve", "evaluate"):
        result = strict(output_of(cli(command, path, "--json", "-")))
        check_state(result)
        assert (result["task"]["pitch"], result["task"]["twist"]) == ("inf", [0, 0, 0, 0, 0, 1])


def test_a_case_with_nothing_free(tmp_path: Path, cli: Run) -> None:
    path, target = case_file(tmp_path, (POSITION, "position = [1, 2, 35]"), (ROTATION, "")), tmp_path / "result.json"
    assert "evaluated" in output_of(cli("solve", path, "--json", str(target)))
    result = strict(target.read_text(encoding="utf-8"))
    check_state(result)
    assert (result["status"], result["starts"]["run"]) == ("evaluated", 0)


def test_a_solve_that_stops_early_is_no_answer(tmp_path: Path, cli: Run) -> None:
    path = case_file(tmp_path, search="starts = 3\nmax_iterations = 1")
    target = tmp_path / "result.json"
    code, out, err = cli("solve", path, "--json", str(target))
    result = strict(target.read_text(encoding="utf-8"))
    assert (code, err) == (1, "")
    assert (result["status"], result["F"]) == ("not converged", None)
    assert (result["starts"]["converged"], result["starts"]["optima"]) == (0, [])
    assert sum(result["starts"]["failed"].values()) == 3
    check_state(result)
    assert all(words in out for words in ("not converged", "max_iterations", "0 of 3 converged"))
    assert not re.search(r"largest F|smallest F|\(optimal\)|local maximum|local minimum", out)
    code, out, _ = cli("solve", path, "--json", "-")
    assert (code, strict(out)["status"]) == (1, "not converged")


def test_a_search_that_meets_no_finite_number_prints_nothing_foreign(tmp_path: Path) -> None:
    path = case_file(tmp_path, *COINCIDING, search="starts = 2")
    ended = process("solve", path, "--json", "-", folder=tmp_path)
    assert ended.returncode in (0, 1)
    assert ended.stderr == ""
    result = strict(ended.stdout)
    assert (result["F"] is None) == (ended.returncode == 1)


def test_output_files_are_whole_or_absent(tmp_path: Path, cli: Run) -> None:
    target = saved(tmp_path / "result.json", "older and longer" * 10_000)
    assert cli("evaluate", "paper-4.1-helical", "--json", str(target))[0] == 0
    check_state(strict(target.read_text(encoding="utf-8")))
    fresh = saved(tmp_path / "fresh", "")
    assert stat.S_IMODE(target.stat().st_mode) == stat.S_IMODE(fresh.stat().st_mode)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["fresh", "result.json"]
    # Through a link they reach its target.
    link = tmp_path / "link.json"
    saved(target, "older")
    link.symlink_to(target)
    assert cli("evaluate", "paper-4.1-helical", "--json", str(link))[0] == 0
    assert link.is_symlink()
    check_state(strict(target.read_text(encoding="utf-8")))


def test_output_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Run) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    saved(tmp_path / "file", "a file")
    case = case_file(tmp_path, search="starts = 1")
    for target in ("nowhere/result.json", "folder", "file/result.json", "x" * 300, ""):
        for command in ("solve", "evaluate"):
            refusal_of(cli(command, case, "--json", target), "cannot be written")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["case.toml", "file", "folder"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_output_to_a_pipe_or_device_does_not_replace_it(tmp_path: Path, cli: Run) -> None:
    # As root, `--json /dev/null` must not put a file in the device's place.
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        code, _, err = cli("evaluate", "paper-4.1-helical", "--json", str(pipe))
        assert stat.S_ISFIFO(pipe.stat().st_mode)
        if code == 0:
            check_state(strict(os.read(reader, 100_000).decode()))
        else:
            assert (code, len(err.splitlines())) == (2, 1)
    finally:
        os.close(reader)


def test_evaluate_stands_in_the_middle_or_at_the_start(tmp_path: Path, cli: Run) -> None:
    result = strict(output_of(cli("evaluate", "paper-4.1-helical", "--json", "-")))
    check_state(result)
    assert (result["pose"]["position"], result["pose"]["angle"]) == ([0, 0, 35], 0)
    path = case_file(
        tmp_path,
        ("x2 = 8", "x2 = { min = 4, max = 9, start = 5 }"),
        ("{ min = 20, max = 50 }", "{ min = 20, max = 50, start = 41 }"),
        (ROTATION, "rotation = { axis = [0, 0, 1], angle = { min = -30, max = 30, start = 12 } }"),
    )
    result = strict(cli("evaluate", path, "--json", "-")[1])
    check_state(result)
    assert (result["parameters"]["x2"], result["pose"]["position"]) == (5, [0, 0, 41])
    assert result["pose"]["angle"] == pytest.approx(12, rel=1e-12)
    # A start of the angle counts with a free axis too.
    for angle in ("{ min = -30, max = 30, start = 12 }", "{ min = 10, max = 30, start = 12 }", "-12"):
        path = case_file(tmp_path, (ROTATION, f"rotation = {{ angle = {angle} }}"))
        result = strict(cli("evaluate", path, "--json", "-")[1])
        check_state(result)
        assert result["pose"]["angle"] == pytest.approx(12, rel=1e-9)


def test_evaluate_with_settings(tmp_path: Path, cli: Run) -> None:
    def at(*settings: str, case: str = "paper-4.1-helical") -> dict[str, Any]:
        result = strict(output_of(cli("evaluate", case, "--json", "-", *(f"--set={setting}" for setting in settings))))
        check_state(result)
        return result

    middle = at()
    assert at("x4=20")["parameters"] == {"x1": 12, "x2": 8, "x3": 30, "x4": 20}
    assert at("x4=20")["F"] != pytest.approx(middle["F"])
    assert at("x4=20.0", "x1 = 9", "x1=10")["parameters"]["x1"] == 10
    assert at("p_x=-3.5", "p_z=60")["pose"]["position"] == [-3.5, 0, 60]
    assert at("angle=25")["pose"]["angle"] == pytest.approx(25)
    turned = at("axis=0,0,2", "angle=-25")
    assert turned["pose"]["axis"] == [0, 0, 1]
    assert turned["pose"]["angle"] == pytest.approx(-25)
    assert at("axis=1,-1,0", "angle=10")["pose"]["axis"] == pytest.approx([math.sqrt(0.5), -math.sqrt(0.5), 0])
    assert at("angle=10", case="paper-4.2-rotation")["pose"]["axis"] == [0, 0, 1]
    assert at("x1=3", case="paper-4.2-rotation")["parameters"]["x1"] == 3
    # One coordinate of a joint.
    path = str(saved(tmp_path / "hexapod.toml", cli("new", "hexapod")[1]))
    joints = at("base_1_x=10", "platform_6_z=1", case=path)["parameters"]
    assert (joints["base_1"][0], joints["platform_6"][2]) == (10, 1)
    # Where a leg has no length.
    path = case_file(tmp_path, *COINCIDING)
    for setting in ((), ("--set", "x1=8")):
        refusal_of(cli("evaluate", path, *setting), "case.toml", "zero length")


EXTREMES = {
    "task-axis-large": (("axis = [2, 2, 1]", "axis = [2e200, 2e200, 1e200]"),),
    "task-axis-small": (("axis = [2, 2, 1]", "axis = [2e-200, 2e-200, 1e-200]"),),
    "rotation-axis-large": ((ROTATION, "rotation = { axis = [0, 0, 1e200], angle = 10 }"),),
    "rotation-axis-small": ((ROTATION, "rotation = { axis = [0, 0, 1e-200], angle = 10 }"),),
    "pitch-large": (("pitch = 1", "pitch = 1e200"),),
    "pitch-small": (("pitch = 1", "pitch = 1e-320"),),
    "point-large": (("[2, 3, 6]", "[1e200, 3, 6]"),),
    "twist-large": ((MOTION, "twist = [1e200, 0, 0, 0, 0, 1]\n"),),
    "twist-small": ((MOTION, "twist = [1e-200, 0, 0, 0, 0, 0]\n"),),
    "radius-large": (("x1 = 12", "x1 = 1e200"),),
    "radius-zero": (("x1 = 12", "x1 = 0"),),
    "range-large": (("{ min = 20, max = 50 }", "{ min = -1e308, max = 1e308 }"),),
    "range-small": (("{ min = 20, max = 50 }", "{ min = 20, max = 20.000000000000004 }"),),
    "point-fixed-large": (("[2, 3, 6]", "[1e200, 3, 6]"), (POSITION, "position = [0, 0, 35]"), (ROTATION, "")),
    "radius-fixed-large": (("x1 = 12", "x1 = 1e200"), (POSITION, "position = [0, 0, 35]"), (ROTATION, "")),
}


@pytest.mark.parametrize("command", ["solve", "evaluate"])
@pytest.mark.parametrize("name", EXTREMES)
def test_extreme_numbers_are_answered_or_refused(name: str, command: str, tmp_path: Path, cli: Run) -> None:
    path, target = case_file(tmp_path, *EXTREMES[name], search="starts = 1"), tmp_path / "result.json"
    code, _, err = cli(command, path, "--json", str(target))
    assert code in (0, 1, 2)
    if code == 2:
        assert len(err.splitlines()) == 1
        assert "case.toml" in err
        assert not target.exists()
    else:
        # No warning of NumPy's or CasADi's comes through.
        assert err == ""
        strict(target.read_text(encoding="utf-8"))


def test_an_axis_has_any_length_but_zero(tmp_path: Path, cli: Run) -> None:
    for name in ("rotation-axis-large", "rotation-axis-small", "task-axis-large", "task-axis-small"):
        result = strict(output_of(cli("evaluate", case_file(tmp_path, *EXTREMES[name]), "--json", "-")))
        check_state(result)
        assert result["task"]["axis"] == pytest.approx([2 / 3, 2 / 3, 1 / 3])


@pytest.mark.parametrize("command", ["solve", "evaluate"])
def test_a_length_label_is_shown_as_it_is(command: str, tmp_path: Path, cli: Run) -> None:
    for label in ("[cm]", "[/cm]", "[bold]", ":ruler:", "µm", "in"):
        path = case_file(tmp_path, ('"cm"', f'"{label}"'), ("Pose of a", f"Pose {label} of a"))
        out = output_of(cli(command, path, "--all"))
        assert next(line for line in out.splitlines() if line.startswith("x1")).split()[2] == label
        assert f"Pose {label} of a" in out


def test_a_title_in_any_script_on_a_terminal_without_it(tmp_path: Path) -> None:
    path = case_file(tmp_path, ("Pose of a", "Größe of a"), search="starts = 1")
    table, data = (
        process("evaluate", path, *options, folder=tmp_path, PYTHONIOENCODING="ascii")
        for options in ((), ("--json", "-"))
    )
    assert table.returncode == data.returncode == 0
    assert "Traceback" not in table.stderr + data.stderr
    assert strict(data.stdout)["title"].startswith("Größe")


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are bytes on Linux only")
def test_a_file_name_that_is_no_text(tmp_path: Path, cli: Run) -> None:
    path = saved(tmp_path / os.fsdecode(b"caf\xe9.toml"), HELICAL)
    code, _, err = cli("evaluate", str(path), "--json", str(tmp_path / "result.json"))
    assert code in (0, 2)
    assert len(err.splitlines()) == (1 if code else 0)
    assert (tmp_path / "result.json").exists() == (code == 0)


@pytest.mark.parametrize("robots", soaked([EACH_KIND, model_names()], [EACH_KIND]), ids=["kinds", "all"])
def test_the_schema_accepts_every_good_case_and_no_other(robots: tuple[str, ...], cli: Run) -> None:
    found = strict(output_of(cli("schema")))
    jsonschema.Draft202012Validator.check_schema(found)
    schema = jsonschema.Draft202012Validator(found)
    assert len(shipped_cases()) >= 8
    texts = [(CASES / f"{name}.toml").read_text(encoding="utf-8") for name in shipped_cases()]
    texts += map(starter_text, ("stewart-gough", "hexapod", "three-upu", *robots))
    texts += [
        edited(HELICAL, (MOTION, own)) for own in ("axis = [0, 0, 1]\npitch = inf\n", "twist = [0, 0, 1, 0, 0, 0]\n")
    ]
    for text in texts:
        schema.validate(tomllib.loads(text))
    for wrong in (
        ("title =", "titel ="),
        *(("x1 = 12", f"x1 = {own}") for own in ('"12"', "{ min = 2 }", "{ min = 2, max = 3, strat = 2 }")),
        *((POSITION, own) for own in ("", "position = [0, 0]")),
        (ROTATION, "rotation = { axis = [0, 0, 1] }"),
        ('sense = "max"', 'sense = "maximum"'),
        (MOTION, "twist = [0, 0, 1]\n"),
        ("pitch = 1", 'pitch = "inf"'),
        ("[[task]]", "[task]"),
        *(("[expect]", f"[solve]\nstarts = {own}\n[expect]") for own in ("0", "2.5")),
        ('length = "cm"', 'length = ""'),
        ('model = "stewart-gough"', ""),
    ):
        assert not schema.is_valid(tomllib.loads(edited(HELICAL, wrong))), wrong


# All starters of the gallery are solved in test_starters.py.
@pytest.mark.parametrize("model", [*(name for name in model_names() if name not in gallery_names()), "3-rps", "6-ups"])
def test_a_new_case_solves(model: str, tmp_path: Path, cli: Run) -> None:
    text = output_of(cli("new", model))
    assert text.endswith("\n")
    assert text == starter_text(model)
    path = saved(tmp_path / "mine.toml", text)
    target = tmp_path / "result.json"
    out = output_of(cli("solve", str(path), "--json", str(target)))
    assert "(optimal" in out
    result = strict(target.read_text(encoding="utf-8"))
    check_state(result, length=tomllib.loads(text)["robot"].get("characteristic_length", 1.0))
    assert (result["status"], result["model"], result["case"]) == ("optimal", model, "mine")
    # What its comments offer instead is right as well.
    lines = text.splitlines()
    pose = lines[: lines.index("", lines.index(next(line for line in lines if line.startswith("[pose]"))))]
    offered = [line.removeprefix("# ") for line in pose if line.startswith("# rotation")]
    assert len(offered) == (0 if model in {"3-rps", "three-upu"} else 1)
    for line in offered:
        saved(path, "\n".join(line if each.startswith("rotation") else each for each in lines) + "\n")
        assert cli("evaluate", str(path))[0] == 0


def test_models_lists_the_shipped_robots_and_shows_one(cli: Run) -> None:
    shown = unbroken(output_of(cli("models")))
    assert all(re.search(rf"(?<!\S){name}\b", shown) for name in model_names())
    assert "six degrees of freedom  6-pus, 6-rss, 6-rus, 6-sps, 6-ups, servo-hexapod\n" in shown
    rows = [line.split()[0] for line in output_of(cli("models", "--all")).splitlines() if line[0] != " "]
    assert rows[rows.index("robot") :][1:3] == ["stewart-gough", "hexapod"]
    words = ("x1", "x4", "layout", '"octahedral"', "length", "angle", "leg_length", ">= 0 deg, <= 30 deg", "1-", "3+")
    assert_words(output_of(cli("models", "stewart-gough", "--all")), *words)
    assert_words(output_of(cli("models", "hexapod", "--all")), "base_1_x", "platform_6_z", "leg_length", "any")


def test_commands_that_do_not_exist_or_lack_something(cli: Run) -> None:
    for arguments, words in (
        ("models hexapode", "did you mean 'hexapod'?"),
        ("new hexapode", "did you mean 'hexapod'?"),
        ("frobnicate", "frobnicate: no such command; allowed: new, models, solve"),
        ("solve", "CASE: is missing: case file"),
        ("evaluate", "CASE: is missing: case file"),
        ("new", "MODEL: is missing: name of a robot"),
        ("solve a --no", "--no: no such option of solve; did you mean '--of'? allowed: --set, "),
        ("solve a b", "it takes CASE"),
    ):
        refusal_of(cli(*arguments.split()), words)
    refusal_of(cli("solve", "a", "b"), "solve: got unexpected extra argument")
    code, out, err = cli()
    assert code == 2
    assert "Usage: " in out + err
    assert "Traceback" not in err


def test_numbers_of_options_are_refused_in_one_sentence(cli: Run) -> None:
    for arguments, words in (
        ("solve --starts 0", "--starts 0: must be a whole number from 1 to 100000"),
        ("solve --starts=100001", "--starts 100001: must be a whole number from 1 to 100000"),
        ("solve --starts=1.5", "--starts 1.5: must be a whole number from 1 to 100000"),
        ("solve --jobs=0", "--jobs 0: must be a whole number from 1 to 256"),
        ("report --out x.html --starts 1e3", "--starts 1e3: must be a whole number from 1 to 100000"),
        ("tradeoff --over x1=1:2:2 --jobs 257", "--jobs 257: must be a whole number from 1 to 256"),
        ("solve --seed=-1", "--seed -1: must be a whole number of at least 0"),
        ("solve --pose 0", "--pose 0: must be a whole number of at least 1"),
        ("certify --gap little", "--gap little: must be a number"),
    ):
        command, *others = arguments.split()
        assert cli(command, "paper-4.3", *others) == (2, "", f"screwsynth: {words}\n")


def test_help(cli: Run) -> None:
    for option in ("-h", "--help"):
        out = output_of(cli(option))
        for command in ("solve", "evaluate", "models", "schema", "new"):
            assert command in out
            assert cli(command, option)[0] == 0
        assert "..." not in out.partition("Commands:")[2], "a command's summary is cut off"


def test_a_reader_that_goes_away(tmp_path: Path) -> None:
    for arguments in ("solve paper-4.3 --starts 2 --json -", "models"):
        command, pipe = [sys.executable, "-P", "-m", "screwsynth.nlp", *arguments.split()], subprocess.PIPE
        with subprocess.Popen(command, cwd=tmp_path, stdout=pipe, stderr=pipe, text=True) as running:
            running.stdout.close()
            assert not re.search("Traceback|Exception", running.stderr.read())
