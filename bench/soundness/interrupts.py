"""Interrupts at random instructions of searches: never a verdict, a bound or a box better than without.

    python bench/soundness/interrupts.py COUNT FIRST [JOURNAL]

Each seed interrupts one kind of search once, at a random instruction of the proofs' Python code; the kinds take turns.
The searches are those of the public names; a case chooses which of them runs.
"""

from __future__ import annotations

import math
import sys
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import copy_context
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import numpy as np
from campaign import Row, campaign

import screwsynth.nlp
from screwsynth.nlp import case_from_tables, certify_program, formulate, judge_workspace, largest_scale

PACKAGE = Path(screwsynth.nlp.__file__).parent
#: The code whose instructions are counted, in turn: the one loop of every search, and all of the proofs.
WATCHED = tuple(
    tuple(str(PACKAGE / each) for each in names)
    for names in (("proof/boxes", "interruption.py"), ("proof", "interruption.py"))
)
TASK = '[[task]]\nname = "one"\nsense = "max"\naxis = [1, 2, 6]\npoint = [3, 1, 12]\npitch = 0.1\n'
PLATFORM = (
    '[robot]\nmodel = "stewart-gough"\nlayout = "octahedral"\nparameters = { x1 = 26.5, x2 = 11.5, x3 = 1, x4 = 5 }\n'
)
BOX = """[workspace]
position = [{ min = -1, max = 1 }, { min = -1, max = 1 }, { min = 19, max = 21 }]
rotation = { angle = { min = -ANGLE, max = ANGLE } }
"""


def platform(limits: str, angle: float = 4, more: str = "") -> str:
    """Return six legs over a workspace."""
    return (
        f"{PLATFORM}[pose]\nposition = [0, 0, 20]\n{TASK}[limits]\n{limits}\n{more}{BOX.replace('ANGLE', str(angle))}"
    )


def gallery(name: str, home: str, values: str, limits: str, more: str = "", angle: float = 2) -> str:
    """Return a robot of the gallery over a small workspace about home."""
    both = f"{{ min = -{angle}, max = {angle} }}"
    turn = f"{{ yaw = {both} }}" if name.startswith("planar") else f"{{ roll = {both}, pitch = {both}, yaw = {both} }}"
    x, y, z = (float(each) for each in home.split(","))
    place = ", ".join(f"{{ min = {each - 0.02}, max = {each + 0.02} }}" for each in (x, y))
    height = str(z) if name.startswith("planar") else f"{{ min = {z - 0.02}, max = {z + 0.02} }}"
    return (
        f'[robot]\nmodel = "{name}"\nparameters = {{ {values} }}\n[pose]\nposition = [{home}]\n'
        '[[task]]\nsense = "max"\naxis = [0, 0, 1]\npoint = [0, 0, 0]\npitch = 0.1\n'
        f"[limits]\n{limits}\n{more}[workspace]\nposition = [{place}, {height}]\nrotation = {turn}\n"
    )


def free(limits: str, poses: str) -> str:
    """Return six legs with free poses and a free radius."""
    return f"{PLATFORM.replace('x1 = 26.5', 'x1 = { min = 24, max = 28 }')}{poses}{TASK}[limits]\n{limits}\n"


def free_joints() -> str:
    """Return six legs whose joint centres are free, at one pose."""
    rows = []
    for k in range(6):
        corner = 2 * math.pi * (k // 2) / 3
        for name, radius, angle in (
            ("base", 26.5, corner),
            ("platform", 11.5, corner + (k % 2 * 2 - 1) * math.radians(55)),
        ):
            place = (radius * math.cos(angle), radius * math.sin(angle), 0.0)
            rows.append(
                f"{name}_{k + 1} = [{', '.join(f'{{ min = {each - 1}, max = {each + 1} }}' for each in place)}]"
            )
    return (
        '[robot]\nmodel = "hexapod"\n[robot.parameters]\n'
        + "\n".join(rows)
        + f"\n[pose]\nposition = [0, 0, 20]\n{TASK}"
    )


#: A range of a position.
SPAN = "{ min = -1, max = 1 }"
#: A position and rotation that are free by little.
POSE = (
    "[pose]\nposition = [{ min = -2, max = 2 }, 0, { min = 19, max = 21 }]\n"
    "rotation = { angle = { min = -5, max = 5 } }\n"
)
HEIGHTS = (19, 21, 23, 25)
SPATIAL = "rb = 1, rp = 0.6, h = 1.1"
CRANKS = "rb = 1, rp = 0.6, base_half = 20, platform_half = 43, crank = 0.35, lift = 35, h = 1.2"
TOLERANCE = "[tolerance]\njoint_centre = JC\n"
CASES: dict[str, tuple[str, str]] = {
    "certificate, whole box": ("certify", free("leg_length = { max = 34 }", POSE)),
    "certificate, independent limbs": ("certify", free_joints()),
    "certificate, shared limbs": (
        "certify",
        free("", "".join(f"[[pose]]\nposition = [{SPAN}, {SPAN}, {{ min = {z}, max = {z + 1} }}]\n" for z in HEIGHTS)),
    ),
    "certificate, infeasible": ("certify", free("leg_length = { max = 19 }", POSE)),
    "above": ("above", free("", POSE).replace('"max"', '"min"')),
    "ranks of legs": ("ranks", platform("", 25)),
    "ranks of legs, singular": ("ranks", platform("", 60)),
    "ranks, closed forms": ("ranks", gallery("6-rus", "0, 0, 1.2", CRANKS, "", angle=9)),
    "ranks, loops": ("ranks", gallery("3-rps", "0, 0, 1.1", SPATIAL, "", angle=9)),
    "limits of loops": ("numbers", gallery("3-rps", "0, 0, 1.1", SPATIAL, "actuator_length = { max = 0.06 }")),
    "smallest values": ("numbers", platform("leg_length = { min = 15, max = 43 }\nleg_clearance = { min = 0.1 }")),
    "singular values": ("numbers", platform("smallest_singular_value = { min = 0.3, length = 11.5 }")),
    "machines of legs": ("numbers", platform("leg_length = { max = 43 }", more=TOLERANCE.replace("JC", "0.01"))),
    "machines of loops": (
        "numbers",
        gallery("3-rps", "0, 0, 1.1", SPATIAL, "actuator_length = { max = 0.2 }", TOLERANCE.replace("JC", "1e-4")),
    ),
    "machines of cranks": ("ranks", gallery("6-rus", "0, 0, 1.2", CRANKS, "", TOLERANCE.replace("JC", "1e-4"))),
    "scale": ("scale", platform("leg_length = { max = 34 }")),
}  # fmt: skip


class Claim(NamedTuple):
    """What a search says: verdicts, numbers that are the larger the more is claimed, and what these may not pass."""

    proved: tuple[bool, ...]
    refuted: tuple[bool, ...]
    bounds: tuple[float, ...]
    most: tuple[float, ...]


@contextmanager
def at_instruction(n: int, watched: tuple[str, ...]) -> Iterator[list[int]]:
    """Raise an interrupt before the n-th instruction of the watched code; gives the number of those that ran."""
    count = [0]

    def local(_: FrameType, event: str, __: object) -> Callable[..., Any]:
        if event == "opcode":
            count[0] += 1
            if count[0] == n:
                raise KeyboardInterrupt
        return local

    def every(frame: FrameType, _: str, __: object) -> Callable[..., Any] | None:
        if not frame.f_code.co_filename.startswith(watched):
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        return local

    sys.settrace(every)
    try:
        yield count
    finally:
        sys.settrace(None)


@cache
def search(kind: str) -> Callable[[], Claim]:
    """Return the search of a kind."""
    command, text = CASES[kind]
    case = case_from_tables(tomllib.loads(text), name="interrupted", source="interrupted")
    if command in ("certify", "above"):
        nlp = formulate(case)
        above = {"above": 0.5 * nlp.evaluate(nlp.start).F} if command == "above" else {}

        def certified() -> Claim:
            found = certify_program(nlp, gap=0.2, jobs=1, **above)
            status = found.status.value
            return Claim(
                (status in ("proved", "infeasible"),),
                (status == "refused",),
                (nlp.sign * found.bound,),
                (nlp.sign * found.incumbent,),
            )

        return certified
    if command == "scale":

        def scaled() -> Claim:
            found = largest_scale(case, time_limit=None)
            most = (found.factor, -found.failed if found.failed else -math.inf)
            return Claim((), (), most, most)

        return scaled

    def judged() -> Claim:
        with_limits = command == "numbers"
        found = judge_workspace(case, gap=0.3, jobs=1, time_limit=None, with_limits=with_limits, with_objective=False)
        ranks = [each.outcome.value for each in (found.regularity, found.constraints) if each is not None]
        values = [each.outcome.value for each in found.extremes]
        every = ranks + values
        bounds, most = (
            tuple((-1 if each.sense.value == "max" else 1) * getattr(each, name) for each in found.extremes)
            for name in ("bound", "reached")
        )
        return Claim(
            tuple(each == "proved" for each in every), tuple(each == "refuted" for each in every), bounds, most
        )

    return judged


@cache
def whole(kind: str, watched: tuple[str, ...]) -> tuple[Claim, int]:
    """Return the claim of a search that nothing interrupts, and the number of its instructions."""
    found = search(kind)()
    with at_instruction(-1, watched) as count:
        search(kind)()
    return found, count[0]


def examine(seed: int) -> Row:
    """Interrupt a search once."""
    rng = np.random.default_rng(seed)
    kind = list(CASES)[seed % len(CASES)]
    watched = WATCHED[seed // len(CASES) % 2]
    claim, instructions = whole(kind, watched)
    # Half of the interrupts come near the beginning or the end.
    part = rng.choice([rng.random(), rng.random(), rng.random() ** 4, 1 - rng.random() ** 4])
    n = 1 + int(part * (instructions - 1))
    try:
        with at_instruction(n, watched):
            found = copy_context().run(search(kind))
    except KeyboardInterrupt:
        return {"counts": {f"{kind}: raised": 1}, "faults": []}
    finally:
        sys.settrace(None)
    faults = []
    if found == claim:
        return {"counts": {f"{kind}: the whole answer": 1}, "faults": []}
    for name, before, after in (("proved", claim.proved, found.proved), ("refuted", claim.refuted, found.refuted)):
        # Claims that an interrupted judgement does not reach are left out; those it has are the first ones.
        if any(a and not b for a, b in zip(after, before, strict=False)) or len(after) > len(before):
            faults.append(f"{kind} at {n}: more is {name} than without")
    past = [a - b for a, b in zip(found.bounds, claim.most, strict=False) if a > b + 1e-9 * abs(b)]
    if past:
        faults.append(f"{kind} at {n}: a bound is beyond the value reached by {max(past):.3g}")
    return {"counts": {f"{kind}: answered": 1}, "faults": faults}


if __name__ == "__main__":
    campaign(examine)
