"""Lists and drawings for a workshop: lengths are those between joint centres, as NumPy finds them, and as drawn."""

import io
import math
from itertools import combinations
from typing import Any

import ezdxf
import numpy as np
import pytest
from builders import Array, case_from, rows_of, starter, starter_tables

from screwsynth.nlp import formulate
from screwsynth.nlp.evidence.closing import closed_start
from screwsynth.nlp.formats.export import files_at


def centres_of(files: dict[str, str], unit: str) -> dict[str, Array]:
    """Joint centres in the frame of the base, by joint."""
    rows = rows_of(files["joints.csv"])
    return {row["joint"]: np.array([float(row[f"{c} in base [{unit}]"]) for c in "xyz"]) for row in rows}


def lengths_of(row: dict[str, str], unit: str, *names: str) -> list[float]:
    return [float(row[f"{name} [{unit}]"]) for name in names]


@pytest.mark.parametrize("name", ["exechon", "6-rus"])
def test_every_link_is_listed_with_the_distances_of_its_centres_and_drawn_with_them(name: str) -> None:
    nlp = formulate(starter(name))
    unit = nlp.case.units.length
    files = files_at(nlp, closed_start(nlp), ["csv", "dxf"], 1)
    centres = centres_of(files, unit)
    links: dict[str, list[str]] = {}
    for row in rows_of(files["joints.csv"]):
        for link in (row["inner link"], row["outer link"]):
            links.setdefault(link, []).append(row["joint"])
    listed: dict[str, list[float]] = {}
    for row in rows_of(files["cut-list.csv"]):
        parts, ends = row["parts"].split(), [row["from joint"].split(), row["to joint"].split()]
        assert len(parts) == int(row["quantity"])
        if row["item"] == "link":
            (length,) = lengths_of(row, unit, "length")
            first, last = (centres[joints[0]] for joints in ends)
            assert length == pytest.approx(np.linalg.norm(last - first), rel=1e-12)
            for part in parts:
                listed.setdefault(part, []).append(length)
    for link, joints in links.items():
        points = np.unique(np.round([centres[joint] for joint in joints], 9), axis=0)
        apart = sorted(float(np.linalg.norm(b - a)) for a, b in combinations(points, 2))
        if link in ("base", "platform"):
            assert link not in listed
            continue
        np.testing.assert_allclose(sorted(listed.get(link, [])), apart, rtol=1e-7)
        assert (f"{link}.dxf" in files) == bool(apart)
        if apart:
            space = ezdxf.read(io.StringIO(files[f"{link}.dxf"])).modelspace()
            drawn = [np.array(circle.dxf.center)[:2] for circle in space.query("CIRCLE")]
            found = sorted(float(np.linalg.norm(b - a)) for a, b in combinations(drawn, 2))
            np.testing.assert_allclose(found, apart, rtol=1e-7)  # of these robots every link is flat
            assert f"`{link}.dxf`: Outline" in files["README.md"]
    assert any(int(row["quantity"]) > 1 for row in rows_of(files["cut-list.csv"]))


def moves() -> list[dict[str, list[Any]]]:
    """Three poses: the stated one, a higher one, and one that is turned too."""
    turned = [[math.cos(0.2), 0, math.sin(0.2)], [0, 1, 0], [-math.sin(0.2), 0, math.cos(0.2)]]
    return [{"translation": [0, 0, 0]}, {"translation": [0, 0, 4]}, {"rotation": turned, "translation": [1, 0, 2]}]


def test_legs_have_their_strokes_over_all_poses_and_within_their_limits() -> None:
    tables = starter_tables("hexapod")
    tables["pose"]["displacements"] = moves()
    tables["limits"] = {"leg_length": {"min": 3, "max": 400}}
    nlp = formulate(case_from(tables, "hexapod"))
    unit, x = nlp.case.units.length, closed_start(nlp)
    at_poses = []
    for pose in (1, 2, 3):
        files = files_at(nlp, x, ["csv"], pose)
        centres = centres_of(files, unit)
        legs = [name for name in centres if name.endswith("_3")]
        at_poses.append([np.linalg.norm(centres[leg] - centres[leg.removesuffix("_3") + "_1_first"]) for leg in legs])
        rows = [row for row in rows_of(files["cut-list.csv"]) if row["item"] == "length of a leg"]
        slides = {name: row for row in rows for name in row["parts"].split()}
        found = [lengths_of(slides[leg.removesuffix("_3") + "_2"], unit, "length") for leg in legs]
        np.testing.assert_allclose(np.ravel(found), at_poses[-1], rtol=1e-12)
    lengths = np.array(at_poses)
    names = ("smallest used", "largest used", "stroke used", "smallest allowed", "largest allowed", "stroke allowed")
    found = np.array([lengths_of(slides[leg.removesuffix("_3") + "_2"], unit, *names) for leg in legs])
    np.testing.assert_allclose(found[:, 0], lengths.min(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], lengths.max(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found[:, 2], np.ptp(lengths, axis=0), atol=1e-12)
    np.testing.assert_allclose(found[:, 3:], [[3, 400, 397]] * 6, rtol=1e-12)
    assert np.ptp(lengths, axis=0).min() > 0.5


@pytest.mark.parametrize(
    ("least", "most", "largest", "dead"),
    [
        (None, None, 5.5, None), (3, 400, 5.5, None), (3, 400, 500, None), (None, None, None, 2),
        (3, 30, None, 2), (10, 22, 500, 9), (10, 14, None, 9), (None, 24, 500, 4), (None, 24, 9, 4),
        (None, 24, None, None),
    ],
)  # fmt: skip
def test_the_stroke_allowed_is_the_largest_one_within_all_limits(
    least: float | None, most: float | None, largest: float | None, dead: float | None
) -> None:
    tables = starter_tables("hexapod")
    tables["pose"]["displacements"] = moves()
    given = {
        "leg_length": {"min": least, "max": most},
        "actuator": {"stroke_max": largest, "dead_length": dead},
    }
    limits = {name: {key: value for key, value in table.items() if value is not None} for name, table in given.items()}
    tables["limits"] = {name: table for name, table in limits.items() if table}
    nlp = formulate(case_from(tables, "hexapod"))
    files = files_at(nlp, closed_start(nlp), ["csv"], 1)
    rows = [row for row in rows_of(files["cut-list.csv"]) if row["item"] == "length of a leg"]
    assert len(rows) > 1
    unit = nlp.case.units.length
    for row in rows:
        (shortest,) = lengths_of(row, unit, "smallest used")
        # Each retracted length up to the shortest one used, and the longest stroke that the limits leave from there.
        retracted = np.linspace(0 if least is None else least, max(shortest, least or 0), 200_001)
        ends = [np.full(retracted.size, np.inf if largest is None else largest)]
        ends += [] if most is None else [most - retracted]
        ends += [] if dead is None else [retracted - dead]
        stroke = float(np.minimum.reduce(ends).max())
        found = row[f"stroke allowed [{unit}]"]
        if largest is None and dead is None and least is None:
            assert found == ""
        else:
            assert float(found) == pytest.approx(stroke, abs=1e-3)
