"""Live pages of cases for the site, by ``screwsynth view``: run by the site's configuration.

A page of the documentation names cases in a comment, ``<!-- live: NAME, NAME -->``. On the site, links to their live
pages replace it. Pages are kept in ``build/live`` by a checksum of everything that they are made of, so that only what
changed is made again. Where no compiler for WebAssembly is installed, the pages have no sliders.
"""

import hashlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

import screwsynth
from screwsynth.nlp.view.wasm import find_compiler

DOCS = Path(__file__).resolve().parent
CACHE = DOCS.parent / "build" / "live"
_COMMENT = re.compile(r"<!-- live: (?P<names>[\w.,\- ]+?) -->")
#: Begin of the reason for a page without sliders, in what the command prints.
_WITHOUT = "; the sliders do not work: "


def names_in(text: str) -> Iterator[str]:
    """Yield the cases that a page of the documentation names in its comments."""
    for comment in _COMMENT.finditer(text):
        yield from (name.strip() for name in comment["names"].split(","))


def live_names(folder: Path = DOCS) -> list[str]:
    """Return the names of all cases with a live page, in alphabetical order."""
    pages = sorted(folder.glob("*.md"))
    return sorted({name for page in pages for name in names_in(page.read_text(encoding="utf-8"))})


def with_links(text: str, faults: Mapping[str, str]) -> str:
    """Return the text of a page with links in place of its comments.

    Args:
        text: Markdown of the page.
        faults: reason for missing sliders, empty for a page with sliders, by the name of each case that has a page on
            the site; links to other cases are left out.
    """

    def links(comment: re.Match[str]) -> str:
        names = [name for name in names_in(comment[0]) if name in faults]
        linked = [
            f'<a href="live/{name}.html">{name}</a>{" (without sliders)" if faults[name] else ""}' for name in names
        ]
        head = "Page that solves" if len(names) == 1 else "Pages that solve"
        head = "Robot in three dimensions" if names and all(faults[name] for name in names) else head
        return f'<p class="live">{head}: {", ".join(linked)}</p>' if names else ""

    return _COMMENT.sub(links, text)


def checksum_of_sources() -> str:
    """Return the checksum of everything that live pages are made of: package, cases, CasADi and the compiler."""
    digest = hashlib.sha256(repr((find_compiler(), version("casadi"), sys.version_info[:2])).encode())
    root = Path(screwsynth.__file__).resolve().parent
    for room in ("models", "nlp", "cases"):
        for path in sorted((root / room).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts and path.suffix not in {".so", ".pyd", ".o"}:
                digest.update(f"{path.relative_to(root).as_posix()}\0".encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()[:32]


def view_page(name: str, target: Path) -> str:
    """Write the live page of a case, and return the reason for missing sliders; empty if it has them.

    Raises:
        CalledProcessError: the command fails.
    """
    command = [sys.executable, "-P", "-m", "screwsynth.nlp", "view", name, "--out", str(target), "--no-open"]
    done = subprocess.run(  # noqa: S603 - our own command
        [*command, "--jobs", "1"], capture_output=True, text=True, check=True
    )
    return done.stdout.strip().partition(_WITHOUT)[2]


def write_pages(folder: Path, names: Iterable[str], cache: Path = CACHE) -> dict[str, str]:
    """Write the live pages of cases into a folder, and return the reasons for missing sliders by name.

    Args:
        folder: folder of the pages; a page is ``NAME.html``.
        names: names of shipped cases.
        cache: folder with pages of earlier calls; pages of other sources are deleted there.

    Raises:
        CalledProcessError: the live page of a case cannot be made.
    """
    wanted, kept = list(names), cache / checksum_of_sources()
    for each in (folder, kept):
        each.mkdir(parents=True, exist_ok=True)

    def write(name: str) -> str:
        page, reason = kept / f"{name}.html", kept / f"{name}.txt"
        if not reason.exists():
            fault = view_page(name, page)
            # Written last: a page without it, as after an interrupt, is made again.
            reason.write_text(fault, encoding="utf-8")
        (folder / page.name).write_bytes(page.read_bytes())
        return reason.read_text(encoding="utf-8")

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        faults = dict(zip(wanted, pool.map(write, wanted), strict=True))
    for old in cache.iterdir():
        if old != kept:
            shutil.rmtree(old)
    return faults
