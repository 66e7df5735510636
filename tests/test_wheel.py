"""What is distributed: a wheel for every Python from 3.11 on, with its kernels, and sources that build."""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import screwsynth.nlp

ROOT = Path(__file__).parents[1]
PIP = ("-m", "pip", "--disable-pip-version-check", "--quiet")
KERNELS = {"screwsynth/nlp/proof/enclosure/_bounds.abi3.so", "screwsynth/nlp/screening/_screen.abi3.so"}

pytestmark = pytest.mark.slow


def other_pythons() -> dict[str, str]:
    """The interpreters of other versions from 3.11 on that this machine has, by version."""
    folders = [
        *os.environ.get("PATH", "").split(os.pathsep),
        *map(str, (Path.home() / ".pyenv/versions").glob("*/bin")),
    ]
    found = {}
    for path in (each for folder in folders for each in sorted(Path(folder).glob("python3.*"))):
        version = re.fullmatch(r"python3\.(\d+)", path.name)
        if version and int(version[1]) >= 11 and int(version[1]) != sys.version_info.minor:
            ran = subprocess.run([path, "-c", "import venv"], check=False, capture_output=True)
            if ran.returncode == 0:
                found.setdefault(f"3.{version[1]}", str(path))
    return found


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sources, without what is built or written beside them."""
    folder = tmp_path_factory.mktemp("sources") / "screwsynth"
    shutil.copytree(ROOT, folder, ignore=shutil.ignore_patterns(".*", "build", "tests", "docs", "*.so", "__pycache__"))
    return folder


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel that is built from a source distribution."""
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "build", "--sdist", "--outdir", folder, source], check=True, capture_output=True
    )
    (archive,) = folder.glob("*.tar.gz")
    with tarfile.open(archive) as sources:
        names = {name.partition("/")[2] for name in sources.getnames()}
    assert {"nlp/proof/enclosure/kernel/rank.h", "nlp/embedding/c/screwsynth-sqp.h", "LICENSE"} <= names
    assert {"__init__.py", "__init__.pyi", "py.typed"} <= names
    subprocess.run([sys.executable, *PIP, "wheel", "--no-deps", "--wheel-dir", folder, archive], check=True)
    (built,) = folder.glob("*.whl")
    return built


def test_a_wheel_has_its_kernels_and_is_for_every_later_python(wheel: Path) -> None:
    assert wheel.name.startswith(f"screwsynth-{screwsynth.nlp.__version__}-cp311-abi3-")
    assert set(zipfile.ZipFile(wheel).namelist()) >= KERNELS


@pytest.mark.soak  # each version installs the packages that the program needs
@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13", "3.14"])
def test_a_wheel_proves_a_task_under_another_python(version: str, wheel: Path, tmp_path: Path) -> None:
    python = other_pythons().get(version)
    if python is None:
        pytest.skip(f"Python {version} is not another one of this machine")
    subprocess.run([python, "-m", "venv", tmp_path / "env"], check=True)
    python = str(tmp_path / "env" / "bin" / "python")
    installed = subprocess.run(
        [python, *PIP, "install", "--only-binary", ":all:", wheel], check=False, capture_output=True
    )
    if installed.returncode:
        pytest.skip(f"what the program needs cannot be installed under Python {version}")
    command = [python, "-m", "screwsynth.nlp", "certify", "paper-4.1-helical", "--gap", "0.01"]
    ran = subprocess.run(command, cwd=tmp_path, check=False, capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert "certificate  proved" in ran.stdout


def test_a_wheel_without_a_compiler_holds_every_module_and_case_and_runs(source: Path, tmp_path: Path) -> None:
    """Built without a C compiler, for want of which nothing fails but proofs."""
    without = {**os.environ, "CC": "false"}
    subprocess.run(
        [sys.executable, *PIP, "wheel", "--no-deps", "--wheel-dir", str(tmp_path), str(source)], check=True, env=without
    )
    (wheel,) = tmp_path.glob("*.whl")
    held = set(zipfile.ZipFile(wheel).namelist())
    assert not [name for name in held if name.endswith(".so")]
    suffixes = (".py", ".toml", ".ngc", ".typed", ".in", ".js", ".css")
    for folder in ("models", "nlp", "cases"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in suffixes and "__pycache__" not in path.parts:
                assert f"screwsynth/{path.relative_to(ROOT).as_posix()}" in held
    # The package's folder is that of the repository: nothing else of it belongs to the package.
    beside = {name.removeprefix("screwsynth/") for name in held if re.fullmatch(r"screwsynth/[^/]+", name)}
    assert beside == {"__init__.py", "__init__.pyi", "py.typed"}
    site = tmp_path / "site"
    subprocess.run([sys.executable, *PIP, "install", "--no-deps", "--target", str(site), str(wheel)], check=True)
    code = f"import screwsynth.nlp.cli.main as c; assert c.__file__.startswith({str(site)!r}), c.__file__; c.main()"
    environment = {**os.environ, "PYTHONPATH": str(site)}
    first = "import screwsynth as ss; print(ss.__file__, ss.solve(ss.load_case('paper-4.2-translation'), starts=2).F)"
    command = [sys.executable, "-P", "-c", first]
    printed = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True).stdout
    file, F = printed.split()
    assert file == str(site / "screwsynth" / "__init__.py")
    assert float(F) == pytest.approx(6)
    for name, status in (("solve", 0), ("certify", 2)):
        command = [sys.executable, "-P", "-c", code, name, "paper-4.2-translation", "--starts", "2"]
        ran = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert ran.returncode == status, ran.stderr
        assert ("largest F = 6" in ran.stdout) == (status == 0)
        assert ("the C kernel was not built" in ran.stderr) == (status == 2)
