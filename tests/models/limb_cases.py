"""Cases whose expressions separate into limbs."""

import math

import numpy as np
from builders import case_from

from screwsynth.models import hexapod
from screwsynth.nlp import Case, Free, Rotation, formulate, load_case
from screwsynth.nlp.proof.statement.limb_separation import Separation, separate
from screwsynth.nlp.proof.statement.standard_form import StandardForm, standard_form


def machine(width: float, pose_is_free: bool = False) -> Case:
    """A hexapod whose 36 joint coordinates are free within a width, and whose pose is held or free."""
    parameters: dict[str, object] = {}
    for leg in range(6):
        corner = 2 * math.pi * (leg // 2) / 3
        azimuth = corner + (-1 if leg % 2 == 0 else 1) * math.radians(55)
        for name, radius, angle in (("base", 26.5, corner), ("platform", 11.543, azimuth)):
            point = (radius * math.cos(angle), radius * math.sin(angle), 0.0)
            parameters[f"{name}_{leg + 1}"] = [Free(each - width, each + width) for each in point]
    task = load_case("hexapod-machining").tasks[0]
    if not pose_is_free:
        return Case(hexapod(), parameters, [0.0, 0.0, 20.0], [task])
    position: list[object] = [Free(-3.0, 3.0), Free(-3.0, 3.0), Free(18.0, 22.0)]
    return Case(hexapod(), parameters, position, [task], rotation=Rotation(axis=None, angle=Free(-0.17, 0.17)))


def poses(seed: int) -> Case:
    """A platform at two or three poses that are free, whose dimensions are free too, half of them with limits."""
    rng = np.random.default_rng(seed)
    parameters = {"x1": {"min": 8, "max": 12}, "x2": float(rng.uniform(4, 8)), "x3": 0.3, "x4": 0.2}
    turn = {"rotation": {"axis": [0, 0, 1], "angle": {"min": -0.3, "max": 0.3} if seed % 3 == 0 else 0.1}}
    tables: dict[str, object] = {
        "units": {"angle": "rad"},
        "robot": {"model": "stewart-gough", "parameters": parameters},
        "pose": [
            {"position": [{"min": -2, "max": 2}, float(rng.uniform(-3, 3)), {"min": 25 + k, "max": 31 + k}]} | turn
            for k in range(2 + seed % 2)
        ],
    }
    axis, point = (rng.normal(size=3).tolist() for _ in range(2))
    tables["task"] = [{"name": "t", "sense": ("max", "min")[seed % 2], "axis": axis, "point": point, "pitch": 1}]
    if seed % 4 > 1:
        tables["limits"] = {"leg_length": {"min": 24, "max": 34}, "base_joint_angle": 0.6, "footprint": {"base": 11}}
    return case_from(tables, "poses")


def separated(case: Case) -> tuple[StandardForm, Separation]:
    form = standard_form(formulate(case))
    found = separate(form)
    assert found is not None
    return form, found
