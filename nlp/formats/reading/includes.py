"""The files of a MuJoCo model as one tree of elements."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element

from ...errors import InputError
from .xmltext import LARGEST_FILE, read_xml

#: Deepest chain of files that include each other.
_DEEPEST = 16
#: Most files of one model.
_MOST_FILES = 200
#: Elements whose children stand in the place of an ``include``.
_ROOTS = ("mujoco", "mujocoinclude")


class _Reader:
    """The files of one model: how many there are, and how large they are together."""

    def __init__(self, main: Path) -> None:
        self.main, self.files, self.size = main, 0, 0

    def expanded(self, element: Element, chain: tuple[Path, ...]) -> Element:
        """Return an element with the content of included files in the place of each ``include``."""
        result = Element(element.tag, element.attrib)
        result.text = element.text
        for child in element:
            if child.tag == "include":
                result.extend(self._included(child, chain))
            else:
                result.append(self.expanded(child, chain))
        return result

    def _included(self, element: Element, chain: tuple[Path, ...]) -> list[Element]:
        """Return the elements of an included file."""
        name = element.get("file", "")
        if not name:
            raise InputError(f"{chain[-1]}: an include names no file")
        # MuJoCo looks beside the main file; models that are put together by hand mean the file that includes.
        places = [self.main.parent / name, chain[-1].parent / name]
        path = next((each for each in places if each.is_file()), places[0])
        if any(path.resolve() == each.resolve() for each in chain):
            raise InputError(f"{chain[-1]}: includes {name}, which includes itself")
        if len(chain) > _DEEPEST:
            raise InputError(f"{chain[-1]}: includes {name} more than {_DEEPEST} files deep")
        if not path.is_file():
            raise InputError(f"{chain[-1]}: includes {name}, which cannot be found")
        self.files, self.size = self.files + 1, self.size + path.stat().st_size
        if self.files > _MOST_FILES or self.size > LARGEST_FILE:
            most = f"{_MOST_FILES} files or {LARGEST_FILE // 2**20} MB"
            raise InputError(f"{self.main}: includes more than {most} in all")
        root = read_xml(path)
        if root.tag not in _ROOTS:
            raise InputError(f"{path}: begins with <{root.tag}>; <mujoco> or <mujocoinclude> is needed")
        return list(self.expanded(root, (*chain, path)))


def with_includes(root: Element, path: Path) -> Element:
    """Return the root of a MuJoCo model with the content of all included files.

    Args:
        root: of the main file.
        path: of the main file.

    Raises:
        InputError: a file cannot be read or found, includes itself, or there are too many.
    """
    return _Reader(path).expanded(root, (path,))
