"""How far each coordinate of a pose can move: ends against formulas and samples of ours."""

import itertools
import json
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from builders import Array, Run, case_from, case_of, case_tables, ends, output_of, refusal_of, rows_of
from path_cases import BASE, LEGS, PLATFORM, lengths_at, robot_of

from screwsynth.nlp import AxisRange, Case, InputError, Outcome, axis_ranges, json_data, load_result
from screwsynth.nlp.results.axisranges import AxisRangesResult
from screwsynth.nlp.results.schema import result_schema


def hexapod(**limits: object) -> Case:
    return case_of("hexapod-linuxcnc", limits=limits)


def moved(start: Array, axis: int, values: Array) -> Array:
    poses = np.tile(start, (len(values), 1))
    poses[:, axis] = values
    return poses


def test_height_of_a_hexapod_ends_where_the_formula_of_its_legs_does() -> None:
    found = axis_ranges(hexapod(leg_length={"min": 25, "max": 43}), axes=["z"])
    (z,) = found.axes
    flat = np.linalg.norm((PLATFORM - BASE)[:, :2], axis=1)
    ends = [math.sqrt(each**2 - pick(flat) ** 2) for each, pick in ((25, np.min), (43, np.max))]
    accuracy = 1e-6 * found.most[0]
    assert ends[0] <= z.lower.value <= ends[0] + accuracy
    assert ends[1] - accuracy <= z.upper.value <= ends[1]
    for end, sign, limit in ((z.lower, -1, 25), (z.upper, 1, 43)):
        assert 0 < sign * (end.failed - end.value) <= accuracy
        stop = end.stop
        assert (stop.outcome, stop.limit, stop.name[:10]) == (Outcome.REFUTED, limit, "leg_length")
        assert stop.value == pytest.approx(limit, abs=1e-6)
    assert found.pairs == ()


def test_every_axis_of_a_hexapod_keeps_its_legs_to_the_end_and_no_farther() -> None:
    here = np.array([2, -3, 22, *np.radians([10, -5, 15])])
    # The hexapod is regular where these limits are kept.
    found = axis_ranges(
        hexapod(leg_length={"min": 24, "max": 38}), here, axes=["x", "z", "pitch"], most=(40, math.radians(40))
    )
    places = {"x": 0, "z": 2, "pitch": 4}
    assert [each.axis for each in found.axes] == list(places)
    assert len(found.pairs) == 3
    limited = 0
    for each in found.axes:
        axis = places[each.axis]
        assert each.lower.value < each.at == here[axis] < each.upper.value
        inside = lengths_at(moved(here, axis, np.linspace(each.lower.value, each.upper.value, 20_001)))
        assert inside.min() >= 24
        assert inside.max() <= 38
        for end in (each.lower, each.upper):
            if end.failed is None:
                assert abs(end.value - each.at) == pytest.approx(found.most[axis // 3])
                continue
            limited += 1
            beyond = lengths_at(moved(here, axis, np.array([end.failed])))[0, LEGS.index(end.stop.name.split()[-1])]
            assert beyond > 38 if end.stop.sense.value == "max" else beyond < 24
            assert beyond == pytest.approx(end.stop.value, abs=1e-9)
    assert limited > 3
    rng, by_name = np.random.default_rng(0), {each.axis: each for each in found.axes}
    for pair in found.pairs:
        ranges = [by_name[name] for name in pair.axes]

        def box(part: float, unit: Array, ranges: list[AxisRange] = ranges) -> Array:
            poses = np.tile(here, (len(unit), 1))
            for each, u in zip(ranges, unit.T, strict=True):
                poses[:, places[each.axis]] += part * (
                    each.lower.value - each.at + u * (each.upper.value - each.lower.value)
                )
            return lengths_at(poses)

        inside = box(pair.factor, rng.uniform(size=(4000, 2)))
        corners = np.array(list(itertools.product([0, 1], repeat=2)))
        for each in (inside, box(pair.factor, corners)):
            assert each.min() >= 24
            assert each.max() <= 38
        if pair.failed is not None:
            assert pair.factor < pair.failed <= pair.factor + 0.01
            edge = np.linspace(0, 1, 501)
            sides = [np.stack([edge, np.full(501, u)], axis=1)[:, ::way] for u in (0, 1) for way in (1, -1)]
            outside = box(pair.failed, np.concatenate(sides))
            assert outside.max() > 38 or outside.min() < 24


def test_a_turn_ends_where_the_platform_is_singular() -> None:
    # The octahedral platform is singular where it is turned by a right angle.
    (yaw,) = axis_ranges(hexapod(), axes=["yaw"], most=(1, math.radians(120))).axes
    for end, sign in ((yaw.lower, -1), (yaw.upper, 1)):
        assert 0 < math.pi / 2 - sign * end.value <= 1e-5
        assert (end.stop.name, end.stop.outcome, end.stop.limit) == ("regular", Outcome.REFUTED, None)


def test_a_translational_robot_slides_and_does_not_turn() -> None:
    case = robot_of("three-upu", {"leg_length": {"min": 40, "max": 70}}, base_radius=50)
    found = axis_ranges(case, [0, 0, 50, 0, 0, 0])
    assert [each.axis for each in found.axes] == ["x", "y", "z"]
    z = found.axes[2]
    assert z.lower.value == pytest.approx(math.sqrt(40**2 - 25**2), abs=1e-6 * found.most[0])
    assert z.upper.value == pytest.approx(math.sqrt(70**2 - 25**2), abs=1e-6 * found.most[0])


def test_ranges_of_strokes_are_cut_on_both_sides() -> None:
    limits = {"leg_length": {"min": 20, "max": 43}, "actuator": {"stroke_max": 6}}
    (z,) = axis_ranges(hexapod(**limits), axes=["z"], most=(8, 1)).axes

    def stroke(ends: tuple[float, float]) -> float:
        return float(np.ptp(lengths_at(moved(np.array([0, 0, 20, 0, 0, 0.0]), 2, np.array(ends))), axis=0).max())

    assert stroke((12, 28)) > 6
    assert 5.98 < stroke((z.lower.value, z.upper.value)) <= 6 < stroke((z.lower.failed, z.upper.failed))
    assert z.lower.value < 20 < z.upper.value
    assert z.lower.stop is z.upper.stop
    assert z.lower.stop.name.startswith("actuator.stroke_max limb")


def test_ranges_do_not_depend_on_the_unit_of_length() -> None:
    inches = axis_ranges(hexapod(leg_length={"min": 17, "max": 43}), [1, 2, 21, 0, 0.1, 0], axes=["x", "pitch"])
    tables = case_tables("hexapod-linuxcnc", units={"length": "mm"}, limits={"leg_length": ends(13000, 30000)})
    tables["robot"]["parameters"] = {"x1": 26500, "x2": 11543, "x3": 0, "x4": 5}
    tables["pose"]["position"] = tables["workspace"]["position"] = [0, 0, 20000]
    other = axis_ranges(case_from(tables), [1000, 2000, 21000, 0, 0.1, 0], axes=["x", "pitch"])
    assert other.most == pytest.approx((1000 * inches.most[0], inches.most[1]))
    for one, two, scale in zip(inches.axes, other.axes, (1000, 1), strict=True):
        for end in ("lower", "upper"):
            a, b = getattr(one, end), getattr(two, end)
            assert b.value == pytest.approx(scale * a.value, rel=1e-9)
            assert (a.stop and a.stop.name) == (b.stop and b.stop.name)
    assert other.pairs[0].factor == pytest.approx(inches.pairs[0].factor, abs=1e-9)


def test_ranges_are_the_same_a_third_of_a_turn_farther() -> None:
    case, most = hexapod(leg_length={"min": 24, "max": 38}), (30, 0.5)
    starts = [(4 * math.cos(turn), 4 * math.sin(turn), 20, 0, 0, 0) for turn in (0, 2 * math.pi / 3)]
    one, other = (axis_ranges(case, start, axes=["z", "yaw"], most=most).axes for start in starts)
    for a, b in zip(one, other, strict=True):
        assert (a.lower.value, a.upper.value) == pytest.approx((b.lower.value, b.upper.value), abs=1e-9)


def test_a_pose_beyond_a_limit_has_no_ranges_and_says_which() -> None:
    found = axis_ranges(hexapod(leg_length={"min": 17, "max": 30}), [5, 0, 20, 0, 0, 0])
    legs = lengths_at(np.array([[5, 0, 20, 0, 0, 0.0]]))[0]
    assert {each.name: each.value for each in found.stops} == pytest.approx(
        {f"leg_length limb {name}": length for name, length in zip(LEGS, legs, strict=True) if length > 30}
    )
    assert found.axes == found.pairs == ()
    singular = axis_ranges(hexapod(), [0, 0, 20, 0, 0, math.pi / 2])
    assert [(each.name, each.outcome) for each in singular.stops] == [("regular", Outcome.REFUTED)]


def test_dependent_coordinates_move_with_those_that_the_robot_chooses() -> None:
    case = robot_of("3-rps", rb=1.0)
    found = axis_ranges(case, [*map(float, case.model.home), 0, 0, 0], most=(0.01, 0.01))
    assert [each.axis for each in found.axes] == ["z", "roll", "pitch"]
    assert found.others == ("x", "y", "yaw")
    assert found.axes[0].upper.value - found.axes[0].at == pytest.approx(0.01)


def test_what_is_no_pose_is_refused() -> None:
    case, free = hexapod(), case_of("hexapod-linuxcnc", pose={"position": [0, 0, {"min": 1, "max": 2}]})
    for given, options, words in (
        (case, {"start": (0, 0, 20)}, "six finite"),
        (case, {"start": (0, 0, 20, 0, 2.6, 0)}, "pitch = 148.969 deg: must be above -148"),
        (case, {"axes": ["jaw"]}, "axis 'jaw'"),
        (case, {"most": (1, 0)}, "positive"),
        (free, {}, "free"),
    ):
        with pytest.raises(InputError, match=words):
            axis_ranges(given, **options)


def test_the_command_shows_ranges_and_pairs(cli: Run, tmp_path: Path) -> None:
    out, table = tmp_path / "ranges.json", tmp_path / "ranges.csv"
    command = ("path", "hexapod-linuxcnc", "--range", "--json", str(out), "--start")
    shown = output_of(cli(*command, "1,0,20,0,0,10", "--most", "3,5", "--csv", str(table)))
    assert len(shown.splitlines()) <= 25
    assert "1, 0, 20 in; roll, pitch, yaw 0, 0, 10 deg" in shown
    result = json.loads(out.read_text())
    jsonschema.validate(result, result_schema())
    assert type(load_result(out)) is AxisRangesResult
    assert json_data(load_result(out)) == result
    assert result["proved"] is True
    assert [each["axis"] for each in result["axes"]] == ["x", "y", "z", "roll", "pitch", "yaw"]
    assert (result["axes"][0]["lower"], result["axes"][5]["upper"]) == ({"value": -2.0}, {"value": 15.0})
    assert [each["factor"] for each in result["pairs"]] == [1.0] * 15
    axes = table.read_text().partition("\n\n")[0].partition("\n")[2]
    assert [row["lower end limited by"] for row in rows_of(axes)] == ["the search range"] * 6
    status, shown, _ = cli(*command, "0,0,50,0,0,0")
    assert status == 1
    none = json.loads(out.read_text())
    jsonschema.validate(none, result_schema())
    assert none["faults"]
    assert "leg_length limb 3+ above 43 in: 54.63139 in" in shown
    for options, words in (
        ("", "the table [path], or the file of a path"),
        (f"--range --of {out}", "is not a result of solve or evaluate"),
        ("--range --along a.ngc", "--along: conflicts with --range"),
        ("--range --unit mm", "--unit: conflicts with --range"),
        ("--along a.ngc --most 1,1", "--most: needs --range"),
        ("--range --most 1,-1", "--most 1,-1: must be LENGTH,ANGLE: two positive numbers"),
    ):
        refusal_of(cli("path", "hexapod-linuxcnc", *options.split()), words)
    free = cli("path", "paper-4.1-helical", "--range")
    refusal_of(free, "paper-4.1-helical", "pose: has free coordinates", "give this pose with --start")


def test_without_time_nothing_is_claimed() -> None:
    found = axis_ranges(hexapod(leg_length={"min": 17, "max": 43}), time_limit=0)
    assert {each.outcome for each in found.stops} == {Outcome.OPEN}
    assert found.axes == found.pairs == ()
