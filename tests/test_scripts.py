"""Types of the JavaScript in pages: ``make scripts`` finds a wrong one, and says so where it cannot check."""

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def scripts() -> ModuleType:
    spec = importlib.util.spec_from_file_location("scripts", ROOT / "bench" / "scripts.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def project(folder: Path, text: str) -> Path:
    """A project of one script with the settings of the package's."""
    settings = json.loads((ROOT / "jsconfig.json").read_text(encoding="utf-8"))
    (folder / "page.js").write_text(text, encoding="utf-8")
    target = folder / "jsconfig.json"
    target.write_text(json.dumps({**settings, "include": ["page.js"]}), encoding="utf-8")
    return target


def test_every_script_of_a_page_is_checked() -> None:
    settings = json.loads((ROOT / "jsconfig.json").read_text(encoding="utf-8"))
    assert settings["compilerOptions"]["strict"] is True
    checked = {path for pattern in settings["include"] for path in ROOT.glob(pattern)}
    assert set((ROOT / "nlp").rglob("*.js")) <= checked
    assert not [path for path in checked if "@ts-nocheck" in path.read_text(encoding="utf-8")]


def test_a_wrong_type_fails_the_check(scripts: ModuleType, tmp_path: Path) -> None:
    folder = ROOT / "build" / "typescript"
    if not (folder / scripts.VERSION).exists():
        pytest.skip("TypeScript is not installed: make scripts")
    right = "/** @param {number} each */\nconst half = (each) => each / 2;\nhalf(3);\n"
    assert scripts.main(project(tmp_path, f"{right}half('three');\n"), folder) != 0
    assert scripts.main(project(tmp_path, right.partition("\n")[2]), folder) != 0


def test_a_compiler_that_cannot_be_installed_is_one_line(
    scripts: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(scripts, "program", lambda _name: None)
    assert scripts.main(project(tmp_path, ""), tmp_path / "typescript") == 0
    assert capsys.readouterr().out == "types of scripts not checked: npm is not installed\n"
    # A program in the place of npm that fails as npm does without a network.
    npm = tmp_path / "npm"
    npm.write_text(f"#!{sys.executable}\nimport sys\nsys.exit('npm error code ENOTFOUND')\n", encoding="utf-8")
    npm.chmod(0o755)
    monkeypatch.setattr(scripts, "program", lambda _name: str(npm))
    assert scripts.main(project(tmp_path, ""), tmp_path / "typescript") == 0
    said = capsys.readouterr().out
    assert said == "types of scripts not checked: npm cannot install TypeScript: npm error code ENOTFOUND\n"
