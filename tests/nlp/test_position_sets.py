"""Workspaces with sets of positions: disc, ring, cylinder, ball, cone and half spaces."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import case_from, shipped_tables
from hypothesis import given, settings
from hypothesis import strategies as st
from position_cases import LOWEST, RADIUS, ROD, delta, excess, heights
from workspace_cases import on_paper, only, rejected, stating

from screwsynth.nlp import CaseError, Free, Outcome, Workspace, judge_workspace
from screwsynth.nlp.case.pose import ends_of
from screwsynth.nlp.case.positionsets import HalfSpace, PositionSet, SetKind
from screwsynth.nlp.proof.checker.proof_file import set_premise, workspace_premise
from screwsynth.nlp.proof.checker.tree import Node
from screwsynth.nlp.proof.checker.workspace.check import check_workspace_proof
from screwsynth.nlp.proof.checker.workspace.pose_boxes import PoseRoot, pose_root
from screwsynth.nlp.proof.workspace.robot.pose_box import pose_box, scaled
from screwsynth.nlp.proof.workspace.scale import largest_scale


@pytest.mark.parametrize("unit", [1e-6, pytest.param(1.0, marks=pytest.mark.soak)])
def test_printable_diameter_of_a_linear_delta(tmp_path: Path, unit: float) -> None:
    """The lowest carriage reaches its stop where R + r is the horizontal reach of a rod."""
    z = -235.0
    exact = 2 * (math.sqrt(ROD**2 - (LOWEST - z) ** 2) - RADIUS)
    case = delta(tmp_path, {"disc": {"diameter": 160 * unit, "z": z * unit}}, unit=unit)
    found = largest_scale(case)
    assert found.factor is not None
    assert exact * (1 - 1e-3) <= 160 * found.factor <= exact
    assert found.positions is not None
    assert 2 * found.positions.radius == pytest.approx(160 * unit * found.factor)
    assert found.refuted
    assert found.pose is not None
    # The pose beyond violates the limit, on the rim of the next disc.
    at = found.pose.position / unit
    assert heights(at[None]).min() < LOWEST
    assert 2 * math.hypot(*at[:2]) <= 160 * found.failed * (1 + 1e-9)


def test_only_the_radius_is_scaled(tmp_path: Path) -> None:
    disc = {"disc": {"radius": 30, "z": [-260, -230], "centre": [10, 5]}}
    case = delta(tmp_path, disc)
    assert case.workspace is not None
    larger = scaled(case.workspace, 2.0)
    assert larger.position_set is not None
    assert larger.position_set.radius == 60
    assert larger.position[2] == case.workspace.position[2]
    assert larger.turns == case.workspace.turns


def test_corners_of_the_box_outside_of_the_disc_refute_nothing(tmp_path: Path) -> None:
    z, disc = -235.0, {"disc": {"radius": 110.0, "z": -235.0}}
    ends = [{"min": -110.0, "max": 110.0}, {"min": -110.0, "max": 110.0}, z]
    # The carriage of the first pillar stays above its stop in the disc, not at the corners of the box.
    rim = np.array([[-110.0 * math.cos(a), 110.0 * math.sin(a), z] for a in np.linspace(0, 2 * math.pi, 100_000)])
    corners = np.array([[x, y, z] for x in (-110.0, 110.0) for y in (-110.0, 110.0)])
    with np.errstate(invalid="ignore"):
        assert np.isnan(heights(corners)).any()
    assert heights(rim).min() > LOWEST
    round_case, square = delta(tmp_path, disc), delta(tmp_path, ends)
    judged = judge_workspace(round_case)
    assert judged.is_proved
    assert judge_workspace(square, until_fault=True).is_refuted
    lengths = [each for each in judged.extremes if each.name.startswith("actuator_length")]
    assert len(lengths) == 6
    least = min(each.bound for each in lengths if each.sense.value == "min")
    assert LOWEST <= least <= heights(rim).min()


def test_a_box_as_a_set_is_the_box(tmp_path: Path) -> None:
    ends = [{"min": -40.0, "max": 40.0}, {"min": -30.0, "max": 30.0}, {"min": -240.0, "max": -230.0}]
    far = {"normal": [1.0, 1.0, 0.0], "point": [500.0, 0.0, 0.0]}
    plain, cut = delta(tmp_path, ends), delta(tmp_path, {"box": ends, "half_spaces": [far]})
    every = [judge_workspace(case, quantities=["actuator_length"]) for case in (plain, cut)]
    for one, other in zip(*(each.extremes for each in every), strict=True):
        assert one.name == other.name
        assert one.outcome is other.outcome is Outcome.PROVED
        if one.limit is None:
            assert other.bound == pytest.approx(one.bound, rel=2e-3)


def test_proof_of_a_disc(tmp_path: Path) -> None:
    case = delta(tmp_path, {"disc": {"radius": 100.0, "z": [-236.0, -235.0]}})
    proof = on_paper(case)[1]
    assert not proof.unproved
    checked = check_workspace_proof(proof, case)
    assert len(checked.claims) == 13
    # The premise in the file is not used by the check, and another one is refused.
    for other in ({"radius": 101.0}, {"radius": 99.0}, {"centre": [0.5, 0.0]}, {"z": [-237.0, -235.0]}):
        changed = delta(tmp_path, {"disc": {"radius": 100.0, "z": [-236.0, -235.0]} | other})
        assert "another workspace" in rejected(proof, changed)
    box = delta(tmp_path, [{"min": -100.0, "max": 100.0}] * 2 + [{"min": -236.0, "max": -235.0}])
    assert "another workspace" in rejected(proof, box)
    # Without the premise, claims must be proved on the set of the case: more poses need other trees.
    wide = delta(tmp_path, {"disc": {"radius": 125.0, "z": [-236.0, -235.0]}})
    assert wide.workspace is not None
    numbers = {"workspace": workspace_premise(wide.workspace), "position_set": set_premise(wide.workspace)}
    forged = only(stating(proof, **numbers), "actuator_length limb 1", "min")
    assert "could not be proved" in rejected(forged, wide)
    assert "not outside" in rejected(only(proof, "regular", tree=bytes([Node.OUTSIDE])), case)
    tight = delta(tmp_path, {"disc": {"radius": 112.9, "z": -235.0}})
    proof = only(on_paper(tight)[1], "actuator_length limb 1", "min")
    assert check_workspace_proof(proof, tight).claims[0].limit == LOWEST


AXES = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: math.hypot(*axis) > 0.1)
UNITS = st.sampled_from([1e-6, 1.0, 1e3])


@st.composite
def position_sets(draw: st.DrawFn, kind: SetKind) -> PositionSet:
    """Random sets of positions of a shape, with up to two half spaces, in several units."""
    unit = draw(UNITS)
    x, y, z = (unit * draw(st.floats(-2, 2)) for _ in range(3))
    radius, axis = unit * draw(st.floats(0.2, 2)), [unit * each for each in draw(AXES)]
    if draw(st.booleans()):
        axis = [0.0, 0.0, unit]
    angles = ()
    if kind is SetKind.RING and draw(st.integers(0, 3)):
        first = draw(st.floats(-6, 3))
        angles = (first, first + draw(st.floats(0.2, 6)))
    spans = tuple(Free(at - unit * half, at + unit * half) for at, half in zip((x, y, z), (0.3, 0.5, 0.2), strict=True))
    halves = []
    for _ in range(draw(st.integers(0, 2))):
        # The centre of the shape stays inside, so that something is left.
        n = np.array(draw(AXES))
        at = np.array([x, y, z]) + unit * draw(st.floats(0.05, 1)) * n / np.linalg.norm(n)
        halves.append(HalfSpace(tuple(n.tolist()), tuple(at.tolist())))
    end = tuple((np.array([x, y, z]) + axis).tolist())
    given = PositionSet(
        kind,
        radius=radius,
        centre=(x, y, z),
        end=end,
        inner=radius * draw(st.floats(0.1, 0.9)),
        angles=angles,
        spans=spans,
        shift=tuple(unit * draw(st.sampled_from([0.0, 0.1])) for _ in range(3)),
    )
    if kind is SetKind.RING or kind in (SetKind.CYLINDER, SetKind.CONE):
        halves = [
            replace(each, point=tuple((given.middle - given.shift + np.array(each.point) - (x, y, z)).tolist()))
            for each in halves
        ]
    return replace(given, half_spaces=tuple(halves))


@pytest.mark.parametrize("kind", SetKind)
@settings(max_examples=8, deadline=None)
@given(data=st.data(), seed=st.integers(0, 2**31))
def test_boxes_are_contracted_to_the_set_and_never_past_a_position(
    kind: SetKind, data: st.DataObject, seed: int
) -> None:
    positions = data.draw(position_sets(kind))
    rng, workspace = np.random.default_rng(seed), Workspace.within(positions)
    box, root = pose_box(workspace), pose_root(workspace)
    size = float((box.upper - box.lower)[:3].max())
    rounding = 1e-12 * float(np.abs([box.lower, box.upper]).max())
    middle = np.array(workspace.middle)
    assert excess(positions, middle[None])[0] < 0
    points = box.random(400, rng)
    moved = box.clipped(
        np.hstack([rng.uniform(box.lower[:3] - size, box.upper[:3] + size, (400, 3)), np.zeros((400, 3))])
    )
    for each in (points, moved):
        assert box.holds(each).all()
        assert (excess(positions, each[:, :3]) <= rounding).all()
        assert all(root.holds(y) for y in each[:10])
        assert all(positions.contains(y[:3]) for y in each[:10])
    # Single points of the set, chosen by the plain formulas.
    alone = np.hstack([rng.uniform(box.lower[:3], box.upper[:3], (4000, 3)), np.zeros((4000, 3))])
    alone = alone[excess(positions, alone[:, :3]) <= -rounding]
    assert not box.contracted(alone, alone)[2].any()
    assert root.contracted(alone, alone)[2].all()
    # Random boxes, many of them at the surface.
    centre = np.concatenate([moved, points])[rng.integers(0, 800, 40), :3] + size * 0.02 * rng.normal(size=(40, 3))
    half = size * 10.0 ** rng.uniform(-3, -0.3, (40, 1)) * rng.uniform(0.2, 1, (40, 3))
    lower, upper = (
        np.hstack([np.clip(end, box.lower[:3], box.upper[:3]), np.zeros((40, 3))])
        for end in (centre - half, centre + half)
    )
    inside = rng.uniform(lower[:, None, :3], upper[:, None, :3], (40, 200, 3))
    far = excess(positions, inside.reshape(-1, 3)).reshape(40, 200)
    low, high, outside = box.contracted(lower, upper)
    least, most, kept = root.contracted(lower, upper)
    for k in range(40):
        members = inside[k][far[k] <= -rounding]
        assert not (len(members) and outside[k])
        assert not (len(members) and not kept[k])
        for a, b in ((low[k], high[k]), (least[k], most[k])):
            assert (members >= a[:3]).all()
            assert (members <= b[:3]).all()
    # What the search discards, the checker discards too, at the latest on parts of the box.
    for k in np.flatnonzero(outside)[:2]:
        assert root.is_outside(lower[k], upper[k])
    for k in np.flatnonzero((far <= -rounding).any(axis=1))[:1]:
        assert not root.is_outside(lower[k], upper[k])
    beyond = inside.reshape(-1, 3)[(far > 1e-9 * size).ravel()][:20]
    assert not any(root.holds(np.append(p, [0, 0, 0])) for p in beyond)


@pytest.mark.parametrize("kind", SetKind)
@settings(max_examples=5, deadline=None)
@given(data=st.data())
def test_bisection_converges_to_the_set(kind: SetKind, data: st.DataObject) -> None:
    positions = data.draw(position_sets(kind))
    workspace = Workspace.within(positions)
    size = float(max(each.upper - each.lower for each in positions.box if isinstance(each, Free)))
    for bounds in (pose_box(workspace), pose_root(workspace)):
        low, high = bounds.lower[None], bounds.upper[None]
        for k in range(15):
            middle = 0.5 * (low[:, k % 3] + high[:, k % 3])
            below, above = high.copy(), low.copy()
            below[:, k % 3] = above[:, k % 3] = middle
            low, high = np.concatenate([low, above]), np.concatenate([below, high])
            low, high, mark = bounds.contracted(low, high)
            kept = mark if isinstance(bounds, PoseRoot) else ~mark
            low, high = low[kept], high[kept]
        centre = 0.5 * (low + high)[:, :3]
        half = 0.5 * np.linalg.norm(high - low, axis=1)
        # Every remaining box is at the set: its middle is at most some diagonals away, from a cone along its base.
        slope = positions.radius / float(np.linalg.norm(positions.axis)) if positions.kind is SetKind.CONE else 1.0
        assert (excess(positions, centre) <= 6 * (1 + slope) ** 2 * half + 1e-9 * size).all()


@pytest.mark.parametrize("kind", SetKind)
@settings(max_examples=5, deadline=None)
@given(data=st.data())
def test_sets_in_a_case_file_and_back(kind: SetKind, data: st.DataObject) -> None:
    positions = data.draw(position_sets(kind))
    case = case_from(shipped_tables("hexapod-linuxcnc"), "set")
    for about_pose in (False, True):
        workspace = Workspace.within(positions, about_pose=about_pose)
        again = case_from(replace(case, workspace=workspace).to_toml()).workspace
        assert again is not None
        assert again.about_pose is about_pose
        assert again.position_set is not None
        assert again.position_set.to_table(case.units) == positions.to_table(case.units)
        assert again.turns == workspace.turns
        points = pose_box(workspace).random(50, np.random.default_rng(0))[:, :3]
        assert all(again.position_set.contains(p) for p in points)


BALL = {"ball": {"diameter": 60.0, "centre": [15.0, -10.0, -250.0]}}
CONE = {"cone": {"radius": 50.0, "apex": [0.0, 10.0, -230.0], "base": [20.0, -5.0, -290.0]}}
CYLINDER = {"cylinder": {"radius": 25.0, "start": [-30.0, 0.0, -260.0], "end": [30.0, 20.0, -240.0]}}
SECTOR = {"ring": {"radius": 80.0, "inner_radius": 50.0, "angle": {"min": 40.0, "max": 310.0}, "z": [-250.0, -240.0]}}


# The boxes of every kind of set are also tested without a robot, above.
@pytest.mark.parametrize(
    "position", [BALL, CONE, *(pytest.param(each, marks=pytest.mark.soak) for each in (CYLINDER, SECTOR))]
)
def test_bounds_over_a_set_against_dense_samples(tmp_path: Path, position: object) -> None:
    case = delta(tmp_path, position, limited=False)
    assert case.workspace is not None
    positions = case.workspace.position_set
    assert positions is not None
    rng = np.random.default_rng(0)
    ends = np.array([ends_of(each) for each in positions.box])
    points = rng.uniform(ends[:, 0], ends[:, 1], (1_000_000, 3))
    inside = heights(points[excess(positions, points) <= 0])
    judged, proof = on_paper(case, quantities=["actuator_length"], gap=1e-3)
    assert judged.is_proved
    found = [each for each in judged.extremes if each.name.startswith("actuator_length")]
    assert len(found) == 6
    for each in found:
        sign, own = each.sense.sign, inside[:, int(each.name[-1]) - 1]
        sample = float(own.max() if sign > 0 else own.min())
        # Never inside of a sample, and as close as gap and samples at the surface allow.
        assert 0 <= sign * (each.bound - sample) <= 0.03 * np.ptp(own) + 2e-3 * abs(sample)
        assert each.pose is not None
        assert excess(positions, each.pose.position[None])[0] <= 1e-9
    checked = check_workspace_proof(proof, case)
    assert len([each for each in checked.claims if each.name.startswith("actuator_length")]) == 6
    assert not proof.unproved


def test_a_singular_pose_outside_of_the_disc_does_not_refute() -> None:
    """LinuxCNC's hexapod is singular near z = 0: the corner of the box about a cone is, the cone is not."""
    tables = shipped_tables("hexapod-linuxcnc")
    del tables["limits"]
    flat = {"normal": [0, 0, -1], "point": [0, 0, 10]}
    ends = [{"min": -2, "max": 2}, {"min": -2, "max": 2}, {"min": -5, "max": 20}]
    tables["workspace"] = {"position": ends}
    assert judge_workspace(case_from(tables), with_objective=False).regularity.outcome is Outcome.REFUTED
    tables["workspace"] = {"position": {"box": ends, "half_spaces": [flat]}}
    judged = judge_workspace(case_from(tables), with_objective=False)
    assert judged.regularity.outcome is Outcome.PROVED


FAULTS = {
    "disc = { z = 0 }": "workspace.position.disc.diameter: is missing: give diameter or radius",
    "disc = { radius = 2, diameter = 4 }": "workspace.position.disc.radius",
    "disc = { radius = -2 }": "workspace.position.disc.radius",
    "disc = { radius = 2, height = 3 }": "workspace.position.disc.height",
    "disc = { radius = 2, z = [3, 1] }": "workspace.position.disc.z",
    "disc = { radius = 2 }, ball = { radius = 1, centre = [0, 0, 0] }": "conflicts with disc",
    "ring = { radius = 2 }": "workspace.position.ring.inner_radius",
    "ring = { radius = 2, inner_radius = 3 }": "workspace.position.ring.inner_radius",
    "ring = { radius = 2, inner_diameter = 3 }": "workspace.position.ring.inner_diameter",
    "ring = { radius = 2, inner_radius = 1, angle = { min = 0, max = 360 } }": "workspace.position.ring.angle",
    "cone = { radius = 2, apex = [0, 0, 1], base = [0, 0, 1] }": "workspace.position.cone.base",
    "box = [0, 0, 0], half_spaces = [{ normal = [0, 0, 0], point = [0, 0, 0] }]": "half_spaces[0].normal",
    "disc = { radius = 2 }, half_spaces = [{ normal = [1, 0, 0], point = [-9, 0, 0] }]": "exclude every position",
    "half_spaces = []": "must have one of disc, ring",
}


@pytest.mark.parametrize(("table", "words"), FAULTS.items())
def test_faults_name_key_and_cause(tmp_path: Path, table: str, words: str) -> None:
    text = delta(tmp_path, [0.0, 0.0, {"min": -240.0, "max": -230.0}]).to_toml()
    position = text.index("position = ", text.index("[workspace]"))
    changed = text[:position] + f"position = {{ {table} }}" + text[text.index("\n", position) :]
    with pytest.raises(CaseError) as caught:
        case_from(changed)
    assert words in str(caught.value)
