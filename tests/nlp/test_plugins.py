"""Robots of other packages, and parameters with any name."""

import json
import math
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import Run, assert_words, edited, output_of, refusal_of, saved, soaked

import screwsynth.nlp as sn
from screwsynth.models import AmbiguousModelError, Model, model_names, robot_function, stewart_gough
from screwsynth.models.catalog import gallery_names
from screwsynth.nlp.embedding.codegen import generate_c
from screwsynth.nlp.evidence.sensitivity import sensitivities
from screwsynth.nlp.program.epigraph import formulate_worst
from screwsynth.nlp.program.formulation import formulate_each, formulate_weighted

# A robot with a constraint couple and an option of every plain kind. Its hints are text, as in many packages.
MODULE = '''
from __future__ import annotations

import math
from typing import Annotated, Literal

import casadi as ca
from casadi import SX

from screwsynth.models import Dimension, Model, Parameter, PoseSymbols, couple_about, force_along


def tripod(
    *,
    legs: int = 3,
    twisted: bool = False,
    drive: Literal["fast", "slow"] = "slow",
    spread: float = 1.0,
    brand: Annotated[str, "name of the maker"] = "none",
) -> Model:
    """Legs on two circles, and a joint that resists turning."""
    pose = PoseSymbols()
    radius, small = SX.sym("radius"), SX.sym("small")
    rows = []
    for i in range(legs):
        azimuth = 2 * math.pi * i / legs
        other = azimuth + (1.0 if twisted else 0.5)
        base = ca.vertcat(spread * radius * math.cos(azimuth), spread * radius * math.sin(azimuth), 0)
        platform = ca.vertcat(small * math.cos(other), small * math.sin(other), 0)
        rows.append(force_along(f"leg {i + 1}", base, pose.position + pose.rotation @ platform - base))
    rows.append(couple_about("joint", pose.rotation[:, 2]))
    return Model(
        name="tripod",
        description="legs and a joint",
        options={"legs": legs, "twisted": twisted, "drive": drive, "spread": spread, "brand": brand},
        parameters=(
            Parameter("radius", radius, Dimension.LENGTH, "radius of the base", (10.0,), 0.0),
            Parameter("small", small, Dimension.LENGTH, "radius of the platform", (6.0,), 0.0),
        ),
        pose=pose,
        home=(0.0, 0.0, 30.0),
        wrenches=tuple(rows),
    )


def sized(*, size: int) -> Model:
    """An option without a default."""
    return renamed("sized", tripod(legs=size), {"size": size})


def renamed(name, model, options=None):
    return Model(
        name=name,
        description=model.description,
        options=options or {},
        parameters=model.parameters,
        pose=model.pose,
        home=model.home,
        wrenches=model.wrenches,
    )


def hexapod() -> Model:
    raise RuntimeError("a shipped name was taken over")
'''

CASE = """\
units = { length = "cm" }
task = [{ sense = "max", axis = [0, 1, 2], point = [1, 0, 30], pitch = 2 }]
[robot]
model = "tripod"
legs = 6
twisted = true
drive = "fast"
spread = 1.5
brand = "any"
characteristic_length = 5
parameters = { radius = { min = 8, max = 12 }, small = 6 }
[pose]
position = [0, 0, 30]
[solve]
starts = 3
"""

Install = Callable[..., Path]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Put a package with entry points on the path, as pip would."""
    packages: list[str] = []

    def put(points: dict[str, str], module: str = MODULE, package: str = "workshop_robots") -> Path:
        site = tmp_path / f"site-{package}"
        info = site / f"{package}-1.0.dist-info"
        (site / package).mkdir(parents=True)
        info.mkdir()
        saved(site / package / "__init__.py", "")
        saved(site / package / "robots.py", module)
        saved(info / "METADATA", f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        lines = [f"{name} = {package}.{target}" for name, target in points.items()]
        saved(info / "entry_points.txt", "\n".join(["[screwsynth.models]", *lines, ""]))
        monkeypatch.syspath_prepend(str(site))
        packages.append(package)
        return site

    yield put
    for name in list(sys.modules):
        if name.split(".")[0] in packages:
            del sys.modules[name]


@pytest.fixture
def tripod(install: Install) -> Path:
    return install({"tripod": "robots:tripod"})


def case_file(folder: Path, *edits: tuple[str, str]) -> str:
    return str(saved(folder / "case.toml", edited(CASE, *edits)))


@pytest.mark.usefixtures("tripod")
def test_it_is_listed_and_shown_with_its_options_and_defaults_as_a_case_writes_them(cli: Run) -> None:
    assert model_names() == ("stewart-gough", "hexapod", "three-upu", *gallery_names(), "tripod")
    assert "tripod" in output_of(cli("models"))
    out = "robot " + output_of(cli("models", "--all")).partition("\nrobot ")[2]
    assert [line.split()[0] for line in out.splitlines() if not line.startswith(" ")] == ["robot", *model_names()]
    assert "legs and a joint" in out
    out = output_of(cli("models", "tripod"))
    assert_words(out, "int", "bool", '"fast", "slow"', "radius", "small", "couple", "joint")
    shown = {row[0]: row[-1] for row in map(str.split, out.splitlines()) if row}
    defaults = {"legs": "3", "twisted": "false", "drive": '"slow"', "spread": "1.0"}
    assert defaults.items() <= shown.items()
    assert re.search(r'brand +str +"none" +name of the maker\n', out)


@pytest.mark.usefixtures("tripod")
def test_it_is_solved_like_a_shipped_one(tmp_path: Path, cli: Run) -> None:
    path = case_file(tmp_path)
    result = json.loads(output_of(cli("solve", path, "--json", "-")))
    assert (result["model"], result["status"], len(result["rates"])) == ("tripod", "optimal", 7)
    assert result["limbs"] == [*(f"leg {i}" for i in range(1, 7)), "joint"]
    assert result["characteristic_length"] == 5
    assert sum(rate**2 for rate in result["rates"]) == pytest.approx(result["F"], rel=1e-12)
    out = output_of(cli("solve", path, "--all"))
    assert_words(out, ", optimal)", "couple")
    assert json.loads(output_of(cli("evaluate", path, "--set", "radius=9", "--json", "-")))["parameters"]["radius"] == 9
    text = output_of(cli("new", "tripod"))
    assert tomllib.loads(text)["robot"]["twisted"] is False
    assert '\n# name of the maker\nbrand = "none"\n' in text
    assert cli("solve", str(saved(tmp_path / "mine.toml", text)), "--starts", "4")[0] == 0


def test_it_is_found_by_a_new_process(tripod: Path, tmp_path: Path) -> None:
    program = f"import sys; sys.path.insert(0, {str(tripod)!r}); from screwsynth.nlp.cli.main import main; main()"
    command = [sys.executable, "-P", "-c", program, "solve", case_file(tmp_path), "--json", "-"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert json.loads(ended.stdout)["status"] == "optimal"


@pytest.mark.usefixtures("tripod")
def test_its_options_reach_its_function(tmp_path: Path) -> None:
    few = sn.load_case(case_file(tmp_path, ("legs = 6\n", "")))
    assert len(few.model.wrenches) == 4
    assert dict(few.model.options) == {"legs": 3, "twisted": True, "drive": "fast", "spread": 1.5, "brand": "any"}
    straight = sn.solve(sn.load_case(case_file(tmp_path, ("twisted = true", "twisted = false")))).F
    assert straight != pytest.approx(sn.solve(sn.load_case(case_file(tmp_path))).F)
    # A whole number is a number.
    assert sn.formulate(sn.load_case(case_file(tmp_path, ("spread = 1.5", "spread = 2")))).n == 1


@pytest.mark.parametrize(
    ("edit", "key", "words"),
    [
        (("legs = 6", 'legs = "6"'), "robot.legs", ("integer",)),
        (("legs = 6", "legs = 6.0"), "robot.legs", ("integer",)),
        (("legs = 6", "legs = true"), "robot.legs", ("integer",)),
        (("legs = 6", "legs = [6]"), "robot.legs", ("integer",)),
        (("legs = 6", "legs = { min = 3, max = 6 }"), "robot.legs", ("integer",)),
        (("twisted = true", "twisted = 1"), "robot.twisted", ("boolean",)),
        (("twisted = true", 'twisted = "yes"'), "robot.twisted", ("boolean",)),
        (('drive = "fast"', 'drive = "faster"'), "robot.drive", ("'fast'", "'slow'")),
        (("spread = 1.5", 'spread = "wide"'), "robot.spread", ("number",)),
        (("spread = 1.5", "spread = nan"), "robot.spread", ("finite",)),
        (("spread = 1.5", "spread = inf"), "robot.spread", ("finite",)),
        (('brand = "any"', "brand = 3"), "robot.brand", ("string",)),
        (("legs = 6", "leggs = 6"), "robot.leggs", ("no such key", "'legs'")),
        (("small = 6", "smal = 6"), "robot.parameters.smal", ("no such parameter", "'small'")),
        (("small = 6", "small = -6"), "robot.parameters.small", ("at least 0 cm",)),
        (("_length = 5", "_length = 0"), "robot.characteristic_length", ("greater than 0",)),
        (("_length = 5", "_length = inf"), "robot.characteristic_length", ("finite",)),
        (('model = "tripod"', 'model = "tripot"'), "robot.model", ("no such robot", "'tripod'")),
    ],
)
@pytest.mark.usefixtures("tripod")
def test_its_options_are_checked_against_its_signature(
    edit: tuple[str, str], key: str, words: tuple[str, ...], tmp_path: Path, cli: Run
) -> None:
    path = case_file(tmp_path, edit)
    with pytest.raises(sn.CaseError) as refused:
        sn.load_case(path)
    assert refused.value.key == key
    refusal_of(cli("solve", path), "case.toml", key, *words)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("(10.0,), 0.0)", "(10.0,), 9.5, 10.5)"),  # a narrow range
        ("(10.0,), 0.0)", "(10.0,), 10.0)"),  # typical at the end of its range
        ("(10.0,), 0.0)", "(0.0,))"),
        ("home=(0.0, 0.0, 30.0)", "home=(20.0, 0.0, 0.0)"),  # in the plane
    ],
)
def test_a_new_case_for_unusual_typical_values(old: str, new: str, install: Install, tmp_path: Path, cli: Run) -> None:
    install({"tripod": "robots:tripod"}, edited(MODULE, (old, new)))
    # How options are written is another test's matter.
    path = saved(tmp_path / "mine.toml", cli("new", "tripod")[1].replace("= False", "= false"))
    assert cli("evaluate", str(path))[::2] == (0, "")


def test_a_shipped_name_cannot_be_taken_over(install: Install, cli: Run) -> None:
    install({"hexapod": "robots:hexapod", "stewart-gough": "robots:hexapod", "tripod": "robots:tripod"})
    assert model_names() == ("stewart-gough", "hexapod", "three-upu", *gallery_names(), "tripod")
    assert robot_function("hexapod").__module__ == "screwsynth.models.hexapod"
    assert sn.build_model("stewart-gough").parameters[0].name == "x1"
    out = output_of(cli("models", "--all"))
    assert sum(line.startswith("hexapod") for line in out.splitlines()) == 1
    assert cli("solve", "paper-4.1-helical", "--starts", "1")[0] == 0


def test_a_name_that_two_packages_offer(install: Install, tmp_path: Path, cli: Run) -> None:
    install({"tripod": "robots:tripod"}, package="first_robots")
    install({"tripod": "robots:tripod"}, package="second_robots")
    assert model_names().count("tripod") == 1
    with pytest.raises(AmbiguousModelError):
        robot_function("tripod")
    with pytest.raises(sn.CaseError, match="first_robots and second_robots"):
        sn.build_model("tripod")
    for arguments in (("models", "tripod"), ("new", "tripod"), ("solve", case_file(tmp_path))):
        refusal_of(cli(*arguments), "first_robots and second_robots")
    assert "first_robots" in " ".join(output_of(cli("models", "--all")).split())


def test_an_option_without_a_default_hides_no_other_robot(install: Install, tmp_path: Path, cli: Run) -> None:
    install({"sized": "robots:sized"})
    edits = [('model = "tripod"\nlegs = 6\n', 'model = "sized"\nsize = 6\n'), ("twisted = true\n", "")]
    edits += [('drive = "fast"\n', ""), ("spread = 1.5\n", ""), ('brand = "any"\n', "")]
    path = case_file(tmp_path, *edits)
    assert cli("solve", path)[0] == 0
    path = case_file(tmp_path, *edits, ("size = 6\n", ""))
    refusal_of(cli("solve", path), "case.toml", "robot.size", "missing", "'sized'")
    out = output_of(cli("models"))
    assert all(name in out for name in ("stewart-gough", "hexapod", "sized"))
    assert "must be given" in output_of(cli("models", "sized"))


def test_text_in_square_brackets_is_shown_as_it_is(install: Install, tmp_path: Path, cli: Run) -> None:
    bracketed = ('"leg {i + 1}"', '"[leg{i}]"'), ('"legs and a joint"', '"legs [short] and a [/joint]"')
    module = edited(MODULE, *bracketed, ('"radius of the base"', '"radius [of the base]"'))
    install({"tripod": "robots:tripod"}, module)
    for arguments, word in (
        (("models", "--all"), "legs [short] and a [/joint]"),
        (("models", "tripod"), "radius [of the base]"),
        (("models", "tripod", "--all"), "[leg0]"),
        (("evaluate", case_file(tmp_path), "--all"), "[leg0]"),
    ):
        assert word in output_of(cli(*arguments))


FAULTY = {
    "raises-at-import": ("raise RuntimeError('no licence')\n", "robots:tripod", "no licence"),
    "imports-what-is-not-there": ("import no_such_module_at_all\n", "robots:tripod", "no_such_module_at_all"),
    "is-no-python": ("def tripod(:\n", "robots:tripod", "robots.py"),
    "has-no-such-function": (MODULE, "robots:tripot", "tripot"),
    "has-no-such-module": (MODULE, "robot:tripod", "workshop_robots.robot"),
    "is-no-function": ("tripod = 3\n", "robots:tripod", "tripod"),
    "is-a-model-itself": (MODULE + "\ntripod = tripod()\n", "robots:tripod", "tripod"),
    "returns-nothing": ("def tripod():\n    pass\n", "robots:tripod", "Model"),
    "returns-text": ("def tripod():\n    return 'tripod'\n", "robots:tripod", "Model"),
    "raises": ("def tripod():\n    raise ZeroDivisionError('by zero')\n", "robots:tripod", "by zero"),
    "contradicts-itself": (MODULE.replace('"radius", radius', '"radius", 2 * radius'), "robots:tripod", "expression"),
    "has-a-hint-that-is-nothing": ("def tripod(*, legs: 'Legs' = 3):\n    pass\n", "robots:tripod", "Legs"),
    "takes-anything": ("def tripod(**options):\n    return None\n", "robots:tripod", "tripod"),
    "takes-positions": ("def tripod(legs=3, /):\n    return None\n", "robots:tripod", "keyword parameter"),
    "exits-at-import": ("raise SystemExit(3)\n", "robots:tripod", "SystemExit"),
    "has-a-hint-that-exits": ("def tripod(*, n: 'object()' = 1): raise SystemExit\n", "robots:tripod", "SystemExit"),
    "exits": ("def tripod(): raise SystemExit\n", "robots:tripod", "SystemExit"),
    "has-no-name-of-a-module": ("", "no-such-thing:!", "cannot be used"),
    "calls-itself-otherwise": (MODULE.replace('name="tripod"', 'name="quadripod"'), "robots:tripod", "quadripod"),
}
OPTIONS = {"legs", "twisted", "drive", "spread", "brand"}
WITHOUT_OPTIONS = "\n".join(line for line in CASE.splitlines() if line.partition(" ")[0] not in OPTIONS)


@pytest.mark.parametrize(("module", "target", "words"), FAULTY.values(), ids=FAULTY)
def test_a_faulty_robot_is_a_sentence_and_hides_no_other(
    module: str, target: str, words: str, install: Install, tmp_path: Path, cli: Run
) -> None:
    install({"tripod": target}, module)
    install({"sized": "robots:sized"}, package="good_robots")
    path = str(saved(tmp_path / "case.toml", WITHOUT_OPTIONS))
    with pytest.raises(sn.InputError) as refused:
        sn.load_case(path)
    for said in (str(refused.value), cli("solve", path)[2]):
        assert all(each in said for each in ("case.toml", "tripod", words))
    for arguments in (("solve", path), ("models", "tripod"), ("new", "tripod")):
        refusal_of(cli(*arguments), "tripod", words)
    assert cli("evaluate", "paper-4.1-helical")[0] == cli("models", "sized")[0] == 0
    code, out, err = cli("models")
    assert code == 0
    assert len(err.splitlines()) <= 1
    for name in ("stewart-gough", "hexapod", "three-upu", "sized", "tripod"):
        assert name in out + err


@pytest.mark.parametrize("points", ["[screwsynth.models]\ntripod\n", "[screwsynth.models\ntripod = robots:tripod"])
def test_entry_points_that_are_none_hide_no_other(points: str, install: Install, cli: Run) -> None:
    site = install({})
    (site / "workshop_robots-1.0.dist-info" / "entry_points.txt").write_text(points, encoding="utf-8")
    install({"sized": "robots:sized"}, package="good_robots")
    assert "sized" in output_of(cli("models"))
    assert cli("models", "sized")[0] == 0
    refusal_of(cli("models", "tripod"))


def test_parameters_with_the_names_of_the_pose(install: Install, tmp_path: Path, cli: Run) -> None:
    """A robot whose parameters are called as numbers of the pose: its own are written with ``robot.`` before them."""
    module = MODULE.replace('Parameter("radius"', 'Parameter("p_x"').replace('Parameter("small"', 'Parameter("angle"')
    install({"tripod": "robots:tripod"}, module)
    edits = [("radius = { min", "p_x = { min"), ("small = 6", "angle = 6")]
    pose = "position = [{ min = -2, max = 1 }, 0, 30]\nrotation = { axis = [0, 0, 1], angle = 5 }"
    relation = '[limits]\ncustom = ["robot.p_x - 2*p_x + 0*robot.angle + 0*angle <= 20"]\n\n[solve]'
    path = case_file(tmp_path, *edits, ("position = [0, 0, 30]", pose), ("[solve]", relation))

    out = output_of(cli("solve", path))
    rows = {line.split()[0]: line for line in out.splitlines() if line.strip()}
    for name, words in {
        "robot.p_x": ("8 .. 12", "at "),
        "robot.angle": ("6 ", "cm ", "fixed"),
        "p_x": ("-2 .. 1",),
        "angle": ("5 ", "deg ", "fixed"),
    }.items():
        assert all(word in rows[name] for word in words), rows[name]

    result = json.loads(output_of(cli("solve", path, "--json", "-")))
    assert set(result["parameters"]) == {"p_x", "angle"}
    sensitivity = {row["name"]: row for row in result["sensitivity"]}
    assert (sensitivity["robot.angle"]["value"], sensitivity["angle"]["value"]) == (6, 5)
    held = {row["name"]: row["multiplier"] for row in result["optimality"]["active"]}
    assert held
    assert set(held) <= {"robot.p_x", "p_x", "custom: robot.p_x - 2*p_x + 0*robot.angle + 0*angle <= 20"}

    settings = ("--set", "robot.p_x=9", "--set", "robot.angle=7", "--set", "p_x=0.5", "--set", "angle=3")
    result = json.loads(output_of(cli("evaluate", path, *settings, "--json", "-")))
    assert result["parameters"] == {"p_x": 9, "angle": 7}
    assert (result["pose"]["position"], result["pose"]["angle"]) == ([0.5, 0, 30], 3)

    refusal_of(cli("evaluate", path, "--set", "robot.p_y=1"), "robot.p_y", "did you mean 'robot.p_x'", "robot.angle")
    wrong = case_file(tmp_path, *edits, ("[solve]", '[limits]\ncustom = ["robot.p_y >= 1"]\n\n[solve]'))
    refusal_of(cli("solve", wrong), "limits.custom[0]", "'robot.p_y' at position 1", "did you mean 'robot.p_x'")


def test_a_parameter_is_held_by_its_own_bound_not_by_the_poses(install: Install, tmp_path: Path, cli: Run) -> None:
    install({"tripod": "robots:tripod"}, MODULE.replace('Parameter("radius"', 'Parameter("p_x"'))
    path = case_file(tmp_path, ("radius = {", "p_x = {"), ("position = [0", "position = [{ min = -1, max = 1 }"))
    result = json.loads(output_of(cli("solve", path, "--json", "-")))
    # F is maximised: relaxing an upper bound moves it up, and a lower bound down.
    held = {
        row["name"]: (f"at {'upper' if row['bound'] == 'max' else 'lower'} bound", f"{row['multiplier']:.4g}")
        for row in result["optimality"]["active"]
    }
    assert held
    rows = {line.split()[0]: line for line in cli("solve", path)[1].splitlines() if line.strip()}
    for name in ("robot.p_x", "p_x"):
        assert all(each in rows[name] for each in held[name]) if name in held else " bound" not in rows[name]


PLAIN = ("x1", "x2", "x3", "x4")
HELICAL = sn.Task.screw("max", axis=[2, 2, 1], point=[2, 3, 6], pitch=1, name="helical")
TURN = sn.Task.screw("max", axis=[0, 0, 1], point=[0, 0, 0], pitch=0, name="turn")

#: Every name that a program or a case gives to something of its own.
INTERNAL = [
    *(f"twist_{i}" for i in range(6)), *(f"twist1_{i}" for i in range(6)), "twist",
    "p_x", "p_y", "p_z", "q_x", "q_y", "q_z", "axis", "axis_x", "axis_y", "axis_z", "angle", "p", "q",
    "level", "ceiling", "weight0", "weight1", "best0", "best1", "near0", "characteristic_length", "cost", "scale",
    "target", "pose1_p_x", "pose1_angle", "pose2_q_x", "at1_p_x", "x", "s", "centre", "weight", "sizes", "t",
    "multipliers", "program.level", "base_error", "R",
]  # fmt: skip


def renamed(names: tuple[str, ...]) -> Model:
    """The platform on two circles with other names for its four parameters."""
    model = stewart_gough()
    new = dict(zip(PLAIN, names, strict=True))
    return replace(
        model,
        parameters=tuple(replace(item, name=new[item.name]) for item in model.parameters),
        scene=replace(model.scene, marks=tuple(replace(m, parameter=new[m.parameter]) for m in model.scene.marks)),
    )


def case_of(names: tuple[str, ...], *, tasks: list[sn.Task], held: bool = False, **rest: object) -> sn.Case:
    x1, x2, x3, x4 = names
    return sn.Case(
        model=renamed(names),
        parameters={x1: 12.0, x2: 8.0, x3: math.radians(30), x4: sn.Free(math.radians(5), math.radians(25))},
        position=[sn.Free(-10, 10), -5.0, sn.Free(20, 50)],
        rotation=sn.Rotation(axis=[0, 0, 1] if held else None, angle=sn.Free(-math.radians(30), math.radians(30))),
        tasks=tasks,
        **rest,  # type: ignore[arg-type]
    )


def groups() -> list[tuple[str, ...]]:
    """The internal names, four to a robot."""
    padded = [*INTERNAL, *(f"extra{i}" for i in range(-len(INTERNAL) % 4))]
    return [tuple(padded[i : i + 4]) for i in range(0, len(padded), 4)]  # type: ignore[misc]


#: With the axis held, only the names of a rotation differ.
KINDS = [(names, held) for names in groups() for held in (False, True)]
OF_ROTATIONS = [
    (names, held) for names, held in KINDS if not held or {"axis", "axis_x", "axis_z", "angle"} & set(names)
]


@pytest.mark.parametrize("kind", soaked(KINDS, OF_ROTATIONS), ids=lambda kind: "-".join(kind[0]))
def test_internal_names_as_parameter_names_change_nothing(kind: tuple[tuple[str, ...], bool]) -> None:
    names, held = kind
    tasks = [HELICAL, TURN]
    one = case_of(PLAIN, tasks=tasks, held=held)
    other = case_of(names, tasks=tasks, held=held)
    pairs = list(zip(formulate_each(one), formulate_each(other), strict=True))
    pairs.append(tuple(formulate_weighted(each, [1.0, 2.0]) for each in (one, other)))
    pairs.append(tuple(formulate_worst(each, [1.0, 1.0], [300.0, 50.0], 400.0) for each in (one, other)))
    steps = sn.along_screw(HELICAL.twist, [0.0, 0.1, 0.2])
    several = {"displacements": steps, "over_poses": sn.OverPoses.WORST, "tasks": [HELICAL], "held": held}
    pairs.append((sn.formulate(case_of(PLAIN, **several)), sn.formulate(case_of(names, **several))))  # type: ignore[arg-type]
    for first, second in pairs:
        for x in (first.start, first.lower + 0.3 * (first.upper - first.lower)):
            F, g = first.evaluate(x)
            G, h = second.evaluate(x)
            assert F == G
            np.testing.assert_array_equal(g, h)
        scalars = [*second.program.variables, *second.program.arguments]
        assert len({scalar.name for scalar in scalars}) == len(scalars)
        plain, odd = (sensitivities(nlp, nlp.start) for nlp in (first, second))
        assert [row.derivative for row in plain] == [row.derivative for row in odd]


def test_two_tasks_of_a_robot_with_a_parameter_named_as_a_twist() -> None:
    """Such a robot once gave 30.01 and 33.62, silently."""
    found = []
    for names in (PLAIN, ("twist_0", "level", "weight0", "q_x")):
        case = case_of(names, tasks=[HELICAL, TURN], method=sn.Method.WORST_CASE)
        solution = sn.solve(case, starts=4)
        found.append([outcome.F for outcome in solution.outcomes] + [solution.combination.value])
    assert found[0] == pytest.approx(found[1], rel=1e-12)


def test_answers_proofs_and_c_do_not_depend_on_names() -> None:
    results = []
    for names in (PLAIN, ("angle", "level", "twist_0", "p_x")):
        solution = sn.solve(case_of(names, tasks=[HELICAL]), starts=4)
        proof = sn.certify_program(solution.nlp, solution.x, time_limit=20.0)
        results.append((solution.F, proof.bound, proof.boxes))
        header = next(text for name, text in generate_c(solution.nlp.case, "").items() if name.endswith(".h"))
        assert "robot.p_x" in header if names != PLAIN else "robot." not in header
    assert results[0] == results[1]
    # A parameter with a name of the pose is written with its robot.
    case = case_of(("p_x", "angle", "q_x", "free"), tasks=[HELICAL])
    assert list(case.scalars)[:4] == ["robot.p_x", "robot.angle", "q_x", "free"]
