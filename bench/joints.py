"""Robots given joint by joint: sizes of their programs, times of an evaluation, and searches from 24 starts.

    python -P bench/joints.py

The pose and two dimensions are free, or three. Instructions are those of CasADi's virtual machine; times are CPU times
on one thread, those of an evaluation the best of five, because the machine may be shared. A search counts as solved
where all its loops are closed, and its point fulfils the program's first-order conditions.
"""

import time
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from screwsynth.models import Model, robot, robot_function
from screwsynth.nlp import Case, Free, Nlp, Rotation, Search, StartStatus, Task, formulate, solve_program

STARTS = 24
TWIST = np.array([0.3, -0.5, 0.7, 0.4, 0.6, -0.2])
#: Bends and angles of the axes of a spherical robot as dimensions; the gallery's has right angles.
SPHERICAL: dict[str, object] = {
    "name": "spherical",
    "dimensions": {
        "base": {"kind": "angle", "typical": 54.7356103172},
        "platform": {"kind": "angle", "typical": 54.7356103172},
        "turn": {"kind": "angle", "typical": 60},
    },
    "limb": [
        {
            "repeat": {"count": 3},
            "points": {
                "a": "sin(base)*x - cos(base)*z",
                "c": "sin(platform)*(cos(turn)*x + sin(turn)*y) + cos(platform)*z",
            },
            "joints": [
                {"type": "R", "at": [0, 0, 0], "axis": "a", "actuated": True},
                {"type": "R", "at": [0, 0, 0], "axis": "unit(cross(a, c))"},
                {"type": "R", "at": [0, 0, 0], "axis": "c"},
            ],
        }
    ],
}
#: Robots by name, and the dimensions that are free.
ROBOTS = {
    "6-ups": ("rb", "rp"),
    "3-rps": ("rb", "rp"),
    "6-rus": ("rb", "rp", "crank"),
    "6-pus": ("rb", "rp"),
    "delta": ("rb", "arm"),
    "delta-parallelogram": ("rb", "arm"),
    "tricept": ("rb", "rp"),
    "spherical": ("base", "platform", "turn"),
    "3-upu": ("rb", "rp"),
}


class Sizes(NamedTuple):
    """Instructions of F, its gradient, the Hessian of the Lagrangian and the loops' Jacobian, and microseconds."""

    instructions: tuple[int, ...]
    microseconds: tuple[float, ...]


def model_of(name: str) -> Model:
    """Return the robot of a row."""
    return robot(**SPHERICAL) if name == "spherical" else robot_function(name)()  # type: ignore[arg-type]


def case_of(name: str, sense: str) -> Case:
    """Return the case of a row: the pose free about home, and some dimensions free about their typical values."""
    model = model_of(name)
    parameters = {
        item.name: Free(0.85 * item.typical[0], 1.15 * item.typical[0])
        if item.name in ROBOTS[name]
        else item.typical[0]
        for item in model.parameters
    }
    size = float(np.linalg.norm(model.home)) or 1.0
    position = [Free(value - 0.15 * size, value + 0.15 * size) for value in model.home]
    twist = np.concatenate([TWIST[:3], TWIST[3:] * size])
    task = Task(twist, sense)  # type: ignore[arg-type]
    return Case(
        model, parameters, position, [task], Rotation(None, Free(-0.35, 0.35)), characteristic_length=0.7 * size
    )


def measure(function: ca.Function, arguments: list[np.ndarray]) -> float:
    """Return the microseconds of one call of a function."""
    buffer, call = function.buffer()
    held = [np.asfortranarray(each, dtype=np.float64) for each in arguments]
    results = [np.zeros(max(1, function.nnz_out(k))) for k in range(function.n_out())]
    for k, each in enumerate(held):
        buffer.set_arg(k, memoryview(each))
    for k, each in enumerate(results):
        buffer.set_res(k, memoryview(each))
    best = float("inf")
    for _ in range(5):
        began = time.process_time()
        for _ in range(200):
            call()
        best = min(best, (time.process_time() - began) / 200)
    return 1e6 * best


def sizes_of(nlp: Nlp) -> Sizes:
    """Return the sizes of a program's functions with its fixed numbers put in."""
    program = nlp.program
    weights = ca.SX.sym("weights", len(program.constraints))
    loops = ca.vertcat(ca.SX(0, 1), *[each.expression for each in program.constraints if each.name.startswith("loop")])
    stacked = [program.objective, program.g, loops]
    F, g, loops = ca.Function("f", [program.x, program.p], stacked).call([program.x, ca.SX(nlp.arguments)])
    lagrangian = F + ca.dot(weights, g)
    outputs = [
        F,
        ca.jacobian(F, program.x),
        ca.triu(ca.hessian(lagrangian, program.x)[0]),
        ca.jacobian(loops, program.x),
    ]
    inputs = [program.x, weights]
    functions = [ca.Function("f", inputs, [each], {"cse": True}) for each in outputs]
    values = [nlp.start, np.ones(weights.numel())]
    times = [measure(each, values) for each in functions[:3]]
    return Sizes(tuple(each.n_instructions() for each in functions), tuple(times))


def search(nlp: Nlp) -> tuple[int, float]:
    """Return how many starts are solved, and milliseconds per start."""
    began = time.process_time()
    found = solve_program(nlp, Search(starts=STARTS), jobs=1)
    seconds = time.process_time() - began
    return sum(start.status is StartStatus.CONVERGED for start in found.starts), 1e3 * seconds / STARTS


def main() -> None:
    """Print both tables."""
    print(f"{'robot':20} unknowns, equations  F / gradient / Hessian / loops      us F / gradient / Hessian   build s")
    programs = {}
    for name in ROBOTS:
        began = time.process_time()
        programs[name] = nlp = formulate(case_of(name, "max"))
        seconds = time.process_time() - began
        sizes = sizes_of(nlp)
        equations = int(np.count_nonzero(nlp.g_lower == nlp.g_upper))
        counts = " / ".join(map(str, sizes.instructions))
        times = " / ".join(f"{each:.3g}" for each in sizes.microseconds)
        unknowns = len(nlp.program.model.unknowns)
        print(f"{name:20} {unknowns:8}, {equations:9}  {counts:32}  {times:26}  {seconds:.2f}", flush=True)
    print(f"\n{'robot':20} max: solved of {STARTS}, ms a start   min: solved, ms a start")
    for name, nlp in programs.items():
        texts = []
        for sense in ("max", "min"):
            solved, milliseconds = search(replace(nlp, sense=case_of(name, sense).tasks[0].sense))
            texts.append(f"{solved:4} {milliseconds:8.1f}")
        print(f"{name:20} {texts[0]:28}   {texts[1]}", flush=True)


if __name__ == "__main__":
    main()
