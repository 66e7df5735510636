"""The package as a whole: what it exports, what its wheel holds, and that its documentation is true."""

import ast
import html
import inspect
import pkgutil
import re
import subprocess
import sys
import textwrap
import tomllib
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import pytest
from builders import docs_script, printed

import screwsynth
import screwsynth.cases
import screwsynth.models
import screwsynth.nlp
from screwsynth.nlp.case.limits.registry import LIMIT_TYPES
from screwsynth.nlp.cli import contents
from screwsynth.nlp.starter.text import starter_case

ROOT = Path(__file__).parents[1]


def text_of(page: str) -> str:
    """A page of the documentation."""
    return (ROOT / "docs" / page).read_text(encoding="utf-8")


@pytest.mark.parametrize("package", [screwsynth, screwsynth.models, screwsynth.nlp])
def test_every_public_name_is_there_and_listed_in_order(package: object) -> None:
    names = package.__all__  # type: ignore[attr-defined]
    assert list(names) == sorted(names)
    for name in names:
        assert getattr(package, name) is not None


def test_the_stub_is_the_one_list_of_public_names() -> None:
    stub = Path(screwsynth.nlp.__file__).with_suffix(".pyi")
    tree = ast.parse(stub.read_text(encoding="utf-8"))
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    places = {alias.asname: (node.module, alias.name) for node in imports for alias in node.names}
    assert all(node.level == 1 for node in imports)
    assert [ast.unparse(node) for node in tree.body[1:] if node not in imports] == ["__version__: str"]
    assert sorted(places) == screwsynth.nlp.__all__ == dir(screwsynth.nlp)
    for name, (module, own_name) in places.items():
        assert own_name == name
        value = getattr(screwsynth.nlp, name)
        assert value is getattr(import_module(f"screwsynth.nlp.{module}"), name)
        # Where it is defined, not where another module imports it.
        assert value.__module__ == f"screwsynth.nlp.{module}"
    with pytest.raises(AttributeError, match="no attribute 'no_such_name'"):
        _ = screwsynth.nlp.no_such_name  # type: ignore[attr-defined]


def test_the_package_has_every_public_name_of_nlp_and_those_of_robots() -> None:
    stub = ast.parse((ROOT / "__init__.pyi").read_text(encoding="utf-8"))
    imports = {
        (node.module, alias.name): alias.asname for node in stub.body[1:] for alias in getattr(node, "names", [])
    }
    of_robots = [name for place, name in imports if place == "models"]
    assert {"Model", "stewart_gough", "hexapod", "three_upu", "robot", "model_names"} <= set(of_robots)
    # A name of both packages would be one of them by chance.
    assert set(of_robots).isdisjoint(screwsynth.nlp.__all__)
    assert sorted([*screwsynth.nlp.__all__, *of_robots, "models", "nlp"]) == screwsynth.__all__
    for name in screwsynth.__all__:
        package = screwsynth.models if name in of_robots else screwsynth.nlp
        if name not in ("models", "nlp"):
            assert getattr(screwsynth, name) is getattr(package, name)
    assert (screwsynth.models, screwsynth.nlp) == (sys.modules["screwsynth.models"], sys.modules["screwsynth.nlp"])
    assert set(dir(screwsynth)) == {*screwsynth.__all__, "__version__"}
    with pytest.raises(AttributeError, match="module 'screwsynth' has no attribute 'no_such_name'"):
        _ = screwsynth.no_such_name  # type: ignore[attr-defined]


def test_the_package_is_imported_without_the_numerical_libraries() -> None:
    code = (
        "import sys, screwsynth as ss\n"
        "heavy = {'casadi', 'numpy', 'pydantic', 'screwsynth.models'} & set(sys.modules)\n"
        "assert not heavy and {'solve', 'Case', 'stewart_gough'} < set(dir(ss)) and ss.__version__, heavy\n"
        "assert ss.models.stewart_gough is ss.stewart_gough"
    )
    ended = subprocess.run([sys.executable, "-P", "-c", code], check=False, capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_every_package_is_listed_for_the_wheel() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    modules = (path for folder in ("cases", "models", "nlp") for path in (ROOT / folder).rglob("*.py"))
    packages = {".".join(("screwsynth", *path.parent.relative_to(ROOT).parts)) for path in modules}
    assert sorted(project["tool"]["setuptools"]["packages"]) == sorted(packages | {"screwsynth"})


def test_the_version_is_that_of_the_distribution() -> None:
    assert screwsynth.nlp.__version__ == screwsynth.__version__ == version("screwsynth")


def test_no_public_name_is_that_of_a_room() -> None:
    # Importing the room would put it in the place of the name.
    rooms = {module.name for module in pkgutil.iter_modules(screwsynth.nlp.__path__)}
    assert rooms.isdisjoint(screwsynth.nlp.__all__)


def test_the_commands_are_public_functions() -> None:
    case = screwsynth.nlp.load_case("paper-4.2-rotation")
    solution = screwsynth.nlp.solve(case, starts=4)
    certified = screwsynth.nlp.certify(solution, gap=1e-2)
    assert certified.solution.outcomes[0].own is solution.outcomes[0].own
    assert certified.is_proved
    assert screwsynth.nlp.certify(case, starts=4, gap=1e-2).is_proved
    assert screwsynth.nlp.result_of(certified).certificate.status.value == "proved"
    assert screwsynth.nlp.result_of(solution).certificate is None
    (checked,) = screwsynth.nlp.check(["paper-4.2-rotation"])
    assert checked.passed
    files = screwsynth.nlp.generate_c(case)
    assert {"case.toml", "Makefile"} < set(files)
    tomllib.loads(files["case.toml"])


def test_pictures_and_pages_are_public_functions(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    pytest.importorskip("plotly")
    case = screwsynth.nlp.load_case("paper-4.2-rotation")
    solution = screwsynth.nlp.solve(case, starts=4)
    for name, found in (("solution.svg", solution), ("model.png", case.model)):
        screwsynth.nlp.plot(found, tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000
    with pytest.raises(screwsynth.nlp.InputError, match="ends in"):
        screwsynth.nlp.plot(solution, tmp_path / "solution.txt")
    text = (Path(screwsynth.cases.__file__).parent / "paper-4.2-rotation.toml").read_text(encoding="utf-8")
    page = screwsynth.nlp.report(solution, text=text)
    assert page.startswith("<!DOCTYPE html>")
    assert html.escape(text.splitlines()[0]) in page
    assert html.escape(case.to_toml().splitlines()[0]) in screwsynth.nlp.report(solution)


def test_public_names_show_before_they_are_loaded() -> None:
    code = "import sys, screwsynth.nlp as n; sys.exit('numpy' in sys.modules or not {'solve', 'Case'} < set(dir(n)))"
    assert subprocess.run([sys.executable, "-P", "-c", code], check=False).returncode == 0


def test_what_commands_deliver_is_loaded_when_it_is_used() -> None:
    names = re.findall(
        r" as (\w+)$", Path(contents.__file__).with_suffix(".pyi").read_text("utf-8"), flags=re.MULTILINE
    )
    assert all(callable(getattr(contents, name)) for name in names)
    code = (
        "import sys, screwsynth.nlp.cli.contents; rooms = ['output', 'results', 'words']\n"
        "sys.exit(any(m.startswith(f'screwsynth.nlp.{room}') for room in rooms for m in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-P", "-c", code], check=False).returncode == 0


def test_help_does_not_import_the_numerical_libraries() -> None:
    heavy = "('casadi', 'numpy', 'pydantic', 'rich.table', 'screwsynth.nlp.cli.solve')"
    code = f"import sys, screwsynth.nlp.cli.app; sys.exit(any(m in sys.modules for m in {heavy}))"
    assert subprocess.run([sys.executable, "-P", "-c", code], check=False).returncode == 0


def test_a_solve_loads_neither_robots_nor_tables_nor_proofs_that_its_case_has_none_of() -> None:
    unused = ("models.joints.model.robot", "models.mechanism", "nlp.case.limits.registry", "nlp.case.workspacetables")
    proofs = ("nlp.proof.workspace", "nlp.proof.boxes", "nlp.proof.enclosure", "nlp.proof.checker")
    names = [f"screwsynth.{name}" for name in (*unused, *proofs)]
    code = (
        "import sys\nfrom screwsynth.nlp.cli.main import run\nsys.argv = ['screwsynth', 'solve', 'paper-4.1-helical']\n"
        f"assert run() == 0\nsys.exit(', '.join(n for n in {names} if n in sys.modules) or 0)"
    )
    ended = subprocess.run([sys.executable, "-P", "-c", code], check=False, capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_the_version_is_one_everywhere_and_its_date_too() -> None:
    citation, recipe, changes = (
        (ROOT / name).read_text(encoding="utf-8")
        for name in ("CITATION.cff", "packaging/conda/recipe.yaml", "CHANGELOG.md")
    )
    assert printed("--version").split() == ["screwsynth", version("screwsynth")]
    assert f"\nversion: {version('screwsynth')}\n" in citation
    assert f'\n  version: "{version("screwsynth")}"\n' in recipe
    assert "\nlicense: MIT\n" in citation
    (date,) = re.findall(r"^date-released: (\d{4}-\d\d-\d\d)$", citation, flags=re.MULTILINE)
    headings = re.findall(r"^## (.*)$", changes, flags=re.MULTILINE)
    assert headings[:2] == ["Unreleased", f"{version('screwsynth')}, {date}"]


def test_the_targets_that_contributors_are_told_are_those_of_make() -> None:
    make = (ROOT / "Makefile").read_text(encoding="utf-8")
    told = [ROOT / "CONTRIBUTING.md", ROOT / "README.md", *(ROOT / ".github" / "workflows").glob("*.yml")]
    for page in told:
        for target in re.findall(r"\bmake ([a-z]+)\b(?=`|\n| +#)", page.read_text(encoding="utf-8")):
            assert f"\n{target}:" in make, f"{page.name}: make {target}"


def test_the_python_of_the_first_steps_runs() -> None:
    (code,) = re.findall(r"```python\n(.*?)```", text_of("start.md"), flags=re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 12
    space: dict[str, object] = {}
    exec(compile(code, "start.md", "exec"), space)  # noqa: S102 - our own page
    assert pytest.approx(407.2107, abs=5e-5) == space["solution"].F  # type: ignore[attr-defined]


def test_the_python_of_the_reference_runs_and_begins_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"```python\n(.*?)```", text_of("api.md"), flags=re.DOTALL)
    assert inspect.cleandoc(screwsynth.__doc__ or "").find(textwrap.indent(blocks[0], "    ").rstrip()) > 0
    space: dict[str, object] = {}
    exec(compile("\n".join(blocks), "api.md", "exec"), space)  # noqa: S102 - our own page
    first, start, height, curve = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"F = 407\.2 \(cm/rad\)² at p_z = 50\.0 cm, turned by -?\d+\.\d deg", first)
    assert float(start) == pytest.approx(338.84944, abs=5e-6)
    assert 25 <= float(height) <= 50
    assert "407.21" in curve


@pytest.mark.parametrize(
    ("page", "name"), [("several-tasks.md", "paper-4.2"), ("certificate.md", "paper-4.2-rotation")]
)
def test_the_python_of_the_documentation_runs(page: str, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", text_of(page), flags=re.DOTALL)
    case = screwsynth.nlp.load_case(name)
    space = {each: getattr(screwsynth.nlp, each) for each in screwsynth.nlp.__all__} | {"case": case}
    exec(compile(code, page, "exec"), space)  # noqa: S102 - our own page
    assert capsys.readouterr().out


def test_links_in_the_documentation_lead_somewhere() -> None:
    own, pages = sorted(ROOT.glob("*.md")), sorted((ROOT / "docs").glob("*.md"))
    for page in [*own, *pages]:
        for target, place in re.findall(r"\]\(([^)#:]*)(?:#([^)]*))?\)", page.read_text(encoding="utf-8")):
            found = page.parent / target if target else page
            assert found.exists(), f"{page.name}: {target}"
            if place:
                headings = re.findall(r"^#+ (.*)$", found.read_text(encoding="utf-8"), flags=re.MULTILINE)
                anchors = [re.sub(r"[^\w -]", "", each.lower()).replace(" ", "-") for each in headings]
                assert place in anchors, f"{page.name}: {target}#{place}"
    # The navigation of the site is made of these lists.
    listed = re.findall(r"^- \[.*?\]\((\w[\w-]*\.md)\)", text_of("index.md") + text_of("api.md"), flags=re.MULTILINE)
    assert sorted([*listed, "index.md"]) == [page.name for page in pages]


def test_the_robots_of_the_documentation_are_models(capsys: pytest.CaptureFixture[str]) -> None:
    space: dict[str, object] = {}
    blocks = re.findall(r"```python\n(.*?)```", text_of("robots.md"), flags=re.DOTALL)
    assert len(blocks) == 2
    for code in blocks:
        exec(compile(code, "robots.md", "exec"), space)  # noqa: S102 - our own page
    assert capsys.readouterr().out.startswith("F = ")
    model = space["tripod"](crossed=True)  # type: ignore[operator]
    assert isinstance(model, screwsynth.models.Model)
    assert model.limbs == ("1", "2", "3")


def test_the_robot_files_of_the_documentation_are_read() -> None:
    text = text_of("robots.md")
    files = [tomllib.loads(each) for each in re.findall(r"^```toml\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)]
    robots = [each for each in files if "limb" in each]
    assert [each["name"] for each in robots] == ["my-robot", "Delta"]
    folder = Path(screwsynth.models.__file__).parent / "robots"
    shipped = tomllib.loads((folder / "delta.toml").read_text(encoding="utf-8"))
    # The same robot as the shipped one, whose file has a description too.
    assert robots[1] == {key: value for key, value in shipped.items() if key != "description"}
    assert screwsynth.models.robot(**robots[0]).limbs == ("1", "2", "3")


def test_the_delta_of_the_documentation_is_what_the_commands_print(tmp_path: Path) -> None:
    text = text_of("robots.md")
    (case,) = (each for each in re.findall(r"```toml\n(.*?)```", text, flags=re.DOTALL) if "[[task]]" in each)
    (tmp_path / "delta.toml").write_text(case, encoding="utf-8")
    for opening, arguments in (
        ("screwsynth models delta --all", ["models", "delta", "--all"]),
        ("solve", ["solve", str(tmp_path / "delta.toml")]),
    ):
        (shown,) = re.findall(rf"<!-- begin: {opening} -->\n```text\n(.*?)```", text, flags=re.DOTALL)
        lines = [line.rstrip() for line in printed(*arguments).splitlines()]
        assert shown
        assert [line for line in shown.splitlines() if line not in lines] == []


def test_the_gallery_of_the_documentation_is_up_to_date() -> None:
    (written,) = re.findall(r"<!-- begin: gallery -->\n(.*?)<!-- end -->", text_of("robots.md"), flags=re.DOTALL)
    assert written == docs_script("gallery").table(), "run `make docs`"


def test_the_page_of_cases_is_up_to_date() -> None:
    assert text_of("cases.md") == docs_script("gallery").cases(), "run `make docs`"


def test_the_case_file_of_the_documentation_is_valid() -> None:
    written, path = re.findall(r"```toml\n(.*?)```", text_of("case-files.md"), flags=re.DOTALL)
    tables = tomllib.loads(written + path)
    case = screwsynth.nlp.case_from_tables(tables, name="shown", source="case-files.md")
    assert case.tasks[0].name == "drive the screw"
    assert case.path is not None
    assert case.path.file == "part.ngc"


def test_the_loads_of_the_documentation_are_valid() -> None:
    loads, objective = re.findall(r"```toml\n(.*?)```", text_of("loads.md"), flags=re.DOTALL)
    starter = tomllib.loads(starter_case(screwsynth.models.stewart_gough()))
    starter["units"]["length"] = "m"
    tables = starter | {**tomllib.loads(loads), "units": starter["units"]}
    case = screwsynth.nlp.case_from_tables(tables, name="shown", source="loads.md")
    assert [each.name for each in case.loading.cases] == ["cutting", "cutting reversed"]
    assert len(case.limits) == 3
    task = {"task": [{**starter["task"][0], "sense": "min"}]}
    least = screwsynth.nlp.case_from_tables(tables | task | tomllib.loads(objective), name="shown", source="loads.md")
    assert least.tasks[0].measure == "actuator_force"


def test_the_limits_of_the_documentation_are_valid() -> None:
    limits, joints, poses = re.findall(r"```toml\n(.*?)```", text_of("limits.md"), flags=re.DOTALL)
    starter = tomllib.loads(starter_case(screwsynth.models.stewart_gough()))
    several = screwsynth.nlp.case_from_tables(starter | tomllib.loads(poses), name="shown", source="limits.md")
    assert several.pose_count == 2 + 5 + 6
    written = tomllib.loads(limits)
    of_joints = {key for kind in LIMIT_TYPES if kind.needs_joints for key in kind.fields()}
    for key in of_joints:
        del written["limits"][key]
    elastic = {"robot": starter["robot"] | {"actuator_stiffness": 1000.0}}
    case = screwsynth.nlp.case_from_tables(starter | written | elastic, name="shown", source="limits.md")
    assert {type(limit) for limit in case.limits} == {
        kind for kind in LIMIT_TYPES if kind.key and not kind.needs_joints
    }
    # The joints that the page speaks of, in two limbs with a ball and one with a tube.
    limb = [
        {"type": "R", "name": "crank", "at": "x", "axis": "y", "actuated": True},
        {"type": "U", "name": "cardan", "at": "x + z", "axes": ["x", "y"]},
        {"type": "P", "at": "x + z", "axis": "z", "actuated": True},
        {"type": "S", "name": "ball", "at": "x + 2*z"},
    ]
    tube = [{"type": "C", "name": "tube", "at": "0*x", "axis": "z"}]
    robot = {"name": "shown", "limb": [{"repeat": {"count": 2}, "joints": limb}, {"joints": tube}]}
    tables = {"robot": {"definition": robot}, "pose": {"position": [0, 0, 0]}, "task": starter["task"]}
    shown = screwsynth.nlp.case_from_tables(tables | tomllib.loads(joints), name="shown", source="limits.md")
    assert len(shown.limits) == 8


def test_the_limits_shown_in_the_documentation_are_what_the_command_prints() -> None:
    begin = "<!-- begin: screwsynth solve hexapod-machining --all -->"
    (shown,) = re.findall(rf"{begin}\n```text\n(.*?)```", text_of("limits.md"), flags=re.DOTALL)
    lines = printed("solve", "hexapod-machining", "--starts", "4", "--all").splitlines()
    assert shown in "".join(f"{line.rstrip()}\n" for line in lines)
