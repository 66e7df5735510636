"""The package as a whole: what it exports, what its wheel holds, and that its README is true."""

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import screwsynth.models
import screwsynth.nlp
from screwsynth.nlp.case.limits.limits import LIMIT_TYPES
from screwsynth.nlp.case.starter import starter_case

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("package", [screwsynth.models, screwsynth.nlp])
def test_every_public_name_is_there_and_listed_in_order(package: object) -> None:
    names = package.__all__  # type: ignore[attr-defined]
    assert list(names) == sorted(names)
    for name in names:
        assert getattr(package, name) is not None


def test_public_names_show_before_they_are_loaded() -> None:
    code = "import sys, screwsynth.nlp as n; sys.exit('numpy' in sys.modules or not {'solve', 'Case'} < set(dir(n)))"
    assert subprocess.run([sys.executable, "-P", "-c", code], check=False).returncode == 0


def test_help_does_not_import_the_numerical_libraries() -> None:
    heavy = "('casadi', 'numpy', 'rich.table')"
    code = f"import sys, screwsynth.nlp.cli.main; sys.exit(any(m in sys.modules for m in {heavy}))"
    assert subprocess.run([sys.executable, "-P", "-c", code], check=False).returncode == 0


@pytest.mark.slow
def test_the_wheel_holds_every_module_and_case_and_runs(tmp_path: Path) -> None:
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    subprocess.run([*pip, "wheel", "--no-deps", "--wheel-dir", str(tmp_path), str(ROOT)], check=True)
    (wheel,) = tmp_path.glob("*.whl")
    held = set(zipfile.ZipFile(wheel).namelist())
    for folder in ("models", "nlp", "cases"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".toml", ".typed", ".in", ".js", ".css") and "__pycache__" not in path.parts:
                assert f"screwsynth/{path.relative_to(ROOT).as_posix()}" in held
    site = tmp_path / "site"
    subprocess.run([*pip, "install", "--no-deps", "--target", str(site), str(wheel)], check=True)
    code = f"import screwsynth.nlp.cli.main as c; assert c.__file__.startswith({str(site)!r}), c.__file__; c.main()"
    environment = {**os.environ, "PYTHONPATH": str(site)}
    command = [sys.executable, "-P", "-c", code, "solve", "paper-4.2-translation", "--starts", "2"]
    ran = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "largest F = 6" in ran.stdout


def test_the_readme_python_runs() -> None:
    (code,) = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 12
    space: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), space)  # noqa: S102 - our own README
    assert pytest.approx(407.2107, abs=5e-5) == space["solution"].F  # type: ignore[attr-defined]


def test_the_readme_output_is_what_the_command_prints() -> None:
    (shown,) = re.findall(r"```text\n\$ screwsynth solve paper-4.1-helical\n(.*?)```", README, flags=re.DOTALL)
    command = [sys.executable, "-P", "-m", "screwsynth.nlp", "solve", "paper-4.1-helical"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout

    def lines(text: str) -> list[str]:
        kept = [line.rstrip() for line in text.strip().splitlines()]
        return [line for line in kept if not line.startswith("evidence")]  # rounding errors differ by machine

    assert lines(shown) == lines(printed)


def test_links_in_the_documentation_lead_somewhere() -> None:
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_robot_of_the_documentation_is_a_model() -> None:
    text = (ROOT / "docs" / "robots.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    space: dict[str, object] = {}
    exec(compile(code, "robots.md", "exec"), space)  # noqa: S102 - our own page
    model = space["tripod"](crossed=True)  # type: ignore[operator]
    assert isinstance(model, screwsynth.models.Model)
    assert model.limbs == ("1", "2", "3")


def test_the_case_file_of_the_documentation_is_valid() -> None:
    text = (ROOT / "docs" / "case-files.md").read_text(encoding="utf-8")
    (written,) = re.findall(r"```toml\n(.*?)```", text, flags=re.DOTALL)
    case = screwsynth.nlp.case_from_tables(tomllib.loads(written), name="shown", source="case-files.md")
    assert case.tasks[0].name == "drive the screw"


def test_the_limits_of_the_documentation_are_valid() -> None:
    text = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")
    limits, poses = re.findall(r"```toml\n(.*?)```", text, flags=re.DOTALL)
    starter = tomllib.loads(starter_case(screwsynth.models.stewart_gough()))
    several = screwsynth.nlp.case_from_tables(starter | tomllib.loads(poses), name="shown", source="limits.md")
    assert several.pose_count == 2 + 5 + 6
    case = screwsynth.nlp.case_from_tables(starter | tomllib.loads(limits), name="shown", source="limits.md")
    assert {type(limit) for limit in case.limits} == {kind for kind in LIMIT_TYPES if kind.key}


def test_the_limits_shown_in_the_documentation_are_what_the_command_prints() -> None:
    text = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")
    (shown,) = re.findall(
        r"<!-- begin: screwsynth solve hexapod-machining -->\n```text\n(.*?)```", text, flags=re.DOTALL
    )
    command = [sys.executable, "-P", "-m", "screwsynth.nlp", "solve", "hexapod-machining", "--starts", "4"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert shown in "".join(f"{line.rstrip()}\n" for line in printed.splitlines())
