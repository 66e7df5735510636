"""Models that contradict themselves are refused; values as frozen dataclasses; graphs by their definitions."""

from __future__ import annotations

import dataclasses
import inspect
import math
import pickle
from collections.abc import Callable, Iterator, Mapping
from dataclasses import FrozenInstanceError, dataclass, field, replace
from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from builders import Array, turn_about
from casadi import SX

from screwsynth import models
from screwsynth.models import Body, Closure, Dimension, Link, Model, ModelError, Point, PoseSymbols, Scene, Wrench
from screwsynth.models.mechanism.topology import between, bridges_between, path_between, reached, spanning_tree
from screwsynth.models.values import dataclass as value_class
from screwsynth.nlp import Case, Nlp, Rotation, Task, evaluate, formulate


@dataclass(frozen=True)
class Parts:
    """A sound little robot in pieces: one leg from a movable base joint, of unknown length, and one couple."""

    pose: PoseSymbols
    base: models.Parameter
    length: models.Unknown
    closure: Closure
    leg: Wrench
    couple: Wrench
    measure: models.Quantity
    scene: Scene

    def model(self, **changed: object) -> Model:
        sound: dict[str, object] = {
            "name": "toy", "description": "a toy", "parameters": (self.base,), "pose": self.pose,
            "home": (0.0, 0.0, 1.0), "wrenches": (self.leg, self.couple), "quantities": (self.measure,),
            "scene": self.scene, "unknowns": (self.length,), "closure": (self.closure,),
        }  # fmt: skip
        return Model(**(sound | changed))  # type: ignore[arg-type]


def parts() -> Parts:
    pose = PoseSymbols()
    b, t = SX.sym("b", 3), SX.sym("t")
    span = pose.position + pose.rotation @ ca.DM([1.0, 0.0, 0.0]) - b
    return Parts(
        pose=pose,
        base=models.Parameter("base", b, Dimension.LENGTH, "base joint", (1.0, 0.0, 0.0)),
        length=models.Unknown("t", t, Dimension.LENGTH, "length of the leg", 0.1, 10.0),
        closure=Closure("loop", t**2 - ca.sumsqr(span)),
        leg=replace(models.force_along("leg", b, span), square=t**2),
        couple=models.couple_about("guide", pose.rotation[:, 2]),
        measure=models.Quantity("reach", ("leg",), t, Dimension.LENGTH, "length of the leg"),
        scene=Scene(
            (Point("B", b, Body.BASE), Point("A", b + span, Body.PLATFORM)),
            (Link("B", "A", Body.LIMB, "leg"), Link("A", "B", Body.BASE)),
        ),
    )


def test_a_sound_model_is_accepted_with_a_copy_of_its_options() -> None:
    toy = parts()
    model = toy.model(wrenches=(toy.leg, toy.couple, toy.leg))
    assert model.limbs == ("leg", "guide")
    assert model.has_couples
    assert not toy.model(wrenches=(toy.leg,)).has_couples
    assert toy.base.components == ("base_x", "base_y", "base_z")
    assert models.component_names("x1", 1) == ("x1",)
    assert models.component_names("p", 3) == ("p_x", "p_y", "p_z")
    options = {"layout": "aligned"}
    model = parts().model(options=options)
    options["layout"] = "other"
    assert model.options == {"layout": "aligned"}
    with pytest.raises(TypeError):
        model.options["layout"] = "other"  # type: ignore[index]


@pytest.mark.parametrize("where", ["wrench", "square", "closure", "quantity", "scene"])
def test_a_symbol_that_is_not_declared_is_refused_wherever_it_is_used(where: str) -> None:
    toy, stray = parts(), SX.sym("stray")
    changed = {
        "wrench": {"wrenches": (replace(toy.leg, moment=toy.leg.moment + stray), toy.couple)},
        "square": {"wrenches": (replace(toy.leg, square=toy.leg.square + stray), toy.couple)},
        "closure": {"closure": (Closure("loop", toy.closure.expression + stray),)},
        "quantity": {"quantities": (replace(toy.measure, values=toy.measure.values + stray),)},
        "scene": {"scene": Scene((Point("B", ca.vertcat(stray, 0, 0), Body.BASE),), ())},
    }[where]
    with pytest.raises(
        ModelError, match=r"model 'toy': expressions contain symbols of no parameter, joint coordinate or pose: stray$"
    ):
        toy.model(**changed)


def test_a_declared_symbol_is_known_by_itself_and_not_by_its_name() -> None:
    # The same letters, another symbol: what a robot function that builds its parameters twice would do.
    toy = parts()
    with pytest.raises(ModelError, match="symbols of no parameter, joint coordinate or pose: b_0, b_1, b_2"):
        toy.model(parameters=(replace(toy.base, symbol=SX.sym("b", 3)),))
    with pytest.raises(ModelError, match=r"symbols of no parameter, joint coordinate or pose: .*p_0"):
        toy.model(pose=PoseSymbols())


def test_names_that_appear_twice_are_refused() -> None:
    toy = parts()
    other = SX.sym("other")
    scalar = models.Parameter("base", other, Dimension.LENGTH, "", (1.0,))
    twins: list[tuple[dict[str, object], str]] = [
        ({"parameters": (toy.base, replace(toy.base, symbol=SX.sym("c", 3)))}, "base_x, base_y, base_z"),
        # A scalar may have the name of one component of a vector.
        ({"parameters": (toy.base, replace(scalar, name="base_y"))}, "base_y"),
        ({"parameters": (toy.base, replace(scalar, name="t"))}, "t"),
        ({"parameters": (toy.base, replace(scalar, name="loop"))}, "loop"),
        ({"parameters": (toy.base, replace(scalar, name="reach"))}, "reach"),
        ({"unknowns": (toy.length, replace(toy.length, symbol=other))}, "t"),
        ({"closure": (toy.closure, toy.closure)}, "loop"),
        ({"closure": (Closure("t", toy.closure.expression),)}, "t"),
        ({"quantities": (toy.measure, toy.measure)}, "reach"),
        ({"quantities": (replace(toy.measure, name="loop"),)}, "loop"),
    ]
    for changed, names in twins:
        with pytest.raises(ModelError, match=f"model 'toy': names appear twice: {names}$"):
            toy.model(**changed)


def test_a_symbol_that_stands_for_two_things_is_refused() -> None:
    toy = parts()
    for changed in (
        {"parameters": (toy.base, replace(toy.base, name="again"))},
        {"parameters": (toy.base, models.Parameter("again", toy.length.symbol, Dimension.LENGTH, "", (1.0,)))},
        {"unknowns": (toy.length, replace(toy.length, name="again"))},
        {"unknowns": (toy.length, replace(toy.length, name="again", symbol=toy.pose.position[1]))},
        {"parameters": (toy.base, replace(toy.base, name="again", symbol=toy.pose.position))},
    ):
        with pytest.raises(ModelError, match="model 'toy': two parameters or joint coordinates use the same symbol"):
            toy.model(**changed)


def test_an_expression_where_a_symbol_must_stand_is_refused() -> None:
    toy = parts()
    fault = "is an expression; a symbol is required"
    for changed in (
        {"parameters": (replace(toy.base, symbol=2 * toy.base.symbol),)},
        {"parameters": (replace(toy.base, symbol=SX([1.0, 2.0, 3.0])),)},
        {"unknowns": (replace(toy.length, symbol=toy.length.symbol + 1),)},
        {"unknowns": (replace(toy.length, symbol=SX(1)),)},
        {"pose": PoseSymbols(rotation=SX.eye(3), position=toy.pose.position)},
        {"pose": PoseSymbols(rotation=toy.pose.rotation, position=-toy.pose.position)},
    ):
        with pytest.raises(ModelError, match=fault):
            toy.model(**changed)


def test_a_wrong_shape_is_refused_by_name() -> None:
    toy = parts()
    row, column = SX.zeros(1, 3), SX.zeros(3)
    wrong: list[tuple[dict[str, object], str]] = [
        ({"wrenches": (replace(toy.leg, force=row),)}, r"wrench 0 force should have shape \(3, 1\), got \(1, 3\)"),
        ({"wrenches": (toy.leg, replace(toy.couple, moment=SX.zeros(2)))}, r"wrench 1 moment .* got \(2, 1\)"),
        ({"wrenches": (replace(toy.leg, square=column),)}, r"wrench 0 square should have shape \(1, 1\)"),
        ({"parameters": (replace(toy.base, typical=(1.0,)),)}, r"base should have shape \(1, 1\), got \(3, 1\)"),
        ({"unknowns": (replace(toy.length, symbol=SX.sym("t", 2)),)}, r"t should have shape \(1, 1\), got \(2, 1\)"),
        ({"closure": (Closure("loop", column),)}, r"loop should have shape \(1, 1\), got \(3, 1\)"),
        ({"quantities": (replace(toy.measure, values=column),)}, r"reach should have shape \(1, 1\), got \(3, 1\)"),
        ({"quantities": (replace(toy.measure, owners=("a", "b")),)}, r"reach should have shape \(2, 1\)"),
        ({"scene": Scene((Point("B", row, Body.BASE),), ())}, r"point B should have shape \(3, 1\)"),
        ({"pose": replace(toy.pose, rotation=SX.sym("R", 9))}, r"pose rotation should have shape \(3, 3\)"),
        ({"pose": replace(toy.pose, position=SX.sym("p", 1, 3))}, r"pose position should have shape \(3, 1\)"),
    ]
    for changed, fault in wrong:
        with pytest.raises(ModelError, match=f"model 'toy': {fault}"):
            toy.model(**changed)


def test_no_wrenches_and_a_drawing_of_what_does_not_exist_are_refused() -> None:
    toy = parts()
    with pytest.raises(ModelError, match="model 'toy': it has no wrenches"):
        toy.model(wrenches=())
    for link, fault in (
        (Link("C", "A", Body.BASE), "a link ends at 'C', which is not a point"),
        (Link("A", "leg", Body.BASE), "a link ends at 'leg', which is not a point"),
        (Link("A", "B", Body.LIMB, "arm"), "a link belongs to limb 'arm', which has no wrench"),
    ):
        with pytest.raises(ModelError, match=fault):
            toy.model(scene=Scene(toy.scene.points, (*toy.scene.links, link)))


@pytest.mark.parametrize(
    "model", [models.stewart_gough(), models.stewart_gough(layout="octahedral"), models.hexapod()], ids=lambda m: m.name
)
def test_shipped_robots_draw_every_leg_between_its_own_joints(model: Model) -> None:
    # Scene points are checked in numbers: the leg from B to A is the line of its row in the Jacobian.
    symbols = [*(item.symbol for item in model.parameters), model.pose.rotation, model.pose.position]
    points = {point.name: point for point in model.scene.points}
    legs = {link.limb: link for link in model.scene.links if link.limb is not None}
    assert tuple(legs) == model.limbs
    rng = np.random.default_rng(0)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for _ in range(5):
        sizes = [np.array(item.typical) * rng.uniform(0.5, 1, size=len(item.typical)) for item in model.parameters]
        numbers = [*sizes, quarter, rng.uniform(20, 30, size=3)]
        for row in model.wrenches:
            link = legs[row.limb]
            ends = [points[link.start].position, points[link.end].position]
            drawn = ca.Function("drawn", symbols, [*ends, row.force, row.moment, row.square])
            b, a, force, moment, square = (part.full().ravel() for part in drawn(*numbers))
            # Coordinates up to 30, moments up to 30 * 60.
            np.testing.assert_allclose(a - b, force, rtol=0, atol=2e-14)
            np.testing.assert_allclose(np.cross(b, force), moment, rtol=0, atol=1e-12)
            np.testing.assert_allclose(square, [force @ force], rtol=1e-14)
            assert (points[link.start].body, points[link.end].body) == (Body.BASE, Body.PLATFORM)


@dataclass(frozen=True)
class Legs:
    """Six legs in numbers, and the same robot as a model whose legs' lengths are unknowns."""

    base: Array
    platform: Array

    def lengths(self, position: Array, R: Array) -> Array:
        return np.asarray(np.linalg.norm(position + self.platform @ R.T - self.base, axis=1))

    def closed(self) -> Model:
        pose = PoseSymbols()
        rows, unknowns, closure = [], [], []
        for i, (b, a) in enumerate(zip(self.base, self.platform, strict=True)):
            t = SX.sym(f"t{i + 1}")
            span = pose.position + pose.rotation @ ca.DM(a) - ca.DM(b)
            rows.append(Wrench(f"{i + 1}", models.WrenchKind.FORCE, span, ca.cross(ca.DM(b), span), t**2))
            unknowns.append(models.Unknown(f"t{i + 1}", t, Dimension.LENGTH, "length of a leg", 1.0, 100.0))
            closure.append(Closure(f"loop{i + 1}", t**2 - ca.sumsqr(span)))
        return Model(
            "closed", "a toy", (), pose, (0, 0, 30), tuple(rows), unknowns=tuple(unknowns), closure=tuple(closure)
        )

    def values(self) -> dict[str, tuple[float, ...]]:
        """Parameters of the shipped hexapod with these joints."""
        plates = (("base", self.base), ("platform", self.platform))
        return {f"{name}_{i + 1}": tuple(joint) for name, plate in plates for i, joint in enumerate(plate.tolist())}


def at(nlp: Nlp, named: Mapping[str, float]) -> Array:
    return np.array([named[variable.name] for variable in nlp.program.variables])


def test_a_robot_given_by_closure_equations_is_the_direct_one_where_they_hold() -> None:
    rng = np.random.default_rng(12)
    for _ in range(10):
        legs = Legs(rng.uniform([-15, -15, -3], [15, 15, 3], (6, 3)), rng.uniform([-8, -8, -3], [8, 8, 3], (6, 3)))
        position, axis, angle = rng.uniform([-5, -5, 20], [5, 5, 40]), rng.normal(size=3), float(rng.uniform(-1, 1))
        task, place = Task(rng.normal(size=6)), position.tolist()
        direct = evaluate(
            formulate(Case(models.hexapod(), legs.values(), place, [task], Rotation(axis, angle))), np.zeros(0)
        )
        nlp = formulate(Case(legs.closed(), {}, place, [task], Rotation(axis, angle)))
        assert [constraint.name for constraint in nlp.program.constraints] == [f"loop{i}" for i in range(1, 7)]
        np.testing.assert_array_equal(nlp.g_lower, np.zeros(6))
        np.testing.assert_array_equal(nlp.g_upper, np.zeros(6))
        np.testing.assert_array_equal(nlp.lower, np.full(6, 1.0))
        np.testing.assert_array_equal(nlp.upper, np.full(6, 100.0))

        lengths = legs.lengths(position, turn_about(axis, angle))
        x = at(nlp, {f"t{i}": length for i, length in enumerate(lengths, start=1)})
        F, g = nlp.evaluate(x)
        state = evaluate(nlp, x)
        # Squares of 30 and more, to some rounding units.
        np.testing.assert_allclose(g, np.zeros(6), rtol=0, atol=4e-15 * float(np.max(lengths)) ** 2)
        assert pytest.approx(direct.F, rel=1e-14) == F
        np.testing.assert_allclose(state.rates, direct.rates, rtol=0, atol=1e-14 * math.sqrt(direct.size))
        np.testing.assert_allclose(state.jacobian, direct.jacobian, rtol=1e-13, atol=1e-13)

        # Elsewhere it is another robot: the unknowns are really in the rows.
        F, g = nlp.evaluate(2 * x)
        assert pytest.approx(direct.F / 4, rel=1e-14) == F
        np.testing.assert_allclose(g, 3 * lengths**2, rtol=1e-14)


def test_the_characteristic_length_means_nothing_to_robots_without_couples() -> None:
    rng = np.random.default_rng(14)
    legs = Legs(rng.uniform(-15, 15, (6, 3)), rng.uniform(-8, 8, (6, 3)))
    for length in (1e-3, 1.0, 1e3):
        case = Case(
            models.hexapod(), legs.values(), (0, 0, 60), [Task((1, 2, 3, 4, 5, 6))], characteristic_length=length
        )
        state = evaluate(formulate(case), np.zeros(0))
        forces = state.jacobian[:, :3]
        np.testing.assert_allclose(np.linalg.norm(forces, axis=1), np.ones(6), rtol=1e-15)
        rates = state.jacobian[:, 3:] @ [1, 2, 3] + forces @ [4, 5, 6]
        assert pytest.approx(float(rates @ rates), rel=1e-13) == state.F


@pytest.mark.parametrize(
    "model", [models.stewart_gough(), models.hexapod(), models.three_upu(axes="tsai"), models.three_upu()]
)
def test_rows_of_a_machine_built_exactly_are_those_of_the_design(model: Model) -> None:
    errors = ca.vertcat(*[error for leg in model.legs for error in (leg.base_error, leg.platform_error)])
    symbols = [ca.vertcat(*[item.symbol for item in model.parameters]), model.pose.rotation, model.pose.position]

    def rows(wrenches: tuple[Wrench, ...]) -> ca.Function:
        parts = [ca.vertcat(row.force, row.moment, row.square) for row in wrenches]
        return ca.Function("rows", [*symbols, errors], [ca.horzcat(*parts)])

    random = np.random.default_rng(1)
    values = [random.normal(size=symbol.shape) for symbol in symbols]
    exact = np.zeros(errors.numel())
    assert rows(model.built)(*values, exact).full() == pytest.approx(rows(model.wrenches)(*values, exact).full())
    off = rows(model.built)(*values, exact + 0.1).full() - rows(model.wrenches)(*values, exact).full()
    assert np.abs(off).max() > 1e-3


def test_legs_and_built_rows_that_fit_no_limb_are_refused() -> None:
    sound = models.stewart_gough()
    with pytest.raises(ModelError, match="leg 'x' needs a wrench of a limb"):
        replace(sound, legs=(*sound.legs, models.Leg("x", SX.zeros(3), SX.zeros(3))))
    with pytest.raises(ModelError, match=r"legs .* must be in the order of their forces"):
        replace(sound, legs=sound.legs[::-1])
    with pytest.raises(ModelError, match="built must have the same limbs and kinds"):
        replace(sound, built=sound.built[1:])
    with pytest.raises(ModelError, match="leg 1- base should have shape"):
        replace(sound, legs=(models.Leg("1-", SX.zeros(2), SX.zeros(3)),))
    with pytest.raises(ModelError, match="expressions contain symbols of no parameter"):
        replace(sound, legs=())


def _fields() -> dict[str, object]:
    annotations = {"a": float, "b": tuple, "c": list, "d": float}
    defaults = {"b": (1.0,), "c": field(default_factory=list, compare=False), "d": field(default=4.0, repr=False)}
    return {"__annotations__": annotations, "__doc__": "Words.", **defaults}


def _pair(*, eq: bool) -> tuple[type, type]:
    kinds = []
    for decorate in (value_class, dataclasses.dataclass):
        make: Callable[..., type] = decorate(frozen=True, eq=eq)  # type: ignore[assignment]
        kinds.append(make(type("Kind", (), _fields())))
    return kinds[0], kinds[1]


@pytest.mark.parametrize("eq", [True, False])
def test_values_are_those_of_a_compiled_dataclass(*, eq: bool) -> None:
    shared, compiled = _pair(eq=eq)
    for places, named in (((1.0,), {}), ((1.0, (2.0,)), {"d": 5.0}), ((), {"c": [3.0], "a": 2.0})):
        one, other = shared(*places, **named), compiled(*places, **named)
        assert vars(one) == vars(other)
        assert repr(one) == repr(other)
        assert vars(replace(one, a=7.0)) == vars(replace(other, a=7.0))
        again = shared(*places, **named)
        assert (one == again, hash(one) == hash(again)) == (eq, eq)
        assert one != other
    assert shared(1.0).c is not shared(1.0).c
    assert (shared(1.0) == shared(1.0, c=[1])) == eq
    assert shared(1.0) != shared(2.0)
    assert inspect.signature(shared).parameters.keys() == inspect.signature(compiled).parameters.keys()
    words = "(a: float, b: tuple = (1.0,), c: list = <class 'list'>, d: float = 4.0) -> None"
    assert str(inspect.signature(shared)) == words


@pytest.mark.parametrize(
    ("places", "named", "words"),
    [
        ((), {}, "missing a required argument: 'a'"),
        ((1, 2, 3, 4, 5), {}, "too many positional arguments"),
        ((1,), {"e": 2}, "unexpected keyword argument 'e'"),
        ((1,), {"a": 2}, "multiple values for argument 'a'"),
    ],
)
def test_wrong_fields_are_refused(places: tuple[int, ...], named: dict[str, int], words: str) -> None:
    shared, compiled = _pair(eq=True)
    with pytest.raises(TypeError, match=words):
        shared(*places, **named)
    with pytest.raises(TypeError):
        compiled(*places, **named)


def test_a_value_is_frozen() -> None:
    for kind in _pair(eq=True):
        value = kind(1.0)
        with pytest.raises(FrozenInstanceError, match="cannot assign to field 'a'"):
            value.a = 2.0
        with pytest.raises(FrozenInstanceError, match="cannot delete field 'a'"):
            del value.a
        assert value.a == 1.0


@value_class(frozen=True)
class Checked:
    """A value that checks itself, and has words of its own."""

    size: float = 1.0

    def __post_init__(self) -> None:
        if self.size < 0:
            raise ValueError("negative")

    def __repr__(self) -> str:
        return f"size {self.size}"


def test_methods_of_the_class_stay_and_values_are_pickled() -> None:
    with pytest.raises(ValueError, match="negative"):
        Checked(-1.0)
    assert repr(Checked(2.0)) == "size 2.0"
    assert pickle.loads(pickle.dumps(Checked(2.0))) == Checked(2.0)  # noqa: S301 - its own bytes


Edge = tuple[str, str]


def simple_paths(edges: list[Edge], node: str, end: str, passed: tuple[str, ...] = ()) -> Iterator[frozenset[int]]:
    """The edges of each path that passes each node once."""
    if node == end:
        yield frozenset()
        return
    for k, edge in enumerate(edges):
        if node in edge and edge[0] != edge[1]:
            other = edge[1] if edge[0] == node else edge[0]
            if other not in (*passed, node):
                for path in simple_paths(edges, other, end, (*passed, node)):
                    yield path | {k}


def test_small_graphs_against_all_their_paths() -> None:
    rng, loops = np.random.default_rng(8), 0
    for _ in range(600):
        n = int(rng.integers(2, 7))
        edges = [(str(one), str(other)) for one, other in rng.integers(n, size=(rng.integers(10), 2))]
        first, last = map(str, rng.permutation(n)[:2])
        paths = list(simple_paths(edges, first, last))
        loops += len(paths) > 1
        assert between(edges, first, last) == sorted(frozenset().union(*paths))
        found, shortest = bridges_between(first, last, edges), path_between(first, last, edges)
        if not paths:
            assert (shortest, found.bridges, found.is_open) == (None, [], False)
            assert last not in reached(first, edges)
            continue
        assert shortest is not None
        assert frozenset(shortest) in paths
        assert len(shortest) == min(map(len, paths))
        every = frozenset.intersection(*paths)
        assert found.bridges == [k for k in shortest if k in every]
        assert found.is_open == (len(paths) == 1 and len(found.bridges) == len(shortest))
    assert loops > 100


class Counted:
    """A node that counts how often it is looked at."""

    looks = 0

    def __init__(self, number: int) -> None:
        self.number = number

    def __hash__(self) -> int:
        Counted.looks += 1
        return hash(self.number)

    def __eq__(self, other: object) -> bool:
        Counted.looks += 1
        return isinstance(other, Counted) and self.number == other.number


def looks_at(count: int, *, is_ring: bool) -> int:
    """How often the nodes of a chain or of a ring are looked at by all searches together."""
    nodes = [Counted(k) for k in range(count)]
    edges = list(pairwise(nodes)) + ([(nodes[-1], nodes[0])] if is_ring else [])
    Counted.looks = 0
    assert len(between(edges, nodes[0], nodes[-1])) == len(edges)
    assert bridges_between(nodes[0], nodes[-1], edges).is_open != is_ring
    assert len(spanning_tree([nodes[0]], edges).branches) == count - 1  # type: ignore[list-item, arg-type]
    return Counted.looks


@pytest.mark.parametrize("is_ring", [False, True])
def test_searches_take_a_number_of_steps_that_grows_linearly(is_ring: bool) -> None:
    assert looks_at(2000, is_ring=is_ring) < 2.2 * looks_at(1000, is_ring=is_ring)
