"""Uses of sets of positions: bounds against points on the rim, slices, searches over a set, tolerances, loads."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from builders import Run, case_from, ends, output_of, refusal_of, saved, shipped_tables, soaked, turn_about
from measures import circle_joints
from position_cases import HOME, LOWEST, PILLARS, RADIUS, ROD, delta, excess, heights

from screwsynth.models import FloatArray
from screwsynth.nlp import Case, Free, Judgement, Outcome, judge_workspace, solve
from screwsynth.nlp.case.pose import ends_of
from screwsynth.nlp.case.positionsets import PositionSet
from screwsynth.nlp.output.pictures.workspaces import slices_figure
from screwsynth.nlp.proof.workspace.axis_ranges import axis_ranges
from screwsynth.nlp.proof.workspace.scale import largest_scale
from screwsynth.nlp.proof.workspace.slices.slice_limits import KEPT
from screwsynth.nlp.proof.workspace.slices.slices import Region, slices_of

COUNT = 10_000
GAP = 1e-2
#: Units of length, and their numbers for a length of 1 in the shapes below.
UNITS = {"mm": 1.0, "m": 1e-3}
RNG = np.random.default_rng(0)


class Sampled(NamedTuple):
    """A set as a case states it, and points (10,000, 3) on its rim and inside, from its sizes alone."""

    table: dict[str, Any]
    rim: FloatArray
    inside: FloatArray


def turned_about(axis: FloatArray) -> FloatArray:
    """Two unit vectors (2, 3) across an axis."""
    return np.asarray(np.linalg.svd(axis[None])[2][1:])


def circles(sizes: FloatArray, turn: FloatArray) -> FloatArray:
    """Points (N, 2) at distances from the origin."""
    return sizes[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def upright(z: FloatArray, inner: float, radius: float, turns: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Points on the rim and inside of a disc or ring about the vertical axis."""
    turn, share, height = RNG.uniform(*turns, COUNT), RNG.uniform(size=COUNT), RNG.uniform(*z, COUNT)
    on = np.where(RNG.uniform(size=COUNT) < 0.3, inner, radius)
    at_ends = np.where(RNG.uniform(size=COUNT) < 0.5, RNG.choice(z, COUNT), height)
    inside = circles(np.sqrt(inner**2 + share * (radius**2 - inner**2)), turn)
    rim = circles(on if inner else np.full(COUNT, radius), turn)
    return np.column_stack([rim, at_ends]), np.column_stack([inside, height])


def along_axis(first: FloatArray, last: FloatArray, radius: float, *, tapers: bool) -> tuple[FloatArray, FloatArray]:
    """Points on the surface and inside of a cylinder, or of a cone from its apex."""
    t, share, turn = RNG.uniform(size=(3, COUNT)) * np.array([[1.0], [1.0], [2 * math.pi]])
    end = RNG.choice([0.0, 1.0], COUNT)
    at = np.where(RNG.uniform(size=COUNT) < 0.5, end, t)
    e = turned_about(last - first)

    def points(along: FloatArray, size: FloatArray) -> FloatArray:
        return np.asarray(first + along[:, None] * (last - first) + circles(size, turn) @ e)

    wide = [radius * (each if tapers else np.ones(COUNT)) for each in (at, t)]
    return points(at, wide[0]), points(t, wide[1] * np.sqrt(share))


def sampled(name: str, height: float) -> Sampled:
    """A set about a height, with points."""
    z = np.array([height - 8.0, height + 5.0])
    spans = {"min": float(z[0]), "max": float(z[1])}
    if name in ("disc", "half disc"):
        rim, inside = upright(z, 0.0, 30.0, (0.0, 2 * math.pi))
        table: dict[str, Any] = {"disc": {"diameter": 60.0, "centre": [4.0, -3.0], "z": spans}}
        rim, inside = (np.array([4.0, -3.0, 0.0]) + each for each in (rim, inside))
        if name == "half disc":
            n, at = np.array([1.0, 2.0, 0.5]), np.array([8.0, 0.0, height])
            table["half_spaces"] = [{"normal": n.tolist(), "point": at.tolist()}]
            # Points beyond the plane are moved onto it, along its normal, as far as they stay in the disc.
            over = np.maximum((np.vstack([rim, inside]) - at) @ n, 0) / (n @ n)
            points = np.vstack([rim, inside]) - over[:, None] * n
            in_disc = np.hypot(points[:, 0] - 4, points[:, 1] + 3) <= 30
            points = points[in_disc & (points[:, 2] >= z[0]) & (points[:, 2] <= z[1])]
            on = ((points - at) @ n) > -1e-9
            assert on.sum() > 100
            return Sampled(table, points[on], points[~on])
        return Sampled(table, rim, inside)
    if name == "ring":
        turns = (math.radians(-40), math.radians(200))
        table = {"ring": {"radius": 35.0, "inner_radius": 15.0, "angle": {"min": -40.0, "max": 200.0}, "z": spans}}
        return Sampled(table, *upright(z, 15.0, 35.0, turns))
    if name == "ball":
        centre, away = np.array([5.0, -6.0, height]), RNG.normal(size=(COUNT, 3))
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        table = {"ball": {"radius": 20.0, "centre": centre.tolist()}}
        return Sampled(table, centre + 20 * away, centre + 20 * np.cbrt(RNG.uniform(size=(COUNT, 1))) * away)
    first, last = np.array([-10.0, 5.0, height - 10]), np.array([15.0, -5.0, height + 10])
    places = ("apex", "base") if name == "cone" else ("start", "end")
    table = {name: {"radius": 18.0, **dict(zip(places, (first.tolist(), last.tolist()), strict=True))}}
    return Sampled(table, *along_axis(first, last, 18.0, tapers=name == "cone"))


SETS = ("disc", "half disc", "ring", "cylinder", "ball", "cone")
#: LinuxCNC's hexapod in tens of millimetres, turned by up to 5 degrees about the vertical.
SIZES = {"x1": 265.0, "x2": 115.43, "x3": 0.0, "x4": math.radians(5)}
YAW = 5.0
PUSH, AT = np.array([3.0, 1.0, -10.0]), np.array([0.0, 5.0, 10.0])


def in_unit(value: object, unit: float) -> Any:  # noqa: ANN401 - a part of a table
    """Lengths of a table of positions in another unit."""
    if isinstance(value, dict):
        return {name: each if name in ("normal", "angle") else in_unit(each, unit) for name, each in value.items()}
    return [in_unit(each, unit) for each in value] if isinstance(value, list) else value * unit  # type: ignore[operator]


def hexapod(position: object, unit: str = "mm", **tables: object) -> Case:
    """The hexapod over positions, given in millimetres."""
    k, given = UNITS[unit], shipped_tables("hexapod-linuxcnc")
    given["units"] = {"length": unit}
    given["robot"]["parameters"] = {"x1": 265 * k, "x2": 115.43 * k, "x3": 0, "x4": 5}
    given["pose"] = {"position": [0, 0, 200 * k]}
    given["task"] = [{"sense": "max", "axis": [1, 0, 0], "point": [0, 0, 100 * k], "pitch": 0}]
    given["workspace"] = {"position": in_unit(position, k), "rotation": {"axis": [0, 0, 1], "angle": ends(YAW)}}
    given["load"] = [{"name": "push", "force": PUSH.tolist(), "point": (AT * k).tolist()}]
    del given["limits"]
    return case_from(given | tables)


def hexapod_values(points: FloatArray) -> dict[str, FloatArray]:
    """Lengths, F and forces (N,) of the hexapod at positions, at random angles and at the largest ones."""
    base, platform = circle_joints(SIZES)
    yaw = np.radians(np.where(RNG.uniform(size=len(points)) < 0.5, RNG.choice([-YAW, YAW], len(points)), 0.0))
    turn = np.array([turn_about((0, 0, 1), each) for each in np.radians([-YAW, 0.0, YAW])])
    turn = turn[np.searchsorted(np.radians([-YAW, 0.0, YAW]), yaw - 1e-12)]
    legs = points[:, None] + platform @ turn.transpose(0, 2, 1) - base
    lengths = np.linalg.norm(legs, axis=2)
    u = legs / lengths[..., None]
    rows = np.concatenate([np.cross(base[None], u), u], axis=2)
    twist = np.array([1.0, 0, 0, 0, 100.0, 0])
    contact = points + turn @ AT
    wrench = np.hstack([np.cross(contact, PUSH), np.broadcast_to(PUSH, contact.shape)])
    forces = -np.linalg.solve(rows.transpose(0, 2, 1), wrench[..., None])[..., 0]
    names = ["1-", "1+", "2-", "2+", "3-", "3+"]
    found = {"F": ((rows @ twist) ** 2).sum(axis=1)}
    found |= {f"leg_length limb {name}": lengths[:, k] for k, name in enumerate(names)}
    return found | {f"actuator_force actuator {name}": forces[:, k] for k, name in enumerate(names)}


def delta_values(points: FloatArray) -> dict[str, FloatArray]:
    """Heights (N,) of the carriages."""
    return {f"actuator_length limb {k + 1}": each for k, each in enumerate(heights(points).T)}


#: Power of the length in the unit of a quantity.
POWERS = {"F": 2, "leg_length": 1, "actuator_length": 1, "actuator_force": 0}


def bounds_of(judged: Judgement, unit: float) -> dict[tuple[str, float], tuple[float, float]]:
    """Bounds and reached values of quantities by name and sign, in millimetres and newtons."""
    found = {}
    for each in judged.extremes:
        name = each.name.replace(" smallest", "").removesuffix(" load push")
        if name.partition(" ")[0] not in POWERS:
            continue
        assert each.outcome is Outcome.PROVED, each
        factor = unit ** POWERS[name.partition(" ")[0]]
        found[name, each.sense.sign] = each.bound / factor, each.reached / factor
    return found


def attacked(
    given: Sampled,
    values: Callable[[FloatArray], dict[str, FloatArray]],
    bounds: dict[tuple[str, float], tuple[float, float]],
) -> int:
    """Compare bounds with values on the rim and inside; the number of extremes that are met within three gaps."""
    rim, inside = values(given.rim), values(given.inside)
    near = 0
    for (name, sign), (bound, reached) in bounds.items():
        every = np.concatenate([rim[name], inside[name]])
        assert np.isfinite(every).all()
        sample, size = float((sign * every).max()), float(np.abs(every).max())
        assert sample <= sign * bound + 1e-9 * size, name
        assert sign * reached <= sign * bound
        near += sign * bound - sample <= 3 * GAP * size
    return near


@pytest.mark.parametrize("name", soaked(SETS, ["disc", "cone"]))
@pytest.mark.parametrize("robot", ["hexapod", "delta"])
def test_bounds_hold_on_the_rim_and_inside_in_two_units(tmp_path: Path, name: str, robot: str) -> None:
    given = sampled(name, 200.0 if robot == "hexapod" else -245.0)
    found = {}
    for unit, k in UNITS.items():
        if robot == "hexapod":
            case, values, quantity = hexapod(given.table, unit), hexapod_values, "leg_length"
        else:
            case = delta(tmp_path, in_unit(given.table, k), unit=k, limited=False)
            values, quantity = delta_values, "actuator_length"
        found[unit] = bounds_of(judge_workspace(case, gap=GAP, quantities=[quantity], jobs=1), k)
        if robot == "delta":
            found[unit] = {key: each for key, each in found[unit].items() if key[0] != "F"}
        assert attacked(given, values, found[unit]) == len(found[unit]) == (26 if robot == "hexapod" else 6)
    # The unit changes nothing but rounding, and choices that depend on it stay within the gap.
    for key, (bound, _) in found["mm"].items():
        assert found["m"][key][0] == pytest.approx(bound, rel=2 * GAP)
    assert case.workspace is not None
    # The box about the set has the set's values, and others.
    spans = [each if not isinstance(each, Free) else {"min": each.lower, "max": each.upper}
             for each in case.workspace.position]  # fmt: skip
    around = (
        hexapod([in_unit(each, 1 / UNITS["m"]) for each in spans], "m")
        if robot == "hexapod"
        else delta(tmp_path, spans, unit=UNITS["m"], limited=False)
    )
    boxed = bounds_of(judge_workspace(around, gap=GAP, quantities=[quantity], jobs=1), UNITS["m"])
    inner = found["m"]
    assert all(sign * boxed[name, sign][0] >= sign * inner[name, sign][1] for name, sign in inner)
    assert any(sign * boxed[name, sign][1] > sign * inner[name, sign][0] for name, sign in inner)


def test_slices_show_the_outline_and_the_verdicts_of_a_disc(tmp_path: Path) -> None:
    case = delta(tmp_path, {"disc": {"radius": 80.0, "centre": [20.0, 0.0], "z": [-240.0, -230.0]}})
    assert case.workspace is not None
    positions = case.workspace.position_set
    assert positions is not None
    found = slices_of(case)
    assert [each.names for each in found] == [("p_x", "p_y"), ("p_x", "p_z"), ("p_y", "p_z")]
    middle = np.array(case.workspace.middle)
    for each in found:
        chosen = [("p_x", "p_y", "p_z").index(name) for name in each.names]
        assert each.outside is not None
        side = len(each.outside)
        grid = np.stack(np.meshgrid(*np.linspace(*each.whole, side).T, indexing="ij"), axis=-1).reshape(-1, 2)
        points = np.tile(middle, (len(grid), 1))
        points[:, chosen] = grid
        beyond = excess(positions, points).reshape(side, side)
        far = np.abs(beyond) > 1e-6
        assert (np.sign(each.outside) == np.sign(beyond))[far].all()
        assert (beyond < 0).any()
        assert (beyond > 0).any()
        # Verdicts are about single boxes of the slice, also outside of the disc.
        centre = 0.5 * (each.boxes[:, :2] + each.boxes[:, 2:])
        at = np.tile(middle, (len(centre), 1))
        at[:, chosen] = centre
        with np.errstate(invalid="ignore"):
            kept = (heights(at) >= LOWEST).all(axis=1)
        is_regular = np.array([region is Region.REGULAR for region in each.regions])
        assert kept[is_regular & (each.binding == KEPT)].all()
        assert (~kept)[each.binding == 0].all()
    figure = slices_figure(case, found)
    outlines = [
        item for axes in figure.axes for item in axes.get_children() if getattr(item, "get_gid", str)() == "workspace"
    ]
    assert len(outlines) == 3
    # The outline of the first slice is the circle.
    (path,) = outlines[0].get_paths()
    corners = path.vertices - [20.0, 0.0]
    assert np.hypot(*corners.T) == pytest.approx(80.0, rel=1e-3)


def test_the_page_and_json_say_which_set_is_meant(tmp_path: Path, cli: Run) -> None:
    case = delta(tmp_path, {"disc": {"diameter": 160.0, "z": [-240.0, -230.0]}})
    file = saved(tmp_path / "printer.toml", case.to_toml())
    page, picture, result = (tmp_path / f"found.{ending}" for ending in ("html", "svg", "json"))
    out = output_of(
        cli("workspace", str(file), "--html", str(page), "--plot", str(picture), "--json", str(result), "--scale")
    )
    words = "disc of diameter 160"
    assert words in out
    assert words in page.read_text(encoding="utf-8")
    assert 'id="workspace"' in picture.read_text(encoding="utf-8")
    content = json.loads(result.read_text(encoding="utf-8"))
    assert words in content["poses"]
    assert content["scale"]["diameter"] == pytest.approx(160 * content["scale"]["factor"])
    assert "largest proved diameter" in out
    assert "next larger diameter" in out


def test_a_search_over_a_disc_ends_at_the_best_of_a_grid_of_designs() -> None:
    """Limits and the worst F are those of the disc: at the corners of the box about it legs are shorter and longer."""
    free = {"x1": {"min": 150, "max": 350}, "x2": 115.43, "x3": 0, "x4": 5}
    shape = {"disc": {"radius": 60.0, "z": [170.0, 230.0]}}
    robot = shipped_tables("hexapod-linuxcnc")["robot"] | {"parameters": free}
    legs = {"min": 150, "max": 330}
    tables = {
        "robot": robot,
        "limits": {"over": "workspace", "leg_length": legs},
        "objective": {"over": "workspace"},
        "solve": {"starts": 2},
    }
    solution = solve(hexapod(shape, "mm", **tables, load=[]))
    assert solution.status.is_answer
    assert solution.workspace.is_proved
    names = [each.name for each in solution.outcomes[0].own.nlp.program.variables]
    radius = float(solution.x[names.index("x1")])
    # Poses of the disc: three heights, rings, and the largest angles.
    turn = np.linspace(0, 2 * math.pi, 73)[:-1]
    flat = np.vstack([np.zeros((1, 2)), *(circles(np.full(72, size), turn) for size in (20.0, 40.0, 60.0))])
    points = np.vstack([np.column_stack([flat, np.full(len(flat), z)]) for z in (170.0, 200.0, 230.0)])

    def values(x1: float) -> tuple[float, bool]:
        base, platform = circle_joints(SIZES | {"x1": x1})
        rows, lengths = [], []
        for yaw in np.radians([-YAW, 0.0, YAW]):
            spans = points[:, None] + platform @ turn_about((0, 0, 1), yaw).T - base
            size = np.linalg.norm(spans, axis=2)
            u = spans / size[..., None]
            rows.append(np.concatenate([np.cross(base[None], u), u], axis=2))
            lengths.append(size)
        F = ((np.concatenate(rows) @ np.array([1.0, 0, 0, 0, 100.0, 0])) ** 2).sum(axis=1)
        every = np.concatenate(lengths)
        return float(F.min()), bool(every.min() >= legs["min"] and every.max() <= legs["max"])

    designs = np.linspace(150, 350, 401)
    worst = np.array([value if kept else -math.inf for value, kept in map(values, designs)])
    assert radius == pytest.approx(designs[int(worst.argmax())], abs=2)
    assert pytest.approx(worst.max(), rel=5e-3) == solution.F
    assert values(radius - 1e-3)[1] or values(radius + 1e-3)[1]
    # The same search over the box about the disc has to give up some of F.
    square = solve(hexapod([ends(60.0), ends(60.0), ends(30.0, 200.0)], "mm", **tables, load=[]))
    assert square.workspace.is_proved
    assert solution.F > square.F * 1.005


def test_errors_of_joint_centres_lengthen_legs_over_a_disc() -> None:
    """Both centres off by the tolerance along the leg: lengths are off by twice the tolerance, exactly."""
    eps, given = 0.5, sampled("disc", 200.0)
    quantities = ["leg_length"]
    wide, exact = (
        bounds_of(judge_workspace(hexapod(given.table, "mm", load=[], **more), gap=1e-3, quantities=quantities), 1.0)
        for more in ({"tolerance": {"joint_centre": eps}}, {})
    )
    values = [hexapod_values(points) for points in (given.rim, given.inside)]
    for (name, sign), (bound, _) in wide.items():
        if not name.startswith("leg_length"):
            continue
        sample = max(float((sign * each[name]).max()) for each in values)
        assert sample + 2 * eps <= sign * bound + 1e-9
        assert bound == pytest.approx(exact[name, sign][0] + 2 * eps * sign, rel=2e-3)


def test_forces_over_a_disc_are_those_of_random_loads() -> None:
    """A force of any direction on top of the load: at most its size times a row's norm more, at every pose."""
    given = sampled("disc", 200.0)
    load = [{"name": "push", "force": PUSH.tolist(), "point": AT.tolist(), "any": {"force": 2.0}}]
    bounds = bounds_of(judge_workspace(hexapod(given.table, "mm", load=load), gap=GAP, jobs=1), 1.0)
    base, platform = circle_joints(SIZES)
    points = np.vstack([given.rim, given.inside])
    legs = points[:, None] + platform - base
    u = legs / np.linalg.norm(legs, axis=2, keepdims=True)
    rows = np.concatenate([np.cross(base[None], u), u], axis=2).transpose(0, 2, 1)
    contact = points + AT
    way = RNG.normal(size=points.shape)
    force = PUSH + 2.0 * way / np.linalg.norm(way, axis=1, keepdims=True)
    forces = -np.linalg.solve(rows, np.hstack([np.cross(contact, force), force])[..., None])[..., 0]
    names = [key for key in bounds if key[0].startswith("actuator_force")]
    assert len(names) == 12
    order = ["1-", "1+", "2-", "2+", "3-", "3+"]
    for name, sign in names:
        own = sign * forces[:, order.index(name.split()[-1])]
        assert own.max() <= sign * bounds[name, sign][0]
        assert own.max() >= sign * bounds[name, sign][0] - 0.5


def test_smallest_angle_of_rods_as_a_cone_of_their_joints(tmp_path: Path) -> None:
    """Klipper's min_angle: a rod at that angle to the horizontal reaches L cos(min_angle) from its pillar."""
    least = 30.0
    case = delta(tmp_path, {"disc": {"diameter": 60.0, "z": HOME}}, limited=False)
    cones = {f"{limb}.1:2": {"cone": 90 - least, "axis": [0, 0, -1]} for limb in (1, 2, 3)}
    text = case.to_toml() + "\n[limits.joint]\n" + "".join(
        f'"{key}" = {{ cone = {each["cone"]}, axis = [0, 0, -1] }}\n' for key, each in cones.items()
    )  # fmt: skip
    found = largest_scale(case_from(text))
    exact = 2 * (ROD * math.cos(math.radians(least)) - RADIUS)
    assert found.factor is not None
    assert exact * (1 - 1e-3) <= 60 * found.factor <= exact
    assert found.refuted
    assert found.pose is not None
    # The rod from the far pillar is the one that lies flat.
    off = RADIUS * PILLARS - found.pose.position[:2]
    assert np.linalg.norm(off, axis=1).max() > ROD * math.cos(math.radians(least))


class Recorded(NamedTuple):
    """Files of a case over a disc with its proof record."""

    case: Path
    record: dict[str, Any]


#: Largest radius at which no carriage passes its stop at a height of -235.
REACH = math.sqrt(ROD**2 - (LOWEST + 235) ** 2) - RADIUS


@pytest.fixture
def recorded(tmp_path: Path, cli: Run) -> Recorded:
    disc = {"disc": {"radius": 100.0, "centre": [1.0, 2.0], "z": -235.0}}
    file = saved(tmp_path / "printer.toml", delta(tmp_path, disc).to_toml())
    record = tmp_path / "record.json"
    output_of(cli("workspace", str(file), "--proof", str(record)))
    content: dict[str, Any] = json.loads(record.read_text(encoding="utf-8"))
    return Recorded(file, content)


def test_a_record_of_another_disc_is_rejected(tmp_path: Path, cli: Run, recorded: Recorded) -> None:
    case, content = recorded
    stated = content["premises"]["position_set"]
    assert stated[0] == "disc"
    assert stated[1][0] == 100.0

    def checked(record: dict[str, Any], *named: str) -> tuple[int, str, str]:
        return cli("verify-proof", str(saved(tmp_path / "other.json", json.dumps(record))), *named)  # type: ignore[no-any-return]

    def with_set(**values: object) -> dict[str, Any]:
        other = json.loads(json.dumps(content))
        places = {"radius": (1, 0), "inner": (1, 1), "x": (2, 0), "y": (2, 1), "shift": (5, 0)}
        for name, value in values.items():
            first, second = places[name]
            other["premises"]["position_set"][first][second] = value
        return other

    output = output_of(checked(content, str(case)))
    assert "disc of radius 100" in output
    nothing = json.loads(json.dumps(content))
    nothing["premises"]["position_set"] = []
    altered = [with_set(**{name: value}) for name, value in [("radius", 100.0000001), ("radius", 99), ("radius", -100),
               ("radius", 1e300), ("inner", 1), ("x", 1.5), ("y", -2), ("shift", 0.1)]]  # fmt: skip
    for k, record in enumerate([*altered, nothing]):
        # A record is refused with the case of the command, and by itself.
        for named in ((str(case),), ()) if k in (0, len(altered)) else ((str(case),),):
            code, out, err = checked(record, *named)
            assert (code, out) == (1, ""), err
            assert len(err.splitlines()) <= 2
            assert "another workspace" in " ".join(err.split())
    # The case of the command counts, whatever case the file has; without one, the file's case counts and is printed.
    larger = content["case"].replace("radius = 100", f"radius = {REACH + 5!r}")
    assert larger != content["case"]
    assert output_of(checked(content | {"case": larger}, str(case))) == output
    code, out, err = checked(content | {"case": larger})
    assert (code, out) == (1, "")
    # File and premise agree on a larger disc: the claims are false there, and no tree proves them.
    forged = with_set(radius=REACH + 5) | {"case": larger}
    forged["premises"]["workspace"][0][0] = [1 - (REACH + 5), 1 + (REACH + 5)]
    code, out, err = checked(forged)
    assert (code, out) == (1, ""), err
    moved = saved(tmp_path / "moved.toml", case.read_text(encoding="utf-8").replace("centre = [1", "centre = [1.5"))
    assert checked(content, str(moved))[:2] == (1, "")
    assert checked(with_set(x=1.5), str(moved))[:2] == (1, "")


WRONG = {
    "disc = { radius = -2 }": ("position.disc.radius", "above 0", "-2"),
    "disc = { radius = 0 }": ("position.disc.radius", "above 0"),
    "disc = { diameter = nan }": ("position.disc.diameter", "finite"),
    "disc = { radius = inf }": ("position.disc.radius", "finite"),
    "disc = { radius = 2, z = [0, nan] }": ("position.disc.z", "finite"),
    "disc = { radius = 2, z = [0, 1, 2] }": ("position.disc.z",),
    "disc = { radius = 2, centre = [0, 0, 1] }": ("position.disc.centre",),
    "disc = { radius = 2, z = 'low' }": ("position.disc.z",),
    "disc = { radius = 2 }, x = { min = 0, max = 1 }": ("position.x", "no such key"),
    "disc = { radius = 2, x = { min = 0, max = 1 } }": ("position.disc.x", "no such key"),
    "disc = { radius = 2, hight = 3 }": ("position.disc.hight", "no such key"),
    "dics = { radius = 2 }": ("position.dics", "disc"),
    "disc = 3": ("position.disc",),
    "ring = { radius = 2, inner_radius = 2 }": ("position.ring.inner_radius", "below"),
    "ring = { diameter = 2, inner_diameter = 5 }": ("position.ring.inner_diameter", "below"),
    "ring = { radius = 2, inner_radius = -1 }": ("position.ring.inner_radius", "above 0"),
    "ball = { radius = 2 }": ("position.ball.centre", "missing"),
    "cylinder = { radius = 2, start = [0, 0, 0], end = [0, 0, 0] }": ("position.cylinder.end",),
    "cone = { radius = 2, apex = [0, 0, nan], base = [0, 0, 1] }": ("position.cone.apex", "finite"),
    "disc = { radius = 2 }, half_spaces = [{ normal = [0, 0, nan], point = [0, 0, 0] }]": ("half_spaces",),
    "disc = { radius = 2 }, half_spaces = { normal = [0, 0, 1] }": ("half_spaces",),
}


@pytest.mark.parametrize(("table", "words"), WRONG.items())
def test_wrong_sets_are_refused_in_one_sentence(
    tmp_path: Path,
    cli: Run,
    table: str,
    words: tuple[str, ...],
) -> None:
    text = hexapod([ends(1), ends(1), ends(1, 200)]).to_toml()
    at = text.index("position = ", text.index("[workspace]"))
    file = saved(tmp_path / "wrong.toml", f"{text[:at]}position = {{ {table} }}{text[text.index(chr(10), at) :]}")
    result = tmp_path / "result.json"
    code, out, err = cli("workspace", str(file), "--json", str(result))
    assert (code, out) == (2, "")
    assert not result.exists()
    refusal_of((code, out, err), "wrong.toml", *words)
    assert len(err.replace("wrong.toml", "").split(". ")) == 1


def test_the_whole_output_of_a_hexapod_has_its_free_travel(tmp_path: Path, cli: Run) -> None:
    case = hexapod({"disc": {"radius": 20.0, "z": 200.0}}, load=[])
    file = saved(tmp_path / "hexapod.toml", case.to_toml())
    travel = "free travel along each axis"
    assert travel not in output_of(cli("workspace", str(file)))
    whole = output_of(cli("workspace", str(file), "--all"))
    assert travel in whole
    rows = {line.split()[0]: line.split()[1:5] for line in whole[whole.index(travel) :].splitlines() if line.split()}
    found = axis_ranges(case, with_pairs=False)
    assert not found.pairs
    for each in found.axes:
        unit, at, low, high = rows[each.axis]
        factor = 1.0 if unit == "mm" else math.degrees(1)
        given = np.array([float(at), float(low), float(high)]) / factor
        assert given == pytest.approx(np.array([each.at, each.lower.value, each.upper.value]), rel=1e-5, abs=1e-9)
    # A printer has three translations: the table is not for it.
    printer = saved(tmp_path / "printer.toml", delta(tmp_path, {"disc": {"radius": 50.0, "z": -235.0}}).to_toml())
    assert travel not in output_of(cli("workspace", str(printer), "--all"))


def test_sets_are_scaled_to_nested_sets(tmp_path: Path) -> None:
    """The bisection of ``--scale`` relies on it: a smaller factor leaves no position that the larger one lacks."""
    for name in SETS:
        case = delta(tmp_path, sampled(name, -245.0).table, limited=False)
        assert case.workspace is not None
        positions: PositionSet | None = case.workspace.position_set
        assert positions is not None
        for small, large in ((0.5, 1.0), (1.0, 1.7)):
            ends_ = np.array([ends_of(each) for each in positions.scaled(small).box])
            points = RNG.uniform(ends_[:, 0], ends_[:, 1], (COUNT, 3))
            inside = excess(positions.scaled(small), points) <= 0
            assert inside.sum() > 1000
            assert (excess(positions.scaled(large), points[inside]) <= 1e-9).all()


def test_a_moved_set_keeps_its_bounds_about_a_moved_robot(tmp_path: Path) -> None:
    """Excursions: the set about the pose is the set in the world, displaced."""
    given = sampled("ball", -245.0)
    world = delta(tmp_path, given.table, limited=False)
    about = {"ball": {"radius": 20.0, "centre": [5.0, -6.0, -245.0 - HOME]}}
    moved = delta(tmp_path, about, limited=False)
    assert moved.workspace is not None
    moved = replace(moved, workspace=replace(moved.workspace, about_pose=True))
    first, second = (
        bounds_of(judge_workspace(case, gap=1e-3, quantities=["actuator_length"], with_objective=False), 1.0)
        for case in (world, moved)
    )
    assert first.keys() == second.keys()
    for key, (bound, _) in first.items():
        assert second[key][0] == pytest.approx(bound, rel=2e-3)
