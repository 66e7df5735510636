"""Random cases certified for a short time: no feasible point of other starts, and no closed pose of ours, is better.

    python bench/soundness/certificates.py COUNT FIRST [JOURNAL]

Straight legs with limits, several poses and tasks are solved again from 32 starts with another seed, and F of the best
point is that of ``legs.py``. Every fourth seed is a robot of the gallery in home's working mode, compared with its own
closed poses (``robots.py``).
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from typing import Any

import numpy as np
from campaign import Row, campaign
from gallery import NAMES, Sampled, random_gallery
from legs import Legs, Poses
from randomcases import limited_legs, random_legs, text_of

from screwsynth.nlp import ScrewsynthError, case_from_tables, certify, certify_program, evaluate, solve

Tables = dict[str, Any]
STARTS, SECONDS, ROUNDING = 32, 1.5, 1e-9


def random_certificate(rng: np.random.Generator) -> Tables:
    """Return a case of straight legs with free dimensions and poses, limits, and one or more tasks and poses."""
    tables = limited_legs(rng, random_legs(rng))
    workspace = tables.pop("workspace")
    tables.pop("tolerance", None)
    tables["limits"].pop("custom", None)  # names of poses change with several of them
    rotation = workspace["rotation"]
    if not {"axis", "angle"} & set(rotation):  # ends of roll, pitch and yaw are no free rotation of a case
        rotation = {"rpy": [rotation.get(name, {"min": 0.0})["min"] for name in ("roll", "pitch", "yaw")]}
    pose: Tables = {"position": workspace["position"], "rotation": rotation}
    several = rng.random() < 0.3
    if several:
        tables["pose"] = [
            pose,
            {"position": [each["min"] if isinstance(each, dict) else each for each in pose["position"]]},
        ]
        if rng.random() < 0.5 and len(tables["task"]) == 1:
            tables["combine"] = {"over_poses": str(rng.choice(["mean", "worst"]))}
    else:
        tables["pose"] = pose
        tables["limits"].pop("actuator", None)
    if len(tables["task"]) > 1:
        tables["combine"] = {"method": str(rng.choice(["weighted-sum", "worst-case"]))}
    parameters = tables["robot"]["parameters"]
    for name in rng.permutation([key for key, each in parameters.items() if isinstance(each, float)])[
        : rng.integers(0, 3)
    ].tolist():
        at = parameters[name]
        parameters[name] = {"min": 0.92 * at, "max": 1.08 * at} if at > 0 else at
    return tables


def of_legs(seed: int, rng: np.random.Generator) -> Row:
    """Certify a random case of straight legs and attack the bounds."""
    tables, counts, faults = random_certificate(rng), Counter[str](), []
    case = case_from_tables(tomllib.loads(text_of(tables)), name=f"random {seed}", source="random")
    poses = "several poses" if isinstance(tables["pose"], list) else "one pose"
    label = f"{tables['robot']['model']}: {len(tables['task'])} tasks, {poses}"
    certified = certify(case, gap=1e-3, time_limit=SECONDS, jobs=1, starts=int(rng.choice([1, 4])), seed=seed)
    other = solve(case, starts=STARTS, seed=seed + 1, jobs=1)
    programs = [(each.own, bound) for each, bound in zip(other.outcomes, certified.tasks, strict=True)]
    if certified.combined is not None and other.decided_by is not None:
        programs.append((other.decided_by, certified.combined))
    for own, certificate in programs:
        counts[f"{label}: {certificate.status.value}"] += 1
        sign = -own.nlp.sign
        feasible = [(sign * each.F, each.x) for each in own.starts if each.violation <= ROUNDING]
        counts["compared" if feasible else "no start feasible"] += 1
        if not feasible:
            continue
        best, x = max(feasible, key=lambda each: each[0])
        size = max(abs(best), 1e-6 * own.nlp.objective_scale)
        if certificate.status.value == "infeasible":
            faults.append(f"infeasible, and a start with F = {best * sign:.12g} keeps all limits")
        elif sign * certificate.bound < best - ROUNDING * size:
            faults.append(f"the bound {certificate.bound:.12g} is beaten by {best * sign:.12g}")
        if len(programs) == 1 and not isinstance(tables["pose"], list):
            faults += recomputed(tables, own.nlp, x, best * sign)
    (first, *_) = programs
    if first[0].nlp.sign > 0 and len(programs) == 1 and "combine" not in tables:
        values = [each.F for each in first[0].starts if each.violation <= ROUNDING]
        above = float(min(values) * rng.choice([0.5, 0.99, 1.01])) if values else 0.0
        proved = certify_program(first[0].nlp, above=above, time_limit=SECONDS, jobs=1)
        counts[f"above: {proved.status.value}"] += 1
        if proved.status.value == "proved" and values and min(values) <= above:
            faults.append(f"F is proved to be above {above:.12g}, and a start has {min(values):.12g}")
    return {"counts": counts, "faults": faults}


def recomputed(tables: Tables, nlp: Any, x: Any, F: float) -> list[str]:  # noqa: ANN401 - the package's values
    """Return a fault where F of a point is not that of its joint centres."""
    state = evaluate(nlp, x)
    unit = Legs({**tables, "robot": numbered(tables, state)}).unit
    robot = numbered(tables, state, unit)
    values = Legs({**tables, "robot": robot, "limits": {}}).values(Poses(state.position[None], state.rotation[None]))
    found = next(each[0] for name, each in values.items() if name.startswith("F"))
    return [] if abs(found - F) <= 1e-8 * abs(F) + 1e-12 else [f"F = {F:.12g}, and that of the legs is {found:.12g}"]


def numbered(tables: Tables, state: Any, unit: float = 1.0) -> Tables:  # noqa: ANN401
    """Return the robot's table with the numbers of a point; angles in the case's unit."""
    given = {}
    for name, each in tables["robot"]["parameters"].items():
        value = state.parameters[name]
        given[name] = (
            value.tolist() if isinstance(each, list) else float(value[0]) / (unit if name in ("x3", "x4") else 1.0)
        )
    return tables["robot"] | {"parameters": given}


def of_gallery(seed: int, rng: np.random.Generator) -> Row:
    """Certify a robot of the gallery with a free pose, and compare with its closed poses."""
    counts, faults = Counter[str](), []
    name = NAMES[(seed // 4) % len(NAMES)]
    tables = random_gallery(rng, name)
    tables.pop("tolerance", None)
    workspace = tables.pop("workspace")
    rotation = workspace["rotation"]
    if "axis" not in rotation:
        largest = max(abs(each[end]) for each in rotation.values() for end in ("min", "max"))
        rotation = {"angle": {"min": -largest, "max": largest}}
    tables["pose"] = {"position": workspace["position"], "rotation": rotation}
    case = case_from_tables(tomllib.loads(text_of(tables)), name=f"random {seed}", source="random")
    certified = certify(case, gap=1e-2, time_limit=3 * SECONDS, jobs=1, starts=4, seed=seed)
    (certificate,) = certified.tasks
    counts[f"{name}: {certificate.status.value}"] += 1
    sampled = Sampled(tables | {"workspace": {"position": workspace["position"], "rotation": rotation}}, rng)
    values, inside = sampled.at(sampled.box.sample(rng, 256), np.zeros((256, *sampled.robot.points_array.shape)))
    counts["compared" if inside.any() else "no closed pose"] += 1
    if inside.any():
        sign = 1.0 if tables["task"][0]["sense"] == "max" else -1.0
        best = float((sign * values["F"][inside]).max())
        if certificate.status.value == "infeasible":
            faults.append(f"{name}: infeasible, and a closed pose has F = {sign * best:.12g}")
        elif sign * certificate.bound < best - 1e-7 * abs(best):
            faults.append(f"{name}: the bound {certificate.bound:.12g} is beaten by {sign * best:.12g}")
    return {"counts": counts, "faults": faults}


def examine(seed: int) -> Row:
    """Certify a random case and attack what is claimed."""
    rng = np.random.default_rng(seed)
    try:
        return of_gallery(seed, rng) if seed % 4 == 3 else of_legs(seed, rng)
    except ScrewsynthError as error:
        return {"counts": {f"refused: {re.sub('[-0-9.e]+', '#', str(error))[:90]}": 1}, "faults": []}


if __name__ == "__main__":
    campaign(examine)
