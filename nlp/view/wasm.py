"""Compilation of C to WebAssembly, with a cache by checksum.

Either ``clang`` with ``wasm-ld`` is installed, or the Python package ``ziglang`` brings a compiler.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ..errors import InputError
from ..system.programs import RunError, cache_folder, first_program, run_program
from .source import checksum_of

#: Flags of every compiler: a module without a C library, with the memory instructions that all engines have.
_FLAGS = ("-std=c99", "-O2", "-nostdlib", "-ffreestanding", "-mbulk-memory", "-Wno-unused-command-line-argument", "-I.")
#: Flags of the linker: only what the exports need, without names. With clang, the stack is put below all data.
_LINKS = ("--no-entry", "--gc-sections", "--strip-all", "-z", "stack-size=1048576")
_CLANG_LINKS = ("--stack-first",)
#: Advice where no compiler is installed.
ADVICE = "no compiler for WebAssembly is installed: pip install 'screwsynth[view]' brings one, or install clang and lld"


class Compiler(NamedTuple):
    """Compiler for WebAssembly.

    Attributes:
        name: name for people.
        words: program and its first arguments.
        version: first line of its version.
        links: further flags of the linker.
    """

    name: str
    words: tuple[str, ...]
    version: str
    links: tuple[str, ...] = ()


def find_compiler() -> Compiler | None:
    """Return a compiler for WebAssembly; None if there is none."""
    clang, linker = first_program(["clang"]), first_program(["wasm-ld"])
    if clang and linker:
        found = _checked("clang", (clang, "--target=wasm32"), [clang, "--version"])
        if found is not None:
            return found._replace(links=_CLANG_LINKS)
    if importlib.util.find_spec("ziglang") is not None:
        zig = (sys.executable, "-m", "ziglang")
        return _checked("zig", (*zig, "cc", "-target", "wasm32-freestanding"), [*zig, "version"])
    return None


def _checked(name: str, words: tuple[str, ...], asked: list[str]) -> Compiler | None:
    """Return a compiler with its version; None if it cannot be run."""
    try:
        lines = run_program(asked).splitlines()
    except RunError:
        return None
    return Compiler(name, words, lines[0] if lines else "")


def compile_module(files: Mapping[str, str], compiler: Compiler | None = None) -> bytes:
    """Compile C to a WebAssembly module, or return the cached module.

    Args:
        files: texts by file name; files ``*.c`` are compiled.
        compiler: compiler; None for an installed one.

    Raises:
        InputError: no compiler is installed, or it fails.
    """
    found = compiler or find_compiler()
    if found is None:
        raise InputError(ADVICE)
    key = checksum_of(files, *found.words, found.version, *_FLAGS, *_LINKS, *found.links)
    folder = cache_folder()
    target = folder / f"{key[:32]}.wasm"
    if target.exists():
        return target.read_bytes()
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        for name, text in files.items():
            (Path(temporary) / name).write_text(text, encoding="utf-8")
        sources = sorted(name for name in files if name.endswith(".c"))
        links = [f"-Wl,{','.join([*_LINKS, *found.links])}"]
        try:
            run_program([*found.words, *_FLAGS, *sources, *links, "-o", "view.wasm"], Path(temporary))
        except RunError as error:
            said = "failed" if error.is_started else "cannot be run"
            raise InputError(f"{found.name}: the compiler for WebAssembly {said}: {error.said}") from None
        made = Path(temporary) / "view.wasm"
        content = made.read_bytes()
        # A rename leaves a whole module or none, also if two processes compile it at the same time.
        os.replace(made, target)
    return content
