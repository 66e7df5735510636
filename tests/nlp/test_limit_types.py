"""The registry of limit types: complete against the schema and the documentation, and enough to add a limit."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import pytest
from builders import case_from, starter_tables

from screwsynth.models import stewart_gough
from screwsynth.nlp import CaseError, LegLength, Limits, Status, margins_of, solve
from screwsynth.nlp.case.limits.constraint import LENGTH, BoundedConstraint, between
from screwsynth.nlp.case.limits.interval import IntervalLimit
from screwsynth.nlp.case.limits.limit import PosedRobot
from screwsynth.nlp.case.limits.registry import LIMIT_TYPES
from screwsynth.nlp.case.wholeschema import WholeDocument

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")
KEYS = [key for kind in LIMIT_TYPES for key in kind.fields()]


def test_the_schema_has_every_limit_and_no_other() -> None:
    table = WholeDocument.model_json_schema()["$defs"]["LimitsTable"]
    assert list(table["properties"]) == ["over", *KEYS]
    assert all(field["description"] for field in table["properties"].values())
    # The measures of robots are the other keys.
    assert table["additionalProperties"] == {"$ref": "#/$defs/IntervalTable"}


def test_the_documentation_has_every_limit_and_no_other() -> None:
    (written, *_) = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
    assert list(tomllib.loads(written)["limits"]) == KEYS


def test_every_limit_type_has_a_key_a_description_and_a_file_of_its_room() -> None:
    named = [kind.key for kind in LIMIT_TYPES if kind.key]
    assert len(set(named)) == len(named) == len(LIMIT_TYPES) - 1
    for kind in LIMIT_TYPES:
        assert kind.__module__.startswith("screwsynth.nlp.case.limits.")
        assert kind.__doc__


@dataclass(frozen=True)
class Height(IntervalLimit):
    """Height of the platform's origin: a limit that is in no registry."""

    key: ClassVar[str] = "height"
    description: ClassVar[str] = "of the platform's origin"

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        yield between(f"height{pose.where}", pose.robot.position[2], LENGTH, self.key, lower=self.min, upper=self.max)


def test_a_limit_outside_of_the_registry_limits_a_case_made_in_python() -> None:
    written = case_from(starter_tables(stewart_gough()), "high")
    case = replace(written, limits=Limits(Height(min=36.5), LegLength(max=60.0)))
    assert [limit.name for limit in case.limits] == ["leg_length", "height"]
    solution = solve(case, starts=2)
    assert solution.status is Status.OPTIMAL
    rows = {row.key: row for row in margins_of(solution.nlp, solution.x, optimal=True)}
    assert rows["height.min"].active
    assert rows["height.min"].value == pytest.approx(36.5, rel=1e-9)
    with pytest.raises(CaseError, match=r"limits\.height\.min = 3\.0: must be below max = 2 cm"):
        replace(written, limits=Limits(Height(min=3.0, max=2.0)))


#: A limit is added in a copy of the package, from outside; nothing but its file and the registry changes.
SCRIPT = """
import json
import tomllib
from pathlib import Path

import screwsynth.nlp
from screwsynth.models import stewart_gough
from screwsynth.nlp import CaseError, Status, case_from_tables, formulate, json_data, result_of, solve
from screwsynth.nlp.case.limits.platform_height import PlatformHeight
from screwsynth.nlp.case.wholeschema import WholeDocument
from screwsynth.nlp.starter.text import starter_case

starter = tomllib.loads(starter_case(stewart_gough()))


def case_with(**limits):
    return case_from_tables({**starter, "limits": limits}, name="high", source="high.toml")


def refusal(**limits):
    try:
        case_with(**limits)
    except CaseError as error:
        return str(error)
    return None


case = case_with(platform_height={"min": 36.5}, leg_length={"max": 60})
nlp = formulate(case)
solution = solve(case, starts=4)
moved = solve(case_with(platform_height={"min": 36.51}, leg_length={"max": 60}), starts=4)
contradicting = solve(case_with(platform_height={"min": 80}), starts=1)
print(
    json.dumps(
        {
            "file": screwsynth.nlp.__file__,
            "read": case.limits.of(PlatformHeight) == PlatformHeight(min=36.5),
            "refused": [
                refusal(platform_height={"min": 40, "max": 30}),
                refusal(platform_height={"min": "high"}),
                refusal(platform_height={"min": -1}),
                refusal(platform_heigth={"min": 3}),
            ],
            "constraints": [each.name for each in nlp.program.constraints],
            "optimal": solution.status is Status.OPTIMAL,
            "height": float(solution.state.position[2]),
            "limits": json_data(result_of(solution))["limits"],
            "slope": (moved.F - solution.F) / 0.01,
            "relaxed": [[row.key, row.needed] for row in contradicting.relaxation],
            "schema": WholeDocument.model_json_schema()["$defs"]["LimitsTable"]["properties"]["platform_height"],
        }
    )
)
"""


def test_a_limit_is_added_by_its_file_and_a_row_of_the_registry(tmp_path: Path) -> None:
    package = tmp_path / "screwsynth"
    for name in ("models", "nlp", "cases"):
        shutil.copytree(ROOT / name, package / name, ignore=shutil.ignore_patterns("__pycache__"))
    room = package / "nlp" / "case" / "limits"
    (module,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    (room / "platform_height.py").write_text(module, encoding="utf-8")
    registry = (room / "registry.py").read_text(encoding="utf-8")
    for old, new in (
        ("from .plates import", "from .platform_height import PlatformHeight\nfrom .plates import"),
        ("    RateShare,\n", "    RateShare,\n    PlatformHeight,\n"),
    ):
        assert registry.count(old) == 1
        registry = registry.replace(old, new)
    (room / "registry.py").write_text(registry, encoding="utf-8")

    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-P", "-c", SCRIPT]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    assert ended.returncode == 0, ended.stderr
    found = json.loads(ended.stdout)

    assert Path(found["file"]).is_relative_to(package)
    assert found["read"]
    crossed, text, negative, misspelt = found["refused"]
    assert crossed == "high.toml: limits.platform_height.min = 40.0: must be below max = 30 cm"
    assert text == 'high.toml: limits.platform_height.min = "high": must be a number'
    assert negative == "high.toml: limits.platform_height.min = -1.0: must be above 0 cm"
    assert "limits.platform_heigth: is nothing that 'stewart-gough' has" in misspelt
    assert "rate_share, platform_height, custom" in misspelt
    assert "platform_height" in found["constraints"]
    assert found["optimal"]
    assert found["height"] == pytest.approx(36.5, rel=1e-9)
    row = next(row for row in found["limits"] if row["key"] == "platform_height.min")
    assert row["active"] == ["platform_height"]
    assert (row["value"], row["limit"], row["unit"]) == (pytest.approx(36.5, rel=1e-9), 36.5, "cm")
    assert row["cost"] == pytest.approx(found["slope"], rel=0.01)
    # The starter's platform is at most 10 cm above 35 cm.
    assert found["relaxed"] == [["platform_height.min", pytest.approx(45, rel=1e-4)]]
    assert found["schema"]["description"] == "of the platform's origin above the base"
