"""Functions of a program in two stages, and the C text of its loops.

The first stage computes the values that depend only on the arguments, the second computes all other values at each
point. A controller changes the task or a dimension rarely and the point always, so sines of fixed angles and the like
must not be computed at every point.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
from casadi import SX

from ..program.program import Program
from .calls import RobotValues
from .ctext import short_table
from .loops import Loop, Loops, find_loops
from .runtimelimits import FixedConditions

#: Number of operations of a Hessian, without loops, above which C has its product with a direction instead: a third of
#: the code.
_LARGE_HESSIAN = 3000


class LoopFunctions(NamedTuple):
    """Functions of a loop, with only the structural nonzeros of derivatives, and their places.

    Attributes:
        values: function ``(inputs, constants) -> (values, slopes)``.
        curvature: function ``(inputs, constants, multipliers) -> (gradient, second)`` of the sum of values times
            multipliers.
        slopes: indices of value and input of each nonzero of the Jacobian, in the order of the values.
        second: indices of both inputs of each nonzero of the Hessian's lower triangle, row by row; the second is not
            larger.
    """

    values: ca.Function
    curvature: ca.Function
    slopes: tuple[tuple[int, int], ...]
    second: tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class StagedFunctions:
    """Functions of a program in two stages.

    Attributes:
        x: (n, 1) symbols of the free variables.
        prepare: first stage, ``p -> k``: (count, 1) values that depend only on the arguments; the last ones are the
            constants of the loops.
        functions: second stage, by name: functions of ``(x, k)`` and of further inputs, with dense results.
        of_loops: functions of each loop.
        of_robot: for several poses, functions of the robot's inputs at one pose.
        loops: loops of the program.
        by_direction: True if ``curvature`` is the product of the Hessian with a direction.
    """

    x: SX
    prepare: ca.Function
    functions: Mapping[str, ca.Function]
    of_loops: tuple[LoopFunctions, ...]
    of_robot: Mapping[str, ca.Function]
    loops: Loops
    by_direction: bool

    @property
    def all(self) -> tuple[ca.Function, ...]:
        """All functions, the first stage first."""
        of_loops = (function for own in self.of_loops for function in (own.values, own.curvature))
        return (self.prepare, *self.functions.values(), *self.of_robot.values(), *of_loops)


def stage_functions(program: Program, size: SX, prefix: str, held: FixedConditions) -> StagedFunctions:
    """Return the functions that the generated C calls.

    * ``F``, ``F_gradient``: the objective, and the objective with its gradient; absent if a loop computes the objective
      of several poses;
    * ``jacobian``, ``rates``, ``rotation``, ``geometry``, with several tasks or poses ``F_of_tasks``: robot functions
      at one pose. For several poses they are functions of the robot's inputs, which ``poses`` returns for all;
    * ``limits``: constraints with their gradients;
    * ``derivatives``: objective, gradient, constraints, and their gradients;
    * ``curvature``: Hessian of ``weight * F + multipliers . g``, for a weight and multipliers as further inputs;
    * ``magnitude``: size of the objective without cancellation;
    * ``signs``: expressions that are positive in the home assembly mode at every pose; absent without any.
    * ``home``: ``signs`` with their gradients; ``home_curvature``: Hessian of ``multipliers . signs``;
    * ``held``: constraints that the fixed parameters satisfy, and gradients of their equations; absent without any.

    With loops, the constraints here are only the plain ones, ``derivatives`` also returns the entries with the
    structural nonzeros of their gradients, entry by entry, ``limits`` is absent, and ``curvature`` takes a multiplier
    for each entry at the end. A Hessian of very many operations is returned as its product with a direction, one more
    input.

    Matrices are transposed, because CasADi stores them by columns and C by rows.

    Names begin with the prefix; ``size`` is the size of the objective without cancellation, (1, 1).
    """
    x, loops = program.x, find_loops(program)
    several = len(program.robots) > 1
    objective = SX(0) if loops.has_objective else program.objective
    g = ca.vertcat(SX(0, 1), *[program.constraints[place].expression for place in loops.plain])
    gradient, slopes = ca.gradient(objective, x), ca.jacobian(g, x).T
    weight, multipliers = SX.sym("weight"), SX.sym("multipliers", g.numel() + loops.entries.numel())
    direction = SX.sym("direction", x.numel())
    lagrangian = weight * objective + ca.dot(multipliers, ca.vertcat(g, loops.entries))
    hessian = ca.cse(ca.hessian(lagrangian, x)[0])
    inputs = {"curvature": [weight, multipliers]}
    whole = ca.Function("H", [x, program.p, weight, multipliers], [hessian])
    by_direction = bool(loops) and whole.n_instructions() > _LARGE_HESSIAN
    if by_direction:
        hessian = ca.jtimes(ca.gradient(lagrangian, x), x, direction)
        inputs["curvature"].append(direction)
    outputs = {
        "F": [program.objective],
        "F_gradient": [program.objective, ca.gradient(program.objective, x)],
        "limits": [g, slopes],
        "derivatives": [objective, gradient, g, slopes],
        "curvature": [hessian],
        "magnitude": [size],
    }
    signs = ca.vertcat(SX(0, 1), *[robot.signs for robot in program.robots])
    if signs.numel():
        outputs["signs"] = [signs]
        inputs["home_curvature"] = [carried := SX.sym("carried", signs.numel())]
        outputs |= {
            "home": [signs, ca.jacobian(signs, x).T],
            "home_curvature": [ca.hessian(ca.dot(carried, signs), x)[0]],
        }
    if held.items:
        outputs["held"] = [held.values, ca.jacobian(held.values[: held.equations], x).T]
    if loops:
        del outputs["limits"]
        outputs["derivatives"] += [loops.entries, ca.jacobian(loops.entries, x).T.nz[:]]
    if several and loops.has_objective:
        del outputs["F"], outputs["F_gradient"]
    of_robot, robot_inputs = _robot_expressions(program)
    outputs |= {"poses": [ca.veccat(*[robot.inputs for robot in program.robots])]} if several else of_robot
    dense = {name: ca.cse([ca.densify(each) for each in expressions]) for name, expressions in outputs.items()}
    rest, k, prepared = _extract(program.p, [each for expressions in dense.values() for each in expressions])
    k, prepared = ca.vertcat(k, SX.sym("c", loops.constants.numel())), ca.vertcat(prepared, loops.constants)
    functions = {}
    for name, expressions in dense.items():
        own, rest = rest[: len(expressions)], rest[len(expressions) :]
        functions[name] = ca.Function(f"{prefix}_{name}", [x, k, *inputs.get(name, [])], own)
    return StagedFunctions(
        x,
        ca.Function(f"{prefix}_prepare", [program.p], [prepared]),
        functions,
        tuple(_loop_functions(loop, f"{prefix}_loop{i}") for i, loop in enumerate(loops.all)),
        {name: ca.Function(f"{prefix}_{name}", [robot_inputs], own) for name, own in of_robot.items() if several},
        loops,
        by_direction,
    )


def _robot_expressions(program: Program) -> tuple[Mapping[str, list[SX]], SX]:
    """Return the robot's expressions by function, and for several poses the symbols (k, 1) on which they depend.

    The expressions use the program's symbols, or for several poses symbols of one pose.
    """
    robot, inputs = program.robot, SX.sym("inputs", program.robot.inputs.numel())
    if len(program.robots) > 1:
        robot = RobotValues(program.model, program.robot.reference).robot(inputs)
    base = ca.horzcat(SX(3, 0), *[leg.base for leg in robot.legs])
    platform = ca.horzcat(SX(3, 0), *[leg.base + leg.span for leg in robot.legs])
    lengths = ca.vertcat(SX(0, 1), *[ca.norm_2(leg.span) for leg in robot.legs])
    matrix = ca.vertcat(ca.horzcat(robot.rotation, robot.position), SX([[0, 0, 0, 1]]))
    expressions = {
        "jacobian": [robot.jacobian.T],
        "rates": [robot.rates.T],
        "rotation": [robot.rotation.T],
        "geometry": [lengths, base, platform, matrix.T],
    }
    if len(program.robots) > 1 or robot.F.numel() > 1:
        expressions["F_of_tasks"] = [robot.F]
    dense = {name: [ca.densify(each) for each in own] for name, own in expressions.items()}
    return dense, inputs


def _loop_functions(loop: Loop, name: str) -> LoopFunctions:
    """Return the functions of a loop."""
    u, values = loop.inputs, loop.values
    multipliers = SX.sym("multipliers", values.numel())
    hessian, gradient = ca.hessian(ca.dot(multipliers, values), u)
    # CasADi orders nonzeros by columns: those of a transposed matrix are in the order of its rows.
    jacobian, triangle = ca.jacobian(values, u).T, ca.triu(hessian)
    inputs, outputs = jacobian.sparsity().get_triplet()
    others, rows = triangle.sparsity().get_triplet()
    first = ca.cse([ca.densify(values), jacobian.nz[:]])
    second = ca.cse([ca.densify(gradient), triangle.nz[:]])
    return LoopFunctions(
        ca.Function(f"{name}_values", [u, loop.constants], first),
        ca.Function(f"{name}_curvature", [u, loop.constants, multipliers], second),
        tuple(zip(outputs, inputs, strict=True)),
        tuple(zip(rows, others, strict=True)),
    )


def _extract(p: SX, expressions: Sequence[SX]) -> tuple[list[SX], SX, SX]:
    """Replace the parts of expressions that depend only on ``p`` by symbols ``k`` (count, 1).

    Returns:
        Expressions of ``(x, k)``, the symbols, and their values as expressions of ``p``.
    """
    joined = ca.vertcat(SX(0, 1), *[ca.vec(each) for each in expressions])
    rest, symbols, parts = ca.extract_parametric(joined, p)
    # An argument that is also combined with variables, such as a component of a twist, is copied to k unchanged.
    left = [each for each, used in zip(ca.vertsplit(p), ca.which_depends(rest, p, 1, False), strict=True) if used]
    k, prepared = ca.vertcat(SX(0, 1), *left, *symbols), ca.vertcat(SX(0, 1), *left, *parts)
    replaced, at = [], 0
    for each in expressions:
        replaced.append(ca.reshape(rest[at : at + each.numel()], each.shape))
        at += each.numel()
    return replaced, k, prepared


def loop_texts(staged: StagedFunctions, prefix: str) -> dict[str, str]:
    """Return the texts of the placeholders for loops."""
    loops = staged.loops
    rows = ""
    if loops:
        what = "repeated limits, and F over several poses, by loops over functions of `-casadi.c`"
        rows += f"| `{prefix}-loops.c` | {what} |\n"
    if loops.spectra:
        rows += f"| `{prefix}-spectrum.c` | limits on singular values of J, with their derivatives, by loops |\n"
    return {
        "has_loops": str(int(bool(loops))),
        "nspectra": str(len(loops.spectra)),
        "spectrum_lengths": ", ".join(repr(float(each.spectral.length)) for each in loops.spectra),
        "spectrum_kinds": ", ".join(str(each.spectral.end.value) for each in loops.spectra),
        "loop_rows": rows,
        "nentries": str(loops.entries.numel()),
        "nslots": str(loops.slot_count),
        "nplain": str(len(loops.plain)),
        "ninner": str(len(loops.inner)),
        "nloops": str(len(loops.all)),
        "has_objective": str(int(loops.has_objective)),
        "by_direction": str(int(staged.by_direction)),
        "constants_at": str(staged.prepare.numel_out(0) - loops.constants.numel()),
        "loop_tables": _tables(staged),
        "loop_cases": _cases(staged.of_loops),
        **_largest(staged),
        "ncolumns": str(sum(map(len, _columns(staged)))),
        "casadi_work": str(max(1, *(function.sz_w() for function in staged.all))),
        # A different order of operations for eigenvalues, and inverses, lose two more digits.
        "limits_close": "1e-10" if loops.spectra else "1e-12",
    }


def _columns(staged: StagedFunctions) -> list[list[int]]:
    """Return the variables on which each slot depends by structure."""
    entries = staged.loops.entries
    own: list[list[int]] = [[] for _ in range(staged.loops.slot_count)]
    for row, column in zip(*ca.jacobian(entries, staged.x).sparsity().get_triplet(), strict=True):
        own[row].append(column)
    for loop, functions in zip(staged.loops.inner, staged.of_loops, strict=False):
        for slots, outputs in zip(loop.slots, loop.outputs, strict=True):
            for value, place in enumerate(outputs):
                taken = (own[slots[i]] for r, i in functions.slopes if r == value)
                own[place] = sorted({column for columns in taken for column in columns})
    return [sorted(columns) for columns in own]


def _largest(staged: StagedFunctions) -> dict[str, str]:
    """Return the texts for the largest numbers of inputs, values, derivatives and so on of a loop, each at least 1."""
    counts = {"inputs": [1], "constants": [1], "values": [1], "slopes": [1], "second": [1]}
    for loop, own in zip(staged.loops.all, staged.of_loops, strict=True):
        counts["inputs"].append(loop.inputs.numel())
        counts["constants"].append(loop.constants.numel())
        counts["values"].append(loop.values.numel())
        # The workspace of the slopes also holds derivatives with respect to the inputs.
        counts["slopes"].append(max(len(own.slopes), loop.inputs.numel()))
        counts["second"].append(len(own.second))
    return {f"most_{name}": str(max(each)) for name, each in counts.items()}


def _tables(staged: StagedFunctions) -> str:
    """Return the constant tables of slots, constants and outputs."""
    loops = staged.loops
    slots, constants, outputs, slopes, second = tables = [list[int]() for _ in range(5)]
    lines = []
    for loop, own in zip(loops.all, staged.of_loops, strict=True):
        sizes = (len(loop.slots), loop.inputs.numel(), loop.constants.numel(), loop.values.numel())
        counts = (len(own.slopes), len(own.second))
        firsts = (len(slots), len(constants), len(outputs), len(slopes) // 2, len(second) // 2)
        lines.append(", ".join(map(str, (*sizes, *counts, *firsts))))
        slopes.extend(each for pair in own.slopes for each in pair)
        second.extend(each for pair in own.second for each in pair)
        for into, table in ((slots, loop.slots), (constants, loop.constant_places), (outputs, loop.outputs)):
            into.extend(value for row in table for value in row)
    rows = ",\n".join(f"    {{{line}}}" for line in (*lines, ", ".join("0" * 11)))
    names = ("slots", "constant_places", "outputs", "slope_places", "second_places")
    blocks = [short_table(name, table) for name, table in zip(names, tables, strict=True)]
    columns = _columns(staged)
    blocks.append(short_table("first_column", itertools.accumulate(map(len, columns), initial=0)))
    blocks.append(short_table("columns", [each for own in columns for each in own]))
    blocks.append(f"static const loop loops[LOOPS + 1] = {{\n{rows}}};")
    blocks.append(short_table("plain_places", loops.plain))
    if loops.spectra:
        blocks.append(short_table("spectral_places", [each.place for each in loops.spectra]))
        blocks.append(short_table("spectral_slots", [slot for each in loops.spectra for slot in each.slots]))
    return "\n".join(blocks) + "\n"


def _cases(functions: Sequence[LoopFunctions]) -> str:
    """Return the cases of the switch that calls the loops' functions."""
    flat = [function for own in functions for function in (own.values, own.curvature)]
    return "".join(f"    case {i}: return {each.name()}(arg, res, 0, work, 0);\n" for i, each in enumerate(flat))
