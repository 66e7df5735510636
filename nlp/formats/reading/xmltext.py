"""Safe reader of XML files: content that needs unbounded memory or time, or other files, is refused."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from ...errors import InputError
from ...system.reading import read_limited

#: Largest file, bytes: twenty times the largest published description without meshes.
LARGEST_FILE = 16 * 2**20
#: Largest depth of elements: a chain of 60 bodies needs 62.
_DEEPEST = 400
#: Largest number of elements.
_MOST_ELEMENTS = 200_000


class _RefusedError(Exception):
    """Reason to stop reading, as a clause."""


def read_xml(path: Path) -> Element:
    """Return the root element of an XML file, without comments.

    Raises:
        InputError: the file cannot be read, is too large or too deep, is not XML, or declares a document type, whose
            entities could grow without limit or include other files.
    """
    content = read_limited(path, LARGEST_FILE, is_regular=True)
    builder = TreeBuilder()
    parser = expat.ParserCreate()
    depth, count = 0, 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > _DEEPEST:
            raise _RefusedError(f"its elements are nested more than {_DEEPEST} deep")
        if count > _MOST_ELEMENTS:
            raise _RefusedError(f"it has more than {_MOST_ELEMENTS} elements")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_: object) -> None:
        raise _RefusedError("it declares a document type or entities, which are not allowed")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        parser.Parse(content, True)
        return builder.close()
    except _RefusedError as refused:
        raise InputError(f"{path}: cannot be read: {refused}") from None
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise InputError(f"{path}: is not valid XML: {error}") from None
