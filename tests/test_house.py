"""What `make check` prints about rooms: lines of code, classes, importers and loops of Newton's method."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

CLOSING = '''"""Closes loops."""

import numpy as np


def closed(f, x):
    """Newton's method, of which the docstring

    is no line of code.
    """
    # nor is a comment
    for _ in range(9):
        values, slopes = f(x)
        if abs(values).max() < 1e-9:
            break
        x = x - np.linalg.lstsq(slopes, values)[0]
    return x
'''
DESIGNS = """from ..first import closing
from .algebra import least


class DesignData:
    pass


class Solver:
    def run(self, x):
        while True:
            error = self.error(x)
            if error < 1e-9:
                return x
            x += self.step(x, error)

    def step(self, x, error):
        return least(self.slopes(x), error)


def active_set(A, b, y):
    for _ in range(9):
        passive = y > 0
        y = y + np.linalg.lstsq(A[:, passive], b)[0]
        if passive.all():
            break
    return y


def each(problems):
    for A, b in problems:
        x = np.linalg.solve(A, b)
        if x is None:
            return x


def outer(f, x):
    for _ in range(9):
        x = x - np.linalg.pinv(closing.closed(f, x)) @ x
        if x is None:
            return x
"""
FILES = {
    "models/__init__.py": "",
    "nlp/__init__.py": "",
    "nlp/__init__.pyi": "from .second.designs import Solver as Solver\n",
    "nlp/first/__init__.py": "",
    "nlp/first/closing.py": CLOSING,
    "nlp/first/c/step.c": "/* a comment\n * of two lines */\nint step(void) // here\n{ return 1; }\n\n",
    "nlp/second/__init__.py": "",
    "nlp/second/algebra.py": "import numpy as np\n\n\ndef least(A, b):\n    return np.linalg.lstsq(A, b)[0]\n",
    "nlp/second/designs.py": DESIGNS,
    "nlp/second/pages.py": "def page():\n    from .designs import DesignData\n",
}


def test_rooms_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "bench")
    from house import house  # noqa: PLC0415 - a script of bench, which is no package

    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    head, *lines = house(tmp_path, with_names=True)
    rows, lists = lines[:5], lines[5:]
    assert head.split() == ["room", "code", "...Data", "Newton", "one", "importer"]
    assert [row.split() for row in rows] == [
        ["models", "0"],
        ["nlp", "0"],
        ["nlp/first", "10", "1", "1"],
        ["nlp/second", "35", "1", "1", "1"],
        ["all", "45", "1", "2", "2"],
    ]
    # Neither an active set, nor equations one after another, nor a loop about another one.
    assert [each.splitlines() for each in lists] == [
        ["classes ...Data:", "  nlp.second.designs.DesignData"],
        ["loops of Newton's method:", "  nlp.first.closing.closed, line 12", "  nlp.second.designs.run, line 11"],
        ["modules with one importer:", "  nlp.first.closing", "  nlp.second.algebra"],
    ]


def test_the_project_is_counted() -> None:
    done = subprocess.run([sys.executable, ROOT / "bench" / "house.py"], capture_output=True, text=True, check=True)
    rooms = {
        path.parent.relative_to(ROOT).as_posix() for top in ("models", "nlp") for path in (ROOT / top).rglob("*.py")
    }
    assert rooms == {line.split()[0] for line in done.stdout.split("all  ")[0].splitlines()[1:]}
