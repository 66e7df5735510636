"""Write docs/cases.md, and the table of robot files in docs/robots.md: run by ``make docs``. A test compares them."""

import re
import tomllib
from collections import Counter
from pathlib import Path

import screwsynth.cases
import screwsynth.models
from screwsynth.models import Model, robot_function

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "robots.md"
FOLDER = Path(screwsynth.models.__file__).parent / "robots"
OPENING, CLOSING = "<!-- begin: gallery -->", "<!-- end -->"
CASES = ROOT / "docs" / "cases.md"
#: Cases with a live page on the site: those of introductions, and examples of the paper.
LIVE = frozenset(
    [
        "agile-eye",
        "hexapod-machining",
        "machine-tool",
        "motion-base",
        "pick-and-place",
        "paper-4.1-helical",
        "paper-4.1-rotation",
        "paper-4.2-rotation",
        "paper-4.2-translation",
        "paper-4.3",
        "paper-4.4-max",
        "paper-4.4-snu",
    ]
)
CASES_HEAD = """# Cases

These [cases](glossary.md#case) come with the package. Each command below finds its case by the name.
[Six worked designs](worked-designs.md) explain six of them. The cases `paper-...` give
[the paper's results](reproduction.md). `make docs` writes this page from the case files, and `make figures` draws the
pictures.
"""


def source_of(text: str) -> str:
    """Return the sentences behind ``Source:`` in the heading of a robot file."""
    heading = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        heading.append(line.removeprefix("#").strip())
    return " ".join(heading).partition("Source: ")[2]


def limbs_of(model: Model) -> str:
    """Return the joints of all limbs, equal limbs together; the chains of a limb with branches in brackets."""
    paths: dict[str, list[str]] = {}
    for each in model.structure:
        paths.setdefault(each.limb, []).append(each.joints.replace("*", "\\*"))
    words = [own[0] if len(own) == 1 else f"({', '.join(own)})" for own in paths.values()]
    return ", ".join(f"{count} x {joints}" for joints, count in Counter(words).items())


def counted(values: list[int]) -> str:
    """Return numbers with equal ones together, such as ``3 x 2``."""
    return ", ".join(f"{count} x {value}" for value, count in Counter(values).items())


def table() -> str:
    """Return the table as Markdown."""
    lines = [
        "| robot | limbs (\\* actuated) | degrees of freedom | rows | dim W | dim C | rank of J | source |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for path in sorted(FOLDER.glob("*.toml")):
        model = robot_function(path.stem)()
        assert model.generic is not None  # noqa: S101 - a script of the documentation
        members = model.structure
        cells = [
            f"`{path.stem}`",
            limbs_of(model),
            str(6 - model.generic.constraints),
            str(len(model.rows)),
            counted([each.wrenches for each in members]),
            counted([each.constraints for each in members]),
            str(model.generic.jacobian),
            source_of(path.read_text(encoding="utf-8")),
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def cases() -> str:
    """Return the page of all cases: question, command and picture of each."""
    parts = [CASES_HEAD]
    for path in sorted(Path(screwsynth.cases.__file__).parent.glob("*.toml")):
        text, name = path.read_text(encoding="utf-8"), path.stem
        tables = tomllib.loads(text)
        is_judged = "workspace" in tables and tables.get("limits", {}).get("over") != "workspace"
        question = text.partition("\n#\n")[0].partition("\ntitle = ")[0].removeprefix("# ").replace("\n# ", "\n")
        parts += [
            f"## {name}\n",
            f"*{tables['title']}*\n",
            f"{question}\n",
            f"```sh\nscrewsynth {'workspace' if is_judged else 'solve'} {name}\n```\n",
            f"[The case file](../cases/{name}.toml)\n",
        ]
        if name in LIVE:
            parts.append(f"<!-- live: {name} -->\n")
        if (ROOT / "docs" / "figures" / f"{name}.png").exists():
            parts.append(f"![{tables['title']}](figures/{name}.png)\n")
    return "\n".join(parts)


def main() -> None:
    """Write the page of cases, and put the table into the page of robots."""
    CASES.write_text(cases(), encoding="utf-8")
    pattern = f"({re.escape(OPENING)}\n).*?({re.escape(CLOSING)})"
    old = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(re.sub(pattern, lambda m: m[1] + table() + m[2], old, flags=re.DOTALL), encoding="utf-8")


if __name__ == "__main__":
    main()
