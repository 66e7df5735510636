"""Loops of generated C beside the same program by CasADi's `map`: flash, workspace, stack, instructions and times.

The functions of the loops are the same in both. By maps, CasADi writes the calls in a loop, the tables by which numbers
are gathered, and the products of sparse matrices of the chain rule. The search and everything else is the same C. Both
are compiled and run in turns by the parts of `generated_c.py`. Run by hand:

    .venv/bin/python bench/casadi_maps.py [--solves N]
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import casadi as ca
from generated_c import COUNTED, FLAGS, KINDS, Tables, built, instructions, output, sizes_of, times, versions

from screwsynth.nlp import Case, load_case
from screwsynth.nlp.case.source import find_case
from screwsynth.nlp.embedding import ctext
from screwsynth.nlp.embedding.codegen import _casadi_files, generate_c
from screwsynth.nlp.embedding.ctext import identifier
from screwsynth.nlp.embedding.loops import Loop
from screwsynth.nlp.embedding.runtimelimits import fixed_conditions, run_time_limits
from screwsynth.nlp.embedding.stages import StagedFunctions, _columns, stage_functions
from screwsynth.nlp.embedding.subject import find_subject, magnitude_of

CALLS = """#include "ID.h"
#include "ID-functions.h"
#include "ID-casadi.h"
static int integers[MOST_INTEGERS + 1];
int ID_SQP_derivatives(const double **arg, double **res, double *work) {
    const double *given[MOST_ARG] = {0};
    double *made[MOST_RES] = {0};
    int i;
    for (i = 0; i < 4; ++i) made[i] = res[i];
    given[0] = arg[0], given[1] = arg[1];
    made[4] = work + MOST_DOUBLES, made[5] = made[4] + MOST_SLOTS;
    return ID_CASADI_mapped(given, made, integers, work, 0);
}
int ID_SQP_limits(const double **arg, double **res, double *work) {
    double *made[4] = {0};
    made[2] = res[0], made[3] = res[1];
    return ID_SQP_derivatives(arg, made, work);
}
int ID_SQP_objective(const double **arg, double **res, double *work) {
    double *made[4] = {0};
    made[0] = res[0], made[1] = res[1];
    return ID_SQP_derivatives(arg, made, work);
}
int ID_SQP_curvature_again(const double **arg, double **res, double *work) {
    const double *given[MOST_ARG] = {0};
    double *made[MOST_RES] = {0};
    int i;
    for (i = 0; i < 4; ++i) given[i] = arg[i];
    given[4] = work + MOST_DOUBLES, given[5] = given[4] + MOST_SLOTS;
    made[0] = res[0];
    return ID_CASADI_mapped_curvature(given, made, integers, work, 0);
}
int ID_SQP_curvature(const double **arg, double **res, double *work) {
    double *made[4] = {0};
    return ID_SQP_derivatives(arg, made, work) || ID_SQP_curvature_again(arg, res, work);
}
"""


class Mapped(NamedTuple):
    """Functions by maps: derivatives with slots and their slopes, and the Hessian from these; doubles of slopes."""

    derivatives: ca.Function
    curvature: ca.Function
    slopes: int


def mapped(staged: StagedFunctions, size: tuple[int, int], prefix: str, *, skips: bool) -> Mapped:
    """Return the functions by maps; those that skip test the multipliers of each call."""
    n, c = size
    loops, columns = staged.loops, _columns(staged)
    x, k = ca.MX.sym("x", n), ca.MX.sym("k", staged.prepare.numel_out(0))
    constants_at = staged.prepare.numel_out(0) - loops.constants.numel()
    pattern = sparsity(n, columns)
    # Derivatives of all slots by x, (n, slots).
    objective, gradient, plain, plain_rows, values, first = staged.functions["derivatives"](x, k)
    slopes = ca.MX(sparsity(n, columns[: loops.entries.numel()]), first)
    results: dict[int, tuple[ca.MX, ca.MX]] = {
        place: (plain[i], plain_rows[:, i]) for i, place in enumerate(loops.plain)
    }
    blocks = []
    for index, (loop, own) in enumerate(zip(loops.all, staged.of_loops, strict=True)):
        m, u, r = len(loop.slots), loop.inputs.numel(), loop.values.numel()
        taken, fixed = gathered(loop, values, k, constants_at)
        y, nonzeros = own.values.map(m)(taken, fixed) if m > 1 else own.values(taken, fixed)
        one = ca.Sparsity.triplet(u, r, [i for _, i in own.slopes], [v for v, _ in own.slopes])
        block = ca.MX(ca.Sparsity(ca.DM(ca.diagcat(*[ca.DM.ones(one)] * m)).sparsity()), ca.vec(nonzeros))
        flat = [slot for row in loop.slots for slot in row]
        rows = ca.mtimes(slopes[:, flat], block)
        outputs = [place for row in loop.outputs for place in row]
        if index < len(loops.inner):
            values = ca.vertcat(values, ca.vec(y))
            slopes = ca.horzcat(slopes, rows)
        else:
            dense = ca.densify(rows)
            for j, place in enumerate(outputs):
                results[place] = (ca.vec(y)[j], dense[:, j])
            blocks.append((outputs, ca.vec(y), dense))
    if loops.has_objective:
        objective, gradient = results.pop(c)
    # Constraints in their order: one gather of all.
    order = [*loops.plain, *(place for outputs, _, _ in blocks for place in outputs)]
    kept = [i for place in range(c) for i in [order.index(place)]]
    g = ca.vertcat(plain, *[y for _, y, _ in blocks])[kept]
    all_rows = ca.horzcat(plain_rows, *[rows for _, _, rows in blocks])[:, kept]
    slopes = ca.project(slopes, pattern)
    outputs = [objective, ca.densify(gradient), g, all_rows, values, ca.densify(slopes.nz[:])]
    derivatives = ca.Function(f"{prefix}_mapped", [x, k], outputs)
    return Mapped(derivatives, curvature(staged, size, prefix, pattern, skips=skips), pattern.nnz())


def sparsity(n: int, columns: list[list[int]]) -> ca.Sparsity:
    """Return the pattern (n, slots) of derivatives of slots by the variables."""
    rows = [row for own in columns for row in own]
    return ca.Sparsity.triplet(n, len(columns), rows, [slot for slot, own in enumerate(columns) for _ in own])


def gathered(loop: Loop, values: ca.MX, k: ca.MX, constants_at: int) -> tuple[ca.MX, ca.MX]:
    """Return the inputs (u, m) and the constants (q, m) of the calls of a loop."""
    m = len(loop.slots)
    taken = ca.reshape(values[[s for row in loop.slots for s in row]], loop.inputs.numel(), m)
    places = [constants_at + place for row in loop.constant_places for place in row]
    return taken, ca.reshape(k[places], loop.constants.numel(), m) if places else ca.MX(0, m)


def curvature(
    staged: StagedFunctions, size: tuple[int, int], prefix: str, pattern: ca.Sparsity, *, skips: bool
) -> ca.Function:
    """Return the Hessian from slots and their slopes."""
    loops, (n, c) = staged.loops, size
    x, k, weight, multipliers = (
        ca.MX.sym(name, m)
        for name, m in (("x", n), ("k", staged.prepare.numel_out(0)), ("weight", 1), ("multipliers", c))
    )
    values, nonzeros = ca.MX.sym("values", loops.slot_count), ca.MX.sym("slopes", pattern.nnz())
    constants_at = staged.prepare.numel_out(0) - loops.constants.numel()
    slopes = ca.MX(pattern, nonzeros)
    carried, total = ca.MX.zeros(loops.slot_count), ca.MX.zeros(n, n)
    given = ca.vertcat(multipliers, weight)
    for index, (loop, own) in reversed([*enumerate(zip(loops.all, staged.of_loops, strict=True))]):
        m, u, r = len(loop.slots), loop.inputs.numel(), loop.values.numel()
        taken, fixed = gathered(loop, values, k, constants_at)
        flat, outputs = [s for row in loop.slots for s in row], [p for row in loop.outputs for p in row]
        y = ca.reshape((carried if index < len(loops.inner) else given)[outputs], r, m)
        function, inputs = own.curvature, [taken, fixed, y]
        if skips:
            zeros = ca.Function("zeros", function.sx_in(), [ca.SX.zeros(*function.size_out(i)) for i in (0, 1)])
            function = ca.Function.if_else(f"{function.name()}_or_not", function, zeros)
            inputs = [ca.sum1(y != 0), *inputs]
        gradients, second = function.map(m)(*inputs) if m > 1 else function(*inputs)
        symbol = ca.MX.sym("slots", loops.slot_count)
        carried += ca.jtimes(symbol[flat], symbol, ca.vec(gradients), True)
        if not own.second:
            continue
        rows, others = [a for a, _ in own.second], [b for _, b in own.second]
        halves = ca.DM([0.5 if a == b else 1.0 for a, b in own.second])
        one = ca.Sparsity.triplet(u, u, others, rows)
        block = ca.MX(ca.diagcat(*[ca.DM.ones(one)] * m).sparsity(), ca.vec(second * ca.repmat(halves, 1, m)))
        wide = slopes[:, flat]
        total += ca.densify(ca.mtimes(ca.mtimes(wide, block), wide.T))
    own_weight = ca.MX(0) if loops.has_objective else weight
    lower = [own_weight, ca.vertcat(multipliers[[*loops.plain]], carried[: loops.entries.numel()])]
    function = staged.functions["curvature"]
    if staged.by_direction:
        identity = ca.DM.eye(n)
        hessian = ca.horzcat(*[function(x, k, *lower, ca.densify(identity[:, i])) for i in range(n)])
    else:
        hessian = function(x, k, *lower)
    return ca.Function(
        f"{prefix}_mapped_curvature", [x, k, weight, multipliers, values, nonzeros], [hessian + total + total.T]
    )


def by_maps(case: Case, files: dict[str, str], *, skips: bool) -> dict[str, str]:
    """Return the files of a case with its loops by maps."""
    subject = find_subject(case)
    nlp, prefix = subject.nlp, identifier(case.name)
    staged = stage_functions(nlp.program, magnitude_of(nlp), f"{prefix}_CASADI", fixed_conditions(nlp))
    if not staged.loops or staged.loops.spectra:
        raise SystemExit(f"{case.name}: it has no loops, or limits on singular values, which are not by maps here")
    made = mapped(staged, (nlp.n, len(nlp.program.constraints)), f"{prefix}_CASADI", skips=skips)
    own = [staged.prepare, *staged.functions.values(), made.derivatives, made.curvature]
    others = [*staged.of_robot.values(), *run_time_limits(nlp, f"{prefix}_CASADI").functions]
    # Sparsities are read by products of matrices here.
    sparsities, ctext._SPARSITY = ctext._SPARSITY, re.compile("(?!)")
    casadi = _casadi_files([*own, *others], f"{prefix}_CASADI")
    ctext._SPARSITY = sparsities
    text = casadi[".c"]
    for line in re.findall(r"^static const casadi_int casadi_s\d+\[[^\n]*\n", text, re.MULTILINE):
        table = re.findall(r"casadi_s\d+", line)[0]
        if len(re.findall(rf"\b{table}\b", text)) <= 2:  # its macro and itself
            text = text.replace(line, "")
    doubles, integers = max(each.sz_w() for each in own), max(each.sz_iw() for each in own)
    numbers = {"INTEGERS": integers, "DOUBLES": doubles, "SLOTS": staged.loops.slot_count}
    numbers |= {"ARG": max(each.sz_arg() for each in own), "RES": max(each.sz_res() for each in own)}
    calls = CALLS.replace("ID", prefix)
    for key, number in numbers.items():
        calls = calls.replace(f"MOST_{key}", str(number))
    room = staged.loops.slot_count + made.slopes
    if case.pose_count > 1:  # the robot's inputs at all poses
        room = max(room, case.pose_count * nlp.program.robot.inputs.numel())
    header = files[f"{prefix}.h"]
    more = doubles + room - int(re.findall(r"_WORK (\d+)", header)[0])
    for end, change in (("_WORK", more), ("_SOLVERWORK", more), ("_SOLVERIWORK", integers)):
        header = re.sub(rf"({end}) (\d+)", lambda m, change=change: f"{m[1]} {int(m[2]) + change}", header, count=1)
    api = re.sub(r"made\[0\] = work \+ \w+", f"made[0] = work + {doubles}", files[f"{prefix}.c"])
    changed = {f"{prefix}.h": header, f"{prefix}.c": api, f"{prefix}-loops.c": calls}
    return files | changed | {f"{prefix}-casadi.c": text, f"{prefix}-casadi.h": casadi[".h"]}


def twenty_poses() -> str:
    """Return the shipped case of eight poses with twenty."""
    head, _, rest = find_case("flight-simulator").read_text(encoding="utf-8").partition("[[pose]]")
    turns = [f"rotation = {{ axis = [1, {k % 2}, 0], angle = {k % 7 - 3 or 4} }}" for k in range(20)]
    places = [
        f"position = [{0.03 * (k % 5 - 2):.2f}, {0.02 * (k % 3 - 1):.2f}, {1.5 + 0.015 * k:.3f}]" for k in range(20)
    ]
    poses = "".join(f"[[pose]]\n{place}\n{turn}\n" for place, turn in zip(places, turns, strict=True))
    return head + poses + rest[rest.index("[[task]]") : rest.index("[expect]")]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--solves", type=int, default=1000, help="solves of each kind whose times are measured")
    given = parser.parse_args()
    tables = Tables()
    tables.add(versions(), "")
    with tempfile.TemporaryDirectory() as root:
        (Path(root) / "twenty-poses.toml").write_text(twenty_poses(), encoding="utf-8")
        for name, file in (("hexapod-machining",) * 2, ("twenty-poses", f"{root}/twenty-poses.toml")):
            case = load_case(file)
            files = generate_c(case)
            ways = {
                "loops": files,
                "maps": by_maps(case, files, skips=False),
                "skips": by_maps(case, files, skips=True),
            }
            builds = []
            for version, texts in ways.items():
                folder = Path(root) / name / version
                folder.mkdir(parents=True)
                for file_name, text in texts.items():
                    (folder / file_name).write_text(text, encoding="utf-8")
                builds.append(built(name, version, folder))
                subprocess.run(
                    ["gcc", *FLAGS, *folder.glob("*.o"), folder / "selftest.c", "-lm", "-o", folder / "selftest"],
                    check=True,
                )
                tables.add(output(folder, "./selftest").splitlines()[-1])
            tables.begin("case | version | flash kB | on a Cortex-M7 | workspace kB | stack bound | stack")
            tables.add(*map(sizes_of, builds), "")
            tables.begin("case | version | limits | cold | task | warm")
            for each in builds:
                calls = [instructions(each, "limits", "functions", COUNTED)]
                calls += [instructions(each, "solve", kind, COUNTED) for kind in KINDS]
                tables.add(f"| `{name}` | {each.version} | {' | '.join(f'{call / 1e3:.1f}' for call in calls)} |")
            tables.add("")
            tables.begin("case | version | solves | median | 99.9 % | largest | iterations, mean and largest | OK")
            for kind in KINDS:
                tables.add(*times(builds, kind, given.solves))
            tables.add("")


if __name__ == "__main__":
    main()
