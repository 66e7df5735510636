"""Paths that cases name: read beside their files, judged by the command and in Python, and written again."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import casadi as ca
import jsonschema
import numpy as np
import pytest
from builders import DOCS, Array, Run, case_from, case_of, docs_script, output_of, refusal_of, saved, shipped_tables
from measures import circle_joints
from path_cases import BASE, PLATFORM, Floats, turns_of

from screwsynth.nlp import CaseError, PathFile, certify, check_path, json_data, load_case, load_result, solve
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.case.toml import toml_document
from screwsynth.nlp.path.options import PathOptions
from screwsynth.nlp.path.path import Kind, Poses, ProgrammedPath
from screwsynth.nlp.path.reader import path_of_case, read_path
from screwsynth.nlp.results.schema import result_schema
from screwsynth.nlp.solver.rounding import round_design
from screwsynth.nlp.solver.status import Status

#: An arc of a quarter, in a program's own coordinates.
PROGRAM = "G20\nG55 G0 X1 Y0 Z20\nG94 F60\nG3 X0 Y1 I-1 A5\nM2\n"


def hexapod_with(folder: Path, *lines: str) -> str:
    """The name of a case file of LinuxCNC's hexapod with these lines of the table of its path."""
    text = find_case("hexapod-linuxcnc").read_text(encoding="utf-8")
    return str(saved(folder / "machine.toml", "\n".join([text, "[path]", *lines, ""])))


def test_a_case_names_its_path_and_how_it_is_read(cli: Run, tmp_path: Path) -> None:
    saved(tmp_path / "part.ngc", PROGRAM)
    saved(tmp_path / "other.ngc", PROGRAM.replace("G55", "G0 X0 Y0 Z19 A0 B0 C0\nG55"))
    keys = ['file = "part.ngc"', 'unit = "mm"', "offsets = { G55 = [0, 0, 1, 0, 0, 0] }", "start = [0, 0, 18, 0, 0, 0]"]
    name, out = hexapod_with(tmp_path, *keys), str(tmp_path / "path.json")

    def result(*flags: str) -> dict[str, object]:
        output_of(cli("path", name, *flags, "--json", out))
        found: dict[str, object] = json.loads(Path(out).read_text())["path"]
        return found

    own = result()
    assert (own["file"], own["segments"]) == ("part.ngc", 2)
    path = path_of_case(load_case(name))
    assert path.knots == pytest.approx(
        np.array([[0, 0, 18, 0, 0, 0], [1, 0, 21, 0, 0, 0], [0, 1, 21, math.radians(5), 0, 0]]), abs=1e-12
    )
    # Choices of the command take the place of those of the case; with a file of its own there are only these.
    lower = result("--offset", "G55=0,0,0,0,0,0")
    assert lower["segments"] == 2
    assert lower["actuators"] != own["actuators"]
    other = result("--along", str(tmp_path / "other.ngc"))
    assert (other["file"], other["segments"]) == (str(tmp_path / "other.ngc"), 2)
    other_path = read_path(tmp_path / "other.ngc", load_case(name).units, PathOptions())
    assert other_path.knots[:, 2] == pytest.approx([19, 20, 20])

    judged = check_path(load_case(name))
    assert judged.is_proved
    lengths = {each.name: each.bound for each in judged.extremes if each.sense.value == "min"}
    for row, length in zip(own["actuators"], lengths.values(), strict=True):
        assert row["smallest"] == pytest.approx(length)
    assert check_path(load_case(name), tmp_path / "other.ngc").path.source == other["file"]
    assert check_path(load_case("hexapod-linuxcnc"), other_path, gap=0.1).path is other_path


def test_other_commands_read_a_case_with_a_path_that_is_not_there(cli: Run, tmp_path: Path) -> None:
    name = hexapod_with(tmp_path, 'file = "none.ngc"')
    assert "2.71312" in output_of(cli("evaluate", name))
    refusal_of(cli("path", name), str(tmp_path / "none.ngc"))
    refusal_of(cli("path", "hexapod-linuxcnc"), "hexapod-linuxcnc.toml: path: is missing")
    with pytest.raises(CaseError, match="path: is missing"):
        check_path(load_case("hexapod-linuxcnc"))
    saved(tmp_path / "none.ngc", PROGRAM)
    refusal_of(cli("path", name, "--json", str(tmp_path / "none.ngc")), "is a file that the case names")


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "path.file: is missing"),
        ({"file": ""}, "path.file = '': must not be empty"),
        ({"file": "a.ngc", "unit": "cm"}, "path.unit = 'cm': must be one of 'mm' or 'in'"),
        ({"file": "a.ngc", "start": [1.0, 2.0]}, "path.start: must have 6 entries, got 2"),
        ({"file": "a.ngc", "offsets": {"G53": [0.0] * 6}}, "path.offsets.G53 = 'G53': must be one of 'G54'"),
        ({"file": "a.ngc", "angles": "xyx"}, "path.angles = 'xyx': must be one of 'rpy'"),
        ({"file": "a.ngc", "between": "line"}, "path.between = 'line': must be one of 'angles' or 'slerp'"),
        ({"file": "a.ngc", "along": 1}, "path.along: no such key; allowed: file, unit"),
    ],
)
def test_faults_of_the_table_are_told(keys: dict[str, object], words: str) -> None:
    with pytest.raises(CaseError) as error:
        case_of("hexapod-linuxcnc", path=keys)
    assert words in str(error.value).replace('"', "'")


def test_a_path_is_written_as_it_was_stated() -> None:
    stated = {
        "file": "sub/part.ngc", "unit": "in", "start": [1.0, 2, 3, 4, 5, 6], "angles": "xyz", "between": "slerp",
        "offsets": {"G59.1": [0.5, 0, 0, 0, 0, 90]},
    }  # fmt: skip
    for keys in (stated, {"file": "part.csv"}):
        case = case_of("hexapod-linuxcnc", path=keys)
        assert case.path == PathFile(**keys)
        assert case_from(case.to_toml()).path == case.path


def test_the_shipped_program_is_the_written_one_and_a_pocket_with_leaning_walls() -> None:
    text = find_case("hexapod-pocket").with_suffix(".ngc").read_text(encoding="utf-8")
    assert docs_script("pocket").program() == text, "run `make docs`"
    assert text.count("\n") >= 2000
    path = path_of_case(load_case("hexapod-pocket"))
    k = np.flatnonzero(path.kinds != Kind.DWELL)
    s = np.linspace(0, 1, 17)
    tips, turns = path.poses_at(np.repeat(k, len(s)), np.tile(s, len(k)))
    tips, axes = 25.4 * (tips - [0, 0, 20]), turns[:, :, 2]
    # The tool, of radius 6 mm, up from its tip as far as the part's top, at the four walls: at their tops 140 by 90 mm.
    tilt = math.radians(8)
    walls = math.cos(tilt) * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    normals = np.hstack([walls, np.full((4, 1), -math.sin(tilt))])
    heights = np.maximum(-tips[:, 2], 0) / axes[:, 2]
    gaps = np.array([
        np.array([70, 45, 70, 45]) * math.cos(tilt) - (tips + part * heights[:, None] * axes) @ normals.T
        for part in (0.0, 1.0)
    ])  # fmt: skip
    in_part = tips[:, 2] < 0
    assert gaps[:, in_part].min() == pytest.approx(6, abs=1e-3)
    leaning = np.arccos(axes[:, 2])
    assert leaning.max() == pytest.approx(tilt, abs=1e-4)
    along = in_part & (np.abs(leaning - tilt) < 1e-6) & (np.abs(axes[:, :2]).min(axis=1) < 1e-9)
    touches = np.abs(gaps[:, along].min(axis=2) - 6) < 1e-3
    assert along.sum() > 1000
    assert touches.all(axis=0).mean() > 0.95  # all but the ways down to the wall
    assert tips[:, 2].min() == pytest.approx(-24)


def test_the_shipped_program_is_proved_and_its_page_says_so(cli: Run) -> None:
    shown = output_of(cli("path", "hexapod-pocket"))
    page = (DOCS / "paths.md").read_text(encoding="utf-8")
    _, _, rest = page.partition("<!-- begin: screwsynth path hexapod-pocket -->\n```text\n")
    assert "PROVED at every point" in shown
    assert max(map(len, shown.splitlines())) <= 80
    assert [line.rstrip() for line in shown.splitlines()] == rest.partition("```")[0].splitlines()


#: An arc of a quarter and a line, in inches, about LinuxCNC's hexapod 20 in above its base.
ARC = "G20\nG94 F60\nG1 X3 Y0 Z20\nG3 X0 Y3 Z21 I-3 A5\nG1 X-4 B-6\nM2\n"


def design_along(folder: Path, **keys: object) -> dict[str, object]:
    """Tables of a hexapod whose base is free and whose legs are limited along a path."""
    saved(folder / "arc.ngc", ARC)
    tables = shipped_tables("hexapod-linuxcnc")
    tables["robot"]["parameters"]["x1"] = {"min": 15, "max": 35}
    tables["limits"] = {"over": "path", "leg_length": {"min": 25, "max": 40}}
    tables |= {"path": {"file": str(folder / "arc.ngc")}, "solve": {"starts": 3}}
    return tables | keys


def legs_along(radius: Array, positions: Array, rotations: Array) -> Array:
    """Lengths (R, N, 6) of the legs of hexapods with bases of these radii at poses, from the joints alone."""
    base = np.array([circle_joints({"x1": each, "x2": 11.5, "x3": 0.0, "x4": 0.1})[0] for each in radius])
    tips = positions[:, None, :] + np.einsum("nij,kj->nki", rotations, PLATFORM)
    return np.asarray(np.linalg.norm(tips[None] - base[:, None], axis=3))


def poses_along(path: ProgrammedPath, count: int) -> Poses:
    return path.poses_at(np.repeat(np.arange(len(path)), count), np.tile(np.linspace(0, 1, count), len(path)))


def are_kept(radius: Array, poses: Poses, longest: float) -> Array:
    """Whether hexapods with bases of these radii have legs of 25 in to a longest length at all poses."""
    lengths = legs_along(radius, *poses).reshape(len(radius), -1)
    return np.asarray((lengths.min(axis=1) >= 25) & (lengths.max(axis=1) <= longest))


def test_a_design_keeps_its_limits_along_a_path_and_is_the_best_of_a_grid(tmp_path: Path) -> None:
    case = case_from(design_along(tmp_path))
    solution = solve(case)
    path = path_of_case(case)
    radius = np.linspace(15, 35, 801)
    kept = radius[are_kept(radius, poses_along(path, 501), 40)]
    # The narrowest base has the largest F: 6 (20 in / length of a leg)^2.
    home = legs_along(kept[:1], np.array([[0.0, 0, 20]]), np.eye(3)[None])[0, 0, 0]
    assert solution.status is Status.OPTIMAL
    assert solution.path.is_proved
    (found,) = solution.path.judgement.case.components("x1")
    assert found > kept[0] - (radius[1] - radius[0])
    assert found == pytest.approx(kept[0], rel=3e-3)
    assert pytest.approx(6 * (20 / home) ** 2, rel=5e-3) == solution.F
    # Limits at the stated pose alone have a narrower base.
    assert solution.path.history[0][1] > 0
    assert solve(case.at_stated_poses()).F > 1.05 * solution.F
    assert case_from(case.to_toml()).limits_over == "path"


def test_the_proof_along_a_path_is_a_result(cli: Run, tmp_path: Path) -> None:
    case, out = saved(tmp_path / "case.toml", toml_document(design_along(tmp_path))), tmp_path / "out.json"
    shown = output_of(cli("solve", str(case), "--json", str(out)))
    assert "2 segments: proved: no singularity and no violated limit at any point" in " ".join(shown.split())
    written = json.loads(out.read_text())
    jsonschema.validate(written, result_schema())
    assert json_data(load_result(out)) == written
    assert written["path"]["proved"]
    assert {each["line"] for each in written["path"]["claims"][1:]} <= {4, 5}
    output_of(cli("path", str(case), "--of", str(out)))
    # Of no base all legs are so short: the path has no design.
    status, shown, _ = cli("solve", str(case), "--set", "limits.leg_length.max=25.5")
    assert status == 1
    assert "proved: no singularity" not in shown
    refusal_of(
        cli("solve", str(saved(tmp_path / "none.toml", case.read_text().replace("arc.ngc", "no.ngc")))), "no.ngc"
    )
    wrong = case_from(design_along(tmp_path)).to_toml().partition("[path]")[0]
    refusal_of(cli("solve", str(saved(tmp_path / "without.toml", wrong))), "limits.over", "needs the table [path]")


#: A line of 8 in, from the origin of a frame of its own.
LINE = "G20\nG94 F60\nG1 X0 Y0 Z0\nG1 X8 A4\nM2\n"
#: The same without a turn, and a quarter of a circle.
STRAIGHT, QUARTER = LINE.replace(" A4", ""), "G20\nG94 F60\nG1 X3 Y0 Z0\nG3 X0 Y3 I-3 Z1 B2\nM2\n"


def at_place(place: Sequence[float], poses: Poses) -> Poses:
    """Poses with a frame that is moved and turned by roll, pitch and yaw."""
    R = turns_of(np.array([place[3:]]))[0]
    return Poses(poses.positions @ R.T + np.array(place[:3]), np.einsum("ij,njk->nik", R, poses.rotations))


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (QUARTER, (1.0, -2, 3, 0, 0, 0)),
        (QUARTER, (1.0, -2, 3, 0, 0, 0.7)),
        (QUARTER, (0.0, 0, 0, 0.1, 0, 0.7)),
        (QUARTER.replace("G20", "G20\nG18").replace("Y3 I-3 Z1", "Y0 Z3 I-3"), (1.0, 2, 3, 0, 0, 0)),
        (QUARTER.replace("G20", "G20\nG18").replace("Y3 I-3 Z1", "Y0 Z3 I-3"), (0.0, 0, 0, 0, 0, 1)),
        (LINE, (1.0, 2, 3, 0, 0, -1)),
        (LINE, (1.0, 2, 3, 0, 0.2, 0)),
        (STRAIGHT, (1.0, 2, 3, 0.3, -0.2, 1)),
    ],
)
def test_a_path_in_another_place(tmp_path: Path, text: str, place: Floats) -> None:
    saved(tmp_path / "part.ngc", text)
    units = load_case("hexapod-linuxcnc").units
    names = ("x", "y", "z", "roll", "pitch", "yaw")
    keys = dict(zip(names, (*place[:3], *np.degrees(place[3:]).tolist()), strict=True))
    case = case_of("hexapod-linuxcnc", path={"file": str(tmp_path / "part.ngc"), "place": keys})
    again = case_from(case.to_toml()).path
    assert again.place == pytest.approx(place, abs=1e-15)
    path, own = path_of_case(case), read_path(tmp_path / "part.ngc", units)
    s = np.linspace(0, 1, 33)
    k = np.zeros(len(s), dtype=np.intp)
    found, expected = path.poses_at(k, s), at_place(place, own.poses_at(k, s))
    assert found.positions == pytest.approx(expected.positions, abs=1e-12)
    assert found.rotations == pytest.approx(expected.rotations, abs=1e-12)
    s_symbol = ca.SX.sym("s")
    pose = ca.Function("pose", [s_symbol], list(path[0].expressions(s_symbol)))
    for row in range(0, 33, 8):
        position, rotation = (each.full() for each in pose(s[row]))
        assert position.ravel() == pytest.approx(expected.positions[row], abs=1e-12)
        assert rotation == pytest.approx(expected.rotations[row], abs=1e-12)


def test_a_free_turn_has_ends_that_are_covered(tmp_path: Path) -> None:
    tables = design_along(tmp_path)
    tables["path"]["place"] = {"yaw": {"min": -5, "max": 175}}
    with pytest.raises(CaseError, match=r"path.place.yaw.max = 175.0: must be between"):
        case_from(tables)


def test_values_and_round_numbers_keep_limits_along_a_path(tmp_path: Path) -> None:
    tables = design_along(tmp_path)
    case = case_from(tables)
    radius = np.arange(15.0, 35.0)
    kept = radius[are_kept(radius, poses_along(path_of_case(case), 201), 40)]
    # The narrowest base has the largest F; the whole number below that of the best design breaks a limit.
    before = solve(case)
    rounded = round_design(before, 1)
    (own,), (now,) = (each.path.judgement.case.components("x1") for each in (before, rounded) if each.path is not None)
    assert isinstance(own, float)
    assert now == kept[0] == math.ceil(own)
    assert rounded.keeps_limits
    tables["robot"]["parameters"]["x1"] = {"values": [kept[2], kept[0] - 1, kept[1]]}
    chosen = solve(case_from(tables))
    assert chosen.path.is_proved
    assert chosen.path.judgement.case.components("x1") == (kept[1],)


def test_the_place_of_a_path_and_the_design_are_the_best_of_a_grid(cli: Run, tmp_path: Path) -> None:
    saved(tmp_path / "line.ngc", LINE)
    tables = design_along(tmp_path)
    place = {"x": {"min": -10.0, "max": 10.0, "start": 5.0}, "y": 1.0, "z": 18.0}
    tables["path"] = {"file": str(tmp_path / "line.ngc"), "place": place}
    tables["limits"] = {"over": "path", "leg_length": {"min": 25, "max": 32}}
    case, out = saved(tmp_path / "case.toml", toml_document(tables)), tmp_path / "out.json"
    shown = " ".join(output_of(cli("solve", str(case), "--json", str(out))).split())
    result = json.loads(out.read_text())
    path = read_path(tmp_path / "line.ngc", load_case(str(case)).units)
    radius, shift, poses = np.linspace(18, 30, 121), np.linspace(-10, 10, 201), poses_along(path, 41)
    kept = np.array([are_kept(radius, at_place((x, 1, 18, 0, 0, 0), poses), 32) for x in shift]).T
    kept &= are_kept(radius, Poses(np.array([[0.0, 0, 20]]), np.eye(3)[None]), 32)[:, None]
    best = int(np.argmax(kept.any(axis=1)))
    assert best > 0
    assert result["path"]["proved"]
    assert math.isclose(result["parameters"]["x1"], radius[best], rel_tol=5e-3)
    near = shift[kept[best]]
    assert near.min() - 0.2 <= result["path"]["place"]["x"] <= near.max() + 0.2
    assert np.ptp(near) < 2
    assert (result["path"]["place"]["y"], result["path"]["place"]["z"]) == (1.0, 18.0)
    assert "(bounds -10 .. 10)" in shown
    # The machine and the place of the result, and another place, which has no machine.
    output_of(cli("path", str(case), "--of", str(out)))
    refusal_of(cli("path", str(case), "--set", "x1=20"), "path.place.x: is free")
    assert cli("path", str(case), "--of", str(out), "--set", "path.place.x=6")[0] == 1
    assert cli("solve", str(case), "--set", "path.place.x.min=5")[0] == 1
    refusal_of(cli("solve", str(case), "--set", "path.place.y.min=5"), "path.place.y is fixed")
    refusal_of(cli("solve", str(case), "--set", "path.place.a=5"), "path.place.a: no such key")


def test_the_least_force_over_the_places_of_a_path_is_that_of_a_grid(tmp_path: Path) -> None:
    saved(tmp_path / "line.ngc", LINE)
    tables = design_along(tmp_path)
    tables["robot"]["parameters"]["x1"] = 26.5
    tables["limits"] = {"over": "path", "leg_length": {"min": 20, "max": 40}}
    ends = {"min": -12.0, "max": 0.0, "start": -9.0}
    tables["path"] = {"file": str(tmp_path / "line.ngc"), "place": {"x": ends, "z": 19.0, "yaw": 20.0}}
    push = np.array([0.0, 1.0, -10.0])
    del tables["task"]
    tables |= {"load": [{"name": "push", "force": push.tolist()}], "objective": {"minimise": "actuator_force"}}
    case = case_from(tables)
    found = certify(case, gap=1e-3)
    proof = found.solution.path
    assert found.solution.status is Status.OPTIMAL
    assert proof.is_proved

    own = poses_along(read_path(tmp_path / "line.ngc", case.units), 41)

    def largest(x: float) -> float:
        """Largest force of a leg along the path in its place, by the balance of forces and moments."""
        sizes = []
        for position, rotation in zip(*at_place((x, 0, 19, 0, 0, math.radians(20)), own), strict=True):
            arms = PLATFORM @ rotation.T
            along = position + arms - BASE
            along /= np.linalg.norm(along, axis=1)[:, None]
            wrenches = np.hstack([along, np.cross(arms, along)])
            sizes.append(np.abs(np.linalg.solve(wrenches.T, np.array([*push, 0, 0, 0]))).max())
        return max(sizes)

    grid = np.linspace(-12, 0, 241)
    forces = np.array([largest(x) for x in grid.tolist()])
    best = int(np.argmin(forces))
    assert 0 < best < len(grid) - 1
    assert math.isclose(found.solution.F, forces[best], rel_tol=3e-3)
    assert abs(proof.place[0] - grid[best]) < 0.2
    assert largest(proof.place[0]) < forces[best] * (1 + 2e-3)
    assert 0.99 * forces[best] < found.certificate.bound < forces[best]
