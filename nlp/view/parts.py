"""Long functions of generated C in parts, which compilers translate in seconds.

A CasADi function is one list of assignments. For robots with many passive joints it has 30,000 of them and a thousand
variables, and compilers need minutes for it: their work grows faster than the length. In parts, a variable that a later
part reads goes through memory. The order and the operations stay, and so does every value.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

#: Number of assignments of a part, and number above which a function has parts.
_PART, _LONG = 1000, 4000
#: Compilers put a function that is called once into its caller, which would undo the parts.
_APART = "__attribute__((noinline)) static"
_FUNCTION = re.compile(r"^static int (casadi_f\d+)\(const casadi_real\*\* arg, casadi_real\*\* res, [^{}]*\) \{$")
_DECLARATION = re.compile(r"^ *casadi_real a\d+(, a\d+)*;$|^ *\(void\).*;$")
_ASSIGNMENT = re.compile(r"^ *(a\d+)=([^;{}]*);$")
_RESULT = re.compile(r"^ *if \(res\[\d+\]!=0\) res\[\d+\]\[\d+\]=([^;{}]*);$")
_VARIABLE = re.compile(r"\ba\d+\b")


def in_parts(text: str) -> str:
    """Return C of CasADi functions with each long function in parts; other functions are as before.

    The parts of a function share one static array, so only one thread may call it at a time.
    """
    lines, found, at = text.split("\n"), list[str](), 0
    while at < len(lines):
        head = _FUNCTION.match(lines[at])
        end = lines.index("}", at) if head is not None else at
        body = lines[at + 1 : end]
        if head is None or len(body) < _LONG:
            found.append(lines[at])
            at += 1
            continue
        found += _parts_of(head.group(1), lines[at], body) or [*lines[at : end + 1]]
        at = end + 1
    return "\n".join(found)


def _parts_of(name: str, head: str, body: Sequence[str]) -> list[str]:
    """Return the lines of a function in parts; none if it has other statements than assignments."""
    statements = [line.strip() for line in body if not _DECLARATION.match(line)]
    if not statements or statements.pop() != "return 0;":
        return []
    parts = [statements[k : k + _PART] for k in range(0, len(statements), _PART)]
    read, written = [], []
    for part in parts:
        first, own = set[str](), set[str]()
        for line in part:
            made = _ASSIGNMENT.match(line)
            match = made or _RESULT.match(line)
            if match is None:
                return []
            first |= set(_VARIABLE.findall(match.group(2 if made else 1))) - own
            if made:
                own.add(made.group(1))
        read.append(first)
        written.append(own)
    # Variables that a part leaves for later ones: those that are read again before they are written.
    kept, later = list[set[str]](), set[str]()
    for first, own in zip(reversed(read), reversed(written), strict=True):
        kept.insert(0, own & later)
        later = (later - own) | first
    place = {each: k for k, each in enumerate(sorted(set[str]().union(*kept)))}
    found = [f"static casadi_real {name}_kept[{max(1, len(place))}];"]
    for k, part in enumerate(parts):
        found.append(f"{_APART} void {name}_part{k}(const casadi_real** arg, casadi_real** res) {{")
        found.append("(void)arg, (void)res;")
        found += [f"  casadi_real {each}={name}_kept[{place[each]}];" for each in sorted(read[k])]
        found += [f"  casadi_real {each};" for each in sorted(written[k] - read[k])]
        found += part
        found += [f"{name}_kept[{place[each]}]={each};" for each in sorted(kept[k])]
        found.append("}")
    calls = [f"  {name}_part{k}(arg, res);" for k in range(len(parts))]
    return [*found, head, "(void)iw, (void)w, (void)mem;", *calls, "return 0;", "}"]
