"""Mechanisms and robot files with nested loops, for tests; and the same machines in MuJoCo, written here by hand."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from builders import Array
from mujoco_robots import column_space, left_null_space, null_space, scaled_twists

from screwsynth.models.mechanism import Mechanism

Table = dict[str, Any]


def joint(name: str, kind: str, between: tuple[str, str], at: str, axis: str = "", *, actuated: bool = False) -> Table:
    values: Table = {"name": name, "type": kind, "between": list(between), "at": at}
    return values | ({"axis": axis} if axis else {}) | ({"actuated": True} if actuated else {})


def radial(k: int) -> tuple[str, str]:
    """Unit vectors outwards and around of limb ``k`` of three."""
    angle = f"{k}*2*pi/3"
    return f"(cos({angle})*x + sin({angle})*y)", f"(cos({angle})*y - sin({angle})*x)"


def four_bar_delta(platform: str = "plate") -> Table:
    """Three limbs in which a motor's crank and a coupler turn a rocker with two rods to the platform."""
    links, joints, points = ["ground", platform], [], {}
    for k in range(3):
        r, t = radial(k)
        n = str(k + 1)
        links += [f"{name}{n}" for name in ("crank", "coupler", "rocker", "rod_a", "rod_b")]
        points |= {
            f"O{n}": f"rb*{r}", f"C{n}": f"(rb + 0.05)*{r} + 0.12*z", f"D{n}": f"(rb + 0.3)*{r} + 0.15*z",
            f"M{n}": f"(rb + 0.25)*{r}", f"E{n}": f"(rb + 0.25 + arm)*{r} - 0.1*z", f"A{n}": f"rp*{r} + h*z",
        }  # fmt: skip
        joints += [
            joint(f"motor{n}", "R", ("ground", f"crank{n}"), f"O{n}", t, actuated=True),
            joint(f"knee{n}", "R", (f"crank{n}", f"coupler{n}"), f"C{n}", t),
            joint(f"wrist{n}", "R", (f"coupler{n}", f"rocker{n}"), f"D{n}", t),
            joint(f"pivot{n}", "R", ("ground", f"rocker{n}"), f"M{n}", t),
        ]
        for side, sign in (("a", "+"), ("b", "-")):
            joints += [
                joint(f"upper_{side}{n}", "S", (f"rocker{n}", f"rod_{side}{n}"), f"E{n} {sign} w/2*{t}"),
                joint(f"lower_{side}{n}", "S", (f"rod_{side}{n}", platform), f"A{n} {sign} w/2*{t}"),
            ]
    typical = {"rb": 0.2, "rp": 0.1, "arm": 0.3, "h": -0.8, "w": 0.1}
    return {
        "name": "four-bar delta", "home": [0, 0, "h"],
        "dimensions": {name: {"typical": value} for name, value in typical.items()}, "base": "ground",
        "platform": platform, "links": links, "points": points, "joint": joints,
    }  # fmt: skip


def geared() -> Table:
    """Planar: three driven slides, each with an arm and a fork whose passive hinges a gear couples."""
    links, joints, couplings = ["base", "platform"], [], []
    for k in range(3):
        r, t = radial(k)
        n = str(k + 1)
        links += [f"carriage{n}", f"arm{n}", f"fork{n}"]
        joints += [
            joint(f"slide{n}", "P", ("base", f"carriage{n}"), f"{r}", t, actuated=True),
            joint(f"shoulder{n}", "R", (f"carriage{n}", f"arm{n}"), f"{r}", "z"),
            joint(f"elbow{n}", "R", (f"arm{n}", f"fork{n}"), f"0.7*{r} + 0.3*{t}", "z"),
            joint(f"wrist{n}", "R", (f"fork{n}", "platform"), f"0.35*{r}", "z"),
        ]
        couplings.append({"factors": {f"shoulder{n}": 1.0, f"elbow{n}": -0.4}})
    return {"name": "geared", "links": links, "joint": joints, "coupling": couplings}


class Engine:
    """A mechanism in MuJoCo: every link a free body, every joint a set of rows built on the engine's Jacobians."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        names = [link.name for link in mechanism.links if link.name != mechanism.base]
        body = '<body name="{}"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
        text = f"<mujoco><worldbody>{''.join(body.format(f'b{k}') for k in range(len(names)))}</worldbody></mujoco>"
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.bodies = {name: self.model.body(f"b{k}").id for k, name in enumerate(names)}

    def motion(self, link: str, point: Array) -> Array:
        """Angular velocity and velocity of a link's point, (6, nv)."""
        linear, angular = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        if link in self.bodies:
            mujoco.mj_jac(self.model, self.data, linear, angular, point, self.bodies[link])
        return np.vstack([angular, linear])

    def rows(self, *, locked: bool) -> Array:
        """Constraint rows (m, nv + a) of joints, then of couplings; the last columns are rates of R, P and H."""
        own = [each for each in self.mechanism.joints if each.kind in ("R", "P", "H")]
        column = {each.name: k for k, each in enumerate(own)}
        found = []
        for each in self.mechanism.joints:
            relative = self.motion(each.outer, each.point) - self.motion(each.inner, each.point)
            block = np.hstack([relative, np.zeros((6, len(own)))])
            if each.kind == "S":
                block = block[3:]
            elif each.kind != "weld":
                turn, slide = (np.zeros(3), each.axis) if each.kind == "P" else (each.axis, each.pitch * each.axis)
                block[:, self.model.nv + column[each.name]] = -np.concatenate([turn, slide])
            found.append(block)
            if locked and each.actuated:
                row = np.zeros((1, self.model.nv + len(own)))
                row[0, self.model.nv + column[each.name]] = 1.0
                found.append(row)
        for coupling in self.mechanism.couplings:
            row = np.zeros((1, self.model.nv + len(own)))
            for name, factor in coupling.factors:
                row[0, self.model.nv + column[name]] = factor
            found.append(row)
        return np.vstack(found)

    def platform_twists(self, *, locked: bool) -> Array:
        """Basis (6, f) of the platform's twists, with actuators locked or free."""
        motions = null_space(self.rows(locked=locked))[: self.model.nv]
        return column_space(self.motion(self.mechanism.platform, np.zeros(3)) @ motions, 1.0)

    def rates(self, chi: Array) -> Array:
        """Rates of the actuated joints for a feasible twist; NaN where they can move with the platform at rest."""
        free = null_space(self.rows(locked=False))
        platform = self.motion(self.mechanism.platform, np.zeros(3)) @ free[: self.model.nv]
        weights = np.linalg.lstsq(platform, chi, rcond=1e-9)[0]
        own = [each for each in self.mechanism.joints if each.kind in ("R", "P", "H")]
        driven = [self.model.nv + k for k, each in enumerate(own) if each.actuated]
        idle = free[driven] @ null_space(platform)
        found: Array = free[driven] @ weights
        found[np.linalg.norm(idle, axis=1) > 1e-7] = np.nan
        return found


def without(mechanism: Mechanism, links: set[str]) -> Mechanism:
    """A mechanism without some links, their joints, and the couplings of these."""
    names = {each.name for each in mechanism.joints if not {each.inner, each.outer} & links}
    return Mechanism(
        mechanism.name,
        tuple(each for each in mechanism.links if each.name not in links),
        tuple(each for each in mechanism.joints if not {each.inner, each.outer} & links),
        mechanism.base,
        mechanism.platform,
        tuple(each for each in mechanism.couplings if {name for name, _ in each.factors} <= names),
    )


def projector(twists: Array, centre: Array, length: float) -> Array:
    """``P_k`` in scaled coordinates about a centre from the twists that a member allows."""
    basis = left_null_space(scaled_twists(centre, length) @ twists)
    return np.asarray(basis @ basis.T)
